//! What brings what: how far an angle is from its set-point, and how much of a control survives a spread of motors, delays
//! and noise.
//!
//! Source: Rasoanarivo 2020, § 3.4 and fig. 3.8. The thesis compares the conventional control with pre-filter to H-infinity
//! without one; the two effects are told apart here by all four combinations (docs/theory/sources.md).

use std::sync::atomic::{AtomicU64, Ordering};

use meltpath_base::{Cancelled, Observer};
use meltpath_numerics::random::Random;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::axis::chain::{Axis, AxisRecord};
use crate::axis::error::{AxisError, not_negative, positive};

/// Alternating steps of falling amplitude, each reached at a limited speed and held.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiStep {
    /// First amplitude to either side, rad.
    pub amplitude: f64,
    /// Number of amplitudes, each half of the one before.
    pub levels: u32,
    /// Speed between steps, rad/s.
    pub slope: f64,
    /// Time at each step, s.
    pub hold: f64,
}

impl MultiStep {
    /// ±18° down to ±0.035° (§ 2.2.3), at the slope and hold fitted to fig. 3.8.
    pub fn thesis() -> Self {
        MultiStep {
            amplitude: 18f64.to_radians(),
            levels: 10,
            slope: 1150f64.to_radians(),
            hold: 60e-3,
        }
    }

    /// The set-points at a sample period, rad, from rest at 0 back to 0.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    ///
    /// ```
    /// use meltpath_scan_head::servo::compare::MultiStep;
    /// let signal = MultiStep::thesis().samples(50e-6).unwrap();
    /// let highest = signal.iter().fold(0.0f64, |m, &x| m.max(x));
    /// assert!((highest.to_degrees() - 18.0).abs() < 1e-9 && signal.last().unwrap().abs() < 1e-9);
    /// ```
    pub fn samples(&self, period: f64) -> Result<Vec<f64>, AxisError> {
        positive("the amplitude", self.amplitude)?;
        positive("the slope", self.slope)?;
        positive("the time at each step", self.hold)?;
        positive("the sample period", period)?;
        let mut out = Vec::new();
        let mut at = 0.0;
        let held = (self.hold / period).round() as usize;
        let goals = (0..self.levels)
            .map(|k| self.amplitude * 0.5f64.powi(k.cast_signed()))
            .flat_map(|a| [a, -a])
            .chain([0.0]);
        for goal in goals {
            let step = self.slope * period;
            while (goal - at).abs() > step {
                at += step.copysign(goal - at);
                out.push(at);
            }
            at = goal;
            out.extend(std::iter::repeat_n(goal, held));
        }
        Ok(out)
    }
}

/// How far an angle is from its set-point over a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrackingError {
    /// Absolute errors in ascending order, rad.
    sorted: Vec<f64>,
}

impl TrackingError {
    /// Of a record, sample by sample; the set-point is the one before the pre-filter.
    pub fn of(set_points: &[f64], angles: &[f64]) -> Self {
        let mut sorted: Vec<f64> = set_points
            .iter()
            .zip(angles)
            .map(|(s, a)| (s - a).abs())
            .collect();
        sorted.sort_by(f64::total_cmp);
        TrackingError { sorted }
    }

    /// Root of the mean square, rad.
    pub fn rms(&self) -> f64 {
        let sum: f64 = self.sorted.iter().map(|e| e * e).sum();
        (sum / self.sorted.len().max(1) as f64).sqrt()
    }

    /// Largest, rad.
    pub fn largest(&self) -> f64 {
        self.sorted.last().copied().unwrap_or(0.0)
    }

    /// The error that a share 0..1 of the samples does not exceed, rad.
    pub fn quantile(&self, share: f64) -> f64 {
        let last = self.sorted.len().saturating_sub(1);
        let at = (share.clamp(0.0, 1.0) * last as f64).round() as usize;
        self.sorted.get(at).copied().unwrap_or(0.0)
    }

    /// Share of the samples below an error (rad), 0..1.
    pub fn share_below(&self, error: f64) -> f64 {
        let below = self.sorted.partition_point(|&e| e < error);
        below as f64 / self.sorted.len().max(1) as f64
    }
}

/// A short record from rest at its first set-point.
///
/// # Errors
/// [`AxisError`].
pub fn run(
    axis: &Axis,
    set_points: &[f64],
    period: f64,
    seed: u64,
) -> Result<AxisRecord, AxisError> {
    let start = set_points.first().copied().unwrap_or(0.0);
    axis.start(period, start, seed)?.record(set_points)
}

/// How far motors, delays and sensors scatter. Factors are drawn evenly from 1 − width to 1 + width.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scatter {
    /// Width of the coil resistance.
    pub resistance: f64,
    /// Width of the inertia.
    pub inertia: f64,
    /// Width of the pulsation of the modes.
    pub modes: f64,
    /// Longest additional loop delay (s), drawn evenly from 0.
    pub delay: f64,
    /// Largest standard deviation of the sensor's noise (rad), drawn evenly from 0.
    pub noise: f64,
}

/// One draw and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Draw {
    /// Factor on the resistance.
    pub resistance: f64,
    /// Factor on the inertia.
    pub inertia: f64,
    /// Factor on the pulsation of the modes.
    pub modes: f64,
    /// Additional delay, s.
    pub delay: f64,
    /// Standard deviation of the noise, rad.
    pub noise: f64,
    /// Root mean square and largest error (rad); none where the axis ran away.
    pub error: Option<(f64, f64)>,
}

meltpath_base::passes_on! {
    /// Why a Monte-Carlo run stops.
    #[derive(Clone, PartialEq)]
    pub enum ScatterError {
        /// The axis or a width.
        Axis(AxisError),
        /// Stopped by the person who started it.
        Cancelled(Cancelled),
    }
}

/// Runs an axis on one record of set-points (rad) for `draws` scattered motors. The same seed scatters alike whatever the
/// controller, so that controllers are compared on the same motors; the result does not depend on the number of threads.
///
/// # Errors
/// [`ScatterError`]; an axis that runs away is a result, not an error.
pub fn monte_carlo(
    axis: &Axis,
    set_points: &[f64],
    period: f64,
    scatter: &Scatter,
    draws: usize,
    seed: u64,
    observer: &dyn Observer,
) -> Result<Vec<Draw>, ScatterError> {
    for (what, width) in [
        ("the scatter of the resistance", scatter.resistance),
        ("the scatter of the inertia", scatter.inertia),
        ("the scatter of the modes", scatter.modes),
    ] {
        if !(0.0..1.0).contains(&width) {
            return Err(ScatterError::Axis(AxisError::Parameter {
                what,
                value: width,
                wanted: "0 to below 1",
            }));
        }
    }
    not_negative("the longest delay", scatter.delay)?;
    not_negative("the largest noise", scatter.noise)?;
    let mut random = Random::new(seed);
    let mut drawn: Vec<Draw> = (0..draws)
        .map(|_| {
            let mut factor = |width: f64| random.between(1.0 - width, 1.0 + width);
            let (resistance, inertia, modes) = (
                factor(scatter.resistance),
                factor(scatter.inertia),
                factor(scatter.modes),
            );
            Draw {
                resistance,
                inertia,
                modes,
                delay: scatter.delay * random.unit(),
                noise: scatter.noise * random.unit(),
                error: None,
            }
        })
        .collect();
    observer.stage("scattered motors", draws as u64);
    let done = AtomicU64::new(0);
    let results: Vec<Result<Option<(f64, f64)>, ScatterError>> = drawn
        .par_iter()
        .enumerate()
        .map(|(k, draw)| {
            if observer.cancelled() {
                return Err(Cancelled.into());
            }
            let outcome = match run(
                &scattered(axis, draw),
                set_points,
                period,
                seed ^ (k as u64 + 1),
            ) {
                Ok(record) => {
                    let error = TrackingError::of(set_points, &record.angle);
                    Some((error.rms(), error.largest()))
                }
                Err(AxisError::RanAway { .. }) => None,
                Err(other) => return Err(other.into()),
            };
            observer.advance(done.fetch_add(1, Ordering::Relaxed) + 1);
            Ok(outcome)
        })
        .collect();
    for (draw, result) in drawn.iter_mut().zip(results) {
        draw.error = result?;
    }
    Ok(drawn)
}

/// The axis with a drawn motor; the controller stays the one designed for the nominal motor.
#[must_use]
pub fn scattered(axis: &Axis, draw: &Draw) -> Axis {
    let mut out = axis.clone();
    out.motor.resistance *= draw.resistance;
    // the modal gain K_r scales with Kc/J as the rigid one does
    out.motor.inertia *= draw.inertia;
    for mode in &mut out.motor.modes {
        mode.omega *= draw.modes;
        mode.gain /= draw.inertia;
    }
    out.delay += draw.delay;
    out.encoder.noise = out.encoder.noise.hypot(draw.noise);
    out
}
