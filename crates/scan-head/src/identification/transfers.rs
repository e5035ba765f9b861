//! The two transfers of a rigid motor, and the motor behind them.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.2 (eqs. 2.8-2.13).

use crate::axis::friction::Friction;
use crate::axis::galvanometer::Galvanometer;
use crate::identification::error::IdentificationError;

/// The two transfers that are identified: θ/i = G1/(s(1+τ1 s)), i/U = G2(1+τ1 s)/((1+τ2 s)(1+τ3 s)) (eq. 2.10).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfers {
    /// G1, rad/(A·s).
    pub angle_gain: f64,
    /// τ1 = J/B, s.
    pub mechanical: f64,
    /// G2, A/V.
    pub current_gain: f64,
    /// τ2 and τ3, s.
    pub lags: [f64; 2],
}

/// The motor behind two transfers (eq. 2.13), torque and back-EMF constants taken equal.
///
/// # Errors
/// [`IdentificationError::Unphysical`] naming the first parameter that is not above zero.
pub fn motor_of(t: &Transfers) -> Result<Galvanometer, IdentificationError> {
    let a = t.mechanical;
    let [r1, r2] = t.lags.map(|tau| 1.0 / tau);
    let c = 1.0 / (t.current_gain * a * r1 * r2);
    let b = (a * c * (r1 + r2) - c) / a;
    let d = 1.0 / t.current_gain - b;
    let torque_constant = d / t.angle_gain;
    let viscous = torque_constant / t.angle_gain;
    let motor = Galvanometer {
        resistance: b,
        inductance: c,
        torque_constant,
        back_emf: torque_constant,
        inertia: a * viscous,
        viscous,
        modes: Vec::new(),
        friction: Friction::None,
        felt: 0.0,
    };
    for (what, value) in [
        ("R", motor.resistance),
        ("L", motor.inductance),
        ("Kc", motor.torque_constant),
        ("B", motor.viscous),
        ("J", motor.inertia),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(IdentificationError::Unphysical { what, value });
        }
    }
    Ok(motor)
}
