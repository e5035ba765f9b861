//! Scan heads, motors and recipes as data files: every number with its unit and its source.
//!
//! The numbers of the two reference heads are reconstructed (docs/theory/sources.md, reference heads): the thesis does not print
//! its motors' parameters.

mod axis;
mod figure;
mod friction;
mod head;
mod motor;
mod recipe;
mod servo;

pub use friction::KnownDrag;
pub use head::{HeadData, HeadFile, PlateTable, parse_head};
pub use motor::{MotorFile, ToldMotor, parse_motor};
pub use recipe::{RecipeFile, parse_recipe};
