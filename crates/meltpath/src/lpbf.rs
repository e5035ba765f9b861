//! The laser scan-head pipeline: recipes on a plate of squares, where the laser really goes, comparison, verdict.

mod present;
pub mod run;
pub mod settings;

pub use run::{doctor, run};
