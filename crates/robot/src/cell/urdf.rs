//! The arm of a URDF (the robot description of ROS) as the text of a robot file: its closed form where it has a spherical wrist,
//! else its six axes. Shapes, torch and table are not taken: meshes of makers are not free, and the rest stands elsewhere.

mod error;
mod read;
mod wrist;

use std::fmt::Write as _;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

pub use error::UrdfError;
use read::{Movable, arm};
use wrist::Recognised;

/// The text of a robot file that says what a URDF says of its arm.
///
/// # Errors
/// [`UrdfError`] with what is wrong.
pub fn from_urdf(text: &str) -> Result<String, UrdfError> {
    let arm = arm(text)?;
    let mut toml = format!(
        "name = {name:?}\n\n[arm]\nsource = \"its URDF\"\n",
        name = arm.name
    );
    match Recognised::of(&arm.joints, arm.last_from_flange) {
        Some(found) => spherical(&mut toml, &found),
        None => axes(&mut toml, &arm.joints, arm.last_from_flange, &arm.flange)?,
    }
    Ok(toml)
}

fn degrees(rad: f64) -> String {
    format!("\"{} deg\"", rounded(rad.to_degrees()))
}

fn millimetres(mm: f64) -> String {
    format!("\"{} mm\"", rounded(mm))
}

/// Six decimals at most, without the dust of conversions.
fn rounded(value: f64) -> f64 {
    // adding zero takes the sign from a zero
    (value * 1e6).round() / 1e6 + 0.0
}

fn list(values: impl Iterator<Item = String>) -> String {
    format!("[{}]", values.collect::<Vec<_>>().join(", "))
}

/// The joints' table.
fn limits(toml: &mut String, joints: &[Movable]) {
    let low = list(joints.iter().map(|j| degrees(j.low)));
    let high = list(joints.iter().map(|j| degrees(j.high)));
    // writing into a string does not fail, here and below
    let _ = write!(
        toml,
        "\n[joints]\nsource = \"its URDF\"\nlow = {low}\nhigh = {high}\n"
    );
    if joints.iter().all(|j| j.speed > 0.0) {
        let speed = joints
            .iter()
            .map(|j| format!("\"{} deg/s\"", rounded(j.speed.to_degrees())));
        let _ = writeln!(toml, "speed = {}", list(speed));
    }
}

fn spherical(toml: &mut String, found: &Recognised) {
    let p = &found.parameters;
    for (key, length) in [
        ("shoulder_height", p.c1),
        ("shoulder_forward", p.a1),
        ("arm_aside", p.b),
        ("upper_arm", p.c2),
        ("forearm_above_elbow", -p.a2),
        ("forearm", p.c3),
        ("flange", p.c4),
    ] {
        if rounded(length) != 0.0 || matches!(key, "shoulder_height" | "flange") {
            let _ = writeln!(toml, "{key} = {}", millimetres(length));
        }
    }
    limits(toml, &found.joints);
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

fn axes(toml: &mut String, joints: &[Movable], flange: Pose, name: &str) -> Result<(), UrdfError> {
    let along = flange.position.z;
    let aside = flange.position.truncate().length();
    let turned =
        flange.orientation.x.abs() + flange.orientation.y.abs() + flange.orientation.z.abs();
    if aside > 1e-6 || turned > 1e-9 {
        return Err(UrdfError::Flange(name.to_owned()));
    }
    let _ = writeln!(toml, "kind = \"axes\"\nflange = {}", millimetres(along));
    let three = |v: DVec3, show: fn(f64) -> String| list(v.to_array().into_iter().map(show));
    for joint in joints {
        let pose = joint.parent_from_joint;
        let _ = writeln!(
            toml,
            "[[arm.axes]]\nposition = {}\nangles = {}\naxis = {}",
            three(pose.position, millimetres),
            three(pose.wpr(), |a| format!("\"{} deg\"", a.to_degrees())),
            three(joint.axis, |a| format!("{a:?}")),
        );
    }
    limits(toml, joints);
    Ok(())
}
