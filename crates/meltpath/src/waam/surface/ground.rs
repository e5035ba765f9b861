//! What layers that are not flat stand on, as a mesh: under the metal, in collisions, and to look at.

use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_planning::surface::Base;

use super::plan::{Ground, SurfacePlan};

/// What a plane is the top of, mm thick.
const SLAB: f64 = 4.0;
/// Corners that stand for a circle: 0.04 mm off at a radius of 1 m.
const CORNERS: u32 = 360;

/// What stands there before the first pass: the body, or a cylinder as long as the passes on it. A plane is that of the plate.
pub(crate) fn standing(plan: &SurfacePlan) -> Option<Mesh> {
    let (origin, axis, radius) = match &plan.ground {
        Ground::Body(meshes) => return Some(meshes.body.clone()),
        Ground::Base(Base::Plane { .. }) => return None,
        Ground::Base(Base::Cylinder {
            origin,
            axis,
            radius,
        }) => (*origin, axis.normalize_or_zero(), *radius),
    };
    let points = plan.passes.iter().flat_map(|p| &p.points);
    let along = points.map(|p| (p.position - origin).dot(axis));
    let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
        (low.min(z), high.max(z))
    });
    (low < high).then(|| cylinder(origin + low * axis, (high - low) * axis, radius))
}

/// The body of a base, as far as a box needs it and farther.
pub(super) fn solid(base: &Base, (low, high): (DVec3, DVec3)) -> Mesh {
    let (middle, reach) = (0.5 * (low + high), low.distance(high));
    match *base {
        Base::Plane { origin, normal } => {
            let up = normal.normalize_or_zero();
            let (u, v) = up.any_orthonormal_pair();
            let centre = middle - (middle - origin).dot(up) * up;
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let corner = |(a, b): (f64, f64)| centre + reach * (a * u + b * v);
            prism(&corners.map(corner), -SLAB * up)
        }
        Base::Cylinder {
            origin,
            axis,
            radius,
        } => {
            let along = axis.normalize_or_zero();
            let end = origin + ((middle - origin).dot(along) - reach) * along;
            cylinder(end, 2.0 * reach * along, radius)
        }
    }
}

/// A cylinder from the middle of one end along a way.
fn cylinder(end: DVec3, along: DVec3, radius: f64) -> Mesh {
    let (u, v) = along.normalize_or_zero().any_orthonormal_pair();
    let corner = |i: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(CORNERS)).sin_cos();
        end + radius * (cos * u + sin * v)
    };
    let outline: Vec<DVec3> = (0..CORNERS).map(corner).collect();
    prism(&outline, along)
}

/// A convex outline drawn along a way.
fn prism(outline: &[DVec3], along: DVec3) -> Mesh {
    let n = outline.len() as u32;
    let mut mesh = Mesh {
        vertices: outline.to_vec(),
        triangles: Vec::new(),
    };
    mesh.vertices.extend(outline.iter().map(|p| *p + along));
    for i in 0..n {
        let next = (i + 1) % n;
        mesh.triangles
            .extend([[i, next, n + next], [i, n + next, n + i]]);
        if i > 0 && next > 0 {
            mesh.triangles.extend([[0, next, i], [n, n + i, n + next]]);
        }
    }
    mesh
}
