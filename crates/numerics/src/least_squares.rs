//! Least squares: linear, fed equation by equation, and nonlinear on top of it.
//!
//! Orthogonal triangular factors by Householder reflections, never the normal equations, which square the condition:
//! G. H. Golub, C. F. Van Loan, "Matrix Computations", 4th ed., section 5.3.

mod nonlinear;

pub use nonlinear::{Fit, fit};

use crate::dense::Reflector;
use crate::matrix::Matrix;

/// Why unknowns cannot be found from data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LeastSquaresError {
    /// More unknowns than the data can tell.
    #[error(
        "{unknowns} unknowns cannot be found from {data} data: use fewer unknowns or more data"
    )]
    TooFewData {
        /// Number of unknowns.
        unknowns: usize,
        /// Number of (real) data.
        data: usize,
    },
    /// The data say nothing of an unknown that they do not say of those before it.
    #[error(
        "the data leave unknown {index} (counted from 0) undetermined: vary more in the data, or use fewer unknowns"
    )]
    Undetermined {
        /// Which unknown.
        index: usize,
    },
    /// The residual is not finite at the starting point.
    #[error("the model's residual is infinite or not a number at the starting point")]
    Start,
}

/// What linear least squares found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The unknowns.
    pub values: Vec<f64>,
    /// Inverse of the normal matrix: the covariance of the unknowns where each equation has a standard deviation of one.
    pub spread: Matrix,
    /// Variance of one equation, from what is left, degrees of freedom taken off.
    pub variance: f64,
}

impl Solution {
    /// Standard deviations of the unknowns, from what is left of the equations.
    pub fn sigma(&self) -> Vec<f64> {
        (0..self.values.len())
            .map(|i| (self.spread[(i, i)] * self.variance).sqrt())
            .collect()
    }
}

/// Linear least squares fed equation by equation: only the triangle of the factors is kept, so that records of any length
/// fit in memory.
///
/// ```
/// use meltpath_numerics::least_squares::Regression;
/// let mut line = Regression::new(2);
/// for (x, y) in [(0.0, 1.1), (1.0, 2.9), (2.0, 5.1), (3.0, 6.9)] { line.push([1.0, x], y); }
/// let found = line.solve().unwrap();
/// assert!((found.values[0] - 1.06).abs() < 1e-12 && (found.values[1] - 1.96).abs() < 1e-12);
/// ```
#[derive(Debug, Clone)]
pub struct Regression {
    unknowns: usize,
    pending: Vec<f64>,
    triangle: Matrix,
    rows: usize,
}

/// Rows gathered before they are folded into the triangle.
const FOLD: usize = 256;

impl Regression {
    /// No equation yet.
    pub fn new(unknowns: usize) -> Self {
        Regression {
            unknowns,
            pending: Vec::new(),
            triangle: Matrix::zeros(0, unknowns + 1),
            rows: 0,
        }
    }

    /// One equation: regressors · unknowns = value.
    pub fn push(&mut self, regressors: impl IntoIterator<Item = f64>, value: f64) {
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

    /// The equations folded into as few as say the same: row k is without the unknowns before k, so rows from k on are what is said
    /// of the others where the first k are free. The last column is the right side.
    pub fn triangle(mut self) -> Matrix {
        self.fold();
        self.triangle
    }

    /// The unknowns that leave the least sum of squares.
    ///
    /// # Errors
    /// [`LeastSquaresError::TooFewData`], [`LeastSquaresError::Undetermined`].
    pub fn solve(mut self) -> Result<Solution, LeastSquaresError> {
        self.fold();
        let n = self.unknowns;
        if self.rows < n || self.triangle.rows() < n {
            return Err(LeastSquaresError::TooFewData {
                unknowns: n,
                data: self.rows,
            });
        }
        for index in 0..n {
            let norm = (0..=index)
                .map(|i| self.triangle[(i, index)].powi(2))
                .sum::<f64>()
                .sqrt();
            // not true of numbers that are not finite either
            let told = self.triangle[(index, index)].abs() > 1e-12 * norm;
            if !told {
                return Err(LeastSquaresError::Undetermined { index });
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
        let mut values: Vec<f64> = (0..n).map(|i| self.triangle[(i, n)]).collect();
        back(&mut values);
        let left = if self.triangle.rows() > n {
            self.triangle[(n, n)].powi(2)
        } else {
            0.0
        };
        // R⁻¹R⁻ᵀ, column by column of the inverse
        let mut inverse = Matrix::zeros(n, n);
        for j in 0..n {
            let mut e = vec![0.0; n];
            e[j] = 1.0;
            back(&mut e);
            for (i, v) in e.into_iter().enumerate() {
                inverse[(i, j)] = v;
            }
        }
        Ok(Solution {
            values,
            spread: &inverse * inverse.transpose(),
            variance: left / (self.rows - n).max(1) as f64,
        })
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
        let found = r.solve().unwrap();
        let x = &found.values;
        assert!(
            (x[0] - 2.0).abs() < 1e-11
                && (x[1] + 3.0).abs() < 1e-11
                && (x[2] - 0.5).abs() < 1e-12
                && found.variance < 1e-24
        );
    }

    #[test]
    fn what_is_free_in_each_piece_leaves_the_common_unknown() {
        // two pieces with an offset of their own and one common slope: eliminated piece by piece, and solved at once
        let y = |piece: usize, t: f64| 3.0 * piece as f64 - 1.5 * t + 0.01 * (7.0 * t).sin();
        let (mut all, mut common) = (Regression::new(3), Regression::new(1));
        for piece in 0..2 {
            let mut own = Regression::new(2);
            for k in 0..300 {
                let t = f64::from(k) * 0.01;
                own.push([1.0, t], y(piece, t));
                let offset = |p: usize| if p == piece { 1.0 } else { 0.0 };
                all.push([offset(0), offset(1), t], y(piece, t));
            }
            let left = own.triangle();
            for i in 1..left.rows() {
                common.push([left[(i, 1)]], left[(i, 2)]);
            }
        }
        let (all, common) = (all.solve().unwrap(), common.solve().unwrap());
        assert!((all.values[2] - common.values[0]).abs() < 1e-12);
        assert!((all.spread[(2, 2)] / common.spread[(0, 0)] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn an_idle_unknown_is_named() {
        let mut r = Regression::new(2);
        for k in 0..10 {
            r.push([f64::from(k), 2.0 * f64::from(k)], 1.0);
        }
        assert_eq!(
            r.solve().unwrap_err(),
            LeastSquaresError::Undetermined { index: 1 }
        );
    }
}
