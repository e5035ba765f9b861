//! Follows a run of moves finely: the joints are always the nearest continuation, and where there is none the run breaks.

use std::f64::consts::TAU;

use meltpath_geometry::Pose;

use super::chain::{Chain, End, Leg, turned};
use super::task::{NotHeld, Task, Why};
use crate::cell::Holder;

/// Greatest distance between samples, mm.
const STEP: f64 = 5.0;

/// Greatest step of a joint between samples, rad.
const JOINT_STEP: f64 = 0.1;

/// A share of a move below which a greater step of a joint is a jump.
const FINEST: f64 = 1.0 / 4096.0;

/// A place along a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The command.
    pub command: u32,
    /// What ends here.
    pub ends: Option<End>,
    /// The wire's tip in the part, turned as chosen.
    pub tip: Pose,
    /// Joint angles, rad.
    pub joints: [f64; 6],
    /// How far joints may have bent away from the straight step to here, rad.
    pub curve: f64,
    /// The fastest joint on the way here while the arc burns: its share of what it can do, and which it is.
    pub speed: Option<(f64, usize)>,
}

/// Goes along a run sample by sample.
pub struct Follower<'a> {
    task: &'a Task<'a>,
    holder: Holder,
    chain: &'a Chain,
    leg: usize,
    share: f64,
    joints: [f64; 6],
    step: [f64; 6],
    begun: bool,
}

impl<'a> Follower<'a> {
    /// From the begin of a run whose way was chosen.
    pub fn new(task: &'a Task<'a>, chain: &'a Chain) -> Self {
        Follower {
            task,
            holder: task.cell.holder(&task.values),
            chain,
            leg: 0,
            share: 0.0,
            joints: chain.joints,
            step: [0.0; 6],
            begun: false,
        }
    }

    /// The next place, or nothing at the end.
    ///
    /// # Errors
    /// [`NotHeld`] where no continuation leads on.
    pub fn next_sample(&mut self) -> Result<Option<Sample>, NotHeld> {
        if !self.begun {
            self.begun = true;
            return Ok(Some(Sample {
                command: self.chain.first.unwrap_or(0),
                ends: Some(End::Target),
                tip: turned(self.chain.start, self.chain.turn_at(0.0).0),
                joints: self.joints,
                curve: 0.0,
                speed: None,
            }));
        }
        let Some(leg) = self.chain.legs.get(self.leg) else {
            return Ok(None);
        };
        let wanted = 1.0 / (leg.length / STEP).ceil().max(1.0);
        let mut share = wanted;
        loop {
            // steps that end at the end of the move but for rounding end there
            let to = if self.share + share > 1.0 - 1e-9 {
                1.0
            } else {
                self.share + share
            };
            let tip = self.tip(leg, to);
            match self.nearest(tip) {
                Ok(joints) if apart(&joints, &self.joints) <= JOINT_STEP => {
                    return Ok(Some(self.reached(leg, to, tip, joints)));
                }
                Ok(_) if share < FINEST => return Err(broken(leg, tip, Why::Change)),
                Err(why) if share < FINEST => return Err(broken(leg, tip, why)),
                Ok(_) | Err(_) => share *= 0.5,
            }
        }
    }

    /// The key place that lies behind.
    fn rung(&self) -> usize {
        let length = match self.chain.legs.get(self.leg) {
            Some(leg) => leg.begin + leg.length * self.share,
            None => self.chain.length(),
        };
        self.chain.turn_at(length).1
    }

    fn tip(&self, leg: &Leg, share: f64) -> Pose {
        let (turn, _) = self.chain.turn_at(leg.begin + leg.length * share);
        turned(leg.at(share), turn)
    }

    /// The way to hold a place that is nearest to where the joints are, limits aside.
    fn nearest(&self, tip: Pose) -> Result<[f64; 6], Why> {
        let flange = self.holder.base_from_flange(tip);
        let found = self
            .task
            .cell
            .arm
            .inverse(flange)
            .map_err(Why::Unreachable)?;
        let ways = found.solutions.iter().map(|s| {
            let near = |i: usize| {
                let turns = ((self.joints[i] - s.angles[i]) / TAU).round();
                s.angles[i] + TAU * turns
            };
            std::array::from_fn(near)
        });
        let best = ways.min_by(|a, b| apart(a, &self.joints).total_cmp(&apart(b, &self.joints)));
        best.ok_or(Why::Change)
    }

    fn reached(&mut self, leg: &Leg, to: f64, tip: Pose, joints: [f64; 6]) -> Sample {
        let step: [f64; 6] = std::array::from_fn(|i| joints[i] - self.joints[i]);
        let time = leg.time.map(|t| t * (to - self.share));
        let sample = Sample {
            command: leg.command,
            ends: (to >= 1.0).then_some(leg.end),
            tip,
            joints,
            // a parabola leaves its chord by an eighth of its second difference: twice that
            curve: 0.25 * apart(&step, &self.step),
            speed: time.and_then(|t| self.fastest(step, t)),
        };
        (self.joints, self.step) = (joints, step);
        self.share = to;
        if to >= 1.0 {
            self.leg += 1;
            self.share = 0.0;
        }
        sample
    }

    /// The joint whose step in a time is the greatest share of what it can do.
    fn fastest(&self, step: [f64; 6], time: f64) -> Option<(f64, usize)> {
        let arm = &self.task.cell.arm;
        // what the controller shows is linear in the joints: so are its steps
        let shown = arm.shown(step);
        let shares = arm.chain.joints.iter().zip(shown).enumerate();
        shares
            .filter_map(|(i, (joint, s))| Some((s.abs() / time / joint.limits.speed?, i)))
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

fn broken(leg: &Leg, tip: Pose, why: Why) -> NotHeld {
    NotHeld {
        command: leg.command,
        position: tip.position,
        why,
    }
}

/// Where a chosen way breaks, and the key place before.
pub(super) struct Broken {
    pub(super) rung: usize,
    pub(super) not_held: NotHeld,
}

/// Follows a chosen run to its end, and shows every place to `see`.
pub(super) fn verify(
    task: &Task<'_>,
    chain: &Chain,
    mut see: impl FnMut(&Sample),
) -> Result<(), Broken> {
    let mut follower = Follower::new(task, chain);
    loop {
        let rung = follower.rung();
        let broken = |not_held| Broken { rung, not_held };
        let Some(sample) = follower.next_sample().map_err(broken)? else {
            return Ok(());
        };
        let (margin, joint) = task.cell.arm.margin(sample.joints);
        if margin < 0.0 {
            let by = -margin;
            return Err(broken(NotHeld {
                command: sample.command,
                position: sample.tip.position,
                why: Why::Limit { joint, by },
            }));
        }
        see(&sample);
    }
}

/// The greatest difference of two sets of angles, rad.
fn apart(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let differ = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differ.fold(0.0, f64::max)
}
