//! What scripts call on a Universal Robot: the `[program.script]` table of a cell file.

use meltpath_base::table;

use crate::program::Dialect;
use crate::template::ArcLines;

table! {
    /// The part's place, and what switches the arc.
    pub struct ScriptWords {
        /// Who says so: the installation.
        source: String => required;
        /// Where the part lies in the base: a pose such as `p[0.5,0,0.1,0,0,0]` (m, rad), or the name of a feature.
        part: String => required;
        /// Lines that start the arc and that set it anew while it burns; `{1}`, `{2}`… stand for the values of the schedule.
        arc_start: Vec<String> => required;
        /// Lines that end the arc.
        arc_end: Vec<String> => required;
    }
}

impl ScriptWords {
    pub(crate) fn arc(&self) -> ArcLines<'_> {
        ArcLines {
            dialect: Dialect::UrScript,
            start: &self.arc_start,
            set: &self.arc_start,
            end: &self.arc_end,
        }
    }
}
