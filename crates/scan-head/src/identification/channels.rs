//! Channels of a bench record that are reversed or stand in each other's place, told from the shapes that no motor's responses have.
//!
//! The rules are ours: the slopes of angle over current and angle over voltage, the coil's lag, the share of the band with the wrong sign.

use meltpath_control::Complex64;
use meltpath_control::frequency::Point;

use crate::identification::error::IdentificationError;

/// Share of the band that has to answer the wrong way round before a sign is called reversed.
const AGAINST: f64 = 0.75;
/// Power of the frequency with which angle over current, or angle over voltage, may rise; both fall in a motor, or stand where friction
/// holds it.
const RISES: f64 = 0.5;
/// Tangent of the phase that current over voltage may have at the upper end of the band: a coil lags there, stuck or not.
const LEADS: f64 = 0.1;

/// The power of the frequency that a response runs with, by regression of the logarithms over the band.
fn power(points: &[Point]) -> f64 {
    let whole: f64 = points.iter().map(|p| p.weight).sum();
    let mean = |of: &dyn Fn(&Point) -> f64| -> f64 {
        points.iter().map(|p| p.weight * of(p)).sum::<f64>() / whole
    };
    let (x, y) = (|p: &Point| p.omega.ln(), |p: &Point| p.response.norm().ln());
    let (mx, my) = (mean(&x), mean(&y));
    mean(&|p| (x(p) - mx) * (y(p) - my)) / mean(&|p| (x(p) - mx).powi(2))
}

/// Refuses channels of which one is reversed or in another's place: θ/i lags by 90 to 180°, i/U by less than 90° either way.
pub(super) fn check_channels(
    angle: &[Point],
    current: &[Point],
) -> Result<(), IdentificationError> {
    let exchanged = |one, other| Err(IdentificationError::Exchanged { one, other });
    let falls = power(angle);
    if falls > RISES {
        return exchanged("the current", "the angle");
    }
    // both together are angle over voltage, or its inverse
    if falls + power(current) > RISES {
        return exchanged("the voltage", "the angle");
    }
    // the upper third of an octave, whatever the sign
    let last = current.last().map_or(0.0, |p| p.omega);
    let top = current.iter().filter(|p| p.omega > 0.8 * last);
    let leads = top.map(|p| p.response / p.response.norm());
    let squared: Complex64 = leads.map(|z| z * z).sum();
    // twice the phase, freed of the sign
    if (0.5 * squared.arg()).tan() > LEADS {
        return exchanged("the voltage", "the current");
    }
    let against = |points: &[Point], lag: f64| -> f64 {
        let turned = Complex64::cis(lag);
        let whole: f64 = points.iter().map(|p| p.weight).sum();
        let wrong = points.iter().filter(|p| (p.response * turned).re < 0.0);
        wrong.map(|p| p.weight).sum::<f64>() / whole
    };
    // a rotor that friction's bristles hold answers as a spring does, without lag
    let held = falls > -RISES;
    let shares = [
        if held {
            0.0
        } else {
            against(angle, 0.75 * std::f64::consts::PI)
        },
        against(current, 0.0),
    ];
    // a reversed current turns both transfers, the other channels only their own
    let (what, share) = match shares.map(|share| share > AGAINST) {
        [false, false] => return Ok(()),
        [true, false] => ("the angle", shares[0]),
        [false, true] => ("the voltage", shares[1]),
        [true, true] => ("the current", shares[0].min(shares[1])),
    };
    Err(IdentificationError::Reversed { what, share })
}
