//! A plane with its own axes: where sections live and how they map to space.

use serde::{Deserialize, Serialize};

use crate::math::{DVec2, DVec3};

/// An oriented plane: origin, unit normal and the unit in-plane x axis; y = normal × x.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// A point of the plane, mm; the origin of local coordinates.
    pub origin: DVec3,
    /// Unit normal, the local z axis.
    pub normal: DVec3,
    /// Unit vector in the plane, the local x axis.
    pub x: DVec3,
}

impl Plane {
    /// The plane z = `height` with local axes along the world's x and y.
    pub fn horizontal(height: f64) -> Self {
        Plane {
            origin: DVec3::new(0.0, 0.0, height),
            normal: DVec3::Z,
            x: DVec3::X,
        }
    }

    /// A plane through `origin` across `normal` (any length but zero); `None` if `normal` has no direction.
    ///
    /// The local x axis is the world x axis laid into the plane, or the world y axis where that degenerates,
    /// so that a horizontal plane has the world's axes.
    pub fn new(origin: DVec3, normal: DVec3) -> Option<Self> {
        let normal = normal.try_normalize()?;
        let seed = if normal.x.abs() < 0.9 {
            DVec3::X
        } else {
            DVec3::Y
        };
        let x = (seed - normal * seed.dot(normal)).try_normalize()?;
        Some(Plane { origin, normal, x })
    }

    /// The local y axis.
    pub fn y(&self) -> DVec3 {
        self.normal.cross(self.x)
    }

    /// Local coordinates of a point: in-plane x and y, and signed distance along the normal, mm.
    pub fn to_local(&self, p: DVec3) -> DVec3 {
        let d = p - self.origin;
        DVec3::new(d.dot(self.x), d.dot(self.y()), d.dot(self.normal))
    }

    /// The point of space at in-plane coordinates `p`.
    ///
    /// ```
    /// use meltpath_geometry::{Plane, math::{DVec2, DVec3}};
    /// let plane = Plane::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 1.0, 1.0)).unwrap();
    /// let p = plane.from_local(DVec2::new(4.0, 5.0));
    /// assert!((plane.to_local(p) - DVec3::new(4.0, 5.0, 0.0)).length() < 1e-12);
    /// ```
    #[allow(
        clippy::wrong_self_convention,
        reason = "the pair to_local / from_local reads as the house names transforms"
    )]
    pub fn from_local(&self, p: DVec2) -> DVec3 {
        self.origin + self.x * p.x + self.y() * p.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_right_handed_and_heights_count_along_the_normal() {
        for normal in [
            DVec3::Z,
            -DVec3::Z,
            DVec3::X,
            DVec3::new(0.3, -2.0, 0.4),
            DVec3::new(5.0, 0.1, 0.1),
        ] {
            let origin = DVec3::new(1.0, 2.0, 3.0);
            let plane = Plane::new(origin, normal).unwrap();
            assert!((plane.x.cross(plane.y()) - normal.normalize()).length() < 1e-12);
            let above = plane.from_local(DVec2::new(4.0, 5.0)) + 0.7 * normal.normalize();
            assert!((plane.to_local(above) - DVec3::new(4.0, 5.0, 0.7)).length() < 1e-12);
        }
        assert_eq!(
            Plane::new(DVec3::Z * 2.0, DVec3::Z * 9.0),
            Some(Plane::horizontal(2.0))
        );
        assert_eq!(Plane::new(DVec3::ZERO, DVec3::ZERO), None);
    }
}
