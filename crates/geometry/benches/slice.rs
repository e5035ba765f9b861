//! Planar slicing: 1,000 planes through a 70,000-triangle mesh (target: 0.25 s on two cores).

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_base::{Reporter, Silent};
use meltpath_geometry::{
    Plane,
    section::{SlicePlan, slice},
    shapes::vase,
};

fn planes(bench: &mut Criterion) {
    let part = vase(40.0, 12.0, 6.0, 120.0, 176, 99);
    assert!((69_000..71_000).contains(&part.triangles.len()));
    let heights = (0..1000).map(|k| 0.06 + 0.12 * f64::from(k)).collect();
    let plan = SlicePlan::new(Plane::horizontal(0.0), heights);
    bench.bench_function("slice 1000 planes through 70k triangles", |b| {
        b.iter(|| slice(&part, &plan, &Reporter::new(), &Silent));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = planes
}
criterion_main!(benches);
