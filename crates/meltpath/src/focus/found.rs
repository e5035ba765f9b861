//! A focus calibration as it was found.

use std::path::PathBuf;

use meltpath_base::Verdict;
use meltpath_gun::focus_walls::FromWalls;

use super::file::Walls;

/// What was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// The walls.
    pub walls: Walls,
    /// The calibration.
    pub calibrated: FromWalls,
    /// As checks.
    pub verdict: Verdict,
    /// The folder of the report.
    pub folder: PathBuf,
}
