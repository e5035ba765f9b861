//! Poses: where a named frame lies in another, with the W, P, R angles that robot controllers write.
//! Source: Rouchon 2022, §2.2.2, eq. 2.9-2.11, pp. 38-40 (two signs of the printed matrix corrected, see `rotation_from_wpr`).

use serde::{Deserialize, Serialize};

use crate::math::{DMat3, DQuat, DVec3};

/// The pose of one frame in another: `part_from_tool` is the pose of the tool in the part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Origin of the inner frame in the outer, mm.
    pub position: DVec3,
    /// Rotation that takes directions of the inner frame to the outer; of unit length.
    pub orientation: DQuat,
}

impl Pose {
    /// Both frames are the same.
    pub const IDENTITY: Pose = Pose {
        position: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
    };

    /// Axes as they were, at `position` mm.
    pub const fn at(position: DVec3) -> Self {
        Pose {
            position,
            ..Pose::IDENTITY
        }
    }

    /// The pose at `position` mm with the angles W, P, R in rad.
    pub fn from_wpr(position: DVec3, wpr: DVec3) -> Self {
        Pose {
            position,
            orientation: DQuat::from_mat3(&rotation_from_wpr(wpr)),
        }
    }

    /// `a_from_c = a_from_b.then(b_from_c)`: eq. 2.9 chains three of these.
    ///
    /// ```
    /// use meltpath_geometry::{math::DVec3, pose::Pose};
    /// let quarter = DVec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2);
    /// let part_from_world = Pose::from_wpr(DVec3::new(10.0, 0.0, 0.0), quarter);
    /// let world_from_tool = Pose::from_wpr(DVec3::X, DVec3::ZERO);
    /// let part_from_tool = part_from_world.then(world_from_tool);
    /// assert!(part_from_tool.position.distance(DVec3::new(10.0, 1.0, 0.0)) < 1e-12);
    /// ```
    #[must_use]
    #[inline]
    pub fn then(self, inner: Pose) -> Pose {
        Pose {
            position: self.point(inner.position),
            orientation: (self.orientation * inner.orientation).normalize(),
        }
    }

    /// The pose of the outer frame in the inner one.
    #[must_use]
    #[inline]
    pub fn inverse(self) -> Pose {
        let back = self.orientation.inverse();
        Pose {
            position: -(back * self.position),
            orientation: back,
        }
    }

    /// A point of the inner frame, in the outer frame, mm.
    #[inline]
    pub fn point(self, p: DVec3) -> DVec3 {
        self.position + self.orientation * p
    }

    /// The angles W, P, R in rad, see `wpr_from_rotation`.
    pub fn wpr(self) -> DVec3 {
        wpr_from_rotation(&DMat3::from_quat(self.orientation))
    }

    /// The pose at `position` mm of a tool with the unit `axis` from the part towards it, turned about that axis by `turn` rad: see
    /// [`Pose::tool_axis`] and [`Pose::turn`].
    ///
    /// ```
    /// use meltpath_geometry::{math::DVec3, pose::Pose};
    /// let pose = Pose::from_wpr(DVec3::ZERO, DVec3::new(3.0, 0.2, 1.0));
    /// let again = Pose::of_tool(DVec3::ZERO, pose.tool_axis(), pose.turn());
    /// assert!(pose.orientation.angle_between(again.orientation) < 1e-9);
    /// ```
    pub fn of_tool(position: DVec3, axis: DVec3, turn: f64) -> Self {
        Pose {
            position,
            orientation: (leaning(axis) * DQuat::from_rotation_z(turn) * HALF_TURN).normalize(),
        }
    }

    /// Rotation of the tool about its axis, rad: what is left when the shortest turn from the vertical to [`Pose::tool_axis`] is taken
    /// away. A vertical torch with the angles W, P, R = 180°, 0, R has the turn R.
    pub fn turn(self) -> f64 {
        let about_z = leaning(self.tool_axis()).inverse() * self.orientation * HALF_TURN.inverse();
        2.0 * about_z.z.atan2(about_z.w)
    }

    /// The unit axis of the tool, from the part towards the tool, where the pose is one of a tool in a part and the tool
    /// frame's z points from the tool towards the part, as torch frames do.
    pub fn tool_axis(self) -> DVec3 {
        -(self.orientation * DVec3::Z)
    }
}

/// The tool that points down, unturned: half a turn about x.
const HALF_TURN: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);

/// The shortest turn from the vertical to `axis`, to the last bit also where it is nearly vertical; half a turn about x for one that
/// points down.
fn leaning(axis: DVec3) -> DQuat {
    let axis = axis.normalize_or(DVec3::Z);
    let along = DVec3::Z.cross(axis);
    let w = if axis.z < 0.0 {
        along.length_squared() / (1.0 - axis.z)
    } else {
        1.0 + axis.z
    };
    let turn = DQuat::from_vec4(along.extend(w));
    if turn.length_squared() > 0.0 {
        turn.normalize()
    } else {
        HALF_TURN
    }
}

/// The rotation of the angles W, P, R (rad) about the fixed axes X, Y, Z in this order: `Rz(R)·Ry(P)·Rx(W)`.
///
/// The matrix as printed in the source carries a minus before `sin W sin R` in its element (1,3) and before
/// `sin W sin P sin R` in its element (2,2); both must be plus for the matrix to be a rotation.
fn rotation_from_wpr(wpr: DVec3) -> DMat3 {
    let (sw, cw) = wpr.x.sin_cos();
    let (sp, cp) = wpr.y.sin_cos();
    let (sr, cr) = wpr.z.sin_cos();
    DMat3::from_cols(
        DVec3::new(cp * cr, cp * sr, -sp),
        DVec3::new(sw * sp * cr - cw * sr, cw * cr + sw * sp * sr, sw * cp),
        DVec3::new(cw * sp * cr + sw * sr, cw * sp * sr - sw * cr, cw * cp),
    )
}

/// The angles W, P, R (rad) of a rotation: W and R in (-π, π], P in [-π/2, π/2].
///
/// Where the tool points along ±X (P = ±90°, gimbal lock) only R ∓ W matters: W is then 0.
fn wpr_from_rotation(rotation: &DMat3) -> DVec3 {
    let (x, y, z) = (rotation.x_axis, rotation.y_axis, rotation.z_axis);
    let cos_p = x.x.hypot(x.y);
    let p = (-x.z).atan2(cos_p);
    // below this the products cos P · cos R have lost the digits that W and R need
    if cos_p < 1e-9 {
        DVec3::new(0.0, p, (-y.x).atan2(y.y))
    } else {
        DVec3::new(y.z.atan2(z.z), p, x.y.atan2(x.x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn product(wpr: DVec3) -> DMat3 {
        DMat3::from_rotation_z(wpr.z)
            * DMat3::from_rotation_y(wpr.y)
            * DMat3::from_rotation_x(wpr.x)
    }

    fn difference(a: &DMat3, b: &DMat3) -> f64 {
        (0..3)
            .map(|i| (a.col(i) - b.col(i)).abs().max_element())
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_tool_is_told_by_its_axis_and_its_turn() {
        let back = |pose: Pose| Pose::of_tool(pose.position, pose.tool_axis(), pose.turn());
        // nearly vertical and nearly upside down
        for lean in [0.0, 1e-16, 1e-12, 1e-8, 1e-4, PI - 1e-4, PI - 1e-12, PI] {
            for turn in [0.0, 1.0, -3.0] {
                let wpr = DVec3::new(PI - lean, 0.0, turn);
                let pose = Pose::from_wpr(DVec3::X, wpr);
                let again = back(pose);
                let apart = |v: DVec3| (pose.orientation * v).distance(again.orientation * v);
                assert!(
                    apart(DVec3::Z) < 1e-15 && apart(DVec3::X) < 1e-14,
                    "{lean} {turn}"
                );
            }
        }
        let turned = Pose::from_wpr(DVec3::X, DVec3::new(PI, 0.0, 0.7));
        assert!((turned.turn() - 0.7).abs() < 1e-15);
    }

    /// The matrix with the two signs as the source prints them.
    fn printed(wpr: DVec3) -> DMat3 {
        let mut m = rotation_from_wpr(wpr);
        let (sw, sp, sr) = (wpr.x.sin(), wpr.y.sin(), wpr.z.sin());
        m.z_axis.x -= 2.0 * sw * sr;
        m.y_axis.y -= 2.0 * sw * sp * sr;
        m
    }

    fn angles() -> impl Strategy<Value = DVec3> {
        (-PI..PI, -FRAC_PI_2..FRAC_PI_2, -PI..PI).prop_map(|(w, p, r)| DVec3::new(w, p, r))
    }

    proptest! {
        #[test]
        fn waam_ac47_the_pose_matrix_is_a_rotation(wpr in angles()) {
            let m = rotation_from_wpr(wpr);
            prop_assert!(difference(&(m.transpose() * m), &DMat3::IDENTITY) < 1e-12);
            prop_assert!((m.determinant() - 1.0).abs() < 1e-12);
            prop_assert!(difference(&m, &product(wpr)) < 1e-12);
        }

        #[test]
        fn angles_come_back(wpr in angles()) {
            let pose = Pose::from_wpr(DVec3::ZERO, wpr);
            let again = rotation_from_wpr(pose.wpr());
            prop_assert!(difference(&again, &rotation_from_wpr(wpr)) < 1e-9);
        }

        #[test]
        fn a_pose_and_its_inverse_cancel(wpr in angles(), x in -500.0..500.0) {
            let pose = Pose::from_wpr(DVec3::new(x, -x, 10.0), wpr);
            let none = pose.then(pose.inverse());
            prop_assert!(none.position.length() < 1e-9);
            prop_assert!(none.orientation.angle_between(DQuat::IDENTITY) < 1e-7);
        }
    }

    #[test]
    fn waam_ac47_the_printed_signs_are_no_rotation() {
        let wpr = DVec3::new(0.3, -0.5, 0.9);
        let m = printed(wpr);
        assert!(difference(&(m.transpose() * m), &DMat3::IDENTITY) > 0.1);
        assert!(difference(&m, &product(wpr)) > 0.1);
    }

    #[test]
    fn gimbal_lock_keeps_the_rotation() {
        for p in [FRAC_PI_2, -FRAC_PI_2] {
            let m = rotation_from_wpr(DVec3::new(0.4, p, 1.1));
            let wpr = wpr_from_rotation(&m);
            assert_eq!(wpr.x, 0.0);
            assert!(difference(&rotation_from_wpr(wpr), &m) < 1e-9);
        }
    }

    #[test]
    fn a_vertical_torch_points_up() {
        let pose = Pose::from_wpr(DVec3::ZERO, DVec3::new(PI, 0.0, 0.3));
        assert!(pose.tool_axis().distance(DVec3::Z) < 1e-12);
    }
}
