//! Why a record gives no motor.

use crate::axis::error::AxisError;
use meltpath_control::welch::WelchError;
use meltpath_numerics::least_squares::LeastSquaresError;

/// Why nothing was identified.
#[derive(Debug, thiserror::Error)]
pub enum IdentificationError {
    /// A column that is shorter or longer than the voltage.
    #[error("{what} has {found} samples, the voltage {wanted}: give columns of one record")]
    Lengths {
        /// Which column.
        what: &'static str,
        /// Its samples.
        found: usize,
        /// Those of the voltage.
        wanted: usize,
    },
    /// Fewer than three frequencies in the band.
    #[error(
        "only {points} frequencies between {low:.1} and {high:.1} Hz carry a signal: widen the band, lengthen the segments or excite more"
    )]
    Band {
        /// How many there are.
        points: usize,
        /// From, Hz.
        low: f64,
        /// To, Hz.
        high: f64,
    },
    /// A channel with the wrong sign.
    #[error(
        "{what} answers against its cause over {:.0} % of the band: its sign is reversed (a negative `scale` in the mapping turns it), or two channels are exchanged",
        100.0 * share
    )]
    Reversed {
        /// Which channel.
        what: &'static str,
        /// Share of the band, as the fit weighs it.
        share: f64,
    },
    /// Two channels stand in each other's place.
    #[error(
        "{one} and {other} are exchanged: the response of one to the other runs over the frequencies as a motor's inverse does"
    )]
    Exchanged {
        /// The one.
        one: &'static str,
        /// The other.
        other: &'static str,
    },
    /// Numbers that no motor has.
    #[error(
        "the transfers give {what} = {value:.4e}, which no motor has: check units and signs of the columns (a swapped or reversed one does this)"
    )]
    Unphysical {
        /// Which parameter.
        what: &'static str,
        /// What it would be.
        value: f64,
    },
    /// Parameters that the record does not determine.
    #[error(
        "not even the order of {what} is known (relative deviation {sigma:.1}): the rotor hardly answers, as where dry friction holds it: excite more, or record longer"
    )]
    Unsure {
        /// Which parameter.
        what: &'static str,
        /// Its relative deviation.
        sigma: f64,
    },
    /// No steady ramp, or ramps in one direction only.
    #[error(
        "friction needs ramps at two speeds or more in each direction: {forward} forward, {backward} backward were given"
    )]
    Ramps {
        /// Ramps with positive speed.
        forward: usize,
        /// Ramps with negative speed.
        backward: usize,
    },
    /// The estimate.
    #[error(transparent)]
    Welch(#[from] WelchError),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] LeastSquaresError),
    /// The simulated motor.
    #[error(transparent)]
    Axis(#[from] AxisError),
}
