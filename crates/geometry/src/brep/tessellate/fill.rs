//! The triangles of a face: constrained Delaunay in the stretched parameter plane, points added
//! inside until the chord error holds.

mod constrain;
mod fold;
mod inside;
mod refine;

use std::collections::HashMap;

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::chart::Chart;
use super::edges::Samples;
use super::error::FaceIssue;
use super::outline::{Inside, Node, Outline};
use super::tolerance::Tolerance;
use super::warp::Warp;
use crate::brep::{Sense, Solid};
use crate::math::{DVec2, DVec3};

/// Points that one face may take.
const MOST_POINTS: usize = 1_000_000;

/// A triangulated face. Triangles are counter-clockwise in the parameter plane.
#[derive(Debug, Clone)]
pub(super) struct FaceMesh {
    pub(super) nodes: Vec<Node>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Triangles that the mesh leaves out, in rising order: they fold to nothing at a pole.
    pub(super) folded: Vec<usize>,
    /// Points of [`Node::Own`].
    pub(super) own: Vec<DVec3>,
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
    let warp = Warp::new(chart, lo, hi, tolerance);
    if warp.is_too_fine() {
        return Err(FaceIssue::TooFine);
    }
    let mut filler = Filler {
        chart,
        warp,
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
        triangles,
        own: filler.own,
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
            return Err(FaceIssue::TooFine);
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
}

fn key(w: DVec2) -> [u64; 2] {
    // -0 and 0 are one place
    [(w.x + 0.0).to_bits(), (w.y + 0.0).to_bits()]
}
