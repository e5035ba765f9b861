//! The pace of programs under the limits of the axes: a travel on which an axis takes longer than the tool is driven as much slower; along beads
//! the motion is as slow as its axes are there.

use meltpath_base::{Fact, Measure, Observer, Quiet};
use meltpath_geometry::math::DVec3;
use meltpath_programs::{Dialect, Program};
use meltpath_robot::cell::{Cell, Values};
use meltpath_robot::command::{Command, Kind, Smoothing, Source};
use meltpath_robot::controller::Controller;
use meltpath_robot::interpolation::corner::dwells;
use meltpath_robot::posture::{Rotation, hold};
use meltpath_robot::travel::{LeastTime, least_time};

use crate::waam::drive::axes::axis;
use crate::waam::drive::driven;
use crate::waam::drive::film::{self, Step};
use crate::waam::drive::hold::{Positions, followed, named, task};
use crate::waam::program::{self, Commands, Slowed};
use crate::waam::settings::Settings;

/// Times closer than this are one, s.
const SAME: f64 = 0.05;
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
    let held = {
        let task = task(cell, moves, Rotation::Written, &named);
        hold(&task, &Quiet(observer)).and_then(|held| Ok((film::steps(&task, &held)?, held)))
    };
    let Ok((steps, held)) = held else { return };
    slow_travels(&programs, &steps, (cell, moves), settings);
    let task = task(cell, moves, Rotation::Written, &named);
    moves.driven = driven::along(&task, &held, moves, (settings, observer));
}

/// Drives travels as slowly as their slowest axis.
fn slow_travels(
    programs: &[Program],
    steps: &[Step],
    (cell, moves): (&Cell, &mut Commands),
    settings: &Settings,
) {
    let times = Times::of(moves, &settings.controller);
    // of RAPID a joint move has the speed of the tool; of others a share of what the joints can do
    let full = match program::spoken(programs) {
        Dialect::Rapid => None,
        _ => Some(settings.controller.joint_speed.value.0),
    };
    let mut before: Option<Values> = None;
    for of_move in steps.chunk_by(|a, b| a.command == b.command) {
        let from = before;
        before = of_move.last().map(|s| s.values);
        let (Some(from), Some(command)) = (from, of_move.first().map(|s| s.command)) else {
            continue;
        };
        let Some(slowed) = slowed((cell, full), moves, &times, (command, from, of_move)) else {
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

/// What a travel needs more than the tool alone; nothing where it does not. `full` is the tool's speed in a joint move at 100 %.
fn slowed(
    (cell, full): (&Cell, Option<f64>),
    moves: &Commands,
    times: &Times,
    (number, from, steps): (u32, Values, &[Step]),
) -> Option<Slowed> {
    let command = moves.commands.get(number as usize)?;
    if command.source != Source::Off || matches!(command.kind, Kind::Wait { .. }) {
        return None;
    }
    let places: Vec<Values> = std::iter::once(from)
        .chain(steps.iter().map(|s| s.values))
        .collect();
    let share = match (command.kind, full) {
        (Kind::Joint, Some(full)) => (command.speed / full).min(1.0),
        _ => 1.0,
    };
    let least = least_time(cell, &places, times.rests(number), share)?;
    let programmed = times.time(number);
    (least.time - programmed > SAME).then_some(Slowed {
        command: number,
        least,
        programmed,
    })
}

/// How long each move takes the tool, from the passage before it to its own.
struct Times {
    ways: Vec<f64>,
    taken: Vec<f64>,
    /// Whether the tool rests at the end of each move.
    rests: Vec<bool>,
}

impl Times {
    fn of(moves: &Commands, controller: &Controller) -> Self {
        let start = moves.start;
        let dwells = dwells(
            start.position,
            start.orientation,
            &moves.commands,
            controller,
        );
        let transition = controller.transition();
        let mut times = Times {
            ways: Vec::with_capacity(dwells.len()),
            taken: Vec::with_capacity(dwells.len()),
            rests: Vec::with_capacity(dwells.len()),
        };
        let (mut here, mut turned, mut begin) = (start.position, start.orientation, 0.0);
        for (command, dwell) in moves.commands.iter().zip(dwells) {
            let rests = dwell >= transition || stops(command);
            let (way, time) = if let Kind::Wait { time } = command.kind {
                (0.0, time)
            } else {
                let way = length(here, command);
                let turn = turned.angle_between(command.orientation);
                (here, turned) = (command.target, command.orientation);
                let speed = controller.rotation_speed.value.0;
                (way, (way / command.speed).max(turn / speed))
            };
            // the passage is the end of a stop, else the middle of the transition
            let end = if rests {
                dwell
            } else {
                0.5 * (transition + dwell)
            };
            times.ways.push(way);
            times.taken.push(begin + time + end);
            times.rests.push(rests);
            begin = if rests {
                0.0
            } else {
                0.5 * (dwell - transition)
            };
        }
        times
    }

    fn way(&self, command: u32) -> f64 {
        self.ways.get(command as usize).copied().unwrap_or(0.0)
    }

    fn time(&self, command: u32) -> f64 {
        self.taken.get(command as usize).copied().unwrap_or(0.0)
    }

    /// Whether the tool rests where a move begins and ends.
    fn rests(&self, command: u32) -> [bool; 2] {
        let at = |i: usize| self.rests.get(i).copied().unwrap_or(true);
        let i = command as usize;
        [i.checked_sub(1).is_none_or(at), at(i)]
    }
}

/// Whether the tool stands at the end of a command.
fn stops(command: &Command) -> bool {
    match (command.kind, command.smoothing) {
        (Kind::Wait { .. }, _) | (_, Smoothing::Fine) => true,
        (_, Smoothing::Cnt(share)) => share <= 0.0,
    }
}

/// Length of the tool's way, mm.
fn length(from: DVec3, command: &Command) -> f64 {
    match command.kind {
        Kind::Arc { via } => from.distance(via) + via.distance(command.target),
        _ => from.distance(command.target),
    }
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
