//! A layer's plan: regions taken apart, filled, written as passes with arcs, neighbours found, coverage told.

use meltpath_base::{Observer, Place, Reporter};
use meltpath_geometry::Plane;
use meltpath_geometry::fit::{Shape, Tolerance, fit};
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::{Layer, Move, PassHead};
use rayon::prelude::*;

use crate::error::PlanError;
use crate::fill::bead::Bead;
use crate::fill::coverage::{Coverage, coverage};
use crate::fill::layer::{FillLayer, PassIds};
use crate::fill::neighbours;
use crate::fill::pace::{self, nominal_length};
use crate::fill::region::fill;
use crate::fill::settings::{CORNER, FillSettings};

/// The plan of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerPlan {
    /// The beads in order of execution; their points bear their own heights.
    pub path: Layer,
    /// How each region is covered.
    pub coverage: Vec<Coverage>,
    /// The settings that made it.
    pub settings: FillSettings,
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
    layer: FillLayer<'_>,
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
    let mut coverage: Vec<Coverage> = layer
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
    let mut path = Layer::new(layer.number, 0.0);
    for region in visiting_order(&filled) {
        for (number, bead) in std::mem::take(&mut filled[region]).iter().enumerate() {
            let head = PassHead {
                id: ids.id(layer.number, path.len())?,
                part: ids.part,
                entity: region as u32,
                bead: number as u32,
                profile: 0,
                role: bead.role,
            };
            write(&mut path, head, bead, layer.plane, settings);
        }
    }
    let mut path =
        pace::adapted(path, layer.regions, layer.plane, settings, reporter).map_err(outline)?;
    for c in coverage.iter_mut().filter(|c| c.area > 0.0) {
        let nominal = settings.paces.map_or(1.0, |p| p.nominal);
        let long: f64 = path
            .passes()
            .filter(|p| p.head.entity == c.region)
            .map(|p| nominal_length(&p, nominal))
            .sum();
        c.fill_ratio = long * settings.stepover / c.area;
    }
    neighbours::find(&mut path, layer.plane, settings.width, settings.tolerance);
    Ok(LayerPlan {
        path,
        coverage,
        settings: *settings,
    })
}

/// Plans all layers, in parallel, with the same result on any number of threads.
///
/// # Errors
/// [`PlanError`] of the first layer that has one, or [`PlanError::Cancelled`].
pub fn plan_layers(
    layers: &[FillLayer<'_>],
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

/// Writes a bead as a pass of lines and arcs.
fn write(path: &mut Layer, head: PassHead, bead: &Bead, plane: &Plane, settings: &FillSettings) {
    let tolerance = Tolerance {
        distance: bead.tolerance,
        facet: settings.facet(),
        corner: CORNER,
    };
    let mut pass = path.begin(head, plane.from_local(bead.points[0]));
    for piece in fit(&bead.points, tolerance) {
        let shape = match piece.shape {
            Shape::Line => Move::Line,
            Shape::Arc { via } => Move::Arc {
                via: plane.from_local(via),
            },
        };
        pass.go(shape, plane.from_local(piece.end));
    }
}
