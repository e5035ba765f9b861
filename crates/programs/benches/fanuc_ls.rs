//! Points a second of building, writing, parsing and executing a long program, one thread.

#![expect(clippy::expect_used, reason = "a bench may fail")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::{Ratio, Reporter};
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::Dialect;
use meltpath_programs::{
    BuildSettings, CellProgramming, ExecutionSettings, Pause, build, fanuc_ls, read_toolpath,
};
use meltpath_toolpath::{Layer, PassHead, Profile, Toolpath};

const POINTS: u32 = 100_000;

fn benchmark(c: &mut Criterion) {
    let text = meltpath_data::cells::ARCMATE_120IC.text;
    let mut cell = meltpath_base::settings::peek::<CellProgramming>(text, &["program"])
        .expect("the shipped cell reads")
        .expect("it is written");
    cell.lines_per_program.value = 1_000_000;
    cell.points_per_program.value = 1_000_000;
    let points = (0..POINTS)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * 0.01).sin_cos();
            DVec3::new(50.0 * cos, 50.0 * sin, f64::from(i) * 1e-3)
        })
        .collect::<Vec<_>>();
    let mut layer = Layer::new(1, 0.0);
    layer.polyline(PassHead::default(), points);
    let toolpath = Toolpath {
        profiles: vec![Profile {
            speed: 12.5,
            wire_feed: 133.3,
            height: 2.0,
            ..Profile::default()
        }],
        layers: vec![layer],
        ..Toolpath::default()
    };
    let settings = BuildSettings {
        name: "bench".to_owned(),
        comment: String::new(),
        dialect: Dialect::FanucLs,
        smoothing: Ratio(0.5),
        pause: Pause::None,
        from: None,
        variant: String::new(),
        standing: None,
    };
    let reporter = Reporter::new();
    let make = || build(&toolpath, &cell, &settings, &reporter).expect("the bench builds");
    let built = make();
    let text = fanuc_ls::write(&built.programs[0]).expect("the bench writes");
    let parsed = fanuc_ls::parse(&text).expect("the bench parses").program;
    let mut group = c.benchmark_group("fanuc_ls");
    group.sample_size(10);
    group.throughput(Throughput::Elements(u64::from(POINTS)));
    group.bench_function("build", |b| b.iter(make));
    group.bench_function("write", |b| b.iter(|| fanuc_ls::write(&built.programs[0])));
    group.bench_function("parse", |b| b.iter(|| fanuc_ls::parse(&text)));
    group.bench_function("execute", |b| {
        let programs = [parsed.clone()];
        b.iter(|| read_toolpath(&programs, &ExecutionSettings::default(), 1e3, &reporter));
    });
    group.finish();
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
