//! Distance of a point to a segment.

use meltpath_geometry::math::DVec2;

/// Distance from `p` to the segment `a`–`b`, mm.
#[inline]
pub fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let squared = along.length_squared();
    let t = if squared > 0.0 {
        ((p - a).dot(along) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p - a - along * t).length()
}
