//! A track that carries the arm along while metal is laid: a key of the `[program]` table of a cell file.

use meltpath_base::{choice, table};

choice! {
    /// What the user frame does while the track moves.
    pub enum TrackFrame {
        Stands "stands" => "It stands: the controller counts the track to the arm, and a position says where the tool is, wherever the arm stands.",
        Rides "rides" => "It rides along with the arm. No programs are written so.",
    }
}

table! {
    /// A track that carries the arm, moved together with it: the first external axis of the robot's group, in mm.
    pub struct Track {
        /// Who says so: the setup of the controller.
        source: String => required;
        /// What the user frame does while the track moves.
        user_frame: TrackFrame => required;
        /// ABB: its mechanical unit, which programs activate.
        unit: String => none("needed for abb-rapid");
        /// Yaskawa: pulses a millimetre of the base axis, below zero where they count against the track; a parameter of the controller.
        pulses_per_millimetre: f64 where within(-1e7, 1e7) => none("needed for yaskawa-inform");
    }
}

impl Track {
    /// How many external axes of the robot's group carry the arm, from the first on.
    pub(crate) fn slides(&self) -> usize {
        usize::from(*self.user_frame == TrackFrame::Stands)
    }
}
