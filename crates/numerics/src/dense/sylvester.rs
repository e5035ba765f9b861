//! Sylvester and Lyapunov equations by Schur forms (Bartels and Stewart), and the discrete Lyapunov equation by doubling.
//!
//! Golub and Van Loan, 7.6.3; R. A. Smith, "Matrix equation XA + BX = C", SIAM J. Appl. Math. 16 (1968) 198–201.

use super::{DenseError, factor::Factored, schur::Schur};
use crate::matrix::Matrix;

/// X with A X + X B = C.
///
/// # Errors
/// [`DenseError::CommonEigenvalue`] when an eigenvalue of A is the opposite of one of B; [`DenseError::NotSettled`], [`DenseError::NotFinite`].
pub fn sylvester(a: &Matrix, b: &Matrix, c: &Matrix) -> Result<Matrix, DenseError> {
    let left = Schur::new(a)?;
    let right = Schur::new(b)?;
    let f = left.vectors.transpose() * c * &right.vectors;
    let y = quasi_triangular(&left, &right, f)?;
    Ok(&left.vectors * y * right.vectors.transpose())
}

/// The symmetric X with A X + X Aᵀ + Q = 0, Q symmetric.
///
/// # Errors
/// [`DenseError::CommonEigenvalue`] when two eigenvalues of A add up to zero; [`DenseError::NotSettled`], [`DenseError::NotFinite`].
///
/// ```
/// use meltpath_numerics::{dense, Matrix};
/// let x = dense::lyapunov(&Matrix::diagonal(&[-1.0, -2.0]), &Matrix::identity(2)).unwrap();
/// assert_eq!(x, Matrix::diagonal(&[0.5, 0.25]));
/// ```
pub fn lyapunov(a: &Matrix, q: &Matrix) -> Result<Matrix, DenseError> {
    let left = Schur::new(a)?;
    let n = a.rows();
    // T Y + Y Tᵀ = F becomes a Sylvester equation with upper factors once the columns are taken in reverse
    let reversed = Schur {
        vectors: Matrix::from_fn(n, n, |i, j| left.vectors[(i, n - 1 - j)]),
        form: Matrix::from_fn(n, n, |i, j| left.form[(n - 1 - j, n - 1 - i)]),
    };
    let f = -(left.vectors.transpose() * q * &reversed.vectors);
    let y = quasi_triangular(&left, &reversed, f)?;
    Ok((&left.vectors * y * reversed.vectors.transpose()).symmetric_part())
}

/// The symmetric X with A X Aᵀ − X + Q = 0, for A with all eigenvalues inside the unit circle.
///
/// # Errors
/// [`DenseError::NotSettled`] when A is not stable, [`DenseError::NotFinite`].
pub fn lyapunov_discrete(a: &Matrix, q: &Matrix) -> Result<Matrix, DenseError> {
    const DOUBLINGS: usize = 60;
    let mut power = a.clone();
    let mut x = q.symmetric_part();
    for _ in 0..DOUBLINGS {
        let step = &power * &x * power.transpose();
        let done = step.norm() <= f64::EPSILON * x.norm();
        x = (&x + &step).symmetric_part();
        if !x.is_finite() {
            break;
        }
        if done {
            return Ok(x);
        }
        power = &power * &power;
    }
    Err(DenseError::NotSettled {
        what: "the discrete Lyapunov sum",
        size: a.rows(),
        sweeps: DOUBLINGS,
    })
}

/// Y with T Y + Y S = F for upper quasi-triangular T and S, block by block from the lower left corner.
fn quasi_triangular(t: &Schur, s: &Schur, f: Matrix) -> Result<Matrix, DenseError> {
    let mut y = f;
    let rows = t.blocks();
    let columns = s.blocks();
    let (t, s) = (&t.form, &s.form);
    let scale = t.largest().max(s.largest());
    for column in &columns {
        for row in rows.iter().rev() {
            let (p, q) = (row.len(), column.len());
            let mut right = Matrix::zeros(p * q, 1);
            let mut system: Matrix = Matrix::zeros(p * q, p * q);
            for i in 0..p {
                for j in 0..q {
                    let (gi, gj) = (row.start + i, column.start + j);
                    let mut sum = y[(gi, gj)];
                    for k in row.end..t.rows() {
                        sum -= t[(gi, k)] * y[(k, gj)];
                    }
                    for k in 0..column.start {
                        sum -= y[(gi, k)] * s[(k, gj)];
                    }
                    right[(i * q + j, 0)] = sum;
                    for k in 0..p {
                        system[(i * q + j, k * q + j)] += t[(gi, row.start + k)];
                    }
                    for k in 0..q {
                        system[(i * q + j, i * q + k)] += s[(column.start + k, gj)];
                    }
                }
            }
            let factored = Factored::new(&system).map_err(|_| DenseError::CommonEigenvalue {
                gap: system.largest(),
            })?;
            if p * q == 1 && system[(0, 0)].abs() <= 1e-3 * f64::EPSILON * scale {
                return Err(DenseError::CommonEigenvalue {
                    gap: system[(0, 0)],
                });
            }
            let x = factored.solve(&right);
            for i in 0..p {
                for j in 0..q {
                    y[(row.start + i, column.start + j)] = x[(i * q + j, 0)];
                }
            }
        }
    }
    Ok(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn solves_sylvester_and_lyapunov((n, m, v) in (1usize..9, 1usize..9).prop_flat_map(|(n, m)| (Just(n), Just(m), proptest::collection::vec(-1.0f64..1.0, n * n + m * m + n * m)))) {
            let shift = |a: Matrix| { let s = a.rows() as f64 + 1.0; a - Matrix::identity(s as usize - 1).scaled(s) };
            let a = shift(Matrix::from_fn(n, n, |i, j| v[i * n + j]));
            let b = shift(Matrix::from_fn(m, m, |i, j| v[n * n + i * m + j]));
            let c = Matrix::from_fn(n, m, |i, j| v[n * n + m * m + i * m + j]);
            let x = sylvester(&a, &b, &c).unwrap();
            prop_assert!((&a * &x + &x * &b - &c).norm() < 1e-12);
            let q = &c * c.transpose();
            let x = lyapunov(&a, &q).unwrap();
            prop_assert!((&a * &x + &x * a.transpose() + &q).norm() < 1e-12);
            let small = a.scaled(1.0 / (2.0 * a.norm()));
            let x = lyapunov_discrete(&small, &q).unwrap();
            prop_assert!((&small * &x * small.transpose() - &x + &q).norm() < 1e-12);
        }
    }

    #[test]
    fn opposite_eigenvalues_are_named() {
        let a = Matrix::diagonal(&[-1.0, 1.0]);
        assert!(matches!(
            lyapunov(&a, &Matrix::identity(2)),
            Err(DenseError::CommonEigenvalue { .. })
        ));
        assert!(lyapunov_discrete(&Matrix::diagonal(&[1.5]), &Matrix::identity(1)).is_err());
    }
}
