//! ABB programs in RAPID, read and written: one module with its data and one routine a program; the arc by ArcWare.
//!
//! Beads are `ArcLStart`, `ArcL`, `ArcC`, `ArcLEnd` with one `welddata` for each pair of schedule and speed: the speed of a bead is that
//! of its weld data, mm/s. Tool, work object and seam data are the controller's, called by the names that the cell tells. Positions
//! carry their `confdata` where a robot was named, else the monitoring of configurations is off.

mod data;
mod parse;
mod statements;
mod words;
mod write;

pub use parse::read;
pub use words::RapidWords;
pub use write::write;
