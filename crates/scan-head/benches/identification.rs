//! Motor and flexible mode from a bench record of 4.5 s at 20 kHz (asked: 2 s for the whole identification).
#![expect(
    clippy::expect_used,
    reason = "a benchmark of data that ships stops where it does not read"
)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_control::prbs::Prbs;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::axis::galvanometer::Galvanometer;
use meltpath_scan_head::axis::plant::Plant;
use meltpath_scan_head::files;
use meltpath_scan_head::identification::modes::{ModeSearch, identify_modes};
use meltpath_scan_head::identification::prediction::predict;
use meltpath_scan_head::identification::record::{BenchRecord, Excitation, Method};

const PERIOD: f64 = 50e-6;
const SAMPLES: usize = 90_000;

fn identification(c: &mut Criterion) {
    let head =
        files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text).expect("the head reads");
    let motor = Galvanometer {
        friction: Friction::None,
        ..head.head.mirrors[1]
            .driven()
            .expect("a head with its motors")
            .motor
            .clone()
    };
    let mut plant = Plant::<5>::new(&motor, &[PERIOD], 0.0).expect("the motor runs");
    let voltage = Prbs::new(13)
        .expect("a register of 13 stages exists")
        .signal(0.5, 1, SAMPLES);
    let (mut current, mut angle) = (Vec::new(), Vec::new());
    for &u in &voltage {
        current.push(plant.current());
        angle.push(plant.angle());
        plant.advance(0, u, 0.0);
    }
    let record = BenchRecord {
        period: PERIOD,
        voltage: &voltage,
        current: &current,
        angle: &angle,
    };
    let (method, search) = (Method::at(PERIOD), ModeSearch::default());
    let mut group = c.benchmark_group("identification");
    group.sample_size(10);
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.bench_function("motor and mode from 90 000 samples, then predicted", |b| {
        b.iter(|| {
            let found = identify_modes(&record, Excitation::Voltage, &method, &search)
                .expect("the record holds a motor");
            predict(&found.motor, [0.0; 2], &record, 2 * SAMPLES / 3).expect("the motor runs")
        });
    });
    group.finish();
}

criterion_group!(benches, identification);
criterion_main!(benches);
