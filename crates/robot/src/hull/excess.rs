//! How far the hull of points stands beyond a mesh: what is told nearer to it than it is.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use meltpath_geometry::math::DVec3;
use meltpath_geometry::sight::Sight;

use super::facets::facets;

/// How far a hull stands beyond its mesh, mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Excess {
    /// At a place that was looked at.
    pub least: f64,
    /// No more than this anywhere.
    pub most: f64,
    /// That place, in the frame of the mesh, mm.
    pub place: DVec3,
}

impl Excess {
    /// The farther of two.
    pub(super) fn or(self, other: Excess) -> Excess {
        let farther = if other.least > self.least {
            other
        } else {
            self
        };
        Excess {
            most: self.most.max(other.most),
            ..farther
        }
    }
}

/// How exactly it is found: to this share of it.
const SHARE: f64 = 0.1;

/// A triangle of the hull's skin, and how far of the mesh it is at most, mm.
struct Open {
    corners: [DVec3; 3],
    most: f64,
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Open {}
impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.most.total_cmp(&other.most)
    }
}

/// How far the skin of the hull of points is from a mesh where it lies outside of it, mm: exactly to a tenth or to `fine` mm, from `looks`
/// places at most. What comes from outside to a convex body meets its skin first.
pub(super) fn excess(points: &[DVec3], sight: &Sight, fine: f64, looks: usize) -> Excess {
    let skin = match *points {
        [] => return Excess::default(),
        // what is flat by its number of points is its own skin
        [a] => vec![[a; 3]],
        [a, b] => vec![[a, b, b]],
        [a, b, c] => vec![[a, b, c]],
        _ => facets(points),
    };
    let mut open: BinaryHeap<Open> = skin
        .into_iter()
        .map(|corners| Open {
            corners,
            most: f64::INFINITY,
        })
        .collect();
    let (mut least, mut worst) = (0.0_f64, points[0]);
    // what is set aside
    let mut most = 0.0_f64;
    let mut left = looks;
    while let Some(Open {
        corners,
        most: told,
    }) = open.pop()
    {
        if told <= (least * (1.0 + SHARE)).max(fine) || left == 0 {
            most = most.max(told);
            break;
        }
        left -= 1;
        let place = 1.0 / 3.0 * (corners[0] + corners[1] + corners[2]);
        let Some((face, far)) = sight.nearest(place) else {
            return Excess::default();
        };
        let reach = corners
            .map(|c| c.distance(place))
            .into_iter()
            .fold(0.0, f64::max);
        // a distance from what is convex is greatest at a corner
        let of_face = corners
            .map(|c| to_triangle(face, c))
            .into_iter()
            .fold(0.0, f64::max);
        let enough = (least * (1.0 + SHARE)).max(fine);
        let here = if of_face.min(reach + far) <= enough {
            of_face.min(reach + far)
        } else if far > least && sight.is_inside(place) {
            of_face.min((reach - far).max(0.0))
        } else {
            if far > least {
                (least, worst) = (far, place);
            }
            of_face.min(reach + far)
        };
        let here = here.min(told);
        if here <= (least * (1.0 + SHARE)).max(fine) {
            most = most.max(here);
            continue;
        }
        open.extend(halves(corners).map(|corners| Open {
            corners,
            most: here,
        }));
    }
    Excess {
        least,
        most,
        place: worst,
    }
}

/// Both halves of a triangle, across its longest side.
fn halves([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 2] {
    let sides = [[a, b, c], [b, c, a], [c, a, b]];
    let long = |s: &[DVec3; 3]| s[0].distance_squared(s[1]);
    let [a, b, c] = sides
        .into_iter()
        .max_by(|s, t| long(s).total_cmp(&long(t)))
        .unwrap_or(sides[0]);
    let middle = a.midpoint(b);
    [[a, middle, c], [middle, b, c]]
}

/// The distance of a point from a triangle, mm.
fn to_triangle(corners: [DVec3; 3], p: DVec3) -> f64 {
    let foremost = |d: DVec3| {
        let [a, b, c] = corners;
        let best = if b.dot(d) > a.dot(d) { b } else { a };
        if c.dot(d) > best.dot(d) { c } else { best }
    };
    let told = super::distance(|_| p, foremost, p - corners[0], f64::INFINITY);
    // no less than it is
    told * (1.0 + 1e-5)
}
