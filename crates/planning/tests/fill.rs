//! Filling: the walls of the thesis, thin sections, every strategy on a zoo of shapes, and laws on random regions.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that fails says so by panicking"
)]

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::boolean::difference;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::shapes as outlines;
use meltpath_geometry::{Plane, Region, Ring};
use meltpath_planning::{
    ContourOrder, FillSettings, Layer, LayerDirection, LayerPlan, LineAngle, LineDirection,
    LineOrder, Paces, PassIds, PlanError, Spacing, StartPoints, Strategy as Fill, nominal_length,
    plan_layer, plan_layers,
};
use meltpath_toolpath::{Move, Role, Side};
use proptest::prelude::*;

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
    let layer = Layer {
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
    for pass in &plan.passes {
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
    let s = &plan.settings;
    let mut ids: Vec<_> = plan.passes.iter().map(|p| p.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), plan.passes.len(), "{what}: a pass named twice");
    for pass in &plan.passes {
        assert_eq!(pass.moves.len() + 1, pass.points.len(), "{what}");
        assert!(
            pass.points.iter().all(|p| p.is_finite()),
            "{what}: not finite"
        );
        assert!(
            pass.length() > s.shortest_bead.min(2.0 * s.stepover) - 0.1,
            "{what}: a pass of {} mm",
            pass.length()
        );
        for i in 0..pass.moves.len() {
            assert!(pass.move_length(i) > 0.0, "{what}: a move without length");
            if matches!(pass.moves[i], Move::Arc { .. }) {
                assert!(pass.arc(i).is_some(), "{what}: an arc that is none");
            }
        }
        for n in &pass.neighbours {
            assert!(
                0.0 <= n.from && n.from < n.to && n.to <= pass.length() + 1e-6,
                "{what}: {n:?}"
            );
            assert!(
                n.distance > 0.0 && n.distance <= 1.2 * s.width + 1e-9,
                "{what}: {n:?}"
            );
            assert!(plan.passes.iter().any(|p| p.id == n.pass), "{what}: {n:?}");
        }
    }
    for p in deposit_points(plan) {
        let room = regions
            .iter()
            .map(|r| clearance(r, p))
            .fold(f64::NEG_INFINITY, f64::max);
        assert!(
            room >= 0.5 * s.narrowest * s.width - 3.0 * s.tolerance,
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

#[test]
fn waam_wall_raster_has_six_beads_at_the_stepover() {
    let wall = [outlines::plate(120.0, 5.0 * STEPOVER + WIDTH)];
    for spacing in [Spacing::Exact, Spacing::Fill] {
        let s = FillSettings {
            spacing,
            ..settings(RASTER)
        };
        let (first, second) = (plan_on(1, &wall, &s), plan_on(2, &wall, &s));
        assert_eq!(first.passes.len(), 6);
        let mut at: Vec<f64> = first.passes.iter().map(|p| p.points[0].y).collect();
        at.sort_by(f64::total_cmp);
        for pair in at.windows(2) {
            assert!((pair[1] - pair[0] - STEPOVER).abs() < 1e-3, "{at:?}");
        }
        for (a, b) in first.passes.iter().zip(&second.passes) {
            assert_eq!(a.moves, [Move::Line]);
            assert!((a.length() - (120.0 - WIDTH)).abs() < 2e-3);
            let along = |p: &meltpath_toolpath::Pass| (p.points[1] - p.points[0]).x;
            assert!(along(a) * along(b) < 0.0, "directions alternate per layer");
        }
        // interior beads have one on either side over their whole length
        let inner: Vec<_> = first
            .passes
            .iter()
            .filter(|p| p.neighbours.len() == 2)
            .collect();
        assert_eq!(inner.len(), 4);
        for n in inner.iter().flat_map(|p| &p.neighbours) {
            assert!(
                (n.distance - STEPOVER).abs() < 1e-3 && n.to - n.from > 119.0 - WIDTH,
                "{n:?}"
            );
        }
    }
}

#[test]
fn waam_wall_contour_is_four_rectangles_joined_in_a_corner() {
    let wall = [outlines::plate(150.0, 7.0 * STEPOVER + WIDTH)];
    let plan = plan(&wall, INSIDE_OUT);
    assert_eq!(plan.passes.len(), 1);
    let pass = &plan.passes[0];
    assert_eq!(pass.role, Role::Contour);
    // four rectangles of four lines and three links
    assert_eq!(pass.moves.len(), 4 * 4 + 3);
    let heights: Vec<f64> = pass.points.iter().map(|p| p.y).collect();
    let (low, high) = (
        heights.iter().copied().fold(f64::INFINITY, f64::min),
        heights.iter().copied().fold(0.0, f64::max),
    );
    assert!((high - low - 7.0 * STEPOVER).abs() < 0.02, "{}", high - low);
    let first = DVec3::new(pass.points[0].x, pass.points[0].y, 1.0);
    let inner_first = clearance(&wall[0], first.truncate())
        > clearance(&wall[0], pass.points[pass.points.len() - 1].truncate());
    assert!(inner_first, "inside first");
    assert!(covered(&plan) > 0.995);
}

#[test]
fn a_wall_one_bead_wide_is_one_straight_pass() {
    for (wall, width) in [(7.0, 6.5), (7.0, 7.0), (4.3, 6.5), (8.5, 6.5)] {
        for strategy in ALL {
            let s = FillSettings {
                strategy,
                ..FillSettings::new(width, 0.7 * width)
            };
            let plan = plan_on(1, &[outlines::plate(150.0, wall)], &s);
            assert_eq!(plan.passes.len(), 1, "{wall} {width} {strategy:?}");
            let pass = &plan.passes[0];
            assert_eq!(pass.moves, [Move::Line], "{wall} {width} {strategy:?}");
            let middle = pass.points[0].lerp(pass.points[1], 0.5);
            let plate = &outlines::plate(150.0, wall);
            let (low, high) = plate
                .outer
                .iter()
                .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| {
                    (l.min(*p), h.max(*p))
                });
            assert!(
                middle.truncate().distance(0.5 * (low + high)) < 0.01,
                "{middle}"
            );
            assert!(
                (pass.length() - (150.0 - width)).abs() < 0.02,
                "{}",
                pass.length()
            );
        }
    }
}

/// Nothing but arcs, as many as said.
fn assert_round(pass: &meltpath_toolpath::Pass, count: std::ops::RangeInclusive<usize>) {
    let arcs = pass.moves.iter().filter(|m| **m != Move::Line).count();
    assert!(
        count.contains(&arcs) && arcs == pass.moves.len(),
        "{:?}",
        pass.moves
    );
}

#[test]
fn facets_of_a_circle_are_arcs_again() {
    // chord errors of 0.05 mm: 64 facets outside, 58 inside, of no common direction
    let outer = outlines::ring(40.0, 10.0, 64).outer;
    let mut hole: Ring = outlines::ring(33.5, 10.0, 58).outer;
    hole.reverse();
    let ring = Region {
        outer,
        holes: vec![hole],
    };
    for strategy in ALL {
        let plan = plan(std::slice::from_ref(&ring), strategy);
        assert_eq!(plan.passes.len(), 1);
        assert_round(&plan.passes[0], 2..=4);
        for p in deposit_points(&plan) {
            assert!((p.length() - 36.75).abs() < 0.08, "{}", p.length());
        }
    }
    // and on nested contours
    for radius in [20.0_f64, 60.0] {
        let n = (std::f64::consts::PI / (1.0 - 0.05 / radius).acos()).ceil() as u32;
        let disc = solid(outlines::ring(radius, 5.0, n).outer);
        let plan = plan(&[disc], HYBRID);
        assert_eq!(plan.passes[0].role, Role::Contour);
        assert_round(&plan.passes[0], 2..=4);
    }
}

#[test]
fn ellipses_and_slots_one_bead_wide_stay_within_tolerance() {
    let oval = |a: f64, b: f64| -> Ring {
        (0..720)
            .map(|i| {
                let (sin, cos) = f64::to_radians(0.5 * f64::from(i)).sin_cos();
                DVec2::new(a * cos, b * sin)
            })
            .collect()
    };
    let slot = |half: f64, r: f64| -> Ring {
        let end = |x: f64, from: f64| {
            (0..=90).map(move |i| {
                DVec2::new(x, 0.0)
                    + DVec2::from_angle(f64::to_radians(from + 2.0 * f64::from(i))) * r
            })
        };
        end(half, -90.0).chain(end(-half, 90.0)).collect()
    };
    let hollow = |outer: Ring, mut hole: Ring| {
        hole.reverse();
        Region {
            outer,
            holes: vec![hole],
        }
    };
    let ellipse = hollow(oval(50.0, 30.0), oval(43.5, 23.5));
    let wall = hollow(slot(30.0, 20.0), slot(30.0, 13.5));
    for (name, region, most) in [("ellipse", ellipse, 24), ("slot", wall, 6)] {
        let plan = plan(std::slice::from_ref(&region), CONTOUR);
        assert_eq!(plan.passes.len(), 1, "{name}");
        let pass = &plan.passes[0];
        assert!(pass.is_closed(), "{name}");
        assert!(pass.moves.len() <= most, "{name}: {:?}", pass.moves);
        let edge = |ring: &Ring, p: DVec2| {
            (0..ring.len())
                .map(|i| to_segment(p, ring[i], ring[(i + 1) % ring.len()]))
                .fold(f64::INFINITY, f64::min)
        };
        for p in deposit_points(&plan) {
            let off = 0.5 * (edge(&region.outer, p) - edge(&region.holes[0], p));
            assert!(off.abs() < 0.08, "{name}: {p} is {off} off the middle");
        }
    }
}

#[test]
fn a_closed_wall_one_bead_wide_is_one_closed_pass() {
    for strategy in ALL {
        let ring = plan(&[outlines::ring(40.0, 33.5, 180)], strategy);
        assert_eq!(ring.passes.len(), 1);
        let pass = &ring.passes[0];
        assert!(pass.is_closed());
        assert!(
            (pass.length() - std::f64::consts::TAU * 36.75).abs() < 0.1,
            "{}",
            pass.length()
        );
        assert_round(pass, 2..=4);
        let frame = difference(
            &[outlines::plate(80.0, 50.0)],
            &[Region {
                outer: outlines::plate(80.0 - 13.2, 50.0 - 13.2)
                    .outer
                    .iter()
                    .map(|&p| {
                        // both plates may start at a corner or sit in the middle: lay their middles together
                        let middle = |r: &Region| {
                            r.outer.iter().copied().sum::<DVec2>() / r.outer.len() as f64
                        };
                        p - middle(&outlines::plate(80.0 - 13.2, 50.0 - 13.2))
                            + middle(&outlines::plate(80.0, 50.0))
                    })
                    .collect(),
                holes: Vec::new(),
            }],
        )
        .unwrap();
        let frame = plan(&frame, strategy);
        assert_eq!(frame.passes.len(), 1);
        assert!(frame.passes[0].is_closed());
        assert!(
            (frame.passes[0].length() - 2.0 * (80.0 + 50.0 - 13.2)).abs() < 0.1,
            "{}",
            frame.passes[0].length()
        );
    }
}

fn zoo() -> Vec<(&'static str, Vec<Region>)> {
    let comb: Vec<DVec2> = (0..6)
        .flat_map(|i| {
            let x = 20.0 * f64::from(i);
            [(x, 0.0), (x, 40.0), (x + 10.0, 40.0), (x + 10.0, 0.0)]
        })
        .chain([(110.0, -12.0), (0.0, -12.0)])
        .map(DVec2::from)
        .rev()
        .collect();
    vec![
        ("plate", vec![outlines::plate(100.0, 40.0)]),
        ("disc", vec![disc(25.0)]),
        ("ring", vec![outlines::ring(50.0, 30.0, 180)]),
        ("cross", vec![outlines::cross(90.0, 24.0)]),
        ("tee", vec![outlines::tee(96.0, 74.0, 24.0)]),
        ("ell", vec![outlines::ell(90.0, 60.0, 18.0)]),
        ("star", vec![outlines::star(5, 60.0, 26.0)]),
        ("gear", vec![outlines::gear(12, 40.0, 52.0, 14.0)]),
        ("honeycomb", vec![outlines::honeycomb(5, 4, 9.0, 6.8)]),
        ("spiral", vec![outlines::spiral(15.0, 14.0, 6.6, 3.0)]),
        ("truss", vec![outlines::truss(4, 30.0, 6.8)]),
        ("islands", outlines::islands(3, 2, 20.0, 9.0)),
        ("comb", vec![solid(comb)]),
        (
            "random star",
            vec![outlines::random_star(3, 14, 25.0, 60.0)],
        ),
    ]
}

#[test]
fn every_strategy_is_sound_on_every_shape() {
    for (name, regions) in zoo() {
        for strategy in ALL {
            for layer in [1, 2] {
                let plan = plan_on(layer, &regions, &settings(strategy));
                let what = format!("{name}, {strategy:?}, layer {layer}");
                assert!(!plan.passes.is_empty(), "{what}");
                assert_sound(&plan, &regions, &what);
            }
        }
    }
}

#[test]
fn simple_shapes_are_covered() {
    let shapes = [
        ("plate", outlines::plate(100.0, 40.0)),
        ("tee", outlines::tee(96.0, 74.0, 24.0)),
        ("ell", outlines::ell(90.0, 60.0, 22.0)),
    ];
    for (name, region) in shapes {
        for strategy in [ZIGZAG, CONTOUR, INSIDE_OUT, SPIRAL, HYBRID] {
            let share = covered(&plan(std::slice::from_ref(&region), strategy));
            assert!(share > 0.99, "{name}, {strategy:?}: {share}");
        }
    }
    for region in [disc(25.0), outlines::ring(50.0, 30.0, 180)] {
        for strategy in [CONTOUR, SPIRAL, HYBRID] {
            let share = covered(&plan(std::slice::from_ref(&region), strategy));
            assert!(share > 0.99, "round, {strategy:?}: {share}");
        }
    }
}

/// Round plates, one with a hole, a rectangle with a round hole and an L.
fn rimmed_shapes() -> Vec<(&'static str, Vec<Region>)> {
    let hole = Region {
        outer: disc(20.0)
            .outer
            .iter()
            .map(|p| *p + DVec2::new(50.0, 40.0))
            .collect(),
        holes: Vec::new(),
    };
    vec![
        ("disc of 50", vec![disc(25.0)]),
        ("disc of 120", vec![disc(60.0)]),
        ("flange", vec![outlines::ring(82.0, 28.0, 240)]),
        (
            "plate with a hole",
            difference(&[outlines::plate(120.0, 80.0)], &[hole]).unwrap(),
        ),
        ("ell", vec![outlines::ell(90.0, 60.0, 30.0)]),
    ]
}

#[test]
fn rims_are_covered_by_lines_too() {
    for (name, regions) in rimmed_shapes() {
        for strategy in [HYBRID, ZIGZAG, RASTER] {
            for layer in [1, 2] {
                let plan = plan_on(layer, &regions, &settings(strategy));
                let what = format!("{name}, {strategy:?}, layer {layer}");
                assert!(covered(&plan) > 0.99, "{what}: {}", covered(&plan));
                assert_sound(&plan, &regions, &what);
            }
        }
    }
}

/// Metal on every place farther than a width from the boundary, as laid within a width of it at the pass' speeds, over
/// the mean of all such places.
fn metal_inside(regions: &[Region], plan: &LayerPlan) -> Vec<f64> {
    const CELL: f64 = 1.0;
    let mut laid = std::collections::HashMap::<(i64, i64), f64>::new();
    for pass in &plan.passes {
        for i in 0..pass.moves.len() {
            let speed = pass.channels.speed.as_ref().map_or(12.5, |s| s[i]);
            let arc = pass.arc(i);
            let n = (pass.move_length(i) / 0.3).ceil().max(1.0) as usize;
            for k in 0..n {
                let t = (k as f64 + 0.5) / n as f64;
                let p = arc.map_or_else(
                    || pass.points[i].lerp(pass.points[i + 1], t),
                    |arc| arc.at(t),
                ) / CELL;
                *laid
                    .entry((p.x.floor() as i64, p.y.floor() as i64))
                    .or_default() += pass.move_length(i) / n as f64 / speed;
            }
        }
    }
    let reach = (WIDTH / CELL).ceil() as i64;
    let mut metal = Vec::new();
    for x in -90..130_i64 {
        for y in -90..100_i64 {
            let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * CELL;
            if regions.iter().any(|r| clearance(r, p) > WIDTH) {
                let near = (-reach..=reach)
                    .flat_map(|i| (-reach..=reach).map(move |j| (i, j)))
                    .filter(|(i, j)| ((i * i + j * j) as f64) * CELL * CELL <= WIDTH * WIDTH);
                metal.push(
                    near.filter_map(|(i, j)| laid.get(&(x + i, y + j)))
                        .sum::<f64>(),
                );
            }
        }
    }
    let mean = metal.iter().sum::<f64>() / metal.len() as f64;
    metal.iter().map(|m| m / mean).collect()
}

#[test]
fn speeds_even_the_metal_out() {
    for (name, regions) in rimmed_shapes() {
        for strategy in [HYBRID, ZIGZAG, RASTER, CONTOUR, SPIRAL] {
            let spread = |paces| {
                let s = FillSettings {
                    paces,
                    ..settings(strategy)
                };
                let plan = plan_on(1, &regions, &s);
                assert_sound(&plan, &regions, name);
                let metal = metal_inside(&regions, &plan);
                let off = metal.iter().filter(|m| (*m - 1.0).abs() > 0.25).count();
                off as f64 / metal.len() as f64
            };
            let (one, adapted) = (spread(None), spread(Some(Paces::about(12.5))));
            // where turns meet and links run, contours heap metal at one speed; a zigzag's turning points come nearer
            let most = match strategy {
                Fill::Contour { .. } | Fill::Spiral { .. } => 0.005 + 0.4 * one,
                _ => 0.04,
            };
            assert!(adapted < most, "{name}, {strategy:?}: {one} -> {adapted}");
        }
    }
}

#[test]
fn speeds_keep_to_their_range_and_the_mean() {
    for (name, regions) in zoo() {
        let s = FillSettings {
            paces: Some(Paces::about(12.5)),
            ..settings(CONTOUR)
        };
        let plan = plan_on(1, &regions, &s);
        let (mut long, mut nominal) = (0.0, 0.0);
        for pass in &plan.passes {
            if let Some(speeds) = &pass.channels.speed {
                assert_eq!(speeds.len(), pass.moves.len(), "{name}");
                assert!(
                    speeds.iter().all(|v| (9.99..=25.01).contains(v)),
                    "{name}: {speeds:?}"
                );
            }
            long += pass.length();
            nominal += nominal_length(pass, 12.5);
        }
        assert!(
            (nominal / long - 1.0).abs() < 0.1,
            "{name}: {nominal} of {long}"
        );
    }
    // a wall one bead wide has no reason to change its speed but near its ends
    let s = FillSettings {
        paces: Some(Paces::about(12.5)),
        ..settings(RASTER)
    };
    let wall = plan_on(1, &[outlines::plate(150.0, 7.0)], &s);
    let pass = &wall.passes[0];
    let speeds = pass.channels.speed.as_ref().unwrap();
    for (i, speed) in speeds.iter().enumerate() {
        let (from, to) = (pass.points[i].x, pass.points[i + 1].x);
        if from.min(to) < 120.0 && from.max(to) > 30.0 {
            assert!((speed - 12.5).abs() < 1e-9, "{pass:?}");
        }
    }
    // spacing as given means speed as given
    let s = FillSettings {
        spacing: Spacing::Exact,
        ..s
    };
    let wall = plan_on(1, &[outlines::plate(100.0, 40.0)], &s);
    assert!(wall.passes.iter().all(|p| p.channels.speed.is_none()));
}

#[test]
fn centre_out_begins_in_the_middle() {
    let centre_out = Fill::Raster {
        angle: LineAngle::Best,
        order: LineOrder::CentreOut,
        direction: LineDirection::OneWay,
    };
    for lines in [6.0, 7.0] {
        let wall = [outlines::plate(120.0, lines * STEPOVER + WIDTH)];
        let plan = plan(&wall, centre_out);
        assert_eq!(plan.passes.len(), lines as usize + 1);
        let mut all: Vec<f64> = plan.passes.iter().map(|p| p.points[0].y).collect();
        let middle = all.iter().sum::<f64>() / all.len() as f64;
        let away: Vec<f64> = all.iter().map(|y| (y - middle).abs()).collect();
        assert!(away.windows(2).all(|a| a[1] > a[0] - 1e-6), "{away:?}");
        let sides: Vec<bool> = all.iter().map(|y| *y > middle + 1e-6).collect();
        assert!(
            sides[1..].windows(2).all(|s| s[0] != s[1]),
            "sides in turn: {all:?}"
        );
        all.sort_by(f64::total_cmp);
        all.dedup();
        assert_eq!(all.len(), plan.passes.len());
    }
}

#[test]
fn starts_move_from_layer_to_layer_or_stay() {
    let ring = [outlines::ring(50.0, 30.0, 180)];
    let starts = |starts: StartPoints| -> Vec<DVec2> {
        let s = FillSettings {
            starts,
            layers: LayerDirection::Same,
            ..settings(CONTOUR)
        };
        (1..=4)
            .map(|layer| plan_on(layer, &ring, &s).passes[0].points[0].truncate())
            .collect()
    };
    let aligned = starts(StartPoints::Aligned);
    assert!(aligned.iter().all(|p| p.distance(aligned[0]) < 1e-9));
    for way in [StartPoints::Spread, StartPoints::Random { seed: 5 }] {
        let spread = starts(way);
        assert!(
            spread.windows(2).all(|p| p[0].distance(p[1]) > WIDTH),
            "{spread:?}"
        );
    }
}

#[test]
fn spaced_exactly_or_told() {
    // 40 mm are no whole number of stepovers: kept as asked for, or adjusted to fill
    let plate = [outlines::plate(100.0, 40.0)];
    let at = |spacing| -> Vec<f64> {
        let s = FillSettings {
            spacing,
            ..settings(RASTER)
        };
        let mut y: Vec<f64> = plan_on(1, &plate, &s)
            .passes
            .iter()
            .map(|p| p.points[0].y)
            .collect();
        y.sort_by(f64::total_cmp);
        y
    };
    let exact = at(Spacing::Exact);
    assert!(
        exact
            .windows(2)
            .all(|p| (p[1] - p[0] - STEPOVER).abs() < 1e-6)
    );
    let filled = at(Spacing::Fill);
    assert!((filled[filled.len() - 1] - filled[0] - (40.0 - WIDTH)).abs() < 1e-2);
}

#[test]
fn regions_too_small_for_a_bead_are_told() {
    let tiny = [outlines::plate(3.0, 2.0), outlines::plate(60.0, 30.0)];
    let reporter = Reporter::new();
    let plane = Plane::horizontal(0.0);
    let layer = Layer {
        number: 1,
        plane: &plane,
        regions: &tiny,
    };
    let plan = plan_layer(layer, &settings(HYBRID), PassIds { part: 0 }, &reporter).unwrap();
    assert_eq!(reporter.warnings()[0].code, "region-without-bead");
    assert_eq!(plan.coverage[0].covered_area, 0.0);
    assert!((plan.coverage[0].lack_area - 6.0).abs() < 1e-6);
}

#[test]
fn nothing_to_fill_is_an_empty_plan_and_bad_input_an_error() {
    assert!(plan(&[], HYBRID).passes.is_empty());
    assert!(plan(&[Region::default()], HYBRID).passes.is_empty());
    let plane = Plane::horizontal(0.0);
    let bad = [solid(vec![
        DVec2::ZERO,
        DVec2::X * 50.0,
        DVec2::new(f64::NAN, 50.0),
    ])];
    let layer = Layer {
        number: 7,
        plane: &plane,
        regions: &bad,
    };
    let error = plan_layer(
        layer,
        &settings(HYBRID),
        PassIds { part: 0 },
        &Reporter::new(),
    )
    .unwrap_err();
    assert!(
        matches!(error, PlanError::Outline { layer: 7, .. }),
        "{error}"
    );
    let zero = FillSettings {
        stepover: 0.0,
        ..settings(HYBRID)
    };
    let layer = Layer {
        number: 1,
        plane: &plane,
        regions: &[],
    };
    let error = plan_layer(layer, &zero, PassIds { part: 0 }, &Reporter::new()).unwrap_err();
    assert!(error.to_string().contains("stepover"), "{error}");
}

#[test]
fn the_same_plan_on_any_number_of_threads() {
    let plane = Plane::horizontal(0.0);
    let zoo = zoo();
    let layers: Vec<Layer<'_>> = zoo
        .iter()
        .zip(1..)
        .map(|((_, regions), number)| Layer {
            number,
            plane: &plane,
            regions,
        })
        .collect();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            plan_layers(
                &layers,
                &settings(HYBRID),
                PassIds { part: 1 },
                &Reporter::new(),
                &Silent,
            )
            .unwrap()
        })
    };
    assert_eq!(on(1), on(4));
}

fn star(centre: DVec2, radii: &[f64]) -> Ring {
    let n = radii.len() as f64;
    (0..radii.len())
        .map(|i| centre + DVec2::from_angle(std::f64::consts::TAU * i as f64 / n) * radii[i])
        .collect()
}

fn region() -> impl Strategy<Value = Vec<Region>> {
    let outer = prop::collection::vec(15.0..60.0_f64, 4..24);
    let hole = (
        0.0..std::f64::consts::TAU,
        0.0..35.0_f64,
        prop::collection::vec(1.0..10.0_f64, 3..12),
    );
    (outer, prop::collection::vec(hole, 0..4)).prop_map(|(outer, holes)| {
        let cut: Vec<_> = holes
            .iter()
            .map(|(angle, r, radii)| solid(star(DVec2::from_angle(*angle) * *r, radii)))
            .collect();
        difference(&[solid(star(DVec2::ZERO, &outer))], &cut).unwrap()
    })
}

/// Area of the regions under discs of half a bead's width stamped along the passes, on a grid.
fn stamped(regions: &[Region], plan: &LayerPlan) -> (f64, f64) {
    const CELL: f64 = 0.5;
    let points = deposit_points(plan);
    let (mut total, mut under) = (0.0, 0.0);
    let reach = 0.5 * WIDTH;
    let mut cells = std::collections::HashMap::<(i64, i64), Vec<DVec2>>::new();
    let key = |p: DVec2| ((p.x / reach).floor() as i64, (p.y / reach).floor() as i64);
    // stamps closer together than the deposit points: scallops below a hundredth of a width
    for pass in &plan.passes {
        let (line, _) = pass.flatten(0.01);
        for s in line.windows(2) {
            let n = (s[0].distance(s[1]) / 0.4).ceil().max(1.0) as usize;
            for i in 0..=n {
                let p = s[0].lerp(s[1], i as f64 / n as f64).truncate();
                cells.entry(key(p)).or_default().push(p);
            }
        }
    }
    assert!(plan.passes.is_empty() || !points.is_empty());
    for i in -130..130 {
        for j in -130..130 {
            let p = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) * CELL;
            if regions.iter().any(|r| clearance(r, p) > 0.0) {
                total += CELL * CELL;
                let (x, y) = key(p);
                let near = (-1..=1).flat_map(|a| (-1..=1).map(move |b| (x + a, y + b)));
                if near
                    .filter_map(|k| cells.get(&k))
                    .flatten()
                    .any(|q| q.distance(p) <= reach)
                {
                    under += CELL * CELL;
                }
            }
        }
    }
    (total, under)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn random_regions_are_filled_soundly(regions in region(), which in 0..ALL.len(), layer in 1..9_u32) {
        let plan = plan_on(layer, &regions, &settings(ALL[which]));
        assert_sound(&plan, &regions, &format!("{:?} on layer {layer}", ALL[which]));
    }

    #[test]
    fn islands_of_any_size_are_filled_or_told(
        sizes in prop::collection::vec((0.3..26.0_f64, 3..12_usize, 0.0..0.6_f64), 1..9),
        which in 0..ALL.len() + 1,
        starts in 0..3_usize,
        layer in 1..9_u32,
    ) {
        let regions: Vec<Region> = sizes
            .iter()
            .enumerate()
            .flat_map(|(i, &(size, n, hole))| {
                let at = DVec2::new(i as f64 % 3.0 - 1.0, (i / 3) as f64 - 1.0) * 60.0;
                let whole = solid(star(at, &vec![size; n]));
                difference(&[whole], &[solid(star(at, &[hole * size; 9]))]).unwrap()
            })
            .collect();
        let centre_out = Fill::Raster {
            angle: LineAngle::Turning { first: 0.3, step: 1.1 },
            order: LineOrder::CentreOut,
            direction: LineDirection::AlternatePerBead,
        };
        let s = FillSettings {
            starts: [StartPoints::Aligned, StartPoints::Spread, StartPoints::Random { seed: 7 }][starts],
            paces: Some(Paces::about(12.5)),
            ..settings(*ALL.get(which).unwrap_or(&centre_out))
        };
        let reporter = Reporter::new();
        let plane = Plane::horizontal(0.0);
        let l = Layer { number: layer, plane: &plane, regions: &regions };
        let plan = plan_layer(l, &s, PassIds { part: 0 }, &reporter).unwrap();
        assert_sound(&plan, &regions, &format!("{:?} on layer {layer}", s.strategy));
        // every region is told of: covered, or said to have no bead
        prop_assert_eq!(plan.coverage.len(), regions.len());
        let bare = |c: &&meltpath_planning::Coverage| plan.passes.iter().all(|p| p.tag.entity != c.region);
        let without = plan.coverage.iter().filter(bare).count();
        let told = reporter.warnings().iter().filter(|w| w.code == "region-without-bead").count();
        prop_assert_eq!(told, without);
        for c in &plan.coverage {
            prop_assert!(c.area.is_finite() && c.covered_area.is_finite() && c.fill_ratio.is_finite());
        }
        // a region that a bead and its length fit into has one
        for (region, c) in regions.iter().zip(&plan.coverage) {
            if region.holes.is_empty() && region.area() > 12.0 * WIDTH * WIDTH {
                prop_assert!(c.covered_area > 0.5 * c.area, "{c:?}");
            }
        }
        // no link from one region to another: a pass stays in its own
        for pass in &plan.passes {
            let own = &regions[pass.tag.entity as usize];
            for p in pass.flatten(0.005).0 {
                prop_assert!(clearance(own, p.truncate()) > 0.0, "{p} left its region");
            }
        }
    }

    #[test]
    fn told_coverage_is_what_stamps_cover(regions in region(), which in 0..ALL.len()) {
        let plan = plan(&regions, ALL[which]);
        let told: f64 = plan.coverage.iter().map(|c| c.covered_area).sum();
        let (total, under) = stamped(&regions, &plan);
        prop_assert!((told - under).abs() < 0.02 * total + 10.0, "told {told}, stamped {under} of {total}");
        let area: f64 = plan.coverage.iter().map(|c| c.area).sum();
        let filled: f64 = plan.coverage.iter().map(|c| c.fill_ratio * c.area).sum();
        prop_assert!(filled < 1.8 * area, "bead length times stepover is {filled} for {area} mm²");
    }

    #[test]
    fn neighbours_are_mutual(regions in region()) {
        let plan = plan(&regions, RASTER);
        // what one bead sees on a side over more than two widths sees it too
        for pass in &plan.passes {
            for n in &pass.neighbours {
                if n.to - n.from > 2.0 * WIDTH && n.pass != pass.id {
                    let other = plan.passes.iter().find(|p| p.id == n.pass).unwrap();
                    prop_assert!(other.neighbours.iter().any(|m| m.pass == pass.id), "{n:?} is not returned");
                    let side = n.side == Side::Left;
                    let t = (pass.points[1] - pass.points[0]).truncate();
                    let v = (other.points[0] - pass.points[0]).truncate();
                    if pass.moves.len() == 1 && other.moves.len() == 1 {
                        prop_assert_eq!(t.perp_dot(v) > 0.0, side);
                    }
                }
            }
        }
    }
}
