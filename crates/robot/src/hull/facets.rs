//! The skin of a convex hull of a few hundred points as triangles.

use meltpath_geometry::math::DVec3;
use meltpath_numerics::random::Random;

/// How far points are moved at most so that no four lie in a plane, as a share of the size of all: then every facet is a triangle, and no
/// rounding decides what is seen from where.
const MOVED: f64 = 1e-6;

/// A facet by the numbers of its corners, counter-clockwise from outside, and its plane.
#[derive(Debug, Clone, Copy)]
struct Facet {
    corners: [usize; 3],
    normal: DVec3,
    height: f64,
}

/// The triangles of the hull of points, counter-clockwise from outside, each true to a millionth of the hull's size; none of fewer than four
/// points.
pub(super) fn facets(points: &[DVec3]) -> Vec<[DVec3; 3]> {
    let Some((low, high)) = meltpath_geometry::mesh::bounds(points.iter().copied()) else {
        return Vec::new();
    };
    let size = (high - low).length();
    if points.len() < 4 || size <= 0.0 || !size.is_finite() {
        return Vec::new();
    }
    let mut random = Random::new(3);
    let mut beside = || MOVED * size * random.between(-1.0, 1.0);
    let moved: Vec<DVec3> = points
        .iter()
        .map(|p| *p + DVec3::new(beside(), beside(), beside()))
        .collect();
    let mut all = first(&moved);
    for (new, p) in moved.iter().enumerate().skip(4) {
        let sees = |f: &Facet| f.normal.dot(*p) > f.height;
        let seen: Vec<Facet> = all.iter().filter(|f| sees(f)).copied().collect();
        if seen.is_empty() {
            continue;
        }
        all.retain(|f| !sees(f));
        let edges: Vec<[usize; 2]> = seen.iter().flat_map(Facet::edges).collect();
        for [a, b] in &edges {
            // an edge whose other side is not seen is on the horizon
            if !edges.contains(&[*b, *a]) {
                all.push(facet(&moved, [*a, *b, new]));
            }
        }
    }
    all.iter().map(|f| f.corners.map(|c| points[c])).collect()
}

/// The volume of the hull of points, mm³.
pub(super) fn volume(points: &[DVec3]) -> f64 {
    let Some(origin) = points.first() else {
        return 0.0;
    };
    let of = |[a, b, c]: [DVec3; 3]| (a - *origin).dot((b - *origin).cross(c - *origin));
    let sum: f64 = facets(points).into_iter().map(of).sum();
    (sum / 6.0).max(0.0)
}

impl Facet {
    fn edges(&self) -> [[usize; 2]; 3] {
        let [a, b, c] = self.corners;
        [[a, b], [b, c], [c, a]]
    }
}

fn facet(points: &[DVec3], corners: [usize; 3]) -> Facet {
    let [a, b, c] = corners.map(|i| points[i]);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    Facet {
        corners,
        normal,
        height: normal.dot(a),
    }
}

/// The tetrahedron of the first four.
fn first(points: &[DVec3]) -> Vec<Facet> {
    let faces = [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 3, 2, 0]];
    let outward = |[a, b, c, other]: [usize; 4]| {
        let one = facet(points, [a, b, c]);
        if one.normal.dot(points[other]) > one.height {
            facet(points, [a, c, b])
        } else {
            one
        }
    };
    faces.map(outward).to_vec()
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::shapes::cuboid;

    use super::*;

    #[test]
    fn hulls_have_their_volumes() {
        let mut points = cuboid(DVec3::ZERO, DVec3::new(2.0, 3.0, 4.0)).vertices;
        // what lies within or on the skin adds nothing
        points.extend([DVec3::ONE, DVec3::new(2.0, 1.0, 1.0), points[0], points[3]]);
        points.rotate_left(5);
        assert!((volume(&points) - 24.0).abs() < 1e-3, "{}", volume(&points));
        assert_eq!(volume(&points[..3]), 0.0);
        let flat = [[0.0, 0.0], [5.0, 0.0], [5.0, 5.0], [0.0, 5.0], [2.0, 2.0]];
        let flat = flat.map(|[x, y]| DVec3::new(x, y, 1.0));
        assert!(volume(&flat) < 1e-3);
        let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let both: f64 = facets(&flat).into_iter().map(area).sum();
        assert!((both - 50.0).abs() < 1e-3, "{both}");
        let mut random = Random::new(1);
        let ball: Vec<DVec3> = (0..400)
            .map(|_| DVec3::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0))))
            .map(|p| 100.0 * p.normalize_or(DVec3::X))
            .collect();
        let all = facets(&ball);
        // Euler's formula
        assert_eq!(all.len(), 2 * 400 - 4);
        for [a, b, c] in all {
            let normal = (b - a).cross(c - a).normalize();
            let out = |p: &DVec3| normal.dot(*p - a);
            assert!(ball.iter().map(out).fold(0.0, f64::max) < 1e-3);
        }
    }
}
