//! Machining stock: points all over a finished surface, and the metal over each of them.

use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use rayon::prelude::*;

/// Points at which stock is measured, at most about so many.
const MOST_POINTS: f64 = 2e5;
/// Farthest that stock is looked for, in multiples of the allowance, and never below this many mm.
const REACH: (f64, f64) = (3.0, 10.0);

/// A point of the finished surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position, mm.
    pub position: DVec3,
    /// Unit outward normal.
    pub normal: DVec3,
}

/// From here on a unit normal looks up more than sideways.
const UPWARD: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl SurfacePoint {
    /// Whether it looks up more than sideways.
    pub fn looks_up(&self) -> bool {
        self.normal.z > UPWARD
    }
}

/// How far stock is looked for where the allowance is this, mm.
pub(in crate::waam) fn reach(allowance: f64) -> f64 {
    (REACH.0 * allowance).max(REACH.1)
}

/// Metal over a point of a surface along its normal, mm, up to `reach`, in steps of `step`. Where there is none it is missing as far as the
/// nearest metal lies that is seen in 26 directions and behind the surface, and the stock is below zero: along a side's normal alone one
/// looks past a corner that is cut, under a top that is a little low, for centimetres.
pub(in crate::waam) fn stock(
    point: &SurfacePoint,
    solid: impl Fn(DVec3) -> bool,
    step: f64,
    reach: f64,
) -> f64 {
    stock_below(point, solid, (step, reach), f64::INFINITY)
}

/// The same where it is less than `below`; else no less than `below`.
fn stock_below(
    point: &SurfacePoint,
    solid: impl Fn(DVec3) -> bool,
    (step, reach): (f64, f64),
    below: f64,
) -> f64 {
    let bare = !solid(point.position);
    let along = |direction: DVec3, reach: f64| {
        let mut far = 0.0;
        while far < reach && solid(point.position + far * direction) != bare {
            far += step;
        }
        far
    };
    if !bare {
        return along(point.normal, reach.min(below));
    }
    // behind the surface first, where metal is nearest as a rule: in the other directions it is then looked for no farther
    let mut missing = along(-point.normal, reach);
    let side = |n: i32, of: i32| f64::from(n / of % 3 - 1);
    for n in 0..27 {
        if -missing >= below {
            break;
        }
        if let Some(direction) = DVec3::new(side(n, 1), side(n, 3), side(n, 9)).try_normalize() {
            missing = along(direction, missing);
        }
    }
    -missing
}

/// Points of a surface that are looked at together.
const TOGETHER: usize = 2048;

/// The least stock over points that look sideways and over those that look up, and the first point of each where it is so small.
pub(in crate::waam) fn least(
    points: &[SurfacePoint],
    solid: impl Fn(DVec3) -> bool + Sync,
    step: f64,
    reach: f64,
) -> [Option<(f64, SurfacePoint)>; 2] {
    let mut least: [Option<(f64, SurfacePoint)>; 2] = [None; 2];
    for points in points.chunks(TOGETHER) {
        // what is no less than before need not be known exactly
        let below = least.map(|l| l.map_or(f64::INFINITY, |l| l.0));
        let of = |p: &SurfacePoint| {
            stock_below(p, &solid, (step, reach), below[usize::from(p.looks_up())])
        };
        let found: Vec<f64> = points.par_iter().map(of).collect();
        for (found, point) in found.into_iter().zip(points) {
            let least = &mut least[usize::from(point.looks_up())];
            if least.is_none_or(|l| found < l.0) {
                *least = Some((found, *point));
            }
        }
    }
    least
}

/// Points all over a surface, `spacing` mm apart or farther where there would be too many: in each triangle rows along its
/// longest edge.
pub(in crate::waam) fn points(mesh: &Mesh, spacing: f64) -> Vec<SurfacePoint> {
    let spacing = spacing.max((mesh.area() / MOST_POINTS).sqrt());
    let count = |length: f64| (length / spacing).ceil().max(1.0) as usize;
    let of_triangle = |t: usize| {
        let [a, b, c] = along_the_longest(mesh.corners(t));
        let (base, cross) = (b - a, (b - a).cross(c - a));
        let normal = cross.try_normalize();
        let rows = normal.map_or(0, |_| count(cross.length() / base.length()));
        let row = move |r: usize| {
            let up = (r as f64 + 0.5) / rows as f64;
            let (from, along) = (a + up * (c - a), (1.0 - up) * base);
            let n = count(along.length());
            (0..n).map(move |i| from + (i as f64 + 0.5) / n as f64 * along)
        };
        let normal = normal.unwrap_or_default();
        let points = (0..rows).flat_map(row);
        points.map(move |position| SurfacePoint { position, normal })
    };
    (0..mesh.triangles.len()).flat_map(of_triangle).collect()
}

/// The corners in the same turn, the longest edge from the first to the second.
fn along_the_longest([a, b, c]: [DVec3; 3]) -> [DVec3; 3] {
    let [ab, bc, ca] = [a.distance(b), b.distance(c), c.distance(a)];
    if ab >= bc.max(ca) {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec2;

    use super::*;

    /// However faces are cut into triangles, each place has a point near it, and there are about as many as the area asks for.
    #[test]
    fn points_lie_evenly_on_slivers_too() {
        let n = 50;
        let x = |i: usize| 40.0 * i as f64 / n as f64;
        let vertices =
            (0..=n).flat_map(|i| [DVec3::new(x(i), 0.0, 0.0), DVec3::new(x(i), 30.0, 0.0)]);
        let slivers = (0..n).flat_map(|i| {
            [
                [2 * i, 2 * i + 2, 2 * i + 1],
                [2 * i + 1, 2 * i + 2, 2 * i + 3],
            ]
        });
        let mesh = Mesh {
            vertices: vertices.collect(),
            triangles: slivers.map(|t| t.map(|v| v as u32)).collect(),
        };
        let points_at = points(&mesh, 1.0);
        assert!((1100..4000).contains(&points_at.len()));
        for (i, j) in (0..40).flat_map(|i| (0..30).map(move |j| (i, j))) {
            let at = DVec3::new(f64::from(i) + 0.3, f64::from(j) + 0.6, 0.0);
            let near = points_at
                .iter()
                .map(|p| p.position.distance(at))
                .fold(1e9, f64::min);
            assert!(near < 1.1, "{at}: {near}");
        }
        // never many more than the most
        let all = points(&mesh, 1e-3).len() as f64;
        assert!((0.9..1.6).contains(&(all / MOST_POINTS)), "{all}");
    }

    /// What is left out once a lesser stock is known changes nothing: the least is that of every point by itself, and the first of its kind.
    #[test]
    fn the_least_stock_is_that_of_every_point() {
        let mesh = meltpath_geometry::shapes::cuboid(DVec3::ZERO, DVec3::new(40.0, 30.0, 10.0));
        let points_at = points(&mesh, 0.25);
        for (hole, thin) in [(6.0, 3.0), (0.0, 1.0), (6.0, -1.0), (80.0, 2.0)] {
            let solid = |p: DVec3| {
                let round = (p.truncate() - DVec2::new(25.0, 15.0)).length() > hole;
                let off = (p - DVec3::new(20.0, 15.0, 5.0)).abs() - DVec3::new(20.0, 15.0, 5.0);
                round && off.max_element() < thin + 0.01 * p.x
            };
            let all = points_at.iter().map(|p| (stock(p, solid, 0.2, 9.0), *p));
            let wanted = |up: bool| {
                let of_kind = all.clone().filter(|(_, p)| p.looks_up() == up);
                of_kind.min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let found = least(&points_at, solid, 0.2, 9.0);
            assert_eq!(found, [wanted(false), wanted(true)], "{hole} {thin}");
        }
    }
}
