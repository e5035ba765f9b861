//! Convex bodies: the hull of points with a radius around it, and how far convex bodies are apart.
//!
//! A hull of few points stands for a mesh of many: it lies within the mesh's own hull, and its radius is as much as that stands out of it, so
//! that nothing of the mesh is left out.

mod cut;
mod excess;
mod facets;
mod gjk;
mod pieces;

use meltpath_geometry::math::DVec3;
use rayon::prelude::*;

pub use excess::Excess;
pub(crate) use gjk::distance;
pub use pieces::{Fineness, Pieces};

/// How far a hull may stand out of the one that it stands for, mm.
const EXACT: f64 = 0.5;
/// The most points of a hull: the search for the foremost goes through all.
const MOST: usize = 160;
/// Points whose coordinates lie side by side.
const LANES: usize = 8;
/// Directions on a turn of the sphere from which points are taken first, and turns between the poles.
const AROUND: u32 = 16;
const BETWEEN: u32 = 7;

/// The hull of points with a radius around it, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    points: Vec<DVec3>,
    /// The same side by side: coordinates of [`LANES`] points, the last filled up with copies.
    blocks: Vec<[[f64; LANES]; 3]>,
    /// How far it goes beyond the hull of its points.
    radius: f64,
    /// The ball around it.
    centre: DVec3,
    reach: f64,
    /// Corners of the box around it.
    corners: [DVec3; 8],
}

impl Hull {
    /// The hull of all points, of few of them; nothing where there are none.
    ///
    /// ```
    /// use meltpath_geometry::{math::DVec3, shapes::cuboid};
    /// use meltpath_robot::hull::Hull;
    /// let cube = cuboid(DVec3::ZERO, DVec3::splat(100.0));
    /// let hull = Hull::of(&cube.vertices).unwrap();
    /// assert_eq!((hull.points().len(), hull.radius()), (8, 0.0));
    /// ```
    pub fn of(all: &[DVec3]) -> Option<Self> {
        let mut points: Vec<DVec3> = Vec::new();
        for direction in directions() {
            let found = foremost(all, direction)?;
            if !points.contains(&found) {
                points.push(found);
            }
        }
        let mut out: Vec<(f64, DVec3)> = all.iter().map(|p| (f64::INFINITY, *p)).collect();
        loop {
            let hull = Self::with(points.clone(), 0.0)?;
            out.par_iter_mut()
                .for_each(|(off, p)| *off = hull.beyond(*p));
            // what lies within stays so where points are added
            out.retain(|(off, _)| *off > 0.0);
            out.sort_by(|a, b| b.0.total_cmp(&a.0));
            let most = out.first().map_or(0.0, |o| o.0);
            let left = MOST.saturating_sub(points.len());
            if most <= EXACT || left == 0 {
                return Self::with(points, most);
            }
            let mut new: Vec<DVec3> = Vec::new();
            for (off, p) in &out {
                // those beside one that is taken may lie within then
                let apart = new.iter().all(|q| q.distance(*p) > 4.0 * most);
                if *off > EXACT && apart && new.len() < left.min(16) {
                    new.push(*p);
                }
            }
            points.extend(new);
        }
    }

    /// The hull of points with a radius around it, mm; nothing where there are none.
    pub fn with(points: Vec<DVec3>, radius: f64) -> Option<Self> {
        let (low, high) = meltpath_geometry::mesh::bounds(points.iter().copied())?;
        let (low, high) = (low - DVec3::splat(radius), high + DVec3::splat(radius));
        let centre = 0.5 * (low + high);
        let far = points.iter().map(|p| p.distance(centre));
        let side = |i: usize, up: bool| if up { high[i] } else { low[i] };
        let corner =
            |n: usize| DVec3::new(side(0, n & 1 > 0), side(1, n & 2 > 0), side(2, n & 4 > 0));
        Some(Hull {
            reach: far.fold(0.0, f64::max) + radius,
            centre,
            corners: std::array::from_fn(corner),
            blocks: blocks(&points),
            points,
            radius,
        })
    }

    /// Its points, mm.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// How far it goes beyond the hull of its points, mm.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The centre of the ball around it, and its radius, mm.
    pub(crate) fn ball(&self) -> (DVec3, f64) {
        (self.centre, self.reach)
    }

    /// Corners of the box around it.
    pub(crate) fn corners(&self) -> &[DVec3; 8] {
        &self.corners
    }

    /// The farthest of it from its origin, mm.
    pub(crate) fn farthest(&self) -> f64 {
        let far = self.points.iter().map(|p| p.length());
        far.fold(0.0, f64::max) + self.radius
    }

    /// Half the second of its three sizes along its axes, mm: how thick a long body is.
    pub(crate) fn thickness(&self) -> f64 {
        let mut size = (self.corners[7] - self.corners[0]).to_array();
        size.sort_by(f64::total_cmp);
        0.5 * size[1]
    }

    /// How far a point lies beyond the hull of its points, mm; no less than it does.
    fn beyond(&self, p: DVec3) -> f64 {
        let told = distance(|d| self.foremost(d), |_| p, DVec3::Z, f64::INFINITY);
        if told > 0.0 { told * (1.0 + 1e-5) } else { 0.0 }
    }

    /// A point of it.
    pub(crate) fn point(&self) -> DVec3 {
        self.points.first().copied().unwrap_or(self.centre)
    }

    /// The point of its points' hull that lies farthest in a direction.
    pub(crate) fn foremost(&self, direction: DVec3) -> DVec3 {
        let mut best = [f64::NEG_INFINITY; LANES];
        let mut of = [0_u32; LANES];
        // a loop without branches, of which the compiler makes vector instructions
        for (number, [x, y, z]) in (0_u32..).zip(&self.blocks) {
            let points = x.iter().zip(y).zip(z);
            for ((best, of), ((x, y), z)) in best.iter_mut().zip(&mut of).zip(points) {
                let along = x * direction.x + y * direction.y + z * direction.z;
                let farther = along > *best;
                *best = if farther { along } else { *best };
                *of = if farther { number } else { *of };
            }
        }
        let mut first = 0;
        for (lane, (far, number)) in best.iter().zip(&of).enumerate() {
            // of those as far the first, as they come
            let same = *far == best[first] && *number < of[first];
            if *far > best[first] || same {
                first = lane;
            }
        }
        let found = of[first] as usize * LANES + first;
        self.points.get(found).copied().unwrap_or(self.centre)
    }
}

/// Points side by side.
fn blocks(points: &[DVec3]) -> Vec<[[f64; LANES]; 3]> {
    let chunk = |all: &[DVec3]| {
        let at = |lane: usize, axis: usize| all[lane.min(all.len() - 1)][axis];
        std::array::from_fn(|axis| std::array::from_fn(|lane| at(lane, axis)))
    };
    points.chunks(LANES).map(chunk).collect()
}

/// The point that lies farthest in a direction.
fn foremost(points: &[DVec3], direction: DVec3) -> Option<DVec3> {
    let mut best = (f64::NEG_INFINITY, None);
    for p in points {
        let along = p.dot(direction);
        if along > best.0 {
            best = (along, Some(*p));
        }
    }
    best.1
}

/// Directions all over the sphere, those along the axes and diagonals among them.
fn directions() -> impl Iterator<Item = DVec3> {
    let turns = 1..=BETWEEN;
    let rings = turns.flat_map(|i| {
        let (z, r) = {
            let up = std::f64::consts::PI * f64::from(i) / f64::from(BETWEEN + 1);
            (up.cos(), up.sin())
        };
        (0..AROUND).map(move |k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(AROUND);
            DVec3::new(r * angle.cos(), r * angle.sin(), z)
        })
    });
    let signs = [1.0, -1.0];
    let diagonals = signs
        .into_iter()
        .flat_map(move |x| signs.map(|y| (x, y)))
        .flat_map(move |(x, y)| signs.map(|z| DVec3::new(x, y, z)));
    rings.chain([DVec3::Z, -DVec3::Z]).chain(diagonals)
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec2;
    use meltpath_geometry::shapes::{cuboid, revolve};
    use meltpath_numerics::random::Random;

    use super::*;

    fn point(random: &mut Random, far: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| random.between(-far, far)))
    }

    /// Nothing of what it stands for lies outside, and it is hardly larger.
    #[test]
    fn a_hull_of_few_points_holds_them_all() {
        let mut random = Random::new(4);
        let cloud: Vec<DVec3> = (0..3000)
            .map(|_| point(&mut random, 1.0).normalize_or(DVec3::X) * 200.0)
            .collect();
        let profile = [[0.0, 0.0], [150.0, 0.0], [150.0, 600.0], [0.0, 600.0]];
        let barrel = revolve(&profile.map(DVec2::from), 90).vertices;
        for (all, most) in [(cloud, 7.0), (barrel, 1.0)] {
            let hull = Hull::of(&all).unwrap();
            assert!(
                hull.points.len() <= MOST && hull.radius < most,
                "{}",
                hull.radius
            );
            for p in &all {
                let off = hull.beyond(*p);
                assert!(off <= hull.radius + 1e-9, "{off} {}", hull.radius);
            }
        }
        assert!(Hull::of(&[]).is_none());
        let point = Hull::of(&[DVec3::X]).unwrap();
        assert_eq!((point.points.len(), point.radius), (1, 0.0));
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.3, 0.3, 0.0)];
        assert_eq!(Hull::of(&flat).unwrap().points.len(), 3);
    }

    /// Side by side as one by one.
    #[test]
    fn the_foremost_point_is_found_side_by_side() {
        let mut random = Random::new(9);
        for count in [1, 2, 3, 7, 8, 9, 15, 16, 17, 159, 160] {
            let mut all: Vec<DVec3> = (0..count).map(|_| point(&mut random, 50.0)).collect();
            // some twice
            all[count / 2] = all[0];
            let hull = Hull::with(all.clone(), 0.0).unwrap();
            for _ in 0..200 {
                let direction = point(&mut random, 1.0);
                assert_eq!(Some(hull.foremost(direction)), foremost(&all, direction));
            }
        }
    }

    /// Boxes have distances in closed form.
    #[test]
    fn boxes_are_as_far_apart_as_they_are() {
        let mut random = Random::new(8);
        for n in 0..2000 {
            let mut cube = |far: f64| {
                let (a, b) = (point(&mut random, far), point(&mut random, far));
                // flat ones and points among them
                let b = if n % 7 == 0 { b.with_z(a.z) } else { b };
                (a.min(b), a.max(b))
            };
            let ((la, ha), (lb, hb)) = (cube(30.0), cube(90.0));
            let wanted = (la - hb).max(lb - ha).max(DVec3::ZERO).length();
            let [a, b] = [cuboid(la, ha), cuboid(lb, hb)].map(|m| m.vertices);
            let of = |points: &[DVec3], d: DVec3| foremost(points, d).unwrap();
            let found = |most| distance(|d| of(&a, d), |d| of(&b, d), DVec3::X, most);
            let all = found(f64::INFINITY);
            assert!(
                all <= wanted + 1e-9 && wanted - all < 1e-5 * (1.0 + wanted),
                "{all} {wanted}"
            );
            // what is farther than is asked for is no less than that
            let half = found(0.5 * wanted);
            assert!(half >= 0.5 * wanted && half <= wanted + 1e-9);
        }
    }
}
