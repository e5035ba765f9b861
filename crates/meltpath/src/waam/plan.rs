//! The plan: layers of the part, each filled with beads, at heights that follow from the growth of the bead.

use meltpath_base::quantity::Auto;
use meltpath_base::{Cancelled, Length, Observer, Origin, Reporter, Resolved};
use meltpath_deposition::assembly::{self, AssemblyBead, AssemblyError, Growth};
use meltpath_geometry::boolean::{PlanarError, difference, union};
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
use meltpath_planning::{Coverage, LayerPlan, PassIds, PlanError, nominal_length, plan_layers};
use meltpath_toolpath::{Pass, Profile, Toolpath};
use rayon::prelude::*;

use super::settings::Settings;
use super::simulate::PlannedLayer;
use crate::stages::part::Part;

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
    /// Mean layer height: as written or from the growth model, mm.
    pub height: Resolved<f64>,
    /// Metal over faces that look up: as written, or what covers them however the build grows, mm.
    pub over: Resolved<f64>,
    /// Share of the bead length that has no neighbour in its layer.
    pub single: f64,
}

/// A free edge of the metal lies this share of the bead's width outside its axis: walls are 0.9 widths wide (Rouchon 2022,
/// § 4.4).
const FREE_EDGE: f64 = 0.45;
/// Most heights at which the growth model looks.
const MOST_PROBES: usize = 60;
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
    let LaidOut {
        layers,
        height,
        over,
    } = lay_out(part, part_top, settings, observer)?;
    let middles: Vec<f64> = layers.iter().map(|l| l.at(0.5)).collect();
    let sections = cut(part, part_top, over.value, &middles, reporter, observer)?;
    let regions: Vec<Vec<Region>> = covered(&sections, settings)?;
    tell_closed_holes(&sections, settings, reporter);
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
    let plans = fill(&layers, &regions, settings, reporter, observer)?;
    let coverage = plans
        .iter()
        .flat_map(|p| p.coverage.iter().map(|c| (p.path.number, c.clone())))
        .collect();
    let paths = plans.into_iter().map(|p| p.path);
    let toolpath = Toolpath {
        profiles: vec![profile(settings)],
        layers: paths.filter(|p| !p.is_empty()).collect(),
        ..Toolpath::default()
    };
    if toolpath.layers.is_empty() {
        return Err(PlanStageError::NoBead {
            narrowest: settings.fill.narrowest * settings.bead.width.value,
            allowance: settings.allowance,
        });
    }
    Ok(Plan {
        over,
        single: single_share(toolpath.passes()),
        toolpath,
        layers,
        regions,
        coverage,
        overhangs,
        height,
    })
}

fn profile(settings: &Settings) -> Profile {
    Profile {
        name: "bead".to_owned(),
        speed: settings.bead.travel_speed,
        wire_feed: settings.bead.wire_feed,
        width: settings.bead.width.value,
        height: settings.bead.height.value,
        ..Profile::default()
    }
}

/// Layers from the plate up.
struct LaidOut {
    layers: Vec<Layer>,
    /// Their mean height, mm.
    height: Resolved<f64>,
    /// What they lay over faces that look up, mm.
    over: Resolved<f64>,
}

fn lay_out(
    part: &Part,
    part_top: f64,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<LaidOut, PlanStageError> {
    let (mut made, origin, over) = match &settings.heights {
        Auto::Value(list) => {
            let list: Vec<f64> = list.iter().map(|h| h.0).collect();
            let height = |i: usize| list.get(i).or(list.last()).copied().unwrap_or(0.0);
            let mean = list.iter().sum::<f64>() / list.len().max(1) as f64;
            let over = over_faces(part_top, mean, 0.0, settings);
            let (goal, last) = match settings.count {
                // so many, whatever the part's height
                Some(count) => ((0..count as usize).map(height).sum(), LastLayer::Full),
                None => (part_top + over.value, LastLayer::Adapted),
            };
            let made = layers(0.0, goal, &LayerHeight::PerLayer(list), last)?;
            (made, Origin::Job, over)
        }
        Auto::Auto => {
            let (growth, single) = growth(part, part_top, settings, observer)?;
            let mean = growth.iter().map(|g| g.1).sum::<f64>() / growth.len() as f64;
            let over = over_faces(part_top, mean, single, settings);
            let origin = "growth, layer by layer: metal of a layer over the area its beads share, free edges 0.45 widths outside the axis (Rouchon 2022, § 4.4)";
            let made = grown_layers(&growth, part_top + over.value);
            (made, Origin::Computed(origin.to_owned()), over)
        }
    };
    if let Some(count) = settings.count {
        made.truncate(count as usize);
    }
    let mean = made.last().map_or(0.0, |l| l.top) / made.len().max(1) as f64;
    let sigma = mean * settings.growth_error(0.0).share;
    let height = Resolved::new(mean, origin.clone());
    let height = if origin == Origin::Job {
        height
    } else {
        height.with_sigma(sigma)
    };
    Ok(LaidOut {
        layers: made,
        height,
        over,
    })
}

/// Metal over faces that look up, mm: as written; else what leaves the least stock on the highest of them where edges lie
/// lower than the middle, the last layer ends short of its target, and the build grows one standard uncertainty less than
/// predicted. Never less than over sides. `height` is the mean layer's, `single` the share of beads without a neighbour.
fn over_faces(part_top: f64, height: f64, single: f64, settings: &Settings) -> Resolved<f64> {
    if let Some(written) = settings.allowance_top {
        return Resolved::new(written, Origin::Job);
    }
    let lag = assembled(settings, EDGE_BEADS).map_or(0.5 * height, |g| g.edge_lag);
    let least = settings.limits.stock_min.max(0.0) + lag + SHORT * height;
    let doubt = settings.growth_error(single).at(part_top + least);
    Resolved::new(
        settings.allowance.max(least + doubt),
        Origin::Computed(format!(
            "least stock, edges {lag:.1} mm lower than the middle, one standard uncertainty of {doubt:.1} mm at {part_top:.0} mm"
        )),
    )
}

/// Beads across a strip whose middle does not see its edges.
pub(super) const EDGE_BEADS: usize = 6;
/// Layers in which the edges of a wall install themselves (Rouchon 2022, § 4.3).
pub(super) const ASSEMBLED: u32 = 5;

/// Growth of walls of `beads` beads across by the assembly of sections.
pub(super) fn assembled(settings: &Settings, beads: usize) -> Result<Growth, AssemblyError> {
    let bead = AssemblyBead {
        width: settings.bead.width.value,
        height: settings.bead.height.value,
    };
    assembly::growth(bead, beads, settings.stepover.value, ASSEMBLED)
}

/// The sections whose union a layer has to cover, so that faces that look up get their allowance too: the part at the layer's
/// mid-height and, at most this many mm apart, down to the allowance of upward faces below it.
const BELOW_STEP: f64 = 1.0;

/// For each height, the sections of the part at that height and down to an allowance below it; none above the part.
fn cut(
    part: &Part,
    part_top: f64,
    allowance: f64,
    heights: &[f64],
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<Vec<Slice>>, PlanStageError> {
    // the very top and the very bottom belong to the part
    let (lowest, highest) = (1e-4 * part_top, part_top * (1.0 - 1e-4));
    let steps = (allowance / BELOW_STEP).ceil().max(1.0) as u32;
    let wanted = |h: f64| {
        (0..=steps)
            .map(move |i| h - f64::from(i) / f64::from(steps) * allowance)
            .filter(move |z| *z <= part_top)
            .map(move |z| z.clamp(lowest, highest))
    };
    let mut cuts: Vec<f64> = heights.iter().flat_map(|h| wanted(*h)).collect();
    cuts.sort_unstable_by(f64::total_cmp);
    cuts.dedup();
    let slices = slice(
        &part.mesh,
        &SlicePlan::new(Plane::horizontal(0.0), cuts.clone()),
        reporter,
        observer,
    )?;
    let at = |z: f64| slices.get(cuts.partition_point(|c| *c < z)).cloned();
    Ok(heights
        .iter()
        .map(|h| wanted(*h).filter_map(at).collect())
        .collect())
}

fn hole_limit(settings: &Settings) -> f64 {
    let diameter = CLOSED_HOLE * settings.bead.width.value;
    0.25 * std::f64::consts::PI * diameter * diameter
}

/// What layers cover: the union of their sections grown by the allowance, without the holes that are too small to keep, and
/// as much more in corners as a bead needs to reach into them.
fn covered(sections: &[Vec<Slice>], settings: &Settings) -> Result<Vec<Vec<Region>>, PlanarError> {
    let limit = hole_limit(settings);
    sections
        .par_iter()
        .map(|slices| {
            let all: Vec<Region> = slices
                .iter()
                .flat_map(|s| s.regions.iter().cloned())
                .collect();
            let mut grown = outset(&all, settings.allowance, ROUND)?;
            for region in &mut grown {
                region.holes.retain(|h| signed_area(h).abs() >= limit);
            }
            let corners = beyond_reach(&all, &grown, settings)?;
            if corners.is_empty() {
                return Ok(grown);
            }
            let room = outset(&corners, REACH * settings.bead.width.value, ROUND)?;
            union(&[grown, room].concat())
        })
        .collect()
}

/// Corners of sections, with stock between the least and the allowance, that the metal of beads inside `grown` does not reach: at a sharp turn
/// the arm cuts across, and the outside of the bead lacks metal.
fn beyond_reach(
    sections: &[Region],
    grown: &[Region],
    settings: &Settings,
) -> Result<Vec<Region>, PlanarError> {
    let width = settings.bead.width.value;
    let (turn, edge) = (ROUND_TURN * width, FREE_EDGE * width);
    let axes = inset(grown, 0.5 * width, ROUND)?;
    let round = outset(&inset(&axes, turn, ROUND)?, turn, ROUND)?;
    // what is lost by rounding the turns is small; what is large are walls too thin to be rounded
    let mut reached = difference(&axes, &round)?;
    reached.retain(|piece| piece.area() > 4.0 * turn * turn);
    reached.extend(round);
    let stock = 0.5 * (settings.limits.stock_min.max(0.0) + settings.allowance);
    let mut bare = difference(
        &outset(sections, stock.min(settings.allowance), ROUND)?,
        &outset(&reached, edge, ROUND)?,
    )?;
    // what is wide is a section too thin for a bead: told, not thickened; what is narrow is the offsets' own
    let near = outset(&axes, width, ROUND)?;
    bare = difference(&bare, &difference(&bare, &near)?)?;
    outset(&inset(&bare, SLIVER, ROUND)?, SLIVER, ROUND)
}

/// Radius of the turn that the outside of a bead's metal makes at a right angle of its axis, less that of the metal itself,
/// bead widths: found on the simulated corner of a plate with CNT50, a value of ours.
const ROUND_TURN: f64 = 0.4;
/// How far round a corner that is not reached the layer grows, bead widths: the axis then goes beyond its turn.
const REACH: f64 = 0.42;
/// Corners of outlines, mm from the exact curve.
const ROUND: Join = Join::Round {
    arc_tolerance: 0.02,
};
/// Differences of outlines below this are the offsets' own, mm.
const SLIVER: f64 = 0.05;

fn tell_closed_holes(sections: &[Vec<Slice>], settings: &Settings, reporter: &Reporter) {
    let limit = hole_limit(settings);
    let shrunk = |hole: &[DVec2]| {
        // a hole of area a shrunk by the allowance, as if it were round
        let radius = (signed_area(hole).abs() / std::f64::consts::PI).sqrt() - settings.allowance;
        std::f64::consts::PI * radius.max(0.0).powi(2)
    };
    let small = |slice: &Slice| {
        slice
            .regions
            .iter()
            .flat_map(|r| &r.holes)
            .filter(|h| shrunk(h) < limit)
            .count()
    };
    let count = sections
        .iter()
        .filter_map(|s| s.first().map(small))
        .max()
        .unwrap_or(0);
    if count > 0 {
        let narrow = CLOSED_HOLE * settings.bead.width.value;
        reporter.warn(
            "holes-closed",
            format!("{count} holes narrower than {narrow:.0} mm (allowance taken off) are filled, to be drilled: beads round them would start and stop for nothing"),
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

/// How much layers grow, over the height of the part: the metal of a layer over the area that its beads share, at a number of
/// heights (mm, growth in mm); and the share of bead length without a neighbour.
fn growth(
    part: &Part,
    part_top: f64,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<(Vec<(f64, f64)>, f64), PlanStageError> {
    let quiet = Reporter::new();
    let count = (part_top / settings.bead.height.value)
        .ceil()
        .clamp(1.0, MOST_PROBES as f64) as usize;
    let heights: Vec<f64> = (0..count)
        .map(|i| (i as f64 + 0.5) / count as f64 * part_top)
        .collect();
    let regions = covered(
        &cut(
            part,
            part_top,
            settings.allowance_top.unwrap_or(settings.allowance),
            &heights,
            &quiet,
            observer,
        )?,
        settings,
    )?;
    let layers: Vec<Layer> = heights
        .iter()
        .map(|h| Layer {
            bottom: *h,
            top: h + 1.0,
        })
        .collect();
    let plans = fill(&layers, &regions, settings, &quiet, observer)?;
    let mut grown = Vec::new();
    for (plan, height) in plans.iter().zip(heights) {
        let lines: Vec<Vec<DVec2>> = plan
            .path
            .passes()
            .map(|p| p.flatten(0.05).0.iter().map(|v| v.truncate()).collect())
            .collect();
        let speed = settings.bead.travel_speed;
        let laid = plan.path.passes().map(|p| nominal_length(&p, speed));
        let laid: f64 = laid.sum();
        let metal = laid * settings.bead.area.value;
        let area: f64 = stroke(&lines, FREE_EDGE * settings.bead.width.value, 0.05)?
            .iter()
            .map(Region::area)
            .sum();
        if area > 0.0 {
            grown.push((height, metal / area));
        }
    }
    if grown.is_empty() {
        return Err(no_bead(settings));
    }
    let single = single_share(plans.iter().flat_map(|p| p.path.passes()));
    Ok((grown, single))
}

/// Layers that follow the growth, up to `top`.
fn grown_layers(growth: &[(f64, f64)], top: f64) -> Vec<Layer> {
    let mut layers: Vec<Layer> = Vec::new();
    let mut bottom = 0.0;
    loop {
        // each layer as the nearest height at which the growth is known
        let nearest = growth
            .iter()
            .min_by(|a, b| (a.0 - bottom).abs().total_cmp(&(b.0 - bottom).abs()));
        let Some((_, height)) = nearest else {
            return layers;
        };
        if top - bottom <= SHORT * height && !layers.is_empty() {
            return layers;
        }
        layers.push(Layer {
            bottom,
            top: bottom + height,
        });
        bottom += height;
    }
}

fn no_bead(settings: &Settings) -> PlanStageError {
    PlanStageError::NoBead {
        narrowest: settings.fill.narrowest * settings.bead.width.value,
        allowance: settings.allowance,
    }
}

/// Share of the bead length without a neighbour in its own layer.
fn single_share<'a>(passes: impl Iterator<Item = Pass<'a>>) -> f64 {
    let (total, beside) = passes.fold((0.0, 0.0), |(total, beside), pass| {
        let mut spans: Vec<(f64, f64)> = pass
            .neighbours()
            .filter(|n| n.layer == pass.layer)
            .map(|n| (n.from, n.to))
            .collect();
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut reached = 0.0_f64;
        let along = spans.iter().fold(0.0, |sum, &(from, to)| {
            let new = (to - from.max(reached)).max(0.0);
            reached = reached.max(to);
            sum + new
        });
        (total + pass.length(), beside + along)
    });
    if total > 0.0 {
        (1.0_f64 - beside / total).clamp(0.0, 1.0)
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
                // free edges round off over a bead and a half, and belong to no flatness
                let inner = inset(regions, 1.5 * settings.bead.width.value, join)?;
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
