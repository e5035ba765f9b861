//! Real polynomials in one variable, highest power first, as transfer functions are written.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// A count as the exponent of an integer power.
pub(crate) fn exponent(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

/// A real polynomial; coefficients from the highest power down, the first one not zero (unless the polynomial is).
///
/// ```
/// use meltpath_control::Polynomial;
/// let p = Polynomial::new([1.0, 3.0, 2.0]); // s² + 3 s + 2
/// assert_eq!((p.degree(), p.at(2.0.into()).re), (2, 12.0));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Polynomial {
    coefficients: Vec<f64>,
}

impl Polynomial {
    /// From coefficients, highest power first; leading zeros are dropped.
    pub fn new(coefficients: impl Into<Vec<f64>>) -> Self {
        let mut coefficients = coefficients.into();
        let leading = coefficients.iter().take_while(|&&c| c == 0.0).count();
        coefficients.drain(..leading);
        Polynomial { coefficients }
    }

    /// The polynomial with the given roots (complex ones in conjugate pairs) and leading coefficient.
    pub fn from_roots(roots: &[Complex64], leading: f64) -> Self {
        let mut c = vec![Complex64::new(1.0, 0.0)];
        for root in roots {
            c.push(Complex64::default());
            for k in (1..c.len()).rev() {
                let above = c[k - 1];
                c[k] -= root * above;
            }
        }
        Self::new(c.iter().map(|z| z.re * leading).collect::<Vec<_>>())
    }

    /// Coefficients, highest power first; empty for the zero polynomial.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// The highest power; 0 for constants and for the zero polynomial.
    pub fn degree(&self) -> usize {
        self.coefficients.len().saturating_sub(1)
    }

    /// Whether it is zero everywhere.
    pub fn is_zero(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// The first coefficient, 0 for the zero polynomial.
    pub fn leading(&self) -> f64 {
        self.coefficients.first().copied().unwrap_or(0.0)
    }

    /// Coefficient of the given power.
    pub fn coefficient(&self, power: usize) -> f64 {
        let position = self.coefficients.len().checked_sub(1 + power);
        position.map_or(0.0, |k| self.coefficients[k])
    }

    /// Value at a complex point.
    pub fn at(&self, s: Complex64) -> Complex64 {
        self.coefficients
            .iter()
            .fold(Complex64::default(), |sum, &c| sum * s + c)
    }

    /// The product.
    #[must_use]
    pub fn times(&self, other: &Polynomial) -> Polynomial {
        if self.is_zero() || other.is_zero() {
            return Polynomial::new([]);
        }
        let mut out = vec![0.0; self.coefficients.len() + other.coefficients.len() - 1];
        for (i, a) in self.coefficients.iter().enumerate() {
            for (j, b) in other.coefficients.iter().enumerate() {
                out[i + j] += a * b;
            }
        }
        Polynomial::new(out)
    }

    /// The sum.
    #[must_use]
    pub fn plus(&self, other: &Polynomial) -> Polynomial {
        let size = self.coefficients.len().max(other.coefficients.len());
        Polynomial::new(
            (0..size)
                .rev()
                .map(|power| self.coefficient(power) + other.coefficient(power))
                .collect::<Vec<_>>(),
        )
    }

    /// Each coefficient multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Polynomial {
        Polynomial::new(
            self.coefficients
                .iter()
                .map(|c| c * factor)
                .collect::<Vec<_>>(),
        )
    }

    /// The derivative.
    #[must_use]
    pub fn derivative(&self) -> Polynomial {
        let degree = self.degree();
        Polynomial::new(
            self.coefficients
                .iter()
                .take(degree)
                .enumerate()
                .map(|(k, c)| c * (degree - k) as f64)
                .collect::<Vec<_>>(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_of_a_cubic() {
        let cubic = Polynomial::new([2.0, -3.0, 5.0, 7.0]);
        assert_eq!(cubic.derivative(), Polynomial::new([6.0, -6.0, 5.0]));
    }

    #[test]
    fn algebra() {
        let p = Polynomial::new([0.0, 1.0, 2.0]);
        let q = Polynomial::new([1.0, -2.0]);
        assert_eq!(p.times(&q).coefficients(), [1.0, 0.0, -4.0]);
        assert_eq!(p.plus(&q).coefficients(), [2.0, 0.0]);
        assert!(p.plus(&p.scaled(-1.0)).is_zero());
    }
}
