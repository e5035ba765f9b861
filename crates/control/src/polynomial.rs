//! Real polynomials in one variable, highest power first, as transfer functions are written.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{DenseError, eigenvalues};

/// A count as the exponent of an integer power.
pub(crate) fn exponent(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

/// A real polynomial; coefficients from the highest power down, the first one not zero (unless the polynomial is).
///
/// ```
/// use meltpath_control::Polynomial;
/// let p = Polynomial::new([1.0, 3.0, 2.0]); // s² + 3 s + 2
/// let mut roots: Vec<f64> = p.roots().unwrap().iter().map(|r| r.re).collect();
/// roots.sort_by(f64::total_cmp);
/// assert!((roots[0] + 2.0).abs() < 1e-12 && (roots[1] + 1.0).abs() < 1e-12);
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

    /// All roots, as eigenvalues of the companion matrix in a scaled variable, polished by Newton's method.
    ///
    /// # Errors
    /// [`DenseError`] when a coefficient is not finite or the iteration does not settle.
    pub fn roots(&self) -> Result<Vec<Complex64>, DenseError> {
        let zeros = self
            .coefficients
            .iter()
            .rev()
            .take_while(|&&c| c == 0.0)
            .count();
        let mut roots = vec![Complex64::default(); zeros.min(self.degree())];
        let reduced =
            Polynomial::new(self.coefficients[..self.coefficients.len() - zeros].to_vec());
        let n = reduced.degree();
        if n == 0 {
            return Ok(roots);
        }
        let first = reduced.leading();
        // the variable is scaled by the geometric mean of the roots, so that coefficients do not overflow
        let scale = (reduced.coefficient(0) / first).abs().powf(1.0 / n as f64);
        if !scale.is_finite() || scale == 0.0 {
            return Err(DenseError::NotFinite);
        }
        let monic: Vec<f64> = (0..=n)
            .map(|k| reduced.coefficients[k] / first / scale.powi(exponent(k)))
            .collect();
        let companion = Matrix::from_fn(n, n, |i, j| {
            if i == 0 {
                -monic[j + 1]
            } else if i == j + 1 {
                1.0
            } else {
                0.0
            }
        });
        let monic = Polynomial::new(monic);
        let slope = monic.derivative();
        for root in eigenvalues(&companion)? {
            let polished = polish(&monic, &slope, root);
            roots.push(polished * scale);
        }
        Ok(roots)
    }
}

fn polish(p: &Polynomial, slope: &Polynomial, start: Complex64) -> Complex64 {
    let mut root = start;
    let mut residual = p.at(root).norm();
    for _ in 0..3 {
        let next = root - p.at(root) / slope.at(root);
        let after = p.at(next).norm();
        // on a multiple root the step is not to be trusted
        if after >= residual || (next - root).norm() > 1e-6 * root.norm() {
            break;
        }
        root = next;
        residual = after;
    }
    if start.im == 0.0 {
        root.im = 0.0;
    }
    root
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
    fn roots_spread_over_decades() {
        let wanted = [-0.134, -145.0, -1.4e4, -2.2e5];
        let p = Polynomial::from_roots(&wanted.map(|r| Complex64::new(r, 0.0)), 3.0);
        let mut roots: Vec<f64> = p.roots().unwrap().iter().map(|r| r.re).collect();
        roots.sort_by(|a, b| b.total_cmp(a));
        for (r, w) in roots.iter().zip(wanted) {
            assert!((r / w - 1.0).abs() < 1e-10, "{r} {w}");
        }
    }

    #[test]
    fn roots_at_the_origin_are_exact() {
        let roots = Polynomial::new([1.0, 2.0, 5.0, 0.0, 0.0]).roots().unwrap();
        assert_eq!(roots.iter().filter(|r| r.norm() == 0.0).count(), 2);
        assert!(
            roots
                .iter()
                .any(|r| (r - Complex64::new(-1.0, 2.0)).norm() < 1e-12)
        );
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
