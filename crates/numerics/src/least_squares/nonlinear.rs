//! Nonlinear least squares by Levenberg and Marquardt's damped Gauss–Newton steps.
//!
//! J. J. Moré, "The Levenberg–Marquardt algorithm: implementation and theory" (1978): damping scaled by the columns.

use serde::{Deserialize, Serialize};

use super::{LeastSquaresError, Regression};

/// A fitted set of values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The unknowns.
    pub values: Vec<f64>,
    /// One standard deviation of each, from the residual and the slope of the model.
    pub sigma: Vec<f64>,
    /// Root mean square residual (degrees of freedom taken off).
    pub rms: f64,
    /// Steps taken.
    pub iterations: usize,
}

/// Minimises the sum of squares of `residuals`, which returns as many values on every call. Slopes are taken by central
/// differences, so the unknowns should be of the order of one (logarithms of positive quantities are a good choice).
///
/// # Errors
/// [`LeastSquaresError::Start`], [`LeastSquaresError::TooFewData`], [`LeastSquaresError::Undetermined`].
///
/// ```
/// use meltpath_numerics::least_squares::fit;
/// let data: Vec<(f64, f64)> = (0..20).map(|k| { let t = 0.1 * k as f64; (t, 3.0 * (-1.5 * t).exp()) }).collect();
/// let found = fit(|x| data.iter().map(|(t, y)| x[0] * (-x[1] * t).exp() - y).collect(), &[1.0, 1.0]).unwrap();
/// assert!((found.values[0] - 3.0).abs() < 1e-8 && (found.values[1] - 1.5).abs() < 1e-8);
/// ```
pub fn fit(
    residuals: impl Fn(&[f64]) -> Vec<f64>,
    start: &[f64],
) -> Result<Fit, LeastSquaresError> {
    const ITERATIONS: usize = 200;
    let n = start.len();
    let mut x = start.to_vec();
    let mut r = residuals(&x);
    if r.len() < n {
        return Err(LeastSquaresError::TooFewData {
            unknowns: n,
            data: r.len(),
        });
    }
    let square = |r: &[f64]| r.iter().map(|v| v * v).sum::<f64>();
    let mut cost = square(&r);
    if !cost.is_finite() {
        return Err(LeastSquaresError::Start);
    }
    let mut damping = 1e-3;
    let mut iterations = 0;
    let mut settled = false;
    while iterations < ITERATIONS && !settled {
        iterations += 1;
        let slopes = jacobian(&residuals, &x, r.len());
        let weights: Vec<f64> = slopes
            .iter()
            .map(|c| square(c).sqrt().max(1e-300))
            .collect();
        loop {
            let mut system = Regression::new(n);
            for k in 0..r.len() {
                system.push(slopes.iter().map(|c| c[k]), -r[k]);
            }
            for (j, w) in weights.iter().enumerate() {
                let level = f64::sqrt(damping) * w;
                system.push((0..n).map(|i| if i == j { level } else { 0.0 }), 0.0);
            }
            let step = system.solve()?.values;
            let next: Vec<f64> = x.iter().zip(&step).map(|(a, b)| a + b).collect();
            let after = residuals(&next);
            let fresh = square(&after);
            let small = step
                .iter()
                .zip(&x)
                .all(|(s, v)| s.abs() <= 1e-11 * (1.0 + v.abs()));
            if fresh.is_finite() && fresh <= cost {
                settled = small || cost - fresh <= 1e-14 * cost;
                x = next;
                r = after;
                cost = fresh;
                damping = f64::max(0.2 * damping, 1e-12);
                break;
            }
            damping *= 5.0;
            if damping > 1e12 || small {
                settled = true;
                break;
            }
        }
    }
    let slopes = jacobian(&residuals, &x, r.len());
    let mut system = Regression::new(n);
    for k in 0..r.len() {
        system.push(slopes.iter().map(|c| c[k]), r[k]);
    }
    let last = system.solve()?;
    Ok(Fit {
        sigma: last.sigma(),
        values: x,
        rms: last.variance.sqrt(),
        iterations,
    })
}

fn jacobian(residuals: &impl Fn(&[f64]) -> Vec<f64>, x: &[f64], count: usize) -> Vec<Vec<f64>> {
    (0..x.len())
        .map(|j| {
            let step = 6e-6 * x[j].abs().max(1e-2);
            let mut moved = x.to_vec();
            moved[j] = x[j] + step;
            let up = residuals(&moved);
            moved[j] = x[j] - step;
            let down = residuals(&moved);
            (0..count)
                .map(|k| (up[k] - down[k]) / (2.0 * step))
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn deviations_are_honest() {
        // the spread of 200 noisy fits matches the deviation each fit states
        let mut random = Random::new(11);
        let (mut square, mut stated) = (0.0, 0.0);
        for _ in 0..200 {
            let data: Vec<(f64, f64)> = (0..40)
                .map(|k| {
                    let t = 0.1 * f64::from(k);
                    (t, 2.0 * (-0.7 * t).exp() + 0.05 * random.normal())
                })
                .collect();
            let found = fit(
                |x| {
                    data.iter()
                        .map(|(t, y)| x[0] * (-x[1] * t).exp() - y)
                        .collect()
                },
                &[1.0, 0.3],
            )
            .unwrap();
            square += (found.values[1] - 0.7).powi(2);
            stated += found.sigma[1];
        }
        let spread = (square / 200.0f64).sqrt();
        let stated = stated / 200.0;
        assert!((spread / stated - 1.0).abs() < 0.2, "{spread} {stated}");
    }

    #[test]
    fn a_hopeless_start_is_refused() {
        assert_eq!(
            fit(|_| vec![f64::NAN, 0.0], &[1.0]),
            Err(LeastSquaresError::Start)
        );
    }
}
