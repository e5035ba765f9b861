//! A body with constant properties, and how a deposit of heat on its surface spreads.
//!
//! Carslaw and Jaeger 1959, chapter X: products of one-dimensional kernels, images for insulated faces.

use crate::material::Material;

/// The body under the beam; its faces are insulated unless said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Body {
    /// Everything below the build plane.
    HalfSpace,
    /// A plate of this thickness, mm.
    Plate {
        /// Thickness, mm.
        thickness: f64,
    },
    /// A plate whose lower face is held at the ambient temperature.
    Cooled {
        /// Thickness, mm.
        thickness: f64,
    },
}

/// Temperatures at which laws are read for their means.
const STEPS: u32 = 4000;

/// Constant properties of a body. For metals with a latent heat take effective ones, fitted to the reference solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// Conductivity, W/(mm·K).
    pub conductivity: f64,
    /// Diffusivity, mm²/s.
    pub diffusivity: f64,
    /// Temperature before the beam came, K.
    pub ambient: f64,
    /// The body.
    pub body: Body,
}

/// Why a medium was refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {value}: it must be finite and above zero")]
pub struct MediumError {
    /// Which property.
    pub what: &'static str,
    /// Its value.
    pub value: f64,
}

impl Medium {
    /// The constant properties that stand for `material` between `ambient` K and its liquidus: conductivity is its mean over
    /// the temperature (what Kirchhoff's transform needs), heat capacity is what takes a unit volume from `ambient` to the
    /// liquid, latent heat included. What is hotter or colder is seen through these means.
    ///
    /// # Errors
    /// [`MediumError`] where `ambient` is not below the liquidus.
    ///
    /// ```
    /// # let text = meltpath_data::materials::IN625_LASER.text;
    /// # let alloy = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
    /// use meltpath_thermal::material::medium::{Body, Medium};
    /// let medium = Medium::effective(&alloy, 293.15, Body::HalfSpace).unwrap();
    /// let heat = medium.heat_capacity() * (alloy.liquidus - 293.15); // J/mm³ to melt it
    /// assert!((heat - 7.64).abs() < 0.05, "{heat}");
    /// ```
    pub fn effective(material: &Material, ambient: f64, body: Body) -> Result<Self, MediumError> {
        let span = material.liquidus - ambient;
        if !(span > 0.0 && span.is_finite()) {
            return Err(MediumError {
                what: "the liquidus above the ambient temperature",
                value: span,
            });
        }
        let step = span / f64::from(STEPS);
        let mut conductivity = 0.0;
        let mut capacity = 0.0;
        for n in 0..STEPS {
            let kelvin = ambient + (f64::from(n) + 0.5) * step;
            conductivity += material.conductivity(kelvin) / f64::from(STEPS);
            capacity += material.heat_capacity(kelvin) / f64::from(STEPS);
        }
        let medium = Medium {
            conductivity,
            diffusivity: conductivity / capacity,
            ambient,
            body,
        };
        medium.check()?;
        Ok(medium)
    }

    /// Whether all properties are finite and above zero.
    ///
    /// # Errors
    /// [`MediumError`] naming the first that is not.
    pub fn check(&self) -> Result<(), MediumError> {
        let thickness = match self.body {
            Body::HalfSpace => 1.0,
            Body::Plate { thickness } | Body::Cooled { thickness } => thickness,
        };
        let all = [
            ("the conductivity", self.conductivity),
            ("the diffusivity", self.diffusivity),
            ("the ambient temperature", self.ambient),
            ("the thickness of the plate", thickness),
        ];
        match all.into_iter().find(|(_, v)| !(*v > 0.0 && v.is_finite())) {
            Some((what, value)) => Err(MediumError { what, value }),
            None => Ok(()),
        }
    }

    /// Heat capacity, J/(mm³·K).
    pub fn heat_capacity(&self) -> f64 {
        self.conductivity / self.diffusivity
    }

    /// Density along depth (1/mm) at `depth` mm of heat that was laid on the surface and has spread to the variance
    /// `spread` mm²; it integrates to 1 over the body.
    ///
    /// ```
    /// use meltpath_thermal::material::medium::{Body, Medium};
    /// let plate = Medium { conductivity: 0.02, diffusivity: 6.0, ambient: 300.0, body: Body::Plate { thickness: 2.0 } };
    /// assert!((plate.along_depth(1.3, 400.0) - 0.5).abs() < 1e-12); // long after: even through the thickness
    /// ```
    pub fn along_depth(&self, depth: f64, spread: f64) -> f64 {
        let half = |z: f64| (-z * z / (2.0 * spread)).exp();
        let norm = 2.0 / (2.0 * std::f64::consts::PI * spread).sqrt();
        match self.body {
            Body::HalfSpace => norm * half(depth),
            Body::Plate { thickness } => {
                let ratio = spread / (thickness * thickness);
                if ratio < 0.4 {
                    let mut sum = half(depth);
                    for m in 1..=4 {
                        let image = 2.0 * f64::from(m) * thickness;
                        let part = half(image - depth);
                        sum += part + half(image + depth);
                        if part < 1e-14 {
                            break;
                        }
                    }
                    norm * sum
                } else {
                    let mut sum = 1.0;
                    for m in 1..=6 {
                        let wave = f64::from(m) * std::f64::consts::PI;
                        let height = 2.0 * (-0.5 * wave * wave * ratio).exp();
                        if height < 1e-14 {
                            break;
                        }
                        sum += height * (wave * depth / thickness).cos();
                    }
                    sum / thickness
                }
            }
            Body::Cooled { thickness } => {
                let ratio = spread / (thickness * thickness);
                if ratio < 0.4 {
                    let mut sum = half(depth);
                    let mut sign = -1.0;
                    for m in 1..=4 {
                        let image = 2.0 * f64::from(m) * thickness;
                        let part = half(image - depth);
                        sum += sign * (part + half(image + depth));
                        if part < 1e-14 {
                            break;
                        }
                        sign = -sign;
                    }
                    norm * sum.max(0.0)
                } else {
                    let mut sum = 0.0;
                    for m in 0..=6 {
                        let wave = (f64::from(m) + 0.5) * std::f64::consts::PI;
                        let height = 2.0 * (-0.5 * wave * wave * ratio).exp();
                        if height < 1e-14 {
                            break;
                        }
                        sum += height * (wave * depth / thickness).cos();
                    }
                    sum.max(0.0) / thickness
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_and_waves_agree_where_they_meet() {
        let plate = |ratio: f64| {
            let medium = Medium {
                conductivity: 0.02,
                diffusivity: 6.0,
                ambient: 300.0,
                body: Body::Plate { thickness: 1.5 },
            };
            [0.0, 0.4, 1.1, 1.5].map(|z| medium.along_depth(z, ratio * 2.25))
        };
        for (a, b) in plate(0.4 - 1e-12).iter().zip(plate(0.4 + 1e-12)) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }
}
