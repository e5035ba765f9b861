//! The medial axis of a region: centres of the discs that touch its boundary twice, with their radii, as a graph of
//! short straight edges. From the Voronoi diagram of the boundary's segments (Fortune's sweep, as in Boost.Polygon).

mod boundary;

use boostvoronoi::prelude::{BvError, CellIndex, SourceCategory};

pub use self::boundary::MedialError;
use self::boundary::{Boundary, CELLS_PER_MM};
use crate::math::DVec2;
use crate::region::Region;

/// Nodes nearer than this are one, mm: twenty cells of the input grid, far below any bead.
const SAME_NODE: f64 = 5e-3;

/// A point of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Where, mm.
    pub position: DVec2,
    /// Distance to the boundary, mm.
    pub radius: f64,
}

/// The axis as a graph; along an edge the radius is linear within the sampling.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MedialAxis {
    /// The points.
    pub nodes: Vec<Node>,
    /// Pairs of indices into `nodes`.
    pub edges: Vec<(u32, u32)>,
}

/// What a Voronoi cell belongs to.
#[derive(Clone, Copy)]
enum Site {
    /// A boundary segment from `a` to `b`, the region on its left.
    Segment { a: DVec2, b: DVec2 },
    /// A boundary vertex; `reflex` where the region turns inwards.
    Vertex { at: DVec2, reflex: bool },
}

impl Site {
    fn distance(self, p: DVec2) -> f64 {
        match self {
            Site::Segment { a, b } => (b - a).normalize_or_zero().perp_dot(p - a).abs(),
            Site::Vertex { at, .. } => p.distance(at),
        }
    }

    fn has_inside(self, p: DVec2) -> bool {
        match self {
            Site::Segment { a, b } => (b - a).perp_dot(p - a) > 0.0,
            Site::Vertex { reflex, .. } => reflex,
        }
    }
}

/// The medial axis of `region`, its curved edges cut into chords of about `step` mm.
///
/// ```
/// use meltpath_geometry::{Region, math::DVec2, medial::medial_axis};
/// let plate = [(0., 0.), (40., 0.), (40., 6.), (0., 6.)].map(|(x, y)| DVec2::new(x, y)).to_vec();
/// let axis = medial_axis(&Region { outer: plate, holes: vec![] }, 1.0).unwrap();
/// let widest = axis.nodes.iter().map(|n| n.radius).fold(0.0, f64::max);
/// assert!((widest - 3.0).abs() < 1e-3);
/// ```
///
/// # Errors
/// [`MedialError`] where the region is too large or its boundary is degenerate at the resolution.
pub fn medial_axis(region: &Region, step: f64) -> Result<MedialAxis, MedialError> {
    let Some(boundary) = Boundary::new(region)? else {
        return Ok(MedialAxis::default());
    };
    let diagram = boundary.diagram()?;
    let broken = |e: BvError| MedialError::Diagram(e.to_string());
    let site = |cell: CellIndex| -> Result<Site, MedialError> {
        let (index, category) = diagram.cell(cell).map_err(broken)?.source_index_2();
        let segment = index.usize();
        let (a, b) = boundary.ends(segment);
        Ok(match category {
            SourceCategory::Segment => Site::Segment { a, b },
            SourceCategory::SegmentEnd => Site::Vertex {
                at: b,
                reflex: boundary.reflex[boundary.next[segment]],
            },
            SourceCategory::SegmentStart | SourceCategory::SinglePoint => Site::Vertex {
                at: a,
                reflex: boundary.reflex[segment],
            },
        })
    };
    let mut graph = Graph::new(diagram.vertices().len());
    for edge in diagram.edges() {
        let twin = edge.twin().map_err(broken)?;
        if edge.is_secondary() || edge.id().usize() > twin.usize() {
            continue;
        }
        let (Some(from), Some(to)) = (
            edge.vertex0(),
            diagram.edge_get_vertex1(edge.id()).map_err(broken)?,
        ) else {
            continue;
        };
        let sites = (
            site(edge.cell().map_err(broken)?)?,
            site(diagram.edge_get_cell(twin).map_err(broken)?)?,
        );
        let at = |v| {
            diagram
                .vertex(v)
                .map(|v| DVec2::new(v.x(), v.y()))
                .map_err(broken)
        };
        let ends = (at(from)?, at(to)?);
        let samples = samples(sites, ends, step * CELLS_PER_MM);
        let middle = samples[samples.len() / 2];
        if !sites.0.has_inside(middle) || !sites.1.has_inside(middle) {
            continue;
        }
        let node = |p: DVec2| Node {
            position: p / CELLS_PER_MM + boundary.centre,
            radius: sites.0.distance(p) / CELLS_PER_MM,
        };
        let mut last = graph.vertex(from.usize(), || node(samples[0]));
        for &p in &samples[1..samples.len() - 1] {
            let next = graph.add(node(p));
            graph.axis.edges.push((last, next));
            last = next;
        }
        let end = graph.vertex(to.usize(), || node(samples[samples.len() - 1]));
        graph.axis.edges.push((last, end));
    }
    Ok(graph.joined())
}

/// Points of the edge between two sites, ends included, at least three.
fn samples(sites: (Site, Site), ends: (DVec2, DVec2), step: f64) -> Vec<DVec2> {
    let n = ((ends.0.distance(ends.1) / step.max(1.0)).ceil() as usize).clamp(2, 10_000);
    let share = |i: usize| i as f64 / n as f64;
    let mut points: Vec<DVec2> = match sites {
        (Site::Segment { a, b }, Site::Vertex { at, .. })
        | (Site::Vertex { at, .. }, Site::Segment { a, b }) => {
            // the parabola of focus `at` and directrix `ab`, by its foot on the directrix
            let u = (b - a).normalize_or_zero();
            let v = u.perp();
            let (focus, height) = ((at - a).dot(u), (at - a).dot(v));
            let (from, to) = ((ends.0 - a).dot(u), (ends.1 - a).dot(u));
            (0..=n)
                .map(|i| {
                    let foot = from + (to - from) * share(i);
                    if height.abs() < 1.0 {
                        return ends.0.lerp(ends.1, share(i));
                    }
                    let y = ((foot - focus).powi(2) + height * height) / (2.0 * height);
                    a + u * foot + v * y
                })
                .collect()
        }
        (Site::Segment { .. }, Site::Segment { .. }) => {
            vec![ends.0, 0.5 * (ends.0 + ends.1), ends.1]
        }
        (Site::Vertex { .. }, Site::Vertex { .. }) => {
            (0..=n).map(|i| ends.0.lerp(ends.1, share(i))).collect()
        }
    };
    // the diagram's own vertices, so that edges meet exactly
    points[0] = ends.0;
    if let Some(last) = points.last_mut() {
        *last = ends.1;
    }
    points
}

/// The axis while it grows, with the node of each Voronoi vertex.
struct Graph {
    axis: MedialAxis,
    of_vertex: Vec<Option<u32>>,
}

impl Graph {
    fn new(vertices: usize) -> Self {
        Graph {
            axis: MedialAxis::default(),
            of_vertex: vec![None; vertices],
        }
    }

    fn add(&mut self, node: Node) -> u32 {
        self.axis.nodes.push(node);
        (self.axis.nodes.len() - 1) as u32
    }

    fn vertex(&mut self, index: usize, node: impl FnOnce() -> Node) -> u32 {
        if let Some(known) = self.of_vertex[index] {
            return known;
        }
        let new = self.add(node());
        self.of_vertex[index] = Some(new);
        new
    }

    /// The axis with edges shorter than [`SAME_NODE`] collapsed.
    fn joined(self) -> MedialAxis {
        let MedialAxis { nodes, edges } = self.axis;
        let mut leader: Vec<u32> = (0..nodes.len() as u32).collect();
        let find = |leader: &mut Vec<u32>, mut i: u32| {
            while leader[i as usize] != i {
                leader[i as usize] = leader[leader[i as usize] as usize];
                i = leader[i as usize];
            }
            i
        };
        for &(a, b) in &edges {
            let (p, q) = (nodes[a as usize].position, nodes[b as usize].position);
            if p.distance(q) < SAME_NODE {
                let (a, b) = (find(&mut leader, a), find(&mut leader, b));
                leader[a.max(b) as usize] = a.min(b);
            }
        }
        let mut axis = MedialAxis::default();
        let mut place = vec![u32::MAX; nodes.len()];
        for i in 0..nodes.len() as u32 {
            let to = find(&mut leader, i) as usize;
            if place[to] == u32::MAX {
                place[to] = axis.nodes.len() as u32;
                axis.nodes.push(nodes[to]);
            }
            place[i as usize] = place[to];
        }
        let kept = edges
            .iter()
            .map(|&(a, b)| (place[a as usize], place[b as usize]));
        axis.edges = kept.filter(|(a, b)| a != b).collect();
        axis
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Ring;

    fn star(centre: DVec2, radii: &[f64]) -> Ring {
        let n = radii.len() as f64;
        (0..radii.len())
            .map(|i| centre + DVec2::from_angle(std::f64::consts::TAU * i as f64 / n) * radii[i])
            .collect()
    }

    fn to_boundary(region: &Region, p: DVec2) -> f64 {
        region
            .rings()
            .flat_map(|r| (0..r.len()).map(move |i| (r[i], r[(i + 1) % r.len()])))
            .map(|(a, b)| {
                let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                p.distance(a.lerp(b, t))
            })
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_ring_has_a_circle_in_its_middle() {
        let mut hole = star(DVec2::ZERO, &[20.0; 90]);
        hole.reverse();
        let region = Region {
            outer: star(DVec2::ZERO, &[26.0; 120]),
            holes: vec![hole],
        };
        let axis = medial_axis(&region, 0.5).unwrap();
        let middle: f64 = axis
            .edges
            .iter()
            .map(|&(a, b)| (axis.nodes[a as usize], axis.nodes[b as usize]))
            .filter(|(a, b)| a.radius.min(b.radius) > 2.9)
            .map(|(a, b)| a.position.distance(b.position))
            .sum();
        assert!(
            (middle - std::f64::consts::TAU * 23.0).abs() < 5.0,
            "{middle}"
        );
    }

    /// A boundary that folds back on itself by less than can be told gave another axis, kilometres long, at each call.
    #[test]
    fn a_boundary_that_folds_back_has_the_same_axis_at_each_call() {
        let cells = |n: f64| n / 4096.0;
        let mut outer: Ring = vec![DVec2::ZERO, DVec2::new(6.0, 0.0)];
        for i in 1..12 {
            let y = 2.0 * f64::from(i);
            // on, back by three cells along the same line, and on
            outer.extend([DVec2::new(6.0, y), DVec2::new(6.0, y - cells(3.0))]);
        }
        outer.extend([DVec2::new(6.0, 24.0), DVec2::new(0.0, 24.0)]);
        let region = Region {
            outer,
            holes: vec![],
        };
        let axis = medial_axis(&region, 0.5).unwrap();
        let at = |i: u32| axis.nodes[i as usize].position;
        let long: f64 = axis.edges.iter().map(|&(a, b)| at(a).distance(at(b))).sum();
        // 18 mm in the middle and four ways into the corners
        assert!(
            (long - (18.0 + 12.0 * 2.0_f64.sqrt())).abs() < 0.01,
            "{long}"
        );
        for _ in 0..20 {
            assert_eq!(medial_axis(&region, 0.5).unwrap(), axis);
        }
    }

    #[test]
    fn what_is_smaller_than_the_grid_has_no_axis() {
        let speck = star(DVec2::new(40.0, 7.0), &[1e-5; 6]);
        let region = Region {
            outer: speck,
            holes: vec![],
        };
        assert_eq!(medial_axis(&region, 0.5).unwrap(), MedialAxis::default());
    }

    proptest! {
        #[test]
        fn a_boundary_that_jitters_has_one_axis(
            sides in prop::collection::vec(prop::collection::vec((0.0..1.0_f64, -0.5..0.5_f64, -0.5..0.5_f64), 0..20), 4),
            jitter in prop::sample::select(vec![1e-5, 3e-4, 1e-2, 0.1]),
        ) {
            let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 24.0), (0.0, 24.0)].map(|(x, y)| DVec2::new(x, y));
            let mut outer = Ring::new();
            for (k, mut side) in sides.into_iter().enumerate() {
                side.sort_by(|a, b| a.0.total_cmp(&b.0));
                outer.push(corners[k]);
                let at = |(t, x, y)| corners[k].lerp(corners[(k + 1) % 4], t) + jitter * DVec2::new(x, y);
                outer.extend(side.into_iter().map(at));
            }
            let region = Region { outer, holes: vec![] };
            let axis = medial_axis(&region, 0.5).unwrap();
            for node in &axis.nodes {
                let away = to_boundary(&region, node.position);
                prop_assert!((away - node.radius).abs() < 2e-3 + jitter, "{node:?} is {away} away");
            }
            prop_assert_eq!(medial_axis(&region, 0.5).unwrap(), axis);
        }

        #[test]
        fn radii_are_distances_to_the_boundary(
            outer in prop::collection::vec(10.0..30.0_f64, 3..40),
            inner in prop::collection::vec(1.0..6.0_f64, 3..20),
        ) {
            let mut hole = star(DVec2::ZERO, &inner);
            hole.reverse();
            let region = Region { outer: star(DVec2::ZERO, &outer), holes: vec![hole] };
            // a hole that reaches over the outer ring makes no region
            let whole = |ring: Ring| [Region { outer: ring, holes: vec![] }];
            let left = crate::boolean::difference(
                &whole(region.outer.clone()),
                &whole(star(DVec2::ZERO, &inner)),
            ).unwrap();
            let area: f64 = left.iter().map(Region::area).sum();
            prop_assume!(left.len() == 1 && (area - region.area()).abs() < 1e-3);
            prop_assume!(region.holes[0].iter().all(|&p| to_boundary(&Region { outer: region.outer.clone(), holes: vec![] }, p) > 0.1));
            let axis = medial_axis(&region, 0.5).unwrap();
            prop_assert!(!axis.edges.is_empty());
            for node in &axis.nodes {
                let away = to_boundary(&region, node.position);
                prop_assert!((away - node.radius).abs() < 2e-3, "{node:?} is {away} away");
            }
        }
    }
}
