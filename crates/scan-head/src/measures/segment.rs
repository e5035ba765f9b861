//! Distance of a point to a segment.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::segments::nearest_share;

/// Distance from `p` to the segment `a`–`b`, mm.
#[inline]
pub fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let t = nearest_share((p - a).dot(along), along.length_squared());
    (p - a - along * t).length()
}
