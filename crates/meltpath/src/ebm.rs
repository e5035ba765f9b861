//! The electron-beam pipeline: beam path, charts, temperatures of every voxel, better speeds, verdict.

pub mod correct;
pub mod cost;
pub mod error;
pub mod gun;
pub mod judge;
pub mod optimise;
pub mod plan;
pub mod preview;
pub mod rounds;
pub mod run;
pub mod settings;
pub mod simulate;

pub use error::EbmError;
pub use run::{examine, run};
