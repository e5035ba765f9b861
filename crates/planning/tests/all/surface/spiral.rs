//! One bead that winds up closed walls, from cones to bent tubes, and walls that have none.

use super::*;
use meltpath_planning::Paces;
use meltpath_planning::surface::{
    Base, Pace, SpiralError, SurfacePoint, paced_layers, plan_mesh, wound,
};
use meltpath_toolpath::Role;
use proptest::prelude::*;

const HEIGHT: f64 = 1.5;

fn pace() -> Pace {
    Pace {
        grown: HEIGHT,
        power: 1.0 / (1.0 - 0.345),
        paces: Paces {
            nominal: 12.5,
            slowest: 0.5,
            fastest: 2.0,
        },
        known: [3.0, 25.0],
        shortest: 3.0,
    }
}

fn passes(mesh: &Mesh) -> Vec<SurfacePass> {
    let base = Base::Plane {
        origin: DVec3::ZERO,
        normal: DVec3::Z,
    };
    let settings = SurfaceSettings {
        strategy: SurfaceStrategy::Distance,
        spacing: HEIGHT,
        chord_error: 0.02,
    };
    plan_mesh(mesh, &base, &settings).unwrap().passes
}

/// A cone whose radius goes from one to the other over its height.
fn cone([low, high]: [f64; 2], tall: f64) -> Mesh {
    shapes::tube(40, 180, |s, t| {
        let (sin, cos) = (TAU * t).sin_cos();
        let radius = low + (high - low) * s;
        DVec3::new(radius * cos, radius * sin, tall * s)
    })
}

/// A tube of 12 mm radius, bent by `angle` rad about a circle of 40 mm.
fn bent(angle: f64) -> Mesh {
    shapes::tube(80, 180, |s, t| {
        let ((sin, cos), (up, out)) = ((TAU * t).sin_cos(), (angle * s).sin_cos());
        let far = 40.0 + 12.0 * cos;
        DVec3::new(far * out - 40.0, 12.0 * sin, far * up)
    })
}

/// What every spiral keeps: one bead of one identifier that never jumps, no thicker or thinner than speeds lay.
fn sound(turns: &[SurfacePass]) {
    for pair in turns.windows(2) {
        assert!(pair[1].goes_on_from(&pair[0]), "{}", pair[1].number);
        assert_eq!(pair[1].number, pair[0].number + 1);
    }
    let [thin, thick] = pace().able();
    for turn in turns {
        for point in &turn.points {
            let thickness = point.spacing().unwrap();
            assert!(
                (thin..thick).contains(&thickness),
                "{} {thickness}",
                turn.number
            );
        }
    }
    let layers = paced_layers(turns, &upwards(TorchRule::Tangent), HEIGHT, |_| {
        (Role::Contour, &[])
    });
    let beads: Vec<_> = layers
        .iter()
        .flat_map(meltpath_toolpath::Layer::passes)
        .collect();
    for pair in beads.windows(2) {
        assert_eq!(pair[0].head.id, pair[1].head.id);
        assert_eq!(pair[0].points.last(), pair[1].points.first());
        assert_eq!(pair[0].axis(pair[0].points.len() - 1), pair[1].axis(0));
    }
}

/// Area that the bead covers as thick as it lies, mm².
fn covered(turns: &[SurfacePass]) -> f64 {
    let pairs = turns.iter().flat_map(|t| t.points.windows(2));
    let thick = |p: &SurfacePoint| p.spacing().unwrap();
    let middle = |p: &SurfacePoint| 0.5 * (p.position + p.from.unwrap());
    pairs
        .map(|p| middle(&p[0]).distance(middle(&p[1])) * 0.5 * (thick(&p[0]) + thick(&p[1])))
        .sum()
}

#[test]
fn a_bead_winds_up_a_cone() {
    let passes = passes(&cone([30.0, 20.0], 24.0));
    let turns = wound(&passes, &pace(), HEIGHT).unwrap();
    sound(&turns);
    // on the cone, and never down
    let mut high = 0.0;
    for p in turns.iter().flat_map(|t| &t.points) {
        let radius = p.position.truncate().length();
        let wanted = 30.0 - p.position.z * 10.0 / 24.0;
        assert!((radius - wanted).abs() < 0.05, "{radius} {wanted}");
        assert!(p.position.z > high - 1e-3, "{} {high}", p.position.z);
        high = p.position.z.max(high);
    }
    // its top is that of the last pass, and between its ramps it is as thick as passes lie apart
    let top = passes.last().unwrap().points[0].position.z;
    assert!((high - top).abs() < 1e-3, "{high} {top}");
    for turn in &turns[2..turns.len() - 2] {
        for p in &turn.points[1..] {
            assert!((p.spacing().unwrap() / HEIGHT - 1.0).abs() < 0.01, "{p:?}");
        }
    }
    // the first turn rises from the thinnest to the thickest
    let first = &turns[0].points;
    let ends = [&first[0], first.last().unwrap()].map(|p| p.spacing().unwrap());
    assert!(ends[0] < 0.7 * HEIGHT && ends[1] > 1.5 * HEIGHT, "{ends:?}");
    // metal is what the wall takes, but for the last wedge
    let slant = HEIGHT * passes.len() as f64;
    let above = 30.0 - slant * 10.0 / 10.0_f64.hypot(24.0);
    let area = std::f64::consts::PI * (30.0 + above) * slant;
    let wedge = 0.5 * 0.67 * 0.67 * HEIGHT * TAU * above;
    let laid = covered(&turns);
    assert!(((laid + wedge) / area - 1.0).abs() < 0.01, "{laid} {area}");
}

#[test]
fn a_wall_that_is_no_ring_has_no_spiral() {
    let sheet = shapes::sheet(10, 20, |_, _| false, |i, k| DVec3::new(2.0 * k, 0.0, i));
    let refused = |mesh: &Mesh| wound(&passes(mesh), &pace(), HEIGHT).unwrap_err();
    assert!(matches!(refused(&sheet), SpiralError::Open { pass: 1, .. }));
    let low = cone([20.0, 20.0], 2.0);
    assert_eq!(refused(&low), SpiralError::Few);
    // two pipes side by side
    let mut two = cone([10.0, 10.0], 9.0);
    let mut other = two.clone();
    for p in &mut other.vertices {
        p.x += 60.0;
    }
    two.add(&other);
    let said = refused(&two);
    assert!(
        matches!(
            said,
            SpiralError::Pieces {
                pass: 1,
                count: 2,
                ..
            }
        ),
        "{said:?}"
    );
    assert!(said.to_string().contains("2 pieces"), "{said}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Bends lay passes that lean over each other: the bead stays on the tube, at the distance of its passes.
    #[test]
    fn a_bead_winds_up_bent_tubes(angle in 0.5..1.2_f64) {
        // the last ones run off the rim on the inside of the bend
        let all = passes(&bent(angle));
        let closed: Vec<SurfacePass> = all.into_iter().take_while(SurfacePass::is_closed).collect();
        let turns = wound(&closed, &pace(), HEIGHT).unwrap();
        sound(&turns);
        for p in turns.iter().flat_map(|t| &t.points) {
            let around = DVec2::new(p.position.x + 40.0, p.position.z).length() - 40.0;
            let radius = around.hypot(p.position.y);
            prop_assert!((radius - 12.0).abs() < 0.06, "{}", radius);
        }
        let inner = &turns[2..turns.len() - 2];
        for p in inner.iter().flat_map(|t| &t.points[1..]) {
            prop_assert!((p.spacing().unwrap() / HEIGHT - 1.0).abs() < 0.05, "{:?}", p);
        }
    }
}
