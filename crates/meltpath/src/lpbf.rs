//! The laser scan-head pipeline: recipes on a plate of squares or on read layers, where the laser really goes, comparison,
//! verdict.

pub(crate) mod comparison;
pub mod error;
pub mod heat;
mod motion;
pub(crate) mod optimise;
mod refuse;
pub(crate) mod result;
pub mod run;
pub mod settings;
pub mod work;

pub use error::LpbfError;
pub use run::{examine, run};
