//! Singular values and vectors by Jacobi rotations of the columns (one-sided), accurate for small singular values too.
//!
//! Golub and Van Loan, 8.6.3; J. Demmel, K. Veselić, "Jacobi's method is more accurate than QR", SIAM J. Matrix Anal. 13
//! (1992) 1204–1245.

use super::DenseError;
use crate::matrix::{ComplexMatrix, Matrix};

/// A = U diag(values) Vᵀ with U and V square and orthogonal, singular values in descending order.
#[derive(Debug, Clone)]
pub struct Singular {
    /// rows x rows.
    pub left: Matrix,
    /// Descending; as many as the smaller dimension.
    pub values: Vec<f64>,
    /// columns x columns.
    pub right: Matrix,
}

impl Singular {
    /// The decomposition of any real matrix.
    ///
    /// # Errors
    /// [`DenseError::NotFinite`], [`DenseError::NotSettled`].
    pub fn new(a: &Matrix) -> Result<Self, DenseError> {
        if a.rows() < a.columns() {
            let t = Singular::new(&a.transpose())?;
            return Ok(Singular {
                left: t.right,
                values: t.values,
                right: t.left,
            });
        }
        let (m, n) = (a.rows(), a.columns());
        let (columns, turns) = rotate_columns(&a.transpose())?;
        // rows of `columns` are σ·uᵀ, rows of `turns` are vᵀ
        let mut values: Vec<f64> = (0..n).map(|j| length(columns.row_slice(j))).collect();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| values[j].total_cmp(&values[i]));
        let right = Matrix::from_fn(n, n, |i, j| turns[(order[j], i)]);
        let left = complete(&columns, &order, &values, m);
        values.sort_by(|x, y| y.total_cmp(x));
        Ok(Singular {
            left,
            values,
            right,
        })
    }

    /// How many singular values exceed `tolerance` times the largest.
    pub fn rank(&self, tolerance: f64) -> usize {
        let limit = tolerance * self.values.first().copied().unwrap_or(0.0);
        self.values.iter().filter(|&&s| s > limit).count()
    }
}

/// The singular values in descending order.
///
/// # Errors
/// [`DenseError::NotFinite`], [`DenseError::NotSettled`].
pub fn singular_values(a: &Matrix) -> Result<Vec<f64>, DenseError> {
    let tall = if a.rows() < a.columns() {
        a.clone()
    } else {
        a.transpose()
    };
    let (columns, _) = rotate_columns(&tall)?;
    let mut values: Vec<f64> = (0..columns.rows())
        .map(|j| length(columns.row_slice(j)))
        .collect();
    values.sort_by(|x, y| y.total_cmp(x));
    Ok(values)
}

/// The largest singular value of a complex matrix: the largest gain over all directions. Infinite entries give infinity.
pub fn largest_singular_value(a: &ComplexMatrix) -> f64 {
    if !a.is_finite() {
        return f64::INFINITY;
    }
    if a.rows() == 1 || a.columns() == 1 {
        return a.norm();
    }
    singular_values(&real_twin(a)).map_or(f64::INFINITY, |s| s.first().copied().unwrap_or(0.0))
}

/// The smallest singular value of a complex matrix; infinite for one without entries.
///
/// # Errors
/// [`DenseError::NotFinite`], [`DenseError::NotSettled`].
pub fn smallest_singular_value(a: &ComplexMatrix) -> Result<f64, DenseError> {
    let values = singular_values(&real_twin(a))?;
    Ok(values.last().copied().unwrap_or(f64::INFINITY))
}

/// [Re −Im; Im Re], which has each singular value of the complex matrix twice.
fn real_twin(a: &ComplexMatrix) -> Matrix {
    let (m, n) = (a.rows(), a.columns());
    Matrix::from_fn(2 * m, 2 * n, |i, j| {
        let z = a[(i % m, j % n)];
        match (i < m, j < n) {
            (true, true) | (false, false) => z.re,
            (true, false) => -z.im,
            (false, true) => z.im,
        }
    })
}

fn length(row: &[f64]) -> f64 {
    let largest = row.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest
        * row
            .iter()
            .map(|x| (x / largest).powi(2))
            .sum::<f64>()
            .sqrt()
}

/// Turns the rows of `rows` against each other until they are orthogonal; returns them and the turns applied.
fn rotate_columns(rows: &Matrix) -> Result<(Matrix, Matrix), DenseError> {
    const SWEEPS: usize = 60;
    if !rows.is_finite() {
        return Err(DenseError::NotFinite);
    }
    let n = rows.rows();
    let mut w = rows.clone();
    let mut v = Matrix::identity(n);
    let tiny = f64::EPSILON * f64::EPSILON * rows.norm();
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                let (x, y) = (length(w.row_slice(p)), length(w.row_slice(q)));
                if x <= tiny || y <= tiny {
                    continue;
                }
                let cosine_between: f64 = w
                    .row_slice(p)
                    .iter()
                    .zip(w.row_slice(q))
                    .map(|(a, b)| (a / x) * (b / y))
                    .sum();
                if cosine_between.abs() <= 4.0 * f64::EPSILON {
                    continue;
                }
                turned = true;
                let tau = (y / x - x / y) / (2.0 * cosine_between);
                let t = 1.0f64.copysign(tau) / (tau.abs() + tau.hypot(1.0));
                let cosine = 1.0 / t.hypot(1.0);
                turn(&mut w, p, q, cosine, t * cosine);
                turn(&mut v, p, q, cosine, t * cosine);
            }
        }
        if !turned {
            return Ok((w, v));
        }
    }
    Err(DenseError::NotSettled {
        what: "the singular value iteration",
        size: n,
        sweeps: SWEEPS,
    })
}

fn turn(m: &mut Matrix, p: usize, q: usize, cosine: f64, sine: f64) {
    for k in 0..m.columns() {
        let (x, y) = (m[(p, k)], m[(q, k)]);
        m[(p, k)] = cosine * x - sine * y;
        m[(q, k)] = sine * x + cosine * y;
    }
}

/// Left singular vectors, completed to an orthonormal basis of m dimensions.
fn complete(columns: &Matrix, order: &[usize], values: &[f64], m: usize) -> Matrix {
    let largest = values.iter().fold(0.0f64, |a, &b| a.max(b));
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(m);
    for &j in order {
        if values[j] > f64::EPSILON * f64::EPSILON * largest && values[j] > 0.0 {
            basis.push(columns.row_slice(j).iter().map(|x| x / values[j]).collect());
        }
    }
    // axes fill what is left, the one least covered first
    while basis.len() < m {
        let covered = |axis: usize| -> f64 { basis.iter().map(|b| b[axis] * b[axis]).sum() };
        let mut axis = 0;
        for candidate in 1..m {
            if covered(candidate) < covered(axis) {
                axis = candidate;
            }
        }
        let mut fresh = vec![0.0; m];
        fresh[axis] = 1.0;
        for _ in 0..2 {
            for b in &basis {
                let dot: f64 = b.iter().zip(&fresh).map(|(x, y)| x * y).sum();
                for (f, x) in fresh.iter_mut().zip(b) {
                    *f -= dot * x;
                }
            }
        }
        let norm = length(&fresh);
        basis.push(fresh.iter().map(|x| x / norm).collect());
    }
    Matrix::from_fn(m, m, |i, j| basis[j][i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rebuilds((m, n, v) in (1usize..8, 1usize..8).prop_flat_map(|(m, n)| (Just(m), Just(n), proptest::collection::vec(-1.0f64..1.0, m * n)))) {
            let a = Matrix::from_fn(m, n, |i, j| v[i * n + j]);
            let s = Singular::new(&a).unwrap();
            let middle = Matrix::from_fn(m, n, |i, j| if i == j { s.values[i] } else { 0.0 });
            prop_assert!((&s.left * middle * s.right.transpose() - &a).norm() < 1e-13);
            prop_assert!((s.left.transpose() * &s.left - Matrix::identity(m)).norm() < 1e-13);
            prop_assert!((s.right.transpose() * &s.right - Matrix::identity(n)).norm() < 1e-13);
        }
    }

    #[test]
    fn smallest_of_a_complex_matrix() {
        let i = Complex64::i();
        let a = ComplexMatrix::from_fn(3, 2, |row, column| match (row, column) {
            (0, 0) => 3.0 * i,
            (1, 1) => 2.0 - i,
            _ => Complex64::ZERO,
        });
        assert!((smallest_singular_value(&a).unwrap() - 5f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn a_row_of_zeros_is_left_as_it_is() {
        let s = Singular::new(&Matrix::from_rows([[0.0, 0.0], [3.0, 4.0]])).unwrap();
        assert!((s.values[0] - 5.0).abs() < 1e-15 && s.values[1] == 0.0);
        assert!(s.left.is_finite() && s.right.is_finite());
    }

    #[test]
    fn rank_of_a_dependent_matrix() {
        let s = Singular::new(&Matrix::from_rows([[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]])).unwrap();
        assert_eq!(s.rank(1e-12), 1);
        assert!((s.values[0] - 70f64.sqrt()).abs() < 1e-13);
        assert_eq!(Singular::new(&Matrix::zeros(2, 3)).unwrap().rank(1e-12), 0);
    }

    #[test]
    fn complex_gain() {
        let i = Complex64::i();
        let one = Complex64::new(1.0, 0.0);
        let a = ComplexMatrix::from_rows([[one, i], [i, one]]);
        assert!((largest_singular_value(&a) - 2f64.sqrt()).abs() < 1e-14);
    }
}
