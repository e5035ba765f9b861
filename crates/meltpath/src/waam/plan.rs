//! The plan: layers of the part, each filled with beads, at heights that follow from the growth of the bead.

use meltpath_base::quantity::Auto;
use meltpath_base::{Cancelled, Length, Observer, Origin, Reporter, Resolved};
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::{Join, inset, outset, stroke};
use meltpath_geometry::overhang::{Overhang, OverhangError, overhangs};
use meltpath_geometry::raster::{Grid, rasterise};
use meltpath_geometry::region::signed_area;
use meltpath_geometry::section::{
    HeightsError, LastLayer, Layer, LayerHeight, Slice, SliceError, SlicePlan, layers, slice,
};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_geometry::{Plane, Region};
use meltpath_planning::{Coverage, LayerPlan, PassIds, PlanError, plan_layers};
use meltpath_toolpath::{Pass, Profile, Toolpath};
use rayon::prelude::*;

use super::part::Part;
use super::settings::Settings;
use super::simulate::PlannedLayer;

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanStageError {
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The part cannot be cut.
    #[error("cannot slice the part: {0}")]
    Slice(#[from] SliceError),
    /// The layer heights make no sense.
    #[error("cannot lay out layers: {0}")]
    Heights(#[from] HeightsError),
    /// A layer cannot be grown or shrunk.
    #[error("cannot offset a layer: {0}")]
    Planar(#[from] PlanarError),
    /// Overhangs cannot be looked for.
    #[error("cannot compare layers: {0}")]
    Overhang(#[from] OverhangError),
    /// A layer cannot be filled.
    #[error("cannot fill a layer: {0}")]
    Fill(#[from] PlanError),
    /// Nothing to build.
    #[error(
        "no bead fits into the part: its walls are thinner than {narrowest:.1} mm everywhere, allowance of {allowance:.1} mm included; choose a narrower bead or a larger allowance"
    )]
    NoBead {
        /// Narrowest section that takes a bead, mm.
        narrowest: f64,
        /// Allowance, mm.
        allowance: f64,
    },
}

/// A plan with what it follows from.
#[derive(Debug)]
pub struct Plan {
    /// The beads.
    pub toolpath: Toolpath,
    /// The layers.
    pub layers: Vec<Layer>,
    /// What each layer covers, allowance included.
    pub regions: Vec<Vec<Region>>,
    /// How each layer's regions are covered: (layer from 1, coverage).
    pub coverage: Vec<(u32, Coverage)>,
    /// Where layers hang over the ones below.
    pub overhangs: Vec<Overhang>,
    /// Layer height: as written or from the growth model, mm.
    pub height: Resolved<f64>,
    /// Share of the bead length that has no neighbour in its layer.
    pub single: f64,
}

/// A free edge of the metal lies this share of the bead's width outside its axis: walls are 0.9 widths wide (Rouchon 2022,
/// § 4.4).
const FREE_EDGE: f64 = 0.45;
/// Heights of the part at which the growth model looks, shares of its height.
const PROBES: [f64; 5] = [0.05, 0.275, 0.5, 0.725, 0.95];
/// Holes narrower than this many bead widths, allowance taken off, are closed.
const CLOSED_HOLE: f64 = 2.0;
/// Part of a layer by which the build may stay below its target.
const SHORT: f64 = 0.2;

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
    let top = part_top + settings.allowance;
    let height = match &settings.heights {
        Auto::Value(list) => Resolved::new(list.0.last().map_or(0.0, |h| h.0.0), Origin::Job),
        Auto::Auto => grown_height(part, part_top, settings, observer)?,
    };
    let layers = lay_out(settings, top, height.value)?;
    let slices = cut(
        part,
        part_top,
        layers.iter().map(|l| l.at(0.5)),
        reporter,
        observer,
    )?;
    let regions: Vec<Vec<Region>> = covered(&slices, settings)?;
    tell_closed_holes(&slices, settings, reporter);
    let overhangs = overhangs(
        &slices,
        settings.bead.width.value,
        settings.limits.overhang,
        reporter,
        observer,
    )?;
    let plans = fill(&layers, &regions, settings, reporter, observer)?;
    let coverage = plans
        .iter()
        .flat_map(|p| p.coverage.iter().map(|c| (p.layer, c.clone())))
        .collect();
    let passes: Vec<Pass> = plans.into_iter().flat_map(|p| p.passes).collect();
    if passes.is_empty() {
        return Err(PlanStageError::NoBead {
            narrowest: settings.fill.narrowest * settings.bead.width.value,
            allowance: settings.allowance,
        });
    }
    let single = single_share(&passes);
    let toolpath = Toolpath {
        profiles: vec![profile(settings)],
        passes,
    };
    Ok(Plan {
        toolpath,
        layers,
        regions,
        coverage,
        overhangs,
        height,
        single,
    })
}

fn profile(settings: &Settings) -> Profile {
    Profile {
        name: "bead".to_owned(),
        speed: settings.bead.travel_speed,
        wire_feed: settings.bead.wire_feed,
        power: 0.0,
        width: settings.bead.width.value,
        height: settings.bead.height.value,
    }
}

/// Layers from the plate up.
fn lay_out(settings: &Settings, top: f64, height: f64) -> Result<Vec<Layer>, PlanStageError> {
    let list = match &settings.heights {
        Auto::Value(list) => list.0.iter().map(|h| h.0.0).collect(),
        Auto::Auto => vec![height],
    };
    let mut made = match (settings.count, &settings.heights) {
        (Some(count), _) => {
            // as many as asked, whatever the part's height
            let enough: f64 = (0..count as usize)
                .map(|i| list.get(i).or(list.last()).copied().unwrap_or(height))
                .sum();
            layers(0.0, enough, &LayerHeight::PerLayer(list), LastLayer::Full)?
        }
        (None, Auto::Value(_)) => {
            layers(0.0, top, &LayerHeight::PerLayer(list), LastLayer::Adapted)?
        }
        (None, Auto::Auto) => {
            // a bead cannot be made lower than it is: whole layers, the last of which may stay a little short
            let count = (top / height - SHORT).ceil().max(1.0);
            layers(
                0.0,
                count * height,
                &LayerHeight::Constant(height),
                LastLayer::Full,
            )?
        }
    };
    if let Some(count) = settings.count {
        made.truncate(count as usize);
    }
    Ok(made)
}

/// Sections of the part; heights above its top take the section just below the top, which the allowance raises.
fn cut(
    part: &Part,
    part_top: f64,
    heights: impl Iterator<Item = f64>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<Slice>, PlanStageError> {
    let heights: Vec<f64> = heights.collect();
    let highest = part_top * (1.0 - 1e-4);
    let mut cuts: Vec<f64> = heights.iter().map(|h| h.min(highest)).collect();
    cuts.dedup();
    let plan = SlicePlan::new(Plane::horizontal(0.0), cuts);
    let mut slices = slice(&part.mesh, &plan, reporter, observer)?;
    if let Some(last) = slices.last().cloned() {
        while slices.len() < heights.len() {
            slices.push(last.clone());
        }
    }
    Ok(slices)
}

fn hole_limit(settings: &Settings) -> f64 {
    let diameter = CLOSED_HOLE * settings.bead.width.value;
    0.25 * std::f64::consts::PI * diameter * diameter
}

/// What layers cover: sections grown by the allowance, without the holes that are too small to keep.
fn covered(slices: &[Slice], settings: &Settings) -> Result<Vec<Vec<Region>>, PlanarError> {
    let join = Join::Round {
        arc_tolerance: 0.02,
    };
    let limit = hole_limit(settings);
    slices
        .par_iter()
        .map(|s| {
            let mut grown = outset(&s.regions, settings.allowance, join)?;
            for region in &mut grown {
                region.holes.retain(|h| signed_area(h).abs() >= limit);
            }
            Ok(grown)
        })
        .collect()
}

fn tell_closed_holes(slices: &[Slice], settings: &Settings, reporter: &Reporter) {
    let limit = hole_limit(settings);
    let shrunk = |hole: &[DVec2]| {
        // a hole of area a shrunk by the allowance, as if it were round
        let radius = (signed_area(hole).abs() / std::f64::consts::PI).sqrt() - settings.allowance;
        std::f64::consts::PI * radius.max(0.0).powi(2)
    };
    let count = slices
        .iter()
        .map(|s| {
            s.regions
                .iter()
                .flat_map(|r| &r.holes)
                .filter(|h| shrunk(h) < limit)
                .count()
        })
        .max()
        .unwrap_or(0);
    if count > 0 {
        reporter.warn(
            "holes-closed",
            format!("{count} holes narrower than {:.0} mm (allowance taken off) are filled, to be drilled: beads round them would start and stop for nothing", CLOSED_HOLE * settings.bead.width.value),
            "",
        );
    }
}

fn fill(
    layers: &[Layer],
    regions: &[Vec<Region>],
    settings: &Settings,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<LayerPlan>, PlanError> {
    // the wire's tip travels on the surface that the layer is laid on
    let planes: Vec<Plane> = layers.iter().map(|l| Plane::horizontal(l.bottom)).collect();
    let wanted: Vec<meltpath_planning::Layer<'_>> = planes
        .iter()
        .zip(regions)
        .enumerate()
        .map(|(i, (plane, regions))| meltpath_planning::Layer {
            number: i as u32 + 1,
            plane,
            regions,
        })
        .collect();
    plan_layers(
        &wanted,
        &settings.fill,
        PassIds { part: 0 },
        reporter,
        observer,
    )
}

/// The height by which a layer grows: its metal over the area that its beads share.
fn grown_height(
    part: &Part,
    part_top: f64,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Resolved<f64>, PlanStageError> {
    let quiet = Reporter::new();
    let slices = cut(
        part,
        part_top,
        PROBES.iter().map(|p| p * part_top),
        &quiet,
        observer,
    )?;
    let regions = covered(&slices, settings)?;
    let layers: Vec<Layer> = PROBES
        .iter()
        .map(|p| Layer {
            bottom: p * part_top,
            top: p * part_top + 1.0,
        })
        .collect();
    let plans = fill(&layers, &regions, settings, &quiet, observer)?;
    let (mut metal, mut area) = (0.0, 0.0);
    for plan in &plans {
        let lines: Vec<Vec<DVec2>> = plan
            .passes
            .iter()
            .map(|p| p.flatten(0.05).0.iter().map(|v| v.truncate()).collect())
            .collect();
        metal += plan.passes.iter().map(Pass::length).sum::<f64>() * settings.bead.area.value;
        area += stroke(&lines, FREE_EDGE * settings.bead.width.value, 0.05)?
            .iter()
            .map(Region::area)
            .sum::<f64>();
    }
    if area <= 0.0 {
        return Err(PlanStageError::NoBead {
            narrowest: settings.fill.narrowest * settings.bead.width.value,
            allowance: settings.allowance,
        });
    }
    let height = metal / area;
    let origin = Origin::Computed("growth: metal of a layer over the area its beads share, free edges 0.45 widths outside the axis (Rouchon 2022, § 4.4)".to_owned());
    Ok(Resolved::new(height, origin).with_sigma(height * settings.growth_sigma(0.0)))
}

/// Share of the bead length without a neighbour in its own layer.
fn single_share(passes: &[Pass]) -> f64 {
    let total: f64 = passes.iter().map(Pass::length).sum();
    let beside: f64 = passes
        .iter()
        .map(|p| {
            let mut spans: Vec<(f64, f64)> = p
                .neighbours
                .iter()
                .filter(|n| n.layer == p.tag.layer)
                .map(|n| (n.from, n.to))
                .collect();
            spans.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut reached = 0.0_f64;
            spans.iter().fold(0.0, |sum, &(from, to)| {
                let new = (to - from.max(reached)).max(0.0);
                reached = reached.max(to);
                sum + new
            })
        })
        .sum();
    if total > 0.0 {
        (1.0 - beside / total).clamp(0.0, 1.0)
    } else {
        0.0
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
                .passes
                .iter()
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
                // a bead's width from the edge: free edges round off and belong to no flatness
                let inner = inset(regions, settings.bead.width.value, join)?;
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
