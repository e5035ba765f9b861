//! Time interpolation: the commanded point at every sample.
//!
//! Source: Rasoanarivo 2020, § 2.2.2.1: the programmed speed is applied, one ramp a vector, no acceleration; smoothing is the
//! drives' business. A vector of length ℓ takes ⌈ℓ/(v Ts)⌉ samples.

use meltpath_geometry::math::DVec3;

use crate::head::error::HeadError;
use crate::head::prepared::Layers;
use crate::head::window::Window;

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

/// Number of samples of a job, the one at its start included, without run-out.
///
/// # Errors
/// [`HeadError`] of a layer that cannot be had.
pub fn sample_count(layers: Layers<'_>, period: f64) -> Result<u64, HeadError> {
    let mut samples = 1;
    for layer in layers {
        let job = layer?.job;
        let vectors = 0..job.vectors.len();
        samples += vectors
            .map(|i| job.samples_of(i, period))
            .fold(0, |sum, (moving, waiting)| sum + moving + waiting);
    }
    Ok(samples)
}

/// Interpolates a job, block after block. Sample 0 is the start; after the last vector the command rests for a while, so
/// that the axes arrive.
#[derive(Debug, Clone)]
pub struct Interpolator {
    period: f64,
    sample: u64,
    /// The vector now, and the one after it.
    vector: u32,
    next: u32,
    from: DVec3,
    to: DVec3,
    /// Samples of this vector already given, and how many it has.
    done: u64,
    moving: u64,
    waiting: u64,
    rest: u64,
    resting: bool,
}

impl Interpolator {
    /// At the start of a job, one sample each `period` s, with `rest` samples at the end.
    pub fn new(period: f64, rest: u64) -> Self {
        Interpolator {
            period,
            sample: 0,
            vector: 0,
            next: 0,
            from: DVec3::ZERO,
            to: DVec3::ZERO,
            done: 0,
            moving: 0,
            waiting: 0,
            rest,
            resting: false,
        }
    }

    /// The vector that the last sample belongs to.
    pub(super) fn vector(&self) -> u32 {
        self.vector
    }

    fn enter(&mut self, window: &mut Window<'_>) {
        self.done = 0;
        let Some(step) = window.step(self.next, self.period) else {
            (self.moving, self.waiting, self.resting) = (0, self.rest, true);
            return;
        };
        (self.vector, self.next) = (self.next, self.next + 1);
        (self.from, self.to) = (step.from, step.to);
        (self.moving, self.waiting) = (step.moving, step.waiting);
    }

    /// Fills `block` with the next `count` samples or fewer at the end; false when there are none left.
    pub fn fill(
        &mut self,
        window: &mut Window<'_>,
        block: &mut CommandBlock,
        count: usize,
    ) -> bool {
        block.restart(self.sample);
        if self.sample == 0 && count > 0 {
            self.to = window.start();
            block.position.push(self.to);
            block.vector.push(0);
            block.moving.push(false);
        }
        while block.position.len() < count {
            if self.done == self.moving + self.waiting {
                if self.resting {
                    break;
                }
                self.enter(window);
                continue;
            }
            let room = (count - block.position.len()) as u64;
            if self.done < self.moving {
                let n = room.min(self.moving - self.done);
                let step = (self.to - self.from) / self.moving as f64;
                for k in self.done + 1..=self.done + n {
                    let at = if k == self.moving {
                        self.to
                    } else {
                        self.from + step * k as f64
                    };
                    block.position.push(at);
                }
                self.push_labels(block, n, true);
            } else {
                let n = room.min(self.moving + self.waiting - self.done);
                block
                    .position
                    .extend(std::iter::repeat_n(self.to, n as usize));
                self.push_labels(block, n, false);
            }
        }
        self.sample += block.position.len() as u64;
        !block.position.is_empty()
    }

    fn push_labels(&mut self, block: &mut CommandBlock, n: u64, moving: bool) {
        let vectors = std::iter::repeat_n(self.vector, n as usize);
        block.vector.extend(vectors);
        block.moving.extend(std::iter::repeat_n(moving, n as usize));
        self.done += n;
    }
}
