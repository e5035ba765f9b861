//! Closed meshes as their distance.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Union;
use meltpath_geometry::math::DVec3;

/// Closed meshes, together one body, with its distance.
pub(super) struct Shape {
    pub(super) near: Union,
}

impl Shape {
    pub(super) fn new<'a>(meshes: impl IntoIterator<Item = &'a Mesh>) -> Self {
        Shape {
            near: Union::new(meshes),
        }
    }

    /// Signed distance, mm; far outside for a shape of nothing.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        self.near.foot(p).map_or(f64::INFINITY, |f| f.distance)
    }
}
