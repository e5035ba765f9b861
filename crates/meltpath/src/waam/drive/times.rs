//! How long moves take the tool, from the passage before each to its own.

use meltpath_geometry::math::DVec3;
use meltpath_robot::command::{Command, Kind, Smoothing};
use meltpath_robot::controller::Controller;
use meltpath_robot::interpolation::corner::dwells;
use meltpath_robot::travel::LeastTime;

use crate::waam::program::{Commands, Slowed};

/// Times closer than this are one, s.
const SAME: f64 = 0.05;

/// A move whose axes take longer than is programmed; nothing where they do not.
pub(in crate::waam) fn longer(command: u32, least: LeastTime, programmed: f64) -> Option<Slowed> {
    (least.time - programmed > SAME).then_some(Slowed {
        command,
        least,
        programmed,
    })
}

/// How long each move takes the tool, from the passage before it to its own.
pub(in crate::waam) struct Times {
    ways: Vec<f64>,
    /// At an even pace.
    own: Vec<f64>,
    /// With what the controller's smoothing adds.
    taken: Vec<f64>,
    /// Whether the tool rests at the end of each move.
    rests: Vec<bool>,
}

impl Times {
    pub(in crate::waam) fn of(moves: &Commands, controller: &Controller) -> Self {
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
            own: Vec::with_capacity(dwells.len()),
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
                let time = match command.kind {
                    Kind::Joint(Some(course)) => course.time,
                    _ => (way / command.speed).max(turn / controller.rotation_speed.value.0),
                };
                (way, time)
            };
            // the passage is the end of a stop, else the middle of the transition
            let end = if rests {
                dwell
            } else {
                0.5 * (transition + dwell)
            };
            times.ways.push(way);
            times.own.push(time);
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

    /// Length of the tool's way, mm; of a joint move the chord.
    pub(in crate::waam) fn way(&self, command: u32) -> f64 {
        self.ways.get(command as usize).copied().unwrap_or(0.0)
    }

    /// How long a move takes, s.
    pub(in crate::waam) fn time(&self, command: u32) -> f64 {
        self.taken.get(command as usize).copied().unwrap_or(0.0)
    }

    /// What the controller's smoothing adds to a move, s; below zero where it begins with what is left of a dwell.
    pub(in crate::waam) fn beside(&self, command: u32) -> f64 {
        let own = self.own.get(command as usize).copied().unwrap_or(0.0);
        self.time(command) - own
    }

    /// Whether the tool rests where a move begins and ends.
    pub(in crate::waam) fn rests(&self, command: u32) -> [bool; 2] {
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
