//! Where a program itself says that its frames lie.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;

/// Where a program says that frames lie, by the numbers that its positions call them: as far as it says it in numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SaidFrames {
    /// User frames in the arm's base; in the flange where the robot holds the part. A KUKA's base is the torch in the world then.
    pub user: BTreeMap<u32, Pose>,
    /// Tools in the flange; in the world where they stand. A KUKA's tool is the part in the flange then.
    pub tool: BTreeMap<u32, Pose>,
    /// Declarations of frames that moves use and that are no plain numbers: line and text.
    pub unread: Vec<(u32, String)>,
}

/// Numbers from here on are those of frames that a program writes out; controllers number no frame so high.
pub(crate) const WRITTEN_OUT: u32 = 1001;

/// The number of a frame that a program writes out where it selects it: the same one for the same frame.
pub(crate) fn written_out(known: &mut BTreeMap<u32, Pose>, pose: Pose) -> u32 {
    let mut own = known.range(WRITTEN_OUT..);
    if let Some((number, _)) = own.find(|(_, there)| **there == pose) {
        return *number;
    }
    let number = known
        .range(WRITTEN_OUT..)
        .next_back()
        .map_or(WRITTEN_OUT, |(last, _)| last.saturating_add(1));
    known.insert(number, pose);
    number
}
