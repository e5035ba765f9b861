//! A wall one bead thick along a surface in space: what a job asks, the plan, its metal, its checks, and the run from part to program.

pub(crate) mod grow;
mod judge;
mod metal;
pub mod plan;
pub(super) mod run;
pub(crate) mod wall;

use meltpath_base::quantity::Auto;
use meltpath_base::{Length, Origin, Provenance, Resolved};
use meltpath_deposition::process_map::Bead;
use meltpath_geometry::math::DVec3;
use meltpath_planning::surface::TorchRule;

use crate::job::WaamJob;
use crate::job::waam::{SurfaceStrategyChoice, TorchChoice};
use crate::waam::settings::bead::FREE_EDGE;

/// What a job asks of a wall on a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// Numbers of faces, from 1, each once; nothing for the whole file.
    pub faces: Option<Vec<u32>>,
    /// What the wall stands on, in the coordinates of the file.
    pub base: BaseAsked,
    /// How passes follow one another.
    pub strategy: SurfaceStrategyChoice,
    /// Distance between passes, mm.
    pub spacing: f64,
    /// Where the torch points from.
    pub torch: TorchRule,
    /// Greatest lean against the vertical, rad.
    pub tilt: Option<f64>,
    /// Angle by which the wire points ahead, rad.
    pub lead: f64,
    /// Largest deviation of the distance between passes, share of it.
    pub spacing_limit: f64,
}

/// What a wall stands on, as far as a job says it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseAsked {
    /// A point of the plane or of the axis, mm.
    pub origin: Option<DVec3>,
    /// The plane's normal or the axis.
    pub direction: Option<DVec3>,
    /// Radius of a cylinder, mm.
    pub radius: Option<f64>,
}

/// What the job's table asks; nothing where the job has flat layers.
pub(super) fn asked(job: &WaamJob, bead: &Bead, r: &mut Provenance) -> Option<Asked> {
    let table = job.surface.as_ref()?;
    let height = match &*job.layers.height {
        Auto::Value(heights) => Resolved::new(heights.first().map_or(0.0, |h| h.0), Origin::Job),
        Auto::Auto => {
            let origin = "a wall of single beads: metal of a pass over the 0.9 widths that it shares (Rouchon 2022, § 4.4)";
            let height = bead.area.value / (2.0 * FREE_EDGE * bead.width.value);
            Resolved::new(height, Origin::Computed(origin.to_owned()))
        }
    };
    let spacing = height.value;
    r.value(
        &job.layers.height.name,
        Resolved::new(Length(spacing), height.origin),
    );
    r.model(
        "passes on a surface",
        "Campocasso 2017, § III: planes, lines of a parameter, constant distance; fronts on faces and meshes of our own",
    );
    let faces = table.faces.value.clone().map(|mut faces| {
        faces.sort_unstable();
        faces.dedup();
        faces
    });
    Some(Asked {
        faces,
        base: BaseAsked {
            origin: table.base.origin.map(|o| DVec3::from_array(o.map(|l| l.0))),
            direction: table.base.direction.map(|d| DVec3::from_array(d.0)),
            radius: table.base.radius.map(|l| l.0),
        },
        strategy: *table.strategy,
        spacing,
        torch: match *table.torch {
            TorchChoice::Tangent => TorchRule::Tangent,
            TorchChoice::Half => TorchRule::Half,
            TorchChoice::Fixed => TorchRule::Fixed,
        },
        tilt: table.tilt.map(|a| a.0),
        lead: table.lead.0,
        spacing_limit: job.checks.spacing.0,
    })
}
