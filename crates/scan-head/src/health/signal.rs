//! The angle signal of the health test's second stage: steps, then ramps.
//!
//! Source: Rasoanarivo 2020, § 2.4, fig. 2.57-2.60.

use crate::axis::chain::Axis;
use crate::axis::error::{AxisError, positive};
use serde::{Deserialize, Serialize};

/// The second stage's signal: steps, then ramps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Km0Signal {
    /// Amplitudes of the steps, rad; each is done up and down.
    pub steps: Vec<f64>,
    /// Slope of the steps, rad/s: large steps reach it, small ones do not.
    pub step_speed: f64,
    /// Speeds of the ramps, rad/s; each is done up and down.
    pub ramps: Vec<f64>,
    /// Angle covered by a ramp, at most, rad.
    pub ramp_amplitude: f64,
    /// Longest ramp, s: slow ones cover less.
    pub ramp_time: f64,
    /// Rest after each step and ramp, s.
    pub rest: f64,
}

/// What a piece of the signal is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Piece {
    Step { from: f64, to: f64 },
    Ramp { speed: f64 },
}

/// The sampled signal and where its pieces lie.
#[derive(Debug, Clone, PartialEq)]
pub struct Km0Samples {
    /// Set-points, rad.
    pub set_points: Vec<f64>,
    pub(super) pieces: Vec<(Piece, std::ops::Range<usize>)>,
    pub(super) period: f64,
}

impl Km0Signal {
    /// A signal for an axis: steps of 18 deg halved down to 1/8 deg and ramps at ten speeds, within the travel and the
    /// speed limit.
    pub fn for_axis(axis: &Axis) -> Self {
        let largest = 0.8 * axis.travel;
        let fastest = axis
            .prefilter
            .as_ref()
            .map_or(30.0, |p| p.speed_limit)
            .min(30.0);
        Km0Signal {
            steps: (0..8).map(|k| largest / f64::from(1 << k)).collect(),
            step_speed: fastest,
            ramps: (1..=10)
                .map(|k| fastest * (f64::from(k) / 10.0).powi(2))
                .collect(),
            ramp_amplitude: largest,
            ramp_time: 0.25,
            rest: 0.1,
        }
    }

    /// The signal sampled at `period` s, from and to 0.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn samples(&self, period: f64) -> Result<Km0Samples, AxisError> {
        positive("the sample period", period)?;
        positive("the slope of the steps", self.step_speed)?;
        positive("the amplitude of the ramps", self.ramp_amplitude)?;
        positive("the longest ramp", self.ramp_time)?;
        positive("the rest", self.rest)?;
        let mut samples = Km0Samples {
            set_points: vec![0.0],
            pieces: Vec::new(),
            period,
        };
        let rest = (self.rest / period).ceil() as usize;
        samples.hold(rest);
        for &amplitude in &self.steps {
            positive("a step", amplitude)?;
            for to in [amplitude, 0.0] {
                let (from, begin) = (samples.last(), samples.set_points.len());
                samples.slope(to, self.step_speed);
                samples.hold(rest);
                samples.close(Piece::Step { from, to }, begin);
            }
        }
        for &speed in &self.ramps {
            positive("the speed of a ramp", speed)?;
            let reach = 0.5 * self.ramp_amplitude.min(speed * self.ramp_time);
            samples.slope(-reach, 0.2 * self.step_speed);
            samples.hold(rest);
            for (to, sign) in [(reach, 1.0), (-reach, -1.0)] {
                let begin = samples.set_points.len();
                samples.slope(to, speed);
                samples.close(
                    Piece::Ramp {
                        speed: sign * speed,
                    },
                    begin,
                );
                samples.hold(rest);
            }
        }
        samples.slope(0.0, 0.2 * self.step_speed);
        samples.hold(rest);
        Ok(samples)
    }
}

impl Km0Samples {
    fn last(&self) -> f64 {
        self.set_points.last().copied().unwrap_or(0.0)
    }

    fn hold(&mut self, count: usize) {
        let last = self.last();
        self.set_points.extend(std::iter::repeat_n(last, count));
    }

    fn slope(&mut self, to: f64, speed: f64) {
        let from = self.last();
        let count = ((to - from).abs() / (speed * self.period)).ceil() as usize;
        self.set_points
            .extend((1..=count).map(|k| from + (to - from) * k as f64 / count as f64));
    }

    fn close(&mut self, piece: Piece, begin: usize) {
        self.pieces.push((piece, begin..self.set_points.len()));
    }

    /// Where the record of this signal begins in a longer one whose set-points (rad) were recorded too: both leave 0 together.
    ///
    /// # Errors
    /// [`AxisError::Parameter`] where the set-points are not those of this signal.
    pub fn align(&self, set_points: &[f64]) -> Result<usize, AxisError> {
        /// Set-points may be rounded by the recorder, rad.
        const ROUNDED: f64 = 2e-4;
        let leaves = |s: &[f64]| s.iter().position(|v| v.abs() > ROUNDED);
        let (Some(there), Some(here)) = (leaves(set_points), leaves(&self.set_points)) else {
            return Err(AxisError::Parameter {
                what: "the largest recorded set-point",
                value: 0.0,
                wanted: "above 0.01 deg: was the health signal played, and in which unit?",
            });
        };
        let begin = there.saturating_sub(here);
        let worst = set_points[begin..]
            .iter()
            .zip(&self.set_points)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        // a sample of shift on the steepest slope
        let slope = self
            .set_points
            .windows(2)
            .map(|w| (w[1] - w[0]).abs())
            .fold(0.0, f64::max);
        if worst > ROUNDED + 2.0 * slope {
            return Err(AxisError::Parameter {
                what: "the largest difference, deg, of the recorded set-points to the health signal",
                value: worst.to_degrees(),
                wanted: "none: play the signal written for this head and axis, at its sample period",
            });
        }
        Ok(begin)
    }
}
