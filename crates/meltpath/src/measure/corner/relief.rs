//! The surface of a corner on a grid of even cells.

use meltpath_geometry::math::{DVec2, DVec3};

/// Cells, mm: as fine as the source's grid, and coarse enough to hold points.
const CELL: [f64; 2] = [0.2, 1.2];
/// Cells are so large that they hold points on this share of the area of those twice as large: no line between lines of a scanner is
/// left empty.
const HELD: f64 = 0.97;
/// Parts of a cell along each side, which belong to a volume or not: its ends may run along rows of cells.
const PARTS: u32 = 6;
/// Cells without points are filled from their neighbours so many times.
const FILLED: u32 = 4;

/// Heights above the plate; NaN where nothing was seen.
#[derive(Debug, Clone)]
pub struct Relief {
    /// Middle of the first cell, mm.
    pub origin: DVec2,
    /// Side of a cell, mm.
    pub cell: f64,
    /// Cells along x.
    pub columns: usize,
    /// Row by row, mm.
    pub z: Vec<f64>,
    /// Whether a cell holds points of its own.
    pub seen: Vec<bool>,
}

impl Relief {
    /// Of points, mm: means over cells.
    pub(super) fn of(points: &[DVec3]) -> Self {
        let corners = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let [low, high] = points.iter().fold(corners, |[low, high], p| {
            [low.min(p.truncate()), high.max(p.truncate())]
        });
        let area = |side: f64| {
            let at = |p: &DVec3| ((p.truncate() - low) / side).floor().to_array();
            let mut cells: Vec<[u32; 2]> = points.iter().map(|p| at(p).map(|v| v as u32)).collect();
            cells.sort_unstable();
            cells.dedup();
            cells.len() as f64 * side * side
        };
        let mut cell = CELL[0];
        while cell < CELL[1] && area(cell) < HELD * area(2.0 * cell) {
            cell *= 1.2;
        }
        let size = ((high - low) / cell).floor();
        let (columns, rows) = (size.x as usize + 1, size.y as usize + 1);
        let mut sums = vec![(0.0, 0.0); columns * rows];
        for p in points {
            let at = ((p.truncate() - low) / cell).floor();
            if let Some(sum) = sums.get_mut(at.y as usize * columns + at.x as usize) {
                *sum = (sum.0 + p.z, sum.1 + 1.0);
            }
        }
        let mut relief = Relief {
            origin: low + DVec2::splat(0.5 * cell),
            cell,
            columns,
            seen: sums.iter().map(|s| s.1 > 0.0).collect(),
            z: sums.iter().map(|s| s.0 / s.1).collect(),
        };
        for _ in 0..FILLED {
            relief.fill();
        }
        relief
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.z.len() / self.columns
    }

    /// The middle of a cell, mm.
    pub fn middle(&self, cell: usize) -> DVec2 {
        let at = DVec2::new((cell % self.columns) as f64, (cell / self.columns) as f64);
        self.origin + self.cell * at
    }

    /// Gives cells without a height the mean of their neighbours.
    fn fill(&mut self) {
        let before = self.z.clone();
        let rows = self.rows();
        for (k, z) in self.z.iter_mut().enumerate() {
            if z.is_finite() {
                continue;
            }
            let (x, y) = (k % self.columns, k / self.columns);
            let (mut sum, mut n) = (0.0, 0.0);
            for j in y.saturating_sub(1)..=(y + 1).min(rows - 1) {
                for i in x.saturating_sub(1)..=(x + 1).min(self.columns - 1) {
                    let at = before[j * self.columns + i];
                    if at.is_finite() {
                        sum += at;
                        n += 1.0;
                    }
                }
            }
            if n >= 3.0 {
                *z = sum / n;
            }
        }
    }

    /// The volume over cells that belong, mm³, and the share of them that hold points of their own.
    pub(super) fn volume(&self, belongs: impl Fn(DVec2) -> bool) -> (f64, f64) {
        let (mut volume, mut all, mut seen) = (0.0, 0.0, 0.0);
        for (k, z) in self.z.iter().enumerate() {
            let middle = self.middle(k);
            let parts = (0..PARTS * PARTS).filter(|n| {
                let place = DVec2::new(f64::from(n % PARTS), f64::from(n / PARTS));
                let step = (place + 0.5) / f64::from(PARTS) - 0.5;
                belongs(middle + self.cell * step)
            });
            let share = parts.count() as f64 / f64::from(PARTS * PARTS);
            all += share;
            seen += share * f64::from(u8::from(self.seen[k]));
            if z.is_finite() {
                volume += share * z * self.cell * self.cell;
            }
        }
        (volume, seen / f64::max(all, 1.0))
    }

    /// Height over a place, mm: bilinear; NaN where a cell around it has none.
    pub(crate) fn height(&self, p: DVec2) -> f64 {
        let g = (p - self.origin) / self.cell;
        let (last_x, last_y) = ((self.columns - 1) as f64, (self.rows() - 1) as f64);
        if !(g.x >= 0.0 && g.y >= 0.0 && g.x <= last_x && g.y <= last_y) {
            return f64::NAN;
        }
        let (x, y) = (g.x as usize, g.y as usize);
        let (next_x, next_y) = ((x + 1).min(self.columns - 1), (y + 1).min(self.rows() - 1));
        let (u, v) = (g.x - x as f64, g.y - y as f64);
        let at = |x: usize, y: usize| self.z[y * self.columns + x];
        (at(x, y) * (1.0 - u) + at(next_x, y) * u) * (1.0 - v)
            + (at(x, next_y) * (1.0 - u) + at(next_x, next_y) * u) * v
    }
}
