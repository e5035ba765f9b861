//! What is held along what, and why it may not be possible.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use crate::cell::{Cell, Stance, Values};
use crate::command::Command;
use crate::kinematics::Unreachable;

/// What is held along what.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// Track and positioner, which stand still; the arm's values are not read.
    pub values: Values,
    /// Where the wire's tip starts, in the part.
    pub start: Pose,
    /// The moves of the wire's tip in the part, numbered by their position.
    pub commands: &'a [Command],
    /// The rotation about the wire.
    pub rotation: Rotation,
    /// How the arm stands where joint moves end, as the program says, by their commands; `None` for the start. Where nothing is said
    /// any way will do.
    pub configurations: &'a BTreeMap<Option<u32>, Stance>,
}

/// What may be chosen about the rotation of the torch about its wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rotation {
    /// Anything.
    Free,
    /// Nothing: it is as written.
    Written,
}

/// Where a program cannot be held, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NotHeld {
    /// The command.
    pub command: u32,
    /// The wire's tip in the part, mm.
    pub position: DVec3,
    /// Why.
    pub why: Why,
}

/// Why a place cannot be held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// Whatever the rotation about the wire.
    Unreachable(Unreachable),
    /// The best way to hold it has a joint beyond its limit.
    Limit {
        /// The joint, from 0.
        joint: usize,
        /// By how much, rad.
        by: f64,
    },
    /// It can be held, but not as its position says.
    Configuration(Stance),
    /// It can be held, but no way to hold it leads there from the places before without a change of configuration.
    Change,
}
