//! Speed of the scan head's chain: samples of one axis, correction table, the whole head on one square (f64; the
//! instruction set is the build's).

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec2;
use meltpath_machine::scan_head::axis::AxisRecord;
use meltpath_machine::scan_head::correction::{Border, CorrectionTable};
use meltpath_machine::scan_head::data;
use meltpath_machine::scan_head::head::{HeadBlock, HeadSink, ScanHead};
use meltpath_machine::scan_head::job::{LaserDelays, Recipe, ScanJob};
use meltpath_machine::scan_head::plate::SquarePlate;

fn head() -> ScanHead {
    data::parse(include_str!("../../../data/scan-heads/three-axis-350.toml"))
        .expect("the head reads")
}

fn job() -> ScanJob {
    let recipe = Recipe {
        name: "1".to_owned(),
        contour_speed: 1500.0,
        fill_speed: 1000.0,
        contour_jump_speed: 4500.0,
        fill_jump_speed: 6000.0,
        contour_power: 300.0,
        fill_power: 300.0,
        jump_wait: 1.5e-3,
        mark_wait: 1.5e-3,
        polygon_wait: 1.5e-3,
        delays: LaserDelays {
            on: 395e-6,
            off: 107e-6,
        },
        sky_writing: None,
    };
    let plate = SquarePlate {
        columns: 1,
        rows: 1,
        column_pitch: 23.0,
        row_pitch: 17.0,
        side: 10.0,
        contour_distance: 0.1,
        hatch: 0.1,
        inset: 0.23,
    };
    plate.job(&recipe).expect("the job is sound")
}

struct Count(u64);

impl HeadSink for Count {
    fn block(&mut self, block: &HeadBlock) {
        self.0 += block.len() as u64;
    }
}

fn chain(c: &mut Criterion) {
    let head = head();
    let ready = head.ready().expect("the head is sound");
    let job = job();
    let mut blocks: Vec<HeadBlock> = Vec::new();
    let delays = LaserDelays {
        on: 395e-6,
        off: 107e-6,
    };
    let summary = ready
        .run(&job, delays, 1, &Silent, &mut blocks)
        .expect("the head runs");

    let mut group = c.benchmark_group("scan head");
    group.sample_size(10);
    group.throughput(Throughput::Elements(3 * summary.samples));
    group.bench_function("one square, three axes (axis-samples)", |b| {
        b.iter(|| {
            let mut count = Count(0);
            ready
                .run(&job, delays, 1, &Silent, &mut count)
                .expect("the head runs");
            count.0
        });
    });
    for (name, axis, column) in [
        ("x axis, one mode", &head.mirrors[0], 0),
        (
            "z axis, two modes",
            &head.focus.as_ref().expect("a focus").0,
            2,
        ),
    ] {
        group.throughput(Throughput::Elements(summary.samples));
        group.bench_function(name, |b| {
            b.iter(|| {
                let start = blocks[0].set_points[column][0];
                let mut running = axis
                    .start(head.period, start, 1)
                    .expect("the axis is sound");
                let mut record = AxisRecord::default();
                for block in &blocks {
                    running
                        .block(&block.set_points[column], &mut record)
                        .expect("it runs");
                }
                record.angle.len()
            });
        });
    }
    group.finish();

    let travel = DVec2::splat(10f64.to_radians());
    c.bench_function("correction table 65 x 65 with focus", |b| {
        b.iter(|| {
            CorrectionTable::new(
                &head.geometry,
                ready.focus(),
                175.0,
                65,
                travel,
                Border::Extrapolate,
            )
            .expect("the field is within reach")
        });
    });
}

criterion_group!(benches, chain);
criterion_main!(benches);
