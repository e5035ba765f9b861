//! STEP part files (ISO 10303-21 with AP203, AP214 or AP242) into boundary representations.
//!
//! Read are solids, solids with cavities, faceted solids and surface models on plane, cylinder,
//! cone, sphere, torus, B-spline, revolution, extrusion and offset surfaces, in assemblies of any
//! depth, each in its own units. What else bounds metal is refused by name, never left out.
//!
//! The parser is this crate's own: errors carry the line, no nesting overflows a stack, and no input
//! makes it panic.

mod assembly;
mod curves;
mod entity;
mod error;
mod exchange;
mod lexer;
mod orientation;
mod placement;
mod solids;
mod surfaces;
mod units;

use std::io::Read;

use meltpath_base::Reporter;

use crate::brep::BrepModel;
pub use assembly::MOST_SOLIDS;
pub use error::{EntityPlace, StepError};

/// Reads a part file.
///
/// Lengths come out in millimetres, angles in radians, whatever the file's units. Items that bound
/// no metal (wires, points, notes) are left out with a warning.
///
/// # Errors
/// [`StepError`], with instance number, entity type, line and what to do.
pub fn read(mut source: impl Read, reporter: &Reporter) -> Result<BrepModel, StepError> {
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes)?;
    parse(&bytes, reporter)
}

/// Reads a part file that is in memory: see [`read`].
///
/// # Errors
/// [`StepError`], with instance number, entity type, line and what to do.
///
/// ```
/// use meltpath_base::Reporter;
/// use meltpath_geometry::step::{self, StepError};
/// let refused = step::parse(b"solid cube", &Reporter::new());
/// assert!(matches!(refused, Err(StepError::NotStep { .. })));
/// ```
pub fn parse(bytes: &[u8], reporter: &Reporter) -> Result<BrepModel, StepError> {
    let file = exchange::Exchange::parse(bytes)?;
    assembly::read(&file, reporter)
}
