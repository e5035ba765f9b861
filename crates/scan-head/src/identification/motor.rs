//! Motor parameters from a bench record of voltage, current and angle, with their deviations, and the test of a model on a
//! record that it has not seen.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.2 (eqs. 2.8-2.13), § 2.2.1.5 (friction), annex A; the joint automatic fit replaces the
//! thesis' fit by eye. Validity: one rigid inertia with viscous damping in the band; dry friction lowers the gain at low
//! frequency and is taken for viscous damping there, so excite strongly against it, then fit it on ramps.

use crate::axis::friction::Friction;
use crate::axis::galvanometer::{Galvanometer, Mode};
use crate::identification::channels::check_channels;
use crate::identification::error::IdentificationError;
use crate::identification::record::{BenchRecord, Excitation, Method};
use crate::identification::refusal::RefusedPeak;
use crate::identification::responses::responses;
use crate::identification::transfers::{Transfers, motor_of};
use meltpath_control::Complex64;
use meltpath_control::frequency::Point;
use meltpath_numerics::least_squares::{self, Fit};

/// Unknowns of the rigid motor.
pub(super) const RIGID: usize = 5;

/// A motor and how sure it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// R, L, Kc = Ke, J, B; modes where they were looked for; no dry friction.
    pub motor: Galvanometer,
    /// One standard deviation of R, L, Kc, J, B, relative.
    pub sigma: [f64; 5],
    /// The same of pulsation, damping and gain (over Kc/J) of each mode.
    pub mode_sigma: Vec<[f64; 3]>,
    /// Peaks that were not taken for modes.
    pub refused: Vec<RefusedPeak>,
    /// Root mean square of the complex logarithmic residuals (0.1 is about 0.9 dB or 6°).
    pub rms: f64,
    /// Estimated θ/i, rad/A.
    pub angle_over_current: Vec<Point>,
    /// Estimated i/U, A/V.
    pub current_over_voltage: Vec<Point>,
}

/// Identifies the rigid motor from a record; [`crate::identification::modes`] adds flexible modes.
///
/// # Errors
/// [`IdentificationError`].
pub fn identify(
    record: &BenchRecord<'_>,
    excitation: Excitation<'_>,
    method: &Method,
) -> Result<Identified, IdentificationError> {
    let (angle_over_current, current_over_voltage) = responses(record, excitation, method)?;
    check_channels(&angle_over_current, &current_over_voltage)?;
    let fit = fit(&angle_over_current, &current_over_voltage, record.period)?;
    let sigma = [0, 1, 2, 3, 4].map(|i| fit.sigma.get(i).copied().unwrap_or(f64::NAN));
    known(sigma)?;
    Ok(Identified {
        motor: motor(&fit.values),
        sigma,
        mode_sigma: Vec::new(),
        refused: Vec::new(),
        rms: fit.rms,
        angle_over_current,
        current_over_voltage,
    })
}

/// Refuses a motor of which not even the order is known, by the deviations of R, L, Kc, J, B.
pub(super) fn known(sigma: [f64; RIGID]) -> Result<(), IdentificationError> {
    for (what, sigma) in [("R", sigma[0]), ("Kc", sigma[2]), ("J", sigma[3])] {
        // a deviation of the logarithm: beyond one not even the order is known
        if sigma.is_nan() || sigma > 1.0 {
            return Err(IdentificationError::Unsure { what, sigma });
        }
    }
    Ok(())
}

/// The motor of the logarithms of R, L, Kc, J, B and, for each mode, ω, ξ, K over Kc/J.
pub(super) fn motor(logs: &[f64]) -> Galvanometer {
    let value = |i: usize| logs.get(i).map_or(f64::NAN, |v| v.exp());
    let per_inertia = value(2) / value(3);
    Galvanometer {
        resistance: value(0),
        inductance: value(1),
        torque_constant: value(2),
        back_emf: value(2),
        inertia: value(3),
        viscous: value(4),
        modes: logs
            .get(RIGID..)
            .unwrap_or_default()
            .chunks_exact(3)
            .map(|m| Mode {
                omega: m[0].exp(),
                damping: m[1].exp(),
                gain: m[2].exp() * per_inertia,
            })
            .collect(),
        friction: Friction::None,
        felt: 0.0,
    }
}

/// Both responses at once, in the complex logarithm, over the logarithms of R, L, Kc, J, B: their deviations come out directly.
fn fit(angle: &[Point], current: &[Point], period: f64) -> Result<Fit, IdentificationError> {
    let start = motor_of(&guess(angle, current))
        .map_or_else(|_| from_asymptotes(angle, current), |m| logs(&m));
    let near = viscous_near(&start, angle, current);
    let residuals = |x: &[f64]| -> Vec<f64> {
        let near = near(x);
        let motor = motor(x);
        let angle = angle.iter().map(|p| {
            let s = Complex64::new(0.0, p.omega);
            (p, motor.speed_over_current(s) / s)
        });
        let current = current.iter().map(|p| {
            let s = Complex64::new(0.0, p.omega);
            // the voltage is held between samples
            let held = (1.0 - (-s * period).exp()) / (s * period);
            (p, motor.current_over_voltage(s) * held)
        });
        angle
            .chain(current)
            .flat_map(|(p, model)| {
                let z = (model / p.response).ln() * p.weight.sqrt();
                [z.re, z.im]
            })
            .chain([near])
            .collect()
    };
    let mut fit = least_squares::fit(residuals, &start)?;
    // weights have a unit: the residual is told per point, as if all weighed one
    let weight: f64 = angle.iter().chain(current).map(|p| p.weight).sum();
    let points = (angle.len() + current.len()) as f64;
    fit.rms *= (points / weight).sqrt();
    Ok(fit)
}

/// What keeps viscous damping near its start where the responses say nothing of it, as where dry friction hides it: a millionth of
/// what they weigh.
pub(super) fn viscous_near(
    start: &[f64],
    angle: &[Point],
    current: &[Point],
) -> impl Fn(&[f64]) -> f64 + use<> {
    let weight: f64 = angle.iter().chain(current).map(|p| p.weight).sum();
    let first = start.get(RIGID - 1).copied().unwrap_or(0.0);
    move |x| 1e-6 * weight.sqrt() * (x.get(RIGID - 1).copied().unwrap_or(first) - first)
}

/// The logarithms of R, L, Kc, J, B.
pub(super) fn logs(m: &Galvanometer) -> Vec<f64> {
    [
        m.resistance,
        m.inductance,
        m.torque_constant,
        m.inertia,
        m.viscous,
    ]
    .map(f64::ln)
    .to_vec()
}

/// The transfers read off the ends of the responses and the crest of current over voltage.
fn guess(angle: &[Point], current: &[Point]) -> Transfers {
    // both hold three points or more
    let size = |p: &Point| (p.omega, p.response.norm());
    let ends = |points: &[Point]| {
        let first = points.first().map_or((1.0, 1.0), size);
        (first, points.last().map_or(first, size))
    };
    let ((w0, a0), (w1, a1)) = ends(angle);
    let angle_gain = a0 * w0;
    let mechanical = angle_gain / (a1 * w1 * w1);
    let ((_, g0), _) = ends(current);
    let crest = current.iter().map(size).max_by(|a, b| a.1.total_cmp(&b.1));
    let (wc, gc) = crest.unwrap_or((1.0, 1.0));
    // between the lags the response stands at G2 τ1/τ2
    let slow = (g0 * mechanical / gc).max(1.0 / wc);
    Transfers {
        angle_gain,
        mechanical,
        current_gain: g0,
        lags: [slow, (1.0 / (wc * wc * slow)).min(0.5 * slow)],
    }
}

/// Orders of magnitude of R, L, Kc, J, B where the ends of the responses give no motor.
fn from_asymptotes(angle: &[Point], current: &[Point]) -> Vec<f64> {
    let t = guess(angle, current);
    let crest = current
        .iter()
        .map(|p| p.response.norm())
        .fold(0.0, f64::max);
    let resistance = 1.0 / crest;
    let back = (1.0 / t.current_gain - resistance).max(0.1 * resistance);
    let torque = back / t.angle_gain;
    let viscous = torque / t.angle_gain;
    [
        resistance,
        resistance * t.lags[1],
        torque,
        t.mechanical * viscous,
        viscous,
    ]
    .map(f64::ln)
    .to_vec()
}
