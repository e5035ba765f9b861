//! Corrects what is not known well (efficiency, beam diameter) from what was built and measured.
//!
//! Least squares with prior knowledge. Each evaluation is a simulation, so that few are made; sizes on voxels go by steps, in which a search along
//! slopes is caught. So the whole of what was believed before is looked at first: a smooth course of each prediction is laid through places
//! spread over it, and the cost on that course is known everywhere (`belief`). Then more places, where the course believes the
//! parameters, refine it there. Values are those of the least cost; uncertainties are integrals over all that may be, so that a bent valley,
//! a bound that cuts it off, measurements, priors and the model's own steps are all in them.

use meltpath_numerics::least_squares::LeastSquaresError;

use super::belief::Belief;
use super::course::Course;
use super::places::{LOOKED, Looked, Sequence, around, spread};
pub use super::places::{Model, Prior};

/// A measurement with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
}

/// What a fit found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Parameters: those that explain measurements and priors best.
    pub values: Vec<f64>,
    /// Their standard uncertainties.
    pub sigmas: Vec<f64>,
    /// The same of the priors alone, within their bounds.
    pub believed: Vec<f64>,
    /// What the model says for each measurement with the priors' values.
    pub before: Vec<f64>,
    /// What its smooth course says with `values`.
    pub predicted: Vec<f64>,
    /// Covariance of the parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Roughness of the model for each measurement: its steps about a smooth course, a standard deviation.
    pub roughness: Vec<f64>,
    /// Sum of squares of what is left of the measurements, over their uncertainties and the model's roughness; without the prior.
    pub misfit: f64,
    /// How each prediction goes with each parameter at `values`.
    pub slopes: Vec<Vec<f64>>,
    /// What each comparison is weighed by: the measurement's uncertainty with the model's roughness.
    pub weighed: Vec<f64>,
    /// Simulations made.
    pub evaluations: usize,
}

/// Uncertainties that remain, as a share of those of the prior, from which measurements taught nothing.
const TAUGHT: f64 = 0.98;

impl Fitted {
    /// Standard uncertainty of another prediction whose slopes on the parameters are `slopes`.
    pub fn sigma_of(&self, slopes: &[f64]) -> f64 {
        let mut variance = 0.0;
        for (row, a) in self.covariance.iter().zip(slopes) {
            for (c, b) in row.iter().zip(slopes) {
                variance += a * c * b;
            }
        }
        variance.max(0.0).sqrt()
    }

    /// How far the parameters would move if every prediction were larger by what `off` tells of it, by the slopes at `values`.
    pub fn moved(&self, off: &[f64]) -> Vec<f64> {
        let pulls = (0..self.values.len()).map(|n| {
            let all = off.iter().zip(&self.weighed).zip(&self.slopes);
            all.map(|((off, sigma), slopes)| -off * slopes[n] / (sigma * sigma))
                .sum::<f64>()
        });
        let pulls: Vec<f64> = pulls.collect();
        let row = |row: &Vec<f64>| row.iter().zip(&pulls).map(|(c, p)| c * p).sum();
        self.covariance.iter().map(row).collect()
    }

    /// Adds an error of the parameters that is not known to their uncertainties.
    pub fn widen(&mut self, by: &[f64]) {
        for (i, row) in self.covariance.iter_mut().enumerate() {
            for (j, c) in row.iter_mut().enumerate() {
                *c += by[i] * by[j];
            }
            self.sigmas[i] = row[i].max(0.0).sqrt();
        }
    }

    /// Whether the fit says no more than its priors.
    pub fn is_blind(&self) -> bool {
        let mut both = self.sigmas.iter().zip(&self.believed);
        both.all(|(sigma, before)| *sigma >= TAUGHT * before)
    }
}

/// Why nothing could be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError<E: std::error::Error> {
    /// The model.
    #[error(transparent)]
    Model(#[from] E),
    /// Uncertainties that are not above zero, or no data.
    #[error("a fit needs measurements and priors with uncertainties above zero")]
    Weights,
    /// The model's predictions are not finite.
    #[error(transparent)]
    LeastSquares(LeastSquaresError),
}

/// How far a parameter may be from its prior, in uncertainties of it.
const FARTHEST: f64 = 4.0;
/// Places that refine the course, of each parameter in each round.
const REFINED: usize = 2;
/// Rounds at least: after them the fit ends where the mean moves no farther than [`STILL`].
const LEAST_ROUNDS: u32 = 2;
/// Share of the uncertainty.
const STILL: f64 = 0.3;
/// Cost above the least up to which places refine the course.
const NEAR: f64 = 6.0;
/// How far places count wholly, in uncertainties; at least this share of the prior's.
const COUNTING: f64 = 2.0;
/// See [`COUNTING`].
const LEAST_REACH: f64 = 0.3;

/// How often a fit asks its model, at least and at most: for so many parameters, `rounds` of refinement at most. It asks more often where the
/// model does not always answer.
///
/// ```
/// assert_eq!(meltpath_thermal::calibration::fit::evaluations(2, 4), [25, 33]);
/// ```
pub fn evaluations(parameters: usize, rounds: u32) -> [usize; 2] {
    let all = |rounds: u32| 1 + spread(parameters) + rounds as usize * REFINED * parameters;
    [all(rounds.min(LEAST_ROUNDS)), all(rounds)]
}

/// Finds the parameters that explain `measured` and stay near their priors; `model` gives a prediction for each
/// measurement. `rounds` of refinement at most.
///
/// # Errors
/// [`FitError`].
pub fn fit<E: std::error::Error>(
    priors: &[Prior],
    measured: &[Measured],
    rounds: u32,
    model: &mut Model<'_, E>,
) -> Result<Fitted, FitError<E>> {
    let positive = |s: f64| s > 0.0 && s.is_finite();
    let sound =
        priors.iter().all(|p| positive(p.sigma)) && measured.iter().all(|m| positive(m.sigma));
    if !sound || priors.is_empty() || measured.is_empty() {
        return Err(FitError::Weights);
    }
    let mut looked = Looked {
        priors,
        answers: Vec::new(),
        silent: Vec::new(),
    };
    let mut sequence = Sequence::new(priors.len());
    looked.over_the_priors(&mut sequence, model)?;
    let domain = around(priors, FARTHEST);
    let mut middle: Vec<f64> = priors.iter().map(|p| p.value).collect();
    let mut reach: Vec<f64> = priors.iter().map(|p| LOOKED * COUNTING * p.sigma).collect();
    let mut round = 0;
    let (known, belief) = loop {
        let course = Course::new(&looked.answers, &middle, &reach);
        let known = Known::new(priors, measured, course.map_err(FitError::LeastSquares)?);
        let cost = |values: &[f64]| {
            if looked.is_silent(values) {
                f64::INFINITY
            } else {
                known.cost(values)
            }
        };
        // the priors' own place answers: somewhere the cost is finite, unless predictions are not
        let Some(belief) = Belief::of(&domain, &cost) else {
            return Err(FitError::LeastSquares(LeastSquaresError::Start));
        };
        let sigmas = belief.sigmas();
        let moved = belief.mean.iter().zip(&middle).zip(&sigmas);
        let still = moved
            .into_iter()
            .all(|((a, b), s)| (a - b).abs() <= STILL * s);
        if round == rounds || (round >= LEAST_ROUNDS && still) {
            break (known, belief);
        }
        round += 1;
        let reaches = sigmas.iter().zip(priors);
        reach = reaches
            .map(|(s, p)| COUNTING * s.max(LEAST_REACH * p.sigma))
            .collect();
        middle.clone_from(&belief.mean);
        let box_of = middle.iter().zip(&reach).zip(&domain);
        let near: Vec<[f64; 2]> = box_of
            .map(|((m, r), d)| [(m - r).max(d[0]), (m + r).min(d[1])])
            .collect();
        let limit = belief.least + NEAR;
        let places = sequence.places(REFINED * priors.len(), &near, &|v| cost(v) <= limit);
        looked.ask(places, model);
    };
    let alone = |values: &[f64]| {
        if looked.is_silent(values) {
            f64::INFINITY
        } else {
            pulls(priors, values)
        }
    };
    let believed = Belief::of(&domain, &alone).map_or_else(Vec::new, |b| b.sigmas());
    let predicted = known.course.predicted(&belief.best);
    let slopes = known.slopes(&belief.best, &domain);
    Ok(Fitted {
        slopes,
        weighed: known.sigmas.clone(),
        sigmas: belief.sigmas(),
        believed,
        before: looked.answers.swap_remove(0).1,
        misfit: known.misfit(&predicted),
        predicted,
        covariance: belief.covariance,
        evaluations: looked.answers.len() + 1 + looked.silent.len(),
        roughness: known.course.roughness,
        values: belief.best,
    })
}

/// What priors leave of values, squared over their uncertainties.
fn pulls(priors: &[Prior], values: &[f64]) -> f64 {
    let off = |(p, v): (&Prior, &f64)| ((v - p.value) / p.sigma).powi(2);
    priors.iter().zip(values).map(off).sum()
}

/// What is known before and what was measured, weighed by uncertainties, on a course of the model.
struct Known<'a> {
    priors: &'a [Prior],
    measured: &'a [Measured],
    course: Course,
    /// Of each comparison: the measurement's with the model's roughness.
    sigmas: Vec<f64>,
}

impl<'a> Known<'a> {
    fn new(priors: &'a [Prior], measured: &'a [Measured], course: Course) -> Self {
        let with = |(m, rough): (&Measured, &f64)| m.sigma.hypot(*rough);
        Known {
            priors,
            measured,
            sigmas: measured.iter().zip(&course.roughness).map(with).collect(),
            course,
        }
    }

    /// Weighted sum of squares of the measurements.
    fn misfit(&self, predicted: &[f64]) -> f64 {
        let all = self.measured.iter().zip(&self.sigmas).zip(predicted);
        all.map(|((m, sigma), p)| ((m.value - p) / sigma).powi(2))
            .sum()
    }

    /// How predictions go with each parameter on the course, over a hundredth of what may be.
    fn slopes(&self, at: &[f64], domain: &[[f64; 2]]) -> Vec<Vec<f64>> {
        let mut slopes = vec![Vec::new(); self.measured.len()];
        for (n, [low, high]) in domain.iter().enumerate() {
            let step = 0.01 * (high - low);
            let [before, after] = [-step, step].map(|step| {
                let mut moved = at.to_vec();
                moved[n] += step;
                self.course.predicted(&moved)
            });
            for ((slopes, a), b) in slopes.iter_mut().zip(before).zip(after) {
                slopes.push((b - a) / (2.0 * step));
            }
        }
        slopes
    }

    /// The same with the priors.
    fn cost(&self, values: &[f64]) -> f64 {
        self.misfit(&self.course.predicted(values)) + pulls(self.priors, values)
    }
}

/// Of two candidate settings with their predictions, which to build: the one whose prediction, spread by its uncertainty, lies
/// nearest the `wanted` value. Returns its index and the expected squared miss of each.
pub fn which_to_build(wanted: f64, candidates: &[(f64, f64)]) -> (usize, Vec<f64>) {
    let misses: Vec<f64> = candidates
        .iter()
        .map(|(value, sigma)| (value - wanted).powi(2) + sigma * sigma)
        .collect();
    let best = (0..misses.len()).fold(0, |best, n| if misses[n] < misses[best] { n } else { best });
    (best, misses)
}

/// The radius at which `diameter(radius)` is `wanted`, by bisection between `radii` to `tolerance` mm; the simulated pairs come
/// with it. `None` where the wanted diameter does not lie between those of the two radii.
///
/// # Errors
/// What `diameter` says.
pub fn solve_radius<E>(
    wanted: f64,
    radii: [f64; 2],
    tolerance: f64,
    diameter: &mut dyn FnMut(f64) -> Result<f64, E>,
) -> Result<(Option<f64>, Vec<[f64; 2]>), E> {
    let [mut low, mut high] = radii;
    let mut pairs = vec![[low, diameter(low)?], [high, diameter(high)?]];
    if pairs[0][1] > wanted || pairs[1][1] < wanted {
        return Ok((None, pairs));
    }
    while high - low > tolerance {
        let middle = 0.5 * (low + high);
        let found = diameter(middle)?;
        pairs.push([middle, found]);
        if found < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok((Some(0.5 * (low + high)), pairs))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn prior(value: f64, sigma: f64) -> Prior {
        Prior {
            name: "p".to_owned(),
            value,
            sigma,
            bounds: [0.1, 10.0],
        }
    }

    #[derive(Debug, thiserror::Error)]
    #[error("never")]
    struct Never;

    /// A model that says the same everywhere teaches nothing, and says so; within bounds that cut the prior too.
    #[test]
    fn a_fit_that_learns_nothing_says_so() {
        let measured = [Measured {
            value: 0.5,
            sigma: 0.1,
        }];
        let of = |bounds: [f64; 2], model: &dyn Fn(f64) -> f64| {
            let priors = [Prior {
                bounds,
                ..prior(1.0, 0.5)
            }];
            let mut model = |p: &[f64]| Ok::<_, Never>(vec![model(p[0])]);
            fit(&priors, &measured, 4, &mut model).unwrap()
        };
        for bounds in [[0.1, 10.0], [0.1, 1.2]] {
            let blind = of(bounds, &|_| 1.0);
            assert!(
                blind.is_blind() && (blind.values[0] - 1.0).abs() < 1e-3,
                "{blind:?}"
            );
            let honest = of(bounds, &|p| p);
            assert!(honest.values[0] < 0.6 && !honest.is_blind(), "{honest:?}");
        }
    }

    /// A beam may be too weak for the model within what was believed of it: then the fit stays where it answers, and says what it said without that.
    #[test]
    fn a_model_that_ends_within_the_prior_is_fitted_all_the_same() {
        let priors = [prior(1.0, 0.5)];
        let measured = [Measured {
            value: 1.1,
            sigma: 0.02,
        }];
        let fitted = |least: f64| {
            let mut model = |p: &[f64]| {
                if p[0] < least {
                    Err(Never)
                } else {
                    Ok(vec![p[0] * p[0]])
                }
            };
            fit(&priors, &measured, 8, &mut model)
        };
        let whole = fitted(0.0).unwrap();
        for least in [0.8, 0.99] {
            let ended = fitted(least).unwrap();
            assert!(
                (whole.values[0] - ended.values[0]).abs() < 1e-3,
                "{ended:?}"
            );
            assert!((whole.sigmas[0] / ended.sigmas[0] - 1.0).abs() < 0.02);
        }
        // at the prior's own place it must answer, and at more than a few
        assert!(fitted(1.01).is_err());
        let mut only = |p: &[f64]| {
            if p[0] == 1.0 {
                Ok(vec![1.0])
            } else {
                Err(Never)
            }
        };
        assert!(matches!(
            fit(&priors, &measured, 8, &mut only),
            Err(FitError::Model(Never))
        ));
    }

    /// One measurement of the product of two numbers leaves the whole valley that the priors allow, and no more.
    #[test]
    fn a_valley_is_as_wide_as_the_priors_leave_it() {
        let priors = [prior(1.0, 0.1), prior(1.0, 0.2)];
        let measured = [Measured {
            value: 1.0,
            sigma: 0.02,
        }];
        let mut model = |p: &[f64]| Ok::<_, Never>(vec![p[0] * p[1]]);
        let found = fit(&priors, &measured, 4, &mut model).unwrap();
        // along p q = 1 the sum of both pulls: 1 / (1/0.1² + 1/0.2²)
        let along = (1.0 / (1.0 / 0.01 + 1.0 / 0.04_f64)).sqrt();
        for sigma in &found.sigmas {
            assert!((sigma / along - 1.0).abs() < 0.1, "{found:?}");
        }
        let correlation = found.covariance[0][1] / (found.sigmas[0] * found.sigmas[1]);
        assert!(correlation < -0.9, "{correlation}");
    }

    /// Predictions that are all off move the parameters as fits of what they would be do.
    #[test]
    fn what_predictions_are_off_moves_the_parameters() {
        let priors = [prior(0.9, 0.1), prior(1.0, 0.15)];
        let fitted = |off: [f64; 3]| {
            let mut model = |p: &[f64]| {
                let all = [p[0] + 0.3 * p[1], p[0] - 0.5 * p[1], p[0] * p[1]];
                Ok::<_, Never>(all.iter().zip(off).map(|(a, o)| a + o).collect())
            };
            let measured = [1.15, 0.3, 0.85].map(|value| Measured { value, sigma: 0.03 });
            fit(&priors, &measured, 4, &mut model).unwrap()
        };
        let off = [0.02, -0.01, 0.03];
        let (before, after) = (fitted([0.0; 3]), fitted(off));
        let moved = before.moved(&off);
        for (n, moved) in moved.iter().enumerate() {
            let true_move = after.values[n] - before.values[n];
            assert!(
                (moved - true_move).abs() < 0.1 * before.sigmas[n],
                "{moved:?}"
            );
            assert!(true_move.abs() > 0.2 * before.sigmas[n], "{true_move}");
        }
        let mut wide = before.clone();
        wide.widen(&moved);
        for (n, moved) in moved.iter().enumerate() {
            assert!((wide.sigmas[n] - before.sigmas[n].hypot(*moved)).abs() < 1e-9);
        }
    }

    /// Two minima of a stepwise model, of which slopes reach the worse one: the whole is looked at first.
    #[test]
    fn a_search_is_not_caught_in_a_step() {
        let priors = [prior(0.9, 0.1), prior(1.0, 0.15)];
        let truth = [0.8, 1.15];
        let size = |k: u32, p: &[f64]| {
            let k = f64::from(k);
            0.6 + (0.3 + 0.1 * k) * p[0] - (0.5 - 0.17 * k) * p[1] * p[1]
        };
        let stepped = |k: u32, p: &[f64]| {
            let phase = (f64::from(k) * 0.618_034).fract();
            0.02 * ((size(k, p) / 0.02 + phase).round() - phase)
        };
        let mut model = |p: &[f64]| Ok::<_, Never>((0..5).map(|k| stepped(k, p)).collect());
        let measured: Vec<Measured> = (0..5)
            .map(|k| Measured {
                value: stepped(k, &truth),
                sigma: 0.003,
            })
            .collect();
        let found = fit(&priors, &measured, 4, &mut model).unwrap();
        for ((value, sigma), truth) in found.values.iter().zip(&found.sigmas).zip(truth) {
            assert!((value - truth).abs() < 2.0 * sigma, "{found:?}");
        }
        assert!(
            found.misfit + pulls(&priors, &found.values) < 11.0,
            "{found:?}"
        );
    }

    /// Sizes in whole cells: the truth lies within the intervals as often as they say, and they are no narrower than the cells allow.
    #[test]
    fn steps_of_a_model_are_part_of_its_uncertainty() {
        let cell = 0.05;
        let (mut within, mut least, tries) = (0, f64::INFINITY, 400);
        for n in 0..tries {
            let phase = |k: u32| (f64::from(7 * n + 3 * k) * 0.618_034).fract();
            let truth = 1.0 + 0.4 * (phase(90) - 0.5);
            // each body has its own slope, and its own place among the cells
            let size = |k: u32, p: f64| (1.0 + 0.2 * f64::from(k)) * p;
            let measured: Vec<Measured> = (0..6)
                .map(|k| Measured {
                    value: size(k, truth) + 0.01 * (phase(k + 40) - 0.5),
                    sigma: 0.003,
                })
                .collect();
            let mut model = |p: &[f64]| {
                let cells = |k: u32| (size(k, p[0]) / cell + phase(k)).round() - phase(k);
                Ok::<_, Never>((0..6).map(|k| cell * cells(k)).collect())
            };
            let priors = [prior(1.0, 0.2)];
            let found = fit(&priors, &measured, 4, &mut model).unwrap();
            // 90 %
            within += u32::from((found.values[0] - truth).abs() < 1.645 * found.sigmas[0]);
            least = least.min(found.sigmas[0]);
        }
        let share = f64::from(within) / f64::from(tries);
        assert!(share > 0.85 && least > 0.002, "{share} {least}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn a_bent_model_is_inverted(a in 0.6..1.4_f64, b in 0.6..1.4_f64) {
            let truth = |p: &[f64]| vec![p[0] * p[0] + p[1], p[0] * p[1], p[1].sqrt()];
            let measured: Vec<Measured> = truth(&[a, b]).into_iter().map(|value| Measured { value, sigma: 1e-3 }).collect();
            let mut model = |p: &[f64]| Ok::<_, Never>(truth(p));
            let found = fit(&[prior(1.0, 0.5), prior(1.0, 0.5)], &measured, 20, &mut model).unwrap();
            // beyond quadratics the courses are as rough as that leaves them
            for ((value, sigma), truth) in found.values.iter().zip(&found.sigmas).zip([a, b]) {
                prop_assert!((value - truth).abs() < 0.02 && *sigma < 0.03, "{found:?}");
                prop_assert!((value - truth).abs() < 2.5 * sigma, "{found:?}");
            }
        }
    }

    #[test]
    fn without_information_the_prior_stays() {
        let mut model = |p: &[f64]| Ok::<_, Never>(vec![p[0]]);
        let measured = [Measured {
            value: 5.0,
            sigma: 1e3,
        }];
        let found = fit(&[prior(1.0, 0.1)], &measured, 5, &mut model).unwrap();
        assert!((found.values[0] - 1.0).abs() < 1e-3 && (found.sigmas[0] - 0.1).abs() < 1e-3);
        assert_eq!(which_to_build(1.0, &[(1.2, 0.0), (1.1, 0.1)]).0, 1);
    }

    #[test]
    fn the_radius_of_a_line_is_found() {
        let mut line = |r: f64| Ok::<f64, ()>(0.3 + 2.0 * r);
        let (radius, pairs) = solve_radius(1.0, [0.1, 0.5], 1e-4, &mut line).unwrap();
        assert!((radius.unwrap() - 0.35).abs() < 1e-4 && pairs.len() > 2);
        assert_eq!(
            solve_radius(9.0, [0.1, 0.5], 1e-4, &mut line).unwrap().0,
            None
        );
    }
}
