//! A way of the whole cell along a run, chosen wide: coarse values of the torch's heading, track and positioner, and all ways of the arm
//! to hold them, at key places far apart. Dynamic programming over the best of them (a beam), which is cut by cost and by place.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use meltpath_base::Observer;
use meltpath_geometry::Pose;
use rayon::prelude::*;

use super::chain::Chain;
use super::choice::{self, Carried, Choice, Held, cost, lean};
use super::comfort::{is_wound, motion, step_over};
use super::grid::{Cube, Grid, LONG};
use super::joint_move::{cost_of, least_room};
use super::ladder::milder;
use super::task::{Guard, Near, NotHeld, Task, Why, guard_places, keep_clear};
use crate::cell::Values;

/// Headings about the wire.
pub(super) const HEADINGS: u8 = 12;
/// Leaning within the steps costs nothing, rad.
pub(super) const SLACK: f64 = 0.7 * TAU / 18.0;
/// Places that lean so much more than the best are not tried, rad.
const LEANING: f64 = 0.35;
/// How many ways are asked for their room at once.
const ASKED: usize = 128;
/// Starts far from rest cost this much per square: only where nothing else decides.
const REST: f64 = 1e-9;

/// What a joint move in the air costs beside its way, rad²/mm: as much as leaning by some 10° more than costs nothing along 15 mm of bead.
const OVER: f64 = 0.1;

/// How many ways are kept at a key place: at one place of the axes, and in all.
#[derive(Clone, Copy)]
struct Beam {
    at_cell: usize,
    all: usize,
}

const BEAM: Beam = Beam {
    at_cell: 4,
    all: 400,
};
const WIDER: Beam = Beam {
    at_cell: 32,
    all: 8000,
};

/// A way that is kept at a key place.
#[derive(Clone, Copy)]
struct Kept {
    cube: Cube,
    heading: u8,
    /// Seven digits are enough to go on from.
    joints: [f32; 6],
    /// Cost of all before it and itself.
    total: f64,
    before: u16,
    /// Whether a joint move leads here from the way before.
    over: bool,
}

impl Kept {
    fn of(node: &Node) -> Kept {
        Kept {
            cube: node.cube,
            heading: node.heading,
            joints: node.joints.map(|j| j as f32),
            total: node.cost,
            before: 0,
            over: false,
        }
    }

    fn joints(&self) -> [f64; 6] {
        self.joints.map(f64::from)
    }
}

/// A way at a key place, not yet led to.
struct Node {
    cube: Cube,
    heading: u8,
    joints: [f64; 6],
    cost: f64,
}

/// One of the ways before, and how track and positioner move from it, rad².
struct From {
    i: usize,
    joints: [f64; 6],
    moved: f64,
}

/// A heading and those beside it; more where the way between is long.
fn headings_beside(heading: u8, gone: f64) -> impl Iterator<Item = u8> {
    let most = if gone < LONG { 1 } else { 2 };
    (HEADINGS - most..=HEADINGS + most).map(move |d| (heading + d) % HEADINGS)
}

fn angle(heading: u8) -> f64 {
    TAU * f64::from(heading) / f64::from(HEADINGS)
}

/// A search along a run, which is taken up again where places have become narrower.
pub(super) struct Wide<'a> {
    task: &'a Task<'a>,
    chain: &'a Chain,
    /// Lengths of the key places.
    lengths: Vec<f64>,
    grid: Grid,
    beam: Beam,
    layers: Vec<Vec<Kept>>,
    /// Key places to which every step is followed before it is taken.
    followed: BTreeSet<usize>,
    /// Key places at which nothing may touch, and how much more room is asked for there, mm.
    guarded: BTreeMap<usize, f64>,
    guard: Option<Guard<'a>>,
    /// Where every axis stands before a joint move leads to the begin.
    from: Option<Values>,
    /// Key places to which a joint move may lead from the one before.
    over: BTreeSet<usize>,
}

impl<'a> Wide<'a> {
    pub(super) fn new(
        task: &'a Task<'a>,
        chain: &'a Chain,
        lengths: Vec<f64>,
        guard: Option<Guard<'a>>,
    ) -> Self {
        Wide {
            task,
            chain,
            lengths,
            grid: Grid::of(task.cell, task.values.external()),
            beam: BEAM,
            layers: Vec::new(),
            followed: BTreeSet::new(),
            guarded: BTreeMap::new(),
            guard,
            from: None,
            over: BTreeSet::new(),
        }
    }

    /// The best way where joint moves may lead to some key places, and those to which one leads.
    ///
    /// # Errors
    /// [`NotHeld`] at the first key place that no way leads to.
    pub(super) fn joint_moves(
        &mut self,
        may: BTreeSet<usize>,
        observer: &dyn Observer,
    ) -> Result<(Vec<Held>, Vec<usize>), NotHeld> {
        self.over = may;
        self.layers.clear();
        let ways = self.climb(observer)?;
        let kept = self.back_from_best();
        let over = kept.iter().enumerate().filter(|(_, kept)| kept.over);
        Ok((ways, over.map(|(place, _)| place).collect()))
    }

    /// A joint move leads to the begin from where every axis stands, if from anywhere.
    pub(super) fn begin_from(&mut self, from: Option<Values>) {
        if self.from != from {
            self.from = from;
            self.layers.clear();
        }
    }

    /// Follows every step to a key place from now on; whether that is new.
    pub(super) fn follow(&mut self, place: usize) -> bool {
        self.layers.truncate(place);
        self.followed.insert(place)
    }

    /// Lets nothing touch at key places: see [`guard_places`].
    pub(super) fn guard(&mut self, near: Near) -> bool {
        let first = guard_places(&mut self.guarded, &self.lengths, near);
        if let Some(first) = first {
            self.layers.truncate(first);
        }
        first.is_some()
    }

    /// The best way at every key place.
    ///
    /// # Errors
    /// [`NotHeld`] at the first key place that no way leads to.
    pub(super) fn climb(&mut self, observer: &dyn Observer) -> Result<Vec<Held>, NotHeld> {
        loop {
            match self.climbed(observer) {
                Err(not) if self.beam.all == BEAM.all && not.why != Why::Stopped => {
                    // what was cut may have led on
                    self.beam = WIDER;
                    self.layers.clear();
                }
                done => return done,
            }
        }
    }

    fn climbed(&mut self, observer: &dyn Observer) -> Result<Vec<Held>, NotHeld> {
        for place in self.layers.len()..self.lengths.len() {
            let not_held = |why| NotHeld {
                command: self.chain.command_at(self.lengths[place]),
                position: self.chain.at(self.lengths[place]).0.position,
                why,
            };
            if observer.cancelled() {
                return Err(not_held(Why::Stopped));
            }
            let layer = self.layer(place).map_err(not_held)?;
            self.layers.push(layer);
        }
        Ok(self.back())
    }

    /// The ways that lead to the best one at the end.
    fn back_from_best(&self) -> Vec<Kept> {
        let last = self.layers.last().map_or(&[][..], |l| &l[..]);
        let best = last.iter().enumerate();
        let best = best.min_by(|a, b| a.1.total.total_cmp(&b.1.total));
        let mut at = best.map_or(0, |(i, _)| i);
        let mut ways = Vec::with_capacity(self.layers.len());
        for layer in self.layers.iter().rev() {
            let Some(kept) = layer.get(at) else { break };
            ways.push(*kept);
            at = usize::from(kept.before);
        }
        ways.reverse();
        ways
    }

    /// The same, each with its length.
    fn back(&self) -> Vec<Held> {
        let kept = self.back_from_best();
        let held = kept.iter().zip(&self.lengths);
        let mut ways: Vec<Held> = held.map(|(k, length)| self.held(k, *length)).collect();
        for i in 1..ways.len() {
            let before = ways[i - 1].choice.heading;
            ways[i].choice.heading = choice::unwound(ways[i].choice.heading, before);
        }
        ways
    }

    fn held(&self, kept: &Kept, length: f64) -> Held {
        Held {
            length,
            choice: Choice {
                heading: angle(kept.heading),
                external: self.grid.value(kept.cube),
            },
            joints: kept.joints(),
        }
    }

    /// The best ways at a key place with what leads to them.
    fn layer(&self, place: usize) -> Result<Vec<Kept>, Why> {
        let length = self.lengths[place];
        let (tip, _) = self.chain.at(length);
        let before = place.checked_sub(1).map(|i| &self.layers[i][..]);
        let gone = length - place.checked_sub(1).map_or(0.0, |i| self.lengths[i]);
        let over = self.over.contains(&place);
        let nodes = self.nodes(tip, self.tried(before.filter(|_| !over), gone))?;
        let Some(before) = before else {
            let begun = nodes.iter().map(|n| self.begun(n)).collect();
            return Ok(self.cut(place, begun));
        };
        let of_cubes: Vec<&[Node]> = nodes.chunk_by(|a, b| a.cube == b.cube).collect();
        let led: Vec<Vec<Kept>> = of_cubes
            .par_iter()
            .map(|nodes| {
                let from = self.beside(nodes[0].cube, before, gone);
                let led = nodes.iter().map(|n| {
                    let led = self.led(n, before, &from, (place, gone));
                    let over = over.then(|| self.gone_over(n, before)).flatten();
                    let cheapest = |a: &Kept, b: &Kept| a.total.total_cmp(&b.total);
                    led.into_iter().chain(over).min_by(cheapest)
                });
                led.flatten().collect()
            })
            .collect();
        let kept = self.cut(place, led.into_iter().flatten().collect());
        if kept.is_empty() {
            return Err(Why::Change);
        }
        Ok(kept)
    }

    /// Headings to try at places of the axes: everything at the begin, then what lies beside the ways before.
    fn tried(
        &self,
        before: Option<&[Kept]>,
        gone: f64,
    ) -> BTreeMap<Cube, [bool; HEADINGS as usize]> {
        let Some(before) = before else {
            let all = self.grid.all().into_iter();
            return all.map(|c| (c, [true; HEADINGS as usize])).collect();
        };
        let mut tried = BTreeMap::new();
        for of_cube in before.chunk_by(|a, b| a.cube == b.cube) {
            let mut headings = [false; HEADINGS as usize];
            for kept in of_cube {
                for h in headings_beside(kept.heading, gone) {
                    headings[usize::from(h)] = true;
                }
            }
            let first = of_cube.first().map(|k| k.cube);
            for cube in first.into_iter().flat_map(|c| self.grid.beside(c, gone)) {
                let known = tried.entry(cube).or_insert([false; HEADINGS as usize]);
                known.iter_mut().zip(headings).for_each(|(k, h)| *k |= h);
            }
        }
        tried
    }

    /// The ways at a key place, in order of their cubes.
    fn nodes(
        &self,
        tip: Pose,
        tried: BTreeMap<Cube, [bool; HEADINGS as usize]>,
    ) -> Result<Vec<Node>, Why> {
        let carried: Vec<_> = tried
            .into_par_iter()
            .map(|(cube, headings)| {
                let carried = Carried::at(self.task, self.grid.value(cube));
                (cube, headings, carried, lean(self.task, &carried, tip))
            })
            .collect();
        let least = carried.iter().map(|c| c.3).fold(f64::INFINITY, f64::min);
        let most = if self.beam.all == BEAM.all {
            least + LEANING
        } else {
            f64::INFINITY
        };
        let found: Vec<Result<Vec<Node>, Why>> = carried
            .into_par_iter()
            .filter(|c| c.3 <= most)
            .map(|(cube, headings, carried, lean)| {
                let headings = (0..HEADINGS).filter(|h| headings[usize::from(*h)]);
                self.at_cube(tip, (cube, &carried, lean), headings)
            })
            .collect();
        let mut nodes = Vec::new();
        let mut why: Option<Why> = None;
        for found in found {
            match found {
                Ok(found) => nodes.extend(found),
                Err(new) => why = Some(why.map_or(new, |old| milder(old, new))),
            }
        }
        if nodes.is_empty() {
            return Err(why.unwrap_or(Why::Change));
        }
        Ok(nodes)
    }

    /// The ways at a place of the axes; where there is none, why.
    fn at_cube(
        &self,
        tip: Pose,
        (cube, carried, lean): (Cube, &Carried, f64),
        headings: impl Iterator<Item = u8>,
    ) -> Result<Vec<Node>, Why> {
        let cell = self.task.cell;
        let mut nodes = Vec::new();
        let mut why = Why::Change;
        let mut milder_of = |new: Why| {
            why = if why == Why::Change {
                new
            } else {
                milder(why, new)
            }
        };
        for heading in headings {
            let found = match cell.arm.inverse(carried.flange(tip, angle(heading))) {
                Ok(found) => found.solutions,
                Err(no) => {
                    milder_of(Why::Unreachable(no));
                    continue;
                }
            };
            for solution in found {
                if solution.margin < 0.0 {
                    milder_of(Why::Limit {
                        joint: solution.tightest,
                        by: -solution.margin,
                    });
                    continue;
                }
                for joints in cell.arm.turns(solution.angles) {
                    if is_wound(&cell.arm, &joints) {
                        continue;
                    }
                    nodes.push(Node {
                        cube,
                        heading,
                        joints,
                        cost: cost(cell, joints, lean, SLACK),
                    });
                }
            }
        }
        if nodes.is_empty() {
            Err(why)
        } else {
            Ok(nodes)
        }
    }

    /// A way at the begin: near where the axes stand before, or else near where they rest.
    fn begun(&self, node: &Node) -> Kept {
        let external = self.grid.value(node.cube);
        let gone = match &self.from {
            Some(from) => cost_of(from, &Values::of(node.joints, external)),
            None => REST * choice::travel(self.grid.rest, external),
        };
        Kept {
            total: node.cost + gone,
            ..Kept::of(node)
        }
    }

    /// The ways before that a step of track and positioner leads to a place of theirs, by their headings.
    fn beside(&self, cube: Cube, before: &[Kept], gone: f64) -> [Vec<From>; HEADINGS as usize] {
        let external = self.grid.value(cube);
        let mut found = [const { Vec::new() }; HEADINGS as usize];
        for beside in self.grid.beside(cube, gone) {
            let first = before.partition_point(|k| k.cube < beside);
            let moved = choice::travel(self.grid.value(beside), external);
            let of_cube = before[first..].iter().take_while(|k| k.cube == beside);
            for (kept, i) in of_cube.zip(first..) {
                found[usize::from(kept.heading)].push(From {
                    i,
                    joints: kept.joints(),
                    moved,
                });
            }
        }
        found
    }

    /// A way with the best of those before that lead to it.
    fn led(
        &self,
        node: &Node,
        before: &[Kept],
        from: &[Vec<From>; HEADINGS as usize],
        (place, gone): (usize, f64),
    ) -> Option<Kept> {
        let turned = headings_beside(node.heading, gone).flat_map(|h| &from[usize::from(h)]);
        let found = turned.filter_map(|f| {
            let motion = motion(&f.joints, &node.joints, step_over(gone))?;
            let total = before[f.i].total + (motion + f.moved) / gone + node.cost * gone;
            Some((total, f.i))
        });
        let cheaper = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let best = if self.followed.contains(&place) {
            let mut found: Vec<_> = found.collect();
            found.sort_by(cheaper);
            found
                .into_iter()
                .find(|(_, i)| self.leads(&before[*i], node, place))
        } else {
            found.min_by(cheaper)
        };
        best.map(|(total, i)| Kept {
            total,
            before: i as u16,
            ..Kept::of(node)
        })
    }

    /// A way with the best of those before from which a joint move leads to it.
    fn gone_over(&self, node: &Node, before: &[Kept]) -> Option<Kept> {
        let stands = |joints, cube| Values::of(joints, self.grid.value(cube));
        let to = stands(node.joints, node.cube);
        let totals = before
            .iter()
            .map(|k| k.total + cost_of(&stands(k.joints(), k.cube), &to));
        let best = totals.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(i, total)| Kept {
            total: total + node.cost + OVER,
            before: i as u16,
            over: true,
            ..Kept::of(node)
        })
    }

    /// Whether joints that follow the path go from a way to the next.
    fn leads(&self, from: &Kept, to: &Node, place: usize) -> bool {
        let from = self.held(from, self.lengths[place - 1]);
        let choice = Choice {
            heading: choice::unwound(angle(to.heading), from.choice.heading),
            external: self.grid.value(to.cube),
        };
        let end = (self.lengths[place], choice);
        let found = choice::go(self.task, self.chain, &from, end, &[]);
        let found = found.and_then(|f| f.last().copied());
        found.is_some_and(|f| is_same(&f.joints, &to.joints))
    }

    /// The best ways at a key place, in order of their cubes: some at each place of the axes, so many in all, and only such as touch nothing where
    /// it is guarded, and on a joint move to the begin; where all of them do, those that have most room.
    fn cut(&self, place: usize, mut ways: Vec<Kept>) -> Vec<Kept> {
        let order = |k: &Kept| (k.cube, k.heading);
        ways.sort_by(|a, b| a.total.total_cmp(&b.total).then(order(a).cmp(&order(b))));
        let from = self.from.filter(|_| place == 0);
        let more = self.guarded.get(&place).copied();
        let more = more.or(from.map(|_| 0.0));
        let mut kept = if let Some((guard, more)) = self.guard.zip(more) {
            let command = self.chain.command_at(self.lengths[place]);
            let room = |k: &Kept| {
                let values = Values::of(k.joints(), self.grid.value(k.cube));
                let here = guard(command, &values, more);
                match &from {
                    Some(from) if here >= 0.0 => least_room(from, &values, (guard, command)),
                    _ => here,
                }
            };
            self.cut_clear(ways, room)
        } else {
            let mut count = BTreeMap::new();
            ways.retain(|k| self.takes(&mut count, k.cube));
            ways.truncate(self.beam.all);
            ways
        };
        kept.sort_by(|a, b| order(a).cmp(&order(b)).then(a.total.total_cmp(&b.total)));
        kept
    }

    /// Whether one more is kept at a place of the axes.
    fn takes(&self, count: &mut BTreeMap<Cube, usize>, cube: Cube) -> bool {
        let at_cube = count.entry(cube).or_insert(0);
        *at_cube += 1;
        *at_cube <= self.beam.at_cell
    }

    /// The best of `ways`, which stand in order, that have room; only so many are asked for it as are needed.
    fn cut_clear(
        &self,
        mut ways: Vec<Kept>,
        room: impl Fn(&Kept) -> f64 + Send + Sync,
    ) -> Vec<Kept> {
        let mut count = BTreeMap::new();
        let mut kept = Vec::new();
        for some in ways.chunks(ASKED) {
            let full = |k: &&Kept| count.get(&k.cube).is_none_or(|n| *n < self.beam.at_cell);
            let open: Vec<&Kept> = some.iter().filter(full).collect();
            let rooms: Vec<f64> = open.par_iter().map(|k| room(k)).collect();
            for (k, room) in open.into_iter().zip(rooms) {
                if room >= 0.0 && self.takes(&mut count, k.cube) {
                    kept.push(*k);
                }
            }
            if kept.len() >= self.beam.all {
                kept.truncate(self.beam.all);
                break;
            }
        }
        if kept.is_empty() {
            keep_clear(&mut ways, room);
            let mut count = BTreeMap::new();
            ways.retain(|k| self.takes(&mut count, k.cube));
            ways.truncate(self.beam.all);
            return ways;
        }
        kept
    }
}

/// Whether joints that were followed are those of a way, which has seven digits.
pub(super) fn is_same(a: &[f64; 6], b: &[f64; 6]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-2)
}
