//! A piece of surface laid out in a plane with the least stretch, and back: what is planned in the plane lies on the surface at the same
//! distances, exactly where the surface can be unrolled, within the stretch that is told elsewhere.
//!
//! As rigid as possible (Liu et al. 2008): each triangle keeps its shape and turns by itself, the vertices follow all of them; both in
//! turn until nothing moves. It begins with the view along the mean normal, so a surface that turns its back to it has none.

use std::f64::consts::FRAC_PI_2;

use crate::level::rims;
use crate::math::{DQuat, DVec2, DVec3};
use crate::{Mesh, Region};

/// Most turns of shapes and vertices.
const ROUNDS: usize = 200;
/// Steps of the solver within one round: the next begins where it ended.
const STEPS: usize = 15;
/// It rests where vertices move by less than this share of the mean side of its triangles.
const REST: f64 = 5e-4;
/// Triangles this much smaller than the mean tell no stretch: their sides are rounding.
const SHRED: f64 = 0.1;
/// Share of the area that may turn its back: shreds along edges of the body, not more.
const ROUNDING: f64 = 0.005;
/// A surface may lean so far from its mean normal, as the cosine: 81°.
const BACK: f64 = 0.15;

/// Why a surface cannot be laid out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FlattenError {
    /// Nothing there.
    #[error("the surface has no triangle with an area")]
    Empty,
    /// The surface turns its back to its mean normal.
    #[error("the surface turns away from its mean direction by {:.0} deg at ({:.1}, {:.1}, {:.1}) mm, and 81 deg can be laid out in a plane: divide the part into pieces that show in one direction each", .angle.to_degrees(), .at.x, .at.y, .at.z)]
    Back {
        /// The angle, rad.
        angle: f64,
        /// Where, mm.
        at: DVec3,
    },
}

/// A surface with its layout in a plane.
#[derive(Debug, Clone)]
pub struct Flat {
    mesh: Mesh,
    /// Where each vertex lies in the plane, mm.
    places: Vec<DVec2>,
    /// Triangles over each cell of a grid in the plane.
    cells: Vec<Vec<u32>>,
    low: DVec2,
    cell: f64,
    count: [usize; 2],
    /// Least and greatest length in the plane over that on the surface, each with its place.
    stretch: [(f64, DVec3); 2],
}

impl Flat {
    /// Lays out a connected piece of surface. The direction of x, seen along the mean normal, lies along x of the plane (of y on a
    /// surface that shows along x); the surface shows towards the reader.
    ///
    /// # Errors
    /// [`FlattenError`].
    pub fn new(mesh: &Mesh) -> Result<Self, FlattenError> {
        let area = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            0.5 * (b - a).cross(c - a)
        };
        let sum: DVec3 = (0..mesh.triangles.len()).map(area).sum();
        let mean = mesh.area() / mesh.triangles.len().max(1) as f64;
        if mean.is_nan() || mean <= 0.0 {
            return Err(FlattenError::Empty);
        }
        let normal = sum.try_normalize().unwrap_or(DVec3::Z);
        let (mut back, mut farthest) = (0.0, (1.0, DVec3::ZERO));
        for t in 0..mesh.triangles.len() {
            let own = area(t);
            let cosine = own.normalize_or(normal).dot(normal);
            if cosine < BACK {
                let [a, b, c] = mesh.corners(t);
                back += own.length();
                if own.length() > SHRED * mean && cosine < farthest.0 {
                    farthest = (cosine, (a + b + c) / 3.0);
                }
            }
        }
        if back > ROUNDING * mesh.area() {
            return Err(FlattenError::Back {
                angle: farthest.0.acos(),
                at: farthest.1,
            });
        }
        let reference = if normal.x.abs() < 0.99 {
            DVec3::X
        } else {
            DVec3::Y
        };
        let along = reference.reject_from(normal).normalize();
        let across = DQuat::from_axis_angle(normal, FRAC_PI_2) * along;
        let seen = |p: &DVec3| DVec2::new(p.dot(along), p.dot(across));
        let mut places: Vec<DVec2> = mesh.vertices.iter().map(seen).collect();
        Layout::new(mesh).settle(&mut places, mean.sqrt());
        turned_back(mesh, &mut places, seen);
        Ok(Flat::laid(mesh.clone(), places, mean))
    }

    fn laid(mesh: Mesh, places: Vec<DVec2>, mean: f64) -> Self {
        let cell = 2.0 * mean.sqrt();
        let (low, high) = around(&places);
        let count = ((high - low) / cell)
            .floor()
            .to_array()
            .map(|n| n as usize + 1);
        let mut flat = Flat {
            cells: vec![Vec::new(); count[0] * count[1]],
            stretch: [(f64::INFINITY, DVec3::ZERO), (0.0, DVec3::ZERO)],
            low,
            cell,
            count,
            mesh,
            places,
        };
        for t in 0..flat.mesh.triangles.len() {
            let corners = flat.mesh.triangles[t].map(|v| flat.places[v as usize]);
            let (from, to) = (
                flat.at(corners[0].min(corners[1]).min(corners[2])),
                flat.at(corners[0].max(corners[1]).max(corners[2])),
            );
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    flat.cells[y * count[0] + x].push(t as u32);
                }
            }
            let [p, q, r] = flat.mesh.corners(t);
            let [a, b, c] = corners;
            let turned = (b - a).perp_dot(c - a) <= 0.0;
            if !turned && 0.5 * (q - p).cross(r - p).length() > SHRED * mean {
                let [least, greatest] = stretched([p, q, r], corners);
                let middle = (p + q + r) / 3.0;
                if least < flat.stretch[0].0 {
                    flat.stretch[0] = (least, middle);
                }
                if greatest > flat.stretch[1].0 {
                    flat.stretch[1] = (greatest, middle);
                }
            }
        }
        flat
    }

    fn at(&self, p: DVec2) -> [usize; 2] {
        let at = ((p - self.low) / self.cell).floor().to_array();
        [0, 1].map(|k| (at[k].max(0.0) as usize).min(self.count[k] - 1))
    }

    /// Least and greatest length in the plane over that on the surface, with their places on it.
    pub fn stretch(&self) -> [(f64, DVec3); 2] {
        self.stretch
    }

    /// Corners of the layout in the plane, mm.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        around(&self.places)
    }

    /// The rims of the surface, closed lines in space that repeat their first point.
    pub fn rims(&self) -> Vec<Vec<DVec3>> {
        let line = |ring: Vec<u32>| -> Vec<DVec3> {
            let closed = ring.iter().chain(ring.first());
            closed.map(|&v| self.mesh.vertices[v as usize]).collect()
        };
        rims(&self.mesh).into_iter().map(line).collect()
    }

    /// The surface's outline in the plane: its longest rim around it, the others as holes.
    pub fn region(&self) -> Region {
        let place = |line: Vec<u32>| -> Vec<DVec2> {
            line.iter().map(|&v| self.places[v as usize]).collect()
        };
        let mut rings: Vec<Vec<DVec2>> = rims(&self.mesh).into_iter().map(place).collect();
        let area = |ring: &Vec<DVec2>| {
            let ends = ring.iter().zip(ring.iter().cycle().skip(1));
            0.5 * ends.map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
        };
        let widest = (0..rings.len()).max_by(|&a, &b| area(&rings[a]).total_cmp(&area(&rings[b])));
        let outer = widest.map_or_else(Vec::new, |i| rings.swap_remove(i));
        rings.retain(|ring| area(ring) < 0.0);
        Region {
            outer,
            holes: rings,
        }
    }

    /// The place on the surface of a point of the plane; of one beside the layout the nearest within a few triangles, else `None`.
    pub fn lift(&self, p: DVec2) -> Option<DVec3> {
        let [x, y] = self.at(p);
        let mut best: Option<(f64, DVec3)> = None;
        for reach in 0..=2_usize {
            let rows = y.saturating_sub(reach)..=(y + reach).min(self.count[1] - 1);
            for cy in rows {
                let columns = x.saturating_sub(reach)..=(x + reach).min(self.count[0] - 1);
                for cx in columns {
                    for &t in &self.cells[cy * self.count[0] + cx] {
                        let found = self.on(t, p);
                        if best.is_none_or(|b| found.0 < b.0) {
                            best = Some(found);
                        }
                    }
                }
            }
            if best.is_some_and(|b| b.0 < 1e-12) {
                break;
            }
        }
        best.map(|b| b.1)
    }

    /// How far a point of the plane lies beside a triangle, mm squared, and the nearest place on the triangle's surface.
    fn on(&self, t: u32, p: DVec2) -> (f64, DVec3) {
        let v = self.mesh.triangles[t as usize];
        let [a, b, c] = v.map(|v| self.places[v as usize]);
        let all = (b - a).perp_dot(c - a);
        let shares = [
            (b - p).perp_dot(c - p) / all,
            (c - p).perp_dot(a - p) / all,
            (a - p).perp_dot(b - p) / all,
        ];
        let shares = shares.map(|s| if s.is_finite() { s.max(0.0) } else { 1.0 });
        let sum: f64 = shares.iter().sum();
        let shares = shares.map(|s| s / sum);
        let mixed = shares[0] * a + shares[1] * b + shares[2] * c;
        let [p3, q3, r3] = v.map(|v| self.mesh.vertices[v as usize]);
        (
            mixed.distance_squared(p),
            shares[0] * p3 + shares[1] * q3 + shares[2] * r3,
        )
    }
}

/// Corners of the box around points.
fn around(places: &[DVec2]) -> (DVec2, DVec2) {
    let first = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let wider = |(l, h): (DVec2, DVec2), p: &DVec2| (l.min(*p), h.max(*p));
    places.iter().fold(first, wider)
}

/// Turns and shifts the layout so that it lies as it was seen at first.
fn turned_back(mesh: &Mesh, places: &mut [DVec2], seen: impl Fn(&DVec3) -> DVec2) {
    let count = places.len().max(1) as f64;
    let first: Vec<DVec2> = mesh.vertices.iter().map(seen).collect();
    let [from, to] = [&*places, &first[..]].map(|all| all.iter().sum::<DVec2>() / count);
    let pairs = places.iter().zip(&first).map(|(p, q)| (*p - from, *q - to));
    let (dot, cross) = pairs.fold((0.0, 0.0), |(d, c), (p, q)| {
        (d + p.dot(q), c + p.perp_dot(q))
    });
    let turn = DVec2::new(dot, cross).normalize_or(DVec2::X);
    for p in places {
        *p = turn.rotate(*p - from) + to;
    }
}

/// Singular values of the way from a triangle in space to one in the plane.
fn stretched([p, q, r]: [DVec3; 3], [a, b, c]: [DVec2; 3]) -> [f64; 2] {
    let e = (q - p).normalize_or_zero();
    let n = (q - p).cross(r - p).normalize_or_zero();
    let f = n.cross(e);
    let (x1, x2) = ((q - p).dot(e), (r - p).dot(e));
    let y2 = (r - p).dot(f);
    // columns of the map: what e and f become
    let u = (b - a) / x1;
    let v = ((c - a) - u * x2) / y2;
    let (s, d) = (
        DVec2::new(u.x + v.y, u.y - v.x).length(),
        DVec2::new(u.x - v.y, u.y + v.x).length(),
    );
    [0.5 * (s - d).abs(), 0.5 * (s + d)]
}

/// A triangle with its shape.
struct Shape {
    vertices: [usize; 3],
    /// Its corners in its own plane.
    corners: [DVec2; 3],
    /// What each side counts, side k from corner k on: the cotangent of the angle that faces it, so that fine and coarse triangles
    /// stretch alike; within bounds, or it would not rest.
    weights: [f64; 3],
}

impl Shape {
    fn sides(&self) -> [(usize, usize, f64); 3] {
        [0, 1, 2].map(|k| (k, (k + 1) % 3, self.weights[k]))
    }
}

/// Bounds of the weights.
const WEIGHTS: [f64; 2] = [0.05, 5.0];

/// Shapes of the triangles and how vertices hang together.
struct Layout {
    /// Of each triangle its vertices, and its corners in its own plane.
    shapes: Vec<Shape>,
    /// Of each vertex the weight of the sides of triangles that end there.
    degree: Vec<f64>,
}

impl Layout {
    fn new(mesh: &Mesh) -> Self {
        let mut degree = vec![0.0; mesh.vertices.len()];
        let mut shapes = Vec::with_capacity(mesh.triangles.len());
        for t in 0..mesh.triangles.len() {
            let [p, q, r] = mesh.corners(t);
            let (e, n) = (q - p, (q - p).cross(r - p));
            let e = e.normalize_or_zero();
            let f = n.cross(e).normalize_or_zero();
            let place = |v: DVec3| DVec2::new((v - p).dot(e), (v - p).dot(f));
            let corners = [place(p), place(q), place(r)];
            let weight = |k: usize| {
                let [u, v] = [k, (k + 1) % 3].map(|i| corners[i] - corners[(k + 2) % 3]);
                let cotangent = u.dot(v) / u.perp_dot(v).abs();
                // of a triangle without an area it may be no number
                if cotangent.is_nan() {
                    WEIGHTS[0]
                } else {
                    cotangent.clamp(WEIGHTS[0], WEIGHTS[1])
                }
            };
            let shape = Shape {
                vertices: mesh.triangles[t].map(|v| v as usize),
                corners,
                weights: [0, 1, 2].map(weight),
            };
            for (i, j, w) in shape.sides() {
                degree[shape.vertices[i]] += w;
                degree[shape.vertices[j]] += w;
            }
            shapes.push(shape);
        }
        Layout { shapes, degree }
    }

    /// Moves places until they rest.
    fn settle(&self, places: &mut [DVec2], side: f64) {
        for _ in 0..ROUNDS {
            let pull = self.pull(places);
            let moved = self.follow(places, &pull);
            if moved < REST * side {
                break;
            }
        }
    }

    /// What each vertex is pulled by when every triangle turns to where it fits best.
    fn pull(&self, places: &[DVec2]) -> Vec<DVec2> {
        let mut pull = vec![DVec2::ZERO; places.len()];
        for shape in &self.shapes {
            let Shape {
                vertices, corners, ..
            } = shape;
            let mut turn = DVec2::ZERO;
            for (i, j, w) in shape.sides() {
                let own = corners[j] - corners[i];
                let seen = places[vertices[j]] - places[vertices[i]];
                turn += w * DVec2::new(own.dot(seen), own.perp_dot(seen));
            }
            let turn = turn.normalize_or(DVec2::X);
            for (i, j, w) in shape.sides() {
                let way = w * turn.rotate(corners[j] - corners[i]);
                pull[vertices[j]] += way;
                pull[vertices[i]] -= way;
            }
        }
        pull
    }

    /// Solves for the places that follow a pull, by conjugate gradients from where they are; how far the farthest moved, mm.
    fn follow(&self, places: &mut [DVec2], pull: &[DVec2]) -> f64 {
        let before = places.to_vec();
        let applied = |x: &[DVec2]| {
            let mut y: Vec<DVec2> = x.iter().zip(&self.degree).map(|(x, d)| *d * *x).collect();
            for shape in &self.shapes {
                for (i, j, w) in shape.sides() {
                    let (i, j) = (shape.vertices[i], shape.vertices[j]);
                    y[i] -= w * x[j];
                    y[j] -= w * x[i];
                }
            }
            y
        };
        // vertices of no triangle stay
        let scaled = |r: &[DVec2]| -> Vec<DVec2> {
            r.iter()
                .zip(&self.degree)
                .map(|(r, d)| if *d > 0.0 { *r / *d } else { DVec2::ZERO })
                .collect()
        };
        let dot = |a: &[DVec2], b: &[DVec2]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        let now = applied(places);
        let mut r: Vec<DVec2> = pull.iter().zip(&now).map(|(b, a)| *b - *a).collect();
        let mut z = scaled(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let enough = 1e-12 * dot(pull, &scaled(pull)).max(f64::MIN_POSITIVE);
        for _ in 0..STEPS {
            if rz <= enough {
                break;
            }
            let ap = applied(&p);
            let pap = dot(&p, &ap);
            if pap <= 0.0 {
                break;
            }
            let alpha = rz / pap;
            for i in 0..p.len() {
                places[i] += alpha * p[i];
                r[i] -= alpha * ap[i];
            }
            z = scaled(&r);
            let next = dot(&r, &z);
            let beta = next / rz;
            for i in 0..p.len() {
                p[i] = z[i] + beta * p[i];
            }
            rz = next;
        }
        let moved = places.iter().zip(&before).map(|(a, b)| a.distance(*b));
        moved.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::{Sampled, piece};

    const BOX: (DVec3, DVec3) = (DVec3::splat(-35.0), DVec3::splat(35.0));

    /// A patch of a tube of 30 about y: its unrolled width is an arc.
    #[test]
    fn a_tube_unrolls_without_stretch() {
        let field = |p: DVec3| DVec3::new(p.x, 0.0, p.z).length();
        let tube = Sampled::new(BOX, 1.5, field).unwrap().surface(30.0, field);
        let patch = piece(&tube, |p| {
            (p.x.abs() - 20.0).max(p.y.abs() - 15.0).max(-p.z)
        });
        let flat = Flat::new(&patch).unwrap();
        let [(least, _), (greatest, _)] = flat.stretch();
        assert!(least > 0.99 && greatest < 1.01, "{least} {greatest}");
        let region = flat.region();
        let wanted = 30.0 * 2.0 * 30.0 * (20.0_f64 / 30.0).asin();
        assert!(
            (region.area() / wanted - 1.0).abs() < 0.005,
            "{}",
            region.area()
        );
        // a step in the plane is as long on the tube
        let (a, b) = (DVec2::new(-8.0, 3.0), DVec2::new(-7.0, 3.0));
        let [p, q] = [a, b].map(|p| flat.lift(p).unwrap());
        assert!(
            (p.distance(q) - 1.0).abs() < 0.01 && (p.y - q.y).abs() < 0.01,
            "{p} {q}"
        );
        assert!((field(p) - 30.0).abs() < 0.05);
    }

    /// A cap of a ball cannot be unrolled: 30° of it shrink and stretch by a few percent, and no more.
    #[test]
    fn a_cap_tells_its_stretch() {
        let field = |p: DVec3| p.length();
        let ball = Sampled::new(BOX, 1.5, field).unwrap().surface(30.0, field);
        let cap = piece(&ball, |p| 30.0 * 30.0_f64.to_radians().cos() - p.z);
        let [(least, _), (greatest, _)] = Flat::new(&cap).unwrap().stretch();
        assert!(
            least < 0.99 && least > 0.93 && greatest > 1.01 && greatest < 1.07,
            "{least} {greatest}"
        );
    }

    #[test]
    fn what_shows_its_back_is_refused_with_its_place() {
        let field = |p: DVec3| p.length();
        let ball = Sampled::new(BOX, 2.0, field).unwrap().surface(30.0, field);
        let most = piece(&ball, |p| -10.0 - p.z);
        assert!(matches!(Flat::new(&most), Err(FlattenError::Back { at, .. }) if at.z < 6.0));
        assert_eq!(Flat::new(&Mesh::default()).err(), Some(FlattenError::Empty));
    }
}
