//! Invariant zeros of a state-space system: frequencies at which some input leaves no trace in the output.
//!
//! Reduction by A. Emami-Naeini, P. Van Dooren, "Computation of zeros of linear multivariable systems", Automatica 18
//! (1982) 415–430, down to a square system whose D is invertible.

use num_complex::Complex64;

use crate::SystemError;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{Factored, Singular, eigenvalues};

/// Rank decisions: relative to the norm of the balanced system matrix.
const RANK: f64 = 1e-13;

/// The finite invariant zeros; empty for a system without any (and for a degenerate one, whose every point is a zero).
///
/// # Errors
/// [`SystemError::Dense`].
///
/// ```
/// use meltpath_control::{zeros::invariant_zeros, TransferFunction};
/// let g = TransferFunction::new([1.0, 5.0], [1.0, 3.0, 2.0]).unwrap().to_state_space().unwrap();
/// let z = invariant_zeros(&g).unwrap();
/// assert!(z.len() == 1 && (z[0].re + 5.0).abs() < 1e-12);
/// ```
pub fn invariant_zeros(system: &StateSpace) -> Result<Vec<Complex64>, SystemError> {
    let s = system.balanced_scaling();
    let limit = RANK * s.a.norm().max(s.b.norm()).max(s.c.norm()).max(s.d.norm());
    let once = compress(s.a, s.b, s.c, s.d, limit)?;
    let twice = compress(
        once.0.transpose(),
        once.2.transpose(),
        once.1.transpose(),
        once.3.transpose(),
        limit,
    )?;
    let (a, b, c, d) = twice;
    if a.rows() == 0 {
        return Ok(Vec::new());
    }
    if !d.is_square() {
        return Ok(Vec::new());
    }
    if d.rows() == 0 {
        return Ok(eigenvalues(&a)?);
    }
    let f = Factored::new(&d)?;
    Ok(eigenvalues(&(a - b * f.solve(&c)))?)
}

type Quadruple = (Matrix, Matrix, Matrix, Matrix);

/// Removes states until D has full row rank.
fn compress(
    mut a: Matrix,
    mut b: Matrix,
    mut c: Matrix,
    mut d: Matrix,
    limit: f64,
) -> Result<Quadruple, SystemError> {
    loop {
        let (n, m, p) = (a.rows(), b.columns(), c.rows());
        if p == 0 {
            return Ok((a, b, c, d));
        }
        // rows of D compressed to full rank on top
        let u = if m == 0 {
            None
        } else {
            Some(Singular::new(&d)?)
        };
        let (rank, left) = match &u {
            Some(s) => (
                s.values.iter().filter(|&&v| v > limit).count(),
                s.left.transpose(),
            ),
            None => (0, Matrix::identity(p)),
        };
        if rank == p {
            return Ok((a, b, c, d));
        }
        let turned_c = &left * &c;
        let turned_d = &left * &d;
        let c2 = turned_c.block(rank..p, 0..n);
        let s = Singular::new(&c2)?;
        let lost = s.values.iter().filter(|&&v| v > limit).count();
        if lost == 0 {
            return Ok((
                a,
                b,
                turned_c.block(0..rank, 0..n),
                turned_d.block(0..rank, 0..m),
            ));
        }
        // states in a basis where C2 sees only the last `lost` ones
        let kept = n - lost;
        let v = Matrix::from_fn(n, n, |i, j| s.right[(i, (j + lost) % n)]);
        let va = v.transpose() * &a * &v;
        let vb = v.transpose() * &b;
        let vc = turned_c.block(0..rank, 0..n) * &v;
        let top = (va.block(0..kept, 0..kept), vb.block(0..kept, 0..m));
        let fresh_c =
            Matrix::blocks([[&vc.block(0..rank, 0..kept)], [&va.block(kept..n, 0..kept)]]);
        let fresh_d =
            Matrix::blocks([[&turned_d.block(0..rank, 0..m)], [&vb.block(kept..n, 0..m)]]);
        (a, b) = top;
        c = fresh_c;
        d = fresh_d;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;

    #[test]
    fn zeros_of_transfer_functions() {
        let g = TransferFunction::new([2.0, 4.0, 26.0], [1.0, 10.0, 35.0, 50.0, 24.0]).unwrap();
        let mut z = invariant_zeros(&g.to_state_space().unwrap()).unwrap();
        z.sort_by(|a, b| a.im.total_cmp(&b.im));
        assert_eq!(z.len(), 2);
        assert!((z[1] - Complex64::new(-1.0, 12f64.sqrt())).norm() < 1e-10);
    }

    #[test]
    fn a_plant_with_two_inputs() {
        // classic: G = [1/(s+1) 2/(s+3); 1/(s+1) 1/(s+1)], zero at +1
        let one = |k: f64, p: f64| {
            TransferFunction::new([k], [1.0, p])
                .unwrap()
                .to_state_space()
                .unwrap()
        };
        let top = one(1.0, 1.0)
            .beside(&one(2.0, 3.0))
            .unwrap()
            .then_gain(&Matrix::row([1.0, 1.0]))
            .unwrap();
        let low = one(1.0, 1.0)
            .beside(&one(1.0, 1.0))
            .unwrap()
            .then_gain(&Matrix::row([1.0, 1.0]))
            .unwrap();
        let both = StateSpace::constant(
            Matrix::from_rows([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 1.0]]),
            top.domain,
        )
        .then(&top.beside(&low).unwrap())
        .unwrap();
        let z = invariant_zeros(&both).unwrap();
        assert!(z.iter().any(|z| (z - 1.0).norm() < 1e-9), "{z:?}");
    }
}
