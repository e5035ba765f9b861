//! Which triangles of the triangulation are the face.

use spade::Triangulation;
use spade::handles::FixedVertexHandle;

use super::{Filler, Rule, Vertex};
use crate::brep::Sense;
use crate::brep::tessellate::error::FaceIssue;
use crate::brep::tessellate::outline::Inside;

impl Filler<'_> {
    /// Triangles of the face, by their vertex handles; an error if they have no end.
    pub(super) fn bounded(&self, rule: &Rule) -> Result<Vec<[FixedVertexHandle; 3]>, FaceIssue> {
        self.inside(rule)
            .filter(|triangles| !triangles.is_empty())
            .ok_or_else(|| FaceIssue::Failed("its boundary encloses nothing".to_owned()))
    }

    /// Triangles of the face, by their vertex handles; `None` if they have no end.
    pub(super) fn inside(&self, rule: &Rule) -> Option<Vec<[FixedVertexHandle; 3]>> {
        let count = self.cdt.num_all_faces();
        // 0 unknown, 1 outside, 2 inside
        let mut state = vec![0u8; count];
        let mut queue = Vec::new();
        let wall_of =
            |e: &spade::handles::DirectedEdgeHandle<'_, Vertex, (), spade::CdtEdge<()>, ()>| {
                if !e.is_constraint_edge() {
                    return None;
                }
                let [a, b] = [e.from().data().local, e.to().data().local];
                let wall = rule
                    .walls
                    .get(&[a.min(b), a.max(b)])
                    .copied()
                    .unwrap_or_default();
                Some((wall, if a < b { wall.net } else { -wall.net }))
            };
        let any_boundary = rule.walls.values().any(|w| w.net != 0);
        match rule.inside {
            Inside::Parity => {
                state[0] = 1;
                queue.push(0usize);
            }
            Inside::BesideBoundary => {
                for edge in self.cdt.directed_edges() {
                    if let Some((_, net)) = wall_of(&edge)
                        && net != 0
                    {
                        let left = (net > 0) == (rule.sense == Sense::Forward);
                        let face = edge.face().fix().index();
                        let mark = if left { 2 } else { 1 };
                        if state[face] == 0 {
                            state[face] = mark;
                            queue.push(face);
                        }
                    }
                }
                if !any_boundary {
                    state[0] = 1;
                    queue.push(0);
                }
            }
        }
        let mut handles = vec![None; count];
        for face in self.cdt.inner_faces() {
            handles[face.fix().index()] = Some(face.fix());
        }
        // the outer face has no triangle of its own: its neighbours are met over the hull
        let outer_edges: Vec<_> = self
            .cdt
            .directed_edges()
            .filter(|e| e.face().fix().index() == 0)
            .map(|e| e.fix())
            .collect();
        while let Some(face) = queue.pop() {
            let edges: Vec<_> = match handles[face] {
                None => outer_edges.clone(),
                Some(handle) => self
                    .cdt
                    .face(handle)
                    .adjacent_edges()
                    .map(|e| e.fix())
                    .to_vec(),
            };
            for edge in edges {
                let edge = self.cdt.directed_edge(edge);
                let next = edge.rev().face().fix().index();
                if state[next] != 0 {
                    continue;
                }
                let here = state[face];
                let there = match (wall_of(&edge), rule.inside) {
                    (None, _) => here,
                    (Some((wall, _)), Inside::Parity) => {
                        if wall.count % 2 == 1 {
                            3 - here
                        } else {
                            here
                        }
                    }
                    // without a boundary the frame is all there is to cross
                    (Some(_), Inside::BesideBoundary) if !any_boundary => 3 - here,
                    (Some(_), Inside::BesideBoundary) => continue,
                };
                state[next] = there;
                queue.push(next);
            }
        }
        if state[0] == 2 {
            return None;
        }
        Some(
            self.cdt
                .inner_faces()
                .filter(|f| state[f.fix().index()] == 2)
                .map(|f| f.vertices().map(|v| v.fix()))
                .collect(),
        )
    }
}
