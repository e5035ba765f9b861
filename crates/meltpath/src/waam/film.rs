//! The cell at every moment of a build: the ways of the axes joined with the time of the simulated motion.

use meltpath_robot::cell::Values;
use meltpath_robot::posture::{Follower, Held, NotHeld, Task};

use super::record::Sample;

/// Moments that a film holds at most; beyond, every k-th is kept.
const MOMENTS: usize = 20_000;

/// Where the axes stand at a place along a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// The move that leads here.
    pub(crate) command: u32,
    /// The axes.
    pub(crate) values: Values,
}

/// Where every axis of the cell stands at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    /// Time, s.
    pub(crate) time: f64,
    /// Layer, from 1; 0 before the first.
    pub(crate) layer: u32,
    /// The axes.
    pub(crate) values: Values,
}

/// The places of a held program, in order.
///
/// # Errors
/// [`NotHeld`] where no continuation leads on.
pub(super) fn steps(task: &Task<'_>, held: &Held) -> Result<Vec<Step>, NotHeld> {
    let mut steps = Vec::new();
    for chain in &held.chains {
        let mut follower = Follower::new(task, chain);
        while let Some(sample) = follower.next_sample()? {
            steps.push(Step {
                command: sample.command,
                values: Values::of(sample.joints, sample.external),
            });
        }
    }
    Ok(steps)
}

/// When each step is reached: the steps of a move share its time evenly, as they lie evenly along it. Moves of which the record keeps
/// no sample take none.
pub(crate) fn moments(steps: &[Step], samples: &[Sample], layer_of_command: &[u32]) -> Vec<Moment> {
    let every = steps.len().div_ceil(MOMENTS).max(1);
    let last = steps.len().saturating_sub(1);
    let mut moments = Vec::with_capacity(steps.len() / every + 2);
    let (mut time, mut layer, mut index) = (0.0_f64, 0, 0);
    let mut record = samples.iter().peekable();
    for of_move in steps.chunk_by(|a, b| a.command == b.command) {
        let command = of_move.first().map_or(0, |s| s.command);
        let mut end = time;
        while let Some(sample) = record.next_if(|s| s.command <= command) {
            end = end.max(sample.time);
        }
        // travels belong to the layer before them
        let own = layer_of_command.get(command as usize);
        layer = own.map_or(layer, |&own| layer.max(own));
        for (i, step) in of_move.iter().enumerate() {
            let share = (i + 1) as f64 / of_move.len() as f64;
            if index % every == 0 || index == last {
                moments.push(Moment {
                    time: time + (end - time) * share,
                    layer,
                    values: step.values,
                });
            }
            index += 1;
        }
        time = end;
    }
    moments
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec3;

    use super::*;

    fn step(command: u32) -> Step {
        Step {
            command,
            values: Values::default(),
        }
    }

    fn sample(time: f64, command: u32) -> Sample {
        Sample {
            time,
            position: DVec3::ZERO,
            speed: 0.0,
            arc: false,
            command,
        }
    }

    #[test]
    fn steps_share_the_time_of_their_move() {
        let steps = [step(0), step(1), step(1), step(2), step(3)];
        let samples = [
            sample(1.0, 0),
            sample(3.0, 1),
            sample(5.0, 1),
            sample(6.0, 3),
        ];
        let found = moments(&steps, &samples, &[1, 1, 2, 2]);
        let times: Vec<f64> = found.iter().map(|m| m.time).collect();
        assert_eq!(times, [1.0, 3.0, 5.0, 5.0, 6.0]);
        let layers: Vec<u32> = found.iter().map(|m| m.layer).collect();
        assert_eq!(layers, [1, 1, 1, 2, 2]);
    }

    #[test]
    fn a_long_build_is_thinned_and_ends_at_its_end() {
        let steps: Vec<Step> = (0..50_001).map(step).collect();
        let samples: Vec<Sample> = (0..50_001).map(|c| sample(f64::from(c), c)).collect();
        let found = moments(&steps, &samples, &[]);
        assert!(found.len() <= MOMENTS + 1);
        assert_eq!(found.last().map(|m| m.time), Some(50_000.0));
    }
}
