//! Why a robot cannot hold its torch somewhere, and what to do about it.

use meltpath_robot::cell::{Arrangement, Cell};
use meltpath_robot::kinematics::Unreachable;
use meltpath_robot::posture::{NotHeld, Why};

use crate::waam::drive::axes::axis;

/// The table of the robot's file that says where that stands which it works on or with.
pub(super) fn what_stands(cell: Option<&Cell>) -> &'static str {
    match cell.map(|cell| cell.arrangement) {
        Some(Arrangement::PartOnRobot) => "[torch]",
        _ => "[table]",
    }
}

/// Why a place cannot be held by a cell, and what to do about it.
pub(in crate::waam) fn not_held(not: &NotHeld, cell: &Cell) -> (String, String) {
    why(not, what_stands(Some(cell)))
}

/// Why a place cannot be held, and what to do about it where this table of the robot's file says what stands.
pub(super) fn why(not: &NotHeld, table: &str) -> (String, String) {
    let file = format!("machine.place, or {table} of the robot's file");
    match not.why {
        Why::Unreachable(why) => (
            why.to_string(),
            match why {
                Unreachable::TooFar { .. } => format!("move the part nearer: {file}"),
                Unreachable::TooNear { .. } => format!("move the part away: {file}"),
                Unreachable::BesideAxis { .. } => {
                    format!("move the part away from the first axis: {file}")
                }
                Unreachable::AtBorder | Unreachable::NothingFound => {
                    format!("move the part a little: {file}")
                }
            },
        ),
        Why::Limit { joint, by } => (
            format!("whatever the rotation about the wire, a joint is beyond its limits: at best joint {}, by {:.1} deg", joint + 1, by.to_degrees()),
            format!("move the part: {file}"),
        ),
        Why::External { axis: number, by } => (
            format!("{} would go {} beyond its limit", axis(6 + number), match number {
                0 => format!("{by:.1} mm"),
                _ => format!("{:.1} deg", by.to_degrees()),
            }),
            "limits of the robot's file, or the part elsewhere: machine.place".to_owned(),
        ),
        Why::Stopped => ("the search was stopped".to_owned(), "run it again".to_owned()),
        Why::Configuration(wanted) => (
            format!("no way to hold the torch there within limits is {wanted}, as the program says"),
            "touch up the position at the controller".to_owned(),
        ),
        Why::Change => (
            "the torch can be held there, but not by going on from the places before: the arm would have to change its configuration, or wind a joint beyond its limits, within a move".to_owned(),
            "move the part, so that the wrist stays on one side of the first axis and its own axes do not come in line".to_owned(),
        ),
    }
}
