//! The arm of a URDF as the text of a robot file: its closed form where it has a spherical wrist, else its six axes. What carries the arm
//! becomes its base.

use std::fmt::Write as _;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::way::{End, Movable, UrdfArm};
use super::wrist::Recognised;

/// The text of a robot file with an arm, which `source` tells.
pub(super) fn toml(arm: &UrdfArm, source: &str) -> String {
    let source = &format!("source = {source:?}");
    let mut toml = format!("name = {:?}\n", arm.name);
    if let Some(found) = Recognised::of(&arm.joints, arm.last_from_flange) {
        closed(&mut toml, arm, &found, source);
    } else {
        any(&mut toml, arm, source);
    }
    base(&mut toml, arm.root_from_base, source);
    toml
}

// writing into a string does not fail, here and below

/// Arm and joints of a closed form.
fn closed(toml: &mut String, arm: &UrdfArm, found: &Recognised, source: &str) {
    let rest = found.end_from_flange;
    // the end of the closed form looks outward
    let looks_in = (rest.orientation * DVec3::Z).z < 0.0;
    let told = (looks_in || is_askew(rest, DVec3::Z)).then_some(TURNED);
    let flange = (&*arm.flange, found.parameters.c4, rest);
    table_of_arm(toml, flange, told, source);
    spherical(toml, found);
    limits(toml, &arm.joints, source);
    shown(toml, found);
}

/// Arm and joints of any other.
fn any(toml: &mut String, arm: &UrdfArm, source: &str) {
    let (along, rest) = along_the_last(arm);
    let last = arm.joints.last().map_or(DVec3::Z, |j| j.axis);
    let told = is_askew(rest, last).then_some(ASKEW);
    table_of_arm(toml, (&arm.flange, along, rest), told, source);
    axes(toml, &arm.joints);
    limits(toml, &arm.joints, source);
}

/// Said of a turned flange where the last axis's own frame is known to have the z of a pendant's flange.
const TURNED: &str = "# its z does not point out along the last axis: where the pendant's flange does, leave flange_angles out and measure [torch] by the pendant\n";
/// Said of a turned flange elsewhere.
const ASKEW: &str =
    "# its z does not point along the last axis, as that of a pendant's flange does\n";

/// The arm's table with the place of its flange, in lines before those of its kind.
fn table_of_arm(
    toml: &mut String,
    (link, along, rest): (&str, f64, Pose),
    askew: Option<&str>,
    source: &str,
) {
    let _ = write!(
        toml,
        "\n[arm]\n{source}\n# the flange is the URDF's link {link:?}, and [torch] is given in its frame\n{}flange = {}\n",
        askew.unwrap_or_default(),
        millimetres(along)
    );
    if rest.position.to_array().map(rounded) != [0.0; 3] {
        let _ = writeln!(
            toml,
            "flange_offset = {}",
            three(rest.position, millimetres)
        );
    }
    let turned = rest.wpr();
    if turned.to_array().map(|a| rounded(a.to_degrees())) != [0.0; 3] {
        let _ = writeln!(toml, "flange_angles = {}", three(turned, degrees));
    }
}

/// Whether a flange's z points askew to an axis of the frame before it.
fn is_askew(rest: Pose, axis: DVec3) -> bool {
    (rest.orientation * DVec3::Z).cross(axis).length() > 1e-5
}

/// How far a flange lies along z of the last joint, outward, and what is left.
fn along_the_last(arm: &UrdfArm) -> (f64, Pose) {
    let flange = arm.last_from_flange;
    let along = DVec3::new(0.0, 0.0, flange.position.z.max(0.0));
    let rest = Pose {
        position: flange.position - along,
        ..flange
    };
    (along.z, rest)
}

fn degrees(rad: f64) -> String {
    format!("\"{} deg\"", rounded(rad.to_degrees()))
}

fn millimetres(mm: f64) -> String {
    format!("\"{} mm\"", rounded(mm))
}

/// Ten decimals at most, without the dust of conversions: files carry what a thousand millimetres away is still a millionth of one.
fn rounded(value: f64) -> f64 {
    // adding zero takes the sign from a zero
    (value * 1e10).round() / 1e10 + 0.0
}

fn list(values: impl Iterator<Item = String>) -> String {
    format!("[{}]", values.collect::<Vec<_>>().join(", "))
}

fn three(v: DVec3, show: fn(f64) -> String) -> String {
    list(v.to_array().into_iter().map(show))
}

/// The joints' table: limits and speeds, and what the file does not say of them. By a guess nothing passes.
fn limits(toml: &mut String, joints: &[Movable], source: &str) {
    let shown = |value: f64| format!("\"{} deg\"", six(value));
    let low = list(joints.iter().map(|j| shown(j.low)));
    let high = list(joints.iter().map(|j| shown(j.high)));
    let _ = write!(toml, "\n[joints]\n{source}\n");
    let speed = speeds(toml, joints);
    ends(toml, joints);
    let guessed = guessed(joints);
    if !guessed.is_empty() {
        let _ = writeln!(toml, "guesses = {guessed:?}");
    }
    if let Some(speed) = speed {
        let _ = writeln!(toml, "speed = {speed}");
    }
    let _ = writeln!(toml, "low = {low}\nhigh = {high}");
}

/// Keys of the joints' table that are guesses.
pub(super) fn guessed(joints: &[Movable]) -> Vec<&'static str> {
    let silent = |j: &Movable| j.speed.is_none();
    let speed = joints.iter().any(silent) && !joints.iter().all(silent);
    let ends = joints.iter().any(|j| j.end == End::Nowhere);
    let all = [("speed", speed), ("low", ends), ("high", ends)];
    all.into_iter().filter(|k| k.1).map(|k| k.0).collect()
}

/// Tells where joints end otherwise than at their `<limit>`.
fn ends(toml: &mut String, joints: &[Movable]) {
    for (joint, i) in joints.iter().zip(1..) {
        let name = &joint.name;
        if joint.end == End::Nowhere {
            let _ = writeln!(
                toml,
                "# joint {i} ({name:?}) is continuous: 360 deg to each side is a guess; write what the controller lets it turn, and take the guess out"
            );
        } else if let Some((low, high)) = joint.hard {
            let _ = writeln!(
                toml,
                "# joint {i} ({name:?}) ends at the soft limits of its safety_controller, within {} to {} deg",
                six(low),
                six(high)
            );
        }
    }
}

/// An angle in degrees as limits are read by people: what is beyond six decimals is dust.
fn six(rad: f64) -> f64 {
    (rad.to_degrees() * 1e6).round() / 1e6 + 0.0
}

/// The joints' speeds. Where some are missing the slowest of the others stands for them, as a guess.
fn speeds(toml: &mut String, joints: &[Movable]) -> Option<String> {
    let known = || joints.iter().filter_map(|j| j.speed);
    let silent: Vec<String> = joints
        .iter()
        .zip(1..)
        .filter(|(j, _)| j.speed.is_none())
        .map(|(j, i)| format!("joint {i} ({:?})", j.name))
        .collect();
    let Some(slowest) = known().reduce(f64::min) else {
        toml.push_str("# the URDF says no velocity of any joint: speeds are not checked; write speed = [six of them] from the data sheet\n");
        return None;
    };
    if !silent.is_empty() {
        let _ = writeln!(
            toml,
            "# the URDF says no velocity of {}: the slowest of the others is a guess; write the data sheet's and take the guess out",
            silent.join(", ")
        );
    }
    let speed = joints.iter().map(|j| j.speed.unwrap_or(slowest));
    Some(list(speed.map(|s| format!("\"{} deg/s\"", six(s)))))
}

/// Lengths of an arm with a spherical wrist.
fn spherical(toml: &mut String, found: &Recognised) {
    let p = &found.parameters;
    for (key, length) in [
        ("shoulder_height", p.c1),
        ("shoulder_forward", p.a1),
        ("arm_aside", p.b),
        ("upper_arm", p.c2),
        ("forearm_above_elbow", -p.a2),
        ("forearm", p.c3),
    ] {
        if rounded(length) != 0.0 || key == "shoulder_height" {
            let _ = writeln!(toml, "{key} = {}", millimetres(length));
        }
    }
}

/// How the joints of an arm with a spherical wrist count.
fn shown(toml: &mut String, found: &Recognised) {
    let p = &found.parameters;
    let zero = list(p.zero.iter().map(|z| degrees(*z)));
    let signs = p
        .sign
        .iter()
        .map(|s| if *s > 0.0 { "\"+\"" } else { "\"-\"" });
    let _ = writeln!(
        toml,
        "zero = {zero}\ndirections = {}",
        list(signs.map(str::to_owned))
    );
    toml.push_str("# URDFs show FANUC's third joint uncoupled: add elbow_shows = \"level\" for the pendant's, with its limits\n");
}

/// The six axes of any other arm.
fn axes(toml: &mut String, joints: &[Movable]) {
    toml.push_str("kind = \"axes\"\n");
    for joint in joints {
        let pose = joint.parent_from_joint;
        let _ = writeln!(
            toml,
            "[[arm.axes]]\nposition = {}\nangles = {}\naxis = {}",
            three(pose.position, millimetres),
            three(pose.wpr(), degrees),
            three(joint.axis, |a| format!("{:?}", a + 0.0)),
        );
    }
}

/// What carries the arm, where its base does not lie in the root of the file.
fn base(toml: &mut String, root_from_base: Pose, source: &str) {
    let (position, wpr) = (root_from_base.position, root_from_base.wpr());
    let still = position.to_array().map(rounded) == [0.0; 3]
        && wpr.to_array().map(|a| rounded(a.to_degrees())) == [0.0; 3];
    if still {
        return;
    }
    let _ = writeln!(
        toml,
        "\n# what carries the arm in the URDF: its root is the world\n[base]\n{source}\nposition = {}\nangles = {}",
        three(position, millimetres),
        three(wpr, degrees)
    );
}
