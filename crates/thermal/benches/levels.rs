//! Drawing on the solver for whole layers: nine lines of 3 mm on cells of 30 µm, powder beside and on top, one thread.
//! Elements are cell updates.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use meltpath_base::Silent;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::levels::{BEND, Levels, Setup};
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::material::file::{Readings, read};
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::watch::Watch;
use meltpath_thermal::solver::{Face, State};

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
    let text = meltpath_data::materials::TI6AL4V_EBM.text;
    let material = read(text, Readings::default()).unwrap();
    let setup = Setup {
        covered: [[-0.5, -0.5], [3.5, 1.5]],
        cell: 0.03,
        coarser: 2,
        heights: vec![0.28, 0.2, 0.15, 0.1, 0.07, 0.05, 0.05, 0.05, 0.05],
        layer: 0.05,
        tracked: 0.2,
        top: Surface::Radiating {
            surroundings: 300.0 + CELSIUS,
        },
        beyond: Face::Imposed(material.start),
        step: 1.0,
        focus: None,
        bend: BEND,
    };
    let part = |[x, y]: [f64; 2]| {
        if (-0.1..3.1).contains(&x) && (-0.1..1.1).contains(&y) {
            State::Dense
        } else {
            State::Powder
        }
    };
    let matter = setup.ground(&material, &part);
    let mut levels = Levels::new(setup, material, matter).unwrap();
    let beam = Beam {
        efficiency: 0.9,
        depth: Depth::Falling { penetration: 0.1 },
    };
    let nothing = Watch {
        places: Vec::new(),
        every: 1.0,
    };
    levels.draw(path, &beam, &nothing, &Silent).unwrap();
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
