//! Meshes at real size: examining 70,000 triangles, intersections included, and reading them from a binary STL.

use std::io::Cursor;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_base::{Reporter, Silent};
use meltpath_geometry::{
    diagnosis::{DiagnosisOptions, diagnose},
    io::stl::{read_stl, write_stl},
    shapes::vase,
};

fn meshes(bench: &mut Criterion) {
    let part = vase(40.0, 12.0, 6.0, 120.0, 176, 99);
    bench.bench_function("examine 70k triangles", |b| {
        b.iter(|| diagnose(&part, &DiagnosisOptions::default(), &Silent));
    });
    let mut bytes = Vec::new();
    let written = write_stl(&part, "vase", &mut bytes);
    assert!(written.is_ok());
    bench.bench_function("read 70k triangles from binary STL", |b| {
        b.iter(|| {
            let length = Some(bytes.len() as u64);
            read_stl(Cursor::new(&bytes), length, &Reporter::new(), &Silent)
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = meshes
}
criterion_main!(benches);
