//! CONFIG and poses as FANUC's controllers show them.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_robot::kinematics::numeric::distance;
use meltpath_robot::kinematics::{Arm, Geometry, OrthoParallel};

use super::shipped;

/// A FANUC arm of other lengths than the ARC Mate's; its base in the height of the second axis, as in the controller's world.
pub(super) fn fanuc(lengths: OrthoParallel) -> Arm {
    let mut arm = shipped("fanuc-arcmate-120ic").arm;
    let limits: Vec<_> = arm.chain.joints.iter().map(|j| j.limits).collect();
    arm.chain = lengths.chain(limits.try_into().unwrap());
    arm.geometry = Geometry::SphericalWrist(lengths);
    arm
}

pub(super) fn arcmate() -> OrthoParallel {
    match shipped("fanuc-arcmate-120ic").arm.geometry {
        Geometry::SphericalWrist(lengths) => lengths,
        _ => panic!("a spherical wrist"),
    }
}

#[test]
fn a_controller_shows_these_poses_and_configurations() {
    let arm = fanuc(OrthoParallel {
        a1: 75.0,
        a2: -215.0,
        c1: 0.0,
        c2: 840.0,
        c3: 890.0,
        c4: 90.0,
        ..arcmate()
    });
    let mut rows = 0;
    for line in include_str!("controllers.csv").lines().skip(1) {
        let [joints, config, pose] = line.split('|').collect::<Vec<_>>().try_into().unwrap();
        let six = |text: &str| -> [f64; 6] {
            let n: Vec<f64> = text.split(',').map(|n| n.parse().unwrap()).collect();
            n.try_into().unwrap()
        };
        let joints = arm.joints(six(joints).map(f64::to_radians));
        let [x, y, z, w, p, r] = six(pose);
        let wpr = DVec3::new(w, p, r) * 1.0_f64.to_radians();
        let shown = Pose::from_wpr(DVec3::new(x, y, z), wpr);
        let [off, turned] = distance(arm.forward(joints), shown);
        assert!(
            off < 1e-3 && turned < 2e-5,
            "{line}: {off} mm, {turned} rad"
        );
        assert_eq!(
            arm.configuration(joints).unwrap().to_string(),
            config,
            "{line}"
        );
        rows += 1;
    }
    assert_eq!(rows, 16);
}

/// Half a turn is of the next turn, as on the controller.
#[test]
fn turns_change_at_half_a_turn() {
    let arm = fanuc(arcmate());
    let of = |j6: f64| {
        let joints = [0.0, 0.0, 0.0, 0.0, -1.0, j6.to_radians()];
        arm.configuration(joints).unwrap().turns[2]
    };
    let found = [-180.0, -179.9, 0.0, 179.9, 180.0, 359.0, 540.0].map(of);
    assert_eq!(found, [-1, 0, 0, 0, 1, 1, 2]);
}
