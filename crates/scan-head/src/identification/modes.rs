//! Flexible modes from a bench record: peaks that the rigid motor does not explain, then all parameters fitted together.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.4 (modes adjusted by eye on the experimental response); the automatic fit and its deviations are
//! ours. Above a sixth of the sampling frequency sampled responses differ from continuous ones: the model is sampled with the
//! voltage held, as the record is.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::frequency::Point;
use meltpath_control::welch::{Welch, estimate};
use meltpath_control::{Complex64, Domain, ZeroPoleGain};
use meltpath_numerics::least_squares::{self, Fit, LeastSquaresError};
use rayon::prelude::*;

use crate::axis::galvanometer::{Galvanometer, MOST_MODES, Mode};
use crate::identification::error::IdentificationError;
use crate::identification::motor::{Identified, RIGID, identify, logs, motor, viscous_near};
use crate::identification::record::{BenchRecord, Excitation, Method};
use crate::identification::refusal::{Refusal, RefusedPeak};
use crate::identification::responses::responses;

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

/// Peaks nearer than this, relative, are one.
pub(super) const APART: f64 = 0.15;
/// Below this share of the angle that answers the current a peak is noise.
const COHERENT: f64 = 0.5;
/// Relative deviation of pulsation, damping or gain beyond which a mode is not known.
pub(super) const KNOWN: f64 = 0.5;
/// Peaks that are tried, over the modes that are looked for.
const CANDIDATES: usize = 2;
/// Refused peaks that are told: noise has many.
const MOST_REFUSED: usize = 8;
/// Windows that coherence is estimated from at least, where the record has the samples: from few of them noise seems to answer, too.
const HEARD: usize = 8;
/// Shortest of these windows, samples.
const SHORTEST: usize = 64;
/// Points of a response that a thread takes together at least.
const TOGETHER: usize = 256;
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
    let mut seen = Seen::of(record, excitation, method, search)?;
    let (found, mut refused) = peaks(
        &rigid.motor,
        &seen.angle,
        &seen.heard,
        record.period,
        search,
    )?;
    seen.leave_unheard(method);
    // one joins after the other, the highest first: one that is none does not take another with it
    let mut best: Option<Flexible> = None;
    for peak in found {
        let modes = best.as_ref().map_or(0, |b| b.peaks.len());
        if modes == search.most.min(MOST_MODES) {
            break;
        }
        best = seen.with(best, peak, &rigid.motor, &mut refused)?;
    }
    let Some(best) = best else {
        return Ok(Identified { refused, ..rigid });
    };
    let Seen { angle, current, .. } = seen;
    let weight: f64 = angle.iter().chain(&current).map(|p| p.weight).sum();
    let points = (angle.len() + current.len()) as f64;
    let mut fitted = motor(&best.fit.values);
    let mut modes: Vec<(Mode, [f64; 3])> = fitted.modes.into_iter().zip(best.sigma()).collect();
    modes.sort_by(|a, b| a.0.omega.total_cmp(&b.0.omega));
    let (modes, mode_sigma) = modes.into_iter().unzip();
    fitted.modes = modes;
    Ok(Identified {
        motor: fitted,
        sigma: std::array::from_fn(|i| sigma(&best.fit, i)),
        mode_sigma,
        refused,
        rms: best.fit.rms * (points / weight).sqrt(),
        angle_over_current: angle,
        current_over_voltage: current,
    })
}

/// The motor that a part of a record tells, with the modes that were found in the whole.
///
/// # Errors
/// [`IdentificationError`].
pub(crate) fn again(
    found: &Identified,
    part: &BenchRecord<'_>,
    excitation: Excitation<'_>,
    method: &Method,
    search: &ModeSearch,
) -> Result<Galvanometer, IdentificationError> {
    let whole = &found.motor;
    if whole.modes.is_empty() {
        return Ok(identify(part, excitation, method)?.motor);
    }
    let mut seen = Seen::of(part, excitation, method, search)?;
    seen.leave_unheard(method);
    let per_inertia = whole.torque_constant / whole.inertia;
    let mut start = logs(whole);
    for mode in &whole.modes {
        start.extend([mode.omega, mode.damping, mode.gain / per_inertia].map(f64::ln));
    }
    let fit = fit(&start, &seen.angle, &seen.current, part.period)?;
    Ok(motor(&fit.values))
}

fn sigma(fit: &Fit, i: usize) -> f64 {
    fit.sigma.get(i).copied().unwrap_or(f64::NAN)
}

/// Responses that motors with modes are fitted to.
struct Seen {
    angle: Vec<Point>,
    current: Vec<Point>,
    /// Share of the angle that answers, by pulsation.
    heard: Vec<(f64, f64)>,
    period: f64,
    /// Width of a line in them, Hz.
    resolved: f64,
}

/// A motor with modes, fitted to responses.
struct Flexible {
    /// In the order of the fit's values.
    peaks: Vec<Peak>,
    fit: Fit,
}

impl Flexible {
    /// Deviations of pulsation, damping and gain of each mode.
    fn sigma(&self) -> Vec<[f64; 3]> {
        (0..self.peaks.len())
            .map(|m| std::array::from_fn(|i| sigma(&self.fit, RIGID + 3 * m + i)))
            .collect()
    }
}

impl Seen {
    fn of(
        record: &BenchRecord<'_>,
        excitation: Excitation<'_>,
        method: &Method,
        search: &ModeSearch,
    ) -> Result<Self, IdentificationError> {
        let wide = Method {
            band: [method.band[0], search.share / record.period],
            ..*method
        };
        let (angle, current) = responses(record, excitation, &wide)?;
        Ok(Seen {
            angle,
            current,
            heard: coherence(record, excitation, &wide)?,
            period: record.period,
            // the main lobe of a Hann window
            resolved: 4.0 / (method.welch.length as f64 * record.period),
        })
    }

    /// Where the angle does not answer the current it says nothing of the motor.
    fn leave_unheard(&mut self, method: &Method) {
        let heard = &self.heard;
        self.angle
            .retain(|p| p.omega <= TAU * method.band[1] || heard_at(heard, p.omega) >= COHERENT);
    }

    /// The motor with one peak more for a mode, fitted from where the fit before it ended; without it where that does not know it.
    /// Where the new one leaves an older one unknown, that one goes.
    fn with(
        &self,
        before: Option<Flexible>,
        peak: Peak,
        rigid: &Galvanometer,
        refused: &mut Vec<RefusedPeak>,
    ) -> Result<Option<Flexible>, IdentificationError> {
        let per_inertia = rigid.torque_constant / rigid.inertia;
        let (mut peaks, mut start) = before.as_ref().map_or_else(
            || (Vec::new(), logs(rigid)),
            |b| (b.peaks.clone(), b.fit.values.clone()),
        );
        let Mode {
            omega,
            damping,
            gain,
        } = peak.mode;
        start.extend([omega, damping, gain / per_inertia].map(f64::ln));
        peaks.push(peak);
        loop {
            let fit = match fit(&start, &self.angle, &self.current, self.period) {
                Err(IdentificationError::Fit(LeastSquaresError::Undetermined { .. })) => {
                    // the modes before it were determined without it
                    refused.push(peak.refused(Refusal::Undetermined));
                    return Ok(before);
                }
                fit => fit?,
            };
            let found = Flexible { peaks, fit };
            let modes = motor(&found.fit.values).modes;
            let strayed = strayed(&modes, &found.peaks);
            let unknown = || least_known(&modes, &found.sigma(), self.resolved);
            let Some((k, why)) = strayed.or_else(unknown) else {
                return Ok(Some(found));
            };
            refused.push(found.peaks[k].refused(why));
            if k + 1 == found.peaks.len() {
                return Ok(before);
            }
            peaks = found.peaks;
            peaks.remove(k);
            start = found.fit.values;
            start.drain(RIGID + 3 * k..RIGID + 3 * (k + 1));
        }
    }
}

/// The fitted mode that has left its peak farthest, if one has.
fn strayed(modes: &[Mode], peaks: &[Peak]) -> Option<(usize, Refusal)> {
    let gone = |k: usize| (modes[k].omega / peaks[k].mode.omega).ln().abs();
    (0..modes.len().min(peaks.len()))
        .filter(|k| gone(*k) > APART)
        .max_by(|a, b| gone(*a).total_cmp(&gone(*b)))
        .map(|k| {
            let to = modes[k].omega / TAU;
            (k, Refusal::Strayed { to })
        })
}

/// The fitted mode that is no mode, if there is one, and why.
fn least_known(modes: &[Mode], sigma: &[[f64; 3]], resolved: f64) -> Option<(usize, Refusal)> {
    let doubt = |s: &[f64; 3]| {
        s.iter().fold(0.0, |most: f64, one| {
            if one.is_nan() {
                f64::INFINITY
            } else {
                most.max(*one)
            }
        })
    };
    let unsure = (0..modes.len())
        .map(|k| (k, doubt(&sigma[k])))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, sigma)| *sigma > KNOWN)
        .map(|(k, sigma)| (k, Refusal::Unsure { sigma }));
    let width = |m: &Mode| 2.0 * m.damping * m.omega / TAU;
    unsure.or_else(|| {
        let k = modes.iter().position(|m| width(m) < resolved)?;
        let width = width(&modes[k]);
        Some((k, Refusal::Thin { width, resolved }))
    })
}

/// All parameters fitted together.
fn fit(
    start: &[f64],
    angle: &[Point],
    current: &[Point],
    period: f64,
) -> Result<Fit, IdentificationError> {
    let near = viscous_near(start, angle, current);
    let domain = Domain::Sampled { period };
    let told = |points: &[Point]| -> Vec<(Complex64, Complex64, f64)> {
        let told = |p: &Point| (domain.point(p.omega), p.response, p.weight.sqrt());
        points.iter().map(told).collect()
    };
    let (angle, current) = (told(angle), told(current));
    let residuals = |x: &[f64]| -> Vec<f64> {
        let count = 2 * (angle.len() + current.len()) + 1;
        sampled(&motor(x), period).map_or_else(
            |_| vec![f64::INFINITY; count],
            |model| {
                let one = angle.par_iter().with_min_len(TOGETHER);
                let one = one.map(|(z, seen, weight)| {
                    (model.angle.at(*z) / model.current.at(*z) / seen).ln() * weight
                });
                let two = current.par_iter().with_min_len(TOGETHER);
                let two = two.map(|(z, seen, weight)| (model.current.at(*z) / seen).ln() * weight);
                one.chain(two)
                    .flat_map_iter(|left| [left.re, left.im])
                    .chain([near(x)])
                    .collect()
            },
        )
    };
    Ok(least_squares::fit(residuals, start)?)
}

/// The share of the angle that answers what was excited, by pulsation (rad/s). Of the angle's steps from sample to sample, lest its
/// slow part leaks over all frequencies.
fn coherence(
    record: &BenchRecord<'_>,
    excitation: Excitation<'_>,
    method: &Method,
) -> Result<Vec<(f64, f64)>, IdentificationError> {
    let input = match excitation {
        Excitation::Voltage => record.current,
        Excitation::SetPoint(set_point) => set_point,
    };
    let steps: Vec<f64> = record.angle.windows(2).map(|a| a[1] - a[0]).collect();
    let input = input.get(1..).unwrap_or_default();
    let longest = method.welch.length.max(SHORTEST);
    let length = (steps.len() / HEARD).clamp(SHORTEST, longest);
    let welch = Welch::hann(length.min(steps.len()));
    let found = estimate(input, &steps, record.period, &welch)?;
    Ok(found.omega.into_iter().zip(found.coherence).collect())
}

/// Responses of a motor sampled with its voltage held.
struct Sampled {
    current: ZeroPoleGain,
    angle: ZeroPoleGain,
}

fn sampled(motor: &Galvanometer, period: f64) -> Result<Sampled, IdentificationError> {
    let failed = |e| IdentificationError::Axis(crate::axis::error::AxisError::System(e));
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
}

/// A peak taken for a mode.
#[derive(Clone, Copy)]
struct Peak {
    mode: Mode,
    /// How far it stands out of the rigid motor's response.
    ratio: f64,
    /// Phase against the rigid motor's response, rad: half a right angle and more ahead in a mode of positive gain, behind in one of negative.
    phase: f64,
}

impl Peak {
    fn refused(&self, why: Refusal) -> RefusedPeak {
        let runs_away = matches!(
            why,
            Refusal::Strayed { .. } | Refusal::Unsure { .. } | Refusal::Undetermined
        );
        // gains are fitted by their logarithm: one that is negative is none that the fit can find
        let why = match why {
            _ if runs_away && self.phase < -FRAC_PI_4 => Refusal::Opposed,
            why => why,
        };
        RefusedPeak {
            frequency: self.mode.omega / TAU,
            ratio: self.ratio,
            why,
        }
    }
}

/// Modes read off the peaks of the measured angle over current against the rigid motor's, the highest first, and the
/// peaks that are none.
fn peaks(
    rigid: &Galvanometer,
    angle: &[Point],
    heard: &[(f64, f64)],
    period: f64,
    search: &ModeSearch,
) -> Result<(Vec<Peak>, Vec<RefusedPeak>), IdentificationError> {
    let model = sampled(rigid, period)?;
    let last = PI / period;
    let seen: Vec<(f64, Complex64, f64)> = angle
        .iter()
        .filter(|p| p.omega >= TAU * search.from && p.omega < last)
        .map(|p| {
            let over = p.response / model.angle_over_current(p.omega);
            (p.omega, over, p.response.norm())
        })
        .collect();
    let ratios = smoothed(&seen.iter().map(|s| s.1.norm()).collect::<Vec<f64>>());
    let mut taken: Vec<f64> = Vec::new();
    let (mut modes, mut refused): (Vec<Peak>, Vec<RefusedPeak>) = (Vec::new(), Vec::new());
    let mut refuse = |peak: RefusedPeak| {
        if refused.len() < MOST_REFUSED {
            refused.push(peak);
        }
    };
    while modes.len() < CANDIDATES * search.most {
        let free = |w: f64| taken.iter().all(|t| (w / t - 1.0).abs() > APART);
        let best = (1..ratios.len().saturating_sub(1))
            .filter(|&k| {
                free(seen[k].0) && ratios[k] >= ratios[k - 1] && ratios[k] >= ratios[k + 1]
            })
            .max_by(|&a, &b| ratios[a].total_cmp(&ratios[b]));
        let Some(k) = best.filter(|&k| ratios[k] > search.prominence) else {
            break;
        };
        let (omega, over, height) = seen[k];
        taken.push(omega);
        // the −3 dB width of the peak is 2ξω
        let half = ratios[k] / std::f64::consts::SQRT_2;
        let below = (0..k).rev().find(|&i| ratios[i] < half);
        let above = (k..ratios.len()).find(|&i| ratios[i] < half);
        let Some(above) = above else {
            refuse(RefusedPeak {
                frequency: omega / TAU,
                ratio: ratios[k],
                why: Refusal::Edge {
                    end: search.share / period,
                },
            });
            continue;
        };
        let coherence = heard_at(heard, omega);
        if coherence < COHERENT {
            refuse(RefusedPeak {
                frequency: omega / TAU,
                ratio: ratios[k],
                why: Refusal::Noise { coherence },
            });
            continue;
        }
        let width = below.map_or(0.1 * omega, |below| seen[above].0 - seen[below].0);
        let damping = (0.5 * width / omega).clamp(1e-3, 0.3);
        modes.push(Peak {
            mode: Mode {
                omega,
                damping,
                // |ω_r/i| at the peak is K/(2ξω), and ω_r is ω times the angle
                gain: omega * height * 2.0 * damping * omega,
            },
            ratio: ratios[k],
            phase: over.arg(),
        });
    }
    Ok((modes, refused))
}

/// The median coherence of the frequencies round one.
fn heard_at(heard: &[(f64, f64)], omega: f64) -> f64 {
    let place = heard.partition_point(|h| h.0 < omega);
    let reach = MEDIAN / 2;
    let mut near: Vec<f64> = heard
        [place.saturating_sub(reach)..(place + reach + 1).min(heard.len())]
        .iter()
        .map(|h| h.1)
        .collect();
    near.sort_by(f64::total_cmp);
    near.get(near.len() / 2).copied().unwrap_or(0.0)
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
