//! Curves in space with their parameters (forms and parameters of ISO 10303-42, clause 4.4).

use std::f64::consts::TAU;
use std::sync::Arc;

use super::nurbs::NurbsCurve;
use crate::math::{DAffine3, DMat3, DVec2, DVec3};

/// A right-handed orthonormal frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin, mm.
    pub origin: DVec3,
    /// First axis, unit.
    pub x: DVec3,
    /// Second axis, unit.
    pub y: DVec3,
    /// Third axis, unit: normal of planes, axis of revolution.
    pub z: DVec3,
}

impl Frame {
    /// The frame with third axis along `z` and first axis as near `x` as can be; `None` if `z` is
    /// zero. An `x` that is zero or along `z` is replaced by any perpendicular.
    pub fn new(origin: DVec3, z: DVec3, x: DVec3) -> Option<Self> {
        let z = z.try_normalize()?;
        let flat = |x: DVec3| (x - z * x.dot(z)).try_normalize();
        let near = x
            .try_normalize()
            .and_then(|x| flat(x).filter(|_| x.cross(z).length() > 1e-9));
        let x = near.unwrap_or_else(|| z.any_orthonormal_vector());
        Some(Self {
            origin,
            x,
            y: z.cross(x),
            z,
        })
    }

    /// Coordinates of a point in this frame.
    pub fn local(&self, p: DVec3) -> DVec3 {
        let d = p - self.origin;
        DVec3::new(d.dot(self.x), d.dot(self.y), d.dot(self.z))
    }

    /// The point with these coordinates in this frame.
    pub fn point(&self, c: DVec3) -> DVec3 {
        self.origin + c.x * self.x + c.y * self.y + c.z * self.z
    }

    /// The transform from coordinates in this frame to those of the frame it is given in.
    pub fn to_affine(&self) -> DAffine3 {
        DAffine3::from_mat3_translation(DMat3::from_cols(self.x, self.y, self.z), self.origin)
    }
}

/// One piece of a composite curve: `curve` from parameter `from` to `to`, which may fall.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvePiece {
    /// The curve of which this is a piece.
    pub curve: Arc<Curve>,
    /// Its parameter at the start.
    pub from: f64,
    /// Its parameter at the end.
    pub to: f64,
}

/// A curve; lengths in mm, angles in radians.
#[derive(Debug, Clone, PartialEq)]
pub enum Curve {
    /// `origin + t direction`.
    Line {
        /// Point at t = 0.
        origin: DVec3,
        /// Derivative; not zero.
        direction: DVec3,
    },
    /// `radius (cos t x + sin t y)`.
    Circle {
        /// Centre and plane.
        frame: Frame,
        /// Radius.
        radius: f64,
    },
    /// `a cos t x + b sin t y`.
    Ellipse {
        /// Centre and plane.
        frame: Frame,
        /// Semi-axes a and b.
        semi_axes: [f64; 2],
    },
    /// `a cosh t x + b sinh t y`.
    Hyperbola {
        /// Centre and plane.
        frame: Frame,
        /// Semi-axes a and b.
        semi_axes: [f64; 2],
    },
    /// `f (t² x + 2 t y)`.
    Parabola {
        /// Apex and plane.
        frame: Frame,
        /// Focal distance f.
        focal: f64,
    },
    /// A B-spline, rational or not.
    Nurbs(NurbsCurve),
    /// Pieces one after the other; piece i holds parameters i to i + 1.
    Composite(Vec<CurvePiece>),
    /// `basis + distance (tangent × direction)`, in a plane normal to `direction`.
    Offset {
        /// The curve it runs beside.
        basis: Arc<Curve>,
        /// Distance, signed.
        distance: f64,
        /// Unit reference direction.
        direction: DVec3,
    },
}

impl Curve {
    /// Point at `t`.
    pub fn point(&self, t: f64) -> DVec3 {
        self.derivatives(t)[0]
    }

    /// Point, first and second derivative at `t`.
    pub fn derivatives(&self, t: f64) -> [DVec3; 3] {
        let conic = |frame: &Frame, c: [DVec2; 3]| {
            [
                frame.origin + c[0].x * frame.x + c[0].y * frame.y,
                c[1].x * frame.x + c[1].y * frame.y,
                c[2].x * frame.x + c[2].y * frame.y,
            ]
        };
        match self {
            Self::Line { origin, direction } => [*origin + t * *direction, *direction, DVec3::ZERO],
            Self::Circle { frame, radius } => {
                let (s, c) = t.sin_cos();
                let p = *radius * DVec2::new(c, s);
                conic(frame, [p, p.perp(), -p])
            }
            Self::Ellipse {
                frame,
                semi_axes: [a, b],
            } => {
                let (s, c) = t.sin_cos();
                let p = DVec2::new(a * c, b * s);
                conic(frame, [p, DVec2::new(-a * s, b * c), -p])
            }
            Self::Hyperbola {
                frame,
                semi_axes: [a, b],
            } => {
                let (s, c) = (t.sinh(), t.cosh());
                let p = DVec2::new(a * c, b * s);
                conic(frame, [p, DVec2::new(a * s, b * c), p])
            }
            Self::Parabola { frame, focal } => conic(
                frame,
                [
                    *focal * DVec2::new(t * t, 2.0 * t),
                    *focal * DVec2::new(2.0 * t, 2.0),
                    *focal * DVec2::new(2.0, 0.0),
                ],
            ),
            Self::Nurbs(spline) => spline.derivatives(t),
            Self::Composite(pieces) => {
                let last = pieces.len().saturating_sub(1);
                let index = (t.floor().max(0.0) as usize).min(last);
                let Some(piece) = pieces.get(index) else {
                    return [DVec3::ZERO; 3];
                };
                let rate = piece.to - piece.from;
                let [p, d1, d2] = piece
                    .curve
                    .derivatives(piece.from + (t - index as f64) * rate);
                [p, rate * d1, rate * rate * d2]
            }
            Self::Offset {
                basis,
                distance,
                direction,
            } => {
                let shifted = |t: f64| {
                    let [p, d1, _] = basis.derivatives(t);
                    p + *distance * d1.cross(*direction).normalize_or_zero()
                };
                differences(shifted, t, self.domain())
            }
        }
    }

    /// First and last parameter; infinite for lines, hyperbolas and parabolas.
    pub fn domain(&self) -> [f64; 2] {
        match self {
            Self::Line { .. } | Self::Hyperbola { .. } | Self::Parabola { .. } => {
                [f64::NEG_INFINITY, f64::INFINITY]
            }
            Self::Circle { .. } | Self::Ellipse { .. } => [0.0, TAU],
            Self::Nurbs(spline) => spline.basis().domain(),
            Self::Composite(pieces) => [0.0, pieces.len() as f64],
            Self::Offset { basis, .. } => basis.domain(),
        }
    }

    /// Length of the parameter after which the curve repeats: conics that close, and splines and
    /// composites whose ends are less than `gap` mm apart.
    pub fn period(&self, gap: f64) -> Option<f64> {
        match self {
            Self::Line { .. } | Self::Hyperbola { .. } | Self::Parabola { .. } => None,
            Self::Circle { .. } | Self::Ellipse { .. } => Some(TAU),
            Self::Offset { basis, .. } => basis.period(gap),
            Self::Nurbs(_) | Self::Composite(_) => {
                let [lo, hi] = self.domain();
                (self.point(lo).distance(self.point(hi)) <= gap).then_some(hi - lo)
            }
        }
    }

    /// Parameters between which the curve is smooth, ends of the domain included; empty for curves
    /// that are smooth everywhere.
    pub fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Nurbs(spline) => spline.basis().breaks(),
            Self::Composite(pieces) => {
                let mut breaks = vec![0.0];
                for (i, piece) in pieces.iter().enumerate() {
                    let rate = piece.to - piece.from;
                    let mut inner: Vec<f64> = piece
                        .curve
                        .breaks()
                        .iter()
                        .map(|b| (b - piece.from) / rate)
                        .filter(|s| *s > 1e-9 && *s < 1.0 - 1e-9)
                        .map(|s| i as f64 + s)
                        .collect();
                    inner.sort_by(f64::total_cmp);
                    breaks.extend(inner);
                    breaks.push((i + 1) as f64);
                }
                breaks
            }
            Self::Offset { basis, .. } => basis.breaks(),
            _ => Vec::new(),
        }
    }

    /// Whether the curve is straight everywhere.
    pub fn is_straight(&self) -> bool {
        matches!(self, Self::Line { .. })
    }

    /// Parameter of the point of the curve nearest to `p`. For lines and circles exact; else the
    /// best of a search over the whole domain.
    pub fn nearest(&self, p: DVec3) -> f64 {
        match self {
            Self::Line { origin, direction } => {
                (p - *origin).dot(*direction) / direction.length_squared()
            }
            Self::Circle { frame, .. } => {
                let c = frame.local(p);
                c.y.atan2(c.x).rem_euclid(TAU)
            }
            Self::Ellipse {
                frame,
                semi_axes: [a, b],
            } => {
                let c = frame.local(p);
                let guess = (c.y / b).atan2(c.x / a);
                self.polish(p, guess).rem_euclid(TAU)
            }
            Self::Hyperbola {
                frame,
                semi_axes: [_, b],
            } => self.polish(p, (frame.local(p).y / b).asinh()),
            Self::Parabola { frame, focal } => self.polish(p, frame.local(p).y / (2.0 * focal)),
            Self::Nurbs(_) | Self::Composite(_) | Self::Offset { .. } => {
                let [lo, hi] = self.domain();
                nearest_parameter(
                    |t| {
                        let [c, d1, d2] = self.derivatives(t);
                        [c - p, d1, d2]
                    },
                    &self.seeds(),
                    [lo, hi],
                )
            }
        }
    }

    /// Parameters that sample every feature of a bounded curve.
    pub(crate) fn seeds(&self) -> Vec<f64> {
        let breaks = match self {
            Self::Line { .. } | Self::Hyperbola { .. } | Self::Parabola { .. } => {
                return Vec::new();
            }
            Self::Circle { .. } | Self::Ellipse { .. } => vec![0.0, TAU],
            _ => {
                let breaks = self.breaks();
                if breaks.is_empty() {
                    self.domain().to_vec()
                } else {
                    breaks
                }
            }
        };
        let parts = match self {
            Self::Nurbs(spline) if spline.basis().degree() == 1 => 1,
            Self::Nurbs(spline) => spline.basis().degree() + 2,
            _ => 16,
        };
        let mut seeds = Vec::with_capacity(breaks.len() * parts);
        for pair in breaks.windows(2) {
            seeds.extend(
                (0..parts).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / parts as f64),
            );
        }
        seeds.extend(breaks.last());
        seeds
    }

    /// Improves a parameter that is already near the nearest point.
    fn polish(&self, p: DVec3, guess: f64) -> f64 {
        newton(
            |t| {
                let [c, d1, d2] = self.derivatives(t);
                [c - p, d1, d2]
            },
            guess,
            [f64::NEG_INFINITY, f64::INFINITY],
        )
        .0
    }
}

/// Point and derivatives by differences inside `domain`, for curves whose formulas would need a third derivative.
fn differences(f: impl Fn(f64) -> DVec3, t: f64, domain: [f64; 2]) -> [DVec3; 3] {
    let scale = if (domain[1] - domain[0]).is_finite() {
        domain[1] - domain[0]
    } else {
        1.0 + t.abs()
    };
    let h = 1e-4 * scale;
    let m = if domain[0].is_finite() {
        t.clamp(domain[0] + h, domain[1] - h)
    } else {
        t
    };
    let (a, b, c) = (f(m - h), f(m), f(m + h));
    let d2 = (a - 2.0 * b + c) / (h * h);
    [f(t), (c - a) / (2.0 * h) + (t - m) * d2, d2]
}

/// Newton's method on half the squared length of `f` (value, first and second derivative), held in
/// `range`; returns the parameter and the squared length there.
pub(super) fn newton(f: impl Fn(f64) -> [DVec3; 3], guess: f64, range: [f64; 2]) -> (f64, f64) {
    let mut t = guess.clamp(range[0], range[1]);
    let [mut r, mut d1, mut d2] = f(t);
    for _ in 0..40 {
        let slope = r.dot(d1);
        let bend = d1.length_squared() + r.dot(d2);
        // where the full second derivative is not convex, Gauss and Newton's step still goes down
        let bend = if bend > 0.0 {
            bend
        } else {
            d1.length_squared()
        };
        if bend <= 0.0 || !slope.is_finite() {
            break;
        }
        let mut step = -slope / bend;
        let mut moved = false;
        for _ in 0..8 {
            let next = (t + step).clamp(range[0], range[1]);
            let [nr, nd1, nd2] = f(next);
            if nr.length_squared() < r.length_squared() {
                moved = (next - t).abs() > 1e-15 * (1.0 + t.abs());
                (t, r, d1, d2) = (next, nr, nd1, nd2);
                break;
            }
            step *= 0.5;
        }
        if !moved {
            break;
        }
    }
    (t, r.length_squared())
}

/// Parameter in `range` at which `f` (difference to a target with its derivatives) is shortest,
/// from the best of the sorted `seeds`.
pub(super) fn nearest_parameter(
    f: impl Fn(f64) -> [DVec3; 3],
    seeds: &[f64],
    range: [f64; 2],
) -> f64 {
    let lengths: Vec<f64> = seeds.iter().map(|&t| f(t)[0].length_squared()).collect();
    let mut valleys: Vec<usize> = (0..seeds.len())
        .filter(|&i| {
            let left = i == 0 || lengths[i] <= lengths[i - 1];
            let right = i + 1 == seeds.len() || lengths[i] <= lengths[i + 1];
            left && right
        })
        .collect();
    valleys.sort_by(|&a, &b| lengths[a].total_cmp(&lengths[b]).then(a.cmp(&b)));
    let mut best = (range[0], f64::INFINITY);
    for &i in valleys.iter().take(4) {
        let found = newton(&f, seeds[i], range);
        if found.1 < best.1 {
            best = found;
        }
    }
    best.0
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Off the origin, turned.
    pub(crate) fn frame() -> Frame {
        Frame::new(
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::X,
        )
        .unwrap()
    }

    fn curves() -> Vec<(Curve, [f64; 2])> {
        let circle = Arc::new(Curve::Circle {
            frame: frame(),
            radius: 3.0,
        });
        vec![
            (
                Curve::Line {
                    origin: DVec3::ONE,
                    direction: DVec3::new(0.0, 2.0, 1.0),
                },
                [-3.0, 5.0],
            ),
            ((*circle).clone(), [0.1, 6.0]),
            (
                Curve::Ellipse {
                    frame: frame(),
                    semi_axes: [5.0, 2.0],
                },
                [0.1, 6.0],
            ),
            (
                Curve::Hyperbola {
                    frame: frame(),
                    semi_axes: [2.0, 1.0],
                },
                [-2.0, 2.0],
            ),
            (
                Curve::Parabola {
                    frame: frame(),
                    focal: 0.7,
                },
                [-4.0, 3.0],
            ),
            (
                Curve::Offset {
                    basis: Arc::clone(&circle),
                    distance: 1.5,
                    direction: frame().z,
                },
                [0.1, 6.0],
            ),
            (
                Curve::Composite(vec![
                    CurvePiece {
                        curve: circle,
                        from: 2.0,
                        to: 0.0,
                    },
                    CurvePiece {
                        curve: Arc::new(Curve::Line {
                            origin: frame().point(DVec3::X * 3.0),
                            direction: DVec3::Y,
                        }),
                        from: 0.0,
                        to: 4.0,
                    },
                ]),
                [0.02, 1.98],
            ),
        ]
    }

    #[test]
    fn nearest_returns_the_parameter_of_a_point_on_the_curve() {
        for (curve, [lo, hi]) in curves() {
            for i in 0..=40 {
                let t = lo + (hi - lo) * f64::from(i) / 40.0;
                let p = curve.point(t);
                let found = curve.nearest(p);
                assert!(
                    curve.point(found).distance(p) < 1e-8,
                    "{curve:?} at {t}: {found}"
                );
            }
        }
    }

    /// A flat parabola: its parameter is the distance from the axis over twice the focal length, wherever the search begins elsewhere.
    #[test]
    fn the_nearest_place_of_a_flat_parabola_is_found() {
        let focal = 1e5;
        let curve = Curve::Parabola {
            frame: frame(),
            focal,
        };
        for t in [-0.5, 0.02, 0.5] {
            let [p, along, _] = curve.derivatives(t);
            let beside = p + along.cross(frame().z).normalize();
            for p in [p, beside] {
                assert!((curve.nearest(p) - t).abs() < 1e-9, "{t}");
            }
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let h = 1e-5;
        for (curve, [lo, hi]) in curves() {
            for i in 1..20 {
                let t = lo + (hi - lo) * (f64::from(i) + 0.03) / 20.0;
                let [_, d1, _] = curve.derivatives(t);
                let d = (curve.point(t + h) - curve.point(t - h)) / (2.0 * h);
                assert!(
                    (d - d1).length() < 1e-6 * (1.0 + d1.length()),
                    "{curve:?} {t}"
                );
            }
        }
    }

    #[test]
    fn a_frame_needs_an_axis_and_mends_its_first() {
        assert!(Frame::new(DVec3::ZERO, DVec3::ZERO, DVec3::X).is_none());
        let mended = Frame::new(DVec3::ZERO, DVec3::Z, DVec3::Z).unwrap();
        assert!(mended.x.dot(DVec3::Z).abs() < 1e-15);
        assert!((mended.x.cross(mended.y) - mended.z).length() < 1e-15);
    }

    /// Where the second derivative of half the square is zero the step is Gauss' and Newton's: it does not end there.
    #[test]
    fn newton_goes_on_where_the_square_does_not_bend() {
        let f = |t: f64| {
            [
                DVec3::X * (1.0 + t - 0.5 * t * t),
                DVec3::X * (1.0 - t),
                -DVec3::X,
            ]
        };
        let (t, square) = newton(f, 0.0, [-2.0, 2.0]);
        assert!((t - (1.0 - f64::sqrt(3.0))).abs() < 1e-9, "{t}");
        assert!(square < 1e-18, "{square}");
    }
}
