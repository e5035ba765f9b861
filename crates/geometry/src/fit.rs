//! Polylines as few lines and circular arcs within a tolerance: every point of the polyline lies within it of the
//! result, and the result within it of the polyline. A polyline whose vertices lie on a circle may be the facets of
//! one: there the result may leave the middles of the chords by more, which is a tolerance of its own.
//!
//! Greedy longest pieces. An arc through both ends of a run has its centre on the perpendicular bisector; the
//! position there is the least-squares solution of the circle equation, which is linear in it.

use std::f64::consts::PI;

use crate::math::DVec2;

/// How a fitted piece goes to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Straight.
    Line,
    /// On the circle through the start, `via` and the end.
    Arc {
        /// The middle of the arc, mm.
        via: DVec2,
    },
}

/// A piece of the result; it starts where the previous one ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Its end, mm: a point of the polyline.
    pub end: DVec2,
    /// Its shape.
    pub shape: Shape,
}

/// What a fit may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Largest distance between the points of the polyline and the result, and between the result and the polyline, mm.
    pub distance: f64,
    /// Largest distance between an arc and the middles of chords that are facets of a curve, mm: chords farther from
    /// an arc than this stay lines. At least `distance` counts.
    pub facet: f64,
    /// Direction changes above this angle are corners, rad: they stay, and no arc runs across them.
    pub corner: f64,
}

/// Shortest sweep written as an arc, rad: below it an arc looks like a line to a controller.
const SMALLEST_SWEEP: f64 = 0.03;

/// Lines and arcs along `points`, from the first to the last; repeated points are dropped. An arc replaces at least
/// three chords and sweeps at most half a turn, so that a full circle is written as two.
///
/// ```
/// use meltpath_geometry::{fit::{Shape, Tolerance, fit}, math::DVec2};
/// let circle: Vec<_> = (0..=90).map(|i| DVec2::from_angle(f64::to_radians(4.0 * f64::from(i))) * 30.0).collect();
/// let pieces = fit(&circle, Tolerance { distance: 0.05, facet: 0.05, corner: 0.35 });
/// assert_eq!(pieces.len(), 2);
/// assert!(pieces.iter().all(|p| matches!(p.shape, Shape::Arc { .. })));
/// ```
pub fn fit(points: &[DVec2], tolerance: Tolerance) -> Vec<Piece> {
    let mut run: Vec<DVec2> = Vec::with_capacity(points.len());
    for &p in points {
        if run.last().is_none_or(|&q| q.distance(p) > 1e-9) {
            run.push(p);
        }
    }
    let fit = Run::new(run, tolerance);
    let last = fit.points.len().saturating_sub(1);
    let mut pieces = Vec::new();
    let mut at = 0;
    while at < last {
        let line = fit.farthest(at, |from, to| fit.line(from, to));
        let arc = fit.farthest_arc(at);
        let (end, shape) = match arc {
            Some((end, via))
                if fit.along[end] - fit.along[at] > 1.2 * (fit.along[line] - fit.along[at]) =>
            {
                (end, Shape::Arc { via })
            }
            _ => (fit.hand_over(at, line), Shape::Line),
        };
        pieces.push((end, shape));
        at = end;
    }
    fit.take_up(&mut pieces);
    let piece = |(end, shape)| Piece {
        end: fit.points[end],
        shape,
    };
    pieces.into_iter().map(piece).collect()
}

struct Run {
    points: Vec<DVec2>,
    along: Vec<f64>,
    /// The next corner at or after each point, as an index.
    next_corner: Vec<usize>,
    /// Absolute turning summed up to and including each point.
    turned: Vec<f64>,
    tolerance: f64,
    facet: f64,
}

impl Run {
    fn new(points: Vec<DVec2>, tolerance: Tolerance) -> Self {
        let n = points.len();
        let mut along = vec![0.0; n];
        for i in 1..n {
            along[i] = along[i - 1] + points[i].distance(points[i - 1]);
        }
        let turn = |i: usize| {
            if i == 0 || i + 1 >= n {
                return 0.0;
            }
            (points[i] - points[i - 1])
                .angle_to(points[i + 1] - points[i])
                .abs()
        };
        let mut turned = vec![0.0; n];
        let mut next_corner = vec![n.saturating_sub(1); n];
        for i in 1..n {
            turned[i] = turned[i - 1] + turn(i);
        }
        for i in (1..n.saturating_sub(1)).rev() {
            let edges = (along[i] - along[i - 1]).min(along[i + 1] - along[i]);
            let corner = turn(i) > tolerance.corner && edges > tolerance.distance;
            next_corner[i] = if corner { i } else { next_corner[i + 1] };
        }
        Run {
            points,
            along,
            next_corner,
            turned,
            tolerance: tolerance.distance,
            facet: tolerance.facet.max(tolerance.distance),
        }
    }

    /// The farthest end for which `fits` holds, by doubling steps and bisection; at least the next point.
    fn farthest(&self, from: usize, fits: impl Fn(usize, usize) -> bool) -> usize {
        let limit = self.next_corner[from + 1];
        let (mut good, mut step) = (from + 1, 1);
        let mut bad = limit + 1;
        while good < limit {
            let to = (good + step).min(limit);
            if fits(from, to) {
                good = to;
                step *= 2;
            } else {
                bad = to;
                break;
            }
        }
        while bad - good > 1 && bad <= limit {
            let middle = usize::midpoint(good, bad);
            if fits(from, middle) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        good
    }

    fn line(&self, from: usize, to: usize) -> bool {
        let (a, b) = (self.points[from], self.points[to]);
        let length = a.distance(b);
        if length <= self.tolerance {
            return to == from + 1;
        }
        let u = (b - a) / length;
        let mut reached = 0.0;
        self.points[from + 1..to].iter().all(|&p| {
            let (x, y) = ((p - a).dot(u), (p - a).perp_dot(u));
            let on = y.abs() <= self.tolerance && x >= reached && x <= length;
            reached = x;
            on
        })
    }

    /// The middle and the sweep of the arc that fits from `from` to `to`.
    fn arc(&self, from: usize, to: usize) -> Option<(DVec2, f64)> {
        if to < from + 3 {
            return None;
        }
        // half a turn, and half a chord's worth of rounding beyond it
        let turning = self.turned[to - 1] - self.turned[from];
        if turning > PI {
            return None;
        }
        let (a, b) = (self.points[from], self.points[to]);
        let (middle, half) = (0.5 * (a + b), 0.5 * a.distance(b));
        let u = (b - a).try_normalize()?;
        let v = u.perp();
        let local = |p: DVec2| DVec2::new((p - middle).dot(u), (p - middle).dot(v));
        let (mut sum_yz, mut sum_yy) = (0.0, 0.0);
        for &p in &self.points[from + 1..to] {
            let q = local(p);
            sum_yz += q.y * (q.length_squared() - half * half);
            sum_yy += q.y * q.y;
        }
        if sum_yy <= 0.0 {
            return None;
        }
        // the centre, middle + height·v, of a circle through a and b
        let height = sum_yz / (2.0 * sum_yy);
        let radius = half.hypot(height);
        let side = sum_side(&self.points[from + 1..to], local);
        let centre = middle + v * height;
        let via = centre + v * (radius * side);
        // travel is clockwise where the arc bulges to the left of its chord
        let sense = -side;
        let start = (a - centre).to_angle();
        let angle = |p: DVec2| (sense * ((p - centre).to_angle() - start)).rem_euclid(2.0 * PI);
        let sweep = angle(b);
        if !(0.0..=1.05 * PI).contains(&sweep) {
            return None;
        }
        let (mut reached, mut before, mut last) = (0.0, 0.0_f64, a);
        for &p in &self.points[from + 1..=to] {
            let off = (p.distance(centre) - radius).abs();
            let (now, chord) = (angle(p), p.distance(last));
            let sagitta = radius - (radius * radius - 0.25 * chord * chord).max(0.0).sqrt();
            let middle = off.max(before) + sagitta;
            if now <= reached || now > sweep + 1e-9 || off > self.tolerance || middle > self.facet {
                return None;
            }
            (reached, before, last) = (now, off, p);
        }
        Some((via, sweep))
    }

    /// Whether an arc or still a line fits from `from` to `to`: so far nothing speaks against an arc. Points close
    /// together may lie on a line before they tell how the curve bends.
    fn may_be_arc(&self, from: usize, to: usize) -> bool {
        to < from + 3 || self.arc(from, to).is_some() || self.line(from, to)
    }

    fn farthest_arc(&self, from: usize) -> Option<(usize, DVec2)> {
        let limit = self.next_corner[from + 1];
        if limit < from + 3 {
            return None;
        }
        let end = self.farthest(from, |from, to| self.may_be_arc(from, to));
        let (via, sweep) = self.arc(from, end)?;
        (sweep >= SMALLEST_SWEEP).then_some((end, via))
    }

    /// An arc and the one or two lines that it left over, where it swept half a turn or the points end: two arcs of
    /// equal length instead.
    fn take_up(&self, pieces: &mut Vec<(usize, Shape)>) {
        let mut from = 0;
        let mut i = 0;
        while i < pieces.len() {
            let (arc_end, shape) = pieces[i];
            let mut to = arc_end;
            let mut chords = 0;
            while shape != Shape::Line
                && chords < 2
                && let Some(&(end, Shape::Line)) = pieces.get(i + chords + 1)
                && end <= self.next_corner[from + 1]
            {
                to = end;
                chords += 1;
            }
            if chords > 0 {
                let half = 0.5 * (self.along[from] + self.along[to]);
                let middle = self.along.partition_point(|s| *s < half);
                let large = |&(via, sweep): &(DVec2, f64)| {
                    (sweep >= SMALLEST_SWEEP).then_some(Shape::Arc { via })
                };
                let halves = (self.arc(from, middle), self.arc(middle, to));
                if let (Some(a), Some(b)) = halves
                    && let (Some(a), Some(b)) = (large(&a), large(&b))
                {
                    pieces.splice(i..=i + chords, [(middle, a), (to, b)]);
                }
            }
            from = pieces[i].0;
            i += 1;
        }
    }

    /// A line that ran a little into a following arc gives those points back where the arc gets farther for it.
    fn hand_over(&self, from: usize, to: usize) -> usize {
        if self.next_corner[to] == to {
            return to;
        }
        let reach = |k: usize| self.farthest_arc(k).map_or(0, |(end, _)| end);
        let (mut best, mut farthest) = (to, reach(to));
        for k in (from + 1..to).rev().take(3) {
            let end = reach(k);
            if end > farthest {
                (best, farthest) = (k, end);
            }
        }
        best
    }
}

/// On which side of the chord the points lie: +1 left, -1 right.
fn sum_side(points: &[DVec2], local: impl Fn(DVec2) -> DVec2) -> f64 {
    points.iter().map(|&p| local(p).y).sum::<f64>().signum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::arc::Arc;

    const TOLERANCE: Tolerance = Tolerance {
        distance: 0.02,
        facet: 0.02,
        corner: 0.35,
    };

    /// The result as dense points.
    fn dense(start: DVec2, pieces: &[Piece]) -> Vec<DVec2> {
        let mut at = start;
        let mut out = vec![start];
        for piece in pieces {
            match piece.shape {
                Shape::Line => {
                    out.extend((1..=50).map(|i| at.lerp(piece.end, f64::from(i) / 50.0)));
                }
                Shape::Arc { via } => {
                    let arc = Arc::through(at.extend(0.0), via.extend(0.0), piece.end.extend(0.0))
                        .unwrap();
                    out.extend((1..=100).map(|i| arc.at(f64::from(i) / 100.0).truncate()));
                }
            }
            at = piece.end;
        }
        out
    }

    fn to_polyline(p: DVec2, line: &[DVec2]) -> f64 {
        line.windows(2)
            .map(|s| {
                let e = s[1] - s[0];
                let t = ((p - s[0]).dot(e) / e.length_squared().max(1e-300)).clamp(0.0, 1.0);
                p.distance(s[0] + e * t)
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn assert_close(points: &[DVec2], pieces: &[Piece]) {
        let result = dense(points[0], pieces);
        assert_eq!(pieces.last().unwrap().end, *points.last().unwrap());
        for &p in points {
            let off = to_polyline(p, &result);
            assert!(
                off <= TOLERANCE.distance + 1e-3,
                "input {p} is {off} from the result"
            );
        }
        for &p in &result {
            let off = to_polyline(p, points);
            assert!(
                off <= TOLERANCE.distance + 1e-9,
                "result {p} is {off} from the input"
            );
        }
    }

    #[test]
    fn a_slot_is_two_lines_and_two_arcs() {
        let mut points = vec![DVec2::new(0.0, -10.0), DVec2::new(50.0, -10.0)];
        points.extend((1..40).map(|i| {
            DVec2::new(50.0, 0.0) + DVec2::from_angle(PI * (f64::from(i) / 40.0 - 0.5)) * 10.0
        }));
        points.push(DVec2::new(50.0, 10.0));
        points.push(DVec2::new(0.0, 10.0));
        points.extend((1..40).map(|i| DVec2::from_angle(PI * (f64::from(i) / 40.0 + 0.5)) * 10.0));
        points.push(points[0]);
        let pieces = fit(&points, TOLERANCE);
        assert_close(&points, &pieces);
        let arcs = pieces.iter().filter(|p| p.shape != Shape::Line).count();
        assert_eq!((pieces.len(), arcs), (4, 2), "{pieces:?}");
    }

    #[test]
    fn corners_stay_corners() {
        let square: Vec<_> = [
            (0., 0.),
            (10., 0.),
            (20., 0.),
            (20., 20.),
            (0., 20.),
            (0., 0.),
        ]
        .map(|(x, y)| DVec2::new(x, y))
        .to_vec();
        let pieces = fit(&square, TOLERANCE);
        assert_eq!(pieces.len(), 4);
        assert!(pieces.iter().all(|p| p.shape == Shape::Line));
    }

    proptest! {
        #[test]
        fn result_and_polyline_stay_within_tolerance(
            steps in prop::collection::vec((0.05..4.0_f64, -0.9..0.9_f64), 2..60),
            runs in prop::collection::vec((1.0..40.0_f64, -0.12..0.12_f64, 3..40_usize), 0..4),
        ) {
            let mut points = vec![DVec2::ZERO];
            let mut heading = 0.0_f64;
            let mut walk = |length: f64, turn: f64| {
                heading += turn;
                let p = *points.last().unwrap() + DVec2::from_angle(heading) * length;
                points.push(p);
            };
            for &(length, turn) in &steps {
                walk(length, turn);
            }
            for &(radius, turn, n) in &runs {
                for _ in 0..n {
                    walk(radius * turn.abs().max(0.01), turn);
                }
            }
            assert_close(&points, &fit(&points, TOLERANCE));
        }
    }
}
