//! All axes of a cell in one row: six joints of the arm, the track, two axes of a positioner.

use super::layout::{Cell, Values};
use crate::kinematics::Limits;

/// How many there are.
pub const AXES: usize = 9;

impl Cell {
    /// The same cell where nobody tells how fast its axes can speed up.
    #[must_use]
    pub fn without_accelerations(&self) -> Cell {
        let mut cell = self.clone();
        let beside = cell.track.iter_mut().chain(&mut cell.positioner);
        for chain in std::iter::once(&mut cell.arm.chain).chain(beside) {
            for joint in &mut chain.joints {
                joint.limits.acceleration = None;
            }
        }
        cell
    }

    /// What each axis can do; nothing for those that the cell lacks.
    pub fn axis_limits(&self) -> [Option<Limits>; AXES] {
        std::array::from_fn(|i| {
            let joint = match i.checked_sub(6) {
                None => self.arm.chain.joints.get(i),
                Some(axis) => self.external_joint(axis),
            };
            joint.map(|j| j.limits)
        })
    }

    /// Where each axis stands as the controller shows it, rad or mm.
    pub fn shown(&self, values: &Values) -> [f64; AXES] {
        let arm = self.arm.shown(values.arm);
        let beside = values.external().0;
        std::array::from_fn(|i| match i.checked_sub(6) {
            None => arm[i],
            Some(axis) => beside[axis],
        })
    }
}
