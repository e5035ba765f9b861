//! Signed distance from a closed mesh: the nearest place, and on which side a point lies.
//!
//! The sign is that of the angle-weighted normal of the nearest triangle, edge or corner (Baerentzen and Aanaes 2005), which holds at
//! sharp edges too. The mesh is closed and its triangles show outwards, as repaired parts do. An open one has two sides as far as its
//! rims; beyond them it can be taken to go on along its tangent.

use crate::bvh::{Bvh, meets};
use crate::math::DVec3;
use crate::topology::{edges, half_edges};
use crate::{Mesh, topology::is_degenerate};

/// A mesh that is asked for distances.
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
    /// Of each triangle which of its sides are a rim, side k from corner k on.
    rim_sides: Vec<[bool; 3]>,
    /// Whether each vertex is on a rim.
    rim_corners: Vec<bool>,
}

/// Where on a mesh.
#[derive(Debug, Clone, Copy)]
struct On {
    point: DVec3,
    /// The normal over the face, side or corner, of any length.
    normal: DVec3,
    rim: bool,
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
        let mut rim_sides = vec![[false; 3]; faces.len()];
        let mut rim_corners = vec![false; mesh.vertices.len()];
        let sorted = half_edges(&mesh);
        for edge in edges(&sorted) {
            let sum: DVec3 = edge.iter().map(|h| faces[h.triangle() as usize]).sum();
            for side in edge {
                let (t, k) = (side.triangle() as usize, (side.corner % 3) as usize);
                sides[t][k] = sum;
                if edge.len() == 1 {
                    rim_sides[t][k] = true;
                    for end in [k, (k + 1) % 3] {
                        rim_corners[mesh.triangles[t][end] as usize] = true;
                    }
                }
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
            rim_sides,
            rim_corners,
        }
    }

    /// The nearest place; `None` of an empty mesh, or where the point is not finite.
    pub fn foot(&self, p: DVec3) -> Option<Foot> {
        self.nearest(p).map(|(_, on)| Foot::from(on, p))
    }

    /// The same of a mesh that goes on beyond its rims along its tangent there: what is nearest to a rim is as far as that plane.
    pub fn foot_beyond(&self, p: DVec3) -> Option<Foot> {
        let (_, on) = self.nearest(p)?;
        if !on.rim {
            return Some(Foot::from(on, p));
        }
        let outward = on.normal.normalize_or_zero();
        let distance = (p - on.point).dot(outward);
        Some(Foot {
            point: p - distance * outward,
            distance,
            outward,
        })
    }

    /// The corners of the nearest triangle, and how far it is on either side, mm.
    pub(crate) fn nearest_face(&self, p: DVec3) -> Option<([DVec3; 3], f64)> {
        let (t, on) = self.nearest(p)?;
        Some((self.mesh.corners(t as usize), on.point.distance(p)))
    }

    /// Whether a ray meets it ahead of its origin.
    pub(crate) fn is_met(&self, origin: DVec3, direction: DVec3) -> bool {
        self.tree.any_along_ray(origin, direction, |t| {
            meets(&self.mesh.corners(t as usize), origin, direction)
        })
    }

    fn nearest(&self, p: DVec3) -> Option<(u32, On)> {
        let mut best: Option<(f64, u32, On)> = None;
        self.tree.nearest(p, |t| {
            let on = self.on_triangle(t, p);
            let squared = on.point.distance_squared(p);
            let near = best.map_or(f64::INFINITY, |b| b.0);
            if squared < near {
                best = Some((squared, t, on));
            }
            near.min(squared)
        });
        best.map(|(_, t, on)| (t, on))
    }

    /// The nearest point of a triangle, and the normal over the face, side or corner on which it lies (Ericson 2005, § 5.1.5).
    fn on_triangle(&self, t: u32, p: DVec3) -> On {
        let t = t as usize;
        let corners = self.mesh.corners(t);
        let [a, b, c] = corners;
        let corner = |k: usize| {
            let vertex = self.mesh.triangles[t][k] as usize;
            On {
                point: corners[k],
                normal: self.corners[vertex],
                rim: self.rim_corners[vertex],
            }
        };
        let side = |point: DVec3, k: usize| On {
            point,
            normal: self.sides[t][k],
            rim: self.rim_sides[t][k],
        };
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return corner(0);
        }
        let bp = p - b;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return corner(1);
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return side(a + ab * (d1 / (d1 - d3)), 0);
        }
        let cp = p - c;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return corner(2);
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return side(a + ac * (d2 / (d2 - d6)), 2);
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return side(b + (c - b) * share, 1);
        }
        let sum = va + vb + vc;
        On {
            point: a + ab * (vb / sum) + ac * (vc / sum),
            normal: self.faces[t],
            rim: false,
        }
    }
}

/// Closed meshes that may reach into each other, as the one body that they are together.
#[derive(Debug)]
pub struct Union {
    meshes: Vec<Distance>,
}

impl Union {
    /// Of meshes; copies are kept.
    pub fn new<'a>(meshes: impl IntoIterator<Item = &'a Mesh>) -> Self {
        Union {
            meshes: meshes.into_iter().map(Distance::new).collect(),
        }
    }

    /// The nearest place; `None` of nothing, or where the point is not finite. Inside, where meshes reach into each other, the surface may
    /// be farther than it says.
    pub fn foot(&self, p: DVec3) -> Option<Foot> {
        self.nearest(p).map(|(_, foot)| foot)
    }

    /// The same with the number of the mesh that it is on, from 0.
    pub fn nearest(&self, p: DVec3) -> Option<(usize, Foot)> {
        let each = self.meshes.iter().enumerate();
        let feet = each.filter_map(|(i, mesh)| Some((i, mesh.foot(p)?)));
        feet.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))
    }
}

impl Foot {
    fn from(on: On, p: DVec3) -> Self {
        let away = p - on.point;
        let outside = away.dot(on.normal) >= 0.0;
        let distance = away.length();
        let sense = if outside { 1.0 } else { -1.0 };
        // over a way so short rounding has the direction
        let outward = if distance > 1e-9 {
            sense * away / distance
        } else {
            on.normal.normalize_or_zero()
        };
        Foot {
            point: on.point,
            distance: sense * distance,
            outward,
        }
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

    /// A square that goes on as its plane, however far beside it one asks; without that it ends at its rim.
    #[test]
    fn beyond_its_rims_a_sheet_goes_on_along_its_tangent() {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        let lie = |(x, y): (f64, f64)| DVec3::new(x, y, 1.0 + 0.25 * x);
        let sheet = Mesh {
            vertices: corners.map(lie).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let near = Distance::new(&sheet);
        let normal = DVec3::new(-0.25, 0.0, 1.0).normalize();
        for x in [-3.0, 0.0, 1.0, 4.0, 6.5] {
            for y in [-2.0, 0.0, 2.5, 4.0, 9.0] {
                for z in [-1.0, 3.0] {
                    let p = DVec3::new(x, y, z);
                    let wanted = (p - lie((0.0, 0.0))).dot(normal);
                    let foot = near.foot_beyond(p).unwrap();
                    assert!((foot.distance - wanted).abs() < 1e-12, "{p:?} {foot:?}");
                    assert!(foot.outward.distance(normal) < 1e-9, "{foot:?}");
                    assert!((foot.point + foot.distance * foot.outward).distance(p) < 1e-12);
                }
            }
        }
        let beside = near.foot(DVec3::new(-3.0, 2.0, 1.0)).unwrap();
        assert!((beside.distance.abs() - 3.0).abs() < 1e-12, "{beside:?}");
    }

    /// A bar through a plate: outside of both the nearest place is that of the nearer, and what is inside of one is inside.
    #[test]
    fn meshes_that_reach_into_each_other_are_one_body() {
        let plate = shapes::cuboid(DVec3::new(0.0, 0.0, -5.0), DVec3::new(40.0, 40.0, 0.0));
        let bar = shapes::cuboid(DVec3::new(15.0, 15.0, -3.0), DVec3::new(25.0, 25.0, 30.0));
        let both = Union::new([&plate, &bar]);
        let at = |x: f64, z: f64| both.nearest(DVec3::new(x, 20.0, z)).unwrap();
        for (x, z, mesh, distance, outward) in [
            (10.0, 2.0, 0, 2.0, DVec3::Z),
            (10.0, 12.0, 1, 5.0, DVec3::NEG_X),
            (20.0, 33.0, 1, 3.0, DVec3::Z),
        ] {
            let (number, foot) = at(x, z);
            assert_eq!(
                (number, foot.distance, foot.outward),
                (mesh, distance, outward)
            );
        }
        // in the bar over the plate, and in both
        assert_eq!(at(17.0, 10.0).1.distance, -2.0);
        assert!(at(20.0, -1.0).1.distance < 0.0);
        assert_eq!(Union::new([]).foot(DVec3::ZERO), None);
    }

    #[test]
    fn nothing_is_nearest_to_nothing() {
        assert_eq!(Distance::new(&Mesh::default()).foot(DVec3::ZERO), None);
    }
}
