//! How powder conducts, by its density or as it was measured.

use meltpath_base::number::significant;
use meltpath_base::settings::{Many, Problem, UnitOf};
use meltpath_base::{choice, table};

use super::units::Conductivity;
use crate::material::law::Law;
use crate::material::{CELSIUS, PowderConduction};

choice! {
    /// How powder conducts.
    pub enum PowderReading {
        ByDensity "by-density" => "As the solid, times its relative density (Béraud 2016).",
        Measured "measured" => "By the material's `powder_conductivity`.",
    }
}

table! {
    /// Conductivity of powder, straight between corners.
    pub struct PowderConductivityTable {
        /// Temperature in °C of powder that is as hot for the first time, and its conductivity in `unit`, by increasing temperature; one corner for a constant. From the last on it nears the solid's at the solidus, as it densifies.
        corners: Many<[f64; 2], 1, 4> => required;
        /// Its unit.
        unit: UnitOf<Conductivity> => required;
        /// One of `sources`.
        source: String => required;
        /// Where in it.
        page: String => required;
        /// How well it is known, in words.
        uncertainty: String => none("not known");
        /// How it was read or derived.
        note: String => none("nothing to add");
    }
}

impl PowderConductivityTable {
    /// What it says, beside the conductivity of the solid.
    pub(super) fn law(&self, solid: &Law) -> Result<PowderConduction, Problem> {
        let unit = self.unit.unit;
        let written = self.corners.iter();
        let corners: Vec<[f64; 2]> = written
            .map(|&[t, k]| [t + CELSIUS, k * unit.factor / unit.divisor])
            .collect();
        if !corners.windows(2).all(|w| w[0][0] < w[1][0]) {
            let message = "the temperatures of the corners must increase";
            return Err(self.corners.problem(message));
        }
        let odd = |&&[kelvin, k]: &&[f64; 2]| !(k > 0.0 && k <= solid.at(kelvin));
        if let Some([kelvin, k]) = corners.iter().find(odd) {
            let message = format!(
                "powder conducts {} W/(m·K) at {:.0} °C: it must be above zero, and no more than the solid's {} W/(m·K)",
                significant(*k, 3),
                kelvin - CELSIUS,
                significant(solid.at(*kelvin), 3)
            );
            return Err(self.corners.problem(message));
        }
        Ok(PowderConduction::Measured { corners })
    }
}
