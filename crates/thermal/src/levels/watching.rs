//! Temperatures that are told in time, while a layer is drawn.

use crate::grid::sample::Sample;

/// Where temperatures are told, and what was told.
#[derive(Debug, Clone, Default)]
pub(super) struct Watching {
    pub(super) places: Vec<[f64; 3]>,
    /// s.
    pub(super) every: f64,
    /// When they are told next, s.
    pub(super) due: f64,
    pub(super) samples: Vec<Sample>,
}
