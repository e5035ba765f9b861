//! Follows a run of moves finely: the joints are always the nearest continuation, and where there is none the run breaks.

use meltpath_geometry::Pose;

use super::chain::{Chain, End, Leg, turned};
use super::stretch::{Place, Stretch, apart, place_on, tip_on};
use super::task::{NotHeld, Task, Why};
use crate::cell::External;

/// Greatest distance between samples, mm.
const STEP: f64 = 5.0;

/// Greatest step of a joint between samples, rad.
const JOINT_STEP: f64 = 0.1;

/// A share of a move below which a greater step of a joint is a jump.
const FINEST: f64 = 1.0 / 4096.0;

/// Joints of the arm: the axes of [`External`] are counted after them.
const ARM: usize = 6;

/// A place along a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The command.
    pub command: u32,
    /// Length from the begin of the run, mm.
    pub length: f64,
    /// What ends here.
    pub ends: Option<End>,
    /// The wire's tip in the part, turned as chosen.
    pub tip: Pose,
    /// Joint angles, rad.
    pub joints: [f64; 6],
    /// Where track and positioner stand.
    pub external: External,
    /// How far joints may have bent away from the straight step to here, rad.
    pub curve: f64,
    /// How long the way here takes at the set speed, s; nothing where the arc does not burn.
    pub time: Option<f64>,
    /// The fastest axis on the way here while the arc burns: its share of what it can do, and which it is: joints of the arm from 0, then
    /// those of [`External`].
    pub speed: Option<(f64, usize)>,
}

/// Goes along a run sample by sample.
pub struct Follower<'a> {
    task: &'a Task<'a>,
    chain: &'a Chain,
    leg: usize,
    share: f64,
    joints: [f64; 6],
    external: External,
    step: [f64; 6],
    begun: bool,
    /// The way to the last place.
    gone: Option<Stretch<'a>>,
}

impl<'a> Follower<'a> {
    /// From the begin of a run whose way was chosen.
    pub fn new(task: &'a Task<'a>, chain: &'a Chain) -> Self {
        Follower {
            task,
            chain,
            leg: 0,
            share: 0.0,
            joints: chain.joints,
            external: chain.external,
            step: [0.0; 6],
            begun: false,
            gone: None,
        }
    }

    /// The way from the place before to the last one; nothing at the begin.
    pub fn gone(&self) -> Option<Stretch<'a>> {
        self.gone
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
                length: 0.0,
                ends: Some(End::Target),
                tip: turned(self.chain.start, self.chain.turn_at(0.0).0),
                joints: self.joints,
                external: self.external,
                curve: 0.0,
                time: None,
                speed: None,
            }));
        }
        let chain = self.chain;
        let Some(leg) = chain.legs.get(self.leg) else {
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
            let broken = |why| broken(leg, tip_on(chain, leg, to), why);
            match place_on(self.task, (chain, leg), to, &self.joints) {
                Ok(place) if apart(&place.joints, &self.joints) <= JOINT_STEP => {
                    return Ok(Some(self.reached(leg, to, place)));
                }
                Ok(_) if share < FINEST => return Err(broken(Why::Change)),
                Err(why) if share < FINEST => return Err(broken(why)),
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

    fn reached(&mut self, leg: &'a Leg, to: f64, place: Place) -> Sample {
        let Place {
            tip,
            joints,
            external,
        } = place;
        let step: [f64; 6] = std::array::from_fn(|i| joints[i] - self.joints[i]);
        let gone: [f64; 3] = std::array::from_fn(|i| external.0[i] - self.external.0[i]);
        let time = leg.time.map(|t| t * (to - self.share));
        let sample = Sample {
            command: leg.command,
            length: leg.begin + leg.length * to,
            ends: (to >= 1.0).then_some(leg.end),
            tip,
            joints,
            external,
            // a parabola leaves its chord by an eighth of its second difference: twice that
            curve: 0.25 * apart(&step, &self.step),
            time,
            speed: time.and_then(|t| self.fastest(step, gone, t)),
        };
        let before = Place {
            tip: tip_on(self.chain, leg, self.share),
            joints: self.joints,
            external: self.external,
        };
        let course = (self.chain, leg, [self.share, to]);
        self.gone = Some(Stretch::of_move(
            self.task,
            course,
            [before, place],
            sample.curve,
        ));
        (self.joints, self.step, self.external) = (joints, step, external);
        self.share = to;
        if to >= 1.0 {
            self.leg += 1;
            self.share = 0.0;
        }
        sample
    }

    /// The axis whose step in a time is the greatest share of what it can do.
    fn fastest(&self, step: [f64; 6], gone: [f64; 3], time: f64) -> Option<(f64, usize)> {
        let cell = self.task.cell;
        // what the controller shows is linear in the joints: so are its steps
        let shown = cell.arm.shown(step);
        let joints = cell.arm.chain.joints.iter().zip(shown).enumerate();
        let moved = (0..3).filter(|i| gone[*i] != 0.0);
        let moved = moved.filter_map(|i| Some((ARM + i, (cell.external_joint(i)?, gone[i]))));
        joints
            .chain(moved)
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
        if let Some((axis, by)) = task.cell.beyond(sample.external) {
            return Err(broken(NotHeld {
                command: sample.command,
                position: sample.tip.position,
                why: Why::External { axis, by },
            }));
        }
        see(&sample);
    }
}
