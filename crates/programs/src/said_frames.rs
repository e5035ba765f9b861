//! Where a program itself says that its frames lie.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_geometry::Pose;

/// Which of the controller's frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Which {
    /// A user frame: a KUKA's base.
    User,
    /// A tool.
    Tool,
}

/// An entry of the controller's tables of frames that a program sets itself: `BASE_DATA[1]={…}`.
#[derive(Debug, Clone, PartialEq)]
pub struct SetFrame {
    /// The instruction that sets it, from 0; nothing of a data list, which holds before all.
    pub at: Option<usize>,
    /// Which table.
    pub which: Which,
    /// Number of the entry.
    pub number: u32,
    /// Where the frame lies from there on.
    pub pose: Pose,
    /// Line in its file, from 1.
    pub line: u32,
    /// Text of the line.
    pub text: String,
}

/// A line that sets a frame while moves may be made in it before, too.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Changed {
    /// The program of the line.
    pub program: String,
    /// Line in its file, from 1.
    pub line: u32,
    /// Its text.
    pub text: String,
}

/// Where a program says that frames lie, by the numbers that its positions call them: as far as it says it in numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SaidFrames {
    /// User frames in the arm's base; in the flange where the robot holds the part. A KUKA's base is the torch in the world then.
    pub user: BTreeMap<u32, Pose>,
    /// Tools in the flange; in the world where they stand. A KUKA's tool is the part in the flange then.
    pub tool: BTreeMap<u32, Pose>,
    /// User frames that it declares by name, in small letters, be they used or not: where they lie in the arm's base.
    pub declared: BTreeMap<String, Pose>,
    /// Declarations of frames that moves use and that are no plain numbers: line and text.
    pub unread: Vec<(u32, String)>,
    /// User frames whose moves are told in another one: its number, and where they lie in it.
    pub told_in: BTreeMap<u32, (u32, Pose)>,
    /// Entries of the controller's tables that it sets, in the order of its text.
    pub set: Vec<SetFrame>,
    /// Instructions, from 0, that set frames which the program declares.
    pub variables: BTreeSet<usize>,
    /// Lines by which it is not known which moves are made in which frame.
    pub changed: Vec<Changed>,
}

impl SaidFrames {
    /// Whether the instruction, from 0, sets a frame that was read.
    pub(crate) fn sets(&self, at: usize) -> bool {
        self.variables.contains(&at) || self.set.iter().any(|set| set.at == Some(at))
    }

    /// The places of frames of a kind by their numbers.
    pub(crate) fn of(&self, which: Which) -> &BTreeMap<u32, Pose> {
        match which {
            Which::User => &self.user,
            Which::Tool => &self.tool,
        }
    }

    /// See [`SaidFrames::of`].
    pub(crate) fn of_mut(&mut self, which: Which) -> &mut BTreeMap<u32, Pose> {
        match which {
            Which::User => &mut self.user,
            Which::Tool => &mut self.tool,
        }
    }
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
