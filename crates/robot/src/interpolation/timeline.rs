//! The nominal motion in time: rectangular pulses of speed with dwells between them, before the filters.

use meltpath_geometry::math::{DQuat, DVec3};

use crate::command::{Command, Kind};
use crate::controller::Controller;
use crate::interpolation::corner;
use crate::interpolation::track::{Moments, Shape};

/// One command on the nominal time axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// Index of the command.
    pub(crate) index: usize,
    /// Where the tool goes.
    pub(crate) position: Shape,
    /// How its axis turns.
    pub(crate) axis: Shape,
    /// Start of the pulse, s.
    pub(crate) begin: f64,
    /// End of the pulse, s.
    pub(crate) pulse_end: f64,
    /// End of the dwell, s.
    pub(crate) end: f64,
    /// Instant at which the tool really passes on to the next command, s.
    pub(crate) passage: f64,
}

/// The commands as steps in time.
pub(crate) struct Timeline<'a> {
    commands: &'a [Command],
    dwells: &'a [f64],
    next: usize,
    time: f64,
    position: DVec3,
    orientation: DQuat,
    resting: bool,
    transition: f64,
    rotation_speed: f64,
}

fn axis(orientation: DQuat) -> DVec3 {
    -(orientation * DVec3::Z)
}

impl<'a> Timeline<'a> {
    pub(crate) fn new(
        position: DVec3,
        orientation: DQuat,
        commands: &'a [Command],
        dwells: &'a [f64],
        controller: &Controller,
    ) -> Self {
        Timeline {
            commands,
            dwells,
            next: 0,
            time: 0.0,
            position,
            orientation,
            resting: true,
            transition: controller.transition(),
            rotation_speed: controller.rotation_speed.value.0,
        }
    }
}

impl Iterator for Timeline<'_> {
    type Item = Step;

    fn next(&mut self) -> Option<Step> {
        let index = self.next;
        let command = self.commands.get(index)?;
        let dwell = self.dwells[index];
        self.next += 1;
        let begin = self.time;
        let position = corner::shape(self.position, command);
        let mut turn = Shape::Hold(axis(self.orientation));
        let duration = if let Kind::Wait { time } = command.kind {
            time
        } else {
            let angle = corner::turning(self.orientation, command.orientation);
            if angle > 0.0 {
                turn = Shape::turn(axis(self.orientation), axis(command.orientation));
            }
            self.position = command.target;
            self.orientation = command.orientation;
            match command.kind.course() {
                Some(course) => course.time,
                None => (position.length() / command.speed).max(angle / self.rotation_speed),
            }
        };
        self.resting &= duration == 0.0 || matches!(command.kind, Kind::Wait { .. });
        let pulse_end = begin + duration;
        let end = pulse_end + dwell;
        // the middle of the transition: at a stop its end, at a corner the point nearest to it
        let passage = if self.resting {
            end
        } else {
            pulse_end + 0.5 * (self.transition + dwell)
        };
        self.resting |= dwell >= self.transition;
        self.time = end;
        Some(Step {
            index,
            position,
            axis: turn,
            begin,
            pulse_end,
            end,
            passage,
        })
    }
}

/// A stretch of nominal time in which one shape is followed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    pub(crate) position: Shape,
    pub(crate) axis: Shape,
    begin: f64,
    pub(crate) end: f64,
    /// Share of the shape per second.
    rate: f64,
}

impl Piece {
    /// The moving part of a step.
    pub(crate) fn pulse(step: &Step) -> Piece {
        let duration = step.pulse_end - step.begin;
        Piece {
            position: step.position,
            axis: step.axis,
            begin: step.begin,
            end: step.pulse_end,
            rate: if duration > 0.0 { 1.0 / duration } else { 0.0 },
        }
    }

    /// Where it begins, s.
    pub(crate) fn begin(&self) -> f64 {
        self.begin
    }

    /// Rest at a point until `end` s.
    pub(crate) fn rest(position: DVec3, axis: DVec3, end: f64) -> Piece {
        Piece {
            position: Shape::Hold(position),
            axis: Shape::Hold(axis),
            begin: end,
            end,
            rate: 0.0,
        }
    }

    /// Moments of a shape of this piece between the times `from` and `to`, in the interval that starts at `start` s and
    /// lasts `dt` s.
    #[inline]
    pub(crate) fn moments(
        &self,
        shape: &Shape,
        from: f64,
        to: f64,
        start: f64,
        dt: f64,
    ) -> Moments {
        let middle = ((0.5 * (from + to) - self.begin) * self.rate).clamp(0.0, 1.0);
        shape.moments(
            (from - start) / dt,
            (to - start) / dt,
            middle,
            self.rate * dt,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_takes_no_time_has_no_rate() {
        let step = Step {
            index: 0,
            position: Shape::Hold(DVec3::X),
            axis: Shape::Hold(DVec3::Z),
            begin: 2.0,
            pulse_end: 2.0,
            end: 2.0,
            passage: 2.0,
        };
        assert_eq!(Piece::pulse(&step).rate, 0.0);
        let timed = Step {
            pulse_end: 2.5,
            ..step
        };
        assert_eq!(Piece::pulse(&timed).rate, 2.0);
    }
}
