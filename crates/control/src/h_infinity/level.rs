//! Whether a level γ can be reached: the two Riccati equations, their signs, and how they go together.
//!
//! Zhou, Doyle and Glover, chapter 17 (with direct terms); the conditions of Rasoanarivo 2020, 3.2.

use num_complex::Complex64;

use super::error::{Obstacle, SynthesisError};
use super::normalised::Normalised;
use crate::riccati::{self, RiccatiError};
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{Factored, eigenvalues, singular_values};

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

/// One of the two halves of the problem: the best command against the worst disturbance, every state known; or, on the
/// dual, the best estimate. Errors are split into those a command reaches directly ("own", with gain one) and the others.
pub(super) struct Half {
    a: Matrix,
    disturbance: Matrix,
    command: Matrix,
    other: Matrix,
    own: Matrix,
    other_direct: Matrix,
    own_direct: Matrix,
}

impl Half {
    pub(super) fn control(p: &Normalised) -> Self {
        let (m1, m2, p1, _) = p.sizes();
        let n = p.order();
        let cut = p1 - m2;
        Half {
            a: p.a.clone(),
            disturbance: p.b1.clone(),
            command: p.b2.clone(),
            other: p.c1.block(0..cut, 0..n),
            own: p.c1.block(cut..p1, 0..n),
            other_direct: p.d11.block(0..cut, 0..m1),
            own_direct: p.d11.block(cut..p1, 0..m1),
        }
    }

    pub(super) fn estimation(p: &Normalised) -> Self {
        let (m1, _, p1, p2) = p.sizes();
        let n = p.order();
        let cut = m1 - p2;
        Half {
            a: p.a.transpose(),
            disturbance: p.c1.transpose(),
            command: p.c2.transpose(),
            other: p.b1.block(0..n, 0..cut).transpose(),
            own: p.b1.block(0..n, cut..m1).transpose(),
            other_direct: p.d11.block(0..p1, 0..cut).transpose(),
            own_direct: p.d11.block(0..p1, cut..m1).transpose(),
        }
    }

    /// γ² I − D_oᵀ D_o, positive above the direct floor.
    fn reserve(&self, gamma: f64) -> Result<Factored, SynthesisError> {
        let d = &self.other_direct;
        let square = Matrix::identity(d.columns()).scaled(gamma * gamma);
        Ok(Factored::new(&(square - d.transpose() * d))?)
    }

    /// Disturbances as they act once the command has cancelled its own errors.
    fn left(&self) -> Matrix {
        &self.disturbance - &self.command * &self.own_direct
    }

    /// The Riccati equation. The command is eliminated by hand: the textbook form with the inverse of the full, indefinite
    /// weight subtracts nearly equal matrices.
    pub(super) fn equation(&self, gamma: f64) -> Result<Equation, SynthesisError> {
        let s = self.reserve(gamma)?;
        let left = self.left();
        let through = s.solve(&(self.other_direct.transpose() * &self.other));
        let control = &self.command * self.command.transpose();
        let worst = &left * s.solve(&left.transpose());
        Ok(Equation {
            a: &self.a - &self.command * &self.own + &left * &through,
            p: (&control - worst).symmetric_part(),
            q: (self.other.transpose() * (&self.other + &self.other_direct * through))
                .symmetric_part(),
            control,
        })
    }

    /// The worst disturbance and the best command as gains on the state, for a solution X: rows (disturbance; command).
    pub(super) fn gains(&self, gamma: f64, x: &Matrix) -> Result<Matrix, SynthesisError> {
        let felt = self.other_direct.transpose() * &self.other + self.left().transpose() * x;
        let worst = self.reserve(gamma)?.solve(&felt);
        let best = -(&self.own + &self.own_direct * &worst + self.command.transpose() * x);
        Ok(Matrix::blocks([[&worst], [&best]]))
    }
}

/// The solution of one half at a level, for a `unit` of frequencies in rad/s; the inner result is the obstacle.
fn solution(
    half: &Half,
    (gamma, unit): (f64, f64),
    none: impl Fn(RiccatiError) -> Obstacle,
    indefinite: impl Fn(Complex64) -> Obstacle,
) -> Result<Result<Matrix, Obstacle>, SynthesisError> {
    let equation = half.equation(gamma)?;
    let x = match riccati::continuous(&equation.a, &equation.p, &equation.q) {
        Ok(x) => x,
        Err(RiccatiError::Dense(error)) => return Err(error.into()),
        Err(error) => return Ok(Err(none(error))),
    };
    Ok(match unstable_mode(&equation, &x)? {
        Some(mode) => Err(indefinite(mode * unit)),
        None => Ok(x),
    })
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
    let none = |error| Obstacle::control(error, p.unit);
    let indefinite = |mode| Obstacle::ControlIndefinite { mode };
    let x = match solution(&Half::control(p), (gamma, p.unit), none, indefinite)? {
        Ok(x) => x,
        Err(obstacle) => return Ok(Err((obstacle, None))),
    };
    let none = |error| Obstacle::estimation(error, p.unit);
    let indefinite = |mode| Obstacle::EstimationIndefinite { mode };
    let y = match solution(&Half::estimation(p), (gamma, p.unit), none, indefinite)? {
        Ok(y) => y,
        Err(obstacle) => return Ok(Err((obstacle, None))),
    };
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
        x: solve(&Half::control(p).equation(gamma).ok()?)?,
        y: solve(&Half::estimation(p).equation(gamma).ok()?)?,
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
