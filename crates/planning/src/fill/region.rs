//! The beads of a region taken apart, in order: bodies by the strategy, then thin sections.

use meltpath_base::Reporter;
use meltpath_geometry::Region;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::Role;

use crate::fill::bead::Bead;
use crate::fill::contour::{contour_beads, start_share, started};
use crate::fill::gaps;
use crate::fill::lined::Lined;
use crate::fill::outline::{Room, length};
use crate::fill::pieces::{Body, Contours, Inside, Lines, Piece, Rimmed};
use crate::fill::raster::raster;
use crate::fill::settings::{ContourOrder, FillSettings, LayerDirection, StartPoints, Strategy};
use crate::fill::spiral::spirals;
use crate::fill::zigzag::zigzag;

fn beads_of(
    role: Role,
    lines: Vec<Vec<DVec2>>,
    settings: &FillSettings,
) -> impl Iterator<Item = Bead> {
    let tolerance = settings.tolerance;
    lines.into_iter().map(move |points| Bead {
        points,
        role,
        tolerance,
    })
}

/// Whether a line stays where bead axes may lie.
fn stays_inside(room: &Room, line: &[DVec2], settings: &FillSettings) -> bool {
    line.windows(2)
        .all(|w| room.has_way(w[0], w[1], 0.25 * settings.width))
}

/// The beads of a piece in order, all but those that close its gaps.
pub(crate) fn lay(
    piece: &Piece,
    layer: u32,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Result<Vec<Bead>, PlanarError> {
    let long = |b: &Bead| {
        b.points.len() > 1
            && length(&b.points) + 1e-9 >= settings.shortest_bead.min(2.0 * settings.stepover)
    };
    let mut beads: Vec<Bead> = Vec::new();
    if let Some(trouble) = &piece.trouble {
        reporter.warn(
            "centre-line-missing",
            format!("layer {layer}: {trouble}; narrow sections get no bead"),
            "repair the part or simplify its outline",
        );
    }
    for body in &piece.bodies {
        match &body.inside {
            Inside::Lines(lines) => {
                beads.extend(parallel_lines(body, lines, layer)?);
            }
            Inside::Contours(contours) => {
                beads.extend(contours_alone(contours, layer, &body.settings, reporter));
            }
            Inside::Rimmed(rimmed) => {
                beads.extend(rimmed_lines(rimmed, layer, &body.settings));
            }
        }
    }
    beads.extend(middles(&piece.lines, layer, settings));
    beads.retain(long);
    Ok(beads)
}

fn contours_alone(
    contours: &Contours,
    layer: u32,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Vec<Bead> {
    let Contours { nest, order, links } = contours;
    let plain = || contour_beads(&nest.contours, links, *order, layer, settings);
    let lines = if matches!(settings.strategy, Strategy::Spiral { .. }) {
        let turns = spirals(&nest.contours, *order, layer, settings);
        // between contours that differ in shape a turn may leave the region: contours never do
        if turns.iter().all(|t| stays_inside(links, t, settings)) {
            turns
        } else {
            reporter.warn(
                "spiral-replaced",
                format!("layer {layer}: a spiral would leave the region; contours fill it"),
                "choose fill.strategy = \"contour\" for parts with holes or branches",
            );
            plain()
        }
    } else {
        plain()
    };
    let contours = beads_of(Role::Contour, lines, settings);
    let middles = middles(&nest.lines, layer, settings);
    match order {
        ContourOrder::OutsideIn => contours.chain(middles).collect(),
        ContourOrder::InsideOut => middles.chain(contours).collect(),
    }
}

/// Parallel lines over a body; with a contour round them where that covers clearly more.
fn parallel_lines(body: &Body, lines: &Lines, layer: u32) -> Result<Vec<Bead>, PlanarError> {
    let settings = &body.settings;
    let plain = straight(&lines.lined, layer, settings);
    let lack = |beads: &[Bead]| -> Result<f64, PlanarError> {
        let points: Vec<_> = beads.iter().map(|b| b.points.clone()).collect();
        let places = lines.ground.bare(&points)?;
        Ok(places.iter().map(Region::area).sum())
    };
    if let Some(inside_rim) = &lines.inside_rim
        && lack(&plain)? > MOST_BARE * body.area
    {
        let inside_rim = rimmed_lines(inside_rim, layer, settings);
        // each as it will be when its gaps are closed
        let mut closed = (plain.clone(), inside_rim.clone());
        gaps::close(&lines.gaps, &mut closed.0, settings)?;
        gaps::close(&lines.gaps, &mut closed.1, settings)?;
        if lack(&closed.1)? < 0.5 * lack(&closed.0)? {
            return Ok(inside_rim);
        }
    }
    Ok(plain)
}

/// Contours along the boundary, if any, and inside them the parallel lines of the strategy.
fn rimmed_lines(rimmed: &Rimmed, layer: u32, settings: &FillSettings) -> Vec<Bead> {
    let Contours { nest, order, links } = &rimmed.contours;
    let lines = contour_beads(&nest.contours, links, *order, layer, settings);
    let mut inner = Vec::new();
    for (lined, lines) in &rimmed.rest {
        inner.extend(straight(lined, layer, settings));
        inner.extend(middles(lines, layer, settings));
    }
    inner.extend(middles(&nest.lines, layer, settings));
    let outer = beads_of(Role::Contour, lines, settings);
    match order {
        ContourOrder::OutsideIn => outer.chain(inner).collect(),
        ContourOrder::InsideOut => inner.into_iter().chain(outer).collect(),
    }
}

/// Share of a body that parallel lines may leave bare before a contour goes round it: ends of lines on a slanting or
/// round rim leave a notch each, layer over layer in the same places.
const MOST_BARE: f64 = 0.01;

/// Beads on centre lines: closed ones start where contours do, and directions follow the layer.
fn middles(
    lines: &[Vec<DVec2>],
    layer: u32,
    settings: &FillSettings,
) -> impl Iterator<Item = Bead> {
    lines.iter().enumerate().map(move |(i, points)| {
        let mut points = points.clone();
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
            // a centre line between facets on either side wavers by as much as they do
            tolerance: settings.facet(),
        }
    })
}

/// The parallel lines of a raster or a zigzag.
fn straight(lined: &Lined, layer: u32, settings: &FillSettings) -> Vec<Bead> {
    let drawn = match settings.strategy {
        Strategy::Raster {
            angle,
            order,
            direction,
        } => lined.each(angle, layer, settings, |flat| {
            raster(flat, order, direction, layer, settings)
        }),
        Strategy::Zigzag { angle } | Strategy::Hybrid { angle, .. } => {
            let entry = entry(layer, settings);
            lined.each(angle, layer, settings, |flat| {
                let mut lines = zigzag(flat, entry, settings);
                if settings.layers == LayerDirection::Alternate && layer.is_multiple_of(2) {
                    lines.reverse();
                    for line in &mut lines {
                        line.reverse();
                    }
                }
                lines
            })
        }
        Strategy::Contour { .. } | Strategy::Spiral { .. } | Strategy::Rimmed { .. } => Vec::new(),
    };
    beads_of(Role::Fill, drawn.concat(), settings).collect()
}

/// The corner in which a layer's zigzag begins: bit 0 right instead of left, bit 1 top instead of bottom. From one layer
/// to the next of the same direction, turned or not, links change ends: the notches between them would stack.
fn entry(layer: u32, settings: &FillSettings) -> u32 {
    if settings.starts == StartPoints::Aligned {
        return 0;
    }
    let top = u32::from(start_share(settings.starts, layer, 0) >= 0.5);
    top << 1 | ((layer.saturating_sub(1) / 2) & 1)
}
