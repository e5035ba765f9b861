//! What one recipe did: errors, energy, fill rates, and the path as far as it is shown.

use meltpath_base::Measure;
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
use meltpath_scan_head::measures::fill_share::{AreaFill, FillShare};

use super::heat::RecipeHeat;

/// The modes in which fill rates are told.
pub(crate) const MODES: [FillMode; 4] = [
    FillMode::SampledPoints { every: 1 },
    FillMode::Segments,
    FillMode::SweptSpot,
    FillMode::SweptSurface,
];
/// Which of them is judged: cells beat with the hatch, the surface does not.
pub(crate) const JUDGED: usize = 3;
/// Samples kept of the path of the first square, at most.
const SHOWN: usize = 400_000;

/// What is judged of a recipe at one end of the friction's range.
pub(crate) struct AtEnd {
    pub(super) errors: PathErrors,
    /// How it is filled, as it is judged; none where no line is marked.
    pub(super) fill: Option<FillShare>,
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
    /// How each square or layer is filled, in each of [`MODES`].
    pub(crate) areas: Vec<AreaFill>,
    pub(crate) path: Path2d,
    /// What the first square or layer melts, where the job asks for it.
    pub(crate) heat: Option<RecipeHeat>,
    /// The same with the least and with the most friction, where the head's file states a range.
    pub(crate) ends: Option<[AtEnd; 2]>,
}

impl RecipeResult<'_> {
    /// How it is filled in the mode of that number; none where no line of a fill was marked.
    pub(crate) fn fill(&self, mode: usize) -> Option<FillShare> {
        FillShare::of(&self.areas, mode)
    }

    /// What its fill rate is called.
    pub(crate) fn fill_title(&self) -> String {
        format!("{}: fill rate, {}", self.recipe.name, MODES[JUDGED].words())
    }
}

/// What is judged of several layers or squares, and the share of all of them.
pub(crate) fn fill_words(fill: &FillShare) -> Option<String> {
    if fill.filled < 2 {
        return None;
    }
    let whole = Measure::exact(100.0 * fill.whole.share, "%");
    let judged = match fill.worst {
        Some(_) if fill.judged() != fill.whole => "the worst layer or square of",
        _ => "the share of all",
    };
    let filled = fill.filled;
    Some(format!("{judged} {filled}; {whole} of their whole surface"))
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
