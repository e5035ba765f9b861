//! Whether two triangles cut each other, by exact signs (adaptive predicates: Shewchuk 1997).

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::{Mesh, math::DVec3};

type Triangle = [DVec3; 3];

/// On which side of the plane of `t` a point lies; exact sign.
fn side(t: &Triangle, p: DVec3) -> f64 {
    let c = |p: DVec3| Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    orient3d(c(t[0]), c(t[1]), c(t[2]), c(p))
}

/// Whether two triangles of a mesh pass through each other or overlap in one plane.
///
/// Touching does not count: an edge that ends on the other triangle, or triangles that share corners or an edge
/// without overlap. Triangles without area cut nothing.
pub(super) fn triangles_intersect(mesh: &Mesh, a: u32, b: u32) -> bool {
    let (va, vb) = (mesh.triangles[a as usize], mesh.triangles[b as usize]);
    let (a, b) = (&mesh.corners(a as usize), &mesh.corners(b as usize));
    // a shared corner lies in the plane: known without the predicate, which is slowest just then
    let sides = |own: [u32; 3], points: &Triangle, other: [u32; 3], plane: &Triangle| {
        [0, 1, 2].map(|k| {
            if other.contains(&own[k]) {
                0.0
            } else {
                side(plane, points[k])
            }
        })
    };
    let apart = |s: &[f64; 3]| {
        s.iter().all(|&x| x >= 0.0) && s.iter().any(|&x| x > 0.0)
            || s.iter().all(|&x| x <= 0.0) && s.iter().any(|&x| x < 0.0)
    };
    let of_a = sides(va, a, vb, b);
    if apart(&of_a) {
        return false;
    }
    let of_b = sides(vb, b, va, a);
    if apart(&of_b) {
        return false;
    }
    if of_a == [0.0; 3] && of_b == [0.0; 3] {
        return overlap_in_plane(a, b);
    }
    pierces(a, &of_a, b) || pierces(b, &of_b, a)
}

/// Whether an edge of `a` goes through `b`; `sides` tells where the corners of `a` lie.
fn pierces(a: &Triangle, sides: &[f64; 3], b: &Triangle) -> bool {
    (0..3).any(|k| {
        let next = (k + 1) % 3;
        if !(sides[k] > 0.0 && sides[next] < 0.0 || sides[k] < 0.0 && sides[next] > 0.0) {
            return false;
        }
        let (p, q) = (a[k], a[next]);
        let turns = [0, 1, 2].map(|e| side(&[p, b[e], b[(e + 1) % 3]], q));
        turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
    })
}

/// Whether two triangles of one plane share more than their rims.
fn overlap_in_plane(a: &Triangle, b: &Triangle) -> bool {
    let normal = (a[1] - a[0]).cross(a[2] - a[0]);
    if normal == DVec3::ZERO {
        return false;
    }
    // drop the coordinate along which the plane is seen best
    let flat = |p: DVec3| {
        let n = normal.abs();
        if n.z >= n.x && n.z >= n.y {
            Coord { x: p.x, y: p.y }
        } else if n.y >= n.x {
            Coord { x: p.z, y: p.x }
        } else {
            Coord { x: p.y, y: p.z }
        }
    };
    let turned = |t: &Triangle| {
        let mut t = t.map(flat);
        let area = orient2d(t[0], t[1], t[2]);
        if area < 0.0 {
            t.swap(1, 2);
        }
        (t, area != 0.0)
    };
    let ((a, a_has_area), (b, b_has_area)) = (turned(a), turned(b));
    // interiors are apart when an edge of one has the whole other on its outer side
    let separates = |a: &[Coord<f64>; 3], b: &[Coord<f64>; 3]| {
        (0..3).any(|k| b.iter().all(|&p| orient2d(a[k], a[(k + 1) % 3], p) <= 0.0))
    };
    a_has_area && b_has_area && !separates(&a, &b) && !separates(&b, &a)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(points: [[f64; 3]; 3]) -> Triangle {
        points.map(DVec3::from)
    }

    #[test]
    fn crossing_counts_and_touching_does_not() {
        let a = triangle([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let through = triangle([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [5.0, 5.0, 1.0]]);
        let standing = triangle([[1.0, 1.0, 0.0], [1.0, 1.0, 3.0], [2.0, 1.0, 3.0]]);
        let beside = triangle([[4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]]);
        let over = triangle([[0.5, 0.5, 0.0], [9.0, 0.5, 0.0], [0.5, 9.0, 0.0]]);
        let far = triangle([[1.0, 1.0, 5.0], [1.0, 2.0, 6.0], [2.0, 1.0, 7.0]]);
        for (b, wanted) in [
            (through, true),
            (standing, false),
            (beside, false),
            (over, true),
            (far, false),
            (a, true),
        ] {
            let mesh = Mesh {
                vertices: [a, b].concat(),
                triangles: vec![[0, 1, 2], [3, 4, 5]],
            };
            assert_eq!(triangles_intersect(&mesh, 0, 1), wanted, "{b:?}");
            assert_eq!(triangles_intersect(&mesh, 1, 0), wanted, "{b:?} first");
            // and with shared corners named as such
            let mut welded = mesh.clone();
            crate::weld::weld(&mut welded, 0.0);
            assert_eq!(triangles_intersect(&welded, 0, 1), wanted, "{b:?} welded");
        }
    }
}
