//! Terraces: prisms of several heights on one floor, joined without cracks. An extrusion is a terrace of one height.

use std::collections::HashMap;

use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use crate::{
    Mesh,
    math::{DVec2, DVec3},
    region::Region,
};

/// Regions that rise from the floor z = 0 to one height.
#[derive(Debug, Clone, PartialEq)]
pub struct Terrace {
    /// Where it stands.
    pub regions: Vec<Region>,
    /// Its top, mm; where terraces overlap the highest wins.
    pub height: f64,
}

/// A vertex of the plan triangulation.
#[derive(Debug, Clone, Copy)]
struct Corner(Point2<f64>);

impl HasPosition for Corner {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.0
    }
}

/// Extrudes regions from z = 0 to `height` mm.
///
/// ```
/// use meltpath_geometry::shapes::{cross, extrude};
/// let part = extrude(&[cross(40.0, 10.0)], 12.0);
/// assert!((part.volume() - 12.0 * 700.0).abs() < 1e-9);
/// ```
pub fn extrude(regions: &[Region], height: f64) -> Mesh {
    terrace(&[Terrace {
        regions: regions.to_vec(),
        height,
    }])
}

/// Joins terraces into one closed mesh with outward normals.
///
/// Outlines may cross: crossings become vertices. Points that are not finite, or beyond the triangulation's
/// domain (about 1e42 mm), are left out. Where two terraces touch in one corner only, the mesh has a vertical
/// edge with four walls.
pub fn terrace(terraces: &[Terrace]) -> Mesh {
    let mut plan: ConstrainedDelaunayTriangulation<Corner> =
        ConstrainedDelaunayTriangulation::new();
    for ring in terraces
        .iter()
        .flat_map(|t| t.regions.iter().flat_map(Region::rings))
    {
        let corners: Vec<_> = ring
            .iter()
            .filter_map(|p| plan.insert(Corner(Point2::new(p.x, p.y))).ok())
            .collect();
        for (k, &from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            if from != to {
                plan.add_constraint_and_split(from, to, Corner);
            }
        }
    }
    let heights = face_heights(&plan, terraces);

    // levels at which something ends, per plan vertex
    let mut levels: Vec<Vec<f64>> = vec![Vec::new(); plan.num_vertices()];
    for face in plan.inner_faces() {
        for vertex in face.vertices() {
            levels[vertex.fix().index()].push(heights[face.fix().index()]);
        }
    }
    for edge in plan.directed_edges() {
        if edge.is_outer_edge() {
            levels[edge.from().fix().index()].push(0.0);
            levels[edge.to().fix().index()].push(0.0);
        }
    }
    for list in &mut levels {
        list.push(0.0);
        list.sort_by(f64::total_cmp);
        list.dedup();
    }
    let mut body = Body {
        mesh: Mesh::default(),
        index: HashMap::new(),
    };
    for face in plan.inner_faces() {
        let height = heights[face.fix().index()];
        if height <= 0.0 {
            continue;
        }
        let ring = face.vertices().map(|v| (v.fix().index(), v.position()));
        let [a, b, c] = ring.map(|v| body.vertex(v, height));
        body.mesh.triangles.push([a, b, c]);
        let [a, b, c] = ring.map(|v| body.vertex(v, 0.0));
        body.mesh.triangles.push([a, c, b]);
    }
    for edge in plan.directed_edges() {
        // the face of an edge lies to its left: the wall faces right, towards the lower neighbour
        let height = |face: Option<usize>| face.map_or(0.0, |f| heights[f]);
        let left = height(edge.face().as_inner().map(|f| f.fix().index()));
        let right = height(edge.rev().face().as_inner().map(|f| f.fix().index()));
        if left > right {
            let side = |v: spade::handles::VertexHandle<_, _, _, _>| {
                let i = v.fix().index();
                let span = levels[i].iter().filter(|&&z| (right..=left).contains(&z));
                ((i, v.position()), span.copied().collect::<Vec<f64>>())
            };
            body.wall(&side(edge.from()), &side(edge.to()));
        }
    }
    body.mesh
}

/// Height of each inner face, by face index: that of the highest terrace which holds it.
///
/// Faces joined by an edge that no outline runs along share their height, so that one point test serves many.
fn face_heights(plan: &ConstrainedDelaunayTriangulation<Corner>, terraces: &[Terrace]) -> Vec<f64> {
    let count = plan.num_all_faces();
    let mut heights = vec![f64::NAN; count];
    for seed in plan.inner_faces() {
        if !heights[seed.fix().index()].is_nan() {
            continue;
        }
        let c = seed.center();
        let centre = DVec2::new(c.x, c.y);
        let height = terraces
            .iter()
            .filter(|t| t.regions.iter().any(|r| holds(r, centre)))
            .map(|t| t.height)
            .fold(0.0, f64::max);
        let mut stack = vec![seed];
        while let Some(face) = stack.pop() {
            let known = &mut heights[face.fix().index()];
            if !known.is_nan() {
                continue;
            }
            *known = height;
            for edge in face.adjacent_edges() {
                if !edge.is_constraint_edge() {
                    stack.extend(edge.rev().face().as_inner());
                }
            }
        }
    }
    heights
}

/// Whether a region holds a point that lies on none of its rings.
fn holds(region: &Region, p: DVec2) -> bool {
    let mut inside = false;
    for ring in region.rings() {
        for (i, &b) in ring.iter().enumerate() {
            let a = ring[(i + ring.len() - 1) % ring.len()];
            if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
                inside = !inside;
            }
        }
    }
    inside
}

/// A plan vertex: its index and position.
type PlanVertex = (usize, Point2<f64>);

/// The mesh under construction: one vertex per plan vertex and level.
struct Body {
    mesh: Mesh,
    index: HashMap<(usize, u64), u32>,
}

impl Body {
    fn vertex(&mut self, (plan, p): PlanVertex, z: f64) -> u32 {
        let mesh = &mut self.mesh;
        *self.index.entry((plan, z.to_bits())).or_insert_with(|| {
            mesh.vertices.push(DVec3::new(p.x, p.y, z));
            (mesh.vertices.len() - 1) as u32
        })
    }

    /// Closes the wall between two vertical lines, each with its levels upwards, seen from outside left to right.
    fn wall(&mut self, left: &(PlanVertex, Vec<f64>), right: &(PlanVertex, Vec<f64>)) {
        let (mut i, mut j) = (0, 0);
        while i + 1 < left.1.len() || j + 1 < right.1.len() {
            let a = self.vertex(left.0, left.1[i]);
            let b = self.vertex(right.0, right.1[j]);
            let up_left = match (left.1.get(i + 1), right.1.get(j + 1)) {
                (Some(l), Some(r)) => l <= r,
                (l, _) => l.is_some(),
            };
            let third = if up_left {
                i += 1;
                self.vertex(left.0, left.1[i])
            } else {
                j += 1;
                self.vertex(right.0, right.1[j])
            };
            self.mesh.triangles.push([a, b, third]);
        }
    }
}
