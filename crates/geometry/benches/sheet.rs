//! Fronts over a tube of a million triangles, on one thread.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;
use meltpath_geometry::sheet::Sheet;

const ROWS: u32 = 500;
const COLUMNS: u32 = 1000;
const SPACING: f64 = 5.0;

/// A tube 300 mm high that bulges and has five lobes.
fn tube() -> Mesh {
    shapes::tube(ROWS, COLUMNS, |z, turn| {
        let angle = TAU * turn;
        let r = 140.0 * (1.0 + 0.1 * (3.0 * z).sin() + 0.05 * z * (5.0 * angle).cos());
        DVec3::new(r * angle.cos(), r * angle.sin(), 300.0 * z)
    })
}

fn bench(c: &mut Criterion) {
    let mesh = tube();
    let mut group = c.benchmark_group("sheet");
    group.sample_size(10);
    group.bench_function("a million triangles as a surface", |b| {
        b.iter(|| Sheet::new(black_box(&mesh), SPACING));
    });
    let Ok(sheet) = Sheet::new(&mesh, SPACING) else {
        return;
    };
    group.bench_function("fronts over a million triangles", |b| {
        b.iter(|| sheet.fronts(|p| p.z, black_box(SPACING), 0.01));
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
