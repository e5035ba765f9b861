//! Models fitted to data: rational functions and physical models to frequency responses, difference equations to records.
//!
//! Every fit returns standard deviations; [`records::Quality`] judges a model on a record it has not seen.

pub mod frequency;
pub mod nonlinear;
pub mod records;

pub use nonlinear::{Fit, least_squares};
pub use records::{Orders, Quality, RecordModel};

use crate::SystemError;
use crate::dense::DenseError;
use crate::dense::factor::Reflector;
use crate::matrix::Matrix;

/// Why a fit does not succeed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// More unknowns than the data can tell.
    #[error(
        "{unknowns} unknowns cannot be found from {data} data: lower the orders or record more"
    )]
    TooFewData {
        /// Number of unknowns.
        unknowns: usize,
        /// Number of (real) data.
        data: usize,
    },
    /// Two records differ in length.
    #[error("the input record has {input} samples, the output record {output}")]
    Lengths {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
    },
    /// The data do not excite every unknown.
    #[error(
        "the data leave unknown {index} (counted from 0) undetermined: excite the system more, or lower the orders"
    )]
    Undetermined {
        /// Which unknown.
        index: usize,
    },
    /// The residual is not finite at the starting point.
    #[error("the model's residual is infinite or not a number at the starting point")]
    Start,
    /// A datum is not finite.
    #[error("datum {index} is infinite or not a number")]
    NotFinite {
        /// Which datum.
        index: usize,
    },
    /// A system could not be built.
    #[error(transparent)]
    System(#[from] SystemError),
    /// A matrix computation failed.
    #[error(transparent)]
    Dense(#[from] DenseError),
}

/// Linear least squares fed row by row: only the triangle of the factorisation is kept, so that records of any length fit
/// in memory.
#[derive(Debug, Clone)]
pub(crate) struct Regression {
    unknowns: usize,
    pending: Vec<f64>,
    triangle: Matrix,
    rows: usize,
}

/// Rows gathered before they are folded into the triangle.
const FOLD: usize = 256;

impl Regression {
    pub(crate) fn new(unknowns: usize) -> Self {
        Regression {
            unknowns,
            pending: Vec::new(),
            triangle: Matrix::zeros(0, unknowns + 1),
            rows: 0,
        }
    }

    /// One equation: regressors · unknowns = value.
    pub(crate) fn push(&mut self, regressors: impl IntoIterator<Item = f64>, value: f64) {
        self.pending.extend(regressors);
        self.pending.push(value);
        self.rows += 1;
        if self.pending.len() >= FOLD * (self.unknowns + 1) {
            self.fold();
        }
    }

    fn fold(&mut self) {
        let width = self.unknowns + 1;
        let fresh = self.pending.len() / width;
        let old = self.triangle.rows();
        let mut stack = Matrix::from_fn(old + fresh, width, |i, j| {
            if i < old {
                self.triangle[(i, j)]
            } else {
                self.pending[(i - old) * width + j]
            }
        });
        self.pending.clear();
        for k in 0..width.min(stack.rows()) {
            let column: Vec<f64> = (k..stack.rows()).map(|i| stack[(i, k)]).collect();
            if let Some(reflector) = Reflector::new(&column) {
                reflector.apply_left(&mut stack, k, k..width);
                for i in k + 1..stack.rows() {
                    stack[(i, k)] = 0.0;
                }
            }
        }
        self.triangle = stack.block(0..width.min(stack.rows()), 0..width);
    }

    /// The unknowns, their covariance, and the root mean square residual (degrees of freedom taken off).
    pub(crate) fn solve(mut self) -> Result<(Vec<f64>, Matrix, f64), FitError> {
        self.fold();
        let n = self.unknowns;
        if self.rows < n || self.triangle.rows() < n {
            return Err(FitError::TooFewData {
                unknowns: n,
                data: self.rows,
            });
        }
        let norms: Vec<f64> = (0..n)
            .map(|j| {
                (0..=j)
                    .map(|i| self.triangle[(i, j)].powi(2))
                    .sum::<f64>()
                    .sqrt()
            })
            .collect();
        for (index, norm) in norms.iter().enumerate() {
            if self.triangle[(index, index)].abs() <= 1e-12 * norm || *norm == 0.0 {
                return Err(FitError::Undetermined { index });
            }
        }
        let back = |right: &mut [f64]| {
            for i in (0..n).rev() {
                for k in i + 1..n {
                    right[i] -= self.triangle[(i, k)] * right[k];
                }
                right[i] /= self.triangle[(i, i)];
            }
        };
        let mut solution: Vec<f64> = (0..n).map(|i| self.triangle[(i, n)]).collect();
        back(&mut solution);
        let left = if self.triangle.rows() > n {
            self.triangle[(n, n)].powi(2)
        } else {
            0.0
        };
        let variance = left / (self.rows - n).max(1) as f64;
        // covariance σ² R⁻¹R⁻ᵀ, column by column of the inverse
        let mut inverse = Matrix::zeros(n, n);
        for j in 0..n {
            let mut e = vec![0.0; n];
            e[j] = 1.0;
            back(&mut e);
            for (i, v) in e.into_iter().enumerate() {
                inverse[(i, j)] = v;
            }
        }
        let covariance = (&inverse * inverse.transpose()).scaled(variance);
        Ok((solution, covariance, variance.sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding_changes_nothing() {
        // y = 2 − 3 t + 0.5 t² exactly, over more rows than one fold
        let mut r = Regression::new(3);
        for k in 0..1000 {
            let t = f64::from(k) * 0.01;
            r.push([1.0, t, t * t], 2.0 - 3.0 * t + 0.5 * t * t);
        }
        let (x, _, rms) = r.solve().unwrap();
        assert!(
            (x[0] - 2.0).abs() < 1e-11
                && (x[1] + 3.0).abs() < 1e-11
                && (x[2] - 0.5).abs() < 1e-12
                && rms < 1e-12
        );
    }

    #[test]
    fn an_idle_unknown_is_named() {
        let mut r = Regression::new(2);
        for k in 0..10 {
            r.push([f64::from(k), 2.0 * f64::from(k)], 1.0);
        }
        assert_eq!(r.solve().unwrap_err(), FitError::Undetermined { index: 1 });
    }
}
