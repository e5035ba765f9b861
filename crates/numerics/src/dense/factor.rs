//! Gaussian elimination with partial pivoting, and the reflections of which orthogonal factors are made (Householder).

use super::DenseError;
use crate::matrix::{Matrix, Scalar};

/// The triangular factors of a square matrix with exchanged rows, ready to solve systems.
#[derive(Debug, Clone)]
pub struct Factored<T = f64> {
    lu: Matrix<T>,
    order: Vec<usize>,
}

impl<T: Scalar> Factored<T> {
    /// Factors a square matrix.
    ///
    /// # Errors
    /// [`DenseError::Singular`] when a pivot is exactly zero or drowns in rounding, [`DenseError::NotFinite`].
    ///
    /// # Panics
    /// When the matrix is not square: a bug of the caller.
    pub fn new(a: &Matrix<T>) -> Result<Self, DenseError> {
        let n = a.rows();
        assert!(a.is_square(), "only a square matrix has an inverse");
        if !a.is_finite() {
            return Err(DenseError::NotFinite);
        }
        let mut lu = a.clone();
        let mut order: Vec<usize> = (0..n).collect();
        // pivots are chosen and judged with every row seen in its own size, so that a badly scaled but regular matrix passes
        let mut size: Vec<f64> = (0..n)
            .map(|i| {
                a.row_slice(i)
                    .iter()
                    .fold(0.0, |m: f64, x| m.max(x.modulus()))
            })
            .map(|m| if m > 0.0 { m } else { 1.0 })
            .collect();
        let scale: Vec<f64> = (0..n)
            .map(|j| (0..n).fold(0.0, |m: f64, i| m.max(a[(i, j)].modulus() / size[i])))
            .collect();
        for k in 0..n {
            let (best, share) = (k..n)
                .map(|i| (i, lu[(i, k)].modulus() / size[i]))
                .fold((k, -1.0), |b, c| if c.1 > b.1 { c } else { b });
            if share <= f64::EPSILON * f64::EPSILON * scale[k] || share == 0.0 {
                return Err(DenseError::Singular {
                    column: k,
                    size: n,
                    pivot: lu[(best, k)].modulus(),
                });
            }
            size.swap(k, best);
            lu.swap_rows(k, best);
            order.swap(k, best);
            let top: Vec<T> = lu.row_slice(k).to_vec();
            for i in k + 1..n {
                let row = lu.row_slice_mut(i);
                let factor = row[k] / top[k];
                row[k] = factor;
                if factor != T::default() {
                    for j in k + 1..n {
                        row[j] = row[j] - factor * top[j];
                    }
                }
            }
        }
        Ok(Factored { lu, order })
    }

    /// Solves A X = B.
    pub fn solve(&self, b: &Matrix<T>) -> Matrix<T> {
        let n = self.lu.rows();
        let mut x = Matrix::from_fn(n, b.columns(), |i, j| b[(self.order[i], j)]);
        for i in 0..n {
            for k in 0..i {
                let factor = self.lu[(i, k)];
                eliminate(&mut x, i, k, factor);
            }
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                let factor = self.lu[(i, k)];
                eliminate(&mut x, i, k, factor);
            }
            let pivot = self.lu[(i, i)];
            for value in x.row_slice_mut(i) {
                *value = *value / pivot;
            }
        }
        x
    }

    /// The inverse.
    pub fn inverse(&self) -> Matrix<T> {
        self.solve(&Matrix::identity(self.lu.rows()))
    }

    /// Ratio of the largest to the smallest pivot: a cheap sign of bad conditioning.
    pub fn pivot_ratio(&self) -> f64 {
        let pivots = (0..self.lu.rows()).map(|i| self.lu[(i, i)].modulus());
        let (low, high) = pivots.fold((f64::INFINITY, 0.0f64), |(l, h), p| (l.min(p), h.max(p)));
        if self.lu.rows() == 0 { 1.0 } else { high / low }
    }
}

fn eliminate<T: Scalar>(x: &mut Matrix<T>, i: usize, k: usize, factor: T) {
    if factor != T::default() {
        for j in 0..x.columns() {
            x[(i, j)] = x[(i, j)] - factor * x[(k, j)];
        }
    }
}

/// Solves A X = B for a square A.
///
/// # Errors
/// [`DenseError::Singular`], [`DenseError::NotFinite`].
///
/// ```
/// use meltpath_numerics::{dense, Matrix};
/// let a = Matrix::from_rows([[2.0, 1.0], [1.0, 3.0]]);
/// let x = dense::solve(&a, &Matrix::column([3.0, 4.0])).unwrap();
/// assert!((x[(0, 0)] - 1.0).abs() < 1e-15 && (x[(1, 0)] - 1.0).abs() < 1e-15);
/// ```
pub fn solve<T: Scalar>(a: &Matrix<T>, b: &Matrix<T>) -> Result<Matrix<T>, DenseError> {
    Ok(Factored::new(a)?.solve(b))
}

/// I − β v vᵀ, which sends a given vector onto the first axis.
pub(crate) struct Reflector {
    v: Vec<f64>,
    beta: f64,
}

impl Reflector {
    /// `None` when the vector already lies on the first axis.
    pub(crate) fn new(x: &[f64]) -> Option<Self> {
        let scale = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if scale == 0.0 || x[1..].iter().all(|&v| v == 0.0) {
            return None;
        }
        let mut v: Vec<f64> = x.iter().map(|value| value / scale).collect();
        let norm = v.iter().map(|value| value * value).sum::<f64>().sqrt();
        v[0] += norm.copysign(v[0]);
        let beta = 2.0 / v.iter().map(|value| value * value).sum::<f64>();
        Some(Reflector { v, beta })
    }

    /// Rows `top..` of the given columns.
    pub(crate) fn apply_left(&self, a: &mut Matrix, top: usize, columns: std::ops::Range<usize>) {
        let mut rows = a
            .rows_mut(top..top + self.v.len())
            .map(|row| &mut row[columns.clone()]);
        // along the rows, which lie together in memory; each column's sum is taken in the same order however many rows there are
        match self.v[..] {
            [v0, v1] => {
                let [Some(x), Some(y)] = [rows.next(), rows.next()] else {
                    return;
                };
                for (x, y) in x.iter_mut().zip(y) {
                    let factor = self.beta * (v0 * *x + v1 * *y);
                    *x -= factor * v0;
                    *y -= factor * v1;
                }
            }
            [v0, v1, v2] => {
                let [Some(x), Some(y), Some(z)] = [rows.next(), rows.next(), rows.next()] else {
                    return;
                };
                for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
                    let factor = self.beta * (v0 * *x + v1 * *y + v2 * *z);
                    *x -= factor * v0;
                    *y -= factor * v1;
                    *z -= factor * v2;
                }
            }
            _ => {
                let mut factors = vec![0.0; columns.len()];
                let mut rows: Vec<_> = rows.collect();
                for (row, v) in rows.iter().zip(&self.v) {
                    for (factor, x) in factors.iter_mut().zip(row.iter()) {
                        *factor += v * x;
                    }
                }
                for factor in &mut factors {
                    *factor *= self.beta;
                }
                for (row, v) in rows.iter_mut().zip(&self.v) {
                    for (factor, x) in factors.iter().zip(row.iter_mut()) {
                        *x -= factor * v;
                    }
                }
            }
        }
    }

    /// Columns `left..` of the given rows.
    pub(crate) fn apply_right(&self, a: &mut Matrix, left: usize, rows: std::ops::Range<usize>) {
        let columns = left..left + self.v.len();
        let rows = a.rows_mut(rows).map(|row| &mut row[columns.clone()]);
        match self.v[..] {
            [v0, v1, v2] => {
                for row in rows {
                    if let [x, y, z] = row {
                        let factor = self.beta * (*x * v0 + *y * v1 + *z * v2);
                        *x -= factor * v0;
                        *y -= factor * v1;
                        *z -= factor * v2;
                    }
                }
            }
            _ => {
                for row in rows {
                    let dot: f64 = row.iter().zip(&self.v).map(|(x, v)| x * v).sum();
                    let factor = self.beta * dot;
                    for (x, v) in row.iter_mut().zip(&self.v) {
                        *x -= factor * v;
                    }
                }
            }
        }
    }
}
