//! What is round along a line, and how near it comes to lines, faces and boxes: exact, ends flat or round.

use meltpath_geometry::math::DVec3;

use super::distance::{Bounds, Segment, between, least_along};

/// How far below something sides of a box are looked at that lie at infinity, mm.
const DEEP: f64 = 100.0;

/// How exactly the least distance along a segment is found, mm.
const EXACT: f64 = 1e-11;
/// Places of a segment that are looked at for it, at most.
const STEPS: u32 = 100;

/// How much a radius counts where something round with flat ends turns: followed without its turn about its line, a point beside the line
/// bends by that of the line and by that of its direction, each a radius at most.
pub(super) const BESIDE: f64 = 2.0;

/// How what is round ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ends {
    /// Half balls beyond the ends of its line.
    Round,
    /// Planes at the ends of its line.
    Flat,
}

/// A line with a radius around it, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Round {
    pub(super) line: Segment,
    pub(super) radius: f64,
    pub(super) ends: Ends,
}

impl Round {
    /// The same along another line.
    pub(super) fn along(self, line: Segment) -> Self {
        Round { line, ..self }
    }

    /// From the line's end to its begin, of unit length; zero for a point.
    fn ahead(&self) -> DVec3 {
        (self.line.a - self.line.b).normalize_or_zero()
    }

    /// How far beside its line what turns with it lies, mm: a ball stays as it is.
    fn beside(&self) -> f64 {
        match self.ends {
            Ends::Round => 0.0,
            Ends::Flat => self.radius,
        }
    }

    /// How far its points go at most from one place to another, straight, mm. It may turn about its line: that moves nothing of it.
    pub(super) fn gone(&self, to: &Round) -> f64 {
        let turned = self.ahead().distance(to.ahead());
        self.line.gone(&to.line) + self.beside() * turned
    }

    /// The lever about a point with which it bends away from its chord where it turns, mm: of its line, and beside that of what lies around
    /// flat ends.
    pub(super) fn lever_about(&self, p: DVec3) -> f64 {
        self.line.a.distance(p).max(self.line.b.distance(p)) + BESIDE * self.beside()
    }

    /// The distance of a point, mm; below zero inside, by how deep it lies.
    fn to_point(self, p: DVec3) -> f64 {
        if self.ends == Ends::Round {
            return between(&self.line, &Segment { a: p, b: p }) - self.radius;
        }
        let (ahead, from) = (self.ahead(), p - self.line.a);
        let along = from.dot(ahead);
        let aside = (from - along * ahead).length() - self.radius;
        let beyond = along.max(-along - self.line.a.distance(self.line.b));
        if aside > 0.0 && beyond > 0.0 {
            (aside * aside + beyond * beyond).sqrt()
        } else {
            aside.max(beyond)
        }
    }

    /// The point that lies farthest in a direction, of it if its ends are flat, else of its line.
    pub(super) fn foremost(&self, direction: DVec3) -> DVec3 {
        let Segment { a, b } = self.line;
        let end = if a.dot(direction) >= b.dot(direction) {
            a
        } else {
            b
        };
        match self.ends {
            Ends::Round => end,
            Ends::Flat => {
                let ahead = self.ahead();
                let aside = direction - direction.dot(ahead) * ahead;
                // along its line nothing beside it is farther: what is left is rounding
                let none = aside.length() < 1e-7;
                end + if none {
                    DVec3::ZERO
                } else {
                    self.radius * aside.normalize()
                }
            }
        }
    }

    /// The distance of a segment, mm, where it is less than `most`; else no less than `most`. Below zero where it goes through.
    pub(super) fn to_segment(self, segment: &Segment, most: f64) -> f64 {
        match self.ends {
            Ends::Round => between(&self.line, segment) - self.radius,
            Ends::Flat => self.flat_to_segment(segment, most),
        }
    }

    /// The same with flat ends. That of its points is convex along it: its tangents at two places bound what is between, and the place where it
    /// no longer falls is looked for by secants and where the tangents meet.
    fn flat_to_segment(self, segment: &Segment, most: f64) -> f64 {
        let along = Along::of(&self, segment);
        let ([mut low, mut high], best) = {
            let ends = [0.0, 1.0].map(|t| along.at(t));
            (ends, ends[0].distance.min(ends[1].distance))
        };
        let (mut best, mut pull) = (best, [low.growth, high.growth]);
        for step in 0..STEPS {
            if best <= 0.0 {
                // how deep it lies is another function
                let at = |t: f64| self.to_point(segment.a.lerp(segment.b, t));
                return least_along(at).min(best);
            }
            if low.growth >= 0.0 || high.growth <= 0.0 {
                return best;
            }
            let [a, b] = [low, high].map(|p| p.distance - p.growth * p.t);
            let meet = (b - a) / (low.growth - high.growth);
            let bound = a + low.growth * meet;
            if bound >= most || best - bound <= EXACT {
                return best;
            }
            let secant = low.t + (high.t - low.t) * pull[0] / (pull[0] - pull[1]);
            let t = if step % 3 == 2 { meet } else { secant };
            if t <= low.t || t >= high.t {
                return best;
            }
            let new = along.at(t);
            best = best.min(new.distance);
            // an end that stays draws less and less, or the other would creep
            if new.growth <= 0.0 {
                (low, pull) = (new, [new.growth, 0.5 * pull[1]]);
            } else {
                (high, pull) = (new, [0.5 * pull[0], new.growth]);
            }
        }
        best
    }

    /// No more than the distance of a segment, mm.
    pub(super) fn at_least_to_segment(&self, segment: &Segment) -> f64 {
        let aside = between(&self.line, segment) - self.radius;
        if self.ends == Ends::Round {
            return aside;
        }
        let ahead = self.ahead();
        let beyond = |p: DVec3| (p - self.line.a).dot(ahead);
        aside.max(beyond(segment.a).min(beyond(segment.b)))
    }

    /// No more than the distance of a box, mm.
    pub(super) fn at_least_to(&self, bounds: &Bounds) -> f64 {
        (bounds.at_least_athwart(&self.line) - self.radius).max(self.beyond(bounds))
    }

    /// How far a box lies beyond the flat end ahead, mm; no more than its distance.
    fn beyond(&self, bounds: &Bounds) -> f64 {
        if self.ends == Ends::Round {
            return f64::NEG_INFINITY;
        }
        let (ahead, from) = (self.ahead(), self.line.a);
        let of = |i: usize| {
            let side = if ahead[i] > 0.0 {
                bounds.low
            } else {
                bounds.high
            };
            // what lies at infinity athwart is no nearer
            if ahead[i] == 0.0 {
                0.0
            } else {
                ahead[i] * (side[i] - from[i])
            }
        };
        of(0) + of(1) + of(2)
    }

    /// No more than the distance of a box, mm, and nearer to it than [`Round::at_least_to`]: with round ends it is the distance.
    pub(super) fn nearly_to(&self, bounds: Bounds) -> f64 {
        (bounds.to_segment(&self.line) - self.radius).max(self.beyond(&bounds))
    }

    /// The distance of a box, mm, where it is less than `most`; else no less than `most`. Zero or less where they touch.
    pub(super) fn to_box(self, bounds: Bounds, most: f64) -> f64 {
        let least = self.nearly_to(bounds);
        if self.ends == Ends::Round || least >= most {
            return least;
        }
        let Segment { a, b } = self.line;
        let near = a.min(b) - DVec3::splat(self.radius + DEEP);
        let (low, high) = (bounds.low.max(near.min(bounds.high)), bounds.high);
        let corner = |n: [bool; 3]| {
            DVec3::from_array(std::array::from_fn(|i| if n[i] { high[i] } else { low[i] }))
        };
        let face = |axis: usize, up: bool| {
            let around = [[false, false], [true, false], [true, true], [false, true]];
            around.map(|[u, v]| {
                let mut of = [up; 3];
                (of[(axis + 1) % 3], of[(axis + 2) % 3]) = (u, v);
                corner(of)
            })
        };
        let faces = (0..3).flat_map(|axis| [false, true].map(|up| face(axis, up)));
        let least = faces.fold(most, |least, face| least.min(self.to_face(&face, least)));
        let holds = (low - a).max(a - high).max_element() <= 0.0;
        if holds { least.min(0.0) } else { least }
    }

    /// The distance of a flat convex face, mm, where it is less than `most`; else no less than `most`. Zero or less where they touch.
    pub(super) fn to_face(self, corners: &[DVec3], most: f64) -> f64 {
        let sides = || {
            let next = corners.iter().cycle().skip(1);
            corners
                .iter()
                .zip(next)
                .map(|(a, b)| Segment { a: *a, b: *b })
        };
        let least = sides().fold(most, |least, side| {
            if self.at_least_to_segment(&side) >= least {
                return least;
            }
            least.min(self.to_segment(&side, least))
        });
        let &[a, b, c, ..] = corners else {
            return least;
        };
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal == DVec3::ZERO {
            return least;
        }
        // else it is nearest within the face, and there foremost
        let radius = self.radius - self.beside();
        let [up, down] = [normal, -normal].map(|n| self.foremost(n));
        let [over, under] = [up, down].map(|p| (p - a).dot(normal));
        let (foot, height) = if under >= 0.0 {
            (down, under)
        } else if over <= 0.0 {
            (up, -over)
        } else {
            // as deep as it must go back
            (down.lerp(up, under / (under - over)), -over.min(-under))
        };
        let within = sides().all(|s| (s.b - s.a).cross(foot - s.a).dot(normal) >= 0.0);
        if within {
            least.min(height - radius)
        } else {
            least
        }
    }

    /// The distance of another, mm, where it is less than `most`; else no less than `most`. Of two with flat ends no more than it.
    pub(super) fn apart(&self, other: &Round, most: f64) -> f64 {
        let of = |one: &Round, other: &Round| {
            one.to_segment(&other.line, most + other.radius) - other.radius
        };
        match (self.ends, other.ends) {
            (Ends::Flat, Ends::Flat) => of(self, other).max(of(other, self)),
            (Ends::Flat, Ends::Round) => of(self, other),
            (Ends::Round, _) => of(other, self),
        }
    }
}

/// The way of a segment past something with flat ends, seen from its end ahead: along its line and beside it.
struct Along {
    length: f64,
    radius: f64,
    ahead: [f64; 2],
    aside: [DVec3; 2],
}

/// A place of a segment, as a share of it, its distance, mm, and how fast that grows along the segment.
#[derive(Clone, Copy)]
struct Passed {
    t: f64,
    distance: f64,
    growth: f64,
}

impl Along {
    fn of(round: &Round, segment: &Segment) -> Self {
        let ahead = round.ahead();
        let part = |v: DVec3| {
            let along = v.dot(ahead);
            (along, v - along * ahead)
        };
        let (from, way) = (part(segment.a - round.line.a), part(segment.b - segment.a));
        Along {
            length: round.line.a.distance(round.line.b),
            radius: round.radius,
            ahead: [from.0, way.0],
            aside: [from.1, way.1],
        }
    }

    /// At a share of the segment. Inside the growth is none.
    fn at(&self, t: f64) -> Passed {
        let ahead = self.ahead[0] + t * self.ahead[1];
        let beside = self.aside[0] + t * self.aside[1];
        let out = beside.length();
        let aside = out - self.radius;
        let (beyond, leaves) = if ahead >= -0.5 * self.length {
            (ahead, self.ahead[1])
        } else {
            (-ahead - self.length, -self.ahead[1])
        };
        let spreads = || beside.dot(self.aside[1]) / out;
        let (distance, growth) = match (aside > 0.0, beyond > 0.0) {
            (true, true) => {
                let far = (aside * aside + beyond * beyond).sqrt();
                (far, (aside * spreads() + beyond * leaves) / far)
            }
            (true, false) => (aside, spreads()),
            (false, true) => (beyond, leaves),
            (false, false) => (aside.max(beyond), 0.0),
        };
        Passed {
            t,
            distance,
            growth,
        }
    }
}

#[cfg(test)]
mod tests {
    use meltpath_numerics::random::Random;

    use super::*;

    fn point(random: &mut Random) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| random.between(-10.0, 10.0)))
    }

    fn flat(random: &mut Random) -> Round {
        Round {
            line: Segment {
                a: point(random),
                b: point(random),
            },
            radius: random.between(0.3, 6.0),
            ends: Ends::Flat,
        }
    }

    /// Alternating projections between two convex bodies: from a point of one to the nearest of the other and back, until they rest.
    fn alternately(
        from: DVec3,
        one: impl Fn(DVec3) -> DVec3,
        other: impl Fn(DVec3) -> DVec3,
    ) -> f64 {
        let mut at = from;
        for _ in 0..20_000 {
            let next = one(other(at));
            if next.distance_squared(at) < 1e-22 {
                break;
            }
            at = next;
        }
        other(at).distance(at)
    }

    /// The point of a flat one nearest to another.
    fn onto(round: &Round, p: DVec3) -> DVec3 {
        let (ahead, from) = (round.ahead(), p - round.line.a);
        let along = from.dot(ahead);
        let length = round.line.a.distance(round.line.b);
        round.line.a
            + along.clamp(-length, 0.0) * ahead
            + (from - along * ahead).clamp_length_max(round.radius)
    }

    /// Against alternating projections, of boxes, of one without a bottom, and of lines.
    #[test]
    fn flat_ends_are_as_far_as_projections_say() {
        let mut random = Random::new(8);
        let mut touching = 0;
        for n in 0..3000 {
            let round = flat(&mut random);
            let (p, q) = (2.0 * point(&mut random), 2.0 * point(&mut random));
            let mut bounds = Bounds {
                low: p.min(q),
                high: p.max(q),
            };
            if n % 3 == 0 {
                bounds.low.z = f64::NEG_INFINITY;
            }
            let into_box = |p: DVec3| p.clamp(bounds.low, bounds.high);
            let wanted = alternately(p, |p| onto(&round, p), into_box);
            let found = round.to_box(bounds, 1e9);
            let (told, low) = (found.max(0.0), round.at_least_to(&bounds));
            assert!((told - wanted).abs() < 2e-3, "{found} for {wanted}");
            assert!(low.max(0.0) <= wanted + 2e-3, "{low} for {wanted}");
            assert!(round.nearly_to(bounds).max(0.0) <= wanted + 2e-3);
            touching += u32::from(found <= 0.0);
            let line = Segment { a: p, b: q };
            let into_line = |x: DVec3| {
                let share = (x - p).dot(q - p) / (q - p).length_squared();
                p.lerp(q, share.clamp(0.0, 1.0))
            };
            let wanted = alternately(p, |p| onto(&round, p), into_line);
            let found = round.to_segment(&line, f64::INFINITY);
            assert!((found.max(0.0) - wanted).abs() < 2e-3, "{found} {wanted}");
            assert!(round.at_least_to_segment(&line) <= found + 1e-9);
        }
        assert!((300..2700).contains(&touching), "{touching}");
    }

    /// A nozzle that pierces a face, or stands over its middle, touches no side of it.
    #[test]
    fn faces_are_near_within_their_sides_too() {
        let face = [[-50.0, -50.0], [50.0, -50.0], [0.0, 60.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let lean = DVec3::new(0.6, 0.0, 0.8);
        let at = |z: f64| Round {
            line: Segment {
                a: z * DVec3::Z,
                b: z * DVec3::Z + 70.0 * lean,
            },
            radius: 10.0,
            ends: Ends::Flat,
        };
        // the rim lies lower than the middle of the end
        for (z, wanted) in [(20.0, 14.0), (6.0, 0.0), (3.0, -3.0), (-30.0, -32.0)] {
            let found = at(z).to_face(&face, 1e9);
            assert!((found - wanted).abs() < 1e-9, "{found} for {wanted}");
        }
        assert!(at(20.0).to_face(&face, 3.0) >= 3.0);
        // upright but for rounding
        for tilt in [0.0, 1e-17, -3e-16, 1e-12] {
            let line = Segment {
                a: 20.0 * DVec3::Z,
                b: DVec3::new(70.0 * tilt, -tilt, 90.0),
            };
            let found = at(20.0).along(line).to_face(&face, 1e9);
            assert!((found - 20.0).abs() < 1e-6, "{found}");
        }
    }

    /// A point of it goes no farther from place to place than is told, but for turns about its line.
    #[test]
    fn nothing_goes_farther_than_is_told() {
        let mut random = Random::new(2);
        for _ in 0..300 {
            let from = flat(&mut random);
            let moved = |random: &mut Random, p: DVec3| p + 0.2 * point(random);
            let to = from.along(Segment {
                a: moved(&mut random, from.line.a),
                b: moved(&mut random, from.line.b),
            });
            let gone = from.gone(&to);
            for _ in 0..30 {
                let p = onto(&to, 3.0 * point(&mut random));
                assert!(from.to_point(p) <= gone + 1e-9);
            }
        }
    }
}
