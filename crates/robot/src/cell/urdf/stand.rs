//! Which way an arm stands: its base lies on the first axis, and is turned so that this axis stands upright in it and the upper arm works above,
//! as makers draw their arms. Whatever hangs or leans then hangs or leans by its base, and the words for configurations are the maker's.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

use super::way::{End, Movable, UrdfArm};

/// A turn smaller than this is rounding of the file, rad.
const ROUNDED: f64 = 1e-5;
/// With its second joint in the middle of its limits an upper arm points up at least as far as this (the cosine), or down: else it tells
/// nothing.
const TELLS: f64 = 0.5;
/// A first axis nearer to the base's origin goes through it, mm: files carry six digits of a metre.
const ASIDE: f64 = 1e-2;
/// Half a turn about x.
const HANGING: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);

/// The same arm with its base on the first axis, and so that up is z.
pub(super) fn upright(arm: UrdfArm) -> UrdfArm {
    let Some(up) = up(&arm.joints) else {
        return arm;
    };
    let hangs = if up.z < 0.0 { HANGING } else { DQuat::IDENTITY };
    let leans = DQuat::from_rotation_arc(DVec3::Z, (hangs.inverse() * up).normalize_or(DVec3::Z));
    let small = leans.angle_between(DQuat::IDENTITY) < ROUNDED;
    let turn = if small { hangs } else { hangs * leans };
    let Some(first) = arm.joints.first().map(|j| j.parent_from_joint.position) else {
        return arm;
    };
    let beside = first - up * first.dot(up);
    // the base lies on the first axis; where the shoulder is below it, it is not the arm's, and the first joint is the nearest that is known
    let position = if shoulder(&arm.joints).is_some_and(|s| s.dot(up) < -ASIDE) {
        first
    } else if beside.length() > ASIDE {
        beside
    } else {
        DVec3::ZERO
    };
    let base = Pose {
        position,
        orientation: turn,
    };
    if base == Pose::IDENTITY {
        return arm;
    }
    let mut joints = arm.joints;
    if let Some(first) = joints.first_mut() {
        first.parent_from_joint = base.inverse().then(first.parent_from_joint);
    }
    UrdfArm {
        root_from_base: arm.root_from_base.then(base),
        joints,
        ..arm
    }
}

/// Where the second joint lies in the base, all joints at zero, mm.
fn shoulder(joints: &[Movable]) -> Option<DVec3> {
    let [first, second] = joints.first_chunk()?;
    Some(
        first
            .parent_from_joint
            .then(second.parent_from_joint)
            .position,
    )
}

/// Which end of the first axis is up, in the base: where the upper arm points in the middle of its limits; where that tells nothing, up is up in
/// the base, too.
fn up(joints: &[Movable]) -> Option<DVec3> {
    let [first, second, third] = joints.first_chunk()?;
    let axis = first.parent_from_joint.orientation * first.axis;
    let middle = DQuat::from_axis_angle(second.axis, 0.5 * (second.low + second.high));
    let to_second = first.parent_from_joint.then(second.parent_from_joint);
    let upper = to_second.orientation * (middle * third.parent_from_joint.position);
    let points = upper.normalize_or_zero().dot(axis);
    let told = match second.end {
        End::AtLimits if points.abs() > TELLS => points,
        End::AtLimits | End::Nowhere => axis.z,
    };
    Some(if told < 0.0 { -axis } else { axis })
}
