//! The growing workpiece: what the metal has become so far.
//!
//! A [`HeightMap`] serves planar builds from a plate. It has one height per place, so it cannot hold an overhang. [`Voxels`] hold metal
//! of any shape.

mod height_map;
mod voxels;

pub use height_map::{HeightMap, MAX_CELLS, WorkpieceError};
pub use voxels::{Column, Columns, MeshFill, Voxels, VoxelsError};

/// How much of the plate goes into a workpiece's mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Crop {
    /// Everything the map covers.
    Whole,
    /// Only what stands out: cells more than this many mm from the base, with one row of cells around.
    Built {
        /// Height off the base from which a cell counts as built, mm.
        threshold: f64,
    },
}
