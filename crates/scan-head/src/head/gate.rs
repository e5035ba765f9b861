//! The laser gate: when the laser is on, with its delays against the commanded marks.
//!
//! Source: Rasoanarivo 2020, § 2.6.1. On-delay: from the start of a mark after a jump to laser on. Off-delay: from its end
//! before a jump to laser off. Marks that follow each other are one chain, lit through. The laser's own dynamics are neglected.

use meltpath_geometry::math::DVec3;

use crate::head::error::HeadError;
use crate::head::prepared::{Layers, alone};
use crate::head::recipe::LaserDelays;
use crate::head::vector::ScanJob;
use crate::head::window::Window;

/// A chain of marks: first and last vector, and the samples at which it starts and ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chain {
    /// First vector.
    pub first: u32,
    /// Last vector.
    pub last: u32,
    /// Sample at its start.
    pub start: u64,
    /// Sample at its end, the last vector's wait not included.
    pub end: u64,
}

/// The chains of marks of a job sampled every `period` s, in order, one after another.
#[derive(Debug, Clone)]
pub struct Chains {
    period: f64,
    vector: u32,
    sample: u64,
}

impl Chains {
    /// From the start of a job.
    pub fn new(period: f64) -> Self {
        Chains {
            period,
            vector: 0,
            sample: 0,
        }
    }

    /// All chains of a job.
    pub fn all(job: &ScanJob, period: f64) -> Vec<Chain> {
        let (mut window, mut chains) = (Window::new(alone(job)), Chains::new(period));
        std::iter::from_fn(|| chains.next(&mut window)).collect()
    }

    /// The next one.
    fn next(&mut self, window: &mut Window<'_>) -> Option<Chain> {
        let mut chain: Option<Chain> = None;
        while let Some(step) = window.step(self.vector, self.period) {
            let (vector, start) = (self.vector, self.sample);
            let end = start + step.moving;
            match &mut chain {
                Some(_) if !step.kind.deposits() => break,
                Some(chain) => (chain.last, chain.end) = (vector, end),
                None if step.kind.deposits() => {
                    chain = Some(Chain {
                        first: vector,
                        last: vector,
                        start,
                        end,
                    });
                }
                None => {}
            }
            self.sample = end + step.waiting;
            self.vector += 1;
        }
        chain
    }
}

/// What a pair of delays does to the chains of a job, before anything is run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Darkness {
    /// Chains of marks.
    pub chains: u64,
    /// Those that no light reaches: over, with the off-delay, before the on-delay is.
    pub dark: u64,
    /// Those whose light lasts until the next one's comes on.
    pub bridged: u64,
    /// Duration of the longest chain, s.
    pub longest: f64,
    /// Of the shortest, s.
    pub shortest: f64,
    /// Layer and start of the first dark one: x and y in the field, z the layer's height, mm.
    pub first_dark: Option<(u32, DVec3)>,
}

impl Darkness {
    /// Of a job sampled every `period` s.
    ///
    /// # Errors
    /// [`HeadError`] of a layer that cannot be had.
    pub fn of(layers: Layers<'_>, delays: LaserDelays, period: f64) -> Result<Self, HeadError> {
        let mut found = Darkness {
            shortest: f64::INFINITY,
            ..Darkness::default()
        };
        let mut last: Option<f64> = None;
        let (mut window, mut chains) = (Window::new(layers), Chains::new(period));
        while let Some(chain) = chains.next(&mut window) {
            let held = window.between(chain.first, chain.first);
            window.release(chains.vector);
            let duration = (chain.end - chain.start) as f64 * period;
            let (on, off) = (
                chain.start as f64 * period + delays.on,
                chain.end as f64 * period + delays.off,
            );
            found.chains += 1;
            found.longest = found.longest.max(duration);
            found.shortest = found.shortest.min(duration);
            if off <= on {
                found.dark += 1;
                let start = held.first().map(|l| {
                    let at = l.job.start_of((chain.first - l.first) as usize);
                    (l.number, at.with_z(l.height))
                });
                found.first_dark = found.first_dark.or(start);
                continue;
            }
            found.bridged += u64::from(last.is_some_and(|l| l >= on));
            last = Some(off);
        }
        window.sound()?;
        Ok(found)
    }
}

/// The gate, streaming.
#[derive(Debug, Clone)]
pub struct Gate {
    chains: Chains,
    /// Delays in samples.
    on: f64,
    off: f64,
    /// The lit interval now, or the next one, in samples, with its first vector.
    interval: Option<(f64, f64)>,
    next: Option<(f64, f64)>,
}

impl Gate {
    /// The gate of a job sampled every `period` s.
    pub fn new(window: &mut Window<'_>, delays: LaserDelays, period: f64) -> Self {
        let mut gate = Gate {
            chains: Chains::new(period),
            on: delays.on / period,
            off: delays.off / period,
            interval: None,
            next: None,
        };
        gate.interval = gate.take(window);
        gate.next = gate.take(window);
        gate
    }

    /// The next vector that it will look at.
    pub(super) fn vector(&self) -> u32 {
        self.chains.vector
    }

    /// The next interval that is not empty.
    fn take(&mut self, window: &mut Window<'_>) -> Option<(f64, f64)> {
        loop {
            let chain = self.chains.next(window)?;
            let (from, to) = (chain.start as f64 + self.on, chain.end as f64 + self.off);
            if to > from {
                return Some((from, to));
            }
        }
    }

    /// The share of the period ending at `sample` during which the laser is on; samples must come in order.
    #[inline]
    pub fn lit(&mut self, window: &mut Window<'_>, sample: u64) -> f64 {
        let (a, b) = (sample as f64 - 1.0, sample as f64);
        while let Some((_, to)) = self.interval {
            if to > a {
                break;
            }
            self.interval = self.next;
            self.next = self.take(window);
        }
        let overlap =
            |i: Option<(f64, f64)>| i.map_or(0.0, |(from, to)| (to.min(b) - from.max(a)).max(0.0));
        // an off-delay may reach into the next chain: its light is counted once
        let (first, second) = (self.interval, self.next);
        let both = match (first, second) {
            (Some((_, to)), Some((from, end))) if from < to => overlap(Some((from, end.min(to)))),
            _ => 0.0,
        };
        overlap(first) + overlap(second) - both
    }
}
