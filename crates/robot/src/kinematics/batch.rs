//! Many poses at once, as arrays: every way of the closed form to hold each of them, checked by the chain from its angles.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DVec3};

use super::arm::Geometry;
use super::solution::{Candidates, HELD, Unreachable};

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
    for i in 0..count {
        let (rotation, position) = poses.at(i);
        let found: Result<Candidates, Unreachable> = match geometry {
            Geometry::SphericalWrist(arm) => arm.solve(&rotation, position),
            Geometry::OffsetWrist(arm) => arm.solve(&rotation, position),
            Geometry::Other => Err(Unreachable::NothingFound),
        };
        let Ok(found) = found else { continue };
        let mut held = 0;
        for candidate in found.as_slice() {
            let (turned, at) = match geometry {
                Geometry::SphericalWrist(arm) => arm.forward(candidate.angles),
                Geometry::OffsetWrist(arm) => arm.forward(candidate.angles),
                Geometry::Other => continue,
            };
            let off = turned - rotation;
            // the square of a small rotation is half the sum of squares of what it changes
            let square = off.x_axis.length_squared()
                + off.y_axis.length_squared()
                + off.z_axis.length_squared();
            if at.distance_squared(position) > HELD[0] * HELD[0] || square > 2.0 * HELD[1] * HELD[1]
            {
                continue;
            }
            let place = WAYS * i + held;
            for (array, angle) in ways.angles.iter_mut().zip(candidate.angles) {
                array[place] = angle;
            }
            ways.singular[place] = candidate.singular.any();
            held += 1;
        }
        ways.count[i] = u8::try_from(held).unwrap_or(u8::MAX);
    }
}
