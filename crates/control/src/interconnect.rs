//! Systems put together: in series, side by side, summed, in feedback, and the lower linear fractional transformation.

use crate::SystemError;
use crate::domain::Domain;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::Factored;

/// The common time of two systems; a system without states joins either.
fn common(one: &StateSpace, two: &StateSpace) -> Result<Domain, SystemError> {
    if one.domain == two.domain || two.order() == 0 {
        Ok(one.domain)
    } else if one.order() == 0 {
        Ok(two.domain)
    } else {
        Err(SystemError::Domains {
            one: one.domain,
            two: two.domain,
        })
    }
}

fn agree(what: &'static str, one: usize, two: usize) -> Result<(), SystemError> {
    if one == two {
        Ok(())
    } else {
        Err(SystemError::Widths { what, one, two })
    }
}

impl StateSpace {
    /// `next` after this one: y = next(this(u)).
    ///
    /// # Errors
    /// [`SystemError::Widths`], [`SystemError::Domains`].
    pub fn then(&self, next: &StateSpace) -> Result<StateSpace, SystemError> {
        let domain = common(self, next)?;
        agree("series connection", self.outputs(), next.inputs())?;
        let zero = Matrix::zeros(self.order(), next.order());
        Ok(StateSpace {
            a: Matrix::blocks([[&self.a, &zero], [&(&next.b * &self.c), &next.a]]),
            b: Matrix::blocks([[&self.b], [&(&next.b * &self.d)]]),
            c: Matrix::blocks([[&(&next.d * &self.c), &next.c]]),
            d: &next.d * &self.d,
            domain,
        })
    }

    /// Both on the same input, outputs added.
    ///
    /// # Errors
    /// [`SystemError::Widths`], [`SystemError::Domains`].
    pub fn plus(&self, other: &StateSpace) -> Result<StateSpace, SystemError> {
        let domain = common(self, other)?;
        agree("sum (inputs)", self.inputs(), other.inputs())?;
        agree("sum (outputs)", self.outputs(), other.outputs())?;
        Ok(StateSpace {
            a: diagonal_blocks(&self.a, &other.a),
            b: Matrix::blocks([[&self.b], [&other.b]]),
            c: Matrix::blocks([[&self.c, &other.c]]),
            d: &self.d + &other.d,
            domain,
        })
    }

    /// Side by side: inputs and outputs of this one, then of the other.
    ///
    /// # Errors
    /// [`SystemError::Domains`].
    pub fn beside(&self, other: &StateSpace) -> Result<StateSpace, SystemError> {
        Ok(StateSpace {
            domain: common(self, other)?,
            a: diagonal_blocks(&self.a, &other.a),
            b: diagonal_blocks(&self.b, &other.b),
            c: diagonal_blocks(&self.c, &other.c),
            d: diagonal_blocks(&self.d, &other.d),
        })
    }

    /// The outputs multiplied by a matrix.
    ///
    /// # Errors
    /// [`SystemError::Widths`].
    pub fn then_gain(&self, gain: &Matrix) -> Result<StateSpace, SystemError> {
        self.then(&StateSpace::constant(gain.clone(), self.domain))
    }

    /// The system with outputs of opposite sign.
    #[must_use]
    pub(crate) fn negated(&self) -> StateSpace {
        StateSpace {
            c: -&self.c,
            d: -&self.d,
            ..self.clone()
        }
    }

    /// Negative feedback: y = this(u − back(y)).
    ///
    /// # Errors
    /// [`SystemError::Widths`], [`SystemError::Domains`], [`SystemError::AlgebraicLoop`].
    ///
    /// ```
    /// use meltpath_control::{StateSpace, TransferFunction, Matrix, Domain};
    /// let integrator = TransferFunction::new([1.0], [1.0, 0.0]).unwrap().to_state_space().unwrap();
    /// let loop_of_gain_5 = integrator.feedback(&StateSpace::constant(Matrix::diagonal(&[5.0]), Domain::Continuous)).unwrap();
    /// assert_eq!(loop_of_gain_5.poles().unwrap()[0].re, -5.0);
    /// ```
    pub fn feedback(&self, back: &StateSpace) -> Result<StateSpace, SystemError> {
        // [y; y] = [this; this] in the upper path, −back around it
        let m = self.inputs();
        let p = self.outputs();
        let open = StateSpace {
            a: self.a.clone(),
            b: Matrix::blocks([[&self.b, &self.b]]),
            c: Matrix::blocks([[&self.c], [&self.c]]),
            d: Matrix::blocks([[&self.d, &self.d], [&self.d, &self.d]]),
            domain: self.domain,
        };
        agree("feedback (outputs)", p, back.inputs())?;
        agree("feedback (inputs)", m, back.outputs())?;
        open.lower_fractional(&back.negated())
    }

    /// The loop closed by `controller` from the last outputs to the last inputs: F_l(this, controller).
    ///
    /// # Errors
    /// [`SystemError::Widths`], [`SystemError::Domains`], [`SystemError::AlgebraicLoop`].
    pub fn lower_fractional(&self, controller: &StateSpace) -> Result<StateSpace, SystemError> {
        let domain = common(self, controller)?;
        let (n, k) = (self.order(), controller.order());
        let (nu, ny) = (controller.outputs(), controller.inputs());
        if nu > self.inputs() || ny > self.outputs() {
            return Err(SystemError::Widths {
                what: "fractional transformation",
                one: self.inputs().min(self.outputs()),
                two: nu.max(ny),
            });
        }
        let (m1, p1) = (self.inputs() - nu, self.outputs() - ny);
        let b1 = self.b.block(0..n, 0..m1);
        let b2 = self.b.block(0..n, m1..m1 + nu);
        let c1 = self.c.block(0..p1, 0..n);
        let c2 = self.c.block(p1..p1 + ny, 0..n);
        let d11 = self.d.block(0..p1, 0..m1);
        let d12 = self.d.block(0..p1, m1..m1 + nu);
        let d21 = self.d.block(p1..p1 + ny, 0..m1);
        let d22 = self.d.block(p1..p1 + ny, m1..m1 + nu);
        // measurement y = M (C2 x + D21 w + D22 Ck xk) with M = (I − D22 Dk)⁻¹
        let loop_matrix = Matrix::identity(ny) - &d22 * &controller.d;
        let f = Factored::new(&loop_matrix).map_err(|_| SystemError::AlgebraicLoop)?;
        if f.pivot_ratio() > 1e14 {
            return Err(SystemError::AlgebraicLoop);
        }
        let y_x = f.solve(&c2);
        let y_k = f.solve(&(&d22 * &controller.c));
        let y_w = f.solve(&d21);
        let u_x = &controller.d * &y_x;
        let u_k = &controller.c + &controller.d * &y_k;
        let u_w = &controller.d * &y_w;
        debug_assert_eq!(k, u_k.columns());
        Ok(StateSpace {
            a: Matrix::blocks([
                [&(&self.a + &b2 * &u_x), &(&b2 * &u_k)],
                [
                    &(&controller.b * &y_x),
                    &(&controller.a + &controller.b * &y_k),
                ],
            ]),
            b: Matrix::blocks([[&(&b1 + &b2 * &u_w)], [&(&controller.b * &y_w)]]),
            c: Matrix::blocks([[&(&c1 + &d12 * &u_x), &(&d12 * &u_k)]]),
            d: &d11 + &d12 * &u_w,
            domain,
        })
    }
}

pub(crate) fn diagonal_blocks(one: &Matrix, two: &Matrix) -> Matrix {
    let mut out = Matrix::zeros(one.rows() + two.rows(), one.columns() + two.columns());
    out.set(0, 0, one);
    out.set(one.rows(), one.columns(), two);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;

    fn first_order(gain: f64, pole: f64, through: f64) -> StateSpace {
        let mut g = TransferFunction::new([gain], [1.0, pole])
            .unwrap()
            .to_state_space()
            .unwrap();
        g.d = Matrix::diagonal(&[through]);
        g
    }

    #[test]
    fn connections_agree_with_their_responses() {
        let g = first_order(2.0, 3.0, 0.5);
        let k = first_order(5.0, 7.0, 0.25);
        for omega in [0.0, 1.0, 10.0] {
            let (x, y) = (g.response(omega)[(0, 0)], k.response(omega)[(0, 0)]);
            let close = |s: &StateSpace, z: num_complex::Complex64| {
                (s.response(omega)[(0, 0)] - z).norm() < 1e-13
            };
            assert!(close(&g.then(&k).unwrap(), x * y));
            assert!(close(&g.plus(&k).unwrap(), x + y));
            assert!(close(&g.feedback(&k).unwrap(), x / (1.0 + x * y)));
        }
    }

    #[test]
    fn refusals() {
        let g = first_order(1.0, 1.0, -1.0);
        assert!(matches!(
            g.feedback(&StateSpace::constant(
                Matrix::identity(1),
                Domain::Continuous
            )),
            Err(SystemError::AlgebraicLoop)
        ));
        let sampled = StateSpace {
            domain: Domain::Sampled { period: 1e-3 },
            ..g.clone()
        };
        assert!(matches!(g.then(&sampled), Err(SystemError::Domains { .. })));
    }
}
