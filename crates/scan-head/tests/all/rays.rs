//! A ray tracer for two-mirror heads: mirrors anywhere, about any axes, and flat windows. The closed forms are held to
//! it (axes not perpendicular, any incidence: Manakov 2011).
//!
//! Geometric optics; source of the three-axis layout: Rasoanarivo 2020, § 2.3.1.2, rebuilt from its equations 2.39-2.43.

use meltpath_geometry::math::{DMat2, DQuat, DVec2, DVec3};

use meltpath_scan_head::optics::geometry::{GeometryError, ThreeAxis};

/// A flat mirror that turns about an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mirror {
    /// A point of the axis, mm.
    pub(crate) centre: DVec3,
    /// The axis, unit.
    pub(crate) axis: DVec3,
    /// The surface's normal at angle 0, unit.
    pub(crate) normal: DVec3,
    /// From the axis to the surface along the normal, mm.
    pub(crate) offset: f64,
}

/// A flat window parallel to the work plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    /// Height of its upper face, mm.
    pub(crate) top: f64,
    /// Thickness, mm.
    pub(crate) thickness: f64,
    /// Refractive index over that of the atmosphere.
    pub(crate) index_ratio: f64,
}

/// A head for the ray tracer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RayHead {
    /// Where the beam starts (the objective), mm.
    pub(crate) source: DVec3,
    /// Its direction, unit.
    pub(crate) direction: DVec3,
    /// The two mirrors, first hit first.
    pub(crate) mirrors: [Mirror; 2],
    /// Windows from the top down.
    pub(crate) windows: Vec<Window>,
    /// Origin of the work plane, whose normal is +z, mm.
    pub(crate) plane: DVec3,
}

/// A traced ray.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trace {
    /// The points from the source to the plane, mm.
    pub(crate) points: Vec<DVec3>,
    /// The hit in the plane, mm.
    pub(crate) hit: DVec2,
    /// Length of the path, mm (geometric, also in glass).
    pub(crate) length: f64,
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
    pub(crate) fn trace(&self, angles: DVec2) -> Result<Trace, GeometryError> {
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
    pub(crate) fn inverse(&self, point: DVec2) -> Result<DVec2, GeometryError> {
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

/// A head for the ray tracer.
pub(crate) fn rays_of(head: &ThreeAxis) -> RayHead {
    let (sb, cb) = head.x_tilt.sin_cos();
    let between = DVec3::new(0.0, -sb, cb);
    let height = head.plane[2];
    let ratio = head.window_index / head.atmosphere_index;
    RayHead {
        source: DVec3::X * head.objective,
        direction: DVec3::X,
        mirrors: [
            Mirror {
                centre: DVec3::new(head.x_axis[0], head.x_axis[1], 0.0),
                axis: between.cross(DVec3::X),
                normal: DQuat::from_axis_angle(between.cross(DVec3::X), -head.x_rest) * between,
                offset: head.mirror_offset,
            },
            Mirror {
                centre: DVec3::new(0.0, head.y_axis[0], head.y_axis[1]),
                axis: DVec3::X,
                normal: DQuat::from_axis_angle(DVec3::X, head.y_rest) * DVec3::Z,
                offset: head.mirror_offset,
            },
        ],
        windows: [0.4, 0.6]
            .map(|share| Window {
                top: share * height,
                thickness: head.window,
                index_ratio: ratio,
            })
            .to_vec(),
        plane: DVec3::from_array(head.plane),
    }
}
