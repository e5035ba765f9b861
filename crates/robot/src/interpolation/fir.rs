//! Streaming interpolation of an industrial robot's controller: a cascade of two moving averages (FIR filters).
//!
//! Source: Rouchon 2022, §3.3.1, eq. 3.2-3.3, pp. 62-66. The nominal motion is a chain of rectangular pulses of speed, one a
//! command, with dwells between them ([`crate::interpolation::corner`]); each Cartesian component is averaged over T_1, then over T_2.
//!
//! **Exact at any sampling period.** A moving average over T = N·dt of a continuous signal equals the mean of N samples of that
//! signal averaged over dt. Both averages over dt are taken analytically on the nominal motion (lines and arcs alike), so that
//! samples lie on the continuous solution to rounding, the area of each pulse is its length exactly wherever it falls between
//! samples, and nothing drifts. Speed is the derivative of the same continuous solution, not a difference of samples.
//!
//! **Passage from one command to the next** (arc, wire feed, command number) is the middle of the transition: at a stop, the instant
//! at which the tool has come to rest at the point; elsewhere half of T_1 + T_2 + T_D after the nominal pulse ends, when the tool is
//! nearest to the point. So with FINE at both ends of a bead the arc starts when the tool stands at the start point and ends when it
//! stands at the end point. Ignition delay and burn-back are not modelled.
//!
//! **Orientation** goes through the same cascade, by the unit tool axis; the source does not establish that this holds.

use std::collections::VecDeque;

use meltpath_base::{Cancelled, Observer};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{MotionBlock, MotionSink, Times};

use crate::command::{Command, Kind, Smoothing, Source};
use meltpath_base::settings::Problems;

use crate::controller::{Controller, ControllerError};
use crate::interpolation::corner;
use crate::interpolation::history::History;
use crate::interpolation::timeline::{Piece, Step, Timeline};
use crate::interpolation::track::{Moments, Shape};
use crate::summary::{CommandRecord, Summary};
use meltpath_numerics::moving_average::MovingAverage;

/// Samples in a block.
pub const BLOCK: usize = 4096;
/// An end this close after a sample needs no further sample, in samples.
const LATE: f64 = 1e-6;

meltpath_base::passes_on! {
    /// Why motion could not be simulated.
    #[derive(Clone, PartialEq)]
    pub enum MotionError {
        /// The controller's data are unsound.
        Controller(ControllerError),
        /// Cancelled.
        Cancelled(Cancelled);

        /// A command cannot be executed.
        #[error("command {index} (number {id}): {what} is {value}, but must be {wanted}")]
        Command {
            /// Position in the list, from 0.
            index: usize,
            /// The command's own number.
            id: u32,
            /// Which of its values.
            what: &'static str,
            /// That value.
            value: f64,
            /// What it must be.
            wanted: &'static str,
        },
    }
}

/// Simulates `commands` from rest at `start`, and pushes samples every `dt` s into `sink`, [`BLOCK`] at a time.
///
/// Sample 0 is the start at time 0; the last sample is the first at or after the end, where the tool rests at the last target.
/// `dt` must divide both filters ([`Controller::sampling`] gives about 2 ms). Of the observer's stage, which the caller names, each command is a step. Memory does not grow with the length of the motion
/// but for one record a command.
///
/// # Errors
/// [`MotionError`] where the controller's data are unsound, a command is not finite or has no speed, or the observer cancels.
pub fn simulate(
    start: Pose,
    commands: &[Command],
    controller: &Controller,
    dt: f64,
    observer: &dyn Observer,
    sink: &mut dyn MotionSink,
) -> Result<Summary, MotionError> {
    let problems = controller.check();
    if !problems.is_empty() {
        return Err(ControllerError::Data(Problems(problems)).into());
    }
    let dwells = corner::dwells(start.position, start.orientation, commands, controller);
    simulate_dwelling(start, commands, &dwells, controller, dt, observer, sink)
}

/// The same, with the dwell after each command, s, told instead of looked up in the controller's law; T_1 + T_2 is a stop.
///
/// # Errors
/// [`MotionError`], as [`simulate`].
pub(crate) fn simulate_dwelling(
    start: Pose,
    commands: &[Command],
    dwells: &[f64],
    controller: &Controller,
    dt: f64,
    observer: &dyn Observer,
    sink: &mut dyn MotionSink,
) -> Result<Summary, MotionError> {
    check(start, commands)?;
    let turns = commands
        .iter()
        .any(|c| c.orientation * DVec3::Z != start.orientation * DVec3::Z);
    let mut run = Run::new(start, commands, dwells, controller, dt)?;
    let mut block = MotionBlock::default();
    let mut told = 0;
    loop {
        let t0 = run.sample as f64 * dt;
        block.restart(Times::Uniform { t0, dt });
        let more = if turns {
            run.fill::<true>(&mut block)
        } else {
            run.fill::<false>(&mut block)
        };
        if !block.is_empty() {
            sink.block(&block);
        }
        observer.check()?;
        let done = run.summary.commands.len() as u64;
        observer.advance(done - told);
        told = done;
        if !more {
            break;
        }
    }
    Ok(run.finish())
}

fn check(start: Pose, commands: &[Command]) -> Result<(), MotionError> {
    let error = |index: usize, id, what, value, wanted| MotionError::Command {
        index,
        id,
        what,
        value,
        wanted,
    };
    let unit = |q: meltpath_geometry::math::DQuat| (q.length() - 1.0).abs() < 1e-6;
    if !start.position.is_finite() || !unit(start.orientation) {
        let value = start.position.length();
        return Err(error(
            0,
            0,
            "the start pose",
            value,
            "finite, with a unit quaternion",
        ));
    }
    for (index, c) in commands.iter().enumerate() {
        let fail = |what, value, wanted| Err(error(index, c.id, what, value, wanted));
        if let Kind::Wait { time } = c.kind {
            if !(time >= 0.0 && time.is_finite()) {
                return fail("the wait", time, "a finite time");
            }
        } else {
            if !c.target.is_finite() {
                return fail("the target", c.target.length(), "finite");
            }
            if !unit(c.orientation) {
                return fail("the orientation's length", c.orientation.length(), "1");
            }
            if !(c.speed > 0.0 && c.speed.is_finite()) {
                return fail("the speed", c.speed, "positive and finite (mm/s)");
            }
        }
        if let Some(course) = c.kind.course()
            && !(course.time >= 0.0 && course.time.is_finite())
        {
            return fail("the time of the joint move", course.time, "a finite time");
        }
        if let Kind::Arc { via } = c.kind
            && !via.is_finite()
        {
            return fail("the via point", via.length(), "finite");
        }
        if let Smoothing::Cnt(share) = c.smoothing
            && !(0.0..=1.0).contains(&share)
        {
            return fail("the smoothing", share, "0 to 1");
        }
        if let Source::On { wire_feed } = c.source
            && !(wire_feed >= 0.0 && wire_feed.is_finite())
        {
            return fail("the wire feed", wire_feed, "finite, not negative (mm/s)");
        }
    }
    Ok(())
}

/// The cascade on three components: from the moments of the nominal motion to filtered values and their derivative.
pub(super) struct Cascade {
    last_first: DVec3,
    /// T_1 over the motion averaged twice over dt, then T_2.
    first: MovingAverage<DVec3>,
    second: MovingAverage<DVec3>,
}

impl Cascade {
    pub(super) fn new(n1: usize, n2: usize, value: DVec3) -> Self {
        Cascade {
            last_first: 0.5 * value,
            first: MovingAverage::new(n1, value),
            second: MovingAverage::new(n2, value),
        }
    }

    /// The filtered value at the end of the interval whose moments are `m`.
    #[inline]
    pub(super) fn push(&mut self, m: Moments) -> DVec3 {
        // triangle of two intervals: rising over the last, falling over this one
        let twice = self.last_first + m.zeroth - m.first;
        self.last_first = m.first;
        self.second.push(self.first.push(twice))
    }
}

/// The derivative of the cascade: `(f(t) − f(t − T_2)) / T_2`, with f the motion averaged over T_1.
struct Velocity {
    first: MovingAverage<DVec3>,
    delayed: Vec<DVec3>,
    at: usize,
    inverse: f64,
}

impl Velocity {
    fn new(n1: usize, n2: usize, t2: f64, value: DVec3) -> Self {
        Velocity {
            first: MovingAverage::new(n1, value),
            delayed: vec![value; n2],
            at: 0,
            inverse: 1.0 / t2,
        }
    }

    #[inline]
    fn push(&mut self, zeroth: DVec3) -> DVec3 {
        let f = self.first.push(zeroth);
        let old = std::mem::replace(&mut self.delayed[self.at], f);
        self.at += 1;
        if self.at == self.delayed.len() {
            self.at = 0;
        }
        (f - old) * self.inverse
    }
}

/// A command whose passage lies ahead of the samples.
#[derive(Clone, Copy)]
struct Pending {
    index: usize,
    passage: f64,
}

/// A passed command whose surroundings are not all sampled yet.
#[derive(Clone, Copy)]
struct Passed {
    record: usize,
    index: usize,
    passage: f64,
    ready: f64,
}

struct Run<'a> {
    commands: &'a [Command],
    dwells: &'a [f64],
    transition: f64,
    dt: f64,
    steps: Timeline<'a>,
    /// The step being executed, while its dwell is still to come.
    step: Option<Step>,
    piece: Piece,
    place: DVec3,
    axis: DVec3,
    /// Nominal end of everything; infinite while steps remain.
    over: f64,
    position: Cascade,
    velocity: Velocity,
    direction: Cascade,
    pending: VecDeque<Pending>,
    passed: VecDeque<Passed>,
    history: History,
    last_passage: f64,
    last_id: u32,
    sample: usize,
    summary: Summary,
}

impl<'a> Run<'a> {
    fn new(
        start: Pose,
        commands: &'a [Command],
        dwells: &'a [f64],
        controller: &Controller,
        dt: f64,
    ) -> Result<Self, ControllerError> {
        let (n1, n2) = controller.taps(dt)?;
        let (place, axis) = (start.position, start.tool_axis());
        Ok(Run {
            commands,
            dwells,
            transition: controller.transition(),
            dt,
            steps: Timeline::new(place, start.orientation, commands, dwells, controller),
            step: None,
            piece: Piece::rest(place, axis, 0.0),
            place,
            axis,
            over: f64::INFINITY,
            position: Cascade::new(n1, n2, place),
            velocity: Velocity::new(n1, n2, controller.t2.value.0, place),
            direction: Cascade::new(n1, n2, axis),
            pending: VecDeque::new(),
            passed: VecDeque::new(),
            history: History::new(2 * (n1 + n2) + 8),
            last_passage: 0.0,
            last_id: commands.first().map_or(0, |c| c.id),
            sample: 0,
            summary: Summary {
                commands: Vec::with_capacity(commands.len()),
                ..Summary::default()
            },
        })
    }

    /// Goes on to the next stretch of nominal time.
    fn next_piece(&mut self) {
        if let Some(step) = self.step.take() {
            self.place = match self.commands[step.index].kind {
                Kind::Wait { .. } => self.place,
                Kind::Line | Kind::Arc { .. } | Kind::Joint(_) => self.commands[step.index].target,
            };

            self.axis = match step.axis {
                Shape::Arc(arc) => arc.at(1.0),
                Shape::Hold(_) | Shape::Line { .. } => self.axis,
            };
            if step.end > step.pulse_end {
                self.piece = Piece::rest(self.place, self.axis, step.end);
                return;
            }
        }
        if let Some(step) = self.steps.next() {
            self.pending.push_back(Pending {
                index: step.index,
                passage: step.passage,
            });
            self.piece = Piece::pulse(&step);
            self.step = Some(step);
        } else {
            self.over = self.piece.end;
            self.piece = Piece::rest(self.place, self.axis, f64::INFINITY);
        }
    }

    /// Moments of position and tool axis over the interval from `start` to `end` s.
    #[inline]
    fn moments<const TURNS: bool>(&mut self, start: f64, end: f64) -> (Moments, Moments) {
        let (mut position, mut axis) = (Moments::ZERO, Moments::ZERO);
        let mut from = start;
        loop {
            let to = end.min(self.piece.end);
            if to > from {
                let p = &self.piece;
                position.add(p.moments(&p.position, from, to, start, self.dt));
                if TURNS {
                    axis.add(p.moments(&p.axis, from, to, start, self.dt));
                }
                from = to;
            }
            if self.piece.end > end {
                return (position, axis);
            }
            self.next_piece();
        }
    }

    /// Wire fed between `from` and `to` s, passing on from command to command on the way.
    #[inline]
    fn feed(&mut self, from: f64, to: f64) -> f64 {
        let (mut wire, mut from) = (0.0, from);
        while let Some(&Pending { index, passage }) = self.pending.front() {
            let upto = passage.min(to);
            if let Source::On { wire_feed } = self.commands[index].source {
                wire += (upto - from).max(0.0) * wire_feed;
            }
            self.last_id = self.commands[index].id;
            if passage >= to {
                break;
            }
            from = from.max(upto);
            self.pass(index, passage);
            self.pending.pop_front();
        }
        wire
    }

    /// Records that the tool passed the end of a command.
    fn pass(&mut self, index: usize, passage: f64) {
        let command = &self.commands[index];
        let duration = passage - self.last_passage;
        let s = &mut self.summary;
        s.spend(command, duration);
        self.passed.push_back(Passed {
            record: s.commands.len(),
            index,
            passage,
            ready: passage + 0.5 * (self.transition + self.dwells[index]),
        });
        s.commands.push(CommandRecord {
            id: command.id,
            start: self.last_passage,
            end: passage,
            passage_speed: 0.0,
            deviation: 0.0,
        });
        s.total_time = passage;
        self.last_passage = passage;
    }

    /// Looks at how the tool passed the commands that are `until` s behind.
    #[inline]
    fn look_back(&mut self, until: f64) {
        while let Some(&passed) = self.passed.front() {
            if passed.ready > until {
                break;
            }
            self.passed.pop_front();
            let command = &self.commands[passed.index];
            if matches!(command.kind, Kind::Wait { .. }) {
                continue;
            }
            let near = (passed.passage / self.dt).round() as usize;
            let (deviation, speed) = self.history.passage(near, command.target);
            let record = &mut self.summary.commands[passed.record];
            record.deviation = deviation;
            // at a stop the speed is 0 between two samples
            if self.dwells[passed.index] < self.transition {
                record.passage_speed = speed;
            }
        }
    }

    /// Fills a block; false once the motion is over.
    fn fill<const TURNS: bool>(&mut self, block: &mut MotionBlock) -> bool {
        while block.len() < BLOCK {
            let n = self.sample;
            let (start, now) = ((n as f64 - 1.0) * self.dt, n as f64 * self.dt);
            let (mut place, mut axis, mut speed, mut wire) = (self.place, self.axis, 0.0, 0.0);
            if n > 0 {
                if start >= self.over - LATE * self.dt {
                    self.end();
                    return false;
                }
                let (p, a) = self.moments::<TURNS>(start, now);
                place = self.position.push(p);
                speed = self.velocity.push(p.zeroth).length();
                if TURNS {
                    axis = self.direction.push(a).normalize_or(self.axis);
                }
                wire = self.feed(start, now);
            } else {
                self.next_piece();
            }
            self.history.record(n, place, speed);
            self.look_back(now);
            block.position.push(place);
            block.speed.push(speed);
            if TURNS || self.axis != DVec3::Z {
                block.axis.push(axis);
            }
            block.wire.push(wire);
            block.command.push(self.last_id);
            self.sample += 1;
        }
        true
    }

    /// Passes what is left: the last command, whose end may lie within rounding of the last sample.
    fn end(&mut self) {
        while let Some(Pending { index, passage }) = self.pending.pop_front() {
            self.pass(index, passage);
        }
        self.look_back(f64::INFINITY);
    }

    fn finish(mut self) -> Summary {
        self.summary.samples = self.sample as u64;
        self.summary
    }
}
