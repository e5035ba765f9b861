//! Scan heads, motors and recipes as data files: every number with its unit and its source.
//!
//! The numbers of the two reference heads are reconstructed (docs/theory/sources.md, reference heads): the thesis does not print
//! its motors' parameters.

mod axis;
mod figure;
mod head;
mod motor;
mod recipe;

pub use figure::{Figure, HeadFileError};
pub use head::{HeadData, Plate, parse_head};
pub use motor::parse_motor;
pub use recipe::parse_recipe;
