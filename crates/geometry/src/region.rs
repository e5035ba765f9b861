//! Regions of a plane: an outer boundary with holes.

use serde::{Deserialize, Serialize};

use crate::math::DVec2;

/// A closed polygon, mm; the last point joins the first and is not repeated.
pub type Ring = Vec<DVec2>;

/// A connected piece of a plane: one outer ring (counter-clockwise) and its holes (clockwise).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Outer boundary, counter-clockwise.
    pub outer: Ring,
    /// Holes, clockwise, inside `outer` and apart from each other.
    pub holes: Vec<Ring>,
}

impl Region {
    /// A rectangle along the axes between two corners, mm.
    ///
    /// ```
    /// use meltpath_geometry::Region;
    /// use meltpath_geometry::math::DVec2;
    /// assert_eq!(Region::rectangle(DVec2::ZERO, DVec2::new(3.0, 2.0)).area(), 6.0);
    /// ```
    pub fn rectangle(low: DVec2, high: DVec2) -> Region {
        let (right, left) = (DVec2::new(high.x, low.y), DVec2::new(low.x, high.y));
        Region {
            outer: vec![low, right, high, left],
            holes: Vec::new(),
        }
    }

    /// Area inside the outer ring and outside the holes, mm².
    pub fn area(&self) -> f64 {
        signed_area(&self.outer) + self.holes.iter().map(|h| signed_area(h)).sum::<f64>()
    }

    /// Whether a point lies inside the outer ring and outside the holes.
    ///
    /// ```
    /// use meltpath_geometry::Region;
    /// use meltpath_geometry::math::DVec2;
    /// let triangle = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]].map(DVec2::from_array);
    /// let region = Region { outer: triangle.to_vec(), holes: Vec::new() };
    /// assert!(region.contains(DVec2::new(0.5, 0.5)) && !region.contains(DVec2::new(1.5, 1.5)));
    /// ```
    pub fn contains(&self, p: DVec2) -> bool {
        let crossed = |ring: &Ring| {
            let ends = ring.iter().zip(ring.iter().cycle().skip(1));
            ends.filter(|(a, b)| crosses(**a, **b, p)).count()
        };
        self.rings().map(crossed).sum::<usize>() % 2 == 1
    }

    /// The outer ring, then the holes.
    pub fn rings(&self) -> impl Iterator<Item = &Ring> {
        std::iter::once(&self.outer).chain(&self.holes)
    }
}

/// Whether the ray from `p` along x crosses the edge from `a` to `b`, mm: a ring that it crosses an odd number of times is round `p`.
pub fn crosses(a: DVec2, b: DVec2, p: DVec2) -> bool {
    (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
}

/// Signed area of a ring, mm²: positive when counter-clockwise.
///
/// ```
/// use meltpath_geometry::{math::DVec2, region::signed_area};
/// let square = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
/// assert_eq!(signed_area(&square), 1.0);
/// ```
pub fn signed_area(ring: &[DVec2]) -> f64 {
    let Some(&o) = ring.first() else { return 0.0 };
    let next = ring.iter().cycle().skip(1);
    0.5 * ring
        .iter()
        .zip(next)
        .map(|(&a, &b)| (a - o).perp_dot(b - o))
        .sum::<f64>()
}
