//! A region taken apart for its strategy: all that takes long and depends neither on where beads start nor on which way they run, so that
//! layers of the same sections share it.

use meltpath_geometry::Region;
use meltpath_geometry::boolean::{PlanarError, union};
use meltpath_geometry::cover::Ground;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::medial::MedialError;
use meltpath_geometry::offset::inset;

use crate::fill::gaps::Places;
use crate::fill::lined::Lined;
use crate::fill::lines::Rim;
use crate::fill::outline::Room;
use crate::fill::rings::{Depth, Nest, nest, spacing};
use crate::fill::settings::{
    ContourOrder, FillSettings, LineOrder, Spacing, Strategy, end_distance,
};
use crate::fill::thin::split;

/// A piece of a region, oriented, without repeated points, apart where the region touches itself.
pub(crate) struct Piece {
    /// Where its beads leave gaps.
    pub(crate) gaps: Places,
    /// What takes two beads or more side by side.
    pub(crate) bodies: Vec<Body>,
    /// Centre lines of the sections that take one.
    pub(crate) lines: Vec<Vec<DVec2>>,
    /// Why the centre lines are missing, where they are.
    pub(crate) trouble: Option<MedialError>,
}

/// A body with the settings that fill it.
pub(crate) struct Body {
    /// Area, mm².
    pub(crate) area: f64,
    pub(crate) settings: FillSettings,
    pub(crate) inside: Inside,
}

/// What fills a body.
pub(crate) enum Inside {
    /// Parallel lines alone.
    Lines(Box<Lines>),
    /// Contours alone.
    Contours(Contours),
    /// Parallel lines inside contours.
    Rimmed(Rimmed),
}

/// Parallel lines, and what may take their place.
pub(crate) struct Lines {
    pub(crate) lined: Lined,
    /// Where they leave gaps.
    pub(crate) gaps: Places,
    /// What they cover.
    pub(crate) ground: Ground,
    /// The same inside a contour, where distances may change for it.
    pub(crate) inside_rim: Option<Rimmed>,
}

/// Contours without a start yet.
pub(crate) struct Contours {
    pub(crate) nest: Nest,
    pub(crate) order: ContourOrder,
    /// Where the way from one contour to the next may lead with the source on.
    pub(crate) links: Room,
}

/// Contours, and what parallel lines fill inside them.
pub(crate) struct Rimmed {
    pub(crate) contours: Contours,
    /// What parallel lines fill inside the contours, and the centre lines of sections too narrow for them.
    pub(crate) rest: Vec<(Lined, Vec<Vec<DVec2>>)>,
}

/// The contours round parallel lines.
pub(crate) struct Around {
    pub(crate) contours: u32,
    /// From the last contour to the lines' ends, mm.
    pub(crate) inside: f64,
    pub(crate) order: ContourOrder,
    /// Where the way from one contour to the next may lead with the source on.
    pub(crate) links: Room,
}

/// Takes a region apart.
pub(crate) fn apart(region: &Region, settings: &FillSettings) -> Result<Vec<Piece>, PlanarError> {
    let pieces = union(std::slice::from_ref(region))?.into_iter();
    pieces
        .map(|whole| {
            let parts = split(&whole, 0.5 * settings.narrowest * settings.width, settings)?;
            let bodies = parts.bodies.into_iter();
            Ok(Piece {
                bodies: bodies
                    .map(|body| body_of(body, *settings))
                    .collect::<Result<_, _>>()?,
                gaps: Places::new(&whole, settings)?,
                lines: parts.lines,
                trouble: parts.trouble,
            })
        })
        .collect()
}

fn body_of(whole: Region, settings: FillSettings) -> Result<Body, PlanarError> {
    let (settings, inside) = match settings.strategy {
        Strategy::Raster { .. } | Strategy::Zigzag { .. } => {
            (settings, Inside::Lines(Box::new(lines(&whole, &settings)?)))
        }
        Strategy::Contour { order } | Strategy::Spiral { order } => {
            let settings = FillSettings {
                stepover: spacing(&whole, &settings),
                ..settings
            };
            let nest = nest(&whole, Depth::Full, &settings)?;
            let links = ways(&whole, &settings)?;
            (settings, Inside::Contours(Contours { nest, order, links }))
        }
        Strategy::Hybrid {
            contours,
            order,
            angle,
        } => {
            let one = std::slice::from_ref(&whole);
            if contours > 0
                && inset(one, widest_band(contours, &settings), settings.join())?.is_empty()
            {
                // a zigzag between contours this near would turn at every step: contours fill the band better
                let strategy = Strategy::Contour { order };
                return body_of(
                    whole,
                    FillSettings {
                        strategy,
                        ..settings
                    },
                );
            }
            let zigzag = FillSettings {
                strategy: Strategy::Zigzag { angle },
                ..settings
            };
            let around = Around {
                contours,
                inside: settings.reversal_distance(),
                order,
                links: ways(&whole, &settings)?,
            };
            (zigzag, Inside::Rimmed(rimmed(&whole, around, &zigzag)?))
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
                ..settings
            };
            let around = Around {
                contours,
                inside: end_distance(settings.stepover),
                order: ContourOrder::OutsideIn,
                links: Room::new(&[]),
            };
            (lines, Inside::Rimmed(rimmed(&whole, around, &lines)?))
        }
    };
    Ok(Body {
        area: whole.area(),
        settings,
        inside,
    })
}

/// Parallel lines over a body, with a contour round them where that may be better.
fn lines(body: &Region, settings: &FillSettings) -> Result<Lines, PlanarError> {
    let whole = std::slice::from_ref(body);
    // distances that stay as written keep their lines, whatever these leave bare
    let may_change = settings.spacing == Spacing::Fill;
    let around = || {
        Ok(Around {
            contours: 1,
            inside: match settings.strategy {
                Strategy::Zigzag { .. } => settings.reversal_distance(),
                _ => end_distance(settings.stepover),
            },
            order: ContourOrder::OutsideIn,
            links: ways(body, settings)?,
        })
    };
    Ok(Lines {
        lined: Lined::new(whole, Rim::Boundary, settings)?,
        gaps: Places::new(body, settings)?,
        ground: Ground::new(whole.to_vec(), settings.metal())?,
        inside_rim: may_change
            .then(|| rimmed(body, around()?, settings))
            .transpose()?,
    })
}

/// Where ways between contours of a body may lead with the source on.
pub(crate) fn ways(body: &Region, settings: &FillSettings) -> Result<Room, PlanarError> {
    let inside = inset(
        std::slice::from_ref(body),
        0.48 * settings.width,
        settings.join(),
    )?;
    Ok(Room::new(&inside))
}

/// Half the width up to which a band is filled with contours alone, mm: inside the contours there must be room for zigzag
/// lines of three stepovers, else their reversals pile up more metal than the lines lay down.
fn widest_band(contours: u32, settings: &FillSettings) -> f64 {
    0.5 * settings.width + (f64::from(contours) + 1.5) * settings.stepover
}

/// Contours along the boundary, if any, and what is left inside them.
pub(crate) fn rimmed(
    body: &Region,
    around: Around,
    settings: &FillSettings,
) -> Result<Rimmed, PlanarError> {
    let Around {
        contours: count,
        inside,
        order,
        links,
    } = around;
    if count == 0 {
        let lined = Lined::new(std::slice::from_ref(body), Rim::Boundary, settings)?;
        let rest = vec![(lined, Vec::new())];
        let nest = Nest::default();
        return Ok(Rimmed {
            contours: Contours { nest, order, links },
            rest,
        });
    }
    let nest = nest(body, Depth::Levels { count, inside }, settings)?;
    let narrowest = 0.5 * settings.width - 0.25 * settings.stepover;
    let rest = nest.rest.iter();
    Ok(Rimmed {
        rest: rest
            .map(|region| {
                let parts = split(region, narrowest, settings)?;
                let lined = Lined::new(&parts.bodies, Rim::Contour(inside), settings)?;
                Ok((lined, parts.lines))
            })
            .collect::<Result<_, _>>()?,
        contours: Contours { nest, order, links },
    })
}
