//! A log of the tool, and what is wrong with it.

use meltpath_geometry::math::DVec3;

/// Where the tool was.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Log {
    /// Times, s, rising.
    pub times: Vec<f64>,
    /// The wire's tip, mm, in one frame that stands.
    pub places: Vec<DVec3>,
    /// Line of the file that each sample stands on, from 1.
    pub lines: Vec<usize>,
}

/// A log is sampled no more slowly than this, s: a transition of 0.2 s has four samples then.
pub const SLOWEST: f64 = 0.05;
/// Fewest samples of a log.
const FEWEST: usize = 50;
/// Samples this many times as far apart as usual leave a gap.
pub(super) const GAP: f64 = 4.0;

/// Why a log cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LogError {
    /// Too few samples.
    #[error(
        "the log has {0} samples: log the whole run, from before the tool starts until after it stops"
    )]
    Few(usize),
    /// A value that is no number.
    #[error("line {line}: {what} is no number: leave the line out, or log again")]
    NoNumber {
        /// Line of the file.
        line: usize,
        /// Which value.
        what: String,
    },
    /// Times that do not rise.
    #[error(
        "line {line}: its time of {time} s is not after that of the line before, {before} s: sort the log by time, and leave out lines that stand twice"
    )]
    Unsorted {
        /// Line of the file.
        line: usize,
        /// Its time, s.
        time: f64,
        /// The time before, s.
        before: f64,
    },
    /// Samples too far apart.
    #[error(
        "the log has a sample every {ms:.0} ms, and corners last some 200 ms: log at least every {most:.0} ms, better every 4 to 12 ms; if its times are no seconds, tell their unit (time_unit)"
    )]
    Slow {
        /// Between samples, ms.
        ms: f64,
        /// At most, ms.
        most: f64,
    },
    /// Samples are missing while the tool moves along the path.
    #[error(
        "line {line}: {gap:.3} s are missing in the log before it (samples are {usual:.4} s apart) while the tool moves: log again, or name a part of the log without gaps (from, to)"
    )]
    Gap {
        /// Line after the gap.
        line: usize,
        /// How long, s.
        gap: f64,
        /// Usual distance of samples, s.
        usual: f64,
    },
}

impl Log {
    /// Whether it can be used.
    ///
    /// # Errors
    /// [`LogError`], the first thing that is wrong.
    pub fn check(&self) -> Result<(), LogError> {
        for (i, (time, place)) in self.times.iter().zip(&self.places).enumerate() {
            let what = match (time.is_finite(), place.is_finite()) {
                (false, _) => "the time",
                (_, false) => "the place of the tool",
                _ => continue,
            };
            return Err(LogError::NoNumber {
                line: self.line(i),
                what: what.to_owned(),
            });
        }
        if let Some(i) = self.times.windows(2).position(|w| w[1] <= w[0]) {
            return Err(LogError::Unsorted {
                line: self.line(i + 1),
                time: self.times[i + 1],
                before: self.times[i],
            });
        }
        if self.times.len() < FEWEST {
            return Err(LogError::Few(self.times.len()));
        }
        let usual = self.interval();
        if usual > SLOWEST {
            return Err(LogError::Slow {
                ms: 1e3 * usual,
                most: 1e3 * SLOWEST,
            });
        }
        Ok(())
    }

    /// The line of a sample.
    pub fn line(&self, sample: usize) -> usize {
        self.lines.get(sample).copied().unwrap_or(sample + 1)
    }

    /// Usual time between samples, s: the median.
    pub fn interval(&self) -> f64 {
        let mut all: Vec<f64> = self.times.windows(2).map(|w| w[1] - w[0]).collect();
        median(&mut all)
    }

    /// Standard deviation of one component of a place, mm, from how far samples lie off the chord of their neighbours: a median, so that
    /// corners do not count.
    pub fn noise(&self) -> f64 {
        // the median length of a normal vector of three components, and the spread of a sample less the mean of its neighbours
        const LENGTH: f64 = 1.538;
        const SPREAD: f64 = 1.224_744_871;
        let mut off: Vec<f64> = self
            .times
            .windows(3)
            .zip(self.places.windows(3))
            .map(|(t, p)| {
                let share = (t[1] - t[0]) / (t[2] - t[0]);
                p[1].distance(p[0].lerp(p[2], share))
            })
            .collect();
        median(&mut off) / (LENGTH * SPREAD)
    }

    /// The first sample at or after a time.
    pub(super) fn from(&self, time: f64) -> usize {
        self.times.partition_point(|t| *t < time)
    }
}

/// The median; 0 of nothing.
pub(super) fn median(all: &mut [f64]) -> f64 {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}
