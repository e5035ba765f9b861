//! Boundary representations: solids kept as faces on surfaces, trimmed by edges on curves.
//!
//! A [`Solid`] owns tables of vertices, edges and faces. A face keeps its surface with the parameters
//! of ISO 10303-42 and its trims as loops of edges, so that exact sections can be made of it.

pub mod curve;
pub mod nurbs;
pub mod surface;
pub mod tessellate;

use std::sync::Arc;

use crate::math::{DAffine3, DVec3};
pub use curve::{Curve, CurvePiece, Frame};
pub use surface::{Pole, Surface, TorusSheet};
pub use tessellate::{TessellateError, Tolerance, tessellate};

/// Direction in which something is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// As it stands.
    Forward,
    /// Turned round.
    Reversed,
}

impl Sense {
    /// `Forward` for true: how files write it.
    pub fn from_flag(same: bool) -> Self {
        if same { Self::Forward } else { Self::Reversed }
    }

    /// One sense after the other.
    #[must_use]
    pub fn then(self, other: Self) -> Self {
        Self::from_flag(self == other)
    }
}

/// A piece of a curve between two vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// The curve.
    pub curve: Arc<Curve>,
    /// Parameters at start and end; the second is the smaller where the edge runs against its curve.
    pub range: [f64; 2],
    /// Indices of the start and end vertex.
    pub vertices: [u32; 2],
    /// Period of the curve, if it closes.
    pub period: Option<f64>,
    /// Instance number in the file it came from.
    pub id: u64,
}

impl Edge {
    /// Point, first and second derivative at a parameter; a closed curve is run through again
    /// beyond its domain.
    pub fn derivatives(&self, t: f64) -> [DVec3; 3] {
        let [lo, hi] = self.curve.domain();
        match self.period {
            Some(period) if t < lo || t > hi => {
                self.curve.derivatives(lo + (t - lo).rem_euclid(period))
            }
            _ => self.curve.derivatives(t),
        }
    }

    /// The point at a fraction 0..1 of the parameter range.
    pub fn at(&self, fraction: f64) -> DVec3 {
        let [from, to] = self.range;
        self.derivatives(from + (to - from) * fraction)[0]
    }
}

/// An edge as a loop runs along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EdgeUse {
    /// Index of the edge.
    pub edge: u32,
    /// Direction.
    pub sense: Sense,
}

/// A closed boundary of a face.
#[derive(Debug, Clone, PartialEq)]
pub enum Loop {
    /// Edges end to end, the face to their left seen against its normal's arrow.
    Edges(Vec<EdgeUse>),
    /// A single vertex: the apex of a cone, the pole of a sphere.
    Vertex(u32),
}

/// A trimmed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// The surface.
    pub surface: Arc<Surface>,
    /// Whether the face's normal is the surface's.
    pub sense: Sense,
    /// Boundaries, in no order; none for a whole sphere or torus.
    pub loops: Vec<Loop>,
    /// Instance number in the file it came from.
    pub id: u64,
}

/// A face as a shell uses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaceUse {
    /// Index of the face.
    pub face: u32,
    /// Whether the shell's outside is the face's.
    pub sense: Sense,
}

/// What a shell bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShellRole {
    /// The outside of a solid.
    Outer,
    /// A cavity in a solid.
    Void,
    /// Nothing: an open surface.
    Open,
}

/// Connected faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    /// What it bounds.
    pub role: ShellRole,
    /// Its faces, normals out of the metal.
    pub faces: Vec<FaceUse>,
}

/// A body: shells over shared tables.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solid {
    /// Vertex positions, mm.
    pub vertices: Vec<DVec3>,
    /// Edges.
    pub edges: Vec<Edge>,
    /// Faces.
    pub faces: Vec<Face>,
    /// Shells.
    pub shells: Vec<Shell>,
    /// Distance within which the writer takes points for one, mm.
    pub uncertainty: f64,
}

impl Solid {
    /// An open surface of some of the faces, by their indices, each turned as its shell has it; edges between them stay shared. `None`
    /// where one of them is not there.
    pub fn piece(&self, faces: &[u32]) -> Option<Solid> {
        let turned = |face: u32| {
            let mut uses = self.shells.iter().flat_map(|s| &s.faces);
            let found = uses.find(|used| used.face == face);
            found.map_or(Sense::Forward, |used| used.sense)
        };
        let own: Option<Vec<Face>> = faces
            .iter()
            .map(|&f| self.faces.get(f as usize).cloned())
            .collect();
        let uses = (0..).zip(faces).map(|(face, &old)| FaceUse {
            face,
            sense: turned(old),
        });
        Some(Solid {
            faces: own?,
            shells: vec![Shell {
                role: ShellRole::Open,
                faces: uses.collect(),
            }],
            ..self.clone()
        })
    }
}

/// A solid in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedSolid {
    /// Name of the product or, where it has none, of the solid.
    pub name: String,
    /// Names of the assemblies it sits in, outermost first.
    pub path: Vec<String>,
    /// The solid, shared between all its places.
    pub solid: Arc<Solid>,
    /// Pose of the solid in the part; mirrors where its determinant is negative.
    pub part_from_solid: DAffine3,
}

/// All solids of a part file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BrepModel {
    /// In the order of the file's assembly tree.
    pub solids: Vec<PlacedSolid>,
}
