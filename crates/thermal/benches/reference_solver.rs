//! Cell updates per second of the reference solver on one core, with latent heat and temperature-dependent laws:
//! a single track as it is computed (most cells solid, some powder), and the worst case where every cell is molten.
//! Elements are cell updates; the names carry the precision and the instructions.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_geometry::math::DVec3;
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::numeric::real::Real;
use meltpath_thermal::solver::Solver;
use meltpath_thermal::solver::source::{Depth, Spot};

#[path = "../tests/all/support.rs"]
mod support;
use support::{faces, fresh_layer, titanium};

fn solver<R: Real>() -> Solver<R> {
    let material = titanium();
    let grid = Grid::covering(
        DVec3::new(-0.6, -0.8, -0.5),
        DVec3::new(2.6, 0.8, 0.0),
        DVec3::new(0.025, 0.025, 0.025),
    )
    .unwrap();
    let faces = faces(&material);
    let mut solver = Solver::new(grid, material, faces).unwrap();
    solver.set_state(fresh_layer);
    solver
}

fn spot(x: f64) -> Spot {
    Spot {
        centre: [x, 0.0],
        diameter: 0.4137,
        power: 0.9 * 300.0,
        depth: Depth::Falling { penetration: 0.1 },
    }
}

/// A track half drawn.
fn track<R: Real>() -> Solver<R> {
    let mut solver = solver::<R>();
    let mut x = 0.0;
    while x < 1.0 {
        solver.step(1.5e-6, &[spot(x)]).unwrap();
        x += 980.0 * 1.5e-6;
    }
    solver
}

/// Every cell in the liquid.
fn molten<R: Real>() -> Solver<R> {
    let mut solver = solver::<R>();
    solver.set_temperature(|c| 2000.0 + CELSIUS + 500.0 * c.x);
    solver
}

fn measure<R: Real>(c: &mut Criterion, name: &str, mut solver: Solver<R>) {
    let mut group = c.benchmark_group("reference_solver_one_core");
    group.sample_size(20);
    group.throughput(Throughput::Elements(solver.grid().len() as u64));
    group.bench_function(name, |b| {
        b.iter(|| solver.step(1.5e-6, &[spot(1.0)]).unwrap());
    });
    group.finish();
}

fn benches(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .unwrap();
    measure(c, "track f32 vector", track::<f32>());
    measure(c, "track f64 vector", track::<f64>());
    measure(c, "molten f32 vector", molten::<f32>());
}

criterion_group!(all, benches);
criterion_main!(all);
