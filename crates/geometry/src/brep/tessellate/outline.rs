//! The outline of a face in the parameter plane of its surface: points, segments, and loops followed through the plane.

use super::chart::Chart;
use crate::brep::Sense;
use crate::math::{DVec2, DVec3};

/// A vertex of the mesh as a face knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Node {
    /// A vertex of the solid.
    Vertex(u32),
    /// An inner sample of an edge.
    Sample { edge: u32, index: u32 },
    /// A point of the face's own.
    Own(u32),
}

/// A point of the outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub(super) uv: DVec2,
    pub(super) node: Node,
}

/// What a segment of the outline is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// A chord of an edge, between these parameters.
    Boundary { edge: u32, t: [f64; 2] },
    /// A piece of a pole: one point in space.
    Pole,
    /// A cut along which a closed surface was opened.
    Cut,
}

/// A directed segment between two points of the outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) kind: Kind,
}

/// Which side of the outline is the face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Inside {
    /// Where a way to infinity crosses the outline an odd number of times.
    Parity,
    /// Left of boundary segments for a forward face, right for a reversed one; all where there are none.
    BesideBoundary,
}

/// The outline of a face in its parameter plane.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outline {
    pub(super) points: Vec<Point>,
    pub(super) segments: Vec<Segment>,
    /// Pairs of segments that are the two banks of one cut, as ((from, to), (from, to)).
    pub(super) banks: Vec<[usize; 2]>,
    /// Points in space of [`Node::Own`].
    pub(super) own: Vec<DVec3>,
    pub(super) inside: Inside,
    /// The face's normal against its surface's, as the boundary's direction has it.
    pub(super) sense: Sense,
}

/// A loop followed through the plane; the last point joins the first, displaced by the winding.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) points: Vec<Point>,
    /// Kind of the segment that begins at each point.
    pub(super) kinds: Vec<Kind>,
    /// Turns round u and round v.
    pub(super) winding: [i32; 2],
}

impl Track {
    /// Parameters of point `i`, where `i == len` is the first point again, after the turns.
    pub(super) fn uv(&self, i: usize, chart: &Chart<'_>) -> DVec2 {
        if i < self.points.len() {
            return self.points[i].uv;
        }
        let turns = self.winding.map(f64::from);
        let periods = chart.periods.map(|p| p.unwrap_or(0.0));
        self.points[0].uv + DVec2::from_array(turns) * DVec2::from_array(periods)
    }

    pub(super) fn shift(&mut self, by: DVec2) {
        for point in &mut self.points {
            point.uv += by;
        }
    }

    /// Twice the signed area.
    pub(super) fn area(&self) -> f64 {
        let origin = self.points[0].uv;
        let n = self.points.len();
        (0..n)
            .map(|i| (self.points[i].uv - origin).perp_dot(self.points[(i + 1) % n].uv - origin))
            .sum()
    }

    /// Smallest and largest coordinates.
    pub(super) fn bounds(&self) -> [DVec2; 2] {
        let first = self.points[0].uv;
        self.points
            .iter()
            .fold([first, first], |[lo, hi], p| [lo.min(p.uv), hi.max(p.uv)])
    }

    /// Whether a point lies inside, by parity.
    pub(super) fn encloses(&self, p: DVec2) -> bool {
        let n = self.points.len();
        let mut odd = false;
        for i in 0..n {
            let (a, b) = (self.points[i].uv, self.points[(i + 1) % n].uv);
            if (a.y > p.y) != (b.y > p.y) {
                let x = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                odd ^= x > p.x;
            }
        }
        odd
    }
}
