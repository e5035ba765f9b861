//! Samples a second of the streaming interpolation, one thread: long lines, short chords, circular moves.

#![expect(clippy::expect_used, reason = "a bench may fail")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::Silent;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_robot::{Command, Controller, Kind, Smoothing, Source, simulate};
use meltpath_toolpath::{MotionBlock, MotionSink};

/// Looks at every block, keeps nothing.
struct Sum(f64);

impl MotionSink for Sum {
    fn block(&mut self, block: &MotionBlock) {
        self.0 += block.wire.iter().sum::<f64>() + block.position[0].x;
    }
}

fn circle(radius: f64, degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(radius * cos, radius * sin, 0.0)
}

fn command(i: u32, target: DVec3) -> Command {
    Command {
        source: Source::On { wire_feed: 150.0 },
        ..Command::line(i, target, 12.5, Smoothing::Cnt(0.5))
    }
}

fn benchmark(c: &mut Criterion) {
    let text = meltpath_data::cells::ARCMATE_120IC.text;
    let controller = meltpath_base::settings::peek::<Controller>(text, &["motion"])
        .expect("the shipped cell reads")
        .expect("it is written");
    let lines = (1..200).map(|i| {
        command(
            i,
            DVec3::new(f64::from(i % 2) * 150.0, f64::from(i) * 4.0, 0.0),
        )
    });
    let chords = (1..60_000).map(|i| command(i, circle(30.0, f64::from(i) * 0.95)));
    let arcs = (1..600).map(|i| Command {
        kind: Kind::Arc {
            via: circle(30.0, f64::from(i) * 90.0 - 45.0),
        },
        ..command(i, circle(30.0, f64::from(i) * 90.0))
    });
    let mut group = c.benchmark_group("fir");
    for (name, commands) in [
        ("lines of 150 mm", lines.collect::<Vec<_>>()),
        ("chords of 0.5 mm", chords.collect()),
        ("circular moves", arcs.collect()),
    ] {
        let start = Pose {
            position: circle(30.0, 0.0),
            orientation: commands[0].orientation,
        };
        let run = || {
            let mut sum = Sum(0.0);
            simulate(
                start,
                &commands,
                &controller,
                controller.sampling(),
                &Silent,
                &mut sum,
            )
        };
        let samples = run().expect("the bench simulates").samples;
        group.throughput(Throughput::Elements(samples));
        group.sample_size(10);
        group.bench_function(name, |b| b.iter(run));
    }
    group.finish();
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
