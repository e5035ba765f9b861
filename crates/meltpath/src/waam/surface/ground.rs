//! What layers that are not flat stand on, as a mesh: under the metal, in collisions, and to look at.

use meltpath_geometry::Mesh;
use meltpath_geometry::math::{DAffine3, DVec3};
use meltpath_planning::surface::Base;

use super::plan::{Ground, SurfacePlan};
use crate::waam::drive::solids::Standing;
use crate::waam::settings::Settings;
use crate::waam::settings::holder::Holder;

/// How far a plate reaches around what stands on it where its size is not told, mm.
const AROUND: f64 = 25.0;

/// What a plane is the top of, mm thick.
const SLAB: f64 = 4.0;
/// Corners that stand for a circle: 0.04 mm off at a radius of 1 m.
const CORNERS: u32 = 360;

/// What stands there before the first pass: the body, a body of revolution, or a cylinder as long as the passes on it. A plane is that of
/// the plate.
pub(crate) fn standing(plan: &SurfacePlan) -> Option<Mesh> {
    let (origin, axis, radius) = match &plan.ground {
        Ground::Body(pieces) => return Some(pieces.body.clone()),
        Ground::Base(Base::Plane { .. }) => return None,
        Ground::Base(Base::Cylinder {
            origin,
            axis,
            radius,
        }) => (*origin, axis.normalize_or_zero(), *radius),
        Ground::Base(Base::Revolution {
            origin,
            axis,
            profile,
        }) => return Some(revolved(*origin, axis.normalize_or_zero(), profile)),
    };
    let points = plan.passes.iter().flat_map(|p| &p.points);
    let along = points.map(|p| (p.position - origin).dot(axis));
    let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
        (low.min(z), high.max(z))
    });
    (low < high).then(|| cylinder(origin + low * axis, (high - low) * axis, radius))
}

/// All that stands there before the first pass, for collisions: the body or the cylinder, the plate, and what holds them. Holders are written in
/// the coordinates of the file.
pub(in crate::waam) fn stands(
    plan: &SurfacePlan,
    settings: &Settings,
    build_from_file: &DAffine3,
) -> Standing {
    let body = standing(plan);
    let plate = plate(plan, body.as_ref(), settings);
    let placed = |holder: &Holder| Holder {
        ends: holder.ends.map(|p| build_from_file.transform_point3(p)),
        ..*holder
    };
    let holders: Vec<Holder> = settings.holders.iter().map(placed).collect();
    let round = holders.iter().map(round);
    Standing {
        meshes: body.into_iter().chain(plate).chain(round).collect(),
        holders,
        beads: Vec::new(),
    }
}

/// How far what stands on a plate spreads over it.
pub(super) struct Spread {
    /// A place on the plate's top, mm.
    pub(super) top: DVec3,
    /// Away from the plate.
    up: DVec3,
    /// Along its sides.
    pub(super) ways: [DVec3; 2],
    /// The middle along these from that place, mm: the plate's.
    pub(super) middle: [f64; 2],
    /// Half of what it spreads over, mm.
    half: [f64; 2],
}

/// How far passes and a body spread over the plate below; nothing where there is nothing.
pub(super) fn spread(plan: &SurfacePlan, body: Option<&Mesh>) -> Option<Spread> {
    let (top, up) = match &plan.ground {
        Ground::Base(Base::Plane { origin, normal }) => (*origin, normal.normalize_or(DVec3::Z)),
        Ground::Base(Base::Cylinder { .. } | Base::Revolution { .. }) | Ground::Body(_) => {
            (DVec3::ZERO, DVec3::Z)
        }
    };
    // along the axes of the build where it lies level, as its size is written
    let (u, v) = if up.dot(DVec3::Z) > 1.0 - 1e-9 {
        (DVec3::X, DVec3::Y)
    } else {
        up.any_orthonormal_pair()
    };
    let passes = plan.passes.iter().flat_map(|p| &p.points);
    let places = passes.map(|p| p.position);
    let places = places.chain(body.into_iter().flat_map(|b| b.vertices.iter().copied()));
    let (low, high) = places.fold(
        ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]),
        |(low, high), p| {
            let at = [u, v].map(|way| (p - top).dot(way));
            let each = |f: fn(f64, f64) -> f64, a: [f64; 2]| [f(a[0], at[0]), f(a[1], at[1])];
            (each(f64::min, low), each(f64::max, high))
        },
    );
    (low[0] <= high[0]).then(|| Spread {
        top,
        up,
        ways: [u, v],
        middle: [0, 1].map(|i| 0.5 * (low[i] + high[i])),
        half: [0, 1].map(|i| 0.5 * (high[i] - low[i])),
    })
}

/// The plate under a base or a body; nothing where there is none.
fn plate(plan: &SurfacePlan, body: Option<&Mesh>, settings: &Settings) -> Option<Mesh> {
    if settings.plate_thickness <= 0.0 {
        return None;
    }
    let on = spread(plan, body)?;
    let ([u, v], up) = (on.ways, on.up);
    let half = |i: usize| match settings.plate {
        Some(size) => 0.5 * size[i],
        None => on.half[i] + AROUND,
    };
    let middle = on.top + on.middle[0] * u + on.middle[1] * v;
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corner = |(a, b): (f64, f64)| middle + a * half(0) * u + b * half(1) * v;
    let under = -settings.plate_thickness * up;
    Some(prism(&corners.map(|c| corner(c) + under), -under))
}

/// What is shown of what stands there: the body, and what holds it.
pub(crate) fn shown(plan: &SurfacePlan, holders: &[Holder]) -> Option<Mesh> {
    standing(plan)
        .into_iter()
        .chain(holders.iter().map(round))
        .reduce(|mut all, mesh| {
            all.add(&mesh);
            all
        })
}

/// A holder as a mesh.
fn round(holder: &Holder) -> Mesh {
    let [a, b] = holder.ends;
    cylinder(a, b - a, holder.radius)
}

/// The body of a base, as far as a box needs it and farther.
pub(super) fn solid(base: &Base, (low, high): (DVec3, DVec3)) -> Mesh {
    let (middle, reach) = (0.5 * (low + high), low.distance(high));
    match base {
        Base::Plane { origin, normal } => {
            let up = normal.normalize_or_zero();
            let (u, v) = up.any_orthonormal_pair();
            let centre = middle - (middle - *origin).dot(up) * up;
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
            let end = *origin + ((middle - *origin).dot(along) - reach) * along;
            cylinder(end, 2.0 * reach * along, *radius)
        }
        Base::Revolution {
            origin,
            axis,
            profile,
        } => revolved(*origin, axis.normalize_or_zero(), profile),
    }
}

/// A closed mesh of a body of revolution: places along the axis with the radius there, flat ends. Rims of no radius are tips.
fn revolved(origin: DVec3, axis: DVec3, profile: &[[f64; 2]]) -> Mesh {
    let (u, v) = axis.any_orthonormal_pair();
    let mut mesh = Mesh::default();
    // a rim of one point where the body ends in a tip
    let rim = |mesh: &mut Mesh, along: f64, radius: f64| -> Vec<u32> {
        let first = mesh.vertices.len() as u32;
        let count = if radius > 0.0 { CORNERS } else { 1 };
        let corner = |i: u32| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(CORNERS)).sin_cos();
            origin + along * axis + radius * (cos * u + sin * v)
        };
        mesh.vertices.extend((0..count).map(corner));
        (0..CORNERS).map(|i| first + i % count).collect()
    };
    let (Some(&[low, _]), Some(&[high, _])) = (profile.first(), profile.last()) else {
        return mesh;
    };
    let mut before = rim(&mut mesh, low, 0.0);
    let rims = profile.iter().filter(|[_, radius]| *radius > 0.0).copied();
    for [along, radius] in rims.chain([[high, 0.0]]) {
        let after = rim(&mut mesh, along, radius);
        for i in 0..CORNERS as usize {
            let next = (i + 1) % CORNERS as usize;
            let [a, b, c, d] = [before[i], before[next], after[next], after[i]];
            if a != b {
                mesh.triangles.push([a, b, c]);
            }
            if c != d {
                mesh.triangles.push([a, c, d]);
            }
        }
        before = after;
    }
    mesh
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
