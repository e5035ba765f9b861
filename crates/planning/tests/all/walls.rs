//! The walls of the thesis, and sections one bead wide.

use super::*;

#[test]
fn waam_wall_raster_has_six_beads_at_the_stepover() {
    let wall = [outlines::plate(120.0, 5.0 * STEPOVER + WIDTH)];
    for spacing in [Spacing::Exact, Spacing::Fill] {
        let s = FillSettings {
            spacing,
            ..settings(RASTER)
        };
        let (first, second) = (plan_on(1, &wall, &s), plan_on(2, &wall, &s));
        assert_eq!(first.path.len(), 6);
        let mut at: Vec<f64> = first.path.passes().map(|p| p.points[0].y).collect();
        at.sort_by(f64::total_cmp);
        for pair in at.windows(2) {
            assert!((pair[1] - pair[0] - STEPOVER).abs() < 1e-3, "{at:?}");
        }
        for (a, b) in first.path.passes().zip(second.path.passes()) {
            assert!(a.moves().eq([Move::Line]));
            assert!((a.length() - (120.0 - WIDTH)).abs() < 2e-3);
            let along = |p: &meltpath_toolpath::Pass<'_>| (p.points[1] - p.points[0]).x;
            assert!(
                along(&a) * along(&b) < 0.0,
                "directions alternate per layer"
            );
        }
        // interior beads have one on either side over their whole length
        let inner: Vec<_> = first
            .path
            .passes()
            .filter(|p| p.neighbours().len() == 2)
            .collect();
        assert_eq!(inner.len(), 4);
        for n in inner.iter().flat_map(meltpath_toolpath::Pass::neighbours) {
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
    assert_eq!(plan.path.len(), 1);
    let pass = plan.path.pass(0);
    assert_eq!(pass.head.role, Role::Contour);
    // four rectangles of four lines and three links
    assert_eq!(pass.move_count(), 4 * 4 + 3);
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
            assert_eq!(plan.path.len(), 1, "{wall} {width} {strategy:?}");
            let pass = plan.path.pass(0);
            assert!(pass.moves().eq([Move::Line]), "{wall} {width} {strategy:?}");
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
fn assert_round(pass: &meltpath_toolpath::Pass<'_>, count: std::ops::RangeInclusive<usize>) {
    let moves: Vec<_> = pass.moves().collect();
    let arcs = moves.iter().filter(|m| **m != Move::Line).count();
    assert!(
        count.contains(&arcs) && arcs == pass.move_count(),
        "{moves:?}"
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
        assert_eq!(plan.path.len(), 1);
        assert_round(&plan.path.pass(0), 2..=4);
        for p in deposit_points(&plan) {
            assert!((p.length() - 36.75).abs() < 0.08, "{}", p.length());
        }
    }
    // and on nested contours
    for radius in [20.0_f64, 60.0] {
        let n = (std::f64::consts::PI / (1.0 - 0.05 / radius).acos()).ceil() as u32;
        let disc = solid(outlines::ring(radius, 5.0, n).outer);
        let plan = plan(&[disc], HYBRID);
        assert_eq!(plan.path.pass(0).head.role, Role::Contour);
        assert_round(&plan.path.pass(0), 2..=4);
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
        assert_eq!(plan.path.len(), 1, "{name}");
        let pass = plan.path.pass(0);
        assert!(pass.is_closed(), "{name}");
        assert!(pass.move_count() <= most, "{name}: {pass:?}");
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
        assert_eq!(ring.path.len(), 1);
        let pass = ring.path.pass(0);
        assert!(pass.is_closed());
        assert!(
            (pass.length() - std::f64::consts::TAU * 36.75).abs() < 0.1,
            "{}",
            pass.length()
        );
        assert_round(&pass, 2..=4);
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
        assert_eq!(frame.path.len(), 1);
        assert!(frame.path.pass(0).is_closed());
        assert!(
            (frame.path.pass(0).length() - 2.0 * (80.0 + 50.0 - 13.2)).abs() < 0.1,
            "{}",
            frame.path.pass(0).length()
        );
    }
}
