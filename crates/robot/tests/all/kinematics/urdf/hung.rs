//! Arms that hang or stand on something: the base says so, and configurations have the words of the arm as its maker builds it.

use meltpath_robot::cell::{self, Cell, Values, from_urdf};
use meltpath_robot::kinematics::numeric::distance;

use super::{Row, SPHERICAL, TOOL, chained, everywhere, urdf};

fn cell_of(maker: &str, toml: &str) -> Cell {
    cell::read(&format!("maker = \"{maker}\"\n{toml}")).unwrap_or_else(|e| panic!("{e}: {toml}"))
}

/// One physical arm, hung by `[base]` and by its URDF, in a joint of its own and in the first joint's place: the same words everywhere.
#[test]
fn an_arm_hung_by_its_urdf_has_the_words_of_one_hung_by_its_base() {
    let own = [SPHERICAL, &[TOOL]].concat();
    let upright = from_urdf(&urdf(&own)).unwrap();
    assert!(!upright.contains("[base]"), "{upright}");
    let mounts: [(Row, &str); 3] = [
        (
            ([0.0, 0.0, 2.0], [180.0, 0.0, 0.0], None),
            "angles = [\"180 deg\", \"0 deg\", \"0 deg\"]",
        ),
        (
            ([0.0, 0.0, 2.0], [0.0, 90.0, 0.0], None),
            "angles = [\"0 deg\", \"90 deg\", \"0 deg\"]",
        ),
        (
            ([0.0, 0.0, 2.0], [10.0, 0.0, 30.0], None),
            "angles = [\"10 deg\", \"0 deg\", \"30 deg\"]",
        ),
    ];
    for (mount, angles) in mounts {
        let by_base =
            format!("{upright}[base]\nposition = [\"0 mm\", \"0 mm\", \"2000 mm\"]\n{angles}\n");
        let rows = [&[mount], &own[..]].concat();
        let by_urdf = from_urdf(&urdf(&rows)).unwrap();
        assert!(by_urdf.contains(angles), "{by_urdf}");
        // the mount within the place of the first joint
        let mut within = own.clone();
        let place = chained(&[mount, (own[0].0, own[0].1, None)], [0.0; 6]);
        let wpr = place.wpr().to_array().map(f64::to_degrees);
        (within[0].0, within[0].1) = ((place.position / 1000.0).to_array(), wpr);
        let by_joint = from_urdf(&urdf(&within)).unwrap();
        for maker in ["fanuc", "kuka", "abb", "yaskawa"] {
            let base = cell_of(maker, &by_base);
            for (how, toml, rows) in [("urdf", &by_urdf, &rows), ("joint", &by_joint, &within)] {
                let hung = cell_of(maker, toml);
                for joints in everywhere() {
                    let values = Values {
                        arm: joints,
                        ..Values::default()
                    };
                    let flange = hung.frames(&values).flange;
                    for pose in [base.frames(&values).flange, chained(rows, joints)] {
                        let [off, turned] = distance(flange, pose);
                        assert!(
                            off < 1e-6 && turned < 1e-9,
                            "{how}: {off:e} {turned:e} {toml}"
                        );
                    }
                    let words = [&base, &hung].map(|c| {
                        c.stance(joints)
                            .unwrap_or_else(|| panic!("no words {how}: {toml}"))
                            .to_string()
                    });
                    assert_eq!(words[0], words[1], "{maker} by {how}, {joints:?}\n{toml}");
                }
            }
        }
    }
}

/// An arm whose first axis counts the other way stands upright all the same: KUKA's.
#[test]
fn an_axis_that_counts_the_other_way_hangs_nothing() {
    let mut rows = [SPHERICAL, &[TOOL]].concat();
    rows[0].2 = Some([0.0, 0.0, -1.0]);
    let toml = from_urdf(&urdf(&rows)).unwrap();
    assert!(!toml.contains("[base]"), "{toml}");
    assert!(toml.contains("directions = [\"-\", \"+\""), "{toml}");
}
