//! What a fit found: the beam, and contours for a diameter.

use std::path::PathBuf;

use meltpath_base::Verdict;
use meltpath_thermal::calibration::fit::Fitted;

use super::measurements::Measurements;

/// A contour for the wanted diameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Radius of the first circle, mm; absent where none between half and twice that measured gives the diameter.
    pub radius: Option<f64>,
    /// Diameter that the corrected beam gives with it, mm, and its standard uncertainty.
    pub diameter: [f64; 2],
}

/// Contours for a diameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The diameter wanted, mm.
    pub wanted: f64,
    /// With the beam as believed before, and as corrected.
    pub candidates: [Candidate; 2],
    /// Which of them to build.
    pub build: Option<usize>,
    /// Radius and diameter, mm, as believed before and as corrected.
    pub curves: [Vec<[f64; 2]>; 2],
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// What was measured.
    pub measurements: Measurements,
    /// The fit.
    pub fitted: Fitted,
    /// Contours for the wanted diameter.
    pub prediction: Option<Prediction>,
    /// Notes.
    pub verdict: Verdict,
    /// Where it was written.
    pub folder: PathBuf,
}
