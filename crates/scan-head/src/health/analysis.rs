//! What the second stage of the health test says: delays, overshoots and lags of its steps and ramps.
//!
//! Source: Rasoanarivo 2020, § 2.4, fig. 2.57-2.60.

use crate::axis::chain::AxisRecord;
use crate::axis::error::AxisError;
use crate::health::friction::FrictionFit;
use crate::health::records::{RampRecord, StepRecord};
use crate::health::signal::{Km0Samples, Piece};
use crate::identification::error::IdentificationError;
use serde::{Deserialize, Serialize};

/// A change of angle by which a step's response is said to have begun, rad (10⁻⁴ deg).
const START: f64 = 1e-4 * std::f64::consts::PI / 180.0;

/// Half the band of the response time.
const BAND: f64 = 0.05;

/// What the second stage found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Km0Stage2 {
    /// The steps, in order.
    pub steps: Vec<StepRecord>,
    /// The ramps, in order.
    pub ramps: Vec<RampRecord>,
    /// The friction.
    pub friction: FrictionFit,
}

impl Km0Samples {
    /// Analyses a record of this signal. `torque_constant` N·m/A is that of the first stage.
    ///
    /// # Errors
    /// [`AxisError::Parameter`] where the record is shorter than the signal, [`IdentificationError::Ramps`] where its ramps do
    /// not tell the friction.
    pub fn analyse(
        &self,
        record: &AxisRecord,
        torque_constant: f64,
    ) -> Result<Km0Stage2, IdentificationError> {
        if record.angle.len() < self.set_points.len()
            || record.current.len() < self.set_points.len()
        {
            return Err(AxisError::Parameter {
                what: "the number of samples of the record",
                value: record.angle.len().min(record.current.len()) as f64,
                wanted: "at least that of the signal: is the sample period the same?",
            }
            .into());
        }
        let (mut steps, mut ramps) = (Vec::new(), Vec::new());
        for (piece, range) in &self.pieces {
            let angle = &record.angle[range.clone()];
            match *piece {
                Piece::Step { from, to } => {
                    let initial = record.angle[range.start - 1];
                    steps.push(self.step(angle, from, to, initial));
                }
                Piece::Ramp { speed } => {
                    let current = &record.current[range.clone()];
                    let asked = &self.set_points[range.clone()];
                    ramps.push(self.ramp(angle, current, asked, speed, torque_constant));
                }
            }
        }
        let friction = FrictionFit::of(&ramps)?;
        Ok(Km0Stage2 {
            steps,
            ramps,
            friction,
        })
    }

    fn step(&self, angle: &[f64], from: f64, to: f64, initial: f64) -> StepRecord {
        let n = angle.len();
        let tail = &angle[n - n / 4..];
        let steady = tail.iter().sum::<f64>() / tail.len() as f64;
        let change = steady - initial;
        let sign = if to >= from { 1.0 } else { -1.0 };
        let peak = angle.iter().fold(f64::MIN, |a, v| a.max(sign * v)) * sign;
        let begun = angle
            .iter()
            .position(|v| (v - initial).abs() > START)
            .unwrap_or(n);
        let outside = angle
            .iter()
            .rposition(|v| (v - steady).abs() > BAND * change.abs());
        StepRecord {
            amplitude_deg: (to - from).to_degrees(),
            steady_from: (n - n / 4) as f64 * self.period,
            steady_deg: steady.to_degrees(),
            start_delay: begun as f64 * self.period,
            overshoot: (100.0 * (peak - steady) / change).max(0.0),
            response_time: outside.map_or(0, |k| k + 1) as f64 * self.period,
            static_error_deg: (to - steady).to_degrees(),
        }
    }

    fn ramp(
        &self,
        angle: &[f64],
        current: &[f64],
        asked: &[f64],
        speed: f64,
        kc: f64,
    ) -> RampRecord {
        let n = angle.len();
        let half = n / 2;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        let end = n - 1;
        let steady = (angle[end] - angle[half]) / ((end - half).max(1) as f64 * self.period);
        // the slope over a few samples: differences of single ones are noise
        let span = (n / 50).clamp(1, 20);
        let slope = |k: usize| (angle[k] - angle[k - span]) / (span as f64 * self.period);
        let outside = (span..half)
            .rev()
            .find(|&k| (slope(k) - steady).abs() > BAND * steady.abs());
        let current = mean(&current[half..]);
        RampRecord {
            speed_deg: speed.to_degrees(),
            steady_speed_deg: steady.to_degrees(),
            amplitude_deg: (asked[end] - asked[0]).to_degrees(),
            lag_deg: (asked[end] - angle[end]).to_degrees(),
            speed_response_time: outside.map_or(0, |k| k + 1) as f64 * self.period,
            current,
            torque: kc * current,
        }
    }
}
