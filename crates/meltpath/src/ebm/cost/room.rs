//! The memory that the judge takes.

use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::judgement::{Bytes, Variant, bytes};
use meltpath_melt_strategy::part::Rectangle;

use crate::ebm::settings::{Judge, Settings};

/// Bytes that the judge takes for paths in `hull` with `lower` layers below the last one, as many of its runs at once as there are
/// `cores`.
pub(super) fn judge(
    settings: &Settings,
    judge: &Judge,
    (hull, lower): (&Rectangle, usize),
    resolution: &Resolution,
    cores: usize,
) -> f64 {
    let layers = (lower, settings.job.ebm.layer.0, judge.between.is_some());
    let of = |variant: &Variant| {
        let varied = resolution.of(*variant, resolution.step);
        bytes(hull, layers, &varied)
    };
    let mut runs: Vec<Bytes> = Variant::ALL.iter().map(of).collect();
    runs.sort_by(|a, b| b.drawing.total_cmp(&a.drawing));
    let drawing: f64 = runs.iter().take(cores.max(1)).map(|run| run.drawing).sum();
    drawing + runs.iter().map(|run| run.left).sum::<f64>()
}
