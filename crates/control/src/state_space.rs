//! Linear systems in state space, continuous or sampled: x' = A x + B u, y = C x + D u.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::domain::Domain;
use crate::error::SystemError;
use meltpath_numerics::dense::{DenseError, Factored, balance::balance_by, eigenvalues};
use meltpath_numerics::{ComplexMatrix, Matrix};

/// A linear system with any number of inputs and outputs.
///
/// ```
/// use meltpath_control::{Matrix, StateSpace};
/// // a mass of 2 kg on a spring of 8 N/m with a damper of 1 N·s/m: force (N) to position (m)
/// let mass = StateSpace::continuous(
///     Matrix::from_rows([[0.0, 1.0], [-4.0, -0.5]]),
///     Matrix::column([0.0, 0.5]),
///     Matrix::row([1.0, 0.0]),
///     Matrix::zeros(1, 1),
/// ).unwrap();
/// assert!(mass.is_stable().unwrap());
/// let at_rest = mass.response(0.0)[(0, 0)];
/// assert!((at_rest.re - 1.0 / 8.0).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StateSpace {
    /// State to state, n x n (1/s when continuous).
    pub a: Matrix,
    /// Inputs to state, n x m.
    pub b: Matrix,
    /// State to outputs, p x n.
    pub c: Matrix,
    /// Inputs straight to outputs, p x m.
    pub d: Matrix,
    /// How time runs.
    pub domain: Domain,
}

impl StateSpace {
    /// Checks sizes and finiteness.
    ///
    /// # Errors
    /// [`SystemError::Sizes`], [`SystemError::NotFinite`], [`SystemError::Period`].
    pub fn new(
        a: Matrix,
        b: Matrix,
        c: Matrix,
        d: Matrix,
        domain: Domain,
    ) -> Result<Self, SystemError> {
        let fits = a.is_square()
            && b.rows() == a.rows()
            && c.columns() == a.rows()
            && d.rows() == c.rows()
            && d.columns() == b.columns();
        if !fits {
            let size = |m: &Matrix| (m.rows(), m.columns());
            return Err(SystemError::Sizes {
                a: size(&a),
                b: size(&b),
                c: size(&c),
                d: size(&d),
            });
        }
        for (name, m) in [("A", &a), ("B", &b), ("C", &c), ("D", &d)] {
            if !m.is_finite() {
                return Err(SystemError::NotFinite { what: name });
            }
        }
        if let Domain::Sampled { period } = domain
            && !(period > 0.0 && period.is_finite())
        {
            return Err(SystemError::Period { period });
        }
        Ok(StateSpace { a, b, c, d, domain })
    }

    /// A continuous system.
    ///
    /// # Errors
    /// As [`StateSpace::new`].
    pub fn continuous(a: Matrix, b: Matrix, c: Matrix, d: Matrix) -> Result<Self, SystemError> {
        Self::new(a, b, c, d, Domain::Continuous)
    }

    /// A constant gain without state.
    pub fn constant(d: Matrix, domain: Domain) -> Self {
        StateSpace {
            a: Matrix::zeros(0, 0),
            b: Matrix::zeros(0, d.columns()),
            c: Matrix::zeros(d.rows(), 0),
            d,
            domain,
        }
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.rows()
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.b.columns()
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.c.rows()
    }

    /// The eigenvalues of A.
    ///
    /// # Errors
    /// [`DenseError`] when the iteration does not settle.
    pub fn poles(&self) -> Result<Vec<Complex64>, DenseError> {
        eigenvalues(&self.a)
    }

    /// Whether every pole decays.
    ///
    /// # Errors
    /// [`DenseError`] when the poles cannot be computed.
    pub fn is_stable(&self) -> Result<bool, DenseError> {
        Ok(self.poles()?.iter().all(|&p| self.domain.decays(p)))
    }

    /// C (s I − A)⁻¹ B + D at a complex point; infinite entries at a pole.
    pub fn at(&self, s: Complex64) -> ComplexMatrix {
        let n = self.order();
        if n == 0 {
            return self.d.to_complex();
        }
        let shifted = ComplexMatrix::from_fn(n, n, |i, j| {
            let diagonal = if i == j { s } else { Complex64::default() };
            diagonal - self.a[(i, j)]
        });
        match Factored::new(&shifted) {
            Ok(f) => self.c.to_complex() * f.solve(&self.b.to_complex()) + self.d.to_complex(),
            Err(_) => self.d.map(|_| Complex64::new(f64::INFINITY, 0.0)),
        }
    }

    /// The frequency response at `omega` (rad/s).
    pub fn response(&self, omega: f64) -> ComplexMatrix {
        self.at(self.domain.point(omega))
    }

    /// Only the given outputs and inputs, in the given order.
    ///
    /// # Errors
    /// [`SystemError::Channel`] when one does not exist.
    pub fn select(&self, outputs: &[usize], inputs: &[usize]) -> Result<Self, SystemError> {
        for (what, wanted, available) in [
            ("output", outputs, self.outputs()),
            ("input", inputs, self.inputs()),
        ] {
            if let Some(&index) = wanted.iter().find(|&&i| i >= available) {
                return Err(SystemError::Channel {
                    what,
                    index,
                    available,
                });
            }
        }
        let n = self.order();
        Ok(StateSpace {
            a: self.a.clone(),
            b: Matrix::from_fn(n, inputs.len(), |i, j| self.b[(i, inputs[j])]),
            c: Matrix::from_fn(outputs.len(), n, |i, j| self.c[(outputs[i], j)]),
            d: Matrix::from_fn(outputs.len(), inputs.len(), |i, j| {
                self.d[(outputs[i], inputs[j])]
            }),
            domain: self.domain,
        })
    }

    /// The same system with states scaled by powers of two so that they weigh the same towards inputs and outputs.
    /// The response does not change, not even in its last bit of rounding.
    #[must_use]
    pub fn balanced_scaling(&self) -> Self {
        let mut out = self.clone();
        let n = self.order();
        balance_by(n, |i, factor| {
            if let Some(f) = factor {
                for k in 0..n {
                    out.a[(i, k)] /= f;
                }
                for k in 0..n {
                    out.a[(k, i)] *= f;
                }
                for x in out.b.row_slice_mut(i) {
                    *x /= f;
                }
                for k in 0..out.c.rows() {
                    out.c[(k, i)] *= f;
                }
            }
            let others = (0..n).filter(|&k| k != i);
            let row: f64 = others.clone().map(|k| out.a[(i, k)].powi(2)).sum::<f64>()
                + out.b.row_slice(i).iter().map(|x| x * x).sum::<f64>();
            let column: f64 = others.map(|k| out.a[(k, i)].powi(2)).sum::<f64>()
                + (0..out.c.rows())
                    .map(|k| out.c[(k, i)].powi(2))
                    .sum::<f64>();
            (row.sqrt(), column.sqrt())
        });
        out
    }

    /// The system in the time unit 1/`factor` s: A and B divided by `factor` (rad/s). Its response at ω is that of the
    /// original at ω·`factor`.
    #[must_use]
    pub fn slowed(&self, factor: f64) -> Self {
        let mut out = self.clone();
        out.a = self.a.scaled(1.0 / factor);
        out.b = self.b.scaled(1.0 / factor);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_sizes_are_named() {
        let wrong = StateSpace::continuous(
            Matrix::zeros(2, 2),
            Matrix::zeros(3, 1),
            Matrix::zeros(1, 2),
            Matrix::zeros(1, 1),
        );
        assert!(wrong.unwrap_err().to_string().contains("B is 3x1"));
    }

    #[test]
    fn scaling_keeps_the_response() {
        let g = StateSpace::continuous(
            Matrix::from_rows([[-1.0, 1e9], [-1e-6, -3.0]]),
            Matrix::column([1e7, 0.0]),
            Matrix::row([0.0, 1e-3]),
            Matrix::zeros(1, 1),
        )
        .unwrap();
        let s = g.balanced_scaling();
        assert!(s.a.norm() < 1e6);
        for omega in [0.1, 10.0, 1000.0] {
            let (x, y) = (g.response(omega)[(0, 0)], s.response(omega)[(0, 0)]);
            assert!((x - y).norm() < 1e-12 * x.norm());
        }
    }
}
