//! The controller's interpolation from a log of a dry run: filter times and dwells, how sure they are, and whether two averages describe the
//! controller at all.
//!
//! The model is that of jobs ([`crate::interpolation::fir`], Rouchon 2022, §3.3.1), run with values under trial; the least squares are ours.

pub mod align;
pub mod driven;
pub mod fit;
pub mod frame;
pub mod log;
pub mod misfit;
pub mod model;
mod projection;

pub use align::{Aligned, align};
pub use driven::{DrivenPath, Stretch};
pub use fit::{Fitted, identify};
pub use log::{Log, LogError};
pub use misfit::{Comparison, Event, Seen, corners, events};
pub use model::Law;
