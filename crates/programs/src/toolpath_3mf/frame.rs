//! The tool at a point, as a quaternion of the extension and as axis and turn.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

/// Half a turn about x: from z towards the tool to z towards the part.
const FLIP: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);
/// Shortest quaternion that is taken for an orientation.
const SHORTEST: f64 = 1e-12;

/// The quaternion of a tool with the unit `axis` from the part towards it, turned about that axis by `turn` rad; its real part not below zero.
pub(super) fn quaternion(axis: DVec3, turn: f64) -> DQuat {
    let torch = Pose::of_tool(DVec3::ZERO, axis, turn).orientation;
    let q = (torch * FLIP.inverse()).normalize();
    if q.w < 0.0 { -q } else { q }
}

/// Axis and turn, rad, of a quaternion of any length; nothing where it has none.
pub(super) fn axis_and_turn(q: DQuat) -> Option<(DVec3, f64)> {
    let length = q.length();
    if !(length.is_finite() && length > SHORTEST) {
        return None;
    }
    let q = q.normalize();
    let torch = Pose {
        position: DVec3::ZERO,
        orientation: q * FLIP,
    };
    Some((torch.tool_axis(), torch.turn()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The figure of the specification: z of the local frame points from the path to the tool, x along the build's for one that stands upright.
    #[test]
    fn an_upright_torch_is_the_identity() {
        assert!(quaternion(DVec3::Z, 0.0).angle_between(DQuat::IDENTITY) < 1e-12);
        let (axis, turn) = axis_and_turn(DQuat::from_rotation_y(0.3)).unwrap();
        assert!(axis.distance(DVec3::new(0.3_f64.sin(), 0.0, 0.3_f64.cos())) < 1e-12);
        assert!(turn.abs() < 1e-12);
    }

    #[test]
    fn what_has_no_length_is_no_orientation() {
        for q in [
            [0.0; 4],
            [f64::NAN, 0.0, 0.0, 1.0],
            [1e300, 0.0, 0.0, 1e300],
        ] {
            assert_eq!(axis_and_turn(DQuat::from_array(q)), None);
        }
    }

    proptest! {
        #[test]
        fn axis_and_turn_come_back(x in -1.0..1.0, y in -1.0..1.0, z in -0.9..1.0, turn in -3.1..3.1, scale in 0.01..100.0f64) {
            prop_assume!(DVec3::new(x, y, z).length() > 0.1);
            let axis = DVec3::new(x, y, z).normalize();
            let q = quaternion(axis, turn);
            prop_assert!((q * DVec3::Z).distance(axis) < 1e-9);
            let scaled = DQuat::from_array(q.to_array().map(|v| v * scale));
            let (again, turned) = axis_and_turn(scaled).unwrap();
            prop_assert!(again.distance(axis) < 1e-9);
            let off = (turned - turn).rem_euclid(std::f64::consts::TAU);
            prop_assert!(off.min(std::f64::consts::TAU - off) < 1e-7);
        }
    }
}
