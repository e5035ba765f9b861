//! The test of a motor on a record that it has not seen.

use crate::axis::error::AxisError;
use crate::axis::galvanometer::{Galvanometer, MOST_MODES};
use crate::axis::plant::Plant;
use crate::identification::error::IdentificationError;
use crate::identification::record::BenchRecord;
use meltpath_control::quality::Quality;

/// How well a motor predicts a record that it was not fitted to, from the voltage alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Of the current, A.
    pub current: Quality,
    /// Of the angle, rad.
    pub angle: Quality,
}

/// Drives the motor with the voltage of a record, from rest at its first angle, reads current and angle late by `delays` s, and judges
/// the samples from number `from` on:
/// 0 for a record that the motor was not fitted to, the end of the fitted part where it was fitted to a first part.
///
/// # Errors
/// [`IdentificationError::Axis`] for a motor that cannot be simulated, [`IdentificationError::Lengths`].
pub fn predict(
    motor: &Galvanometer,
    delays: [f64; 2],
    record: &BenchRecord<'_>,
    from: usize,
) -> Result<Prediction, IdentificationError> {
    let (current, angle) = match motor.modes.len() {
        0 => driven::<3>(motor, record)?,
        1 => driven::<5>(motor, record)?,
        2 => driven::<7>(motor, record)?,
        _ => driven::<{ 3 + 2 * MOST_MODES }>(motor, record)?,
    };
    let [current, angle] = [(current, delays[0]), (angle, delays[1])]
        .map(|(c, delay)| late(&c, delay / record.period));
    let quality = |what, predicted: &[f64], measured: &[f64]| {
        let (seen, wanted) = (measured.get(from..), predicted.get(from..));
        Quality::of(wanted.unwrap_or_default(), seen.unwrap_or_default()).ok_or(
            IdentificationError::Lengths {
                what,
                found: measured.len(),
                wanted: predicted.len(),
            },
        )
    };
    Ok(Prediction {
        current: quality("the current", &current, record.current)?,
        angle: quality("the angle", &angle, record.angle)?,
    })
}

/// A column read late by a share of samples, straight between them; the first sample stands before the begin.
fn late(column: &[f64], samples: f64) -> Vec<f64> {
    let at = |k: f64| {
        let k = (k.max(0.0) as usize).min(column.len() - 1);
        column[k]
    };
    (0..column.len())
        .map(|k| {
            let when = k as f64 - samples;
            let before = at(when.floor());
            before + (when - when.floor()) * (at(when.floor() + 1.0) - before)
        })
        .collect()
}

/// Current and angle at each sample under the record's voltage.
fn driven<const N: usize>(
    motor: &Galvanometer,
    record: &BenchRecord<'_>,
) -> Result<(Vec<f64>, Vec<f64>), AxisError> {
    let start = record.angle.first().copied().unwrap_or(0.0);
    let mut plant = Plant::<N>::new(motor, &[record.period], start)?;
    let (mut current, mut angle) = (Vec::new(), Vec::new());
    for &voltage in record.voltage {
        current.push(plant.current());
        angle.push(plant.angle());
        plant.advance(0, voltage, 0.0);
    }
    Ok((current, angle))
}
