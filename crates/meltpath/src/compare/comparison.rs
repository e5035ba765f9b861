//! What a comparison found: the figures of each quantity.

use std::path::PathBuf;

use meltpath_base::Verdict;
use meltpath_thermal::calibration::comparison::{Apart, Pair};

use super::quantity::Quantity;

/// How far apart two tellings of one quantity are.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The quantity.
    pub quantity: Quantity,
    /// The figures.
    pub apart: Apart,
    /// The pairs, in the order of the table.
    pub pairs: Vec<Pair>,
    /// The layer of each pair, from 1; 1 against a table.
    pub layers: Vec<usize>,
    /// How far the two places of a pair lie apart in the mean, and at most, mm; none against a field, which tells every place.
    pub away: Option<[f64; 2]>,
    /// Samples left out for their place, and for their time or because the other tells nothing there.
    pub left_out: [usize; 2],
    /// Places of the other table without a counterpart.
    pub unmet: usize,
}

/// What a comparison found.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Each quantity that was compared, one at least.
    pub parts: Vec<Compared>,
    /// What was compared, in words.
    pub name: String,
    /// What it was compared with, in words.
    pub against: String,
    /// Edge of a cell of the map, mm.
    pub cell: f64,
    /// Where it was written.
    pub folder: PathBuf,
    /// Notes.
    pub verdict: Verdict,
}
