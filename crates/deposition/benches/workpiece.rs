//! Beads in voxels of 0.5 mm: stamps alone, and levelling on a growing wall of three beads, upright and along a turned axis.
#![allow(missing_docs, clippy::expect_used)]

use bead::{BEAD, POOL};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use meltpath_deposition::deposit::{Mode, Settings};
use meltpath_deposition::workpiece::Laying;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};
use meltpath_geometry::shapes::cuboid;
use meltpath_geometry::workpiece::Voxels;
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};

mod bead;

/// Travel of a sample, mm: a little less than the longest stamp, so that each is one.
const STEP: f64 = 0.1499;

/// Beads of 100 mm, one stamp a sample.
fn motion(turn: DMat3) -> Vec<MotionBlock> {
    let n = 668;
    (0..6)
        .map(|b| {
            let y = 4.62 * f64::from(b % 3);
            let along = (0..n).map(|i| STEP * f64::from(i));
            let position = along
                .map(|x| turn * DVec3::new(x, y, 1.8 * f64::from(b / 3)))
                .collect();
            let count = n as usize;
            let mut wire = vec![STEP * BEAD.area / BEAD.wire_section; count];
            wire[0] = 0.0;
            MotionBlock {
                times: Times::Uniform {
                    t0: f64::from(b) * 10.0,
                    dt: 0.012,
                },
                position,
                axis: vec![turn.z_axis; count],
                wire,
                command: vec![b as u32; count],
                ..MotionBlock::default()
            }
        })
        .collect()
}

/// A plate under the beads, as a slab along the turned frame.
fn plate(turn: DMat3) -> Voxels {
    let mut mesh = cuboid(DVec3::new(-15.0, -12.0, -4.0), DVec3::new(115.0, 22.0, 0.0));
    for vertex in &mut mesh.vertices {
        *vertex = turn * *vertex;
    }
    let (lo, hi) = mesh.bounds().expect("corners");
    let mut voxels =
        Voxels::new(lo - DVec3::splat(10.0), hi + DVec3::splat(10.0), 0.5).expect("a box");
    voxels.fill_mesh(&mesh).expect("a plate");
    voxels
}

fn workpiece(c: &mut Criterion) {
    let mut group = c.benchmark_group("workpiece");
    group.sample_size(10);
    let turned = DMat3::from_quat(DQuat::from_axis_angle(
        DVec3::new(1.0, -2.0, 0.7).normalize(),
        0.9,
    ));
    for (frame, turn) in [("upright", DMat3::IDENTITY), ("turned", turned)] {
        let blocks = motion(turn);
        let stamps: usize = blocks.iter().map(|b| b.len() - 1).sum();
        group.throughput(Throughput::Elements(stamps as u64));
        let bare = plate(turn);
        for (name, mode) in [
            ("plain", Mode::Plain),
            ("levelling", Settings::default().mode),
        ] {
            group.bench_function(format!("{name} {frame}"), |b| {
                b.iter_batched(
                    || bare.clone(),
                    |voxels| {
                        let settings = Settings {
                            mode,
                            ..Settings::default()
                        };
                        let mut d =
                            Laying::new(voxels, BEAD, POOL, settings).expect("sensible sizes");
                        for block in &blocks {
                            d.block(block);
                        }
                        d.finish()
                    },
                    BatchSize::LargeInput,
                );
            });
        }
    }
    group.finish();
}

criterion_group!(benches, workpiece);
criterion_main!(benches);
