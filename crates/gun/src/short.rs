//! Ends and corners of lines that the beam does not come to, because it is behind.

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::MotionBlock;

use crate::stretch::Stretch;

/// Lags after the command's corner within which the beam comes nearest to it: slow lines behind fast ones draw the rest of them.
const ARRIVES: f64 = 6.0;

/// Lines that are not drawn to their ends: where the beam goes off farther from the end than half the spot, or turns into the next line
/// without coming that near to the corner. What lies between is not drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Short {
    /// So many; corners of one path that are no farther apart than a spot are one.
    pub lines: usize,
    /// The longest way from the beam to such an end, mm.
    pub farthest: f64,
    /// The first one, mm.
    pub first: Option<[f64; 2]>,
    /// The least spot of them, mm.
    pub spot: f64,
}

/// What `drawn` leaves out of the lit lines of `asked`, by a deflection that is `lag` s behind.
pub(crate) fn short(asked: &[Stretch], drawn: &MotionBlock, lag: f64) -> Short {
    let mut found = Short::default();
    if lag <= 0.0 || drawn.is_empty() {
        return found;
    }
    let mut beam = Beam { drawn, next: 0 };
    let mut begin = 0;
    while begin < asked.len() {
        let lit = asked[begin..].iter().take_while(|s| s.is_lit()).count();
        run(&mut found, &asked[begin..begin + lit], &mut beam, lag);
        begin += lit.max(1);
    }
    found
}

/// Lines that are joined, the beam on all along.
fn run(found: &mut Short, lines: &[Stretch], beam: &mut Beam<'_>, lag: f64) {
    let Some(end) = lines.last().map(Stretch::end) else {
        return;
    };
    // path since the last corner that was counted
    let mut since = f64::INFINITY;
    for (n, line) in lines.iter().enumerate() {
        since += line.from.distance(line.to);
        let way = if n + 1 == lines.len() {
            beam.at(end).distance(line.to)
        } else {
            // not the beginning of the line: there and back again, that is where the one before may be drawn still
            let from = line.end() - lag.min(0.5 * line.takes);
            let to = end.min(line.end() + ARRIVES * lag);
            beam.nearest(line.to, [from, to])
        };
        if way <= 0.5 * line.spot {
            continue;
        }
        if since > line.spot {
            found.lines += 1;
        }
        since = 0.0;
        let first = found.first.is_none();
        found.spot = if first {
            line.spot
        } else {
            found.spot.min(line.spot)
        };
        found.farthest = found.farthest.max(way);
        found.first.get_or_insert(line.to.to_array());
    }
}

/// Looks along the drawn beam, times ever later.
struct Beam<'a> {
    drawn: &'a MotionBlock,
    /// The first point that is not before the time that was asked for last.
    next: usize,
}

impl Beam<'_> {
    fn point(&self, n: usize) -> DVec2 {
        self.drawn.position[n].truncate()
    }

    fn seek(&mut self, time: f64) {
        while self.next + 1 < self.drawn.len() && self.drawn.time(self.next) < time {
            self.next += 1;
        }
    }

    /// Where it is at `time` s, between the points about `n`.
    fn between(&self, n: usize, time: f64) -> DVec2 {
        if n == 0 {
            return self.point(0);
        }
        let [before, after] = [n - 1, n].map(|n| self.drawn.time(n));
        let share = (time - before) / (after - before);
        let share = if share.is_finite() {
            share.clamp(0.0, 1.0)
        } else {
            1.0
        };
        self.point(n - 1).lerp(self.point(n), share)
    }

    fn at(&mut self, time: f64) -> DVec2 {
        self.seek(time);
        self.between(self.next, time)
    }

    /// How near it comes to `place` in a span of time, mm.
    fn nearest(&mut self, place: DVec2, [from, to]: [f64; 2]) -> f64 {
        let mut last = self.at(from);
        let mut nearest = last.distance(place);
        let mut n = self.next;
        loop {
            let ends = n + 1 >= self.drawn.len() || self.drawn.time(n) >= to;
            let here = if ends {
                self.between(n, to)
            } else {
                self.point(n)
            };
            nearest = nearest.min(distance(place, [last, here]));
            if ends {
                return nearest;
            }
            last = here;
            n += 1;
        }
    }
}

/// Distance of `place` from a straight piece, mm.
fn distance(place: DVec2, [from, to]: [DVec2; 2]) -> f64 {
    let along = to - from;
    let square = along.length_squared();
    if square == 0.0 {
        return place.distance(from);
    }
    let share = ((place - from).dot(along) / square).clamp(0.0, 1.0);
    place.distance(from + share * along)
}
