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
