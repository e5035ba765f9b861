//! The samples of a record of an arc.

use std::path::Path;

use meltpath_base::{Current, Speed, Time, Voltage};

use super::ArcError;
use super::columns::{ArcColumns, means, values};
use crate::table;

/// A step so many times the usual one is a gap: clocks of loggers jitter.
const GAP: f64 = 2.5;

/// Samples in the order of time: s, V, A, mm/s.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// Times.
    pub times: Vec<f64>,
    /// Voltages; not a number where none was written.
    pub voltage: Vec<f64>,
    /// Currents.
    pub current: Vec<f64>,
    /// Wire feeds, where they were recorded.
    pub feed: Option<Vec<f64>>,
    /// The usual time between two samples.
    pub usual: f64,
}

impl Samples {
    /// Reads a record; with `sample_time` (s) it needs no column of times. Of its times only `within` counts, s.
    ///
    /// # Errors
    /// [`ArcError`]: the file, its columns, their units, times that run backwards.
    pub fn read(
        path: &Path,
        columns: &ArcColumns,
        sample_time: Option<f64>,
        within: [f64; 2],
    ) -> Result<Self, ArcError> {
        let needed =
            |place: usize, heading: &str| columns.told().any(|c| means(&c.name, place, heading));
        let table = table::read_where(path, needed)?;
        let file = path.display().to_string();
        let voltage = values::<Voltage>(&file, &table, &columns.voltage, "V")?;
        let current = values::<Current>(&file, &table, &columns.current, "A")?;
        let feed = columns.feed.as_ref();
        let feed = feed.map(|c| values::<Speed>(&file, &table, c, "m/min"));
        let feed = feed.transpose()?;
        let (times, usual) = match (columns.time.as_ref(), sample_time) {
            (_, Some(step)) => ((0..table.rows()).map(|k| k as f64 * step).collect(), step),
            (Some(time), None) => {
                let times = values::<Time>(&file, &table, time, "s")?;
                let usual = usual_step(&file, &times)?;
                (times, usual)
            }
            (None, None) => (Vec::new(), f64::NAN),
        };
        let mut all = Samples {
            times,
            voltage,
            current,
            feed,
            usual,
        };
        all.keep(within);
        Ok(all)
    }

    /// Leaves what lies within these times, in columns of one length.
    fn keep(&mut self, [from, to]: [f64; 2]) {
        let first = self.times.partition_point(|t| *t < from);
        let last = self.times.partition_point(|t| *t <= to);
        let feed = self.feed.as_mut();
        let columns = [&mut self.times, &mut self.voltage, &mut self.current];
        for column in columns.into_iter().chain(feed) {
            column.truncate(last);
            column.drain(..first.min(column.len()));
        }
    }

    /// The time that a sample stands for, s: no more than a step that is no gap.
    pub(super) fn weight(&self, k: usize) -> f64 {
        match (self.times.get(k), self.times.get(k + 1)) {
            (Some(now), Some(next)) if next - now <= GAP * self.usual => next - now,
            _ => self.usual,
        }
    }

    /// Whether voltage and current are there.
    pub(super) fn is_whole(&self, k: usize) -> bool {
        self.voltage[k].is_finite() && self.current[k].is_finite()
    }

    /// How much time between a sample and the next is not covered, s.
    pub(super) fn gap(&self, k: usize) -> f64 {
        self.times
            .get(k + 1)
            .map_or(0.0, |next| (next - self.times[k] - self.weight(k)).max(0.0))
    }
}

/// The middle step of times that rise.
fn usual_step(file: &str, times: &[f64]) -> Result<f64, ArcError> {
    let wrong = |row: usize, told: String| ArcError::Times {
        file: file.to_owned(),
        row,
        told,
    };
    if let Some(k) = times.iter().position(|t| !t.is_finite()) {
        return Err(wrong(k + 1, "no time stands there".to_owned()));
    }
    let mut steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    if let Some(k) = steps.iter().position(|s| *s < 0.0) {
        let told = format!(
            "the time runs backwards, from {} to {} s: cut the record there",
            times[k],
            times[k + 1]
        );
        return Err(wrong(k + 2, told));
    }
    if steps.is_empty() {
        return Err(wrong(
            times.len(),
            "there are fewer than two rows".to_owned(),
        ));
    }
    let middle = steps.len() / 2;
    let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    if usual > 0.0 {
        return Ok(usual);
    }
    let still = times.windows(2).position(|w| w[1] <= w[0]).unwrap_or(0);
    let told = "most times are the same as the one before: the clock is coarser than the samples; write sample_time, and leave columns.time out";
    Err(wrong(still + 2, told.to_owned()))
}
