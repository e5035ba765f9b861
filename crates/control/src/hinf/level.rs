//! Whether a level γ can be reached: the two Riccati equations, their signs, and how they go together.
//!
//! Zhou, Doyle and Glover, chapter 17 (with direct terms); the conditions of Rasoanarivo 2020, 3.2.

use num_complex::Complex64;

use super::error::{Obstacle, SynthesisError};
use super::normalised::Normalised;
use crate::dense::{Factored, eigenvalues, singular_values, symmetric_eigen};
use crate::matrix::Matrix;
use crate::riccati::{self, RiccatiError};

/// Both Riccati solutions at a level.
#[derive(Debug, Clone)]
pub(super) struct Solved {
    pub gamma: f64,
    pub x: Matrix,
    pub y: Matrix,
    /// ρ(XY)/γ²: below one when the level is reached.
    pub coupling: f64,
}

/// A Riccati equation X A + Aᵀ X − X P X + Q = 0.
pub(super) struct Equation {
    pub a: Matrix,
    pub p: Matrix,
    pub q: Matrix,
    /// The positive part of P: what commands (or measurements) achieve.
    control: Matrix,
}

/// The smallest level that direct terms allow.
pub(super) fn direct_floor(p: &Normalised) -> Result<f64, SynthesisError> {
    let (m1, m2, p1, p2) = p.sizes();
    let first = |m: Matrix| -> Result<f64, SynthesisError> {
        Ok(singular_values(&m)?.first().copied().unwrap_or(0.0))
    };
    let rows = first(p.d11.block(0..p1 - m2, 0..m1))?;
    let columns = first(p.d11.block(0..p1, 0..m1 - p2))?;
    Ok(rows.max(columns))
}

/// [D11 D12] and its weight R = D1•ᵀD1• − diag(γ² I, 0), or their duals.
fn weight(direct: &Matrix, disturbances: usize, gamma: f64) -> Matrix {
    let mut r = direct.transpose() * direct;
    for i in 0..disturbances {
        r[(i, i)] -= gamma * gamma;
    }
    r
}

pub(super) fn control_direct(p: &Normalised) -> Matrix {
    let (_, m2, p1, _) = p.sizes();
    let d12 = Matrix::from_fn(p1, m2, |i, j| f64::from(u8::from(i == p1 - m2 + j)));
    Matrix::blocks([[&p.d11, &d12]])
}

pub(super) fn estimation_direct(p: &Normalised) -> Matrix {
    let (m1, _, _, p2) = p.sizes();
    let d21 = Matrix::from_fn(p2, m1, |i, j| f64::from(u8::from(j == m1 - p2 + i)));
    Matrix::blocks([[&p.d11], [&d21]])
}

/// The control equation, and the weight's factors for the gains.
pub(super) fn control(p: &Normalised, gamma: f64) -> Result<(Equation, Factored), SynthesisError> {
    let b = Matrix::blocks([[&p.b1, &p.b2]]);
    equation(&p.a, &b, &p.c1, &control_direct(p), p.b1.columns(), gamma)
}

/// The estimation equation: the control equation of the dual.
pub(super) fn estimation(
    p: &Normalised,
    gamma: f64,
) -> Result<(Equation, Factored), SynthesisError> {
    let c = Matrix::blocks([[&p.c1], [&p.c2]]);
    equation(
        &p.a.transpose(),
        &c.transpose(),
        &p.b1.transpose(),
        &estimation_direct(p).transpose(),
        p.c1.rows(),
        gamma,
    )
}

fn equation(
    a: &Matrix,
    b: &Matrix,
    c: &Matrix,
    direct: &Matrix,
    disturbances: usize,
    gamma: f64,
) -> Result<(Equation, Factored), SynthesisError> {
    let r = weight(direct, disturbances, gamma);
    let f = Factored::new(&r)?;
    let parts = symmetric_eigen(&r)?;
    let positive: Vec<f64> = parts
        .values
        .iter()
        .map(|&v| if v > 0.0 { v.sqrt().recip() } else { 0.0 })
        .collect();
    let half = b * &parts.vectors * Matrix::diagonal(&positive);
    let dc = direct.transpose() * c;
    let q = c.transpose() * c - dc.transpose() * f.solve(&dc);
    Ok((
        Equation {
            a: a - b * f.solve(&dc),
            p: (b * f.solve(&b.transpose())).symmetric_part(),
            q: q.symmetric_part(),
            control: &half * half.transpose(),
        },
        f,
    ))
}

/// Tries a level. The inner result is the obstacle, with the coupling when both equations were solved.
pub(super) fn attempt(
    p: &Normalised,
    gamma: f64,
) -> Result<Result<Solved, (Obstacle, Option<f64>)>, SynthesisError> {
    let floor = direct_floor(p)?;
    if gamma <= floor {
        return Ok(Err((Obstacle::DirectGain { floor }, None)));
    }
    let solve = |e: &Equation| riccati::continuous(&e.a, &e.p, &e.q);
    let (equation, _) = control(p, gamma)?;
    let x = match solve(&equation) {
        Ok(x) => x,
        Err(RiccatiError::Dense(error)) => return Err(error.into()),
        Err(error) => return Ok(Err((Obstacle::control(error, p.unit), None))),
    };
    if let Some(mode) = unstable_mode(&equation, &x)? {
        let mode = mode * p.unit;
        return Ok(Err((Obstacle::ControlIndefinite { mode }, None)));
    }
    let (equation, _) = estimation(p, gamma)?;
    let y = match solve(&equation) {
        Ok(y) => y,
        Err(RiccatiError::Dense(error)) => return Err(error.into()),
        Err(error) => return Ok(Err((Obstacle::estimation(error, p.unit), None))),
    };
    if let Some(mode) = unstable_mode(&equation, &y)? {
        let mode = mode * p.unit;
        return Ok(Err((Obstacle::EstimationIndefinite { mode }, None)));
    }
    let radius = eigenvalues(&(&x * &y))?
        .iter()
        .map(|e| e.re)
        .fold(0.0, f64::max);
    let coupling = radius / (gamma * gamma);
    if coupling >= 1.0 {
        return Ok(Err((Obstacle::SpectralRadius { radius }, Some(coupling))));
    }
    Ok(Ok(Solved {
        gamma,
        x,
        y,
        coupling,
    }))
}

/// Both solutions far above any level that matters, without judging their signs: they show which states control and
/// estimation weigh, and serve to choose coordinates. `None` when an equation has no solution.
pub(super) fn relaxed(p: &Normalised) -> Option<Solved> {
    const FAR: f64 = 1e6;
    let gamma = FAR * direct_floor(p).ok()?.max(1.0);
    let solve = |e: &Equation| riccati::continuous(&e.a, &e.p, &e.q).ok();
    Some(Solved {
        gamma,
        x: solve(&control(p, gamma).ok()?.0)?,
        y: solve(&estimation(p, gamma).ok()?.0)?,
        coupling: 0.0,
    })
}

/// A mode that shows that a stabilising solution is not positive semidefinite; `None` when it is.
///
/// With P = P⁺ − P⁻, both positive, the solution obeys a Lyapunov equation of A − P⁺X with a positive right side (Q ≥ 0 above
/// the direct floor): it is positive exactly when A − P⁺X is stable. Unlike a look at the eigenvalues of X, this does not
/// depend on the scaling of the states.
fn unstable_mode(e: &Equation, x: &Matrix) -> Result<Option<Complex64>, SynthesisError> {
    let closed = &e.a - &e.control * x;
    let worst = eigenvalues(&closed)?
        .into_iter()
        .max_by(|a, b| a.re.total_cmp(&b.re));
    Ok(worst.filter(|mode| mode.re >= 0.0))
}
