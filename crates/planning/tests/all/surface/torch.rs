//! How the torch is held along passes on the torus, and what becomes of the passes in a toolpath.

use super::*;
use meltpath_planning::surface::{SurfacePoint, paced_layers, tilts, torch_axes};
use meltpath_toolpath::Role;

fn passes() -> Vec<SurfacePass> {
    planned(SurfaceStrategy::Distance)
}

/// Every point with its axis.
fn each(torch: &Torch, mut check: impl FnMut(DVec2, DVec3)) {
    for pass in passes() {
        for (p, axis) in pass.points.iter().zip(torch_axes(&pass, torch)) {
            assert!(axis.is_normalized());
            check(parameters(p.position), axis);
        }
    }
}

/// The turn of the build direction about the axis of the bend.
fn turned(angle: f64) -> DVec3 {
    DVec3::new(-angle.sin(), 0.0, angle.cos())
}

#[test]
fn the_rules_of_the_source_hold_on_the_torus() {
    let torch = upwards;
    each(&torch(TorchRule::Half), |uv, axis| {
        assert!(axis.distance(turned(0.5 * uv.x)) < 1e-9);
    });
    each(&torch(TorchRule::Tangent), |uv, axis| {
        assert!(axis.distance(turned(uv.x)) < 1e-9);
    });
    each(&torch(TorchRule::Fixed), |_, axis| {
        assert_eq!(axis, DVec3::Z);
    });
}

#[test]
fn the_torch_leans_no_farther_than_it_may() {
    let most = 20_f64.to_radians();
    let torch = Torch {
        greatest_tilt: most,
        ..upwards(TorchRule::Half)
    };
    each(&torch, |uv, axis| {
        assert!(axis.distance(turned(most.min(0.5 * uv.x))) < 1e-9);
    });
    let tilt = tilts(&passes(), &torch).unwrap();
    assert!((tilt.greatest.value - most).abs() < 1e-9);
    let free = tilts(&passes(), &upwards(TorchRule::Half)).unwrap();
    assert!(
        free.greatest.value > 44_f64.to_radians() && free.greatest.value <= 45_f64.to_radians()
    );
}

#[test]
fn a_torch_that_pushes_points_its_wire_ahead() {
    let lead = 10_f64.to_radians();
    let torch = Torch {
        lead,
        ..upwards(TorchRule::Tangent)
    };
    for pass in passes() {
        let axes = torch_axes(&pass, &torch);
        let plain = torch_axes(&pass, &upwards(TorchRule::Tangent));
        for (i, pair) in pass.points.windows(2).enumerate() {
            // the wire runs against the axis
            let ahead = pair[1].position - pair[0].position;
            assert!((plain[i] - axes[i]).dot(ahead) > 0.0);
        }
        for (led, axis) in axes.iter().zip(plain) {
            assert!((led.angle_between(axis) - lead).abs() < 1e-9);
        }
    }
}

#[test]
fn passes_become_layers_with_the_torch_at_every_point() {
    let passes = passes();
    let layers = paced_layers(&passes, &upwards(TorchRule::Half), STEP, |_| {
        (Role::Contour, &[])
    });
    assert_eq!(layers.len(), 20);
    let mut ids = Vec::new();
    for layer in &layers {
        layer.sanity_check().unwrap();
        for pass in layer.passes() {
            ids.push(pass.head.id);
            assert!((0..pass.points.len()).all(|i| pass.axis(i).is_some()));
        }
    }
    ids.dedup();
    assert_eq!(ids.len(), passes.len());
    // the wire's tip goes over what each pass is laid on: the base at first, then the pass before
    let below =
        |p: &SurfacePass| -> Vec<DVec3> { p.points.iter().filter_map(|p| p.from).collect() };
    let laid = layers.iter().flat_map(meltpath_toolpath::Layer::passes);
    for (pass, laid) in passes.iter().zip(laid) {
        assert_eq!(laid.points, below(pass));
    }
    assert!(below(&passes[0]).iter().all(|p| p.z.abs() < 1e-9));
    assert!(
        below(&passes[1])
            .iter()
            .all(|p| distance(*p, &passes[0]) < 1e-2)
    );
}

/// Around a sharp corner the torch turns over the length that is given, and nowhere else.
#[test]
fn a_torch_turns_evenly_at_a_kink() {
    let point = |x: f64, growth: DVec3| SurfacePoint {
        position: DVec3::new(x, 0.0, 0.0),
        normal: DVec3::Y,
        growth,
        from: None,
    };
    let leaning = |angle: f64| DVec3::new(0.0, angle.sin(), angle.cos());
    let pass = SurfacePass {
        number: 1,
        points: (0..=400_u32)
            .map(|i| point(0.1 * f64::from(i), leaning(if i < 200 { 0.0 } else { 0.6 })))
            .collect(),
    };
    let torch = Torch {
        even: 8.0,
        ..upwards(TorchRule::Tangent)
    };
    let axes = torch_axes(&pass, &torch);
    let angle = |i: usize| axes[i].y.atan2(axes[i].z);
    assert!(angle(0).abs() < 1e-12 && angle(150).abs() < 1e-12);
    assert!((angle(250) - 0.6).abs() < 1e-12 && (angle(400) - 0.6).abs() < 1e-12);
    assert!((angle(200) - 0.3).abs() < 0.01, "{}", angle(200));
    let steepest = (1..=400).map(|i| angle(i) - angle(i - 1));
    assert!(steepest.fold(0.0, f64::max) < 1.1 * 0.6 / 80.0);
}

/// On a closed pass the mean goes on over the seam: the rule of the torus stays, wherever a pass begins.
#[test]
fn an_even_torch_knows_no_seam() {
    let torch = Torch {
        even: 6.0,
        ..upwards(TorchRule::Half)
    };
    let pass = passes().into_iter().find(SurfacePass::is_closed).unwrap();
    let mut turned = pass.clone();
    turned.points.pop();
    let third = turned.points.len() / 3;
    turned.points.rotate_left(third);
    turned.points.push(turned.points[0]);
    let [a, b] = [&pass, &turned].map(|p| torch_axes(p, &torch));
    for i in 0..third {
        assert!(a[third + i].distance(b[i]) < 1e-9);
    }
    // what is even already is hardly changed
    let own = torch_axes(&pass, &upwards(TorchRule::Half));
    for (even, own) in a.iter().zip(own) {
        assert!(even.distance(own) < 1e-3);
    }
}
