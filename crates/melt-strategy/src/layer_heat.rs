//! Where the heat of a layer went.

use meltpath_thermal::solver::ledger::Ledger;
use serde::{Deserialize, Serialize};

/// The heat of one layer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LayerHeat {
    /// Mean and highest temperature of what it is laid on, within the extent of the paths, before its powder lies there, K.
    pub before: [f64; 2],
    /// Highest temperature of its build plane while its path was drawn, K.
    pub surface: f64,
    /// Where its heat went until the next one is laid.
    pub ledger: Ledger,
    /// What the solver lost of the heat, as a share of what the beam brought.
    pub residual: f64,
}
