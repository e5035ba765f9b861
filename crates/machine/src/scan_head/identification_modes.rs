//! Flexible modes from a bench record: peaks that the rigid motor does not explain, then all parameters fitted together.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.4 (modes adjusted by eye on the experimental response); the automatic fit and its deviations are
//! ours. Above a sixth of the sampling frequency sampled responses differ from continuous ones: the model is sampled with the
//! voltage held, as the record is.

use std::f64::consts::{PI, TAU};

use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::fit::frequency::Point;
use meltpath_control::fit::least_squares;
use meltpath_control::{Complex64, ZeroPoleGain};

use super::friction::Friction;
use super::galvanometer::{Galvanometer, MOST_MODES, Mode};
use super::identification::{
    BenchRecord, Excitation, IdentificationError, Identified, Method, identify, responses,
};

/// How modes are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeSearch {
    /// Most modes.
    pub most: usize,
    /// From where on, Hz: below, the rigid motor is fitted.
    pub from: f64,
    /// Up to which share of the sampling frequency.
    pub share: f64,
    /// How far a peak has to stand out of the rigid motor's response, as a ratio.
    pub prominence: f64,
}

impl Default for ModeSearch {
    /// Up to three modes from 1 kHz to 0.45 of the sampling frequency that stand out twofold.
    fn default() -> Self {
        ModeSearch {
            most: MOST_MODES,
            from: 1000.0,
            share: 0.45,
            prominence: 2.0,
        }
    }
}

/// Unknowns of the rigid motor.
const RIGID: usize = 5;
/// Peaks nearer than this, relative, are one.
const APART: f64 = 0.15;
/// Lengths of the running median that takes single outliers away.
const MEDIAN: usize = 5;

/// Identifies the motor with its flexible modes. Without a peak that stands out the result is that of [`identify`].
///
/// # Errors
/// [`IdentificationError`].
pub fn identify_modes(
    record: &BenchRecord<'_>,
    excitation: Excitation<'_>,
    method: &Method,
    search: &ModeSearch,
) -> Result<Identified, IdentificationError> {
    let rigid = identify(record, excitation, method)?;
    let wide = Method {
        band: [method.band[0], search.share / record.period],
        ..*method
    };
    let (angle, current) = responses(record, excitation, &wide)?;
    let found = peaks(&rigid.motor, &angle, record.period, search)?;
    if found.is_empty() {
        return Ok(rigid);
    }
    let mut start = vec![
        rigid.motor.resistance.ln(),
        rigid.motor.inductance.ln(),
        rigid.motor.torque_constant.ln(),
        rigid.motor.inertia.ln(),
        rigid.motor.viscous.ln(),
    ];
    let per_inertia = rigid.motor.torque_constant / rigid.motor.inertia;
    for mode in &found {
        start.extend([
            mode.omega.ln(),
            mode.damping.ln(),
            (mode.gain / per_inertia).ln(),
        ]);
    }
    let residuals = |x: &[f64]| -> Vec<f64> {
        let count = 2 * (angle.len() + current.len());
        sampled(&motor(x), record.period).map_or_else(
            |_| vec![f64::INFINITY; count],
            |model| {
                let one = angle.iter().map(|p| (p, model.angle_over_current(p.omega)));
                let two = current
                    .iter()
                    .map(|p| (p, model.current_over_voltage(p.omega)));
                one.chain(two)
                    .flat_map(|(p, value)| {
                        let z = (value / p.response).ln() * p.weight.sqrt();
                        [z.re, z.im]
                    })
                    .collect()
            },
        )
    };
    let fit = least_squares(residuals, &start)?;
    let weight: f64 = angle.iter().chain(&current).map(|p| p.weight).sum();
    let points = (angle.len() + current.len()) as f64;
    let sigma = |i: usize| fit.sigma.get(i).copied().unwrap_or(f64::NAN);
    Ok(Identified {
        motor: motor(&fit.values),
        sigma: std::array::from_fn(sigma),
        mode_sigma: (0..found.len())
            .map(|m| std::array::from_fn(|i| sigma(RIGID + 3 * m + i)))
            .collect(),
        rms: fit.rms * (points / weight).sqrt(),
        angle_over_current: angle,
        current_over_voltage: current,
    })
}

/// The motor of the logarithms of R, L, Kc, J, B and, for each mode, ω, ξ, K over Kc/J.
fn motor(logs: &[f64]) -> Galvanometer {
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
    }
}

/// Responses of a motor sampled with its voltage held.
struct Sampled {
    current: ZeroPoleGain,
    angle: ZeroPoleGain,
}

fn sampled(motor: &Galvanometer, period: f64) -> Result<Sampled, IdentificationError> {
    let failed = |e| IdentificationError::Axis(super::galvanometer::AxisError::System(e));
    let held = discretise(&motor.linear().map_err(failed)?, period, Hold::Zero).map_err(failed)?;
    Ok(Sampled {
        current: ZeroPoleGain::from_state_space(&held, 0, 0).map_err(failed)?,
        angle: ZeroPoleGain::from_state_space(&held, 1, 0).map_err(failed)?,
    })
}

impl Sampled {
    fn angle_over_current(&self, omega: f64) -> Complex64 {
        self.angle.response(omega) / self.current.response(omega)
    }

    fn current_over_voltage(&self, omega: f64) -> Complex64 {
        self.current.response(omega)
    }
}

/// Modes read off the peaks of the measured angle over current against the rigid motor's, by ascending frequency.
fn peaks(
    rigid: &Galvanometer,
    angle: &[Point],
    period: f64,
    search: &ModeSearch,
) -> Result<Vec<Mode>, IdentificationError> {
    let model = sampled(rigid, period)?;
    let last = PI / period;
    let seen: Vec<(f64, f64, f64)> = angle
        .iter()
        .filter(|p| p.omega >= TAU * search.from && p.omega < last)
        .map(|p| {
            let expected = model.angle_over_current(p.omega).norm();
            (p.omega, p.response.norm() / expected, p.response.norm())
        })
        .collect();
    let ratios = smoothed(&seen.iter().map(|s| s.1).collect::<Vec<f64>>());
    let mut taken: Vec<f64> = Vec::new();
    let mut modes = Vec::new();
    while modes.len() < search.most.min(MOST_MODES) {
        let free = |w: f64| taken.iter().all(|t| (w / t - 1.0).abs() > APART);
        let best = (1..ratios.len().saturating_sub(1))
            .filter(|&k| {
                free(seen[k].0) && ratios[k] >= ratios[k - 1] && ratios[k] >= ratios[k + 1]
            })
            .max_by(|&a, &b| ratios[a].total_cmp(&ratios[b]));
        let Some(k) = best.filter(|&k| ratios[k] > search.prominence) else {
            break;
        };
        let (omega, _, height) = seen[k];
        taken.push(omega);
        // the −3 dB width of the peak is 2ξω
        let half = ratios[k] / std::f64::consts::SQRT_2;
        let below = (0..k).rev().find(|&i| ratios[i] < half);
        let above = (k..ratios.len()).find(|&i| ratios[i] < half);
        let width = match (below, above) {
            (Some(a), Some(b)) => seen[b].0 - seen[a].0,
            _ => 0.1 * omega,
        };
        let damping = (0.5 * width / omega).clamp(1e-3, 0.3);
        modes.push(Mode {
            omega,
            damping,
            // |ω_r/i| at the peak is K/(2ξω), and ω_r is ω times the angle
            gain: omega * height * 2.0 * damping * omega,
        });
    }
    modes.sort_by(|a, b| a.omega.total_cmp(&b.omega));
    Ok(modes)
}

/// Running median.
fn smoothed(values: &[f64]) -> Vec<f64> {
    let reach = MEDIAN / 2;
    (0..values.len())
        .map(|k| {
            let mut near =
                values[k.saturating_sub(reach)..(k + reach + 1).min(values.len())].to_vec();
            near.sort_by(f64::total_cmp);
            near[near.len() / 2]
        })
        .collect()
}
