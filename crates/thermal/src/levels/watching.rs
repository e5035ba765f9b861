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
    /// When the tiles at each place last ended a step, s, and what the temperature was, K.
    pub(super) known: Vec<[f64; 2]>,
    /// What is to be told of each place once its tiles have ended theirs: which of the samples.
    pub(super) pending: Vec<Vec<usize>>,
}

impl Watching {
    /// Begins to watch `places` every `every` s from `due` on; keeps what was told before.
    pub(super) fn new(places: Vec<[f64; 3]>, every: f64, due: f64, samples: Vec<Sample>) -> Self {
        Watching {
            known: vec![[due, f64::NAN]; places.len()],
            pending: vec![Vec::new(); places.len()],
            places,
            every,
            due,
            samples,
        }
    }
}
