//! The central controller at a level that is reached, and the state in which it is best computed.
//!
//! Formulas: Zhou, Doyle and Glover, theorem 17.1; Rasoanarivo 2020 in the general form of its annex.

use super::error::SynthesisError;
use super::level::{Half, Solved};
use super::normalised::Normalised;
use crate::domain::Domain;
use crate::riccati::refine;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{Factored, symmetric_eigen};

/// The central controller of the scaled problem.
pub(super) fn central(p: &Normalised, solved: &Solved) -> Result<StateSpace, SynthesisError> {
    let gamma = solved.gamma;
    let (m1, m2, p1, p2) = p.sizes();
    let n = p.order();
    let (control, estimation) = (Half::control(p), Half::estimation(p));
    // Newton's step needs a regular Lyapunov equation; without one the Schur solution stands
    let polish = |half: &Half, x: &Matrix| -> Result<Matrix, SynthesisError> {
        let e = half.equation(gamma)?;
        Ok(refine(&e.a, &e.p, &e.q, x).unwrap_or_else(|_| x.clone()))
    };
    let x = polish(&control, &solved.x)?;
    let y = polish(&estimation, &solved.y)?;
    let f = control.gains(gamma, &x)?;
    let l = estimation.gains(gamma, &y)?.transpose();
    let b = Matrix::blocks([[&p.b1, &p.b2]]);
    let f12 = f.block(m1 - p2..m1, 0..n);
    let f2 = f.block(m1..m1 + m2, 0..n);
    let l12 = l.block(0..n, p1 - m2..p1);
    let l2 = l.block(0..n, p1..p1 + p2);

    let d1111 = p.d11.block(0..p1 - m2, 0..m1 - p2);
    let d1112 = p.d11.block(0..p1 - m2, m1 - p2..m1);
    let d1121 = p.d11.block(p1 - m2..p1, 0..m1 - p2);
    let d1122 = p.d11.block(p1 - m2..p1, m1 - p2..m1);
    let square = gamma * gamma;
    let left =
        Factored::new(&(Matrix::identity(p1 - m2).scaled(square) - &d1111 * d1111.transpose()))?;
    let right =
        Factored::new(&(Matrix::identity(m1 - p2).scaled(square) - d1111.transpose() * &d1111))?;
    let d11 = -(&d1121 * d1111.transpose() * left.solve(&d1112)) - &d1122;
    let d12 = cholesky(&(Matrix::identity(m2) - &d1121 * right.solve(&d1121.transpose())));
    let d21 =
        cholesky(&(Matrix::identity(p2) - d1112.transpose() * left.solve(&d1112))).transpose();

    let z = Factored::new(&(Matrix::identity(n) - (&y * &x).scaled(1.0 / square)))?;
    let b2 = z.solve(&((&p.b2 + l12) * &d12));
    let c2 = -(&d21 * (&p.c2 + f12));
    let through_b = &b2 * Factored::new(&d12)?.solve(&d11);
    let b1 = through_b - z.solve(&l2);
    let to_c2 = Factored::new(&d21)?.solve(&c2);
    let c1 = f2 + &d11 * &to_c2;
    let a = &p.a + b * f + &b1 * to_c2;
    Ok(StateSpace::new(a, b1, c1, d11, Domain::Continuous)?)
}

/// The change of state after which control and estimation weigh every direction equally: X and Y equal and diagonal.
///
/// A direction that one of the two does not feel is given a small share of what disturbances and errors could weigh, so
/// that the change of state stays regular; a solution that is zero (rounding apart) plays no part at all.
pub(super) fn balancing_state(p: &Normalised, solved: &Solved) -> Result<Matrix, SynthesisError> {
    const SHARE: f64 = 1e-10;
    let floor = |values: &[f64], natural: f64| -> Vec<f64> {
        let largest = values.iter().fold(natural, |m, v| m.max(v.abs()));
        values.iter().map(|v| v.max(SHARE * largest)).collect()
    };
    let ex = symmetric_eigen(&solved.x)?;
    let root: Vec<f64> = floor(&ex.values, p.c1.norm().powi(2))
        .iter()
        .map(|v| v.sqrt())
        .collect();
    let lx = &ex.vectors * Matrix::diagonal(&root);
    let inverse: Vec<f64> = root.iter().map(|r| 1.0 / r).collect();
    // Y enters with its own floor, before it is seen through X
    let ey = symmetric_eigen(&solved.y)?;
    let y = &ey.vectors
        * Matrix::diagonal(&floor(&ey.values, p.b1.norm().powi(2)))
        * ey.vectors.transpose();
    let both = symmetric_eigen(&(lx.transpose() * y * &lx))?;
    let largest = both.values.iter().fold(0.0f64, |m, v| m.max(*v));
    let stretch: Vec<f64> = both
        .values
        .iter()
        .map(|v| v.max(f64::EPSILON * f64::EPSILON * largest).powf(0.25))
        .collect();
    Ok(&ex.vectors * Matrix::diagonal(&inverse) * &both.vectors * Matrix::diagonal(&stretch))
}

/// Lower triangular root of a symmetric positive matrix; pivots that rounding made negative count as zero's neighbour. It stands here,
/// not in `numerics`: no other room takes such a root, and a general one would refuse those pivots.
fn cholesky(m: &Matrix) -> Matrix {
    let n = m.rows();
    let mut l = Matrix::zeros(n, n);
    for j in 0..n {
        let mut pivot = m[(j, j)];
        for k in 0..j {
            pivot -= l[(j, k)] * l[(j, k)];
        }
        let root = pivot.max(f64::EPSILON * f64::EPSILON).sqrt();
        l[(j, j)] = root;
        for i in j + 1..n {
            let mut sum = m[(i, j)];
            for k in 0..j {
                sum -= l[(i, k)] * l[(j, k)];
            }
            l[(i, j)] = sum / root;
        }
    }
    l
}
