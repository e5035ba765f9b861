//! The boundary of a region on the grid of the Voronoi diagram, as segments that meet in their ends alone.

use std::panic::{AssertUnwindSafe, catch_unwind};

use boostvoronoi::prelude::{Builder, BvError, Diagram};
use clipper2_rust::core::{FillRule, Paths64, Point64};
use clipper2_rust::engine::ClipType;
use clipper2_rust::engine_public::Clipper64;

use crate::math::{DVec2, DVec3};
use crate::region::Region;
use crate::sheet::thinned;

/// Grid cells per millimetre: boundary points move by at most 0.17 µm.
pub(super) const CELLS_PER_MM: f64 = 4096.0;
/// Largest half extent of a region, mm, that 32-bit coordinates hold at that resolution.
const LARGEST_HALF_EXTENT: f64 = 250_000.0;
/// How far a boundary that meets itself is smoothed until it does not, cells: up to 8 µm.
const SMOOTHED: [f64; 3] = [2.0, 8.0, 32.0];

/// Why a region has no medial axis here.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MedialError {
    /// Too large for the resolution, or not a number.
    #[error("the region spans {0} mm: the medial axis takes regions up to 500 m across")]
    Extent(f64),
    /// The boundary meets itself within the resolution, or the diagram could not be built.
    #[error("no Voronoi diagram of the boundary: {0}; simplify the boundary or repair the part")]
    Diagram(String),
}

/// A point of the grid.
type Point = [i32; 2];

/// The boundary on the grid.
pub(super) struct Boundary {
    pub(super) centre: DVec2,
    segments: Vec<[i32; 4]>,
    /// Whether the region turns inwards at the start of each segment.
    pub(super) reflex: Vec<bool>,
    /// The segment that follows each segment on its ring.
    pub(super) next: Vec<usize>,
}

impl Boundary {
    /// The boundary of a region; none where nothing of it is as large as a cell.
    pub(super) fn new(region: &Region) -> Result<Option<Self>, MedialError> {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in region.rings().flatten() {
            (low, high) = (low.min(*p), high.max(*p));
        }
        let extent = (high - low).max_element();
        // a NaN lies in no range
        if !region.outer.is_empty() && !(0.0..=2.0 * LARGEST_HALF_EXTENT).contains(&extent) {
            return Err(MedialError::Extent(extent));
        }
        let centre = 0.5 * (low + high);
        let on_grid = |p: &DVec2| {
            let p = (p - centre) * CELLS_PER_MM;
            [p.x.round() as i32, p.y.round() as i32]
        };
        let rings: Vec<Vec<Point>> = region
            .rings()
            .map(|ring| ring.iter().map(on_grid).collect())
            .collect();
        // what folds back by less than a cell lies on itself on the grid, of which no diagram could be built
        let smoothed = SMOOTHED.iter().map(|&cells| smooth(&rings, cells));
        let found = std::iter::once(rings.clone())
            .chain(smoothed)
            .map(|rings| Boundary::of(centre, rings))
            .find(|boundary| !meets_itself(&boundary.segments));
        match found {
            Some(boundary) if boundary.segments.is_empty() => Ok(None),
            Some(boundary) => Ok(Some(boundary)),
            None => Err(MedialError::Diagram("it meets itself".to_owned())),
        }
    }

    fn of(centre: DVec2, rings: Vec<Vec<Point>>) -> Self {
        let mut boundary = Boundary {
            centre,
            segments: Vec::new(),
            reflex: Vec::new(),
            next: Vec::new(),
        };
        for mut points in rings {
            points.dedup();
            while points.len() > 1 && points.first() == points.last() {
                points.pop();
            }
            let (n, first) = (points.len(), boundary.segments.len());
            if n < 3 {
                continue;
            }
            for i in 0..n {
                let (before, a, b) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
                boundary.segments.push([a[0], a[1], b[0], b[1]]);
                boundary.reflex.push(turn(before, a, b) < 0);
                boundary.next.push(first + (i + 1) % n);
            }
        }
        boundary
    }

    /// The ends of a segment, in cells.
    pub(super) fn ends(&self, segment: usize) -> (DVec2, DVec2) {
        let [ax, ay, bx, by] = self.segments[segment].map(f64::from);
        (DVec2::new(ax, ay), DVec2::new(bx, by))
    }

    pub(super) fn diagram(&self) -> Result<Diagram, MedialError> {
        let build = || {
            Builder::<i32>::default()
                .with_segments(self.segments.iter())?
                .build()
        };
        // the library asserts on some degenerate input: its failure is ours to report, not to spread
        catch_unwind(AssertUnwindSafe(build))
            .unwrap_or_else(|_| Err(BvError::InternalError("it gave up".to_owned())))
            .map_err(|e| MedialError::Diagram(e.to_string()))
    }
}

/// Positive where the way over `a`, `b`, `c` turns left.
fn turn(a: Point, b: Point, c: Point) -> i128 {
    let way = |p: Point, q: Point| [0, 1].map(|k| i128::from(q[k]) - i128::from(p[k]));
    let ([ux, uy], [vx, vy]) = (way(a, b), way(b, c));
    ux * vy - uy * vx
}

/// The rings without what stands out of them by less than `cells`, as one region that crosses itself nowhere.
fn smooth(rings: &[Vec<Point>], cells: f64) -> Vec<Vec<Point>> {
    let mut paths = Paths64::with_capacity(rings.len());
    for ring in rings {
        let closed = ring.iter().chain(ring.first());
        let line: Vec<DVec3> = closed
            .map(|p| DVec3::new(p[0].into(), p[1].into(), 0.0))
            .collect();
        let stays = thinned(&line, cells);
        let kept = ring.iter().zip(stays).filter(|(_, stays)| *stays);
        paths.push(
            kept.map(|(p, _)| Point64::new(p[0].into(), p[1].into()))
                .collect(),
        );
    }
    let mut clipper = Clipper64::new();
    clipper.add_subject(&paths);
    let mut united = Paths64::new();
    clipper.execute(ClipType::Union, FillRule::NonZero, &mut united, None);
    // what is united reaches no farther than its rings, which are 32-bit
    let on_grid = |p: &Point64| [p.x as i32, p.y as i32];
    let ring = |path: &Vec<Point64>| path.iter().map(on_grid).collect();
    united.iter().map(ring).collect()
}

/// Whether two segments share more than an end of both.
fn meets_itself(segments: &[[i32; 4]]) -> bool {
    let range = |s: &[i32; 4], k: usize| [s[k].min(s[k + 2]), s[k].max(s[k + 2])];
    let long = |k: usize| {
        let all = segments.iter().map(|s| range(s, k));
        let around = all.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        around.map_or(0, |[low, high]| i64::from(high) - i64::from(low))
    };
    // along the longer side fewer lie beside one another
    let (along, across) = if long(0) >= long(1) { (0, 1) } else { (1, 0) };
    let mut sorted: Vec<&[i32; 4]> = segments.iter().collect();
    sorted.sort_unstable_by_key(|s| range(s, along)[0]);
    sorted.iter().enumerate().any(|(i, s)| {
        let [_, end] = range(s, along);
        let [low, high] = range(s, across);
        sorted[i + 1..]
            .iter()
            .take_while(|t| range(t, along)[0] <= end)
            .filter(|t| range(t, across)[0] <= high && range(t, across)[1] >= low)
            .any(|t| meet(s, t))
    })
}

/// Whether two segments share more than an end of both.
fn meet(&[ax, ay, bx, by]: &[i32; 4], &[cx, cy, dx, dy]: &[i32; 4]) -> bool {
    let (a, b, c, d) = ([ax, ay], [bx, by], [cx, cy], [dx, dy]);
    if (a == c && b == d) || (a == d && b == c) {
        return true;
    }
    let of_first = [turn(a, b, c), turn(a, b, d)].map(i128::signum);
    let of_second = [turn(c, d, a), turn(c, d, b)].map(i128::signum);
    if of_first[0] * of_first[1] < 0 && of_second[0] * of_second[1] < 0 {
        return true;
    }
    let within = |p: Point, from: Point, to: Point| {
        p != from
            && p != to
            && (0..2).all(|k| p[k] >= from[k].min(to[k]) && p[k] <= from[k].max(to[k]))
    };
    (of_first[0] == 0 && within(c, a, b))
        || (of_first[1] == 0 && within(d, a, b))
        || (of_second[0] == 0 && within(a, c, d))
        || (of_second[1] == 0 && within(b, c, d))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_meet_where_they_share_more_than_an_end() {
        let meets = |a, b| meet(&a, &b) && meet(&b, &a);
        assert!(meets([0, 0, 4, 4], [0, 4, 4, 0]));
        // an end on the other, and one along the other
        assert!(meets([0, 0, 4, 0], [2, 0, 2, 3]));
        assert!(meets([0, 0, 4, 0], [4, 0, 1, 0]));
        assert!(meets([0, 0, 4, 0], [4, 0, 0, 0]));
        let apart = |a, b| !meet(&a, &b) && !meet(&b, &a);
        assert!(apart([0, 0, 4, 0], [4, 0, 9, 0]));
        assert!(apart([0, 0, 4, 0], [4, 0, 4, 3]));
        assert!(apart([0, 0, 4, 0], [5, 0, 9, 0]));
        assert!(apart([0, 0, 4, 0], [0, 1, 4, 1]));
    }
}
