//! First-order weights, tuned through their inverse: the template a closed-loop transfer has to stay under.
//!
//! Rasoanarivo 2020, eqs 3.40–3.41 (the printed (3.40) is the inverse of the weight).

use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::transfer::TransferFunction;

/// Why a template is not one.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WeightError {
    /// Both gains on one side of one.
    #[error(
        "a template with gain {low} at low and {high} at high frequency never crosses 1: put one gain below 1 and the other above"
    )]
    SameSide {
        /// Low-frequency gain.
        low: f64,
        /// High-frequency gain.
        high: f64,
    },
    /// Not positive or not finite.
    #[error(
        "the template's {what} is {value}: it must be positive and finite (a weight cannot have a pole or a zero at the origin)"
    )]
    NotPositive {
        /// Which parameter.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// The inverse of a first-order weight: gain `low` at rest, `high` far above, one at `crossover` (rad/s).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Template {
    low: f64,
    high: f64,
    crossover: f64,
}

impl Template {
    /// A template from its two gains and the frequency (rad/s) where it crosses one.
    ///
    /// # Errors
    /// [`WeightError`].
    ///
    /// ```
    /// use meltpath_control::h_infinity::Template;
    /// let follow = Template::new(0.001, 1.5, 3000.0).unwrap();  // sensitivity: precise below 3000 rad/s
    /// assert!((follow.inverse().response(3000.0).norm() - 1.0).abs() < 1e-12);
    /// assert!(Template::new(0.1, 0.9, 10.0).is_err());
    /// ```
    pub fn new(low: f64, high: f64, crossover: f64) -> Result<Self, WeightError> {
        for (what, value) in [
            ("low-frequency gain", low),
            ("high-frequency gain", high),
            ("crossover (rad/s)", crossover),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(WeightError::NotPositive { what, value });
            }
        }
        if (low - 1.0) * (high - 1.0) >= 0.0 {
            return Err(WeightError::SameSide { low, high });
        }
        Ok(Template {
            low,
            high,
            crossover,
        })
    }

    /// a, b, c, d of the inverse weight (a s + b)/(c s + d).
    pub fn coefficients(&self) -> [f64; 4] {
        let low = (self.low * self.low - 1.0).abs().sqrt();
        let high = (self.high * self.high - 1.0).abs().sqrt();
        [
            self.high * low,
            self.low * self.crossover * high,
            low,
            self.crossover * high,
        ]
    }

    /// The template itself, W⁻¹.
    pub fn inverse(&self) -> TransferFunction {
        let [a, b, c, d] = self.coefficients();
        ratio([a, b], [c, d])
    }

    /// The weight W.
    pub fn weight(&self) -> TransferFunction {
        let [a, b, c, d] = self.coefficients();
        ratio([c, d], [a, b])
    }

    /// The weight as a state-space system of one state.
    ///
    /// # Errors
    /// [`SystemError`] on overflow of extreme parameters.
    pub fn to_state_space(&self) -> Result<crate::StateSpace, SystemError> {
        self.weight().to_state_space()
    }
}

fn ratio(up: [f64; 2], down: [f64; 2]) -> TransferFunction {
    // a template's parameters were checked: the leading coefficients are positive and finite
    let constant = TransferFunction::constant(1.0);
    TransferFunction::new(up, down).unwrap_or(constant)
}
