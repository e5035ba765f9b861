//! Time interpolation: the commanded point at every sample.
//!
//! Source: Rasoanarivo 2020, § 2.2.2.1: the programmed speed is applied, one ramp a vector, no acceleration; smoothing is the
//! drives' business. A vector of length ℓ takes ⌈ℓ/(v Ts)⌉ samples.

use meltpath_geometry::math::DVec3;

use crate::head::vector::ScanJob;

/// Rounding of a length in samples that is whole but for the last bits.
const WHOLE: f64 = 1e-9;

/// Samples of the commanded path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CommandBlock {
    /// Index of the first sample in the job.
    pub first: u64,
    /// Commanded point, mm.
    pub position: Vec<DVec3>,
    /// The vector that the sample belongs to (moving along it or waiting at its end).
    pub vector: Vec<u32>,
    /// Whether the command moves during the period that ends at this sample.
    pub moving: Vec<bool>,
}

impl CommandBlock {
    /// Empties the block, keeping its room.
    fn restart(&mut self, first: u64) {
        self.first = first;
        self.position.clear();
        self.vector.clear();
        self.moving.clear();
    }
}

/// Samples that vector `i` moves and then waits.
pub(crate) fn counts(job: &ScanJob, i: usize, period: f64) -> (u64, u64) {
    let v = &job.vectors[i];
    let moving = (job.length_of(i) / (v.speed * period) - WHOLE)
        .ceil()
        .max(0.0);
    (moving as u64, (v.wait / period).round() as u64)
}

/// Number of samples of a job, the one at its start included, without run-out.
pub fn sample_count(job: &ScanJob, period: f64) -> u64 {
    (0..job.vectors.len())
        .map(|i| counts(job, i, period))
        .fold(1, |sum, (m, w)| sum + m + w)
}

/// Interpolates a job, block after block. Sample 0 is the start; after the last vector the command rests for a while, so
/// that the axes arrive.
#[derive(Debug, Clone)]
pub struct Interpolator<'a> {
    job: &'a ScanJob,
    period: f64,
    sample: u64,
    vector: usize,
    /// Samples of this vector already given, and how many it has.
    done: u64,
    moving: u64,
    waiting: u64,
    rest: u64,
}

impl<'a> Interpolator<'a> {
    /// At the start of `job`, one sample each `period` s, with `rest` samples at the end.
    pub fn new(job: &'a ScanJob, period: f64, rest: u64) -> Self {
        let mut interpolator = Interpolator {
            job,
            period,
            sample: 0,
            vector: 0,
            done: 0,
            moving: 0,
            waiting: 0,
            rest,
        };
        interpolator.enter();
        interpolator
    }

    fn enter(&mut self) {
        self.done = 0;
        (self.moving, self.waiting) = if self.vector < self.job.vectors.len() {
            counts(self.job, self.vector, self.period)
        } else {
            (0, self.rest)
        };
    }

    /// Fills `block` with the next `count` samples or fewer at the end; false when there are none left.
    pub fn fill(&mut self, block: &mut CommandBlock, count: usize) -> bool {
        block.restart(self.sample);
        let last = self.job.vectors.len().saturating_sub(1);
        if self.sample == 0 && count > 0 {
            block.position.push(self.job.start);
            block.vector.push(0);
            block.moving.push(false);
        }
        while block.position.len() < count {
            if self.done == self.moving + self.waiting {
                if self.vector > last {
                    break;
                }
                self.vector += 1;
                self.enter();
                continue;
            }
            let room = (count - block.position.len()) as u64;
            if self.done < self.moving {
                let n = room.min(self.moving - self.done);
                let from = self.job.start_of(self.vector);
                let to = self.job.vectors[self.vector].end;
                let step = (to - from) / self.moving as f64;
                for k in self.done + 1..=self.done + n {
                    let at = if k == self.moving {
                        to
                    } else {
                        from + step * k as f64
                    };
                    block.position.push(at);
                }
                self.push_labels(block, n, true, last);
            } else {
                let n = room.min(self.moving + self.waiting - self.done);
                let at = self
                    .job
                    .vectors
                    .get(self.vector.min(last))
                    .map_or(self.job.start, |v| v.end);
                block.position.extend(std::iter::repeat_n(at, n as usize));
                self.push_labels(block, n, false, last);
            }
        }
        self.sample += block.position.len() as u64;
        !block.position.is_empty()
    }

    fn push_labels(&mut self, block: &mut CommandBlock, n: u64, moving: bool, last: usize) {
        let vector = self.vector.min(last) as u32;
        block.vector.extend(std::iter::repeat_n(vector, n as usize));
        block.moving.extend(std::iter::repeat_n(moving, n as usize));
        self.done += n;
    }
}
