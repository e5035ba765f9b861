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

/// The unit tool axis of W, P, R in degrees, from the work towards the tool.
pub(crate) fn axis_of_wpr(wpr_degrees: [f64; 3]) -> DVec3 {
    pose(DVec3::ZERO, wpr_degrees).tool_axis()
}

/// The pose of mm and degrees.
pub(crate) fn pose(position: DVec3, wpr_degrees: [f64; 3]) -> Pose {
    Pose::from_wpr(
        position,
        DVec3::from_array(wpr_degrees.map(f64::to_radians)),
    )
}

/// Orientations are written and read in steps of this, deg: what is written is read as the same.
const STEP: f64 = 1e-4;

fn stepped(wpr_degrees: [f64; 3]) -> [f64; 3] {
    wpr_degrees.map(|angle| (angle / STEP).round() * STEP)
}

/// The unit quaternion of W, P, R in degrees, its real part first and not below zero.
pub(crate) fn quaternion_of(wpr_degrees: [f64; 3]) -> [f64; 4] {
    let q = pose(DVec3::ZERO, stepped(wpr_degrees))
        .orientation
        .normalize();
    let q = [q.w, q.x, q.y, q.z];
    let first = q.iter().find(|v| v.abs() > 1e-9);
    if first.is_some_and(|v| *v < 0.0) {
        q.map(|v| -v)
    } else {
        q
    }
}

/// W, P, R in degrees of a quaternion, its real part first; nothing where it is none.
pub(crate) fn wpr_of_quaternion([w, x, y, z]: [f64; 4]) -> Option<[f64; 3]> {
    let q = DQuat::from_xyzw(x, y, z, w);
    let length = q.length();
    (length.is_finite() && (length - 1.0).abs() < 0.1).then(|| {
        let pose = Pose {
            position: DVec3::ZERO,
            orientation: q.normalize(),
        };
        stepped(pose.wpr().to_array().map(f64::to_degrees))
    })
}

/// The rotation vector of W, P, R in degrees, rad.
pub(crate) fn rotation_vector_of(wpr_degrees: [f64; 3]) -> [f64; 3] {
    let [w, x, y, z] = quaternion_of(wpr_degrees);
    let axis = DVec3::new(x, y, z);
    let sine = axis.length();
    if sine < 1e-12 {
        return [0.0; 3];
    }
    (axis / sine * (2.0 * sine.atan2(w))).to_array()
}

/// W, P, R in degrees of a rotation vector, rad; nothing where it is not finite.
pub(crate) fn wpr_of_rotation_vector(vector: [f64; 3]) -> Option<[f64; 3]> {
    let vector = DVec3::from_array(vector);
    if !vector.is_finite() {
        return None;
    }
    let half = 0.5 * vector.length();
    let axis = vector.normalize_or_zero() * half.sin();
    wpr_of_quaternion([half.cos(), axis.x, axis.y, axis.z])
}

/// rx, ry, rz in degrees of W, P, R in degrees: about x, then about the new y, then about the newest z.
pub(crate) fn xyz_of_wpr(wpr_degrees: [f64; 3]) -> [f64; 3] {
    let turned = pose(DVec3::ZERO, stepped(wpr_degrees))
        .orientation
        .normalize();
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turned * axis);
    let level = x.x.hypot(y.x);
    let ry = z.x.atan2(level);
    // looking along x one turn stands for both
    let [rx, rz] = if level > 1e-9 {
        [(-z.y).atan2(z.z), (-y.x).atan2(x.x)]
    } else {
        [0.0, x.y.atan2(y.y)]
    };
    [rx, ry, rz].map(|angle| {
        let degrees = (angle.to_degrees() * 1e8).round() / 1e8;
        if degrees <= -180.0 { 180.0 } else { degrees }
    })
}

/// W, P, R in degrees of rx, ry, rz in degrees; nothing where they are not finite.
pub(crate) fn wpr_of_xyz(xyz_degrees: [f64; 3]) -> Option<[f64; 3]> {
    let [x, y, z] = xyz_degrees.map(f64::to_radians);
    let q = DQuat::from_rotation_x(x) * DQuat::from_rotation_y(y) * DQuat::from_rotation_z(z);
    wpr_of_quaternion([q.w, q.x, q.y, q.z])
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

    proptest! {
        #[test]
        fn orientations_survive_the_digits_of_files(w in -180.0..180.0, p in -90.0..90.0, r in -180.0..180.0) {
            let asked = pose(DVec3::ZERO, [w, p, r]).orientation;
            let digits = |v: f64| (v * 1e10).round() / 1e10;
            let q = quaternion_of([w, p, r]).map(digits);
            let v = rotation_vector_of([w, p, r]).map(digits);
            let e = xyz_of_wpr([w, p, r]);
            for found in [wpr_of_quaternion(q).unwrap(), wpr_of_rotation_vector(v).unwrap(), wpr_of_xyz(e).unwrap()] {
                prop_assert!(pose(DVec3::ZERO, found).orientation.angle_between(asked) < 1e-3_f64.to_radians());
            }
            let again = quaternion_of(wpr_of_quaternion(q).unwrap()).map(digits);
            prop_assert_eq!(again, q);
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
