//! Height map: one z per square cell over a plate. Memory is proportional to plan area.

mod mesh;

use std::ops::Range;

use meltpath_base::parallel;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::math::DVec2;

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
/// let cell = map.index(ix, iy);
/// map.z[cell] = 12.0;
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
        self.height_of(p, |i| self.z[i])
    }

    /// The same where cell `i` has the height `at(i)`.
    pub fn height_of(&self, p: DVec2, at: impl Fn(usize) -> f64) -> f64 {
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
        let at = |ix, iy| at(self.index(ix, iy));
        let low = at(ix, iy) * (1.0 - u) + at(jx, iy) * u;
        let high = at(ix, jy) * (1.0 - u) + at(jx, jy) * u;
        low * (1.0 - v) + high * v
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
}
