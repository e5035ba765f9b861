//! What laying in space tells: along the path, and where metal hung free.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::Voxels;
use serde::{Deserialize, Serialize};

/// What lies under a bead's axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Support {
    /// Metal, under the middle half of the bead's width at least.
    Metal,
    /// Metal under the axis, none within reach under a quarter of the width beside it.
    Partial,
    /// No metal within reach of the arc: the bead hangs free.
    None,
}

/// A place on the path of a bead.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LaidPoint {
    /// Tool point, mm, part frame.
    pub tool: DVec3,
    /// Unit torch axis, from the part to the torch.
    pub axis: DVec3,
    /// Time, s.
    pub time: f64,
    /// Command being executed.
    pub command: u32,
    /// Bead, counted from 0.
    pub bead: u32,
    /// Contact tube to the metal that this bead finds, along the axis, mm.
    pub ctwd: f64,
    /// Wire fed here over what the program asks for at the reference distance.
    pub feed: f64,
    /// Surface left on the bead's axis, mm.
    pub crest: DVec3,
    /// Thickness laid there along the torch axis, mm.
    pub thickness: f64,
    /// What carries the bead here.
    pub support: Support,
}

/// A stretch of bead without metal under it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Loose {
    /// Where it begins: the bead's axis, mm.
    pub position: DVec3,
    /// Its length, mm.
    pub length: f64,
    /// Bead, counted from 0.
    pub bead: u32,
    /// Command being executed.
    pub command: u32,
    /// What little there is: partial or none.
    pub support: Support,
}

/// What has been laid.
#[derive(Debug, Clone, PartialEq)]
pub struct Laid {
    /// All metal: what was there, and the beads.
    pub voxels: Voxels,
    /// Wire fed, mm: with the source's answer to the contact tube distance, where there is one.
    pub wire: f64,
    /// Metal laid, mm³: efficiency times wire section times wire.
    pub volume: f64,
    /// Metal for which there was no room in the box of voxels or in memory, mm³: not in `voxels`.
    pub beside: f64,
    /// Metal laid over places without metal within reach, mm³.
    pub loose_volume: f64,
    /// Stretches of bead without metal under them.
    pub loose: Vec<Loose>,
    /// Places along the beads, in order of time.
    pub path: Vec<LaidPoint>,
    /// Number of beads.
    pub beads: u32,
}
