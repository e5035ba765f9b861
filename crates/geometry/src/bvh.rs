//! A bounding-volume hierarchy over triangles: a complete binary tree over leaves in Morton order
//! (after Lauterbach et al. 2009), with single-precision boxes rounded outwards.

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::{Mesh, math::DVec3};

/// Triangles in one leaf.
const LEAF: usize = 8;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Bounds {
    const NOTHING: Bounds = Bounds {
        lo: [f32::INFINITY; 3],
        hi: [f32::NEG_INFINITY; 3],
    };

    fn of(points: [DVec3; 3]) -> Self {
        let lo = points[0].min(points[1]).min(points[2]);
        let hi = points[0].max(points[1]).max(points[2]);
        // the nearest float may lie inside: step outwards once
        Bounds {
            lo: lo.to_array().map(|x| (x as f32).next_down()),
            hi: hi.to_array().map(|x| (x as f32).next_up()),
        }
    }

    fn merged(mut self, other: Bounds) -> Bounds {
        for k in 0..3 {
            self.lo[k] = self.lo[k].min(other.lo[k]);
            self.hi[k] = self.hi[k].max(other.hi[k]);
        }
        self
    }

    fn meets(&self, other: &Bounds) -> bool {
        (0..3).all(|k| self.lo[k] <= other.hi[k] && other.lo[k] <= self.hi[k])
    }

    /// Square of the distance of a point, mm².
    fn squared_distance(&self, p: DVec3) -> f64 {
        let beyond = |k: usize| {
            let (lo, hi) = (f64::from(self.lo[k]), f64::from(self.hi[k]));
            (lo - p[k]).max(p[k] - hi).max(0.0)
        };
        (0..3).map(|k| beyond(k) * beyond(k)).sum()
    }

    /// Whether the ray from `origin` with inverse direction `inverse` meets the box ahead of it.
    fn hit(&self, origin: DVec3, inverse: DVec3) -> bool {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let a = (f64::from(self.lo[k]) - origin[k]) * inverse[k];
            let b = (f64::from(self.hi[k]) - origin[k]) * inverse[k];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

/// The tree. Node 1 is the root, node i has the children 2i and 2i + 1, the last `leaves` nodes are leaves.
#[derive(Debug)]
pub(crate) struct Bvh {
    nodes: Vec<Bounds>,
    leaves: usize,
    /// Triangle numbers in Morton order, [`LEAF`] to a leaf.
    order: Vec<u32>,
}

/// Spreads the low 21 bits of a number three apart.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1F_FFFF;
    x = (x | (x << 32)) & 0x001F_0000_0000_FFFF;
    x = (x | (x << 16)) & 0x001F_0000_FF00_00FF;
    x = (x | (x << 8)) & 0x100F_00F0_0F00_F00F;
    x = (x | (x << 4)) & 0x10C3_0C30_C30C_30C3;
    (x | (x << 2)) & 0x1249_2492_4924_9249
}

impl Bvh {
    /// Builds the tree over all triangles of a mesh with finite vertices.
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let (lo, hi) = mesh.bounds().unwrap_or_default();
        let scale =
            DVec3::splat(f64::from(1 << 21)) / (hi - lo).max(DVec3::splat(f64::MIN_POSITIVE));
        let mut coded: Vec<(u64, u32)> = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                let g = (((a + b + c) / 3.0 - lo) * scale)
                    .clamp(DVec3::ZERO, DVec3::splat(f64::from((1 << 21) - 1)));
                let code =
                    spread(g.x as u64) | (spread(g.y as u64) << 1) | (spread(g.z as u64) << 2);
                (code, t as u32)
            })
            .collect();
        coded.par_sort_unstable();
        let order: Vec<u32> = coded.into_iter().map(|(_, t)| t).collect();
        let leaves = order.len().div_ceil(LEAF).next_power_of_two();
        let mut nodes = vec![Bounds::NOTHING; 2 * leaves];
        nodes[leaves..]
            .par_iter_mut()
            .zip(order.par_chunks(LEAF))
            .for_each(|(node, triangles)| {
                *node = triangles
                    .iter()
                    .map(|&t| Bounds::of(mesh.corners(t as usize)))
                    .fold(Bounds::NOTHING, Bounds::merged);
            });
        for i in (1..leaves).rev() {
            nodes[i] = nodes[2 * i].merged(nodes[2 * i + 1]);
        }
        Bvh {
            nodes,
            leaves,
            order,
        }
    }

    /// Number of leaves that hold triangles.
    pub(crate) fn filled_leaves(&self) -> usize {
        self.order.len().div_ceil(LEAF)
    }

    /// Triangles of a leaf.
    fn leaf(&self, leaf: usize) -> &[u32] {
        let first = (leaf * LEAF).min(self.order.len());
        &self.order[first..(first + LEAF).min(self.order.len())]
    }

    /// Calls `visit` for every pair of triangles with meeting boxes of which the first is in `leaf`, each pair once over all leaves;
    /// until it breaks.
    pub(crate) fn pairs_from(
        &self,
        mesh: &Mesh,
        leaf: usize,
        mut visit: impl FnMut(u32, u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let own = self.leaf(leaf);
        let own_bounds: Vec<Bounds> = own
            .iter()
            .map(|&t| Bounds::of(mesh.corners(t as usize)))
            .collect();
        for (i, &a) in own.iter().enumerate() {
            for (j, &b) in own.iter().enumerate().skip(i + 1) {
                if own_bounds[i].meets(&own_bounds[j]) {
                    visit(a, b)?;
                }
            }
        }
        let bounds = self.nodes[self.leaves + leaf];
        let mut stack = vec![1];
        while let Some(node) = stack.pop() {
            if !self.nodes[node].meets(&bounds) {
                continue;
            }
            if node < self.leaves {
                stack.extend([2 * node + 1, 2 * node]);
                continue;
            }
            let other = node - self.leaves;
            if other <= leaf {
                continue;
            }
            for &b in self.leaf(other) {
                let b_bounds = Bounds::of(mesh.corners(b as usize));
                for (k, &a) in own.iter().enumerate() {
                    if own_bounds[k].meets(&b_bounds) {
                        visit(a, b)?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Calls `visit` for triangles, near boxes first, as long as their boxes may be nearer to `p` than the squared distance that it
    /// answers, mm².
    pub(crate) fn nearest(&self, p: DVec3, mut visit: impl FnMut(u32) -> f64) {
        if self.order.is_empty() || !p.is_finite() {
            return;
        }
        let far = |node: usize| self.nodes[node].squared_distance(p);
        let mut least = f64::INFINITY;
        let mut stack = vec![(far(1), 1)];
        while let Some((box_distance, node)) = stack.pop() {
            if box_distance >= least {
                continue;
            }
            if node < self.leaves {
                let (a, b) = ((far(2 * node), 2 * node), (far(2 * node + 1), 2 * node + 1));
                stack.extend(if a.0 < b.0 { [b, a] } else { [a, b] });
            } else {
                for &t in self.leaf(node - self.leaves) {
                    least = visit(t);
                }
            }
        }
    }

    /// Calls `visit` for every triangle whose leaf the ray may meet ahead of `origin`.
    pub(crate) fn along_ray(&self, origin: DVec3, direction: DVec3, mut visit: impl FnMut(u32)) {
        self.any_along_ray(origin, direction, |t| {
            visit(t);
            false
        });
    }

    /// Whether any of the triangles whose leaf the ray may meet ahead of `origin` is what `is` asks for.
    pub(crate) fn any_along_ray(
        &self,
        origin: DVec3,
        direction: DVec3,
        mut is: impl FnMut(u32) -> bool,
    ) -> bool {
        if self.order.is_empty() {
            return false;
        }
        let inverse = direction.recip();
        let mut stack = vec![1];
        while let Some(node) = stack.pop() {
            if !self.nodes[node].hit(origin, inverse) {
                continue;
            }
            if node < self.leaves {
                stack.extend([2 * node + 1, 2 * node]);
            } else if self.leaf(node - self.leaves).iter().any(|&t| is(t)) {
                return true;
            }
        }
        false
    }
}

/// Whether a ray meets a triangle ahead of its origin (Möller & Trumbore 1997).
pub(crate) fn meets([a, b, c]: &[DVec3; 3], origin: DVec3, direction: DVec3) -> bool {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return false;
    }
    let s = (origin - a) / determinant;
    let u = s.dot(p);
    let q = s.cross(e1);
    let v = direction.dot(q);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(q) > 0.0
}
#[cfg(test)]
mod tests {
    use super::*;

    /// Small triangles far apart, in no order: those of a leaf lie together.
    #[test]
    fn a_leaf_is_small() {
        let mut mesh = Mesh::default();
        for n in 0..4096_u32 {
            // 1723 is odd: every number up to 4096 once
            let n = n.wrapping_mul(1723) % 4096;
            let places = [n % 16, n / 16 % 16, n / 256].map(|k| 0.01 * f64::from(k));
            let corner = DVec3::from(places);
            let first = mesh.vertices.len() as u32;
            let small = [DVec3::ZERO, 1e-3 * DVec3::X, 1e-3 * DVec3::Y];
            mesh.vertices.extend(small.map(|d| corner + d));
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        let tree = Bvh::new(&mesh);
        // eight of a leaf are a cube of two by two by two
        for node in &tree.nodes[tree.leaves..] {
            for k in 0..3 {
                let width = node.hi[k] - node.lo[k];
                assert!(width < 0.012, "{node:?}");
            }
        }
    }
}
