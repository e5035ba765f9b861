//! How time runs in a system, and what that makes of a frequency and of a pole.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// How time runs in a system.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Domain {
    /// Differential equations in s (rad/s).
    Continuous,
    /// Difference equations in z.
    Sampled {
        /// Sample time (s).
        period: f64,
    },
}

impl Domain {
    /// The point of the complex plane that belongs to the frequency `omega` (rad/s): jω, or exp(jω·period).
    pub fn point(self, omega: f64) -> Complex64 {
        match self {
            Domain::Continuous => Complex64::new(0.0, omega),
            Domain::Sampled { period } => Complex64::cis(omega * period),
        }
    }

    /// A value at the point `s` of the complex plane, `delay` (s) later; whole in periods of a sampled system.
    pub(crate) fn delayed(self, value: Complex64, s: Complex64, delay: f64) -> Complex64 {
        match self {
            _ if delay == 0.0 => value,
            Domain::Continuous => value * (-s * delay).exp(),
            Domain::Sampled { period } => value / s.powi((delay / period).round() as i32),
        }
    }

    /// Whether a pole decays: left half plane, or inside the unit circle.
    pub fn decays(self, pole: Complex64) -> bool {
        match self {
            Domain::Continuous => pole.re < 0.0,
            Domain::Sampled { .. } => pole.norm() < 1.0,
        }
    }
}
