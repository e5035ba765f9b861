//! The galvanometer: a limited-travel motor that tilts a mirror, with the flexible modes of its shaft.
//!
//! Source: Rasoanarivo 2020, eq. 2.1-2.20. The modes are those of the thesis' modal split,
//! ω_r/i = Kc/(B + J s) + Σ K_r s/(s² + 2ξω s + ω²) (eq. 2.18-2.20).

use crate::axis::error::{AxisError, not_negative, positive};
use crate::axis::friction::Friction;
use meltpath_control::{Complex64, Matrix, StateSpace, SystemError};
use serde::{Deserialize, Serialize};

/// A flexible mode: K s/(s² + 2ξω s + ω²) in rotor speed over current.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mode {
    /// Pulsation ω, rad/s.
    pub omega: f64,
    /// Damping ξ.
    pub damping: f64,
    /// Gain K, rad/s² per A; positive where sensor and motor are on the same end of the shaft.
    pub gain: f64,
}

/// A galvanometer with its load.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Galvanometer {
    /// Coil resistance R, Ω.
    pub resistance: f64,
    /// Coil inductance L, H.
    pub inductance: f64,
    /// Torque constant Kc, N·m/A.
    pub torque_constant: f64,
    /// Back-EMF constant Ke, V·s/rad.
    pub back_emf: f64,
    /// Inertia of rotor and load J, kg·m².
    pub inertia: f64,
    /// Viscous coefficient B, N·m·s/rad.
    pub viscous: f64,
    /// Flexible modes.
    #[serde(default)]
    pub modes: Vec<Mode>,
    /// Friction beyond the viscous one.
    #[serde(default)]
    pub friction: Friction,
    /// Share of this friction, and of any other torque on the axis, that the modes feel: 1 where it acts on the rotor, as the motor's
    /// own torque does; 0 where it is spread as the inertia is.
    #[serde(default)]
    pub felt: f64,
}

/// The most flexible modes that are simulated.
pub const MOST_MODES: usize = 3;

impl Galvanometer {
    /// Checks every parameter.
    ///
    /// # Errors
    /// [`AxisError::Parameter`], [`AxisError::Modes`].
    pub fn check(&self) -> Result<(), AxisError> {
        positive("the coil resistance", self.resistance)?;
        positive("the coil inductance", self.inductance)?;
        positive("the torque constant", self.torque_constant)?;
        not_negative("the back-EMF constant", self.back_emf)?;
        positive("the inertia", self.inertia)?;
        not_negative("the viscous coefficient", self.viscous)?;
        if self.modes.len() > MOST_MODES {
            return Err(AxisError::Modes {
                modes: self.modes.len(),
                most: MOST_MODES,
            });
        }
        for mode in &self.modes {
            positive("the pulsation of a mode", mode.omega)?;
            not_negative("the damping of a mode", mode.damping)?;
            if !mode.gain.is_finite() {
                return Err(AxisError::Parameter {
                    what: "the gain of a mode",
                    value: mode.gain,
                    wanted: "finite",
                });
            }
        }
        if !self.felt.is_finite() {
            return Err(AxisError::Parameter {
                what: "the share of friction that the modes feel",
                value: self.felt,
                wanted: "finite",
            });
        }
        self.friction.check()
    }

    /// RES(s): the flexible part of rotor speed over current, rad/s per A.
    fn modal(&self, s: Complex64) -> Complex64 {
        self.modes
            .iter()
            .map(|m| m.gain * s / (s * s + 2.0 * m.damping * m.omega * s + m.omega * m.omega))
            .sum()
    }

    /// Rotor speed over current, rad/s per A, at the complex pulsation `s` rad/s (eq. 2.18).
    pub fn speed_over_current(&self, s: Complex64) -> Complex64 {
        self.torque_constant / (self.inertia * s + self.viscous) + self.modal(s)
    }

    /// Current over voltage, A/V, at `s` (eq. 2.29).
    pub fn current_over_voltage(&self, s: Complex64) -> Complex64 {
        let electric = self.inductance * s + self.resistance;
        1.0 / (electric + self.back_emf * self.speed_over_current(s))
    }

    /// The linear part: inputs voltage (V) and a torque that opposes motion (N·m); outputs current (A), angle (rad),
    /// rotor speed (rad/s). States: current, rigid speed, rigid angle, then (q, q') of each mode.
    ///
    /// # Errors
    /// [`SystemError`] where a parameter is not finite.
    pub fn linear(&self) -> Result<StateSpace, SystemError> {
        let n = 3 + 2 * self.modes.len();
        let mut a = Matrix::zeros(n, n);
        let mut b = Matrix::zeros(n, 2);
        let mut c = Matrix::zeros(3, n);
        a[(0, 0)] = -self.resistance / self.inductance;
        a[(0, 1)] = -self.back_emf / self.inductance;
        a[(1, 0)] = self.torque_constant / self.inertia;
        a[(1, 1)] = -self.viscous / self.inertia;
        a[(2, 1)] = 1.0;
        b[(0, 0)] = 1.0 / self.inductance;
        b[(1, 1)] = -1.0 / self.inertia;
        c[(0, 0)] = 1.0;
        c[(1, 2)] = 1.0;
        c[(2, 1)] = 1.0;
        for (j, mode) in self.modes.iter().enumerate() {
            let (q, speed) = (3 + 2 * j, 4 + 2 * j);
            a[(0, speed)] = -self.back_emf / self.inductance;
            a[(q, speed)] = 1.0;
            a[(speed, q)] = -mode.omega * mode.omega;
            a[(speed, speed)] = -2.0 * mode.damping * mode.omega;
            a[(speed, 0)] = mode.gain;
            b[(speed, 1)] = -self.felt * mode.gain / self.torque_constant;
            c[(1, q)] = 1.0;
            c[(2, speed)] = 1.0;
        }
        StateSpace::continuous(a, b, c, Matrix::zeros(3, 2))
    }
}

/// A motor with a mode, for tests.
#[cfg(test)]
pub(crate) fn example() -> Galvanometer {
    let (kc, j) = (6.17e-3, 4.530_873_193e-8);
    Galvanometer {
        resistance: 2.79,
        inductance: 180e-6,
        torque_constant: kc,
        back_emf: kc,
        inertia: j,
        viscous: 3e-6,
        modes: vec![Mode {
            omega: std::f64::consts::TAU * 4000.0,
            damping: 0.015,
            gain: 0.3 * kc / j,
        }],
        friction: Friction::None,
        felt: 0.0,
    }
}
