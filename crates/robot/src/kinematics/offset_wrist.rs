//! Arms whose second, third and fourth axis are parallel and whose wrist has an offset: Universal Robots and their kind.
//! Source of the parameters: Universal Robots, "Parameters for calculations of kinematics and dynamics" (Denavit and Hartenberg).

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};

use super::chain::{Chain, Joint, JointKind, Limits};
use super::planar::{self, Elbow, Shoulder, wrapped};
use super::solution::{Candidate, Candidates, IN_LINE, Singularities, Unreachable};

/// What is off in the directions of a pose, by rounding.
const DIGITS: f64 = 1e-14;

/// Denavit and Hartenberg's lengths, mm, with the twists 90°, 0, 0, 90°, -90°, 0. The maker prints a2 and a3 below zero; here
/// they are lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetWrist {
    /// From the base up to the second axis.
    pub d1: f64,
    /// The upper arm.
    pub a2: f64,
    /// The forearm.
    pub a3: f64,
    /// From the plane of the first axis sideways to the fifth axis.
    pub d4: f64,
    /// From the fourth axis to the sixth.
    pub d5: f64,
    /// From the fifth axis to the flange.
    pub d6: f64,
}

impl OffsetWrist {
    /// The arm as a chain of joints.
    pub fn chain(&self, limits: [Limits; 6]) -> Chain {
        let quarter = std::f64::consts::FRAC_PI_2;
        // each joint's frame lies at the end of the link before: that link's lengths and twist
        let before = [
            (DVec3::ZERO, 0.0),
            (DVec3::new(0.0, 0.0, self.d1), quarter),
            (DVec3::new(-self.a2, 0.0, 0.0), 0.0),
            (DVec3::new(-self.a3, 0.0, 0.0), 0.0),
            (DVec3::new(0.0, 0.0, self.d4), quarter),
            (DVec3::new(0.0, 0.0, self.d5), -quarter),
        ];
        let joints =
            before
                .into_iter()
                .zip(limits)
                .enumerate()
                .map(|(i, ((position, twist), limits))| Joint {
                    name: format!("J{}", i + 1),
                    kind: JointKind::Revolute,
                    parent_from_joint: Pose {
                        position,
                        orientation: DQuat::from_rotation_x(twist),
                    },
                    axis: DVec3::Z,
                    limits,
                });
        Chain {
            joints: joints.collect(),
            last_from_end: Pose::at(DVec3::new(0.0, 0.0, self.d6)),
        }
    }

    /// The eight ways to hold the flange so: two of the shoulder, two of the wrist, two of the elbow. Where two of them are one,
    /// or a joint is free, they are named singular.
    ///
    /// # Errors
    /// [`Unreachable`] where there is none.
    pub(super) fn solve(
        &self,
        rotation: &DMat3,
        position: DVec3,
    ) -> Result<Candidates, Unreachable> {
        let centre = position - self.d6 * rotation.z_axis;
        let shoulder = Shoulder::under(centre, self.d4)?;
        let mut found = Candidates::none();
        let mut why = None;
        // in the first joint's frame the centre lies at (±forward, d4)
        for radial in [shoulder.forward, -shoulder.forward] {
            let q1 = shoulder.towards - (-self.d4).atan2(radial);
            let (s1, k1) = q1.sin_cos();
            let (x1, z1) = (DVec3::new(k1, s1, 0.0), DVec3::new(s1, -k1, 0.0));
            let (towards_x, towards_y) = (rotation.x_axis.dot(z1), rotation.y_axis.dot(z1));
            let sine = towards_x.hypot(towards_y);
            let wrist = sine < IN_LINE;
            let singular = Singularities {
                shoulder: shoulder.singular,
                wrist,
                ..Singularities::default()
            };
            // the nearer the axes are in line, the fewer digits of the sixth joint the pose holds
            let unsure = (DIGITS / sine).min(std::f64::consts::PI);
            let turned = (-towards_y).atan2(towards_x);
            let best = |from: f64| self.most_room(rotation, centre, x1, from, unsure);
            for q6 in [turned, turned + std::f64::consts::PI] {
                let q6 = if unsure < 1.0 { q6 } else { best(q6) };
                let way = |q6: f64| self.arms(q1, &Outer::of(rotation, q6, x1, z1), centre, x1);
                // missed by no more than those digits: of the values that hold the pose as well, the one with most room
                let ways = way(q6).or_else(|missed| {
                    let near = missed.by() < self.d5.abs() * unsure;
                    let other = if near { way(best(q6)) } else { Err(missed) };
                    other.map_err(|_| missed)
                });
                match ways {
                    Ok((elbow, ways)) => {
                        let singular = Singularities {
                            elbow: elbow.straight,
                            folded: elbow.folded,
                            ..singular
                        };
                        for angles in ways {
                            found.push(Candidate { angles, singular });
                        }
                    }
                    Err(missed) => why = why.or(Some(missed)),
                }
            }
        }
        found.unless(why)
    }

    /// The two ways of the elbow for a shoulder and a wrist.
    fn arms(
        &self,
        q1: f64,
        outer: &Outer,
        centre: DVec3,
        x1: DVec3,
    ) -> Result<(Elbow, [[f64; 6]; 2]), Unreachable> {
        let at = centre - self.d5 * outer.fifth_axis;
        let point = [-at.dot(x1), self.d1 - at.z];
        let elbow = planar::reach([self.a2, self.a3], point)?;
        let Outer { q234, q5, q6, .. } = *outer;
        let way = |i: usize| {
            let (q2, q3) = (elbow.first[i], elbow.bend[i]);
            [q1, q2, q3, q234 - q2 - q3, q5, q6]
        };
        Ok((elbow, [way(0), way(1)]))
    }

    /// Where the last axis is parallel to those of the arm the sixth joint is free: the turn within `unsure` of `from` at which the
    /// arm is farthest from its limits, rad.
    fn most_room(&self, rotation: &DMat3, centre: DVec3, x1: DVec3, from: f64, unsure: f64) -> f64 {
        let reach = centre - DVec3::new(0.0, 0.0, self.d1);
        let reach = reach.dot(x1) * x1 + reach.z * DVec3::Z;
        let middle = self.a2.hypot(self.a3);
        let miss = |q6: &f64| {
            let at = reach - self.d5 * fifth_axis(rotation, *q6);
            (at.dot(x1).hypot(at.z) - middle).abs()
        };
        // farthest and nearest where the wrist points out and in
        let out = (-rotation.x_axis.dot(reach)).atan2(-rotation.y_axis.dot(reach));
        let ends = [out, out + std::f64::consts::PI]
            .map(|end| from + wrapped(end - from).clamp(-unsure, unsure));
        let turns = (-12..=12).map(|i| from + f64::from(i) * unsure / 12.0);
        turns
            .chain(ends)
            .min_by(|a, b| miss(a).total_cmp(&miss(b)))
            .unwrap_or(from)
    }
}

/// The fifth axis in the base for a turn of the sixth joint.
fn fifth_axis(rotation: &DMat3, q6: f64) -> DVec3 {
    let (s6, k6) = q6.sin_cos();
    -s6 * rotation.x_axis - k6 * rotation.y_axis
}

/// What a turn of the sixth joint fixes of the joints before it.
struct Outer {
    q234: f64,
    q5: f64,
    q6: f64,
    fifth_axis: DVec3,
}

impl Outer {
    /// For the first joint's axes across (x) and out of the arm's plane (z).
    fn of(rotation: &DMat3, q6: f64, x1: DVec3, z1: DVec3) -> Outer {
        let fifth_axis = fifth_axis(rotation, q6);
        let q234 = fifth_axis.dot(x1).atan2(-fifth_axis.z);
        let (s, k) = q234.sin_cos();
        let x4 = k * x1 + s * DVec3::Z;
        let q5 = (-rotation.z_axis.dot(x4)).atan2(rotation.z_axis.dot(z1));
        Outer {
            q234,
            q5,
            q6,
            fifth_axis,
        }
    }
}
