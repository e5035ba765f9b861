//! The acceptance cases on the toric tube of Campocasso 2017.

use super::*;
use meltpath_planning::surface::{Base, evenness, nearest_spacing, plan_mesh};

/// The point of pass `number` at the source's v in degrees, if it has one.
fn point(passes: &[SurfacePass], number: u32, v: f64) -> Option<DVec3> {
    let wanted = DVec2::from_angle(v.to_radians());
    let points = numbered(passes, number).into_iter().flat_map(|p| &p.points);
    let mut at = points.map(|p| p.position).filter(|p| {
        let v = parameters(*p).y;
        DVec2::from_angle(v).distance(wanted) < 1e-9
    });
    at.next()
}

const SIDES: [f64; 3] = [0.0, 90.0, 180.0];

#[test]
fn multiaxis_ma1_the_step_of_the_parameter_differs_around_the_tube() {
    let passes = planned(SurfaceStrategy::Distance);
    for (v, wanted) in SIDES.into_iter().zip([4.4085, 5.7320, 8.1921]) {
        let mut before = 0.0;
        for number in 1..=10 {
            let u = parameters(point(&passes, number, v).unwrap())
                .x
                .to_degrees();
            assert!(
                (u - before - wanted).abs() < 1e-4,
                "pass {number} at {v}: {}",
                u - before
            );
            before = u;
        }
    }
}

#[test]
fn multiaxis_ma2_points_of_the_tenth_pass() {
    let passes = planned(SurfaceStrategy::Distance);
    let outer = point(&passes, 10, 0.0).unwrap();
    let inner = point(&passes, 10, 180.0).unwrap();
    assert!(
        outer.distance(DVec3::new(-3.3096, 0.0, 45.2217)) < 1e-3,
        "{outer}"
    );
    assert!(
        inner.distance(DVec3::new(-45.0811, 0.0, 34.6527)) < 1e-3,
        "{inner}"
    );
}

#[test]
fn multiaxis_ma3_passes_beyond_the_end_are_trimmed() {
    let passes = planned(SurfaceStrategy::Distance);
    for (v, wanted) in SIDES.into_iter().zip([20, 15, 10]) {
        let count = (1..=30).filter(|n| point(&passes, *n, v).is_some()).count();
        assert_eq!(count, wanted, "at {v}");
    }
    for pass in &passes {
        assert_eq!(pass.is_closed(), pass.number <= 10, "pass {}", pass.number);
        let top = pass.points.iter().map(|p| parameters(p.position).x);
        assert!(top.clone().fold(0.0, f64::max) < FRAC_PI_2 + 1e-9);
        if pass.number > 10 {
            // both ends lie on the end of the tube
            let ends = [pass.points[0], pass.points[pass.points.len() - 1]];
            let short = ends.map(|p| FRAC_PI_2 - parameters(p.position).x);
            assert!(
                short.iter().all(|s| *s < 1e-4),
                "pass {}: {short:?}",
                pass.number
            );
            assert_eq!(numbered(&passes, pass.number).len(), 1);
        }
    }
}

#[test]
fn multiaxis_ma4_parallel_planes_lose_part_of_the_pass() {
    let passes = planned(PLANES);
    for (v, wanted) in [(0.0, 27.486), (180.0, 58.997)] {
        let p = point(&passes, 6, v).unwrap();
        assert!((parameters(p).x.to_degrees() - wanted).abs() < 1e-3);
        assert!((p.z - 30.0).abs() < 1e-9);
    }
    assert!(point(&passes, 10, 0.0).is_some());
    assert_eq!(point(&passes, 10, 180.0), None);
    // whole below R - r = 35 mm, open above it, up to R + r = 65 mm
    for pass in passes.iter().filter(|p| p.number != 7) {
        assert_eq!(pass.is_closed(), pass.number < 7, "pass {}", pass.number);
    }
    assert_eq!(passes.last().unwrap().number, 12);
    // on the mesh the planes are the same
    let base = Base::Plane {
        origin: DVec3::ZERO,
        normal: DVec3::Z,
    };
    let meshed = plan_mesh(&torus_mesh(0.02), &base, &settings(PLANES)).unwrap();
    for number in (1..=12).filter(|n| *n != 7) {
        for pass in numbered(&meshed.passes, number) {
            for p in &pass.points {
                assert!((p.position.z - STEP * f64::from(number)).abs() < 1e-9);
                let lines = numbered(&passes, number).into_iter();
                let off = lines
                    .map(|l| distance(p.position, l))
                    .fold(f64::INFINITY, f64::min);
                // 0.02 mm across the surface are more along it where it lies flatter
                assert!(off < 0.1, "pass {number}: {off}");
            }
        }
    }
}

/// Farthest that the distance of passes from the one before is from the step, over ten places of every segment.
fn worst(passes: &[SurfacePass]) -> f64 {
    let mut worst = 0.0_f64;
    for pass in passes.iter().filter(|p| p.number > 1) {
        let before = numbered(passes, pass.number - 1);
        for pair in pass.points.windows(2) {
            for k in 0..10 {
                let p = pair[0].position.lerp(pair[1].position, f64::from(k) / 10.0);
                let near = before.iter().map(|b| distance(p, b));
                worst = worst.max((near.fold(f64::INFINITY, f64::min) - STEP).abs());
            }
        }
    }
    worst
}

#[test]
fn multiaxis_ma5_the_distance_is_constant_on_surface_and_mesh() {
    // from the point of the same parameter, as the source has it
    let exact = planned(SurfaceStrategy::Distance);
    let even = evenness(&exact, STEP, 1e-6).unwrap();
    assert!(even.beyond == 0.0, "{even:?}");
    assert!(even.deviation.value < 1e-9);
    // on the mesh from the nearest point
    let base = Base::Plane {
        origin: DVec3::ZERO,
        normal: DVec3::Z,
    };
    for tolerance in [0.5, 0.1, 0.02] {
        let mesh = torus_mesh(tolerance);
        let found = plan_mesh(&mesh, &base, &settings(SurfaceStrategy::Distance)).unwrap();
        let worst = worst(&found.passes);
        // 0.0024, 0.0012, 0.0010 mm
        assert!(
            worst < 0.01 * tolerance + 2e-3 && worst < tolerance + 1e-3,
            "{tolerance}: {worst}"
        );
        // the distance over the parameter is the nearest one where the tube is symmetric: eq. 3 holds at its inner side, and at its
        // outer side until the ways around meet there
        let ring = |number: u32, v: f64| {
            let step = 2.0 * (STEP / 2.0 / (50.0 + 15.0 * v.cos())).asin();
            eq1(f64::from(number) * step, v)
        };
        for number in 1..=9 {
            for v in [0.0, TAU / 2.0] {
                let lines = numbered(&found.passes, number).into_iter();
                let off = lines.map(|l| distance(ring(number, v), l));
                let off = off.fold(f64::INFINITY, f64::min);
                assert!(
                    off < 1.5 * tolerance + 1e-3,
                    "{tolerance}, pass {number} at {v}: {off}"
                );
            }
        }
        assert_eq!(found.unreached, 0.0);
    }
}

/// What eq. 3 does not say: passes that lean over each other lie closer than the step, as the nearest place is not that of the same
/// parameter.
#[test]
fn passes_at_one_distance_over_the_parameter_lie_closer_where_they_lean() {
    let exact = planned(SurfaceStrategy::Distance);
    let whole: Vec<SurfacePass> = exact.into_iter().filter(|p| p.number <= 10).collect();
    let near = nearest_spacing(&whole, STEP).unwrap();
    assert!((near.least.value - 3.543).abs() < 1e-2 && near.least.pass == 10);
    assert!((near.greatest.value - STEP).abs() < 1e-6);
}

#[test]
fn multiaxis_ma6_lines_of_a_parameter_are_told_as_uneven() {
    let passes = planned(SurfaceStrategy::Parameter);
    let even = evenness(&passes, STEP, 0.5).unwrap();
    assert!((even.ratio.value - 65.0 / 35.0).abs() < 1e-6, "{even:?}");
    assert!((even.spacing.greatest.value - STEP).abs() < 1e-9);
    assert!(even.beyond > 0.5, "{}", even.beyond);
    // the worst place is inside the bend
    let worst = parameters(even.deviation.position).y.to_degrees();
    assert!((worst - 180.0).abs() < 1e-6);
    assert_eq!(passes.len(), 20);
    assert!(passes.iter().all(SurfacePass::is_closed));
    // parallel planes are uneven, too
    let planes = evenness(&planned(PLANES), STEP, 0.5).unwrap();
    assert!(planes.beyond > 0.0 && planes.spacing.greatest.value > 2.0 * STEP);
}
