//! Difference equations fitted to sampled records, and their judgement on records they have not seen.
//!
//! L. Ljung, "System Identification: Theory for the User", 2nd ed., chapters 4, 7, 10 and 16.

use serde::{Deserialize, Serialize};

use super::{FitError, Regression};
use crate::dense::Factored;
use crate::matrix::Matrix;
use crate::transfer::TransferFunction;

/// Orders of a difference equation y(t) + a1 y(t−1) + … = b0 u(t−d) + b1 u(t−d−1) + …
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Orders {
    /// Number of a's: poles.
    pub poles: usize,
    /// Number of b's.
    pub inputs: usize,
    /// Whole samples before the input acts.
    pub delay: usize,
}

/// A fitted difference equation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordModel {
    /// a1, a2, …
    pub a: Vec<f64>,
    /// b0, b1, …
    pub b: Vec<f64>,
    /// Standard deviations of the a's, then of the b's.
    pub sigma: Vec<f64>,
    /// Root mean square of what was minimised.
    pub rms: f64,
    /// Whole samples before the input acts.
    pub delay: usize,
    /// Sample time (s).
    pub period: f64,
}

impl RecordModel {
    /// The model as a transfer function in z.
    ///
    /// # Errors
    /// [`FitError::System`] when a coefficient is not finite.
    pub fn to_transfer_function(&self) -> Result<TransferFunction, FitError> {
        let size = self.a.len().max(self.b.len() + self.delay).max(1);
        let width = size.max(self.b.len() + self.delay - usize::from(!self.b.is_empty()));
        let mut up = vec![0.0; width + 1];
        for (k, b) in self.b.iter().enumerate() {
            up[k + self.delay] = *b;
        }
        let mut down = vec![0.0; width + 1];
        down[0] = 1.0;
        for (k, a) in self.a.iter().enumerate() {
            down[k + 1] = *a;
        }
        // common factors z are taken off both
        let idle = (0..=width)
            .rev()
            .take_while(|&k| up[k] == 0.0 && down[k] == 0.0)
            .count();
        up.truncate(width + 1 - idle);
        down.truncate(width + 1 - idle);
        Ok(TransferFunction::sampled(up, down, self.period)?)
    }

    /// The output for an input record from rest, without looking at the measured output.
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(input.len());
        for t in 0..input.len() {
            let mut sum = 0.0;
            for (k, b) in self.b.iter().enumerate() {
                if t >= k + self.delay {
                    sum += b * input[t - k - self.delay];
                }
            }
            for (k, a) in self.a.iter().enumerate() {
                if t > k {
                    sum -= a * y[t - k - 1];
                }
            }
            y.push(sum);
        }
        y
    }
}

fn check(input: &[f64], output: &[f64], unknowns: usize) -> Result<(), FitError> {
    if input.len() != output.len() {
        return Err(FitError::Lengths {
            input: input.len(),
            output: output.len(),
        });
    }
    if let Some(index) =
        (0..input.len()).find(|&k| !(input[k].is_finite() && output[k].is_finite()))
    {
        return Err(FitError::NotFinite { index });
    }
    if input.len() < 2 * unknowns {
        return Err(FitError::TooFewData {
            unknowns,
            data: input.len(),
        });
    }
    Ok(())
}

fn row(y: &[f64], u: &[f64], t: usize, o: &Orders) -> Vec<f64> {
    let past = |x: &[f64], lag: usize| if t >= lag { x[t - lag] } else { 0.0 };
    (1..=o.poles)
        .map(|k| -past(y, k))
        .chain((0..o.inputs).map(|k| past(u, k + o.delay)))
        .collect()
}

fn model(x: &[f64], covariance: &Matrix, rms: f64, o: &Orders, period: f64) -> RecordModel {
    RecordModel {
        a: x[..o.poles].to_vec(),
        b: x[o.poles..].to_vec(),
        sigma: (0..x.len())
            .map(|i| covariance[(i, i)].max(0.0).sqrt())
            .collect(),
        rms,
        delay: o.delay,
        period,
    }
}

/// Least squares on the equation itself (ARX): exact without noise, biased when noise sits on the output.
///
/// # Errors
/// [`FitError`].
pub fn equation_error(
    input: &[f64],
    output: &[f64],
    period: f64,
    orders: &Orders,
) -> Result<RecordModel, FitError> {
    let unknowns = orders.poles + orders.inputs;
    check(input, output, unknowns)?;
    let mut system = Regression::new(unknowns);
    let start = orders.poles.max(orders.delay + orders.inputs);
    for t in start..input.len() {
        system.push(row(output, input, t, orders), output[t]);
    }
    let (x, covariance, rms) = system.solve()?;
    Ok(model(&x, &covariance, rms, orders, period))
}

/// Instrumental variables: the equation weighted by a noise-free copy of its regressors, which takes the bias of
/// [`equation_error`] away. The copy comes from the last model, three times over.
///
/// # Errors
/// [`FitError`].
pub fn instrumental(
    input: &[f64],
    output: &[f64],
    period: f64,
    orders: &Orders,
) -> Result<RecordModel, FitError> {
    const ROUNDS: usize = 3;
    let unknowns = orders.poles + orders.inputs;
    let mut last = equation_error(input, output, period, orders)?;
    let start = orders.poles.max(orders.delay + orders.inputs);
    for _ in 0..ROUNDS {
        let clean = last.simulate(input);
        if clean.iter().any(|v| !v.is_finite()) {
            break;
        }
        let mut left: Matrix = Matrix::zeros(unknowns, unknowns);
        let mut right = Matrix::zeros(unknowns, 1);
        let mut power: Matrix = Matrix::zeros(unknowns, unknowns);
        for t in start..input.len() {
            let z = row(&clean, input, t, orders);
            let phi = row(output, input, t, orders);
            for i in 0..unknowns {
                right[(i, 0)] += z[i] * output[t];
                for j in 0..unknowns {
                    left[(i, j)] += z[i] * phi[j];
                    power[(i, j)] += z[i] * z[j];
                }
            }
        }
        let f = Factored::new(&left)?;
        let x = f.solve(&right);
        let residual: f64 = (start..input.len())
            .map(|t| {
                let phi = row(output, input, t, orders);
                (output[t] - phi.iter().zip(x.entries()).map(|(p, v)| p * v).sum::<f64>()).powi(2)
            })
            .sum();
        let variance = residual / (input.len() - start - unknowns).max(1) as f64;
        let inverse = f.inverse();
        let covariance = (&inverse * power * inverse.transpose()).scaled(variance);
        last = model(x.entries(), &covariance, variance.sqrt(), orders, period);
    }
    Ok(last)
}

/// Output error: the simulated output brought closest to the measured one, the right criterion when noise sits on the
/// output. Starts from [`instrumental`]; damped Gauss–Newton with slopes filtered through the model.
///
/// # Errors
/// [`FitError`].
///
/// ```
/// use meltpath_control::{fit::records::{output_error, Orders}, prbs::Prbs};
/// let u = Prbs::new(8).unwrap().signal(1.0, 2, 600);
/// let mut y = vec![0.0, 0.4 * u[0]];
/// for t in 2..600 { y.push(1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.4 * u[t - 1]); }
/// let m = output_error(&u, &y, 1e-3, &Orders { poles: 2, inputs: 1, delay: 1 }).unwrap();
/// assert!((m.a[1] - 0.7).abs() < 1e-9 && (m.b[0] - 0.4).abs() < 1e-9);
/// ```
pub fn output_error(
    input: &[f64],
    output: &[f64],
    period: f64,
    orders: &Orders,
) -> Result<RecordModel, FitError> {
    const ITERATIONS: usize = 60;
    let unknowns = orders.poles + orders.inputs;
    let mut best = instrumental(input, output, period, orders)?;
    let square = |m: &RecordModel| -> f64 {
        let y = m.simulate(input);
        y.iter().zip(output).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let mut cost = square(&best);
    if !cost.is_finite() {
        // an unstable start cannot be simulated: begin from the input's direct action alone
        best.a.fill(0.0);
        cost = square(&best);
    }
    let mut damping = 1e-6;
    for _ in 0..ITERATIONS {
        let y = best.simulate(input);
        // slopes of the simulated output: −y and u, both through 1/A
        let filter = |x: &[f64]| -> Vec<f64> {
            let inverse = RecordModel {
                b: vec![1.0],
                delay: 0,
                ..best.clone()
            };
            inverse.simulate(x)
        };
        let (sy, su) = (filter(&y), filter(input));
        let mut improved = false;
        while damping < 1e12 {
            let mut system = Regression::new(unknowns);
            let mut sizes = vec![0.0f64; unknowns];
            for t in 0..input.len() {
                let slopes = row(&sy, &su, t, orders);
                for (size, s) in sizes.iter_mut().zip(&slopes) {
                    *size += s * s;
                }
                system.push(slopes, output[t] - y[t]);
            }
            for (j, size) in sizes.iter().enumerate() {
                let level = (damping * size).sqrt();
                system.push((0..unknowns).map(|i| if i == j { level } else { 0.0 }), 0.0);
            }
            let (step, covariance, rms) = system.solve()?;
            let x: Vec<f64> = best
                .a
                .iter()
                .chain(&best.b)
                .zip(&step)
                .map(|(v, s)| v + s)
                .collect();
            let next = model(&x, &covariance, rms, orders, period);
            let fresh = square(&next);
            if fresh.is_finite() && fresh < cost {
                improved = cost - fresh > 1e-12 * cost;
                best = next;
                cost = fresh;
                damping = f64::max(0.1 * damping, 1e-12);
                break;
            }
            damping *= 10.0;
        }
        if !improved {
            break;
        }
    }
    best.rms = (cost / (input.len() - unknowns).max(1) as f64).sqrt();
    // deviations from the undamped slopes at the end
    let y = best.simulate(input);
    let inverse = RecordModel {
        b: vec![1.0],
        delay: 0,
        ..best.clone()
    };
    let (sy, su) = (inverse.simulate(&y), inverse.simulate(input));
    let mut system = Regression::new(unknowns);
    for t in 0..input.len() {
        system.push(row(&sy, &su, t, orders), output[t] - y[t]);
    }
    let (_, covariance, _) = system.solve()?;
    best.sigma = (0..unknowns)
        .map(|i| covariance[(i, i)].max(0.0).sqrt())
        .collect();
    Ok(best)
}

/// How well a prediction meets a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// 1 − |error|/|deviation of the record from its mean|: 1 is perfect, 0 no better than the mean.
    pub fit: f64,
    /// Root mean square error, in the record's unit.
    pub rms: f64,
    /// The error below which 50, 90 and 99 % of the samples lie, in the record's unit.
    pub percentiles: [f64; 3],
    /// Autocorrelation of the error at lags 1…25, 1 being its power.
    pub autocorrelation: Vec<f64>,
    /// The level that 99 % of the autocorrelations of white noise stay below.
    pub confidence: f64,
    /// Share of the lags beyond that level: near 0.01 for a model that explains all but white noise.
    pub coloured: f64,
}

impl Quality {
    /// Compares a prediction with the record it predicts; `None` when lengths differ or fewer than 2 samples are given.
    pub fn of(predicted: &[f64], measured: &[f64]) -> Option<Self> {
        const LAGS: usize = 25;
        let n = measured.len();
        if predicted.len() != n || n < 2 {
            return None;
        }
        let mean = measured.iter().sum::<f64>() / n as f64;
        let error: Vec<f64> = measured.iter().zip(predicted).map(|(m, p)| m - p).collect();
        let power = |x: &mut dyn Iterator<Item = f64>| x.map(|v| v * v).sum::<f64>();
        let left = power(&mut error.iter().copied());
        let spread = power(&mut measured.iter().map(|m| m - mean));
        let mut sorted: Vec<f64> = error.iter().map(|e| e.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted[((share * n as f64) as usize).min(n - 1)];
        let autocorrelation: Vec<f64> = (1..=LAGS.min(n - 1))
            .map(|lag| {
                let sum: f64 = (lag..n).map(|t| error[t] * error[t - lag]).sum();
                if left > 0.0 { sum / left } else { 0.0 }
            })
            .collect();
        let confidence = 2.576 / (n as f64).sqrt();
        let beyond = autocorrelation
            .iter()
            .filter(|r| r.abs() > confidence)
            .count();
        Some(Quality {
            fit: if spread > 0.0 {
                1.0 - (left / spread).sqrt()
            } else {
                f64::NAN
            },
            rms: (left / n as f64).sqrt(),
            percentiles: [at(0.5), at(0.9), at(0.99)],
            coloured: beyond as f64 / autocorrelation.len().max(1) as f64,
            autocorrelation,
            confidence,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prbs::Prbs;
    use crate::random::Random;

    const ORDERS: Orders = Orders {
        poles: 2,
        inputs: 2,
        delay: 1,
    };

    fn bench(seed: u64, count: usize, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let truth = RecordModel {
            a: vec![-1.6, 0.8],
            b: vec![0.3, 0.1],
            sigma: vec![],
            rms: 0.0,
            delay: 1,
            period: 1e-3,
        };
        let mut random = Random::new(seed);
        let u = Prbs::new(11)
            .unwrap()
            .signal(1.0, 1 + seed as usize % 3, count);
        let y = truth
            .simulate(&u)
            .iter()
            .map(|v| v + noise * random.normal())
            .collect();
        (u, y)
    }

    #[test]
    fn bias_and_its_cure() {
        let (u, y) = bench(1, 20_000, 0.3);
        let naive = equation_error(&u, &y, 1e-3, &ORDERS).unwrap();
        let iv = instrumental(&u, &y, 1e-3, &ORDERS).unwrap();
        let oe = output_error(&u, &y, 1e-3, &ORDERS).unwrap();
        let error = |m: &RecordModel| (m.a[0] + 1.6).abs();
        assert!(error(&naive) > 0.05, "{}", error(&naive));
        assert!(
            error(&iv) < 0.01 && error(&oe) < 0.003,
            "{} {}",
            error(&iv),
            error(&oe)
        );
        assert!(
            error(&oe) < 4.0 * oe.sigma[0],
            "{} {}",
            error(&oe),
            oe.sigma[0]
        );
        assert!((oe.rms / 0.3 - 1.0).abs() < 0.02);
    }

    #[test]
    fn judged_on_an_unseen_record() {
        let (u, y) = bench(1, 8000, 0.1);
        let m = output_error(&u, &y, 1e-3, &ORDERS).unwrap();
        let (u2, y2) = bench(2, 8000, 0.1);
        let q = Quality::of(&m.simulate(&u2), &y2).unwrap();
        assert!(
            q.fit > 0.9 && (q.rms / 0.1 - 1.0).abs() < 0.05 && q.coloured <= 0.08,
            "{q:?}"
        );
        // a model of too low an order leaves colour behind
        let poor = output_error(
            &u,
            &y,
            1e-3,
            &Orders {
                poles: 1,
                inputs: 1,
                delay: 1,
            },
        )
        .unwrap();
        assert!(Quality::of(&poor.simulate(&u2), &y2).unwrap().coloured > 0.5);
    }

    #[test]
    fn transfer_function_of_a_model() {
        let m = RecordModel {
            a: vec![-0.5],
            b: vec![1.0, 2.0],
            sigma: vec![],
            rms: 0.0,
            delay: 2,
            period: 0.1,
        };
        let g = m.to_transfer_function().unwrap();
        let z = num_complex::Complex64::cis(0.3);
        let wanted = (z.powi(-2) + 2.0 * z.powi(-3)) / (1.0 - 0.5 / z);
        assert!((g.response(3.0) - wanted).norm() < 1e-13);
        assert_eq!(g.denominator.degree(), 3);
    }
}
