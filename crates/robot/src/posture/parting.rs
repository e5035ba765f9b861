//! Where no way of the arm holds a bead as a whole: the places at which it is to end and to begin anew, so that the arm can go over to another
//! way between.
//!
//! A bead is followed by one way as far as any leads, and ends a little before: at the latest place where that way still has the room that is
//! asked for, or, where the way after it would have less, where both have the same.

use std::collections::BTreeSet;
use std::ops::Range;

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;

use super::chain::{Chain, chains};
use super::change::{cut, holds};
use super::comfort::REACH;
use super::ladder::Blocked;
use super::search::{Found, of_arm};
use super::task::{NotHeld, Task, Why};

/// A part of a bead is at least so long, mm.
const LEAST: f64 = 20.0;
/// How finely the place is looked for, mm.
const FINE: f64 = 4.0;
/// So far before the place where a way ends a better one is looked for at most, mm.
const BACK: f64 = 400.0;
/// How far before and behind the place that was told first the end of a way is looked for, mm.
const ABOUT: f64 = 40.0;

/// A place at which a bead is to end and to begin anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parting {
    /// The command.
    pub command: u32,
    /// How far along the command, mm.
    pub along: f64,
    /// The wire's tip in the part, mm.
    pub position: DVec3,
    /// What ends the way before.
    pub end: WayEnd,
}

/// What keeps the way before a parting from going on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WayEnd {
    /// How far it would lead behind the parting, mm.
    pub behind: f64,
    /// What it comes nearest to there.
    pub near: Bound,
}

/// A bound of a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// The limit of a joint, from 0: where the controller shows it, rad, and how far it is, rad.
    Limit(usize, f64, f64),
    /// The axes of the wrist in line: how far that is, rad.
    Wrist(f64),
    /// The arm stretched: how far that is, rad.
    Elbow(f64),
    /// The wrist's centre over the first axis: how far that is, mm.
    Shoulder(f64),
}

impl Bound {
    /// What joints come nearest to.
    fn of(task: &Task<'_>, joints: [f64; 6]) -> Bound {
        let arm = &task.cell.arm;
        let (margin, joint) = arm.margin(joints);
        let limits = arm.chain.joints.get(joint).map(|j| j.limits);
        let shown = arm.shown(joints)[joint];
        let at = limits.map_or(shown, |l| {
            if shown - l.low < l.high - shown {
                l.low
            } else {
                l.high
            }
        });
        let singular = arm.nearness(joints).map(|n| {
            [
                Bound::Wrist(n.wrist),
                Bound::Elbow(n.elbow),
                Bound::Shoulder(n.shoulder.abs()),
            ]
        });
        let all = singular.into_iter().flatten();
        let all = all.chain([Bound::Limit(joint, at, margin)]);
        let least = all.min_by(|a, b| a.room().total_cmp(&b.room()));
        least.unwrap_or(Bound::Limit(joint, at, margin))
    }

    /// How far it is, rad, a metre as a radian.
    fn room(self) -> f64 {
        match self {
            Bound::Limit(_, _, room) | Bound::Wrist(room) | Bound::Elbow(room) => room,
            Bound::Shoulder(room) => room / REACH,
        }
    }
}

/// The places at which beads are to be divided so that changes on `travels` let the arm hold them; none where changes alone do. A way keeps
/// `room` (rad) from limits and singularities there, where it can.
///
/// # Errors
/// [`NotHeld`] where that does not help, or the search was stopped.
pub fn partings(
    task: &Task<'_>,
    travels: &BTreeSet<u32>,
    room: f64,
    observer: &dyn Observer,
) -> Result<Vec<Parting>, NotHeld> {
    let mut found = Vec::new();
    for run in chains(task) {
        let mut rest = run;
        while let Err(why) = holds(task, &rest, observer) {
            // what no way holds, no parting does
            if matches!(why.why, Why::Stopped | Why::Unreachable(_)) {
                return Err(why);
            }
            let bead = bead(&rest, why.command);
            let whole = bead
                .clone()
                .is_none_or(|legs| holds(task, &rest.of_legs(legs), observer).is_ok());
            let parted = bead.filter(|_| !whole).and_then(|legs| {
                let search = Parted {
                    task,
                    rest: &rest,
                    observer,
                };
                search.latest(legs, &why, room)
            });
            rest = if let Some((parting, tail)) = parted {
                found.push(parting);
                tail
            } else {
                let at = (why.command, travels);
                cut(task, &rest, at, observer).ok_or(why)?.1
            };
        }
    }
    Ok(found)
}

/// The legs of the bead that a command belongs to; nothing on travels.
fn bead(run: &Chain, command: u32) -> Option<Range<usize>> {
    let at = run.legs.partition_point(|l| l.command < command);
    let burns = |i: &usize| run.legs.get(*i).is_some_and(|l| l.time.is_some());
    // a place at the end of a travel is the begin of its bead
    let at = [at, at + 1].into_iter().find(burns)?;
    let begin = (0..=at).rev().take_while(burns).last()?;
    let end = (at..run.legs.len()).take_while(burns).last()? + 1;
    Some(begin..end)
}

/// The search for a place to part a bead of a run.
struct Parted<'a> {
    task: &'a Task<'a>,
    rest: &'a Chain,
    observer: &'a dyn Observer,
}

impl Parted<'_> {
    fn way(&self, run: &Chain) -> Option<Found> {
        of_arm(
            self.task,
            (run, None),
            &mut Blocked::new(None),
            self.observer,
        )
        .ok()
    }

    /// What a way from the begin comes near to at a length.
    fn before(&self, length: f64) -> Option<Bound> {
        let found = self.way(&self.rest.until(length))?;
        Some(Bound::of(self.task, found.end.arm))
    }

    /// What a way from a length on comes near to there, that leads farther than any before it by half of what is left at least.
    fn after(&self, length: f64, (reach, end): (f64, f64)) -> Option<Bound> {
        let mut to = end;
        loop {
            if to - reach < LEAST.min(end - reach) {
                return None;
            }
            let run = self.rest.until(to).from(length);
            if let Some(found) = self.way(&run) {
                return Some(Bound::of(self.task, found.chain.joints));
            }
            to = reach + 0.5 * (to - reach);
            if self.observer.cancelled() {
                return None;
            }
        }
    }

    /// The greatest length between two, the first of which a way leads to and the second none.
    fn reach(&self, mut held: f64, mut broken: f64) -> f64 {
        while broken - held > FINE && !self.observer.cancelled() {
            let middle = 0.5 * (held + broken);
            match self.before(middle) {
                Some(_) => held = middle,
                None => broken = middle,
            }
        }
        held
    }

    /// The latest place to part a bead, and the run after it.
    fn latest(&self, legs: Range<usize>, why: &NotHeld, room: f64) -> Option<(Parting, Chain)> {
        let span = |i: usize| self.rest.legs.get(i).map(|l| (l.begin, l.begin + l.length));
        let (begin, end) = (span(legs.start)?.0, span(legs.end.checked_sub(1)?)?.1);
        let first = (begin + LEAST).min(end);
        self.before(first)?;
        // the place that was told is near the end of the way, mostly
        let told = self.rest.length_near(why).clamp(first, end);
        let (mut held, mut broken) = (first, end);
        if let Some(near) = Some(told + ABOUT).filter(|l| *l < end) {
            match self.before(near) {
                Some(_) => held = near,
                None => broken = near,
            }
        }
        let near = told - ABOUT;
        if near > held && self.before(near).is_some() {
            held = near;
        }
        let reach = self.reach(held, broken);
        let bound = self.before(reach)?;
        let at = self.roomy((first, reach, end), room)?;
        let leg = self
            .rest
            .legs
            .get(self.rest.legs.partition_point(|l| l.begin + l.length < at))?;
        let share = ((at - leg.begin) / leg.length).clamp(0.0, 1.0);
        let parting = Parting {
            command: leg.command,
            along: leg.way_at(share),
            position: leg.at(share).position,
            end: WayEnd {
                behind: reach - at,
                near: bound,
            },
        };
        Some((parting, self.rest.from(at)))
    }

    /// Back from where a way ends: the latest place with room for it, or with as much room as for the way that comes after.
    fn roomy(&self, (first, reach, end): (f64, f64, f64), room: f64) -> Option<f64> {
        let before = |at: f64| self.before(at).map_or(f64::NEG_INFINITY, Bound::room);
        let after = |at: f64| {
            let bound = self.after(at, (reach, end));
            bound.map_or(f64::NEG_INFINITY, Bound::room)
        };
        let bisected = |mut good: f64, mut bad: f64, is_good: &dyn Fn(f64) -> bool| {
            while bad - good > FINE && !self.observer.cancelled() {
                let middle = 0.5 * (good + bad);
                if is_good(middle) {
                    good = middle;
                } else {
                    bad = middle;
                }
            }
            good
        };
        let back = first.max(reach - BACK);
        let wide = if before(reach) >= room {
            reach
        } else {
            bisected(back, reach, &|at| before(at) >= room)
        };
        let least = after(wide);
        if least >= room {
            return Some(wide);
        }
        // the way after has less room the farther back it begins, or none at all
        let even = bisected(wide, reach, &|at| after(at) < before(at));
        let best = [wide, even, reach]
            .into_iter()
            .map(|at| (at, after(at).min(before(at))));
        let best = best.max_by(|a, b| a.1.total_cmp(&b.1))?;
        best.1.is_finite().then_some(best.0)
    }
}
