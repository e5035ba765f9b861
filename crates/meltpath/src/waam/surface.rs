//! Layers that are not flat: a wall one bead thick along a surface in space, or layers that follow a body. What a job asks, the plan,
//! its metal, its checks, and the run from part to program.

mod directions;
mod flatness;
pub(crate) mod ground;
pub(crate) mod grow;
pub(super) mod held;
mod judge;
pub(crate) mod layers;
mod metal;
pub(crate) mod onto;
pub mod pieces;
pub mod plan;
mod pores;
pub(super) mod run;
mod sunk;
pub(crate) mod thickness;
mod under;
pub(crate) mod wall;

use std::path::{Path, PathBuf};

use meltpath_base::quantity::Auto;
use meltpath_base::{Length, Origin, Provenance, Resolved};
use meltpath_deposition::process_map::Bead;
use meltpath_geometry::math::DVec3;
use meltpath_planning::surface::TorchRule;

use crate::job::WaamJob;
use crate::job::waam::{
    SurfacePasses, SurfaceSpeeds, SurfaceStrategyChoice, SurfaceTable, SurfaceTorch, TorchChoice,
};
use crate::waam::settings::bead::FREE_EDGE;

/// What a job asks of layers that are not flat.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// What is laid.
    pub shape: Shape,
    /// Distance between passes, mm; of layers on a body where planning begins.
    pub spacing: f64,
    /// Whether filled layers are as high as their beads grow.
    pub grows: bool,
    /// Where the torch points from.
    pub torch: TorchRule,
    /// Greatest lean against the vertical, rad.
    pub tilt: Option<f64>,
    /// Angle by which the wire points ahead, rad.
    pub lead: f64,
    /// Largest deviation of the distance between passes, share of it.
    pub spacing_limit: f64,
}

/// What is laid in layers that are not flat.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A wall one bead thick along a surface.
    Wall(WallAsked),
    /// Filled layers that follow a body.
    Onto(OntoAsked),
}

/// A wall along a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct WallAsked {
    /// Numbers of faces, from 1, each once; nothing for the whole file.
    pub faces: Option<Vec<u32>>,
    /// What the wall stands on, in the coordinates of the file.
    pub base: BaseAsked,
    /// How passes follow one another.
    pub strategy: SurfaceStrategyChoice,
    /// Whether they are beads of their own.
    pub passes: SurfacePasses,
    /// Travel speeds along them.
    pub speeds: SurfaceSpeeds,
    /// What a pass grows at the bead's own speed, mm.
    pub grows: f64,
    /// The file of the torch's directions.
    pub field: Option<PathBuf>,
}

/// Layers on a body.
#[derive(Debug, Clone, PartialEq)]
pub struct OntoAsked {
    /// The file of the body.
    pub body: PathBuf,
    /// The files of what grows out of body and part, one after the other.
    pub then: Vec<PathBuf>,
    /// Whether layers go to the top of the part, and what that is.
    pub top: Option<TopAsked>,
}

/// The top of a part that layers go to.
#[derive(Debug, Clone, PartialEq)]
pub enum TopAsked {
    /// What looks away from the body.
    Found,
    /// Numbers of faces, from 1.
    Faces(Vec<u32>),
}

impl OntoAsked {
    /// The faces that are named as the top.
    pub(super) fn faces(&self) -> Option<&[u32]> {
        match &self.top {
            Some(TopAsked::Faces(faces)) => Some(faces),
            Some(TopAsked::Found) | None => None,
        }
    }
}

/// What a wall stands on, as far as a job says it.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseAsked {
    /// A point of the plane or of the axis, mm.
    pub origin: Option<DVec3>,
    /// The plane's normal or the axis.
    pub direction: Option<DVec3>,
    /// Radius of a cylinder, mm.
    pub radius: Option<f64>,
    /// Profile of a body of revolution: along the axis, and the radius there, mm.
    pub profile: Option<Vec<[f64; 2]>>,
}

/// What the job's tables ask; nothing where the job has flat layers. `folder` is the job's, `stepover` that of its beads, mm.
pub(super) fn asked(
    job: &WaamJob,
    folder: &Path,
    (bead, stepover): (&Bead, f64),
    r: &mut Provenance,
) -> Option<Asked> {
    let (shape, torch, tilt, lead) = match (job.surface.as_ref(), job.onto.as_ref()) {
        (Some(table), _) => {
            let torch = match *table.torch {
                SurfaceTorch::Tangent => TorchRule::Tangent,
                SurfaceTorch::Half => TorchRule::Half,
                SurfaceTorch::Fixed => TorchRule::Fixed,
                SurfaceTorch::Field => TorchRule::Field,
            };
            let shape = Shape::Wall(wall_asked(table, (folder, bead), r));
            (shape, torch, *table.tilt, *table.lead)
        }
        (None, Some(table)) => {
            let torch = match *table.torch {
                TorchChoice::Tangent => TorchRule::Tangent,
                TorchChoice::Half => TorchRule::Half,
                TorchChoice::Fixed => TorchRule::Fixed,
            };
            let body = folder.join(&**table.body);
            let top = table.top.value.as_ref().map(|top| match top {
                Auto::Auto => TopAsked::Found,
                Auto::Value(faces) => TopAsked::Faces(faces.clone()),
            });
            let then = table.then.iter().map(|file| folder.join(&**file));
            let shape = Shape::Onto(OntoAsked {
                body,
                then: then.collect(),
                top,
            });
            (shape, torch, *table.tilt, *table.lead)
        }
        (None, None) => return None,
    };
    let (share, origin, model) = match shape {
        Shape::Wall(_) => (
            2.0 * FREE_EDGE * bead.width.value,
            "a wall of single beads: metal of a pass over the 0.9 widths that it shares (Rouchon 2022, § 4.4)",
            [
                "passes on a surface",
                "Campocasso 2017, § III: planes, lines of a parameter, constant distance; fronts on faces and meshes of our own",
            ],
        ),
        Shape::Onto(ref onto) => (
            stepover,
            "filled layers: metal of a bead over the stepover",
            [
                "layers on a body",
                if onto.top.is_some() {
                    "ours: level sets of the share of the way from the body to the top, by the distances from both, contours and zigzags on them; travel speeds follow their thickness (S2 of Campocasso 2017, § III)"
                } else {
                    "ours: surfaces at one distance from the body (Campocasso 2017, § III.C), contours and zigzags on them"
                },
            ],
        ),
    };
    let height = match &*job.layers.height {
        Auto::Value(heights) => Resolved::new(heights.first().map_or(0.0, |h| h.0), Origin::Job),
        Auto::Auto => Resolved::new(bead.area.value / share, Origin::Computed(origin.to_owned())),
    };
    let spacing = height.value;
    r.value(
        &job.layers.height.name,
        Resolved::new(Length(spacing), height.origin),
    );
    r.model(model[0], model[1]);
    Some(Asked {
        shape,
        spacing,
        grows: *job.layers.height == Auto::Auto,
        torch,
        tilt: tilt.map(|a| a.0),
        lead: lead.0,
        spacing_limit: job.checks.spacing.0,
    })
}

fn wall_asked(
    table: &SurfaceTable,
    (folder, bead): (&Path, &Bead),
    r: &mut Provenance,
) -> WallAsked {
    let own = match *table.passes {
        SurfacePasses::Each => SurfaceSpeeds::Constant,
        SurfacePasses::Spiral => SurfaceSpeeds::Adapted,
    };
    let speeds = table.speeds.or_computed(r, own);
    let grown = bead.area.value / (2.0 * FREE_EDGE * bead.width.value);
    let grows = match speeds {
        SurfaceSpeeds::Constant => grown,
        SurfaceSpeeds::Adapted => table.grows.or_computed(r, Length(grown)).0,
    };
    let faces = table.faces.value.clone().map(|mut faces| {
        faces.sort_unstable();
        faces.dedup();
        faces
    });
    WallAsked {
        faces,
        base: BaseAsked {
            origin: table.base.origin.map(|o| DVec3::from_array(o.map(|l| l.0))),
            direction: table.base.direction.map(|d| DVec3::from_array(d.0)),
            radius: table.base.radius.map(|l| l.0),
            profile: table.base.profile.value.as_ref().map(|places| {
                let place = |place: &[Length; 2]| place.map(|l| l.0);
                places.iter().map(place).collect()
            }),
        },
        strategy: *table.strategy,
        passes: *table.passes,
        speeds,
        grows,
        field: table.field.value.as_ref().map(|file| folder.join(&**file)),
    }
}
