//! Frequency responses estimated from a bench record: angle over current, current over voltage.

use crate::identification::error::IdentificationError;
use crate::identification::record::{BenchRecord, Excitation, Method};
use meltpath_control::frequency::Point;
use meltpath_control::welch::estimate;
use std::f64::consts::TAU;

/// Estimated θ/i (rad/A) and i/U (A/V) in the band of a method.
///
/// # Errors
/// [`IdentificationError`].
pub fn responses(
    record: &BenchRecord<'_>,
    excitation: Excitation<'_>,
    method: &Method,
) -> Result<(Vec<Point>, Vec<Point>), IdentificationError> {
    let wanted = record.voltage.len();
    let columns = [("the current", record.current), ("the angle", record.angle)];
    let drawn = match excitation {
        Excitation::Voltage => None,
        Excitation::SetPoint(set_point) => Some(("the set-point", set_point)),
    };
    for (what, column) in columns.into_iter().chain(drawn) {
        if column.len() != wanted {
            let found = column.len();
            return Err(IdentificationError::Lengths {
                what,
                found,
                wanted,
            });
        }
    }
    let response =
        |input: &[f64], output: &[f64]| estimate(input, output, record.period, &method.welch);
    // a ratio of two responses to the excitation, or the response itself
    let points = |input: &[f64], output: &[f64]| -> Result<Vec<Point>, IdentificationError> {
        let (omega, values, power) = match excitation {
            Excitation::Voltage => {
                let e = response(input, output)?;
                (e.omega, e.response, e.input)
            }
            Excitation::SetPoint(set_point) => {
                let (over, under) = (response(set_point, output)?, response(set_point, input)?);
                let ratio = over.response.iter().zip(&under.response);
                let ratio = ratio.map(|(o, u)| o / u).collect();
                (over.omega, ratio, over.input)
            }
        };
        let excited = UNEXCITED * power.iter().copied().fold(0.0, f64::max);
        let [low, high] = method.band.map(|f| TAU * f);
        let found: Vec<Point> = omega
            .into_iter()
            .zip(values)
            .zip(power)
            .filter(|((w, v), p)| {
                (low..=high).contains(w) && *p > excited && v.is_finite() && v.norm() > 0.0
            })
            // as many squares in every octave
            .map(|((omega, response), _)| Point {
                omega,
                response,
                weight: 1.0 / omega,
            })
            .collect();
        if found.len() < 3 {
            let [low, high] = method.band;
            return Err(IdentificationError::Band {
                points: found.len(),
                low,
                high,
            });
        }
        Ok(found)
    };
    Ok((
        points(record.current, record.angle)?,
        points(record.voltage, record.current)?,
    ))
}

/// Power of a signal, over its largest at any frequency, below which a frequency counts as not excited: a sweep that ends within the
/// band leaves only its windows' leakage beyond.
const UNEXCITED: f64 = 1e-5;
