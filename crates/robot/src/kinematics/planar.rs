//! Two links in a plane that reach for a point: shoulder and elbow of every arm.

use std::f64::consts::{PI, TAU};

use meltpath_geometry::math::DVec3;

use super::angles::whole;
use super::solution::Unreachable;

/// Distances that rounding may put beyond the reach, mm.
pub(super) const ROUNDING: f64 = 5e-7;

/// Points nearer to the shoulder or to the first axis, mm, count as on it: a root or a direction that takes half of the digits.
pub(super) const ON_SHOULDER: f64 = 1e-4;

/// Below this the sine of an angle counts as zero: the arm is stretched or folded.
pub(super) const STRAIGHT: f64 = 1e-6;

/// The two ways in which the links reach the point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elbow {
    /// Angle of the first link for the elbow bent to the positive side, then to the negative, rad.
    pub(super) first: [f64; 2],
    /// Angle between the links, rad, likewise.
    pub(super) bend: [f64; 2],
    /// Whether stretched or folded: both ways are one.
    pub(super) straight: bool,
    /// Whether folded with the point on the shoulder: the first angle is free.
    pub(super) folded: bool,
}

/// Where the centre of the wrist lies about the first axis, for an arm whose plane stands aside of that axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shoulder {
    /// From the first axis to the centre within the arm's plane, mm.
    pub(super) forward: f64,
    /// The direction of the centre in the base, rad from x.
    pub(super) towards: f64,
    /// Whether front and back are one.
    pub(super) singular: bool,
}

impl Shoulder {
    /// For a plane `offset` mm aside.
    ///
    /// # Errors
    /// [`Unreachable::BesideAxis`] where the centre is nearer to the axis than the plane.
    pub(super) fn under(centre: DVec3, offset: f64) -> Result<Self, Unreachable> {
        let out = centre.x.hypot(centre.y);
        let by = offset.abs() - out;
        if by > ROUNDING {
            return Err(Unreachable::BesideAxis { by });
        }
        let forward = ((out - offset) * (out + offset)).max(0.0).sqrt();
        Ok(Shoulder {
            forward,
            towards: centre.y.atan2(centre.x),
            singular: forward < ON_SHOULDER,
        })
    }
}

/// Links of `lengths` mm from the origin to the point (x, y) mm: x = l₁ cos α + l₂ cos(α + β), y likewise with sines.
///
/// # Errors
/// [`Unreachable`] by how much the point is farther than both links stretched, or nearer than both folded.
pub(super) fn reach([l1, l2]: [f64; 2], [x, y]: [f64; 2]) -> Result<Elbow, Unreachable> {
    let distance = x.hypot(y);
    if distance > l1 + l2 + ROUNDING {
        let by = distance - l1 - l2;
        return Err(Unreachable::TooFar { by });
    }
    if distance < (l1 - l2).abs() - ROUNDING {
        let by = (l1 - l2).abs() - distance;
        return Err(Unreachable::TooNear { by });
    }
    // (d² - l₁² - l₂²)/2 l₁ l₂ by half angles: no digits are lost where the links are stretched or folded
    let over = ((l1 + l2 - distance) * (l1 + l2 + distance)).max(0.0);
    let under = ((distance - (l1 - l2)) * (distance + (l1 - l2))).max(0.0);
    let bend = 2.0 * over.sqrt().atan2(under.sqrt());
    let (sine, cosine) = bend.sin_cos();
    let towards = y.atan2(x);
    let aside = (l2 * sine).atan2(l1 + l2 * cosine);
    let folded = distance < ON_SHOULDER;
    let first = [towards - aside, towards + aside];
    Ok(Elbow {
        first,
        bend: [bend, -bend],
        straight: sine.abs() < STRAIGHT,
        folded,
    })
}

/// An angle in (-π, π], rad.
pub(super) fn wrapped(angle: f64) -> f64 {
    let turned = angle - TAU * whole(angle / TAU);
    if turned <= -PI { turned + TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn end([l1, l2]: [f64; 2], first: f64, bend: f64) -> [f64; 2] {
        [
            l1 * first.cos() + l2 * (first + bend).cos(),
            l1 * first.sin() + l2 * (first + bend).sin(),
        ]
    }

    proptest! {
        #[test]
        fn both_ways_reach_the_point(l1 in 100.0..900.0, l2 in 100.0..900.0, a in -3.0..3.0, b in -3.1..3.1) {
            let lengths = [l1, l2];
            let point = end(lengths, a, b);
            let elbow = reach(lengths, point).unwrap();
            for i in 0..2 {
                let found = end(lengths, elbow.first[i], elbow.bend[i]);
                prop_assert!((found[0] - point[0]).hypot(found[1] - point[1]) < 1e-10);
            }
            let again = (0..2).any(|i| (elbow.bend[i] - b).abs() < 1e-9);
            prop_assert!(again, "{b} {elbow:?}");
        }
    }

    #[test]
    fn what_is_out_of_reach_is_measured() {
        assert_eq!(
            reach([3.0, 2.0], [6.0, 0.0]).unwrap_err(),
            Unreachable::TooFar { by: 1.0 }
        );
        assert_eq!(
            reach([3.0, 2.0], [0.0, 0.25]).unwrap_err(),
            Unreachable::TooNear { by: 0.75 }
        );
        assert!(reach([3.0, 3.0], [0.0, 0.0]).unwrap().folded);
        assert!(reach([3.0, 2.0], [5.0, 0.0]).unwrap().straight);
    }
}
