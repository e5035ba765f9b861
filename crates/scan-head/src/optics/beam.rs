//! The Gaussian beam at the powder: radius, spot and irradiance out of focus.
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

/// The spot on a plane that the beam meets at an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Radius across the plane of incidence (1/e²), mm.
    pub across: f64,
    /// Radius along it, mm.
    pub along: f64,
}

impl GaussianBeam {
    /// The Rayleigh length z_R = π w0²/(M² λ), mm.
    pub fn rayleigh_length(&self) -> f64 {
        std::f64::consts::PI * self.waist * self.waist / (self.quality * self.wavelength)
    }

    /// The radius (1/e²), mm, at `distance` mm from the waist along the ray.
    ///
    /// ```
    /// use meltpath_scan_head::optics::beam::GaussianBeam;
    /// let beam = GaussianBeam { waist: 0.035, wavelength: 1.07e-3, quality: 1.0 };
    /// assert!((beam.rayleigh_length() - 3.60).abs() < 0.01);
    /// assert!((beam.radius(beam.rayleigh_length()) / 0.035 - 2f64.sqrt()).abs() < 1e-12);
    /// ```
    pub fn radius(&self, distance: f64) -> f64 {
        self.waist * (1.0 + (distance / self.rayleigh_length()).powi(2)).sqrt()
    }

    /// The spot at `distance` mm from the waist where the ray makes an angle of cosine `incidence` with the normal.
    pub fn spot(&self, distance: f64, incidence: f64) -> Spot {
        let across = self.radius(distance);
        Spot {
            across,
            along: across / incidence,
        }
    }
}
