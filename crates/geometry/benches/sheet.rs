//! Fronts over a tube of a million triangles, on one thread.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::sheet::Sheet;

const ROWS: u32 = 500;
const COLUMNS: u32 = 1000;
const SPACING: f64 = 5.0;

/// A tube 300 mm high that bulges and has five lobes.
fn tube() -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=ROWS {
        let z = f64::from(i) / f64::from(ROWS);
        for k in 0..COLUMNS {
            let angle = TAU * f64::from(k) / f64::from(COLUMNS);
            let r = 140.0 * (1.0 + 0.1 * (3.0 * z).sin() + 0.05 * z * (5.0 * angle).cos());
            let place = DVec3::new(r * angle.cos(), r * angle.sin(), 300.0 * z);
            mesh.vertices.push(place);
        }
    }
    for i in 0..ROWS {
        for k in 0..COLUMNS {
            let at = |i: u32, k: u32| i * COLUMNS + k % COLUMNS;
            let (a, b, c, d) = (at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
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
