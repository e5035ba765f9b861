//! The laser scan-head pipeline: recipes on a plate of squares, on read layers or on layers of a part, where the laser really
//! goes, comparison, verdict.

pub(crate) mod defocus;
pub mod error;
pub(crate) mod friction;
pub mod heat;
mod judge;
pub(crate) mod left_out;
mod marked_again;
mod motion;
pub(crate) mod optimise;
pub(crate) mod paced;
pub mod plan;
mod refuse;
pub(crate) mod result;
pub mod run;
pub mod settings;
pub(crate) mod strays;
mod toolpath_file;

pub use error::LpbfError;
pub use run::{examine, run};
