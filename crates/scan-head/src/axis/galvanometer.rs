//! The galvanometer: a limited-travel motor that tilts a mirror, with the flexible modes of its shaft.
//!
//! Source: Rasoanarivo 2020, eq. 2.1-2.20. The modes are those of the thesis' modal split,
//! ω_r/i = Kc/(B + J s) + Σ K_r s/(s² + 2ξω s + ω²) (eq. 2.18-2.20), which a chain of elementary loads has too ([`Chain`]).

use meltpath_control::{Complex64, Matrix, Polynomial, StateSpace, SystemError, TransferFunction};
use serde::{Deserialize, Serialize};

use crate::axis::friction::Friction;

/// Why a galvanometer, its drive or its controller cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AxisError {
    /// A parameter that has no sense.
    #[error("{what} is {value}, but must be {wanted}")]
    Parameter {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// More flexible modes than the simulator integrates.
    #[error("the galvanometer has {modes} flexible modes; {most} are simulated: keep the lowest")]
    Modes {
        /// How many it has.
        modes: usize,
        /// How many are possible.
        most: usize,
    },
    /// A controller in state space that has other than one input and one output, or another sample period.
    #[error(
        "the controller has {inputs} inputs and {outputs} outputs at {period} s; one of each at {wanted} s is needed"
    )]
    Controller {
        /// Its inputs.
        inputs: usize,
        /// Its outputs.
        outputs: usize,
        /// Its sample period, s; 0 when continuous.
        period: f64,
        /// The axis' sample period, s.
        wanted: f64,
    },
    /// The loop ran away: the angle left the travel by far.
    #[error(
        "the axis ran away at {time} s: {angle_deg:.1} deg, travel ±{travel_deg:.1} deg; the loop is unstable with this plant, sampling and delay"
    )]
    RanAway {
        /// When, s.
        time: f64,
        /// The angle, deg.
        angle_deg: f64,
        /// The travel, deg.
        travel_deg: f64,
    },
    /// Changes of speed that the drives do not follow, however the path is smoothed ahead.
    #[error(
        "a preview cannot keep the drives within their limits: the path changes the mirrors' speeds by {:.0} and {:.0} deg/s at once, even smoothed over {:.0} µs to either side: slower jumps, or no preview",
        .changes_deg[0], .changes_deg[1], 1e6 * .smoothing
    )]
    Ahead {
        /// Largest changes of speed, X and Y, deg/s.
        changes_deg: [f64; 2],
        /// The longest smoothing that was tried, s.
        smoothing: f64,
    },
    /// A linear system behind it.
    #[error(transparent)]
    System(#[from] SystemError),
}

/// Refuses a value that is not positive and finite.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), AxisError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(AxisError::Parameter {
            what,
            value,
            wanted: "positive and finite",
        })
    }
}

/// Refuses a value that is negative or not finite.
pub(crate) fn not_negative(what: &'static str, value: f64) -> Result<(), AxisError> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(AxisError::Parameter {
            what,
            value,
            wanted: "finite and not negative",
        })
    }
}

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

    /// Angle over voltage, rad/V, at `s`, friction limited to the viscous one.
    pub fn angle_over_voltage(&self, s: Complex64) -> Complex64 {
        self.current_over_voltage(s) * self.speed_over_current(s) / s
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
            c[(1, q)] = 1.0;
            c[(2, speed)] = 1.0;
        }
        StateSpace::continuous(a, b, c, Matrix::zeros(3, 2))
    }
}

/// A shaft as a chain of elementary loads behind the rotor (eq. 2.14-2.16).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chain {
    /// Torque constant Kc, N·m/A.
    pub torque_constant: f64,
    /// Rotor inertia, kg·m².
    pub rotor_inertia: f64,
    /// Viscous coefficient at the rotor, N·m·s/rad.
    pub rotor_viscous: f64,
    /// The loads, next to the rotor first.
    pub loads: Vec<Load>,
}

/// One elementary load and the piece of shaft before it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Inertia, kg·m².
    pub inertia: f64,
    /// Viscous coefficient, N·m·s/rad.
    pub viscous: f64,
    /// Stiffness of the shaft towards the rotor, N·m/rad.
    pub stiffness: f64,
}

impl Chain {
    /// Rotor speed over current (rad/s per A) as a ratio of polynomials of degrees 2n and 2n + 1 (eq. 2.17).
    ///
    /// # Errors
    /// [`SystemError`] where a parameter is not finite.
    pub fn speed_over_current(&self) -> Result<TransferFunction, SystemError> {
        // θ_j/θ_{j-1} = num/den, from the free end towards the rotor; `rest` is k_j (1 − θ_j/θ_{j−1}) as a ratio
        let mut rest = (Polynomial::new([0.0]), Polynomial::new([1.0]));
        for load in self.loads.iter().rev() {
            // D = s²J + sB + k + rest; θ_j/θ_{j−1} = k/D, so k(1 − k/D) = k(D − k)/D
            let own = Polynomial::new([load.inertia, load.viscous, 0.0]);
            let without = own.times(&rest.1).plus(&rest.0);
            let whole = without.plus(&rest.1.scaled(load.stiffness));
            rest = (without.scaled(load.stiffness), whole);
        }
        let rotor = Polynomial::new([self.rotor_inertia, self.rotor_viscous]);
        // ω/i = Kc/(J s + B + rest/s); rest.0 is divisible by s (every load's D − k is)
        let quotient = divide_by_s(&rest.0);
        let denominator = rotor.times(&rest.1).plus(&quotient);
        TransferFunction::new(
            rest.1.scaled(self.torque_constant).coefficients().to_vec(),
            denominator.coefficients().to_vec(),
        )
    }

    /// The modal split of the chain: base inertia and viscous coefficient, then modes by partial fractions.
    /// Exact where nothing is damped; with damping, K s is the part of each pair's residue that vanishes at rest and the
    /// remainder is neglected.
    ///
    /// # Errors
    /// [`SystemError`] where poles cannot be found.
    pub fn modal(&self) -> Result<(f64, f64, Vec<Mode>), SystemError> {
        let transfer = self.speed_over_current()?;
        let inertia = self.rotor_inertia + self.loads.iter().map(|l| l.inertia).sum::<f64>();
        let viscous = self.rotor_viscous + self.loads.iter().map(|l| l.viscous).sum::<f64>();
        let slope = transfer.denominator.derivative();
        let mut modes: Vec<Mode> = transfer
            .poles()?
            .into_iter()
            .filter(|p| p.im > 0.0)
            .map(|p| {
                let residue = transfer.numerator.at(p) / slope.at(p);
                let omega = p.norm();
                Mode {
                    omega,
                    damping: -p.re / omega,
                    gain: 2.0 * residue.re,
                }
            })
            .collect();
        modes.sort_by(|a, b| a.omega.total_cmp(&b.omega));
        Ok((inertia, viscous, modes))
    }
}

fn divide_by_s(p: &Polynomial) -> Polynomial {
    let c = p.coefficients();
    Polynomial::new(c[..c.len().saturating_sub(1)].to_vec())
}
