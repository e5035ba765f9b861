//! Layers that follow a body, and parts that grow out of it one after the other: each out of the body and of what the layers of those before it
//! fill.

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::Mesh;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::distance::Union;
use meltpath_geometry::math::DVec3;
use meltpath_planning::Paces;
use meltpath_planning::onto::{Onto, OntoBead, OntoLayer, OntoPlan, OntoSettings, ToTop, touches};
use meltpath_planning::surface::{SurfacePass, paced_layers};
use meltpath_robot::cell::Arrangement;
use meltpath_toolpath::Role;

use super::pieces::{OntoMeshes, OntoPart, Piece, Pieces};
use super::plan::{Ground, SurfacePlan, SurfacePlanError, toolpath, torch};
use super::thickness::{Thick, Thickness, known_speeds, thickness_paces};
use super::{Asked, Shape};
use crate::waam::plan::ROUNDED_OFF;
use crate::waam::plan::heights::{grown, over_faces};
use crate::waam::settings::Settings;

/// The layers of all pieces.
#[derive(Default)]
struct Laid {
    beads: Vec<OntoBead>,
    layers: Vec<OntoLayer>,
    /// Of each layer its height, mm.
    heights: Vec<f64>,
    /// Of each layer the least and the greatest thickness that can be laid, mm.
    able: Vec<[f64; 2]>,
}

/// Plans layers that follow a body, and those of further parts on them.
///
/// # Errors
/// [`SurfacePlanError`], of several parts with the name of the one.
pub(crate) fn plan_layers(
    meshes: OntoMeshes,
    asked: &Asked,
    settings: &Settings,
    told: (&Reporter, &dyn Observer),
) -> Result<SurfacePlan, SurfacePlanError> {
    let mut pieces = Pieces {
        body: meshes.body,
        pieces: Vec::with_capacity(meshes.parts.len()),
    };
    let mut laid = Laid::default();
    let count = meshes.parts.len();
    for part in meshes.parts {
        let name = part.name.clone();
        let piece = plan_piece(part, &pieces, &mut laid, (asked, settings, count), told);
        pieces.pieces.push(piece.map_err(|source| match count {
            1 => source,
            _ => SurfacePlanError::Piece {
                name,
                source: Box::new(source),
            },
        })?);
    }
    let torch = torch(asked, DVec3::Z, settings);
    let how: Vec<(Role, Vec<Option<f64>>)> = laid
        .beads
        .iter()
        .map(|b| (b.role, b.speeds.clone()))
        .collect();
    let passes: Vec<SurfacePass> = laid.beads.into_iter().map(|b| b.pass).collect();
    let thickness = goes_to_top(asked).then(|| {
        let paces = paces_to_top(settings);
        Thickness::new(
            &passes,
            (laid.able, paces),
            settings.bead.width.value,
            Thick::Filled,
        )
    });
    let paced = |i: usize| {
        how.get(i)
            .map_or((Role::Fill, &[][..]), |h| (h.0, &h.1[..]))
    };
    Ok(SurfacePlan {
        toolpath: toolpath(
            paced_layers(&passes, &torch, asked.spacing, paced),
            settings,
        ),
        passes,
        heights: laid.heights,
        thickness,
        ground: Ground::Body(Box::new(pieces)),
        torch,
        ends: Vec::new(),
        unreached: 0.0,
        cut: None,
        in_base: 0.0,
        openings: Vec::new(),
        layers: laid.layers,
    })
}

/// Plans the layers of one of `count` parts and lays them on those of the pieces before.
fn plan_piece(
    part: OntoPart,
    pieces: &Pieces,
    laid: &mut Laid,
    (asked, settings, count): (&Asked, &Settings, usize),
    told: (&Reporter, &dyn Observer),
) -> Result<Piece, SurfacePlanError> {
    let before = laid.layers.len() as u32;
    let standing = || pieces.before(pieces.pieces.len());
    let touched = standing().filter(|(_, mesh)| touches(&part.mesh, mesh, asked.spacing));
    let mut on: Vec<usize> = touched.map(|(i, _)| i).collect();
    if on.is_empty() {
        // which of them is the nearest is told
        on = standing().map(|(i, _)| i).collect();
    }
    let mut piece = Piece {
        part,
        on,
        built: None,
        first: before + 1,
        below: 0.0,
    };
    let left = settings.count.map(|all| all.saturating_sub(before));
    if left == Some(0) {
        return Ok(piece);
    }
    let (part, under) = (&piece.part, pieces.under(&piece));
    let least = 0.5 * asked.spacing;
    let out = Union::new(under.iter().copied());
    above_table(
        lowest(&part.mesh, &out, (least, settings.allowance)),
        (least, settings),
    )?;
    let to_top = goes_to_top(asked).then(|| to_top(part.top.as_ref(), settings));
    let onto = {
        let over = over_faces(reach(&part.mesh, &out), asked.spacing, 0.0, settings);
        let how = OntoSettings {
            fill: &settings.fill,
            side: settings.allowance,
            over: over.value,
            inside: ROUNDED_OFF * settings.bead.width.value,
            chord_error: settings.chord_error,
            count: left,
            top: to_top,
        };
        Onto::new(&part.mesh, &under, asked.spacing, how)?
    };
    let (found, mut heights) = as_beads_grow(&onto, piece.first, (asked, settings), told)?;
    let points = found.beads.iter().flat_map(|b| &b.pass.points);
    above_table(points.map(|p| p.position).collect(), (least, settings))?;
    let built = (pieces.pieces.len() + 1 < count).then(|| onto.built(&found));
    let first = found.beads.iter().map(|b| &b.pass);
    let first = first.filter(|pass| pass.number == piece.first).cloned();
    let below = pieces.below(&piece, &first.collect::<Vec<_>>());
    (piece.built, piece.below) = (built.transpose()?, below);
    let last = heights.last().copied().unwrap_or(0.0);
    heights.resize(found.layers.len(), last);
    if let Some(to) = to_top {
        laid.able
            .extend(heights.iter().map(|grown| to.able(*grown)));
        let tops = found.layers.iter().map(|l| l.top);
        let below = std::iter::once(0.0).chain(tops.clone());
        heights = tops.zip(below).map(|(top, bottom)| top - bottom).collect();
    }
    laid.heights.extend(heights);
    laid.beads.extend(found.beads);
    laid.layers.extend(found.layers);
    Ok(piece)
}

/// Plans the layers of a part from layer `first` on at the heights to which their beads grow, where no height is written, with these heights.
fn as_beads_grow(
    onto: &Onto<'_>,
    first: u32,
    (asked, settings): (&Asked, &Settings),
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<(OntoPlan, Vec<f64>), SurfacePlanError> {
    let plan = |heights: &[f64]| onto.plan((first, heights), reporter, observer);
    let to_top = goes_to_top(asked);
    // up to a top a height that is written says how many layers, not what beads grow to
    let begin = if to_top {
        settings.bead.area.value / settings.stepover.value
    } else {
        asked.spacing
    };
    let mut heights = vec![begin];
    let mut found = plan(&heights)?;
    // a thickness is kept by speeds, and those follow from what beads grow to
    if asked.grows || to_top {
        for _ in 0..GROWN {
            let grown = growth(&found, settings)?;
            if grown == heights {
                break;
            }
            heights = grown;
            found = plan(&heights)?;
        }
    }
    Ok((found, heights))
}

/// Whether layers go to the top of each part.
fn goes_to_top(asked: &Asked) -> bool {
    matches!(&asked.shape, Shape::Onto(onto) if onto.top.is_some())
}

/// How far a part reaches out of what it grows out of, mm.
fn reach(part: &Mesh, under: &Union) -> f64 {
    let far = |p: &DVec3| under.foot(*p).map_or(0.0, |f| f.distance);
    part.vertices.iter().map(far).fold(0.0, f64::max)
}

/// Corners of what is laid, with their allowance downwards: what reaches out of the body by less than `least` mm is not laid, and the
/// allowance lies along the body.
fn lowest(part: &Mesh, under: &Union, (least, allowance): (f64, f64)) -> Vec<DVec3> {
    let lowered = |p: &DVec3| {
        let out = under.foot(*p).filter(|f| f.distance > least)?.outward;
        // on a level face it lies level; there the rest is rounding
        let down = (-DVec3::Z).reject_from_normalized(out);
        let share = if down.length() > 1e-3 { allowance } else { 0.0 };
        Some(*p + share * down.normalize_or_zero())
    };
    part.vertices.iter().filter_map(lowered).collect()
}

/// Whether places that metal is laid at lie above what the body stands on, but for `least` mm.
///
/// # Errors
/// [`SurfacePlanError::BelowTable`] with the lowest.
fn above_table(
    places: Vec<DVec3>,
    (least, settings): (f64, &Settings),
) -> Result<(), SurfacePlanError> {
    let heights = places.into_iter();
    let heights = heights.filter_map(|at| Some((over_table(at, settings)?, at)));
    match heights.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((height, at)) if height < -least => {
            Err(SurfacePlanError::BelowTable { depth: -height, at })
        }
        _ => Ok(()),
    }
}

/// How high a place of the build lies over the table, mm: without a robot the body stands on it, on z = 0. Nothing beside the table, where
/// the robot's file does not say how large it is, or where the robot holds the part.
fn over_table(at: DVec3, settings: &Settings) -> Option<f64> {
    let Some(cell) = &settings.robot else {
        return Some(at.z);
    };
    let table = cell.shapes.as_ref()?.table?;
    let at = cell.carrier_from_part.point(at);
    let within = 2.0 * at.x.abs() <= table.size[0] && 2.0 * at.y.abs() <= table.size[1];
    (cell.arrangement == Arrangement::TorchOnRobot && within).then_some(at.z)
}

/// Layers from the body to the top, at speeds at which beads keep their shape and of which the process map knows.
fn to_top<'a>(sheet: Option<&'a Mesh>, settings: &Settings) -> ToTop<'a> {
    ToTop {
        sheet,
        paces: paces_to_top(settings),
        known: known_speeds(settings),
    }
}

fn paces_to_top(settings: &Settings) -> Paces {
    thickness_paces(settings.bead.travel_speed, known_speeds(settings))
}

/// How often layers are planned anew at the heights to which the last plan's beads would grow: the first moves them by some tenths, the
/// second by some hundredths.
const GROWN: u32 = 2;

/// The height to which the beads of each layer grow, mm.
fn growth(plan: &OntoPlan, settings: &Settings) -> Result<Vec<f64>, PlanarError> {
    let mut heights: Vec<f64> = Vec::with_capacity(plan.layers.len());
    for layer in &plan.layers {
        let grown = grown(&layer.path, settings)?;
        // a layer without a bead is planned as the one below
        heights.extend(grown.or(heights.last().copied()));
    }
    Ok(heights)
}
