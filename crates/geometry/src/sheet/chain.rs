//! Lines between vertices below and above a level, chained from triangle to triangle.

use super::{NONE, Sheet};
use crate::math::DVec3;

/// A point of a line on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ChainPoint {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
    /// The triangle in which the line goes on from here; at the end of an open line the one in which it came.
    pub(super) triangle: u32,
}

impl Sheet {
    /// The lines through `mixed` triangles, sorted, each with vertices below the level and above it; open ones first. `crossing` says
    /// at which share of the way from below to above the line passes.
    pub(super) fn chains(
        &self,
        mixed: &[u32],
        below: &[bool],
        crossing: impl Fn(DVec3, DVec3) -> f64,
    ) -> Vec<Vec<ChainPoint>> {
        // the line enters where the sides run from below to above, and leaves where they run back: what is below stays on its left
        let side = |t: u32, leaves: bool| {
            let v = self.mesh.triangles[t as usize];
            (0..3).find(|&k| {
                let (a, b) = (below[v[k] as usize], below[v[(k + 1) % 3] as usize]);
                a != b && b == leaves
            })
        };
        let beyond = |t: u32, leaves: bool| {
            let over = side(t, leaves).map_or(NONE, |k| self.neighbours[t as usize][k]);
            mixed.binary_search(&over).ok()
        };
        let point = |t: u32, leaves: bool| {
            let v = self.mesh.triangles[t as usize];
            let k = side(t, leaves).unwrap_or(0);
            let (mut a, mut b) = (v[k] as usize, v[(k + 1) % 3] as usize);
            if !below[a] {
                (a, b) = (b, a);
            }
            let [p, q] = [a, b].map(|v| self.mesh.vertices[v]);
            let share = crossing(p, q);
            ChainPoint {
                position: p.lerp(q, share),
                normal: self.normals[a]
                    .lerp(self.normals[b], share)
                    .normalize_or_zero(),
                triangle: t,
            }
        };
        let mut taken = vec![false; mixed.len()];
        let mut lines = Vec::new();
        let starts = (0..mixed.len()).filter(|&i| beyond(mixed[i], false).is_none());
        for start in starts.chain(0..mixed.len()) {
            if taken[start] {
                continue;
            }
            let mut line = Vec::new();
            let mut at = start;
            loop {
                taken[at] = true;
                line.push(point(mixed[at], false));
                match beyond(mixed[at], true) {
                    Some(next) if !taken[next] => at = next,
                    Some(_) => {
                        line.push(line[0]);
                        break;
                    }
                    None => {
                        line.push(point(mixed[at], true));
                        break;
                    }
                }
            }
            lines.push(line);
        }
        lines
    }

    /// The unit normal at a point of a triangle, from those of its corners; `None` where the point lies outside.
    pub(super) fn normal_in(&self, t: u32, p: DVec3) -> Option<DVec3> {
        let [a, b, c] = self.mesh.corners(t as usize);
        let area = (b - a).cross(c - a);
        let whole = area.length_squared();
        let part = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).dot(area) / whole;
        let shares = [part(b, c, p), part(c, a, p), part(a, b, p)];
        // shares of a triangle without an area are not numbers, and none of them passes
        let inside = shares.iter().all(|s| *s >= -1e-9);
        let corners = self.mesh.triangles[t as usize].map(|v| self.normals[v as usize]);
        let normal: DVec3 = corners.iter().zip(shares).map(|(n, s)| *n * s).sum();
        inside.then(|| normal.normalize_or_zero())
    }

    /// The direction across a triangle.
    pub(super) fn face_normal(&self, t: u32) -> DVec3 {
        let [a, b, c] = self.mesh.corners(t as usize);
        (b - a).cross(c - a).normalize_or_zero()
    }
}
