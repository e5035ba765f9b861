//! The friction behind the ramps of a health test.

use crate::health::records::RampRecord;
use crate::identification::error::IdentificationError;
use crate::identification::friction::{SteadyRamp, friction_of_ramps};
use serde::{Deserialize, Serialize};

/// Friction fitted to the ramps: T = B ω + T_P + T_C sgn ω (Rasoanarivo 2020, eq. 2.22).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrictionFit {
    /// B, N·m·s/rad.
    pub viscous: f64,
    /// T_P, N·m.
    pub bias: f64,
    /// T_C, N·m.
    pub coulomb: f64,
    /// RMS of what is left, N·m.
    pub residual: f64,
    /// RMS left by B alone, N·m.
    pub residual_viscous: f64,
}

impl FrictionFit {
    /// The friction of ramps.
    ///
    /// # Errors
    /// [`IdentificationError::Ramps`], [`IdentificationError::Fit`].
    pub fn of(ramps: &[RampRecord]) -> Result<Self, IdentificationError> {
        // torques, as of a motor of 1 N·m/A
        let steady = ramps.iter().map(|r| SteadyRamp {
            speed: r.steady_speed_deg.to_radians(),
            current: r.torque,
            sigma: None,
        });
        let found = friction_of_ramps(&steady.collect::<Vec<_>>(), 1.0)?;
        let count = ramps.len() as f64;
        // the fit takes off degrees of freedom
        let rms = |sigma: f64, unknowns: f64| sigma * (1.0 - unknowns / count).sqrt();
        Ok(FrictionFit {
            viscous: found.viscous[0],
            bias: found.bias[0],
            coulomb: found.coulomb[0],
            residual: rms(found.rms, 3.0),
            residual_viscous: rms(found.rms_viscous_only, 1.0),
        })
    }
}
