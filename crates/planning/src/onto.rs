//! Layers that follow a body which is there already: a repair on a worn face, a boss on a pipe, a rib on a casting.
//!
//! Layer k lies at k layer heights from the body, so that every layer is evenly thick and stands on the metal below it. The surface
//! through the middle of each layer is laid out in a plane with the least stretch, filled there as a flat layer is, and brought back.
//! What the layout stretches, the distance between beads is off by: it is told. A face that can be unrolled is not stretched.
//!
//! Ours. Layers at one distance from a free-form base are what Campocasso 2017 does with one bead on a surface, § III.C, eq. 3.

mod layers;
mod lift;

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::distance::Distance;
use meltpath_geometry::flatten::{Flat, FlattenError};
use meltpath_geometry::level::{LevelError, pieces};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::{Mesh, Plane, Region};
use meltpath_toolpath::Role;
use rayon::prelude::*;

use crate::fill::{Coverage, FillLayer, FillSettings, PassIds, plan_layers};
use crate::surface::SurfacePass;
use crate::PlanError;

/// What is asked of layers on a body.
#[derive(Debug, Clone, Copy)]
pub struct OntoSettings<'a> {
    /// Layer height, mm.
    pub height: f64,
    /// How layers are filled.
    pub fill: &'a FillSettings,
    /// Metal beyond the part, mm.
    pub allowance: f64,
    /// How far the polyline of a bead may lie beside its curve, mm.
    pub chord_error: f64,
    /// Layers after this one are left out.
    pub count: Option<u32>,
}

/// One bead.
#[derive(Debug, Clone, PartialEq)]
pub struct OntoBead {
    /// Where it lies; its number is that of its layer.
    pub pass: SurfacePass,
    /// What it is for.
    pub role: Role,
    /// Travel speed of each of its moves, mm/s; `None` is the bead's own.
    pub speeds: Vec<Option<f64>>,
}

/// One layer as planned.
#[derive(Debug, Clone, PartialEq)]
pub struct OntoLayer {
    /// Its number, from 1.
    pub number: u32,
    /// Area of the surface through its middle, mm².
    pub area: f64,
    /// Distances between beads over those that were asked for: the least and the greatest, each with its place.
    pub stretch: [(f64, DVec3); 2],
    /// How its pieces are covered; places of gaps are on the layer.
    pub coverage: Vec<Coverage>,
}

/// Layers on a body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OntoPlan {
    /// Beads in the order in which they are laid.
    pub beads: Vec<OntoBead>,
    /// The layers.
    pub layers: Vec<OntoLayer>,
}

/// Why layers on a body cannot be planned.
#[derive(Debug, thiserror::Error)]
pub enum OntoError {
    /// A setting out of its range.
    #[error("{name} is {value}: it must be above zero and finite")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// The body covers the part, to within half a layer.
    #[error("the part reaches nowhere more than {reach:.3} mm out of the body, and half a layer is {:.3} mm: there is nothing to lay; give the part as it is to be, and the body as it is now, in the same coordinates", 0.5 * .height)]
    Nothing {
        /// How far the part reaches out of the body, mm.
        reach: f64,
        /// Layer height, mm.
        height: f64,
    },
    /// Part and body do not meet.
    #[error("the part does not touch the body: its nearest place ({:.3}, {:.3}, {:.3}) mm is {gap:.3} mm away, more than half a layer; both files are in the same coordinates", .at.x, .at.y, .at.z)]
    Apart {
        /// Least distance, mm.
        gap: f64,
        /// Where on the part, mm.
        at: DVec3,
    },
    /// No layer has room for a bead.
    #[error("no layer has room for a bead {width:.3} mm wide; take a narrower bead")]
    Narrow {
        /// Width of a bead, mm.
        width: f64,
    },
    /// The grid on which layers are found.
    #[error(transparent)]
    Level(#[from] LevelError),
    /// A layer that goes around too much of the body.
    #[error("layer {number}: {source}")]
    Flatten {
        /// The layer.
        number: u32,
        /// Why.
        source: FlattenError,
    },
    /// The fill.
    #[error(transparent)]
    Fill(#[from] PlanError),
}

/// A layer laid out in a plane.
struct LaidOut {
    number: u32,
    area: f64,
    pieces: Vec<Piece>,
}

/// A piece of a layer, and where the plane has it.
struct Piece {
    flat: Flat,
    shift: DVec2,
}

/// Plans the layers with which `part` grows out of `body`; both are closed, in the same coordinates.
///
/// Where the part reaches out of the body by less than half a layer nothing is laid.
///
/// # Errors
/// [`OntoError`].
pub fn plan_onto(
    part: &Mesh,
    body: &Mesh,
    settings: &OntoSettings<'_>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<OntoPlan, OntoError> {
    settings.check()?;
    let (part, body) = (Shape::new(part), Shape::new(body));
    let sheets = layers::sheets(&part, &body, settings)?;
    let laid_out = (1..).zip(&sheets).collect::<Vec<(u32, &Mesh)>>();
    let laid_out = laid_out
        .into_par_iter()
        .map(|(number, sheet)| laid_out_in_a_plane(number, sheet, settings))
        .collect::<Result<Vec<LaidOut>, OntoError>>()?;
    let plane = Plane::horizontal(0.0);
    let regions: Vec<Vec<Region>> = laid_out.iter().map(LaidOut::regions).collect();
    let wanted = laid_out.iter().zip(&regions);
    let wanted: Vec<FillLayer<'_>> = wanted
        .map(|(layer, regions)| FillLayer {
            number: layer.number,
            plane: &plane,
            regions,
        })
        .collect();
    let filled = plan_layers(
        &wanted,
        settings.fill,
        PassIds { part: 0 },
        reporter,
        observer,
    )?;
    let mut plan = OntoPlan::default();
    for (layer, filled) in laid_out.iter().zip(filled) {
        let lift = lift::Lift {
            layer,
            body: &body,
            height: settings.height,
            chord_error: settings.chord_error,
        };
        plan.beads
            .extend(filled.path.passes().filter_map(|p| lift.bead(p)));
        plan.layers.push(OntoLayer {
            number: layer.number,
            area: layer.area,
            stretch: layer.stretch(),
            coverage: lift.coverage(filled.coverage),
        });
    }
    if plan.beads.is_empty() {
        return Err(OntoError::Narrow {
            width: settings.fill.width,
        });
    }
    Ok(plan)
}

/// The pieces of a layer side by side in a plane.
fn laid_out_in_a_plane(
    number: u32,
    sheet: &Mesh,
    settings: &OntoSettings<'_>,
) -> Result<LaidOut, OntoError> {
    let mut laid = Vec::new();
    let mut edge: Option<f64> = None;
    for piece in pieces(sheet) {
        let flat = Flat::new(&piece).map_err(|source| OntoError::Flatten { number, source })?;
        let (low, high) = flat.bounds();
        // the first lies as it is seen, the others well apart from it
        let shift = edge.map_or(0.0, |edge| edge + 4.0 * settings.fill.width - low.x);
        edge = Some(high.x + shift);
        laid.push(Piece {
            flat,
            shift: DVec2::new(shift, 0.0),
        });
    }
    Ok(LaidOut {
        number,
        area: sheet.area(),
        pieces: laid,
    })
}

impl LaidOut {
    fn regions(&self) -> Vec<Region> {
        let shifted = |piece: &Piece| {
            let Region {
                mut outer,
                mut holes,
            } = piece.flat.region();
            for p in outer.iter_mut().chain(holes.iter_mut().flatten()) {
                *p += piece.shift;
            }
            Region { outer, holes }
        };
        self.pieces.iter().map(shifted).collect()
    }

    /// Distances on the layer over those in the plane.
    fn stretch(&self) -> [(f64, DVec3); 2] {
        let all = self.pieces.iter().map(|p| p.flat.stretch());
        let first = [(f64::INFINITY, DVec3::ZERO), (0.0, DVec3::ZERO)];
        all.fold(first, |[least, greatest], [shrunk, grown]| {
            let (close, wide) = ((1.0 / grown.0, grown.1), (1.0 / shrunk.0, shrunk.1));
            [
                if close.0 < least.0 { close } else { least },
                if wide.0 > greatest.0 { wide } else { greatest },
            ]
        })
    }
}

/// A closed mesh and its distance.
struct Shape<'a> {
    mesh: &'a Mesh,
    near: Distance,
}

impl<'a> Shape<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        Shape {
            mesh,
            near: Distance::new(mesh),
        }
    }

    /// Signed distance, mm; far outside for a shape of nothing.
    fn distance(&self, p: DVec3) -> f64 {
        self.near.foot(p).map_or(f64::INFINITY, |f| f.distance)
    }
}

impl OntoSettings<'_> {
    fn check(&self) -> Result<(), OntoError> {
        for (name, value) in [
            ("the layer height", self.height),
            ("the chord error", self.chord_error),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(OntoError::Setting { name, value });
            }
        }
        Ok(self.fill.check()?)
    }
}
