//! How much of a surface lies in its base.

use meltpath_geometry::Mesh;
use meltpath_planning::surface::Base;

/// The share of a surface's area that lies in its base.
pub(super) fn in_base(mesh: &Mesh, base: &Base) -> f64 {
    let (mut all, mut under) = (0.0, 0.0);
    for corners in mesh
        .triangles
        .iter()
        .map(|t| t.map(|i| mesh.vertices[i as usize]))
    {
        let [a, b, c] = corners;
        let area = 0.5 * (b - a).cross(c - a).length();
        all += area;
        under += area * share_below(corners.map(|p| base.distance(p)));
    }
    if all > 0.0 { under / all } else { 0.0 }
}

/// The share of a triangle below zero, from the heights of its corners.
fn share_below(heights: [f64; 3]) -> f64 {
    let mut h = heights;
    h.sort_by(f64::total_cmp);
    let [low, middle, high] = h;
    if high <= 0.0 {
        1.0
    } else if low >= 0.0 {
        0.0
    } else if middle >= 0.0 {
        low * low / ((low - middle) * (low - high))
    } else {
        1.0 - high * high / ((high - low) * (high - middle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_lies_below_by_its_share() {
        for (heights, share) in [
            ([1.0, 2.0, 3.0], 0.0),
            ([-1.0, -2.0, 0.0], 1.0),
            // half of each side is a quarter of the area
            ([-1.0, 1.0, 1.0], 0.25),
            ([1.0, -1.0, -1.0], 0.75),
            ([-1.0, 0.0, 1.0], 0.5),
        ] {
            assert!((share_below(heights) - share).abs() < 1e-12, "{heights:?}");
        }
    }
}
