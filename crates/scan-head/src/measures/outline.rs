//! What is to be filled of a layer: its section where that is known, else what its closed contours enclose.

use std::collections::BTreeMap;
use std::sync::Arc;

use meltpath_geometry::math::DVec2;
use meltpath_geometry::region::signed_area;
use meltpath_toolpath::Role;

use super::segment::distance_to_segment;
use crate::head::vector::ScanJob;

/// Hatch distances up to which a ring lies beside the one round it all along: both are contours of one boundary.
const BESIDE: f64 = 1.6;
/// Lines go on where the last one ended, and rings end where they begin, mm.
const JOINED: f64 = 1e-3;
/// Lines that end this near to where they begin, in shares of their length, and not within a spot, may be meant to close: without its last side
/// a triangle does by half.
const MAY_CLOSE: f64 = 0.5;
/// Hatch distances up to which rings touch.
const TOUCHING: f64 = 0.1;
/// What no mark comes nearer to than so many hatch distances is bare. Lines a hatch apart leave half of one, one missing line a whole one.
pub const NEAR: f64 = 1.05;

/// A closed contour.
#[derive(Debug, Clone, PartialEq)]
pub struct Ring {
    /// The part that it belongs to.
    pub part: u32,
    /// Its corners, mm; the last one joins the first.
    pub corners: Vec<DVec2>,
}

/// Lines that may be meant to close, and do not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Where they end, mm.
    pub at: DVec2,
    /// From there to where they begin, mm.
    pub gap: f64,
}

/// The contours of a layer.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Contours {
    /// Those that close.
    pub rings: Vec<Ring>,
    /// What of the others may be meant to.
    pub openings: Vec<Opening>,
}

/// What lies on the inner side of a ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Within {
    /// What is to be filled.
    Area,
    /// What is not.
    Hole,
}

/// A ring that bounds what is to be filled, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// Its corners.
    pub ring: Vec<DVec2>,
    /// What lies in it.
    pub within: Within,
}

/// The boundaries of a layer: what lies in more areas than holes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Boundaries {
    /// All of them.
    pub all: Vec<Boundary>,
    /// Where two rings cross that run the one this, the other that way round: whether one is a hole of the other nothing tells.
    pub crossing: Option<DVec2>,
}

/// Where outlines of layers come from.
#[derive(Debug, Clone)]
pub enum Outlines {
    /// There are none.
    None,
    /// Of a part's sections, by the number of the layer.
    Known(Arc<BTreeMap<u32, Vec<Boundary>>>),
    /// The closed contours of the layers themselves, drawn with a spot of that diameter, mm. Nobody says what they are for: what no line of a
    /// fill comes near ([`NEAR`]) is left out, and a layer without lines, or without closed contours, has no outline.
    OfContours {
        /// The spot's diameter.
        spot: f64,
    },
}

/// What is to be filled of one layer.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    pub(super) boundaries: Vec<Boundary>,
    /// Only what lies within so many mm of a line, where that is a bound.
    pub(super) near: Option<(Vec<[DVec2; 2]>, f64)>,
}

impl Outlines {
    /// The outline of layer `number`, whose lines lie `hatch` mm apart.
    pub(super) fn of(&self, number: u32, job: &ScanJob, hatch: f64) -> Option<Outline> {
        match self {
            Outlines::None => None,
            Outlines::Known(all) => {
                let boundaries = all.get(&number)?.clone();
                Some(Outline {
                    boundaries,
                    near: None,
                })
            }
            Outlines::OfContours { spot } => {
                let marks = |wanted: fn(Role) -> bool| {
                    let marks =
                        (0..job.vectors.len()).filter(move |&i| wanted(job.vectors[i].kind));
                    marks.map(|i| {
                        let v = &job.vectors[i];
                        (v.block, [job.start_of(i).truncate(), v.end.truncate()])
                    })
                };
                marks(|role| role == Role::Fill).next()?;
                let drawn = contours(marks(|role| role == Role::Contour), *spot);
                let boundaries = boundaries(drawn.rings, hatch).all;
                // a contour round what has no lines asks for none
                let near = marks(|role| role == Role::Fill).map(|(_, line)| line);
                let near = near.collect();
                (!boundaries.is_empty()).then_some(Outline {
                    boundaries,
                    near: Some((near, NEAR * hatch)),
                })
            }
        }
    }
}

/// From where to where, mm along x, rows at the heights `rows`, mm and rising, lie within more areas than holes: row by row, in order. A ring
/// that crosses itself is round what it is round an odd number of times.
///
/// ```
/// use meltpath_geometry::math::DVec2;
/// use meltpath_scan_head::measures::outline::{Boundary, Within, rows_within};
/// let square = Boundary {
///     ring: vec![DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y],
///     within: Within::Area,
/// };
/// assert_eq!(rows_within(&[square], &[-0.5, 0.5]), [vec![], vec![[0.0, 1.0]]]);
/// ```
pub fn rows_within(boundaries: &[Boundary], rows: &[f64]) -> Vec<Vec<[f64; 2]>> {
    let mut changes = vec![Vec::new(); rows.len()];
    for Boundary { ring, within } in boundaries {
        let step = match within {
            Within::Area => 1,
            Within::Hole => -1,
        };
        for (row, [from, to]) in rows_of(ring, rows) {
            changes[row].extend([(from, step), (to, -step)]);
        }
    }
    let spans = |mut row: Vec<(f64, i32)>| {
        row.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut spans, mut depth) = (Vec::<[f64; 2]>::new(), 0);
        for (x, step) in row {
            let before = depth;
            depth += step;
            if before <= 0 && depth > 0 {
                spans.push([x, x]);
            } else if before > 0
                && depth <= 0
                && let Some(last) = spans.last_mut()
            {
                last[1] = x;
            }
        }
        spans.retain(|[from, to]| to > from);
        spans
    };
    changes.into_iter().map(spans).collect()
}

/// Which of the rows, mm and rising, cross one ring, and from where to where along x, mm.
fn rows_of(ring: &[DVec2], rows: &[f64]) -> Vec<(usize, [f64; 2])> {
    let mut crossings = Vec::new();
    for [a, b] in sides(ring) {
        // half open, so that a corner counts once
        let [first, end] =
            [a.y.min(b.y), a.y.max(b.y)].map(|y| rows.partition_point(|row| *row < y));
        for (row, y) in rows.iter().enumerate().take(end).skip(first) {
            crossings.push((row, a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y)));
        }
    }
    crossings.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    // each row is crossed an even number of times
    let pairs = crossings.as_chunks::<2>().0;
    pairs
        .iter()
        .map(|[from, to]| (from.0, [from.1, to.1]))
        .collect()
}

/// The contours of lines, each with its part; what is drawn on from where the last line ended goes on with it. Lines that end within a spot of
/// that diameter, mm, of where they begin close.
pub fn contours(lines: impl Iterator<Item = (u32, [DVec2; 2])>, spot: f64) -> Contours {
    let mut found = Contours::default();
    let mut open = Ring {
        part: 0,
        corners: Vec::new(),
    };
    for (part, [from, to]) in lines {
        let goes_on = |end: &DVec2| part == open.part && end.distance(from) <= JOINED;
        if !open.corners.last().is_some_and(goes_on) {
            let begun = Ring {
                part,
                corners: vec![from],
            };
            found.end(std::mem::replace(&mut open, begun), spot);
        }
        open.corners.push(to);
        if open.corners.len() > 3 && open.corners[0].distance(to) <= JOINED {
            let corners = std::mem::take(&mut open.corners);
            found.end(Ring { part, corners }, spot);
        }
    }
    found.end(open, spot);
    found
}

impl Contours {
    /// Lines are drawn to their end.
    fn end(&mut self, mut lines: Ring, spot: f64) {
        let corners = &mut lines.corners;
        let (Some(&first), Some(&last)) = (corners.first(), corners.last()) else {
            return;
        };
        if corners.len() < 3 {
            return;
        }
        let gap = first.distance(last);
        let length: f64 = corners.windows(2).map(|l| l[0].distance(l[1])).sum();
        if gap <= spot {
            if gap <= JOINED {
                corners.pop();
            }
            if corners.len() > 2 {
                self.rings.push(lines);
            }
        } else if gap <= MAY_CLOSE * length && signed_area(corners).abs() > spot * length {
            self.openings.push(Opening { at: last, gap });
        }
    }
}

/// A ring with its box and its signed area.
struct Nested {
    part: u32,
    ring: Vec<DVec2>,
    low: DVec2,
    high: DVec2,
    area: f64,
}

impl Nested {
    fn of(Ring { part, corners }: Ring) -> Self {
        Nested {
            part,
            low: corners.iter().copied().fold(DVec2::INFINITY, DVec2::min),
            high: corners
                .iter()
                .copied()
                .fold(DVec2::NEG_INFINITY, DVec2::max),
            area: signed_area(&corners),
            ring: corners,
        }
    }

    fn apart(&self, other: &Nested) -> bool {
        self.high.cmplt(other.low).any() || self.low.cmpgt(other.high).any()
    }

    fn runs_as(&self, other: &Nested) -> bool {
        self.area.signum() == other.area.signum()
    }

    /// How a smaller ring lies, of which `points` are places by rising y; what is no farther than `touching` mm is on either side.
    fn holds(&self, inner: &Nested, points: &[DVec2], touching: f64) -> Lies {
        if self.apart(inner) {
            return Lies::Apart;
        }
        let heights: Vec<f64> = points.iter().map(|p| p.y).collect();
        let mut inside = vec![false; points.len()];
        for (row, [from, to]) in rows_of(&self.ring, &heights) {
            inside[row] |= (from..to).contains(&points[row].x);
        }
        let clearly = |wanted: bool| {
            let places = points.iter().zip(&inside).filter(|(_, is)| **is == wanted);
            let far =
                |p: DVec2| sides(&self.ring).all(|[a, b]| distance_to_segment(p, a, b) > touching);
            places.map(|(p, _)| *p).find(|p| far(*p))
        };
        match (clearly(true), clearly(false)) {
            (_, None) => Lies::Within,
            (None, Some(_)) => Lies::Apart,
            (Some(_), Some(at)) => Lies::Across(at),
        }
    }
}

/// What a ring bounds.
#[derive(Debug, Clone, Copy)]
enum Bounds {
    Side(Within),
    /// Nothing: another one beside it does.
    Double(Within),
}

impl Bounds {
    /// What a ring bounds that lies in `round`, of which it is that.
    fn of_what_lies_in(self, round: &Nested, own: &Nested, hatch: f64) -> Bounds {
        let (Bounds::Side(side) | Bounds::Double(side)) = self;
        let alike = round.runs_as(own);
        let most = if alike { BESIDE } else { TOUCHING };
        if beside(&own.ring, &round.ring, most * hatch) {
            return Bounds::Double(side);
        }
        let hole = side == Within::Area && (!alike || round.part == own.part);
        Bounds::Side(if hole { Within::Hole } else { Within::Area })
    }
}

/// How a ring lies to a larger one.
enum Lies {
    Within,
    Apart,
    /// With a place outside of it.
    Across(DVec2),
}

/// The sides of a ring.
fn sides(ring: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> + '_ {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// Places of a ring, its corners among them, no more than `step` mm apart, by rising y.
fn places(ring: &[DVec2], step: f64) -> Vec<DVec2> {
    let on = |[a, b]: [DVec2; 2]| {
        let count = (a.distance(b) / step).ceil().max(1.0);
        (0..count as usize).map(move |k| a.lerp(b, k as f64 / count))
    };
    let mut all: Vec<DVec2> = sides(ring).flat_map(on).collect();
    all.sort_by(|a, b| a.y.total_cmp(&b.y));
    all
}

/// What rings of a layer bound, whose lines lie `hatch` mm apart: of contours side by side the outermost. In an area of its part a ring is a
/// hole, in a hole an area, whichever way it runs, and in an area of another part where it runs the other way round. Areas that cross are to be
/// filled both.
pub fn boundaries(rings: Vec<Ring>, hatch: f64) -> Boundaries {
    let mut all: Vec<Nested> = rings.into_iter().map(Nested::of).collect();
    all.sort_by(|a, b| b.area.abs().total_cmp(&a.area.abs()));
    let mut found = Boundaries::default();
    let mut known: Vec<(Nested, Bounds)> = Vec::new();
    for own in all {
        let points = places(&own.ring, hatch);
        // the smallest of the larger ones that hold it
        let mut round = None;
        for (k, (larger, _)) in known.iter().enumerate().rev() {
            match larger.holds(&own, &points, TOUCHING * hatch) {
                Lies::Within => round = round.or(Some(k)),
                Lies::Across(at) if !larger.runs_as(&own) => found.crossing = Some(at),
                Lies::Across(_) | Lies::Apart => {}
            }
        }
        let bounds = match round.map(|k| &known[k]) {
            None => Bounds::Side(Within::Area),
            Some((round, bounds)) => bounds.of_what_lies_in(round, &own, hatch),
        };
        known.push((own, bounds));
    }
    let bounds = known
        .into_iter()
        .filter_map(|(nested, bounds)| match bounds {
            Bounds::Side(within) => Some(Boundary {
                ring: nested.ring,
                within,
            }),
            Bounds::Double(_) => None,
        });
    found.all = bounds.collect();
    found
}

/// Whether every corner of a ring lies within a distance of another.
fn beside(ring: &[DVec2], round: &[DVec2], within: f64) -> bool {
    let near = |p: DVec2| sides(round).any(|[a, b]| distance_to_segment(p, a, b) <= within);
    ring.iter().all(|p| near(*p))
}
