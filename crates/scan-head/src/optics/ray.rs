//! A ray tracer for two-mirror heads: mirrors anywhere, about any axes, and flat windows. It checks the closed forms, and
//! serves heads they do not cover (axes not perpendicular, any incidence: Manakov 2011).
//!
//! Geometric optics; source of the three-axis layout: Rasoanarivo 2020, § 2.3.1.2, rebuilt from its equations 2.39-2.43.

use meltpath_geometry::math::{DMat2, DQuat, DVec2, DVec3};

use crate::optics::geometry::{GeometryError, ThreeAxis};

/// A flat mirror that turns about an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirror {
    /// A point of the axis, mm.
    pub centre: DVec3,
    /// The axis, unit.
    pub axis: DVec3,
    /// The surface's normal at angle 0, unit.
    pub normal: DVec3,
    /// From the axis to the surface along the normal, mm.
    pub offset: f64,
}

/// A flat window parallel to the work plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Height of its upper face, mm.
    pub top: f64,
    /// Thickness, mm.
    pub thickness: f64,
    /// Refractive index over that of the atmosphere.
    pub index_ratio: f64,
}

/// A head for the ray tracer.
#[derive(Debug, Clone, PartialEq)]
pub struct RayHead {
    /// Where the beam starts (the objective), mm.
    pub source: DVec3,
    /// Its direction, unit.
    pub direction: DVec3,
    /// The two mirrors, first hit first.
    pub mirrors: [Mirror; 2],
    /// Windows from the top down.
    pub windows: Vec<Window>,
    /// Origin of the work plane, whose normal is +z, mm.
    pub plane: DVec3,
}

/// A traced ray.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The points from the source to the plane, mm.
    pub points: Vec<DVec3>,
    /// The hit in the plane, mm.
    pub hit: DVec2,
    /// Length of the path, mm (geometric, also in glass).
    pub length: f64,
}

impl Mirror {
    /// Where the ray meets the mirror turned by `angle`, and its direction after.
    fn reflect(&self, angle: f64, from: DVec3, along: DVec3) -> Option<(DVec3, DVec3)> {
        let normal = DQuat::from_axis_angle(self.axis, angle) * self.normal;
        let approach = along.dot(normal);
        let distance = (self.offset - (from - self.centre).dot(normal)) / approach;
        (approach.abs() > 1e-12 && distance.is_finite())
            .then(|| (from + along * distance, along - normal * (2.0 * approach)))
    }
}

impl RayHead {
    /// Traces the beam for two mirror angles, rad.
    ///
    /// # Errors
    /// [`GeometryError::OutOfReach`] where the beam misses a mirror or the plane.
    pub fn trace(&self, angles: DVec2) -> Result<Trace, GeometryError> {
        let lost = GeometryError::OutOfReach {
            x: f64::NAN,
            y: f64::NAN,
        };
        let mut points = vec![self.source];
        let (mut at, mut along) = (self.source, self.direction);
        for (mirror, angle) in self.mirrors.iter().zip([angles.x, angles.y]) {
            (at, along) = mirror.reflect(angle, at, along).ok_or(lost)?;
            points.push(at);
        }
        let mut down = |at: &mut DVec3, along: DVec3, height: f64| {
            *at += along * ((height - at.z) / along.z);
            points.push(*at);
        };
        if along.z.is_nan() || along.z >= -1e-9 {
            return Err(lost);
        }
        for window in &self.windows {
            down(&mut at, along, window.top);
            let inside = refract(along, window.index_ratio).ok_or(lost)?;
            down(&mut at, inside, window.top - window.thickness);
        }
        down(&mut at, along, self.plane.z);
        let length = points.windows(2).map(|p| p[0].distance(p[1])).sum();
        Ok(Trace {
            hit: (at - self.plane).truncate(),
            length,
            points,
        })
    }

    /// The mirror angles, rad, for a point, mm, by Newton's method with differences.
    ///
    /// # Errors
    /// [`GeometryError::OutOfReach`], [`GeometryError::Singular`].
    pub fn inverse(&self, point: DVec2) -> Result<DVec2, GeometryError> {
        let mut angles = DVec2::ZERO;
        let h = 1e-6;
        for _ in 0..50 {
            let error = point - self.trace(angles)?.hit;
            if error.length() < 1e-9 {
                return Ok(angles);
            }
            let slope = |d: DVec2| -> Result<DVec2, GeometryError> {
                Ok((self.trace(angles + d)?.hit - self.trace(angles - d)?.hit) / (2.0 * h))
            };
            let j = DMat2::from_cols(slope(DVec2::X * h)?, slope(DVec2::Y * h)?);
            let determinant = j.determinant().abs();
            if determinant.is_nan() || determinant <= 1e-9 * j.x_axis.length() * j.y_axis.length() {
                return Err(GeometryError::Singular {
                    x_deg: angles.x.to_degrees(),
                    y_deg: angles.y.to_degrees(),
                });
            }
            angles += j.inverse() * error;
        }
        Err(GeometryError::OutOfReach {
            x: point.x,
            y: point.y,
        })
    }
}

/// The direction inside a medium of relative index `ratio` under a horizontal face.
fn refract(along: DVec3, ratio: f64) -> Option<DVec3> {
    let flat = along.truncate() / ratio;
    let rest = 1.0 - flat.length_squared();
    (rest > 0.0).then(|| flat.extend(-rest.sqrt()))
}

impl ThreeAxis {
    /// The same head for the ray tracer.
    pub fn to_rays(&self) -> RayHead {
        let (sb, cb) = self.x_tilt.sin_cos();
        let between = DVec3::new(0.0, -sb, cb);
        let height = self.plane[2];
        let ratio = self.window_index / self.atmosphere_index;
        RayHead {
            source: DVec3::X * self.objective,
            direction: DVec3::X,
            mirrors: [
                Mirror {
                    centre: DVec3::new(self.x_axis[0], self.x_axis[1], 0.0),
                    axis: between.cross(DVec3::X),
                    normal: DQuat::from_axis_angle(between.cross(DVec3::X), -self.x_rest) * between,
                    offset: self.mirror_offset,
                },
                Mirror {
                    centre: DVec3::new(0.0, self.y_axis[0], self.y_axis[1]),
                    axis: DVec3::X,
                    normal: DQuat::from_axis_angle(DVec3::X, self.y_rest) * DVec3::Z,
                    offset: self.mirror_offset,
                },
            ],
            windows: [0.4, 0.6]
                .map(|share| Window {
                    top: share * height,
                    thickness: self.window,
                    index_ratio: ratio,
                })
                .to_vec(),
            plane: DVec3::from_array(self.plane),
        }
    }
}
