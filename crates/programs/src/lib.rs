//! What controllers read: a neutral program, one module per dialect (each a writer and a parser), programs from toolpaths, and
//! toolpaths from programs, in the order in which a controller executes them. Files hold mm and degrees; what is executed is in mm, s, rad.

pub mod assembly;
pub mod build;
pub mod cell;
pub mod cli;
mod execute;
pub mod fanuc_ls;
mod orientation;
pub mod program;
pub mod reading;
pub mod vectors;

pub use build::{BuildError, BuildSettings, Built, Pause, Schedule, build};
pub use cell::{CellProgramming, PathSpeedUnit};
pub use execute::{ExecutionSettings, Gap, Missing, ProgramError, Refusal, WeldSettings};
pub use program::{ArcValue, Program};
pub use reading::{Control, Reading, Way, read_toolpath};
