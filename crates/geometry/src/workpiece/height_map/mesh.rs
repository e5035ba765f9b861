//! From height map to closed triangle mesh: top surface, skirt and flat bottom.

use super::HeightMap;
use crate::workpiece::Crop;
use crate::{Mesh, math::DVec3};

/// Marks a cell centre that no kept quad uses.
const UNUSED: u32 = u32::MAX;

impl HeightMap {
    /// The map as a closed, edge-manifold mesh: vertices on the cell centres, a skirt down to a flat
    /// bottom `floor` mm under the base (or under the lowest cell, if that lies below the base).
    ///
    /// With [`Crop::Built`], the mesh's volume is the built volume plus `floor` × its plan area (when
    /// nothing built touches the grid's border and the threshold is 0). A `floor` that is not positive is
    /// taken as one cell: a solid needs thickness. Empty when nothing is built, or for a map of one row
    /// or column.
    pub fn to_mesh(&self, crop: Crop, floor: f64) -> Mesh {
        if self.nx < 2 || self.ny < 2 {
            return Mesh::default();
        }
        let floor = if floor.is_finite() && floor > 0.0 {
            floor
        } else {
            self.cell
        };
        let (qx, qy) = (self.nx - 1, self.ny - 1);
        let kept = self.kept_quads(crop);
        let lowest = self.z.iter().copied().fold(self.base, f64::min);
        let bottom = lowest - floor;

        // one vertex above and one below each cell centre that a kept quad uses
        let mut top = vec![UNUSED; self.z.len()];
        let mut mesh = Mesh::default();
        for iy in 0..qy {
            for ix in 0..qx {
                if !kept[iy * qx + ix] {
                    continue;
                }
                for (jx, jy) in [(ix, iy), (ix + 1, iy), (ix, iy + 1), (ix + 1, iy + 1)] {
                    let i = self.index(jx, jy);
                    if top[i] == UNUSED {
                        top[i] = mesh.vertices.len() as u32;
                        let p = self.centre(jx, jy);
                        mesh.vertices.push(DVec3::new(p.x, p.y, self.z[i]));
                        mesh.vertices.push(DVec3::new(p.x, p.y, bottom));
                    }
                }
            }
        }
        // wrapping: left of column 0 is far beyond the last one, hence not kept
        let is_kept = |ix: usize, iy: usize| ix < qx && iy < qy && kept[iy * qx + ix];
        for iy in 0..qy {
            for ix in 0..qx {
                if !kept[iy * qx + ix] {
                    continue;
                }
                let v = |dx: usize, dy: usize| top[self.index(ix + dx, iy + dy)];
                let ring = [v(0, 0), v(1, 0), v(1, 1), v(0, 1)];
                let [a, b, c, d] = ring;
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
                // vertex + 1 is the one below
                mesh.triangles
                    .extend([[a + 1, c + 1, b + 1], [a + 1, d + 1, c + 1]]);
                let neighbours = [
                    (ix, iy.wrapping_sub(1)),
                    (ix + 1, iy),
                    (ix, iy + 1),
                    (ix.wrapping_sub(1), iy),
                ];
                for (side, (jx, jy)) in neighbours.into_iter().enumerate() {
                    if !is_kept(jx, jy) {
                        let (p, q) = (ring[side], ring[(side + 1) % 4]);
                        mesh.triangles.extend([[p, p + 1, q + 1], [p, q + 1, q]]);
                    }
                }
            }
        }
        mesh
    }

    /// Which quads between four cell centres belong to the mesh, row-major (nx−1 by ny−1).
    fn kept_quads(&self, crop: Crop) -> Vec<bool> {
        let (qx, qy) = (self.nx - 1, self.ny - 1);
        let threshold = match crop {
            Crop::Whole => return vec![true; qx * qy],
            Crop::Built { threshold } => threshold.max(0.0),
        };
        let mut kept = vec![false; qx * qy];
        for iy in 0..self.ny {
            for ix in 0..self.nx {
                if (self.z[self.index(ix, iy)] - self.base).abs() > threshold {
                    for jy in iy.saturating_sub(1)..=iy.min(qy - 1) {
                        for jx in ix.saturating_sub(1)..=ix.min(qx - 1) {
                            kept[jy * qx + jx] = true;
                        }
                    }
                }
            }
        }
        // two quads that touch at a corner only would share one vertical edge of the skirt four times:
        // fill one of the two empty corners until no such place is left (quads are only ever added)
        loop {
            let mut changed = false;
            for iy in 1..qy {
                for ix in 1..qx {
                    let [a, b, c, d] = [
                        (iy - 1) * qx + ix - 1,
                        (iy - 1) * qx + ix,
                        iy * qx + ix - 1,
                        iy * qx + ix,
                    ];
                    if kept[a] && kept[d] && !kept[b] && !kept[c] {
                        kept[b] = true;
                        changed = true;
                    } else if kept[b] && kept[c] && !kept[a] && !kept[d] {
                        kept[a] = true;
                        changed = true;
                    }
                }
            }
            if !changed {
                return kept;
            }
        }
    }
}
