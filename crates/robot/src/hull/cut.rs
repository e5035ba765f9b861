//! Pieces of a mesh on one side of planes, and where to cut one: where the hulls of both sides take up least room.

use meltpath_geometry::math::{DMat3, DVec3};
use meltpath_geometry::sight::Sight;
use rayon::prelude::*;

use super::facets::volume;

/// A plane: what lies at `height` along a direction of unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cut {
    along: DVec3,
    height: f64,
}

/// What of a mesh lies in a cell, which is what some planes leave of space.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    /// What the cell leaves of the mesh's triangles.
    pub(super) triangles: Vec<[DVec3; 3]>,
    /// Corners of the cell that lie in the mesh. With those of the triangles their hull holds whatever of the mesh's inside lies in the cell: a
    /// corner of that which is on no triangle is one of the cell.
    pub(super) corners: Vec<DVec3>,
    /// The cell: what is below all of these.
    planes: Vec<Cut>,
}

/// No cut is made so near to an end of a piece, mm.
const END: f64 = 0.5;
/// Cuts beside a face are made so far off it, mm, that it lies on one side as a whole.
const OFF: f64 = 1e-3;
/// Even cuts along a direction, and those beside the largest faces across it.
const EVEN: u32 = 9;
const FACES: usize = 8;
/// Directions beside the axes: those of the largest faces.
const ASLOPE: usize = 3;
/// Triangles that are looked at to choose a cut, at most.
const LOOKED: usize = 20_000;
/// A cut that saves less than this share of a piece's hull saves nothing.
const SAVED: f64 = 0.03;
/// How much uneven sides count as room, as a share of their difference.
const UNEVEN: f64 = 0.01;

impl Piece {
    /// All of a mesh.
    pub(super) fn all(triangles: Vec<[DVec3; 3]>) -> Self {
        let far = triangles.iter().flatten().map(|p| p.abs().max_element());
        let height = far.fold(1.0, f64::max) * 2.0;
        let sides = [DVec3::X, DVec3::Y, DVec3::Z].into_iter();
        let planes = sides
            .flat_map(|d| [d, -d])
            .map(|along| Cut { along, height });
        Piece {
            planes: planes.collect(),
            triangles,
            corners: Vec::new(),
        }
    }

    /// All points that its hull must hold, each once where it can be told.
    pub(super) fn points(&self) -> Vec<DVec3> {
        let mut points: Vec<DVec3> = self.triangles.iter().flatten().copied().collect();
        points.extend(&self.corners);
        let order = |a: &DVec3, b: &DVec3| {
            let by = |i: usize| a[i].total_cmp(&b[i]);
            by(0).then(by(1)).then(by(2))
        };
        points.par_sort_unstable_by(order);
        points.dedup();
        points
    }

    /// What lies below a cut, and above.
    pub(super) fn both(&self, cut: Cut, sight: &Sight) -> [Piece; 2] {
        let other = Cut {
            along: -cut.along,
            height: -cut.height,
        };
        [cut, other].map(|cut| self.below(cut, sight))
    }

    fn below(&self, cut: Cut, sight: &Sight) -> Piece {
        let mut triangles = Vec::new();
        for t in &self.triangles {
            clip(*t, cut, &mut triangles);
        }
        let mut corners: Vec<DVec3> = self.corners.clone();
        corners.retain(|c| cut.over(*c) <= 0.0);
        corners.extend(
            self.new_corners(cut)
                .into_iter()
                .filter(|c| sight.is_inside(*c)),
        );
        let mut planes = self.planes.clone();
        planes.push(cut);
        Piece {
            triangles,
            corners,
            planes,
        }
    }

    /// Corners that a cut gives its cell.
    fn new_corners(&self, cut: Cut) -> Vec<DVec3> {
        let mut found: Vec<DVec3> = Vec::new();
        for (i, a) in self.planes.iter().enumerate() {
            for b in &self.planes[i + 1..] {
                let rows = DMat3::from_cols(cut.along, a.along, b.along).transpose();
                if rows.determinant().abs() < 1e-9 {
                    continue;
                }
                let p = rows.inverse() * DVec3::new(cut.height, a.height, b.height);
                let within = |c: &Cut| c.over(p) <= 1e-6;
                if self.planes.iter().all(within) && !found.contains(&p) {
                    found.push(p);
                }
            }
        }
        found
    }

    /// Where to cut it whose hull stands farthest beyond the mesh at `worst`; nothing where it is too thin everywhere.
    ///
    /// Where no cut saves room, as of a ring whose halves are as full as the whole, it is cut through that place.
    pub(super) fn best(&self, worst: DVec3) -> Option<Cut> {
        let stride = self.triangles.len().div_ceil(LOOKED).max(1);
        let some: Vec<[DVec3; 3]> = self.triangles.iter().step_by(stride).copied().collect();
        let directions = directions(&some);
        let scored = directions
            .par_iter()
            .flat_map_iter(|d| scored(&some, *d, worst));
        let scored: Vec<Scored> = scored.collect();
        let least = |a: &&Scored, b: &&Scored| a.room.total_cmp(&b.room);
        let best = scored.iter().min_by(least)?;
        let through = scored.iter().filter(|s| s.through).min_by(least);
        let saves = best.room < (1.0 - SAVED) * best.whole;
        Some(if saves { best } else { through.unwrap_or(best) }.cut)
    }
}

impl Cut {
    /// How far a point lies above, mm.
    fn over(&self, p: DVec3) -> f64 {
        p.dot(self.along) - self.height
    }
}

/// Adds what of a triangle lies below a cut.
fn clip(triangle: [DVec3; 3], cut: Cut, to: &mut Vec<[DVec3; 3]>) {
    let over = triangle.map(|p| cut.over(p));
    if over.iter().all(|o| *o <= 0.0) {
        to.push(triangle);
        return;
    }
    let mut left: Vec<DVec3> = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (i, (i + 1) % 3);
        if over[a] <= 0.0 {
            left.push(triangle[a]);
        }
        if (over[a] < 0.0 && over[b] > 0.0) || (over[a] > 0.0 && over[b] < 0.0) {
            // the same point from both sides of the cut and from both triangles of the edge
            let (low, high) = if over[a] < 0.0 { (a, b) } else { (b, a) };
            let share = over[low] / (over[low] - over[high]);
            left.push(triangle[low].lerp(triangle[high], share));
        }
    }
    match left[..] {
        [a, b, c] => to.push([a, b, c]),
        [a, b, c, d] => to.extend([[a, b, c], [a, c, d]]),
        _ => {}
    }
}

/// The axes, and the directions of the largest faces aslope to them.
fn directions(triangles: &[[DVec3; 3]]) -> Vec<DVec3> {
    let mut faces: Vec<(DVec3, f64)> = Vec::new();
    let mut all: Vec<DVec3> = triangles
        .iter()
        .map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a))
        .collect();
    all.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    for area in all {
        let normal = area.normalize_or_zero();
        let same = |of: &(DVec3, f64)| of.0.dot(normal).abs() > 0.9999;
        match faces.iter().position(same) {
            Some(of) => faces[of].1 += area.length(),
            // the large ones come first
            None if faces.len() < 64 && normal != DVec3::ZERO => {
                faces.push((normal, area.length()));
            }
            None => {}
        }
    }
    faces.sort_by(|a, b| b.1.total_cmp(&a.1));
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let aslope = faces.into_iter().map(|f| f.0);
    let aslope = aslope.filter(|n| axes.iter().all(|a| a.dot(*n).abs() < 0.9999));
    axes.into_iter().chain(aslope.take(ASLOPE)).collect()
}

/// A cut, how much room the hulls beside it take up, and the hull of both, mm³.
struct Scored {
    cut: Cut,
    room: f64,
    whole: f64,
    /// Whether it goes through the place that is asked for.
    through: bool,
}

/// Cuts across a direction.
fn scored(triangles: &[[DVec3; 3]], along: DVec3, worst: DVec3) -> Vec<Scored> {
    let through = worst.dot(along);
    let heights = heights(triangles, along, through);
    let slabs = slabs(triangles, along, &heights);
    let sums = |forward: bool| {
        let mut sum = Foremost::default();
        let mut volumes = Vec::with_capacity(slabs.len());
        let mut add = |slab: &Foremost| {
            sum.add(slab);
            volumes.push(volume(&sum.points()));
        };
        if forward {
            slabs.iter().for_each(&mut add);
        } else {
            slabs.iter().rev().for_each(&mut add);
            volumes.reverse();
        }
        volumes
    };
    let (below, above) = (sums(true), sums(false));
    let score = |i: usize| {
        let (a, b) = (below[i], above[i + 1]);
        a + b + UNEVEN * (a - b).abs()
    };
    let whole = above.first().copied().unwrap_or(0.0);
    let of = |(i, height): (usize, &f64)| Scored {
        cut: Cut {
            along,
            height: *height,
        },
        room: score(i),
        whole,
        through: *height == through,
    };
    heights.iter().enumerate().map(of).collect()
}

/// Where a direction may be cut across: at even distances, on both sides of the largest faces, and at `through`.
fn heights(triangles: &[[DVec3; 3]], along: DVec3, through: f64) -> Vec<f64> {
    let all = triangles.iter().flatten().map(|p| p.dot(along));
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
        (l.min(x), h.max(x))
    });
    let mut faces: Vec<(f64, f64)> = Vec::new();
    for [a, b, c] in triangles {
        let area = (*b - *a).cross(*c - *a);
        if area.dot(along).abs() > 0.9999 * area.length() {
            faces.push((a.dot(along), area.length()));
        }
    }
    faces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut levels: Vec<(f64, f64)> = Vec::new();
    for (height, area) in faces {
        match levels.last_mut() {
            Some(last) if height - last.0 < 1e-6 => last.1 += area,
            _ => levels.push((height, area)),
        }
    }
    levels.sort_by(|a, b| b.1.total_cmp(&a.1));
    let beside = levels
        .iter()
        .take(FACES)
        .flat_map(|l| [l.0 - OFF, l.0 + OFF]);
    let even = (1..=EVEN).map(|i| low + (high - low) * f64::from(i) / f64::from(EVEN + 1));
    // a cut in a face would give it to both sides
    let even = even
        .chain([through])
        .filter(|h| levels.iter().all(|l| (l.0 - h).abs() > 1e-6));
    let mut heights: Vec<f64> = beside.chain(even).collect();
    heights.retain(|h| *h > low + END && *h < high - END);
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    heights
}

/// The foremost points of what lies between heights.
fn slabs(triangles: &[[DVec3; 3]], along: DVec3, heights: &[f64]) -> Vec<Foremost> {
    let mut slabs = vec![Foremost::default(); heights.len() + 1];
    let slab = |h: f64| heights.partition_point(|own| *own < h);
    for t in triangles {
        let at = t.map(|p| p.dot(along));
        for i in 0..3 {
            let j = (i + 1) % 3;
            slabs[slab(at[i])].take(t[i]);
            let (low, high) = (at[i].min(at[j]), at[i].max(at[j]));
            for k in slab(low)..slab(high) {
                let share = (heights[k] - at[i]) / (at[j] - at[i]);
                let p = t[i].lerp(t[j], share.clamp(0.0, 1.0));
                slabs[k].take(p);
                slabs[k + 1].take(p);
            }
        }
    }
    slabs
}

/// Directions in which foremost points are kept: those to faces, sides and corners of a cube, and crooked ones, in which two corners of what
/// stands along the axes are hardly ever as far.
const WAYS: usize = 37;
const CROOKED: [[f64; 3]; 2] = [[1.0, 0.37, 0.61], [1.0, 0.71, 0.13]];

fn ways(DVec3 { x, y, z }: DVec3) -> [f64; WAYS] {
    let straight = [
        x,
        y,
        z,
        x + y,
        x - y,
        x + z,
        x - z,
        y + z,
        y - z,
        x + y + z,
        x + y - z,
        x - y + z,
        x - y - z,
    ];
    let mut all = [0.0; WAYS];
    let (first, rest) = all.split_at_mut(straight.len());
    first.copy_from_slice(&straight);
    let turned = [[x, y, z], [y, z, x], [z, x, y]];
    let crooked = CROOKED.iter().flat_map(|c| turned.map(|p| (c, p)));
    for (four, ([a, b, c], [x, y, z])) in rest.chunks_exact_mut(4).zip(crooked) {
        let [x, y, z] = [a * x, b * y, c * z];
        four.copy_from_slice(&[x + y + z, x + y - z, x - y + z, x - y - z]);
    }
    all
}

/// The foremost points in some directions, and in the directions opposite to these.
#[derive(Debug, Clone)]
struct Foremost([[(f64, DVec3); 2]; WAYS]);

impl Default for Foremost {
    fn default() -> Self {
        Foremost([[(f64::NEG_INFINITY, DVec3::ZERO); 2]; WAYS])
    }
}

impl Foremost {
    fn take(&mut self, p: DVec3) {
        for (own, far) in self.0.iter_mut().zip(ways(p)) {
            if far > own[0].0 {
                own[0] = (far, p);
            }
            if -far > own[1].0 {
                own[1] = (-far, p);
            }
        }
    }

    fn add(&mut self, other: &Foremost) {
        for (own, other) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            if other.0 > own.0 {
                *own = *other;
            }
        }
    }

    fn points(&self) -> Vec<DVec3> {
        let mut points: Vec<DVec3> = Vec::with_capacity(2 * WAYS);
        for (far, p) in self.0.iter().flatten() {
            if far.is_finite() && !points.contains(p) {
                points.push(*p);
            }
        }
        points
    }
}
