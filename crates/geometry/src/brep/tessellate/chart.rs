//! A face's surface as a parameter plane: periods, poles and the way between points and parameters.

use crate::brep::{Face, Pole, Sense, Surface};
use crate::math::{DVec2, DVec3};

/// The parameter plane of one face.
#[derive(Debug)]
pub(super) struct Chart<'a> {
    pub(super) surface: &'a Surface,
    pub(super) sense: Sense,
    pub(super) periods: [Option<f64>; 2],
    pub(super) poles: Vec<Pole>,
    pub(super) domain: [[f64; 2]; 2],
    /// Distance within which points are one, mm.
    pub(super) gap: f64,
}

impl<'a> Chart<'a> {
    pub(super) fn new(face: &'a Face, uncertainty: f64) -> Self {
        let gap = (10.0 * uncertainty).max(1e-5);
        let surface = face.surface.as_ref();
        Self {
            surface,
            sense: face.sense,
            periods: surface.periods(gap),
            poles: surface.poles(gap),
            domain: surface.domain(),
            gap,
        }
    }

    /// Parameters brought back into the surface's domain where it repeats.
    pub(super) fn wrapped(&self, uv: DVec2) -> DVec2 {
        let one = |x: f64, d: usize| match self.periods[d] {
            Some(period) => {
                let [lo, hi] = self.domain[d];
                if lo.is_finite() && !(lo..=hi).contains(&x) {
                    lo + (x - lo).rem_euclid(period)
                } else {
                    x
                }
            }
            None => x,
        };
        DVec2::new(one(uv.x, 0), one(uv.y, 1))
    }

    /// Point at parameters anywhere in the plane.
    pub(super) fn point(&self, uv: DVec2) -> DVec3 {
        self.surface.point(self.wrapped(uv))
    }

    /// Point and derivatives at parameters anywhere in the plane.
    pub(super) fn tangents(&self, uv: DVec2) -> [DVec3; 3] {
        self.surface.tangents(self.wrapped(uv))
    }

    /// Parameters of a point, in the copy of the domain nearest to `near`.
    pub(super) fn locate(&self, p: DVec3, near: Option<DVec2>) -> DVec2 {
        let guess = near.map(|uv| self.wrapped(uv));
        let uv = self.surface.locate(p, guess, self.gap);
        near.map_or(uv, |near| self.shifted(uv, near))
    }

    /// The copy of parameters nearest to `near`.
    pub(super) fn shifted(&self, uv: DVec2, near: DVec2) -> DVec2 {
        let one = |x: f64, near: f64, d: usize| match self.periods[d] {
            Some(period) => x + period * ((near - x) / period).round(),
            None => x,
        };
        DVec2::new(one(uv.x, near.x, 0), one(uv.y, near.y, 1))
    }

    /// The pole at a point.
    pub(super) fn pole_at(&self, p: DVec3) -> Option<&Pole> {
        self.poles
            .iter()
            .find(|pole| pole.point.distance(p) <= self.gap)
    }

    /// Whether faces may lie on this surface without any boundary.
    pub(super) fn is_compact(&self) -> bool {
        match self.periods {
            [Some(_), Some(_)] => true,
            [Some(_), None] => self.poles.iter().filter(|p| p.fixed == 1).count() >= 2,
            [None, Some(_)] => self.poles.iter().filter(|p| p.fixed == 0).count() >= 2,
            [None, None] => false,
        }
    }
}
