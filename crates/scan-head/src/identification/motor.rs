//! Motor parameters from a bench record of voltage, current and angle, with their deviations, and the test of a model on a
//! record that it has not seen.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.2 (eqs. 2.8-2.13), § 2.2.1.5 (friction), annex A; the joint automatic fit replaces the
//! thesis' fit by eye. Validity: one rigid inertia with viscous damping in the band; dry friction lowers the gain at low
//! frequency and is taken for viscous damping there, so excite strongly against it, then fit it on ramps.

use std::f64::consts::TAU;

use meltpath_control::Complex64;
use meltpath_control::frequency::Point;
use meltpath_control::quality::Quality;
use meltpath_control::welch::{Welch, WelchError, estimate};
use meltpath_numerics::least_squares::{self, Fit, LeastSquaresError};

use crate::axis::friction::Friction;
use crate::axis::galvanometer::{AxisError, Galvanometer, MOST_MODES};
use crate::axis::plant::Plant;
use crate::identification::channels::check_channels;

/// The two transfers that are identified: θ/i = G1/(s(1+τ1 s)), i/U = G2(1+τ1 s)/((1+τ2 s)(1+τ3 s)) (eq. 2.10).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfers {
    /// G1, rad/(A·s).
    pub angle_gain: f64,
    /// τ1 = J/B, s.
    pub mechanical: f64,
    /// G2, A/V.
    pub current_gain: f64,
    /// τ2 and τ3, s.
    pub lags: [f64; 2],
}

/// Why nothing was identified.
#[derive(Debug, thiserror::Error)]
pub enum IdentificationError {
    /// A column that is shorter or longer than the voltage.
    #[error("{what} has {found} samples, the voltage {wanted}: give columns of one record")]
    Lengths {
        /// Which column.
        what: &'static str,
        /// Its samples.
        found: usize,
        /// Those of the voltage.
        wanted: usize,
    },
    /// Fewer than three frequencies in the band.
    #[error(
        "only {points} frequencies between {low:.1} and {high:.1} Hz carry a signal: widen the band, lengthen the segments or excite more"
    )]
    Band {
        /// How many there are.
        points: usize,
        /// From, Hz.
        low: f64,
        /// To, Hz.
        high: f64,
    },
    /// A channel with the wrong sign.
    #[error(
        "{what} answers against its cause over {:.0} % of the band: its sign is reversed (a negative `scale` in the mapping turns it), or two channels are exchanged",
        100.0 * share
    )]
    Reversed {
        /// Which channel.
        what: &'static str,
        /// Share of the band, as the fit weighs it.
        share: f64,
    },
    /// Two channels stand in each other's place.
    #[error(
        "{one} and {other} are exchanged: the response of one to the other runs over the frequencies as a motor's inverse does"
    )]
    Exchanged {
        /// The one.
        one: &'static str,
        /// The other.
        other: &'static str,
    },
    /// Numbers that no motor has.
    #[error(
        "the transfers give {what} = {value:.4e}, which no motor has: check units and signs of the columns (a swapped or reversed one does this)"
    )]
    Unphysical {
        /// Which parameter.
        what: &'static str,
        /// What it would be.
        value: f64,
    },
    /// Parameters that the record does not determine.
    #[error(
        "not even the order of {what} is known (relative deviation {sigma:.1}): the rotor hardly answers, as where dry friction holds it: excite more, or record longer"
    )]
    Unsure {
        /// Which parameter.
        what: &'static str,
        /// Its relative deviation.
        sigma: f64,
    },
    /// No steady ramp, or ramps in one direction only.
    #[error(
        "friction needs ramps at two speeds or more in each direction: {forward} forward, {backward} backward were given"
    )]
    Ramps {
        /// Ramps with positive speed.
        forward: usize,
        /// Ramps with negative speed.
        backward: usize,
    },
    /// The estimate.
    #[error(transparent)]
    Welch(#[from] WelchError),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] LeastSquaresError),
    /// The simulated motor.
    #[error(transparent)]
    Axis(#[from] AxisError),
}

/// The motor behind two transfers (eq. 2.13), torque and back-EMF constants taken equal.
///
/// # Errors
/// [`IdentificationError::Unphysical`] naming the first parameter that is not above zero.
pub fn motor_of(t: &Transfers) -> Result<Galvanometer, IdentificationError> {
    let a = t.mechanical;
    let [r1, r2] = t.lags.map(|tau| 1.0 / tau);
    let c = 1.0 / (t.current_gain * a * r1 * r2);
    let b = (a * c * (r1 + r2) - c) / a;
    let d = 1.0 / t.current_gain - b;
    let torque_constant = d / t.angle_gain;
    let viscous = torque_constant / t.angle_gain;
    let motor = Galvanometer {
        resistance: b,
        inductance: c,
        torque_constant,
        back_emf: torque_constant,
        inertia: a * viscous,
        viscous,
        modes: Vec::new(),
        friction: Friction::None,
    };
    for (what, value) in [
        ("R", motor.resistance),
        ("L", motor.inductance),
        ("Kc", motor.torque_constant),
        ("B", motor.viscous),
        ("J", motor.inertia),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(IdentificationError::Unphysical { what, value });
        }
    }
    Ok(motor)
}

/// The two transfers of a motor (eqs. 2.8, 2.9), its modes and dry friction left out; none where the electric and mechanical
/// poles of current over voltage are complex, or without viscous damping.
///
/// ```
/// use meltpath_scan_head::identification::motor::{Transfers, motor_of, transfers_of};
/// let t = Transfers { angle_gain: 2057.0, mechanical: 15.1e-3, current_gain: 0.065, lags: [2.67e-3, 66e-6] };
/// let again = transfers_of(&motor_of(&t).unwrap()).unwrap();
/// assert!((again.lags[0] / t.lags[0] - 1.0).abs() < 1e-9);
/// ```
pub fn transfers_of(motor: &Galvanometer) -> Option<Transfers> {
    let tau1 = motor.inertia / motor.viscous;
    let gain = 1.0 / (motor.resistance + motor.torque_constant * motor.back_emf / motor.viscous);
    let sum = gain * (motor.resistance * tau1 + motor.inductance);
    let product = gain * motor.inductance * tau1;
    let root = (sum * sum - 4.0 * product).sqrt();
    let slow = 0.5 * (sum + root);
    let found = Transfers {
        angle_gain: motor.torque_constant / motor.viscous,
        mechanical: tau1,
        current_gain: gain,
        // the product, not the difference, gives the fast lag without cancellation
        lags: [slow, product / slow],
    };
    (root.is_finite() && tau1.is_finite()).then_some(found)
}

/// A bench record of one axis, one value a sample.
#[derive(Debug, Clone, Copy)]
pub struct BenchRecord<'a> {
    /// Time between samples, s.
    pub period: f64,
    /// Voltage held from each sample on, V.
    pub voltage: &'a [f64],
    /// Current, A.
    pub current: &'a [f64],
    /// Angle, rad.
    pub angle: &'a [f64],
}

/// What was excited.
#[derive(Debug, Clone, Copy)]
pub enum Excitation<'a> {
    /// The voltage itself, in open loop.
    Voltage,
    /// The set-point of the closed loop, rad: estimates refer to it, so that noise that the loop feeds back does not bias them.
    SetPoint(&'a [f64]),
}

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

/// A peak of angle over current that stands out of the rigid motor's, and why it is no mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefusedPeak {
    /// Where, Hz.
    pub frequency: f64,
    /// How far it stands out, as a ratio.
    pub ratio: f64,
    /// Why it is no mode.
    pub why: Refusal,
}

/// Why a peak is no mode.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The response has not fallen again at the end of the band that is searched.
    #[error(
        "the response has not fallen again where the search ends, at {end:.0} Hz: sample faster to see what is there"
    )]
    Edge {
        /// The end, Hz.
        end: f64,
    },
    /// Most of the angle there is not an answer to the current.
    #[error("only {:.0} % of the angle there answers the current, the rest is noise or the encoder's steps: excite more, or average longer", 100.0 * coherence)]
    Noise {
        /// Coherence at the peak.
        coherence: f64,
    },
    /// Thinner than the windows of the estimate tell from a line.
    #[error(
        "it is {width:.1} Hz wide, thinner than the {resolved:.1} Hz that windows of this length resolve: record longer, in longer windows"
    )]
    Thin {
        /// Width at −3 dB, Hz.
        width: f64,
        /// Width of a line in the estimate, Hz.
        resolved: f64,
    },
    /// The fit with it does not determine it.
    #[error("its frequency, damping and gain are known to ± {:.0} % only: record longer, or excite more", 100.0 * sigma)]
    Unsure {
        /// The largest of the three relative deviations.
        sigma: f64,
    },
}

/// How estimates are made and fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Method {
    /// The spectral estimate.
    pub welch: Welch,
    /// The band of the fit, Hz.
    pub band: [f64; 2],
}

impl Default for Method {
    /// Hann windows of 8192 samples, half overlapping; 5 Hz to 1.5 kHz.
    fn default() -> Self {
        Method {
            welch: Welch::hann(8192),
            band: [5.0, 1500.0],
        }
    }
}

impl Method {
    /// Windows of about 0.4 s, whatever the sample time (s): 8192 samples at 20 kHz, 32 768 at 93.75 kHz. Shorter ones do not see
    /// viscous damping.
    pub fn at(period: f64) -> Self {
        let exponent = (0.41 / period).log2().round().clamp(8.0, 20.0) as u32;
        Method {
            welch: Welch::hann(1 << exponent),
            ..Method::default()
        }
    }
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
    for (what, sigma) in [("R", sigma[0]), ("Kc", sigma[2]), ("J", sigma[3])] {
        // a deviation of the logarithm: beyond one not even the order is known
        if sigma.is_nan() || sigma > 1.0 {
            return Err(IdentificationError::Unsure { what, sigma });
        }
    }
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

/// The motor of the logarithms of R, L, Kc, J, B.
fn motor(logs: &[f64]) -> Galvanometer {
    let value = |i: usize| logs.get(i).map_or(f64::NAN, |v| v.exp());
    Galvanometer {
        resistance: value(0),
        inductance: value(1),
        torque_constant: value(2),
        back_emf: value(2),
        inertia: value(3),
        viscous: value(4),
        modes: Vec::new(),
        friction: Friction::None,
    }
}

/// Both responses at once, in the complex logarithm, over the logarithms of R, L, Kc, J, B: their deviations come out directly.
fn fit(angle: &[Point], current: &[Point], period: f64) -> Result<Fit, IdentificationError> {
    let start = motor_of(&guess(angle, current))
        .map_or_else(|_| from_asymptotes(angle, current), |m| logs(&m));
    let residuals = |x: &[f64]| -> Vec<f64> {
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
            .collect()
    };
    let mut fit = least_squares::fit(residuals, &start)?;
    // weights have a unit: the residual is told per point, as if all weighed one
    let weight: f64 = angle.iter().chain(current).map(|p| p.weight).sum();
    let points = (angle.len() + current.len()) as f64;
    fit.rms *= (points / weight).sqrt();
    Ok(fit)
}

fn logs(m: &Galvanometer) -> Vec<f64> {
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

/// A steady ramp: speed (rad/s) and mean current (A).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyRamp {
    /// Speed, signed, rad/s.
    pub speed: f64,
    /// Mean current while the speed is constant, A.
    pub current: f64,
}

/// Torque at constant speed: Kc·ī = B ω + T_P + T_C sgn ω (eq. 2.22).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RampFriction {
    /// B, N·m·s/rad, and its deviation.
    pub viscous: [f64; 2],
    /// T_P, N·m, the same in both directions, and its deviation.
    pub bias: [f64; 2],
    /// T_C, N·m, and its deviation.
    pub coulomb: [f64; 2],
    /// Root mean square of the residual torques, N·m.
    pub rms: f64,
    /// The same with viscous friction alone, N·m: what the dry terms bring.
    pub rms_viscous_only: f64,
}

/// Friction from ramps at many speeds in both directions.
///
/// # Errors
/// [`IdentificationError::Ramps`], [`IdentificationError::Fit`].
pub fn friction_of_ramps(
    ramps: &[SteadyRamp],
    torque_constant: f64,
) -> Result<RampFriction, IdentificationError> {
    let forward = ramps.iter().filter(|r| r.speed > 0.0).count();
    let backward = ramps.iter().filter(|r| r.speed < 0.0).count();
    if forward < 2 || backward < 2 {
        return Err(IdentificationError::Ramps { forward, backward });
    }
    // unknowns of the order of one: torques over the greatest torque, speeds over the greatest speed
    let torque = |r: &SteadyRamp| torque_constant * r.current;
    let most = ramps.iter().map(|r| torque(r).abs()).fold(1e-300, f64::max);
    let fastest = ramps.iter().map(|r| r.speed.abs()).fold(1e-300, f64::max);
    let dry = least_squares::fit(
        |x| {
            ramps
                .iter()
                .map(|r| {
                    x[0] * r.speed / fastest + x[1] + x[2] * r.speed.signum() - torque(r) / most
                })
                .collect()
        },
        &[0.5, 0.0, 0.5],
    )?;
    let wet = least_squares::fit(
        |x| {
            ramps
                .iter()
                .map(|r| x[0] * r.speed / fastest - torque(r) / most)
                .collect()
        },
        &[0.5],
    )?;
    let both = |i: usize, unit: f64| [unit * dry.values[i], unit * dry.sigma[i]];
    Ok(RampFriction {
        viscous: both(0, most / fastest),
        bias: both(1, most),
        coulomb: both(2, most),
        rms: most * dry.rms,
        rms_viscous_only: most * wet.rms,
    })
}

/// How well a motor predicts a record that it was not fitted to, from the voltage alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Of the current, A.
    pub current: Quality,
    /// Of the angle, rad.
    pub angle: Quality,
}

/// Drives the motor with the voltage of a record, from rest at its first angle, and judges the samples from number `from` on:
/// 0 for a record that the motor was not fitted to, the end of the fitted part where it was fitted to a first part.
///
/// # Errors
/// [`IdentificationError::Axis`] for a motor that cannot be simulated, [`IdentificationError::Lengths`].
pub fn predict(
    motor: &Galvanometer,
    record: &BenchRecord<'_>,
    from: usize,
) -> Result<Prediction, IdentificationError> {
    let (current, angle) = match motor.modes.len() {
        0 => driven::<3>(motor, record)?,
        1 => driven::<5>(motor, record)?,
        2 => driven::<7>(motor, record)?,
        _ => driven::<{ 3 + 2 * MOST_MODES }>(motor, record)?,
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
