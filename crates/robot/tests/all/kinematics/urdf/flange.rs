//! Flanges that are turned against their last axis.

use meltpath_robot::cell::{self, Values, from_urdf};
use meltpath_robot::kinematics::Geometry;
use meltpath_robot::kinematics::numeric::distance;

use super::{ODD, Row, SPHERICAL, TOOL, chained, everywhere, urdf};

/// The last joint's own frame, one turned askew, one beside the axis, one that looks inward, and one on the other side of the last joint's origin.
const FLANGES: [Row; 6] = [
    TOOL,
    ([0.03, 0.0, 0.0], [0.0, 0.0, 0.0], None),
    ([0.03, 0.0, 0.0], [20.0, -35.0, 70.0], None),
    ([0.03, 0.02, -0.04], [0.0, 40.0, 0.0], None),
    ([0.03, 0.0, 0.0], [0.0, -90.0, 0.0], None),
    ([-0.2, 0.0, -0.1], [0.0, -90.0, 25.0], None),
];

/// The flange of the file that is made goes where the URDF's chain goes, and the ways back hold it.
#[test]
fn a_turned_flange_is_taken_and_moves_as_the_chain() {
    for (rows, spherical) in [(SPHERICAL, true), (ODD, false)] {
        for flange in FLANGES {
            let rows = [rows, &[flange]].concat();
            let toml = from_urdf(&urdf(&rows)).unwrap();
            let cell = cell::read(&toml).unwrap_or_else(|e| panic!("{e}: {toml}"));
            let found = matches!(cell.arm.geometry, Geometry::SphericalWrist(_));
            assert_eq!(found, spherical, "{toml}");
            for joints in everywhere() {
                let values = Values {
                    arm: joints,
                    ..Values::default()
                };
                let pose = cell.frames(&values).flange;
                let [off, turned] = distance(pose, chained(&rows, joints));
                assert!(off < 1e-6 && turned < 1e-9, "{off:e} {turned:e} {toml}");
                let back = cell.arm.nearest(pose, &joints).unwrap();
                let [off, turned] = distance(cell.arm.forward(back), pose);
                assert!(off < 1e-6 && turned < 1e-9, "{off:e} {turned:e} {toml}");
            }
        }
    }
}

/// The file names the flange that its torch is given in, and says where that is not the pendant's.
#[test]
fn the_flange_is_named() {
    let flange = |row: Row| from_urdf(&urdf(&[SPHERICAL, &[row]].concat())).unwrap();
    let usual = flange(FLANGES[0]);
    assert!(
        usual.contains("URDF's link \"l7\"") && !usual.contains("flange_angles"),
        "{usual}"
    );
    assert!(usual.contains("flange = \"100 mm\""), "{usual}");
    let turned = flange(FLANGES[1]);
    for told in [
        "flange = \"100 mm\"",
        "flange_angles = [\"0 deg\", \"-90 deg\", \"0 deg\"]",
        "measure [torch] by the pendant",
    ] {
        assert!(turned.contains(told), "{told} is not in\n{turned}");
    }
    // of other arms it is known which way the axis goes, not which end is out
    let of = |row: Row| from_urdf(&urdf(&[ODD, &[row]].concat())).unwrap();
    assert!(!of(FLANGES[0]).contains("does not point along"));
    assert!(of(FLANGES[1]).contains("does not point along the last axis"));
}
