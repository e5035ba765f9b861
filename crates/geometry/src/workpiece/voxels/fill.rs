//! What is there before the first bead: boxes, and meshes by their winding number.

use super::{COUNT, EDGE, EMPTY, FULL, Voxels, VoxelsError};
use crate::Mesh;
use crate::math::{DVec2, DVec3};

/// Columns along a side of a voxel by which a mesh is measured.
const FINE: usize = 3;

/// What filling by a mesh found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshFill {
    /// Metal added, mm³.
    pub volume: f64,
    /// Share of the columns through the mesh that enter it and do not leave: more than 0 where it has holes.
    pub open: f64,
}

impl Voxels {
    /// Fills a box, corners in mm, to the share of each voxel that it covers.
    ///
    /// # Errors
    /// [`VoxelsError::TooLarge`].
    pub fn fill_box(&mut self, lo: DVec3, hi: DVec3) -> Result<(), VoxelsError> {
        let corner = self.bounds().0;
        let (lo, hi) = ((lo - corner) / self.cell, (hi - corner) / self.cell);
        let [nx, ny, _] = self.blocks_along.map(|n| n as usize);
        for block in 0..self.table.len() {
            let at = [block % nx, block / nx % ny, block / (nx * ny)];
            let base = DVec3::from_array(at.map(|n| (n * EDGE) as f64));
            let ends = base + DVec3::splat(EDGE as f64);
            if lo.cmpge(ends).any() || hi.cmple(base).any() || self.table[block] == FULL {
                continue;
            }
            if lo.cmple(base).all() && hi.cmpge(ends).all() && self.table[block] == EMPTY {
                self.table[block] = FULL;
                continue;
            }
            let covered = |n: usize, axis: usize| {
                let from = base[axis] + n as f64;
                (hi[axis].min(from + 1.0) - lo[axis].max(from)).max(0.0)
            };
            let Some(values) = self.values(block) else {
                return Err(self.too_large());
            };
            for (n, value) in values.iter_mut().enumerate() {
                let [i, j, k] = [n % EDGE, n / EDGE % EDGE, n / (EDGE * EDGE)];
                let share = covered(i, 0) * covered(j, 1) * covered(k, 2);
                *value = value.max(share as f32);
            }
        }
        Ok(())
    }

    /// Fills what a mesh encloses, by winding number: what several sheets cover counts once. Shares are exact along z and of three by
    /// three columns across.
    ///
    /// # Errors
    /// [`VoxelsError::TooLarge`].
    pub fn fill_mesh(&mut self, mesh: &Mesh) -> Result<MeshFill, VoxelsError> {
        let before = self.volume();
        let (mut open, mut met) = (0usize, 0usize);
        // one row of voxels at a time: memory of its crossings only
        let [nx, ny, _] = self.blocks_along.map(|n| n as usize);
        let rows = ny * EDGE;
        let columns = nx * EDGE * FINE;
        let mut of_row = triangles_of_rows(mesh, self, rows);
        let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); columns];
        for (j, triangles) in of_row.iter_mut().enumerate() {
            for sub in 0..FINE {
                let y = j as f64 + fine(sub);
                for &t in triangles.iter() {
                    self.cross(mesh, t as usize, y, &mut crossings);
                }
                for (c, found) in crossings.iter_mut().enumerate() {
                    if found.is_empty() {
                        continue;
                    }
                    met += 1;
                    open += usize::from(found.iter().map(|f| f.1).sum::<i32>() != 0);
                    found.sort_by(|a, b| a.0.total_cmp(&b.0));
                    self.fill_column((c / FINE, j), found)?;
                    found.clear();
                }
            }
        }
        self.join_blocks();
        Ok(MeshFill {
            volume: self.volume() - before,
            open: open as f64 / met.max(1) as f64,
        })
    }

    /// Where the row of columns at `y` crosses a triangle: heights, and the change of the winding number on the way up; in voxels.
    fn cross(&self, mesh: &Mesh, t: usize, y: f64, crossings: &mut [Vec<(f64, i32)>]) {
        let corner = self.bounds().0;
        let p = mesh.corners(t).map(|p| (p - corner) / self.cell);
        let flat = p.map(DVec3::truncate);
        let area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let low = flat[0].x.min(flat[1].x).min(flat[2].x);
        let high = flat[0].x.max(flat[1].x).max(flat[2].x);
        let n = FINE as f64;
        let first = ((low * n).floor() - 1.0).max(0.0) as usize;
        let last = ((high * n).ceil() + 1.0).clamp(0.0, crossings.len() as f64) as usize;
        for (c, found) in crossings.iter_mut().enumerate().take(last).skip(first) {
            let at = DVec2::new((c / FINE) as f64 + fine(c % FINE), y);
            let w = [
                side(flat[1], flat[2], at),
                side(flat[2], flat[0], at),
                side(flat[0], flat[1], at),
            ];
            if w.iter().all(|(_, left)| *left == (area > 0.0)) {
                let z = (w[0].0 * p[0].z + w[1].0 * p[1].z + w[2].0 * p[2].z) / area;
                found.push((z, if area < 0.0 { 1 } else { -1 }));
            }
        }
    }

    /// Adds what lies inside along one fine column.
    fn fill_column(
        &mut self,
        (i, j): (usize, usize),
        found: &[(f64, i32)],
    ) -> Result<(), VoxelsError> {
        let share = 1.0 / (FINE * FINE) as f64;
        let top = f64::from(self.blocks_along[2]) * EDGE as f64;
        let mut winding = 0;
        for pair in found.windows(2) {
            winding += pair[0].1;
            let (from, to) = (pair[0].0.clamp(0.0, top), pair[1].0.clamp(0.0, top));
            if winding == 0 || to <= from {
                continue;
            }
            let mut k = from.floor();
            while k < to {
                let length = to.min(k + 1.0) - from.max(k);
                let v = [i as f64, j as f64, k].map(|c| c as i64);
                if let Some((block, local)) = self.place(v)
                    && self.table[block] != FULL
                {
                    let Some(values) = self.values(block) else {
                        return Err(self.too_large());
                    };
                    let new = f64::from(values[local]) + share * length;
                    // nine ninths in single precision may miss one by a rounding
                    values[local] = if new > 1.0 - 1e-6 { 1.0 } else { new as f32 };
                }
                k += 1.0;
            }
        }
        Ok(())
    }

    /// Gives back the values of blocks that became whole.
    fn join_blocks(&mut self) {
        let mut kept = Vec::new();
        for entry in &mut self.table {
            if *entry == EMPTY || *entry == FULL {
                continue;
            }
            let values = std::mem::take(&mut self.blocks[*entry as usize]);
            if values.len() == COUNT && values.iter().all(|f| *f >= 1.0) {
                *entry = FULL;
            } else {
                *entry = kept.len() as u32;
                kept.push(values);
            }
        }
        self.blocks = kept;
    }
}

/// Where in a voxel its fine columns stand, a little off the round numbers that parts are drawn in.
fn fine(sub: usize) -> f64 {
    (sub as f64 + 0.5) / FINE as f64 + 1.237e-5
}

/// Twice the area beside an edge, and whether the point lies to its left. An edge gives the same answer to both its triangles: it is
/// taken from its smaller end, and a point on it counts as left of it.
fn side(p: DVec2, q: DVec2, at: DVec2) -> (f64, bool) {
    if (p.x, p.y) <= (q.x, q.y) {
        let w = (q - p).perp_dot(at - p);
        (w, w >= 0.0)
    } else {
        let w = (p - q).perp_dot(at - q);
        (-w, w < 0.0)
    }
}

/// The triangles that each row of voxels may cross.
fn triangles_of_rows(mesh: &Mesh, voxels: &Voxels, rows: usize) -> Vec<Vec<u32>> {
    let corner = voxels.bounds().0.y;
    let mut of_row: Vec<Vec<u32>> = vec![Vec::new(); rows];
    for t in 0..mesh.triangles.len() {
        let y = mesh.corners(t).map(|p| (p.y - corner) / voxels.cell());
        let low = y[0].min(y[1]).min(y[2]).floor();
        let high = y[0].max(y[1]).max(y[2]).floor();
        if low.is_finite() && high.is_finite() && high >= 0.0 && low < rows as f64 {
            for row in &mut of_row[low.max(0.0) as usize..=(high as usize).min(rows - 1)] {
                row.push(t as u32);
            }
        }
    }
    of_row
}
