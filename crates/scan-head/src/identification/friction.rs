//! Friction of an axis from ramps at constant speed.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.5 (eq. 2.22).

use crate::identification::error::IdentificationError;
use meltpath_numerics::least_squares;

/// A steady ramp: speed (rad/s) and mean current (A).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyRamp {
    /// Speed, signed, rad/s.
    pub speed: f64,
    /// Mean current while the speed is constant, A.
    pub current: f64,
}

/// Torque at constant speed: Kc·ī = B ω + T_P + T_C sgn ω (eq. 2.22).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RampFriction {
    /// B, N·m·s/rad, and its deviation.
    pub viscous: [f64; 2],
    /// T_P, N·m, the same in both directions, and its deviation.
    pub bias: [f64; 2],
    /// T_C, N·m, and its deviation.
    pub coulomb: [f64; 2],
    /// Standard deviation of the residual torques, N·m.
    pub rms: f64,
    /// The same with viscous friction alone, N·m: what the dry terms bring.
    pub rms_viscous_only: f64,
}

/// Friction from ramps at many speeds in both directions.
///
/// # Errors
/// [`IdentificationError::Ramps`], [`IdentificationError::Fit`].
pub fn friction_of_ramps(
    ramps: &[SteadyRamp],
    torque_constant: f64,
) -> Result<RampFriction, IdentificationError> {
    let forward = ramps.iter().filter(|r| r.speed > 0.0).count();
    let backward = ramps.iter().filter(|r| r.speed < 0.0).count();
    if forward < 2 || backward < 2 {
        return Err(IdentificationError::Ramps { forward, backward });
    }
    // unknowns of the order of one: torques over the greatest torque, speeds over the greatest speed
    let torque = |r: &SteadyRamp| torque_constant * r.current;
    let most = ramps.iter().map(|r| torque(r).abs()).fold(1e-300, f64::max);
    let fastest = ramps.iter().map(|r| r.speed.abs()).fold(1e-300, f64::max);
    let dry = least_squares::fit(
        |x| {
            ramps
                .iter()
                .map(|r| {
                    x[0] * r.speed / fastest + x[1] + x[2] * r.speed.signum() - torque(r) / most
                })
                .collect()
        },
        &[0.5, 0.0, 0.5],
    )?;
    let wet = least_squares::fit(
        |x| {
            ramps
                .iter()
                .map(|r| x[0] * r.speed / fastest - torque(r) / most)
                .collect()
        },
        &[0.5],
    )?;
    let both = |i: usize, unit: f64| [unit * dry.values[i], unit * dry.sigma[i]];
    Ok(RampFriction {
        viscous: both(0, most / fastest),
        bias: both(1, most),
        coulomb: both(2, most),
        rms: most * dry.rms,
        rms_viscous_only: most * wet.rms,
    })
}
