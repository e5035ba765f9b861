//! A bead as strategies draw it.

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::Role;

/// A bead before it has a name.
#[derive(Clone, PartialEq)]
pub(crate) struct Bead {
    pub(crate) points: Vec<DVec2>,
    pub(crate) role: Role,
    /// How near its lines and arcs stay to the points, mm.
    pub(crate) tolerance: f64,
}
