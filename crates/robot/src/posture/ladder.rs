//! Chooses the rotation about the wire and the way of the arm at key places of a run: dynamic programming over all of them.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use meltpath_base::Observer;
use meltpath_geometry::Pose;

use super::chain::{Chain, turned};
use super::comfort::{STEP, discomfort, is_wound, motion};
use super::joint_move::{cost_of, least_room};
use super::task::{Guard, Near, NotHeld, Rotation, Task, Why, guard_places, keep_clear};
use crate::cell::{External, Holder, Stance, Values};

/// Rotations that are tried at each key place.
const ROTATIONS: usize = 36;

/// Greatest and least distance of key places, mm.
const FAR: f64 = 30.0;
const NEAR: f64 = 10.0;

/// A way to hold a key place: a rotation, and one of the ways of the arm at it.
type Way = (u8, u16);

/// What a way may not do.
pub(super) struct Blocked<'a> {
    /// Pairs of ways that were found not to lead from one key place to the next.
    pairs: BTreeSet<(usize, Way, Way)>,
    /// Key places at which nothing may touch, and how much more room is asked for there, mm.
    guarded: BTreeMap<usize, f64>,
    guard: Option<Guard<'a>>,
}

impl<'a> Blocked<'a> {
    pub(super) fn new(guard: Option<Guard<'a>>) -> Self {
        Blocked {
            pairs: BTreeSet::new(),
            guarded: BTreeMap::new(),
            guard,
        }
    }

    /// Lets nothing touch at key places: see [`guard_places`].
    pub(super) fn guard(&mut self, chain: &Chain, near: Near) -> bool {
        guard_places(&mut self.guarded, &rungs(chain), near).is_some()
    }

    /// Keeps the ways at a key place that touch nothing, where it is guarded.
    fn clear(&self, rung: usize, (command, external): (u32, External), nodes: &mut Vec<Node>) {
        if let (Some(guard), Some(more)) = (self.guard, self.guarded.get(&rung)) {
            keep_clear(nodes, |n| {
                guard(command, &Values::of(n.joints, external), *more)
            });
        }
    }

    /// Keeps the ways that a joint move leads to clear of what stands around, and lets its motion count.
    fn over(&self, from: &Values, (command, external): (u32, External), nodes: &mut Vec<Node>) {
        let values = |n: &Node| Values::of(n.joints, external);
        if let Some(guard) = self.guard {
            keep_clear(nodes, |n| least_room(from, &values(n), (guard, command)));
        }
        for node in nodes {
            node.cost += cost_of(from, &values(node));
        }
    }

    /// Blocks the step from a key place to the next.
    pub(super) fn add(&mut self, chosen: &Chosen, rung: usize) {
        let last = chosen.ways.len().saturating_sub(1);
        let (a, b) = (rung.min(last), (rung + 1).min(last));
        if let (Some(from), Some(to)) = (chosen.ways.get(a), chosen.ways.get(b)) {
            self.pairs.insert((b, *from, *to));
        }
    }
}

/// A run with its way chosen.
pub(super) struct Chosen {
    pub(super) chain: Chain,
    ways: Vec<Way>,
}

/// One way at one key place.
struct Node {
    way: Way,
    joints: [f64; 6],
    /// Of all before it and itself.
    cost: f64,
}

/// How a key place was come to: the way, and which of the ways before.
struct Step {
    way: Way,
    before: u16,
}

/// Lengths of the key places of a run.
fn rungs(chain: &Chain) -> Vec<f64> {
    let mut rungs = vec![0.0];
    let mut last = 0.0;
    for leg in &chain.legs {
        let end = leg.begin + leg.length;
        let pieces = ((end - last) / FAR).ceil().max(1.0);
        if end - last >= NEAR {
            rungs.extend((1..=pieces as u32).map(|i| last + (end - last) * f64::from(i) / pieces));
            last = end;
        }
    }
    if chain.length() > last {
        rungs.push(chain.length());
    }
    rungs
}

/// Ways of all rotations at a length.
struct Places<'a> {
    task: &'a Task<'a>,
    chain: &'a Chain,
}

impl Places<'_> {
    fn turn(&self, rotation: u8) -> f64 {
        match self.task.rotation {
            Rotation::Free => TAU * f64::from(rotation) / ROTATIONS as f64,
            Rotation::Written => 0.0,
        }
    }

    fn rotations(&self) -> u8 {
        match self.task.rotation {
            Rotation::Free => ROTATIONS as u8,
            Rotation::Written => 1,
        }
    }

    /// The ways at a length within limits; where there is none, why.
    fn nodes(&self, length: f64) -> Result<Vec<Node>, Why> {
        let mut nodes = Vec::new();
        let mut why: Option<Why> = None;
        let place = self.place(length);
        for rotation in 0..self.rotations() {
            match self.at(place, rotation) {
                Ok(found) => nodes.extend(found),
                Err(new) => why = Some(why.map_or(new, |old| milder(old, new))),
            }
        }
        match why {
            Some(why) if nodes.is_empty() => Err(why),
            _ => Ok(nodes),
        }
    }

    /// The ways at the first key place, as the program says the arm stands there.
    fn begin(&self) -> Result<Vec<Node>, Why> {
        let task = self.task;
        let Some(wanted) = task.configurations.get(&self.chain.first) else {
            return self.nodes(0.0);
        };
        if let Stance::Joints(shown) = wanted {
            // where the wrist is stretched these joints are one of many ways
            let joints = task.cell.arm.joints(shown.map(f64::to_radians));
            let (tip, holder) = self.place(0.0);
            if task.cell.arm.holds(holder.base_from_flange(tip), joints) {
                let (margin, joint) = task.cell.arm.margin(joints);
                let by = -margin;
                let node = Node {
                    way: (0, 0),
                    joints,
                    cost: discomfort(&task.cell.arm, joints),
                };
                if by > 0.0 {
                    return Err(Why::Limit { joint, by });
                }
                return Ok(vec![node]);
            }
        }
        let mut nodes = self.nodes(0.0)?;
        nodes.retain(|n| task.cell.stands(n.joints, wanted));
        match nodes[..] {
            [] => Err(Why::Configuration(*wanted)),
            _ => Ok(nodes),
        }
    }

    /// The wire's tip at a length as written, and what leads from it to the flange.
    fn place(&self, length: f64) -> (Pose, Holder) {
        let (tip, external) = self.chain.at(length);
        let values = Values::of(self.task.values.arm, external);
        (tip, self.task.cell.holder(&values))
    }

    /// The ways of one rotation at a place within limits.
    fn at(&self, (tip, holder): (Pose, Holder), rotation: u8) -> Result<Vec<Node>, Why> {
        let tip = turned(tip, self.turn(rotation));
        let arm = &self.task.cell.arm;
        let found = arm
            .inverse(holder.base_from_flange(tip))
            .map_err(Why::Unreachable)?;
        let within = found.solutions.iter().filter(|s| s.margin >= 0.0);
        let ways = within.flat_map(|s| arm.turns(s.angles));
        let ways = ways.filter(|joints| self.is_tried(joints));
        let nodes: Vec<Node> = (0..u16::MAX)
            .zip(ways)
            .map(|(i, joints)| Node {
                way: (rotation, i),
                joints,
                cost: discomfort(arm, joints),
            })
            .collect();
        if !nodes.is_empty() {
            return Ok(nodes);
        }
        let best = found
            .solutions
            .iter()
            .max_by(|a, b| a.margin.total_cmp(&b.margin));
        Err(best.map_or(Why::Change, |s| Why::Limit {
            joint: s.tightest,
            by: -s.margin,
        }))
    }

    /// Whole turns are tried where a written rotation may need them; where it is free, only those that wind nothing up.
    fn is_tried(&self, joints: &[f64; 6]) -> bool {
        self.task.rotation == Rotation::Written || !is_wound(&self.task.cell.arm, joints)
    }
}

/// Of two reasons why a place cannot be held, the one that is nearer to holding it.
pub(super) fn milder(a: Why, b: Why) -> Why {
    let by = |why: &Why| match why {
        Why::Configuration(_) | Why::Change | Why::Stopped => (0, 0.0),
        Why::Limit { by, .. } | Why::External { by, .. } => (1, *by),
        Why::Unreachable(u) => (2, u.by()),
    };
    let ((rank_a, by_a), (rank_b, by_b)) = (by(&a), by(&b));
    if (rank_b, by_b) < (rank_a, by_a) {
        b
    } else {
        a
    }
}

/// Chooses a way at each key place, so that joint motion and discomfort are least over the whole run. Where a joint move leads there from other
/// beads, its own motion counts too.
///
/// # Errors
/// [`NotHeld`] at the first key place that no way leads to.
pub(super) fn climb(
    task: &Task<'_>,
    (chain, from): (&Chain, Option<Values>),
    blocked: &Blocked<'_>,
    observer: &dyn Observer,
) -> Result<Chosen, NotHeld> {
    let places = Places { task, chain };
    let rungs = rungs(chain);
    let not_held = |length: f64, why: Why| NotHeld {
        command: chain.command_at(length),
        position: chain.at(length).0.position,
        why,
    };
    let mut steps: Vec<Vec<Step>> = Vec::with_capacity(rungs.len());
    let mut before: Vec<Node> = Vec::new();
    let mut first: BTreeMap<Way, [f64; 6]> = BTreeMap::new();
    for (rung, &length) in rungs.iter().enumerate() {
        if observer.cancelled() {
            return Err(not_held(length, Why::Stopped));
        }
        let found = match rung {
            0 => places.begin(),
            _ => places.nodes(length),
        };
        let mut nodes = found.map_err(|why| not_held(length, why))?;
        let at = (chain.command_at(length), chain.at(length).1);
        blocked.clear(rung, at, &mut nodes);
        let gone = rungs.get(rung.wrapping_sub(1)).map_or(0.0, |l| length - l);
        let (nodes, step) = if rung == 0 {
            if let Some(from) = from {
                blocked.over(&from, at, &mut nodes);
            }
            first = nodes.iter().map(|n| (n.way, n.joints)).collect();
            let step = nodes.iter().map(|n| Step {
                way: n.way,
                before: 0,
            });
            let step = step.collect();
            (nodes, step)
        } else {
            onward(&before, nodes, gone, places.rotations(), |from, to| {
                blocked.pairs.contains(&(rung, from, to))
            })
        };
        if nodes.is_empty() {
            return Err(not_held(length, Why::Change));
        }
        before = nodes;
        steps.push(step);
    }
    let last = before
        .iter()
        .enumerate()
        .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    let ways = back(&steps, last.map_or(0, |(i, _)| i));
    let begin = ways.first().and_then(|way| first.get(way));
    let chain = Chain {
        joints: begin.copied().unwrap_or_default(),
        ..places.chosen(&rungs, &ways)
    };
    Ok(Chosen { chain, ways })
}

/// The ways at a key place that some way of the one before leads to, with the least cost so far.
fn onward(
    before: &[Node],
    nodes: Vec<Node>,
    gone: f64,
    rotations: u8,
    blocked: impl Fn(Way, Way) -> bool,
) -> (Vec<Node>, Vec<Step>) {
    // ways before stand in the order of their rotations: only neighbours of a rotation lead on
    let range = |rotation: u8| {
        let at = |r: u8| before.partition_point(|n| n.way.0 < r);
        at(rotation)..at(rotation + 1)
    };
    let ranges: Vec<_> = (0..rotations).map(range).collect();
    let neighbours = |rotation: u8| {
        let others = [rotations - 1, 0, 1].map(|d| (rotation + d) % rotations);
        let count = usize::from(rotations).min(3);
        others.into_iter().take(count)
    };
    let (mut kept, mut steps) = (Vec::new(), Vec::new());
    for mut node in nodes {
        let mut best: Option<(f64, usize)> = None;
        for rotation in neighbours(node.way.0) {
            for i in ranges[usize::from(rotation)].clone() {
                let from = &before[i];
                let Some(motion) = motion(&from.joints, &node.joints, STEP) else {
                    continue;
                };
                let cost = from.cost + motion / gone + node.cost * gone;
                if best.is_none_or(|b| cost < b.0) && !blocked(from.way, node.way) {
                    best = Some((cost, i));
                }
            }
        }
        if let Some((cost, i)) = best {
            node.cost = cost;
            steps.push(Step {
                way: node.way,
                before: i as u16,
            });
            kept.push(node);
        }
    }
    (kept, steps)
}

/// The ways that lead to the last one.
fn back(steps: &[Vec<Step>], last: usize) -> Vec<Way> {
    let mut ways = Vec::with_capacity(steps.len());
    let mut at = last;
    for step in steps.iter().rev() {
        let Some(step) = step.get(at) else { break };
        ways.push(step.way);
        at = usize::from(step.before);
    }
    ways.reverse();
    ways
}

impl Places<'_> {
    /// The run with the rotations of the chosen ways, never more than half a turn from one key place to the next.
    fn chosen(&self, rungs: &[f64], ways: &[Way]) -> Chain {
        let mut turns: Vec<(f64, f64)> = Vec::with_capacity(rungs.len());
        for (&length, &(rotation, _)) in rungs.iter().zip(ways) {
            let turn = self.turn(rotation);
            let last = turns.last().map_or(turn, |t| t.1);
            turns.push((length, turn + TAU * ((last - turn) / TAU).round()));
        }
        Chain {
            turns,
            ..self.chain.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use meltpath_numerics::random::Random;

    use super::*;

    fn random_nodes(random: &mut Random) -> Vec<Node> {
        let ways = (0..3).flat_map(|rotation| (0..2).map(move |way| (rotation, way)));
        let node = |way| Node {
            way,
            joints: std::array::from_fn(|_| random.between(0.0, 1.2)),
            cost: random.between(0.0, 0.1),
        };
        ways.map(node).collect()
    }

    /// The least cost over every sequence of ways, by trying all of them.
    fn exhaustive(rungs: &[Vec<Node>]) -> f64 {
        let mut best = f64::INFINITY;
        let all = rungs.iter().fold(1, |n, r| n * r.len());
        for mut index in 0..all {
            let mut cost = 0.0;
            let mut before: Option<&Node> = None;
            for nodes in rungs {
                let node = &nodes[index % nodes.len()];
                index /= nodes.len();
                if let Some(before) = before {
                    let step = motion(&before.joints, &node.joints, STEP).unwrap_or(f64::INFINITY);
                    cost += step / 20.0 + node.cost * 20.0;
                } else {
                    cost += node.cost;
                }
                before = Some(node);
            }
            best = best.min(cost);
        }
        best
    }

    /// With three rotations each is beside each: nothing is left out.
    #[test]
    fn the_least_cost_is_that_of_trying_everything() {
        let mut random = Random::new(7);
        for _ in 0..50 {
            let rungs: Vec<Vec<Node>> = (0..4).map(|_| random_nodes(&mut random)).collect();
            let wanted = exhaustive(&rungs);
            let mut rungs = rungs.into_iter();
            let mut before = rungs.next().unwrap_or_default();
            for nodes in rungs {
                (before, _) = onward(&before, nodes, 20.0, 3, |_, _| false);
            }
            let found = before.iter().map(|n| n.cost).fold(f64::INFINITY, f64::min);
            assert!(
                (found - wanted).abs() < 1e-12 || (found.is_infinite() && wanted.is_infinite())
            );
        }
    }
}
