//! Friction of a galvanometer beyond the viscous one.
//!
//! Sources: Rasoanarivo 2020, eq. 2.22 and § 2.2.1.5 (static and Coulomb); D. Karnopp, J. Dyn. Syst. Meas. Control 107 (1985);
//! C. Canudas de Wit et al., IEEE Trans. Autom. Control 40 (1995) (LuGre).

use serde::{Deserialize, Serialize};

use crate::axis::error::{AxisError, not_negative, positive};

/// Friction torque on the rotor, N·m, opposed to motion; the viscous part is with the galvanometer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Friction {
    /// None.
    #[default]
    None,
    /// T = bias + T_C sgn ω. At rest the torque is whatever holds the rotor, within the two sliding values.
    /// The thesis' "static friction" T_P carries no sign (eq. 2.22, erratum 4): it is the bias.
    Coulomb {
        /// T_C, N·m.
        coulomb: f64,
        /// T_P as printed: a constant torque, the same in both directions, N·m.
        #[serde(default)]
        bias: f64,
    },
    /// T_C sgn ω when sliding; at rest up to T_C + T_P (T_P taken as extra stiction, Karnopp's logic).
    Karnopp {
        /// T_C, N·m.
        coulomb: f64,
        /// T_P: what sticking holds beyond T_C, N·m.
        stiction: f64,
        /// Below this speed the rotor counts as at rest, rad/s.
        rest: f64,
    },
    /// Bristles: dz/dt = ω − σ0|ω|z/g(ω), T = σ0 z + σ1 dz/dt, g = T_C + (T_S − T_C) exp(−(ω/ω_s)²).
    LuGre {
        /// T_C, N·m.
        coulomb: f64,
        /// T_S, N·m.
        stiction: f64,
        /// Stribeck speed ω_s, rad/s.
        stribeck: f64,
        /// Bristle stiffness σ0, N·m/rad.
        stiffness: f64,
        /// Bristle damping σ1, N·m·s/rad.
        damping: f64,
    },
}

/// All that holds a turning rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drag {
    /// The dry part.
    pub dry: Friction,
    /// The viscous coefficient, N·m·s/rad.
    pub viscous: f64,
}

impl Friction {
    /// Checks every parameter.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn check(&self) -> Result<(), AxisError> {
        match *self {
            Friction::None => Ok(()),
            Friction::Coulomb { coulomb, bias } => {
                not_negative("the Coulomb torque", coulomb)?;
                if bias.is_finite() {
                    Ok(())
                } else {
                    Err(AxisError::Parameter {
                        what: "the friction bias",
                        value: bias,
                        wanted: "finite",
                    })
                }
            }
            Friction::Karnopp {
                coulomb,
                stiction,
                rest,
            } => {
                not_negative("the Coulomb torque", coulomb)?;
                not_negative("the stiction", stiction)?;
                positive("the speed of rest", rest)
            }
            Friction::LuGre {
                coulomb,
                stiction,
                stribeck,
                stiffness,
                damping,
            } => {
                positive("the Coulomb torque", coulomb)?;
                positive("the stiction torque", stiction)?;
                positive("the Stribeck speed", stribeck)?;
                positive("the bristle stiffness", stiffness)?;
                not_negative("the bristle damping", damping)
            }
        }
    }
}
