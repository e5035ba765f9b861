//! The theory's assumptions, checked before anything is solved, each violation with its mode or frequency.
//!
//! Rasoanarivo 2020, H1–H4 (3.10); Popov–Belevitch–Hautus tests on the scaled problem.

use num_complex::Complex64;

use super::error::{Assumption, SynthesisError};
use super::normalised::Normalised;
use meltpath_numerics::dense::{DenseError, eigenvalues, smallest_singular_value};
use meltpath_numerics::{ComplexMatrix, Matrix};

/// Distance from rank loss, relative to the matrix, below which a mode is out of reach.
const REACH: f64 = 1e-11;
/// Distance from the imaginary axis, relative to the mode or the time unit, below which a mode lies on it.
const AXIS: f64 = 1e-10;

pub(super) fn check(p: &Normalised) -> Result<(), SynthesisError> {
    let (m1, m2, p1, p2) = p.sizes();
    let n = p.order();
    let at = p.a.transpose();
    if let Some(mode) = out_of_reach(&p.a, &p.b2, |e| e.re >= -AXIS * e.norm().max(AXIS))? {
        return Err(SynthesisError::Assumption(Assumption::Stabilisable {
            mode: mode * p.unit,
        }));
    }
    if let Some(mode) = out_of_reach(&at, &p.c2.transpose(), |e| {
        e.re >= -AXIS * e.norm().max(AXIS)
    })? {
        return Err(SynthesisError::Assumption(Assumption::Detectable {
            mode: mode * p.unit,
        }));
    }
    let on_axis = |e: Complex64| e.re.abs() <= AXIS * e.norm().max(1e-2);
    // zeros from commands to errors: modes left unseen by the other errors once the command cancels its own
    let own = p.c1.block(p1 - m2..p1, 0..n);
    let others = p.c1.block(0..p1 - m2, 0..n);
    let kept = &p.a - &p.b2 * own;
    if let Some(mode) = out_of_reach(&kept.transpose(), &others.transpose(), on_axis)? {
        return Err(SynthesisError::Assumption(Assumption::CommandZero {
            omega: mode.im.abs() * p.unit,
        }));
    }
    let own = p.b1.block(0..n, m1 - p2..m1);
    let others = p.b1.block(0..n, 0..m1 - p2);
    let kept = &p.a - own * &p.c2;
    if let Some(mode) = out_of_reach(&kept, &others, on_axis)? {
        return Err(SynthesisError::Assumption(Assumption::MeasurementZero {
            omega: mode.im.abs() * p.unit,
        }));
    }
    Ok(())
}

/// The first eigenvalue of A that concerns us and for which [A − λ I, B] loses rank.
fn out_of_reach(
    a: &Matrix,
    b: &Matrix,
    concerns: impl Fn(Complex64) -> bool,
) -> Result<Option<Complex64>, DenseError> {
    let n = a.rows();
    let scale = a.norm().max(b.norm());
    for mode in eigenvalues(a)?
        .into_iter()
        .filter(|&e| e.im >= 0.0 && concerns(e))
    {
        let m = b.columns();
        let pencil = ComplexMatrix::from_fn(n, n + m, |i, j| {
            if j < n {
                Complex64::new(a[(i, j)], 0.0) - if i == j { mode } else { Complex64::default() }
            } else {
                Complex64::new(b[(i, j - n)], 0.0)
            }
        });
        if smallest_singular_value(&pencil)? <= REACH * scale {
            return Ok(Some(mode));
        }
    }
    Ok(None)
}
