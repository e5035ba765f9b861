//! Why an axis, its motor or its control cannot be used.

use meltpath_base::number::significant;
use meltpath_control::SystemError;
use meltpath_control::export::ExportError;

/// Why a galvanometer, its drive or its controller cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AxisError {
    /// A law of friction other than the printed one, where records are followed.
    #[error(
        "a record is followed with viscous and Coulomb friction only: leave `friction` out and write `coulomb` and `bias`"
    )]
    Law,
    /// A parameter that has no sense.
    #[error("{what} is {}, but must be {wanted}", significant(*value, 6))]
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
    /// An axis without a motor, where one is needed.
    #[error(
        "it is known by its data sheet alone, in [servo] of the head's file: write its motor and its control in [x] and [y]"
    )]
    DataSheet,
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
    /// The loop is unstable: the smallest step makes it swing more and more.
    #[error(
        "the loop is unstable with this plant, sampling and delay: after the smallest step it swings at {frequency:.0} Hz, more and more"
    )]
    Oscillates {
        /// How often, Hz.
        frequency: f64,
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
    /// An exported controller that cannot run.
    #[error(transparent)]
    Export(#[from] ExportError),
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
