//! Three successive insets of about 126,000 vertices of hard polygons, on one thread and on all.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_geometry::Region;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::{Join, inset};

mod hard_polygons;

fn regions() -> Vec<Region> {
    let ring = |points: &hard_polygons::Points| points.iter().map(|&p| DVec2::from(p)).collect();
    hard_polygons::hard_set()
        .iter()
        .map(|rings| Region {
            outer: ring(&rings[0]),
            holes: rings[1..].iter().map(ring).collect(),
        })
        .collect()
}

fn three_insets(regions: &[Region]) -> f64 {
    let join = Join::Round {
        arc_tolerance: 0.01,
    };
    let mut current = regions.to_vec();
    for distance in [1.0, 1.5, 2.0] {
        current = inset(&current, distance, join).unwrap_or_default();
    }
    current.iter().map(Region::area).sum()
}

fn bench(c: &mut Criterion) {
    let regions = regions();
    let vertices: usize = regions.iter().flat_map(Region::rings).map(Vec::len).sum();
    let mut group = c.benchmark_group("offset");
    group.sample_size(10);
    for (name, threads) in [("one thread", 1), ("all threads", 0)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let Ok(pool) = pool else { continue };
        group.bench_function(format!("three insets, {vertices} vertices, {name}"), |b| {
            pool.install(|| b.iter(|| three_insets(black_box(&regions))));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
