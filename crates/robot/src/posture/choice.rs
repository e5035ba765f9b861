//! What is free along a program beside the way of the arm: the torch's heading about its wire, track and positioner; and what a place
//! costs for it.

use std::f64::consts::PI;

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

use super::chain::{Chain, turned};
use super::comfort::{MOTION, REACH, discomfort};
use super::task::Task;
use crate::cell::{Arrangement, Cell, External, Holder, Values};

/// A torch that leans so far from straight down costs as much per length as [`MOTION`], rad.
const LEAN: f64 = 0.002;

/// What is chosen at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Choice {
    /// Where the torch looks, about its wire and against the world, rad: a torch that keeps it does not turn while the table does.
    pub(super) heading: f64,
    /// Where track and positioner stand.
    pub(super) external: External,
}

impl Choice {
    /// At a share of the way to another choice.
    pub(super) fn lerp(self, to: Choice, share: f64) -> Choice {
        Choice {
            heading: self.heading + (to.heading - self.heading) * share,
            external: self.external.lerp(to.external, share),
        }
    }
}

/// The part while track and positioner stand somewhere.
#[derive(Clone, Copy)]
pub(super) struct Carried {
    holder: Holder,
    world_from_part: DQuat,
}

impl Carried {
    pub(super) fn at(task: &Task<'_>, external: External) -> Self {
        let values = Values::of(task.values.arm, external);
        let frames = task.cell.frames(&values);
        Carried {
            holder: task.cell.holder_of(&frames),
            // a part that the arm holds is turned by it
            world_from_part: match task.cell.arrangement {
                Arrangement::TorchOnRobot => frames.part.orientation,
                Arrangement::PartOnRobot => DQuat::IDENTITY,
            },
        }
    }

    /// The turn about the wire, rad, at which the torch of a place looks to a heading.
    pub(super) fn turn(&self, tip: Pose, heading: f64) -> f64 {
        heading - heading_of(self.world_from_part * tip.orientation)
    }

    /// Where the flange must be in the arm's base.
    pub(super) fn flange(&self, tip: Pose, heading: f64) -> Pose {
        self.holder
            .base_from_flange(turned(tip, self.turn(tip, heading)))
    }

    /// How far the torch leans from straight down, rad.
    fn lean(&self, tip: Pose) -> f64 {
        let wire = self.world_from_part * tip.orientation * DVec3::Z;
        wire.angle_between(DVec3::NEG_Z)
    }
}

/// How far a torch is turned about its wire from one that stands along the world's x and is laid over the shortest way, rad.
fn heading_of(world_from_tip: DQuat) -> f64 {
    let wire = world_from_tip * DVec3::Z;
    let laid = DQuat::from_rotation_arc(DVec3::NEG_Z, wire) * DVec3::X;
    let x = world_from_tip * DVec3::X;
    laid.cross(x).dot(wire).atan2(laid.dot(x))
}

/// How far the positioner lets the torch of a place lean, rad; nothing to lean where none carries the part.
pub(super) fn lean(task: &Task<'_>, carried: &Carried, tip: Pose) -> f64 {
    let level = task.cell.positioner.is_some();
    if level && task.cell.arrangement == Arrangement::TorchOnRobot {
        carried.lean(tip)
    } else {
        0.0
    }
}

/// What a place costs per length, rad²/mm², where leaning by less than `slack` rad costs nothing.
pub(super) fn cost(cell: &Cell, joints: [f64; 6], lean: f64, slack: f64) -> f64 {
    let lean = MOTION * (lean - slack).max(0.0) / LEAN;
    discomfort(&cell.arm, joints) + lean * lean
}

/// The squares of a step of track and positioner, rad².
pub(super) fn travel(a: External, b: External) -> f64 {
    let weight = [REACH, 1.0, 1.0];
    let step = |i: usize| (b.0[i] - a.0[i]) / weight[i];
    (0..3).map(|i| step(i) * step(i)).sum()
}

/// A choice with joints of the arm that hold it, at a length of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Held {
    pub(super) length: f64,
    pub(super) choice: Choice,
    pub(super) joints: [f64; 6],
}

/// Greatest distance of places that are looked at between two, mm.
const NEAR: f64 = 5.0;
/// Greatest step of a joint between them, rad.
const JUMP: f64 = 0.35;

/// Goes from a place to a choice at another length in step with the path, the joints always the nearest continuation within limits.
/// Where they are at each of `stops` and at the end; nothing where they cannot go on.
pub(super) fn go(
    task: &Task<'_>,
    chain: &Chain,
    from: &Held,
    (end, to): (f64, Choice),
    stops: &[f64],
) -> Option<Vec<Held>> {
    let mut found = Vec::with_capacity(stops.len() + 1);
    let mut here = *from;
    for stop in stops.iter().copied().chain([end]) {
        let way = stop - here.length;
        let pieces = (way / NEAR).ceil().max(1.0) as u32;
        let begin = here.length;
        for piece in 1..=pieces {
            let length = begin + way * f64::from(piece) / f64::from(pieces);
            let choice = from
                .choice
                .lerp(to, (length - from.length) / (end - from.length));
            let (tip, _) = chain.at(length);
            let flange = Carried::at(task, choice.external).flange(tip, choice.heading);
            let joints = task.cell.arm.nearest(flange, &here.joints).ok()?;
            let jump = (0..6).any(|i| (joints[i] - here.joints[i]).abs() > JUMP);
            if jump || task.cell.arm.margin(joints).0 < 0.0 {
                return None;
            }
            here = Held {
                length,
                choice,
                joints,
            };
        }
        found.push(here);
    }
    Some(found)
}

/// The heading nearest to another, rad: whole turns away it is the same.
pub(super) fn unwound(heading: f64, near: f64) -> f64 {
    heading + 2.0 * PI * ((near - heading) / (2.0 * PI)).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A torch turned about its wire looks as much farther, however it leans.
    #[test]
    fn headings_count_turns_about_the_wire() {
        for (w, p, r) in [(PI, 0.0, 0.3), (2.5, 0.4, -1.0), (-2.8, 0.9, 2.0)] {
            let tip = Pose::from_wpr(DVec3::ZERO, DVec3::new(w, p, r));
            let first = heading_of(tip.orientation);
            for turn in [0.1, 1.0, -2.0] {
                let found = heading_of(turned(tip, turn).orientation) - first;
                assert!((unwound(found, turn) - turn).abs() < 1e-9, "{found} {turn}");
            }
        }
    }
}
