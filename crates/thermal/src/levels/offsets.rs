//! Heat of cells by enthalpy and relative density, from a table: what is kept where tiles become finer and coarser.

use crate::material::Material;
use crate::material::enthalpy::Enthalpy;

/// Heat of a cell of relative density `r` whose enthalpy is 0, J/mm³: linear pieces of [`Enthalpy::stored`].
#[derive(Debug, Clone)]
pub(crate) struct Offsets {
    fresh: f32,
    per_entry: f64,
    heat: Vec<f64>,
    highest: Vec<f64>,
}

impl Offsets {
    const ENTRIES: usize = 1024;

    pub(crate) fn new(curve: &Enthalpy, material: &Material) -> Self {
        let fresh = material.relative_density(material.start).min(1.0 - 1e-6);
        let width = 1.0 - fresh;
        let at = |n: usize| fresh + width * n as f64 / Self::ENTRIES as f64;
        Offsets {
            fresh: fresh as f32,
            per_entry: Self::ENTRIES as f64 / width,
            heat: (0..=Self::ENTRIES)
                .map(|n| curve.stored(0.0, at(n).min(1.0)))
                .collect(),
            highest: (0..=Self::ENTRIES)
                .map(|n| curve.highest(at(n).min(1.0)))
                .collect(),
        }
    }

    /// Enthalpy at which powder grows as dense as `r`, J/mm³.
    pub(crate) fn highest(&self, r: f32) -> f32 {
        self.of(&self.highest, r) as f32
    }

    /// Heat of a cell whose enthalpy is 0, J/mm³.
    pub(crate) fn at(&self, r: f32) -> f64 {
        self.of(&self.heat, r)
    }

    fn of(&self, table: &[f64], r: f32) -> f64 {
        if r >= 1.0 {
            return table[Self::ENTRIES];
        }
        let place =
            (f64::from(r - self.fresh) * self.per_entry).clamp(0.0, Self::ENTRIES as f64 - 1e-9);
        let n = place as usize;
        table[n] + (place - n as f64) * (table[n + 1] - table[n])
    }

    /// Heat of a cell, J/mm³.
    pub(crate) fn stored(&self, g: f32, r: f32) -> f64 {
        self.at(r) + f64::from(r) * f64::from(g)
    }
}
