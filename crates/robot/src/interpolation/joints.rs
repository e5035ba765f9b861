//! Joint moves along the real motion: the joints pass the two averages of the controller, and the tip goes where the forward chain has it.
//!
//! The motion of [`super::fir`] goes along the chord of a joint move. Here the averaged chord is taken off again and the forward chain of the
//! averaged joints put in its place. Between two stops that is exactly the way of the averaged joints. Where a joint move and another move
//! pass into each other without a stop, each adds what it has gone by then, as pulses of speed that overlap do; joint moves in a row are
//! averaged in the joints. That a controller's averages of joints are those of its paths is an assumption, as for orientations.

use std::iter::Peekable;

use meltpath_base::Observer;
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_toolpath::{MotionBlock, MotionSink};

use super::corner::dwells;
use super::fir::{self, Cascade, MotionError};
use super::riders::across;
use super::timeline::{Piece, Step, Timeline};
use super::track::{Moments, Shape};
use crate::cell::{Cell, External, Values};
use crate::command::{Command, Kind};
use crate::controller::{Controller, ControllerError};
use crate::joint_move::JointMove;
use crate::summary::Summary;

/// Samples after which nothing of a pulse is left, beyond the averages themselves.
const LATE: f64 = 3.0;
/// Times closer than this are one, s.
const ROUNDING: f64 = 1e-9;
/// What is averaged of a joint move: place, axis and x axis of the tool along its chord, and three by three the axes of the cell.
const CHANNELS: usize = 6;

/// What a motion along chords lacks at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lacks {
    /// Of the wire's tip, mm.
    pub position: DVec3,
    /// Of the tool axis.
    pub axis: DVec3,
    /// Of the tool's x axis.
    pub across: DVec3,
    /// Where every axis stands, where no other move counts.
    pub alone: Option<Values>,
}

/// What goes on along a motion: its joint moves.
#[derive(Debug, Clone, Copy)]
pub struct Along<'a> {
    /// The cell; without one joint moves are taken as straight.
    pub cell: Option<&'a Cell>,
    /// Its joint moves whose ends are known, by their commands.
    pub moves: &'a [JointMove],
    /// Where the motion starts.
    pub start: Pose,
    /// Its commands, numbered by their position.
    pub commands: &'a [Command],
}

/// The joint moves of a motion, sample by sample, at the samples of [`super::fir::simulate`]. It does not end.
pub struct JointMoves<'a> {
    along: Along<'a>,
    steps: Peekable<Timeline<'a>>,
    /// The tool at the end of the steps so far.
    orientation: DQuat,
    runs: Vec<Run>,
    /// Whether the last step that moved was a joint move of the last run.
    goes_on: bool,
    /// When nothing of other moves is left, s.
    settled: f64,
    transition: f64,
    taps: (usize, usize),
    dt: f64,
    sample: usize,
}

/// A joint move in nominal time.
struct Pulse {
    piece: Piece,
    shapes: [Shape; CHANNELS],
}

/// Joint moves in a row.
struct Run {
    pulses: Vec<Pulse>,
    averages: [Cascade; CHANNELS],
    /// When what was before has no part in it any more, and when what comes after begins to, s.
    alone: [f64; 2],
}

impl<'a> JointMoves<'a> {
    /// Along commands with their dwells ([`super::corner::dwells`]).
    ///
    /// # Errors
    /// [`ControllerError`] where the period does not divide the averages.
    pub fn new(
        along: Along<'a>,
        dwells: &'a [f64],
        (controller, dt): (&Controller, f64),
    ) -> Result<Self, ControllerError> {
        let (place, orientation) = (along.start.position, along.start.orientation);
        let steps = Timeline::new(place, orientation, along.commands, dwells, controller);
        Ok(JointMoves {
            steps: steps.peekable(),
            orientation,
            runs: Vec::new(),
            goes_on: false,
            settled: f64::NEG_INFINITY,
            transition: controller.transition(),
            taps: controller.taps(dt)?,
            dt,
            sample: 0,
            along,
        })
    }

    /// The joint move of a command, where its ends are known.
    pub fn known(&self, command: u32) -> Option<&'a JointMove> {
        let moves = self.along.moves;
        let at = moves.binary_search_by_key(&command, |m| m.command);
        at.ok().and_then(|i| moves.get(i))
    }

    /// Takes the next step of nominal time.
    fn take(&mut self, step: &Step) {
        let Some(command) = self.along.commands.get(step.index) else {
            return;
        };
        let from = self.orientation;
        if matches!(command.kind, Kind::Wait { .. }) {
            return;
        }
        self.orientation = command.orientation;
        if step.pulse_end <= step.begin {
            return;
        }
        let Some(known) = self.known(step.index as u32) else {
            self.settled = step.pulse_end + self.transition;
            for run in &mut self.runs {
                run.alone[1] = run.alone[1].min(step.begin);
            }
            self.goes_on = false;
            return;
        };
        let pulse = Pulse::of(step, across(from, command.orientation), known);
        if let Some(run) = self.runs.last_mut().filter(|_| self.goes_on) {
            run.pulses.push(pulse);
        } else {
            let (n1, n2) = self.taps;
            let averages = |i: usize| Cascade::new(n1, n2, pulse.shapes[i].at(0.0));
            // after a stop nothing is left, at rest before the first move neither
            let left = self.settled > step.begin + ROUNDING;
            let after = if left {
                self.settled
            } else {
                f64::NEG_INFINITY
            };
            self.runs.push(Run {
                averages: std::array::from_fn(averages),
                alone: [after, f64::INFINITY],
                pulses: vec![pulse],
            });
        }
        self.goes_on = true;
    }

    /// What the motion lacks at the next sample; nothing where no joint move goes on.
    pub fn next_sample(&mut self) -> Option<Lacks> {
        let cell = self.along.cell.filter(|_| !self.along.moves.is_empty())?;
        let n = self.sample;
        self.sample += 1;
        let (start, end) = ((n as f64 - 1.0) * self.dt, n as f64 * self.dt);
        // the first sample is the start itself
        let begun = |step: &Step| step.begin < end || n == 0 && step.begin <= end;
        while let Some(step) = self.steps.next_if(begun) {
            self.take(&step);
        }
        let over = self.transition + LATE * self.dt;
        self.runs.retain(|run| {
            let last = run.pulses.last();
            last.is_some_and(|pulse| start <= pulse.piece.end + over)
        });
        if self.runs.is_empty() {
            self.goes_on = false;
            return None;
        }
        let single = self.runs.len() == 1;
        let mut all = Lacks {
            position: DVec3::ZERO,
            axis: DVec3::ZERO,
            across: DVec3::ZERO,
            alone: None,
        };
        for run in &mut self.runs {
            let [place, axis, across, first, second, external] =
                run.averaged([start, end], self.dt);
            let arm = [first.x, first.y, first.z, second.x, second.y, second.z];
            let values = Values::of(arm, External(external.to_array()));
            let tip = cell.frames(&values).part_from_wire_tip();
            all.position += tip.position - place;
            // that of the motion is of unit length
            all.axis += tip.tool_axis() - axis.normalize_or_zero();
            all.across += tip.orientation * DVec3::X - across;
            let [after, before] = run.alone;
            if single && start >= after && end <= before {
                all.alone = Some(values);
            }
        }
        Some(all)
    }
}

impl Pulse {
    fn of(step: &Step, across: Shape, known: &JointMove) -> Pulse {
        let [a, b] = &known.ends;
        let line = |from: [f64; 3], to: [f64; 3]| {
            let from = DVec3::from_array(from);
            Shape::Line {
                from,
                along: DVec3::from_array(to) - from,
            }
        };
        let three = |arm: &[f64; 6], i: usize| std::array::from_fn(|j| arm[i + j]);
        Pulse {
            piece: Piece::pulse(step),
            shapes: [
                step.position,
                step.axis,
                across,
                line(three(&a.arm, 0), three(&b.arm, 0)),
                line(three(&a.arm, 3), three(&b.arm, 3)),
                line(a.external().0, b.external().0),
            ],
        }
    }
}

impl Run {
    /// The averages at the end of a sampling interval.
    fn averaged(&mut self, [start, end]: [f64; 2], dt: f64) -> [DVec3; CHANNELS] {
        // what is over counts by its end alone
        while self.pulses.len() > 1 && self.pulses[1].piece.begin() <= start {
            self.pulses.remove(0);
        }
        let mut sums = [Moments::ZERO; CHANNELS];
        let rest = |from: f64, to: f64, at: DVec3| {
            Shape::Hold(at).moments((from - start) / dt, (to - start) / dt, 0.0, 0.0)
        };
        let mut from = start;
        for (i, pulse) in self.pulses.iter().enumerate() {
            let piece = &pulse.piece;
            let next = self
                .pulses
                .get(i + 1)
                .map_or(f64::INFINITY, |p| p.piece.begin());
            let [begun, over, until] = [piece.begin(), piece.end, next].map(|t| t.clamp(from, end));
            for (sum, shape) in sums.iter_mut().zip(&pulse.shapes) {
                if begun > from {
                    sum.add(rest(from, begun, shape.at(0.0)));
                }
                if over > begun {
                    sum.add(piece.moments(shape, begun, over, start, dt));
                }
                if until > over {
                    sum.add(rest(over, until, shape.at(1.0)));
                }
            }
            from = until;
        }
        let mut averages = self.averages.iter_mut().zip(sums);
        std::array::from_fn(|_| {
            let next = averages.next();
            next.map_or(DVec3::ZERO, |(average, sum)| average.push(sum))
        })
    }
}

/// Simulates commands as [`super::fir::simulate`] does, about every 2 ms ([`Controller::sampling`]), joint moves along their joints.
///
/// # Errors
/// [`MotionError`].
pub fn simulate(
    along: &Along<'_>,
    controller: &Controller,
    observer: &dyn Observer,
    sink: &mut dyn MotionSink,
) -> Result<Summary, MotionError> {
    let dt = controller.sampling();
    let (start, commands) = (along.start, along.commands);
    let dwells = dwells(start.position, start.orientation, commands, controller);
    let moves = JointMoves::new(*along, &dwells, (controller, dt))?;
    let mut bending = Bending::new(moves, sink);
    fir::simulate(start, commands, controller, dt, observer, &mut bending)
}

/// Bends joint moves of a motion on its way to another sink.
pub struct Bending<'a, 's> {
    moves: JointMoves<'a>,
    sink: &'s mut dyn MotionSink,
    bent: MotionBlock,
    /// The sample before: where it was bent to, and when.
    before: Option<(DVec3, f64)>,
}

impl<'a, 's> Bending<'a, 's> {
    /// Pushes into `sink`.
    pub fn new(moves: JointMoves<'a>, sink: &'s mut dyn MotionSink) -> Self {
        Bending {
            moves,
            sink,
            bent: MotionBlock::default(),
            before: None,
        }
    }
}

impl MotionSink for Bending<'_, '_> {
    fn block(&mut self, block: &MotionBlock) {
        let mut out = std::mem::take(&mut self.bent);
        let mut bends = false;
        for (i, &straight) in block.position.iter().enumerate() {
            let time = block.time(i);
            let mut here = straight;
            if let Some(lacks) = self.moves.next_sample() {
                if !bends {
                    out.clone_from(block);
                    out.axis.resize(block.len(), DVec3::Z);
                    bends = true;
                }
                here += lacks.position;
                out.position[i] = here;
                out.axis[i] = (out.axis[i] + lacks.axis).normalize_or(out.axis[i]);
                if let (Some((from, then)), Some(speed)) = (self.before, out.speed.get_mut(i))
                    && time > then
                {
                    *speed = from.distance(here) / (time - then);
                }
            }
            self.before = Some((here, time));
        }
        self.sink.block(if bends { &out } else { block });
        self.bent = out;
    }
}
