//! Universal Robots script, read and written: one function a program, poses in the part's frame, the arc by lines of the cell.
//!
//! These arms have no words for how they stand. The first move is therefore made in joints: those nearest to the joints that were
//! computed (`get_inverse_kin` with them), so a robot must be named. Accelerations are the controller's own.

mod parse;
mod variables;
mod words;
mod write;

pub(crate) use parse::BASE;
pub use parse::read;
pub use words::ScriptWords;
pub use write::write;
