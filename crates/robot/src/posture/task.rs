//! What is held along what, and why it may not be possible.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use rayon::prelude::*;

use crate::cell::{Cell, External, Stance, Values};
use crate::command::Command;
use crate::kinematics::Unreachable;

/// What is held along what.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// Where track and positioner rest; the arm's values are not read.
    pub values: Values,
    /// What track and positioner do.
    pub axes: Axes<'a>,
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

/// What track and positioner do along a program. On the way of a move they go in step with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Axes<'a> {
    /// They rest.
    Standing,
    /// Anything that helps the arm and keeps the torch upright.
    Free,
    /// What is written.
    Written {
        /// Where the program starts.
        start: External,
        /// At the end of each command, by its number; those beyond the last stay where they are.
        ends: &'a [External],
    },
}

/// How much room is left beyond what is asked for, and so much more, while a command is executed and the cell stands so, mm. Exact below zero;
/// what is above may be told as less.
pub type Guard<'a> = &'a (dyn Fn(u32, &Values, f64) -> f64 + Sync);

/// Ways that come nearer than they may, where none keeps away, are those within this of the best, mm.
const ALIKE: f64 = 1.0;

/// Keeps the ways that have room; where none has, those that have most.
pub(super) fn keep_clear<T>(ways: &mut Vec<T>, room: impl Fn(&T) -> f64 + Send + Sync)
where
    T: Sync,
{
    let rooms: Vec<f64> = ways.par_iter().map(room).collect();
    let most = rooms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = (most - ALIKE).min(0.0);
    let mut rooms = rooms.into_iter();
    ways.retain(|_| rooms.next().is_some_and(|room| room >= least));
}

/// A piece of a run on which bodies come nearer than they may.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// Lengths between which they do, mm.
    pub between: [f64; 2],
    /// How far beside it they are to be kept apart too, mm.
    pub beside: f64,
    /// How much room they lack at most, mm.
    pub lack: f64,
}

/// Guards the key places of `lengths` beside which a way is too near, and one beyond each end. Where they are guarded already they are
/// clear, and the way is too near between them: they are to keep so much more room. The first one that is new; nothing where none is.
pub(super) fn guard_places(
    guarded: &mut BTreeMap<usize, f64>,
    lengths: &[f64],
    near: Near,
) -> Option<usize> {
    let places = |from: f64, to: f64| {
        let first = lengths.partition_point(|l| *l < from).saturating_sub(1);
        let last = lengths.partition_point(|l| *l <= to);
        first..=last.min(lengths.len().saturating_sub(1))
    };
    let [from, to] = near.between;
    let mut new: Option<usize> = None;
    for place in places(from, to) {
        if let Some(more) = guarded.get_mut(&place) {
            *more += near.lack;
            new = Some(new.map_or(place, |n| n.min(place)));
        }
    }
    for place in places(from - near.beside, to + near.beside) {
        if let Entry::Vacant(vacant) = guarded.entry(place) {
            vacant.insert(0.0);
            new = Some(new.map_or(place, |n| n.min(place)));
        }
    }
    new
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
    /// Track or positioner would go beyond a limit.
    External {
        /// The axis, from 0: the track, then those of the positioner.
        axis: usize,
        /// By how much, mm or rad.
        by: f64,
    },
    /// It can be held, but not as its position says.
    Configuration(Stance),
    /// The person stopped the search.
    Stopped,
    /// It can be held, but no way to hold it leads there from the places before without a change of configuration.
    Change,
}
