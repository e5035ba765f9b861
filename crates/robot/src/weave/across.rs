//! The direction across the travel and the tool axis, as an angle: so that it can turn evenly where the travel turns at once.

use std::f64::consts::{PI, TAU};

use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_numerics::moving_average::MovingAverage;

/// A tool that goes nearer to the direction of its axis than this, as the sine, has no left: its rounding would turn.
const ALONG: f64 = 0.01;

/// A number that passes the two moving averages of a controller.
#[derive(Debug, Clone)]
pub(super) struct Smooth {
    first: MovingAverage<f64>,
    second: MovingAverage<f64>,
    /// The average.
    pub(super) value: f64,
}

impl Smooth {
    /// Averages over so many samples, all of them `value` so far.
    pub(super) fn new((n1, n2): (usize, usize), value: f64) -> Self {
        Smooth {
            first: MovingAverage::new(n1, value),
            second: MovingAverage::new(n2, value),
            value,
        }
    }

    pub(super) fn push(&mut self, value: f64) {
        self.value = self.second.push(self.first.push(value));
    }
}

/// A direction across the tool axis that goes along with it by its least turns, and how far the left of the travel is turned from that.
#[derive(Debug, Clone, Copy)]
pub(super) struct Across {
    axis: DVec3,
    /// The direction that goes along with the axis.
    pub(super) reference: DVec3,
    /// From the reference to the left of the travel about the axis, rad; it goes on past whole turns. Nothing before the tool moves.
    pub(super) turned: Option<f64>,
}

impl Across {
    pub(super) fn new(axis: DVec3) -> Self {
        Across {
            axis,
            reference: axis.any_orthonormal_vector(),
            turned: None,
        }
    }

    /// Goes on to a sample with this axis, towards which the tool moved by `moved`: nothing where it stood.
    pub(super) fn go(&mut self, axis: DVec3, moved: Option<DVec3>) {
        if axis != self.axis {
            let carried = DQuat::from_rotation_arc(self.axis, axis) * self.reference;
            let across = carried.reject_from(axis).try_normalize();
            self.reference = across.unwrap_or_else(|| axis.any_orthonormal_vector());
            self.axis = axis;
        }
        let across = moved.map(|m| axis.cross(m.normalize_or_zero()));
        let Some(left) = across.filter(|a| a.length() > ALONG) else {
            return;
        };
        let angle = axis
            .dot(self.reference.cross(left))
            .atan2(self.reference.dot(left));
        self.turned = Some(match self.turned {
            Some(before) => before + (angle - before + PI).rem_euclid(TAU) - PI,
            None => angle,
        });
    }
}
