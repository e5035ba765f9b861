//! Drawing on the solver for whole layers: nine lines of 3 mm on cells of 30 µm, powder beside and on top, one thread.
//! Elements are cell updates.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::Silent;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::levels::Levels;

#[path = "../tests/all/support.rs"]
mod support;
use support::{beam, ground, nothing, on_levels, titanium};

fn path() -> BeamPath {
    let corners: Vec<[f64; 2]> = (0..9_u32)
        .flat_map(|n| {
            let y = 0.125 * f64::from(n);
            let ends = [[0.0, y], [3.0, y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    let start = BeamPoint::start(300.0, 0.4137);
    BeamPath::along(&corners, 980.0, start).unwrap()
}

/// Draws the lines; how many cells were updated.
fn drawn(path: &BeamPath) -> u64 {
    let material = titanium();
    let heights = vec![0.28, 0.2, 0.15, 0.1, 0.07, 0.05, 0.05, 0.05, 0.05];
    let setup = on_levels([[-0.5, -0.5], [3.5, 1.5]], (0.03, 2), heights);
    let matter = setup.ground(&material, &ground([3.0, 1.0]));
    let mut levels = Levels::new(setup, material, matter).unwrap();
    levels.draw(path, &beam(), &nothing(), &Silent).unwrap();
    levels.updates()
}

fn hatch(c: &mut Criterion) {
    let path = path();
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let updates = one.install(|| drawn(&path));
    let mut group = c.benchmark_group("levels");
    group.sample_size(10);
    group.throughput(Throughput::Elements(updates));
    group.bench_function("nine lines of 3 mm", |b| {
        b.iter(|| one.install(|| drawn(&path)));
    });
    group.finish();
}

criterion_group!(benches, hatch);
criterion_main!(benches);
