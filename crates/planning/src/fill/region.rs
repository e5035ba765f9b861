//! The beads of one region in order: thin sections apart, the body by the strategy.

use meltpath_base::Reporter;
use meltpath_geometry::Region;
use meltpath_geometry::boolean::{PlanarError, union};
use meltpath_geometry::cover::bare;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::inset;
use meltpath_toolpath::Role;

use crate::fill::bead::Bead;
use crate::fill::contour::{contour_beads, start_share, started};
use crate::fill::direction::angle;
use crate::fill::gaps;
use crate::fill::layer::FillLayer;
use crate::fill::lines::Rim;
use crate::fill::outline::{Room, length};
use crate::fill::raster::raster;
use crate::fill::rings::{Depth, nest, spacing};
use crate::fill::settings::{
    ContourOrder, FillSettings, LayerDirection, LineOrder, Spacing, StartPoints, Strategy,
    end_distance,
};
use crate::fill::spiral::spirals;
use crate::fill::thin::split;
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

/// Half the width up to which a band is filled with contours alone, mm: inside the contours there must be room for zigzag
/// lines of three stepovers, else their reversals pile up more metal than the lines lay down.
fn widest_band(contours: u32, settings: &FillSettings) -> f64 {
    0.5 * settings.width + (f64::from(contours) + 1.5) * settings.stepover
}

/// The beads of one region in order.
pub(crate) fn fill(
    region: &Region,
    layer: FillLayer<'_>,
    settings: &FillSettings,
    reporter: &Reporter,
) -> Result<Vec<Bead>, PlanarError> {
    let mut beads: Vec<Bead> = Vec::new();
    // the outline as the grid sees it: oriented, without repeated points, apart where it touches itself
    let long = |b: &Bead| {
        b.points.len() > 1
            && length(&b.points) + 1e-9 >= settings.shortest_bead.min(2.0 * settings.stepover)
    };
    for clean in union(std::slice::from_ref(region))? {
        let mut here: Vec<Bead> = Vec::new();
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
            fill_body(body, layer, settings, reporter, &mut here)?;
        }
        here.extend(middles(parts.lines, layer.number, settings));
        here.retain(long);
        gaps::close(&clean, &mut here, settings)?;
        beads.extend(here);
    }
    Ok(beads)
}

fn fill_body(
    body: &Region,
    layer: FillLayer<'_>,
    settings: &FillSettings,
    reporter: &Reporter,
    beads: &mut Vec<Bead>,
) -> Result<(), PlanarError> {
    let whole = std::slice::from_ref(body);
    let links = |inside: &[Region]| {
        inset(inside, 0.48 * settings.width, settings.join()).map(|room| Room::new(&room))
    };
    match settings.strategy {
        Strategy::Raster { .. } | Strategy::Zigzag { .. } => {
            beads.extend(parallel_lines(body, layer, settings)?);
        }
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
            let contours = beads_of(Role::Contour, lines, &settings);
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
            let zigzag = FillSettings {
                strategy: Strategy::Zigzag { angle },
                ..*settings
            };
            if contours > 0
                && inset(whole, widest_band(contours, settings), settings.join())?.is_empty()
            {
                // a zigzag between contours this near would turn at every step: contours fill the band better
                let settings = FillSettings {
                    strategy: Strategy::Contour { order },
                    ..*settings
                };
                return fill_body(body, layer, &settings, reporter, beads);
            }
            let around = Around {
                contours,
                inside: settings.reversal_distance(),
                order,
                links: &links(whole)?,
            };
            rimmed_lines(body, &around, layer, &zigzag, beads)?;
        }
        Strategy::Rimmed {
            contours,
            angle,
            direction,
        } => {
            let lines = FillSettings {
                strategy: Strategy::Raster {
                    angle,
                    order: LineOrder::Across,
                    direction,
                },
                ..*settings
            };
            let around = Around {
                contours,
                inside: end_distance(settings.stepover),
                order: ContourOrder::OutsideIn,
                links: &Room::new(&[]),
            };
            rimmed_lines(body, &around, layer, &lines, beads)?;
        }
    }
    Ok(())
}

/// Parallel lines over a body; with a contour round them where that covers clearly more.
fn parallel_lines(
    body: &Region,
    layer: FillLayer<'_>,
    settings: &FillSettings,
) -> Result<Vec<Bead>, PlanarError> {
    let whole = std::slice::from_ref(body);
    let mut lines = Vec::new();
    straight(whole, Rim::Boundary, layer, settings, &mut lines)?;
    // distances that stay as written keep their lines, whatever these leave bare
    let may_change = settings.spacing == Spacing::Fill;
    if may_change && lack(whole, &lines, settings)? > MOST_BARE * body.area() {
        let inside = match settings.strategy {
            Strategy::Zigzag { .. } => settings.reversal_distance(),
            _ => end_distance(settings.stepover),
        };
        let mut rimmed = Vec::new();
        let around = Around {
            contours: 1,
            inside,
            order: ContourOrder::OutsideIn,
            links: &Room::new(&inset(whole, 0.48 * settings.width, settings.join())?),
        };
        rimmed_lines(body, &around, layer, settings, &mut rimmed)?;
        // each as it will be when its gaps are closed
        let mut closed = (lines.clone(), rimmed.clone());
        gaps::close(body, &mut closed.0, settings)?;
        gaps::close(body, &mut closed.1, settings)?;
        if lack(whole, &closed.1, settings)? < 0.5 * lack(whole, &closed.0, settings)? {
            lines = rimmed;
        }
    }
    Ok(lines)
}

/// The contours round parallel lines.
struct Around<'a> {
    contours: u32,
    /// From the last contour to the lines' ends, mm.
    inside: f64,
    order: ContourOrder,
    /// Where the way from one contour to the next may lead with the source on.
    links: &'a Room,
}

/// Contours along the boundary, if any, and inside them, from `inside` of the last on, the parallel lines of the strategy.
fn rimmed_lines(
    body: &Region,
    around: &Around<'_>,
    layer: FillLayer<'_>,
    settings: &FillSettings,
    beads: &mut Vec<Bead>,
) -> Result<(), PlanarError> {
    let whole = std::slice::from_ref(body);
    let &Around {
        contours,
        inside,
        order,
        links,
    } = around;
    if contours == 0 {
        return straight(whole, Rim::Boundary, layer, settings, beads);
    }
    let depth = Depth::Levels {
        count: contours,
        inside,
    };
    let nest = nest(body, depth, settings)?;
    let lines = contour_beads(&nest.contours, links, order, layer.number, settings);
    let mut inner = Vec::new();
    let narrowest = 0.5 * settings.width - 0.25 * settings.stepover;
    for region in &nest.rest {
        let parts = split(region, narrowest, settings)?;
        straight(
            &parts.bodies,
            Rim::Contour(inside),
            layer,
            settings,
            &mut inner,
        )?;
        inner.extend(middles(parts.lines, layer.number, settings));
    }
    inner.extend(middles(nest.lines, layer.number, settings));
    let outer = beads_of(Role::Contour, lines, settings);
    if order == ContourOrder::OutsideIn {
        beads.extend(outer.chain(inner));
    } else {
        beads.extend(inner.into_iter().chain(outer));
    }
    Ok(())
}

/// Share of a body that parallel lines may leave bare before a contour goes round it: ends of lines on a slanting or
/// round rim leave a notch each, layer over layer in the same places.
const MOST_BARE: f64 = 0.01;

/// Area of the bodies under no bead, mm².
fn lack(bodies: &[Region], beads: &[Bead], settings: &FillSettings) -> Result<f64, PlanarError> {
    let lines: Vec<_> = beads.iter().map(|b| b.points.clone()).collect();
    let places = bare(bodies, &lines, settings.metal())?;
    Ok(places.iter().map(Region::area).sum())
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
            // a centre line between facets on either side wavers by as much as they do
            tolerance: settings.facet(),
        }
    })
}

/// The parallel lines of a raster or a zigzag.
fn straight(
    bodies: &[Region],
    rim: Rim,
    layer: FillLayer<'_>,
    settings: &FillSettings,
    beads: &mut Vec<Bead>,
) -> Result<(), PlanarError> {
    let centres = inset(bodies, 0.5 * settings.width, settings.join())?;
    let links = inset(bodies, 0.48 * settings.width, settings.join())?;
    for centre in centres.chunks(1) {
        let lines = match settings.strategy {
            Strategy::Raster {
                angle: wanted,
                order,
                direction,
            } => {
                let angle = angle(wanted, centre, layer.number, settings);
                raster(centre, angle, rim, order, direction, layer.number, settings)
            }
            Strategy::Zigzag { angle: wanted } | Strategy::Hybrid { angle: wanted, .. } => {
                let angle = angle(wanted, centre, layer.number, settings);
                let entry = entry(layer.number, settings);
                let mut lines = zigzag(centre, &links, angle, rim, entry, settings);
                if settings.layers == LayerDirection::Alternate && layer.number.is_multiple_of(2) {
                    lines.reverse();
                    for line in &mut lines {
                        line.reverse();
                    }
                }
                lines
            }
            Strategy::Contour { .. } | Strategy::Spiral { .. } | Strategy::Rimmed { .. } => {
                Vec::new()
            }
        };
        beads.extend(beads_of(Role::Fill, lines, settings));
    }
    Ok(())
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
