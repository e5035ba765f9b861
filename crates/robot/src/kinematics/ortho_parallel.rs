//! Arms with a spherical wrist whose second and third axis are parallel and at right angles to the first: most industrial robots.
//! Source of the seven parameters: M. Brandstötter, A. Angerer, M. Hofbaur, "An analytical solution of the inverse kinematics
//! problem of industrial serial manipulators with an ortho-parallel basis and a spherical wrist", Austrian Robotics Workshop 2014.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};

use super::chain::{Chain, Joint, JointKind, Limits};
use super::planar::{self, Shoulder};
use super::solution::{Candidate, Candidates, IN_LINE, Singularities, Unreachable};

/// The seven lengths, and how the robot's own angles relate to the arm stretched upright.
///
/// Upright means: upper arm, forearm and flange point up along z, the arm leans forward along x with positive second and third
/// angles, and turns by the right hand about z with positive first, fourth and sixth angles. The flange's z points out of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrthoParallel {
    /// From the first axis forward to the second, mm.
    pub a1: f64,
    /// From the elbow forward to the axis of the forearm with the arm upright, mm; below zero for a forearm that lies above the
    /// elbow when it is level.
    pub a2: f64,
    /// From the first axis sideways along y to the plane of the arm, mm.
    pub b: f64,
    /// From the base up to the second axis, mm.
    pub c1: f64,
    /// The upper arm, mm.
    pub c2: f64,
    /// From the elbow along the forearm to the centre of the wrist, mm.
    pub c3: f64,
    /// From the centre of the wrist to the flange, mm.
    pub c4: f64,
    /// The angle from upright at which each joint shows zero, rad.
    pub zero: [f64; 6],
    /// 1 where a joint counts as above, -1 where it counts the other way.
    pub sign: [f64; 6],
}

impl OrthoParallel {
    /// The angle from upright of each joint, rad.
    pub(super) fn upright(&self, joints: [f64; 6]) -> [f64; 6] {
        std::array::from_fn(|i| self.sign[i] * joints[i] + self.zero[i])
    }

    /// The angle between upper arm and the line from the elbow to the centre of the wrist, rad: above zero bent forward.
    pub(super) fn bend(&self, upright_third: f64) -> f64 {
        upright_third + self.a2.atan2(self.c3)
    }

    /// How far the centre of the wrist lies in front of the first axis, mm.
    pub(super) fn forward_of_axis(&self, upright_second: f64, upright_third: f64) -> f64 {
        let (s23, k23) = (upright_second + upright_third).sin_cos();
        self.a1 + self.c2 * upright_second.sin() + self.a2 * k23 + self.c3 * s23
    }

    /// Whether the centre of the wrist lies behind the first axis, and whether the elbow is bent back, for the joints' angles, rad.
    pub(crate) fn behind(&self, joints: [f64; 6]) -> [bool; 2] {
        let q = self.upright(joints);
        let back = planar::wrapped(self.bend(q[2])) < 0.0;
        [self.forward_of_axis(q[1], q[2]) < 0.0, back]
    }

    /// The robot's angle of joint `i` for an angle from upright, rad.
    fn shown(&self, i: usize, upright: f64) -> f64 {
        (upright - self.zero[i]) * self.sign[i]
    }

    /// The arm as a chain of joints.
    pub fn chain(&self, limits: [Limits; 6]) -> Chain {
        let steps = [
            DVec3::ZERO,
            DVec3::new(self.a1, self.b, self.c1),
            DVec3::new(0.0, 0.0, self.c2),
            DVec3::new(self.a2, 0.0, self.c3),
            DVec3::ZERO,
            DVec3::ZERO,
        ];
        let axes = [DVec3::Z, DVec3::Y, DVec3::Y, DVec3::Z, DVec3::Y, DVec3::Z];
        let joints = (0..6).map(|i| Joint {
            name: format!("J{}", i + 1),
            kind: JointKind::Revolute,
            parent_from_joint: Pose {
                position: steps[i],
                orientation: DQuat::from_axis_angle(axes[i], self.zero[i]),
            },
            axis: axes[i] * self.sign[i],
            limits: limits[i],
        });
        Chain {
            joints: joints.collect(),
            last_from_end: Pose::at(DVec3::new(0.0, 0.0, self.c4)),
        }
    }

    /// The eight ways to hold the flange so: front and back, elbow one way and the other, wrist one way and the other. Where two
    /// of them are one, or a joint is free, they are named singular.
    ///
    /// # Errors
    /// [`Unreachable`] where there is none.
    pub(super) fn solve(
        &self,
        rotation: &DMat3,
        position: DVec3,
    ) -> Result<Candidates, Unreachable> {
        let centre = position - self.c4 * rotation.z_axis;
        let shoulder = Shoulder::under(centre, self.b)?;
        let Shoulder {
            forward, towards, ..
        } = shoulder;
        let aside = self.b.atan2(forward);
        let sides = [
            (towards - aside, forward - self.a1),
            (towards + aside + std::f64::consts::PI, -forward - self.a1),
        ];
        let lengths = [self.c2, self.a2.hypot(self.c3)];
        let lean = self.a2.atan2(self.c3);
        let mut found = Candidates::none();
        let mut why = None;
        for (q1, x) in sides {
            // angles of the plane are measured from z towards x, as the joints turn
            let elbow = match planar::reach(lengths, [centre.z - self.c1, x]) {
                Ok(elbow) => elbow,
                Err(missed) => {
                    why = why.or(Some(missed));
                    continue;
                }
            };
            let singular = Singularities {
                shoulder: shoulder.singular,
                elbow: elbow.straight,
                folded: elbow.folded,
                wrist: false,
            };
            for (q2, bend) in elbow.first.into_iter().zip(elbow.bend) {
                let q3 = bend - lean;
                self.wrists([q1, q2, q3], rotation, singular, &mut found);
            }
        }
        found.unless(why)
    }

    /// The two ways of the wrist for an arm.
    fn wrists(
        &self,
        [q1, q2, q3]: [f64; 3],
        rotation: &DMat3,
        singular: Singularities,
        found: &mut Candidates,
    ) {
        let ((s1, k1), (s23, k23)) = (q1.sin_cos(), (q2 + q3).sin_cos());
        let rest = forearm(s1, k1, s23, k23).transpose() * *rotation;
        let sine = rest.z_axis.x.hypot(rest.z_axis.y);
        let wrist = sine < IN_LINE;
        // the axes in line: the fourth is free and stands at zero
        let q4 = if sine < 1e-14 {
            0.0
        } else {
            rest.z_axis.y.atan2(rest.z_axis.x)
        };
        let (s4, k4) = q4.sin_cos();
        // both from the fourth angle as it is, so that near the singularity the three still make up the rotation
        let q5 = (k4 * rest.z_axis.x + s4 * rest.z_axis.y).atan2(rest.z_axis.z);
        let q6 = (k4 * rest.x_axis.y - s4 * rest.x_axis.x)
            .atan2(k4 * rest.y_axis.y - s4 * rest.y_axis.x);
        let pi = std::f64::consts::PI;
        for [q4, q5, q6] in [[q4, q5, q6], [q4 + pi, -q5, q6 + pi]] {
            let upright = [q1, q2, q3, q4, q5, q6];
            found.push(Candidate {
                angles: std::array::from_fn(|i| self.shown(i, upright[i])),
                singular: Singularities { wrist, ..singular },
            });
        }
    }
}

/// The rotation of the forearm.
fn forearm(s1: f64, k1: f64, s23: f64, k23: f64) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(k1 * k23, s1 * k23, -s23),
        DVec3::new(-s1, k1, 0.0),
        DVec3::new(k1 * s23, s1 * s23, k23),
    )
}
