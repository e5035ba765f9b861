//! Arms against what stands outside: poses of an independent library, a real controller's record, data sheets' reach, searches.
mod adversarial;
mod batch;
mod configuration;
mod frames;
mod urdf;

use std::f64::consts::PI;

use meltpath_data::{find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};
use meltpath_numerics::random::Random;
use meltpath_robot::cell::{self, Cell};
use meltpath_robot::kinematics::numeric::{apart, distance, search};
use meltpath_robot::kinematics::{Arm, Geometry, OrthoParallel, Solution, Unreachable};

pub(crate) fn shipped(name: &str) -> Cell {
    cell::read(find(robots::ALL, name).unwrap().text).unwrap()
}

pub(crate) fn all() -> impl Iterator<Item = (&'static str, Arm)> {
    robots::ALL
        .iter()
        .map(|file| (file.name, shipped(file.name).arm))
}

/// Whatever an arm returns for a pose holds it, from the angles returned.
pub(crate) fn check(name: &str, arm: &Arm, pose: Pose) -> Vec<Solution> {
    let inverse = arm
        .inverse(pose)
        .unwrap_or_else(|why| panic!("{name}: {why} at {pose:?}"));
    assert!(
        inverse.all && (1..=8).contains(&inverse.solutions.len()),
        "{name}: {inverse:?}"
    );
    for solution in &inverse.solutions {
        let [off, turned] = distance(arm.forward(solution.angles), pose);
        // at the border of reach a pose may be beyond it by rounding
        let most = if solution.singular.elbow { 1e-6 } else { 1e-9 };
        assert!(
            off < most && turned < 1e-9,
            "{name}: {off:e} mm, {turned:e} rad of {solution:?}"
        );
    }
    inverse.solutions
}

pub(crate) fn anywhere(random: &mut Random) -> [f64; 6] {
    std::array::from_fn(|_| random.between(-PI, PI))
}

/// Joints (rad) and flange poses of a robot by yourdfpy 0.0.60, from the joints of the public URDFs and of the makers' drawings.
pub(crate) fn flange_poses(name: &str) -> impl Iterator<Item = ([f64; 6], Pose)> {
    let lines = include_str!("kinematics/flange-poses.csv").lines().skip(1);
    let of_robot = lines.filter_map(move |line| {
        let (robot, numbers) = line.split_once(',').unwrap();
        (robot == name).then_some(numbers)
    });
    of_robot.map(|numbers| {
        let n: Vec<f64> = numbers.split(',').map(|n| n.parse().unwrap()).collect();
        let pose = Pose {
            position: DVec3::from_slice(&n[6..9]),
            orientation: DQuat::from_mat3(&DMat3::from_cols_slice(&n[9..18])),
        };
        (n[..6].try_into().unwrap(), pose)
    })
}

#[test]
fn forward_chains_agree_with_an_independent_library() {
    let mut rows = 0;
    for (name, arm) in all() {
        for (joints, wanted) in flange_poses(name) {
            let [off, turned] = distance(arm.forward(joints), wanted);
            assert!(
                off < 1e-9 && turned < 1e-9,
                "{name}: {off:e} mm, {turned:e} rad"
            );
            rows += 1;
        }
    }
    assert_eq!(rows, 7 * 25);
}

/// A FANUC R-2000iB/165F's joints and pose as its controller showed them (onerobotics.com, The perils of six-axis robots, 2013):
/// lengths of its public URDF, a tool of 55 mm. The third joint is shown to the level: taken as it stands the pose is missed by far.
#[test]
fn a_fanuc_shows_its_third_joint_to_the_level() {
    let arm = configuration::fanuc(OrthoParallel {
        a1: 312.0,
        a2: -225.0,
        c1: 0.0,
        c2: 1075.0,
        c3: 1280.0,
        c4: 215.0 + 55.0,
        ..configuration::arcmate()
    });
    let degrees = |d: [f64; 6]| d.map(f64::to_radians);
    let pose = Pose::from_wpr(
        DVec3::new(1500.0, 0.0, 360.0),
        DVec3::new(135.0, -45.0, 0.0) * (PI / 180.0),
    );
    let records = [
        degrees([7.962, -5.284, -36.250, 77.661, -51.975, -79.273]),
        degrees([7.962, -5.284, -36.250, -102.339, 51.975, 100.727]),
    ];
    let solutions = check("R-2000iB", &arm, pose);
    for (shown, wrist) in records
        .into_iter()
        .zip(["N U T, 0, 0, 0", "F U T, 0, 0, 0"])
    {
        let joints = arm.joints(shown);
        assert_eq!(arm.configuration(joints).unwrap().to_string(), wrist);
        let [off, turned] = distance(arm.forward(joints), pose);
        assert!(off < 0.02 && turned < 2e-5, "{off} mm, {turned} rad");
        assert!(distance(arm.forward(shown), pose)[0] > 50.0);
        // and back: what the controller shows is among the solutions, to its printed digits
        assert!(apart(&arm.shown(joints), &shown) < 1e-12);
        let near = |s: &Solution| apart(&arm.shown(s.angles), &shown) < 2e-5;
        assert!(solutions.iter().any(near), "{shown:?} {solutions:?}");
    }
}

/// The third joint's limits are of what the controller shows: with the second joint they forbid and allow other elbows.
#[test]
fn coupled_limits_are_those_shown() {
    let arm = shipped("fanuc-arcmate-120ic").arm;
    let shown = [0.0, 90.0, -180.0, 0.0, 10.0, 0.0].map(f64::to_radians);
    let (margin, tightest) = arm.margin(arm.joints(shown));
    assert!(
        (margin.to_degrees() - 5.0).abs() < 1e-9 && tightest == 2,
        "{margin} {tightest}"
    );
    // one angle between the links, beyond the limit leaning forward and within it leaning back
    let with = |j2: f64| {
        arm.margin([0.0, j2, -190.0, 0.0, 10.0, 0.0].map(f64::to_radians))
            .0
            .to_degrees()
    };
    assert!((with(20.0) + 25.0).abs() < 1e-9 && (with(-20.0) - 15.0).abs() < 1e-9);
}

/// Reach of the wrist's centre from the second axis and of the arm as the makers print them.
#[test]
fn reach_is_that_of_the_data_sheets() {
    for (name, printed) in [
        ("fanuc-arcmate-120ic", 1811.0),
        ("kuka-kr16-r2010-2", 2013.0),
        ("abb-irb2600-12-185", 1853.0),
        ("yaskawa-ar2010", 2010.0),
        ("staubli-rx60b", 600.0),
        ("staubli-rx60bl", 800.0),
    ] {
        let Geometry::SphericalWrist(arm) = shipped(name).arm.geometry else {
            panic!("{name} has a spherical wrist");
        };
        let reach = arm.a1 + arm.c2 + arm.a2.hypot(arm.c3);
        assert!((reach - printed).abs() < 1.0, "{name}: {reach} mm");
    }
}

/// Any joint values are found again from the pose they make; what is returned holds the pose; at most eight ways.
fn finds_random(poses: u32) {
    let mut random = Random::new(1);
    for (name, arm) in all() {
        let mut most = 0;
        for _ in 0..poses {
            let joints = anywhere(&mut random);
            let solutions = check(name, &arm, arm.forward(joints));
            most = most.max(solutions.len());
            let found = solutions
                .iter()
                .map(|s| apart(&s.angles, &joints))
                .fold(f64::INFINITY, f64::min);
            let singular = solutions.iter().any(|s| s.singular.any());
            // digits are lost as a singularity comes near: one pose in a million is folded to 5e-6 rad
            let near = arm
                .nearness(joints)
                .map_or(f64::INFINITY, |n| n.wrist.min(n.elbow));
            assert!(
                found < 1e-6 || singular || found * near < 1e-11,
                "{name}: {found:e} from {joints:?}"
            );
        }
        assert_eq!(most, 8, "{name}");
    }
}

#[test]
fn multiaxis_ma7_inverse_gives_random_poses_back() {
    finds_random(10_000);
}

#[test]
#[ignore = "long validation: a million poses a robot"]
fn inverse_gives_a_million_poses_back() {
    finds_random(1_000_000);
}

/// The fifth joint tells the wrist's distance from its singularity, on either side and after half a turn.
#[test]
fn the_wrist_is_as_far_from_straight_as_its_joint_says() {
    for (name, arm) in all() {
        for (fifth, far) in [
            (0.2, 0.2),
            (-0.3, 0.3),
            (PI - 0.1, 0.1),
            (0.5 * PI, 0.5 * PI),
        ] {
            let near = arm.nearness([0.1, 0.2, 0.3, 0.4, fifth, 0.6]).unwrap();
            assert!((near.wrist - far).abs() < 1e-9, "{name}: {fifth} {near:?}");
        }
        // the elbow comes nearer as the third joint goes to where the arm is stretched
        let elbow = |third: f64| {
            arm.nearness([0.0, 0.0, third, 0.0, 1.0, 0.0])
                .unwrap()
                .elbow
        };
        let stretched = (-3000..3000)
            .map(|k| f64::from(k) * 1e-3)
            .min_by(|a, b| elbow(*a).total_cmp(&elbow(*b)))
            .unwrap();
        assert!(elbow(stretched) < 1e-3, "{name}");
        for off in [-0.4, -0.1, 0.1, 0.4] {
            assert!(
                (elbow(stretched + off) - f64::abs(off)).abs() < 2e-3,
                "{name}: {off}"
            );
        }
    }
}

/// Shapes are guessed as long as nobody vouches for them, whoever vouches for the rest.
#[test]
fn shapes_without_a_source_are_guessed() {
    let text = find(robots::ALL, "abb-irb2600-12-185").unwrap().text;
    assert!(cell::read(text).unwrap().guessed_shapes().is_some());
    let vouched = text.replacen("[shapes]", "[shapes]\nsource = \"measured\"", 1);
    assert_ne!(vouched, text);
    assert_eq!(cell::read(&vouched).unwrap().guessed_shapes(), None);
}

/// A joint on a border of its words stands as either side says within the digits of a program, and no farther off.
#[test]
fn a_joint_on_a_border_is_on_both_sides() {
    let cell = cell::read(find(robots::ALL, "fanuc-arcmate-120ic").unwrap().text).unwrap();
    let at = |sixth: f64| [0.1, 0.2, 0.1, 0.2, 0.8, sixth.to_radians()];
    let [below, beyond] = [179.0, 181.0].map(|j| cell.stance(at(j)).unwrap());
    assert_ne!(below, beyond);
    for (sixth, both) in [
        (179.95, false),
        (179.997, true),
        (180.003, true),
        (180.05, false),
    ] {
        let own = if sixth < 180.0 {
            [below, beyond]
        } else {
            [beyond, below]
        };
        assert!(cell.stands(at(sixth), &own[0]) && !cell.stands(at(sixth), &own[1]));
        assert!(cell.stands_within_digits(at(sixth), &own[0]));
        assert_eq!(
            cell.stands_within_digits(at(sixth), &own[1]),
            both,
            "{sixth}"
        );
    }
}

/// A table is as deep as its file says; one that stands reaches the floor, and how deep one on a positioner is is a guess where nobody says.
#[test]
fn a_table_is_as_deep_as_it_is_written() {
    let deep = |text: &str| {
        let cell = cell::read(text).unwrap();
        let thickness = cell.shapes.as_ref().unwrap().table.unwrap().thickness;
        (thickness, cell.guessed_shapes())
    };
    let of = |name: &str| find(robots::ALL, name).unwrap().text;
    let vouched = |text: &str| text.replacen("[shapes]", "[shapes]\nsource = \"measured\"", 1);
    let silent = |text: &str| {
        let lines = text.lines().filter(|l| !l.starts_with("table_thickness"));
        lines.collect::<Vec<&str>>().join("\n")
    };
    let standing = vouched(of("abb-irb2600-12-185"));
    assert_eq!(deep(&standing), (2000.0, None));
    assert_eq!(deep(&silent(&standing)), (2000.0, None));
    let turning = vouched(of("fanuc-arcmate-120ic"));
    assert_eq!(deep(&turning), (100.0, None));
    assert_eq!(
        deep(&silent(&turning)),
        (100.0, Some("shapes (table_thickness)".to_owned()))
    );
}

#[test]
fn a_table_without_sides_or_of_no_depth_is_refused() {
    let text = find(robots::ALL, "fanuc-arcmate-120ic").unwrap().text;
    let refused = |from: &str, to: &str| {
        assert!(text.contains(from));
        let problems = cell::read(&text.replacen(from, to, 1)).unwrap_err();
        format!("{problems:?}")
    };
    let negative = refused(
        "table_thickness = \"100 mm\"",
        "table_thickness = \"-100 mm\"",
    );
    assert!(negative.contains("table_thickness"), "{negative}");
    let alone = refused("table = [\"1000 mm\", \"1000 mm\"]", "");
    assert!(alone.contains("not how large the table is"), "{alone}");
}

/// A slip of the unit makes an arm that none has: the link and the joint are named, with what may be meant.
#[test]
fn lengths_and_limits_that_no_arm_has_are_refused() {
    let text = find(robots::ALL, "kuka-kr16-r2010-2").unwrap().text;
    let key = |name: &str| {
        let line = text.lines().find(|l| l.starts_with(&format!("{name} =")));
        line.unwrap().to_owned()
    };
    let refused = |from: &str, to: &str| {
        assert!(text.contains(from));
        let problems = cell::read(&text.replacen(from, to, 1)).unwrap_err();
        assert_eq!(problems.0.len(), 1, "{problems:?}");
        assert!(problems.0[0].span.is_some());
        format!("{} {:?}", problems.0[0], problems.0[0].help)
    };
    let told = |from: String, to: &str, words: &[&str]| {
        let told = refused(&from, to);
        assert!(words.iter().all(|w| told.contains(w)), "{told}");
    };
    let link = ["upper_arm", "575 m", "longer than 10 m", "\\\"575 mm\\\""];
    told(key("upper_arm"), "upper_arm = \"575 m\"", &link);
    let joints = key("high");
    let first = joints.split('"').nth(1).unwrap();
    let of = |limit: &str| joints.replacen(first, limit, 1);
    let turns = ["joint 1", "27.1 turns", "\\\"170 deg\\\""];
    told(joints.clone(), &of("170 rad"), &turns);
    let low = key("low").split('"').nth(1).unwrap().to_owned();
    told(joints.clone(), &of(&low), &["joint 1", "are equal"]);
    told(
        joints.clone(),
        &of("-300 deg"),
        &["are swapped", "lesser one in low"],
    );
    // five turns to a side are those of a last axis
    let wide = text.replacen(&joints, &of("1800 deg"), 1);
    assert!(cell::read(&wide).is_ok());
}

/// A search from many starts finds nothing that the closed form lacks.
fn search_finds_nothing_else(poses: u32) {
    let mut random = Random::new(2);
    for (name, arm) in all() {
        let mut found = 0;
        for _ in 0..poses {
            let pose = arm.forward(anywhere(&mut random));
            let solutions = check(name, &arm, pose);
            for angles in search(&arm.chain, pose, 40) {
                // a search ends at 1e-6 mm, 1e-9 rad: beside a singularity that is far off in the joints
                let off = 1e-5 + adversarial::lost(&arm, &angles, 1e-9);
                let near = solutions.iter().any(|s| apart(&s.angles, &angles) < off);
                assert!(near, "{name}: {angles:?} is not among {solutions:?}");
                found += 1;
            }
        }
        assert!(found > 2 * poses, "{name}: the search found {found} only");
    }
}

#[test]
fn a_search_finds_nothing_that_the_closed_form_lacks() {
    search_finds_nothing_else(30);
}

#[test]
#[ignore = "long validation: five hundred poses a robot"]
fn a_long_search_finds_nothing_that_the_closed_form_lacks() {
    search_finds_nothing_else(500);
}

/// Every whole turn within limits, each joint by itself.
#[test]
fn turns_are_all_those_within_limits() {
    let arm = shipped("abb-irb2600-12-185").arm;
    let joints = [10.0, 20.0, 30.0, -350.0, 40.0, 45.0].map(f64::to_radians);
    let turns = arm.turns(joints);
    // J4 may be -350, 10 or 370 deg, J6 -315 or 45 deg
    assert_eq!(turns.len(), 3 * 2, "{turns:?}");
    for way in &turns {
        assert!(arm.margin(*way).0 >= 0.0);
        assert!(distance(arm.forward(*way), arm.forward(joints))[0] < 1e-9);
    }
    assert!(arm.turns([0.0, 3.0, 0.0, 0.0, 0.0, 0.0]).is_empty());
}

#[test]
fn what_is_out_of_reach_is_told_with_its_distance() {
    let arm = shipped("fanuc-arcmate-120ic").arm;
    let far = Pose {
        position: DVec3::new(0.0, 2500.0, 525.0),
        orientation: DQuat::from_rotation_arc(DVec3::Z, DVec3::Y),
    };
    let Err(Unreachable::TooFar { by }) = arm.inverse(far) else {
        panic!("out of reach")
    };
    // flange 100 mm, arm 150 + 790 + 871.6 mm
    assert!(
        (by - (2400.0 - 940.0 - 250.0_f64.hypot(835.0))).abs() < 1e-9,
        "{by}"
    );
    let beside = Pose {
        position: DVec3::new(10.0, 0.0, 800.0),
        ..Pose::IDENTITY
    };
    let Err(Unreachable::BesideAxis { by }) = shipped("staubli-rx60bl").arm.inverse(beside) else {
        panic!("beside the axis")
    };
    assert!((by - 39.0).abs() < 1e-9);
}

/// The ARC Mate's axes as those of any arm: ways are searched, told as found, and are among all there are.
#[test]
fn any_other_chain_is_searched() {
    let known = shipped("fanuc-arcmate-120ic").arm;
    let axes = [
        ([0, 0, 525], [0, 0, 1]),
        ([150, 0, 0], [0, 1, 0]),
        ([0, 0, 790], [0, -1, 0]),
        ([0, 0, 250], [-1, 0, 0]),
        ([835, 0, 0], [0, -1, 0]),
        ([0, 0, 0], [-1, 0, 0]),
    ];
    let mut text = "name = \"any\"\n[joints]\nsource = \"test\"\nlow = [\"-180 deg\", \"-180 deg\", \"-180 deg\", \"-180 deg\", \"-180 deg\", \"-180 deg\"]\nhigh = [\"180 deg\", \"180 deg\", \"180 deg\", \"180 deg\", \"180 deg\", \"180 deg\"]\n[arm]\nkind = \"axes\"\nsource = \"test\"\n".to_owned();
    for (p, axis) in axes {
        let [x, y, z] = p;
        let axis = format!(
            "[[arm.axes]]\nposition = [\"{x} mm\", \"{y} mm\", \"{z} mm\"]\naxis = {axis:?}\n"
        );
        text.push_str(&axis);
    }
    let arm = cell::read(&text).unwrap().arm;
    let joints = [0.3, 0.2, -0.4, 0.5, -0.9, 0.7];
    let pose = arm.forward(joints);
    let inverse = arm.inverse(pose).unwrap();
    assert!(
        !inverse.all && inverse.solutions.len() >= 4,
        "{}",
        inverse.solutions.len()
    );
    assert!(
        inverse
            .solutions
            .iter()
            .any(|s| apart(&s.angles, &joints) < 1e-6)
    );
    // the flange of the closed form lies 100 mm out and turned
    let flange = known.forward(joints);
    let closed = known.inverse(flange).unwrap();
    for solution in &inverse.solutions {
        assert!(
            closed
                .solutions
                .iter()
                .any(|s| apart(&s.angles, &solution.angles) < 1e-6)
        );
    }
}

/// Within narrow limits an arm reaches little, and never beyond what it reaches within wide ones.
#[test]
fn reach_keeps_to_the_limits() {
    let wide = shipped("abb-irb2600-12-185").arm;
    let mut narrow = wide.clone();
    for joint in &mut narrow.chain.joints[1..3] {
        (joint.limits.low, joint.limits.high) = (-0.05, 0.05);
    }
    let (wide, narrow) = (wide.reach(), narrow.reach());
    let span = |[low, high]: [f64; 2]| high - low;
    assert!(span(wide.out) > 1000.0 && span(wide.up) > 1000.0);
    // a twentieth of a radian to either side of joints with some 1.9 m and 1.1 m beyond them
    assert!(
        span(narrow.out) < 300.0 && span(narrow.up) < 300.0,
        "{narrow:?}"
    );
    assert!(narrow.out[1] <= wide.out[1] && narrow.up[1] <= wide.up[1]);
}
