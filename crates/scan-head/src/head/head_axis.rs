//! An axis of a head, as far as it is known.

use crate::axis::chain::{Axis, RunningAxis};
use crate::axis::error::AxisError;
use crate::axis::servo::Servo;

/// An axis of a head, as far as it is known.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a head has three at the most")]
pub enum HeadAxis {
    /// With its motor, its control and its sensor.
    Driven(Axis),
    /// By its data sheet.
    Servo(Servo),
}

impl HeadAxis {
    /// With its motor and its control, where these are known.
    pub fn driven(&self) -> Option<&Axis> {
        match self {
            HeadAxis::Driven(axis) => Some(axis),
            HeadAxis::Servo(_) => None,
        }
    }

    /// With its motor and its control.
    ///
    /// # Errors
    /// [`AxisError::DataSheet`] where these are not known.
    pub fn motor(&self) -> Result<&Axis, AxisError> {
        self.driven().ok_or(AxisError::DataSheet)
    }

    /// The same, to be changed.
    pub fn driven_mut(&mut self) -> Option<&mut Axis> {
        match self {
            HeadAxis::Driven(axis) => Some(axis),
            HeadAxis::Servo(_) => None,
        }
    }

    /// Travel of the mirror to either side, rad.
    pub fn travel(&self) -> f64 {
        match self {
            HeadAxis::Driven(axis) => axis.travel,
            HeadAxis::Servo(servo) => servo.travel,
        }
    }

    /// How fast the mirror turns at most, rad/s, where the data sheet says it; what a known drive reaches is simulated.
    pub fn top_speed(&self) -> Option<f64> {
        match self {
            HeadAxis::Driven(_) => None,
            HeadAxis::Servo(servo) => Some(servo.speed_limit),
        }
    }

    /// Checks every part.
    ///
    /// # Errors
    /// [`AxisError`].
    pub fn check(&self) -> Result<(), AxisError> {
        match self {
            HeadAxis::Driven(axis) => axis.check(),
            HeadAxis::Servo(servo) => servo.check(),
        }
    }

    /// Refuses an axis whose loop is unstable; that of a data sheet is critically damped.
    ///
    /// # Errors
    /// As [`Axis::check_stable`].
    pub fn check_stable(&self, period: f64) -> Result<(), AxisError> {
        match self {
            HeadAxis::Driven(axis) => axis.check_stable(period),
            HeadAxis::Servo(servo) => servo.start(period, 0.0).map(|_| ()),
        }
    }

    /// The axis at rest at `angle` rad, sampled every `period` s; `seed` is that of its sensor's noise.
    ///
    /// # Errors
    /// [`AxisError`] where a part is unsound or does not suit the period.
    pub fn start(&self, period: f64, angle: f64, seed: u64) -> Result<RunningAxis, AxisError> {
        match self {
            HeadAxis::Driven(axis) => axis.start(period, angle, seed),
            HeadAxis::Servo(servo) => servo.start(period, angle),
        }
    }
}

impl From<Axis> for HeadAxis {
    fn from(axis: Axis) -> Self {
        HeadAxis::Driven(axis)
    }
}
