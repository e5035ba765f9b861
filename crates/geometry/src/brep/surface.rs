//! Surfaces with their parameters (forms and parameters of ISO 10303-42, clause 4.4).

mod locate;

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use super::curve::{Curve, Frame, newton};
use super::nurbs::NurbsSurface;
use crate::math::{DQuat, DVec2, DVec3};

/// Which part of a torus that meets itself (minor radius above major radius).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TorusSheet {
    /// The outer part, an apple; also every torus that does not meet itself.
    Outer,
    /// The inner part, a lemon.
    Inner,
}

/// A surface; lengths in mm, angles in radians, parameters (u, v).
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// `u x + v y`.
    Plane(Frame),
    /// `radius (cos u x + sin u y) + v z`.
    Cylinder {
        /// Axis.
        frame: Frame,
        /// Radius.
        radius: f64,
    },
    /// `(radius + v tan half_angle) (cos u x + sin u y) + v z`.
    Cone {
        /// Axis.
        frame: Frame,
        /// Radius at v = 0.
        radius: f64,
        /// Half the angle of the apex.
        half_angle: f64,
    },
    /// `radius (cos v (cos u x + sin u y) + sin v z)`.
    Sphere {
        /// Centre and poles.
        frame: Frame,
        /// Radius.
        radius: f64,
    },
    /// `(major + minor cos v) (cos u x + sin u y) + minor sin v z`.
    Torus {
        /// Axis.
        frame: Frame,
        /// Radius of the centre line.
        major: f64,
        /// Radius of the tube.
        minor: f64,
        /// Which part, if it meets itself.
        sheet: TorusSheet,
    },
    /// A B-spline, rational or not.
    Nurbs(NurbsSurface),
    /// `profile(v)` turned by u about an axis.
    Revolution {
        /// The curve that is turned.
        profile: Arc<Curve>,
        /// Axis: third axis of the frame.
        frame: Frame,
    },
    /// `profile(u) + v direction`.
    Extrusion {
        /// The curve that is moved.
        profile: Arc<Curve>,
        /// Derivative along v; not zero.
        direction: DVec3,
    },
    /// `base + distance · unit normal`.
    Offset {
        /// The surface it runs beside.
        base: Arc<Surface>,
        /// Distance, signed.
        distance: f64,
    },
}

/// A line of constant parameter that the surface shrinks to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// The parameter that is constant: 0 for u, 1 for v.
    pub fixed: usize,
    /// Its value.
    pub at: f64,
    /// The point, mm.
    pub point: DVec3,
}

impl Surface {
    /// What it is, in words, with its sizes.
    pub fn words(&self) -> String {
        match self {
            Self::Plane(_) => "plane".to_owned(),
            Self::Cylinder { radius, .. } => format!("cylinder of radius {radius:.3} mm"),
            Self::Cone { half_angle, .. } => {
                format!(
                    "cone of half-angle {:.2} deg",
                    half_angle.to_degrees().abs()
                )
            }
            Self::Sphere { radius, .. } => format!("sphere of radius {radius:.3} mm"),
            Self::Torus { major, minor, .. } => {
                format!("torus of radii {major:.3} and {minor:.3} mm")
            }
            Self::Nurbs(_) => "spline surface".to_owned(),
            Self::Revolution { .. } => "surface of revolution".to_owned(),
            Self::Extrusion { .. } => "extruded surface".to_owned(),
            Self::Offset { distance, .. } => format!("surface offset by {distance:.3} mm"),
        }
    }

    /// Point at (u, v).
    pub fn point(&self, uv: DVec2) -> DVec3 {
        self.tangents(uv)[0]
    }

    /// Point and derivatives by u and by v.
    pub fn tangents(&self, uv: DVec2) -> [DVec3; 3] {
        let DVec2 { x: u, y: v } = uv;
        // ring of radius rho at height z, with their derivatives by v
        let ring = |frame: &Frame, rho: f64, z: f64, d_rho: f64, d_z: f64| {
            let (s, c) = u.sin_cos();
            let radial = c * frame.x + s * frame.y;
            let around = c * frame.y - s * frame.x;
            [
                frame.origin + rho * radial + z * frame.z,
                rho * around,
                d_rho * radial + d_z * frame.z,
            ]
        };
        match self {
            Self::Plane(frame) => [frame.origin + u * frame.x + v * frame.y, frame.x, frame.y],
            Self::Cylinder { frame, radius } => ring(frame, *radius, v, 0.0, 1.0),
            Self::Cone {
                frame,
                radius,
                half_angle,
            } => {
                let slope = half_angle.tan();
                ring(frame, radius + v * slope, v, slope, 1.0)
            }
            Self::Sphere { frame, radius } => {
                let (s, c) = v.sin_cos();
                ring(frame, radius * c, radius * s, -radius * s, radius * c)
            }
            Self::Torus {
                frame,
                major,
                minor,
                ..
            } => {
                let (s, c) = v.sin_cos();
                ring(frame, major + minor * c, minor * s, -minor * s, minor * c)
            }
            Self::Nurbs(spline) => spline.tangents(u, v),
            Self::Revolution { profile, frame } => {
                let [p, d, _] = profile.derivatives(v);
                let turn = DQuat::from_axis_angle(frame.z, u);
                let arm = turn * (p - frame.origin);
                [frame.origin + arm, frame.z.cross(arm), turn * d]
            }
            Self::Extrusion { profile, direction } => {
                let [p, d, _] = profile.derivatives(u);
                [p + v * *direction, d, *direction]
            }
            Self::Offset { base, distance } => {
                let at = |uv: DVec2| {
                    let [p, du, dv] = base.tangents(uv);
                    p + *distance * du.cross(dv).normalize_or_zero()
                };
                let domain = base.domain();
                let slope = |axis: DVec2, [lo, hi]: [f64; 2]| {
                    let x = uv.dot(axis);
                    let scale = if (hi - lo).is_finite() {
                        hi - lo
                    } else {
                        1.0 + x.abs()
                    };
                    let h = 1e-6 * scale;
                    let a = (x - h).max(lo);
                    let b = (x + h).min(hi);
                    (at(uv + (b - x) * axis) - at(uv + (a - x) * axis)) / (b - a)
                };
                [
                    at(uv),
                    slope(DVec2::X, domain[0]),
                    slope(DVec2::Y, domain[1]),
                ]
            }
        }
    }

    /// Unit normal, `du × dv`; zero where the surface has none.
    pub fn normal(&self, uv: DVec2) -> DVec3 {
        let [_, du, dv] = self.tangents(uv);
        du.cross(dv).normalize_or_zero()
    }

    /// Range of u and of v; infinite for planes, cylinders, cones and extrusions along their rulings.
    pub fn domain(&self) -> [[f64; 2]; 2] {
        const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
        match self {
            Self::Plane(_) => [ALL, ALL],
            Self::Cylinder { .. } | Self::Cone { .. } => [[0.0, TAU], ALL],
            Self::Sphere { .. } => [[0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]],
            Self::Torus {
                major,
                minor,
                sheet,
                ..
            } => {
                if minor < major {
                    return [[0.0, TAU], [0.0, TAU]];
                }
                let meet = (-major / minor).acos();
                match sheet {
                    TorusSheet::Outer => [[0.0, TAU], [-meet, meet]],
                    TorusSheet::Inner => [[0.0, TAU], [meet, TAU - meet]],
                }
            }
            Self::Nurbs(spline) => spline.bases().map(super::nurbs::Basis::domain),
            Self::Revolution { profile, .. } => [[0.0, TAU], profile.domain()],
            Self::Extrusion { profile, .. } => [profile.domain(), ALL],
            Self::Offset { base, .. } => base.domain(),
        }
    }

    /// Lengths of u and v after which the surface repeats; splines and profiles count as closed
    /// when their ends are at most `gap` mm apart.
    pub fn periods(&self, gap: f64) -> [Option<f64>; 2] {
        match self {
            Self::Plane(_) => [None, None],
            Self::Cylinder { .. } | Self::Cone { .. } | Self::Sphere { .. } => [Some(TAU), None],
            Self::Torus { major, minor, .. } => [Some(TAU), (minor < major).then_some(TAU)],
            Self::Nurbs(_) => {
                let [[u0, u1], [v0, v1]] = self.domain();
                let closed = |pair: &dyn Fn(f64) -> [DVec2; 2]| {
                    (0..=16).all(|i| {
                        let [a, b] = pair(f64::from(i) / 16.0);
                        self.point(a).distance(self.point(b)) <= gap
                    })
                };
                let u = closed(&|s| {
                    let v = v0 + (v1 - v0) * s;
                    [DVec2::new(u0, v), DVec2::new(u1, v)]
                });
                let v = closed(&|s| {
                    let u = u0 + (u1 - u0) * s;
                    [DVec2::new(u, v0), DVec2::new(u, v1)]
                });
                // where all of a side is one point the two ends meet there too: that is a pole
                [u.then_some(u1 - u0), v.then_some(v1 - v0)]
            }
            Self::Revolution { profile, .. } => [Some(TAU), profile.period(gap)],
            Self::Extrusion { profile, .. } => [profile.period(gap), None],
            Self::Offset { base, .. } => base.periods(gap),
        }
    }

    /// Lines of constant parameter that shrink to a point, to within `gap` mm.
    pub fn poles(&self, gap: f64) -> Vec<Pole> {
        let pole = |fixed: usize, at: f64, other: f64| {
            let uv = if fixed == 0 {
                DVec2::new(at, other)
            } else {
                DVec2::new(other, at)
            };
            Pole {
                fixed,
                at,
                point: self.point(uv),
            }
        };
        match self {
            Self::Plane(_) | Self::Cylinder { .. } | Self::Extrusion { .. } => Vec::new(),
            Self::Cone {
                radius, half_angle, ..
            } => vec![pole(1, -radius / half_angle.tan(), 0.0)],
            Self::Sphere { .. } => vec![pole(1, -FRAC_PI_2, 0.0), pole(1, FRAC_PI_2, 0.0)],
            Self::Torus { major, minor, .. } if minor < major => Vec::new(),
            Self::Torus { .. } => self.domain()[1].map(|v| pole(1, v, 0.0)).to_vec(),
            Self::Nurbs(_) => {
                let domain = self.domain();
                let mut poles = Vec::new();
                for fixed in [0, 1] {
                    let [lo, hi] = domain[1 - fixed];
                    for at in domain[fixed] {
                        let first = pole(fixed, at, lo);
                        let shrunk = (1..=16).all(|i| {
                            let other = lo + (hi - lo) * f64::from(i) / 16.0;
                            pole(fixed, at, other).point.distance(first.point) <= gap
                        });
                        if shrunk {
                            poles.push(first);
                        }
                    }
                }
                poles
            }
            Self::Revolution { profile, frame } => profile_poles(profile, frame, gap)
                .into_iter()
                .map(|v| pole(1, v, 0.0))
                .collect(),
            Self::Offset { base, distance } => base
                .poles(gap)
                .into_iter()
                // only where the normal is one over the whole pole does the offset keep it
                .filter(|_| distance.abs() <= gap)
                .collect(),
        }
    }

    /// Parameters of u and v where the surface is not smooth, ends included; empty where smooth everywhere.
    pub fn breaks(&self) -> [Vec<f64>; 2] {
        match self {
            Self::Nurbs(spline) => spline.bases().map(super::nurbs::Basis::breaks),
            Self::Revolution { profile, .. } => [Vec::new(), profile.breaks()],
            Self::Extrusion { profile, .. } => [profile.breaks(), Vec::new()],
            Self::Offset { base, .. } => base.breaks(),
            _ => [Vec::new(), Vec::new()],
        }
    }
}

/// Parameters at which a profile meets its axis of revolution.
fn profile_poles(profile: &Curve, frame: &Frame, gap: f64) -> Vec<f64> {
    let off = |p: DVec3| {
        let c = frame.local(p);
        c.x.hypot(c.y)
    };
    if let Curve::Line { origin, direction } = profile {
        let flat = |d: DVec3| d - frame.z * d.dot(frame.z);
        let (a, d) = (flat(*origin - frame.origin), flat(*direction));
        if d.length_squared() <= 1e-24 * direction.length_squared() {
            return Vec::new();
        }
        let t = -a.dot(d) / d.length_squared();
        return if off(profile.point(t)) <= gap {
            vec![t]
        } else {
            Vec::new()
        };
    }
    let seeds = profile.seeds();
    let [lo, hi] = profile.domain();
    let mut found: Vec<f64> = Vec::new();
    for &seed in &seeds {
        let (t, left) = newton(
            |t| {
                let [p, d1, d2] = profile.derivatives(t);
                let flat = |d: DVec3| d - frame.z * d.dot(frame.z);
                [flat(p - frame.origin), flat(d1), flat(d2)]
            },
            seed,
            [lo, hi],
        );
        let scale = 1e-7 * (1.0 + (hi - lo).abs());
        if left.sqrt() <= gap && found.iter().all(|f| (f - t).abs() > scale) {
            found.push(t);
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brep::curve::tests::frame;
    use crate::brep::nurbs::NurbsCurve;

    /// Surfaces with a box of parameters inside their domain.
    fn surfaces() -> Vec<(Surface, [[f64; 2]; 2])> {
        let frame = frame();
        let wave = NurbsCurve::new(
            3,
            vec![0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0],
            [(4.0, 0.0), (6.0, 1.0), (2.0, 2.5), (5.0, 4.0), (3.0, 6.0)]
                .map(|(x, z)| frame.point(DVec3::new(x, 0.4 * x, z)))
                .to_vec(),
            vec![1.0, 2.0, 0.7, 1.0, 1.5],
        )
        .unwrap();
        let wave = Arc::new(Curve::Nurbs(wave));
        let patch = NurbsSurface::new(
            [2, 3],
            [
                vec![0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0],
                vec![0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0],
            ],
            (0..4)
                .map(|i| {
                    (0..4)
                        .map(|j| {
                            let (x, y) = (f64::from(i), f64::from(j));
                            DVec3::new(2.0 * x, y, (x * 1.1 + y * 0.8).sin())
                        })
                        .collect()
                })
                .collect(),
            (0..16).map(|i| 1.0 + 0.1 * f64::from(i % 5)).collect(),
        )
        .unwrap();
        let all = [0.01, TAU - 0.01];
        vec![
            (Surface::Plane(frame), [[-5.0, 5.0], [-5.0, 5.0]]),
            (Surface::Cylinder { frame, radius: 3.0 }, [all, [-5.0, 5.0]]),
            (
                Surface::Cone {
                    frame,
                    radius: 3.0,
                    half_angle: 0.4,
                },
                [all, [-5.0, 5.0]],
            ),
            (Surface::Sphere { frame, radius: 3.0 }, [all, [-1.5, 1.5]]),
            (
                Surface::Torus {
                    frame,
                    major: 5.0,
                    minor: 2.0,
                    sheet: TorusSheet::Outer,
                },
                [all, all],
            ),
            (
                Surface::Torus {
                    frame,
                    major: 1.0,
                    minor: 2.0,
                    sheet: TorusSheet::Inner,
                },
                [all, [2.2, 4.0]],
            ),
            (Surface::Nurbs(patch.clone()), [[0.0, 1.0], [0.0, 2.0]]),
            (
                Surface::Revolution {
                    profile: Arc::clone(&wave),
                    frame,
                },
                [all, [0.0, 1.0]],
            ),
            (
                Surface::Extrusion {
                    profile: wave,
                    direction: frame.y * 2.0,
                },
                [[0.0, 1.0], [-3.0, 3.0]],
            ),
            (
                Surface::Offset {
                    base: Arc::new(Surface::Nurbs(patch)),
                    distance: 0.1,
                },
                [[0.0, 1.0], [0.0, 2.0]],
            ),
        ]
    }

    fn grid([[u0, u1], [v0, v1]]: [[f64; 2]; 2]) -> impl Iterator<Item = DVec2> {
        (0..=12).flat_map(move |i| {
            (0..=12).map(move |j| {
                DVec2::new(
                    u0 + (u1 - u0) * f64::from(i) / 12.0,
                    v0 + (v1 - v0) * f64::from(j) / 12.0,
                )
            })
        })
    }

    #[test]
    fn locate_inverts_point_with_and_without_a_guess() {
        for (surface, range) in surfaces() {
            for uv in grid(range) {
                let p = surface.point(uv);
                let cold = surface.locate(p, None, 1e-9);
                assert!(surface.point(cold).distance(p) < 1e-8, "{surface:?} {uv}");
                let warm = surface.locate(p, Some(uv + DVec2::splat(1e-3)), 1e-9);
                assert!(surface.point(warm).distance(p) < 1e-8, "{surface:?} {uv}");
            }
        }
    }

    #[test]
    fn tangents_match_differences() {
        let h = 1e-6;
        for (surface, range) in surfaces() {
            let [[u0, u1], [v0, v1]] = range;
            let m = 0.013;
            let inner = [[u0 + m, u1 - m], [v0 + m, v1 - m]];
            for uv in grid(inner) {
                let [_, du, dv] = surface.tangents(uv);
                let d =
                    |step: DVec2| (surface.point(uv + step) - surface.point(uv - step)) / (2.0 * h);
                let scale = 1.0 + du.length() + dv.length();
                assert!(
                    (d(DVec2::X * h) - du).length() < 2e-4 * scale,
                    "{surface:?} {uv}"
                );
                assert!(
                    (d(DVec2::Y * h) - dv).length() < 2e-4 * scale,
                    "{surface:?} {uv}"
                );
            }
        }
    }

    #[test]
    fn poles_are_points() {
        let frame = frame();
        let half = Arc::new(Curve::Circle {
            frame: Frame::new(frame.origin, frame.y, frame.z).unwrap(),
            radius: 2.0,
        });
        let cases = [
            (
                Surface::Cone {
                    frame,
                    radius: 3.0,
                    half_angle: -0.4,
                },
                1,
            ),
            (Surface::Sphere { frame, radius: 3.0 }, 2),
            (
                Surface::Torus {
                    frame,
                    major: 1.0,
                    minor: 2.0,
                    sheet: TorusSheet::Outer,
                },
                2,
            ),
            (
                Surface::Revolution {
                    profile: half,
                    frame,
                },
                3, // 0, π and 2π: the profile's circle starts on the axis
            ),
        ];
        for (surface, count) in cases {
            let poles = surface.poles(1e-6);
            assert_eq!(poles.len(), count, "{surface:?} {poles:?}");
            for pole in poles {
                for i in 0..8 {
                    let uv = DVec2::new(f64::from(i), pole.at);
                    assert!(surface.point(uv).distance(pole.point) < 1e-9);
                }
            }
        }
    }
}
