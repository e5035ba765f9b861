//! Stäubli programs in VAL3, read and written: a project of files (`.pjx`, its programs `.pgx`, its data `.dtx`); the arc by lines of the
//! cell.
//!
//! Moves are queued while the program runs on, so a wait and what switches the arc stand behind `waitEndMove()`: the arm stops there,
//! and lines of the arc without it are not taken for the arc's. Points lie in the frame `fPart` with their configuration where a robot
//! was named. Where the torch stands the part is the tool, a tool for each of its points (`tPart`, in `tHeld` of the flange), and each move leads that
//! tool to the torch (`fTorch`): the point comes there with the speed of the wire over the part. Format: projects, programs and data of VAL3 s7 as published by others; digits: 1 µm and 0.0001°.

mod data;
mod parse;
mod words;
mod write;

pub use data::in_inches;
pub use parse::read;
pub use words::{Val3Output, Val3OutputKind, Val3Words};
pub use write::write;
