//! The point of a surface nearest to a point in space: closed forms for the elementary surfaces, damped Gauss-Newton for the
//! others.

use std::f64::consts::{PI, TAU};

use super::{Surface, TorusSheet};
use crate::brep::curve::{Curve, Frame, nearest_parameter, newton};
use crate::math::{DVec2, DVec3};

impl Surface {
    /// Parameters of the point of the surface nearest to `p`. Exact for the elementary surfaces;
    /// for the others `guess`, parameters near by, is improved first, and the whole surface is
    /// searched where that does not end within `near` mm.
    pub fn locate(&self, p: DVec3, guess: Option<DVec2>, near: f64) -> DVec2 {
        match self {
            Self::Plane(frame) => frame.local(p).truncate(),
            Self::Cylinder { frame, .. } => {
                let c = frame.local(p);
                DVec2::new(c.y.atan2(c.x), c.z)
            }
            Self::Cone {
                frame,
                radius,
                half_angle,
            } => {
                let c = frame.local(p);
                let (s, k) = half_angle.sin_cos();
                let rho = c.x.hypot(c.y);
                let u = c.y.atan2(c.x);
                // on either side of the apex the nearer ruling is the one to take
                let at = |rho: f64| {
                    let along = (rho - radius) * s + c.z * k;
                    let off = ((rho - radius) * k - c.z * s).abs();
                    (off, along * k)
                };
                let (front, back) = (at(rho), at(-rho));
                if front.0 <= back.0 {
                    DVec2::new(u, front.1)
                } else {
                    DVec2::new(u + PI, back.1)
                }
            }
            Self::Sphere { frame, .. } => {
                let c = frame.local(p);
                DVec2::new(c.y.atan2(c.x), c.z.atan2(c.x.hypot(c.y)))
            }
            Self::Torus {
                frame,
                major,
                sheet,
                ..
            } => {
                let c = frame.local(p);
                let rho = c.x.hypot(c.y);
                let u = c.y.atan2(c.x);
                match sheet {
                    TorusSheet::Outer => DVec2::new(u, c.z.atan2(rho - major)),
                    TorusSheet::Inner => {
                        DVec2::new(u + PI, c.z.atan2(-rho - major).rem_euclid(TAU))
                    }
                }
            }
            Self::Nurbs(_) | Self::Offset { .. } => {
                if let Some(guess) = guess {
                    let (uv, off) = self.descend(p, guess);
                    if off <= near {
                        return uv;
                    }
                }
                self.search(p)
            }
            Self::Revolution { profile, frame } => {
                let c = frame.local(p);
                let rho = c.x.hypot(c.y);
                let v = meridian_parameter(profile, frame, rho, c.z, guess.map(|g| g.y), near);
                let q = frame.local(profile.point(v));
                DVec2::new(c.y.atan2(c.x) - q.y.atan2(q.x), v)
            }
            Self::Extrusion { profile, direction } => {
                let axis = *direction / direction.length();
                let flat = |d: DVec3| d - axis * d.dot(axis);
                let u = if let Curve::Line {
                    origin,
                    direction: along,
                } = profile.as_ref()
                {
                    let along = flat(*along);
                    flat(p - *origin).dot(along) / along.length_squared()
                } else {
                    seek(
                        profile,
                        |t| {
                            let [c, d1, d2] = profile.derivatives(t);
                            [flat(c - p), flat(d1), flat(d2)]
                        },
                        guess.map(|g| g.x),
                        near,
                        p,
                    )
                };
                let v = (p - profile.point(u)).dot(axis) / direction.length();
                DVec2::new(u, v)
            }
        }
    }

    /// Damped Gauss-Newton from `guess`; returns the parameters and the distance left.
    fn descend(&self, p: DVec3, guess: DVec2) -> (DVec2, f64) {
        let [[u0, u1], [v0, v1]] = self.domain();
        let lo = DVec2::new(u0, v0);
        let hi = DVec2::new(u1, v1);
        let mut uv = guess.clamp(lo, hi);
        let [mut s, mut du, mut dv] = self.tangents(uv);
        for _ in 0..50 {
            let r = p - s;
            let (a, b, c) = (du.length_squared(), du.dot(dv), dv.length_squared());
            let (e, f) = (du.dot(r), dv.dot(r));
            // at a pole or a cusp one derivative vanishes: a little of the diagonal keeps the step finite
            let (a, c) = (a * (1.0 + 1e-12) + 1e-300, c * (1.0 + 1e-12) + 1e-300);
            let det = a * c - b * b;
            let full = if det > 1e-14 * a * c {
                DVec2::new(e * c - f * b, f * a - e * b) / det
            } else {
                DVec2::new(e / a, f / c) * 0.5
            };
            // a bound that holds the step moves it along the other parameter only
            let mut step = (uv + full).clamp(lo, hi) - uv;
            if step.x == 0.0 && full.x != 0.0 {
                step.y = (uv.y + f / c).clamp(v0, v1) - uv.y;
            } else if step.y == 0.0 && full.y != 0.0 {
                step.x = (uv.x + e / a).clamp(u0, u1) - uv.x;
            }
            let mut moved = false;
            for _ in 0..10 {
                let next = uv + step;
                let [ns, ndu, ndv] = self.tangents(next);
                if p.distance_squared(ns) < r.length_squared() {
                    moved = step.abs().cmpgt((uv.abs() + 1e-12) * 1e-15).any();
                    (uv, s, du, dv) = (next, ns, ndu, ndv);
                    break;
                }
                step *= 0.5;
            }
            if !moved {
                break;
            }
        }
        (uv, p.distance(s))
    }

    /// The nearest point over the whole bounded domain: descent from the best of a grid.
    fn search(&self, p: DVec3) -> DVec2 {
        let lines = self.grid_lines();
        let mut seeds = Vec::with_capacity(lines[0].len() * lines[1].len());
        for &u in &lines[0] {
            for &v in &lines[1] {
                let uv = DVec2::new(u, v);
                seeds.push((self.point(uv).distance_squared(p), uv));
            }
        }
        let keep = 12.min(seeds.len());
        if keep == 0 {
            return DVec2::ZERO;
        }
        seeds.select_nth_unstable_by(keep - 1, |a, b| a.0.total_cmp(&b.0));
        seeds.truncate(keep);
        seeds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best = (DVec2::ZERO, f64::INFINITY);
        for (_, seed) in seeds {
            let found = self.descend(p, seed);
            if found.1 < best.1 {
                best = found;
            }
            if best.1 < 1e-9 {
                break;
            }
        }
        best.0
    }

    /// Parameters in u and v between which a bounded surface is smooth and nearly simple.
    fn grid_lines(&self) -> [Vec<f64>; 2] {
        let fill = |breaks: &[f64], parts: usize| {
            let mut lines = Vec::new();
            for pair in breaks.windows(2) {
                let step = (pair[1] - pair[0]) / parts as f64;
                lines.extend((0..parts).map(|i| pair[0] + step * i as f64));
            }
            lines.extend(breaks.last());
            lines
        };
        match self {
            Self::Nurbs(spline) => spline
                .bases()
                .map(|basis| fill(&basis.breaks(), basis.degree() + 1)),
            Self::Offset { base, .. } => base.grid_lines(),
            _ => self.domain().map(|range| {
                if (range[1] - range[0]).is_finite() {
                    fill(&range, 24)
                } else {
                    Vec::new()
                }
            }),
        }
    }
}

/// Parameter of the profile at the point nearest to (rho, z) in the half-plane of the axis.
fn meridian_parameter(
    profile: &Curve,
    frame: &Frame,
    rho: f64,
    z: f64,
    guess: Option<f64>,
    near: f64,
) -> f64 {
    // radius and height of the profile minus the target, and their derivatives
    let residual = |t: f64| {
        let [p, d1, d2] = profile.derivatives(t);
        let c = frame.local(p);
        let axes = |d: DVec3| DVec3::new(d.dot(frame.x), d.dot(frame.y), d.dot(frame.z));
        let (d1, d2) = (axes(d1), axes(d2));
        let r = c.x.hypot(c.y);
        if r < 1e-12 {
            let rate = d1.x.hypot(d1.y);
            return [
                DVec3::new(r - rho, c.z - z, 0.0),
                DVec3::new(rate, d1.z, 0.0),
                DVec3::new(0.0, d2.z, 0.0),
            ];
        }
        let r1 = (c.x * d1.x + c.y * d1.y) / r;
        let r2 = (d1.x * d1.x + d1.y * d1.y + c.x * d2.x + c.y * d2.y - r1 * r1) / r;
        [
            DVec3::new(r - rho, c.z - z, 0.0),
            DVec3::new(r1, d1.z, 0.0),
            DVec3::new(r2, d2.z, 0.0),
        ]
    };
    let seeds = if profile.is_straight() {
        // a line's radius has one valley: start at both sides of it
        let mid = profile.nearest(frame.origin + z * frame.z);
        let reach = (rho + 1.0) / profile.derivatives(0.0)[1].length();
        vec![mid - reach, mid, mid + reach]
    } else {
        profile.seeds()
    };
    if let Some(guess) = guess {
        let (t, off) = newton(residual, guess, profile_range(profile));
        if off.sqrt() <= near {
            return t;
        }
    }
    nearest_parameter(residual, &seeds, profile_range(profile))
}

/// Range in which a profile's parameter may be sought: conics that close may be run through again.
fn profile_range(profile: &Curve) -> [f64; 2] {
    match profile {
        Curve::Circle { .. } | Curve::Ellipse { .. } => [-TAU, 2.0 * TAU],
        _ => profile.domain(),
    }
}

/// Parameter of a profile at which `f` is shortest, from `guess` if that ends within `near`.
fn seek(
    profile: &Curve,
    f: impl Fn(f64) -> [DVec3; 3],
    guess: Option<f64>,
    near: f64,
    p: DVec3,
) -> f64 {
    let range = profile_range(profile);
    if let Some(guess) = guess {
        let (t, off) = newton(&f, guess, range);
        if off.sqrt() <= near {
            return t;
        }
    }
    let mut seeds = profile.seeds();
    if seeds.is_empty() {
        // unbounded conics: their own nearest point is a fair start
        let t = profile.nearest(p);
        seeds = vec![t - 2.0, t - 1.0, t - 0.5, t, t + 0.5, t + 1.0, t + 2.0];
    }
    nearest_parameter(f, &seeds, range)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brep::nurbs::NurbsSurface;

    /// Every span is cut into equal parts, and no line lies outside.
    #[test]
    fn lines_of_a_spline_run_through_its_spans() {
        let rows = (0..4).map(|i| {
            let point = |j: u32| DVec3::new(f64::from(i), f64::from(j), f64::from(i * j));
            (0..4).map(point).collect()
        });
        let patch = NurbsSurface::new(
            [2, 3],
            [
                vec![1.0, 1.0, 1.0, 1.6, 3.0, 3.0, 3.0],
                vec![-2.0, -2.0, -2.0, -2.0, 2.0, 2.0, 2.0, 2.0],
            ],
            rows.collect(),
            vec![1.0; 16],
        );
        let lines = Surface::Nurbs(patch.unwrap()).grid_lines();
        let wanted = [
            vec![1.0, 1.2, 1.4, 1.6, 1.6 + 1.4 / 3.0, 1.6 + 2.8 / 3.0, 3.0],
            vec![-2.0, -1.0, 0.0, 1.0, 2.0],
        ];
        for (lines, wanted) in lines.iter().zip(&wanted) {
            assert_eq!(lines.len(), wanted.len(), "{lines:?}");
            for (a, b) in lines.iter().zip(wanted) {
                assert!((a - b).abs() < 1e-12, "{lines:?}");
            }
        }
    }
}
