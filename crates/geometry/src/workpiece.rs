//! The growing workpiece: what the metal has become so far, behind one interface.
//!
//! A [`HeightMap`] serves planar builds from a plate. It has one height per place, so it cannot hold an
//! overhang; a volume field (sparse voxels) answers the same [`Workpiece`] questions where that matters.

mod height_map;

pub use height_map::{HeightMap, MAX_CELLS, WorkpieceError};

use crate::{
    Mesh,
    math::{DVec2, DVec3},
};

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

/// What planning, machine and deposition ask of a workpiece, whatever holds the metal.
///
/// Lengths in mm, volumes in mm³, all in the part frame (plate at its base height, z up).
pub trait Workpiece {
    /// Distance from `from` along `direction` (any length but zero) to the first surface met, mm.
    ///
    /// `Some(0.0)` when `from` is inside the metal; `None` when the ray meets nothing.
    fn ray_to_surface(&self, from: DVec3, direction: DVec3) -> Option<f64>;

    /// Lays `volume` mm³ evenly over a disc of `radius` mm about `at`, growing along the local axis that
    /// the workpiece supports nearest to `axis`. Returns the volume really laid, mm³ (0 where `at` is
    /// off the workpiece).
    fn add(&mut self, at: DVec3, axis: DVec3, radius: f64, volume: f64) -> f64;

    /// The upper surface over a line in plan: (arc length along the line, z), at most `step` mm apart.
    fn section(&self, line: &[DVec2], step: f64) -> Vec<DVec2>;

    /// The whole workpiece as a closed mesh, with `floor` mm of plate under it.
    fn to_mesh(&self, crop: Crop, floor: f64) -> Mesh;

    /// Metal above the base, mm³; the same bits on any number of threads.
    fn volume(&self) -> f64;
}
