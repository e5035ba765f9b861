//! A closed mesh as its distance.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::math::DVec3;

/// A closed mesh with its distance.
pub(super) struct Shape {
    pub(super) near: Distance,
}

impl Shape {
    pub(super) fn new(mesh: &Mesh) -> Self {
        Shape {
            near: Distance::new(mesh),
        }
    }

    /// Signed distance, mm; far outside for a shape of nothing.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        self.near.foot(p).map_or(f64::INFINITY, |f| f.distance)
    }
}
