//! STEP files: reading, meshing at the default chord error.

use std::hint::black_box;
use std::path::PathBuf;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::{Reporter, Silent};
use meltpath_geometry::brep::{Tolerance, tessellate};
use meltpath_geometry::step;

/// The sample with most faces, and the one with most triangles.
const FILES: [&str; 2] = ["cover_ap203_inch.step", "pipe_bend.step"];

fn bench(c: &mut Criterion) {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/step");
    for name in FILES {
        let Ok(bytes) = std::fs::read(folder.join(name)) else {
            continue;
        };
        let mut group = c.benchmark_group(name);
        group.sample_size(20);
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        group.bench_function("read", |b| {
            b.iter(|| step::parse(black_box(&bytes), &Reporter::new()));
        });
        let Ok(model) = step::parse(&bytes, &Reporter::new()) else {
            continue;
        };
        let tolerance = Tolerance::default();
        let triangles = tessellate(&model, &tolerance, &Reporter::new(), &Silent)
            .map_or(0, |mesh| mesh.triangles.len());
        group.throughput(Throughput::Elements(triangles as u64));
        group.bench_function("tessellate", |b| {
            b.iter(|| tessellate(black_box(&model), &tolerance, &Reporter::new(), &Silent));
        });
        group.finish();
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
