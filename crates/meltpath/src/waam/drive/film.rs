//! The cell at every moment of a build: the ways of the axes joined with the time of the simulated motion.

use meltpath_robot::cell::{Cell, Values};
use meltpath_robot::joint_move::JointMove;
use meltpath_robot::posture::{Follower, Held, NotHeld, Task};
use meltpath_robot::summary::CommandRecord;

use crate::waam::drive::key_moments::KeyMoment;

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

impl Step {
    /// The shortest time in which every axis gets from here to `to` at its greatest speed, s, and the axis that takes it: joints of the
    /// arm from 0, then track and positioner. Nothing where no speed is known.
    pub(crate) fn slowest(&self, to: &Step, cell: &Cell) -> Option<(f64, usize)> {
        let shown = |step: &Step| cell.arm.shown(step.values.arm);
        let (from, till) = (shown(self), shown(to));
        let (a, b) = (self.values.external().0, to.values.external().0);
        let arm = cell.arm.chain.joints.iter().enumerate();
        let arm = arm.map(|(i, joint)| (i, joint, till[i] - from[i]));
        let beside = (0..3).filter_map(|i| Some((6 + i, cell.external_joint(i)?, b[i] - a[i])));
        arm.chain(beside)
            .filter_map(|(i, joint, gone)| Some((gone.abs() / joint.limits.speed?, i)))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// What is shown of a robot along a build; without steps where the way of its axes is not known.
#[derive(Debug, Default)]
pub(crate) struct Film {
    /// The way of the axes.
    pub(crate) steps: Vec<Step>,
    /// The moments that decide.
    pub(crate) moments: Vec<KeyMoment>,
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

/// The places of a held program, in order, and its joint moves: each chord of their tip's way ends at a place.
///
/// # Errors
/// [`NotHeld`] where no continuation leads on.
pub(in crate::waam) fn steps(
    task: &Task<'_>,
    held: &Held,
) -> Result<(Vec<Step>, Vec<JointMove>), NotHeld> {
    let (mut steps, mut joint_moves) = (Vec::<Step>::new(), Vec::new());
    for chain in &held.chains {
        let mut follower = Follower::new(task, chain);
        let mut leads_here = chain.first;
        while let Some(sample) = follower.next_sample()? {
            let values = Values::of(sample.joints, sample.external);
            if let (Some(command), Some(before)) = (leads_here.take(), steps.last()) {
                let joint_move = JointMove {
                    command,
                    ends: [before.values, values],
                };
                let places = joint_move.places(task.cell);
                steps.extend(places.map(|values| Step { command, values }));
                joint_moves.push(joint_move);
            } else {
                let command = sample.command;
                steps.push(Step { command, values });
            }
        }
    }
    Ok((steps, joint_moves))
}

/// Every step with the time when it is reached, s, in order: the steps of a move share its time evenly, as they lie evenly along it. The
/// first is where the program starts.
pub(crate) fn timed<'a>(
    steps: &'a [Step],
    records: &'a [CommandRecord],
) -> impl Iterator<Item = (f64, &'a Step)> {
    let moves = steps.chunk_by(|a, b| a.command == b.command);
    moves.enumerate().flat_map(|(number, of_move)| {
        let command = of_move.first().map_or(0, |s| s.command);
        let record = records.get(command as usize);
        let (start, end) = record.map_or((0.0, 0.0), |r| (r.start, r.end));
        let begun = usize::from(number == 0);
        let count = (of_move.len() - begun).max(1) as f64;
        let reached = move |i: usize| start + (end - start) * ((i + 1 - begun) as f64 / count);
        of_move
            .iter()
            .enumerate()
            .map(move |(i, s)| (reached(i), s))
    })
}

/// The cell as the report's film shows it.
pub(crate) fn moments(
    steps: &[Step],
    records: &[CommandRecord],
    layer_of_command: &[u32],
) -> Vec<Moment> {
    let every = steps.len().div_ceil(MOMENTS).max(1);
    let last = steps.len().saturating_sub(1);
    let mut moments = Vec::with_capacity(steps.len() / every + 2);
    let mut layer = 0;
    for (index, (time, step)) in timed(steps, records).enumerate() {
        // travels belong to the layer before them
        let own = layer_of_command.get(step.command as usize);
        layer = own.map_or(layer, |&own| layer.max(own));
        if index % every == 0 || index == last {
            moments.push(Moment {
                time,
                layer,
                values: step.values,
            });
        }
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(command: u32) -> Step {
        Step {
            command,
            values: Values::default(),
        }
    }

    fn record(id: u32, start: f64, end: f64) -> CommandRecord {
        CommandRecord {
            id,
            start,
            end,
            passage_speed: 0.0,
            deviation: 0.0,
        }
    }

    #[test]
    fn steps_share_the_time_of_their_move() {
        let steps = [step(0), step(1), step(1), step(2), step(3)];
        let records = [
            record(0, 0.0, 1.0),
            record(1, 1.0, 5.0),
            record(2, 5.0, 5.0),
            record(3, 5.0, 6.0),
        ];
        let found = moments(&steps, &records, &[1, 1, 2, 2]);
        let times: Vec<f64> = found.iter().map(|m| m.time).collect();
        // the first step is where the program starts
        assert_eq!(times, [0.0, 3.0, 5.0, 5.0, 6.0]);
        let layers: Vec<u32> = found.iter().map(|m| m.layer).collect();
        assert_eq!(layers, [1, 1, 1, 2, 2]);
    }

    #[test]
    fn a_long_build_is_thinned_and_ends_at_its_end() {
        let steps: Vec<Step> = (0..50_001).map(step).collect();
        let of = |c: u32| record(c, f64::from(c) - 1.0, f64::from(c));
        let records: Vec<CommandRecord> = (0..50_001).map(of).collect();
        let found = moments(&steps, &records, &[]);
        assert!(found.len() <= MOMENTS + 1);
        assert_eq!(found.last().map(|m| m.time), Some(50_000.0));
    }
}
