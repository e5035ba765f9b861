//! Many poses at once, as arrays: every way of the closed form to hold each of them, checked by the chain from its angles.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DVec3};

use super::arm::Geometry;
use super::lanes::Lanes;
use super::offset_wrist::OffsetWrist;
use super::ortho_batch::{Block, POSES};
use super::ortho_parallel::OrthoParallel;
use super::solution::HELD;

/// Greatest ways an arm has.
pub const WAYS: usize = 8;

/// Flange poses in the base, one array for each number.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Poses {
    /// x, y and z, mm.
    pub position: [Vec<f64>; 3],
    /// The rotation's columns one after the other.
    pub rotation: [Vec<f64>; 9],
}

impl Poses {
    /// One more pose.
    pub fn push(&mut self, pose: Pose) {
        let rotation = DMat3::from_quat(pose.orientation).to_cols_array();
        for (array, value) in self.position.iter_mut().zip(pose.position.to_array()) {
            array.push(value);
        }
        for (array, value) in self.rotation.iter_mut().zip(rotation) {
            array.push(value);
        }
    }

    /// How many there are: the shortest array's length.
    pub fn len(&self) -> usize {
        let arrays = self.position.iter().chain(&self.rotation);
        arrays.map(Vec::len).min().unwrap_or(0)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn at(&self, i: usize) -> (DMat3, DVec3) {
        let position = DVec3::from_array(std::array::from_fn(|k| self.position[k][i]));
        let rotation: [f64; 9] = std::array::from_fn(|k| self.rotation[k][i]);
        (DMat3::from_cols_array(&rotation), position)
    }
}

/// The ways to hold poses: pose `i` has its `count[i]` ways from `WAYS * i` on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ways {
    /// Joint angles, rad, at any turn, one array a joint.
    pub angles: [Vec<f64>; 6],
    /// Whether a way is singular.
    pub singular: Vec<bool>,
    /// How many ways each pose has.
    pub count: Vec<u8>,
}

impl Ways {
    /// The angles of way `k` of pose `i`, if there is one.
    pub fn get(&self, i: usize, k: usize) -> Option<[f64; 6]> {
        let count = usize::from(*self.count.get(i)?);
        (k < count).then(|| std::array::from_fn(|j| self.angles[j][WAYS * i + k]))
    }

    /// One more way of pose `i`.
    fn add(&mut self, i: usize, angles: [f64; 6], singular: bool) {
        let place = WAYS * i + usize::from(self.count[i]);
        for (array, angle) in self.angles.iter_mut().zip(angles) {
            array[place] = angle;
        }
        self.singular[place] = singular;
        self.count[i] += 1;
    }
}

/// All ways of a closed form to hold each of `poses`, limits and turns aside; equal ones at singularities are not merged. The arrays
/// of `ways` are used again. An arm without a closed form has none here.
pub fn inverse(geometry: &Geometry, poses: &Poses, ways: &mut Ways) {
    let count = poses.len();
    for array in &mut ways.angles {
        array.clear();
        array.resize(WAYS * count, 0.0);
    }
    ways.singular.clear();
    ways.singular.resize(WAYS * count, false);
    ways.count.clear();
    ways.count.resize(count, 0);
    match geometry {
        Geometry::SphericalWrist(arm) => by_blocks(arm, poses, ways),
        Geometry::OffsetWrist(arm) => one_by_one(arm, poses, ways),
        Geometry::Other => {}
    }
}

/// Eight poses at once; what the last block lacks is filled with its first pose.
fn by_blocks(arm: &OrthoParallel, poses: &Poses, ways: &mut Ways) {
    let count = poses.len();
    for first in (0..count).step_by(POSES) {
        let last = count - 1;
        let lanes = |array: &[f64]| Lanes(std::array::from_fn(|i| array[(first + i).min(last)]));
        let block = Block {
            rotation: std::array::from_fn(|k| lanes(&poses.rotation[k])),
            position: std::array::from_fn(|k| lanes(&poses.position[k])),
        };
        let here = POSES.min(count - first);
        arm.solve_block(&block, |_, way| {
            for lane in (0..here).filter(|lane| way.held[*lane]) {
                let pose = first + lane;
                let angles = way.angles.map(|a| a.0[lane]);
                ways.add(pose, angles, way.singular[lane]);
            }
        });
    }
}

fn one_by_one(arm: &OffsetWrist, poses: &Poses, ways: &mut Ways) {
    for i in 0..poses.len() {
        let (rotation, position) = poses.at(i);
        let Ok(found) = arm.solve(&rotation, position) else {
            continue;
        };
        for candidate in found.as_slice() {
            let (turned, at) = arm.forward(candidate.angles);
            let off = turned - rotation;
            // the square of a small rotation is half the sum of squares of what it changes
            let square = off.x_axis.length_squared()
                + off.y_axis.length_squared()
                + off.z_axis.length_squared();
            if at.distance_squared(position) < HELD[0] * HELD[0] && square < 2.0 * HELD[1] * HELD[1]
            {
                ways.add(i, candidate.angles, candidate.singular.any());
            }
        }
    }
}
