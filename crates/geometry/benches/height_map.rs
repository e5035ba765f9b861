//! The height map at the size of a build: 400 x 400 mm at 0.5 mm cells.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_geometry::{
    math::DVec2,
    workpiece::{Crop, HeightMap, WorkpieceError},
};

fn build() -> Result<HeightMap, WorkpieceError> {
    let mut map = HeightMap::new(DVec2::ZERO, DVec2::splat(400.0), 0.5, 0.0)?;
    for iy in 100..700 {
        for ix in 100..700 {
            let cell = map.index(ix, iy);
            map.z[cell] = 8.0 + ((ix * 7 + iy * 13) % 11) as f64 * 0.2;
        }
    }
    Ok(map)
}

fn height_map(bench: &mut Criterion) {
    let Ok(map) = build() else { return };
    bench.bench_function("height map: volume of 640,000 cells", |b| {
        b.iter(|| map.volume());
    });
    bench.bench_function("height map: 10,000 heights", |b| {
        b.iter(|| {
            (0..10_000)
                .map(|k| {
                    let t = f64::from(k) * 0.04;
                    map.height(black_box(DVec2::new(t, 400.0 - t)))
                })
                .sum::<f64>()
        });
    });
    bench.bench_function("height map: mesh of the built area", |b| {
        b.iter(|| map.to_mesh(Crop::Built { threshold: 0.0 }, 1.0));
    });
}

criterion_group!(benches, height_map);
criterion_main!(benches);
