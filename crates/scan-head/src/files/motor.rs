//! A motor's file, as an identification prints it.

use crate::axis::friction::Friction;
use crate::axis::galvanometer::{Galvanometer, Mode};
use crate::files::figure::{
    BACK_EMF, Figure, HERTZ, HeadFileError, INDUCTANCE, INERTIA, NONE, RESISTANCE, Reading, TORQUE,
    TORQUE_CONSTANT, VISCOUS, read,
};
use meltpath_base::quantity::Unit;
use serde::Deserialize;

/// The figures of a motor alone, as an identification prints them; what is missing stays as it was.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorFile {
    resistance: Option<Figure>,
    inductance: Option<Figure>,
    torque_constant: Option<Figure>,
    back_emf: Option<Figure>,
    inertia: Option<Figure>,
    viscous: Option<Figure>,
    coulomb: Option<Figure>,
    bias: Option<Figure>,
    mode: Option<Vec<ModeTable>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModeTable {
    frequency: Figure,
    damping: Figure,
    /// K_r Kc/J: the mode's gain over the rigid body's.
    gain_ratio: Figure,
}

/// Puts the figures of a motor's file, such as `meltpath identify` prints them, in place of those of a motor.
///
/// # Errors
/// [`HeadFileError`] with the place in the file.
pub fn parse_motor(text: &str, motor: &Galvanometer) -> Result<Galvanometer, HeadFileError> {
    let file: MotorFile = toml::from_str(text).map_err(|e| HeadFileError::Form(e.to_string()))?;
    let r = Reading { table: "motor" };
    let or = |key: &'static str, figure: &Option<Figure>, units: &[Unit], old: f64| match figure {
        Some(figure) => r.get(key, figure, units),
        None => Ok(old),
    };
    let mut out = motor.clone();
    out.resistance = or("resistance", &file.resistance, RESISTANCE, out.resistance)?;
    out.inductance = or("inductance", &file.inductance, INDUCTANCE, out.inductance)?;
    out.torque_constant = or(
        "torque_constant",
        &file.torque_constant,
        TORQUE_CONSTANT,
        out.torque_constant,
    )?;
    out.back_emf = or("back_emf", &file.back_emf, BACK_EMF, out.back_emf)?;
    out.inertia = or("inertia", &file.inertia, INERTIA, out.inertia)?;
    out.viscous = or("viscous", &file.viscous, VISCOUS, out.viscous)?;
    if let Friction::Coulomb { coulomb, bias } = &mut out.friction {
        *coulomb = or("coulomb", &file.coulomb, TORQUE, *coulomb)?;
        *bias = or("bias", &file.bias, TORQUE, *bias)?;
    }
    let rigid = out.torque_constant / out.inertia;
    if let Some(modes) = &file.mode {
        out.modes = modes
            .iter()
            .map(|m| mode(&r, m, rigid))
            .collect::<Result<_, _>>()?;
    } else {
        let before = motor.torque_constant / motor.inertia;
        for m in &mut out.modes {
            m.gain *= rigid / before;
        }
    }
    out.check()
        .map_err(|e| HeadFileError::Form(e.to_string()))?;
    Ok(out)
}

/// A mode whose gain is told over that of the rigid body, `rigid` rad/s² per A.
pub(super) fn mode(r: &Reading, m: &ModeTable, rigid: f64) -> Result<Mode, HeadFileError> {
    Ok(Mode {
        omega: std::f64::consts::TAU * read!(r, m, frequency, HERTZ),
        damping: read!(r, m, damping, NONE),
        gain: read!(r, m, gain_ratio, NONE) * rigid,
    })
}
