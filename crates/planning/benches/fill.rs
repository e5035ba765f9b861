//! Planning one layer of a flange of 164 mm: gaps closed, speeds adapted, neighbours found.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_base::Reporter;
use meltpath_geometry::shapes::ring;
use meltpath_geometry::{Plane, Region};
use meltpath_planning::{
    ContourOrder, FillLayer, FillSettings, LineAngle, Paces, PassIds, Strategy, plan_layer,
};

fn flange_layer(c: &mut Criterion) {
    let regions: [Region; 1] = [ring(82.0, 28.0, 240)];
    let plane = Plane::horizontal(0.0);
    let layer = FillLayer {
        number: 1,
        plane: &plane,
        regions: &regions,
    };
    let order = ContourOrder::OutsideIn;
    let angle = LineAngle::Best;
    let hybrid = Strategy::Hybrid {
        contours: 1,
        order,
        angle,
    };
    let mut group = c.benchmark_group("flange layer");
    for (name, strategy) in [
        ("hybrid", hybrid),
        ("zigzag", Strategy::Zigzag { angle }),
        ("contour", Strategy::Contour { order }),
    ] {
        for (speeds, paces) in [
            ("one speed", None),
            ("speeds", Some(Paces::about(12.5, (0.0, 50.0)))),
        ] {
            let settings = FillSettings {
                strategy,
                paces,
                ..FillSettings::new(6.5, 4.8)
            };
            group.bench_function(format!("{name}, {speeds}"), |b| {
                b.iter(|| {
                    let ids = PassIds { part: 0 };
                    plan_layer(black_box(layer), &settings, ids, &Reporter::new())
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, flange_layer);
criterion_main!(benches);
