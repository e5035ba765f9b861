//! The voxels of the chart simulation: how many, and the memory they take.

use super::words::{memory, time};
use crate::ebm::settings::Settings;

/// Bytes of memory for each voxel, results included; measured on sections of 1 260 and 12 600 mm².
const PER_VOXEL: f64 = 54.0;
/// Bytes for each value of the pictures that a page carries, and how many values it carries at most.
const PER_PICTURED: f64 = 22.0;
/// See `PER_PICTURED`.
const PICTURED: f64 = 12e6;
/// Bytes of everything else.
const REST: f64 = 20e6;
/// Planes of voxels.
pub(super) fn planes(settings: &Settings) -> f64 {
    (depth(settings) / settings.job.ebm.layer.0 - 1e-6).ceil()
}

/// How deep voxels reach, mm.
pub(super) fn depth(settings: &Settings) -> f64 {
    3.5 * settings.job.ebm.penetration.0
}

/// What drawing with charts will cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::ebm) struct Cost {
    /// Extent of the voxels, mm.
    pub(in crate::ebm) extent: [f64; 2],
    /// Voxels.
    pub(in crate::ebm) voxels: f64,
    /// Bytes of memory.
    pub(in crate::ebm) bytes: f64,
    /// Seconds of one core.
    pub(in crate::ebm) seconds: f64,
}

impl Cost {
    /// Of voxels over an extent, mm, before anything is drawn on them.
    pub(in crate::ebm) fn of_extent(settings: &Settings, extent: [f64; 2]) -> Self {
        let voxel = settings.job.simulation.voxel.0;
        let columns: f64 = extent.map(|size| (size / voxel).ceil()).iter().product();
        let voxels = columns * planes(settings);
        let pictured = (columns * f64::from(*settings.job.simulation.frames)).min(PICTURED);
        // an optimiser starts again and again from what it keeps
        let copies = if settings.optimise.is_some() {
            2.0
        } else {
            1.0
        };
        Cost {
            extent,
            voxels,
            bytes: REST + PER_PICTURED * pictured + copies * PER_VOXEL * voxels,
            seconds: 0.0,
        }
    }

    /// In words.
    pub(in crate::ebm) fn words(&self) -> String {
        let [width, depth] = self.extent;
        let (memory, time) = (memory(self.bytes), time(self.seconds));
        format!(
            "{:.2} million voxels over {width:.1} x {depth:.1} mm: about {memory} of memory and {time} of one core to draw them once",
            1e-6 * self.voxels
        )
    }
}
