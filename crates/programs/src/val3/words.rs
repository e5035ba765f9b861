//! What a project on a Stäubli controller holds: the `[program.val3]` table of a cell file.

use meltpath_base::{Angle, Length, choice, table};

use crate::program::Dialect;
use crate::template::ArcLines;

choice! {
    /// Kinds of outputs.
    pub enum Val3OutputKind {
        Digital "dio" => "On or off.",
        Analog "aio" => "A value.",
        Number "num" => "No output: a number that the lines set.",
    }
}

table! {
    /// Part and torch, outputs, and what switches the arc.
    pub struct Val3Words {
        /// Who says so: the controller's frames, tools and outputs.
        source: String => required;
        /// Where the part lies in the world, in the flange where the robot holds it: x, y, z.
        part_position: [Length; 3] => required;
        /// How it is turned: rx, ry, rz, as the controller shows them.
        part_angles: [Angle; 3] => default(["0 deg", "0 deg", "0 deg"], "not turned");
        /// The wire tip in the flange, in the world where the torch stands, at the nominal contact-tube distance: x, y, z.
        tool_position: [Length; 3] => required;
        /// How the torch is turned: rx, ry, rz, as the controller shows them; its z points along the wire towards the work.
        tool_angles: [Angle; 3] => default(["0 deg", "0 deg", "0 deg"], "not turned");
        /// Outputs and numbers that the lines of the arc name.
        outputs as "output": Vec<Val3Output> => default([], "none");
        /// Lines that start the arc and that set it anew while it burns; `{1}`, `{2}`… stand for the values of the schedule.
        arc_start: Vec<String> => required;
        /// Lines that end the arc.
        arc_end: Vec<String> => required;
    }

    /// An output of the controller, or a number.
    pub struct Val3Output {
        /// What programs call it, such as `doArc`.
        name: String => required;
        /// What it is.
        kind: Val3OutputKind => default("dio", "on or off");
        /// What an output is tied to on the controller.
        link: String => none("nothing: a number");
    }
}

impl Val3Words {
    pub(super) fn arc(&self) -> ArcLines<'_> {
        ArcLines {
            dialect: Dialect::Val3,
            start: &self.arc_start,
            set: &self.arc_start,
            end: &self.arc_end,
        }
    }
}
