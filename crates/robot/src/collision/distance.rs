//! Distances of line segments from each other and from boxes.

use meltpath_geometry::math::DVec3;

/// A line from one end to the other, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub(super) a: DVec3,
    pub(super) b: DVec3,
}

impl Segment {
    /// How far its points go at most from one place to another, straight, mm.
    pub(super) fn gone(&self, to: &Segment) -> f64 {
        self.a.distance(to.a).max(self.b.distance(to.b))
    }
}

/// A box along the axes; its sides may lie at infinity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

/// Steps of the search along a segment: the golden section of its length to 1e-8 of it.
const STEPS: u32 = 38;

impl Bounds {
    /// The distance of a point, mm; zero inside.
    fn to_point(self, p: DVec3) -> f64 {
        (self.low - p).max(p - self.high).max(DVec3::ZERO).length()
    }

    /// No more than the distance of a segment, mm.
    pub(super) fn at_least_to(&self, segment: &Segment) -> f64 {
        let (low, high) = (segment.a.min(segment.b), segment.a.max(segment.b));
        (self.low - high)
            .max(low - self.high)
            .max(DVec3::ZERO)
            .length()
    }

    /// The same, nearer to the distance for a segment that lies athwart the axes; of a box whose sides lie nowhere at infinity.
    pub(super) fn at_least_athwart(&self, segment: &Segment) -> f64 {
        let (centre, half) = (0.5 * (self.low + self.high), 0.5 * (self.high - self.low));
        let way = segment.b - segment.a;
        let share = (centre - segment.a).dot(way) / way.length_squared().max(POINT);
        let from = segment.a + share.clamp(0.0, 1.0) * way;
        self.at_least_to(segment)
            .max(centre.distance(from) - half.length())
    }

    /// The distance of a segment, mm: exact. The square of that of its points is convex along it, and of the second degree between the places
    /// where it passes the planes of the box's sides.
    pub(super) fn to_segment(self, segment: &Segment) -> f64 {
        let way = segment.b - segment.a;
        let at = |t: f64| segment.a.lerp(segment.b, t);
        // how fast half the square grows along it
        let growth = |t: f64| {
            let p = at(t);
            way.dot(p - p.clamp(self.low, self.high))
        };
        let ends = self.to_point(segment.a).min(self.to_point(segment.b));
        let (mut low, mut high) = ((0.0, growth(0.0)), (1.0, growth(1.0)));
        if low.1 >= 0.0 || high.1 <= 0.0 || ends <= self.at_least_to(segment) {
            return ends;
        }
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for i in 0..3 {
            if way[i] == 0.0 {
                let beside = segment.a[i] < self.low[i] || segment.a[i] > self.high[i];
                enter = if beside { f64::INFINITY } else { enter };
                continue;
            }
            let sides = [self.low[i], self.high[i]].map(|side| (side - segment.a[i]) / way[i]);
            enter = enter.max(sides[0].min(sides[1]));
            leave = leave.min(sides[0].max(sides[1]));
            for t in sides {
                if t > low.0 && t < high.0 {
                    match growth(t) {
                        here if here <= 0.0 => low = (t, here),
                        here => high = (t, here),
                    }
                }
            }
        }
        if enter <= leave {
            return 0.0;
        }
        // nothing is passed between these: it grows evenly
        let share = low.1 / (low.1 - high.1);
        let least = low.0 + (high.0 - low.0) * share.clamp(0.0, 1.0);
        self.to_point(at(least)).min(ends)
    }
}

/// The least of a convex function between zero and one, by sections: that of the points which are looked at, so that zero on a stretch is zero,
/// where the middle of what is left in the end may lie beside it.
pub(super) fn least_along(at: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (0.0, 1.0);
    let (mut s, mut t) = (1.0 - GOLDEN, GOLDEN);
    let (mut at_s, mut at_t) = (at(s), at(t));
    for _ in 0..STEPS {
        if at_s <= at_t {
            (high, t, at_t) = (t, s, at_s);
            s = high - GOLDEN * (high - low);
            at_s = at(s);
        } else {
            (low, s, at_s) = (s, t, at_t);
            t = low + GOLDEN * (high - low);
            at_t = at(t);
        }
    }
    at_s.min(at_t)
}

/// The square of a length that is none, mm².
const POINT: f64 = 1e-18;

/// The distance of two segments, mm. Source: C. Ericson, Real-Time Collision Detection, 2005, 5.1.9.
pub(super) fn between(p: &Segment, q: &Segment) -> f64 {
    let (d1, d2, r) = (p.b - p.a, q.b - q.a, p.a - q.a);
    let (a, e, f) = (d1.length_squared(), d2.length_squared(), d2.dot(r));
    let (s, t) = if a <= POINT && e <= POINT {
        (0.0, 0.0)
    } else if a <= POINT {
        (0.0, (f / e).clamp(0.0, 1.0))
    } else {
        let c = d1.dot(r);
        if e <= POINT {
            ((-c / a).clamp(0.0, 1.0), 0.0)
        } else {
            let b = d1.dot(d2);
            let across = a * e - b * b;
            let s = if across > 1e-12 * a * e {
                ((b * f - c * e) / across).clamp(0.0, 1.0)
            } else {
                0.0
            };
            match (b * s + f) / e {
                t if t < 0.0 => ((-c / a).clamp(0.0, 1.0), 0.0),
                t if t > 1.0 => (((b - c) / a).clamp(0.0, 1.0), 1.0),
                t => (s, t),
            }
        }
    };
    (p.a + d1 * s).distance(q.a + d2 * t)
}

#[cfg(test)]
mod tests {
    use meltpath_numerics::random::Random;

    use super::*;

    fn point(random: &mut Random) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| random.between(-10.0, 10.0)))
    }

    fn segment(random: &mut Random) -> Segment {
        Segment {
            a: point(random),
            b: point(random),
        }
    }

    fn points(s: &Segment) -> impl Iterator<Item = DVec3> + '_ {
        (0..=400).map(|i| s.a.lerp(s.b, f64::from(i) / 400.0))
    }

    /// A point, a parallel line before, behind or beside it, or one that crosses or ends somewhere else.
    fn beside(p: &Segment, random: &mut Random, kind: usize) -> Segment {
        let a = point(random);
        let along = random.between(-3.0, 3.0) * (p.b - p.a);
        match kind {
            0 => Segment { a, b: a },
            1 => Segment { a, b: a + along },
            2 => Segment {
                a: p.a + along,
                b: p.b + along,
            },
            _ => segment(random),
        }
    }

    /// Against the nearest of many points of them.
    #[test]
    fn distances_are_those_of_many_points() {
        let mut random = Random::new(3);
        for n in 0..400 {
            let p = segment(&mut random);
            let q = beside(&p, &mut random, n % 5);
            // the same either way round
            let (p, q) = if n % 2 == 0 { (p, q) } else { (q, p) };
            let sampled = points(&p)
                .map(|x| {
                    points(&q)
                        .map(|y| x.distance(y))
                        .fold(f64::INFINITY, f64::min)
                })
                .fold(f64::INFINITY, f64::min);
            let found = between(&p, &q);
            assert!(
                found <= sampled + 1e-9 && sampled - found < 0.1,
                "{found} {sampled}"
            );
            let (a, b) = (point(&mut random), point(&mut random));
            let mut bounds = Bounds {
                low: a.min(b),
                high: a.max(b),
            };
            bounds.low.z = f64::NEG_INFINITY;
            let sampled = points(&p)
                .map(|x| bounds.to_point(x))
                .fold(f64::INFINITY, f64::min);
            let found = bounds.to_segment(&p);
            assert!(
                found <= sampled + 1e-9 && sampled - found < 0.1,
                "{found} {sampled}"
            );
            assert!(bounds.at_least_to(&p) <= found + 1e-9);
            bounds.low.z = a.z.min(b.z);
            assert!(bounds.at_least_athwart(&p) <= bounds.to_segment(&p) + 1e-9);
        }
    }
}
