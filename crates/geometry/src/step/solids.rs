//! Topology (ISO 10303-42, clause 5): shells, faces, loops, edges into the tables of a [`Solid`].

use std::collections::HashMap;
use std::sync::Arc;

use meltpath_base::Reporter;

use super::StepError;
use super::curves::curve;
use super::entity::Entity;
use super::orientation::orient;
use super::placement::point;
use super::surfaces::surface;
use super::units::Units;
use crate::brep::{
    Curve, Edge, EdgeUse, Face, FaceUse, Frame, Loop, Sense, Shell, ShellRole, Solid, Surface,
};
use crate::math::DVec3;

/// Entity types that make a body.
pub(super) const BODIES: [&str; 6] = [
    "MANIFOLD_SOLID_BREP",
    "BREP_WITH_VOIDS",
    "FACETED_BREP",
    "FACETED_BREP_AND_BREP_WITH_VOIDS",
    "SHELL_BASED_SURFACE_MODEL",
    "FACE_BASED_SURFACE_MODEL",
];

/// Whether an instance is a body.
pub(super) fn is_body(entity: Entity<'_>) -> bool {
    BODIES.iter().any(|keyword| entity.has(keyword))
}

/// Reads a body. `entity` satisfies [`is_body`].
pub(super) fn solid(
    entity: Entity<'_>,
    units: &Units,
    reporter: &Reporter,
) -> Result<Solid, StepError> {
    let mut builder = Builder {
        units: *units,
        solid: Solid {
            uncertainty: units.uncertainty,
            ..Solid::default()
        },
        vertices: HashMap::new(),
        edges: HashMap::new(),
        sides: HashMap::new(),
        faces: HashMap::new(),
        worst: None,
    };
    if entity.has("SHELL_BASED_SURFACE_MODEL") || entity.has("FACE_BASED_SURFACE_MODEL") {
        for set in entity.references(1)? {
            builder.shell(set, ShellRole::Open)?;
        }
    } else {
        let outer = entity
            .part("MANIFOLD_SOLID_BREP", 1)
            .map_or_else(|| entity.reference(1), |part| part.reference(0))?;
        builder.shell(outer, ShellRole::Outer)?;
        let voids = if entity.is_complex() {
            entity
                .exact("BREP_WITH_VOIDS")
                .map(|part| part.references(0))
        } else {
            entity.has("BREP_WITH_VOIDS").then(|| entity.references(2))
        };
        for cavity in voids.transpose()?.unwrap_or_default() {
            builder.shell(cavity, ShellRole::Void)?;
        }
    }
    if let Some((off, edge)) = builder.worst
        && off > (10.0 * units.uncertainty).max(1e-3)
    {
        reporter.warn(
            "step-vertex-off-curve",
            format!(
                "in {}, a vertex of edge #{edge} lies {off:.3e} mm off the edge's curve",
                entity.place()
            ),
            "check the edge in the program that wrote the file",
        );
    }
    orient(&mut builder.solid, entity, reporter);
    Ok(builder.solid)
}

struct Builder {
    units: Units,
    solid: Solid,
    vertices: HashMap<u64, u32>,
    /// Index of an edge, or `None` for one that has no length.
    edges: HashMap<u64, Option<u32>>,
    /// Sides of facets by their vertices, smaller first.
    sides: HashMap<[u32; 2], u32>,
    faces: HashMap<u64, u32>,
    /// Largest distance of a vertex from the curve of its edge, and the edge.
    worst: Option<(f64, u64)>,
}

impl Builder {
    fn shell(&mut self, entity: Entity<'_>, role: ShellRole) -> Result<(), StepError> {
        let mut sense = Sense::Forward;
        let mut shell = entity;
        // ORIENTED_CLOSED_SHELL('', *, shell, orientation); one of another is not allowed, but cheap
        for _ in 0..4 {
            if !matches!(
                shell.keyword(),
                "ORIENTED_CLOSED_SHELL" | "ORIENTED_OPEN_SHELL"
            ) {
                break;
            }
            sense = sense.then(Sense::from_flag(shell.flag(3)?));
            shell = shell.reference(2)?;
        }
        let known = [
            "CLOSED_SHELL",
            "OPEN_SHELL",
            "CONNECTED_FACE_SET",
            "SURFACED_OPEN_SHELL",
        ];
        if !known.contains(&shell.keyword()) {
            return Err(shell.unsupported("a shell", "export the part as AP214 with solids"));
        }
        let mut faces = Vec::new();
        for face in shell.references(1)? {
            faces.push(self.face_use(face, sense)?);
        }
        if faces.is_empty() {
            return Err(shell.degenerate("the shell has no faces"));
        }
        // a closed shell of a surface model bounds a body as well as a solid's does
        let role = match role {
            ShellRole::Open if shell.keyword() == "CLOSED_SHELL" => ShellRole::Outer,
            role => role,
        };
        self.solid.shells.push(Shell { role, faces });
        Ok(())
    }

    fn face_use(&mut self, entity: Entity<'_>, sense: Sense) -> Result<FaceUse, StepError> {
        if entity.keyword() == "ORIENTED_FACE" {
            let own = Sense::from_flag(entity.flag(3)?);
            let face = self.face(entity.reference(2)?)?;
            return Ok(FaceUse {
                face,
                sense: sense.then(own),
            });
        }
        let face = self.face(entity)?;
        Ok(FaceUse { face, sense })
    }

    fn face(&mut self, entity: Entity<'_>) -> Result<u32, StepError> {
        if let Some(&known) = self.faces.get(&entity.id()) {
            return Ok(known);
        }
        let bounds = entity.references(1)?;
        let mut loops = Vec::with_capacity(bounds.len());
        for bound in bounds {
            if !matches!(bound.keyword(), "FACE_BOUND" | "FACE_OUTER_BOUND") {
                return Err(bound.unsupported("the bound of a face", "export the part again"));
            }
            let sense = Sense::from_flag(bound.flag(2)?);
            if let Some(found) = self.bound(bound.reference(1)?, sense)? {
                loops.push(found);
            }
        }
        let (surface, sense) = match entity.keyword() {
            "ADVANCED_FACE" | "FACE_SURFACE" => (
                surface(entity.reference(2)?, &self.units)?,
                Sense::from_flag(entity.flag(3)?),
            ),
            "FACE" => (self.facet_plane(entity, &loops)?, Sense::Forward),
            _ => {
                return Err(entity.unsupported("a face", "export the part as AP214 with solids"));
            }
        };
        let index = self.solid.faces.len() as u32;
        self.solid.faces.push(Face {
            surface: Arc::new(surface),
            sense,
            loops,
            id: entity.id(),
        });
        self.faces.insert(entity.id(), index);
        Ok(index)
    }

    /// Plane of a facet that names none: its largest loop's area vector is the normal.
    fn facet_plane(&self, entity: Entity<'_>, loops: &[Loop]) -> Result<Surface, StepError> {
        let mut best = (DVec3::ZERO, DVec3::ZERO);
        for boundary in loops {
            let Loop::Edges(uses) = boundary else {
                continue;
            };
            let corners: Vec<DVec3> = uses
                .iter()
                .map(|u| {
                    let ends = self.solid.edges[u.edge as usize].vertices;
                    let start = match u.sense {
                        Sense::Forward => ends[0],
                        Sense::Reversed => ends[1],
                    };
                    self.solid.vertices[start as usize]
                })
                .collect();
            let area: DVec3 = (0..corners.len())
                .map(|i| {
                    let j = (i + 1) % corners.len();
                    (corners[i] - corners[0]).cross(corners[j] - corners[0])
                })
                .sum();
            if area.length() > best.0.length() {
                best = (area, corners[0]);
            }
        }
        Frame::new(best.1, best.0, DVec3::X)
            .map(Surface::Plane)
            .ok_or_else(|| entity.degenerate("the facet has no area"))
    }

    fn bound(&mut self, entity: Entity<'_>, sense: Sense) -> Result<Option<Loop>, StepError> {
        let mut uses = Vec::new();
        match entity.keyword() {
            "VERTEX_LOOP" => {
                return Ok(Some(Loop::Vertex(self.vertex(entity.reference(1)?)?)));
            }
            "EDGE_LOOP" => {
                let mut last = None;
                for oriented in entity.references(1)? {
                    let (edge, forward) = if oriented.keyword() == "ORIENTED_EDGE" {
                        (oriented.reference(3)?, oriented.flag(4)?)
                    } else {
                        (oriented, true)
                    };
                    match self.edge(edge)? {
                        Some(edge) => uses.push(EdgeUse {
                            edge,
                            sense: Sense::from_flag(forward),
                        }),
                        None => last = Some(edge),
                    }
                }
                if uses.is_empty() {
                    // a loop of edges without length is a point
                    return match last {
                        Some(edge) => Ok(Some(Loop::Vertex(self.vertex(edge.reference(1)?)?))),
                        None => Err(entity.degenerate("the loop has no edges")),
                    };
                }
            }
            "POLY_LOOP" => {
                let corners: Result<Vec<u32>, StepError> = entity
                    .references(1)?
                    .into_iter()
                    .map(|p| self.corner(p))
                    .collect();
                let mut corners = corners?;
                corners.dedup();
                if corners.len() > 1 && corners.first() == corners.last() {
                    corners.pop();
                }
                if corners.len() < 3 {
                    return Err(entity.degenerate("the loop has fewer than three corners"));
                }
                for i in 0..corners.len() {
                    uses.push(self.side(corners[i], corners[(i + 1) % corners.len()], entity)?);
                }
            }
            _ => {
                return Err(entity.unsupported("a loop", "export the part as AP214 with solids"));
            }
        }
        if sense == Sense::Reversed {
            uses.reverse();
            for used in &mut uses {
                used.sense = used.sense.then(Sense::Reversed);
            }
        }
        self.check_chain(entity, &uses)?;
        Ok(Some(Loop::Edges(uses)))
    }

    /// Each edge of a loop must begin where the one before it ends.
    fn check_chain(&self, entity: Entity<'_>, uses: &[EdgeUse]) -> Result<(), StepError> {
        let ends = |u: &EdgeUse| {
            let [a, b] = self.solid.edges[u.edge as usize].vertices;
            match u.sense {
                Sense::Forward => [a, b],
                Sense::Reversed => [b, a],
            }
        };
        for (i, this) in uses.iter().enumerate() {
            let next = &uses[(i + 1) % uses.len()];
            let (a, b) = (ends(this)[1], ends(next)[0]);
            let gap = self.solid.vertices[a as usize].distance(self.solid.vertices[b as usize]);
            // distinct vertices in one place are met in sewn surface models; apart they make no loop
            if a != b && gap > (10.0 * self.units.uncertainty).max(1e-3) {
                return Err(entity.degenerate(format!(
                    "edges #{} and #{} follow each other but their ends are {gap:.3e} mm apart",
                    self.solid.edges[this.edge as usize].id,
                    self.solid.edges[next.edge as usize].id,
                )));
            }
        }
        Ok(())
    }

    fn vertex(&mut self, entity: Entity<'_>) -> Result<u32, StepError> {
        if let Some(&known) = self.vertices.get(&entity.id()) {
            return Ok(known);
        }
        if entity.keyword() != "VERTEX_POINT" {
            return Err(entity.unsupported("a vertex", "export the part again"));
        }
        let position = point(entity.reference(1)?, &self.units)?;
        Ok(self.push_vertex(entity.id(), position))
    }

    /// The corner of a facet: a point is its own vertex.
    fn corner(&mut self, entity: Entity<'_>) -> Result<u32, StepError> {
        if let Some(&known) = self.vertices.get(&entity.id()) {
            return Ok(known);
        }
        let position = point(entity, &self.units)?;
        Ok(self.push_vertex(entity.id(), position))
    }

    fn push_vertex(&mut self, id: u64, position: DVec3) -> u32 {
        let index = self.solid.vertices.len() as u32;
        self.solid.vertices.push(position);
        self.vertices.insert(id, index);
        index
    }

    /// The straight side of a facet between two corners.
    fn side(&mut self, a: u32, b: u32, entity: Entity<'_>) -> Result<EdgeUse, StepError> {
        let key = [a.min(b), a.max(b)];
        let edge = if let Some(&known) = self.sides.get(&key) {
            known
        } else {
            let [p, q] = key.map(|v| self.solid.vertices[v as usize]);
            if p == q {
                return Err(entity.degenerate("two corners of the loop lie in one place"));
            }
            let index = self.solid.edges.len() as u32;
            self.solid.edges.push(Edge {
                curve: Arc::new(Curve::Line {
                    origin: p,
                    direction: q - p,
                }),
                range: [0.0, 1.0],
                vertices: key,
                period: None,
                id: entity.id(),
            });
            self.sides.insert(key, index);
            index
        };
        Ok(EdgeUse {
            edge,
            sense: Sense::from_flag(a < b),
        })
    }

    fn edge(&mut self, entity: Entity<'_>) -> Result<Option<u32>, StepError> {
        if let Some(&known) = self.edges.get(&entity.id()) {
            return Ok(known);
        }
        if entity.keyword() != "EDGE_CURVE" {
            return Err(entity.unsupported(
                "an edge",
                "export the part as AP214 with the curves of its edges in space",
            ));
        }
        let vertices = [
            self.vertex(entity.reference(1)?)?,
            self.vertex(entity.reference(2)?)?,
        ];
        let trimmed = curve(entity.reference(3)?, &self.units)?;
        let mut sense = Sense::from_flag(entity.flag(4)?);
        // a trimmed curve that runs against its basis turns the edge with it
        if trimmed.range.is_some_and(|[from, to]| to < from) {
            sense = sense.then(Sense::Reversed);
        }
        let curve = trimmed.curve;
        let ends = vertices.map(|v| self.solid.vertices[v as usize]);
        let gap = self.units.uncertainty.max(1e-6);
        let period = curve.period(gap);
        let range = edge_range(&curve, ends, vertices[0] == vertices[1], sense, period, gap);
        let edge = Edge {
            curve,
            range,
            vertices,
            period,
            id: entity.id(),
        };
        let short = (1..8).all(|i| edge.at(f64::from(i) / 8.0).distance(ends[0]) <= gap);
        let index = if vertices[0] == vertices[1] && short {
            None
        } else {
            let off = edge
                .at(0.0)
                .distance(ends[0])
                .max(edge.at(1.0).distance(ends[1]));
            if !off.is_finite() {
                return Err(entity.degenerate("the edge's ends are not on its curve"));
            }
            let reach = ends[0]
                .distance(ends[1])
                .max(edge.at(0.5).distance(ends[0]));
            if off > 1.0 && off > 0.05 * reach {
                return Err(
                    entity.degenerate(format!("a vertex lies {off:.3e} mm off the edge's curve"))
                );
            }
            if self.worst.is_none_or(|(most, _)| off > most) {
                self.worst = Some((off, entity.id()));
            }
            self.solid.edges.push(edge);
            Some(self.solid.edges.len() as u32 - 1)
        };
        self.edges.insert(entity.id(), index);
        Ok(index)
    }
}

/// Parameters of an edge's ends on its curve, the second beyond the first in the edge's sense.
fn edge_range(
    curve: &Curve,
    ends: [DVec3; 2],
    closed: bool,
    sense: Sense,
    period: Option<f64>,
    gap: f64,
) -> [f64; 2] {
    let [lo, hi] = curve.domain();
    let bounded = lo.is_finite() && hi.is_finite();
    let at_end = |t: f64, p: DVec3| bounded && curve.point(t).distance(p) <= gap;
    let Some(period) = period else {
        if bounded {
            // most edges run over the whole curve, and its ends are exact
            let whole = match sense {
                Sense::Forward => [lo, hi],
                Sense::Reversed => [hi, lo],
            };
            if at_end(whole[0], ends[0]) && at_end(whole[1], ends[1]) {
                return whole;
            }
        }
        return ends.map(|p| curve.nearest(p));
    };
    let start = if at_end(lo, ends[0]) {
        lo
    } else {
        curve.nearest(ends[0])
    };
    if closed {
        return match sense {
            Sense::Forward => [start, start + period],
            Sense::Reversed => [start, start - period],
        };
    }
    let end = if at_end(lo, ends[1]) {
        lo
    } else {
        curve.nearest(ends[1])
    };
    let ahead = match sense {
        Sense::Forward => (end - start).rem_euclid(period),
        Sense::Reversed => (start - end).rem_euclid(period),
    };
    // vertices that are nearly one: the short way, not all round
    let ahead = if period - ahead < 1e-9 * period && ends[0].distance(ends[1]) <= gap {
        0.0
    } else {
        ahead
    };
    match sense {
        Sense::Forward => [start, start + ahead],
        Sense::Reversed => [start, start - ahead],
    }
}
