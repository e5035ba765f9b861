//! What is refused of a URDF, by joint and line, and what it does not say.

use meltpath_robot::cell::{self, JointFault, UrdfError, from_urdf};

use super::{ABB, SPHERICAL, TOOL, UNIVERSAL, urdf};

/// A good arm, a line each joint.
fn good() -> String {
    urdf(&[SPHERICAL, &[TOOL]].concat()).replace("<link", "\n<link")
}

fn refused(from: &str, to: &str) -> UrdfError {
    let text = good();
    assert!(text.contains(from), "{from} is not in {text}");
    from_urdf(&text.replacen(from, to, 1)).unwrap_err()
}

const LIMIT: &str = "<limit lower=\"-3\" upper=\"2.5\" velocity=\"3.5\" effort=\"0\"/>";

#[test]
fn what_is_no_arm_is_refused() {
    let refused = |text: &str| from_urdf(text).unwrap_err();
    let abb = urdf(ABB);
    assert!(from_urdf(&abb).is_ok());
    assert!(matches!(
        refused(&abb.replacen("revolute", "fixed", 1)),
        UrdfError::Joints { found: 5 }
    ));
    assert!(matches!(
        refused(&abb.replacen("child link=\"l1\"", "child link=\"l0\"", 1)),
        UrdfError::Loop(_)
    ));
    assert!(matches!(
        refused(&abb.replacen("0.0 0.0 0.445", "0,0 0 0.445", 1)),
        UrdfError::Number { .. }
    ));
    // a second tree, and a circle that hangs on nothing
    let beside = |parent: &str, child: &str| {
        let more = format!(
            "<joint name=\"more\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint></robot>"
        );
        refused(&abb.replace("</robot>", &more))
    };
    let roots = UrdfError::Roots(["l0", "hall"].map(str::to_owned));
    assert_eq!(beside("hall", "lamp"), roots);
    assert_eq!(beside("lamp", "lamp"), UrdfError::Loop("lamp".to_owned()));
    let (one, other) = (
        "<joint name=\"a\" type=\"fixed\"><parent link=\"x\"/><child link=\"y\"/></joint>",
        "<joint name=\"b\" type=\"fixed\"><parent link=\"y\"/><child link=\"x\"/></joint></robot>",
    );
    let round = abb.replace("</robot>", &format!("{one}{other}"));
    assert_eq!(refused(&round), UrdfError::Loop("x".to_owned()));
    let seven = refused(&urdf(&[ABB, &UNIVERSAL[..1]].concat()));
    assert_eq!(seven, UrdfError::Joints { found: 7 });
    assert!(seven.to_string().contains("[positioner]"));
    assert!(matches!(
        refused("<robot name=\"x\"><link"),
        UrdfError::Broken(_)
    ));
    assert!(matches!(refused("no xml"), UrdfError::Broken(_)));
    assert!(matches!(
        refused(&urdf(&UNIVERSAL[..5])),
        UrdfError::Joints { found: 5 }
    ));
}

/// Each is told with the joint, its line and what to do.
#[test]
fn what_no_joint_of_an_arm_is_is_refused_by_its_name() {
    let of = |fault: JointFault| UrdfError::Joint {
        joint: "j0".to_owned(),
        line: 3,
        fault,
    };
    let no_limit = |what| of(JointFault::NoLimit(what));
    let with = |limit: &str| refused(LIMIT, limit);
    assert_eq!(with(""), no_limit("limits"));
    assert_eq!(
        with("<limit velocity=\"3.5\" effort=\"0\"/>"),
        no_limit("limits")
    );
    assert_eq!(with("<limit upper=\"1\"/>"), no_limit("lower limit"));
    assert_eq!(with("<limit lower=\"-1\"/>"), no_limit("upper limit"));
    let (low, high) = (3.0, -3.0);
    assert_eq!(
        with("<limit lower=\"3\" upper=\"-3\"/>"),
        of(JointFault::Order { low, high })
    );
    let (low, high) = (-170.0, 170.0);
    assert_eq!(
        with("<limit lower=\"-170\" upper=\"170\"/>"),
        of(JointFault::Far { low, high })
    );
    assert_eq!(
        with("<limit lower=\"-1\" upper=\"1\" velocity=\"120\"/>"),
        of(JointFault::Fast(120.0))
    );
    assert_eq!(
        refused("<axis xyz=\"0.0 0.0 1.0\"/>", "<axis xyz=\"0 0 0\"/>"),
        of(JointFault::Axis)
    );
    assert_eq!(
        refused("0.0 0.0 0.4\"", "0 0 800\""),
        of(JointFault::Long(800.0))
    );
    assert_eq!(
        refused("rpy=\"0.0 0.0 0.0\"", "rpy=\"0 90 0\""),
        of(JointFault::Turned(90.0))
    );
    assert_eq!(
        refused("\"revolute\"", "\"prismatic\""),
        of(JointFault::Slides)
    );
    for kind in ["planar", "floating"] {
        assert_eq!(
            refused("\"revolute\"", &format!("{kind:?}")),
            of(JointFault::Kind(kind.to_owned()))
        );
    }
    assert_eq!(
        refused(LIMIT, &format!("{LIMIT}<mimic joint=\"j4\"/>")),
        of(JointFault::Coupled("j4".to_owned()))
    );
    let told = with("").to_string();
    for part in ["joint \"j0\" in line 3", "no limits", "<limit lower="] {
        assert!(told.contains(part), "{part} is not in {told}");
    }
}

#[test]
fn what_is_read_in_part_is_refused() {
    for text in ["nan", "inf", "1,5", ""] {
        let limit = format!("<limit lower=\"{text}\" upper=\"2.5\"/>");
        let wrong = refused(LIMIT, &limit);
        assert!(
            matches!(&wrong, UrdfError::Number { what: "lower", .. }),
            "{wrong}"
        );
    }
    assert_eq!(
        refused("\"j3\"", "\"j1\""),
        UrdfError::Twice {
            joint: "j1".to_owned(),
            lines: [4, 6]
        }
    );
    // a file that ends with a joint, before its robot does
    let text = good();
    let last = text.rfind("\n<link").unwrap();
    assert_eq!(
        from_urdf(&text[..last]).unwrap_err(),
        UrdfError::CutOff { line: 8 }
    );
}

/// A velocity that is missing leaves those of the other joints, and is a guess that is told by the joint's name.
#[test]
fn a_missing_velocity_leaves_the_others() {
    let text = good().replacen("velocity=\"3.5\"", "velocity=\"2.5\"", 2);
    let toml = from_urdf(&text.replacen("velocity=\"2.5\"", "", 1)).unwrap();
    assert!(toml.contains("no velocity of joint 1 (\"j0\"):"), "{toml}");
    let cell = cell::read(&toml).unwrap();
    let speeds: Vec<f64> = cell
        .arm
        .chain
        .joints
        .iter()
        .map(|j| j.limits.speed.unwrap())
        .collect();
    for (speed, wanted) in speeds.iter().zip([2.5, 2.5, 3.5, 3.5, 3.5, 3.5]) {
        assert!((speed - wanted).abs() < 1e-7, "{speeds:?}");
    }
    assert_eq!(cell.guesses()[0], "joints (speed)");
    // of none there is nothing to guess by
    let toml = from_urdf(&good().replace("velocity=\"3.5\"", "velocity=\"0\"")).unwrap();
    assert!(toml.contains("no velocity of any joint"), "{toml}");
    let silent = cell::read(&toml).unwrap();
    assert!(
        silent
            .arm
            .chain
            .joints
            .iter()
            .all(|j| j.limits.speed.is_none())
    );
}

/// A joint without an end is told as such; one that ends says its limits.
#[test]
fn a_continuous_joint_is_told() {
    let text = good().replacen("\"revolute\"", "\"continuous\"", 1);
    let toml = from_urdf(&text.replacen(LIMIT, "", 1)).unwrap();
    assert!(
        toml.contains("joint 1 (\"j0\") is continuous: 360 deg to each side"),
        "{toml}"
    );
    assert!(!from_urdf(&good()).unwrap().contains("continuous"));
    // with a velocity missing besides, both stand in one list
    let guesses = |toml: &str| cell::read(toml).unwrap().guesses()[0].clone();
    assert_eq!(guesses(&toml), "joints (speed, low, high)");
    let ends = from_urdf(&text).unwrap();
    assert_eq!(guesses(&ends), "joints (low, high)");
}

/// Soft limits end a joint where they are narrower than its hard ones, before or after these.
#[test]
fn soft_limits_narrow_a_joint() {
    let soft = |low: &str, high: &str| {
        format!("<safety_controller {low} {high} k_position=\"20\" k_velocity=\"20\"/>")
    };
    let of = |kind: &str, inside: String| {
        let text = good().replacen("\"revolute\"", kind, 1);
        let toml = from_urdf(&text.replacen(LIMIT, &inside, 1))?;
        let limits = cell::read(&toml).unwrap().arm.chain.joints[0].limits;
        Ok::<_, UrdfError>(([limits.low, limits.high], toml))
    };
    let (low, high) = ("soft_lower_limit=\"-1\"", "soft_upper_limit=\"0.5\"");
    for (inside, wanted) in [
        (soft(low, high) + LIMIT, [-1.0, 0.5]),
        (LIMIT.to_owned() + &soft(low, high), [-1.0, 0.5]),
        (LIMIT.to_owned() + &soft(low, ""), [-1.0, 2.5]),
        (
            LIMIT.to_owned() + &soft("soft_lower_limit=\"-4\"", high),
            [-3.0, 0.5],
        ),
        // nothing is said
        (
            LIMIT.to_owned() + &soft("soft_lower_limit=\"0\"", "soft_upper_limit=\"0\""),
            [-3.0, 2.5],
        ),
    ] {
        let (found, toml) = of("\"revolute\"", inside).unwrap();
        let near = |k: usize| (found[k] - wanted[k]).abs() < 1e-7;
        assert!(near(0) && near(1), "{found:?} {wanted:?}");
        let told = toml.contains("joint 1 (\"j0\") ends at the soft limits");
        assert_eq!(told, wanted != [-3.0, 2.5], "{toml}");
    }
    // they are no guess of a continuous joint
    let (found, toml) = of("\"continuous\"", soft(low, high) + LIMIT).unwrap();
    assert!((found[0] + 1.0).abs() < 1e-7 && (found[1] - 0.5).abs() < 1e-7);
    assert!(!toml.contains("guesses"), "{toml}");
    let nothing = soft(low, "soft_upper_limit=\"-2\"");
    assert!(matches!(
        of("\"revolute\"", LIMIT.to_owned() + &nothing),
        Err(UrdfError::Joint {
            fault: JointFault::Soft { .. },
            ..
        })
    ));
}
