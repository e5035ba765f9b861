//! What was measured: records of drives and sensors, read from the files that benches and controllers write, put into
//! units, and examined before anything is concluded from them.
//!
//! Records of an [`arc`] are cut to where it burns steadily. A [`cloud`] of points is looked through for its [`plate`] and the [`beads`] on it.
//!
//! A record is read with a [`mapping`]: a short TOML file that says which column is what, in which unit.

pub mod arc;
pub mod beads;
pub mod cloud;
mod error;
pub mod examine;
pub mod mapping;
pub mod plate;
mod reading;
pub mod record;
pub mod table;

pub use error::RecordError;
pub use mapping::Mapping;
pub use reading::read;
pub use record::{Channel, Record};
