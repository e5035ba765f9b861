//! The passes of a wall on a surface, how the torch is held along them, and the toolpath they make.

use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::sheet::FrontEnd;
use meltpath_planning::onto::{OntoError, OntoLayer};
use meltpath_planning::surface::{
    Base, FieldError, MeshPasses, Opening, Parameter, Patch, SpiralError, SurfaceError,
    SurfacePass, SurfacePoint, SurfaceSettings, SurfaceStrategy, Torch, distribution, paced_layers,
    plan_mesh, plan_patch, without_narrow, wound,
};
use meltpath_robot::cell::Arrangement;
use meltpath_toolpath::{Layer, Role, Toolpath};

use super::directions::{DirectionsError, directions};
use super::pieces::Pieces;
use super::sunk::in_base;
use super::thickness::{Thick, Thickness, wall_pace};
use super::{Asked, BaseAsked, WallAsked};
use crate::job::waam::{SurfacePasses, SurfaceSpeeds, SurfaceStrategyChoice};
use crate::stages::sheet::{Rectangle, Sheet};
use crate::waam::plan::merge_short_moves;
use crate::waam::plan::profile::profile;
use crate::waam::settings::Settings;

/// Layers that are not flat: a wall along a surface, or filled layers on a body.
#[derive(Debug)]
pub struct SurfacePlan {
    /// The beads: one layer for each pass, with the torch's axis at every point, speed and wire feed in their profile.
    pub toolpath: Toolpath,
    /// Where each pass ends on the surface, in the order in which they are laid.
    pub passes: Vec<SurfacePass>,
    /// Heights of the layers from the first on, mm, in the mean where they are not the same everywhere; the last one repeats.
    pub heights: Vec<f64>,
    /// Of layers that go to the top of a part, and of walls whose speeds follow the distance, how thick they are where.
    pub thickness: Option<Thickness>,
    /// What it stands on.
    pub ground: Ground,
    /// How the torch is held.
    pub torch: Torch,
    /// Where fronts end: caps, rims, other fronts.
    pub ends: Vec<FrontEnd>,
    /// Area that no pass reaches, mm².
    pub unreached: f64,
    /// Passes that the job's count leaves out; nothing where it leaves out none.
    pub cut: Option<Cut>,
    /// The share of the surface's area that lies in its base.
    pub in_base: f64,
    /// Openings where the wall closes: there passes shorter than four pools are not laid.
    pub openings: Vec<Opening>,
    /// Layers on a body; none of a wall.
    pub layers: Vec<OntoLayer>,
}

impl SurfacePlan {
    /// The share of the beads that stand alone.
    pub fn single(&self) -> f64 {
        match self.ground {
            Ground::Base(_) => 1.0,
            Ground::Body(_) => 0.0,
        }
    }

    /// Of a layer its bottom and its top, mm from what everything stands on; of a part that grows out of another they count on from how high
    /// that was built in the same direction.
    pub(super) fn ends(&self, number: u32) -> [f64; 2] {
        let pieces = match &self.ground {
            Ground::Body(pieces) => &pieces.pieces[..],
            Ground::Base(_) => &[],
        };
        let piece = pieces.iter().rev().find(|p| p.first <= number);
        let (first, base) = piece.map_or((1, 0.0), |p| (p.first, p.below));
        let last = self.heights.last().copied().unwrap_or(0.0);
        let height = |n: u32| self.heights.get(n as usize - 1).copied().unwrap_or(last);
        let below = base + (first..number).map(height).sum::<f64>();
        [below, below + height(number.max(1))]
    }
}

/// A count of layers that is less than those of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cut {
    /// How many are laid.
    pub count: u32,
    /// How many the surface has.
    pub all: u32,
}

/// What layers stand on.
#[derive(Debug, Clone)]
pub enum Ground {
    /// A plane, a cylinder or a body of revolution under a wall.
    Base(Base),
    /// A body, with the parts that grow out of it.
    Body(Box<Pieces>),
}

/// Why a surface cannot be planned.
#[derive(Debug, thiserror::Error)]
pub enum SurfacePlanError {
    /// The passes.
    #[error(transparent)]
    Passes(#[from] SurfaceError),
    /// The file of the torch's directions.
    #[error(transparent)]
    Directions(#[from] DirectionsError),
    /// Its directions.
    #[error("{0} (surface.field)")]
    Field(#[from] FieldError),
    /// A bead that winds up the wall.
    #[error("{source}; {} surface.passes = \"each\", or name faces that make one (surface.faces)", below(.source))]
    Spiral {
        /// Why there is none.
        #[from]
        source: SpiralError,
    },
    /// Layers on a body.
    #[error(transparent)]
    Onto(#[from] OntoError),
    /// One of several parts that grow out of one another.
    #[error("{name}: {source}")]
    Piece {
        /// Its file.
        name: String,
        /// Why it cannot be planned.
        source: Box<SurfacePlanError>,
    },
    /// The area that beads share.
    #[error(transparent)]
    Growth(#[from] PlanarError),
    /// A strategy of one face, and there is none between lines of its parameters.
    #[error(
        "surface.strategy \"{}\" follows the parameters of one face that lies between lines of them, and the surface is none: name such a face (surface.faces; `meltpath inspect` lists them), or write \"distance\" or \"planes\"", .strategy.word()
    )]
    NoParameters {
        /// The strategy.
        strategy: SurfaceStrategyChoice,
    },
    /// No pass has room for its pool.
    #[error(
        "the surface is too narrow for the pool of its bead: it ends in passes shorter round than two pools, and all of them are shorter than {least:.1} mm, four pools; lay a smaller bead (waam.bead), or build the part as flat layers, without [surface]"
    )]
    Narrow {
        /// Four pools, mm.
        least: f64,
    },
    /// What is to be laid on a body lies below what it stands on.
    #[error(
        "layers would lie {depth:.1} mm below the table that the body stands on, lowest at ({:.1}, {:.1}, {:.1}) mm of the build: the part reaches out of the body there, or its allowance does; turn the body (build_direction) so that what grows looks up or to the side, cut off what of the part comes out at the underside, or name the robot and hold the body over its table (machine.place, machine.holders)", .at.x, .at.y, .at.z
    )]
    BelowTable {
        /// How far, mm.
        depth: f64,
        /// The lowest place, mm.
        at: DVec3,
    },
    /// No side of the face lies on the base.
    #[error("no side of the face lies on the base: the nearest one is {gap:.3} mm away at ({:.3}, {:.3}, {:.3}) mm of the build; move surface.base, or write strategy = \"distance\"", .at.x, .at.y, .at.z)]
    NoSide {
        /// Its greatest distance, mm.
        gap: f64,
        /// Where, mm.
        at: DVec3,
    },
}

/// What ends a spiral below the pass that it cannot go round, where some are.
fn below(why: &SpiralError) -> String {
    match why {
        SpiralError::Open { pass, .. } | SpiralError::Pieces { pass, .. } if *pass > 2 => {
            format!("end it below (layers.count = {}), write", pass - 1)
        }
        _ => "write".to_owned(),
    }
}

/// Plans the passes of a surface and the torch along them.
///
/// # Errors
/// [`SurfacePlanError`].
pub fn plan_wall(
    sheet: &Sheet,
    asked: &Asked,
    (wall, settings): (&WallAsked, &Settings),
) -> Result<SurfacePlan, SurfacePlanError> {
    let base = base(&wall.base, sheet);
    let how = |strategy| SurfaceSettings {
        strategy,
        spacing: asked.spacing,
        chord_error: settings.chord_error,
    };
    let on_mesh = |strategy| plan_mesh(&sheet.mesh, &base, &how(strategy));
    let exactly = |strategy| on_face(sheet, &base, wall.strategy, &how(strategy));
    let found = match wall.strategy {
        SurfaceStrategyChoice::Distance => on_mesh(SurfaceStrategy::Distance)?,
        SurfaceStrategyChoice::Planes => on_mesh(SurfaceStrategy::Planes {
            direction: DVec3::Z,
        })?,
        SurfaceStrategyChoice::ParameterDistance => exactly(SurfaceStrategy::Distance)?,
        SurfaceStrategyChoice::Parameter => exactly(SurfaceStrategy::Parameter)?,
    };
    let least = 4.0 * settings.pool.length();
    let (mut wide, mut openings) = without_narrow(found.passes, least, asked.spacing);
    let mut ends = found.ends;
    let all = wide.iter().map(|p| p.number).max().unwrap_or(0);
    let cut = settings.count.filter(|count| *count < all);
    let cut = cut.map(|count| Cut { count, all });
    if let Some(Cut { count, .. }) = cut {
        wide.retain(|p| p.number <= count);
        openings.retain(|o| o.pass <= count);
        ends.retain(|e| e.front <= count);
    }
    if wide.is_empty() {
        return Err(SurfacePlanError::Narrow { least });
    }
    let read = |file| directions(file, &sheet.build_from_file, settings.bead.width.value);
    let field = wall.field.as_deref().map(read).transpose()?;
    if let Some(field) = &field {
        wide = field.along(&wide)?;
    }
    let ((passes, speeds), thickness) = laid(&wide, asked, (wall, settings))?;
    let in_base = in_base(&sheet.mesh, &base);
    let begin = match base {
        Base::Plane { normal, .. } => normal,
        // around an axis a wall begins in every direction: none but the vertical is that of all
        Base::Cylinder { .. } | Base::Revolution { .. } => DVec3::Z,
    };
    let mut torch = torch(asked, begin, settings);
    torch.field = field;
    let paced = |i: usize| (Role::Contour, speeds.get(i).map_or(&[][..], Vec::as_slice));
    Ok(SurfacePlan {
        toolpath: toolpath(
            paced_layers(&passes, &torch, asked.spacing, paced),
            settings,
        ),
        heights: match &thickness {
            Some(_) => heights(&passes, asked.spacing),
            None => vec![asked.spacing],
        },
        passes,
        thickness,
        ground: Ground::Base(base),
        torch,
        ends,
        unreached: found.unreached,
        cut,
        in_base,
        openings,
        layers: Vec::new(),
    })
}

/// Passes, with the speeds of their moves, mm/s.
type Paced = (Vec<SurfacePass>, Vec<Vec<Option<f64>>>);

/// Passes in the order in which they are laid, the speeds of their moves, mm/s, and how thick they are where that follows.
fn laid(
    passes: &[SurfacePass],
    asked: &Asked,
    (wall, settings): (&WallAsked, &Settings),
) -> Result<(Paced, Option<Thickness>), SurfacePlanError> {
    let pace = wall_pace(wall.grows, settings);
    let paced = match (wall.passes, wall.speeds) {
        (SurfacePasses::Each, SurfaceSpeeds::Constant) => {
            return Ok(((ordered(passes), Vec::new()), None));
        }
        (SurfacePasses::Each, SurfaceSpeeds::Adapted) => {
            pace.wall(&ordered(passes), settings.chord_error)
        }
        (SurfacePasses::Spiral, _) => {
            let turns = wound(passes, &pace, asked.spacing)?;
            pace.as_laid(&turns, settings.chord_error)
        }
    };
    let able = (vec![pace.able()], pace.paces);
    let height = asked.spacing;
    let width = settings.bead.width.value;
    let thickness = Thickness::new(&paced.0, able, width, Thick::Wall { height });
    Ok((paced, Some(thickness)))
}

/// The mean distance of each pass from what it is laid on, mm; `spacing` of one that lies on nothing.
fn heights(passes: &[SurfacePass], spacing: f64) -> Vec<f64> {
    let groups = passes.chunk_by(|a, b| a.number == b.number);
    let mean = |group: &[SurfacePass]| {
        let all = distribution(group, |pass, i| pass.points[i].spacing());
        all.map_or(spacing, |d| d.mean)
    };
    groups.map(mean).collect()
}

/// The toolpath of beads.
pub(super) fn toolpath(layers: Vec<Layer>, settings: &Settings) -> Toolpath {
    let mut toolpath = Toolpath {
        profiles: vec![profile(settings)],
        layers,
        ..Toolpath::default()
    };
    merge_short_moves(&mut toolpath, settings);
    toolpath
}

/// The base in the build. A plane whose place is not written lies under the surface.
fn base(asked: &BaseAsked, sheet: &Sheet) -> Base {
    let place = &sheet.build_from_file;
    let direction = asked
        .direction
        .map_or(DVec3::Z, |d| place.transform_vector3(d).normalize());
    let written = asked.origin.map(|o| place.transform_point3(o));
    let on_axis = || written.unwrap_or(place.transform_point3(DVec3::ZERO));
    if let Some(profile) = &asked.profile {
        return Base::Revolution {
            origin: on_axis(),
            axis: direction,
            profile: profile.clone(),
        };
    }
    if let Some(radius) = asked.radius {
        return Base::Cylinder {
            origin: on_axis(),
            axis: direction,
            radius,
        };
    }
    let lowest = || {
        let heights = sheet.mesh.vertices.iter().map(|p| p.dot(direction));
        heights.fold(f64::INFINITY, f64::min) * direction
    };
    Base::Plane {
        origin: written.unwrap_or_else(lowest),
        normal: direction,
    }
}

/// The torch along what begins to grow in the direction `begin`.
pub(super) fn torch(asked: &Asked, begin: DVec3, settings: &Settings) -> Torch {
    let up = up(settings);
    Torch {
        rule: asked.torch,
        begin,
        up,
        greatest_tilt: asked.tilt.unwrap_or(std::f64::consts::PI),
        lead: asked.lead,
        even: settings.bead.width.value,
        field: None,
    }
}

/// The vertical in the part. A robot that holds the part turns it under the torch: the build's own direction stands in.
pub(super) fn up(settings: &Settings) -> DVec3 {
    match &settings.robot {
        Some(cell) if cell.arrangement == Arrangement::TorchOnRobot => {
            let world_from_part = cell.frames(&cell.at_rest()).part.orientation;
            world_from_part.inverse() * DVec3::Z
        }
        _ => DVec3::Z,
    }
}

/// Passes on the face itself.
fn on_face(
    sheet: &Sheet,
    base: &Base,
    strategy: SurfaceStrategyChoice,
    settings: &SurfaceSettings,
) -> Result<MeshPasses, SurfacePlanError> {
    let exact = sheet.exact.as_ref();
    let face = exact.ok_or(SurfacePlanError::NoParameters { strategy })?;
    let patch = standing(face, base, settings.chord_error)?;
    let mut passes = plan_patch(&patch, settings)?;
    let place = &face.build_from_surface;
    let turned = |v: DVec3| place.transform_vector3(v).normalize_or_zero();
    for point in passes.iter_mut().flat_map(|p| &mut p.points) {
        *point = SurfacePoint {
            position: place.transform_point3(point.position),
            normal: turned(point.normal),
            growth: turned(point.growth),
            from: point.from.map(|p| place.transform_point3(p)),
        };
    }
    Ok(MeshPasses {
        passes,
        ends: Vec::new(),
        unreached: 0.0,
    })
}

/// The face, growing from the side that lies on the base within `near` mm.
fn standing<'a>(
    face: &'a Rectangle,
    base: &Base,
    near: f64,
) -> Result<Patch<'a>, SurfacePlanError> {
    const PLACES: u32 = 64;
    let [u, v] = face.ranges;
    let mut best: Option<(f64, DVec3, Patch<'a>)> = None;
    for (growth, along, across) in [(Parameter::U, u, v), (Parameter::V, v, u)] {
        if face.closed[usize::from(growth == Parameter::V)] {
            continue;
        }
        for along in [along, [along[1], along[0]]] {
            let patch = Patch {
                surface: &face.surface,
                growth,
                along,
                across,
            };
            let place = |i: u32| {
                let t = across[0] + (across[1] - across[0]) * f64::from(i) / f64::from(PLACES);
                let p = face
                    .build_from_surface
                    .transform_point3(patch.point(along[0], t));
                (base.distance(p).abs(), p)
            };
            let places = (0..=PLACES).map(place);
            let Some((gap, at)) = places.max_by(|a, b| a.0.total_cmp(&b.0)) else {
                continue;
            };
            if best.as_ref().is_none_or(|b| gap < b.0) {
                best = Some((gap, at, patch));
            }
        }
    }
    match best {
        Some((gap, _, patch)) if gap <= near => Ok(patch),
        Some((gap, at, _)) => Err(SurfacePlanError::NoSide { gap, at }),
        // a face that closes both ways has no side
        None => Err(SurfacePlanError::NoSide {
            gap: f64::INFINITY,
            at: face.build_from_surface.translation,
        }),
    }
}

/// The share of a turn by which closed passes start farther from one to the next: start defects do not stack.
const SPREAD: f64 = 0.618_033_988_749_895;

/// The pieces of each pass in the order of the shortest ways between them, closed ones each beginning elsewhere.
fn ordered(passes: &[SurfacePass]) -> Vec<SurfacePass> {
    let mut done: Vec<SurfacePass> = Vec::with_capacity(passes.len());
    let mut here: Option<DVec3> = None;
    for group in passes.chunk_by(|a, b| a.number == b.number) {
        let mut left: Vec<SurfacePass> = group.to_vec();
        while !left.is_empty() {
            let far = |p: &SurfacePoint| here.map_or(0.0, |h| h.distance(p.position));
            // (distance, piece, turned round)
            let ends = left.iter().enumerate().flat_map(|(i, pass)| {
                let closed = pass.is_closed();
                let first = pass.points.first().map(|p| (far(p), i, false));
                let last = pass.points.last().filter(|_| !closed);
                first.into_iter().chain(last.map(|p| (far(p), i, true)))
            });
            let nearest = ends.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, i, turned)) = nearest else { break };
            let mut pass = left.remove(i);
            if pass.is_closed() {
                begin_elsewhere(&mut pass);
            } else if turned {
                pass.points.reverse();
            }
            here = pass.points.last().map(|p| p.position);
            done.push(pass);
        }
    }
    done
}

/// Turns a closed pass so that it begins at its own share of its points.
fn begin_elsewhere(pass: &mut SurfacePass) {
    pass.points.pop();
    let count = pass.points.len();
    let share = (f64::from(pass.number) * SPREAD).fract();
    pass.points
        .rotate_left((share * count as f64) as usize % count);
    pass.points.push(pass.points[0]);
}
