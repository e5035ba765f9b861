//! What was measured.

use std::path::PathBuf;

use meltpath_base::Verdict;
use meltpath_deposition::capillary::Capillary;
use meltpath_deposition::corner::{Balance, Fold};
use meltpath_deposition::pursuit::identify::{Identified, NoLength};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_perception::beads::Bead;
use meltpath_perception::plate::Plate;

use super::corner::deviation::Deviation;
use super::corner::relief::Relief;
use super::file::{CornerSetting, Scan, Setting};

/// A mean and the standard deviation of what it is of.
pub type Mean = [f64; 2];

/// A bead with its sizes.
#[derive(Debug, Clone)]
pub struct Measured {
    /// As it was found.
    pub bead: Bead,
    /// Width over its sections, mm.
    pub width: Mean,
    /// Standard uncertainty of the mean width, mm: by scatter along the bead, and by what of its feet is not told from the plate.
    pub width_sigma: f64,
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

    /// Share of its width that points show; the mean over the sections.
    pub fn shown(&self) -> f64 {
        let all = &self.bead.sections;
        all.iter().map(|s| s.shown).sum::<f64>() / all.len() as f64
    }

    /// Two thirds of width times height over the area, less one: zero of a parabola.
    pub fn form(&self) -> f64 {
        2.0 / 3.0 * self.width[0] * self.height[0] / self.area[0] - 1.0
    }
}

/// A corner with what was found.
///
/// Its frame: the corner is the origin, the torch comes along x from the negative side, y is to its left, z stands on the plate. mm.
#[derive(Debug, Clone)]
pub struct MeasuredCorner {
    /// Where its legs meet, in the frame of the cloud.
    pub place: DVec3,
    /// The ends of its legs, in the frame of the cloud, in the order of travel.
    pub ends: [DVec3; 2],
    /// What the file tells.
    pub told: CornerSetting,
    /// How far its legs turn, rad, not signed.
    pub seen: f64,
    /// Lengths of the legs, in the order of travel.
    pub legs: [f64; 2],
    /// Mean width, height and area of its straight parts, mm and mm².
    pub mean: [f64; 3],
    /// Standard deviation of the area over sections, and how many there are.
    pub scatter: (f64, usize),
    /// Its crest.
    pub crest: Vec<DVec2>,
    /// Its surface.
    pub relief: Relief,
    /// The pursuit length as jobs follow it.
    pub pursuit: Result<Identified, NoLength>,
    /// That of a follower at a constant distance, which sharp corners push back first.
    pub rigid: Option<f64>,
    /// How far the crest lies off the nearest curve of a torch that came the other way, mm.
    pub other_way: Option<f64>,
    /// Volumes.
    pub balance: Balance,
    /// The fold of the parabola of the mean width and height, beside that of the sections themselves.
    pub parabola: Fold,
    /// What slowing down should have added by the torch's record, mm³.
    pub slowing: Option<f64>,
    /// Cells of the corner that the scan shows, as a share.
    pub shown: f64,
    /// The length that the crest of the deposit's model shows when it is laid with the length that was found, mm: a crest is not the curve
    /// that the pool follows.
    pub shown_by_model: Option<f64>,
    /// The deposit's model against the scan; none where it could not be made.
    pub deviation: Option<Deviation>,
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
    /// The beads with a corner.
    pub corners: Vec<MeasuredCorner>,
    /// The file of pursuit lengths that they make, where they make one.
    pub pursuit: Option<String>,
    /// The process map that they make, where they make one.
    pub map: Option<String>,
    /// As checks.
    pub verdict: Verdict,
    /// The folder of the report.
    pub folder: PathBuf,
}
