//! A layer's plan: regions taken apart, filled, written as passes with arcs, neighbours found, coverage told.

use meltpath_base::{Observer, Place, Reporter};
use meltpath_geometry::Plane;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::cover::Ground;
use meltpath_geometry::fit::{Shape, Tolerance, fit};
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::{Layer, Move, PassHead};
use rayon::prelude::*;

use crate::error::PlanError;
use crate::fill::alike::alike;
use crate::fill::bead::Bead;
use crate::fill::coverage::{Coverage, coverage};
use crate::fill::gaps;
use crate::fill::layer::{FillLayer, PassIds};
use crate::fill::neighbours;
use crate::fill::pace::{self, is_paced, nominal_length};
use crate::fill::pieces::{Piece, apart};
use crate::fill::region::lay;
use crate::fill::rooms::Rooms;
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

/// What layers of the same sections share.
struct Shared {
    sections: Vec<Section>,
    /// Where rooms of beads are counted, if they are.
    rooms: Option<Rooms>,
}

/// A region of a layer with what layers of the same section share.
struct Section {
    pieces: Vec<Piece>,
    /// What beads cover of it.
    ground: Ground,
}

/// The beads of a layer's regions, piece by piece, before gaps are closed.
type Drawn = Vec<Vec<Vec<Bead>>>;

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
    let shared = shared(layer, settings)?;
    let drawn = draw(&shared.sections, layer, settings, reporter)?;
    finish(drawn, &shared, layer, (settings, ids), reporter)
}

/// The passes of one layer as [`plan_layer`] has them, all of one speed; what they cover and what lies beside each, which takes most
/// of the time of a plan, is not looked for.
///
/// # Errors
/// See [`plan_layer`].
pub(crate) fn passes_alone(
    layer: FillLayer<'_>,
    settings: &FillSettings,
    ids: PassIds,
    reporter: &Reporter,
) -> Result<Layer, PlanError> {
    settings.check()?;
    let sections = taken_apart(layer, settings)?;
    let drawn = draw(&sections, layer, settings, reporter)?;
    let filled = closed(drawn, &sections, layer, settings, reporter)?;
    written(filled, layer, settings, ids)
}

/// An outline that the booleans do not take, with its layer.
fn outline(layer: FillLayer<'_>) -> impl Fn(PlanarError) -> PlanError {
    move |source| PlanError::Outline {
        layer: layer.number,
        source,
    }
}

/// The regions of a layer taken apart.
fn taken_apart(layer: FillLayer<'_>, settings: &FillSettings) -> Result<Vec<Section>, PlanError> {
    let regions = layer.regions.par_iter();
    let apart = regions.map(|region| {
        Ok(Section {
            pieces: apart(region, settings)?,
            ground: Ground::new(vec![region.clone()], settings.metal())?,
        })
    });
    apart.collect::<Result<_, _>>().map_err(outline(layer))
}

/// What layers with the sections of this one share.
fn shared(layer: FillLayer<'_>, settings: &FillSettings) -> Result<Shared, PlanError> {
    let rooms = is_paced(settings).then(|| Rooms::new(layer.regions, settings));
    Ok(Shared {
        sections: taken_apart(layer, settings)?,
        rooms: rooms.transpose().map_err(outline(layer))?,
    })
}

/// The beads of each region, before gaps are closed.
fn draw(
    sections: &[Section],
    layer: FillLayer<'_>,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Result<Drawn, PlanError> {
    let drawn = sections.par_iter().map(|section| {
        let pieces = section.pieces.iter();
        pieces
            .map(|piece| lay(piece, layer.number, settings, reporter))
            .collect()
    });
    drawn.collect::<Result<_, _>>().map_err(outline(layer))
}

/// The beads of each region with its gaps closed; tells of those that have none.
fn closed(
    drawn: Drawn,
    sections: &[Section],
    layer: FillLayer<'_>,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Result<Vec<Vec<Bead>>, PlanError> {
    let regions = drawn.into_par_iter().zip(sections);
    let filled: Vec<Vec<Bead>> = regions
        .map(|(mut beads, section)| {
            for (beads, piece) in beads.iter_mut().zip(&section.pieces) {
                gaps::close(&piece.gaps, beads, settings)?;
            }
            Ok(beads.concat())
        })
        .collect::<Result<_, _>>()
        .map_err(outline(layer))?;
    for (number, (region, beads)) in layer.regions.iter().zip(&filled).enumerate() {
        if beads.is_empty() {
            let place = region.outer.first();
            let place = layer.plane.from_local(place.copied().unwrap_or_default());
            reporter.warn_at(
                "region-without-bead",
                format!(
                    "layer {}: region {number} of {:.1} mm² is too small for a bead {:.2} mm wide",
                    layer.number,
                    region.area(),
                    settings.width
                ),
                Place::at(place.to_array()),
                "choose a narrower bead, or thicken the part there",
            );
        }
    }
    Ok(filled)
}

/// A layer's plan from its beads.
fn finish(
    drawn: Drawn,
    shared: &Shared,
    layer: FillLayer<'_>,
    (settings, ids): (&FillSettings, PassIds),
    reporter: &Reporter,
) -> Result<LayerPlan, PlanError> {
    let Shared { sections, rooms } = shared;
    let filled = closed(drawn, sections, layer, settings, reporter)?;
    let mut coverage: Vec<Coverage> = layer
        .regions
        .par_iter()
        .zip(sections)
        .zip(&filled)
        .enumerate()
        .map(|(i, ((region, section), beads))| {
            let lines: Vec<_> = beads.iter().map(|b| b.points.clone()).collect();
            coverage(
                i as u32,
                region,
                &section.ground,
                &lines,
                (layer.plane, settings),
            )
        })
        .collect::<Result<_, _>>()
        .map_err(outline(layer))?;
    let path = written(filled, layer, settings, ids)?;
    let mut path = pace::adapted(path, rooms.as_ref(), layer.plane, settings, reporter);
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

/// The beads as passes, region after region by the shortest ways between them.
fn written(
    mut filled: Vec<Vec<Bead>>,
    layer: FillLayer<'_>,
    settings: &FillSettings,
    ids: PassIds,
) -> Result<Layer, PlanError> {
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
    Ok(path)
}

/// Plans all layers, in parallel, with the same result on any number of threads.
///
/// Layers of the same sections are taken apart once, and those of them whose beads start and run alike are planned once.
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
    observer.stage("fill", 2 * layers.len() as u64);
    let kinds = alike(layers.len(), |i, j| layers[i].regions == layers[j].regions);
    let each: Vec<Vec<(usize, Result<LayerPlan, PlanError>)>> = kinds
        .par_iter()
        .map(|kind| {
            let of_kind: Vec<FillLayer<'_>> = kind.iter().map(|&i| layers[i]).collect();
            match plan_alike(&of_kind, settings, ids, reporter, observer) {
                Ok(plans) => kind
                    .iter()
                    .copied()
                    .zip(plans.into_iter().map(Ok))
                    .collect(),
                Err(error) => vec![(kind[0], Err(error))],
            }
        })
        .collect();
    let mut plans: Vec<_> = each.into_iter().flatten().collect();
    plans.sort_by_key(|(layer, _)| *layer);
    plans.into_iter().map(|(_, plan)| plan).collect()
}

/// Plans layers of the same sections.
fn plan_alike(
    layers: &[FillLayer<'_>],
    settings: &FillSettings,
    ids: PassIds,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<LayerPlan>, PlanError> {
    observer.check()?;
    let shared = shared(layers[0], settings)?;
    observer.advance(layers.len() as u64);
    let drawn = layers.par_iter();
    let drawn: Vec<Drawn> = drawn
        .map(|&layer| draw(&shared.sections, layer, settings, reporter))
        .collect::<Vec<_>>()
        .into_iter()
        .collect::<Result<_, _>>()?;
    let kinds = alike(layers.len(), |i, j| drawn[i] == drawn[j]);
    let plans: Vec<Result<LayerPlan, PlanError>> = kinds
        .par_iter()
        .map(|kind| {
            observer.check()?;
            let first = kind[0];
            let plan = finish(
                drawn[first].clone(),
                &shared,
                layers[first],
                (settings, ids),
                reporter,
            );
            observer.advance(kind.len() as u64);
            plan
        })
        .collect();
    let mut each = Vec::with_capacity(layers.len());
    for (kind, plan) in kinds.iter().zip(plans) {
        let plan = plan?;
        for &layer in kind {
            each.push((layer, on_layer(&plan, layers[kind[0]], layers[layer], ids)?));
        }
    }
    each.sort_by_key(|(layer, _)| *layer);
    Ok(each.into_iter().map(|(_, plan)| plan).collect())
}

/// The plan of a layer as that of another, whose beads start and run alike.
fn on_layer(
    plan: &LayerPlan,
    of: FillLayer<'_>,
    layer: FillLayer<'_>,
    ids: PassIds,
) -> Result<LayerPlan, PlanError> {
    let mut plan = plan.clone();
    if of.number == layer.number {
        return Ok(plan);
    }
    let lifted = |p| layer.plane.from_local(of.plane.to_local(p).truncate());
    plan.path.place(lifted);
    for gap in plan.coverage.iter_mut().flat_map(|c| &mut c.gaps) {
        gap.place = lifted(gap.place);
    }
    let names = (0..plan.path.len()).map(|index| ids.id(layer.number, index));
    let names: Vec<_> = names.collect::<Result<_, _>>()?;
    plan.path.rename(layer.number, &names);
    Ok(plan)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fill::settings::{ContourOrder, LineAngle, Spacing, Strategy};
    use meltpath_geometry::Region;

    /// What is left out of a plan changes none of its passes.
    #[test]
    fn passes_alone_are_those_of_the_plan() {
        let ring = |corners: [[f64; 2]; 4]| corners.map(DVec2::from_array).to_vec();
        let regions = [Region {
            outer: ring([[0.0, 0.0], [8.0, 0.5], [7.0, 5.0], [1.0, 4.0]]),
            holes: vec![ring([[3.0, 2.0], [3.0, 3.0], [4.0, 3.0], [4.0, 2.0]])],
        }];
        let plane = Plane::horizontal(0.0);
        let layer = FillLayer {
            number: 3,
            plane: &plane,
            regions: &regions,
        };
        let angle = LineAngle::Turning {
            first: 0.3,
            step: 0.0,
        };
        let order = ContourOrder::OutsideIn;
        for strategy in [Strategy::Zigzag { angle }, Strategy::Contour { order }] {
            let settings = FillSettings {
                strategy,
                spacing: Spacing::Exact,
                ..FillSettings::new(0.2, 0.2)
            };
            let (ids, reporter) = (PassIds { part: 0 }, Reporter::new());
            let whole = plan_layer(layer, &settings, ids, &reporter).unwrap().path;
            let alone = passes_alone(layer, &settings, ids, &reporter).unwrap();
            let points = |layer: &Layer| -> Vec<_> {
                layer.passes().map(|pass| pass.points.to_vec()).collect()
            };
            assert!(whole.len() > 1 && points(&whole) == points(&alone));
        }
    }
}
