//! The semi-analytic engine on rasters: one element is a millimetre of scan with the pool measured every 0.1 mm, one core,
//! double precision. The cost per millimetre should not grow with the raster.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::material::medium::{Body, Medium};
use meltpath_thermal::pool::history::Memory;
use meltpath_thermal::pool::moving_source::MovingSource;
use meltpath_thermal::solver::source::Depth;

const SPEED: f64 = 980.0;

#[path = "../tests/all/raster.rs"]
mod corners;

fn raster(length: f64, line: f64) -> BeamPath {
    let corners = corners::raster(length, line, 0.125);
    let start = BeamPoint::start(300.0, 0.4137);
    BeamPath::along(&corners, SPEED, start).unwrap()
}

/// Pools along the whole path; the sum of their lengths, so that nothing is optimised away.
fn pools(path: &BeamPath, body: Body) -> f64 {
    let medium = Medium {
        conductivity: 0.0275,
        diffusivity: 8.0,
        ambient: 1023.0,
        body,
    };
    let beam = Beam {
        efficiency: 0.9,
        depth: Depth::Falling { penetration: 0.1 },
    };
    let mut engine = MovingSource::new(medium, path.clone(), beam, Memory::Folded).unwrap();
    let samples = (path.end() * SPEED / 0.1) as usize;
    (1..=samples)
        .map(|n| {
            engine.advance(n as f64 * 0.1 / SPEED).unwrap();
            engine.measure(1938.0).unwrap().pool.length
        })
        .sum()
}

fn benches(c: &mut Criterion) {
    let mut group = c.benchmark_group("moving_source_mm");
    group.sample_size(10);
    for (length, line) in [(42.0, 5.0), (255.0, 10.0), (1010.0, 10.0)] {
        let path = raster(length, line);
        group.throughput(Throughput::Elements((path.end() * SPEED) as u64));
        group.bench_function(format!("half space, raster of {length} mm"), |b| {
            b.iter(|| pools(&path, Body::HalfSpace));
        });
    }
    let path = raster(255.0, 10.0);
    group.throughput(Throughput::Elements((path.end() * SPEED) as u64));
    group.bench_function("plate of 2 mm, raster of 255 mm", |b| {
        b.iter(|| pools(&path, Body::Plate { thickness: 2.0 }));
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
