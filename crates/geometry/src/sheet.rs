//! A surface as a mesh that lines are drawn on: level lines of a field, and fronts that go on at a constant distance.
//!
//! The surface may be open or closed, in pieces, and have holes; no edge has more than two triangles, and neighbours run alike.

mod chain;
mod front;
mod subdivide;
mod thin;

pub use front::{Front, FrontEnd, FrontLine, FrontPoint, Fronts};
pub use subdivide::subdivide;
pub use thin::thinned;

use crate::Mesh;
use crate::math::DVec3;
use crate::topology::{edges, half_edges, is_degenerate};

/// A surface that lines are drawn on.
#[derive(Debug, Clone)]
pub struct Sheet {
    mesh: Mesh,
    /// The triangle over each side of each triangle; [`NONE`] at a rim.
    neighbours: Vec<[u32; 3]>,
    /// Triangles around each vertex: where each vertex' own begin in `around`.
    first: Vec<u32>,
    around: Vec<u32>,
    /// Unit normals at vertices; zero where there is none.
    normals: Vec<DVec3>,
}

/// No triangle.
const NONE: u32 = u32::MAX;

/// Most triangles of a sheet.
pub const MOST_TRIANGLES: usize = 20_000_000;

/// Why lines cannot be drawn on a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SheetError {
    /// There is no triangle with an area.
    #[error("the mesh has no triangle: give a surface")]
    Empty,
    /// A vertex is not a finite point, or a triangle names one that is not there.
    #[error("vertex {vertex} of the mesh is missing or not finite: repair the mesh")]
    Vertex {
        /// Which.
        vertex: u32,
    },
    /// More than two triangles share an edge.
    #[error("{triangles} triangles meet in one edge at ({:.3}, {:.3}, {:.3}) mm: a wall has two there at most; split the surface, or repair the mesh", .at.x, .at.y, .at.z)]
    Branch {
        /// How many.
        triangles: usize,
        /// The middle of the edge, mm.
        at: DVec3,
    },
    /// Two neighbours run against each other.
    #[error("two triangles at ({:.3}, {:.3}, {:.3}) mm show opposite sides: orient the mesh (repair does)", .at.x, .at.y, .at.z)]
    Turned {
        /// The middle of their edge, mm.
        at: DVec3,
    },
    /// The spacing of lines asks for too many triangles.
    #[error(
        "lines {spacing} mm apart on this surface need more than {MOST_TRIANGLES} triangles: take a larger spacing, or a smaller piece"
    )]
    TooFine {
        /// Spacing, mm.
        spacing: f64,
    },
    /// The base does not touch the surface.
    #[error("the base does not touch the surface: its nearest place ({:.3}, {:.3}, {:.3}) mm is {gap:.3} mm away; move the part or the base", .at.x, .at.y, .at.z)]
    NoBase {
        /// Distance of the nearest vertex, mm.
        gap: f64,
        /// That vertex, mm.
        at: DVec3,
    },
    /// The whole surface lies behind the base.
    #[error("the whole surface lies behind the base, up to {depth:.3} mm deep at ({:.3}, {:.3}, {:.3}) mm: turn the base round, or move the part", .at.x, .at.y, .at.z)]
    Behind {
        /// Distance of the deepest vertex, mm.
        depth: f64,
        /// That vertex, mm.
        at: DVec3,
    },
    /// A length is not above zero and finite.
    #[error("{name} is {value} mm: it must be above zero and finite")]
    Length {
        /// Which.
        name: &'static str,
        /// What was given, mm.
        value: f64,
    },
    /// More fronts than there can be.
    #[error("more than {most} fronts of {spacing} mm: take a larger spacing")]
    TooMany {
        /// Spacing, mm.
        spacing: f64,
        /// Most fronts.
        most: usize,
    },
}

/// A line on a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetLine {
    /// Its points with the surface's unit normal there; what lies below the level lies on the left, seen against the normal. A closed
    /// line repeats its first point at the end.
    pub points: Vec<(DVec3, DVec3)>,
}

impl SheetLine {
    /// Whether it ends where it starts.
    pub fn is_closed(&self) -> bool {
        let ends = self.points.first().zip(self.points.last());
        self.points.len() > 2 && ends.is_some_and(|(a, b)| a.0 == b.0)
    }
}

impl Sheet {
    /// The surface of a mesh with welded vertices, for lines `spacing` mm apart: triangles are cut where they are larger than a quarter
    /// of that, the surface stays the same. Triangles without an area are left out.
    ///
    /// # Errors
    /// [`SheetError`]: what is not a surface, with its place.
    pub fn new(mesh: &Mesh, spacing: f64) -> Result<Self, SheetError> {
        positive("the spacing", spacing)?;
        let count = mesh.vertices.len();
        for &vertex in mesh.triangles.iter().flatten() {
            if mesh
                .vertices
                .get(vertex as usize)
                .is_none_or(|p| !p.is_finite())
            {
                return Err(SheetError::Vertex { vertex });
            }
        }
        let mut own = Mesh {
            vertices: mesh.vertices.clone(),
            triangles: mesh.triangles.clone(),
        };
        own.triangles.retain(|t| !is_degenerate(*t));
        if own.triangles.is_empty() || count == 0 {
            return Err(SheetError::Empty);
        }
        check_edges(&own)?;
        subdivide(&mut own, 0.25 * spacing, MOST_TRIANGLES)
            .ok_or(SheetError::TooFine { spacing })?;
        let neighbours = neighbours(&own);
        let (first, around) = around(&own);
        let normals = normals(&own);
        Ok(Sheet {
            mesh: own,
            neighbours,
            first,
            around,
            normals,
        })
    }

    /// The triangles, after cutting.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Lines at which a field rises through zero, open ones first. The field must be continuous along the surface.
    pub fn level_lines(&self, field: impl Fn(DVec3) -> f64) -> Vec<SheetLine> {
        let values: Vec<f64> = self.mesh.vertices.iter().map(|&p| field(p)).collect();
        let below: Vec<bool> = values.iter().map(|v| *v <= 0.0).collect();
        let mixed: Vec<u32> = (0..self.mesh.triangles.len() as u32)
            .filter(|&t| self.is_mixed(t, &below))
            .collect();
        let lines = self.chains(&mixed, &below, |a, b| crossing(a, b, &field));
        lines
            .into_iter()
            .map(|line| SheetLine {
                points: line.iter().map(|p| (p.position, p.normal)).collect(),
            })
            .collect()
    }

    fn is_mixed(&self, t: u32, below: &[bool]) -> bool {
        let [a, b, c] = self.mesh.triangles[t as usize].map(|v| below[v as usize]);
        a != b || b != c
    }

    fn fan(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.around[self.first[v] as usize..self.first[v + 1] as usize]
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), SheetError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(SheetError::Length { name, value })
    }
}

/// The share of the way from `a`, where the field is not above zero, to `b`, where it is, at which it is zero.
pub(crate) fn crossing(a: DVec3, b: DVec3, field: impl Fn(DVec3) -> f64) -> f64 {
    let at = |x: f64| field(a.lerp(b, x));
    let (mut low, mut high) = (0.0, 1.0);
    let (mut f_low, mut f_high) = (at(0.0), at(1.0));
    if f_low >= 0.0 {
        return 0.0;
    }
    // regula falsi after Illinois: the end that stays counts half
    let mut side = 0;
    for _ in 0..60 {
        let x = if f_high > f_low {
            (low * f_high - high * f_low) / (f_high - f_low)
        } else {
            0.5 * (low + high)
        };
        let f = at(x);
        if f.abs() < 1e-12 || high - low < 1e-14 {
            return x;
        }
        if f < 0.0 {
            (low, f_low) = (x, f);
            f_high *= if side == -1 { 0.5 } else { 1.0 };
            side = -1;
        } else {
            (high, f_high) = (x, f);
            f_low *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        }
    }
    0.5 * (low + high)
}

/// Whether no edge has more than two triangles, and neighbours run alike.
fn check_edges(mesh: &Mesh) -> Result<(), SheetError> {
    let sorted = half_edges(mesh);
    for edge in edges(&sorted) {
        let (a, b) = edge[0].ends(mesh);
        let at = mesh.vertices[a as usize].midpoint(mesh.vertices[b as usize]);
        match edge {
            [_] => {}
            [a, b] if a.is_rising(mesh) != b.is_rising(mesh) => {}
            [_, _] => return Err(SheetError::Turned { at }),
            _ => {
                return Err(SheetError::Branch {
                    triangles: edge.len(),
                    at,
                });
            }
        }
    }
    Ok(())
}

fn neighbours(mesh: &Mesh) -> Vec<[u32; 3]> {
    let mut neighbours = vec![[NONE; 3]; mesh.triangles.len()];
    let sorted = half_edges(mesh);
    for edge in edges(&sorted) {
        if let [a, b] = edge {
            neighbours[a.triangle() as usize][(a.corner % 3) as usize] = b.triangle();
            neighbours[b.triangle() as usize][(b.corner % 3) as usize] = a.triangle();
        }
    }
    neighbours
}

fn around(mesh: &Mesh) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0_u32; mesh.vertices.len() + 1];
    for &v in mesh.triangles.iter().flatten() {
        first[v as usize + 1] += 1;
    }
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    let mut next = first.clone();
    let mut around = vec![0; 3 * mesh.triangles.len()];
    for (t, triangle) in (0..).zip(&mesh.triangles) {
        for &v in triangle {
            around[next[v as usize] as usize] = t;
            next[v as usize] += 1;
        }
    }
    (first, around)
}

/// Unit normals at vertices, each triangle by its area.
fn normals(mesh: &Mesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let area = (b - a).cross(c - a);
        for &v in triangle {
            normals[v as usize] += area;
        }
    }
    normals.into_iter().map(DVec3::normalize_or_zero).collect()
}
