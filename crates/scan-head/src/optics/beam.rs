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

impl GaussianBeam {
    /// Distance from the waist at which the spot's area has doubled, mm: π·w0²/(M²·λ).
    pub fn rayleigh_length(&self) -> f64 {
        std::f64::consts::PI * self.waist * self.waist / (self.quality * self.wavelength)
    }

    /// Radius (1/e²) of the spot `defocus` mm away from the waist, mm: w0·√(1 + (z/z_R)²).
    ///
    /// # Examples
    ///
    /// ```
    /// use meltpath_scan_head::optics::beam::GaussianBeam;
    ///
    /// let beam = GaussianBeam { waist: 0.05, wavelength: 1.07e-3, quality: 1.1 };
    /// let far = beam.rayleigh_length();
    /// assert!((far - 6.673).abs() < 1e-3);
    /// assert!((beam.radius_at(far) / beam.waist - 2.0_f64.sqrt()).abs() < 1e-12);
    /// ```
    pub fn radius_at(&self, defocus: f64) -> f64 {
        self.waist * (defocus / self.rayleigh_length()).hypot(1.0)
    }
}
