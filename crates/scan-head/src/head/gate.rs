//! The laser gate: when the laser is on, with its delays against the commanded marks.
//!
//! Source: Rasoanarivo 2020, § 2.6.1. On-delay: from the start of a mark after a jump to laser on. Off-delay: from its end
//! before a jump to laser off. Marks that follow each other are one chain, lit through. The laser's own dynamics are neglected.

use crate::head::interpolation::counts;
use crate::head::recipe::LaserDelays;
use crate::head::vector::ScanJob;

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
pub struct Chains<'a> {
    job: &'a ScanJob,
    period: f64,
    vector: usize,
    sample: u64,
}

impl<'a> Chains<'a> {
    /// From the start of the job.
    pub fn new(job: &'a ScanJob, period: f64) -> Self {
        Chains {
            job,
            period,
            vector: 0,
            sample: 0,
        }
    }
}

impl Iterator for Chains<'_> {
    type Item = Chain;

    fn next(&mut self) -> Option<Chain> {
        let vectors = &self.job.vectors;
        while !vectors.get(self.vector)?.kind.is_mark() {
            let (m, w) = counts(self.job, self.vector, self.period);
            self.sample += m + w;
            self.vector += 1;
        }
        let (first, start) = (self.vector, self.sample);
        let mut end = start;
        while vectors.get(self.vector).is_some_and(|v| v.kind.is_mark()) {
            let (m, w) = counts(self.job, self.vector, self.period);
            end = self.sample + m;
            self.sample = end + w;
            self.vector += 1;
        }
        Some(Chain {
            first: first as u32,
            last: (self.vector - 1) as u32,
            start,
            end,
        })
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
}

impl Darkness {
    /// Of a job sampled every `period` s.
    pub fn of(job: &ScanJob, delays: LaserDelays, period: f64) -> Self {
        let mut found = Darkness::default();
        let mut last: Option<f64> = None;
        for chain in Chains::new(job, period) {
            let duration = (chain.end - chain.start) as f64 * period;
            let (on, off) = (
                chain.start as f64 * period + delays.on,
                chain.end as f64 * period + delays.off,
            );
            found.chains += 1;
            found.longest = found.longest.max(duration);
            if off <= on {
                found.dark += 1;
                continue;
            }
            found.bridged += u64::from(last.is_some_and(|l| l >= on));
            last = Some(off);
        }
        found
    }
}

/// The gate, streaming.
#[derive(Debug, Clone)]
pub struct Gate<'a> {
    chains: Chains<'a>,
    /// Delays in samples.
    on: f64,
    off: f64,
    /// The lit interval now, or the next one, in samples, with its first vector.
    interval: Option<(f64, f64)>,
    next: Option<(f64, f64)>,
}

impl<'a> Gate<'a> {
    /// The gate of a job sampled every `period` s.
    pub fn new(job: &'a ScanJob, delays: LaserDelays, period: f64) -> Self {
        let mut gate = Gate {
            chains: Chains::new(job, period),
            on: delays.on / period,
            off: delays.off / period,
            interval: None,
            next: None,
        };
        gate.interval = gate.take();
        gate.next = gate.take();
        gate
    }

    /// The next interval that is not empty.
    fn take(&mut self) -> Option<(f64, f64)> {
        loop {
            let chain = self.chains.next()?;
            let (from, to) = (chain.start as f64 + self.on, chain.end as f64 + self.off);
            if to > from {
                return Some((from, to));
            }
        }
    }

    /// The share of the period ending at `sample` during which the laser is on; samples must come in order.
    #[inline]
    pub fn lit(&mut self, sample: u64) -> f64 {
        let (a, b) = (sample as f64 - 1.0, sample as f64);
        while let Some((_, to)) = self.interval {
            if to > a {
                break;
            }
            self.interval = self.next;
            self.next = self.take();
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
