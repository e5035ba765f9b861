//! The outline's segments as constraints of the triangulation; poles and cuts are divided into chord units.

use std::collections::{HashMap, HashSet};

use super::{Filler, Wall, key};
use crate::brep::tessellate::error::FaceIssue;
use crate::brep::tessellate::outline::{Kind, Node, Outline};
use crate::math::DVec2;

/// A constraint between two local points.
type Piece = (u32, u32, Kind);

impl Filler<'_> {
    /// Adds the outline's segments as constraints.
    pub(super) fn constrain(
        &mut self,
        outline: &Outline,
        locals: &[u32],
    ) -> Result<HashMap<[u32; 2], Wall>, FaceIssue> {
        let mut pieces: Vec<Piece> = Vec::with_capacity(outline.segments.len());
        let mut banked: HashSet<usize> = HashSet::new();
        for &banks in &outline.banks {
            banked.extend(banks);
            let ends = banks.map(|s| {
                let segment = outline.segments[s];
                [segment.from, segment.to].map(|p| locals[p])
            });
            self.divide_cut(ends, &mut pieces)?;
        }
        for (s, segment) in outline.segments.iter().enumerate() {
            let [from, to] = [segment.from, segment.to].map(|p| locals[p]);
            if banked.contains(&s) {
                continue;
            }
            if segment.kind == Kind::Pole {
                self.divide_pole(from, to, &mut pieces)?;
            } else {
                pieces.push((from, to, segment.kind));
            }
        }
        self.add_constraints(&pieces)
    }

    /// Both banks of a cut, given by their ends, divided alike.
    fn divide_cut(
        &mut self,
        ends: [[u32; 2]; 2],
        pieces: &mut Vec<Piece>,
    ) -> Result<(), FaceIssue> {
        let at = |bank: usize, s: f64| {
            let [a, b] = ends[bank].map(|l| self.uv[l as usize]);
            a + s * (b - a)
        };
        let length = self
            .warp
            .warp(at(0, 1.0))
            .distance(self.warp.warp(at(0, 0.0)));
        let parts = length.ceil().max(1.0) as usize;
        let steps: Vec<[DVec2; 2]> = (1..parts)
            .map(|i| i as f64 / parts as f64)
            .map(|s| [at(0, s), at(1, s)])
            .collect();
        let mut last = [ends[0][0], ends[1][0]];
        for uv in steps {
            let point = self.chart.point(uv[0]);
            let node = Node::Own(self.own.len() as u32);
            self.own.push(point);
            let mut next = last;
            for bank in 0..2 {
                let w = self.warp.warp(uv[bank]);
                next[bank] = self.insert(w, uv[bank], node, point)?;
                pieces.push((last[bank], next[bank], Kind::Cut));
            }
            last = next;
        }
        for bank in 0..2 {
            pieces.push((last[bank], ends[bank][1], Kind::Cut));
        }
        Ok(())
    }

    /// A pole from one local point to another: one point in space, many in the plane.
    fn divide_pole(
        &mut self,
        from: u32,
        to: u32,
        pieces: &mut Vec<Piece>,
    ) -> Result<(), FaceIssue> {
        let [a, b] = [from, to].map(|l| self.uv[l as usize]);
        let length = self.warp.warp(a).distance(self.warp.warp(b));
        let parts = length.ceil().max(1.0) as usize;
        let node = self.nodes[from as usize];
        let point = self.points[from as usize];
        let mut last = from;
        let mut row = vec![from];
        for i in 1..parts {
            let uv = a + (b - a) * (i as f64 / parts as f64);
            let w = self.warp.warp(uv);
            let next = match self.by_place.get(&key(w)) {
                Some(&known) => known,
                None => self.insert(w, uv, node, point)?,
            };
            pieces.push((last, next, Kind::Pole));
            last = next;
            row.push(next);
        }
        pieces.push((last, to, Kind::Pole));
        row.push(to);
        for (place, &local) in row.iter().enumerate() {
            self.on_pole.insert(local, (self.poles.len(), place));
        }
        self.poles.push(row);
        Ok(())
    }

    /// Adds the pieces; where one would cross another, the edges of both are to be cut more finely.
    fn add_constraints(&mut self, pieces: &[Piece]) -> Result<HashMap<[u32; 2], Wall>, FaceIssue> {
        let mut walls: HashMap<[u32; 2], Wall> = HashMap::new();
        let mut kinds: HashMap<[u32; 2], Kind> = HashMap::new();
        let mut splits = Vec::new();
        for &(a, b, kind) in pieces {
            if a == b {
                continue;
            }
            let edge = [a.min(b), a.max(b)];
            let [ha, hb] = [a, b].map(|l| self.handles[l as usize]);
            let fresh = !self.cdt.exists_constraint(ha, hb);
            if fresh {
                let conflicts: Vec<[u32; 2]> = self
                    .cdt
                    .get_conflicting_edges_between_vertices(ha, hb)
                    .filter(|e| e.is_constraint_edge())
                    .map(|e| {
                        let [x, y] = e.vertices().map(|v| v.data().local);
                        [x.min(y), x.max(y)]
                    })
                    .collect();
                let clear = conflicts.is_empty() && {
                    self.cdt.try_add_constraint(ha, hb);
                    self.cdt.exists_constraint(ha, hb)
                };
                if !clear {
                    let mut halve = |kind: Option<Kind>| {
                        if let Some(Kind::Boundary { edge, t }) = kind {
                            splits.push((edge, 0.5 * (t[0] + t[1])));
                        }
                    };
                    halve(Some(kind));
                    for other in conflicts {
                        halve(kinds.get(&other).copied());
                    }
                    continue;
                }
            }
            kinds.insert(edge, kind);
            let wall = walls.entry(edge).or_default();
            wall.count += 1;
            if let Kind::Boundary { .. } = kind {
                wall.net += if a < b { 1 } else { -1 };
            }
        }
        if splits.is_empty() {
            Ok(walls)
        } else {
            Err(FaceIssue::Split(splits))
        }
    }
}
