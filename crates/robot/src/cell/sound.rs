//! Lengths and limits of an arm that none has: most often a slip of the unit.

use std::f64::consts::TAU;
use std::fmt::Display;

use meltpath_base::Length;
use meltpath_base::settings::{Problem, Setting};

use meltpath_geometry::math::DVec3;

use super::file::{ArmTable, CellFile, JointsTable};
use super::layout::Arrangement;
use crate::kinematics::{Chain, Limits};

/// No arm has a link longer than this, mm: twice the reach of the longest that are sold.
pub(super) const LONGEST: f64 = 10_000.0;
/// No arm turns a joint farther to a side, turns: the last axes of arms that turn without end are told with a handful.
pub(super) const MOST_TURNS: f64 = 10.0;
/// What is wrong with the order of two limits, and what to do; nothing where the lesser one is below.
pub(super) fn order(low: f64, high: f64) -> Option<(&'static str, &'static str)> {
    if low > high {
        Some(("the limits are swapped", "write the lesser one in low"))
    } else if low < high {
        None
    } else {
        Some((
            "the limits are equal",
            "write the least value in low and the greatest in high; for an axis that stands, a little to both sides of where it does",
        ))
    }
}

/// Tells limits that are swapped or equal.
pub(super) fn told<T>(
    written: &Setting<T>,
    of: &str,
    (low, high): (impl Display, impl Display),
    (what, help): (&str, &str),
) -> Problem {
    let message = format!("{of} goes from {low} to {high}: {what}");
    written.problem(message).help(help)
}

/// Joints that turn farther than any arm's.
pub(super) fn turns(joints: &JointsTable, limits: &[Limits; 6]) -> Vec<Problem> {
    let far = |l: &Limits| l.low.abs().max(l.high.abs()) / TAU > MOST_TURNS;
    let all = limits.iter().enumerate().filter(|(_, l)| far(l));
    all.map(|(i, l)| {
        let [low, high] = [l.low, l.high].map(|v| v / TAU);
        let message = format!(
            "joint {} goes from {low:.1} to {high:.1} turns: no arm turns a joint farther than {MOST_TURNS} to a side",
            i + 1
        );
        let help = format!(
            "are degrees meant, and rad written? Then \"{:.0} deg\" and \"{:.0} deg\"; of a joint without an end write \"-3600 deg\" and \"3600 deg\"",
            l.low, l.high
        );
        joints.high.problem(message).help(help)
    })
    .collect()
}

/// Zeros that are farther off than a whole turn.
pub(super) fn zeros(joints: &JointsTable) -> Option<Problem> {
    let all = (*joints.zero)?;
    let (i, far) = all.iter().enumerate().find(|(_, z)| z.0.abs() > TAU)?;
    let message = format!(
        "the zero of joint {} lies {:.1} turns off: no controller shows zero beyond a whole turn",
        i + 1,
        far.0 / TAU
    );
    let help = format!(
        "are degrees meant, and rad written? Then \"{:.0} deg\"",
        far.0
    );
    Some(joints.zero.problem(message).help(help))
}

/// Links that are longer than any arm's.
pub(super) fn lengths(arm: &ArmTable) -> Vec<Problem> {
    let links = [
        &arm.shoulder_height,
        &arm.shoulder_forward,
        &arm.arm_aside,
        &arm.upper_arm,
        &arm.forearm_above_elbow,
        &arm.forearm,
        &arm.wrist_aside,
        &arm.wrist_offset,
        &arm.flange,
    ];
    let written = links.into_iter().filter_map(|l| Some((l, (**l)?)));
    let long = |length: Length| length.0.abs() > LONGEST;
    let mut problems: Vec<Problem> = written
        .filter(|(_, length)| long(*length))
        .map(|(link, length)| told_long(link, &link.name, length))
        .collect();
    let off = arm.flange_offset.iter().find(|l| long(**l));
    problems
        .extend(off.map(|length| told_long(&arm.flange_offset, &arm.flange_offset.name, *length)));
    for (i, axis) in arm.axes.iter().enumerate() {
        let longest = axis.position.iter().find(|l| long(**l));
        problems.extend(longest.map(|length| {
            let of = format!("the position of axis {} of {}", i + 1, arm.axes.name);
            told_long(&axis.position, &of, *length)
        }));
    }
    problems
}

/// A nozzle with a radius of more lengths is one whose numbers stand the wrong way round.
const FLATTEST: f64 = 2.0;

/// Shapes that the lengths of arm and torch contradict.
pub(super) fn shapes(file: &CellFile, chain: &Chain) -> Vec<Problem> {
    let Some(shapes) = file.shapes.as_ref() else {
        return Vec::new();
    };
    let places = chain.joints.iter().map(|j| j.parent_from_joint.position);
    let places = places.chain([chain.last_from_end.position]);
    let longest = places.map(DVec3::length).fold(0.0, f64::max);
    let radii = shapes.links.iter().flatten();
    let thickest = radii.map(|l| l.0).fold(0.0, f64::max);
    let nozzle = shapes.nozzle[0].0;
    let torch = DVec3::from_array(file.torch.position.map(|l| l.0)).length();
    let on_robot = *file.arrangement == Arrangement::TorchOnRobot;
    let links = (thickest > longest).then(|| {
        let message = format!(
            "{} has a radius of {thickest} mm, more than the longest link of the arm has length: {longest:.0} mm",
            shapes.links.name
        );
        let help = "write half of how thick the link is";
        shapes.links.problem(message).help(help)
    });
    let nozzle = (on_robot && file.torch.position.is_written() && nozzle > torch).then(|| {
        let message = format!(
            "{} is {nozzle} mm long, and the contact tube ends {torch:.0} mm from the flange",
            shapes.nozzle.name
        );
        let help = "write how long the nozzle is, from the torch's body to the end of the contact tube, then its radius";
        shapes.nozzle.problem(message).help(help)
    });
    let [long, radius] = shapes.nozzle.map(|l| l.0);
    let flat = (radius > FLATTEST * long).then(|| {
        let message = format!(
            "{} is {long} mm long, with a radius of {radius} mm: wider than a nozzle is long by far",
            shapes.nozzle.name
        );
        let help = "write its length first, then its radius";
        shapes.nozzle.problem(message).help(help)
    });
    links.into_iter().chain(nozzle).chain(flat).collect()
}

fn told_long<T>(written: &Setting<T>, of: &str, length: Length) -> Problem {
    let metres = length.0 / 1000.0;
    let message = format!(
        "{of} is {metres} m: no arm has a link longer than {} m",
        LONGEST / 1000.0
    );
    let help = if metres.abs() < LONGEST {
        format!("are millimetres meant, and metres written? Then \"{metres} mm\"")
    } else {
        "write the length of the drawing, with its unit".to_owned()
    };
    written.problem(message).help(help)
}
