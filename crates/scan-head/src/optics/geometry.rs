//! From mirror angles to the point on the powder and back: two-axis heads in closed form, three-axis heads in closed form one
//! way and by Newton's method the other.
//!
//! Sources: Rasoanarivo 2020, eq. 2.36-2.45 (two axes), 2.39-2.43, 2.50 (three axes, after Godineau 2019). Angles are
//! mechanical, rad, as (θx, θy); points are mm in the work plane.

use meltpath_base::choice;
use meltpath_geometry::math::{DMat2, DVec2};
use serde::Serialize;

/// Why a point or an angle cannot be reached.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// A dimension that has no sense.
    #[error("{what} of the head is {value}, but must be {wanted}")]
    Parameter {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// An angle beyond the travel.
    #[error(
        "({x:.3}, {y:.3}) mm needs {angle_deg:.3} deg of the {axis} axis, whose travel is ±{travel_deg:.3} deg: move the job towards the centre of the field"
    )]
    Travel {
        /// `X`, `Y` or `Z`.
        axis: char,
        /// The point asked for, mm.
        x: f64,
        /// The point asked for, mm.
        y: f64,
        /// The angle, deg.
        angle_deg: f64,
        /// The travel, deg.
        travel_deg: f64,
    },
    /// The mirrors cannot steer there: the Jacobian has no inverse.
    #[error(
        "the head's Jacobian is singular at ({x_deg:.3}, {y_deg:.3}) deg: the mirrors move the spot in one direction only; check the assembly angles of the head"
    )]
    Singular {
        /// θx, deg.
        x_deg: f64,
        /// θy, deg.
        y_deg: f64,
    },
    /// The inverse did not settle.
    #[error(
        "no mirror angles were found for ({x:.3}, {y:.3}) mm: the point is out of the head's reach or its dimensions are wrong"
    )]
    OutOfReach {
        /// The point, mm.
        x: f64,
        /// The point, mm.
        y: f64,
    },
}

/// Mirrors before an F-theta objective, its distortion corrected: the spot moves in proportion to the angles (x = 2 f θx).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FTheta {
    /// Focal length of the objective, mm.
    pub focal_length: f64,
}

/// Two mirrors with perpendicular axes, the beam on both axes (eq. 2.36-2.38).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TwoAxis {
    /// D: from the Y mirror's axis to the work plane, mm.
    pub plane_distance: f64,
    /// e: between the mirrors, mm.
    pub mirror_distance: f64,
}

choice! {
    /// Which sign the term K1 tan 2θx of eq. 2.39 takes.
    pub enum PathSign {
        Traced "traced" => "Plus: the path between the mirrors adds to the lever, as ray tracing shows.",
        Printed "printed" => "Minus, as the thesis prints it (erratum 5).",
    }
}

/// Two mirrors whose axes lie off their surfaces, and two windows (eq. 2.39-2.43). The beam comes along +x at y = z = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ThreeAxis {
    /// (X_p, Y_p, Z_p): the work plane's origin, mm; Z_p is negative.
    pub plane: [f64; 3],
    /// (X_ax0, Y_ax0): the X mirror's axis, mm.
    pub x_axis: [f64; 2],
    /// A_ax0: the X mirror's angle at rest, rad.
    pub x_rest: f64,
    /// B_ax0: direction from the X mirror to the Y mirror, rad.
    pub x_tilt: f64,
    /// (Y_ay0, Z_ay0): the Y mirror's axis, mm.
    pub y_axis: [f64; 2],
    /// A_ay0: the Y mirror's angle at rest, rad.
    pub y_rest: f64,
    /// e_m: from a mirror's axis to its surface, mm.
    pub mirror_offset: f64,
    /// e_v: thickness of each of the two windows, mm.
    pub window: f64,
    /// n1: refractive index of the atmosphere.
    pub atmosphere_index: f64,
    /// n2: refractive index of the windows.
    pub window_index: f64,
    /// x of the objective on the incoming beam, mm.
    pub objective: f64,
    /// Sign of the term K1 tan 2θx.
    pub path_sign: PathSign,
}

/// A head's geometry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// Two axes, simple model.
    TwoAxis(TwoAxis),
    /// Behind an F-theta objective, corrected.
    FTheta(FTheta),
    /// Three axes, nominal model.
    ThreeAxis(ThreeAxis),
}

/// What the closed form of a three-axis head is made of at one pair of angles.
struct Terms {
    sx: f64,
    cx: f64,
    sy: f64,
    cy: f64,
    /// Hit of the X mirror along x.
    hit: f64,
    hit_slope: f64,
    k1: f64,
    k1_slope: f64,
    k2: f64,
    k2_slope: f64,
    k3: f64,
    sign: f64,
}

impl ThreeAxis {
    fn terms(&self, angles: DVec2) -> Terms {
        let (sx, cx) = (2.0 * angles.x).sin_cos();
        let (sy, cy) = (2.0 * angles.y).sin_cos();
        let (sa, ca) = (angles.x - self.x_rest).sin_cos();
        let (sb, cb) = self.x_tilt.sin_cos();
        let lever = self.mirror_offset - self.x_axis[1] * ca * sb;
        let (sv, cv) = (self.y_rest + angles.y).sin_cos();
        let (su, cu) = (self.y_rest - self.x_tilt + angles.y).sin_cos();
        let [y0, z0] = self.y_axis;
        let n = self.mirror_offset + z0 * cv - y0 * sv;
        let k1 = n / cu;
        let k1_slope = ((-z0 * sv - y0 * cv) * cu + n * su) / (cu * cu);
        let ratio = self.window_index / self.atmosphere_index;
        Terms {
            sx,
            cx,
            sy,
            cy,
            hit: self.x_axis[0] + lever / sa,
            hit_slope: (self.x_axis[1] * sa * sb * sa - lever * ca) / (sa * sa),
            k1,
            k1_slope,
            k2: self.plane[2] + 2.0 * self.window - k1 * cb,
            k2_slope: -k1_slope * cb,
            k3: (cx * cx * cy * cy - 1.0 + ratio * ratio).sqrt(),
            sign: match self.path_sign {
                PathSign::Traced => 1.0,
                PathSign::Printed => -1.0,
            },
        }
    }

    fn direct(&self, angles: DVec2) -> DVec2 {
        let t = self.terms(angles);
        let tx = t.sx / t.cx;
        let glass = 2.0 * self.window / t.k3;
        DVec2::new(
            -self.plane[0] + t.hit - t.k2 * tx / t.cy + t.sign * t.k1 * tx + glass * t.sx,
            -self.plane[1] - t.k1 * self.x_tilt.sin() - t.k2 * t.sy / t.cy + glass * t.cx * t.sy,
        )
    }

    fn jacobian(&self, angles: DVec2) -> DMat2 {
        let t = self.terms(angles);
        let (tx, ty) = (t.sx / t.cx, t.sy / t.cy);
        let e = 2.0 * self.window;
        let k3x = -2.0 * t.sx * t.cx * t.cy * t.cy / t.k3;
        let k3y = -2.0 * t.sy * t.cy * t.cx * t.cx / t.k3;
        let k3k3 = t.k3 * t.k3;
        let cx2 = t.cx * t.cx;
        let cy2 = t.cy * t.cy;
        let x_x = t.hit_slope - t.k2 * 2.0 / (cx2 * t.cy)
            + t.sign * t.k1 * 2.0 / cx2
            + e * (2.0 * t.cx / t.k3 - t.sx * k3x / k3k3);
        let x_y = -t.k2_slope * tx / t.cy - t.k2 * tx * 2.0 * t.sy / cy2 + t.sign * t.k1_slope * tx
            - e * t.sx * k3y / k3k3;
        let y_x = e * (-2.0 * t.sx * t.sy / t.k3 - t.cx * t.sy * k3x / k3k3);
        let y_y = -t.k1_slope * self.x_tilt.sin() - t.k2_slope * ty - t.k2 * 2.0 / cy2
            + e * t.cx * (2.0 * t.cy / t.k3 - t.sy * k3y / k3k3);
        DMat2::from_cols(DVec2::new(x_x, y_x), DVec2::new(x_y, y_y))
    }

    fn path(&self, angles: DVec2) -> f64 {
        let t = self.terms(angles);
        let ratio = self.window_index / self.atmosphere_index;
        (t.hit - self.objective).abs()
            + t.k1.abs() / t.cx
            + t.k2.abs() / (t.cx * t.cy)
            + 2.0 * self.window * ratio / t.k3
    }
}

impl Geometry {
    /// Checks every dimension.
    ///
    /// # Errors
    /// [`GeometryError::Parameter`].
    pub fn check(&self) -> Result<(), GeometryError> {
        let fail = |what, value, wanted| {
            Err(GeometryError::Parameter {
                what,
                value,
                wanted,
            })
        };
        match self {
            Geometry::TwoAxis(h) => {
                if !(h.plane_distance > 0.0 && h.plane_distance.is_finite()) {
                    return fail("the plane distance D", h.plane_distance, "positive");
                }
                if !(h.mirror_distance >= 0.0 && h.mirror_distance.is_finite()) {
                    return fail("the mirror distance e", h.mirror_distance, "not negative");
                }
            }
            Geometry::FTheta(h) => {
                if !(h.focal_length > 0.0 && h.focal_length.is_finite()) {
                    return fail("the focal length", h.focal_length, "positive");
                }
            }
            Geometry::ThreeAxis(h) => {
                if !(h.plane[2] < 0.0 && h.plane[2].is_finite()) {
                    return fail("the plane height Z_p", h.plane[2], "negative");
                }
                if !(h.window >= 0.0 && h.window.is_finite()) {
                    return fail("the window thickness e_v", h.window, "not negative");
                }
                for (what, n) in [
                    ("the refractive index of the atmosphere", h.atmosphere_index),
                    ("the refractive index of the windows", h.window_index),
                ] {
                    if !(1.0..5.0).contains(&n) {
                        return fail(what, n, "from 1 to 5");
                    }
                }
                for value in [
                    h.plane[0],
                    h.plane[1],
                    h.x_axis[0],
                    h.x_axis[1],
                    h.x_rest,
                    h.x_tilt,
                    h.y_axis[0],
                    h.y_axis[1],
                    h.y_rest,
                    h.mirror_offset,
                    h.objective,
                ] {
                    if !value.is_finite() {
                        return fail("a dimension", value, "finite");
                    }
                }
                if h.x_rest.sin().abs() < 1e-3 {
                    return fail(
                        "the X mirror's angle at rest A_ax0",
                        h.x_rest,
                        "away from 0 and π (the beam would graze it)",
                    );
                }
                if (h.y_rest - h.x_tilt).cos().abs() < 1e-3 {
                    return fail(
                        "A_ay0 − B_ax0",
                        h.y_rest - h.x_tilt,
                        "away from π/2 (the beam would graze the Y mirror)",
                    );
                }
            }
        }
        Ok(())
    }

    /// The point hit, mm, for mirror angles, rad (MGD).
    #[inline]
    pub fn direct(&self, angles: DVec2) -> DVec2 {
        match self {
            Geometry::TwoAxis(h) => DVec2::new(
                (h.plane_distance / (2.0 * angles.y).cos() + h.mirror_distance)
                    * (2.0 * angles.x).tan(),
                h.plane_distance * (2.0 * angles.y).tan(),
            ),
            Geometry::FTheta(h) => 2.0 * h.focal_length * angles,
            Geometry::ThreeAxis(h) => h.direct(angles),
        }
    }

    /// The derivatives of the point hit by the angles, mm/rad: columns ∂/∂θx, ∂/∂θy.
    pub fn jacobian(&self, angles: DVec2) -> DMat2 {
        match self {
            Geometry::TwoAxis(h) => {
                let (sy, cy) = (2.0 * angles.y).sin_cos();
                let (sx, cx) = (2.0 * angles.x).sin_cos();
                let lever = h.plane_distance / cy + h.mirror_distance;
                DMat2::from_cols(
                    DVec2::new(2.0 * lever / (cx * cx), 0.0),
                    DVec2::new(
                        2.0 * h.plane_distance * sy / (cy * cy) * sx / cx,
                        2.0 * h.plane_distance / (cy * cy),
                    ),
                )
            }
            Geometry::FTheta(h) => DMat2::from_diagonal(DVec2::splat(2.0 * h.focal_length)),
            Geometry::ThreeAxis(h) => h.jacobian(angles),
        }
    }

    /// The inverse of [`Geometry::jacobian`], rad/mm.
    ///
    /// # Errors
    /// [`GeometryError::Singular`].
    fn inverse_jacobian(&self, angles: DVec2) -> Result<DMat2, GeometryError> {
        let j = self.jacobian(angles);
        let scale = j.x_axis.length() * j.y_axis.length();
        let determinant = j.determinant().abs();
        if determinant.is_nan() || determinant <= 1e-9 * scale {
            return Err(GeometryError::Singular {
                x_deg: angles.x.to_degrees(),
                y_deg: angles.y.to_degrees(),
            });
        }
        Ok(j.inverse())
    }

    /// The mirror angles, rad, for a point, mm (MGI).
    ///
    /// # Errors
    /// [`GeometryError::OutOfReach`], [`GeometryError::Singular`].
    pub fn inverse(&self, point: DVec2) -> Result<DVec2, GeometryError> {
        self.inverse_counted(point).map(|(angles, _)| angles)
    }

    /// The mirror angles and the number of Newton steps they took (0 in closed form).
    ///
    /// # Errors
    /// As [`Geometry::inverse`].
    pub fn inverse_counted(&self, point: DVec2) -> Result<(DVec2, u32), GeometryError> {
        let lost = GeometryError::OutOfReach {
            x: point.x,
            y: point.y,
        };
        if !point.is_finite() {
            return Err(lost);
        }
        match self {
            Geometry::TwoAxis(h) => {
                let d = h.plane_distance;
                let angles = DVec2::new(
                    0.5 * (point.x / (point.y.hypot(d) + h.mirror_distance)).atan(),
                    0.5 * (point.y / d).atan(),
                );
                Ok((angles, 0))
            }
            Geometry::FTheta(h) => Ok((point / (2.0 * h.focal_length), 0)),
            Geometry::ThreeAxis(h) => {
                let mut angles = point / (2.0 * h.plane[2].abs());
                for step in 1..=20 {
                    let error = point - h.direct(angles);
                    if error.length() < 1e-10 {
                        return Ok((angles, step - 1));
                    }
                    let move_by = self.inverse_jacobian(angles)? * error;
                    if !move_by.is_finite() || move_by.length() > 1.0 {
                        return Err(lost);
                    }
                    angles += move_by;
                }
                // rounding of large fields may stay above the goal by little
                if (point - h.direct(angles)).length() < 1e-8 {
                    Ok((angles, 20))
                } else {
                    Err(lost)
                }
            }
        }
    }

    /// The mirror angles for a point, refused beyond the travels (rad) of the two axes.
    ///
    /// # Errors
    /// As [`Geometry::inverse`], and [`GeometryError::Travel`].
    pub fn inverse_within(&self, point: DVec2, travel: DVec2) -> Result<DVec2, GeometryError> {
        let angles = self.inverse(point)?;
        for (axis, angle, limit) in [('X', angles.x, travel.x), ('Y', angles.y, travel.y)] {
            if angle.abs() > limit {
                return Err(GeometryError::Travel {
                    axis,
                    x: point.x,
                    y: point.y,
                    angle_deg: angle.to_degrees(),
                    travel_deg: limit.to_degrees(),
                });
            }
        }
        Ok(angles)
    }

    /// The length of the beam's path to the plane, mm: from the X mirror (two axes, eq. 2.38) or from the objective
    /// (three axes, eq. 2.50; F-theta: the field is flat).
    pub fn path(&self, angles: DVec2) -> f64 {
        match self {
            Geometry::TwoAxis(h) => {
                (h.mirror_distance + h.plane_distance / (2.0 * angles.y).cos())
                    / (2.0 * angles.x).cos()
            }
            Geometry::FTheta(h) => h.focal_length,
            Geometry::ThreeAxis(h) => h.path(angles),
        }
    }
}
