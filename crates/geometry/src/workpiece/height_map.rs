//! Height map: one z per square cell over a plate. Memory is proportional to plan area.

mod mesh;

use std::ops::Range;

use meltpath_base::parallel;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Crop, Workpiece};
use crate::{
    Mesh,
    math::{DVec2, DVec3},
};

/// The largest map accepted, cells: 1.6 GB of heights.
pub const MAX_CELLS: u64 = 200_000_000;

/// Why a height map could not be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WorkpieceError {
    /// The cell size is not a positive number.
    #[error("height map: cell size {cell} mm must be a positive number")]
    Cell {
        /// The value given, mm.
        cell: f64,
    },
    /// The bounds are not finite, or reversed.
    #[error(
        "height map: bounds from ({}, {}) to ({}, {}) mm are not finite or are reversed",
        lo.x, lo.y, hi.x, hi.y
    )]
    Bounds {
        /// Lower corner given, mm.
        lo: DVec2,
        /// Upper corner given, mm.
        hi: DVec2,
    },
    /// The map would not fit in memory.
    #[error(
        "height map: {width} x {depth} mm at {cell} mm cells makes {cells} cells (at most {MAX_CELLS}): \
         use cells of {remedy:.3} mm or more, or check the part's unit"
    )]
    TooLarge {
        /// Plan extent along x, mm.
        width: f64,
        /// Plan extent along y, mm.
        depth: f64,
        /// Cell size asked, mm.
        cell: f64,
        /// Number of cells this makes.
        cells: f64,
        /// Smallest cell size that fits, mm.
        remedy: f64,
    },
    /// The heights do not match the grid.
    #[error(
        "height map: {len} heights for {nx} x {ny} cells: the stored map is damaged or was cut short"
    )]
    Shape {
        /// Number of heights given.
        len: usize,
        /// Cells along x.
        nx: usize,
        /// Cells along y.
        ny: usize,
    },
    /// A height is not a number.
    #[error("height map: the height of cell ({ix}, {iy}) is not a finite number")]
    Height {
        /// Column of the cell.
        ix: usize,
        /// Row of the cell.
        iy: usize,
    },
}

/// Heights over a plate, one per square cell, in the part frame (mm, z up).
///
/// - Structure: row-major, cell (ix, iy) at `iy * nx + ix`, its centre at `origin + cell * (ix, iy)`. The
///   plate goes on at `base` outside the grid.
/// - Use: planar builds from a plate; each place has one height, so what hangs over is filled below it.
/// - Validity: `z.len() == nx * ny`, `nx, ny >= 1`, all values finite.
///
/// ```
/// use meltpath_geometry::{math::DVec2, workpiece::HeightMap};
/// let mut map = HeightMap::new(DVec2::ZERO, DVec2::new(20.0, 10.0), 0.5, 0.0).unwrap();
/// let (ix, iy) = map.cell_at(DVec2::new(10.0, 5.0)).unwrap();
/// map.add_volume(ix, iy, 3.0);
/// assert_eq!(map.volume(), 3.0);
/// assert_eq!(map.height(map.centre(ix, iy)), 12.0);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeightMap {
    /// Centre of cell (0, 0), mm.
    pub origin: DVec2,
    /// Side of a cell, mm.
    pub cell: f64,
    /// Cells along x.
    pub nx: usize,
    /// Cells along y.
    pub ny: usize,
    /// Height of the plate, mm.
    pub base: f64,
    /// Heights, mm, row-major.
    pub z: Vec<f64>,
}

impl HeightMap {
    /// A bare plate at height `base` covering `lo`..`hi` with square cells of side `cell`, all mm.
    ///
    /// The grid starts at `lo` and covers `hi`; it overshoots by less than one cell.
    ///
    /// # Errors
    /// A cell size or bounds that make no sense, or more than [`MAX_CELLS`] cells.
    pub fn new(lo: DVec2, hi: DVec2, cell: f64, base: f64) -> Result<Self, WorkpieceError> {
        if !(cell.is_finite() && cell > 0.0) {
            return Err(WorkpieceError::Cell { cell });
        }
        let size = hi - lo;
        if !(lo.is_finite() && hi.is_finite() && size.is_finite() && base.is_finite())
            || size.min_element() < 0.0
        {
            return Err(WorkpieceError::Bounds { lo, hi });
        }
        // a hair of tolerance: 10 mm in cells of 0.1 mm is 100 cells, not 101
        let count = |length: f64| (length / cell - 1e-9).ceil().max(1.0);
        let (nx, ny) = (count(size.x), count(size.y));
        if nx * ny > MAX_CELLS as f64 {
            let area = size.x.max(cell) * size.y.max(cell);
            return Err(WorkpieceError::TooLarge {
                width: size.x,
                depth: size.y,
                cell,
                cells: nx * ny,
                // 0.1 % above the exact value: rounding up the counts must not undo the remedy
                remedy: 1.001 * (area / MAX_CELLS as f64).sqrt(),
            });
        }
        let (nx, ny) = (nx as usize, ny as usize);
        Ok(HeightMap {
            origin: lo + DVec2::splat(0.5 * cell),
            cell,
            nx,
            ny,
            base,
            z: vec![base; nx * ny],
        })
    }

    /// Rebuilds a map from its stored columns, checking them.
    ///
    /// # Errors
    /// A wrong cell size, an origin that is not finite, a height count that does not match, or a height
    /// that is not finite.
    pub fn from_columns(
        origin: DVec2,
        cell: f64,
        (nx, ny): (usize, usize),
        base: f64,
        z: Vec<f64>,
    ) -> Result<Self, WorkpieceError> {
        if !(cell.is_finite() && cell > 0.0) {
            return Err(WorkpieceError::Cell { cell });
        }
        if !(origin.is_finite() && base.is_finite()) {
            return Err(WorkpieceError::Bounds {
                lo: origin,
                hi: origin,
            });
        }
        if nx == 0 || ny == 0 || nx.checked_mul(ny) != Some(z.len()) {
            return Err(WorkpieceError::Shape {
                len: z.len(),
                nx,
                ny,
            });
        }
        if let Some(i) = z.iter().position(|h| !h.is_finite()) {
            return Err(WorkpieceError::Height {
                ix: i % nx,
                iy: i / nx,
            });
        }
        Ok(HeightMap {
            origin,
            cell,
            nx,
            ny,
            base,
            z,
        })
    }

    /// Position of cell (ix, iy) in `z`.
    pub fn index(&self, ix: usize, iy: usize) -> usize {
        iy * self.nx + ix
    }

    /// Centre of cell (ix, iy), mm.
    pub fn centre(&self, ix: usize, iy: usize) -> DVec2 {
        self.origin + self.cell * DVec2::new(ix as f64, iy as f64)
    }

    /// The corners of the covered rectangle (cell edges, not centres), mm.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        let half = DVec2::splat(0.5 * self.cell);
        (
            self.origin - half,
            self.centre(self.nx - 1, self.ny - 1) + half,
        )
    }

    /// The cell that holds a point of the plan, or `None` outside the grid.
    pub fn cell_at(&self, p: DVec2) -> Option<(usize, usize)> {
        let g = (p - self.origin) / self.cell + DVec2::splat(0.5);
        let inside = g.x >= 0.0 && g.y >= 0.0 && g.x < self.nx as f64 && g.y < self.ny as f64;
        inside.then_some((g.x as usize, g.y as usize))
    }

    /// The columns and rows whose centres lie in the rectangle `lo`..=`hi`; empty ranges off the grid.
    pub fn cells_within(&self, lo: DVec2, hi: DVec2) -> (Range<usize>, Range<usize>) {
        let axis = |lo: f64, hi: f64, n: usize| {
            let first = lo.ceil().clamp(0.0, n as f64) as usize;
            let past = (hi.floor() + 1.0).clamp(0.0, n as f64) as usize;
            first..past.max(first)
        };
        let (lo, hi) = (
            (lo - self.origin) / self.cell,
            (hi - self.origin) / self.cell,
        );
        (axis(lo.x, hi.x, self.nx), axis(lo.y, hi.y, self.ny))
    }

    /// Height of the surface at a point of the plan, mm: bilinear between cell centres, constant from the
    /// outermost centres to the grid's edge, `base` outside the grid.
    pub fn height(&self, p: DVec2) -> f64 {
        let g = (p - self.origin) / self.cell;
        let (nx, ny) = (self.nx as f64, self.ny as f64);
        // a NaN point fails this test and stands outside
        let inside = g.x >= -0.5 && g.y >= -0.5 && g.x <= nx - 0.5 && g.y <= ny - 0.5;
        if !inside {
            return self.base;
        }
        let (gx, gy) = (g.x.clamp(0.0, nx - 1.0), g.y.clamp(0.0, ny - 1.0));
        let (ix, iy) = (gx as usize, gy as usize);
        let (jx, jy) = ((ix + 1).min(self.nx - 1), (iy + 1).min(self.ny - 1));
        let (u, v) = (gx - ix as f64, gy - iy as f64);
        let at = |ix, iy| self.z[self.index(ix, iy)];
        let low = at(ix, iy) * (1.0 - u) + at(jx, iy) * u;
        let high = at(ix, jy) * (1.0 - u) + at(jx, jy) * u;
        low * (1.0 - v) + high * v
    }

    /// Vertical distance from a point down to the surface, mm; negative when the point is in the metal.
    ///
    /// This is the distance from the contact tube to the part for a vertical torch.
    pub fn distance_below(&self, from: DVec3) -> f64 {
        from.z - self.height(from.truncate())
    }

    /// Raises cell (ix, iy) by `volume` mm³.
    pub fn add_volume(&mut self, ix: usize, iy: usize, volume: f64) {
        let i = self.index(ix, iy);
        self.z[i] += volume / (self.cell * self.cell);
    }

    /// Metal above the base, mm³ (cells below the base count as negative).
    ///
    /// Summed in fixed chunks: the same bits on any number of threads.
    pub fn volume(&self) -> f64 {
        parallel::sum(&self.z, |z| z - self.base) * self.cell * self.cell
    }

    /// Greatest height of the map, mm.
    pub fn maximum(&self) -> f64 {
        self.z.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// The surface over a polyline in plan: (arc length, z) at every vertex of `line` and at most `step` mm
    /// apart between them. Empty for an empty line; `step` is never taken below a thousandth of a cell.
    pub fn section(&self, line: &[DVec2], step: f64) -> Vec<DVec2> {
        let Some(&first) = line.first() else {
            return Vec::new();
        };
        let step = if step.is_finite() { step } else { self.cell }.max(1e-3 * self.cell);
        let mut profile = vec![DVec2::new(0.0, self.height(first))];
        let mut s = 0.0;
        for w in line.windows(2) {
            let length = w[0].distance(w[1]);
            let pieces = (length / step).ceil().max(1.0);
            for k in 1..=pieces as u64 {
                let t = k as f64 / pieces;
                profile.push(DVec2::new(s + t * length, self.height(w[0].lerp(w[1], t))));
            }
            s += length;
        }
        profile
    }

    /// The mean cross-section of what lies along a path: for each lateral offset, the surface averaged
    /// over stations at most `step` mm apart along `path`, offset to the left of travel (mm, negative: right).
    ///
    /// Returns (offset, mean z) per entry of `offsets`; offset lines do not mitre at corners, stations do.
    pub fn mean_section(&self, path: &[DVec2], offsets: &[f64], step: f64) -> Vec<DVec2> {
        let step = if step.is_finite() { step } else { self.cell }.max(1e-3 * self.cell);
        let mut sums = vec![0.0; offsets.len()];
        let mut length_sum = 0.0;
        for w in path.windows(2) {
            let length = w[0].distance(w[1]);
            if length == 0.0 {
                continue;
            }
            let left = (w[1] - w[0]).perp() / length;
            let pieces = (length / step).ceil().max(1.0);
            let weight = length / pieces;
            for k in 0..pieces as u64 {
                // midpoints: each station stands for `weight` mm of path
                let p = w[0].lerp(w[1], (k as f64 + 0.5) / pieces);
                for (sum, &offset) in sums.iter_mut().zip(offsets) {
                    *sum += weight * self.height(p + left * offset);
                }
            }
            length_sum += length;
        }
        if length_sum == 0.0 {
            let at = path.first().map_or(self.base, |&p| self.height(p));
            return offsets.iter().map(|&o| DVec2::new(o, at)).collect();
        }
        offsets
            .iter()
            .zip(sums)
            .map(|(&o, sum)| DVec2::new(o, sum / length_sum))
            .collect()
    }

    /// First crossing of a slanted ray with the bilinear surface; parameters in units of `direction`.
    fn slanted_crossing(&self, from: DVec3, direction: DVec3) -> Option<f64> {
        // along the ray the surface changes formula only where it crosses a line of cell centres or the
        // grid's edge: cut there, and solve the quadratic of each piece
        let g = (from.truncate() - self.origin) / self.cell;
        let d = direction.truncate() / self.cell;
        let (nx, ny) = (self.nx as f64, self.ny as f64);
        let mut enter: f64 = 0.0;
        let mut leave = f64::INFINITY;
        for (g, d, n) in [(g.x, d.x, nx), (g.y, d.y, ny)] {
            if d == 0.0 {
                if !(-0.5..=n - 0.5).contains(&g) {
                    leave = f64::NEG_INFINITY;
                }
            } else {
                let (a, b) = ((-0.5 - g) / d, (n - 0.5 - g) / d);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        // where the ray meets the plate outside the grid
        let plate = (self.base - from.z) / direction.z;
        let plate = (plate >= 0.0 && plate.is_finite()).then_some(plate);
        if enter >= leave {
            return plate;
        }
        if let Some(t) = plate.filter(|&t| t < enter) {
            return Some(t);
        }
        let gap = |t: f64| self.distance_below(from + direction * t);
        if gap(enter) <= 0.0 {
            return Some(enter);
        }
        let mut t = enter;
        while t < leave {
            let mut next = leave;
            for (g, d) in [(g.x, d.x), (g.y, d.y)] {
                if d != 0.0 {
                    let here = g + d * t;
                    let line = if d > 0.0 {
                        here.floor() + 1.0
                    } else {
                        here.ceil() - 1.0
                    };
                    let cut = (line - g) / d;
                    // rounding may return the line we stand on: take the one after
                    let cut = if cut <= t { cut + 1.0 / d.abs() } else { cut };
                    next = next.min(cut);
                }
            }
            if let Some(hit) = first_root(&gap, t, next) {
                return Some(hit);
            }
            t = next;
        }
        // past the grid the ray may still come down on the plate
        plate.filter(|&p| p >= leave)
    }
}

/// First zero in `a`..=`b` of a function that is quadratic there and positive at `a`.
fn first_root(gap: &impl Fn(f64) -> f64, a: f64, b: f64) -> Option<f64> {
    let (ga, gm, gb) = (gap(a), gap(0.5 * (a + b)), gap(b));
    // the parabola through three points, in the local variable 0..1
    let quadratic = 2.0 * (ga - 2.0 * gm + gb);
    let linear = gb - ga - quadratic;
    let scale = ga.abs().max(gb.abs()).max(gm.abs());
    let local = if quadratic.abs() <= 1e-12 * scale {
        (ga > 0.0 && gb <= 0.0).then(|| ga / (ga - gb))
    } else {
        let disc = linear * linear - 4.0 * quadratic * ga;
        if disc < 0.0 {
            None
        } else {
            // the form that does not cancel
            let q = -0.5 * (linear + disc.sqrt().copysign(linear));
            let mut roots = [q / quadratic, if q == 0.0 { 0.0 } else { ga / q }];
            roots.sort_by(f64::total_cmp);
            roots.into_iter().find(|r| (0.0..=1.0).contains(r))
        }
    };
    let local = local.or((gb <= 0.0).then_some(1.0))?;
    Some(a + local * (b - a))
}

impl Workpiece for HeightMap {
    fn ray_to_surface(&self, from: DVec3, direction: DVec3) -> Option<f64> {
        let direction = direction.try_normalize()?;
        if !from.is_finite() {
            return None;
        }
        if self.distance_below(from) <= 0.0 {
            return Some(0.0);
        }
        if direction.x == 0.0 && direction.y == 0.0 {
            return (direction.z < 0.0).then(|| self.distance_below(from));
        }
        self.slanted_crossing(from, direction)
    }

    /// A height map grows along z only, whatever `axis` is. The volume is shared over the cells whose
    /// centres lie in the disc (the cell under `at` when none does), so that it is laid whole.
    fn add(&mut self, at: DVec3, _axis: DVec3, radius: f64, volume: f64) -> f64 {
        let p = at.truncate();
        let reach = DVec2::splat(radius.max(0.0));
        let (columns, rows) = self.cells_within(p - reach, p + reach);
        let inside: Vec<(usize, usize)> = rows
            .flat_map(|iy| columns.clone().map(move |ix| (ix, iy)))
            .filter(|&(ix, iy)| self.centre(ix, iy).distance(p) <= radius)
            .collect();
        let inside = if inside.is_empty() {
            self.cell_at(p).into_iter().collect()
        } else {
            inside
        };
        for &(ix, iy) in &inside {
            self.add_volume(ix, iy, volume / inside.len() as f64);
        }
        if inside.is_empty() { 0.0 } else { volume }
    }

    fn section(&self, line: &[DVec2], step: f64) -> Vec<DVec2> {
        HeightMap::section(self, line, step)
    }

    fn to_mesh(&self, crop: Crop, floor: f64) -> Mesh {
        HeightMap::to_mesh(self, crop, floor)
    }

    fn volume(&self) -> f64 {
        HeightMap::volume(self)
    }
}
