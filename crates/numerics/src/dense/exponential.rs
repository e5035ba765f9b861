//! The exponential of a matrix by scaling, Padé approximation of order 13 and squaring.
//!
//! N. J. Higham, "The scaling and squaring method for the matrix exponential revisited", SIAM Review 51 (2009) 747–764.

use super::{DenseError, balance, factor::solve};
use crate::matrix::Matrix;

/// Largest 1-norm for which the Padé approximant of order 13 is exact to double precision (Higham 2009, table 10.2).
const PADE_13_REACH: f64 = 5.371_920_351_148_152;

/// exp(A) of a square matrix, balanced first.
///
/// # Errors
/// [`DenseError::NotFinite`] on infinite entries or overflow, [`DenseError::Singular`] never in exact arithmetic.
///
/// ```
/// use meltpath_numerics::{dense, Matrix};
/// let turn = dense::exponential(&Matrix::from_rows([[0.0, -1.0], [1.0, 0.0]])).unwrap();
/// assert!((turn[(0, 0)] - 1f64.cos()).abs() < 1e-15 && (turn[(1, 0)] - 1f64.sin()).abs() < 1e-15);
/// ```
pub fn exponential(a: &Matrix) -> Result<Matrix, DenseError> {
    if !a.is_finite() {
        return Err(DenseError::NotFinite);
    }
    let n = a.rows();
    let (balanced, scale) = balance(a);
    let norm = (0..n)
        .map(|j| (0..n).map(|i| balanced[(i, j)].abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let squarings = if norm > PADE_13_REACH {
        (norm / PADE_13_REACH).log2().ceil() as i32
    } else {
        0
    };
    let x = balanced.scaled(0.5f64.powi(squarings));
    let mut e = pade_13(&x)?;
    for _ in 0..squarings {
        e = &e * &e;
    }
    let out = Matrix::from_fn(n, n, |i, j| e[(i, j)] * scale[i] / scale[j]);
    if out.is_finite() {
        Ok(out)
    } else {
        Err(DenseError::NotFinite)
    }
}

fn pade_13(x: &Matrix) -> Result<Matrix, DenseError> {
    // coefficients of the [13/13] approximant: c_k = (26 − k)! 13! / (26! k! (13 − k)!)
    let mut c = [1.0; 14];
    for k in 1..14 {
        c[k] = c[k - 1] * (14 - k) as f64 / ((27 - k) * k) as f64;
    }
    let identity = Matrix::identity(x.rows());
    let x2 = x * x;
    let x4 = &x2 * &x2;
    let x6 = &x4 * &x2;
    let combine = |c0: f64, c2: f64, c4: f64, c6: f64| {
        identity.scaled(c0) + x2.scaled(c2) + x4.scaled(c4) + x6.scaled(c6)
    };
    let odd = x * (combine(c[1], c[3], c[5], c[7]) + &x6 * combine(0.0, c[9], c[11], c[13]));
    let even = combine(c[0], c[2], c[4], c[6]) + &x6 * combine(0.0, c[8], c[10], c[12]);
    solve(&(&even - &odd), &(&even + &odd))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_exponentials() {
        // nilpotent: exact polynomial
        let e = exponential(&Matrix::from_rows([
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0],
        ]))
        .unwrap();
        assert!(
            (e - Matrix::from_rows([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])).norm()
                < 1e-15
        );
        // wide spread of rates needs squaring
        let e = exponential(&Matrix::from_rows([[-1000.0, 1e6], [0.0, -0.5]])).unwrap();
        let coupling = 1e6 / 999.5 * ((-0.5f64).exp() - (-1000f64).exp());
        // squaring ten times multiplies rounding by about a thousand
        assert!((e[(0, 1)] / coupling - 1.0).abs() < 1e-10);
        assert!((e[(1, 1)] - (-0.5f64).exp()).abs() < 1e-11);
    }

    #[test]
    fn inverse_is_the_exponential_of_the_opposite() {
        let a = Matrix::from_fn(6, 6, |i, j| ((i * 7 + j * 3) as f64 * 0.37).sin() * 3.0);
        let product = exponential(&a).unwrap() * exponential(&-&a).unwrap();
        assert!((product - Matrix::identity(6)).norm() < 1e-9);
    }
}
