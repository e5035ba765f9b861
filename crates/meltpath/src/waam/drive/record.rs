//! A thinned record of the motion, for pictures and tables: enough samples to see every slow-down, few enough to hold.

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{MotionBlock, MotionSink};

/// A sample is kept when the tool moved this far since the last one kept, mm, …
const DISTANCE: f64 = 1.0;
/// … or its speed changed by this share, …
const SPEED: f64 = 0.08;
/// … or this much time passed, s.
const TIME: f64 = 1.0;

/// One kept sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub time: f64,
    /// Tool centre point, mm, part frame.
    pub position: DVec3,
    /// Speed, mm/s.
    pub speed: f64,
    /// Whether wire was fed since the sample before.
    pub arc: bool,
    /// The command being executed.
    pub command: u32,
}

/// Keeps the samples that matter.
#[derive(Debug, Default)]
pub struct Recorder {
    /// The samples kept, in order of time.
    pub samples: Vec<Sample>,
    pending: Option<Sample>,
}

impl Recorder {
    /// The samples, the very last one included.
    pub fn finish(mut self) -> Vec<Sample> {
        self.samples.extend(self.pending);
        self.samples
    }
}

impl MotionSink for Recorder {
    fn block(&mut self, block: &MotionBlock) {
        for i in 0..block.len() {
            let sample = Sample {
                time: block.time(i),
                position: block.position[i],
                speed: block.speed[i],
                arc: block.wire.get(i).is_some_and(|w| *w > 0.0),
                command: block.command[i],
            };
            let Some(last) = self.samples.last() else {
                self.samples.push(sample);
                continue;
            };
            if sample.arc != last.arc || sample.command != last.command {
                // both ends of the change, so that a line never bridges it
                self.samples.extend(self.pending.take());
                self.samples.push(sample);
            } else if sample.position.distance_squared(last.position) >= DISTANCE * DISTANCE
                || (sample.speed - last.speed).abs() > SPEED * last.speed.max(1.0)
                || sample.time - last.time >= TIME
            {
                self.samples.push(sample);
                self.pending = None;
            } else {
                self.pending = Some(sample);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_toolpath::Times;

    #[test]
    fn long_lines_are_thinned_and_changes_kept() {
        let n = 10_000;
        let block = MotionBlock {
            times: Times::Uniform { t0: 0.0, dt: 0.002 },
            position: (0..n).map(|i| DVec3::X * (f64::from(i) * 0.025)).collect(),
            speed: vec![12.5; n as usize],
            axis: vec![],
            wire: (0..n).map(|i| if i > 5000 { 0.2 } else { 0.0 }).collect(),
            command: (0..n).map(|i| (i / 2500) as u32).collect(),
            ..MotionBlock::default()
        };
        let mut recorder = Recorder::default();
        recorder.block(&block);
        let samples = recorder.finish();
        assert!(
            samples.len() > 240 && samples.len() < 300,
            "{}",
            samples.len()
        );
        assert_eq!(
            samples.last().unwrap().position,
            *block.position.last().unwrap()
        );
        assert!(samples.windows(2).all(|w| w[0].time < w[1].time));
        // the switch of the arc is caught to the sample
        let on = samples.iter().find(|s| s.arc).unwrap();
        assert!((on.time - 5001.0 * 0.002).abs() < 1e-9);
    }
}
