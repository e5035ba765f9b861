//! What the head is asked to do: mark and jump vectors with their speeds, powers and waits.
//!
//! Source: Rasoanarivo 2020, § 2.5.2.

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::Role;
use serde::{Deserialize, Serialize};

/// Strongest laser, W.
pub(crate) const STRONGEST: f64 = 1e6;
/// Rounding of a length in samples that is whole but for the last bits.
const WHOLE: f64 = 1e-9;

/// Why a job cannot be executed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScanJobError {
    /// A vector with a value that has no sense.
    #[error("vector {index}: {what} is {value}, but must be {wanted}")]
    Vector {
        /// Position in the job, from 0.
        index: usize,
        /// Which of its values.
        what: &'static str,
        /// That value.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// A recipe or plate with a value that has no sense.
    #[error("{what} is {value}, but must be {wanted}")]
    Value {
        /// Which value.
        what: &'static str,
        /// That value.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// Nothing to do.
    #[error("the job has no mark vector")]
    Empty,
}

/// A straight move from where the last one ended, and a wait at its end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Vector {
    /// What it is for: the laser marks where it deposits, as a contour or as a fill.
    pub kind: Role,
    /// Where it ends: x and y in the plane, z the height of the focus, mm.
    pub end: DVec3,
    /// Speed, mm/s.
    pub speed: f64,
    /// Laser power, W; 0 where the laser is off.
    pub power: f64,
    /// Wait at its end, s.
    pub wait: f64,
    /// The caller's number of the part or square it belongs to.
    pub block: u32,
}

/// A job for the head: the layers of a toolpath as this head will run them. It is no [`meltpath_toolpath::Toolpath`], since a
/// vector has what no pass says, every value resolved by the recipe, the wait at its end, sky-writing, and is found by its number;
/// and no motion, since it says what is commanded, not where the mirrors are.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ScanJob {
    /// Where the head stands at first, mm.
    pub start: DVec3,
    /// The vectors, first executed first.
    pub vectors: Vec<Vector>,
}

impl ScanJob {
    /// Checks every vector, and that one marks.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn check(&self) -> Result<(), ScanJobError> {
        if !self.marks() {
            return Err(ScanJobError::Empty);
        }
        self.check_vectors(0)
    }

    /// Whether any vector marks.
    pub(super) fn marks(&self) -> bool {
        self.vectors.iter().any(|v| v.kind.deposits())
    }

    /// Checks every vector, the first of which is number `first` of the whole job.
    pub(super) fn check_vectors(&self, first: u32) -> Result<(), ScanJobError> {
        for (index, v) in (first as usize..).zip(&self.vectors) {
            let fail = |what, value, wanted| {
                Err(ScanJobError::Vector {
                    index,
                    what,
                    value,
                    wanted,
                })
            };
            if !v.end.is_finite() {
                return fail("the end", v.end.length(), "finite");
            }
            if !(v.speed > 0.0 && v.speed.is_finite()) {
                return fail("the speed", v.speed, "positive and finite (mm/s)");
            }
            if !(0.0..=STRONGEST).contains(&v.power) {
                return fail("the power", v.power, "not negative, and at most 1 MW (W)");
            }
            if v.power == 0.0 && v.kind.deposits() {
                return fail(
                    "the power",
                    v.power,
                    "above zero: a mark without power lights nothing (W)",
                );
            }
            if !(v.wait >= 0.0 && v.wait.is_finite()) {
                return fail("the wait", v.wait, "finite and not negative (s)");
            }
        }
        Ok(())
    }

    /// Where vector `i` starts, mm.
    pub fn start_of(&self, i: usize) -> DVec3 {
        if i == 0 {
            self.start
        } else {
            self.vectors[i - 1].end
        }
    }

    /// Length of vector `i`, mm.
    pub fn length_of(&self, i: usize) -> f64 {
        self.start_of(i).distance(self.vectors[i].end)
    }

    /// Samples of `period` s that vector `i` moves and then waits.
    pub(crate) fn samples_of(&self, i: usize, period: f64) -> (u64, u64) {
        let v = &self.vectors[i];
        let moving = (self.length_of(i) / (v.speed * period) - WHOLE)
            .ceil()
            .max(0.0);
        (moving as u64, (v.wait / period).round() as u64)
    }

    /// Length of all vectors of a kind, mm.
    pub fn length(&self, kind: Role) -> f64 {
        (0..self.vectors.len())
            .filter(|&i| self.vectors[i].kind == kind)
            .map(|i| self.length_of(i))
            .sum()
    }

    /// The first mark's start, mm.
    pub fn first_mark(&self) -> DVec3 {
        let first = self.vectors.iter().position(|v| v.kind.deposits());
        first.map_or(self.start, |i| self.start_of(i))
    }

    /// The vectors of a range as a job of their own, from rest where the first one starts.
    #[must_use]
    pub fn slice(&self, range: std::ops::Range<usize>) -> ScanJob {
        ScanJob {
            start: self.start_of(range.start),
            vectors: self.vectors.get(range).unwrap_or_default().to_vec(),
        }
    }
}
