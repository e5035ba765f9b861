//! A box between two corners.

use crate::Mesh;
use crate::math::DVec3;

/// The closed box between its low and its high corner, mm, with outward normals.
///
/// ```
/// use meltpath_geometry::{math::DVec3, shapes::cuboid};
/// let plate = cuboid(DVec3::new(-5.0, -4.0, -3.0), DVec3::new(5.0, 4.0, 0.0));
/// assert!((plate.volume() - 240.0).abs() < 1e-9);
/// ```
pub fn cuboid(low: DVec3, high: DVec3) -> Mesh {
    // bit k of a corner's number: high along axis k
    let side = |corner: usize, k: usize| {
        if corner >> k & 1 == 0 {
            low[k]
        } else {
            high[k]
        }
    };
    let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|k| side(i, k)));
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let halves = |&[a, b, c, d]: &[u32; 4]| [[a, b, c], [a, c, d]];
    Mesh {
        vertices: (0..8).map(corner).collect(),
        triangles: faces.iter().flat_map(halves).collect(),
    }
}
