//! Where the heat of a solver went, and what left as vapour.

use serde::{Deserialize, Serialize};

use crate::material::vapour::Evaporation;

/// Where the heat went, J. [`Ledger::residual`] tells what the solver lost.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Ledger {
    /// Brought by the beam into the domain.
    pub absorbed: f64,
    /// Power of the beam that fell beside the domain.
    pub missed: f64,
    /// Radiated by the build plane.
    pub radiated: f64,
    /// Carried away by evaporation.
    pub evaporated: f64,
    /// Mass of each component of the material's vapour that left, kg.
    pub vapour: [f64; Evaporation::MOST],
    /// Conducted out through imposed faces.
    pub conducted: f64,
    /// Taken out or brought in by new layers and set temperatures.
    pub reset: f64,
}

impl Ledger {
    /// Adds what another one holds.
    pub(crate) fn add(&mut self, other: &Ledger) {
        self.absorbed += other.absorbed;
        self.missed += other.missed;
        self.radiated += other.radiated;
        self.evaporated += other.evaporated;
        for (mass, more) in self.vapour.iter_mut().zip(other.vapour) {
            *mass += more;
        }
        self.conducted += other.conducted;
        self.reset += other.reset;
    }

    /// Share of the beam's heat that vapour carried away.
    pub fn vapour_share(&self) -> f64 {
        self.evaporated / self.absorbed.max(f64::MIN_POSITIVE)
    }

    /// Heat that should have stayed, J.
    pub fn net(&self) -> f64 {
        self.absorbed - self.radiated - self.evaporated - self.conducted + self.reset
    }

    /// Difference between the heat `stored` and what should have stayed, as a share of what the beam brought.
    pub fn residual(&self, stored: f64) -> f64 {
        let scale = self
            .absorbed
            .abs()
            .max(self.conducted.abs())
            .max(f64::MIN_POSITIVE);
        (stored - self.net()) / scale
    }
}
