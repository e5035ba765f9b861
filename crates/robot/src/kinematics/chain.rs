//! A chain of joints: where each of them and the end stand for given joint values.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// It turns: values are rad.
    Revolute,
    /// It slides: values are mm.
    Prismatic,
}

/// What a joint may do; rad or mm, as the joint moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
    /// The greatest speed, per second, where known.
    pub speed: Option<f64>,
    /// The greatest acceleration, per second squared, where known.
    pub acceleration: Option<f64>,
}

impl Limits {
    /// How far a value is from the nearer limit; below zero beyond one.
    pub fn margin(&self, value: f64) -> f64 {
        (value - self.low).min(self.high - value)
    }
}

/// One joint: a fixed frame, and a motion along or about an axis of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Its frame at zero, in the frame of the joint before (of the base for the first).
    pub parent_from_joint: Pose,
    /// The axis in its own frame, of unit length; positive values turn about it by the right hand, or slide along it.
    pub axis: DVec3,
    /// What it may do.
    pub limits: Limits,
}

impl Joint {
    /// The frame after the motion, in the frame of the joint before.
    fn moved(&self, value: f64) -> Pose {
        let parent = self.parent_from_joint;
        match self.kind {
            JointKind::Revolute => Pose {
                position: parent.position,
                orientation: (parent.orientation * DQuat::from_axis_angle(self.axis, value))
                    .normalize(),
            },
            JointKind::Prismatic => parent.then(Pose::at(self.axis * value)),
        }
    }
}

/// Joints one after the other, and what hangs at the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// From the base to the end.
    pub joints: Vec<Joint>,
    /// The end in the frame of the last joint.
    pub last_from_end: Pose,
}

impl Chain {
    /// The frames of the joints after their motions, in the base. Joints without a value stand at zero.
    pub fn frames(&self, values: &[f64]) -> Vec<Pose> {
        let mut base_from_joint = Pose::IDENTITY;
        let values = values.iter().copied().chain(std::iter::repeat(0.0));
        self.joints
            .iter()
            .zip(values)
            .map(|(joint, value)| {
                base_from_joint = base_from_joint.then(joint.moved(value));
                base_from_joint
            })
            .collect()
    }

    /// The pose of the end in the base.
    ///
    /// ```
    /// use meltpath_geometry::{Pose, math::DVec3};
    /// use meltpath_robot::kinematics::{Chain, Joint, JointKind, Limits};
    /// let limits = Limits { low: -3.0, high: 3.0, speed: None, acceleration: None };
    /// let arm = Pose { position: DVec3::new(100.0, 0.0, 0.0), ..Pose::IDENTITY };
    /// let turn = Joint {
    ///     name: "turn".into(), kind: JointKind::Revolute, parent_from_joint: Pose::IDENTITY, axis: DVec3::Z, limits,
    /// };
    /// let chain = Chain { joints: vec![turn], last_from_end: arm };
    /// let end = chain.forward(&[std::f64::consts::FRAC_PI_2]);
    /// assert!(end.position.distance(DVec3::new(0.0, 100.0, 0.0)) < 1e-12);
    /// ```
    pub fn forward(&self, values: &[f64]) -> Pose {
        let values = values.iter().copied().chain(std::iter::repeat(0.0));
        let joints = self.joints.iter().zip(values);
        let moved = |base: Pose, (joint, value): (&Joint, f64)| base.then(joint.moved(value));
        joints.fold(Pose::IDENTITY, moved).then(self.last_from_end)
    }

    /// How the end moves with each joint: its velocity in mm, then its turning in rad, in the base, per unit of the joint.
    pub fn jacobian(&self, values: &[f64]) -> Vec<(DVec3, DVec3)> {
        let frames = self.frames(values);
        let end = frames
            .last()
            .copied()
            .unwrap_or(Pose::IDENTITY)
            .then(self.last_from_end)
            .position;
        let of_joint = |(joint, frame): (&Joint, &Pose)| {
            let axis = frame.orientation * joint.axis;
            match joint.kind {
                JointKind::Revolute => (axis.cross(end - frame.position), axis),
                JointKind::Prismatic => (axis, DVec3::ZERO),
            }
        };
        self.joints.iter().zip(&frames).map(of_joint).collect()
    }
}
