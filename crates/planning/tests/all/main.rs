//! Filling: the walls of the thesis, thin sections, every strategy on a zoo of shapes, and laws on random regions; passes on surfaces in
//! space.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that fails says so by panicking"
)]

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::boolean::difference;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::{Join, outset};
use meltpath_geometry::shapes as outlines;
use meltpath_geometry::{Plane, Region, Ring};
use meltpath_planning::{
    ContourOrder, FillLayer, FillSettings, LayerDirection, LayerPlan, LineAngle, LineDirection,
    LineOrder, Paces, PassIds, PlanError, Spacing, StartPoints, Strategy as Fill, nominal_length,
    plan_layer, plan_layers,
};
use meltpath_toolpath::{Channel, Move, Pass, Role, Side};
use proptest::prelude::*;

mod laws;
mod legs;
mod onto;
mod strategies;
mod surface;
mod walls;

const WIDTH: f64 = 6.5;
const STEPOVER: f64 = 4.62;

fn settings(strategy: Fill) -> FillSettings {
    FillSettings {
        strategy,
        ..FillSettings::new(WIDTH, STEPOVER)
    }
}

const RASTER: Fill = Fill::Raster {
    angle: LineAngle::Best,
    order: LineOrder::Across,
    direction: LineDirection::AlternatePerLayer,
};
const ZIGZAG: Fill = Fill::Zigzag {
    angle: LineAngle::Best,
};
const CONTOUR: Fill = Fill::Contour {
    order: ContourOrder::OutsideIn,
};
const INSIDE_OUT: Fill = Fill::Contour {
    order: ContourOrder::InsideOut,
};
const SPIRAL: Fill = Fill::Spiral {
    order: ContourOrder::OutsideIn,
};
const HYBRID: Fill = Fill::Hybrid {
    contours: 1,
    order: ContourOrder::OutsideIn,
    angle: LineAngle::Best,
};
const ALL: [Fill; 6] = [RASTER, ZIGZAG, CONTOUR, INSIDE_OUT, SPIRAL, HYBRID];

fn plan_on(layer: u32, regions: &[Region], settings: &FillSettings) -> LayerPlan {
    let plane = Plane::horizontal(f64::from(layer));
    let layer = FillLayer {
        number: layer,
        plane: &plane,
        regions,
    };
    plan_layer(layer, settings, PassIds { part: 0 }, &Reporter::new()).unwrap()
}

fn plan(regions: &[Region], strategy: Fill) -> LayerPlan {
    plan_on(1, regions, &settings(strategy))
}

fn solid(outer: Ring) -> Region {
    Region {
        outer,
        holes: Vec::new(),
    }
}

fn disc(radius: f64) -> Region {
    solid(
        (0..120)
            .map(|i| DVec2::from_angle(f64::from(i).to_radians() * 3.0) * radius)
            .collect(),
    )
}

fn edges(region: &Region) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
    region
        .rings()
        .flat_map(|r| (0..r.len()).map(move |i| (r[i], r[(i + 1) % r.len()])))
}

fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let e = b - a;
    let t = ((p - a).dot(e) / e.length_squared().max(1e-300)).clamp(0.0, 1.0);
    p.distance(a + e * t)
}

/// Distance to the boundary, negative outside.
fn clearance(region: &Region, p: DVec2) -> f64 {
    let away = edges(region)
        .map(|(a, b)| to_segment(p, a, b))
        .fold(f64::INFINITY, f64::min);
    let crossings = edges(region)
        .filter(|(a, b)| {
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        })
        .count();
    if crossings % 2 == 1 { away } else { -away }
}

/// Points at most a quarter of a width apart along every pass.
fn deposit_points(plan: &LayerPlan) -> Vec<DVec2> {
    let mut out = Vec::new();
    for pass in plan.path.passes() {
        let (points, _) = pass.flatten(0.005);
        for s in points.windows(2) {
            let n = (s[0].distance(s[1]) / (0.25 * WIDTH)).ceil().max(1.0) as usize;
            out.extend((0..n).map(|i| s[0].lerp(s[1], i as f64 / n as f64).truncate()));
        }
        out.extend(points.last().map(|p| p.truncate()));
    }
    out
}

fn covered(plan: &LayerPlan) -> f64 {
    let sum = |f: fn(&meltpath_planning::Coverage) -> f64| plan.coverage.iter().map(f).sum::<f64>();
    sum(|c| c.covered_area) / sum(|c| c.area)
}

/// What holds for every plan: finite, long enough, inside, named once, arcs real, neighbours in range.
fn assert_sound(plan: &LayerPlan, regions: &[Region], what: &str) {
    plan.path.sanity_check().unwrap();
    let s = &plan.settings;
    let mut ids: Vec<_> = plan.path.passes().map(|p| p.head.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), plan.path.len(), "{what}: a pass named twice");
    for pass in plan.path.passes() {
        assert!(
            pass.points.iter().all(|p| p.is_finite()),
            "{what}: not finite"
        );
        assert!(
            pass.length() > s.shortest_bead.min(2.0 * s.stepover) - 0.1,
            "{what}: a pass of {} mm",
            pass.length()
        );
        for i in 0..pass.move_count() {
            assert!(pass.move_length(i) > 0.0, "{what}: a move without length");
            if matches!(pass.move_at(i), Move::Arc { .. }) {
                assert!(pass.arc(i).is_some(), "{what}: an arc that is none");
            }
        }
        for n in pass.neighbours() {
            assert!(
                0.0 <= n.from && n.from < n.to && n.to <= pass.length() + 1e-6,
                "{what}: {n:?}"
            );
            assert!(
                n.distance > 0.0 && n.distance <= 1.2 * s.width + 1e-9,
                "{what}: {n:?}"
            );
            assert!(
                plan.path.passes().any(|p| p.head.id == n.pass),
                "{what}: {n:?}"
            );
        }
    }
    for p in deposit_points(plan) {
        let room = regions
            .iter()
            .map(|r| clearance(r, p))
            .fold(f64::NEG_INFINITY, f64::max);
        assert!(
            room >= 0.5 * s.narrowest * s.width - 4.0 * s.tolerance,
            "{what}: {p} is {room} from the boundary"
        );
    }
    for c in &plan.coverage {
        assert!(
            c.covered_area >= -1e-6 && c.lack_area >= -1e-6,
            "{what}: {c:?}"
        );
        assert!(
            (c.covered_area + c.lack_area - c.area).abs() < 1e-3 * c.area + 1e-6,
            "{what}: {c:?}"
        );
    }
}
