//! What a material does with heat: laws of its powder, solid and liquid, latent heat, radiation and evaporation.
//!
//! Source of the powder model: Béraud 2016, section 3.2.2.1: powder becomes denser with the highest temperature it has
//! reached and is dense for ever above the solidus.

pub mod enthalpy;
pub mod file;
pub mod law;
pub mod medium;
pub mod pool_limit;
pub mod vapour;

use meltpath_base::choice;

use crate::material::law::Law;
use crate::material::vapour::Evaporation;

/// 0 °C in kelvin.
pub const CELSIUS: f64 = 273.15;

choice! {
    /// How the latent heat is spread between solidus and liquidus.
    pub enum LatentShape {
        Triangular "triangular" => "A triangle with its summit midway (Béraud 2016, fig. 3.2.5).",
        Uniform "uniform" => "The same share in every kelvin.",
    }
}

/// How powder conducts.
#[derive(Debug, Clone, PartialEq)]
pub enum PowderConduction {
    /// By the relative density: `k_c = k_s (1 − φ)` (Béraud 2016, table 3.2.1).
    Proportional,
    /// As it was measured, W/(m·K), on powder that is as hot, K, for the first time. From the last corner on it nears the dense
    /// metal's at the solidus, in proportion to the densification.
    Measured {
        /// The corners, temperatures strictly increasing.
        corners: Vec<[f64; 2]>,
    },
}

/// Powder before it melts.
#[derive(Debug, Clone, PartialEq)]
pub struct Powder {
    /// Relative density `1 − φ` against the highest temperature reached, K; 1 from the solidus on, whatever it says there.
    pub relative_density: Law,
    /// Its conductivity.
    pub conduction: PowderConduction,
    /// Emissivity.
    pub emissivity: f64,
}

/// Arithmetic roughness Ra of what is built, µm. It depends on the powder, whose grains stick to the melt, and on the face's
/// direction; no beam setting changes it (Béraud 2016, annex A: 64 planes over 3 to 15 mA, 500 to 1400 mm/s, 0 to 21 mA of
/// focus show no correlation). Hence nothing here asks for the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Of vertical faces, measured in the build plane: mean, least, greatest.
    pub in_plane: [f64; 3],
    /// Of vertical faces, measured along the build direction: mean, least, greatest.
    pub along_build: [f64; 3],
    /// Of faces of any direction: least, greatest.
    pub any_face: [f64; 2],
}

/// Laws of one material. Density kg/m³, specific heat J/(kg·K), conductivity W/(m·K), as the sources print them;
/// [`Material::conductivity`] and [`Material::heat_capacity`] give them in millimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Its name.
    pub name: String,
    /// Temperatures between which the laws are meant to hold, K.
    pub range: [f64; 2],
    /// Temperature at which every layer starts, K; enthalpy is counted from here.
    pub start: f64,
    /// Where melting begins, K.
    pub solidus: f64,
    /// Where melting ends, K.
    pub liquidus: f64,
    /// Latent heat of fusion, J/kg.
    pub latent: f64,
    /// How it is spread.
    pub latent_shape: LatentShape,
    /// Density of the dense solid.
    pub density_solid: Law,
    /// Density of the liquid.
    pub density_liquid: Law,
    /// Specific heat of the solid.
    pub specific_heat_solid: Law,
    /// Specific heat of the liquid.
    pub specific_heat_liquid: Law,
    /// Conductivity of the dense solid.
    pub conductivity_solid: Law,
    /// Conductivity of the liquid.
    pub conductivity_liquid: Law,
    /// The powder.
    pub powder: Powder,
    /// Emissivity of the dense solid and of the liquid.
    pub emissivity: f64,
    /// Loss by evaporation, where the data give it; the solver applies it only when its surface says so.
    pub evaporation: Option<Evaporation>,
    /// Surface tension of the melt, N/m, where the data give it.
    pub surface_tension: Option<Law>,
    /// What parts are drawn larger by, since they shrink on cooling: in the build plane, along the build direction; 1 where the
    /// data give nothing.
    pub scaling: [f64; 2],
    /// Roughness of what is built, where the data give it.
    pub roughness: Option<Roughness>,
    /// Share of a laser's power that becomes heat on a flat surface, where the data give it.
    pub absorptivity: Option<f64>,
}

impl Material {
    /// A dense material with constant properties and no phase change: conductivity in W/(mm·K), heat capacity in J/(mm³·K).
    /// What the closed-form solutions assume.
    pub fn constant(conductivity: f64, heat_capacity: f64, start: f64) -> Self {
        Material {
            name: "constant properties".to_owned(),
            range: [0.0, f64::INFINITY],
            start,
            solidus: start + 1000.0,
            liquidus: start + 1010.0,
            latent: 0.0,
            latent_shape: LatentShape::Uniform,
            density_solid: Law::constant(1e3),
            density_liquid: Law::constant(1e3),
            specific_heat_solid: Law::constant(heat_capacity * 1e6),
            specific_heat_liquid: Law::constant(heat_capacity * 1e6),
            conductivity_solid: Law::constant(conductivity * 1e3),
            conductivity_liquid: Law::constant(conductivity * 1e3),
            powder: Powder {
                relative_density: Law::constant(1.0),
                conduction: PowderConduction::Proportional,
                emissivity: 0.0,
            },
            emissivity: 0.0,
            evaporation: None,
            surface_tension: None,
            scaling: [1.0, 1.0],
            roughness: None,
            absorptivity: None,
        }
    }

    fn across(&self, solid: &Law, liquid: &Law, kelvin: f64) -> f64 {
        if kelvin <= self.solidus {
            solid.at(kelvin)
        } else if kelvin >= self.liquidus {
            liquid.at(kelvin)
        } else {
            let share = (kelvin - self.solidus) / (self.liquidus - self.solidus);
            (1.0 - share) * solid.at(self.solidus) + share * liquid.at(self.liquidus)
        }
    }

    /// Density of the dense material, kg/m³; straight between solidus and liquidus.
    pub fn density(&self, kelvin: f64) -> f64 {
        self.across(&self.density_solid, &self.density_liquid, kelvin)
    }

    /// Specific heat without latent heat, J/(kg·K); straight between solidus and liquidus.
    pub fn specific_heat(&self, kelvin: f64) -> f64 {
        self.across(
            &self.specific_heat_solid,
            &self.specific_heat_liquid,
            kelvin,
        )
    }

    /// Conductivity of the dense material, W/(mm·K); straight between solidus and liquidus.
    pub fn conductivity(&self, kelvin: f64) -> f64 {
        1e-3 * self.across(&self.conductivity_solid, &self.conductivity_liquid, kelvin)
    }

    /// What the latent heat adds to the specific heat, J/(kg·K).
    fn latent_bump(&self, kelvin: f64) -> f64 {
        let width = self.liquidus - self.solidus;
        let inside = (kelvin - self.solidus) / width;
        if !(0.0..=1.0).contains(&inside) {
            return 0.0;
        }
        match self.latent_shape {
            LatentShape::Uniform => self.latent / width,
            LatentShape::Triangular => {
                2.0 * self.latent / width * (1.0 - (2.0 * inside - 1.0).abs())
            }
        }
    }

    /// Heat to warm a unit volume of the dense material by one kelvin, latent heat included, J/(mm³·K).
    pub fn heat_capacity(&self, kelvin: f64) -> f64 {
        1e-9 * self.density(kelvin) * (self.specific_heat(kelvin) + self.latent_bump(kelvin))
    }

    /// Relative density of powder whose highest temperature so far is `highest`, K: 1 from the solidus on.
    ///
    /// ```
    /// # let text = meltpath_data::materials::TI6AL4V_EBM.text;
    /// # let material = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
    /// assert!((material.relative_density(750.0 + 273.15) - 0.62).abs() < 1e-12);
    /// assert_eq!(material.relative_density(1605.0 + 273.15), 1.0);
    /// ```
    pub fn relative_density(&self, highest: f64) -> f64 {
        if highest >= self.solidus {
            1.0
        } else {
            self.powder.relative_density.at(highest).clamp(0.01, 1.0)
        }
    }

    /// Corners `[relative density, share of the dense conductivity]` between which powder conducts, from fresh powder at the start
    /// temperature to dense metal; two, or three and more where it was measured.
    pub fn powder_conduction(&self) -> Vec<[f64; 2]> {
        let fresh = self.relative_density(self.start);
        let corners = match &self.powder.conduction {
            PowderConduction::Measured { corners } if fresh < 1.0 - 1e-6 => corners,
            _ => return vec![[0.0, 0.0], [1.0, 1.0]],
        };
        let measured = Law::Table {
            corners: corners.clone(),
        };
        let share = |kelvin: f64| 1e-3 * measured.at(kelvin) / self.conductivity(kelvin);
        let mut found = vec![[fresh, share(self.start)]];
        for [kelvin, _] in corners {
            let relative = self.relative_density(*kelvin);
            let last = found[found.len() - 1][0];
            if relative > last + 1e-6 && relative < 1.0 - 1e-6 {
                found.push([relative, share(*kelvin)]);
            }
        }
        found.push([1.0, 1.0]);
        found
    }

    /// How much larger the diffusivity of powder beside dense metal is than that of the metal: it conducts by the harmonic mean of both
    /// but stores only its own share; 1 where it is not larger.
    pub(crate) fn powder_contrast(&self) -> f64 {
        let contrast = |share: f64, relative: f64| 2.0 * share / (share + 1.0) / relative;
        let fresh = self.relative_density(self.start);
        if self.powder.conduction == PowderConduction::Proportional {
            return contrast(fresh, fresh).max(1.0);
        }
        let corners = self.powder_conduction().into_iter();
        let corners = corners.filter(|[relative, _]| *relative > 0.0);
        let contrasts = corners.map(|[relative, share]| contrast(share, relative));
        contrasts.fold(1.0, f64::max)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::material::enthalpy::Enthalpy;
    use crate::material::file::{Readings, read};

    pub(crate) fn titanium() -> Material {
        let text = meltpath_data::materials::TI6AL4V_EBM.text;
        read(text, Readings::default()).unwrap()
    }

    #[test]
    fn ebm_a03_powder_becomes_dense_and_stays_so() {
        let material = titanium();
        let porosity = |celsius: f64| 1.0 - material.relative_density(celsius + CELSIUS);
        assert!((porosity(750.0) - 0.38).abs() < 1e-3);
        assert!((porosity(1177.5) - 0.19).abs() < 1e-3);
        assert!(porosity(1605.0) == 0.0 && porosity(2500.0) == 0.0);
        // the law is of the highest temperature: a cell of the solver that has cooled keeps its density
        let curve = Enthalpy::new(&material).unwrap();
        let f = curve.formulas::<f64>();
        let (g, r) = crate::solver::kernel::warm(&f, 0.0, 0.62, 0.5 * curve.at_solidus);
        let (_, cooled) = crate::solver::kernel::warm(&f, g, r, -0.9 * g * r);
        assert!(r > 0.7 && cooled == r, "{r} {cooled}");
    }

    #[test]
    fn ebm_a04_the_bump_holds_the_latent_heat() {
        let material = titanium();
        let n = 6000;
        let step = (material.liquidus - material.solidus) / f64::from(n);
        let sum: f64 = (0..n)
            .map(|i| material.latent_bump(material.solidus + (f64::from(i) + 0.5) * step) * step)
            .sum();
        assert!((sum / 440e3 - 1.0).abs() < 1e-3, "{sum}");
        let top = material.latent_bump(1635.0 + CELSIUS);
        assert!((top - 14_667.0).abs() < 1.0, "{top}");
    }
}
