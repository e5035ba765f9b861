//! Why a plan cannot be made.

use meltpath_base::Cancelled;
use meltpath_geometry::boolean::PlanarError;

/// Why a plan cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A setting out of its range.
    #[error("{name} is {value}, it must lie between {low} and {high}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Smallest value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// The layer's outline cannot be worked with.
    #[error("layer {layer}: {source}")]
    Outline {
        /// The layer, counted from 1.
        layer: u32,
        /// What is wrong.
        source: PlanarError,
    },
    /// More passes, layers or parts than stable identifiers can name.
    #[error(
        "layer {layer} of part {part} needs {passes} passes: up to 16 parts of 16383 layers of 16384 passes have identifiers"
    )]
    TooMany {
        /// Part, counted from 0.
        part: u32,
        /// Layer, counted from 1.
        layer: u32,
        /// Passes on that layer.
        passes: usize,
    },
    /// Cancelled by the person who started it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
