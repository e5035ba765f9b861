//! What one recipe did: errors, energy, fill rates, and the path as far as it is shown.

use meltpath_geometry::math::DVec2;
use meltpath_scan_head::head::block::{HeadBlock, HeadSink};
use meltpath_scan_head::head::gate::Darkness;
use meltpath_scan_head::head::recipe::{LaserDelays, Recipe};
use meltpath_scan_head::head::survey::Survey;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_scan_head::measures::contour_error::PathErrors;
use meltpath_scan_head::measures::delays::{DelayScore, Tuned};
use meltpath_scan_head::measures::energy::EnergyAlong;
use meltpath_scan_head::measures::fill_rate::FillMode;

use super::heat::RecipeHeat;

/// The modes in which fill rates are told.
pub(crate) const MODES: [FillMode; 3] = [
    FillMode::SampledPoints { every: 1 },
    FillMode::Segments,
    FillMode::SweptSpot,
];
/// Samples kept of the path of the first square, at most.
const SHOWN: usize = 400_000;

/// What is judged of a recipe at one end of the friction's range.
pub(crate) struct AtEnd {
    pub(super) errors: PathErrors,
    /// Mean fill rate in each mode.
    pub(super) fill: Vec<f64>,
    pub(super) heat: Option<RecipeHeat>,
}

/// What one recipe did.
pub(crate) struct RecipeResult<'a> {
    pub(crate) recipe: &'a Recipe,
    /// What its whole job is.
    pub(crate) survey: &'a Survey,
    /// The first square or layer.
    pub(crate) first: ScanJob,
    pub(crate) delays: LaserDelays,
    /// What the delays do to its marks.
    pub(crate) darkness: Darkness,
    pub(crate) tuned: Option<Tuned>,
    /// The pairs of delays that no other beats.
    pub(crate) front: Vec<DelayScore>,
    pub(crate) duration: f64,
    pub(crate) errors: PathErrors,
    pub(crate) energy: EnergyAlong,
    /// Mean rate over the squares or layers, in each of [`MODES`].
    pub(crate) fill: Vec<f64>,
    /// For each square or layer, its rates; none where no line fills it.
    pub(crate) rates: Vec<Vec<f64>>,
    pub(crate) path: Path2d,
    /// What the first square or layer melts, where the job asks for it.
    pub(crate) heat: Option<RecipeHeat>,
    /// The same with the least and with the most friction, where the head's file states a range.
    pub(crate) ends: Option<[AtEnd; 2]>,
}

impl RecipeResult<'_> {
    /// Whether any line of a fill was marked.
    pub(crate) fn fills(&self) -> bool {
        self.survey.fills > 0.0
    }

    /// What its fill rate is called.
    pub(crate) fn fill_title(&self) -> String {
        format!("{}: fill rate, {}", self.recipe.name, MODES[2].words())
    }
}

/// The path of the first square or layer, as far as it is shown: point hit, whether lit, vector.
#[derive(Debug, Default)]
pub(crate) struct Path2d {
    pub(crate) hits: Vec<DVec2>,
    pub(crate) lit: Vec<bool>,
    pub(crate) vectors: Vec<u32>,
    /// The last vector that belongs to it.
    pub(crate) last: u32,
}

impl HeadSink for Path2d {
    fn block(&mut self, block: &HeadBlock) {
        for (k, &vector) in block.command.vector.iter().enumerate() {
            if vector <= self.last && self.hits.len() < SHOWN {
                self.hits.push(block.hit[k]);
                self.lit.push(block.lit[k] >= 0.5);
                self.vectors.push(vector);
            }
        }
    }
}
