//! Chart simulation in single precision, plain x86-64 instructions: the thesis' line of 3 mm and its triangle on one
//! thread and on all; elements are voxels times steps. And a set of charts (reference solver, widest registers, f32).
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::chart::{ChartSet, ChartSettings};
use meltpath_thermal::chart_build::compute;
use meltpath_thermal::chart_simulation::{ChartSimulation, Settings};
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::material_file::{Readings, read};
use meltpath_thermal::solver::State;

fn titanium() -> Material {
    let text = include_str!("../../../data/materials/ti6al4v-ebm.toml");
    read(text, Readings::default()).unwrap()
}

fn fast() -> ChartSettings {
    ChartSettings {
        stop: 3700.0 + CELSIUS,
        ..ChartSettings::of_thesis(60e3, 5e-3, 4e-3, 0.413_67)
    }
}

fn start(current: f64, focus: f64) -> BeamPoint {
    BeamPoint {
        time: 0.0,
        x: 0.0,
        y: 0.0,
        voltage: 60e3,
        current,
        focus,
        on: true,
    }
}

fn simulation(set: &ChartSet, low: DVec3, high: DVec3, edge: f64) -> ChartSimulation {
    let grid = Grid::covering(low, high, DVec3::new(edge, edge, 0.05)).unwrap();
    let material = titanium();
    let settings = Settings::of(&material);
    let mut simulation =
        ChartSimulation::new(&grid, material, vec![set.clone()], settings).unwrap();
    simulation.set_state(|c| {
        if c.z > -0.05 {
            State::Powder
        } else {
            State::Dense
        }
    });
    simulation
}

fn triangle() -> BeamPath {
    let corners: Vec<[f64; 2]> = (0..60)
        .flat_map(|n| {
            let y = (f64::from(n) + 0.5) * 0.125;
            let half = 8.75 * (1.0 - y / 7.5);
            let ends = [[-half, y], [half, y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    BeamPath::along(&corners, 980.0, start(5e-3, 4e-3)).unwrap()
}

fn benches(c: &mut Criterion) {
    let material = titanium();
    let mut group = c.benchmark_group("chart_simulation_f32");
    group.sample_size(10);
    let slow = compute(
        &ChartSettings::of_thesis(60e3, 2e-3, 0.0, 0.551_67),
        &material,
        &Silent,
    )
    .unwrap();
    let line = BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 400.0, start(2e-3, 0.0)).unwrap();
    let low = DVec3::new(-0.25, -0.25, -0.35);
    let ready = simulation(&slow, low, DVec3::new(3.25, 0.25, 0.0), 0.048);
    group.throughput(Throughput::Elements(ready.grid().len() as u64 * 3000));
    group.bench_function("line of 3 mm, all threads", |b| {
        b.iter(|| ready.clone().draw(&line, &[], &mut |_, _| (), &Silent));
    });
    let quick = compute(&fast(), &material, &Silent).unwrap();
    let path = triangle();
    let low = DVec3::new(-9.25, -0.5, -0.35);
    let ready = simulation(&quick, low, DVec3::new(9.25, 8.0, 0.0), 0.061);
    let steps = (path.end() / 2.5e-6) as u64;
    group.throughput(Throughput::Elements(ready.grid().len() as u64 * steps));
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        group.bench_function(
            format!("triangle, {} voxels, {threads} threads", ready.grid().len()),
            |b| {
                b.iter(|| pool.install(|| ready.clone().draw(&path, &[], &mut |_, _| (), &Silent)));
            },
        );
    }
    group.throughput(Throughput::Elements(1));
    group.bench_function("charts of 5 mA, 25 µm, to 3700 °C", |b| {
        b.iter(|| compute(&fast(), &material, &Silent).unwrap());
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
