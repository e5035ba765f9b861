//! The health of an axis: a test in two stages, rated against the first one that was accepted.

pub mod bench;
pub mod km0;
