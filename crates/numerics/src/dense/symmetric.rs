//! Eigenvalues and eigenvectors of a symmetric matrix by Jacobi's cyclic rotations.
//!
//! Golub and Van Loan, 8.5: slower than tridiagonal reduction by a constant, but small eigenvalues keep their digits.

use super::DenseError;
use crate::matrix::Matrix;

/// A = V diag(values) Vᵀ, eigenvalues in ascending order.
#[derive(Debug, Clone)]
pub struct Symmetric {
    /// Ascending.
    pub values: Vec<f64>,
    /// One eigenvector a column, orthonormal.
    pub vectors: Matrix,
}

/// Eigenvalues and vectors of the symmetric part of `a`.
///
/// # Errors
/// [`DenseError::NotFinite`], [`DenseError::NotSettled`].
pub fn symmetric_eigen(a: &Matrix) -> Result<Symmetric, DenseError> {
    const SWEEPS: usize = 60;
    if !a.is_finite() {
        return Err(DenseError::NotFinite);
    }
    let n = a.rows();
    let mut s = a.symmetric_part();
    let mut v = Matrix::identity(n);
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                let off = s[(p, q)];
                let small = f64::EPSILON * (s[(p, p)].abs() * s[(q, q)].abs()).sqrt();
                if off.abs() <= small || off.abs() < f64::MIN_POSITIVE {
                    continue;
                }
                turned = true;
                let tau = (s[(q, q)] - s[(p, p)]) / (2.0 * off);
                let t = 1.0f64.copysign(tau) / (tau.abs() + tau.hypot(1.0));
                let cosine = 1.0 / t.hypot(1.0);
                let sine = t * cosine;
                for k in 0..n {
                    let (x, y) = (s[(k, p)], s[(k, q)]);
                    s[(k, p)] = cosine * x - sine * y;
                    s[(k, q)] = sine * x + cosine * y;
                }
                for k in 0..n {
                    let (x, y) = (s[(p, k)], s[(q, k)]);
                    s[(p, k)] = cosine * x - sine * y;
                    s[(q, k)] = sine * x + cosine * y;
                }
                s[(p, q)] = 0.0;
                s[(q, p)] = 0.0;
                for k in 0..n {
                    let (x, y) = (v[(k, p)], v[(k, q)]);
                    v[(k, p)] = cosine * x - sine * y;
                    v[(k, q)] = sine * x + cosine * y;
                }
            }
        }
        if !turned {
            let mut order: Vec<usize> = (0..n).collect();
            order.sort_by(|&i, &j| s[(i, i)].total_cmp(&s[(j, j)]));
            return Ok(Symmetric {
                values: order.iter().map(|&i| s[(i, i)]).collect(),
                vectors: Matrix::from_fn(n, n, |i, j| v[(i, order[j])]),
            });
        }
    }
    Err(DenseError::NotSettled {
        what: "the symmetric eigenvalue iteration",
        size: n,
        sweeps: SWEEPS,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rebuilds((n, v) in (1usize..12).prop_flat_map(|n| (Just(n), proptest::collection::vec(-1.0f64..1.0, n * n)))) {
            let a = Matrix::from_fn(n, n, |i, j| v[i * n + j]).symmetric_part();
            let e = symmetric_eigen(&a).unwrap();
            let rebuilt = &e.vectors * Matrix::diagonal(&e.values) * e.vectors.transpose();
            prop_assert!((rebuilt - &a).norm() < 1e-13 * n as f64);
            prop_assert!(e.values.is_sorted());
        }
    }

    #[test]
    fn graded_matrices_keep_their_small_eigenvalues() {
        // diag(1, 1e-8, 1e-16) scaled from both sides round a well conditioned core
        let core = Matrix::from_rows([[1.0, 0.3, 0.2], [0.3, 1.0, 0.1], [0.2, 0.1, 1.0]]);
        let d = Matrix::diagonal(&[1.0, 1e-8, 1e-16]);
        let values = symmetric_eigen(&(&d * &core * &d)).unwrap().values;
        let product = values[0] * values[1] * values[2];
        let determinant = 0.872 * 1e-48; // det(core) = 1 + 2·0.3·0.1·0.2 − 0.04 − 0.01 − 0.09
        assert!((product / determinant - 1.0).abs() < 1e-12, "{product:e}");
    }
}
