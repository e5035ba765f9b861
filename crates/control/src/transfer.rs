//! Transfer functions as ratios of polynomials, with a delay that stays exact in frequency.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::delay;
use crate::domain::Domain;
use crate::polynomial::{Polynomial, exponent};
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;

/// numerator(s) / denominator(s) · exp(−delay·s), one input and one output.
///
/// ```
/// use meltpath_control::TransferFunction;
/// let motor = TransferFunction::new([10.0], [0.5, 1.0, 0.0]).unwrap().delayed(2e-3).unwrap();
/// let at_1_rad = motor.response(1.0);
/// assert!((at_1_rad.norm() - 10.0 / 1.25f64.sqrt()).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TransferFunction {
    /// Numerator.
    pub numerator: Polynomial,
    /// Denominator, not zero.
    pub denominator: Polynomial,
    /// Delay (s); a whole number of periods when sampled.
    pub delay: f64,
    /// How time runs.
    pub domain: Domain,
}

impl TransferFunction {
    /// A continuous transfer function from coefficients, highest power first.
    ///
    /// # Errors
    /// [`SystemError::ZeroDenominator`], [`SystemError::NotFinite`].
    pub fn new(
        numerator: impl Into<Vec<f64>>,
        denominator: impl Into<Vec<f64>>,
    ) -> Result<Self, SystemError> {
        Self::in_domain(numerator, denominator, Domain::Continuous)
    }

    /// A sampled transfer function in z, highest power first.
    ///
    /// # Errors
    /// [`SystemError::ZeroDenominator`], [`SystemError::NotFinite`], [`SystemError::Period`].
    pub fn sampled(
        numerator: impl Into<Vec<f64>>,
        denominator: impl Into<Vec<f64>>,
        period: f64,
    ) -> Result<Self, SystemError> {
        if !(period > 0.0 && period.is_finite()) {
            return Err(SystemError::Period { period });
        }
        Self::in_domain(numerator, denominator, Domain::Sampled { period })
    }

    fn in_domain(
        numerator: impl Into<Vec<f64>>,
        denominator: impl Into<Vec<f64>>,
        domain: Domain,
    ) -> Result<Self, SystemError> {
        let (numerator, denominator) = (Polynomial::new(numerator), Polynomial::new(denominator));
        for (what, p) in [("numerator", &numerator), ("denominator", &denominator)] {
            if p.coefficients().iter().any(|c| !c.is_finite()) {
                return Err(SystemError::NotFinite { what });
            }
        }
        if denominator.is_zero() {
            return Err(SystemError::ZeroDenominator);
        }
        Ok(TransferFunction {
            numerator,
            denominator,
            delay: 0.0,
            domain,
        })
    }

    /// A constant gain.
    pub fn constant(gain: f64) -> Self {
        TransferFunction {
            numerator: Polynomial::new([gain]),
            denominator: Polynomial::new([1.0]),
            delay: 0.0,
            domain: Domain::Continuous,
        }
    }

    /// The same with `delay` (s) more.
    ///
    /// # Errors
    /// [`SystemError::Delay`] when negative, not finite, or not whole in periods of a sampled system.
    pub fn delayed(mut self, delay: f64) -> Result<Self, SystemError> {
        let whole = match self.domain {
            Domain::Continuous => true,
            Domain::Sampled { period } => {
                let samples = delay / period;
                (samples - samples.round()).abs() < 1e-9
            }
        };
        if !(delay >= 0.0 && delay.is_finite() && whole) {
            return Err(SystemError::Delay { delay });
        }
        self.delay += delay;
        Ok(self)
    }

    /// Value at a complex point, delay included.
    pub fn at(&self, s: Complex64) -> Complex64 {
        let ratio = self.numerator.at(s) / self.denominator.at(s);
        self.domain.delayed(ratio, s, self.delay)
    }

    /// The frequency response at `omega` (rad/s), delay exact.
    pub fn response(&self, omega: f64) -> Complex64 {
        self.at(self.domain.point(omega))
    }

    /// The product of two transfer functions; delays add.
    ///
    /// # Errors
    /// [`SystemError::Domains`].
    pub fn times(&self, other: &TransferFunction) -> Result<TransferFunction, SystemError> {
        Ok(TransferFunction {
            numerator: self.numerator.times(&other.numerator),
            denominator: self.denominator.times(&other.denominator),
            delay: self.delay + other.delay,
            domain: self.common(other)?,
        })
    }

    /// The sum; both have the same delay.
    ///
    /// # Errors
    /// [`SystemError::Domains`], [`SystemError::Delay`] when delays differ (approximate them first: [`Self::padé`](Self::pade)).
    pub fn plus(&self, other: &TransferFunction) -> Result<TransferFunction, SystemError> {
        if self.delay != other.delay {
            return Err(SystemError::Delay {
                delay: (self.delay - other.delay).abs(),
            });
        }
        let domain = self.common(other)?;
        Ok(TransferFunction {
            numerator: self
                .numerator
                .times(&other.denominator)
                .plus(&other.numerator.times(&self.denominator)),
            denominator: self.denominator.times(&other.denominator),
            delay: self.delay,
            domain,
        })
    }

    /// Negative feedback this / (1 + this·back), both without delay.
    ///
    /// # Errors
    /// [`SystemError::Domains`], [`SystemError::Delay`] (a loop with delay is not rational: use [`Self::pade`]), [`SystemError::AlgebraicLoop`].
    pub fn feedback(&self, back: &TransferFunction) -> Result<TransferFunction, SystemError> {
        if self.delay != 0.0 || back.delay != 0.0 {
            return Err(SystemError::Delay {
                delay: self.delay + back.delay,
            });
        }
        let domain = self.common(back)?;
        let denominator = self
            .denominator
            .times(&back.denominator)
            .plus(&self.numerator.times(&back.numerator));
        if denominator.is_zero() {
            return Err(SystemError::AlgebraicLoop);
        }
        Ok(TransferFunction {
            numerator: self.numerator.times(&back.denominator),
            denominator,
            delay: 0.0,
            domain,
        })
    }

    /// The delay replaced by a Padé approximant of the given order: same gain everywhere, phase right up to about
    /// order/delay rad/s.
    ///
    /// # Errors
    /// [`SystemError::Domains`] on a sampled system, whose delay is exact anyway.
    pub fn pade(&self, order: usize) -> Result<TransferFunction, SystemError> {
        if self.delay == 0.0 {
            return Ok(self.clone());
        }
        let (up, down) = delay::pade(self.delay, order);
        let rational = TransferFunction {
            delay: 0.0,
            ..self.clone()
        };
        rational.times(&TransferFunction {
            numerator: up,
            denominator: down,
            delay: 0.0,
            domain: Domain::Continuous,
        })
    }

    /// A state-space form of the same order, in a scaled companion form; sampled delays become states.
    ///
    /// # Errors
    /// [`SystemError::Improper`] when the numerator's degree exceeds the denominator's, [`SystemError::Delay`] when a
    /// continuous delay is left.
    pub fn to_state_space(&self) -> Result<StateSpace, SystemError> {
        let mut denominator = self.denominator.clone();
        if self.delay != 0.0 {
            match self.domain {
                Domain::Continuous => return Err(SystemError::Delay { delay: self.delay }),
                Domain::Sampled { period } => {
                    let mut c = denominator.coefficients().to_vec();
                    c.resize(c.len() + (self.delay / period).round() as usize, 0.0);
                    denominator = Polynomial::new(c);
                }
            }
        }
        let n = denominator.degree();
        if self.numerator.degree() > n {
            return Err(SystemError::Improper {
                numerator: self.numerator.degree(),
                denominator: n,
            });
        }
        let first = denominator.leading();
        let through = self.numerator.coefficient(n) / first;
        // time is scaled by the geometric mean of the poles that are not at the origin: coefficients of the order of one
        let (_, low) = (0..n)
            .map(|power| (power, denominator.coefficient(power)))
            .find(|&(_, c)| c != 0.0)
            .map_or((0, 0.0), |(power, c)| {
                (power, (c / first).abs().powf(1.0 / (n - power) as f64))
            });
        let scale = if low > 0.0 && matches!(self.domain, Domain::Continuous) {
            low
        } else {
            1.0
        };
        let coefficient = |power: usize| {
            denominator.coefficient(power) / first * scale.powi(exponent(power) - exponent(n))
        };
        let a = Matrix::from_fn(n, n, |i, j| {
            if i + 1 == n {
                -coefficient(j)
            } else if j == i + 1 {
                1.0
            } else {
                0.0
            }
        });
        let b = Matrix::from_fn(n, 1, |i, _| if i + 1 == n { 1.0 } else { 0.0 });
        let c = Matrix::from_fn(1, n, |_, j| {
            self.numerator.coefficient(j) / first * scale.powi(exponent(j) - exponent(n))
                - through * coefficient(j)
        });
        let slow = StateSpace::new(a, b, c, Matrix::diagonal(&[through]), self.domain)?;
        Ok(slow.slowed(1.0 / scale).balanced_scaling())
    }

    fn common(&self, other: &TransferFunction) -> Result<Domain, SystemError> {
        let constant = |g: &TransferFunction| {
            g.numerator.degree() == 0 && g.denominator.degree() == 0 && g.delay == 0.0
        };
        if self.domain == other.domain || constant(other) {
            Ok(self.domain)
        } else if constant(self) {
            Ok(other.domain)
        } else {
            Err(SystemError::Domains {
                one: self.domain,
                two: other.domain,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_in_series_delays_by_the_sum() {
        let late = |delay| {
            let mut g = TransferFunction::new([1.0], [1.0, 1.0]).unwrap();
            g.delay = delay;
            g
        };
        let both = late(3e-4).times(&late(2e-4)).unwrap();
        assert!((both.delay - 5e-4).abs() < 1e-18);
    }

    #[test]
    fn sums_of_other_delays_are_refused_with_the_difference() {
        let late = |delay| {
            TransferFunction::new([1.0], [1.0, 1.0])
                .unwrap()
                .delayed(delay)
                .unwrap()
        };
        assert!(late(0.25).plus(&late(0.25)).is_ok());
        for (a, b) in [(0.75, 0.25), (0.25, 0.75)] {
            let Err(SystemError::Delay { delay }) = late(a).plus(&late(b)) else {
                panic!("a sum of two delays")
            };
            assert!((delay - 0.5).abs() < 1e-15, "{delay}");
        }
    }

    #[test]
    fn state_space_keeps_the_response_of_a_badly_scaled_plant() {
        // current loop of a small galvanometer, deg/A (coefficients spread over 24 decades)
        let g = TransferFunction::new(
            [1.07629e11, 1.60163e15, 5.32110e19, 7.47082e23],
            [
                1.0, 2.69313e4, 8.10776e8, 1.66643e13, 9.97989e16, 6.33989e18, 0.0,
            ],
        )
        .unwrap();
        let s = g.to_state_space().unwrap();
        assert!(s.a.largest() < 1e6);
        for omega in [1.0, 64.0, 3000.0, 25_133.0, 2e5] {
            let (x, y) = (g.response(omega), s.response(omega)[(0, 0)]);
            assert!((x - y).norm() < 1e-10 * x.norm(), "{omega} {x} {y}");
        }
        assert!((g.response(3000.0).norm() - 0.80125).abs() < 1e-4);
    }

    #[test]
    fn sampled_delay_becomes_states() {
        let g = TransferFunction::sampled([0.5], [1.0, -0.5], 1e-3)
            .unwrap()
            .delayed(2e-3)
            .unwrap();
        let s = g.to_state_space().unwrap();
        assert_eq!(s.order(), 3);
        assert!((g.response(700.0) - s.response(700.0)[(0, 0)]).norm() < 1e-14);
        assert!(
            TransferFunction::sampled([1.0], [1.0], 1e-3)
                .unwrap()
                .delayed(0.5e-3)
                .is_err()
        );
    }

    #[test]
    fn improper_and_delayed_are_refused() {
        assert!(matches!(
            TransferFunction::new([1.0, 0.0], [1.0])
                .unwrap()
                .to_state_space(),
            Err(SystemError::Improper { .. })
        ));
        let late = TransferFunction::new([1.0], [1.0, 1.0])
            .unwrap()
            .delayed(0.1)
            .unwrap();
        assert!(matches!(
            late.to_state_space(),
            Err(SystemError::Delay { .. })
        ));
        let close = late.pade(4).unwrap();
        assert!((close.response(10.0) - late.response(10.0)).norm() < 1e-8);
        assert!(
            (close.to_state_space().unwrap().response(10.0)[(0, 0)] - late.response(10.0)).norm()
                < 1e-8
        );
    }
}
