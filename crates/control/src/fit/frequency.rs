//! Fits to frequency responses: rational functions linear in their coefficients, and physical models in theirs.
//!
//! E. C. Levy, IRE Trans. Automatic Control 4 (1959) 37–43; C. K. Sanathanan, J. Koerner, IEEE Trans. Automatic Control 8
//! (1963) 56–58; complex logarithmic error for physical models.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::{Fit, FitError, Regression, least_squares};
use crate::polynomial::exponent;
use crate::transfer::TransferFunction;

/// One measured point of a response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Frequency (rad/s).
    pub omega: f64,
    /// The response there.
    pub response: Complex64,
    /// Weight of its squared error.
    pub weight: f64,
}

/// What a rational function looks like.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shape {
    /// Zeros.
    pub zeros: usize,
    /// Poles, integrators included.
    pub poles: usize,
    /// Poles fixed at the origin.
    pub integrators: usize,
    /// A known delay (s).
    pub delay: f64,
}

/// A continuous transfer function of the given shape whose relative error at the points is smallest in the mean. Levy's
/// linear problem is solved again with the last denominator as weight until it stays (Sanathanan and Koerner).
///
/// # Errors
/// [`FitError::TooFewData`], [`FitError::NotFinite`], [`FitError::Undetermined`].
///
/// ```
/// use meltpath_control::{fit::frequency::{rational, Point, Shape}, frequency, TransferFunction};
/// let g = TransferFunction::new([5.0, 3.0], [1.0, 0.4, 16.0, 0.0]).unwrap();
/// let points: Vec<Point> = frequency::logarithmic(0.1, 50.0, 60).into_iter()
///     .map(|omega| Point { omega, response: g.response(omega), weight: 1.0 }).collect();
/// let fit = rational(&points, &Shape { zeros: 1, poles: 3, integrators: 1, delay: 0.0 }).unwrap();
/// assert!((fit.denominator.coefficient(1) - 16.0).abs() < 1e-6);
/// ```
pub fn rational(points: &[Point], shape: &Shape) -> Result<TransferFunction, FitError> {
    const ROUNDS: usize = 40;
    let free = shape.poles - shape.integrators.min(shape.poles);
    let unknowns = shape.zeros + 1 + free;
    if 2 * points.len() < unknowns {
        return Err(FitError::TooFewData {
            unknowns,
            data: 2 * points.len(),
        });
    }
    if let Some(index) = points.iter().position(|p| {
        !(p.response.re.is_finite() && p.response.im.is_finite() && p.omega.is_finite())
            || p.response.norm() == 0.0
    }) {
        return Err(FitError::NotFinite { index });
    }
    // frequency in units of the geometric mean of the band: powers stay moderate
    let unit =
        (points.iter().map(|p| p.omega.max(1e-300).ln()).sum::<f64>() / points.len() as f64).exp();
    let mut denominator = vec![Complex64::new(1.0, 0.0); points.len()];
    let mut best: Option<(f64, Vec<f64>)> = None;
    for _ in 0..ROUNDS {
        let mut system = Regression::new(unknowns);
        for (p, previous) in points.iter().zip(&denominator) {
            let s = Complex64::new(0.0, p.omega / unit);
            // the response without its integrators and delay
            let g = p.response
                * s.powi(exponent(shape.integrators))
                * (Complex64::new(0.0, p.omega) * shape.delay).exp();
            let scale = p.weight.sqrt() / (g * previous).norm();
            let mut row: Vec<Complex64> = (0..=shape.zeros).map(|k| s.powi(exponent(k))).collect();
            row.extend((0..free).map(|k| -g * s.powi(exponent(k))));
            let value = g * s.powi(exponent(free));
            system.push(row.iter().map(|z| z.re * scale), value.re * scale);
            system.push(row.iter().map(|z| z.im * scale), value.im * scale);
        }
        let (x, _, _) = system.solve()?;
        let at = |s: Complex64| -> (Complex64, Complex64) {
            let up = (0..=shape.zeros).map(|k| x[k] * s.powi(exponent(k))).sum();
            let down: Complex64 = (0..free)
                .map(|k| x[shape.zeros + 1 + k] * s.powi(exponent(k)))
                .sum();
            (up, down + s.powi(exponent(free)))
        };
        let mut error = 0.0;
        for (p, d) in points.iter().zip(&mut denominator) {
            let s = Complex64::new(0.0, p.omega / unit);
            let (up, down) = at(s);
            let g = p.response
                * s.powi(exponent(shape.integrators))
                * (Complex64::new(0.0, p.omega) * shape.delay).exp();
            error += p.weight * (up / down / g - 1.0).norm_sqr();
            *d = down;
        }
        let improved = best.as_ref().is_none_or(|(e, _)| error < *e * (1.0 - 1e-9));
        if improved {
            best = Some((error, x));
        } else {
            break;
        }
    }
    let x = best.map(|(_, x)| x).unwrap_or_default();
    // back from the scaled frequency: s = unit·p
    let power = |k: usize| unit.powi(exponent(k));
    let up: Vec<f64> = (0..=shape.zeros).rev().map(|k| x[k] / power(k)).collect();
    let mut down: Vec<f64> = vec![1.0 / power(free)];
    down.extend((0..free).rev().map(|k| x[shape.zeros + 1 + k] / power(k)));
    let first = down[0];
    let unscale = power(shape.integrators) / first;
    let up: Vec<f64> = up.iter().map(|c| c * unscale).collect();
    let mut down: Vec<f64> = down.iter().map(|c| c / first).collect();
    down.extend(std::iter::repeat_n(0.0, shape.integrators));
    Ok(TransferFunction::new(up, down)?.delayed(shape.delay)?)
}

/// The positive parameters of a model that bring its response closest to the points, in the complex logarithm: decibels and
/// angles weigh the same at every level. Parameters are sought in logarithm; `sigma` is returned in the parameters' units.
///
/// # Errors
/// [`FitError`].
///
/// ```
/// use meltpath_control::{fit::frequency::{physical, Point}, frequency, Complex64};
/// // a lag k/(1 + τ s)
/// let lag = |p: &[f64], w: f64| p[0] / Complex64::new(1.0, p[1] * w);
/// let points: Vec<Point> = frequency::logarithmic(1.0, 1e3, 30).into_iter()
///     .map(|omega| Point { omega, response: lag(&[4.0, 0.02], omega), weight: 1.0 }).collect();
/// let fit = physical(lag, &points, &[1.0, 1.0]).unwrap();
/// assert!((fit.values[1] / 0.02 - 1.0).abs() < 1e-8);
/// ```
pub fn physical(
    model: impl Fn(&[f64], f64) -> Complex64,
    points: &[Point],
    start: &[f64],
) -> Result<Fit, FitError> {
    let logs: Vec<f64> = start.iter().map(|v| v.ln()).collect();
    if let Some(index) = logs.iter().position(|v| !v.is_finite()) {
        return Err(FitError::NotFinite { index });
    }
    let residuals = |x: &[f64]| -> Vec<f64> {
        let values: Vec<f64> = x.iter().map(|v| v.exp()).collect();
        points
            .iter()
            .flat_map(|p| {
                // the principal logarithm of the ratio wraps the phase
                let z = (model(&values, p.omega) / p.response).ln() * p.weight.sqrt();
                [z.re, z.im]
            })
            .collect()
    };
    let mut fit = least_squares(residuals, &logs)?;
    for (v, s) in fit.values.iter_mut().zip(&mut fit.sigma) {
        *v = v.exp();
        *s *= *v;
    }
    Ok(fit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frequency;
    use crate::random::Random;

    #[test]
    fn a_flexible_plant_with_noise() {
        let g = TransferFunction::new([2e4, 4e5, 1.2e9], [1.0, 60.0, 4.0e4, 9.0e5, 0.0])
            .unwrap()
            .delayed(2e-4)
            .unwrap();
        let mut random = Random::new(5);
        let points: Vec<Point> = frequency::logarithmic(1.0, 2000.0, 300)
            .into_iter()
            .map(|omega| {
                let noise = Complex64::new(1.0 + 0.01 * random.normal(), 0.01 * random.normal());
                Point {
                    omega,
                    response: g.response(omega) * noise,
                    weight: 1.0,
                }
            })
            .collect();
        let fit = rational(
            &points,
            &Shape {
                zeros: 2,
                poles: 4,
                integrators: 1,
                delay: 2e-4,
            },
        )
        .unwrap();
        for omega in [2.0, 30.0, 190.0, 245.0, 1500.0] {
            assert!(
                (fit.response(omega) / g.response(omega) - 1.0).norm() < 0.02,
                "{omega}"
            );
        }
    }

    #[test]
    fn too_few_points() {
        let points = [Point {
            omega: 1.0,
            response: Complex64::new(1.0, 0.0),
            weight: 1.0,
        }];
        let shape = Shape {
            zeros: 3,
            poles: 4,
            integrators: 0,
            delay: 0.0,
        };
        assert!(matches!(
            rational(&points, &shape),
            Err(FitError::TooFewData { .. })
        ));
    }
}
