//! A circular arc in space, from its start, a point on the way and its end: how controllers write arcs.

use crate::math::DVec3;

/// A circular arc: points `centre + radius·(cos φ · u + sin φ · v)` for φ from 0 to `sweep`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Centre, mm.
    pub centre: DVec3,
    /// Unit vector from the centre to the start.
    pub u: DVec3,
    /// Unit vector of the plane at a right angle to `u`, in the sense of travel.
    pub v: DVec3,
    /// Radius, mm.
    pub radius: f64,
    /// Angle travelled, rad, in (0, 2π).
    pub sweep: f64,
}

impl Arc {
    /// The arc from `start` through `via` to `end`; `None` where the three points lie on a line within rounding
    /// or two of them coincide.
    ///
    /// ```
    /// use meltpath_geometry::{arc::Arc, math::DVec3};
    /// let arc = Arc::through(DVec3::X, DVec3::Y, -DVec3::X).unwrap();
    /// assert!((arc.length() - std::f64::consts::PI).abs() < 1e-12);
    /// assert!((arc.at(0.5) - DVec3::Y).length() < 1e-12);
    /// ```
    pub fn through(start: DVec3, via: DVec3, end: DVec3) -> Option<Self> {
        let (a, b) = (via - start, end - start);
        let normal = a.cross(b);
        let (aa, bb, nn) = (
            a.length_squared(),
            b.length_squared(),
            normal.length_squared(),
        );
        let chord = (end - via).length_squared();
        if !nn.is_finite() || nn <= 1e-18 * aa * bb || aa == 0.0 || bb == 0.0 || chord == 0.0 {
            return None;
        }
        let centre = start + (b.cross(normal) * -aa + a.cross(normal) * bb) / (-2.0 * nn);
        let radial = start - centre;
        let radius = radial.length();
        let u = radial / radius;
        let v = normal.normalize().cross(u);
        let angle = |p: DVec3| {
            let d = p - centre;
            d.dot(v).atan2(d.dot(u)).rem_euclid(std::f64::consts::TAU)
        };
        // the normal orients the plane so that start, via, end turn positively
        let sweep = angle(end);
        (sweep > 0.0).then_some(Arc {
            centre,
            u,
            v,
            radius,
            sweep,
        })
    }

    /// The point at the share `t` of the way, 0 at the start and 1 at the end.
    pub fn at(&self, t: f64) -> DVec3 {
        let (sin, cos) = (t * self.sweep).sin_cos();
        self.centre + (self.u * cos + self.v * sin) * self.radius
    }

    /// Unit direction of travel at the share `t` of the way.
    pub fn tangent(&self, t: f64) -> DVec3 {
        let (sin, cos) = (t * self.sweep).sin_cos();
        self.v * cos - self.u * sin
    }

    /// Length, mm.
    pub fn length(&self) -> f64 {
        self.radius * self.sweep
    }

    /// How many equal chords keep within `chord_error` mm of the arc; at least 1.
    pub fn chords(&self, chord_error: f64) -> usize {
        let ratio = (1.0 - chord_error / self.radius).clamp(-1.0, 1.0);
        let step = 2.0 * ratio.acos();
        ((self.sweep / step.max(1e-6)).ceil() as usize).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_senses_and_large_sweeps() {
        let on = |deg: f64| {
            DVec3::new(deg.to_radians().cos(), deg.to_radians().sin(), 0.0) * 30.0
                + DVec3::new(5.0, 6.0, 7.0)
        };
        for (start, via, end, sweep) in [
            (0.0, 40.0, 90.0, 90.0),
            (90.0, 40.0, 0.0, 90.0),
            (0.0, 180.0, 300.0, 300.0),
            (10.0, -100.0, -200.0, 210.0),
        ] {
            let arc = Arc::through(on(start), on(via), on(end)).unwrap();
            assert!(
                (arc.sweep.to_degrees() - sweep).abs() < 1e-9,
                "{start} {via} {end}: {}",
                arc.sweep.to_degrees()
            );
            assert!((arc.radius - 30.0).abs() < 1e-9);
            assert!((arc.at(1.0) - on(end)).length() < 1e-9);
        }
    }

    #[test]
    fn lines_and_repeated_points_are_no_arcs() {
        assert!(Arc::through(DVec3::ZERO, DVec3::X, DVec3::X * 2.0).is_none());
        assert!(Arc::through(DVec3::ZERO, DVec3::ZERO, DVec3::X).is_none());
        assert!(Arc::through(DVec3::ZERO, DVec3::X, DVec3::ZERO).is_none());
    }

    #[test]
    fn the_tangent_points_along_the_travel() {
        let points = [
            DVec3::new(3.0, 1.0, 2.0),
            DVec3::new(5.0, -1.0, 4.0),
            DVec3::new(9.0, 2.0, 1.0),
        ];
        let arc = Arc::through(points[0], points[1], points[2]).unwrap();
        for k in 0..10 {
            let (t, h) = (0.1 * f64::from(k) + 0.05, 1e-6);
            let moved = arc.at(t + h) - arc.at(t - h);
            assert!((arc.tangent(t) - moved.normalize()).length() < 1e-6);
        }
    }

    #[test]
    fn chords_are_as_few_as_their_error_allows() {
        let arc = Arc::through(DVec3::X * 30.0, DVec3::Y * 30.0, -DVec3::X * 30.0).unwrap();
        for error in [0.5, 0.05, 0.002] {
            let n = arc.chords(error);
            let sag = |n: usize| arc.radius * (1.0 - (0.5 * arc.sweep / n as f64).cos());
            assert!(sag(n) <= error && sag(n - 1) > error, "{error}: {n}");
        }
        assert_eq!(arc.chords(100.0), 1);
    }
}
