//! Points added inside a face until the chord error holds.

use std::collections::HashSet;

use spade::handles::FixedVertexHandle;
use spade::{Point2, PositionInTriangulation, Triangulation};

use super::{Filler, MOST_POINTS, Rule};
use crate::brep::Surface;
use crate::brep::tessellate::edges::distance_to_segment;
use crate::brep::tessellate::error::FaceIssue;
use crate::brep::tessellate::tolerance::Tolerance;
use crate::math::{DVec2, DVec3};

/// Rounds of refinement of one face.
const ROUNDS: usize = 40;

impl Filler<'_> {
    /// Adds a grid of points, one chord unit apart, where the surface bends both ways.
    pub(super) fn seed(&mut self, rule: &Rule) -> Result<(), FaceIssue> {
        if !(self.warp.bent[0] && self.warp.bent[1]) {
            return Ok(());
        }
        let [lo, hi] = self
            .uv
            .iter()
            .fold([self.uv[0]; 2], |[lo, hi], &uv| [lo.min(uv), hi.max(uv)]);
        let size = self.warp.warp(hi) - self.warp.warp(lo);
        if size.x * size.y > MOST_POINTS as f64 {
            return Err(FaceIssue::TooFine);
        }
        let mut seeds = Vec::new();
        for triangle in self.bounded(rule)? {
            let corners = triangle.map(|v| {
                let p = self.cdt.vertex(v).position();
                DVec2::new(p.x, p.y)
            });
            grid_points(corners, &mut seeds);
        }
        seeds.sort_unstable();
        seeds.dedup();
        for [i, j] in seeds {
            let w = DVec2::new(f64::from(i), f64::from(j));
            if !self.is_crowded(w) {
                self.inner_point(w)?;
            }
        }
        Ok(())
    }

    /// Whether a place is within half a chord unit of a vertex or constraint of its triangle.
    fn is_crowded(&self, w: DVec2) -> bool {
        const NEAR: f64 = 0.45;
        let PositionInTriangulation::OnFace(face) = self.cdt.locate(Point2::new(w.x, w.y)) else {
            return true;
        };
        let face = self.cdt.face(face);
        let near_edge = face.adjacent_edges().iter().any(|e| {
            let near = e.distance_2(Point2::new(w.x, w.y)) < NEAR * NEAR;
            e.is_constraint_edge() && near
        });
        near_edge
            || face.vertices().iter().any(|v| {
                let p = v.position();
                DVec2::new(p.x, p.y).distance_squared(w) < NEAR * NEAR
            })
    }

    /// Adds points where triangles leave the surface by more than the chord error.
    pub(super) fn refine(&mut self, rule: &Rule, tolerance: &Tolerance) -> Result<(), FaceIssue> {
        if matches!(self.chart.surface, Surface::Plane(_)) {
            return Ok(());
        }
        let mut good: HashSet<[u32; 3]> = HashSet::new();
        for _ in 0..ROUNDS {
            let mut wanted: Vec<DVec2> = Vec::new();
            for triangle in self.bounded(rule)? {
                let mut sorted = triangle.map(|v| self.local(v));
                sorted.sort_unstable();
                if good.contains(&sorted) {
                    continue;
                }
                match self.worst_place(triangle, tolerance) {
                    Some(place) => wanted.push(place),
                    None => {
                        good.insert(sorted);
                    }
                }
            }
            if wanted.is_empty() {
                break;
            }
            for place in wanted {
                self.inner_point(place)?;
            }
        }
        Ok(())
    }

    /// Places of the ends of a pole.
    fn pole_ends(&self, row: usize) -> [DVec2; 2] {
        let row = &self.poles[row];
        [row[0], row[row.len() - 1]].map(|l| self.warp.warp(self.uv[l as usize]))
    }

    /// Where a triangle is farthest off the surface, if that is more than the chord error.
    fn worst_place(
        &self,
        triangle: [FixedVertexHandle; 3],
        tolerance: &Tolerance,
    ) -> Option<DVec2> {
        let local = triangle.map(|v| self.local(v) as usize);
        let p = local.map(|l| self.points[l]);
        let longest = p[0]
            .distance(p[1])
            .max(p[1].distance(p[2]))
            .max(p[2].distance(p[0]));
        // no point inside mends what an edge lacks
        let chord = tolerance.chord + local.iter().map(|&l| self.off[l]).fold(0.0, f64::max);
        if longest <= 4.0 * chord {
            return None;
        }
        let w = triangle.map(|v| {
            let q = self.cdt.vertex(v).position();
            DVec2::new(q.x, q.y)
        });
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        let off = |w: DVec2, along: [usize; 2]| {
            let s = self.chart.point(self.warp.unwarp(w));
            if normal == DVec3::ZERO {
                distance_to_segment(s, p[along[0]], p[along[1]])
            } else {
                (s - p[0]).dot(normal).abs()
            }
        };
        // a pole is one point: seen from another corner it stands where that corner's line meets it
        let corner = |a: usize, from: DVec2| match self.on_pole.get(&(local[a] as u32)) {
            None => w[a],
            Some(&(row, _)) => {
                let [p, q] = self.pole_ends(row);
                let d = q - p;
                p + d * ((from - p).dot(d) / d.length_squared()).clamp(0.0, 1.0)
            }
        };
        let mut worst = (chord, None);
        let of = |a: usize| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            corner(a, 0.5 * (w[b] + w[c]))
        };
        let centre = (of(0) + of(1) + of(2)) / 3.0;
        let centre_off = off(centre, [0, 1]);
        if centre_off > worst.0 {
            worst = (centre_off, Some(centre));
        }
        for [a, b] in [[0, 1], [1, 2], [2, 0]] {
            if self.cdt.exists_constraint(triangle[a], triangle[b]) {
                continue;
            }
            let mid = 0.5 * (corner(a, w[b]) + corner(b, w[a]));
            let d = off(mid, [a, b]);
            // halving a side serves both its triangles, so it is taken when nearly as bad
            if d > chord && d > 0.8 * worst.0 {
                worst = (d.max(worst.0), Some(mid));
            }
        }
        worst.1
    }
}

/// Whole-numbered points inside a triangle.
fn grid_points(corners: [DVec2; 3], out: &mut Vec<[i32; 2]>) {
    let lo = corners[0].min(corners[1]).min(corners[2]);
    let hi = corners[0].max(corners[1]).max(corners[2]);
    for j in lo.y.ceil() as i32..=hi.y.floor() as i32 {
        let y = f64::from(j);
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if (a.y <= y && y <= b.y) || (b.y <= y && y <= a.y) {
                let x = if a.y == b.y {
                    a.x
                } else {
                    a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x)
                };
                range = [range[0].min(x), range[1].max(x)];
                if a.y == b.y {
                    range = [range[0].min(b.x), range[1].max(b.x)];
                }
            }
        }
        if range[0] <= range[1] {
            out.extend((range[0].ceil() as i32..=range[1].floor() as i32).map(|i| [i, j]));
        }
    }
}
