//! Inverse kinematics of many poses at once: structures of arrays in, structures of arrays out.
//!
//! Arms with a spherical wrist are solved some poses side by side in vector registers (AVX2 or AVX-512 where the processor has them, found at run
//! time); of poses at or beside a singularity or the border of reach, and of all other arms, [`Arm::inverse`] decides. What is returned is what that
//! returns for each pose, but for the last digits, and for the turn of a joint that stands half a turn from the middle of its limits.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};
use meltpath_numerics::vector::Level;

use super::arm::{Arm, Geometry};
use super::lanes::{Block, Eight, Form, LANES, Solve};
use super::solution::{HELD, Singularities, Solution, Unreachable};

/// How far the closed form's chain may be off the arm's own for the one to check the other: a part of what holds a pose.
const ALIKE: f64 = 0.01;

/// Poses of the flange in the base, side by side.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Poses {
    /// x, y, z in mm.
    position: [Vec<f64>; 3],
    /// x, y, z, w of the unit quaternion.
    orientation: [Vec<f64>; 4],
}

impl Poses {
    /// How many.
    pub fn len(&self) -> usize {
        self.position[0].len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.position[0].is_empty()
    }

    /// One more.
    pub fn push(&mut self, pose: Pose) {
        for (lane, value) in self.position.iter_mut().zip(pose.position.to_array()) {
            lane.push(value);
        }
        for (lane, value) in self.orientation.iter_mut().zip(pose.orientation.to_array()) {
            lane.push(value);
        }
    }

    /// None any more; the memory is kept.
    pub fn clear(&mut self) {
        self.position.iter_mut().for_each(Vec::clear);
        self.orientation.iter_mut().for_each(Vec::clear);
    }

    /// Pose `i`, which there must be.
    pub fn at(&self, i: usize) -> Pose {
        let [x, y, z] = self.position.each_ref().map(|lane| lane[i]);
        let quaternion = self.orientation.each_ref().map(|lane| lane[i]);
        Pose {
            position: DVec3::new(x, y, z),
            orientation: DQuat::from_array(quaternion),
        }
    }
}

impl FromIterator<Pose> for Poses {
    fn from_iter<T: IntoIterator<Item = Pose>>(poses: T) -> Self {
        let mut all = Poses::default();
        poses.into_iter().for_each(|pose| all.push(pose));
        all
    }
}

/// The ways to hold each of some poses, side by side, those of one pose after those of the one before. A way takes some 60 bytes: of a million poses
/// ask for a part at a time.
#[derive(Debug, Clone, Default)]
pub struct Ways {
    /// Where the ways of each pose end.
    ends: Vec<usize>,
    /// Why a pose has none.
    why: Vec<Option<Unreachable>>,
    /// Whether a pose was solved by itself.
    alone: Vec<bool>,
    angles: [Vec<f64>; 6],
    margin: Vec<f64>,
    tightest: Vec<u8>,
    singular: Vec<Singularities>,
}

impl Ways {
    /// How many poses.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are no poses.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Angles of each joint, rad, of all ways of all poses.
    pub fn angles(&self) -> [&[f64]; 6] {
        self.angles.each_ref().map(Vec::as_slice)
    }

    /// The ways of pose `i` in the order of [`Arm::inverse`]; empty beyond the last pose.
    ///
    /// # Errors
    /// [`Unreachable`] where it has none.
    pub fn of(&self, i: usize) -> Result<impl Iterator<Item = Solution> + '_, Unreachable> {
        if let Some(Some(why)) = self.why.get(i) {
            return Err(*why);
        }
        let begin = i.checked_sub(1).and_then(|before| self.ends.get(before));
        let end = self.ends.get(i).copied().unwrap_or(0);
        Ok((begin.copied().unwrap_or(0)..end).map(|way| self.solution(way)))
    }

    /// Whether the ways of pose `i` are those of [`Arm::inverse`] to the last digit: it was solved by itself.
    pub fn is_alone(&self, i: usize) -> bool {
        self.alone.get(i).copied().unwrap_or(true)
    }

    fn solution(&self, way: usize) -> Solution {
        Solution {
            angles: self.angles.each_ref().map(|lane| lane[way]),
            singular: self.singular[way],
            margin: self.margin[way],
            tightest: usize::from(self.tightest[way]),
        }
    }

    fn clear(&mut self) {
        self.ends.clear();
        self.why.clear();
        self.alone.clear();
        self.angles.iter_mut().for_each(Vec::clear);
        self.margin.clear();
        self.tightest.clear();
        self.singular.clear();
    }

    fn push(&mut self, solution: &Solution) {
        for (lane, angle) in self.angles.iter_mut().zip(solution.angles) {
            lane.push(angle);
        }
        self.margin.push(solution.margin);
        self.tightest.push(solution.tightest as u8);
        self.singular.push(solution.singular);
    }

    /// What was pushed last is all of a pose.
    fn end(&mut self, why: Option<Unreachable>, alone: bool) {
        self.ends.push(self.margin.len());
        self.why.push(why);
        self.alone.push(alone);
    }
}

/// Solves many poses of one arm.
#[derive(Debug, Clone)]
pub struct Batch<'a> {
    arm: &'a Arm,
    /// What is solved side by side.
    form: Option<Form>,
    level: Level,
}

impl<'a> Batch<'a> {
    /// Of an arm, with the widest registers of this processor.
    pub fn of(arm: &'a Arm) -> Self {
        Batch::with(arm, Level::widest())
    }

    /// With other registers: the bits are the same.
    pub fn with(arm: &'a Arm, level: Level) -> Self {
        Batch {
            arm,
            form: form(arm),
            level,
        }
    }

    /// Whether poses are solved side by side; else one by one.
    pub fn is_side_by_side(&self) -> bool {
        self.form.is_some()
    }

    /// All ways to hold each of `poses`, limits aside, in place of what `ways` held. Each is checked by the chain from its angles.
    pub fn inverse(&self, poses: &Poses, ways: &mut Ways) {
        ways.clear();
        let Some(form) = &self.form else {
            (0..poses.len()).for_each(|i| self.alone(poses.at(i), ways));
            return;
        };
        let flange_from_end = self.arm.end_from_flange.map(Pose::inverse);
        let mut block = Block::empty();
        let mut found = Eight::none();
        for first in (0..poses.len()).step_by(LANES) {
            let here = LANES.min(poses.len() - first);
            for lane in 0..here {
                let pose = poses.at(first + lane);
                fill(
                    &mut block,
                    lane,
                    flange_from_end.map_or(pose, |f| pose.then(f)),
                );
            }
            self.level.run(Solve {
                form,
                block: &block,
                found: &mut found,
            });
            for lane in 0..here {
                let reached = found.sides.each_ref().map(|side| side.reached[lane] > 0.0);
                if found.doubt[lane] == 0.0 && (reached[0] || reached[1]) {
                    take(&found, lane, reached, ways);
                } else {
                    self.alone(poses.at(first + lane), ways);
                }
            }
        }
    }

    /// One pose by itself.
    fn alone(&self, pose: Pose, ways: &mut Ways) {
        match self.arm.inverse(pose) {
            Ok(found) => {
                found.solutions.iter().for_each(|s| ways.push(s));
                ways.end(None, true);
            }
            Err(why) => ways.end(Some(why), true),
        }
    }
}

/// What is solved side by side of an arm; nothing where it has no spherical wrist, or its own chain is another than that of the closed form.
fn form(arm: &Arm) -> Option<Form> {
    let Geometry::SphericalWrist(lengths) = arm.geometry else {
        return None;
    };
    let joints: &[_; 6] = arm.chain.joints.as_slice().try_into().ok()?;
    let limits = [
        joints.each_ref().map(|j| j.limits.low),
        joints.each_ref().map(|j| j.limits.high),
    ];
    let form = Form::new(lengths, limits, arm.coupling);
    let flange_from_end = arm.end_from_flange.map(Pose::inverse);
    let same = (0..4).all(|i| {
        let joints: [f64; 6] =
            std::array::from_fn(|k| (1.3 * f64::from(i) + 0.7 * k as f64).sin() * 3.0);
        let flange = arm.forward(joints);
        let end = flange_from_end.map_or(flange, |f| flange.then(f));
        let (rotation, position) = form.forward(joints);
        let turned = DMat3::from_quat(end.orientation) - rotation;
        let columns = [turned.x_axis, turned.y_axis, turned.z_axis];
        position.distance(end.position) < ALIKE * HELD[0]
            && columns.iter().all(|c| c.length() < ALIKE * HELD[1])
    });
    same.then_some(form)
}

/// Puts a pose in a block.
fn fill(block: &mut Block, lane: usize, pose: Pose) {
    let columns = DMat3::from_quat(pose.orientation).to_cols_array();
    for (to, value) in block.rotation.iter_mut().zip(columns) {
        to[lane] = value;
    }
    for (to, value) in block.position.iter_mut().zip(pose.position.to_array()) {
        to[lane] = value;
    }
}

/// Takes the ways of one pose of a block.
fn take(found: &Eight, lane: usize, reached: [bool; 2], ways: &mut Ways) {
    for (of_side, reached) in found.ways.chunks_exact(4).zip(reached) {
        for way in of_side.iter().filter(|_| reached) {
            ways.push(&Solution {
                angles: way.angles.each_ref().map(|angle| angle[lane]),
                singular: Singularities::default(),
                margin: way.margin[lane],
                tightest: way.tightest[lane] as usize,
            });
        }
    }
    ways.end(None, false);
}
