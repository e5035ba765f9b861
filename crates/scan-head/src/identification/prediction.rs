//! The test of a motor on a record that it has not seen.

use crate::axis::error::AxisError;
use crate::axis::galvanometer::{Galvanometer, MOST_MODES};
use crate::identification::abreast;
use crate::identification::begins::unseen;
use crate::identification::drive::Drive;
use crate::identification::error::IdentificationError;
use crate::identification::estimate::Estimate;
use crate::identification::joint::Joint;
use crate::identification::record::BenchRecord;
use meltpath_control::quality::Quality;

/// A record begins in motion where the state that the fit found for its beginning leaves less than this of the squares that a beginning
/// at rest leaves.
const MOVING: f64 = 0.25;

/// How well a motor predicts a record that it was not fitted to, from the voltage alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Of the current, A.
    pub current: Quality,
    /// Of the angle, rad.
    pub angle: Quality,
}

/// What a motor makes of the end of a record to whose beginning it was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Foreseen {
    /// Driven on from the record's beginning by the voltage alone. What small errors of its parameters do adds up over the record.
    pub prediction: Prediction,
    /// Root mean square of what is left of current (A) and angle (rad), the end cut into pieces as the beginning was for the fit: each
    /// begins where it fits best.
    pub left: [f64; 2],
    /// Whether the record begins in motion: the prediction does, too.
    pub moving: bool,
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
    let columns = match motor.modes.len() {
        0 => from_rest::<3>(motor, delays, record)?,
        1 => from_rest::<5>(motor, delays, record)?,
        2 => from_rest::<7>(motor, delays, record)?,
        _ => from_rest::<{ 3 + 2 * MOST_MODES }>(motor, delays, record)?,
    };
    judged(&columns, record, from)
}

/// Current and angle at each sample under the record's voltage.
fn from_rest<const N: usize>(
    motor: &Galvanometer,
    delays: [f64; 2],
    record: &BenchRecord<'_>,
) -> Result<[Vec<f64>; 2], AxisError> {
    let drive = Drive::<N>::new(motor, delays, record.period)?;
    Ok(run(&drive, &resting(record), record, 0.0))
}

fn resting<const N: usize>(record: &BenchRecord<'_>) -> [f64; N] {
    let mut rest = [0.0; N];
    rest[2] = record.angle.first().copied().unwrap_or(0.0);
    rest
}

fn run<const N: usize>(
    drive: &Drive<N>,
    begin: &[f64; N],
    record: &BenchRecord<'_>,
    zero: f64,
) -> [Vec<f64>; 2] {
    let mut columns = abreast::run(drive, begin, record.voltage);
    let first = record.angle.first().copied().unwrap_or(0.0);
    // what is read late stands at rest before
    for (column, rest) in columns.iter_mut().zip([zero, first]) {
        let early = column.iter_mut().take_while(|value| value.is_nan());
        early.for_each(|value| *value = rest);
    }
    columns
}

fn judged(
    [current, angle]: &[Vec<f64>; 2],
    record: &BenchRecord<'_>,
    from: usize,
) -> Result<Prediction, IdentificationError> {
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
        current: quality("the current", current, record.current)?,
        angle: quality("the angle", angle, record.angle)?,
    })
}

impl Joint {
    /// What the motor makes of the samples of a record from number `from` on, where it was fitted to those before.
    ///
    /// # Errors
    /// [`IdentificationError::Axis`], [`IdentificationError::Lengths`].
    pub fn foresee(
        &self,
        record: &BenchRecord<'_>,
        from: usize,
    ) -> Result<Foreseen, IdentificationError> {
        match self.motor.modes.len() {
            0 => self.foreseen::<3>(record, from),
            1 => self.foreseen::<5>(record, from),
            2 => self.foreseen::<7>(record, from),
            _ => self.foreseen::<{ 3 + 2 * MOST_MODES }>(record, from),
        }
    }

    fn foreseen<const N: usize>(
        &self,
        record: &BenchRecord<'_>,
        from: usize,
    ) -> Result<Foreseen, IdentificationError> {
        let estimate = Estimate {
            motor: self.motor.clone(),
            coulomb: self.coulomb.map_or(0.0, |c| c[0]),
            bias: self.bias[0],
            delays: self.delays.map(|d| d[0]),
            zero: self.zero[0],
        };
        let drive = Drive::<N>::new(&estimate.driven(), estimate.delays, record.period)?
            .read_from(estimate.zero);
        let rest = run(&drive, &resting(record), record, estimate.zero);
        let begin: Option<[f64; N]> = self.begin.as_slice().try_into().ok();
        let moved = begin.map(|begin| run(&drive, &begin, record, estimate.zero));
        // whichever leaves less of the part that was fitted
        let left = |columns: &[Vec<f64>; 2]| -> f64 {
            let pairs = columns[1].iter().zip(record.angle).take(from);
            pairs.map(|(p, m)| (p - m).powi(2)).sum()
        };
        let moved = moved.filter(|moved| left(moved) < MOVING * left(&rest));
        let later = BenchRecord {
            voltage: record.voltage.get(from..).unwrap_or_default(),
            current: record.current.get(from..).unwrap_or_default(),
            angle: record.angle.get(from..).unwrap_or_default(),
            ..*record
        };
        Ok(Foreseen {
            prediction: judged(moved.as_ref().unwrap_or(&rest), record, from)?,
            left: unseen::<N>(&later, &estimate, self.rms)?,
            moving: moved.is_some(),
        })
    }
}
