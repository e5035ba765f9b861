//! Continuous algebraic Riccati equations: ordered Schur form of the balanced Hamiltonian, refined by Newton.
//!
//! A. J. Laub, IEEE Trans. Automatic Control 24 (1979) 913–921; symplectic balancing after P. Benner, "Symplectic balancing
//! of Hamiltonian matrices", SIAM J. Sci. Comput. 22 (2001) 1885–1904.

use meltpath_numerics::Matrix;
use meltpath_numerics::dense::balance::balance_by;
use meltpath_numerics::dense::{DenseError, Factored, Schur, lyapunov};

/// Why no stabilising solution was found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RiccatiError {
    /// The Hamiltonian has eigenvalues on the imaginary axis.
    #[error(
        "no stabilising solution: the Hamiltonian has an eigenvalue on the imaginary axis near {omega} rad/s"
    )]
    OnAxis {
        /// Frequency of the eigenvalue closest to the axis, in the time unit of the equation.
        omega: f64,
    },
    /// The stable subspace has no solution matrix.
    #[error(
        "no solution: the stable subspace is not a graph (the solution is infinite in some direction)"
    )]
    Infinite,
    /// A matrix computation failed.
    #[error(transparent)]
    Dense(#[from] DenseError),
}

/// Asymmetry of a computed solution above which its subspace was not the stable one of a Hamiltonian.
const ASYMMETRY: f64 = 1e-5;
/// Solutions below this, in balanced states, are rounding: their symmetry says nothing.
const NOTHING: f64 = 1e-10;

/// The symmetric X with X A + Aᵀ X − X P X + Q = 0 that makes A − P X stable. P and Q are symmetric, of any sign.
///
/// # Errors
/// [`RiccatiError`].
///
/// ```
/// use meltpath_control::{riccati, Matrix};
/// // ẋ = u, cost ∫ (x² + u²): X = 1
/// let x = riccati::continuous(&Matrix::zeros(1, 1), &Matrix::identity(1), &Matrix::identity(1)).unwrap();
/// assert!((x[(0, 0)] - 1.0).abs() < 1e-15);
/// ```
pub fn continuous(a: &Matrix, p: &Matrix, q: &Matrix) -> Result<Matrix, RiccatiError> {
    let n = a.rows();
    if n == 0 {
        return Ok(Matrix::zeros(0, 0));
    }
    let (a, p, q, scale) = balanced(a, p, q);
    let hamiltonian = Matrix::blocks([[&a, &-&p], [&-&q, &-a.transpose()]]);
    let mut schur = Schur::new(&hamiltonian)?;
    let nearest = schur
        .eigenvalues()
        .into_iter()
        .min_by(|x, y| x.re.abs().total_cmp(&y.re.abs()))
        .map_or(0.0, |e| e.im.abs());
    if schur.order(|e| e.re < 0.0) != n {
        return Err(RiccatiError::OnAxis { omega: nearest });
    }
    let u1 = schur.vectors.block(0..n, 0..n);
    let u2 = schur.vectors.block(n..2 * n, 0..n);
    // X U1 = U2
    let f = Factored::new(&u1.transpose()).map_err(|_| RiccatiError::Infinite)?;
    let x = f.solve(&u2.transpose());
    if !x.is_finite() {
        return Err(RiccatiError::Infinite);
    }
    if (&x - x.transpose()).norm() > ASYMMETRY * x.norm() + NOTHING {
        return Err(RiccatiError::OnAxis { omega: nearest });
    }
    let x = x.symmetric_part();
    Ok(Matrix::from_fn(n, n, |i, j| {
        x[(i, j)] / (scale[i] * scale[j])
    }))
}

/// X A + Aᵀ X − X P X + Q.
pub fn residual(a: &Matrix, p: &Matrix, q: &Matrix, x: &Matrix) -> Matrix {
    let xa = x * a;
    (&xa + xa.transpose() - x * p * x + q).symmetric_part()
}

/// A solution brought closer by Newton's method, as long as the residual falls.
///
/// # Errors
/// [`DenseError`] when A − P X has eigenvalues of opposite sign.
pub fn refine(a: &Matrix, p: &Matrix, q: &Matrix, x: &Matrix) -> Result<Matrix, DenseError> {
    const STEPS: usize = 3;
    let mut best = x.clone();
    let mut left = residual(a, p, q, &best);
    for _ in 0..STEPS {
        let closed = a - p * &best;
        let step = lyapunov(&closed.transpose(), &left)?;
        let next = (&best + step).symmetric_part();
        let after = residual(a, p, q, &next);
        if after.norm() >= 0.5 * left.norm() || !after.is_finite() {
            break;
        }
        best = next;
        left = after;
    }
    Ok(best)
}

/// T⁻¹AT, T⁻¹PT⁻¹, TQT and the diagonal of T, powers of two that even out the Hamiltonian.
fn balanced(a: &Matrix, p: &Matrix, q: &Matrix) -> (Matrix, Matrix, Matrix, Vec<f64>) {
    let n = a.rows();
    let (mut a, mut p, mut q) = (a.clone(), p.clone(), q.clone());
    let scale = balance_by(n, |i, factor| {
        if let Some(f) = factor {
            for k in 0..n {
                a[(i, k)] /= f;
                p[(i, k)] /= f;
                q[(i, k)] *= f;
            }
            for k in 0..n {
                a[(k, i)] *= f;
                p[(k, i)] /= f;
                q[(k, i)] *= f;
            }
        }
        // the diagonals of P and Q move with the square of the factor and stay out of the balance only when zero
        let mut row = p[(i, i)].powi(2);
        let mut column = q[(i, i)].powi(2);
        for k in (0..n).filter(|&k| k != i) {
            row += a[(i, k)].powi(2) + p[(i, k)].powi(2);
            column += a[(k, i)].powi(2) + q[(k, i)].powi(2);
        }
        (row.sqrt(), column.sqrt())
    });
    (a, p, q, scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::dense::eigenvalues;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn solves_and_stabilises((n, v, decades) in (1usize..8).prop_flat_map(|n| (Just(n), proptest::collection::vec(-1.0f64..1.0, n * n + 2 * n), proptest::collection::vec(-3.0f64..3.0, n)))) {
            // random regulators in badly scaled states
            let t = Matrix::diagonal(&decades.iter().map(|d| 10f64.powf(*d)).collect::<Vec<_>>());
            let ti = Matrix::diagonal(&decades.iter().map(|d| 10f64.powf(-*d)).collect::<Vec<_>>());
            let a = &ti * Matrix::from_fn(n, n, |i, j| v[i * n + j]) * &t;
            let b = &ti * Matrix::from_fn(n, 1, |i, _| v[n * n + i]);
            let q = &t * Matrix::identity(n) * &t;
            let p = &b * b.transpose();
            if let Ok(x) = continuous(&a, &p, &q) {
                let x = refine(&a, &p, &q, &x).unwrap();
                let scaled = &ti * residual(&a, &p, &q, &x) * &ti;
                let size = (&ti * &x * &ti).norm();
                prop_assert!(scaled.norm() < 1e-11 * (1.0 + size * size), "{} {}", scaled.norm(), size);
                prop_assert!(eigenvalues(&(&a - &p * &x)).unwrap().iter().all(|e| e.re < 0.0));
            }
        }
    }

    #[test]
    fn eigenvalues_on_the_axis_are_reported() {
        // no control, marginal oscillator: the Hamiltonian has ±j twice
        let a = Matrix::from_rows([[0.0, 1.0], [-1.0, 0.0]]);
        let error = continuous(&a, &Matrix::zeros(2, 2), &Matrix::identity(2)).unwrap_err();
        assert!(matches!(error, RiccatiError::OnAxis { omega } if (omega - 1.0).abs() < 1e-6));
    }
}
