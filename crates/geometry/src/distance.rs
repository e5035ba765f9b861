//! Signed distance from a closed mesh: the nearest place, and on which side a point lies.
//!
//! The sign is that of the angle-weighted normal of the nearest triangle, edge or corner (Baerentzen and Aanaes 2005), which holds at
//! sharp edges too. The mesh is closed and its triangles show outwards, as repaired parts do.

use crate::bvh::Bvh;
use crate::math::DVec3;
use crate::topology::{edges, half_edges};
use crate::{Mesh, topology::is_degenerate};

/// A closed mesh that is asked for distances.
#[derive(Debug)]
pub struct Distance {
    mesh: Mesh,
    tree: Bvh,
    /// Normal of each triangle, weightless where it has no area.
    faces: Vec<DVec3>,
    /// Of each triangle the normals over its three sides, side k from corner k on.
    sides: Vec<[DVec3; 3]>,
    /// Of each vertex.
    corners: Vec<DVec3>,
}

/// The nearest place of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Where, mm.
    pub point: DVec3,
    /// How far, mm: below zero inside.
    pub distance: f64,
    /// Outward unit direction there: from the foot to the point that was asked about, or the surface's own on it.
    pub outward: DVec3,
}

impl Distance {
    /// Of a mesh; its own copy is kept.
    pub fn new(mesh: &Mesh) -> Self {
        let mut mesh = mesh.clone();
        mesh.triangles.retain(|t| !is_degenerate(*t));
        let face = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let faces: Vec<DVec3> = (0..mesh.triangles.len()).map(face).collect();
        let mut sides = vec![[DVec3::ZERO; 3]; faces.len()];
        let sorted = half_edges(&mesh);
        for edge in edges(&sorted) {
            let sum: DVec3 = edge.iter().map(|h| faces[h.triangle() as usize]).sum();
            for side in edge {
                sides[side.triangle() as usize][(side.corner % 3) as usize] = sum;
            }
        }
        let mut corners = vec![DVec3::ZERO; mesh.vertices.len()];
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let p = mesh.corners(t);
            for k in 0..3 {
                let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                let angle = u.angle_between(v);
                if angle.is_finite() {
                    corners[triangle[k] as usize] += angle * faces[t];
                }
            }
        }
        Distance {
            tree: Bvh::new(&mesh),
            mesh,
            faces,
            sides,
            corners,
        }
    }

    /// The nearest place; `None` of an empty mesh, or where the point is not finite.
    pub fn foot(&self, p: DVec3) -> Option<Foot> {
        let mut best: Option<(f64, DVec3, DVec3)> = None;
        self.tree.nearest(p, |t| {
            let (point, feature) = self.on_triangle(t, p);
            let squared = point.distance_squared(p);
            let near = best.map_or(f64::INFINITY, |b| b.0);
            if squared < near {
                best = Some((squared, point, feature));
            }
            near.min(squared)
        });
        let (squared, point, normal) = best?;
        let away = p - point;
        let outside = away.dot(normal) >= 0.0;
        let distance = squared.sqrt();
        let sense = if outside { 1.0 } else { -1.0 };
        let own = normal.normalize_or_zero();
        // over a way so short rounding has the direction
        let outward = if distance > 1e-9 {
            sense * away / distance
        } else {
            own
        };
        Some(Foot {
            point,
            distance: sense * distance,
            outward,
        })
    }

    /// The nearest point of a triangle, and the normal over the face, side or corner on which it lies (Ericson 2005, § 5.1.5).
    fn on_triangle(&self, t: u32, p: DVec3) -> (DVec3, DVec3) {
        let t = t as usize;
        let [a, b, c] = self.mesh.corners(t);
        let corner = |k: usize| self.corners[self.mesh.triangles[t][k] as usize];
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return (a, corner(0));
        }
        let bp = p - b;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return (b, corner(1));
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (a + ab * (d1 / (d1 - d3)), self.sides[t][0]);
        }
        let cp = p - c;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return (c, corner(2));
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (a + ac * (d2 / (d2 - d6)), self.sides[t][2]);
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return (b + (c - b) * share, self.sides[t][1]);
        }
        let sum = va + vb + vc;
        (a + ab * (vb / sum) + ac * (vc / sum), self.faces[t])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::shapes;

    proptest! {
        /// Of a box the distance has a closed form, inside, beside faces, edges and corners.
        #[test]
        fn of_a_box_it_is_that_of_its_formula(x in -3.0..13.0_f64, y in -3.0..23.0_f64, z in -3.0..8.0_f64) {
            let size = DVec3::new(10.0, 20.0, 5.0);
            let near = Distance::new(&shapes::cuboid(DVec3::ZERO, size));
            let p = DVec3::new(x, y, z);
            let beyond = (p - 0.5 * size).abs() - 0.5 * size;
            let wanted = beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0);
            let foot = near.foot(p).unwrap();
            prop_assert!((foot.distance - wanted).abs() < 1e-9, "{} for {wanted}", foot.distance);
            prop_assert!((foot.point + foot.distance * foot.outward).distance(p) < 1e-9);
        }
    }

    #[test]
    fn nothing_is_nearest_to_nothing() {
        assert_eq!(Distance::new(&Mesh::default()).foot(DVec3::ZERO), None);
    }
}
