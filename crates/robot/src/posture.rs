//! How an arm holds the torch along a whole program: one way for each place, chosen for all places together and then verified
//! between them.
//!
//! The rotation about the wire is free: wire and arc are the same all around. It is chosen at key places by dynamic programming over
//! rotations and all ways of the arm to hold each of them ([`hold`]), least in joint motion and far from limits and singularities. Then
//! every move is followed finely, the joints always the nearest continuation, so that a jump of branch is found and never taken.

mod chain;
mod change;
mod choice;
mod comfort;
mod follow;
mod free;
mod grid;
mod joint_move;
mod ladder;
mod narrow;
mod parting;
mod search;
mod stretch;
mod task;
mod wide;

use meltpath_geometry::math::DVec3;

pub use chain::{Chain, End};
pub use change::{Because, Change, changes, turned_back};
pub use comfort::REACH;
pub use follow::{Follower, Sample};
pub use parting::{Bound, Parting, WayEnd, partings};
pub use search::{Search, hold, runs};
pub use stretch::{Place, Stretch};
pub use task::{Axes, Guard, Near, NotHeld, Rotation, Task, Why};

use crate::cell::{Cell, Values};

/// How the arm goes along a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Runs of moves without a joint move between them.
    pub chains: Vec<Chain>,
    /// What it comes near to on the way.
    pub margins: Margins,
}

/// What the arm comes near to along a program, each at its worst place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Margins {
    /// Least distance of a joint from its limits, rad.
    pub limit: Option<Least>,
    /// Where each axis of track and positioner stands least and most, mm or rad.
    pub stood: [Option<[Least; 2]>; 3],
    /// Greatest speed of a joint while the arc burns at the set speed, as a share of what it can do; nothing where that is not known.
    pub speed: Option<Least>,
    /// Least distance of the wrist from its singularity, rad.
    pub wrist: Option<Least>,
    /// Least distance of the elbow from the stretched arm, rad.
    pub elbow: Option<Least>,
    /// Least distance of the wrist's centre from the first axis, mm.
    pub shoulder: Option<Least>,
    /// How the torch leans while the arc burns.
    pub lean: Option<Lean>,
}

/// How the torch leans from straight down along the beads of a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lean {
    /// The greatest lean, rad; its joint has no meaning.
    pub greatest: Least,
    /// The sum of lean by time, rad s.
    sum: f64,
    /// The time, s.
    time: f64,
}

impl Lean {
    /// The mean over the time of the arc, rad.
    pub fn mean(&self) -> f64 {
        self.sum / self.time
    }
}

/// A worst value, and where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Least {
    /// The value.
    pub value: f64,
    /// The joint it is of, from 0.
    pub joint: usize,
    /// The command.
    pub command: u32,
    /// The wire's tip in the part, mm.
    pub position: DVec3,
}

impl Margins {
    /// What two runs come near to, the first where both come as near.
    fn and(&self, other: &Margins) -> Margins {
        let least = |a: Option<Least>, b: Option<Least>| match (a, b) {
            (Some(a), Some(b)) if b.value < a.value => Some(b),
            (a, b) => a.or(b),
        };
        let greatest = |a: Least, b: Least| if b.value > a.value { b } else { a };
        let stood = |a: Option<[Least; 2]>, b: Option<[Least; 2]>| match (a, b) {
            (Some([low, high]), Some([l, h])) => {
                Some([if l.value < low.value { l } else { low }, greatest(high, h)])
            }
            (a, b) => a.or(b),
        };
        Margins {
            limit: least(self.limit, other.limit),
            stood: std::array::from_fn(|i| stood(self.stood[i], other.stood[i])),
            wrist: least(self.wrist, other.wrist),
            elbow: least(self.elbow, other.elbow),
            shoulder: least(self.shoulder, other.shoulder),
            speed: match (self.speed, other.speed) {
                (Some(a), Some(b)) => Some(greatest(a, b)),
                (a, b) => a.or(b),
            },
            lean: match (self.lean, other.lean) {
                (Some(a), Some(b)) => Some(Lean {
                    greatest: greatest(a.greatest, b.greatest),
                    sum: a.sum + b.sum,
                    time: a.time + b.time,
                }),
                (a, b) => a.or(b),
            },
        }
    }

    /// How near an axis of track or positioner comes to its limits, mm or rad, where it moves or stands elsewhere than at rest: what
    /// stands at the end where it rests may stay there.
    pub fn external(&self, cell: &Cell, axis: usize) -> Option<Least> {
        const ROUNDING: f64 = 1e-4;
        let limits = cell.external_joint(axis)?.limits;
        let [low, high] = self.stood[axis]?;
        let rest = cell.at_rest().external().0[axis];
        if high.value - low.value < ROUNDING && (low.value - rest).abs() < ROUNDING {
            return None;
        }
        let margin = |at: Least| Least {
            value: limits.margin(at.value),
            ..at
        };
        let both = [low, high].map(margin);
        both.into_iter().min_by(|a, b| a.value.total_cmp(&b.value))
    }

    /// Takes a place into account.
    fn add(&mut self, cell: &Cell, sample: &Sample) {
        let place = |value: f64, joint: usize| Least {
            value,
            joint,
            command: sample.command,
            position: sample.tip.position,
        };
        let least = |kept: &mut Option<Least>, new: Least| {
            if kept.is_none_or(|k| new.value < k.value) {
                *kept = Some(new);
            }
        };
        let (margin, joint) = cell.arm.margin(sample.joints);
        least(&mut self.limit, place(margin - sample.curve, joint));
        for (axis, value) in sample.external.0.into_iter().enumerate() {
            let here = place(value, 6 + axis);
            let [low, high] = self.stood[axis].unwrap_or([here; 2]);
            self.stood[axis] = Some([
                if value < low.value { here } else { low },
                if value > high.value { here } else { high },
            ]);
        }
        if let Some(near) = cell.arm.nearness(sample.joints) {
            least(&mut self.wrist, place(near.wrist - sample.curve, 4));
            least(&mut self.elbow, place(near.elbow - sample.curve, 2));
            least(&mut self.shoulder, place(near.shoulder.abs(), 0));
        }
        if let Some(time) = sample.time {
            let values = Values::of(sample.joints, sample.external);
            let axis = cell.frames(&values).wire_tip.tool_axis();
            let here = place(axis.angle_between(DVec3::Z), 0);
            let known = self
                .lean
                .map_or((here, 0.0, 0.0), |l| (l.greatest, l.sum, l.time));
            let greatest = if here.value > known.0.value {
                here
            } else {
                known.0
            };
            self.lean = Some(Lean {
                greatest,
                sum: known.1 + here.value * time,
                time: known.2 + time,
            });
        }
        if let Some((share, joint)) = sample.speed
            && self.speed.is_none_or(|k| share > k.value)
        {
            self.speed = Some(place(share, joint));
        }
    }
}
