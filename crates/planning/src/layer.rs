//! A layer's plan: regions taken apart, filled, written as passes with arcs, neighbours found, coverage told.

use meltpath_base::verdict::Place;
use meltpath_base::{Observer, Reporter};
use meltpath_geometry::boolean::{PlanarError, union};
use meltpath_geometry::fit::{Shape, Tolerance, fit};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::inset;
use meltpath_geometry::{Plane, Region};
use meltpath_toolpath::{Move, Pass, PassId, Role, Tag};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::contour::{contour_beads, start_share, started};
use crate::coverage::{Coverage, coverage};
use crate::direction::angle;
use crate::error::PlanError;
use crate::neighbours;
use crate::outline::{length, way_inside};
use crate::raster::raster;
use crate::rings::{Depth, nest, spacing};
use crate::settings::{
    CORNER, ContourOrder, FillSettings, LayerDirection, LineAngle, Strategy, reversal_distance,
};
use crate::spiral::spirals;
use crate::thin::split;
use crate::zigzag::zigzag;

/// A layer to fill: the regions to cover, allowance included.
#[derive(Debug, Clone, Copy)]
pub struct Layer<'a> {
    /// Counted from 1.
    pub number: u32,
    /// Where the regions lie: the plane on which the wire's tip travels.
    pub plane: &'a Plane,
    /// What to cover, in the plane's coordinates.
    pub regions: &'a [Region],
}

/// Names passes so that identifiers survive re-planning of other layers: part, layer and position in the layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PassIds {
    /// Part, counted from 0.
    pub part: u32,
}

impl PassIds {
    const PARTS: u32 = 1 << 4;
    const LAYERS: u32 = 1 << 14;
    const PASSES: usize = 1 << 14;

    /// The identifier of pass `index` of a layer.
    ///
    /// # Errors
    /// [`PlanError::TooMany`] beyond 16 parts, 16383 layers or 16384 passes a layer.
    pub fn id(self, layer: u32, index: usize) -> Result<PassId, PlanError> {
        if self.part >= Self::PARTS || layer >= Self::LAYERS || index >= Self::PASSES {
            return Err(PlanError::TooMany {
                part: self.part,
                layer,
                passes: index + 1,
            });
        }
        Ok(PassId(self.part << 28 | layer << 14 | index as u32))
    }
}

/// The plan of a layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LayerPlan {
    /// Counted from 1.
    pub layer: u32,
    /// The beads in order of execution.
    pub passes: Vec<Pass>,
    /// How each region is covered.
    pub coverage: Vec<Coverage>,
    /// The settings that made it.
    pub settings: FillSettings,
}

/// A bead before it has a name.
struct Bead {
    points: Vec<DVec2>,
    role: Role,
}

fn beads_of(role: Role, lines: Vec<Vec<DVec2>>) -> impl Iterator<Item = Bead> {
    lines.into_iter().map(move |points| Bead { points, role })
}

/// Plans one layer.
///
/// Each bead lies inside its region by half a bead width, except where a section is narrower than a bead; such sections
/// get one bead on their centre line down to `narrowest`, and nothing below; [`Coverage`] tells what is left.
/// Passes are polylines of lines and arcs within the tolerance; their `profile` is 0.
///
/// # Errors
/// [`PlanError`] where a setting or an outline is out of range.
pub fn plan_layer(
    layer: Layer<'_>,
    settings: &FillSettings,
    ids: PassIds,
    reporter: &Reporter,
) -> Result<LayerPlan, PlanError> {
    settings.check()?;
    let outline = |source| PlanError::Outline {
        layer: layer.number,
        source,
    };
    let mut filled: Vec<Vec<Bead>> = layer
        .regions
        .par_iter()
        .map(|region| fill(region, layer, settings, reporter))
        .collect::<Result<_, _>>()
        .map_err(outline)?;
    let coverage: Vec<Coverage> = layer
        .regions
        .par_iter()
        .zip(&filled)
        .enumerate()
        .map(|(i, (region, beads))| {
            let lines: Vec<_> = beads.iter().map(|b| b.points.clone()).collect();
            coverage(i as u32, region, &lines, layer.plane, settings)
        })
        .collect::<Result<_, _>>()
        .map_err(outline)?;
    for c in &coverage {
        if filled[c.region as usize].is_empty() {
            let place = layer.regions[c.region as usize].outer.first();
            let place = layer.plane.from_local(place.copied().unwrap_or_default());
            reporter.warn_at(
                "region-without-bead",
                format!(
                    "layer {}: region {} of {:.1} mm² is too small for a bead {:.2} mm wide",
                    layer.number, c.region, c.area, settings.width
                ),
                Place::at(place.to_array()),
                "choose a narrower bead, or thicken the part there",
            );
        }
    }
    let mut passes = Vec::new();
    for region in visiting_order(&filled) {
        for bead in std::mem::take(&mut filled[region]) {
            let tag = Tag {
                part: ids.part,
                layer: layer.number,
                entity: region as u32,
            };
            let id = ids.id(layer.number, passes.len())?;
            passes.push(pass(id, tag, &bead, layer.plane, settings));
        }
    }
    neighbours::find(&mut passes, layer.plane, settings.width, settings.tolerance);
    Ok(LayerPlan {
        layer: layer.number,
        passes,
        coverage,
        settings: *settings,
    })
}

/// Plans all layers, in parallel, with the same result on any number of threads.
///
/// # Errors
/// [`PlanError`] of the first layer that has one, or [`PlanError::Cancelled`].
pub fn plan_layers(
    layers: &[Layer<'_>],
    settings: &FillSettings,
    ids: PassIds,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<LayerPlan>, PlanError> {
    settings.check()?;
    observer.stage("fill", layers.len() as u64);
    let plans: Vec<Result<LayerPlan, PlanError>> = layers
        .par_iter()
        .map(|&layer| {
            observer.check()?;
            let plan = plan_layer(layer, settings, ids, reporter);
            observer.advance(1);
            plan
        })
        .collect();
    plans.into_iter().collect()
}

/// Whether a line stays where bead axes may lie.
fn stays_inside(room: &[Region], line: &[DVec2], settings: &FillSettings) -> bool {
    line.windows(2)
        .all(|w| way_inside(room, w[0], w[1], 0.25 * settings.width))
}

/// Half the width up to which a band is filled with contours alone, mm: inside the contours there must be room for zigzag
/// lines of three stepovers, else their reversals pile up more metal than the lines lay down.
fn widest_band(contours: u32, settings: &FillSettings) -> f64 {
    0.5 * settings.width + (f64::from(contours) + 1.5) * settings.stepover
}

/// The beads of one region in order.
fn fill(
    region: &Region,
    layer: Layer<'_>,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Result<Vec<Bead>, PlanarError> {
    let mut beads: Vec<Bead> = Vec::new();
    // the outline as the grid sees it: oriented, without repeated points, apart where it touches itself
    for clean in union(std::slice::from_ref(region))? {
        let parts = split(&clean, 0.5 * settings.narrowest * settings.width, settings)?;
        if let Some(trouble) = &parts.trouble {
            reporter.warn(
                "centre-line-missing",
                format!(
                    "layer {}: {trouble}; narrow sections get no bead",
                    layer.number
                ),
                "repair the part or simplify its outline",
            );
        }
        for body in &parts.bodies {
            fill_body(body, layer, settings, reporter, &mut beads)?;
        }
        beads.extend(middles(parts.lines, layer.number, settings));
    }
    beads.retain(|b| {
        b.points.len() > 1
            && length(&b.points) + 1e-9 >= settings.shortest_bead.min(2.0 * settings.stepover)
    });
    Ok(beads)
}

fn fill_body(
    body: &Region,
    layer: Layer<'_>,
    settings: &FillSettings,
    reporter: &Reporter,
    beads: &mut Vec<Bead>,
) -> Result<(), PlanarError> {
    let whole = std::slice::from_ref(body);
    let links = |inside: &[Region]| inset(inside, 0.48 * settings.width, settings.join());
    match settings.strategy {
        Strategy::Raster {
            angle: wanted,
            order,
            direction,
        } => {
            let centres = inset(whole, 0.5 * settings.width, settings.join())?;
            for centre in centres.chunks(1) {
                let angle = angle(wanted, centre, layer.number, settings);
                let lines = raster(centre, angle, order, direction, layer.number, settings);
                beads.extend(beads_of(Role::Fill, lines));
            }
        }
        Strategy::Zigzag { angle } => zigzag_body(whole, angle, layer, settings, beads)?,
        Strategy::Contour { order } | Strategy::Spiral { order } => {
            let settings = FillSettings {
                stepover: spacing(body, settings),
                ..*settings
            };
            let nest = nest(body, Depth::Full, &settings)?;
            let room = links(whole)?;
            let contours = || contour_beads(&nest.contours, &room, order, layer.number, &settings);
            let lines = if matches!(settings.strategy, Strategy::Spiral { .. }) {
                let turns = spirals(&nest.contours, order, layer.number, &settings);
                // between contours that differ in shape a turn may leave the region: contours never do
                if turns.iter().all(|t| stays_inside(&room, t, &settings)) {
                    turns
                } else {
                    reporter.warn(
                        "spiral-replaced",
                        format!(
                            "layer {}: a spiral would leave the region; contours fill it",
                            layer.number
                        ),
                        "choose fill.strategy = \"contour\" for parts with holes or branches",
                    );
                    contours()
                }
            } else {
                contours()
            };
            let contours = beads_of(Role::Contour, lines);
            let middles = middles(nest.lines, layer.number, &settings);
            match order {
                ContourOrder::OutsideIn => beads.extend(contours.chain(middles)),
                ContourOrder::InsideOut => beads.extend(middles.chain(contours)),
            }
        }
        Strategy::Hybrid {
            contours,
            order,
            angle,
        } => {
            if contours == 0 {
                return zigzag_body(whole, angle, layer, settings, beads);
            }
            if inset(whole, widest_band(contours, settings), settings.join())?.is_empty() {
                // a zigzag between contours this near would turn at every step: contours fill the band better
                let settings = FillSettings {
                    strategy: Strategy::Contour { order },
                    ..*settings
                };
                return fill_body(body, layer, &settings, reporter, beads);
            }
            let inside = reversal_distance(settings.stepover);
            let nest = nest(
                body,
                Depth::Levels {
                    count: contours,
                    inside,
                },
                settings,
            )?;
            let lines = contour_beads(
                &nest.contours,
                &links(whole)?,
                order,
                layer.number,
                settings,
            );
            let mut inner = Vec::new();
            let narrowest = 0.5 * settings.width - 0.25 * settings.stepover;
            for region in &nest.rest {
                let parts = split(region, narrowest, settings)?;
                zigzag_body(&parts.bodies, angle, layer, settings, &mut inner)?;
                inner.extend(middles(parts.lines, layer.number, settings));
            }
            inner.extend(middles(nest.lines, layer.number, settings));
            let outer = beads_of(Role::Contour, lines);
            if order == ContourOrder::OutsideIn {
                beads.extend(outer.chain(inner));
            } else {
                beads.extend(inner.into_iter().chain(outer));
            }
        }
    }
    Ok(())
}

/// Beads on centre lines: closed ones start where contours do, and directions follow the layer.
fn middles(
    lines: Vec<Vec<DVec2>>,
    layer: u32,
    settings: &FillSettings,
) -> impl Iterator<Item = Bead> + '_ {
    lines.into_iter().enumerate().map(move |(i, mut points)| {
        if points.len() > 3 && points.first() == points.last() {
            points.pop();
            points = started(&points, start_share(settings.starts, layer, i as u32));
        }
        if settings.layers == LayerDirection::Alternate && layer.is_multiple_of(2) {
            points.reverse();
        }
        Bead {
            points,
            role: Role::Fill,
        }
    })
}

fn zigzag_body(
    bodies: &[Region],
    wanted: LineAngle,
    layer: Layer<'_>,
    settings: &FillSettings,
    beads: &mut Vec<Bead>,
) -> Result<(), PlanarError> {
    let centres = inset(bodies, 0.5 * settings.width, settings.join())?;
    let links = inset(bodies, 0.48 * settings.width, settings.join())?;
    for centre in centres.chunks(1) {
        let angle = angle(wanted, centre, layer.number, settings);
        let entry = (start_share(settings.starts, layer.number, 0) * 4.0) as u32 & 3;
        let mut lines = zigzag(centre, &links, angle, entry, settings);
        if settings.layers == LayerDirection::Alternate && layer.number.is_multiple_of(2) {
            lines.reverse();
            for line in &mut lines {
                line.reverse();
            }
        }
        beads.extend(beads_of(Role::Fill, lines));
    }
    Ok(())
}

/// Regions in the order of the shortest ways between them, from the first.
fn visiting_order(filled: &[Vec<Bead>]) -> Vec<usize> {
    let ends = |i: usize| {
        let first = filled[i].first()?.points.first()?;
        let last = filled[i].last()?.points.last()?;
        Some((*first, *last))
    };
    let mut left: Vec<usize> = (0..filled.len()).filter(|&i| ends(i).is_some()).collect();
    let mut order = Vec::with_capacity(left.len());
    let mut at: Option<DVec2> = None;
    while !left.is_empty() {
        let away = |&i: &usize| match (at, ends(i)) {
            (Some(p), Some((first, _))) => p.distance(first),
            _ => 0.0,
        };
        let next = (0..left.len()).min_by(|&a, &b| away(&left[a]).total_cmp(&away(&left[b])));
        let Some(next) = next else { break };
        let region = left.remove(next);
        at = ends(region).map(|(_, last)| last);
        order.push(region);
    }
    order
}

/// The bead as a pass of lines and arcs.
fn pass(id: PassId, tag: Tag, bead: &Bead, plane: &Plane, settings: &FillSettings) -> Pass {
    let tolerance = Tolerance {
        distance: settings.tolerance,
        corner: CORNER,
    };
    let pieces = fit(&bead.points, tolerance);
    let mut points = vec![plane.from_local(bead.points[0])];
    let mut moves = Vec::with_capacity(pieces.len());
    for piece in pieces {
        points.push(plane.from_local(piece.end));
        moves.push(match piece.shape {
            Shape::Line => Move::Line,
            Shape::Arc { via } => Move::Arc {
                via: plane.from_local(via),
            },
        });
    }
    Pass {
        moves,
        ..Pass::polyline(id, bead.role, tag, points)
    }
}
