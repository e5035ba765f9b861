//! Finds the parameters of a spherical wrist's closed form in a chain of axes.

use std::f64::consts::PI;

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

use super::way::Movable;
use crate::kinematics::numeric::distance;
use crate::kinematics::{Chain, Joint, JointKind, Limits, OrthoParallel};

/// How far axes may be off a right angle, or off each other in metres: files carry six digits.
const EXACT: f64 = 1e-5;

/// An arm whose closed form is known.
pub(super) struct Recognised {
    pub(super) parameters: OrthoParallel,
    /// The file's flange in the one of the closed form, whose z points out along the last axis.
    pub(super) end_from_flange: Pose,
}

/// An axis in the base, all joints at zero.
#[derive(Clone, Copy)]
struct Line {
    at: DVec3,
    along: DVec3,
}

impl Recognised {
    /// The closed form of a chain, if it has one that moves its flange as the chain does.
    pub(super) fn of(joints: &[Movable], last_from_flange: Pose) -> Option<Self> {
        let mut base_from_joint = Pose::IDENTITY;
        let lines: Vec<Line> = joints
            .iter()
            .map(|j| {
                base_from_joint = base_from_joint.then(j.parent_from_joint);
                Line {
                    at: base_from_joint.position,
                    along: base_from_joint.orientation * j.axis,
                }
            })
            .collect();
        let lines: [Line; 6] = lines.try_into().ok()?;
        let flange = base_from_joint.then(last_from_flange);
        let wrist = meeting(&lines[4], &lines[5])?;
        let end = end(lines[5].along, wrist, flange);
        let found = Recognised {
            parameters: parameters(&lines, wrist, end)?,
            end_from_flange: end.inverse().then(flange),
        };
        found.moves_as(joints, last_from_flange).then_some(found)
    }

    /// Whether the closed form and the chain agree wherever the joints are.
    fn moves_as(&self, joints: &[Movable], last_from_flange: Pose) -> bool {
        let chain = Chain {
            joints: joints.iter().map(joint).collect(),
            last_from_end: last_from_flange,
        };
        let mut closed = self.parameters.chain([NONE; 6]);
        closed.last_from_end = closed.last_from_end.then(self.end_from_flange);
        (0..20).all(|i| {
            let values: [f64; 6] =
                std::array::from_fn(|k| (1.3 * f64::from(i) + 0.7 * k as f64).sin() * 3.0);
            let [off, turned] = distance(closed.forward(&values), chain.forward(&values));
            off < 1000.0 * EXACT && turned < EXACT
        })
    }
}

const NONE: Limits = Limits {
    low: -1.0,
    high: 1.0,
    speed: None,
    acceleration: None,
};

fn joint(movable: &Movable) -> Joint {
    Joint {
        name: String::new(),
        kind: JointKind::Revolute,
        parent_from_joint: movable.parent_from_joint,
        axis: movable.axis,
        limits: NONE,
    }
}

/// The sign of a number, 1 for zero.
fn sign(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}

/// The parameters, as far as the axes lie as those of a spherical wrist on parallel axes; [`Recognised::moves_as`] proves them.
fn parameters(lines: &[Line; 6], wrist: DVec3, flange: Pose) -> Option<OrthoParallel> {
    let z = DVec3::Z;
    let level = |l: &Line| l.along.z.abs() < EXACT;
    if lines[0].along.cross(z).length() > EXACT || !level(&lines[1]) || !level(&lines[2]) {
        return None;
    }
    // forward is where the arm stands with all joints at zero: the second axis lies across it
    let across = lines[1].along;
    let ahead = across.cross(z).dot(wrist);
    let y = if ahead.abs() > 1.0 {
        across * sign(ahead)
    } else {
        across
    };
    let x = y.cross(z);
    let plane = |p: DVec3| [p.dot(x), p.z];
    let ([f2, u2], [f3, u3], [fw, uw]) = (plane(lines[1].at), plane(lines[2].at), plane(wrist));
    let upper = [f3 - f2, u3 - u2];
    let (fore, out) = ([fw - f3, uw - u3], lines[3].along);
    let along = out * sign(out.dot(x) * fore[0] + out.z * fore[1]);
    let [kf, ku] = plane(along);
    let lean = kf.atan2(ku);
    // the forearm's own frame, before its turn and after
    let x3 = y.cross(along);
    let fifth = lines[4].along * sign(lines[4].along.dot(y));
    let q4 = (-fifth.dot(x3)).atan2(fifth.dot(y));
    let x4 = fifth.cross(along);
    let point = flange.orientation * z;
    let q5 = point.dot(x4).atan2(point.dot(along));
    let x5 = fifth.cross(point);
    let right = flange.orientation * DVec3::X;
    let q6 = right.dot(fifth).atan2(right.dot(x5));
    let second = upper[0].atan2(upper[1]);
    Some(OrthoParallel {
        a1: f2,
        a2: fore[0] * ku - fore[1] * kf,
        b: wrist.dot(y),
        c1: u2,
        c2: upper[0].hypot(upper[1]),
        c3: fore[0] * kf + fore[1] * ku,
        c4: (flange.position - wrist).dot(point),
        zero: [x.y.atan2(x.x), second, lean - second, q4, q5, q6],
        sign: [
            sign(lines[0].along.z),
            sign(lines[1].along.dot(y)),
            sign(lines[2].along.dot(y)),
            sign(out.dot(along)),
            sign(lines[4].along.dot(y)),
            sign(lines[5].along.dot(point)),
        ],
    })
}

/// The flange of the closed form: on the last axis, its z along it and outward. A flange that lies so is itself; another is turned the shortest
/// way.
fn end(along: DVec3, wrist: DVec3, flange: Pose) -> Pose {
    let z = flange.orientation * DVec3::Z;
    let out = (flange.position - wrist).dot(along);
    let position = wrist + along * out;
    // a flange in the centre of the wrist is outward as it lies
    let outward = if out.abs() < 1000.0 * EXACT {
        along * sign(z.dot(along))
    } else {
        along * sign(out)
    };
    let aligned = z.cross(along).length() < EXACT;
    let turn = match (aligned, z.dot(outward) > 0.0) {
        (true, true) => DQuat::IDENTITY,
        // about its own x: no way is the shortest
        (true, false) => DQuat::from_axis_angle(flange.orientation * DVec3::X, PI),
        (false, _) => DQuat::from_rotation_arc(z, outward),
    };
    Pose {
        position,
        orientation: turn * flange.orientation,
    }
}

/// Where two lines meet.
fn meeting(a: &Line, b: &Line) -> Option<DVec3> {
    let normal = a.along.cross(b.along);
    let square = normal.length_squared();
    if square < EXACT {
        return None;
    }
    let t = (b.at - a.at).cross(b.along).dot(normal) / square;
    Some(a.at + a.along * t)
}
