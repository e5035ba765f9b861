//! The layers of a program whose plan is unknown.

use std::collections::BTreeMap;

use meltpath_geometry::arc::Arc;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::{Join, inset, stroke};
use meltpath_geometry::raster::{Grid, rasterise};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_robot::command::{Kind, Source};
use rayon::prelude::*;

use crate::waam::deposit::simulate::PlannedLayer;
use crate::waam::plan::ROUNDED_OFF;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Layers that begin nearer to each other end at the same height, mm.
const SAME_HEIGHT: f64 = 0.5;
/// Straight pieces that stand for an arc: they miss a thousandth of its radius.
const ARC_PIECES: u32 = 64;
/// Beads of a layer whose axes lie nearer than twice this to each other, bead widths, are one area.
const JOINED: f64 = 1.0;
/// Distance of chords to round edges of such an area, mm.
const ROUND: f64 = 0.05;

/// Places along a move after its begin: those of an arc, and its end.
pub(super) fn along(from: DVec3, kind: &Kind, to: DVec3) -> impl Iterator<Item = DVec2> {
    let arc = match *kind {
        Kind::Arc { via } => Arc::through(from, via, to),
        _ => None,
    };
    let bulge = arc
        .into_iter()
        .flat_map(|arc| (1..ARC_PIECES).map(move |i| arc.at(f64::from(i) / f64::from(ARC_PIECES))));
    bulge.chain([to]).map(DVec3::truncate)
}

/// The beads of a layer.
#[derive(Default)]
struct Beads {
    /// Lowest place of the tool.
    bottom: f64,
    lines: Vec<Vec<DVec2>>,
}

/// The beads of each layer.
fn beads(commands: &Commands) -> BTreeMap<u32, Beads> {
    let mut layers = BTreeMap::<u32, Beads>::new();
    let mut from = commands.start.position;
    let mut burns = false;
    for (c, layer) in commands.commands.iter().zip(&commands.layer_of_command) {
        // waits have no target
        if matches!(c.kind, Kind::Wait { .. }) {
            continue;
        }
        // travels lead to other layers
        let on = *layer > 0 && matches!(c.source, Source::On { .. });
        if on {
            let beads = layers.entry(*layer).or_insert(Beads {
                bottom: c.target.z,
                lines: Vec::new(),
            });
            beads.bottom = beads.bottom.min(c.target.z);
            if !burns || beads.lines.is_empty() {
                beads.lines.push(vec![from.truncate()]);
            }
            if let Some(line) = beads.lines.last_mut() {
                line.extend(along(from, &c.kind, c.target));
            }
        }
        (burns, from) = (on, c.target);
    }
    layers
}

/// The layers: each ends at the next height above it where another begins, and is judged well inside the area that its beads fill side by
/// side, as one that was planned is.
pub(super) fn levels(
    commands: &Commands,
    map: &HeightMap,
    settings: &Settings,
) -> Result<Vec<PlannedLayer>, PlanarError> {
    let layers = beads(commands);
    let mut heights: Vec<f64> = layers.values().map(|beads| beads.bottom).collect();
    heights.sort_unstable_by(f64::total_cmp);
    heights.dedup_by(|b, a| *b - *a <= SAME_HEIGHT);
    let step = match heights[..] {
        [.., a, b] => b - a,
        _ => settings.bead.height.value,
    };
    let top = |bottom: f64| {
        let next = heights.partition_point(|z| *z <= bottom + SAME_HEIGHT);
        heights.get(next).copied().unwrap_or(bottom + step)
    };
    let grid = Grid {
        origin: map.origin,
        cell: map.cell,
        nx: map.nx,
        ny: map.ny,
    };
    let width = settings.bead.width.value;
    let join = Join::Round {
        arc_tolerance: ROUND,
    };
    let planned = |(layer, beads): (u32, Beads)| {
        let area = stroke(&beads.lines, JOINED * width, ROUND)?;
        // the edge of the metal lies half a width from the axes
        let inner = inset(&area, (JOINED - 0.5 + ROUNDED_OFF) * width, join)?;
        Ok(PlannedLayer {
            layer,
            top: top(beads.bottom),
            inner: rasterise(&inner, &grid),
        })
    };
    let layers: Vec<(u32, Beads)> = layers.into_iter().collect();
    layers.into_par_iter().map(planned).collect()
}
