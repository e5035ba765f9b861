//! Time a place of a way takes to be paced under limits of speed and acceleration; every axis is asked for more than it can do every so often.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_robot::cell::AXES;
use meltpath_robot::kinematics::Limits;
use meltpath_robot::pacing::{Asked, rates};

const COUNT: u32 = 100_000;
const STEP: f64 = 0.004;

fn limits(c: &mut Criterion) {
    let mut group = c.benchmark_group("limits");
    group.throughput(Throughput::Elements(u64::from(COUNT)));
    for axes in [6, AXES] {
        let row = |i: u32| {
            let t = f64::from(i) * STEP;
            std::array::from_fn(|axis| match axis {
                _ if axis < axes => 0.4 * ((0.5 + 0.2 * axis as f64) * t).sin(),
                _ => 0.0,
            })
        };
        let rows: Vec<[f64; AXES]> = (0..COUNT).map(row).collect();
        let limit = Limits {
            low: -10.0,
            high: 10.0,
            speed: Some(0.15),
            acceleration: Some(0.5),
        };
        let limits = std::array::from_fn(|axis| (axis < axes).then_some(limit));
        let asked = Asked {
            rows: &rows,
            step: STEP,
            beside: [0, 0],
            limits: &limits,
        };
        group.bench_function(format!("{axes} axes"), |b| b.iter(|| rates(&asked)));
    }
    group.finish();
}

criterion_group!(benches, limits);
criterion_main!(benches);
