//! URDFs as ROS has them, against the poses of an independent library: joints of the public packages, written here as numbers.

mod flange;
mod hung;
mod named;
mod refused;

use std::f64::consts::PI;
use std::fmt::Write as _;

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_robot::cell::{self, from_urdf};
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

/// An arm with a spherical wrist whose numbers are nobody's.
const SPHERICAL: &[Row] = &[
    ([0.0, 0.0, 0.4], [0.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.15, 0.03, 0.1], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.0, 0.0, 0.8], [0.0, 0.0, 0.0], Some([0.0, -1.0, 0.0])),
    ([0.3, 0.0, 0.12], [0.0, 0.0, 0.0], Some([-1.0, 0.0, 0.0])),
    ([0.5, 0.0, 0.0], [0.0, 0.0, 0.0], Some([0.0, -1.0, 0.0])),
    ([0.07, 0.0, 0.0], [0.0, 0.0, 0.0], Some([-1.0, 0.0, 0.0])),
];

/// One without: the fifth and sixth axis do not meet the fourth.
const ODD: &[Row] = &[
    ([0.0, 0.0, 0.4], [0.0, 0.0, 0.0], Some([0.0, 0.0, 1.0])),
    ([0.15, 0.0, 0.1], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.0, 0.0, 0.8], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.3, 0.0, 0.12], [0.0, 0.0, 0.0], Some([1.0, 0.0, 0.0])),
    ([0.5, 0.05, 0.0], [0.0, 0.0, 0.0], Some([0.0, 1.0, 0.0])),
    ([0.07, 0.0, 0.03], [0.0, 0.0, 0.0], Some([1.0, 0.0, 0.0])),
];

/// The common flange of ROS: its z along x of the last joint.
const TOOL: Row = ([0.03, 0.0, 0.0], [0.0, 90.0, 0.0], None);

/// Where rows put their last frame, joint by joint.
fn chained(rows: &[Row], joints: [f64; 6]) -> Pose {
    let mut values = joints.into_iter();
    let moved = |pose: Pose, (xyz, rpy, axis): &Row| {
        let place = Pose::from_wpr(
            DVec3::from_array(*xyz) * 1000.0,
            DVec3::from_array(*rpy) * (PI / 180.0),
        );
        let turn = axis.map_or(DQuat::IDENTITY, |a| {
            DQuat::from_axis_angle(DVec3::from_array(a), values.next().unwrap())
        });
        pose.then(place).then(Pose {
            position: DVec3::ZERO,
            orientation: turn,
        })
    };
    rows.iter().fold(Pose::IDENTITY, moved)
}

/// Joint values all over their ranges, the same for each arm.
fn everywhere() -> impl Iterator<Item = [f64; 6]> {
    (0..100).map(|i| {
        std::array::from_fn(|k| {
            (1.7 * f64::from(i) + 0.9 * k as f64).sin() * [2.9, 1.4, 1.9][k % 3]
        })
    })
}

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
