//! From continuous to sampled systems: exact for held inputs, exact for inputs in straight lines between samples, by the
//! bilinear rule (with a frequency kept true), or with the same impulse response.
//!
//! G. F. Franklin, J. D. Powell, M. Workman, "Digital Control of Dynamic Systems", 3rd ed., chapters 4 and 6.

use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::domain::Domain;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{Factored, exponential};

/// What the input does between samples, or which rule replaces it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Hold {
    /// The input keeps its value until the next sample (exact for a converter's output).
    Zero,
    /// The input runs straight from sample to sample (exact for ramps; "triangle" in the literature).
    First,
    /// s = 2(z − 1)/(T(z + 1)).
    Tustin,
    /// The bilinear rule scaled so that the response at `omega` (rad/s) is exact.
    TustinAt {
        /// The frequency kept true (rad/s), below half the sampling frequency.
        omega: f64,
    },
    /// The samples of the impulse response, times the period.
    Impulse,
}

/// The sampled system at `period` (s).
///
/// # Errors
/// [`SystemError::Period`], [`SystemError::Domains`] when already sampled, [`SystemError::Range`] for a frequency beyond
/// half the sampling frequency or a direct gain under [`Hold::Impulse`], [`SystemError::Dense`].
///
/// ```
/// use meltpath_control::{discretise::{discretise, Hold}, TransferFunction};
/// let lag = TransferFunction::new([1.0], [0.01, 1.0]).unwrap().to_state_space().unwrap();
/// let sampled = discretise(&lag, 1e-3, Hold::Zero).unwrap();
/// assert!((sampled.poles().unwrap()[0].re - (-0.1f64).exp()).abs() < 1e-15);
/// ```
pub fn discretise(system: &StateSpace, period: f64, hold: Hold) -> Result<StateSpace, SystemError> {
    if !(period > 0.0 && period.is_finite()) {
        return Err(SystemError::Period { period });
    }
    let domain = Domain::Sampled { period };
    if system.domain != Domain::Continuous {
        return Err(SystemError::Domains {
            one: system.domain,
            two: Domain::Continuous,
        });
    }
    if system.order() == 0 {
        return Ok(StateSpace::constant(system.d.clone(), domain));
    }
    let s = system;
    let (n, m) = (s.order(), s.inputs());
    match hold {
        Hold::Zero => {
            let (phi, gamma) = held(s, period)?;
            StateSpace::new(phi, gamma, s.c.clone(), s.d.clone(), domain)
        }
        Hold::First => {
            let mut big = Matrix::zeros(n + 2 * m, n + 2 * m);
            big.set(0, 0, &s.a.scaled(period));
            big.set(0, n, &s.b.scaled(period));
            big.set(n, n + m, &Matrix::identity(m));
            let e = exponential(&big)?;
            let phi = e.block(0..n, 0..n);
            let g1 = e.block(0..n, n..n + m);
            let g2 = e.block(0..n, n + m..n + 2 * m);
            let b = &g1 + &phi * &g2 - &g2;
            let d = &s.d + &s.c * &g2;
            StateSpace::new(phi, b, s.c.clone(), d, domain)
        }
        Hold::Tustin => bilinear(s, 2.0 / period, domain),
        Hold::TustinAt { omega } => {
            let half = 0.5 * omega * period;
            if !(half > 0.0 && half < std::f64::consts::FRAC_PI_2) {
                return Err(SystemError::Range {
                    what: "the frequency kept true (rad/s)",
                    value: omega,
                    wanted: "it must lie between 0 and half the sampling frequency",
                });
            }
            bilinear(s, omega / half.tan(), domain)
        }
        Hold::Impulse => {
            let direct = s.d.largest();
            if direct != 0.0 {
                return Err(SystemError::Range {
                    what: "the direct gain",
                    value: direct,
                    wanted: "an impulse through a direct gain has no samples; use another hold",
                });
            }
            let phi = exponential(&s.a.scaled(period))?;
            let b = (&phi * &s.b).scaled(period);
            let d = (&s.c * &s.b).scaled(period);
            StateSpace::new(phi, b, s.c.clone(), d, domain)
        }
    }
}

/// exp(A T) and the integral of exp(A t) B over a period.
fn held(s: &StateSpace, period: f64) -> Result<(Matrix, Matrix), SystemError> {
    let (n, m) = (s.order(), s.inputs());
    let mut big = Matrix::zeros(n + m, n + m);
    big.set(0, 0, &s.a.scaled(period));
    big.set(0, n, &s.b.scaled(period));
    let e = exponential(&big)?;
    Ok((e.block(0..n, 0..n), e.block(0..n, n..n + m)))
}

/// The sampled system for held inputs that act `delay` (s) late: exact for any delay, with the inputs on their way as
/// states.
///
/// # Errors
/// As [`discretise`]; [`SystemError::Delay`] when negative or not finite.
pub fn discretise_delayed(
    system: &StateSpace,
    period: f64,
    delay: f64,
) -> Result<StateSpace, SystemError> {
    if !(delay >= 0.0 && delay.is_finite()) {
        return Err(SystemError::Delay { delay });
    }
    let whole = (delay / period).floor();
    let rest = delay - whole * period;
    let plain = discretise(system, period, Hold::Zero)?;
    let late = if rest <= 1e-12 * period {
        plain
    } else {
        // the old input acts for `rest`, the new one for the remainder of the period
        let (n, m) = (system.order(), system.inputs());
        let (_, fresh) = held(system, period - rest)?;
        let (_, stale) = held(system, rest)?;
        let carry = exponential(&system.a.scaled(period - rest))?;
        let old = carry * stale;
        let zero = Matrix::zeros(m, n + m);
        let mut a = Matrix::blocks([[&Matrix::blocks([[&plain.a, &old]])], [&zero]]);
        a.set(n, 0, &Matrix::zeros(m, n + m));
        StateSpace::new(
            a,
            Matrix::blocks([[&fresh], [&Matrix::identity(m)]]),
            // between samples a direct gain sees the input that has arrived: the old one at the sample itself
            Matrix::blocks([[&system.c, &system.d]]),
            Matrix::zeros(system.outputs(), m),
            plain.domain,
        )?
    };
    let mut out = late;
    for _ in 0..whole as usize {
        let m = system.inputs();
        let sample = StateSpace::new(
            Matrix::zeros(m, m),
            Matrix::identity(m),
            Matrix::identity(m),
            Matrix::zeros(m, m),
            out.domain,
        )?;
        out = sample.then(&out)?;
    }
    Ok(out)
}

/// s = k(z − 1)/(z + 1).
fn bilinear(s: &StateSpace, k: f64, domain: Domain) -> Result<StateSpace, SystemError> {
    let n = s.order();
    let f = Factored::new(&(Matrix::identity(n).scaled(k) - &s.a))?;
    let a = f.solve(&(Matrix::identity(n).scaled(k) + &s.a));
    let b = f.solve(&s.b);
    // G = D + C (s I − A)⁻¹ B at z = ∞ is D + C (kI − A)⁻¹ B
    let d = &s.d + &s.c * &b;
    let c = &s.c * (&a + Matrix::identity(n));
    StateSpace::new(a, b, c, d, domain)
}

/// The continuous system with the response of a sampled one at z = (2/T + s)/(2/T − s): every gain is kept.
pub(crate) fn continuous_twin(s: &StateSpace) -> Result<StateSpace, SystemError> {
    let Domain::Sampled { period } = s.domain else {
        return Ok(s.clone());
    };
    let k = 2.0 / period;
    let n = s.order();
    let f = Factored::new(&(Matrix::identity(n) + &s.a))?;
    // s = k (z − 1)/(z + 1): A = k (I + Ad)⁻¹ (Ad − I), B = 2k (I + Ad)⁻¹ Bd … in a form that keeps C
    let a = f.solve(&(&s.a - Matrix::identity(n))).scaled(k);
    let b = f.solve(&s.b);
    let d = &s.d - &s.c * &b;
    let inverse = f.inverse();
    let c = (&s.c * inverse).scaled(2.0 * k);
    StateSpace::new(a, b, c, d, Domain::Continuous)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TransferFunction, simulate::simulate};

    fn plant() -> StateSpace {
        TransferFunction::new([3.0, 40.0], [1.0, 4.0, 104.0, 100.0])
            .unwrap()
            .to_state_space()
            .unwrap()
    }

    #[test]
    fn twin_keeps_the_response() {
        let sampled = discretise(&plant(), 0.01, Hold::Zero).unwrap();
        let twin = continuous_twin(&sampled).unwrap();
        for omega in [0.3f64, 10.0, 200.0] {
            let warped = 2.0 / 0.01 * (0.5 * omega * 0.01).tan();
            let (x, y) = (
                sampled.response(omega)[(0, 0)],
                twin.response(warped)[(0, 0)],
            );
            assert!((x - y).norm() < 1e-12 * (1.0 + x.norm()));
        }
    }

    #[test]
    fn tustin_is_exact_where_asked() {
        let g = plant();
        let s = discretise(&g, 0.05, Hold::TustinAt { omega: 10.0 }).unwrap();
        assert!((g.response(10.0)[(0, 0)] - s.response(10.0)[(0, 0)]).norm() < 1e-12);
        assert!(discretise(&g, 0.05, Hold::TustinAt { omega: 100.0 }).is_err());
    }

    #[test]
    fn impulse_samples() {
        let g = TransferFunction::new([1.0], [1.0, 2.0])
            .unwrap()
            .to_state_space()
            .unwrap();
        let s = discretise(&g, 0.1, Hold::Impulse).unwrap();
        let mut input = [0.0; 5];
        input[0] = 1.0;
        let y = simulate(&s, &Matrix::from_fn(5, 1, |i, _| input[i])).unwrap();
        for k in 0..5 {
            assert!((y[(k, 0)] - 0.1 * (-0.2 * k as f64).exp()).abs() < 1e-15);
        }
    }

    #[test]
    fn fractional_delay_is_exact_for_steps() {
        // integrator, delay 0.37 periods: after k samples of a unit step the output is k·T − delay
        let stepped = |denominator: [f64; 2]| {
            let g = TransferFunction::new([1.0], denominator).unwrap();
            let s = discretise_delayed(&g.to_state_space().unwrap(), 0.1, 0.237).unwrap();
            simulate(&s, &Matrix::from_fn(8, 1, |_, _| 1.0)).unwrap()
        };
        let y = stepped([1.0, 0.0]);
        for k in 3..8 {
            assert!(
                (y[(k, 0)] - (0.1 * k as f64 - 0.237)).abs() < 1e-14,
                "{}",
                y[(k, 0)]
            );
        }
        // a lag of 80 ms fades meanwhile: 1 − exp(−(t − delay)/lag)
        let y = stepped([0.08, 1.0]);
        for k in 3..8 {
            let wanted = 1.0 - f64::exp(-(0.1 * k as f64 - 0.237) / 0.08);
            assert!((y[(k, 0)] - wanted).abs() < 1e-14, "{k}: {}", y[(k, 0)]);
        }
    }
}
