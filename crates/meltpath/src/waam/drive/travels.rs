//! The pace of programs under the limits of the axes: a travel on which an axis takes longer than the tool is driven as much slower; along beads
//! the motion is as slow as its axes are there.

use meltpath_base::{Fact, Measure, Observer, Quiet};
use meltpath_programs::{Dialect, Program};
use meltpath_robot::cell::{Cell, Values};
use meltpath_robot::command::{Kind, Source};
use meltpath_robot::posture::{Rotation, hold};
use meltpath_robot::travel::{LeastTime, least_time};

use crate::waam::drive::axes::axis;
use crate::waam::drive::driven;
use crate::waam::drive::film::{self, Step};
use crate::waam::drive::hold::followed;
use crate::waam::drive::joint_moves;
use crate::waam::drive::positions::{Positions, named, stands};
use crate::waam::drive::times::{Times, longer};
use crate::waam::drive::way::task;
use crate::waam::program::{self, Commands, Slowed};
use crate::waam::settings::Settings;

/// Moves shorter than this have no speed to set, mm.
const NOWHERE: f64 = 1e-3;

/// Drives programs as they are written so slowly that every axis of the job's robot gets along: travels as a whole, beads where an axis cannot
/// follow. Where the robot does not hold the torch along them they stay as they are: the verdict tells why.
pub(in crate::waam) fn pace(
    programs: &[Program],
    moves: &mut Commands,
    settings: &Settings,
    observer: &dyn Observer,
) {
    let Some(cell) = followed(moves, settings) else {
        return;
    };
    let mut programs = programs.to_vec();
    let positions = Positions::of(&programs);
    let named = named(&positions, &mut programs, moves, cell);
    let named = stands(&named, moves);
    let held = {
        let task = task(cell, moves, Rotation::Written, &named);
        hold(&task, &Quiet(observer)).and_then(|held| Ok((film::steps(&task, &held)?, held)))
    };
    let Ok(((steps, joint_moves), held)) = held else {
        return;
    };
    // of RAPID a joint move has the speed of the tool; of others a share of what the joints can do
    let full = match program::spoken(&programs) {
        Dialect::Rapid => None,
        _ => Some(settings.controller.joint_speed.value.0),
    };
    joint_moves::follow(joint_moves, full, (cell, moves), &settings.controller);
    slow_travels(&steps, (cell, moves), settings);
    let task = task(cell, moves, Rotation::Written, &named);
    moves.driven = driven::along(&task, &held, moves, (settings, observer));
}

/// Drives straight travels as slowly as their slowest axis.
fn slow_travels(steps: &[Step], (cell, moves): (&Cell, &mut Commands), settings: &Settings) {
    let times = Times::of(moves, &settings.controller);
    let mut before: Option<Values> = None;
    for of_move in steps.chunk_by(|a, b| a.command == b.command) {
        let from = before;
        before = of_move.last().map(|s| s.values);
        let (Some(from), Some(command)) = (from, of_move.first().map(|s| s.command)) else {
            continue;
        };
        let Some(slowed) = slowed(cell, moves, &times, (command, from, of_move)) else {
            continue;
        };
        moves.slowed.push(slowed);
        let (more, way) = (slowed.least.time - slowed.programmed, times.way(command));
        if let Some(command) = moves.commands.get_mut(command as usize)
            && way > NOWHERE
        {
            command.speed = way / (way / command.speed + more);
        }
    }
}

/// What a travel needs more than the tool alone; nothing where it does not.
fn slowed(
    cell: &Cell,
    moves: &Commands,
    times: &Times,
    (number, from, steps): (u32, Values, &[Step]),
) -> Option<Slowed> {
    let command = moves.commands.get(number as usize)?;
    let straight = matches!(command.kind, Kind::Line | Kind::Arc { .. });
    if command.source != Source::Off || !straight {
        return None;
    }
    let places: Vec<Values> = std::iter::once(from)
        .chain(steps.iter().map(|s| s.values))
        .collect();
    let least = least_time(cell, &places, times.rests(number), 1.0)?;
    let programmed = times.time(number);
    longer(number, least, programmed)
}

/// Travels that axes make longer.
pub(in crate::waam) fn fact(moves: &Commands) -> Option<Fact> {
    let more = |s: &Slowed| s.least.time - s.programmed;
    let worst = moves
        .slowed
        .iter()
        .max_by(|a, b| more(a).total_cmp(&more(b)))?;
    let LeastTime {
        time,
        axis: slowest,
        ..
    } = worst.least;
    let mut told = format!(
        "most {}: {time:.1} s in place of {:.1} s",
        axis(slowest),
        worst.programmed
    );
    if moves.slowed.iter().any(|s| !s.least.accelerated) {
        told += "; without accelerations, which the robot's file does not tell";
    }
    let fact = Fact::new(
        "travel-axes",
        "travels take longer than programmed, as an axis goes no faster",
        Measure::exact(moves.slowed.iter().map(more).sum(), "s"),
        &told,
    );
    let target = moves.commands.get(worst.command as usize)?.target;
    Some(fact.at(moves.place(worst.command, target)))
}
