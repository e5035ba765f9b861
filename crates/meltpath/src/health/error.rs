//! Why a health test gave nothing.

use std::path::PathBuf;

use meltpath_base::output::OutputError;
use meltpath_perception::RecordError;
use meltpath_scan_head::axis::error::AxisError;
use meltpath_scan_head::identification::error::IdentificationError;

use super::history::HistoryError;

/// Why a health test gave nothing.
#[derive(Debug, thiserror::Error)]
pub enum HealthError {
    /// The head's file.
    #[error("cannot use the scan head \"{name}\": {message}")]
    Head {
        /// Which.
        name: String,
        /// What is wrong.
        message: String,
    },
    /// A head without that axis.
    #[error("the head \"{head}\" has no axis \"{axis}\"; it has {known}")]
    Axis {
        /// The head.
        head: String,
        /// The axis asked for.
        axis: String,
        /// Those it has.
        known: String,
    },
    /// A change that a simulated axis does not know.
    #[error(
        "\"{text}\" is no change of an axis: write NAME=FACTOR with a FACTOR above zero and NAME one of {known}"
    )]
    Change {
        /// What was written.
        text: String,
        /// The names.
        known: String,
    },
    /// A change of what the axis does not have.
    #[error("the head's file gives this axis no {name}: there is nothing to change")]
    Nothing {
        /// What was to be changed.
        name: &'static str,
    },
    /// A circumstance that cannot be.
    #[error("{what} \"{told}\" cannot be: {remedy}")]
    Circumstance {
        /// Which.
        what: &'static str,
        /// As it was told.
        told: String,
        /// What to write.
        remedy: &'static str,
    },
    /// A record or its mapping.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A record at another sample period than the head.
    #[error(
        "`{}` has a sample every {:.3} µs, the head \"{head}\" every {:.3} µs: record at the head's sample time", path.display(), 1e6 * found, 1e6 * wanted
    )]
    Period {
        /// Which record.
        path: PathBuf,
        /// The head.
        head: String,
        /// The record's, s.
        found: f64,
        /// The head's, s.
        wanted: f64,
    },
    /// The first stage.
    #[error("first stage: {0}")]
    First(#[from] IdentificationError),
    /// The second stage.
    #[error("second stage: {0}")]
    Second(IdentificationError),
    /// The simulated axis, or its signal.
    #[error("second stage: {0}")]
    Bench(#[from] AxisError),
    /// A sequence that drives the motor into its stops.
    #[error(
        "no signal is written: by the head's file the motor of the {axis} axis drifts to {reached:.1} deg in open loop under a binary sequence of any amplitude, its travel is ±{travel:.1} deg; record the first stage with the position loop closed: add a binary sequence of a few tenths of a degree to its set-points, and map them as [channels.set-point]"
    )]
    Stops {
        /// The axis.
        axis: String,
        /// How far it goes, deg.
        reached: f64,
        /// Its travel, deg.
        travel: f64,
    },
    /// The history.
    #[error(transparent)]
    History(#[from] HistoryError),
    /// The report or the signal.
    #[error(transparent)]
    Output(#[from] OutputError),
}
