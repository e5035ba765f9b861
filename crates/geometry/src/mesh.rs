//! Triangle meshes: shared vertices and indexed triangles.

use serde::{Deserialize, Serialize};

use crate::math::DVec3;

/// A triangle mesh in millimetres, in the frame of the file or part it came from.
///
/// Triangles are counter-clockwise seen from outside (outward normals) when the mesh is sound;
/// nothing here assumes that it is: see the diagnosis module.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Vertex positions, mm.
    pub vertices: Vec<DVec3>,
    /// Vertex indices of each triangle; every index is below `vertices.len()`.
    pub triangles: Vec<[u32; 3]>,
}

/// Smallest and largest coordinates of some points; nothing where there are none.
pub fn bounds(mut points: impl Iterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    let first = points.next()?;
    Some(points.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p))))
}

impl Mesh {
    /// The corner positions of triangle `t`.
    ///
    /// `t` must be a valid triangle index.
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|v| self.vertices[v as usize])
    }

    /// Adds the triangles of another mesh in the same frame. Nothing is welded: where both reach into each other they stay two surfaces.
    ///
    /// ```
    /// use meltpath_geometry::shapes::thin_wall;
    /// let mut walls = thin_wall(60.0, 10.0, 20.0);
    /// walls.add(&thin_wall(60.0, 10.0, 20.0));
    /// assert_eq!(walls.volume(), 2.0 * 60.0 * 10.0 * 20.0);
    /// ```
    pub fn add(&mut self, other: &Mesh) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(&other.vertices);
        let moved = other.triangles.iter().map(|t| t.map(|v| v + first));
        self.triangles.extend(moved);
    }

    /// Smallest and largest coordinates over the corners of triangles, or `None` for a mesh without triangles: vertices that none uses are no
    /// part of the surface.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        bounds((0..self.triangles.len()).flat_map(|t| self.corners(t)))
    }

    /// Surface area, mm².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }

    /// Signed volume, mm³ (divergence theorem); positive for a closed mesh with outward normals.
    ///
    /// ```
    /// use meltpath_geometry::{Mesh, math::DVec3};
    /// let tetra = Mesh {
    ///     vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
    ///     triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
    /// };
    /// assert!((tetra.volume() - 1.0 / 6.0).abs() < 1e-15);
    /// ```
    pub fn volume(&self) -> f64 {
        let Some((lo, hi)) = self.bounds() else {
            return 0.0;
        };
        // about the centre of the bounds: keeps digits for parts far from the origin
        let o = 0.5 * (lo + hi);
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t);
                (a - o).dot((b - o).cross(c - o)) / 6.0
            })
            .sum()
    }
}

/// A mesh and the name that its file gives it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedMesh {
    /// Object name; may be empty.
    pub name: String,
    /// The triangles, mm.
    pub mesh: Mesh,
}
