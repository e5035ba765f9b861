//! The metal's surface as a closed mesh: surface nets (Gibson 1998), one vertex for each cube of eight voxel centres that the
//! surface of half-filled places crosses, one quad for each pair of neighbours on its two sides.

use std::collections::HashMap;

use super::{EMPTY, FULL, STEP, Voxels};
use crate::Mesh;
use crate::math::DVec3;

/// A place is metal from this share on.
const HALF: f64 = 0.5;
/// The surface stays this share of a voxel away from voxel centres, so that no two vertices coincide, not even as 32-bit numbers.
const APART: f64 = 0.02;

impl Voxels {
    /// The metal as a closed mesh; empty where there is none. Its volume differs from the voxels' by the pores inside and by what
    /// edges lose: compare the two.
    pub fn to_mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        let mut vertex_of: HashMap<[i64; 3], u32> = HashMap::new();
        let blocks = self.crossed_blocks();
        for &base in &blocks {
            each_voxel(base, |v| {
                if let Some(p) = self.net_vertex(v) {
                    vertex_of.insert(v, mesh.vertices.len() as u32);
                    mesh.vertices.push(p);
                }
            });
        }
        for &base in &blocks {
            each_voxel(base, |v| {
                let inside = self.at(v) >= HALF;
                for axis in 0..3 {
                    let mut next = v;
                    next[axis] += 1;
                    if (self.at(next) >= HALF) == inside {
                        continue;
                    }
                    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
                    let around = [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(db, dc)| {
                        let mut cube = v;
                        cube[b] -= db;
                        cube[c] -= dc;
                        vertex_of.get(&cube).copied()
                    });
                    if let [Some(p), Some(q), Some(r), Some(s)] = around {
                        // outwards: towards `next` where this voxel is the metal
                        let [q, s] = if inside { [q, s] } else { [s, q] };
                        mesh.triangles.push([p, q, r]);
                        mesh.triangles.push([p, r, s]);
                    }
                }
            });
        }
        mesh
    }

    /// First voxels of the blocks that the surface may cross, with those before them, in the table's order; voxels outside the box
    /// are air.
    fn crossed_blocks(&self) -> Vec<[i64; 3]> {
        let n = self.blocks_along.map(i64::from);
        let entry = |b: [i64; 3]| {
            if (0..3).all(|a| (0..n[a]).contains(&b[a])) {
                self.table[((b[2] * n[1] + b[1]) * n[0] + b[0]) as usize]
            } else {
                EMPTY
            }
        };
        let mut crossed = Vec::new();
        for k in -1..n[2] {
            for j in -1..n[1] {
                for i in -1..n[0] {
                    let own = entry([i, j, k]);
                    let same = |d: i64| entry([i + (d & 1), j + (d >> 1 & 1), k + (d >> 2)]) == own;
                    if !((own == EMPTY || own == FULL) && (1..8).all(same)) {
                        crossed.push([i, j, k].map(|b| b * STEP));
                    }
                }
            }
        }
        crossed
    }

    /// The vertex of the cube from voxel `v` to the next along each axis: the mean of the places where its edges are crossed.
    fn net_vertex(&self, v: [i64; 3]) -> Option<DVec3> {
        let mut value = [0.0; 8];
        for (n, f) in (0..).zip(&mut value) {
            *f = self.at([v[0] + (n & 1), v[1] + (n >> 1 & 1), v[2] + (n >> 2)]);
        }
        let metal = value.iter().filter(|f| **f >= HALF).count();
        if metal == 0 || metal == 8 {
            return None;
        }
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for n in 0..8usize {
            for axis in 0..3 {
                let m = n | 1 << axis;
                if m == n || (value[n] >= HALF) == (value[m] >= HALF) {
                    continue;
                }
                let mut p = DVec3::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64);
                p[axis] = ((HALF - value[n]) / (value[m] - value[n])).clamp(APART, 1.0 - APART);
                sum += p;
                count += 1.0;
            }
        }
        let at = DVec3::from_array(v.map(|c| c as f64)) + sum / count;
        Some(self.origin + self.cell * at)
    }
}

/// Calls `f` with each voxel of the block that begins at `base`.
fn each_voxel(base: [i64; 3], mut f: impl FnMut([i64; 3])) {
    let n = STEP;
    for k in 0..n {
        for j in 0..n {
            for i in 0..n {
                f([base[0] + i, base[1] + j, base[2] + k]);
            }
        }
    }
}
