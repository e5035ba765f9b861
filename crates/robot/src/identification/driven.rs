//! The path that was driven while a log was written: moves between two stops, and where the controller may dwell.

use std::ops::Range;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use crate::command::{Command, Kind, Smoothing};
use crate::controller::{Controller, CornerLaw};
use crate::interpolation::corner;
use crate::interpolation::track::Shape;

/// Chords of arcs lie so near to them, mm.
const CHORD: f64 = 0.01;
/// Smoothings closer than this are one.
const SAME: f64 = 1e-6;

/// Why a path tells nothing of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PathError {
    /// Nothing moves.
    #[error(
        "the path has no straight or circular move between two stops: nothing can be compared with the log"
    )]
    NoMove,
    /// No change of direction without a stop.
    #[error(
        "the path has no corner that is driven without a stop: drive a polygon with corners of several angles at each smoothing that your programs use"
    )]
    NoCorner,
}

/// What the controller does at the end of a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// Goes on as if nothing were.
    Through,
    /// Goes round a corner.
    Corner {
        /// Which smoothing, in [`DrivenPath::smoothings`].
        smoothing: usize,
        /// Share of the full dwell, by the angle.
        share: f64,
        /// How far the direction changes, rad.
        turn: f64,
    },
    /// Stops.
    Stop,
}

/// Moves from a stop to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Where the tool stands before.
    pub start: Pose,
    /// The moves; they are lines and arcs.
    pub commands: Vec<Command>,
    /// What happens at the end of each.
    pub ends: Vec<End>,
    /// What its commands are in the whole path.
    pub numbers: Range<usize>,
    /// How long the program waits after it, s; nothing where it goes on at once.
    pub wait: Option<f64>,
}

impl Stretch {
    /// Where the tool is after it.
    pub fn end(&self) -> DVec3 {
        self.commands
            .last()
            .map_or(self.start.position, |c| c.target)
    }

    /// Its way as chords, from the start on.
    pub(super) fn chords(&self) -> Vec<DVec3> {
        let mut points = vec![self.start.position];
        let mut from = self.start.position;
        for command in &self.commands {
            match corner::shape(from, command) {
                Shape::Arc(arc) => {
                    let n = arc.chords(CHORD).max(1);
                    points.extend((1..=n).map(|k| arc.at(k as f64 / n as f64)));
                }
                Shape::Hold(_) | Shape::Line { .. } => points.push(command.target),
            }
            from = command.target;
        }
        points
    }

    /// Lengths of its moves, mm.
    pub(super) fn lengths(&self) -> Vec<f64> {
        let mut from = self.start.position;
        let mut lengths = Vec::with_capacity(self.commands.len());
        for command in &self.commands {
            lengths.push(corner::shape(from, command).length());
            from = command.target;
        }
        lengths
    }
}

/// The path of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenPath {
    /// Its stretches, each beginning where the one before ended.
    pub stretches: Vec<Stretch>,
    /// Smoothings of its corners, 0 to 1, rising.
    pub smoothings: Vec<f64>,
}

impl DrivenPath {
    /// The path of commands, from rest at `start`; the tool stops at the last. Which corners are ones is told by `law`.
    ///
    /// # Errors
    /// [`PathError`].
    pub fn new(start: Pose, commands: &[Command], law: &CornerLaw) -> Result<Self, PathError> {
        let mut smoothings: Vec<f64> = Vec::new();
        let mut stretches = Vec::new();
        let mut from = start;
        let mut first = 0;
        for (k, command) in commands.iter().enumerate() {
            let waits = |c: &Command| match c.kind {
                Kind::Wait { time } => Some(time),
                Kind::Line | Kind::Arc { .. } | Kind::Joint(_) => None,
            };
            if waits(command).is_some() {
                first = k + 1;
                continue;
            }
            let next = commands.get(k + 1);
            let wait = next.and_then(waits);
            let stops = match command.smoothing {
                Smoothing::Fine => true,
                Smoothing::Cnt(share) => share <= 0.0,
            };
            if !(stops || wait.is_some() || next.is_none()) {
                continue;
            }
            let own = &commands[first..=k];
            let ends = ends(from, own, law, &mut smoothings);
            let stretch = Stretch {
                start: from,
                commands: own.to_vec(),
                ends,
                numbers: first..k + 1,
                wait,
            };
            from = Pose {
                position: command.target,
                orientation: command.orientation,
            };
            first = k + 1;
            if stretch.lengths().iter().sum::<f64>() > 0.0 {
                stretches.push(stretch);
            }
        }
        let mut path = DrivenPath {
            stretches,
            smoothings,
        };
        path.sort();
        let corner = |e: &End| matches!(e, End::Corner { .. });
        match &path.stretches[..] {
            [] => Err(PathError::NoMove),
            all if all.iter().any(|s| s.ends.iter().any(corner)) => Ok(path),
            _ => Err(PathError::NoCorner),
        }
    }

    /// Numbers smoothings as they rise.
    fn sort(&mut self) {
        let mut order: Vec<usize> = (0..self.smoothings.len()).collect();
        order.sort_by(|a, b| self.smoothings[*a].total_cmp(&self.smoothings[*b]));
        let place = |old: usize| order.iter().position(|o| *o == old).unwrap_or(old);
        for end in self.stretches.iter_mut().flat_map(|s| &mut s.ends) {
            if let End::Corner { smoothing, .. } = end {
                *smoothing = place(*smoothing);
            }
        }
        self.smoothings.sort_by(f64::total_cmp);
    }

    /// Its length, mm.
    pub fn length(&self) -> f64 {
        self.stretches.iter().flat_map(Stretch::lengths).sum()
    }

    /// The slowest and the fastest of its moves, mm/s.
    pub fn speeds(&self) -> [f64; 2] {
        let all = self.stretches.iter().flat_map(|s| &s.commands);
        all.fold([f64::INFINITY, 0.0], |[low, high], c| {
            [c.speed.min(low), c.speed.max(high)]
        })
    }
}

/// What happens at the end of each move of a stretch.
fn ends(start: Pose, commands: &[Command], law: &CornerLaw, smoothings: &mut Vec<f64>) -> Vec<End> {
    // a law whose dwell is a second everywhere tells the shares by angle
    let mut unit = Controller::without_corners();
    unit.corner.value = law.clone();
    for entry in &mut unit.dwell.value {
        entry.time.value.0 = 1.0;
    }
    let shares = corner::dwells(start.position, start.orientation, commands, &unit);
    let mut from = start.position;
    let mut ways = Vec::with_capacity(commands.len());
    for command in commands {
        ways.push(corner::shape(from, command));
        from = command.target;
    }
    let mut ends = Vec::with_capacity(commands.len());
    for (k, command) in commands.iter().enumerate() {
        let share = shares[k];
        ends.push(match command.smoothing {
            _ if k + 1 == commands.len() => End::Stop,
            Smoothing::Cnt(value) if share > 0.0 => {
                let known = smoothings.iter().position(|s| (s - value).abs() < SAME);
                let smoothing = known.unwrap_or_else(|| {
                    smoothings.push(value);
                    smoothings.len() - 1
                });
                let tangents = ways[k].end_tangent().zip(ways[k + 1].start_tangent());
                End::Corner {
                    smoothing,
                    share,
                    turn: tangents.map_or(0.0, |(a, b)| a.angle_between(b)),
                }
            }
            Smoothing::Fine | Smoothing::Cnt(_) => End::Through,
        });
    }
    ends
}
