//! A way of the whole cell along a run, drawn narrow: at every key place it may go a step aside in each of what is free, the joints the
//! nearest continuation; the best of all such ways is taken, again and again with smaller steps.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};

use meltpath_base::Observer;
use rayon::prelude::*;

use super::chain::Chain;
use super::choice::{self, Carried, Choice, Held, cost, lean};
use super::comfort::{MOTION, STEP, motion, step_over};
use super::grid::STEPS;
use super::stretch::apart;
use super::task::{Guard, Task, keep_clear};
use super::wide::{HEADINGS, SLACK};
use crate::cell::{External, Values};
use crate::kinematics::Limits;

/// Shares of the wide steps, one after the other.
const SHARES: [f64; 6] = [0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015_625];
/// Steps of one size are taken until they gain less than this, and no more often.
const GAIN: f64 = 1e-2;
const ROUNDS: usize = 8;
/// All places of a way are shifted alike where leaning is at least this share of what the way costs, and no more often.
const LEANING: f64 = 0.5;
const SHIFTS: usize = 16;
/// Steps that are tried then, along runs of no more key places than this.
const FARTHER: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
const SHORT: usize = 400;
/// An axis may take this share of its speed along a bead; this much more costs as much per length as [`MOTION`].
const FAST: f64 = 0.7;
const HASTE: f64 = 0.003;
/// Beyond this share it cannot follow: that costs ten times as much again.
const FULL: f64 = 0.95;
/// Key places that are drawn together. Their ends stand; the next time they lie between the ends.
const WINDOW: usize = 64;

/// What is drawn along.
pub(super) struct Narrow<'a> {
    pub(super) task: &'a Task<'a>,
    pub(super) chain: &'a Chain,
    /// Key places to which every step is followed before it is taken.
    pub(super) followed: &'a BTreeSet<usize>,
    /// Key places at which nothing may touch, by their number, and how much more room is asked for there, mm.
    pub(super) guarded: &'a BTreeMap<usize, f64>,
    pub(super) guard: Option<Guard<'a>>,
    /// What was drawn before along the same run.
    pub(super) drawn: &'a Drawn,
}

/// What windows were drawn from, and what came out, by number of the step size, round, and first key place: a run is drawn again when places
/// become narrower, and most of it is then as it was.
#[derive(Default)]
pub(super) struct Drawn(Mutex<BTreeMap<(usize, usize, usize), Window>>);

/// One window as it was drawn.
#[derive(Clone, PartialEq)]
struct Window {
    ways: Vec<Held>,
    guarded: Vec<Option<f64>>,
    followed: Vec<bool>,
    found: Vec<Held>,
}

/// A way beside the one that is.
struct Node {
    held: Held,
    cost: f64,
    /// See [`Narrow::rate`].
    rate: f64,
}

/// How far aside, and how much leaning costs nothing there.
#[derive(Clone, Copy)]
struct Aside {
    /// The number of the share in [`SHARES`], and of the round.
    number: (usize, usize),
    share: f64,
    slack: f64,
}

impl Narrow<'_> {
    /// The best way near `ways`, which hold the path at its key places.
    pub(super) fn draw(&self, mut ways: Vec<Held>, observer: &dyn Observer) -> Vec<Held> {
        for (size, share) in SHARES.into_iter().enumerate() {
            let slack = if share > SHARES[5] {
                SLACK * share
            } else {
                0.0
            };
            ways = self.shifted(ways, share);
            let mut before = self.total(&ways, slack);
            for round in 0..ROUNDS {
                if observer.cancelled() {
                    return ways;
                }
                let aside = Aside {
                    number: (size, round),
                    share,
                    slack,
                };
                ways = self.round(&ways, aside, round % 2 == 1);
                let total = self.total(&ways, slack);
                // both halves of the windows have had their turn
                if round % 2 == 1 && total > (1.0 - GAIN) * before {
                    break;
                }
                if round % 2 == 1 {
                    before = total;
                }
            }
        }
        ways
    }

    /// Ways that lean much, track and positioner shifted alike at all of them as long as that gains: the ends of windows stand, and where all
    /// places lean alike one of them going alone gains nothing.
    fn shifted(&self, mut ways: Vec<Held>, share: f64) -> Vec<Held> {
        for _ in 0..SHIFTS {
            let total = self.total(&ways, 0.0);
            if self.leaning(&ways) < LEANING * total {
                break;
            }
            // about a table that is turned by a quarter a tilt levels nothing: only farther round it does
            let times: &[f64] = if ways.len() > SHORT { &[1.0] } else { &FARTHER };
            let tried = self.shifts(share, times).into_par_iter();
            let tried = tried.filter_map(|by| {
                let shifted = self.shifted_by(&ways, by)?;
                Some((self.total(&shifted, 0.0), shifted))
            });
            let tried: Vec<(f64, Vec<Held>)> = tried.collect();
            let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
            match best.filter(|best| best.0 < (1.0 - GAIN) * total) {
                Some((_, shifted)) => ways = shifted,
                None => break,
            }
        }
        ways
    }

    /// What leaning costs of a way's total, rad²/mm.
    fn leaning(&self, ways: &[Held]) -> f64 {
        let pieces = ways.par_windows(2).map(|pair| {
            let (way, gone) = (&pair[1], pair[1].length - pair[0].length);
            let level = cost(self.task.cell, way.joints, 0.0, 0.0);
            (self.cost(way, 0.0) - level) * gone
        });
        let pieces: Vec<f64> = pieces.collect();
        pieces.iter().sum()
    }

    /// Ways with track and positioner elsewhere by as much at each; nothing where one of them cannot go there, or touches something.
    fn shifted_by(&self, ways: &[Held], by: External) -> Option<Vec<Held>> {
        let task = self.task;
        let shifted = ways.par_iter().enumerate().map(|(i, way)| {
            let external = External(std::array::from_fn(|k| way.choice.external.0[k] + by.0[k]));
            let is_within = (0..3).all(|k| {
                let room = task.cell.external_room(k);
                room.is_none_or(|[low, high]| (low..=high).contains(&external.0[k]))
            });
            if !is_within {
                return None;
            }
            let choice = Choice {
                external,
                ..way.choice
            };
            let (tip, _) = self.chain.at(way.length);
            let flange = Carried::at(task, external).flange(tip, choice.heading);
            let joints = task.cell.arm.nearest(flange, &way.joints).ok()?;
            motion(&joints, &way.joints, STEP)?;
            if task.cell.arm.margin(joints).0 < 0.0 {
                return None;
            }
            if let (Some(guard), Some(more)) = (self.guard, self.guarded.get(&i)) {
                let command = self.chain.command_at(way.length);
                let room = guard(command, &Values::of(joints, external), *more);
                if room < 0.0 {
                    return None;
                }
            }
            Some(Held {
                choice,
                joints,
                ..*way
            })
        });
        let shifted: Option<Vec<Held>> = shifted.collect();
        let shifted = shifted?;
        let goes_on = shifted.windows(2).enumerate().all(|(i, pair)| {
            let gone = pair[1].length - pair[0].length;
            let is_near = motion(&pair[0].joints, &pair[1].joints, step_over(gone)).is_some();
            is_near && (!self.followed.contains(&(i + 1)) || self.leads(&pair[0], &pair[1]))
        });
        goes_on.then_some(shifted)
    }

    /// What a way costs, rad²/mm.
    pub(super) fn total(&self, ways: &[Held], slack: f64) -> f64 {
        let pieces = ways.par_iter().enumerate().map(|(i, way)| {
            let Some(before) = i.checked_sub(1).map(|i| &ways[i]) else {
                return 0.0;
            };
            let gone = way.length - before.length;
            let steps = (0..6).map(|j| (way.joints[j] - before.joints[j]).powi(2));
            let moved =
                steps.sum::<f64>() + choice::travel(before.choice.external, way.choice.external);
            let haste = self.haste(before, way, self.rate(before.length, way.length));
            moved / gone + (self.cost(way, slack) + haste) * gone
        });
        let pieces: Vec<f64> = pieces.collect();
        pieces.iter().sum()
    }

    /// The greatest way along the run per second at the set speed between two lengths, mm/s; nothing where the arc does not burn.
    fn rate(&self, from: f64, to: f64) -> f64 {
        let legs = &self.chain.legs;
        let first = legs.partition_point(|l| l.begin + l.length <= from);
        let between = legs.iter().skip(first).take_while(|l| l.begin < to);
        let rates = between.filter_map(|l| Some(l.length / l.time?));
        rates.fold(0.0, f64::max)
    }

    /// What it costs per length to drive an axis faster than it shall, rad²/mm².
    fn haste(&self, from: &Held, to: &Held, rate: f64) -> f64 {
        let per_second = rate / (to.length - from.length);
        let share = |(a, b): (&f64, &f64), limits: &Limits| {
            limits.speed.map_or(0.0, |s| (b - a).abs() * per_second / s)
        };
        let cell = self.task.cell;
        let arm = from
            .joints
            .iter()
            .zip(&to.joints)
            .zip(&cell.arm.chain.joints);
        let arm = arm.map(|(step, joint)| share(step, &joint.limits));
        let (a, b) = (&from.choice.external.0, &to.choice.external.0);
        let beside = (0..3).filter_map(|i| {
            let joint = cell.external_joint(i)?;
            Some(share((&a[i], &b[i]), &joint.limits))
        });
        let greatest = arm.chain(beside).fold(0.0, f64::max);
        let haste = (greatest - FAST).max(0.0) + 10.0 * (greatest - FULL).max(0.0);
        (MOTION * haste / HASTE).powi(2)
    }

    fn cost(&self, way: &Held, slack: f64) -> f64 {
        let carried = Carried::at(self.task, way.choice.external);
        let (tip, _) = self.chain.at(way.length);
        let leaning = lean(self.task, &carried, tip);
        cost(self.task.cell, way.joints, leaning, slack)
    }

    /// The best way a step beside; windows begin half of one later where `shifted`.
    fn round(&self, ways: &[Held], aside: Aside, shifted: bool) -> Vec<Held> {
        let last = ways.len().saturating_sub(1);
        let first = if shifted { WINDOW / 2 } else { 0 };
        let mut ends: Vec<usize> = (first..last).step_by(WINDOW).collect();
        if ends.first() != Some(&0) {
            ends.insert(0, 0);
        }
        ends.push(last);
        let drawn: Vec<Vec<Held>> = ends
            .par_windows(2)
            .map(|ends| self.known_window(ways, [ends[0], ends[1]], aside))
            .collect();
        // a window's first place is the last one of the window before
        let mut all: Vec<Held> = Vec::with_capacity(ways.len());
        for window in drawn {
            all.pop();
            all.extend(window);
        }
        all
    }

    /// The best way between two key places, as it was drawn before where nothing has changed.
    fn known_window(&self, ways: &[Held], [from, to]: [usize; 2], aside: Aside) -> Vec<Held> {
        let asked = Window {
            ways: ways[from..=to].to_vec(),
            guarded: (from..=to).map(|i| self.guarded.get(&i).copied()).collect(),
            followed: (from..=to).map(|i| self.followed.contains(&i)).collect(),
            found: Vec::new(),
        };
        let (size, round) = aside.number;
        let same = |w: &&Window| {
            w.ways == asked.ways && w.guarded == asked.guarded && w.followed == asked.followed
        };
        let known = |round: usize| {
            let drawn = self.drawn.0.lock().unwrap_or_else(PoisonError::into_inner);
            let window = drawn.get(&(size, round, from)).filter(same);
            window.map(|w| w.found.clone())
        };
        // two rounds before the same places lay between the same ends
        let before = round.checked_sub(2).and_then(known);
        let found = known(round).or(before);
        let found = found.unwrap_or_else(|| self.window(ways, [from, to], aside));
        let window = Window {
            found: found.clone(),
            ..asked
        };
        let mut drawn = self.drawn.0.lock().unwrap_or_else(PoisonError::into_inner);
        drawn.insert((size, round, from), window);
        found
    }

    /// The best way between two key places, which stand but at the ends of the run.
    fn window(&self, ways: &[Held], [from, to]: [usize; 2], aside: Aside) -> Vec<Held> {
        let mut nodes: Vec<Vec<Node>> = (from..=to)
            .map(|i| {
                let stands = (i == from && from > 0) || (i == to && i + 1 < ways.len());
                let rate = match i.checked_sub(1) {
                    Some(before) => self.rate(ways[before].length, ways[i].length),
                    None => 0.0,
                };
                self.nodes(&ways[i], rate, aside, stands)
            })
            .collect();
        let mut looked = vec![false; nodes.len()];
        loop {
            let found = self.best(&nodes, from);
            let touched = self.touched(&mut nodes, &found, from, &mut looked);
            if !touched {
                let held = nodes.iter().zip(found).map(|(nodes, at)| nodes[at].held);
                return held.collect();
            }
        }
    }

    /// Which of the nodes at each key place from `from` on the best way goes through.
    fn best(&self, nodes: &[Vec<Node>], from: usize) -> Vec<usize> {
        let mut totals: Vec<f64> = vec![0.0; nodes[0].len()];
        let mut steps: Vec<Vec<u8>> = vec![vec![0; nodes[0].len()]];
        for (k, pair) in nodes.windows(2).enumerate() {
            let followed = self.followed.contains(&(from + k + 1));
            let (total, step): (Vec<f64>, Vec<u8>) = pair[1]
                .iter()
                .map(|node| self.led(&pair[0], &totals, node, followed))
                .unzip();
            totals = total;
            steps.push(step);
        }
        let best = totals.iter().enumerate();
        let mut at = best.min_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |b| b.0);
        let mut found = Vec::with_capacity(nodes.len());
        for step in steps.iter().rev() {
            found.push(at);
            at = usize::from(step[at]);
        }
        found.reverse();
        found
    }

    /// Takes out nodes that touch something at guarded key places where the way that was `found` does; whether there were such.
    fn touched(
        &self,
        nodes: &mut [Vec<Node>],
        found: &[usize],
        from: usize,
        looked: &mut [bool],
    ) -> bool {
        let Some(guard) = self.guard else {
            return false;
        };
        let mut touched = false;
        for (k, (nodes, at)) in nodes.iter_mut().zip(found).enumerate() {
            let Some(more) = self.guarded.get(&(from + k)) else {
                continue;
            };
            // what stands, or was looked at, is as it is
            if looked[k] || nodes.len() == 1 {
                continue;
            }
            let room = |n: &Node| {
                let command = self.chain.command_at(n.held.length);
                let values = Values::of(n.held.joints, n.held.choice.external);
                guard(command, &values, *more)
            };
            if room(&nodes[*at]) < 0.0 {
                keep_clear(nodes, room);
                looked[k] = true;
                touched = true;
            }
        }
        touched
    }

    /// The least cost of a way that comes from one of those before, and which.
    fn led(&self, before: &[Node], totals: &[f64], node: &Node, followed: bool) -> (f64, u8) {
        // what a way costs but for its haste, and that
        let cost = |i: usize| {
            let from = &before[i].held;
            let gone = node.held.length - from.length;
            let motion = motion(&from.joints, &node.held.joints, step_over(gone))?;
            let moved = choice::travel(from.choice.external, node.held.choice.external);
            Some(totals[i] + (motion + moved) / gone + node.cost * gone)
        };
        let haste = |i: usize| {
            let from = &before[i].held;
            self.haste(from, &node.held, node.rate) * (node.held.length - from.length)
        };
        if followed {
            let all = (0..before.len()).filter_map(|i| Some((cost(i)? + haste(i), i as u8)));
            let mut found: Vec<_> = all.collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut found = found.into_iter();
            let led = found.find(|(_, i)| self.leads(&before[usize::from(*i)].held, &node.held));
            return led.unwrap_or((f64::INFINITY, 0));
        }
        let mut best = (f64::INFINITY, 0);
        for i in 0..before.len() {
            // haste costs nothing or more: what is dearer without it need not be asked for it
            if let Some(least) = cost(i).filter(|least| *least < best.0) {
                let total = least + haste(i);
                if total < best.0 {
                    best = (total, i as u8);
                }
            }
        }
        best
    }

    fn leads(&self, from: &Held, to: &Held) -> bool {
        let end = (to.length, to.choice);
        let found = choice::go(self.task, self.chain, from, end, &[]);
        let found = found.and_then(|f| f.last().copied());
        found.is_some_and(|f| apart(&f.joints, &to.joints) < 1e-6)
    }

    /// What may be chosen at a key place, what is chosen first.
    fn nodes(&self, way: &Held, rate: f64, aside: Aside, stands: bool) -> Vec<Node> {
        let (tip, _) = self.chain.at(way.length);
        let mut nodes = vec![Node {
            held: *way,
            cost: self.cost(way, aside.slack),
            rate,
        }];
        if stands {
            return nodes;
        }
        let turn = aside.share * std::f64::consts::TAU / f64::from(HEADINGS);
        for external in self.beside(way.choice.external, aside.share) {
            let carried = Carried::at(self.task, external);
            let leaning = lean(self.task, &carried, tip);
            for heading in [-turn, 0.0, turn].map(|t| way.choice.heading + t) {
                let choice = Choice { heading, external };
                if choice == way.choice {
                    continue;
                }
                let flange = carried.flange(tip, heading);
                let Ok(joints) = self.task.cell.arm.nearest(flange, &way.joints) else {
                    continue;
                };
                let far = motion(&joints, &way.joints, STEP).is_none();
                if far || self.task.cell.arm.margin(joints).0 < 0.0 {
                    continue;
                }
                let held = Held {
                    choice,
                    joints,
                    ..*way
                };
                nodes.push(Node {
                    held,
                    cost: cost(self.task.cell, joints, leaning, aside.slack),
                    rate,
                });
            }
        }
        nodes
    }

    /// By how much all places are shifted: so many steps of the positioner's axes each way, or none.
    fn shifts(&self, share: f64, times: &[f64]) -> Vec<External> {
        let along = |i: usize| -> Vec<f64> {
            let moves = self.task.cell.external_room(i).is_some();
            let step = share * STEPS[i];
            let both = times
                .iter()
                .filter(|_| moves)
                .flat_map(|t| [t * step, -t * step]);
            std::iter::once(0.0).chain(both).collect()
        };
        let (first, second) = (along(1), along(2));
        let pairs = first
            .iter()
            .flat_map(|a| second.iter().map(|b| [0.0, *a, *b]));
        pairs.filter(|by| *by != [0.0; 3]).map(External).collect()
    }

    /// Places of track and positioner a step aside, within limits.
    fn beside(&self, External(at): External, share: f64) -> Vec<External> {
        let mut all = vec![at];
        for i in 0..3 {
            let Some([low, high]) = self.task.cell.external_room(i) else {
                continue;
            };
            let step = share * STEPS[i];
            all = all
                .into_iter()
                .flat_map(|at| {
                    let mut values = vec![at[i]];
                    values.extend([at[i] - step, at[i] + step].map(|v| v.clamp(low, high)));
                    values.dedup();
                    values.into_iter().map(move |v| {
                        let mut moved = at;
                        moved[i] = v;
                        moved
                    })
                })
                .collect();
        }
        all.into_iter().map(External).collect()
    }
}
