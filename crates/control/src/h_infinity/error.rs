//! Why a synthesis did not succeed, in terms a person can act on.

use num_complex::Complex64;

use crate::SystemError;
use crate::riccati::RiccatiError;
use meltpath_numerics::dense::DenseError;

/// An assumption of the theory that a generalised plant does not meet. Channels are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Assumption {
    /// (A, B2) is not stabilisable.
    #[error(
        "H1: no command reaches the mode at {mode} rad/s, which does not decay; give it an actuator or take it out of the plant (a weight with a pole at the origin does this: move the pole slightly left)"
    )]
    Stabilisable {
        /// The mode (rad/s).
        mode: Complex64,
    },
    /// (C2, A) is not detectable.
    #[error(
        "H1: no measurement sees the mode at {mode} rad/s, which does not decay; measure it or take it out of the plant (a weight with a pole at the origin does this: move the pole slightly left)"
    )]
    Detectable {
        /// The mode (rad/s).
        mode: Complex64,
    },
    /// D12 lacks full column rank.
    #[error(
        "H2: command {command} costs nothing at high frequency (D12 has not full column rank): weight it, for instance by a command template with a finite high-frequency gain"
    )]
    CommandCost {
        /// The command that weighs most in the free direction.
        command: usize,
    },
    /// D21 lacks full row rank.
    #[error(
        "H2: measurement {measurement} has no direct disturbance (D21 has not full row rank): add a reference or sensor noise to it"
    )]
    MeasurementNoise {
        /// The measurement that weighs most in the free direction.
        measurement: usize,
    },
    /// The transfer from commands to errors has a zero on the imaginary axis.
    #[error(
        "H3: at {omega} rad/s some command moves no weighted error; weight the command or an error at that frequency"
    )]
    CommandZero {
        /// Frequency (rad/s).
        omega: f64,
    },
    /// The transfer from disturbances to measurements has a zero on the imaginary axis.
    #[error(
        "H4: at {omega} rad/s some measurement feels no disturbance; add a disturbance that acts at that frequency, for instance on the plant's input"
    )]
    MeasurementZero {
        /// Frequency (rad/s).
        omega: f64,
    },
}

/// Which of the conditions fails at a level γ.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Obstacle {
    /// γ is below what the direct terms alone impose.
    #[error("the direct gain from disturbances to errors alone is {floor}")]
    DirectGain {
        /// The floor on γ.
        floor: f64,
    },
    /// The state feedback Riccati equation has no stabilising solution.
    #[error(
        "the control Riccati equation (X) has no stabilising solution near {omega} rad/s: even with every state known the level is out of reach"
    )]
    ControlRiccati {
        /// Frequency (rad/s).
        omega: f64,
    },
    /// The estimation Riccati equation has no stabilising solution.
    #[error(
        "the estimation Riccati equation (Y) has no stabilising solution near {omega} rad/s: the measurements do not tell enough"
    )]
    EstimationRiccati {
        /// Frequency (rad/s).
        omega: f64,
    },
    /// A Riccati solution is infinite in some direction.
    #[error("a Riccati solution is infinite: the level lies exactly on a boundary")]
    Infinite,
    /// X is not positive semidefinite.
    #[error(
        "the control Riccati solution (X) is not positive (the mode at {mode} rad/s is left unstable): even with every state known the level is out of reach"
    )]
    ControlIndefinite {
        /// A mode (rad/s) that shows it.
        mode: Complex64,
    },
    /// Y is not positive semidefinite.
    #[error(
        "the estimation Riccati solution (Y) is not positive (the mode at {mode} rad/s is left unstable): the measurements do not tell enough"
    )]
    EstimationIndefinite {
        /// A mode (rad/s) that shows it.
        mode: Complex64,
    },
    /// The two solutions do not go together.
    #[error(
        "control and estimation together need γ² > {radius}, the spectral radius of XY: relax the weight that is active where the closed loop peaks"
    )]
    SpectralRadius {
        /// ρ(XY).
        radius: f64,
    },
}

/// Why no controller is returned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SynthesisError {
    /// Fewer channels than commands or measurements, or none.
    #[error(
        "a plant with {inputs} inputs and {outputs} outputs cannot have {controls} commands and {measurements} measurements: at least one of each, and one disturbance and one error, are needed"
    )]
    Channels {
        /// All inputs.
        inputs: usize,
        /// All outputs.
        outputs: usize,
        /// Commands.
        controls: usize,
        /// Measurements.
        measurements: usize,
    },
    /// The plant is sampled.
    #[error(
        "synthesis works on continuous plants: convert the sampled plant by the bilinear rule, which keeps every gain"
    )]
    Sampled,
    /// The plant misses an assumption.
    #[error("assumption {0}")]
    Assumption(Assumption),
    /// No controller reaches the level.
    #[error("no controller reaches γ = {gamma}: {obstacle}{}", far(*gamma))]
    Infeasible {
        /// The level.
        gamma: f64,
        /// What stands in the way.
        obstacle: Obstacle,
    },
    /// A controller was computed but its closed loop does not keep the promise; the problem is too badly conditioned.
    #[error(
        "the controller computed at γ = {gamma} does not keep its bound (closed-loop peak {peak}): the problem is ill-conditioned; scale units, move weights' poles towards the band of interest, or accept a larger margin"
    )]
    Unverified {
        /// The level.
        gamma: f64,
        /// The true peak; infinite when unstable.
        peak: f64,
    },
    /// A system could not be built.
    #[error(transparent)]
    System(#[from] SystemError),
}

/// What a level that no sound problem needs says of the plant.
fn far(gamma: f64) -> &'static str {
    if gamma < 1e8 {
        return "";
    }
    "; so high a level means that rounding stands in the way: weight the commands (D12) and the measurements' noise (D21) by more, not below a thousandth of the other entries, and scale units"
}

impl From<DenseError> for SynthesisError {
    fn from(error: DenseError) -> Self {
        SynthesisError::System(SystemError::Dense(error))
    }
}

impl Obstacle {
    pub(super) fn control(error: RiccatiError, unit: f64) -> Self {
        match error {
            RiccatiError::OnAxis { omega } => Obstacle::ControlRiccati {
                omega: omega * unit,
            },
            _ => Obstacle::Infinite,
        }
    }

    pub(super) fn estimation(error: RiccatiError, unit: f64) -> Self {
        match error {
            RiccatiError::OnAxis { omega } => Obstacle::EstimationRiccati {
                omega: omega * unit,
            },
            _ => Obstacle::Infinite,
        }
    }
}
