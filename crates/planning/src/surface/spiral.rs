//! One bead that winds up a wall from pass to pass: the arc is struck once. Ours; flat spirals turn likewise from contour to contour.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::{Segments, nearest_share};

use super::pace::Pace;
use super::pass::{SurfacePass, SurfacePoint};

/// How far the ends of the ramps stay within what speeds lay, shares of it: a stretch of one speed is a mean.
const WITHIN: [f64; 2] = [1.05, 0.97];
/// Rounding of lengths, mm.
const SAME: f64 = 1e-6;
/// Points closer than this are one, mm: no controller plans shorter moves in time.
const CLOSE: f64 = 0.25;

/// Why a wall has no spiral.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpiralError {
    /// A pass with ends.
    #[error("pass {pass} is open, it ends at ({:.3}, {:.3}, {:.3}) mm: a spiral goes round a wall that is closed", .at.x, .at.y, .at.z)]
    Open {
        /// Its number.
        pass: u32,
        /// Where it ends, mm.
        at: DVec3,
    },
    /// A pass in pieces.
    #[error("pass {pass} has {count} pieces, one of them at ({:.3}, {:.3}, {:.3}) mm: one spiral goes round one wall, without branches and windows", .at.x, .at.y, .at.z)]
    Pieces {
        /// Its number.
        pass: u32,
        /// How many.
        count: usize,
        /// Where the second begins, mm.
        at: DVec3,
    },
    /// Nothing to wind from one to the next.
    #[error("the wall has one pass: a spiral takes two")]
    Few,
}

/// The turns of one bead that winds up a wall of closed passes `spacing` mm apart, by number from the base; each begins where the one before
/// ends.
///
/// The first turn lies on the base and rises from the thinnest bead that speeds lay (`pace`), the others on the turn below. At the top the
/// bead stays level, on the turn below that still rises, and ends where it would be thinner than that. Between two passes it goes over
/// from one to the next by the share of the turn that is done, straight along the wall.
///
/// # Errors
/// [`SpiralError`] with the first pass that is not one closed ring.
pub fn wound(
    passes: &[SurfacePass],
    pace: &Pace,
    spacing: f64,
) -> Result<Vec<SurfacePass>, SpiralError> {
    let rings = rings(passes, spacing)?;
    let rise = Rise::new(rings.len(), pace.able(), spacing);
    let foot = |p: &SurfacePoint| p.from.unwrap_or(p.position);
    let base: Vec<DVec3> = rings[0].points.iter().map(foot).collect();
    let mut course = walked(rings, &rise);
    stand(&mut course, &Segments::new([&base[..]], spacing), spacing);
    Ok(turns(&course, pace.shortest))
}

/// How high the bead's top lies along its turns, in passes from the base.
struct Rise {
    /// At its begin and after one turn: from there on it rises by a pass a turn.
    first: [f64; 2],
    /// Where it is level.
    top: f64,
    /// Turns until it is level, and until it ends.
    level: f64,
    end: f64,
}

impl Rise {
    fn new(passes: usize, [thin, thick]: [f64; 2], spacing: f64) -> Self {
        let begin = (WITHIN[0] * thin / spacing).min(1.0);
        let after = (WITHIN[1] * thick / spacing).min(begin + 1.0).max(begin);
        let top = passes as f64;
        let level = top - after + 1.0;
        Rise {
            first: [begin, after],
            top,
            level,
            end: level + 1.0 - begin,
        }
    }

    /// After so many turns.
    fn at(&self, turns: f64) -> f64 {
        let [begin, after] = self.first;
        let rising = if turns < 1.0 {
            begin + (after - begin) * turns
        } else {
            after + turns - 1.0
        };
        rising.min(self.top)
    }

    /// Turns until it lies so high.
    fn until(&self, height: f64) -> f64 {
        let [begin, after] = self.first;
        if height > after {
            height - after + 1.0
        } else if after > begin {
            ((height - begin) / (after - begin)).clamp(0.0, 1.0)
        } else {
            // a bead of one thickness lies level for its first turn
            1.0
        }
    }
}

/// A closed pass, with what is known at each of its points, and of the pass below where it was laid from.
struct Ring {
    /// The first one again at the end.
    points: Vec<SurfacePoint>,
    /// Normal and growth of the pass below.
    below: Vec<[DVec3; 2]>,
    /// Length from the first point on, mm.
    at: Vec<f64>,
}

impl Ring {
    fn new(points: Vec<SurfacePoint>, below: Vec<[DVec3; 2]>) -> Self {
        let mut at = vec![0.0];
        for pair in points.windows(2) {
            let before = at.last().copied().unwrap_or(0.0);
            at.push(before + pair[0].position.distance(pair[1].position));
        }
        Ring { points, below, at }
    }

    fn length(&self) -> f64 {
        self.at.last().copied().unwrap_or(0.0).max(SAME)
    }

    /// The other way round.
    fn reversed(mut self) -> Self {
        self.points.reverse();
        self.below.reverse();
        Ring::new(self.points, self.below)
    }

    /// The bead's place so far along, a share of the way from the pass below.
    fn place(&self, along: f64, share: f64) -> SurfacePoint {
        let last = self.points.len() - 1;
        let i = self.at.partition_point(|a| *a <= along).clamp(1, last) - 1;
        let step = self.at[i + 1] - self.at[i];
        let t = nearest_share((along - self.at[i]) * step, step * step);
        let top = self.points[i].towards(&self.points[i + 1], t);
        let [normal, growth] = [0, 1].map(|k| self.below[i][k].lerp(self.below[i + 1][k], t));
        let from = top.from.unwrap_or(top.position);
        SurfacePoint {
            position: from.lerp(top.position, share),
            normal: normal.lerp(top.normal, share).normalize_or(top.normal),
            growth: growth.lerp(top.growth, share).normalize_or(top.growth),
            from: Some(from),
        }
    }

    /// How far along the place was laid from what is nearest to `p`, and which way it goes there.
    fn over(&self, p: DVec3) -> (f64, DVec3) {
        let foot = |q: &SurfacePoint| q.from.unwrap_or(q.position);
        let near = |i: usize| {
            let [a, b] = [foot(&self.points[i]), foot(&self.points[i + 1])];
            let way = b - a;
            let t = nearest_share((p - a).dot(way), way.length_squared());
            let far = p.distance_squared(a.lerp(b, t));
            (far, self.at[i] + t * (self.at[i + 1] - self.at[i]), i)
        };
        let all = (0..self.points.len() - 1).map(near);
        let best = all.min_by(|a, b| a.0.total_cmp(&b.0));
        let (along, i) = best.map_or((0.0, 0), |b| (b.1, b.2));
        let way = self.points[i + 1].position - self.points[i].position;
        (along, way)
    }
}

/// The passes as rings.
fn rings(passes: &[SurfacePass], spacing: f64) -> Result<Vec<Ring>, SpiralError> {
    let mut rings: Vec<Ring> = Vec::new();
    for group in passes.chunk_by(|a, b| a.number == b.number) {
        let pass = &group[0];
        let place = |p: &SurfacePass| p.points.last().map_or(DVec3::ZERO, |p| p.position);
        if let Some(open) = group.iter().find(|p| !p.is_closed()) {
            return Err(SpiralError::Open {
                pass: pass.number,
                at: place(open),
            });
        }
        if let Some(second) = group.get(1) {
            return Err(SpiralError::Pieces {
                pass: pass.number,
                count: group.len(),
                at: place(second),
            });
        }
        let own = |p: &SurfacePoint| [p.normal, p.growth];
        let below = match rings.last() {
            None => pass.points.iter().map(own).collect(),
            Some(before) => {
                let each: Vec<[DVec3; 2]> = before
                    .points
                    .windows(2)
                    .map(|w| [w[0].position, w[1].position])
                    .collect();
                let near = Segments::new(each.iter().map(|e| &e[..]), spacing);
                let under = |p: &SurfacePoint| {
                    let found = near.nearest(p.from?, spacing)?;
                    before.points.get(found.line as usize).map(own)
                };
                let all = pass.points.iter();
                all.map(|p| under(p).unwrap_or(own(p))).collect()
            }
        };
        rings.push(Ring::new(pass.points.clone(), below));
    }
    if rings.len() < 2 {
        return Err(SpiralError::Few);
    }
    Ok(rings)
}

/// The bead's course with the turns done at each point.
fn walked(rings: Vec<Ring>, rise: &Rise) -> Vec<(f64, SurfacePoint)> {
    let mut rings = (1_u32..).zip(rings).peekable();
    let mut course: Vec<(f64, SurfacePoint)> = Vec::new();
    let (mut turns, mut along) = (0.0, 0.0);
    while let Some((number, ring)) = rings.next() {
        let length = ring.length();
        let until = match rings.peek() {
            Some(_) => rise.until(f64::from(number)),
            None => rise.end,
        };
        let mut emit = |turns: f64, along: f64| {
            let share = (rise.at(turns) - f64::from(number - 1)).clamp(0.0, 1.0);
            let point = ring.place(along, share);
            let far = |last: &(f64, SurfacePoint)| last.1.position.distance(point.position) > CLOSE;
            if course.last().is_none_or(far) {
                course.push((turns, point));
            }
        };
        if number == 1 {
            emit(turns, along);
        }
        while turns < until {
            // to the next point of the pass, the end of a turn, where it is level, or the next pass
            let i = ring.at.partition_point(|a| *a <= along + SAME);
            let corner = ring
                .at
                .get(i)
                .map_or(until, |a| turns + (a - along) / length);
            let whole = turns.floor() + 1.0;
            let level = if turns < rise.level {
                rise.level
            } else {
                until
            };
            let next = corner.min(whole).min(level).min(until);
            along += (next - turns) * length;
            turns = next;
            emit(turns, along);
            if along >= length - SAME {
                along = 0.0;
            }
        }
        if let (Some((_, next)), Some(here)) = (rings.peek_mut(), course.last()) {
            let (there, way) = next.over(here.1.position);
            let before = course.len().checked_sub(2).and_then(|i| course.get(i));
            let heading = before.map_or(DVec3::ZERO, |b| here.1.position - b.1.position);
            along = there;
            if heading.dot(way) < 0.0 {
                let whole = next.length();
                let none = Ring::new(Vec::new(), Vec::new());
                *next = std::mem::replace(next, none).reversed();
                along = whole - there;
            }
        }
    }
    course
}

/// Each point on what is below it: the base along the first turn, from there on the nearest place of the turn before.
fn stand(course: &mut [(f64, SurfacePoint)], base: &Segments, spacing: f64) {
    let places: Vec<(f64, DVec3)> = course.iter().map(|c| (c.0, c.1.position)).collect();
    let first = |turns: f64| places.partition_point(|p| p.0 < turns);
    for (turns, point) in course {
        if *turns <= 1.0 {
            let near = base.nearest(point.position, 10.0 * spacing);
            point.from = near.map(|n| n.point).or(point.from);
            continue;
        }
        let [from, to] = [*turns - 1.25, *turns - 0.75].map(first);
        let under = &places[from.saturating_sub(1)..(to + 1).min(places.len())];
        let near = |pair: &[(f64, DVec3)]| {
            let way = pair[1].1 - pair[0].1;
            let off = point.position - pair[0].1;
            pair[0].1 + nearest_share(off.dot(way), way.length_squared()) * way
        };
        let all = under.windows(2).map(near);
        let far = |p: &DVec3| p.distance_squared(point.position);
        point.from = all.min_by(|a, b| far(a).total_cmp(&far(b))).or(point.from);
    }
}

/// The course turn by turn; a last one shorter than `least` mm belongs to the one before.
fn turns(course: &[(f64, SurfacePoint)], least: f64) -> Vec<SurfacePass> {
    let mut turns: Vec<SurfacePass> = Vec::new();
    for (done, point) in course {
        let number = (done.ceil() as u32).max(1);
        match turns.last_mut() {
            Some(turn) if turn.number == number => turn.points.push(*point),
            last => {
                let begin = last.and_then(|turn| turn.points.last().copied());
                turns.push(SurfacePass {
                    number,
                    points: begin.into_iter().chain([*point]).collect(),
                });
            }
        }
    }
    if turns.len() > 1 && turns.last().is_some_and(|t| t.length() < least) {
        let last = turns.pop().map_or(Vec::new(), |t| t.points);
        if let Some(turn) = turns.last_mut() {
            turn.points.extend(last.into_iter().skip(1));
        }
    }
    turns
}
