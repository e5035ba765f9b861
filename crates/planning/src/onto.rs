//! Layers that follow a body which is there already: a repair on a worn face, a boss on a pipe, a rib on a casting.
//!
//! Layer k lies at k layer heights from the body, so that every layer is evenly thick and stands on the metal below it. Each layer is
//! planned on the surface through its middle: contours at their distance from its rim, zigzag lines inside. Lines are parallel
//! on the surface, not in its projection: the same distance lies between them where it leans.
//!
//! Ours, after the rules of flat layers (Rouchon 2022, § 1.2.3.2): layers at a distance from a free-form base are what Campocasso 2017
//! does with one bead on a surface, § III.C, eq. 3.

mod chain;
mod layers;
mod lines;

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::level::LevelError;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;
use meltpath_geometry::sheet::{Sheet, SheetError};

use crate::surface::{SurfacePass, SurfacePoint};

/// What is asked of layers on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OntoSettings {
    /// Layer height, mm.
    pub height: f64,
    /// Distance between neighbouring beads, mm.
    pub stepover: f64,
    /// Distance of the outermost beads from the rim of their layer, mm: half of a bead's width.
    pub inset: f64,
    /// Contours around the lines.
    pub contours: u32,
    /// Direction of the lines of the first layer, rad, about the layer's normal from the direction of x.
    pub angle: f64,
    /// Turn of that direction from layer to layer, rad.
    pub turn: f64,
    /// Metal beyond the part, mm.
    pub allowance: f64,
    /// How far the polyline of a bead may lie beside its curve, mm.
    pub chord_error: f64,
}

/// One layer as planned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OntoLayer {
    /// Its number, from 1.
    pub number: u32,
    /// Area of the surface through its middle, mm².
    pub area: f64,
    /// Area of it that lies farther than a stepover from every bead, mm².
    pub uncovered: f64,
    /// A place of that, mm.
    pub uncovered_at: Option<DVec3>,
}

/// Layers on a body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OntoPlan {
    /// Beads in the order in which they are laid, numbered by their layer.
    pub passes: Vec<SurfacePass>,
    /// The layers.
    pub layers: Vec<OntoLayer>,
}

/// Why layers on a body cannot be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
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
    #[error(
        "the part reaches nowhere more than {reach:.3} mm out of the body, less than half a layer of {height:.3} mm: there is nothing to lay; give the part as it is to be, and the body as it is now, in the same coordinates"
    )]
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
    #[error(
        "no layer has room for a bead: what is to be laid is narrower than {width:.3} mm; take a narrower bead"
    )]
    Narrow {
        /// Two insets, mm.
        width: f64,
    },
    /// The grid on which layers are found.
    #[error(transparent)]
    Level(#[from] LevelError),
    /// A layer is not a surface.
    #[error(transparent)]
    Sheet(#[from] SheetError),
}

/// Plans the layers with which `part` grows out of `body`; both are closed, in the same coordinates.
///
/// Where the part reaches out of the body by less than half a layer nothing is laid.
///
/// # Errors
/// [`OntoError`].
pub fn plan_onto(part: &Mesh, body: &Mesh, settings: &OntoSettings) -> Result<OntoPlan, OntoError> {
    settings.check()?;
    let (part, body) = (Shape::new(part), Shape::new(body));
    let sheets = layers::sheets(&part, &body, settings)?;
    let mut plan = OntoPlan::default();
    for (number, mesh) in (1..).zip(&sheets) {
        let sheet = Sheet::new(mesh, settings.stepover)?;
        let direction = settings.angle + f64::from(number - 1) * settings.turn;
        let found = lines::beads(&sheet, direction, settings)?;
        let (uncovered, uncovered_at) = uncovered(sheet.mesh(), &found, settings.stepover);
        plan.layers.push(OntoLayer {
            number,
            area: mesh.area(),
            uncovered,
            uncovered_at,
        });
        let above = |line: &Vec<DVec3>| lifted(line, number, &body, settings.height);
        plan.passes.extend(found.iter().filter_map(above));
    }
    if plan.passes.is_empty() {
        return Err(OntoError::Narrow {
            width: 2.0 * settings.inset,
        });
    }
    Ok(plan)
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

impl OntoSettings {
    fn check(&self) -> Result<(), OntoError> {
        for (name, value) in [
            ("the layer height", self.height),
            ("the stepover", self.stepover),
            ("the distance of beads from the rim", self.inset),
            ("the chord error", self.chord_error),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(OntoError::Setting { name, value });
            }
        }
        Ok(())
    }
}

/// Area of a layer farther than `reach` from every bead, and a place of it.
fn uncovered(mesh: &Mesh, beads: &[Vec<DVec3>], reach: f64) -> (f64, Option<DVec3>) {
    let near = Segments::new(beads.iter().map(Vec::as_slice), reach);
    let (mut area, mut at) = (0.0, None);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let middle = (a + b + c) / 3.0;
        if near.nearest(middle, reach).is_none() {
            area += 0.5 * (b - a).cross(c - a).length();
            at = at.or(Some(middle));
        }
    }
    (area, at)
}

/// A line on the middle of a layer as a bead between the layer below and its own top. `None` of less than two points.
fn lifted(line: &[DVec3], number: u32, body: &Shape, height: f64) -> Option<SurfacePass> {
    if line.len() < 2 {
        return None;
    }
    let last = line.len() - 1;
    let closed = line[0] == line[last];
    let point = |(i, &p): (usize, &DVec3)| {
        let foot = body.near.foot(p)?;
        let before = if i == 0 && closed {
            last - 1
        } else {
            i.saturating_sub(1)
        };
        let after = if i == last && closed {
            1
        } else {
            (i + 1).min(last)
        };
        let travel = (line[after] - line[before]).normalize_or_zero();
        let growth = foot.outward;
        let top = f64::from(number) * height;
        Some(SurfacePoint {
            position: foot.point + top * growth,
            normal: travel.cross(growth).normalize_or_zero(),
            growth,
            from: Some(foot.point + (top - height) * growth),
        })
    };
    let points: Option<Vec<SurfacePoint>> = line.iter().enumerate().map(point).collect();
    Some(SurfacePass {
        number,
        points: points?,
    })
}
