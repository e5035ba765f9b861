//! The laser scan-head pipeline: recipes on a plate of squares or on read layers, where the laser really goes, comparison,
//! verdict.

mod comparison;
pub mod heat;
mod motion;
mod optimise;
mod present;
mod present_heat;
mod refuse;
mod result;
pub mod run;
pub mod settings;
pub mod work;

pub use run::{examine, run};
