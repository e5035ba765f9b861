//! Goes along a held program and finds how near each pair of bodies comes, between the places too.
//!
//! At places distances are exact; between two of them they are bounded ([`Gone::least`]). Where that bound leaves open whether a pair comes
//! nearer than is of interest the stretch is halved, at the place where the controller passes, until it does not.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::bodies::{Bar, Body, bars, beside_links};
use super::distance::Bounds;
use super::metal::Metal;
use super::motion::{BodiesGone, Gone, Reach};
use super::pairs::Pairs;
use super::rooms::Rooms;
use super::round::BESIDE;
use super::surroundings::{Surroundings, foot, table, to_table};
use crate::cell::{Cell, Shapes, Values};
use crate::posture::{Follower, Held, NotHeld, Place, Stretch, Task};

/// How often a stretch is halved at most: a step of 40 mm becomes one of a thousandth of a millimetre.
const HALVINGS: u32 = 16;

/// What is farther by this is so by more than rounding, mm.
const ROUNDING: f64 = 1e-3;

/// Greatest step of a joint between places of a joint move, rad, and of the track, mm.
const JOINT_STEP: f64 = 0.01;
const TRACK_STEP: f64 = 10.0;

/// What is wanted of a way.
pub(super) trait Look {
    /// Goes on to the stretch between two lengths of a run, while a command is executed, the wire's tip at a place of the part.
    fn next(&mut self, run: usize, lengths: [f64; 2], command: u32, tip: DVec3);
    /// Distances of a pair that are no less are of no interest, mm.
    fn below(&self, bodies: [Body; 2]) -> f64;
    /// Whether a pair between whose bounds its least distance lies need not be looked at more finely.
    fn settled(&self, bodies: [Body; 2], between: [f64; 2]) -> bool;
    /// A pair is no nearer than this on the stretch, mm, which is below what is of interest.
    fn tell(&mut self, bodies: [Body; 2], distance: f64);
}

/// What a bar may come near to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Other {
    Metal,
    Table,
    /// Another bar, by its number.
    Bar(usize),
}

/// Two that come near each other on a stretch, and how near they are at its ends, mm.
#[derive(Debug, Clone, Copy)]
struct Pair {
    one: usize,
    other: Other,
    distances: [f64; 2],
}

/// Where everything is.
struct At<'a> {
    place: Place,
    bars: Vec<Bar<'a>>,
}

/// What does not change on the way.
struct Scene<'a> {
    cell: &'a Cell,
    shapes: &'a Shapes,
    pairs: Pairs,
    reach: Reach,
    table: Option<(Pose, Bounds)>,
    /// How far down metal goes, mm.
    foot: f64,
}

/// Shows all pairs of bodies to `look`, along all of a program.
///
/// # Errors
/// [`NotHeld`], where the program is not held after all.
pub(super) fn pass<'a>(
    task: &'a Task<'_>,
    held: &Held,
    around: &'a Surroundings<'_>,
    look: &mut impl Look,
) -> Result<(), NotHeld> {
    let scene = Scene {
        cell: task.cell,
        shapes: around.shapes,
        pairs: around.pairs,
        reach: Reach::of(
            task.cell,
            BESIDE * around.shapes.nozzle[1],
            beside_links(task.cell, around.shapes),
        ),
        table: table(task.cell, around),
        foot: foot(task.cell, around),
    };
    let mut rooms = Rooms::default();
    let mut before: Option<At<'_>> = None;
    for (run, chain) in held.chains.iter().enumerate() {
        let mut follower = Follower::new(task, chain);
        let mut last = 0.0;
        while let Some(sample) = follower.next_sample()? {
            let place = Place {
                tip: sample.tip,
                joints: sample.joints,
                external: sample.external,
            };
            let metal = (around.metal)(sample.command);
            let lengths = [last, sample.length];
            let mut go = |stretch: &Stretch<'_>, before: &mut Option<At<'a>>| {
                let tip = stretch.ends[1].tip.position;
                look.next(run, lengths, sample.command, tip);
                let now = scene.at(stretch.ends[1]);
                let from = before.take().unwrap_or_else(|| scene.at(stretch.ends[0]));
                scene.stretch(stretch, [&from, &now], metal, &mut rooms, look);
                *before = Some(now);
            };
            match (follower.gone(), before.as_ref().map(|at| at.place)) {
                (Some(stretch), _) => go(&stretch, &mut before),
                (None, Some(from)) => {
                    for stretch in joint_move(task, from, place) {
                        go(&stretch, &mut before);
                    }
                }
                // a stretch of no length: what is near at the start
                (None, None) => go(&Stretch::of_joints(task, [place; 2]), &mut before),
            }
            last = sample.length;
        }
    }
    Ok(())
}

/// A move in the joints, in pieces.
fn joint_move<'a>(task: &'a Task<'a>, from: Place, to: Place) -> Vec<Stretch<'a>> {
    let turned = (0..6).map(|i| (to.joints[i] - from.joints[i]).abs() / JOINT_STEP);
    let carried = (0..3).map(|i| {
        let step = if i == 0 { TRACK_STEP } else { JOINT_STEP };
        (to.external.0[i] - from.external.0[i]).abs() / step
    });
    let steps = turned.chain(carried).fold(0.0, f64::max);
    let mut pieces = vec![Stretch::of_joints(task, [from, to])];
    while (pieces.len() as f64) < steps {
        let halves = pieces
            .iter()
            .map(|p| p.halves().map_or(vec![*p], Vec::from));
        pieces = halves.flatten().collect();
    }
    pieces
}

impl<'a> Scene<'a> {
    fn at(&self, place: Place) -> At<'a> {
        let values = Values::of(place.joints, place.external);
        At {
            place,
            bars: bars(self.cell, self.shapes, &values),
        }
    }

    /// One step of the way: what may be near on it is looked at more finely.
    fn stretch<'m>(
        &self,
        stretch: &Stretch<'_>,
        [before, now]: [&At<'_>; 2],
        metal: &'m Metal,
        rooms: &mut Rooms<'m>,
        look: &mut impl Look,
    ) {
        let motion = self.reach.motion(stretch, &before.bars, &now.bars);
        rooms.of(metal, now.bars.len());
        let mut near = Vec::new();
        let (a, b) = (&before.bars, &now.bars);
        let mut add = |one: usize, other: Other, distances: [f64; 2], look: &mut _| {
            let pair = Pair {
                one,
                other,
                distances,
            };
            near.extend(open(&pair, a, &motion, look).then_some(pair));
        };
        for i in 0..b.len() {
            let may = |other: Body| self.pairs.may_touch(b[i].body, other);
            let gone = motion.in_part[i];
            if may(Body::Metal) {
                let below = look.below([b[i].body, Body::Metal]);
                let to =
                    |at: &[Bar<'_>], most: f64| metal.distance(&at[i].in_part, most, self.foot);
                let found = rooms.metal[i]
                    .looked(gone, below, |now, most| to(if now { b } else { a }, most));
                if let Some(distances) = found {
                    add(i, Other::Metal, distances, look);
                }
            }
            if let Some(table) = self.table.as_ref().filter(|_| may(Body::Table)) {
                let below = look.below([b[i].body, Body::Table]);
                let found = rooms.table[i].looked(gone, below, |now, most| {
                    to_table(table, &if now { b[i] } else { a[i] }.in_part, most)
                });
                if let Some(distances) = found {
                    add(i, Other::Table, distances, look);
                }
            }
            for j in 0..b.len() {
                if b[j].body > b[i].body && may(b[j].body) {
                    // what is farther keeps farther on all of the stretch
                    let most = look.below([b[i].body, b[j].body])
                        + Gone::room(&[motion.in_base[i], motion.in_base[j]])
                        + ROUNDING;
                    let distances = [a, b].map(|at| at[i].in_base.apart(&at[j].in_base, most));
                    add(i, Other::Bar(j), distances, look);
                }
            }
        }
        if !near.is_empty() {
            self.halve(stretch, ([before, now], metal), &near, HALVINGS, look);
        }
    }

    /// Looks at both halves of a stretch on which pairs may be near.
    fn halve(
        &self,
        stretch: &Stretch<'_>,
        (ends, metal): ([&At<'_>; 2], &Metal),
        near: &[Pair],
        left: u32,
        look: &mut impl Look,
    ) {
        // where it cannot be held between its ends nothing is known but the bound
        let (Ok(halves), true) = (stretch.halves(), left > 0) else {
            let [a, b] = ends.map(|at| &at.bars);
            let motion = self.reach.motion(stretch, a, b);
            for pair in near {
                look.tell(pair.bodies(a), pair.least(&motion));
            }
            return;
        };
        let middle = self.at(halves[0].ends[1]);
        let distances: Vec<f64> = near
            .iter()
            .map(|pair| self.distance(pair, &middle, metal))
            .collect();
        let pieces = [[ends[0], &middle], [&middle, ends[1]]];
        for (half, (piece, ends)) in halves.iter().zip(pieces).enumerate() {
            let [a, b] = ends.map(|at| &at.bars);
            let motion = self.reach.motion(piece, a, b);
            let mut still = Vec::new();
            for (pair, middle) in near.iter().zip(&distances) {
                let mut pair = *pair;
                pair.distances[1 - half] = *middle;
                still.extend(open(&pair, a, &motion, look).then_some(pair));
            }
            if !still.is_empty() {
                self.halve(piece, (ends, metal), &still, left - 1, look);
            }
        }
    }

    fn distance(&self, pair: &Pair, at: &At<'_>, metal: &Metal) -> f64 {
        let one = &at.bars[pair.one];
        match (pair.other, &self.table) {
            (Other::Metal, _) => metal.distance(&one.in_part, f64::MAX, self.foot),
            (Other::Table, Some(table)) => to_table(table, &one.in_part, f64::INFINITY),
            (Other::Table, None) => f64::INFINITY,
            (Other::Bar(j), _) => one.in_base.apart(&at.bars[j].in_base, f64::INFINITY),
        }
    }
}

/// Whether a pair must be looked at more finely on a stretch; else what is of interest was told.
fn open(pair: &Pair, bars: &[Bar<'_>], motion: &BodiesGone, look: &mut impl Look) -> bool {
    let bodies = pair.bodies(bars);
    let least = pair.least(motion);
    if least >= look.below(bodies) {
        return false;
    }
    let [a, b] = pair.distances;
    if look.settled(bodies, [least, a.min(b)]) {
        look.tell(bodies, least);
        return false;
    }
    true
}

impl Pair {
    fn bodies(&self, bars: &[Bar<'_>]) -> [Body; 2] {
        let other = match self.other {
            Other::Metal => Body::Metal,
            Other::Table => Body::Table,
            Other::Bar(j) => bars[j].body,
        };
        [bars[self.one].body, other]
    }

    /// No more than its least distance on a stretch, mm.
    fn least(&self, motion: &BodiesGone) -> f64 {
        match self.other {
            Other::Metal | Other::Table => Gone::least(self.distances, &[motion.in_part[self.one]]),
            Other::Bar(j) => {
                let gone = [motion.in_base[self.one], motion.in_base[j]];
                Gone::least(self.distances, &gone)
            }
        }
    }
}
