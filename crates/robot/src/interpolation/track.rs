//! One piece of nominal motion at constant speed, with its exact time integrals over a sampling interval.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;

/// The shape of a piece. Tool axes use the same shapes: a turn of the axis is an arc on the unit sphere.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Shape {
    /// Stays.
    Hold(DVec3),
    /// From a point along a vector.
    Line { from: DVec3, along: DVec3 },
    /// Round a circle.
    Arc(Arc),
}

/// The integrals of a piece over a part of one sampling interval, in units of the interval: ∫ Q dx and ∫ x Q dx, where x runs
/// from 0 at the interval's start to 1 at its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moments {
    pub(crate) zeroth: DVec3,
    pub(crate) first: DVec3,
}

impl Moments {
    pub(crate) const ZERO: Moments = Moments {
        zeroth: DVec3::ZERO,
        first: DVec3::ZERO,
    };

    pub(crate) fn add(&mut self, other: Moments) {
        self.zeroth += other.zeroth;
        self.first += other.first;
    }
}

impl Shape {
    /// The turn of a unit tool axis, by the shortest way; opposite axes turn about any perpendicular.
    pub(crate) fn turn(from: DVec3, to: DVec3) -> Shape {
        let normal = from.cross(to);
        let sweep = normal.length().atan2(from.dot(to));
        if sweep < 1e-12 {
            return Shape::Hold(to);
        }
        let normal = normal
            .try_normalize()
            .filter(|_| sweep < std::f64::consts::PI - 1e-9)
            .unwrap_or_else(|| from.any_orthonormal_vector());
        Shape::Arc(Arc {
            centre: DVec3::ZERO,
            u: from,
            v: normal.cross(from),
            radius: 1.0,
            sweep,
        })
    }

    /// Direction of travel at the start; `None` where nothing moves.
    pub(crate) fn start_tangent(&self) -> Option<DVec3> {
        match self {
            Shape::Hold(_) => None,
            Shape::Line { along, .. } => along.try_normalize(),
            Shape::Arc(arc) => Some(arc.tangent(0.0)),
        }
    }

    /// Direction of travel at the end; `None` where nothing moves.
    pub(crate) fn end_tangent(&self) -> Option<DVec3> {
        match self {
            Shape::Arc(arc) => Some(arc.tangent(1.0)),
            Shape::Hold(_) | Shape::Line { .. } => self.start_tangent(),
        }
    }

    /// The place at a share of the piece.
    pub(crate) fn at(&self, share: f64) -> DVec3 {
        match self {
            Shape::Hold(place) => *place,
            Shape::Line { from, along } => from + along * share,
            Shape::Arc(arc) => arc.at(share),
        }
    }

    /// Length, mm.
    pub(crate) fn length(&self) -> f64 {
        match self {
            Shape::Hold(_) => 0.0,
            Shape::Line { along, .. } => along.length(),
            Shape::Arc(arc) => arc.length(),
        }
    }

    /// Moments over the part `[x0, x1]` of a sampling interval; `middle` is the share of the piece at the middle of that part,
    /// `rate` the share of the piece per interval.
    #[inline]
    pub(crate) fn moments(&self, x0: f64, x1: f64, middle: f64, rate: f64) -> Moments {
        let (w, x) = (x1 - x0, 0.5 * (x0 + x1));
        match *self {
            Shape::Hold(p) => Moments {
                zeroth: p * w,
                first: p * (w * x),
            },
            Shape::Line { from, along } => {
                let zeroth = (from + along * middle) * w;
                Moments {
                    zeroth,
                    first: zeroth * x + along * (rate * w * w * w / 12.0),
                }
            }
            Shape::Arc(arc) => {
                let (sin, cos) = (middle * arc.sweep).sin_cos();
                let out = arc.u * cos + arc.v * sin;
                let tangent = arc.v * cos - arc.u * sin;
                let half = 0.5 * arc.sweep * rate * w;
                let (even, odd) = circular_means(half);
                let zeroth = (arc.centre + out * (arc.radius * even)) * w;
                Moments {
                    zeroth,
                    first: zeroth * x + tangent * (arc.radius * odd * w * w),
                }
            }
        }
    }
}

/// Over an arc of half angle h: the mean of cos, `sin h / h`, and of `y sin(2 h y)` for y from -1/2 to 1/2,
/// `(sin h - h cos h) / (2 h²)`.
#[inline]
fn circular_means(h: f64) -> (f64, f64) {
    if h.abs() < 0.05 {
        // series to rounding: the closed form of the second cancels
        let s = h * h;
        let even = 1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0));
        let odd = h / 6.0 * (1.0 - s / 10.0 * (1.0 - s / 28.0 * (1.0 - s / 54.0)));
        (even, odd)
    } else {
        let (sin, cos) = h.sin_cos();
        (sin / h, (sin - h * cos) / (2.0 * h * h))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Brute-force moments by the midpoint rule.
    fn brute(at: impl Fn(f64) -> DVec3, x0: f64, x1: f64) -> Moments {
        let n = 100_000;
        let mut m = Moments::ZERO;
        for i in 0..n {
            let x = x0 + (x1 - x0) * (f64::from(i) + 0.5) / f64::from(n);
            let q = at(x) * ((x1 - x0) / f64::from(n));
            m.add(Moments {
                zeroth: q,
                first: q * x,
            });
        }
        m
    }

    #[test]
    fn moments_are_exact() {
        let arc = Arc::through(DVec3::X * 5.0, DVec3::Y * 5.0, DVec3::X * -5.0).unwrap();
        let line = Shape::Line {
            from: DVec3::X,
            along: DVec3::new(3.0, 4.0, 5.0),
        };
        // the interval is the first 0.3 of the piece, seen from x = 0.2 to 0.9 of the interval
        for rate in [0.3, 0.01] {
            let (x0, x1) = (0.2, 0.9);
            let at = |x: f64| (x - x0) * rate;
            let middle = at(0.5 * (x0 + x1));
            let checks = [
                (
                    Shape::Arc(arc).moments(x0, x1, middle, rate),
                    brute(|x| arc.at(at(x)), x0, x1),
                ),
                (
                    line.moments(x0, x1, middle, rate),
                    brute(|x| DVec3::X + DVec3::new(3.0, 4.0, 5.0) * at(x), x0, x1),
                ),
            ];
            for (ours, plain) in checks {
                assert!(ours.zeroth.distance(plain.zeroth) < 1e-9);
                assert!(ours.first.distance(plain.first) < 1e-9);
            }
        }
    }

    #[test]
    fn series_meet_closed_forms() {
        let (a, b) = (circular_means(0.05 - 1e-12), circular_means(0.05 + 1e-12));
        assert!((a.0 - b.0).abs() < 1e-13 && (a.1 - b.1).abs() < 1e-12);
    }

    #[test]
    fn axes_turn_the_short_way() {
        let Shape::Arc(arc) = Shape::turn(DVec3::Z, DVec3::X) else {
            panic!("no turn")
        };
        assert!(arc.at(1.0).distance(DVec3::X) < 1e-12);
        assert!(arc.at(0.5).z > 0.7);
        let Shape::Arc(arc) = Shape::turn(DVec3::Z, -DVec3::Z) else {
            panic!("no turn")
        };
        assert!(arc.at(1.0).distance(-DVec3::Z) < 1e-12);
    }
}
