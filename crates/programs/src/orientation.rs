//! Between tool axes and the W, P, R angles of programs.

use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_geometry::pose::Pose;

/// W, P, R in degrees of a tool whose axis lies along `axis`, reached from the default orientation by the shortest turn.
pub(crate) fn wpr_of_axis(default_degrees: [f64; 3], axis: DVec3) -> [f64; 3] {
    let default = pose(DVec3::ZERO, default_degrees);
    let turn = DQuat::from_rotation_arc(default.tool_axis(), axis.normalize_or(DVec3::Z));
    if turn.angle_between(DQuat::IDENTITY) < 1e-6 {
        return default_degrees;
    }
    let turned = Pose {
        position: DVec3::ZERO,
        orientation: turn * default.orientation,
    };
    turned.wpr().to_array().map(f64::to_degrees)
}

/// The pose of mm and degrees.
pub(crate) fn pose(position: DVec3, wpr_degrees: [f64; 3]) -> Pose {
    Pose::from_wpr(
        position,
        DVec3::from_array(wpr_degrees.map(f64::to_radians)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_tool_points_along_its_axis(x in -1.0..1.0, y in -1.0..1.0, z in 0.0..1.0) {
            let axis = DVec3::new(x, y, z + 0.01).normalize();
            let wpr = wpr_of_axis([180.0, 0.0, 0.0], axis);
            prop_assert!(pose(DVec3::ZERO, wpr).tool_axis().distance(axis) < 1e-9);
        }
    }

    #[test]
    fn the_default_is_kept_as_written() {
        assert_eq!(
            wpr_of_axis([180.0, 0.0, 35.0], DVec3::Z),
            [180.0, 0.0, 35.0]
        );
    }
}
