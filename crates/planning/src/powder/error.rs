//! Why a region cannot be hatched.

use meltpath_geometry::boolean::PlanarError;

use crate::error::PlanError;

/// Why a region cannot be hatched.
#[derive(Debug, thiserror::Error)]
pub enum HatchError {
    /// Planning.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The region.
    #[error("the region cannot be enlarged or cut into islands: {0}")]
    Region(#[from] PlanarError),
    /// Contours that follow a modulation which is not there.
    #[error("modulated contours need the table [modulation]")]
    NotModulated,
    /// Lines nearer together or farther apart than any are drawn.
    #[error("the distance between lines is {spacing} mm, it must lie between {low} and {high} mm")]
    Spacing {
        /// What was given, mm.
        spacing: f64,
        /// Smallest distance, mm.
        low: f64,
        /// Largest distance, mm.
        high: f64,
    },
    /// A region smaller than a line.
    #[error("no line fits into the region: it is narrower than the spacing of {spacing} mm")]
    Nothing {
        /// The spacing, mm.
        spacing: f64,
    },
    /// More islands or spots than a layer can hold.
    #[error("{what} of {size} mm are too small for a region of {width:.0} x {height:.0} mm")]
    TooSmall {
        /// What.
        what: &'static str,
        /// Their size, mm.
        size: f64,
        /// The region's width, mm.
        width: f64,
        /// The region's height, mm.
        height: f64,
    },
}
