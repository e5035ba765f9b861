//! A motor's file, as an identification prints it.

use crate::axis::friction::Friction;
use crate::axis::galvanometer::{Galvanometer, Mode};
use crate::files::figure::{
    BackEmf, Hertz, Inductance, Inertia, Resistance, Torque, TorqueConstant, Viscous,
};
use meltpath_base::quantity::Quantity;
use meltpath_base::settings::{self, Problem, Problems, Setting, Sourced};
use meltpath_base::{Pure, table};

table! {
    /// The figures of a motor alone, as `meltpath identify` prints them; what is missing stays as the head has it.
    pub struct MotorFile {
        /// Resistance of the coil.
        resistance: Sourced<Resistance> where positive => none("the head's");
        /// Inductance of the coil.
        inductance: Sourced<Inductance> where positive => none("the head's");
        /// Torque per current.
        torque_constant: Sourced<TorqueConstant> where positive => none("the head's");
        /// Voltage per speed.
        back_emf: Sourced<BackEmf> where not_negative => none("the head's");
        /// Inertia of rotor and mirror.
        inertia: Sourced<Inertia> where positive => none("the head's");
        /// Viscous friction.
        viscous: Sourced<Viscous> => none("the head's");
        /// Coulomb friction.
        coulomb: Sourced<Torque> => none("the head's");
        /// Its part that does not turn with the speed.
        bias: Sourced<Torque> => none("the head's");
        /// Share of friction that the modes feel.
        friction_felt: Sourced<Pure> where within(0.0, 1.0) => none("the head's");
        /// What the motor leaves of the record that it was identified from, over the record's noise: about 1 where it explains it. Beyond 1.1 no verdict on it is a promise.
        misfit: Sourced<Pure> where not_negative => none("not judged");
        /// Modes of the flexible shaft.
        mode: Vec<ModeTable> => none("the head's, at the same share of the rigid body's gain");
    }

    /// A mode of the flexible shaft.
    pub struct ModeTable {
        /// Its frequency.
        frequency: Sourced<Hertz> where positive => required;
        /// Its damping.
        damping: Sourced<Pure> where not_negative => required;
        /// K_r Kc/J: its gain over the rigid body's.
        gain_ratio: Sourced<Pure> => required;
    }
}

/// A motor as its file tells it.
#[derive(Debug, Clone, PartialEq)]
pub struct ToldMotor {
    /// It.
    pub motor: Galvanometer,
    /// What it leaves of the record that it was identified from, over the record's noise, where the file says so.
    pub misfit: Option<f64>,
}

/// Puts the figures of a motor's file, such as `meltpath identify` prints them, in place of those of a motor.
///
/// # Errors
/// Everything wrong, with its place in the file.
pub fn parse_motor(text: &str, motor: &Galvanometer) -> Result<ToldMotor, Problems> {
    fn put<Q: Quantity>(figure: &Setting<Option<Sourced<Q>>>, old: &mut f64) {
        if let Some(figure) = &**figure {
            *old = figure.number();
        }
    }
    let file = settings::parse(text, |_: &MotorFile| Vec::new())?;
    let mut out = motor.clone();
    put(&file.resistance, &mut out.resistance);
    put(&file.inductance, &mut out.inductance);
    put(&file.torque_constant, &mut out.torque_constant);
    put(&file.back_emf, &mut out.back_emf);
    put(&file.inertia, &mut out.inertia);
    put(&file.viscous, &mut out.viscous);
    if let Friction::Coulomb { coulomb, bias } = &mut out.friction {
        put(&file.coulomb, coulomb);
        put(&file.bias, bias);
    }
    put(&file.friction_felt, &mut out.felt);
    let rigid = out.torque_constant / out.inertia;
    if let Some(modes) = &*file.mode {
        out.modes = modes.iter().map(|m| mode(m, rigid)).collect();
    } else {
        let before = motor.torque_constant / motor.inertia;
        for m in &mut out.modes {
            m.gain *= rigid / before;
        }
    }
    out.check().map_err(|e| Problem::new(e.to_string()))?;
    Ok(ToldMotor {
        motor: out,
        misfit: file.misfit.as_ref().map(|misfit| misfit.0),
    })
}

/// A mode whose gain is told over that of the rigid body, `rigid` rad/s² per A.
pub(super) fn mode(m: &ModeTable, rigid: f64) -> Mode {
    Mode {
        omega: std::f64::consts::TAU * m.frequency.0,
        damping: m.damping.0,
        gain: m.gain_ratio.0 * rigid,
    }
}
