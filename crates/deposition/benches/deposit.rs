//! Deposition of 100 mm beads at 0.5 mm cells: stamps alone, and levelling on a growing wall of three beads.
#![allow(missing_docs, clippy::expect_used)]

use bead::{BEAD, POOL};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_deposition::deposit::{Deposition, Mode, Settings};
use meltpath_deposition::feed_response::FeedResponse;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};

mod bead;

const SPEED: f64 = 12.5;
const DT: f64 = 0.012;

fn motion(beads: u32) -> Vec<MotionBlock> {
    let n = (100.0 / (SPEED * DT)) as usize + 1;
    (0..beads)
        .map(|b| {
            let y = 4.62 * f64::from(b % 3);
            let position =
                (0..n).map(|i| DVec3::new(SPEED * DT * i as f64, y, 1.8 * f64::from(b / 3)));
            let mut wire = vec![0.153 * 12.0 * DT / 0.012; n];
            wire[0] = 0.0;
            MotionBlock {
                times: Times::Uniform {
                    t0: f64::from(b) * 10.0,
                    dt: DT,
                },
                position: position.collect(),
                speed: vec![SPEED; n],
                axis: vec![],
                wire,
                command: vec![b; n],
                ..MotionBlock::default()
            }
        })
        .collect()
}

fn deposit(c: &mut Criterion) {
    let blocks = motion(6);
    let stamps: usize = blocks.iter().map(MotionBlock::len).sum();
    let mut group = c.benchmark_group("deposit");
    group.throughput(Throughput::Elements(stamps as u64));
    group.sample_size(10);
    let response = FeedResponse {
        reference: 15.0,
        slope: 0.0225,
        limits: (0.65, 1.09),
        measured: (5.47, 15.0),
    };
    for (name, mode, feed_response) in [
        ("plain", Mode::Plain, None),
        ("levelling", Settings::default().mode, None),
        (
            "levelling with feed response",
            Settings::default().mode,
            Some(response),
        ),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| {
                let map = HeightMap::new(DVec2::splat(-10.0), DVec2::new(110.0, 20.0), 0.5, 0.0)
                    .expect("a sensible map");
                let settings = Settings {
                    mode,
                    feed_response,
                    ..Settings::default()
                };
                let mut d = Deposition::new(map, BEAD, POOL, settings).expect("sensible sizes");
                for block in &blocks {
                    d.block(block);
                }
                d.finish().volume
            });
        });
    }
    group.finish();
}

criterion_group!(benches, deposit);
criterion_main!(benches);
