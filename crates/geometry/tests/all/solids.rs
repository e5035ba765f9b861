//! Solids put together for tests.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::{Mesh, shapes};

/// The mesh moved.
pub(crate) fn shifted(mesh: &Mesh, by: DVec3) -> Mesh {
    Mesh {
        vertices: mesh.vertices.iter().map(|&p| p + by).collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Both meshes in one, not united.
pub(crate) fn joined(a: &Mesh, b: &Mesh) -> Mesh {
    let shift = a.vertices.len() as u32;
    let mut mesh = a.clone();
    mesh.vertices.extend(&b.vertices);
    mesh.triangles
        .extend(b.triangles.iter().map(|t| t.map(|v| v + shift)));
    mesh
}

/// A cube from its least corner.
pub(crate) fn cube(at: DVec3, side: f64) -> Mesh {
    shifted(&shapes::extrude(&[shapes::plate(side, side)], side), at)
}
