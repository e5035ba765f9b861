//! Columns through the voxels along any direction: the surface that one meets, and metal laid in one.

use super::{Voxels, whole};
use crate::math::DVec3;

/// Share from which a place is whole metal: rotated columns leave pores of some hundredths.
const WHOLE: f64 = 0.95;
/// Share from which what is missing of a voxel under new metal is a pore.
const PORE: f64 = 0.8;
/// Share below which a place is air.
const TRACE: f64 = 0.02;
/// Least share of a column that counts as a wall over its foot, and the rise over one voxel below which it has reached its share.
const LEAST: f64 = 0.05;
const LEVEL: f64 = 0.03;

/// What a column finds on its way down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Height of the surface along the axis, mm.
    pub top: f64,
    /// Share of the column's section that stands at `top`, the rest at `foot`: 1 but where an edge crosses it.
    pub cover: f64,
    /// Height of the lower surface, mm; `top` where the column is whole.
    pub foot: f64,
}

/// Columns of square section along one direction: a frame and their side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Columns {
    /// Place at height 0, mm.
    pub origin: DVec3,
    /// Unit vectors: the two sides of the section, and up along the columns.
    pub axes: [DVec3; 3],
    /// Side of the section, mm.
    pub side: f64,
}

impl Columns {
    /// The point at (x, y, z) of the frame, mm.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.origin + p.x * self.axes[0] + p.y * self.axes[1] + p.z * self.axes[2]
    }

    /// The coordinates of a point in the frame, mm.
    pub fn local(&self, p: DVec3) -> DVec3 {
        let d = p - self.origin;
        DVec3::new(
            d.dot(self.axes[0]),
            d.dot(self.axes[1]),
            d.dot(self.axes[2]),
        )
    }
}

impl Voxels {
    /// The first surface on the way down the column at (x, y) from height `from`, or from the air above where that is inside metal,
    /// but not above `ceiling`; `None` where there is none above `low`.
    ///
    /// The height is that of the metal in the column: it is exact where columns and voxels are in line, whatever the shares.
    pub fn column(
        &self,
        columns: &Columns,
        (x, y): (f64, f64),
        (low, from, ceiling): (f64, f64, f64),
    ) -> Option<Column> {
        let step = 0.5 * self.cell;
        let up = columns.axes[2];
        let foot = columns.point(DVec3::new(x, y, 0.0));
        let (base, slope) = ((foot - self.origin) / self.cell, up / self.cell);
        let f = |z: f64| self.sample_at(base + z * slope);
        let mut z = (from / step).ceil() * step;
        while f(z) > TRACE && z < ceiling {
            z += step;
        }
        let (mut sum, mut before, mut earlier) = (0.0, 0.0, 0.0);
        while z >= low {
            let v = f(z);
            let level = v > LEAST && v - earlier < LEVEL;
            if v >= WHOLE || level {
                let (share, z) = if v < before {
                    sum -= 0.5 * before * step;
                    (before, z + step)
                } else {
                    sum += 0.5 * v * step;
                    (v, z)
                };
                let top = z + sum / share;
                let cover = if share >= 0.9 { 1.0 } else { share };
                let foot = if cover < 1.0 {
                    self.foot(foot, up, (z - step, low), 0.5 * (1.0 + cover))
                } else {
                    top
                };
                return Some(Column { top, cover, foot });
            }
            sum += v * step;
            (earlier, before) = (before, v);
            z -= step;
        }
        None
    }

    /// Height below which a partly covered column is filled to `share`; `low` where it is not.
    fn foot(&self, base: DVec3, up: DVec3, (from, low): (f64, f64), share: f64) -> f64 {
        let step = 0.5 * self.cell;
        let (mut z, mut above) = (from, self.sample(base + from * up));
        while z >= low {
            let v = self.sample(base + z * up);
            if v >= share {
                let t = if v > above {
                    ((share - above) / (v - above)).clamp(0.0, 1.0)
                } else {
                    1.0
                };
                return z + step * (1.0 - t);
            }
            above = v;
            z -= step;
        }
        low
    }

    /// Lays metal in the column at (x, y) between two heights over a share of its section, and `owed` mm³ besides; returns what found
    /// no room (rounding of the shares in it), mm³.
    ///
    /// What a voxel has no room for goes up along the column. So no voxel is filled beyond 1 and the volume is exact.
    pub fn lay(
        &mut self,
        columns: &Columns,
        (x, y): (f64, f64),
        (from, to): (f64, f64),
        cover: f64,
        owed: f64,
    ) -> f64 {
        let step = 0.5 * self.cell;
        let (side, up) = (columns.side, columns.axes[2]);
        let slices = ((to - from) / step).ceil().max(1.0);
        let thick = (to - from) / slices;
        let share = cover * side * side * thick / 4.0;
        let enough = 1e-9 * self.cell.powi(3);
        let quarter = 0.25 * side;
        let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
            .map(|(a, b)| columns.point(DVec3::new(x + a * quarter, y + b * quarter, 0.0)));
        let mut owed = owed;
        if cover >= 1.0 {
            owed += self.close_pores(&corners, up, (from - (to - from), from));
        }
        for k in 0..slices as u32 {
            let height = (from + (f64::from(k) + 0.5) * thick) * up;
            for corner in corners {
                let wanted = share + owed;
                owed = wanted - self.add_cloud(corner + height, wanted);
            }
        }
        for k in 0..64 {
            if owed <= enough {
                break;
            }
            let height = (to + (f64::from(k) + 0.5) * step) * up;
            for corner in corners {
                owed -= self.add_cloud(corner + height, 0.25 * owed);
            }
        }
        owed
    }

    /// Fills voxels that are metal but for a pore, between two heights of a column that is laid over: rotated columns leave some
    /// hundredths open, and the pool melts into what it lies on. Returns what is then missing, negative, mm³.
    fn close_pores(&mut self, corners: &[DVec3; 4], up: DVec3, (from, to): (f64, f64)) -> f64 {
        let step = 0.5 * self.cell;
        let mut taken = 0.0;
        for k in 0..((to - from) / step).ceil() as u32 {
            let height = (to - f64::from(k) * step) * up;
            for corner in corners {
                let g = (*corner + height - self.origin) / self.cell + DVec3::splat(0.5);
                let v = [whole(g.x), whole(g.y), whole(g.z)];
                let share = self.at(v);
                if share > PORE && share < 1.0 {
                    taken += self.add(v, 1.0 - share);
                }
            }
        }
        -taken * self.cell.powi(3)
    }

    /// Spreads `volume` mm³ over a cube of half a voxel about a point, as far as there is room; returns what went in.
    fn add_cloud(&mut self, p: DVec3, volume: f64) -> f64 {
        let g = (p - self.origin) / self.cell + DVec3::splat(0.25);
        let (i, j, k) = (whole(g.x), whole(g.y), whole(g.z));
        // the cube reaches from g to g + 0.5 in units of voxels whose edges are whole numbers
        let beyond = |g: f64, first: i64| (2.0 * (g - 0.5 - first as f64)).max(0.0);
        let (bx, by, bz) = (beyond(g.x, i), beyond(g.y, j), beyond(g.z, k));
        let shares = volume / self.cell.powi(3);
        let mut placed = 0.0;
        for (dk, wk) in [(0, 1.0 - bz), (1, bz)] {
            for (dj, wj) in [(0, 1.0 - by), (1, by)] {
                for (di, wi) in [(0, 1.0 - bx), (1, bx)] {
                    let weight = wi * wj * wk;
                    if weight > 0.0 {
                        placed += self.add([i + di, j + dj, k + dk], weight * shares);
                    }
                }
            }
        }
        placed * self.cell.powi(3)
    }
}
