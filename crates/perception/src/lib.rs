//! What was measured: records of drives and sensors, read from the files that benches and controllers write, put into
//! units, and examined before anything is concluded from them.
//!
//! A record is read with a [`mapping`]: a short TOML file that says which column is what, in which unit.

mod error;
pub mod examine;
pub mod mapping;
mod reading;
pub mod record;
pub mod table;

pub use error::RecordError;
pub use mapping::Mapping;
pub use reading::read;
pub use record::{Channel, Record};
