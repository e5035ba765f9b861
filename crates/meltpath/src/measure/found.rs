//! What was measured.

use std::path::PathBuf;

use meltpath_base::Verdict;
use meltpath_deposition::capillary::Capillary;
use meltpath_perception::beads::Bead;
use meltpath_perception::plate::Plate;

use super::file::{Scan, Setting};

/// A mean and the standard deviation of what it is of.
pub type Mean = [f64; 2];

/// A bead with its sizes.
#[derive(Debug, Clone)]
pub struct Measured {
    /// As it was found.
    pub bead: Bead,
    /// Width over its sections, mm.
    pub width: Mean,
    /// Height over its sections, mm.
    pub height: Mean,
    /// Area over its sections, mm².
    pub area: Mean,
    /// The section of its width and height that liquid at rest has; none where none is so high and narrow.
    pub at_rest: Option<Capillary>,
    /// The settings that it was laid with.
    pub setting: Option<Setting>,
    /// The wire that was fed for it over its way, mm².
    pub fed: Option<f64>,
}

impl Measured {
    /// Its metal over the wire that was fed, and the standard uncertainty.
    pub fn kept(&self, wire_sigma: f64) -> Option<Mean> {
        let [area, scatter] = self.area;
        let ratio = area / self.fed?;
        let of_mean = scatter / (self.bead.sections.len() as f64).sqrt() / area;
        Some([ratio, ratio * of_mean.hypot(wire_sigma)])
    }

    /// How far points are off the parabola, root mean square, over its height; the mean over the sections.
    pub fn off(&self) -> f64 {
        let all = &self.bead.sections;
        all.iter().map(|s| s.off / s.height).sum::<f64>() / all.len() as f64
    }

    /// Two thirds of width times height over the area, less one: zero of a parabola.
    pub fn form(&self) -> f64 {
        2.0 / 3.0 * self.width[0] * self.height[0] / self.area[0] - 1.0
    }
}

/// What was measured.
#[derive(Debug, Clone)]
pub struct Found {
    /// The file, resolved.
    pub scan: Scan,
    /// The plate.
    pub plate: Plate,
    /// Points of the scan.
    pub points: usize,
    /// The beads.
    pub beads: Vec<Measured>,
    /// The process map that they make, where they make one.
    pub map: Option<String>,
    /// As checks.
    pub verdict: Verdict,
    /// The folder of the report.
    pub folder: PathBuf,
}
