//! The wire-arc pipeline: part, plan, program, machine, metal, verdict.

pub mod deposit;
pub mod drive;
pub mod error;
mod foreign;
pub mod judge;
mod loaded;
mod maker;
pub mod plan;
pub mod program;
pub mod run;
pub mod settings;
pub mod surface;

pub use error::WaamError;
pub use foreign::simulate_program;
pub use program::to_folder::{WrittenPrograms, program_to_folder};
pub use run::{LeftOpen, examine, plan_to_file, read_toolpath, run};
