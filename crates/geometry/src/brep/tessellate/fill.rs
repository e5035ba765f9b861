//! The triangles of a face: constrained Delaunay in the stretched parameter plane, points added
//! inside until the chord error holds.

use std::collections::{BTreeMap, HashMap, HashSet};

use spade::handles::FixedVertexHandle;
use spade::{
    ConstrainedDelaunayTriangulation, HasPosition, Point2, PositionInTriangulation, Triangulation,
};

use super::chart::Chart;
use super::edges::Samples;
use super::trim::{Inside, Kind, Node, Outline};
use super::warp::Warp;
use super::{FaceIssue, Tolerance};
use crate::brep::{Sense, Solid};
use crate::math::{DVec2, DVec3};

/// Rounds of refinement of one face.
const ROUNDS: usize = 40;
/// Points that one face may take.
const MOST_POINTS: usize = 5_000_000;

/// A chord of an edge as the boundary of a face has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BoundaryChord {
    pub(super) edge: u32,
    pub(super) t: [f64; 2],
    pub(super) uv: [DVec2; 2],
    /// Local points at its ends.
    pub(super) ends: [u32; 2],
}

/// A triangulated face. Triangles are counter-clockwise in the parameter plane.
#[derive(Debug, Clone)]
pub(super) struct FaceMesh {
    pub(super) nodes: Vec<Node>,
    pub(super) uv: Vec<DVec2>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Triangles that the mesh leaves out, in rising order: they fold to nothing at a pole.
    pub(super) folded: Vec<usize>,
    /// Points of [`Node::Own`].
    pub(super) own: Vec<DVec3>,
    pub(super) boundary: Vec<BoundaryChord>,
    /// The face's normal against its surface's, as its boundary has it.
    pub(super) sense: Sense,
}

#[derive(Debug, Clone, Copy)]
struct Vertex {
    position: Point2<f64>,
    local: u32,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

type Cdt = ConstrainedDelaunayTriangulation<Vertex>;

struct Filler<'a> {
    chart: &'a Chart<'a>,
    warp: Warp,
    cdt: Cdt,
    /// Vertex handle of each local point.
    handles: Vec<FixedVertexHandle>,
    nodes: Vec<Node>,
    uv: Vec<DVec2>,
    points: Vec<DVec3>,
    /// How far each point lies off the surface: edges are as good as their writer made them.
    off: Vec<f64>,
    own: Vec<DVec3>,
    by_node: HashMap<Node, Vec<u32>>,
    by_place: HashMap<[u64; 2], u32>,
    /// Local points along each pole of the outline, in order.
    poles: Vec<Vec<u32>>,
    /// Pole on which a local point lies, and its place along it.
    on_pole: HashMap<u32, (usize, usize)>,
}

/// Triangulates an outline.
pub(super) fn fill(
    chart: &Chart<'_>,
    outline: &Outline,
    solid: &Solid,
    samples: &[Samples],
    tolerance: &Tolerance,
) -> Result<FaceMesh, FaceIssue> {
    let first = outline.points.first().map_or(DVec2::ZERO, |p| p.uv);
    let (lo, hi) = outline
        .points
        .iter()
        .fold((first, first), |(lo, hi), p| (lo.min(p.uv), hi.max(p.uv)));
    if !(lo.is_finite() && hi.is_finite()) {
        return Err(FaceIssue::Failed(
            "its boundary has no place on its surface".to_owned(),
        ));
    }
    let mut filler = Filler {
        chart,
        warp: Warp::new(chart, lo, hi, tolerance),
        cdt: Cdt::new(),
        handles: Vec::new(),
        nodes: Vec::new(),
        uv: Vec::new(),
        points: Vec::new(),
        off: Vec::new(),
        own: outline.own.clone(),
        by_node: HashMap::new(),
        by_place: HashMap::new(),
        poles: Vec::new(),
        on_pole: HashMap::new(),
    };
    let point_of = |node: Node, own: &[DVec3]| match node {
        Node::Vertex(v) => solid.vertices[v as usize],
        Node::Sample { edge, index } => samples[edge as usize].points[index as usize],
        Node::Own(i) => own[i as usize],
    };
    let mut locals = Vec::with_capacity(outline.points.len());
    for p in &outline.points {
        let point = point_of(p.node, &filler.own);
        locals.push(filler.outline_point(p.uv, p.node, point)?);
    }
    let walls = filler.constrain(outline, &locals)?;
    let mut mesh_boundary = Vec::new();
    for segment in &outline.segments {
        if let Kind::Boundary { edge, t } = segment.kind {
            mesh_boundary.push(BoundaryChord {
                edge,
                t,
                uv: [
                    outline.points[segment.from].uv,
                    outline.points[segment.to].uv,
                ],
                ends: [locals[segment.from], locals[segment.to]],
            });
        }
    }
    let mut rule = Rule {
        walls,
        inside: outline.inside,
        sense: outline.sense,
    };
    if filler.inside(&rule).is_none() {
        // the boundary runs the other way than the face's sense says
        rule.sense = rule.sense.then(Sense::Reversed);
    }
    filler.seed(&rule)?;
    filler.refine(&rule, tolerance)?;
    let triangles: Vec<[u32; 3]> = filler
        .bounded(&rule)?
        .into_iter()
        .map(|t| t.map(|v| filler.local(v)))
        .collect();
    let folded = filler.folded(&triangles);
    Ok(FaceMesh {
        folded,
        nodes: filler.nodes,
        uv: filler.uv,
        triangles,
        own: filler.own,
        boundary: mesh_boundary,
        sense: rule.sense,
    })
}

/// Which triangles are the face.
struct Rule {
    /// Constraint edges by their local ends: boundary chords along minus against, and all segments.
    walls: HashMap<[u32; 2], Wall>,
    inside: Inside,
    sense: Sense,
}

#[derive(Debug, Clone, Copy, Default)]
struct Wall {
    /// Boundary chords from the smaller to the larger local index, minus the others.
    net: i32,
    /// Segments of any kind.
    count: u32,
}

impl Filler<'_> {
    fn local(&self, handle: FixedVertexHandle) -> u32 {
        self.cdt.vertex(handle).data().local
    }

    /// The local point of an outline point; points of one node in one place are one.
    fn outline_point(&mut self, uv: DVec2, node: Node, point: DVec3) -> Result<u32, FaceIssue> {
        let w = self.warp.warp(uv);
        for &known in self.by_node.get(&node).into_iter().flatten() {
            if self.warp.warp(self.uv[known as usize]).distance(w) < 1e-7 {
                return Ok(known);
            }
        }
        let key = key(w);
        if let Some(&known) = self.by_place.get(&key) {
            // two vertices of the solid in one place of the plane: the writer left them unjoined
            if self.points[known as usize].distance(point) <= self.chart.gap {
                return Ok(known);
            }
            return Err(FaceIssue::Failed(
                "two points of its boundary fall on one point of its surface".to_owned(),
            ));
        }
        self.insert(w, uv, node, point)
    }

    fn insert(&mut self, w: DVec2, uv: DVec2, node: Node, point: DVec3) -> Result<u32, FaceIssue> {
        let local = self.nodes.len() as u32;
        if self.nodes.len() >= MOST_POINTS {
            return Err(FaceIssue::Failed(format!(
                "it needs more than {MOST_POINTS} points at this chord error"
            )));
        }
        let handle = self
            .cdt
            .insert(Vertex {
                position: spade::mitigate_underflow(Point2::new(w.x, w.y)),
                local,
            })
            .map_err(|e| {
                FaceIssue::Failed(format!("its boundary has no place on its surface ({e})"))
            })?;
        self.handles.push(handle);
        self.nodes.push(node);
        self.uv.push(uv);
        self.points.push(point);
        self.off.push(match node {
            Node::Own(_) => 0.0,
            _ => self.chart.point(uv).distance(point),
        });
        self.by_node.entry(node).or_default().push(local);
        self.by_place.insert(key(w), local);
        Ok(local)
    }

    /// A new point inside, unless one is there.
    fn inner_point(&mut self, w: DVec2) -> Result<(), FaceIssue> {
        if self.by_place.contains_key(&key(w)) {
            return Ok(());
        }
        let uv = self.warp.unwarp(w);
        let point = self.chart.point(uv);
        let node = Node::Own(self.own.len() as u32);
        self.own.push(point);
        self.insert(w, uv, node, point)?;
        Ok(())
    }

    /// Adds the outline's segments as constraints.
    fn constrain(
        &mut self,
        outline: &Outline,
        locals: &[u32],
    ) -> Result<HashMap<[u32; 2], Wall>, FaceIssue> {
        // poles and cuts are divided into chord units; both banks of a cut alike
        let mut pieces: Vec<(u32, u32, Kind)> = Vec::with_capacity(outline.segments.len());
        let mut banked: HashSet<usize> = HashSet::new();
        for &[left, right] in &outline.banks {
            banked.extend([left, right]);
            let ends = [left, right].map(|s| {
                let segment = outline.segments[s];
                [segment.from, segment.to].map(|p| locals[p])
            });
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
        }
        for (s, segment) in outline.segments.iter().enumerate() {
            let [from, to] = [segment.from, segment.to].map(|p| locals[p]);
            if banked.contains(&s) {
                continue;
            }
            if segment.kind != Kind::Pole {
                pieces.push((from, to, segment.kind));
                continue;
            }
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
        }
        let mut walls: HashMap<[u32; 2], Wall> = HashMap::new();
        let mut kinds: HashMap<[u32; 2], Kind> = HashMap::new();
        let mut splits = Vec::new();
        for &(a, b, kind) in &pieces {
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

    /// Triangles of the face, by their vertex handles; an error if they have no end.
    fn bounded(&self, rule: &Rule) -> Result<Vec<[FixedVertexHandle; 3]>, FaceIssue> {
        self.inside(rule)
            .filter(|triangles| !triangles.is_empty())
            .ok_or_else(|| FaceIssue::Failed("its boundary encloses nothing".to_owned()))
    }

    /// Triangles of the face, by their vertex handles; `None` if they have no end.
    fn inside(&self, rule: &Rule) -> Option<Vec<[FixedVertexHandle; 3]>> {
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

    /// Adds a grid of points, one chord unit apart, where the surface bends both ways.
    fn seed(&mut self, rule: &Rule) -> Result<(), FaceIssue> {
        if !(self.warp.bent[0] && self.warp.bent[1]) {
            return Ok(());
        }
        let [lo, hi] = self
            .uv
            .iter()
            .fold([self.uv[0]; 2], |[lo, hi], &uv| [lo.min(uv), hi.max(uv)]);
        let size = self.warp.warp(hi) - self.warp.warp(lo);
        if size.x * size.y > MOST_POINTS as f64 {
            return Err(FaceIssue::Failed(format!(
                "it needs more than {MOST_POINTS} points at this chord error"
            )));
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
    fn refine(&mut self, rule: &Rule, tolerance: &Tolerance) -> Result<(), FaceIssue> {
        if matches!(self.chart.surface, crate::brep::Surface::Plane(_)) {
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

    /// Triangles between two lines from one point to the same pole: in space both lines are one,
    /// and what lies between them is folded flat.
    fn folded(&self, triangles: &[[u32; 3]]) -> Vec<usize> {
        // places along a pole that a point is joined to: least, most, triangles on the pole itself
        let mut fans: BTreeMap<(u32, usize), [usize; 3]> = BTreeMap::new();
        for t in triangles {
            for k in 0..3 {
                let (x, a, b) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                if self.on_pole.contains_key(&x) {
                    continue;
                }
                let ends = [self.on_pole.get(&a), self.on_pole.get(&b)];
                for &&(row, place) in ends.iter().flatten() {
                    let fan = fans.entry((x, row)).or_insert([place, place, 0]);
                    fan[0] = fan[0].min(place);
                    fan[1] = fan[1].max(place);
                }
                if let [Some((row, _)), Some((other, _))] = ends
                    && row == other
                    && let Some(fan) = fans.get_mut(&(x, *row))
                {
                    fan[2] += 1;
                }
            }
        }
        let mut folded = Vec::new();
        let place = |l: u32| self.warp.warp(self.uv[l as usize]);
        for ((x, row), [least, most, flat]) in fans {
            if flat >= most - least {
                continue;
            }
            let corners = [x, self.poles[row][least], self.poles[row][most]].map(place);
            let side = |a: DVec2, b: DVec2, p: DVec2| (b - a).perp_dot(p - a);
            let turn = side(corners[0], corners[1], corners[2]).signum();
            let within: Vec<usize> = (0..triangles.len())
                .filter(|&i| {
                    let c = triangles[i].map(place).iter().sum::<DVec2>() / 3.0;
                    (0..3).all(|k| turn * side(corners[k], corners[(k + 1) % 3], c) > 0.0)
                })
                .collect();
            // a hole of the face in there would be lost: then the fold stays
            let inner = within
                .iter()
                .flat_map(|&i| triangles[i])
                .filter(|&l| l != x && !self.on_pole.contains_key(&l))
                .all(|l| matches!(self.nodes[l as usize], Node::Own(_)));
            if inner {
                folded.extend(within);
            }
        }
        folded.sort_unstable();
        folded.dedup();
        folded
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
                super::edges::distance_to_segment(s, p[along[0]], p[along[1]])
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

fn key(w: DVec2) -> [u64; 2] {
    // -0 and 0 are one place
    [(w.x + 0.0).to_bits(), (w.y + 0.0).to_bits()]
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
