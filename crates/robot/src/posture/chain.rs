//! Runs of moves whose path is known: their places by length, and the way chosen to hold them.

use std::ops::Range;

use meltpath_geometry::Pose;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::{DQuat, DVec3};

use super::task::{Axes, NotHeld, Task};
use crate::cell::External;
use crate::command::{Command, Kind, Source};

/// Moves shorter than this are none, mm.
const NOTHING: f64 = 1e-9;

/// One straight or circular move, or a part of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// The command.
    pub command: u32,
    /// Whether it ends at the command's target, or at the point on the way of an arc.
    pub end: End,
    from: Pose,
    to: Pose,
    arc: Option<(Arc, [f64; 2])>,
    /// Track and positioner at both ends.
    pub(super) external: [External; 2],
    /// Length from the chain's begin to its own, mm.
    pub begin: f64,
    /// Its length, mm; of a turn on the spot a length that stands for it.
    pub length: f64,
    /// How long it takes at the set speed, s; nothing where the arc does not burn.
    pub time: Option<f64>,
}

/// Where a leg ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At the target.
    Target,
    /// At the point on the way.
    Via,
}

impl Leg {
    /// The wire's tip in the part at a share of the way, as written.
    pub fn at(&self, share: f64) -> Pose {
        let position = match self.arc {
            Some((arc, [a, b])) => arc.at(a + (b - a) * share),
            None => self.from.position.lerp(self.to.position, share),
        };
        Pose {
            position,
            orientation: self.from.orientation.slerp(self.to.orientation, share),
        }
    }

    /// How far along its command a share of the way is, mm.
    pub(super) fn way_at(&self, share: f64) -> f64 {
        match self.arc {
            Some((arc, [a, b])) => arc.length() * (a + (b - a) * share),
            None => self.from.position.distance(self.to.position) * share,
        }
    }

    /// The part of it between two shares of its way.
    fn part(&self, [low, high]: [f64; 2]) -> Leg {
        let along = |[a, b]: [f64; 2], share: f64| a + (b - a) * share;
        let arc = self.arc.map(|(arc, range)| {
            let range = [along(range, low), along(range, high)];
            (arc, range)
        });
        Leg {
            from: self.at(low),
            to: self.at(high),
            arc,
            external: [self.external_at(low), self.external_at(high)],
            begin: self.begin + self.length * low,
            length: self.length * (high - low),
            time: self.time.map(|t| t * (high - low)),
            ..*self
        }
    }

    /// The share of the way at a length of its run.
    fn share_at(&self, length: f64) -> f64 {
        ((length - self.begin) / self.length).clamp(0.0, 1.0)
    }

    /// Track and positioner at a share of the way.
    pub fn external_at(&self, share: f64) -> External {
        let [from, to] = self.external;
        from.lerp(to, share)
    }
}

/// A run of moves, with the rotation about the wire at key places.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// The command that leads to its first place; nothing for the start of the program.
    pub first: Option<u32>,
    /// Its first place as written.
    pub start: Pose,
    /// Track and positioner there.
    pub external: External,
    /// Its moves.
    pub legs: Vec<Leg>,
    /// Length and rotation about the wire (rad, not wrapped) at key places, in order; empty until it is chosen.
    pub turns: Vec<(f64, f64)>,
    /// Joint angles at its first place, rad.
    pub joints: [f64; 6],
}

impl Chain {
    /// Its whole length, mm.
    pub fn length(&self) -> f64 {
        self.legs.last().map_or(0.0, |l| l.begin + l.length)
    }

    /// Whether the arc burns along the move that ends at a length, or leads past it.
    pub(super) fn burns_at(&self, length: f64) -> bool {
        let at = self.legs.partition_point(|l| l.begin + l.length < length);
        self.legs.get(at).is_some_and(|l| l.time.is_some())
    }

    /// The rotation about the wire at a length, rad, and the key place before it.
    pub fn turn_at(&self, length: f64) -> (f64, usize) {
        let after = self.turns.partition_point(|t| t.0 <= length);
        let before = after.saturating_sub(1);
        match (self.turns.get(before), self.turns.get(after)) {
            (Some(a), Some(b)) if b.0 > a.0 => {
                let share = (length - a.0) / (b.0 - a.0);
                (a.1 + (b.1 - a.1) * share, before)
            }
            (Some(a), _) => (a.1, before),
            (None, _) => (0.0, 0),
        }
    }

    /// The wire's tip in the part at a length, as written, and where track and positioner stand there.
    pub fn at(&self, length: f64) -> (Pose, External) {
        let after = self.legs.partition_point(|l| l.begin <= length);
        match self.legs.get(after.saturating_sub(1)) {
            Some(leg) => {
                let share = ((length - leg.begin) / leg.length).clamp(0.0, 1.0);
                (leg.at(share), leg.external_at(share))
            }
            None => (self.start, self.external),
        }
    }

    /// What comes after one of its legs, as a run of its own whose way is not chosen.
    pub(super) fn after(&self, leg: usize) -> Option<Chain> {
        let last = self.legs.get(leg)?;
        let gone = last.begin + last.length;
        let moved = |leg: &Leg| Leg {
            begin: leg.begin - gone,
            ..*leg
        };
        Some(Chain {
            first: Some(last.command),
            start: last.at(1.0),
            external: last.external_at(1.0),
            legs: self.legs[leg + 1..].iter().map(moved).collect(),
            turns: Vec::new(),
            joints: [0.0; 6],
        })
    }

    /// Its first part, up to a length, mm.
    pub(super) fn until(&self, length: f64) -> Chain {
        let begun = self.legs.iter().take_while(|l| l.begin < length);
        let cut = begun.map(|leg| match leg.share_at(length) {
            share if share < 1.0 => leg.part([0.0, share]),
            _ => *leg,
        });
        Chain {
            legs: cut.filter(|l| l.length >= NOTHING).collect(),
            ..self.clone()
        }
    }

    /// What comes after a length, mm, as a run of its own whose way is not chosen.
    pub(super) fn from(&self, length: f64) -> Chain {
        let (start, external) = self.at(length);
        let left = self.legs.iter().filter(|l| l.begin + l.length > length);
        let cut = left.map(|leg| match leg.share_at(length) {
            share if share > 0.0 => leg.part([share, 1.0]),
            _ => *leg,
        });
        let legs: Vec<Leg> = cut.filter(|l| l.length >= NOTHING).collect();
        let gone = legs.first().map_or(0.0, |l| l.begin);
        let moved = legs.iter().map(|leg| Leg {
            begin: leg.begin - gone,
            ..*leg
        });
        Chain {
            first: Some(self.command_at(length)),
            start,
            external,
            legs: moved.collect(),
            turns: Vec::new(),
            joints: [0.0; 6],
        }
    }

    /// Some of its legs as a run of their own.
    pub(super) fn of_legs(&self, legs: Range<usize>) -> Chain {
        let ends = |i: usize| self.legs.get(i).map(|l| (l.begin, l.begin + l.length));
        let last = legs.end.saturating_sub(1);
        match (ends(legs.start), ends(last)) {
            (Some((begin, _)), Some((_, end))) => self.until(end).from(begin),
            _ => self.clone(),
        }
    }

    /// The length at which a place along one of its commands lies, as far as its moves tell.
    pub(super) fn length_near(&self, place: &NotHeld) -> f64 {
        let legs = self.legs.iter().filter(|l| l.command == place.command);
        let near = legs.map(|leg| {
            let shares = (0..=64).map(|i| f64::from(i) / 64.0);
            let far = |share: f64| leg.at(share).position.distance(place.position);
            let best = shares.min_by(|a, b| far(*a).total_cmp(&far(*b)));
            let share = best.unwrap_or(0.0);
            (leg.begin + leg.length * share, far(share))
        });
        let best = near.min_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(0.0, |(length, _)| length)
    }

    /// The command at a length.
    pub fn command_at(&self, length: f64) -> u32 {
        let after = self.legs.partition_point(|l| l.begin <= length);
        let leg = self.legs.get(after.saturating_sub(1));
        leg.map_or(self.first.unwrap_or(0), |l| l.command)
    }
}

/// A pose turned about its wire.
pub(super) fn turned(tip: Pose, turn: f64) -> Pose {
    Pose {
        orientation: tip.orientation * DQuat::from_rotation_z(turn),
        ..tip
    }
}

/// The runs of a program between its joint moves.
pub(super) fn chains(task: &Task<'_>) -> Vec<Chain> {
    let rest = task.values.external();
    let mut stands = match task.axes {
        Axes::Written { start, .. } => start,
        Axes::Standing | Axes::Free => rest,
    };
    let mut chains = vec![begun(None, task.start, stands)];
    let mut here = task.start;
    for command in task.commands {
        let before = stands;
        if let Axes::Written { ends, .. } = task.axes
            && let Some(end) = ends.get(command.id as usize)
        {
            stands = *end;
        }
        let axes = [before, stands];
        let to = Pose {
            position: command.target,
            orientation: command.orientation,
        };
        match command.kind {
            Kind::Wait { .. } => continue,
            Kind::Joint(_) => chains.push(begun(Some(command.id), to, stands)),
            Kind::Line => add(&mut chains, command, (here, to), axes, None),
            Kind::Arc { via } => match Arc::through(here.position, via, to.position) {
                None => add(&mut chains, command, (here, to), axes, None),
                Some(arc) => {
                    let share = share_of(&arc, via);
                    let middle = Pose {
                        position: via,
                        orientation: here.orientation.slerp(to.orientation, share),
                    };
                    let between = before.lerp(stands, share);
                    let half = Some((arc, [0.0, share], End::Via));
                    add(
                        &mut chains,
                        command,
                        (here, middle),
                        [before, between],
                        half,
                    );
                    let half = Some((arc, [share, 1.0], End::Target));
                    add(&mut chains, command, (middle, to), [between, stands], half);
                }
            },
        }
        here = to;
    }
    chains
}

fn begun(first: Option<u32>, start: Pose, external: External) -> Chain {
    Chain {
        first,
        start,
        external,
        legs: Vec::new(),
        turns: Vec::new(),
        joints: [0.0; 6],
    }
}

/// The share of an arc at which a point of it lies.
fn share_of(arc: &Arc, point: DVec3) -> f64 {
    let d = point - arc.centre;
    let angle = d.dot(arc.v).atan2(d.dot(arc.u));
    angle.rem_euclid(std::f64::consts::TAU) / arc.sweep
}

/// Adds a move to the last run.
fn add(
    chains: &mut [Chain],
    command: &Command,
    (from, to): (Pose, Pose),
    external: [External; 2],
    arc: Option<(Arc, [f64; 2], End)>,
) {
    let Some(chain) = chains.last_mut() else {
        return;
    };
    let path = match &arc {
        Some((arc, [a, b], _)) => arc.length() * (b - a),
        None => from.position.distance(to.position),
    };
    // a radian on the spot counts as 100 mm: the way of a torch's neck
    let length = path.max(100.0 * from.orientation.angle_between(to.orientation));
    if length < NOTHING {
        return;
    }
    let burns = matches!(command.source, Source::On { .. });
    let leg = Leg {
        command: command.id,
        end: arc.as_ref().map_or(End::Target, |a| a.2),
        from,
        to,
        arc: arc.map(|(arc, range, _)| (arc, range)),
        external,
        begin: chain.length(),
        length,
        time: (burns && path > NOTHING).then(|| path / command.speed),
    };
    chain.legs.push(leg);
}
