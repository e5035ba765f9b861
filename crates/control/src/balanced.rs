//! Balanced states and smaller models: what is hard to reach and hard to see is left out.
//!
//! B. C. Moore, IEEE Trans. Automatic Control 26 (1981) 17–32; square-root computation; Zhou, Doyle and Glover, chapter 7.
//! The error of a model truncated at order r is at most twice the sum of the Hankel singular values left out.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::domain::Domain;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{
    Factored, Schur, Singular, lyapunov, lyapunov_discrete, sylvester, symmetric_eigen,
};

/// A stable system in balanced states, strongest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Balanced {
    /// The balanced system; states that cannot be reached or seen are gone.
    pub system: StateSpace,
    /// Its Hankel singular values, descending, one a state.
    pub hankel: Vec<f64>,
}

/// What happens to the states left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reduction {
    /// Dropped: exact at infinite frequency.
    Truncate,
    /// Put at rest: exact at zero frequency.
    Residualise,
}

/// The reachability and observability Gramians of a stable system.
///
/// # Errors
/// [`SystemError::Unstable`], [`SystemError::Dense`].
fn gramians(system: &StateSpace) -> Result<(Matrix, Matrix), SystemError> {
    if let Some(&pole) = system.poles()?.iter().find(|&&p| !system.domain.decays(p)) {
        return Err(SystemError::Unstable {
            pole,
            need: "Gramians exist for stable systems; split the unstable part off first",
        });
    }
    let bb = &system.b * system.b.transpose();
    let cc = system.c.transpose() * &system.c;
    Ok(match system.domain {
        Domain::Continuous => (
            lyapunov(&system.a, &bb)?,
            lyapunov(&system.a.transpose(), &cc)?,
        ),
        Domain::Sampled { .. } => (
            lyapunov_discrete(&system.a, &bb)?,
            lyapunov_discrete(&system.a.transpose(), &cc)?,
        ),
    })
}

/// L with L Lᵀ = a positive semidefinite matrix.
fn root(gramian: &Matrix) -> Result<Matrix, SystemError> {
    let e = symmetric_eigen(gramian)?;
    let scale: Vec<f64> = e.values.iter().map(|v| v.max(0.0).sqrt()).collect();
    Ok(&e.vectors * Matrix::diagonal(&scale))
}

impl Balanced {
    /// Balances a stable system.
    ///
    /// # Errors
    /// [`SystemError::Unstable`], [`SystemError::Dense`].
    pub fn new(system: &StateSpace) -> Result<Self, SystemError> {
        const NEGLIGIBLE: f64 = 1e-13;
        let system = system.balanced_scaling();
        let (p, q) = gramians(&system)?;
        let (lp, lq) = (root(&p)?, root(&q)?);
        let s = Singular::new(&(lq.transpose() * &lp))?;
        let largest = s.values.first().copied().unwrap_or(0.0);
        let kept = s
            .values
            .iter()
            .filter(|&&v| v > NEGLIGIBLE * largest && v > 0.0)
            .count();
        let n = system.order();
        let inverse: Vec<f64> = s.values[..kept].iter().map(|v| 1.0 / v.sqrt()).collect();
        let right = &lp * s.right.block(0..n, 0..kept) * Matrix::diagonal(&inverse);
        let left =
            Matrix::diagonal(&inverse) * s.left.block(0..n, 0..kept).transpose() * lq.transpose();
        Ok(Balanced {
            system: StateSpace {
                a: &left * &system.a * &right,
                b: &left * &system.b,
                c: &system.c * &right,
                d: system.d.clone(),
                domain: system.domain,
            },
            hankel: s.values[..kept].to_vec(),
        })
    }

    /// The model of the first `order` states.
    ///
    /// # Errors
    /// [`SystemError::Dense`] when the states left out cannot be put at rest.
    pub fn reduced(&self, order: usize, reduction: Reduction) -> Result<StateSpace, SystemError> {
        let s = &self.system;
        let (n, r) = (s.order(), order.min(s.order()));
        let (a11, b1, c1) = (
            s.a.block(0..r, 0..r),
            s.b.block(0..r, 0..s.inputs()),
            s.c.block(0..s.outputs(), 0..r),
        );
        match reduction {
            Reduction::Truncate => StateSpace::new(a11, b1, c1, s.d.clone(), s.domain),
            Reduction::Residualise => {
                let rest = n - r;
                let at_rest = match s.domain {
                    Domain::Continuous => -s.a.block(r..n, r..n),
                    Domain::Sampled { .. } => Matrix::identity(rest) - s.a.block(r..n, r..n),
                };
                let f = Factored::new(&at_rest)?;
                let to_a = f.solve(&s.a.block(r..n, 0..r));
                let to_b = f.solve(&s.b.block(r..n, 0..s.inputs()));
                let a12 = s.a.block(0..r, r..n);
                let c2 = s.c.block(0..s.outputs(), r..n);
                StateSpace::new(
                    a11 + &a12 * &to_a,
                    b1 + a12 * &to_b,
                    c1 + &c2 * to_a,
                    &s.d + c2 * to_b,
                    s.domain,
                )
            }
        }
    }

    /// Upper bound on the largest gain of the error of a model of `order` states.
    fn error_bound(&self, order: usize) -> f64 {
        2.0 * self.hankel.iter().skip(order).sum::<f64>()
    }
}

/// A system as the sum of the part whose poles satisfy `first` (with the direct gain) and the rest. A conjugate pair goes
/// one way together.
///
/// # Errors
/// [`SystemError::Dense`] when the two groups of poles touch.
pub fn split(
    system: &StateSpace,
    first: impl Fn(Complex64) -> bool,
) -> Result<(StateSpace, StateSpace), SystemError> {
    let s = system.balanced_scaling();
    let n = s.order();
    let mut schur = Schur::new(&s.a)?;
    let k = schur.order(&first);
    let t = &schur.form;
    let (t11, t12, t22) = (
        t.block(0..k, 0..k),
        t.block(0..k, k..n),
        t.block(k..n, k..n),
    );
    // [I X; 0 I] removes the coupling: T11 X − X T22 = −T12
    let x = sylvester(&t11, &-&t22, &-&t12)?;
    let ub = schur.vectors.transpose() * &s.b;
    let cu = &s.c * &schur.vectors;
    let (b1, b2) = (ub.block(0..k, 0..s.inputs()), ub.block(k..n, 0..s.inputs()));
    let (c1, c2) = (
        cu.block(0..s.outputs(), 0..k),
        cu.block(0..s.outputs(), k..n),
    );
    let one = StateSpace::new(t11, b1 - &x * &b2, c1.clone(), s.d.clone(), s.domain)?;
    let two = StateSpace::new(
        t22,
        b2,
        c2 + c1 * x,
        Matrix::zeros(s.outputs(), s.inputs()),
        s.domain,
    )?;
    Ok((one, two))
}

/// A smaller model of any system: poles that do not decay are kept exactly, the others reduced in balanced states to
/// `order` in all. Returns the model and the bound on its error.
///
/// # Errors
/// [`SystemError::Range`] when more poles do not decay than `order`, [`SystemError::Dense`].
///
/// ```
/// use meltpath_control::{balanced::{reduce, Reduction}, TransferFunction};
/// // a controller with an integrator and a far pole nobody notices
/// let k = TransferFunction::new([1.0, 1.0], [1e-6, 1.0, 0.0]).unwrap().to_state_space().unwrap();
/// let (small, bound) = reduce(&k, 1, Reduction::Residualise).unwrap();
/// assert!(small.order() == 1 && bound < 3e-6 + 2.0);
/// ```
pub fn reduce(
    system: &StateSpace,
    order: usize,
    reduction: Reduction,
) -> Result<(StateSpace, f64), SystemError> {
    // a pole within rounding of the boundary counts as kept
    let margin = 1e-9;
    let (stable, kept) = split(system, |p| match system.domain {
        Domain::Continuous => p.re < -margin * p.norm().max(margin),
        Domain::Sampled { .. } => p.norm() < 1.0 - margin,
    })?;
    if kept.order() > order {
        return Err(SystemError::Range {
            what: "the order wanted",
            value: order as f64,
            wanted: "it must hold at least every pole that does not decay",
        });
    }
    let balanced = Balanced::new(&stable)?;
    let left = order - kept.order();
    let model = balanced.reduced(left, reduction)?.plus(&kept)?;
    Ok((model, balanced.error_bound(left)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::norms::peak_gain;
    use crate::{TransferFunction, ZeroPoleGain};

    fn lightly_damped() -> StateSpace {
        let c = Complex64::new;
        let poles = vec![
            c(-1.0, 0.0),
            c(-0.5, 7.0),
            c(-0.5, -7.0),
            c(-3.0, 40.0),
            c(-3.0, -40.0),
            c(-200.0, 0.0),
            c(-500.0, 0.0),
        ];
        ZeroPoleGain::new(vec![c(-0.6, 9.0), c(-0.6, -9.0), c(-30.0, 0.0)], poles, 1e8)
            .to_state_space()
            .unwrap()
    }

    #[test]
    fn balanced_gramians_are_equal_and_diagonal() {
        let b = Balanced::new(&lightly_damped()).unwrap();
        let (p, q) = gramians(&b.system).unwrap();
        let wanted = Matrix::diagonal(&b.hankel);
        assert!((p - &wanted).norm() < 1e-9 * b.hankel[0]);
        assert!((q - &wanted).norm() < 1e-9 * b.hankel[0]);
    }

    #[test]
    fn errors_stay_within_the_bound() {
        let g = lightly_damped();
        let b = Balanced::new(&g).unwrap();
        for order in 1..7 {
            for reduction in [Reduction::Truncate, Reduction::Residualise] {
                let model = b.reduced(order, reduction).unwrap();
                let error = g.plus(&model.negated()).unwrap();
                let peak = peak_gain(&error, 1e-6).unwrap().gain;
                let limit = b.error_bound(order);
                assert!(
                    peak <= limit * (1.0 + 1e-6) + 1e-9 * b.hankel[0],
                    "{order}: {peak} {limit}"
                );
                // and the bound is not idle: the error is at least the first Hankel value left out
                assert!(peak >= b.hankel[order] * (1.0 - 1e-6));
            }
        }
    }

    #[test]
    fn unstable_parts_are_kept() {
        let g = TransferFunction::new([1.0, 2.0], [1.0, 99.0, -100.0])
            .unwrap()
            .to_state_space()
            .unwrap();
        let (model, bound) = reduce(&g, 1, Reduction::Truncate).unwrap();
        assert_eq!(model.order(), 1);
        assert!((model.poles().unwrap()[0].re - 1.0).abs() < 1e-12);
        let left = (g.response(3.0)[(0, 0)] - model.response(3.0)[(0, 0)]).norm();
        assert!(left <= bound && left > 0.0);
        assert!(reduce(&g, 0, Reduction::Truncate).is_err());
    }
}
