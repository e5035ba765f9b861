//! The surface on which a field in space has a value, as a mesh, and the piece of a mesh on one side of such a surface.
//!
//! Cubes of a grid are cut into six tetrahedra about their diagonal (Kuhn 1960), so that neighbours fit and no case is ambiguous. Grid
//! points decide how the surface hangs together; its vertices lie on the field itself.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use crate::Mesh;
use crate::math::DVec3;
use crate::sheet::crossing;
use crate::topology::{half_edges, is_degenerate, shells};

/// Most points of a grid.
pub const MOST_POINTS: usize = 60_000_000;
/// A crossing nearer to an end of its edge than this share of it is taken to that end.
const NEAR: f64 = 0.25;

/// Why a field cannot be sampled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LevelError {
    /// The grid would be too fine.
    #[error(
        "a grid of {cell} mm in this box has more than {MOST_POINTS} points: take larger cells, or a smaller piece"
    )]
    TooFine {
        /// Side of its cells, mm.
        cell: f64,
    },
    /// A length or corner is not finite, or not above zero.
    #[error("cells of {cell} mm in a box {size} mm wide: both must be above zero and finite")]
    Size {
        /// Side of the cells, mm.
        cell: f64,
        /// Least side of the box, mm.
        size: f64,
    },
}

/// A field sampled on a grid.
#[derive(Debug, Clone)]
pub struct Sampled {
    low: DVec3,
    cell: f64,
    count: [usize; 3],
    values: Vec<f64>,
}

/// Corners of the six tetrahedra of a cube: bits of the corner's steps along x, y and z.
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 1, 5, 7],
    [0, 2, 3, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 4, 6, 7],
];

impl Sampled {
    /// Samples a field in a box, from `low` on, `cell` mm apart.
    ///
    /// # Errors
    /// [`LevelError`].
    pub fn new(
        (low, high): (DVec3, DVec3),
        cell: f64,
        field: impl Fn(DVec3) -> f64 + Sync,
    ) -> Result<Self, LevelError> {
        let size = (high - low).min_element();
        if !(cell > 0.0 && size > 0.0 && (high - low).is_finite() && cell.is_finite()) {
            return Err(LevelError::Size { cell, size });
        }
        let steps = ((high - low) / cell).ceil() + 1.0;
        if steps.x * steps.y * steps.z > MOST_POINTS as f64 {
            return Err(LevelError::TooFine { cell });
        }
        let count = steps.to_array().map(|n| n as usize);
        let mut sampled = Sampled {
            low,
            cell,
            count,
            values: Vec::new(),
        };
        let all = count[0] * count[1] * count[2];
        let values = (0..all).into_par_iter().map(|i| field(sampled.point(i)));
        sampled.values = values.collect();
        Ok(sampled)
    }

    /// Side of the cells, mm.
    pub fn cell(&self) -> f64 {
        self.cell
    }

    fn point(&self, i: usize) -> DVec3 {
        let [nx, ny, _] = self.count;
        let at = [i % nx, i / nx % ny, i / (nx * ny)];
        self.low + self.cell * DVec3::from_array(at.map(|n| n as f64))
    }

    /// Forgets all but what lies within `reach` mm, along the axes, of the grid points at which something holds for place and value.
    pub fn keep(&mut self, holds: impl Fn(DVec3, f64) -> bool + Sync, reach: f64) {
        let all = 0..self.values.len();
        let holds = |i: usize| holds(self.point(i), self.values[i]);
        let mut near: Vec<bool> = all.into_par_iter().map(holds).collect();
        let steps = (reach / self.cell).ceil().max(0.0) as usize;
        let [nx, ny, nz] = self.count;
        for (along, stride) in [(nx, 1), (ny, nx), (nz, nx * ny)] {
            let before = near.clone();
            // how far back the last one is that held, both ways
            let mut spread = |order: &mut dyn Iterator<Item = usize>| {
                let mut since = usize::MAX;
                for i in order {
                    since = if before[i] {
                        0
                    } else {
                        since.saturating_add(1)
                    };
                    near[i] |= since <= steps;
                }
            };
            for line in (0..before.len()).filter(|i| i / stride % along == 0) {
                let at = |k: usize| line + k * stride;
                spread(&mut (0..along).map(at));
                spread(&mut (0..along).rev().map(at));
            }
        }
        for (value, near) in self.values.iter_mut().zip(near) {
            if !near {
                *value = f64::NAN;
            }
        }
    }

    /// Another field on the same grid, of place and value; what was forgotten stays so, and so does what has no value then.
    #[must_use]
    pub fn map(&self, field: impl Fn(DVec3, f64) -> f64 + Sync) -> Self {
        let known = |i: usize| {
            let value = self.values[i];
            if value.is_nan() {
                value
            } else {
                field(self.point(i), value)
            }
        };
        let values = (0..self.values.len()).into_par_iter().map(known);
        Sampled {
            values: values.collect(),
            ..*self
        }
    }

    /// The greatest value; of nothing minus infinity.
    pub fn greatest(&self) -> f64 {
        self.values
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// The surface on which the field is `level`, showing towards greater values. `field` is what was sampled.
    pub fn surface(&self, level: f64, field: impl Fn(DVec3) -> f64) -> Mesh {
        let [nx, ny, nz] = self.count;
        let step =
            |corner: usize| (corner & 1) + nx * (corner >> 1 & 1) + nx * ny * (corner >> 2 & 1);
        let steps: [usize; 8] = std::array::from_fn(step);
        let off = |p: DVec3| field(p) - level;
        let below = |i: usize| self.values[i] <= level;
        let cubes = |holds: &dyn Fn(usize) -> bool| -> Vec<usize> {
            let mixed = |base: &usize| {
                let [x, y, z] = [base % nx, base / nx % ny, base / (nx * ny)];
                let inner = x + 1 < nx && y + 1 < ny && z + 1 < nz;
                let known = |s: &usize| !self.values[base + s].is_nan();
                inner
                    && steps.iter().all(known)
                    && steps.iter().any(|s| holds(base + s) != holds(*base))
            };
            (0..self.values.len()).filter(mixed).collect()
        };
        let mut snapped = Snapped::default();
        for base in cubes(&below) {
            for [i, j] in TETRAHEDRA.iter().flat_map(|t| pairs(*t)) {
                let (i, j) = (base + steps[i], base + steps[j]);
                if below(i) != below(j) {
                    let (a, b) = if below(i) { (i, j) } else { (j, i) };
                    let cross = || crossing(self.point(a), self.point(b), off);
                    snapped.cross((a, self.point(a)), (b, self.point(b)), cross);
                }
            }
        }
        let reached = |i: usize| below(i) || snapped.holds(i);
        let mut mesh = Mesh::default();
        let mut known: HashMap<Corner, u32> = HashMap::new();
        for base in cubes(&reached) {
            for tetrahedron in TETRAHEDRA {
                let corners = tetrahedron.map(|c| base + steps[c]);
                let (low, high): (Vec<usize>, Vec<usize>) =
                    corners.iter().partition(|&&i| reached(i));
                let mut vertex = |a: usize, b: usize| {
                    let (corner, place) = snapped.corner(a, b);
                    *known.entry(corner).or_insert_with(|| {
                        mesh.vertices.push(place);
                        mesh.vertices.len() as u32 - 1
                    })
                };
                let quad: Vec<u32> = match (&low[..], &high[..]) {
                    (&[a], &[b, c, d]) => vec![vertex(a, b), vertex(a, c), vertex(a, d)],
                    (&[b, c, d], &[a]) => vec![vertex(b, a), vertex(c, a), vertex(d, a)],
                    (&[a, b], &[c, d]) => {
                        vec![vertex(a, c), vertex(a, d), vertex(b, d), vertex(b, c)]
                    }
                    _ => continue,
                };
                let middle = |of: &[usize]| {
                    let sum: DVec3 = of.iter().map(|&i| self.point(i)).sum();
                    sum / of.len() as f64
                };
                let up = middle(&high) - middle(&low);
                for k in 2..quad.len() {
                    let triangle = [quad[0], quad[k - 1], quad[k]];
                    if is_degenerate(triangle) {
                        continue;
                    }
                    let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
                    let turned = (b - a).cross(c - a).dot(up) < 0.0;
                    mesh.triangles.push(if turned {
                        [triangle[0], triangle[2], triangle[1]]
                    } else {
                        triangle
                    });
                }
            }
        }
        mesh
    }
}

/// The piece of a mesh where a field is not above zero, cut where it is zero.
pub fn piece(mesh: &Mesh, field: impl Fn(DVec3) -> f64 + Sync) -> Mesh {
    let values: Vec<f64> = mesh.vertices.par_iter().map(|&p| field(p)).collect();
    let inside = |v: usize| values[v] <= 0.0;
    let at = |v: usize| (v, mesh.vertices[v]);
    let sides = |t: &[u32; 3]| [0, 1, 2].map(|k| (t[k] as usize, t[(k + 1) % 3] as usize));
    let mut snapped = Snapped::default();
    for (a, b) in mesh.triangles.iter().flat_map(sides) {
        if inside(a) != inside(b) {
            let (a, b) = if inside(a) { (a, b) } else { (b, a) };
            let cross = || crossing(mesh.vertices[a], mesh.vertices[b], &field);
            snapped.cross(at(a), at(b), cross);
        }
    }
    let mut new = Mesh::default();
    let mut known: HashMap<Corner, u32> = HashMap::new();
    for triangle in &mesh.triangles {
        let mut outline: Vec<(Corner, DVec3)> = Vec::with_capacity(4);
        let reached = |v: usize| inside(v) || snapped.holds(v);
        for (a, b) in sides(triangle) {
            if reached(a) {
                outline.push((Corner::Point(a), snapped.place(a, mesh.vertices[a])));
            }
            if reached(a) != reached(b) {
                let (low, high) = if reached(a) { (a, b) } else { (b, a) };
                outline.push(snapped.corner(low, high));
            }
        }
        outline.dedup_by_key(|c| c.0);
        // in a notch all three may have been moved onto the cut from outside
        if triangle.iter().all(|&v| snapped.holds(v as usize)) {
            let middle: DVec3 = outline.iter().map(|c| c.1).sum();
            if field(middle / outline.len() as f64) > 0.0 {
                continue;
            }
        }
        let vertex = |(corner, place): (Corner, DVec3)| {
            *known.entry(corner).or_insert_with(|| {
                new.vertices.push(place);
                new.vertices.len() as u32 - 1
            })
        };
        let outline: Vec<u32> = outline.into_iter().map(vertex).collect();
        for k in 2..outline.len() {
            let triangle = [outline[0], outline[k - 1], outline[k]];
            if !is_degenerate(triangle) {
                new.triangles.push(triangle);
            }
        }
    }
    new
}

/// A corner of what is cut: a point of the grid or mesh that was moved onto the cut or lies inside it, or a place on an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Corner {
    Point(usize),
    Edge(usize, usize),
}

/// Where edges are crossed. Crossings near an end share that end, moved onto the nearest of them: so no triangle becomes a shred
/// (after Raman and Wenger 2008).
#[derive(Default)]
struct Snapped {
    edges: HashMap<(usize, usize), DVec3>,
    at: HashMap<usize, (f64, DVec3)>,
}

impl Snapped {
    /// Takes in the edge from a point not above zero to one above it.
    fn cross(&mut self, a: (usize, DVec3), b: (usize, DVec3), share: impl Fn() -> f64) {
        let Entry::Vacant(edge) = self.edges.entry((a.0, b.0)) else {
            return;
        };
        let share = share();
        let place = a.1.lerp(b.1, share);
        edge.insert(place);
        for (end, far) in [(a.0, share), (b.0, 1.0 - share)] {
            if far < self.at.get(&end).map_or(NEAR, |found| found.0) {
                self.at.insert(end, (far, place));
            }
        }
    }

    /// Whether a point was moved onto the cut: it then counts as not above zero.
    fn holds(&self, point: usize) -> bool {
        self.at.contains_key(&point)
    }

    /// Where a point lies that was at `place`.
    fn place(&self, point: usize, place: DVec3) -> DVec3 {
        self.at.get(&point).map_or(place, |found| found.1)
    }

    /// The corner on the edge from a point not above zero to one above it.
    fn corner(&self, a: usize, b: usize) -> (Corner, DVec3) {
        match (self.at.get(&a), self.edges.get(&(a, b))) {
            (Some(found), _) => (Corner::Point(a), found.1),
            (None, Some(found)) => (Corner::Edge(a, b), *found),
            // every edge that is crossed was taken in
            (None, None) => (Corner::Edge(a, b), DVec3::NAN),
        }
    }
}

/// The six edges of a tetrahedron.
fn pairs(t: [usize; 4]) -> [[usize; 2]; 6] {
    [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]].map(|[i, j]| [t[i], t[j]])
}

/// The pieces of a mesh that hang together by edges, in the order of their first triangles.
pub fn pieces(mesh: &Mesh) -> Vec<Mesh> {
    let sorted = half_edges(mesh);
    let shells = shells(mesh, &sorted);
    let mut pieces = vec![Mesh::default(); shells.count];
    let mut known: HashMap<(u32, u32), u32> = HashMap::new();
    for (&shell, triangle) in shells.shell.iter().zip(&mesh.triangles) {
        let Some(piece) = pieces.get_mut(shell as usize) else {
            continue;
        };
        let own = triangle.map(|v| {
            *known.entry((shell, v)).or_insert_with(|| {
                piece.vertices.push(mesh.vertices[v as usize]);
                piece.vertices.len() as u32 - 1
            })
        });
        piece.triangles.push(own);
    }
    pieces
}

/// The rims of a mesh with two triangles at most to an edge: closed lines of its vertices, the mesh on their left seen against its normal.
pub fn rims(mesh: &Mesh) -> Vec<Vec<u32>> {
    let all = || {
        let triangles = mesh.triangles.iter();
        triangles.flat_map(|t| (0..3).map(move |k| (t[k], t[(k + 1) % 3])))
    };
    let sides: HashSet<(u32, u32)> = all().collect();
    // in the order of triangles: a set's own order is not that of the next run
    let open: Vec<(u32, u32)> = all().filter(|&(a, b)| !sides.contains(&(b, a))).collect();
    let mut next: HashMap<u32, Vec<u32>> = HashMap::new();
    for &(a, b) in open.iter().rev() {
        next.entry(a).or_default().push(b);
    }
    let mut lines = Vec::new();
    for &(start, _) in &open {
        let mut line = Vec::new();
        let mut at = start;
        while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
            line.push(at);
            at = to;
            if at == start {
                break;
            }
        }
        if line.len() > 2 {
            lines.push(line);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    const BOX: (DVec3, DVec3) = (DVec3::splat(-12.0), DVec3::splat(12.0));

    #[test]
    fn a_ball_has_its_area_and_volume_and_shows_outwards() {
        let far = |p: DVec3| p.length();
        let sampled = Sampled::new(BOX, 0.5, far).unwrap();
        for radius in [5.0, 10.0] {
            let mesh = sampled.surface(radius, far);
            assert!((mesh.volume() / (4.0 / 3.0 * PI * radius.powi(3)) - 1.0).abs() < 0.005);
            assert!((mesh.area() / (4.0 * PI * radius * radius) - 1.0).abs() < 0.005);
            assert_eq!(rims(&mesh), Vec::<Vec<u32>>::new());
            let off = |p: &DVec3| (p.length() - radius).abs();
            assert!(mesh.vertices.iter().map(off).fold(0.0, f64::max) < 1e-3);
        }
    }

    #[test]
    fn a_piece_of_it_has_one_rim_on_the_cut() {
        let far = |p: DVec3| p.length();
        let ball = Sampled::new(BOX, 0.5, far).unwrap().surface(10.0, far);
        let cap = piece(&ball, |p| 6.0 - p.z);
        // 2 pi r h
        assert!((cap.area() / (TAU * 10.0 * 4.0) - 1.0).abs() < 0.005);
        let [rim] = &rims(&cap)[..] else { panic!() };
        let rim: Vec<DVec3> = rim
            .iter()
            .chain(rim.first())
            .map(|&v| cap.vertices[v as usize])
            .collect();
        assert!(rim.iter().all(|p| (p.z - 6.0).abs() < 1e-3));
        let long: f64 = rim.windows(2).map(|w| w[0].distance(w[1])).sum();
        assert!((long / (TAU * 8.0) - 1.0).abs() < 0.005, "{long}");
        assert!(piece(&ball, |_| 1.0).triangles.is_empty());
    }

    #[test]
    fn what_is_forgotten_has_no_surface() {
        let far = |p: DVec3| p.length();
        let mut sampled = Sampled::new(BOX, 0.5, far).unwrap();
        let whole = sampled.surface(10.0, far);
        sampled.keep(|p, _| p.z > 9.0, 1.0);
        let cap = sampled.surface(10.0, far);
        // 9.0 is the last that does not hold: from 9.5 two cells down
        let low = cap
            .vertices
            .iter()
            .map(|p| p.z)
            .fold(f64::INFINITY, f64::min);
        assert!((low - 8.5).abs() < 0.2, "{low}");
        let above = piece(&whole, |p| 9.0 - p.z);
        assert!((piece(&cap, |p| 9.0 - p.z).area() - above.area()).abs() < 1e-9);
        sampled.keep(|_, _| false, 1.0);
        assert_eq!(sampled.greatest(), f64::NEG_INFINITY);
    }

    #[test]
    fn what_is_too_fine_or_empty_is_refused() {
        let flat = (DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0));
        let size = Sampled::new(flat, 0.5, |p| p.x);
        assert!(matches!(size, Err(LevelError::Size { .. })));
        let fine = Sampled::new(BOX, 0.01, |p| p.x);
        assert!(matches!(fine, Err(LevelError::TooFine { .. })));
    }
}
