//! How the torch is held along passes on the torus, and what becomes of the passes in a toolpath.

use super::*;
use meltpath_planning::surface::{Torch, TorchRule, layers, tilts, torch_axes};

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
    let torch = Torch::upwards;
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
        ..Torch::upwards(TorchRule::Half)
    };
    each(&torch, |uv, axis| {
        assert!(axis.distance(turned(most.min(0.5 * uv.x))) < 1e-9);
    });
    let tilt = tilts(&passes(), &torch).unwrap();
    assert!((tilt.greatest.value - most).abs() < 1e-9);
    let free = tilts(&passes(), &Torch::upwards(TorchRule::Half)).unwrap();
    assert!(
        free.greatest.value > 44_f64.to_radians() && free.greatest.value <= 45_f64.to_radians()
    );
}

#[test]
fn a_torch_that_pushes_points_its_wire_ahead() {
    let lead = 10_f64.to_radians();
    let torch = Torch {
        lead,
        ..Torch::upwards(TorchRule::Tangent)
    };
    for pass in passes() {
        let axes = torch_axes(&pass, &torch);
        let plain = torch_axes(&pass, &Torch::upwards(TorchRule::Tangent));
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
    let layers = layers(&passes, &Torch::upwards(TorchRule::Half), STEP);
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
