//! The plan: layers of the part, each filled with beads, at heights that follow from the growth of the bead.

pub(crate) mod begun;
pub(crate) mod cover;
pub(crate) mod foretell;
pub(crate) mod heights;
pub(crate) mod laid;
pub(crate) mod mend;
pub(crate) mod other_job;
pub(crate) mod own;
pub(crate) mod planned;
pub(crate) mod profile;

use meltpath_base::{Length, Observer, Origin, Reporter, Resolved};
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::{Join, inset};
use meltpath_geometry::overhang::{Overhang, Shift, largest_shift, overhangs};
use meltpath_geometry::raster::{Grid, rasterise};
use meltpath_geometry::section::{LayerSpan, Slice};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_geometry::{Plane, Region};
use meltpath_planning::Coverage;
use meltpath_programs::spacing::shortest_move;
use meltpath_toolpath::Toolpath;
use rayon::prelude::*;

use super::settings::Settings;
use crate::stages::part::Part;
use crate::waam::deposit::simulate::PlannedLayer;
pub use crate::waam::plan::cover::{Lean, PlanStageError};
use crate::waam::plan::cover::{
    covered, cut, fill, lean, no_bead, single_share, tell_closed_holes, tell_grown_together,
};
use crate::waam::plan::heights::{LaidOut, cut_at, lay_out};
use crate::waam::plan::profile::profile;

/// A plan with what it follows from.
#[derive(Debug)]
pub struct Plan {
    /// The beads.
    pub toolpath: Toolpath,
    /// The layers.
    pub layers: Vec<LayerSpan>,
    /// What each layer covers, allowance included.
    pub regions: Vec<Vec<Region>>,
    /// How each layer's regions are covered: (layer from 1, coverage).
    pub coverage: Vec<(u32, Coverage)>,
    /// Where layers hang over the ones below by more than the job accepts.
    pub overhangs: Vec<Overhang>,
    /// The farthest that a layer reaches beyond the one below, whatever is accepted.
    pub shift: Option<Shift>,
    /// Where layers lean out over all below.
    pub lean: Option<Lean>,
    /// Mean layer height: as written or from the growth model, mm.
    pub height: Resolved<f64>,
    /// Metal over faces that look up: as written, or what covers them however the build grows, mm.
    pub over: Resolved<f64>,
    /// How much lower than the layer below is planned to stand the wire's tip runs, from the second layer on, mm.
    pub lowered: f64,
    /// Share of the bead length that has no neighbour in its layer.
    pub single: f64,
}

/// Leaves out points that the controllers of the job cannot take that fast, where the way of a bead stays within a hundredth of its width.
pub(in crate::waam) fn merge_short_moves(toolpath: &mut Toolpath, settings: &Settings) {
    let dialects = settings.dialects().into_iter();
    let least = dialects.map(|dialect| shortest_move(&settings.cell.program, dialect));
    let chord = 0.01 * settings.bead.width.value;
    toolpath.merge_short_moves(least.fold(0.0, f64::max), chord);
}

/// Slices and fills.
///
/// # Errors
/// [`PlanStageError`].
pub fn plan(
    part: &Part,
    settings: &Settings,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Plan, PlanStageError> {
    let part_top = part.mesh.bounds().map_or(0.0, |(_, hi)| hi.z);
    let laid_out = lay_out(part, part_top, settings, observer)?;
    let torch = laid_out.torch_heights();
    let LaidOut {
        layers,
        height,
        over,
        lowered,
    } = laid_out;
    tell_count(&layers, part_top + over.value, settings, reporter);
    let goal = part_top + over.value;
    let middles: Vec<f64> = layers.iter().map(|l| cut_at(l, goal)).collect();
    let sections = cut(part, part_top, over.value, &middles, reporter, observer)?;
    let regions: Vec<Vec<Region>> = covered(&sections, settings)?;
    tell_closed_holes(&sections, settings, reporter);
    tell_grown_together(&sections, &regions, reporter);
    let shapes: Vec<Slice> = layers
        .iter()
        .zip(&regions)
        .map(|(l, r)| Slice {
            surface: Plane::horizontal(l.bottom),
            height: l.bottom,
            regions: r.clone(),
        })
        .collect();
    let overhangs = overhangs(
        &shapes,
        settings.bead.width.value,
        settings.limits.overhang,
        reporter,
        observer,
    )?;
    let shift = largest_shift(&shapes, settings.bead.width.value, observer)?;
    let lean = lean(&regions, settings.bead.width.value)?;
    let plans = fill(&torch, &regions, settings, reporter, observer)?;
    let coverage = plans
        .iter()
        .flat_map(|p| p.coverage.iter().map(|c| (p.path.number, c.clone())))
        .collect();
    let paths = plans.into_iter().map(|p| p.path);
    let mut toolpath = Toolpath {
        profiles: vec![profile(settings)],
        layers: paths.filter(|p| !p.is_empty()).collect(),
        weaves: settings.weave.into_iter().collect(),
        ..Toolpath::default()
    };
    if settings.weave.is_some() {
        toolpath.layers.iter_mut().for_each(|layer| layer.weave(1));
    }
    if toolpath.layers.is_empty() {
        return Err(no_bead(part, settings));
    }
    merge_short_moves(&mut toolpath, settings);
    Ok(Plan {
        over,
        single: single_share(toolpath.passes()),
        toolpath,
        layers,
        regions,
        coverage,
        overhangs,
        shift,
        lean,
        height,
        lowered,
    })
}

/// Warns where the job counts more layers than the part has up to `top`, mm, metal over it included.
fn tell_count(layers: &[LayerSpan], top: f64, settings: &Settings, reporter: &Reporter) {
    let Some(count) = settings.count else {
        return;
    };
    // heights that the job writes are laid as often as it counts, those that grow up to the top alone
    let needed = layers.iter().filter(|l| l.bottom < top).count();
    if count as usize > needed {
        let beyond = match layers.len() - needed {
            0 => "these are planned".to_owned(),
            more => format!("{more} are planned beyond its top"),
        };
        reporter.warn(
            "layers-count",
            format!("layers.count is {count}, and the part has {needed} layers, metal over its top included: {beyond}"),
            "lower layers.count, or leave it out",
        );
    }
}

impl Plan {
    /// The bare plate: as asked, or the plan with 25 mm around it.
    ///
    /// # Errors
    /// [`meltpath_geometry::workpiece::WorkpieceError`] when the map would be too large.
    pub fn plate(
        &self,
        settings: &Settings,
    ) -> Result<HeightMap, meltpath_geometry::workpiece::WorkpieceError> {
        plate(
            self.toolpath
                .passes()
                .flat_map(|p| p.points.iter().map(|v| v.truncate())),
            settings,
        )
    }

    /// The layers as the simulation needs them.
    ///
    /// # Errors
    /// [`PlanarError`].
    pub fn planned_layers(
        &self,
        map: &HeightMap,
        settings: &Settings,
    ) -> Result<Vec<PlannedLayer>, PlanarError> {
        let grid = Grid {
            origin: map.origin,
            cell: map.cell,
            nx: map.nx,
            ny: map.ny,
        };
        let join = Join::Round {
            arc_tolerance: 0.05,
        };
        self.layers
            .par_iter()
            .zip(&self.regions)
            .enumerate()
            .map(|(i, (layer, regions))| {
                let inner = inset(regions, ROUNDED_OFF * settings.bead.width.value, join)?;
                Ok(PlannedLayer {
                    layer: i as u32 + 1,
                    top: layer.top,
                    inner: rasterise(&inner, &grid),
                })
            })
            .collect()
    }

    /// Records what the plan resolved.
    pub fn record(&self, provenance: &mut meltpath_base::Provenance) {
        let height = Resolved {
            value: Length(self.height.value),
            origin: self.height.origin.clone(),
            sigma: self.height.sigma.map(Length),
        };
        provenance.parameter("layers.height", &height);
        let over = Resolved::new(Length(self.over.value), self.over.origin.clone());
        provenance.parameter("target.allowance_top", &over);
        let lowered = "edges and grooves of a layer lie lower than its middle: over them too the wire feed is known";
        provenance.parameter(
            "plan.torch_lowered",
            &Resolved::new(Length(self.lowered), Origin::Computed(lowered.to_owned())),
        );
        provenance.parameter(
            "layers.made",
            &Resolved::new(
                self.layers.len(),
                Origin::Computed("part height and allowance over the layer height".to_owned()),
            ),
        );
        provenance.parameter(
            "plan.single_bead_share",
            &Resolved::new(
                self.single,
                Origin::Computed("bead length without a neighbour in its layer".to_owned()),
            ),
        );
    }
}

/// Free edges round off over so many bead widths, and belong to no flatness.
pub(super) const ROUNDED_OFF: f64 = 1.5;
/// Metal may flow this far beyond the outermost points of a path, bead widths.
const BESIDE: f64 = 3.0;

/// A bare plate round the points `path`: of the size asked, centred on them, and never smaller than the metal needs.
///
/// # Errors
/// [`meltpath_geometry::workpiece::WorkpieceError`] when the map would be too large.
pub fn plate(
    path: impl Iterator<Item = DVec2>,
    settings: &Settings,
) -> Result<HeightMap, meltpath_geometry::workpiece::WorkpieceError> {
    let (lo, hi) = path.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| {
        (lo.min(p), hi.max(p))
    });
    let middle = 0.5 * (lo + hi);
    let needed = 0.5 * (hi - lo) + DVec2::splat(BESIDE * settings.bead.width.value);
    let half = match settings.plate {
        Some([length, width]) => needed
            .min(0.5 * DVec2::new(length, width))
            .max(0.5 * (hi - lo) + DVec2::splat(0.5 * settings.bead.width.value)),
        None => needed,
    };
    HeightMap::new(middle - half, middle + half, settings.cell_size, 0.0)
}
