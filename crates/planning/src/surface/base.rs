//! What a wall stands on: a plane, a cylinder, or any body of revolution.

use meltpath_geometry::math::DVec3;

use super::error::SurfaceError;

/// What a wall stands on.
#[derive(Debug, Clone, PartialEq)]
pub enum Base {
    /// A plane; the wall grows towards its normal.
    Plane {
        /// A point of it, mm.
        origin: DVec3,
        /// Its normal; of any length but zero.
        normal: DVec3,
    },
    /// A cylinder; the wall grows away from its axis.
    Cylinder {
        /// A point of its axis, mm.
        origin: DVec3,
        /// Along its axis; of any length but zero.
        axis: DVec3,
        /// Radius, mm.
        radius: f64,
    },
    /// A body of revolution with flat ends; the wall grows away from it.
    Revolution {
        /// The point of its axis that the profile counts from, mm.
        origin: DVec3,
        /// Along its axis; of any length but zero.
        axis: DVec3,
        /// Its profile: how far along the axis, ever farther, and the radius there, mm; straight between.
        profile: Vec<[f64; 2]>,
    },
}

impl Base {
    /// A point of the plane or of the axis, mm.
    pub fn origin(&self) -> DVec3 {
        match self {
            Base::Plane { origin, .. }
            | Base::Cylinder { origin, .. }
            | Base::Revolution { origin, .. } => *origin,
        }
    }

    /// The signed distance of a point, mm: above zero where the wall grows.
    ///
    /// ```
    /// use meltpath_geometry::math::DVec3;
    /// use meltpath_planning::surface::Base;
    /// // a cone, 30 mm wide at its foot and 10 mm at its top
    /// let cone = Base::Revolution {
    ///     origin: DVec3::ZERO,
    ///     axis: DVec3::Z,
    ///     profile: vec![[0.0, 30.0], [20.0, 10.0]],
    /// };
    /// let away = cone.distance(DVec3::new(30.0, 0.0, 10.0));
    /// assert!((away - 10.0 / 2.0_f64.sqrt()).abs() < 1e-12);
    /// ```
    pub fn distance(&self, p: DVec3) -> f64 {
        match self {
            Base::Plane { origin, normal } => (p - *origin).dot(normal.normalize_or_zero()),
            Base::Cylinder {
                origin,
                axis,
                radius,
            } => (p - *origin).reject_from(*axis).length() - radius,
            Base::Revolution {
                origin,
                axis,
                profile,
            } => {
                let axis = axis.normalize_or_zero();
                let along = (p - *origin).dot(axis);
                let radius = (p - *origin - along * axis).length();
                beside_profile(profile, [along, radius])
            }
        }
    }

    pub(super) fn check(&self) -> Result<(), SurfaceError> {
        let above = |name: &'static str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(SurfaceError::Setting { name, value })
            }
        };
        let direction = match self {
            Base::Plane { normal, .. } => normal,
            Base::Cylinder { axis, .. } | Base::Revolution { axis, .. } => axis,
        };
        above(
            "the length of the direction of the base",
            direction.length(),
        )?;
        match self {
            Base::Plane { .. } => Ok(()),
            Base::Cylinder { radius, .. } => above("the radius of the base", *radius),
            Base::Revolution { profile, .. } => check_profile(profile),
        }
    }
}

fn check_profile(profile: &[[f64; 2]]) -> Result<(), SurfaceError> {
    let finite = profile.iter().flatten().all(|v| v.is_finite());
    if profile.len() < 2 || !finite {
        return Err(SurfaceError::Profile {
            place: profile.len(),
            what: "two or more places with a radius each are a profile",
        });
    }
    let back = profile.windows(2).position(|w| w[1][0] <= w[0][0]);
    if let Some(place) = back {
        return Err(SurfaceError::Profile {
            place: place + 2,
            what: "it lies no farther along the axis than the one before",
        });
    }
    let last = profile.len() - 1;
    let hollow = |(i, [_, radius]): (usize, &[f64; 2])| {
        let end = i == 0 || i == last;
        *radius < 0.0 || (*radius == 0.0 && (!end || last == 1 && profile[last - i][1] == 0.0))
    };
    match profile.iter().enumerate().position(hollow) {
        Some(place) => Err(SurfaceError::Profile {
            place: place + 1,
            what: "its radius is not above zero (a tip may be zero at either end)",
        }),
        None => Ok(()),
    }
}

/// The signed distance of a place along and beside the axis from a body of revolution, mm.
fn beside_profile(profile: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let (Some(&first), Some(&last)) = (profile.first(), profile.last()) else {
        return f64::INFINITY;
    };
    let ends = [[[first[0], 0.0], first], [last, [last[0], 0.0]]];
    let sides = profile.windows(2).map(|w| [w[0], w[1]]);
    let near = sides
        .chain(ends)
        .map(|side| from_side(p, side))
        .fold(f64::INFINITY, f64::min);
    let inside = profile.windows(2).any(|w| {
        let share = (p[0] - w[0][0]) / (w[1][0] - w[0][0]);
        (0.0..=1.0).contains(&share) && p[1] < w[0][1] + share * (w[1][1] - w[0][1])
    });
    if inside { -near } else { near }
}

/// The distance of a place from a straight side, mm.
fn from_side(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let way = [b[0] - a[0], b[1] - a[1]];
    let of = [p[0] - a[0], p[1] - a[1]];
    let length = way[0] * way[0] + way[1] * way[1];
    let share = if length > 0.0 {
        ((of[0] * way[0] + of[1] * way[1]) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (of[0] - share * way[0]).hypot(of[1] - share * way[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(profile: &[[f64; 2]]) -> Base {
        Base::Revolution {
            origin: DVec3::new(1.0, 2.0, 3.0),
            axis: DVec3::new(0.0, 0.0, 2.0),
            profile: profile.to_vec(),
        }
    }

    /// A ball of facets: distances are those of the ball but for its facets, inside and outside.
    #[test]
    fn a_ball_of_facets_is_as_far_as_a_ball() {
        let facets = 400_u32;
        let at = |i: u32| std::f64::consts::PI * f64::from(i) / f64::from(facets);
        let profile: Vec<_> = (0..=facets)
            .map(|i| [-10.0 * at(i).cos(), (10.0 * at(i).sin()).max(0.0)])
            .collect();
        let mut profile = profile;
        profile[facets as usize][1] = 0.0;
        let ball = body(&profile);
        ball.check().unwrap();
        for p in [
            [0.0, 0.0, 0.0],
            [3.0, 4.0, -5.0],
            [30.0, -4.0, 7.0],
            [0.0, 0.0, 25.0],
        ] {
            let p = DVec3::from_array(p);
            let told = ball.distance(p + ball.origin());
            assert!((told - (p.length() - 10.0)).abs() < 1e-3, "{p} {told}");
        }
    }

    #[test]
    fn ends_are_flat() {
        let disc = body(&[[0.0, 20.0], [5.0, 20.0]]);
        let from = |p: [f64; 3]| disc.distance(disc.origin() + DVec3::from_array(p));
        assert!((from([3.0, 0.0, 9.0]) - 4.0).abs() < 1e-12);
        assert!((from([0.0, 23.0, 9.0]) - 5.0).abs() < 1e-12);
        assert!((from([0.0, 18.5, 3.0]) + 1.5).abs() < 1e-12);
    }

    #[test]
    fn profiles_that_are_none_are_refused() {
        for (profile, place) in [
            (vec![[0.0, 20.0]], 1),
            (vec![[0.0, 20.0], [0.0, 10.0]], 2),
            (vec![[0.0, 20.0], [5.0, 0.0], [9.0, 3.0]], 2),
            (vec![[0.0, 0.0], [5.0, 0.0]], 1),
            (vec![[0.0, -1.0], [5.0, 2.0]], 1),
        ] {
            match body(&profile).check() {
                Err(SurfaceError::Profile { place: told, .. }) => assert_eq!(told, place),
                other => panic!("{profile:?}: {other:?}"),
            }
        }
        body(&[[0.0, 0.0], [5.0, 4.0], [9.0, 0.0]]).check().unwrap();
    }
}
