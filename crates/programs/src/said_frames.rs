//! Where a program itself says that its frames lie.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;

/// Where a program says that frames lie, by the numbers that its positions call them: as far as it says it in numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SaidFrames {
    /// User frames in the arm's base; in the flange where the robot holds the part.
    pub user: BTreeMap<u32, Pose>,
    /// Tools in the flange; in the world where they stand.
    pub tool: BTreeMap<u32, Pose>,
}
