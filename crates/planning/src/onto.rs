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
use meltpath_toolpath::{Layer, Role};
use rayon::prelude::*;

use self::layers::Growing;
use self::lift::Lift;
use crate::PlanError;
use crate::fill::{Coverage, FillLayer, FillSettings, PassIds, plan_layers};
use crate::surface::SurfacePass;

/// What is asked of layers on a body.
#[derive(Debug, Clone, Copy)]
pub struct OntoSettings<'a> {
    /// How layers are filled.
    pub fill: &'a FillSettings,
    /// Metal beyond the part aside, mm.
    pub side: f64,
    /// Metal over the part, away from the body, mm.
    pub over: f64,
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
    /// Distance of its top from the body, mm.
    pub top: f64,
    /// Area of the surface through its middle, mm².
    pub area: f64,
    /// Distances between beads over those that were asked for: the least and the greatest, each with its place.
    pub stretch: [(f64, DVec3); 2],
    /// How its pieces are covered; places of gaps are on the layer.
    pub coverage: Vec<Coverage>,
    /// Its rims, closed lines on the surface through its middle, mm.
    pub rims: Vec<Vec<DVec3>>,
    /// Its beads as they lie in the plane.
    pub path: Layer,
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

/// A part that grows out of a body: what its plans share.
pub struct Onto<'a> {
    growing: Growing<'a>,
    settings: OntoSettings<'a>,
}

impl<'a> Onto<'a> {
    /// Finds what grows out of `body` where `part` is to be; both are closed, in the same coordinates.
    ///
    /// Where the part reaches out of the body by less than half of `height`, the height of a layer, mm, nothing is laid.
    ///
    /// # Errors
    /// [`OntoError`].
    pub fn new(
        part: &Mesh,
        body: &Mesh,
        height: f64,
        settings: OntoSettings<'a>,
    ) -> Result<Self, OntoError> {
        for (name, value) in [
            ("the layer height", height),
            ("the chord error", settings.chord_error),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(OntoError::Setting { name, value });
            }
        }
        settings.fill.check()?;
        Ok(Onto {
            growing: Growing::new(part, body, height, settings)?,
            settings,
        })
    }

    /// Plans layers that are as high as `heights` says, from the body on, mm; the last one repeats.
    ///
    /// # Errors
    /// [`OntoError`].
    pub fn plan(
        &self,
        heights: &[f64],
        reporter: &Reporter,
        observer: &dyn Observer,
    ) -> Result<OntoPlan, OntoError> {
        let sheets = self.growing.sheets(heights);
        let numbered: Vec<(u32, &Mesh)> = (1..).zip(&sheets).collect();
        let laid_out = numbered
            .into_par_iter()
            .map(|(number, sheet)| laid_out_in_a_plane(number, sheet, self.settings.fill.width))
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
        let ids = PassIds { part: 0 };
        let filled = plan_layers(&wanted, self.settings.fill, ids, reporter, observer)?;
        let mut plan = OntoPlan::default();
        let mut bottom = 0.0;
        for (i, (layer, filled)) in laid_out.iter().zip(filled).enumerate() {
            let height = heights.get(i).or(heights.last()).copied().unwrap_or(0.0);
            let lift = Lift {
                layer,
                body: &self.growing.body,
                heights: [bottom, bottom + height],
                chord_error: self.settings.chord_error,
            };
            bottom += height;
            plan.beads
                .extend(filled.path.passes().filter_map(|p| lift.bead(p)));
            plan.layers.push(OntoLayer {
                number: layer.number,
                top: bottom,
                area: layer.area,
                stretch: layer.stretch(),
                coverage: lift.coverage(filled.coverage),
                rims: layer.pieces.iter().flat_map(|p| p.flat.rims()).collect(),
                path: filled.path,
            });
        }
        if plan.beads.is_empty() {
            return Err(OntoError::Narrow {
                width: self.settings.fill.width,
            });
        }
        Ok(plan)
    }
}

/// The pieces of a layer side by side in a plane.
fn laid_out_in_a_plane(number: u32, sheet: &Mesh, width: f64) -> Result<LaidOut, OntoError> {
    let mut laid = Vec::new();
    let mut edge: Option<f64> = None;
    for piece in pieces(sheet) {
        let flat = Flat::new(&piece).map_err(|source| OntoError::Flatten { number, source })?;
        let (low, high) = flat.bounds();
        // the first lies as it is seen, the others well apart from it
        let shift = edge.map_or(0.0, |edge| edge + 4.0 * width - low.x);
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

/// A closed mesh with its distance.
struct Shape {
    near: Distance,
}

impl Shape {
    fn new(mesh: &Mesh) -> Self {
        Shape {
            near: Distance::new(mesh),
        }
    }

    /// Signed distance, mm; far outside for a shape of nothing.
    fn distance(&self, p: DVec3) -> f64 {
        self.near.foot(p).map_or(f64::INFINITY, |f| f.distance)
    }
}
