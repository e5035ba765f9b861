//! Yaskawa jobs in INFORM, read and written: one `.JBI` with positions in a user frame (a relative job) and instructions; the arc by
//! condition files.
//!
//! Positions carry their `RCONF`, so a robot must be named. Every use of a position has its own entry, as the controller wants it. A
//! circle is three `MOVC`, the first where the tool already is; between two circles a `MOVL` to that same place parts them. A base axis
//! (`BC00012`) stands beside each position, in its own group (`RB1,BS1`); a station (`EC00012`) is a second group, and `SMOVL … +MOVJ` leads both
//! together. Format: NX100 and DX100 manuals, "Job data format" (NPOS, GROUP, positions of base and station), the words of moves with them
//! as published writers of jobs have them; digits: 1 µm, 0.0001°, whole pulses, a tenth of the unit of speed.

mod motion;
mod parse;
mod positions;
mod pulses;
mod times;
mod words;
mod write;

pub use parse::read;
pub use pulses::Pulses;
pub(crate) use words::zone_near;
pub use words::{InformSpeed, InformWords};
pub use write::write;
