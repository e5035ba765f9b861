//! The electron-beam pipeline: beam path, charts, temperatures of every voxel, better speeds, verdict.

mod advice;
pub(crate) mod along;
pub(crate) mod charts;
pub mod correct;
pub mod cost;
pub mod drawn;
pub mod ends;
pub mod error;
pub mod film;
pub mod focus;
pub mod gun;
pub mod hatch;
pub mod judge;
pub mod optimise;
pub mod path_file;
pub mod plan;
pub mod region;
pub mod run;
pub mod settings;
pub mod simulate;
mod under;
mod verdict;

pub use error::EbmError;
pub use run::{examine, run};
