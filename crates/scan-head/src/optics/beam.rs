//! The Gaussian beam that a head focuses.
//!
//! Source: A. E. Siegman, "Lasers", chapter 17, with the beam quality factor M²; the thesis only defines the waist.

use serde::{Deserialize, Serialize};

/// A focused beam.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaussianBeam {
    /// Waist radius w0 (1/e²), mm.
    pub waist: f64,
    /// Wavelength, mm.
    pub wavelength: f64,
    /// Beam quality factor M², at least 1.
    pub quality: f64,
}
