//! Speed of the scan head's chain: samples of one axis, correction table, the whole head on one square (f64; the
//! instruction set is the build's).

#![expect(
    clippy::expect_used,
    reason = "a benchmark of data that ships stops where it does not read"
)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec2;
use meltpath_scan_head::axis::chain::AxisRecord;
use meltpath_scan_head::head::block::{HeadBlock, HeadSink};
use meltpath_scan_head::head::recipe::LaserDelays;
use meltpath_scan_head::optics::correction::CorrectionTable;

#[path = "../tests/all/reference.rs"]
#[allow(dead_code, clippy::unwrap_used, reason = "the tests' own")]
mod reference;

struct Count(u64);

impl HeadSink for Count {
    fn block(&mut self, block: &HeadBlock) {
        self.0 += block.len() as u64;
    }
}

fn chain(c: &mut Criterion) {
    let reference::HeadData { head, plate, .. } = reference::three_axis_data();
    let ready = head.ready().expect("the head is sound");
    let [industrial, ..] = reference::recipes();
    let job = reference::job_of(&reference::one(plate), &industrial);
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
        (
            "x axis, one mode",
            head.mirrors[0].driven().expect("its motor"),
            0,
        ),
        (
            "z axis, two modes",
            head.focus
                .as_ref()
                .and_then(|f| f.0.driven())
                .expect("a focus with its motor"),
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
            CorrectionTable::new(&head.geometry, ready.focus(), 175.0, 65, travel)
                .expect("the field is within reach")
        });
    });
}

criterion_group!(benches, chain);
criterion_main!(benches);
