//! Dynamic focusing: a fixed converging objective and one diverging lens moved by a cam, and the height of the focus.
//!
//! Source: Rasoanarivo 2020, eq. 2.46-2.52. Thin lenses, collimated input, image focal lengths; windows are taken not to
//! change the beam's shape.

use meltpath_base::choice;
use meltpath_geometry::math::DVec2;
use serde::Serialize;

use crate::optics::geometry::{Geometry, GeometryError};

choice! {
    /// How a distance along the ray becomes a height.
    pub enum FocusProjection {
        Exact "exact" => "By the ray's vertical component, cos 2θx cos 2θy.",
        Thesis "thesis" => "By cos 2θy alone, as the thesis has it (eq. 2.49, erratum 6).",
    }
}

/// The lens pair and its cam.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lenses {
    /// f_s: image focal length of the fixed objective, positive, mm.
    pub objective: f64,
    /// f_D: image focal length of the moving lens, negative, mm.
    pub moving: f64,
    /// R_C: cam radius, mm.
    pub cam_radius: f64,
    /// θ_z0: cam angle at rest, rad.
    pub rest_angle: f64,
    /// How a distance along the ray becomes a height.
    pub projection: FocusProjection,
}

/// A dynamic focus module fitted to a head: at rest it focuses on the plane at the centre of the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focus {
    lenses: Lenses,
    geometry: Geometry,
    rest_spacing: f64,
}

impl Lenses {
    /// The focus distance from the objective, mm, for a lens spacing λ, mm (eq. 2.48).
    pub fn focus_distance(&self, spacing: f64) -> f64 {
        (self.moving - spacing) * self.objective / (self.objective + self.moving - spacing)
    }

    /// The lens spacing λ, mm, for a focus distance, mm (eq. 2.47).
    pub fn spacing(&self, focus_distance: f64) -> f64 {
        (focus_distance * (self.objective + self.moving) - self.objective * self.moving)
            / (focus_distance - self.objective)
    }
}

impl Focus {
    /// Fits the lenses to the head: the spacing at rest is the one that focuses at the centre of the field.
    ///
    /// # Errors
    /// [`GeometryError::Parameter`] where a focal length or the cam has no sense.
    pub fn new(lenses: Lenses, geometry: Geometry) -> Result<Self, GeometryError> {
        let fail = |what, value, wanted| {
            Err(GeometryError::Parameter {
                what,
                value,
                wanted,
            })
        };
        let path = geometry.path(geometry.inverse(DVec2::ZERO)?);
        if !(lenses.objective > 0.0 && lenses.objective < path) {
            return fail(
                "the objective's focal length",
                lenses.objective,
                "positive and shorter than the path to the plane",
            );
        }
        if !(lenses.moving < 0.0 && lenses.moving.is_finite()) {
            return fail("the moving lens' focal length", lenses.moving, "negative");
        }
        if !(lenses.cam_radius.abs() > 0.0 && lenses.cam_radius.is_finite()) {
            return fail("the cam radius", lenses.cam_radius, "not zero");
        }
        Ok(Focus {
            lenses,
            geometry,
            rest_spacing: lenses.spacing(path),
        })
    }

    /// The lens pair.
    pub fn lenses(&self) -> &Lenses {
        &self.lenses
    }

    fn projection(&self, angles: DVec2) -> f64 {
        let cy = (2.0 * angles.y).cos();
        match self.lenses.projection {
            FocusProjection::Exact => (2.0 * angles.x).cos() * cy,
            FocusProjection::Thesis => cy,
        }
    }

    /// The focus distance from the objective, mm, for a cam angle, rad.
    pub fn focus_distance(&self, cam: f64) -> f64 {
        let spacing = self.rest_spacing + self.lenses.cam_radius * (cam - self.lenses.rest_angle);
        self.lenses.focus_distance(spacing)
    }

    /// The height of the focus over the plane, mm, for mirror and cam angles, rad (DFM).
    #[inline]
    pub fn direct(&self, angles: DVec2, cam: f64) -> f64 {
        (self.geometry.path(angles) - self.focus_distance(cam)) * self.projection(angles)
    }

    /// The cam angle, rad, that puts the focus at height `z` mm for the mirror angles, rad (DFMI).
    pub fn inverse(&self, angles: DVec2, z: f64) -> f64 {
        let distance = self.geometry.path(angles) - z / self.projection(angles);
        let spacing = self.lenses.spacing(distance);
        (spacing - self.rest_spacing) / self.lenses.cam_radius + self.lenses.rest_angle
    }
}
