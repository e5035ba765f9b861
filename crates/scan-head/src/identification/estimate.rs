//! What the joint fit of a record searches: the motor's parameters, and the state in which each piece of the record begins.

use crate::axis::friction::Friction;
use crate::axis::galvanometer::{Galvanometer, Mode};
use crate::identification::drive::{Delays, LATEST};

/// A parameter of the joint fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Parameter {
    Resistance,
    Inductance,
    TorqueConstant,
    Inertia,
    Viscous,
    Bias,
    Coulomb,
    /// What the ammeter reads where no current flows.
    Zero,
    /// Share of dry friction that the modes feel.
    Felt,
    /// Delay of the current (0) or of the angle (1).
    Delay(usize),
    /// Pulsation (0), damping (1) or gain over Kc/J (2) of a mode.
    Mode(usize, usize),
}

/// Parameters of the rigid motor, in the order of [`super::motor::Identified::sigma`].
pub(super) const RIGID: [Parameter; 5] = [
    Parameter::Resistance,
    Parameter::Inductance,
    Parameter::TorqueConstant,
    Parameter::Inertia,
    Parameter::Viscous,
];

/// Values of all parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Estimate {
    pub(super) motor: Galvanometer,
    /// N·m.
    pub(super) coulomb: f64,
    pub(super) bias: f64,
    /// s.
    pub(super) delays: Delays,
    /// What the ammeter reads where no current flows, A.
    pub(super) zero: f64,
}

/// Units in which steps are taken where a parameter's logarithm is not.
#[derive(Debug, Clone, Copy)]
pub(super) struct Units {
    /// N·m.
    pub(super) torque: f64,
    /// A.
    pub(super) current: f64,
    /// s.
    pub(super) period: f64,
}

impl Parameter {
    /// What one unit of a step is in the parameter's own unit; nothing where the step is of its logarithm.
    pub(super) fn unit(self, units: Units) -> Option<f64> {
        match self {
            Parameter::Bias | Parameter::Coulomb => Some(units.torque),
            Parameter::Zero => Some(units.current),
            Parameter::Delay(_) => Some(units.period),
            Parameter::Felt => Some(1.0),
            _ => None,
        }
    }
}

impl Estimate {
    /// The motor with its friction.
    pub(super) fn driven(&self) -> Galvanometer {
        Galvanometer {
            friction: Friction::Coulomb {
                coulomb: self.coulomb,
                bias: self.bias,
            },
            ..self.motor.clone()
        }
    }

    /// Moved by a step of one parameter; torque constant and back-EMF constant stay equal, modes keep their share of Kc/J.
    pub(super) fn moved(&self, parameter: Parameter, step: f64, units: Units) -> Self {
        let mut out = self.clone();
        let by = step * parameter.unit(units).unwrap_or(1.0);
        let times = step.exp();
        let m = &mut out.motor;
        let share = |modes: &mut [Mode], by: f64| modes.iter_mut().for_each(|m| m.gain *= by);
        match parameter {
            Parameter::Resistance => m.resistance *= times,
            Parameter::Inductance => m.inductance *= times,
            Parameter::TorqueConstant => {
                m.torque_constant *= times;
                m.back_emf *= times;
                share(&mut m.modes, times);
            }
            Parameter::Inertia => {
                m.inertia *= times;
                share(&mut m.modes, 1.0 / times);
            }
            Parameter::Viscous => m.viscous *= times,
            Parameter::Bias => out.bias += by,
            Parameter::Coulomb => out.coulomb = (out.coulomb + by).max(0.0),
            Parameter::Zero => out.zero += by,
            Parameter::Felt => m.felt = (m.felt + by).clamp(-1.0, 2.0),
            Parameter::Delay(channel) => {
                if let Some(delay) = out.delays.get_mut(channel) {
                    let latest = LATEST as f64 * units.period;
                    *delay = (*delay + by).clamp(-units.period, latest);
                }
            }
            Parameter::Mode(k, which) => {
                if let Some(mode) = m.modes.get_mut(k) {
                    match which {
                        0 => mode.omega *= times,
                        1 => mode.damping *= times,
                        _ => mode.gain *= times,
                    }
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::galvanometer::example;

    fn estimate() -> Estimate {
        Estimate {
            motor: Galvanometer {
                felt: 1.0,
                ..example()
            },
            coulomb: 3e-5,
            bias: 0.0,
            delays: [0.0; 2],
            zero: 0.0,
        }
    }

    const UNITS: Units = Units {
        torque: 1e-3,
        current: 0.1,
        period: 20e-6,
    };

    /// Delays go in samples, and no farther than a channel may be read late, or a sample early; torques go in the motor's, down to none.
    #[test]
    fn steps_end_at_the_bounds_of_their_parameters() {
        let from = estimate();
        let delay = |step: f64| from.moved(Parameter::Delay(1), step, UNITS).delays;
        assert_eq!(delay(0.5), [0.0, 10e-6]);
        assert!((delay(40.0)[1] / 320e-6 - 1.0).abs() < 1e-12);
        assert_eq!(delay(-7.0)[1], -20e-6);
        let dry = |step: f64| from.moved(Parameter::Coulomb, step, UNITS).coulomb;
        assert!((dry(0.01) - 4e-5).abs() < 1e-18);
        assert_eq!(dry(-1.0), 0.0);
        let felt = |step: f64| from.moved(Parameter::Felt, step, UNITS).motor.felt;
        assert_eq!([felt(-0.25), felt(5.0), felt(-5.0)], [0.75, 2.0, -1.0]);
    }

    /// The gain of a mode is its share of Kc/J: that stays where the motor's constants move.
    #[test]
    fn modes_keep_their_share_of_the_motor() {
        let from = estimate();
        let share = |m: &Galvanometer| m.modes[0].gain * m.inertia / m.torque_constant;
        for parameter in [Parameter::TorqueConstant, Parameter::Inertia] {
            let moved = from.moved(parameter, 0.3, UNITS).motor;
            assert!((share(&moved) - 0.3).abs() < 1e-12, "{parameter:?}");
            assert_eq!(moved.back_emf, moved.torque_constant);
            let times = (moved.inertia / from.motor.inertia)
                * (moved.torque_constant / from.motor.torque_constant);
            assert!((times - 0.3_f64.exp()).abs() < 1e-12, "{parameter:?}");
        }
    }
}
