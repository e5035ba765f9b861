//! A run with everything free: chosen wide, drawn narrow, followed, and chosen again where it does not hold.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;

use super::chain::{Chain, End};
use super::choice::{self, Carried, Choice, Held, lean};
use super::follow::verify;
use super::grid::STEPS;
use super::narrow::{Drawn, Narrow};
use super::task::{Guard, Near, NotHeld, Task, Why, guard_places};
use super::wide::{SLACK, Wide, is_same};
use crate::cell::{Arrangement, Values};

/// Least distance of key places, mm, and of those where ways are chosen wide.
const NEAR: f64 = 10.0;
const FAR: f64 = 40.0;

/// A positioner turns back where the torch then leans so much less, rad.
const WORTH: f64 = TAU / 72.0;

/// Along longer runs a positioner is not given more key places the more it has to turn, nor turned back in the air, mm: either takes
/// several times as long as the way itself.
const LONG: f64 = 5000.0;

/// How often another way is looked for.
const ATTEMPTS: usize = 40;

/// A search along one run.
pub(super) struct Free<'a> {
    task: &'a Task<'a>,
    chain: &'a Chain,
    /// Lengths of the key places: ends of moves, so that what lies between goes in step with each move.
    places: Vec<f64>,
    wide: Wide<'a>,
    followed: BTreeSet<usize>,
    /// Key places at which nothing may touch, and how much more room is asked for there, mm.
    guarded: BTreeMap<usize, f64>,
    guard: Option<Guard<'a>>,
    drawn: Drawn,
}

/// Ends of moves at least so far apart, or between which the last axis of the positioner has a step to turn; the first and the last
/// among them.
fn spaced(
    ends: impl Iterator<Item = f64>,
    least: f64,
    chain: &Chain,
    turning: Option<Turning>,
) -> Vec<f64> {
    let tool = |length: f64| chain.at(length).0.orientation * DVec3::Z;
    let mut spaced = vec![0.0];
    for end in ends {
        let from = spaced.last().copied().unwrap_or(0.0);
        if end - from >= least || turning.is_some_and(|t| t.has_a_step(tool(from), tool(end))) {
            spaced.push(end);
        }
    }
    let whole = chain.length();
    if spaced.last().is_some_and(|last| *last < whole) {
        spaced.push(whole);
    }
    spaced
}

/// How the last axis of a positioner turns what a torch points at.
#[derive(Clone, Copy)]
struct Turning {
    /// The axis, in the part.
    axis: DVec3,
    /// Its step where a way is chosen wide, rad.
    step: f64,
}

impl Turning {
    /// Of a positioner that is to keep the torch upright, along a run that is not too long for it.
    fn of(task: &Task<'_>, chain: &Chain) -> Option<Self> {
        if task.cell.arrangement != Arrangement::TorchOnRobot || chain.length() > LONG {
            return None;
        }
        let last = [2, 1]
            .into_iter()
            .find(|i| task.cell.external_joint(*i).is_some())?;
        let turned = |angle: f64| {
            let mut external = task.values.external();
            external.0[last] += angle;
            let values = Values::of(task.values.arm, external);
            task.cell.frames(&values).part.orientation
        };
        let (axis, _) = (turned(0.0).inverse() * turned(1.0)).to_axis_angle();
        let step = STEPS[last];
        Some(Turning { axis, step })
    }

    /// Whether it has nearly a step to turn for torches that point one way and then another. About torches that stand along it, or lean
    /// no more than costs nothing, it has none.
    fn has_a_step(&self, from: DVec3, to: DVec3) -> bool {
        let leans = |tool: DVec3| tool.cross(self.axis).length() > SLACK.sin();
        let beside = |tool: DVec3| tool.reject_from_normalized(self.axis);
        leans(from) && leans(to) && beside(from).angle_between(beside(to)) > 0.8 * self.step
    }
}

/// Lengths of the key places of a run.
fn near_places(task: &Task<'_>, chain: &Chain) -> Vec<f64> {
    let ends = chain.legs.iter().filter(|l| l.end == End::Target);
    let ends = ends.map(|l| l.begin + l.length);
    spaced(ends, NEAR, chain, Turning::of(task, chain))
}

/// Of the key places those where ways are chosen wide.
fn far_places(task: &Task<'_>, chain: &Chain, places: &[f64]) -> Vec<f64> {
    let ends = places.iter().skip(1).copied();
    spaced(ends, FAR, chain, Turning::of(task, chain))
}

impl<'a> Free<'a> {
    pub(super) fn new(task: &'a Task<'a>, chain: &'a Chain, guard: Option<Guard<'a>>) -> Self {
        let places = near_places(task, chain);
        let far = far_places(task, chain, &places);
        Free {
            task,
            chain,
            wide: Wide::new(task, chain, far, guard),
            places,
            followed: BTreeSet::new(),
            guarded: BTreeMap::new(),
            guard,
            drawn: Drawn::default(),
        }
    }

    /// The travels on which joint moves let the positioner keep the torch upright, where it has not turns enough for the whole run.
    ///
    /// # Errors
    /// [`NotHeld`] where no way holds the run, either.
    pub(super) fn turned_back(
        task: &Task<'_>,
        chain: &Chain,
        travels: &BTreeSet<u32>,
        observer: &dyn Observer,
    ) -> Result<Vec<u32>, NotHeld> {
        if chain.length() > LONG {
            return Ok(Vec::new());
        }
        let over = chain.legs.iter().filter(|l| travels.contains(&l.command));
        let over: Vec<(u32, [f64; 2])> = over
            .map(|l| (l.command, [l.begin, l.begin + l.length]))
            .collect();
        let mut lengths = far_places(task, chain, &near_places(task, chain));
        lengths.extend(over.iter().flat_map(|o| o.1));
        lengths.sort_by(f64::total_cmp);
        lengths.dedup();
        let between = |[begin, end]: [f64; 2]| move |l: &f64| *l <= begin || *l >= end;
        for (_, ends) in &over {
            lengths.retain(between(*ends));
        }
        let place = |length: f64| lengths.partition_point(|l| *l < length);
        let commands: BTreeMap<usize, u32> = over.iter().map(|o| (place(o.1[1]), o.0)).collect();
        let may = commands.keys().copied().collect();
        let mut wide = Wide::new(task, chain, lengths, None);
        let straight = wide.climb(observer)?;
        let (back, places) = wide.joint_moves(may, observer)?;
        let leans = |ways: &[Held]| {
            let along_beads = ways.iter().filter(|way| chain.burns_at(way.length));
            let leans = along_beads.map(|way| {
                let carried = Carried::at(task, way.choice.external);
                lean(task, &carried, chain.at(way.length).0)
            });
            leans.fold(0.0, f64::max)
        };
        if leans(&straight) - leans(&back) < WORTH {
            return Ok(Vec::new());
        }
        let chosen = places.iter().filter_map(|place| commands.get(place));
        Ok(chosen.copied().collect())
    }

    /// Lets nothing touch at key places: see [`guard_places`].
    pub(super) fn guard(&mut self, near: Near) -> bool {
        let narrow = guard_places(&mut self.guarded, &self.places, near);
        self.wide.guard(near) || narrow.is_some()
    }

    /// The best way; a joint move leads there from where every axis stands `before`, if anywhere.
    ///
    /// # Errors
    /// [`NotHeld`] at the first place from which no way goes on.
    pub(super) fn best(
        &mut self,
        before: Option<Values>,
        observer: &dyn Observer,
    ) -> Result<Chain, NotHeld> {
        self.wide.begin_from(before);
        let mut first = None;
        for _ in 0..ATTEMPTS {
            let ways = self.wide.climb(observer).map_err(|e| first.unwrap_or(e))?;
            let held = match self.followed(&ways) {
                Ok(held) => held,
                Err(broken) => {
                    let new = broken.iter().filter(|place| self.wide.follow(**place));
                    if new.count() == 0 {
                        break;
                    }
                    continue;
                }
            };
            let narrow = Narrow {
                task: self.task,
                chain: self.chain,
                followed: &self.followed,
                guarded: &self.guarded,
                guard: self.guard,
                drawn: &self.drawn,
            };
            let chain = self.chosen(&narrow.draw(held, observer));
            let Err(broken) = verify(self.task, &chain, |_| ()) else {
                return Ok(chain);
            };
            first.get_or_insert(broken.not_held);
            if !self.followed.insert(broken.rung + 1) {
                break;
            }
        }
        Err(first.unwrap_or(NotHeld {
            command: self.chain.first.unwrap_or(0),
            position: self.chain.start.position,
            why: Why::Change,
        }))
    }

    /// The way at every key place; where it cannot be followed, the wide key places that are not come to.
    fn followed(&self, ways: &[Held]) -> Result<Vec<Held>, Vec<usize>> {
        let mut held: Vec<Held> = ways.first().copied().into_iter().collect();
        let mut broken = Vec::new();
        let mut places = self.places.iter().copied().skip(1).peekable();
        for (i, pair) in ways.windows(2).enumerate() {
            let (from, to) = (pair[0], pair[1]);
            let mut stops = Vec::new();
            while let Some(stop) = places.next_if(|p| *p < to.length) {
                stops.push(stop);
            }
            places.next_if(|p| *p <= to.length);
            let found = choice::go(self.task, self.chain, &from, (to.length, to.choice), &stops);
            let found = found.filter(|f| f.last().is_some_and(|f| is_same(&f.joints, &to.joints)));
            match found {
                Some(found) => held.extend(found),
                None => broken.push(i + 1),
            }
        }
        if broken.is_empty() {
            Ok(held)
        } else {
            Err(broken)
        }
    }

    /// The run with a way: rotations at its key places, track and positioner at the ends of its moves.
    fn chosen(&self, ways: &[Held]) -> Chain {
        let mut turns: Vec<(f64, f64)> = Vec::with_capacity(ways.len());
        for way in ways {
            let carried = Carried::at(self.task, way.choice.external);
            let turn = carried.turn(self.chain.at(way.length).0, way.choice.heading);
            let last = turns.last().map_or(turn, |t| t.1);
            turns.push((way.length, choice::unwound(turn, last)));
        }
        let first = ways.first();
        let mut chain = Chain {
            turns,
            joints: first.map_or([0.0; 6], |w| w.joints),
            external: first.map_or(self.chain.external, |w| w.choice.external),
            ..self.chain.clone()
        };
        let mut stands = chain.external;
        let mut after = 0;
        for leg in &mut chain.legs {
            let end = leg.begin + leg.length;
            while ways.get(after).is_some_and(|w| w.length < end) {
                after += 1;
            }
            let to = match (
                after.checked_sub(1).and_then(|i| ways.get(i)),
                ways.get(after),
            ) {
                (Some(a), Some(b)) => between(a, b, end).external,
                (_, Some(way)) | (Some(way), None) => way.choice.external,
                (None, None) => stands,
            };
            leg.external = [stands, to];
            stands = to;
        }
        chain
    }
}

/// What is chosen at a length between two key places.
fn between(a: &Held, b: &Held, length: f64) -> Choice {
    a.choice
        .lerp(b.choice, (length - a.length) / (b.length - a.length))
}

#[cfg(test)]
mod tests {
    use meltpath_base::Silent;
    use meltpath_data::{find, robots};
    use meltpath_geometry::Pose;
    use meltpath_geometry::math::DVec3;

    use super::super::chain::chains;
    use super::super::choice::cost;
    use super::super::comfort::motion;
    use super::super::task::{Axes, Rotation};
    use super::*;
    use crate::cell::{self, External};
    use crate::command::{Command, Smoothing, Source};

    /// The least cost over all headings in steps of 3 deg and all angles of the roller in steps of 1 deg, nothing left out.
    fn exhaustive(task: &Task<'_>, chain: &Chain, lengths: &[f64]) -> f64 {
        let mut before: Vec<(Held, f64)> = Vec::new();
        for &length in lengths {
            let (tip, _) = chain.at(length);
            let mut now = Vec::new();
            for angle in -20..=20 {
                let external = External([0.0, f64::from(angle).to_radians(), 0.0]);
                let carried = Carried::at(task, external);
                let lean = lean(task, &carried, tip);
                for heading in (0..120).map(|h| TAU * f64::from(h) / 120.0) {
                    let found = task.cell.arm.inverse(carried.flange(tip, heading)).unwrap();
                    for solution in found.solutions.iter().filter(|s| s.margin >= 0.0) {
                        let choice = Choice { heading, external };
                        let joints = solution.angles;
                        let held = Held {
                            length,
                            choice,
                            joints,
                        };
                        now.push((held, cost(task.cell, joints, lean, 0.0)));
                    }
                }
            }
            for (held, total) in &mut now {
                let led = before.iter().filter_map(|(from, sum)| {
                    let gone = held.length - from.length;
                    let moved = choice::travel(from.choice.external, held.choice.external);
                    let motion = motion(&from.joints, &held.joints, 1.0)?;
                    Some(sum + (motion + moved) / gone + *total * gone)
                });
                *total = if before.is_empty() {
                    0.0
                } else {
                    led.fold(f64::INFINITY, f64::min)
                };
            }
            before = now;
        }
        before.iter().map(|b| b.1).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn multiaxis_ma7_the_cost_is_within_two_percent_of_trying_everything() {
        let text = find(robots::ALL, "abb-irb2600-12-185").unwrap().text;
        let (arm, _) = text.split_once("\n[table]").unwrap();
        let cell = cell::read(&format!(
            "{arm}\n[positioner]\nsource = \"test\"\naxes = [{{ position = [\"1200 mm\", \"0 mm\", \"700 mm\"], axis = [1, 0, 0] }}]\nlow = [\"-20 deg\"]\nhigh = [\"20 deg\"]\n"
        ))
        .unwrap();
        let pose = |i: u32| {
            let (s, c) = (0.1 * f64::from(i) - 0.1).sin_cos();
            let out = DVec3::new(0.0, s, c);
            Pose::of_tool(60.0 * out + 12.0 * f64::from(i) * DVec3::X, out, 0.0)
        };
        let commands: Vec<Command> = (1..4)
            .map(|i| Command {
                source: Source::On { wire_feed: 100.0 },
                orientation: pose(i).orientation,
                ..Command::line(i - 1, pose(i).position, 10.0, Smoothing::Fine)
            })
            .collect();
        let configurations = BTreeMap::new();
        let task = Task {
            cell: &cell,
            values: cell.at_rest(),
            axes: Axes::Free,
            start: pose(0),
            commands: &commands,
            rotation: Rotation::Free,
            configurations: &configurations,
        };
        let chain = &chains(&task)[0];
        let mut free = Free::new(&task, chain, None);
        let ways = free.wide.climb(&Silent).unwrap();
        let held = free.followed(&ways).unwrap();
        let narrow = Narrow {
            task: &task,
            chain,
            followed: &free.followed,
            guarded: &BTreeMap::new(),
            guard: None,
            drawn: &free.drawn,
        };
        let found = narrow.total(&narrow.draw(held, &Silent), 0.0);
        let best = exhaustive(&task, chain, &free.places);
        assert_eq!(free.places.len(), 4);
        assert!(found <= 1.02 * best, "{found:e} {best:e}");
    }
}
