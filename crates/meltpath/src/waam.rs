//! The wire-arc pipeline: part, plan, program, machine, metal, verdict.

mod bead;
pub(crate) mod checks;
mod columns;
mod cover;
mod doubt;
pub mod error;
pub(crate) mod film;
mod foreign;
mod foretell;
mod heights;
mod hold;
pub mod judge;
mod lean;
mod loaded;
mod machine;
mod mend;
mod metal;
pub mod plan;
mod planned;
mod process;
pub mod program;
pub(crate) mod program_files;
mod program_to_folder;
mod reach;
pub mod record;
pub mod run;
pub mod settings;
pub mod simulate;
pub mod surface;
pub mod target;
mod tube;
pub mod wanted;

pub use error::WaamError;
pub use foreign::simulate_program;
pub use program_to_folder::program_to_folder;
pub use run::{examine, plan_to_file, read_toolpath, run};
