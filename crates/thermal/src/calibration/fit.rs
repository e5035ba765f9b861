//! Corrects what is not known well (efficiency, beam diameter) from what was built and measured.
//!
//! Least squares with prior knowledge, by Gauss-Newton with differences: each evaluation is a simulation, so that few are made.
//! Uncertainties come from those of the measurements and of the prior, and from the model's own steps, carried through its slopes.

use meltpath_numerics::least_squares::{LeastSquaresError, Regression, Solution};

use super::course::{Course, PLACES, places};

/// A parameter before the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Its name.
    pub name: String,
    /// Its value and standard uncertainty.
    pub value: f64,
    /// See `value`.
    pub sigma: f64,
    /// Values it may take.
    pub bounds: [f64; 2],
}

/// A measurement with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The next step would be small, or all rounds were made.
    Settled,
    /// Where it began: the slopes promise a better fit that no step along them gives, as those of a model too coarse for them do.
    Stuck,
}

/// What a fit found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Parameters.
    pub values: Vec<f64>,
    /// Their standard uncertainties.
    pub sigmas: Vec<f64>,
    /// What the model says for each measurement with them.
    pub predicted: Vec<f64>,
    /// `∂ predicted / ∂ parameter`.
    pub slopes: Vec<Vec<f64>>,
    /// Covariance of the parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Roughness of the model for each measurement: its steps about a smooth course, a standard deviation.
    pub roughness: Vec<f64>,
    /// Sum of squares of what is left of the measurements, over their uncertainties and the model's roughness; without the prior.
    pub misfit: f64,
    /// How it ended.
    pub end: End,
    /// Simulations made.
    pub evaluations: usize,
}

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
}

/// Uncertainties that remain, as a share of those of the prior, from which measurements taught nothing.
const TAUGHT: f64 = 0.98;
/// Least fall of the weighted sum of squares that slopes promise, for a step that finds none to be worth telling.
const PROMISE: f64 = 0.1;

/// Why a fit says nothing beyond what was believed before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nothing {
    /// No measurement changes with any parameter.
    Blind,
    /// See [`End::Stuck`].
    Stuck,
}

impl Fitted {
    /// Whether the fit says no more than its `priors`.
    pub fn nothing(&self, priors: &[Prior]) -> Option<Nothing> {
        let mut both = self.sigmas.iter().zip(priors);
        if both.all(|(sigma, prior)| *sigma >= TAUGHT * prior.sigma) {
            Some(Nothing::Blind)
        } else {
            (self.end == End::Stuck).then_some(Nothing::Stuck)
        }
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
    /// The model's slopes are not finite.
    #[error(transparent)]
    LeastSquares(LeastSquaresError),
}

/// A model: a prediction for each measurement from the parameters.
pub type Model<'a, E> = dyn FnMut(&[f64]) -> Result<Vec<f64>, E> + 'a;

/// How often a fit asks its model, at least and at most: for so many parameters, `rounds` steps at most.
///
/// ```
/// assert_eq!(meltpath_thermal::calibration::fit::evaluations(2, 4), [14, 61]);
/// ```
pub fn evaluations(parameters: usize, rounds: u32) -> [usize; 2] {
    let look = parameters * PLACES.len();
    [1 + look + 1, 1 + rounds as usize * (look + SHARES.len())]
}

/// Finds the parameters that explain `measured` and stay near their priors; `model` gives a prediction for each
/// measurement. `rounds` Gauss-Newton steps at most.
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
    let n = priors.len();
    let mut evaluations = 0;
    let mut evaluate = |values: &[f64]| {
        evaluations += 1;
        model(values)
    };
    let mut values: Vec<f64> = priors.iter().map(|p| p.value).collect();
    let mut predicted = evaluate(&values)?;
    let before: Vec<f64> = priors.iter().map(|p| p.sigma).collect();
    let mut sigmas = before.clone();
    let here = (&*values, &*predicted);
    let mut course = look(here, priors, sigmas.clone(), &mut evaluate)?;
    let mut known = Known {
        priors,
        measured,
        sigmas: Vec::new(),
    };
    let mut covariance: Vec<Vec<f64>> = vec![vec![0.0; n]; n];
    let (mut promise, mut steps) = (0.0, 0);
    for _ in 0..rounds {
        if !course.covers(&values) {
            let reach = course.next_reach(&sigmas, &before);
            course = look((&values, &predicted), priors, reach, &mut evaluate)?;
        }
        let with = |(m, rough): (&Measured, &f64)| m.sigma.hypot(*rough);
        known.sigmas = measured.iter().zip(&course.roughness).map(with).collect();
        let slopes = course.slopes(&values);
        let (step, spread) = known
            .step(&values, &predicted, &slopes)
            .map_err(FitError::LeastSquares)?;
        sigmas = (0..n).map(|i| spread[i][i].max(0.0).sqrt()).collect();
        covariance = spread;
        let cost = known.cost(&values, &predicted);
        let whole: Vec<f64> = (0..n).map(|i| values[i] + step[i]).collect();
        promise = cost - known.cost(&whole, &along(&predicted, &slopes, &step));
        let Some((next, there)) = known.search(&values, &step, cost, &mut evaluate)? else {
            break;
        };
        let far = |((a, b), p): ((&f64, &f64), &Prior)| (a - b).abs() > 0.02 * p.sigma;
        let moved = values.iter().zip(&next).zip(priors).any(far);
        (values, predicted) = (next, there);
        steps += 1;
        if !moved {
            break;
        }
    }
    Ok(Fitted {
        sigmas,
        misfit: known.misfit(&predicted),
        slopes: course.slopes(&values),
        roughness: course.roughness,
        values,
        predicted,
        covariance,
        end: if steps == 0 && promise > PROMISE {
            End::Stuck
        } else {
            End::Settled
        },
        evaluations,
    })
}

/// Shares of a step that are tried; of a model that does not answer at the least of them it is told why.
const SHARES: [f64; 3] = [1.0, 0.4, 0.16];
/// How often the reach is halved where a model does not answer within it.
const HALVED: u32 = 3;

/// The course of the model about values and what it predicts there, within `reach`; within less where the model does not answer so far out, as
/// for a beam that is too weak there.
fn look<E: std::error::Error>(
    here: (&[f64], &[f64]),
    priors: &[Prior],
    mut reach: Vec<f64>,
    evaluate: &mut Model<'_, E>,
) -> Result<Course, FitError<E>> {
    let bounds: Vec<[f64; 2]> = priors.iter().map(|p| p.bounds).collect();
    let mut halved = 0;
    loop {
        let places = places(here.0, &bounds, &reach);
        let found: Result<Vec<_>, E> = places.iter().map(|values| evaluate(values)).collect();
        match found {
            Ok(found) => {
                let course = Course::new(here, reach, (&places, &found));
                return course.map_err(FitError::LeastSquares);
            }
            Err(_) if halved < HALVED => {
                halved += 1;
                for r in &mut reach {
                    *r *= 0.5;
                }
            }
            Err(why) => return Err(why.into()),
        }
    }
}

/// Values of the parameters, and what the model predicts with them.
type There = (Vec<f64>, Vec<f64>);

/// What is known before and what was measured, weighed by uncertainties.
struct Known<'a> {
    priors: &'a [Prior],
    measured: &'a [Measured],
    /// Of each comparison: the measurement's with the model's roughness.
    sigmas: Vec<f64>,
}

impl Known<'_> {
    /// Weighted sum of squares of the measurements.
    fn misfit(&self, predicted: &[f64]) -> f64 {
        let all = self.measured.iter().zip(&self.sigmas).zip(predicted);
        all.map(|((m, sigma), p)| ((m.value - p) / sigma).powi(2))
            .sum()
    }

    /// The same with the priors.
    fn cost(&self, values: &[f64], predicted: &[f64]) -> f64 {
        let off = |(p, v): (&Prior, &f64)| ((v - p.value) / p.sigma).powi(2);
        self.misfit(predicted) + self.priors.iter().zip(values).map(off).sum::<f64>()
    }

    /// The step to the least sum of squares if the model were straight, and the covariance there.
    fn step(
        &self,
        values: &[f64],
        predicted: &[f64],
        slopes: &[Vec<f64>],
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), LeastSquaresError> {
        let n = values.len();
        let mut system = Regression::new(n);
        let rows = predicted.iter().zip(slopes);
        for ((m, sigma), (p, row)) in self.measured.iter().zip(&self.sigmas).zip(rows) {
            system.push(row.iter().map(|s| s / sigma), (m.value - p) / sigma);
        }
        for (i, prior) in self.priors.iter().enumerate() {
            let row = (0..n).map(|k| if k == i { 1.0 / prior.sigma } else { 0.0 });
            system.push(row, (prior.value - values[i]) / prior.sigma);
        }
        let Solution {
            values: step,
            spread,
            ..
        } = system.solve()?;
        Ok((step, spread.to_rows()))
    }

    /// A place along `step` where the sum is below `before`, with its predictions: a shorter step where a whole one makes it worse, or where
    /// the model does not answer so far out.
    fn search<E>(
        &self,
        values: &[f64],
        step: &[f64],
        before: f64,
        evaluate: &mut Model<'_, E>,
    ) -> Result<Option<There>, E> {
        for (n, share) in SHARES.into_iter().enumerate() {
            let further = |(i, p): (usize, &Prior)| {
                (values[i] + share * step[i]).clamp(p.bounds[0], p.bounds[1])
            };
            let next: Vec<f64> = self.priors.iter().enumerate().map(further).collect();
            match evaluate(&next) {
                Ok(there) if self.cost(&next, &there) < before => {
                    return Ok(Some((next, there)));
                }
                Err(why) if n + 1 == SHARES.len() => return Err(why),
                Ok(_) | Err(_) => {}
            }
        }
        Ok(None)
    }
}

/// What slopes promise a `step` further.
fn along(predicted: &[f64], slopes: &[Vec<f64>], step: &[f64]) -> Vec<f64> {
    let further = |row: &[f64]| -> f64 { row.iter().zip(step).map(|(s, d)| s * d).sum() };
    let both = predicted.iter().zip(slopes);
    both.map(|(p, row)| p + further(row)).collect()
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

    /// A model that does not answer, and one that jumps where the slope is taken: both leave the prior as it is, and say so.
    #[test]
    fn a_fit_that_learns_nothing_says_so() {
        let priors = [prior(1.0, 0.5)];
        let measured = [Measured {
            value: 0.5,
            sigma: 0.1,
        }];
        let of = |model: &dyn Fn(f64) -> f64| {
            let mut model = |p: &[f64]| Ok::<_, Never>(vec![model(p[0])]);
            fit(&priors, &measured, 4, &mut model).unwrap()
        };
        let blind = of(&|_| 1.0);
        assert_eq!(blind.nothing(&priors), Some(Nothing::Blind));
        let jumping = of(&|p| if p > 1.0 { 2.0 } else { 1.0 });
        assert_eq!(jumping.values, [1.0]);
        assert_eq!(jumping.nothing(&priors), Some(Nothing::Stuck));
        let honest = of(&|p| p);
        assert!(honest.values[0] < 0.6 && honest.nothing(&priors).is_none());
        // nothing to learn where the prior explains it all
        let right = fit(
            &priors,
            &[Measured {
                value: 1.0,
                sigma: 0.1,
            }],
            4,
            &mut |p: &[f64]| Ok::<_, Never>(vec![p[0]]),
        );
        assert_eq!(right.unwrap().nothing(&priors), None);
    }

    /// A beam may be too weak for the model within what was believed of it: then the fit looks nearer, and says what it said without that.
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
        let ended = fitted(0.8).unwrap();
        assert!((whole.values[0] - ended.values[0]).abs() < 1e-3);
        assert!((whole.sigmas[0] / ended.sigmas[0] - 1.0).abs() < 0.02);
        assert!(fitted(0.99).is_err());
        // a step that would lead out of the model is taken in part
        let near = |p: &[f64]| {
            if p[0] > 1.3 {
                Err(Never)
            } else {
                Ok(vec![p[0]])
            }
        };
        let far = [Measured {
            value: 1.45,
            sigma: 0.02,
        }];
        let taken = fit(&priors, &far, 1, &mut |p: &[f64]| near(p)).unwrap();
        assert!((taken.values[0] - 1.18).abs() < 0.01, "{taken:?}");
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
        assert!(share > 0.85 && least > 0.004, "{share} {least}");
    }

    proptest! {
        #[test]
        fn a_bent_model_is_inverted(a in 0.6..1.4_f64, b in 0.6..1.4_f64) {
            let truth = |p: &[f64]| vec![p[0] * p[0] + p[1], p[0] * p[1], p[1].sqrt()];
            let measured: Vec<Measured> = truth(&[a, b]).into_iter().map(|value| Measured { value, sigma: 1e-3 }).collect();
            let mut model = |p: &[f64]| Ok::<_, Never>(truth(p));
            let found = fit(&[prior(1.0, 0.5), prior(1.0, 0.5)], &measured, 20, &mut model).unwrap();
            prop_assert!((found.values[0] - a).abs() < 0.01 && (found.values[1] - b).abs() < 0.01, "{:?}", found.values);
            prop_assert!(found.sigmas.iter().all(|s| *s < 0.01));
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
