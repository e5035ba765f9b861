//! What is so large that nothing could be drawn on it is refused before it is hatched.

use std::ops::Range;

use meltpath_base::settings::Problem;
use meltpath_melt_strategy::part::Rectangle;

use super::lever::{self, Lever, Need, of_room, refused};
use super::room;
use super::voxels::Cost;
use crate::ebm::settings::Settings;
use crate::job::ebm::{ChartPreview, EbmJob};
use crate::machine::Machine;

/// Refuses what `name` in the job spreads between two corners, mm, where the least that is drawn on needs more memory than there is.
///
/// # Errors
/// The setting that asks for most.
pub(in crate::ebm) fn fits(
    settings: &Settings,
    job: &EbmJob,
    (name, span): (&str, Option<Range<usize>>),
    [low, high]: [[f64; 2]; 2],
) -> Result<(), Problem> {
    let machine = Machine::here();
    let size = [0, 1].map(|a| (high[a] - low[a]).max(0.0));
    let extent = Lever::of_extent((name, span), size);
    let judged = settings.judge.as_ref().and_then(|judge| {
        let hull = Rectangle { low, high };
        // the ground that no path asks for more than
        let bytes = room::judge(
            settings,
            judge,
            (&hull, 0),
            &judge.resolution,
            machine.cores,
        );
        let levers = of_room(job, judge).into_iter().chain([extent.clone()]);
        refused("the judge", Need::Memory([bytes, machine.bytes]), levers)
    });
    let charts = || {
        let drawn = settings.preview == ChartPreview::Drawn;
        drawn.then(|| voxels(settings, job, size, (extent.clone(), machine)))?
    };
    judged.or_else(charts).map_or(Ok(()), Err)
}

/// Why the voxels of the charts over `size` mm and the margin round it do not fit.
pub(super) fn voxels(
    settings: &Settings,
    job: &EbmJob,
    size: [f64; 2],
    (extent, machine): (Lever, Machine),
) -> Option<Problem> {
    let table = &job.simulation;
    let bytes = Cost::of_extent(settings, size.map(|s| s + 2.0 * table.margin.0)).bytes;
    let margin = size.map(|s| (s + 2.0 * table.margin.0) / (s + 1.0));
    let levers = [
        lever::voxel(job),
        Lever::of(
            &table.margin,
            margin[0] * margin[1],
            "is it in mm? half a millimetre of powder beyond the path is usual",
        ),
        lever::penetration(job),
        lever::layer(&job.ebm.layer, 0.05 / job.ebm.layer.0),
        extent,
    ];
    let need = Need::Memory([bytes, machine.bytes]);
    refused("drawing with charts", need, levers)
}
