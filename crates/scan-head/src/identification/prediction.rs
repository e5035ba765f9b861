//! The test of a motor on a record that it has not seen.

use crate::axis::error::AxisError;
use crate::axis::galvanometer::{Galvanometer, MOST_MODES};
use crate::identification::drive::Drive;
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
/// [`IdentificationError::Axis`] for a motor that cannot be simulated or has another law of friction than Coulomb's, [`IdentificationError::Lengths`].
pub fn predict(
    motor: &Galvanometer,
    delays: [f64; 2],
    record: &BenchRecord<'_>,
    from: usize,
) -> Result<Prediction, IdentificationError> {
    motor.check()?;
    let [current, angle] = match motor.modes.len() {
        0 => driven::<3>(motor, delays, record)?,
        1 => driven::<5>(motor, delays, record)?,
        2 => driven::<7>(motor, delays, record)?,
        _ => driven::<{ 3 + 2 * MOST_MODES }>(motor, delays, record)?,
    };
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

/// Current and angle at each sample under the record's voltage.
fn driven<const N: usize>(
    motor: &Galvanometer,
    delays: [f64; 2],
    record: &BenchRecord<'_>,
) -> Result<[Vec<f64>; 2], AxisError> {
    let first = record.angle.first().copied().unwrap_or(0.0);
    let mut rest = [0.0; N];
    rest[2] = first;
    let mut columns = Drive::<N>::new(motor, delays, record.period)?.run(&rest, record.voltage);
    // what is read late stands at rest before
    for (column, rest) in columns.iter_mut().zip([0.0, first]) {
        let early = column.iter_mut().take_while(|value| value.is_nan());
        early.for_each(|value| *value = rest);
    }
    Ok(columns)
}
