//! Sections of shapes by surfaces: planar slicing of meshes, layer heights.

mod chain;
pub mod heights;
mod nesting;
mod simplify;
mod slice;

pub use heights::{HeightsError, LastLayer, LayerHeight, LayerSpan, layers};
pub use simplify::simplified;
pub use slice::{Slice, SliceError, SlicePlan, slice};
