//! How far an arm is from its singularities, in the terms in which people know them.

use std::f64::consts::PI;

use super::arm::{Arm, Geometry};

/// Distances from the singularities of a closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearness {
    /// The fifth joint from where two axes of the wrist are in line, rad.
    pub wrist: f64,
    /// The elbow from the arm stretched or folded, rad.
    pub elbow: f64,
    /// The centre of the wrist (of an offset wrist: the fifth axis) from where front and back are one, mm; below zero behind.
    pub shoulder: f64,
}

/// The least distance of an angle from the multiples of half a turn, rad.
fn from_straight(angle: f64) -> f64 {
    let angle = angle.rem_euclid(PI);
    angle.min(PI - angle)
}

impl Arm {
    /// How far joint angles are from singularities; nothing for arms without a closed form.
    pub fn nearness(&self, joints: [f64; 6]) -> Option<Nearness> {
        match self.geometry {
            Geometry::SphericalWrist(arm) => {
                let q = arm.upright(joints);
                Some(Nearness {
                    wrist: from_straight(q[4]),
                    elbow: from_straight(arm.bend(q[2])),
                    shoulder: arm.forward_of_axis(q[1], q[2]),
                })
            }
            Geometry::OffsetWrist(arm) => {
                let (k2, k23) = (joints[1].cos(), (joints[1] + joints[2]).cos());
                let s234 = (joints[1] + joints[2] + joints[3]).sin();
                Some(Nearness {
                    wrist: from_straight(joints[4]),
                    elbow: from_straight(joints[2]),
                    shoulder: -arm.a2 * k2 - arm.a3 * k23 + arm.d5 * s234,
                })
            }
            Geometry::Other => None,
        }
    }
}
