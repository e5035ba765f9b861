//! All parameters of a motor fitted together to a record in time: output error, from the estimate of the frequency responses.
//!
//! Source: L. Ljung, "System Identification: Theory for the User", 2nd ed., §§ 7.2-7.4, 9.4-9.5 (output error, its concentrated
//! likelihood, covariance where residuals are coloured); the pieces with a free begin are ours. Assumptions: the voltage is known and
//! held between samples, current and angle carry errors that do not come back through it. Validity: viscous and Coulomb friction; under
//! another law the residuals are coloured, which the deviations count in, and the Coulomb torque is the one that fits best.

use std::ops::Range;

use meltpath_numerics::Matrix;
use meltpath_numerics::least_squares::{LeastSquaresError, Regression};
use rayon::prelude::*;

use crate::identification::drive::{Drive, LATEST};
use crate::identification::error::IdentificationError;
use crate::identification::estimate::{Estimate, Parameter, Units};
use crate::identification::record::BenchRecord;

/// Length of a piece of the record, s: some time constants of a motor on its bearings. Before, shorter ones: what is wrong with an
/// estimate adds up over a piece, and a search from afar loses its way.
pub(super) const PIECE: f64 = 0.1;
pub(super) const SHORT_PIECE: f64 = 0.006;
/// Fewest pieces, so that deviations under coloured residuals can be told.
const PIECES: usize = 24;
/// The state in which a piece begins is free within this many times what the record moves over.
const FREE: f64 = 10.0;
/// Steps of the fit at most.
const STEPS: usize = 60;
/// The fit has settled where a step gains less than this in the logarithm of the likelihood: a hundredth of a deviation.
const SETTLED: f64 = 1e-4;
/// Residuals below this share of a channel are rounding.
const ROUNDING: f64 = 1e-9;
/// Longest step of a logarithm, or of a delay in samples.
const LONGEST: f64 = 0.7;

/// A fit that has settled.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    pub(super) estimate: Estimate,
    /// One standard deviation of each free parameter, in the unit of its step.
    pub(super) sigma: Vec<f64>,
    /// Root mean square residuals of current (A) and angle (rad).
    pub(super) rms: [f64; 2],
    pub(super) units: Units,
}

/// A record cut into pieces, and how far their first states may be from where they seem.
struct Pieces<'a, const N: usize> {
    record: &'a BenchRecord<'a>,
    units: Units,
    spans: Vec<Range<usize>>,
    seems: Vec<[f64; N]>,
    spread: [f64; N],
    rounding: [f64; 2],
}

/// Where the search stands.
struct Stand<const N: usize> {
    estimate: Estimate,
    states: Vec<[f64; N]>,
    rms: [f64; 2],
    /// Logarithm of the likelihood, negative, up to a constant.
    cost: f64,
}

/// Fits the free parameters to pieces of `piece` s, beginning at an estimate.
///
/// # Errors
/// [`IdentificationError::Fit`] naming the free parameter that the record leaves undetermined, [`IdentificationError::Axis`].
pub(super) fn settle<const N: usize>(
    record: &BenchRecord<'_>,
    piece: f64,
    start: &Estimate,
    free: &[Parameter],
) -> Result<Settled, IdentificationError> {
    let pieces = Pieces::<N>::new(record, piece, start);
    let mut stand = pieces.stand(start.clone(), pieces.seems.clone())?;
    if !stand.cost.is_finite() {
        return Err(LeastSquaresError::Start.into());
    }
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let triangles = pieces.linearise(&stand, free)?;
        let settled = loop {
            let step = damped(&triangles, N, free.len(), damping)?;
            let longest = step
                .iter()
                .zip(free)
                .filter(|(_, p)| !matches!(p, Parameter::Bias | Parameter::Coulomb))
                .fold(LONGEST, |a, (s, _)| a.max(s.abs()));
            let step: Vec<f64> = step.iter().map(|s| s * LONGEST / longest).collect();
            // where steps fail the first states go less far, too
            let share = 1.0 / (1.0 + damping);
            let next = pieces.step(&stand, (free, &step), share, &triangles)?;
            let gain = stand.cost - next.cost;
            if gain > 0.0 {
                stand = next;
                damping = f64::max(0.1 * damping, 1e-10);
                break gain < SETTLED && damping < 1e-4;
            }
            damping *= 10.0;
            if gain > -SETTLED || damping > 1e8 {
                break true;
            }
        };
        if settled {
            break;
        }
    }
    let triangles = pieces.linearise(&stand, free)?;
    Ok(Settled {
        sigma: deviations(&triangles, N, free.len())?,
        estimate: stand.estimate,
        rms: stand.rms,
        units: pieces.units,
    })
}

impl<'a, const N: usize> Pieces<'a, N> {
    fn new(record: &'a BenchRecord<'a>, piece: f64, start: &Estimate) -> Self {
        let samples = record.voltage.len();
        let count = (samples as f64 * record.period / piece) as usize;
        let length = (samples / count.max(PIECES)).max(3 * LATEST).min(samples);
        let spans: Vec<Range<usize>> = (0..samples / length.max(1))
            .map(|k| k * length..(k + 1) * length)
            .collect();
        let most = |values: &mut dyn Iterator<Item = f64>| {
            values.fold(0.0, |a: f64, v| a.max(v.abs())).max(1e-12)
        };
        // the speed over a few samples, that an encoder's steps do not dominate
        let reach = LATEST.min(length / 2).max(1);
        let speed = |from: usize| {
            let ends = record.angle.get(from).zip(record.angle.get(from + reach));
            ends.map_or(0.0, |(a, b)| (b - a) / (reach as f64 * record.period))
        };
        let first = record.angle.first().copied().unwrap_or(0.0);
        let current = most(&mut record.current.iter().copied());
        let fastest = most(&mut (0..samples.saturating_sub(reach)).map(speed));
        let angle = most(&mut record.angle.iter().map(|a| a - first));
        let mut spread = [FREE * fastest; N];
        spread[0] = FREE * current;
        spread[2] = FREE * angle;
        for (k, mode) in start.motor.modes.iter().enumerate() {
            if let Some(q) = spread.get_mut(3 + 2 * k) {
                *q = FREE * fastest / mode.omega;
            }
        }
        let seems = spans
            .iter()
            .map(|span| {
                let mut state = [0.0; N];
                state[0] = record.current.get(span.start).copied().unwrap_or(0.0);
                state[1] = speed(span.start);
                state[2] = record.angle.get(span.start).copied().unwrap_or(0.0);
                state
            })
            .collect();
        let torque = start.motor.torque_constant * root_mean_square(record.current);
        Pieces {
            record,
            units: Units {
                torque: torque.max(f64::MIN_POSITIVE),
                period: record.period,
            },
            spans,
            seems,
            spread,
            rounding: [ROUNDING * current, ROUNDING * angle],
        }
    }

    fn drive(&self, estimate: &Estimate) -> Result<Drive<N>, IdentificationError> {
        Ok(Drive::new(
            &estimate.driven(),
            estimate.felt,
            estimate.delays,
            self.record.period,
        )?)
    }

    /// The likelihood of an estimate and first states.
    fn stand(
        &self,
        estimate: Estimate,
        states: Vec<[f64; N]>,
    ) -> Result<Stand<N>, IdentificationError> {
        let drive = self.drive(&estimate)?;
        let squares: Vec<[f64; 2]> = self
            .spans
            .par_iter()
            .zip(&states)
            .map(|(span, state)| {
                let predicted = drive.run(state, &self.record.voltage[span.clone()]);
                let measured = [self.record.current, self.record.angle];
                std::array::from_fn(|c| {
                    let measured = &measured[c][span.clone()];
                    let pairs = measured.iter().zip(&predicted[c]).skip(LATEST);
                    pairs.map(|(m, p)| (m - p).powi(2)).sum()
                })
            })
            .collect();
        let count: usize = self
            .spans
            .iter()
            .map(|span| span.len().saturating_sub(LATEST))
            .sum();
        let rms: [f64; 2] = std::array::from_fn(|c| {
            let sum: f64 = squares.iter().map(|s| s[c]).sum();
            (sum / count as f64).sqrt()
        });
        let rms: [f64; 2] = std::array::from_fn(|c| {
            if rms[c].is_nan() {
                f64::INFINITY
            } else {
                rms[c].max(self.rounding[c])
            }
        });
        Ok(Stand {
            cost: count as f64 * (rms[0].ln() + rms[1].ln()),
            estimate,
            states,
            rms,
        })
    }

    /// The triangle of each piece: columns are its first state, the free parameters, and what is left of the record.
    fn linearise(
        &self,
        stand: &Stand<N>,
        free: &[Parameter],
    ) -> Result<Vec<Matrix>, IdentificationError> {
        let drive = self.drive(&stand.estimate)?;
        let steps: Vec<f64> = free
            .iter()
            .map(|p| {
                if matches!(p, Parameter::Delay(_)) {
                    1e-5
                } else {
                    1e-6
                }
            })
            .collect();
        let moved: Vec<Drive<N>> = free
            .iter()
            .zip(&steps)
            .map(|(p, step)| self.drive(&stand.estimate.moved(*p, *step, self.units)))
            .collect::<Result<_, _>>()?;
        let triangles = (0..self.spans.len())
            .into_par_iter()
            .map(|piece| {
                let span = self.spans[piece].clone();
                let voltage = &self.record.voltage[span.clone()];
                let state = &stand.states[piece];
                let now = drive.run(state, voltage);
                let mut slopes: Vec<([Vec<f64>; 2], f64)> = (0..N)
                    .map(|i| {
                        let mut other = *state;
                        let step = 1e-7 * self.spread[i];
                        other[i] += step;
                        (drive.run(&other, voltage), step)
                    })
                    .collect();
                slopes.extend(
                    moved
                        .iter()
                        .zip(&steps)
                        .map(|(drive, step)| (drive.run(state, voltage), *step)),
                );
                let mut system = Regression::new(slopes.len());
                for (c, measured) in [self.record.current, self.record.angle]
                    .into_iter()
                    .enumerate()
                {
                    let weight = 1.0 / stand.rms[c];
                    let measured = &measured[span.clone()];
                    for k in LATEST..measured.len() {
                        let row = slopes
                            .iter()
                            .map(|(other, step)| weight * (other[c][k] - now[c][k]) / step);
                        system.push(row, weight * (measured[k] - now[c][k]));
                    }
                }
                for (i, (seems, state)) in self.seems[piece].iter().zip(state).enumerate() {
                    let level = 1.0 / self.spread[i];
                    let row = (0..slopes.len()).map(|j| if i == j { level } else { 0.0 });
                    system.push(row, level * (seems - state));
                }
                system.triangle()
            })
            .collect();
        Ok(triangles)
    }

    /// Where a share of a step of the parameters leads, the first state of each piece going along.
    fn step(
        &self,
        stand: &Stand<N>,
        (free, step): (&[Parameter], &[f64]),
        share: f64,
        triangles: &[Matrix],
    ) -> Result<Stand<N>, IdentificationError> {
        let mut estimate = stand.estimate.clone();
        for (parameter, step) in free.iter().zip(step) {
            estimate = estimate.moved(*parameter, share * step, self.units);
        }
        let states = stand
            .states
            .iter()
            .zip(triangles)
            .map(|(state, t)| {
                let mut by = [0.0; N];
                for i in (0..N).rev() {
                    let mut right = t[(i, N + free.len())];
                    for (j, step) in step.iter().enumerate() {
                        right -= t[(i, N + j)] * step;
                    }
                    for k in i + 1..N {
                        right -= t[(i, k)] * by[k];
                    }
                    by[i] = right / t[(i, i)];
                }
                std::array::from_fn(|i| state[i] + share * by[i])
            })
            .collect();
        self.stand(estimate, states)
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|v| v * v).sum();
    (sum / values.len().max(1) as f64).sqrt()
}

/// What the triangles say of the free parameters: rows beyond the first states.
fn told(
    triangles: &[Matrix],
    states: usize,
    free: usize,
) -> impl Iterator<Item = (Vec<f64>, f64)> + '_ {
    triangles.iter().flat_map(move |t| {
        (states..t.rows().min(states + free)).map(move |i| {
            let row = (0..free).map(|j| t[(i, states + j)]).collect();
            (row, t[(i, states + free)])
        })
    })
}

/// The step of the free parameters, damped by the lengths of their columns.
fn damped(
    triangles: &[Matrix],
    states: usize,
    free: usize,
    damping: f64,
) -> Result<Vec<f64>, LeastSquaresError> {
    let mut system = Regression::new(free);
    let mut lengths = vec![0.0; free];
    for (row, right) in told(triangles, states, free) {
        for (length, value) in lengths.iter_mut().zip(&row) {
            *length += value * value;
        }
        system.push(row, right);
    }
    for (j, length) in lengths.iter().enumerate() {
        let level = (damping * length).sqrt();
        system.push((0..free).map(|i| if i == j { level } else { 0.0 }), 0.0);
    }
    Ok(system.solve()?.values)
}

/// One standard deviation of each free parameter: the larger of what white residuals leave, and of what the pieces' own scatter
/// leaves (the sandwich of Ljung's eq. 9.54 with pieces as its terms).
fn deviations(
    triangles: &[Matrix],
    states: usize,
    free: usize,
) -> Result<Vec<f64>, LeastSquaresError> {
    let mut system = Regression::new(free);
    for (row, right) in told(triangles, states, free) {
        system.push(row, right);
    }
    let spread = system.solve()?.spread;
    let mut scatter = vec![0.0; free];
    for t in triangles {
        let mut slope = vec![0.0; free];
        for (row, right) in told(std::slice::from_ref(t), states, free) {
            for (slope, value) in slope.iter_mut().zip(row) {
                *slope += value * right;
            }
        }
        for (i, scatter) in scatter.iter_mut().enumerate() {
            let by: f64 = slope
                .iter()
                .enumerate()
                .map(|(j, s)| spread[(i, j)] * s)
                .sum();
            *scatter += by * by;
        }
    }
    let pieces = triangles.len() as f64;
    Ok(scatter
        .iter()
        .enumerate()
        .map(|(i, scatter)| {
            let scatter = scatter * pieces / (pieces - 1.0).max(1.0);
            spread[(i, i)].max(scatter).sqrt()
        })
        .collect())
}
