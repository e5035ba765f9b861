//! Diagonal scaling by powers of two so that rows and columns of a matrix weigh the same (no rounding at all).
//!
//! B. N. Parlett, C. Reinsch, "Balancing a matrix for calculation of eigenvalues", Numer. Math. 13 (1969) 293–304, with the
//! 2-norm of R. James, J. Langou, B. R. Lowery, arXiv:1401.5766.

use crate::matrix::Matrix;

/// D⁻¹ A D and the diagonal of D.
pub fn balance(a: &Matrix) -> (Matrix, Vec<f64>) {
    let n = a.rows();
    let mut b = a.clone();
    let scale = balance_by(n, |i, factor| {
        let (mut row, mut column) = (0.0f64, 0.0f64);
        for k in (0..n).filter(|&k| k != i) {
            row += b[(i, k)] * b[(i, k)];
            column += b[(k, i)] * b[(k, i)];
        }
        if let Some(f) = factor {
            for k in 0..n {
                b[(i, k)] /= f;
            }
            for k in 0..n {
                b[(k, i)] *= f;
            }
        }
        (row.sqrt(), column.sqrt())
    });
    (b, scale)
}

/// Repeats sweeps over the states until no exchange of weight between the row and the column of a state pays.
/// `visit(i, None)` returns the norms of row and column i; `visit(i, Some(f))` divides the row and multiplies the column by f.
pub fn balance_by(
    states: usize,
    mut visit: impl FnMut(usize, Option<f64>) -> (f64, f64),
) -> Vec<f64> {
    const SWEEPS: usize = 100;
    let mut scale = vec![1.0f64; states];
    for _ in 0..SWEEPS {
        let mut changed = false;
        for (i, total) in scale.iter_mut().enumerate() {
            let (row, column) = visit(i, None);
            if row == 0.0 || column == 0.0 || !row.is_finite() || !column.is_finite() {
                continue;
            }
            let f = (row / column).sqrt().log2().round().exp2();
            let after = (row / f).hypot(column * f);
            if f != 1.0 && f.is_finite() && f > 0.0 && after < 0.95 * row.hypot(column) {
                visit(i, Some(f));
                *total *= f;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_states_share_their_weight_evenly() {
        let (b, d) = balance(&Matrix::from_rows([[0.0, 256.0], [0.0625, 0.0]]));
        assert_eq!((b[(0, 1)], b[(1, 0)]), (4.0, 4.0));
        assert_eq!(d, [64.0, 1.0]);
    }

    /// An exchange that gains less than a twentieth is left.
    #[test]
    fn what_hardly_pays_is_left() {
        let a = Matrix::from_rows([[0.0, 2.1], [1.0, 0.0]]);
        let (b, d) = balance(&a);
        assert_eq!(d, [1.0, 1.0]);
        assert_eq!((b[(0, 1)], b[(1, 0)]), (2.1, 1.0));
    }

    #[test]
    fn evens_out_and_keeps_the_similarity() {
        let a = Matrix::from_rows([[1.0, 1e8, 0.0], [1e-8, 2.0, 1e-5], [3.0, 1e9, 4.0]]);
        let (b, d) = balance(&a);
        assert!(b.norm() < 1e-4 * a.norm());
        for i in 0..3 {
            for j in 0..3 {
                assert_eq!(b[(i, j)], a[(i, j)] * d[j] / d[i]);
            }
        }
    }
}
