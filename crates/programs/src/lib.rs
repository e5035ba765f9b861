//! What controllers read: a neutral program, one module per dialect (each a writer and a parser), programs from toolpaths, and
//! toolpaths from programs, in the order in which a controller executes them. Files hold mm and degrees; what is executed is in mm, s, rad.

pub mod acceleration;
mod arc_word;
pub mod assembly;
pub mod build;
pub mod cell;
pub mod cli;
mod collected;
pub mod dialect;
mod execute;
mod expression;
pub mod fanuc_ls;
pub mod frame_text;
pub mod held;
pub mod inform;
pub mod krl;
pub mod modal;
mod orientation;
mod parsed;
pub mod positioner;
pub mod program;
pub mod rapid;
pub mod reading;
mod reserved;
pub mod said_frames;
mod scan;
pub mod shared_frames;
pub mod spacing;
mod spelling;
mod template;
pub mod toolpath_3mf;
pub mod track;
mod unrolled;
pub mod upkeep;
pub mod ur_script;
pub mod val3;
pub mod vectors;
mod weave;
mod written;

pub use build::{
    BuildError, BuildSettings, Built, Pause, Restart, Schedule, build, check_axes, check_cell,
    dry_run, laid_from, tell,
};
pub use cell::{CellProgramming, PathSpeedUnit};
pub use execute::{
    Becomes, ExecutionSettings, Gap, Lacking, Missing, NoPose, Open, ProgramError, Refusal,
    ToldOutput, ToldPosition, WeldSettings, becomes,
};
pub use parsed::{ParseError, Parsed, Unread};
pub use program::{ArcValue, Dialect, Program};
pub use reading::{Control, Reading, Way, read_toolpath};
pub use written::{TextFile, WriteError};
