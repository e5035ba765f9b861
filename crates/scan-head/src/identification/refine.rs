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

use crate::identification::abreast::{Responses, run};
use crate::identification::drive::{Drive, LATEST};
use crate::identification::error::IdentificationError;
use crate::identification::estimate::{Estimate, Parameter, Units};
use crate::identification::record::BenchRecord;
use crate::identification::triangles::{damped, deviations, led, stepped};

/// How a record is cut, and how far a fit to its pieces goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// Length of a piece, s.
    pub(super) piece: f64,
    /// The fit has settled where a step changes the logarithm of the likelihood by less than this.
    settled: f64,
}

/// Some time constants of a motor on its bearings, to a seventh of a deviation.
pub(super) const FINE: Cut = Cut {
    piece: 0.1,
    settled: 1e-2,
};
/// The same, as far as tells which of two fits is the better.
pub(super) const ROUGH: Cut = Cut {
    settled: 10.0,
    ..FINE
};
/// Before, shorter ones: what is wrong with an estimate adds up over a piece, and a search from afar loses its way.
pub(super) const COARSE: Cut = Cut {
    piece: 0.006,
    settled: 10.0,
};
/// Fewest pieces, so that deviations under coloured residuals can be told.
const PIECES: usize = 24;
/// The state in which a piece begins is free within this many times what the record moves over.
const FREE: f64 = 10.0;
/// Steps of the fit that are tried at most.
const TRIES: usize = 60;
/// The first state of a piece has settled where a step gains less than this of its squared residuals, in deviations.
const SETTLED: f64 = 1e-4;
/// Steps of the first state of a piece before the parameters.
pub(super) const BEGINS: usize = 60;
/// Steps of the first state of a piece after each of the parameters.
const EASED: usize = 3;
/// Shares of its step that the first state of a piece may go.
const GOES: [f64; 4] = [1.0, 0.3, 0.1, 0.0];
/// Steps over which slopes are taken anew where friction's turns made the ground rough: a slope over a short step that a jump crosses
/// says too much, and what it tells of a parameter counts only if longer steps to either side tell it, too.
const REACHES: [f64; 3] = [-1.0, 30.0, -30.0];
/// Residuals below this share of a channel are rounding.
const ROUNDING: f64 = 1e-9;
/// Damping up to which a step counts as a whole one.
const WHOLE: f64 = 1e-2;
/// The fit ends where as many damped steps in succession gain less than this: the parameters are within their deviations.
const POOR: usize = 8;
const ROUGHNESS: f64 = 0.3;
/// Longest step of a logarithm, or of a delay in samples.
const LONGEST: f64 = 0.7;

/// A fit that has settled.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    pub(super) estimate: Estimate,
    /// One standard deviation of each free parameter, in the unit of its step.
    pub(super) sigma: Vec<f64>,
    /// The state in which each piece begins.
    pub(super) begins: Vec<Vec<f64>>,
    /// Root mean square residuals of current (A) and angle (rad).
    pub(super) rms: [f64; 2],
    /// What is left of current and angle, piece by piece, and what of it is rounding.
    pub(super) left: [Vec<Vec<f64>>; 2],
    pub(super) rounding: [f64; 2],
    /// Logarithm of the likelihood, negative, up to a constant of the record and its cut.
    pub(super) cost: f64,
    pub(super) units: Units,
    /// Whether the last step was a whole one that led nowhere; else the search ended among friction's turns, or out of tries.
    pub(super) smooth: bool,
}

/// A record cut into pieces, and how far their first states may be from where they seem.
pub(super) struct Pieces<'a, const N: usize> {
    record: &'a BenchRecord<'a>,
    pub(super) units: Units,
    pub(super) spans: Vec<Range<usize>>,
    pub(super) seems: Vec<[f64; N]>,
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

/// Fits the free parameters to the pieces of a cut, beginning at an estimate, its pieces where an earlier fit to this cut left them, or
/// where they seem to begin.
///
/// # Errors
/// [`IdentificationError::Fit`] naming the free parameter that the record leaves undetermined, [`IdentificationError::Axis`].
pub(super) fn settle<const N: usize>(
    record: &BenchRecord<'_>,
    cut: Cut,
    (start, begins): (&Estimate, &[Vec<f64>]),
    free: &[Parameter],
) -> Result<Settled, IdentificationError> {
    let pieces = Pieces::<N>::new(record, cut.piece, start);
    let begins = begins.iter().map(|b| b.as_slice().try_into().ok());
    let begins = begins.collect::<Option<Vec<[f64; N]>>>();
    let begins = begins.filter(|b| b.len() == pieces.spans.len());
    let mut stand = pieces.stand(start.clone(), begins.unwrap_or(pieces.seems.clone()))?;
    if !stand.cost.is_finite() {
        return Err(LeastSquaresError::Start.into());
    }
    // first where the pieces begin, lest the parameters make up for it
    stand = pieces.eased(stand, BEGINS)?;
    let mut triangles = pieces.linearise(&stand, free, 1.0)?;
    let (mut damping, mut poor, mut smooth) = (1e-3, 0, false);
    for _ in 0..TRIES {
        let step = damped(&triangles, N, free.len(), damping)?;
        let longest = step
            .iter()
            .zip(free)
            .filter(|(_, p)| !matches!(p, Parameter::Bias | Parameter::Coulomb | Parameter::Zero))
            .fold(LONGEST, |a, (s, _)| a.max(s.abs()));
        let step: Vec<f64> = step.iter().map(|s| s * LONGEST / longest).collect();
        // where steps fail the first states go less far, too
        let share = 1.0 / (1.0 + damping);
        let next = pieces.step(&stand, (free, &step), share, &triangles)?;
        let next = pieces.eased(next, EASED)?;
        let gain = stand.cost - next.cost;
        if gain > 0.0 {
            stand = next;
            triangles = pieces.linearise(&stand, free, 1.0)?;
            damping = f64::max(0.1 * damping, 1e-10);
        } else {
            damping *= 10.0;
        }
        // a short step says nothing of where a whole one would lead; where many gain little friction's turns have made the ground rough
        if damping < WHOLE {
            poor = 0;
            if gain.abs() < cut.settled {
                smooth = true;
                break;
            }
        } else if gain < ROUGHNESS {
            poor += 1;
            if poor == POOR {
                break;
            }
        }
    }
    let mut sigma = deviations(&triangles, N, free.len())?;
    if !smooth {
        for reach in REACHES {
            let triangles = pieces.linearise(&stand, free, reach)?;
            let other = deviations(&triangles, N, free.len())?;
            for (sigma, other) in sigma.iter_mut().zip(other) {
                *sigma = sigma.max(other);
            }
        }
    }
    Ok(Settled {
        sigma,
        left: pieces.left(&stand)?,
        rounding: pieces.rounding,
        estimate: stand.estimate,
        begins: stand.states.iter().map(|s| s.to_vec()).collect(),
        rms: stand.rms,
        cost: stand.cost,
        units: pieces.units,
        smooth,
    })
}

impl<'a, const N: usize> Pieces<'a, N> {
    pub(super) fn new(record: &'a BenchRecord<'a>, piece: f64, start: &Estimate) -> Self {
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
        let flows = root_mean_square(record.current).max(f64::MIN_POSITIVE);
        Pieces {
            record,
            units: Units {
                torque: (start.motor.torque_constant * flows).max(f64::MIN_POSITIVE),
                current: flows,
                period: record.period,
            },
            spans,
            seems,
            spread,
            rounding: [ROUNDING * current, ROUNDING * angle],
        }
    }

    pub(super) fn drive(&self, estimate: &Estimate) -> Result<Drive<N>, IdentificationError> {
        Ok(
            Drive::new(&estimate.driven(), estimate.delays, self.record.period)?
                .read_from(estimate.zero),
        )
    }

    /// The likelihood of an estimate and first states.
    fn stand(
        &self,
        estimate: Estimate,
        states: Vec<[f64; N]>,
    ) -> Result<Stand<N>, IdentificationError> {
        let drive = self.drive(&estimate)?;
        let squares: Vec<[f64; 2]> = states
            .par_iter()
            .enumerate()
            .map(|(piece, state)| self.squares(piece, &drive, state))
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

    /// What is left of current and angle in a piece.
    fn residuals(&self, piece: usize, drive: &Drive<N>, state: &[f64; N]) -> [Vec<f64>; 2] {
        let span = self.spans[piece].clone();
        let predicted = run(drive, state, &self.record.voltage[span.clone()]);
        let measured = [self.record.current, self.record.angle];
        std::array::from_fn(|c| {
            let measured = &measured[c][span.clone()];
            let pairs = measured.iter().zip(&predicted[c]).skip(LATEST);
            pairs.map(|(m, p)| m - p).collect()
        })
    }

    /// Sums of squared residuals of a piece, of current and angle.
    pub(super) fn squares(&self, piece: usize, drive: &Drive<N>, state: &[f64; N]) -> [f64; 2] {
        self.residuals(piece, drive, state)
            .map(|left| left.iter().map(|l| l * l).sum())
    }

    /// What is left of current and angle in all pieces.
    fn left(&self, stand: &Stand<N>) -> Result<[Vec<Vec<f64>>; 2], IdentificationError> {
        let drive = self.drive(&stand.estimate)?;
        let pieces = stand.states.iter().enumerate();
        let left = pieces.map(|(piece, state)| self.residuals(piece, &drive, state).into());
        let (current, angle) = left.unzip();
        Ok([current, angle])
    }

    /// Squared residuals of a piece, each over its channel's deviation.
    pub(super) fn cost(
        &self,
        piece: usize,
        drive: &Drive<N>,
        state: &[f64; N],
        rms: [f64; 2],
    ) -> f64 {
        let [current, angle] = self.squares(piece, drive, state);
        current / (rms[0] * rms[0]) + angle / (rms[1] * rms[1])
    }

    /// The triangle of each piece: columns are its first state, the free parameters, and what is left of the record. Slopes are taken
    /// over `reach` times the usual steps of the parameters.
    fn linearise(
        &self,
        stand: &Stand<N>,
        free: &[Parameter],
        reach: f64,
    ) -> Result<Vec<Matrix>, IdentificationError> {
        let drive = self.drive(&stand.estimate)?;
        let steps: Vec<f64> = free
            .iter()
            .map(|p| {
                if matches!(p, Parameter::Delay(_)) {
                    1e-5 * reach
                } else {
                    1e-6 * reach
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
                let moved = moved.iter().zip(steps.iter().copied());
                self.triangle(piece, (&drive, moved), &stand.states[piece], stand.rms)
            })
            .collect();
        Ok(triangles)
    }

    /// The triangle of a piece that begins in a state.
    fn triangle<'d>(
        &self,
        piece: usize,
        (drive, moved): (&Drive<N>, impl Iterator<Item = (&'d Drive<N>, f64)>),
        state: &[f64; N],
        rms: [f64; 2],
    ) -> Matrix {
        let span = self.spans[piece].clone();
        let voltage = &self.record.voltage[span.clone()];
        let mut runs = vec![(drive, *state)];
        let mut steps = self.spread.map(|spread| 1e-7 * spread).to_vec();
        for (i, step) in steps.iter().enumerate() {
            let mut other = *state;
            other[i] += step;
            runs.push((drive, other));
        }
        for (drive, step) in moved {
            runs.push((drive, *state));
            steps.push(step);
        }
        let read = Responses::of(&runs, voltage);
        let mut system = Regression::new(steps.len());
        for (c, measured) in [self.record.current, self.record.angle]
            .into_iter()
            .enumerate()
        {
            let weight = 1.0 / rms[c];
            let measured = &measured[span.clone()];
            for (k, measured) in measured.iter().enumerate().skip(LATEST) {
                let now = read.at(0, c, k);
                let slopes = (1..).zip(&steps);
                let row = slopes.map(|(run, step)| weight * (read.at(run, c, k) - now) / step);
                system.push(row, weight * (measured - now));
            }
        }
        for (i, (seems, state)) in self.seems[piece].iter().zip(state).enumerate() {
            let level = 1.0 / self.spread[i];
            let row = (0..steps.len()).map(|j| if i == j { level } else { 0.0 });
            system.push(row, level * (seems - state));
        }
        system.triangle()
    }

    /// The same estimate, each piece beginning where it fits best: as many steps as told, as far as they lead down.
    fn eased(&self, stand: Stand<N>, steps: usize) -> Result<Stand<N>, IdentificationError> {
        let drive = self.drive(&stand.estimate)?;
        let states = stand
            .states
            .par_iter()
            .enumerate()
            .map(|(piece, state)| self.begun(piece, &drive, *state, stand.rms, steps))
            .collect();
        self.stand(stand.estimate, states)
    }

    /// The first state of a piece, stepped towards the least residual.
    pub(super) fn begun(
        &self,
        piece: usize,
        drive: &Drive<N>,
        mut state: [f64; N],
        rms: [f64; 2],
        steps: usize,
    ) -> [f64; N] {
        let cost = |state: &[f64; N]| self.cost(piece, drive, state, rms);
        let mut now = cost(&state);
        let mut damping = 1e-6;
        for _ in 0..steps {
            let none: [(&Drive<N>, f64); 0] = [];
            let triangle = self.triangle(piece, (drive, none.into_iter()), &state, rms);
            // what a whole step can gain is known before it
            let promised: f64 = (0..N.min(triangle.rows()))
                .map(|i| triangle[(i, N)].powi(2))
                .sum();
            if promised < SETTLED {
                break;
            }
            let better = loop {
                let Ok(by) = stepped::<N>(&triangle, damping) else {
                    return state;
                };
                let next: [f64; N] = std::array::from_fn(|i| state[i] + by[i]);
                let then = cost(&next);
                if then < now {
                    damping = f64::max(0.1 * damping, 1e-12);
                    break Some((next, then));
                }
                damping *= 10.0;
                if damping > 1e4 {
                    break None;
                }
            };
            let Some((next, then)) = better else {
                break;
            };
            let gain = now - then;
            (state, now) = (next, then);
            if gain < SETTLED {
                break;
            }
        }
        state
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
        let drive = self.drive(&estimate)?;
        let states = (stand.states.par_iter().zip(triangles).enumerate())
            .map(|(piece, (state, triangle))| {
                let by = led::<N>(triangle, step);
                // friction lets a piece leave its ground at a bound: then it goes less far, or stays
                let ends =
                    GOES.map(|goes| std::array::from_fn(|i| state[i] + goes * share * by[i]));
                let costs = ends.map(|end| self.cost(piece, &drive, &end, stand.rms));
                let best = (0..ends.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]));
                best.map_or(*state, |best| ends[best])
            })
            .collect();
        self.stand(estimate, states)
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|v| v * v).sum();
    (sum / values.len().max(1) as f64).sqrt()
}
