//! Chart simulation in single precision, plain x86-64 instructions: the thesis' line of 3 mm and its triangle on one
//! thread and on two, with and without a memory of the ground; elements are voxels times steps. What it costs by how many
//! voxels are under the beam: the same line on voxels of half the edge (four times as many), and twice the line (elements are
//! voxels under the beam times steps). And a set of charts (reference solver, widest registers, f32).
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::charts::build::{compute, warm, warm_grounds};
use meltpath_thermal::charts::simulation::{ChartSimulation, Memory, Settings};
use meltpath_thermal::charts::{ChartSet, ChartSettings};
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::material::medium::Body;

#[path = "../tests/all/support.rs"]
mod support;
use support::{fresh_layer, titanium};

fn fast() -> ChartSettings {
    ChartSettings {
        stop: 3700.0 + CELSIUS,
        ..ChartSettings::for_beam(300.0, 0.413_67)
    }
}

fn start(power: f64, spot: f64) -> BeamPoint {
    BeamPoint::start(power, spot)
}

fn simulation(
    set: &ChartSet,
    low: DVec3,
    high: DVec3,
    edge: f64,
    memory: Memory,
) -> ChartSimulation {
    let grid = Grid::covering(low, high, DVec3::new(edge, edge, 0.05)).unwrap();
    let material = titanium();
    let settings = Settings {
        memory,
        ..Settings::of(&material)
    };
    let mut simulation =
        ChartSimulation::new(&grid, material, vec![set.clone()], settings).unwrap();
    simulation.set_state(fresh_layer);
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
    BeamPath::along(&corners, 980.0, start(300.0, 0.413_67)).unwrap()
}

fn benches(c: &mut Criterion) {
    let material = titanium();
    let mut group = c.benchmark_group("chart_simulation_f32");
    group.sample_size(10);
    let slow = compute(
        &ChartSettings::for_beam(120.0, 0.551_67),
        &material,
        &Silent,
    )
    .unwrap();
    let line = BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 400.0, start(120.0, 0.551_67)).unwrap();
    let low = DVec3::new(-0.25, -0.25, -0.35);
    let ready = simulation(&slow, low, DVec3::new(3.25, 0.25, 0.0), 0.048, Memory::None);
    group.throughput(Throughput::Elements(ready.grid().len() as u64 * 3000));
    group.bench_function("line of 3 mm, all threads", |b| {
        b.iter(|| ready.clone().draw(&line, &[], &mut |_, _| (), &Silent));
    });
    // the disc of the heated zone: 1.4 beam diameters across, seven planes
    let radius = 0.7 * 0.551_67_f64;
    for (length, edge) in [(3.0, 0.096), (3.0, 0.048), (6.0, 0.048)] {
        let line =
            BeamPath::along(&[[0.0, 0.0], [length, 0.0]], 400.0, start(120.0, 0.551_67)).unwrap();
        let low = DVec3::new(-0.5, -0.5, -0.35);
        let high = DVec3::new(length + 0.5, 0.5, 0.0);
        let ready = simulation(&slow, low, high, edge, Memory::None);
        let active = 7.0 * std::f64::consts::PI * radius * radius / (edge * edge);
        let steps = line.end() / 2.5e-6;
        group.throughput(Throughput::Elements((active * steps) as u64));
        let name = format!("line of {length} mm, {active:.0} voxels under the beam, 1 thread");
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        group.bench_function(name, |b| {
            b.iter(|| pool.install(|| ready.clone().draw(&line, &[], &mut |_, _| (), &Silent)));
        });
    }
    let mut quick = compute(&fast(), &material, &Silent).unwrap();
    warm(&mut quick, &warm_grounds(&material), &material, &Silent).unwrap();
    let path = triangle();
    let low = DVec3::new(-9.25, -0.5, -0.35);
    let steps = (path.end() / 2.5e-6) as u64;
    for (words, memory) in [
        ("", Memory::None),
        (
            " with memory",
            Memory::Ground(Body::Cooled { thickness: 0.5 }),
        ),
    ] {
        let ready = simulation(&quick, low, DVec3::new(9.25, 8.0, 0.0), 0.061, memory);
        group.throughput(Throughput::Elements(ready.grid().len() as u64 * steps));
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            group.bench_function(
                format!(
                    "triangle{words}, {} voxels, {threads} threads",
                    ready.grid().len()
                ),
                |b| {
                    b.iter(|| {
                        pool.install(|| ready.clone().draw(&path, &[], &mut |_, _| (), &Silent))
                    });
                },
            );
        }
    }
    group.throughput(Throughput::Elements(1));
    group.bench_function("charts of 5 mA, 25 µm, to 3700 °C", |b| {
        b.iter(|| compute(&fast(), &material, &Silent).unwrap());
    });
    group.bench_function("the same over warm ground too", |b| {
        b.iter(|| {
            let mut set = compute(&fast(), &material, &Silent).unwrap();
            warm(&mut set, &warm_grounds(&material), &material, &Silent).unwrap();
            set
        });
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
