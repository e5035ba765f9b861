//! CONFIG and poses as FANUC's controllers show them.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_numerics::random::Random;
use meltpath_robot::cell::{Maker, Stance};
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

/// Joints within limits by chance, and how the arm stands.
fn stances(name: &str, count: usize) -> Vec<([f64; 6], Stance)> {
    let cell = shipped(name);
    let mut random = Random::new(7);
    let joints = |random: &mut Random| -> [f64; 6] {
        std::array::from_fn(|i| {
            let limits = cell.arm.chain.joints[i].limits;
            random.between(limits.low, limits.high)
        })
    };
    let all = (0..count).map(|_| cell.arm.joints(joints(&mut random)));
    all.map(|q| (q, cell.stance(q).unwrap())).collect()
}

/// Status and turn that controllers have shown in published programs (five positions taught on KUKA's arms): the fifth axis is below
/// zero where bit 4 of the status is set, the third where bit 2 is not.
#[test]
fn kuka_positions_of_controllers_are_among_ours() {
    let ours: Vec<Stance> = stances("kuka-kr16-r2010-2", 20_000)
        .into_iter()
        .map(|(_, s)| s)
        .collect();
    for published in [
        "S 2, T 10",
        "S 6, T 27",
        "S 22, T 27",
        "S 22, T 59",
        "S 16, T 37",
    ] {
        let read = Stance::read(Maker::Kuka, published).unwrap();
        assert!(ours.contains(&read), "{published}");
    }
    let home = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0].map(f64::to_radians);
    let cell = shipped("kuka-kr16-r2010-2");
    assert_eq!(
        cell.stance(cell.arm.joints(home)).unwrap().to_string(),
        "S 2, T 2"
    );
}

/// What is said names one way among all that hold the pose, and reads back.
#[test]
fn a_stance_names_one_way() {
    for (name, maker) in [
        ("kuka-kr16-r2010-2", Maker::Kuka),
        ("abb-irb2600-12-185", Maker::Abb),
        ("yaskawa-ar2010", Maker::Yaskawa),
        ("staubli-rx60bl", Maker::Staubli),
    ] {
        let cell = shipped(name);
        for (joints, stance) in stances(name, 500) {
            assert_eq!(Stance::read(maker, &stance.to_string()), Some(stance));
            let ways = cell
                .arm
                .inverse(cell.arm.forward(joints))
                .unwrap()
                .solutions;
            let same = ways
                .iter()
                .filter(|w| cell.stance(w.angles) == Some(stance))
                .count();
            assert!(same <= 1 || ways.len() < 8, "{name} {joints:?} {stance}");
        }
    }
    let cell = shipped("abb-irb2600-12-185");
    let said = |degrees: [f64; 6]| {
        cell.stance(cell.arm.joints(degrees.map(f64::to_radians)))
            .unwrap()
            .to_string()
    };
    assert_eq!(said([10.0, 0.0, 0.0, 95.0, 30.0, -10.0]), "0,1,-1,0");
    assert_eq!(said([-100.0, 0.0, 0.0, -5.0, -30.0, 200.0]), "-2,-1,2,1");
    // of Yaskawa: the R axis turned by half a turn is no flip, and so in front of the S axis with the elbow up
    let cell = shipped("yaskawa-ar2010");
    let said = |degrees: [f64; 6]| {
        let stance = cell.stance(cell.arm.joints(degrees.map(f64::to_radians)));
        stance.unwrap().to_string()
    };
    assert_eq!(said([0.0, 0.0, 0.0, 0.0, -60.0, 0.0]), "0,0,0,0,0,0");
    assert_eq!(said([0.0, 0.0, 0.0, 90.0, -60.0, 0.0]), "0,0,0,0,0,0");
    assert_eq!(said([0.0, 0.0, 0.0, 91.0, -60.0, 200.0]), "1,0,0,0,1,0");
    assert_eq!(said([0.0, 0.0, 0.0, -90.0, -60.0, 0.0]), "1,0,0,0,0,0");
    let cell = shipped("abb-irb2600-12-185");
    let said = |degrees: [f64; 6]| {
        let stance = cell.stance(cell.arm.joints(degrees.map(f64::to_radians)));
        stance.unwrap().to_string()
    };
    // leaning back over the first axis
    assert_eq!(
        said([0.0, -80.0, -60.0, 0.0, 30.0, 0.0])
            .split(',')
            .next_back(),
        Some("4")
    );
}
