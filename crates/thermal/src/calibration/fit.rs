//! Corrects what is not known well (efficiency, beam diameter) from what was built and measured.
//!
//! Least squares with prior knowledge, by Gauss-Newton with finite differences: each evaluation is a simulation, so that few
//! are made. Uncertainties come from those of the measurements and of the prior, carried through the model's slopes.

use meltpath_numerics::least_squares::{LeastSquaresError, Regression, Solution};

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
    /// Weighted sum of squares of what is left of the measurements, without the prior.
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

/// Finds the parameters that explain `measured` and stay near their priors; `model` gives a prediction for each
/// measurement. `rounds` Gauss-Newton steps at most; slopes by steps of a fifth of each prior's uncertainty.
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
    let cost = |values: &[f64], predicted: &[f64]| {
        let data: f64 = measured
            .iter()
            .zip(predicted)
            .map(|(m, p)| ((m.value - p) / m.sigma).powi(2))
            .sum();
        let prior: f64 = priors
            .iter()
            .zip(values)
            .map(|(p, v)| ((v - p.value) / p.sigma).powi(2))
            .sum();
        (data, data + prior)
    };
    let mut values: Vec<f64> = priors.iter().map(|p| p.value).collect();
    let mut predicted = evaluate(&values)?;
    let mut slopes = vec![vec![0.0; n]; measured.len()];
    let mut covariance = vec![vec![0.0; n]; n];
    let (mut promise, mut steps) = (0.0, 0);
    for _ in 0..rounds {
        slopes = slopes_at(&values, &predicted, priors, &mut evaluate)?;
        let mut system = Regression::new(n);
        for ((m, p), row) in measured.iter().zip(&predicted).zip(&slopes) {
            system.push(row.iter().map(|s| s / m.sigma), (m.value - p) / m.sigma);
        }
        for (i, prior) in priors.iter().enumerate() {
            let row = (0..n).map(|k| if k == i { 1.0 / prior.sigma } else { 0.0 });
            system.push(row, (prior.value - values[i]) / prior.sigma);
        }
        let Solution {
            values: step,
            spread,
            ..
        } = system.solve().map_err(FitError::LeastSquares)?;
        covariance = spread.to_rows();
        let (_, before) = cost(&values, &predicted);
        let whole: Vec<f64> = (0..n).map(|i| values[i] + step[i]).collect();
        let straight = along(&predicted, &slopes, &step);
        promise = before - cost(&whole, &straight).1;
        // a shorter step where a whole one makes it worse
        let mut share = 1.0;
        let mut moved = false;
        while share > 0.1 {
            let next: Vec<f64> = (0..n)
                .map(|i| {
                    (values[i] + share * step[i]).clamp(priors[i].bounds[0], priors[i].bounds[1])
                })
                .collect();
            let there = evaluate(&next)?;
            if cost(&next, &there).1 < before {
                moved = values
                    .iter()
                    .zip(&next)
                    .zip(priors)
                    .any(|((a, b), p)| (a - b).abs() > 0.02 * p.sigma);
                values = next;
                predicted = there;
                steps += 1;
                break;
            }
            share *= 0.4;
        }
        if !moved {
            break;
        }
    }
    let (misfit, _) = cost(&values, &predicted);
    Ok(Fitted {
        sigmas: (0..n).map(|i| covariance[i][i].max(0.0).sqrt()).collect(),
        values,
        predicted,
        slopes,
        covariance,
        misfit,
        end: if steps == 0 && promise > PROMISE {
            End::Stuck
        } else {
            End::Settled
        },
        evaluations,
    })
}

/// Slopes of the model at `values`, where it predicts `predicted`: a row a measurement.
fn slopes_at<E>(
    values: &[f64],
    predicted: &[f64],
    priors: &[Prior],
    evaluate: &mut Model<'_, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let mut slopes = vec![vec![0.0; values.len()]; predicted.len()];
    for (k, prior) in priors.iter().enumerate() {
        // towards the inside of the bounds
        let mut step = 0.2 * prior.sigma;
        if values[k] + step > prior.bounds[1] {
            step = -step;
        }
        let mut moved = values.to_vec();
        moved[k] += step;
        let there = evaluate(&moved)?;
        for (row, (a, b)) in slopes.iter_mut().zip(there.iter().zip(predicted)) {
            row[k] = (a - b) / step;
        }
    }
    Ok(slopes)
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
