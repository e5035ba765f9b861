//! FANUC programs as text (`.ls`), read and written.
//!
//! The layout follows what controllers and other programming software print: `/PROG`, `/ATTR`, `/APPL`, `/MN` with numbered
//! instructions that end in `;`, `/POS` with one block a position, `/END`. Words that are not modelled are kept verbatim and listed.
//! Arc words and header are the cell's business: check them against the manual of the controller at hand.

mod line;
mod parse;
mod positions;
mod write;

pub use parse::{parse, read};
pub use write::write;

pub(crate) use line::parse as parse_instruction;
pub(crate) use line::weave_text;
pub(crate) use positions::{lacking, lacks_config, other_unit};

use crate::scan::tidy;

/// An instruction in one line, as people read it.
pub(crate) fn instruction_text(instruction: &crate::program::Instruction) -> String {
    tidy(&line::write(instruction))
}
