//! What controllers read: a neutral program, one module per dialect (each a writer and a parser), programs from toolpaths,
//! and the order in which a controller executes them. Files hold mm and degrees; what is executed is in mm, s, rad.

pub mod assembly;
pub mod build;
pub mod cell;
pub mod cli;
pub mod execute;
pub mod fanuc_ls;
mod orientation;
pub mod program;
pub mod vectors;

pub use build::{BuildError, BuildSettings, Built, Pause, Schedule, build};
pub use cell::{CellProgramming, PathSpeedUnit};
pub use execute::{
    Executed, ExecutedKind, ExecutedMotion, ExecutedSpeed, Execution, ExecutionSettings, Gap,
    Missing, ProgramError, WeldSettings, execution_order,
};
pub use program::Program;
