//! What goes along in step with the tool's tip: the turn of the tool about its axis, a track, a positioner. It passes the same averages.

use meltpath_geometry::Pose;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::{DQuat, DVec3};

use super::fir::Cascade;
use super::timeline::{Piece, Step, Timeline};
use super::track::{Moments, Shape};
use crate::command::{Command, Kind};
use crate::controller::{Controller, ControllerError};

/// Turns and radii below this are none, rad and 1.
const NOTHING: f64 = 1e-12;

/// Values that go evenly along each command: a track's (mm) and a positioner's (rad).
#[derive(Debug, Clone, Copy)]
pub struct Carried<'a> {
    /// Where the motion starts.
    pub start: DVec3,
    /// At the end of each command, by its position in the list; those beyond the last stay where they are.
    pub ends: &'a [DVec3],
}

/// What goes along, at a sample of the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rider {
    /// The x axis of the tool, averaged: neither of unit length nor at right angles to the averaged tool axis.
    pub across: DVec3,
    /// What is carried.
    pub carried: DVec3,
}

/// What goes along with a motion, sample by sample, at the samples of [`super::fir::simulate`]. It does not end.
pub struct Riders<'a> {
    commands: &'a [Command],
    carried: Carried<'a>,
    steps: Timeline<'a>,
    /// The step being executed, while its dwell is still to come.
    step: Option<Step>,
    piece: Piece,
    /// At the end of the step.
    orientation: DQuat,
    stands: DVec3,
    /// How both go along the piece.
    shapes: [Shape; 2],
    averages: [Cascade; 2],
    dt: f64,
    sample: usize,
}

impl<'a> Riders<'a> {
    /// Along commands with their dwells ([`super::corner::dwells`]).
    ///
    /// # Errors
    /// [`ControllerError`] where the period does not divide the averages.
    pub fn new(
        start: Pose,
        commands: &'a [Command],
        dwells: &'a [f64],
        carried: Carried<'a>,
        (controller, dt): (&Controller, f64),
    ) -> Result<Self, ControllerError> {
        let (n1, n2) = controller.taps(dt)?;
        let at = [start.orientation * DVec3::X, carried.start];
        let (place, orientation) = (start.position, start.orientation);
        Ok(Riders {
            commands,
            carried,
            steps: Timeline::new(place, orientation, commands, dwells, controller),
            step: None,
            piece: Piece::rest(place, DVec3::Z, 0.0),
            orientation,
            stands: carried.start,
            shapes: at.map(Shape::Hold),
            averages: at.map(|value| Cascade::new(n1, n2, value)),
            dt,
            sample: 0,
        })
    }

    /// Goes on to the next stretch of nominal time.
    fn next_piece(&mut self) {
        let rests = [self.orientation * DVec3::X, self.stands].map(Shape::Hold);
        self.shapes = rests;
        if let Some(step) = self.step.take()
            && step.end > step.pulse_end
        {
            self.piece = Piece::rest(DVec3::ZERO, DVec3::Z, step.end);
            return;
        }
        let Some(step) = self.steps.next() else {
            self.piece = Piece::rest(DVec3::ZERO, DVec3::Z, f64::INFINITY);
            return;
        };
        let command = &self.commands[step.index];
        if !matches!(command.kind, Kind::Wait { .. }) {
            self.shapes[0] = across(self.orientation, command.orientation);
            self.orientation = command.orientation;
        }
        if let Some(&end) = self.carried.ends.get(step.index) {
            let (from, along) = (self.stands, end - self.stands);
            if along != DVec3::ZERO {
                self.shapes[1] = Shape::Line { from, along };
            }
            self.stands = end;
        }
        self.piece = Piece::pulse(&step);
        self.step = Some(step);
    }

    /// Moments of both over the interval from `start` to `end` s.
    fn moments(&mut self, start: f64, end: f64) -> [Moments; 2] {
        let mut sums = [Moments::ZERO; 2];
        let mut from = start;
        loop {
            let to = end.min(self.piece.end);
            if to > from {
                for (sum, shape) in sums.iter_mut().zip(&self.shapes) {
                    sum.add(self.piece.moments(shape, from, to, start, self.dt));
                }
                from = to;
            }
            if self.piece.end > end {
                return sums;
            }
            self.next_piece();
        }
    }

    /// At the next sample.
    pub fn next_sample(&mut self) -> Rider {
        let n = self.sample;
        self.sample += 1;
        if n == 0 {
            let at = Rider {
                across: self.orientation * DVec3::X,
                carried: self.stands,
            };
            self.next_piece();
            return at;
        }
        let [across, carried] = self.moments((n as f64 - 1.0) * self.dt, n as f64 * self.dt);
        Rider {
            across: self.averages[0].push(across),
            carried: self.averages[1].push(carried),
        }
    }
}

/// The way of a tool's x axis from one orientation to another: it turns about the axis of the rotation between them.
pub(super) fn across(from: DQuat, to: DQuat) -> Shape {
    let mut between = to * from.inverse();
    if between.w < 0.0 {
        between = -between;
    }
    let (normal, sweep) = between.to_axis_angle();
    let x = from * DVec3::X;
    let centre = x.dot(normal) * normal;
    let radius = (x - centre).length();
    if sweep < NOTHING || radius < NOTHING {
        return Shape::Hold(to * DVec3::X);
    }
    let u = (x - centre) / radius;
    Shape::Arc(Arc {
        centre,
        u,
        v: normal.cross(u),
        radius,
        sweep,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_x_axis_turns_as_the_orientation_does() {
        let from = DQuat::from_rotation_x(3.0) * DQuat::from_rotation_z(0.4);
        let to = DQuat::from_rotation_x(2.8) * DQuat::from_rotation_z(-1.1);
        let Shape::Arc(arc) = across(from, to) else {
            panic!("no turn")
        };
        for share in [0.0, 0.3, 1.0] {
            let wanted = from.slerp(to, share) * DVec3::X;
            assert!(arc.at(share).distance(wanted) < 1e-12, "{share}");
        }
        assert!(matches!(across(from, -from), Shape::Hold(_)));
    }
}
