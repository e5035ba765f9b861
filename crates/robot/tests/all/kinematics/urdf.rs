//! URDFs as ROS has them, against the poses of an independent library: joints of the public packages, written here as numbers.

use std::f64::consts::PI;
use std::fmt::Write as _;

use meltpath_robot::cell::{self, UrdfError, from_urdf};
use meltpath_robot::kinematics::Geometry;
use meltpath_robot::kinematics::numeric::distance;

use super::flange_poses;

/// A joint: place in m, roll, pitch and yaw in deg, axis; none for a fixed one.
type Row = ([f64; 3], [f64; 3], Option<[f64; 3]>);

const FANUC: &[Row] = &[
    ([0.0, 0.0, 0.525], [0.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.15, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.0, 0.0, 0.79], [0.0, 0.0, 0.0], Some([0.0, -1.0, 0.0])),
    ([0.0, 0.0, 0.25], [0.0, 0.0, 0.0], Some([-1.0, 0.0, 0.0])),
    ([0.835, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, -1.0, 0.0])),
    ([0.1, 0.0, 0.0], [0.0, 0.0, 0.0], Some([-1.0, 0.0, 0.0])),
    ([0.0, 0.0, 0.0], [180.0, -90.0, 0.0], None),
];

const ABB: &[Row] = &[
    ([0.0, 0.0, 0.445], [0.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.15, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.0, 0.0, 0.9], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.0, 0.0, 0.115], [0.0, 0.0, 0.0], Some([1.0, 0.0, 0.0])),
    ([0.795, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.085, 0.0, 0.0], [0.0, 0.0, 0.0], Some([1.0, 0.0, 0.0])),
    ([0.0, 0.0, 0.0], [0.0, 90.0, 0.0], None),
];

const KUKA: &[Row] = &[
    ([0.0, 0.0, 0.52], [0.0, 0.0, 0.0], Some([0.0, 0.0, -1.0])),
    ([0.16, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.98, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.86, 0.0, 0.15], [0.0, 0.0, 0.0], Some([-1.0, 0.0, 0.0])),
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], Some([-1.0, 0.0, 0.0])),
    ([0.153, 0.0, 0.0], [0.0, 90.0, 0.0], None),
];

const YASKAWA: &[Row] = &[
    ([0.0, 0.0, 0.505], [0.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    (
        [0.15, 0.0, 0.0],
        [90.0, -90.0, -180.0],
        Some([0.0, 0.0, 1.0]),
    ),
    ([0.76, 0.0, 0.0], [180.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.2, 0.0, 0.0], [-90.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.0, 0.0, -1.082], [90.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.0, -0.1, 0.0], [-90.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.0, 0.0, 0.0], [0.0, 90.0, 0.0], None),
    ([0.0, 0.0, 0.0], [180.0, -90.0, 0.0], None),
];

const UNIVERSAL: &[Row] = &[
    ([0.0, 0.0, 0.1807], [0.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.0, 0.0, 0.0], [90.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([-0.6127, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    (
        [-0.57155, 0.0, 0.17415],
        [0.0, 0.0, 0.0],
        Some([0.0, 0.0, 1.0]),
    ),
    (
        [0.0, -0.11985, 0.0],
        [90.0, 0.0, 0.0],
        Some([0.0, 0.0, 1.0]),
    ),
    (
        [0.0, 0.11655, 0.0],
        [-90.0, 0.0, 0.0],
        Some([0.0, 0.0, 1.0]),
    ),
];

fn urdf(rows: &[Row]) -> String {
    let mut text = "<robot name=\"arm\"><link name=\"l0\"/>".to_owned();
    let three = |v: &[f64; 3], scale: f64| {
        format!("{:?} {:?} {:?}", v[0] * scale, v[1] * scale, v[2] * scale)
    };
    for (i, (xyz, rpy, axis)) in rows.iter().enumerate() {
        let kind = if axis.is_some() { "revolute" } else { "fixed" };
        write!(
            text,
            "<link name=\"l{n}\"/><joint name=\"j{i}\" type=\"{kind}\"><origin xyz=\"{}\" rpy=\"{}\"/><parent link=\"l{i}\"/><child link=\"l{n}\"/>",
            three(xyz, 1.0),
            three(rpy, PI / 180.0),
            n = i + 1
        )
        .unwrap();
        if let Some(axis) = axis {
            write!(text, "<axis xyz=\"{}\"/><limit lower=\"-3\" upper=\"2.5\" velocity=\"3.5\" effort=\"0\"/>", three(axis, 1.0)).unwrap();
        }
        text += "</joint>";
    }
    text + "<transmission><joint name=\"j0\"><hardwareInterface/></joint></transmission></robot>"
}

#[test]
fn urdfs_move_as_the_independent_library_says() {
    for (name, rows) in [
        ("fanuc-arcmate-120ic", FANUC),
        ("abb-irb2600-12-185", ABB),
        ("kuka-kr16-r2010-2", KUKA),
        ("yaskawa-ar2010", YASKAWA),
        ("universal-ur10e", UNIVERSAL),
    ] {
        let toml = from_urdf(&urdf(rows)).unwrap();
        let arm = cell::read(&toml)
            .unwrap_or_else(|e| panic!("{e}: {toml}"))
            .arm;
        let spherical = matches!(arm.geometry, Geometry::SphericalWrist(_));
        assert_eq!(spherical, name != "universal-ur10e", "{toml}");
        let limits = arm.chain.joints[3].limits;
        assert!((limits.low + 3.0).abs() < 1e-7 && (limits.high - 2.5).abs() < 1e-7);
        assert!((limits.speed.unwrap() - 3.5).abs() < 1e-7);
        let mut rows = 0;
        for (joints, wanted) in flange_poses(name) {
            let [off, turned] = distance(arm.forward(joints), wanted);
            assert!(
                off < 1e-4 && turned < 1e-7,
                "{name}: {off:e} {turned:e} {toml}"
            );
            rows += 1;
        }
        assert_eq!(rows, 25);
    }
}

#[test]
fn what_is_no_arm_is_refused() {
    let refused = |text: &str| from_urdf(text).unwrap_err();
    let abb = urdf(ABB);
    assert!(matches!(
        refused(&abb.replacen("revolute", "prismatic", 1)),
        UrdfError::Joints { found: 5, .. }
    ));
    assert!(matches!(
        refused(&abb.replacen("revolute", "fixed", 1)),
        UrdfError::Joints { found: 5, .. }
    ));
    assert!(matches!(
        refused(&abb.replacen("child link=\"l1\"", "child link=\"l0\"", 1)),
        UrdfError::Loop(_)
    ));
    assert!(matches!(
        refused(&abb.replacen("0.0 0.0 0.445", "0,0 0 0.445", 1)),
        UrdfError::Number { .. }
    ));
    assert!(matches!(
        refused("<robot name=\"x\"><link"),
        UrdfError::Broken(_)
    ));
    assert!(matches!(refused("no xml"), UrdfError::Broken(_)));
    assert!(matches!(
        refused(&urdf(&UNIVERSAL[..5])),
        UrdfError::Joints { found: 5, .. }
    ));
    // limits that are swapped are refused where the file is read
    let swapped = abb.replacen(
        "lower=\"-3\" upper=\"2.5\"",
        "lower=\"3\" upper=\"-2.5\"",
        1,
    );
    let told = cell::read(&from_urdf(&swapped).unwrap())
        .unwrap_err()
        .to_string();
    assert!(told.contains("swapped"), "{told}");
}
