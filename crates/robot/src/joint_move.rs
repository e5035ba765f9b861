//! Joint moves: every axis of arm, track and positioner goes evenly, all of them together, from where it stands to where it ends, and the
//! wire's tip is where the forward chain has it. The time is that of the slowest axis.
//!
//! Assumption: the controller moves all axes in step, external ones too (synchronous point to point: FANUC J, KUKA PTP, ABB MoveJ, Yaskawa
//! MOVJ, Stäubli movej, Universal Robots movej). No joint log of any of them has been held against it. Axes that run asynchronously, or a
//! positioner that is told apart, end at the same place by another way.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use crate::cell::{Cell, Values};
use crate::collision::motion::Reach;
use crate::command::Course;

/// The wire's tip leaves the chords that stand for its way by no more, mm.
pub const CHORD: f64 = 0.05;
/// The tool's turn leaves an even one along a chord by no more, rad.
pub const TURN: f64 = 1e-3;
/// Ways shorter than this are none, mm.
const NOTHING: f64 = 1e-6;
/// Share of a move on whose chord its direction is taken.
const BESIDE: f64 = 1e-4;

/// A joint move whose ends are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMove {
    /// The command.
    pub command: u32,
    /// Where every axis stands at begin and end.
    pub ends: [Values; 2],
}

/// The way of the wire's tip along a joint move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipWay {
    /// Its length, mm.
    pub length: f64,
    /// How far the tool turns, rad.
    pub turn: f64,
    /// How far it leaves the straight line between its ends, mm.
    pub bow: f64,
    /// Where it leaves it farthest, mm, part frame.
    pub farthest: DVec3,
}

impl JointMove {
    /// Where every axis stands at a share of the move.
    pub fn at(&self, share: f64) -> Values {
        let [from, to] = &self.ends;
        let arm = std::array::from_fn(|i| from.arm[i] + (to.arm[i] - from.arm[i]) * share);
        Values::of(arm, from.external().lerp(to.external(), share))
    }

    /// The wire's tip in the part at a share of the move.
    pub fn tip(&self, cell: &Cell, share: f64) -> Pose {
        cell.frames(&self.at(share)).part_from_wire_tip()
    }

    /// Places evenly along the move, the end as the last, between which the tip leaves its chords by [`CHORD`] and the tool's turn an even
    /// one by [`TURN`] at most: proven by the levers of the chain, not sampled.
    pub fn places(&self, cell: &Cell) -> impl Iterator<Item = Values> + use<'_> {
        let [bend, turn] = Reach::tip(cell, self.ends);
        // both fall with the square of the step
        let pieces = (bend / CHORD).max(turn / TURN).sqrt().ceil().max(1.0);
        let pieces = pieces as u32;
        (1..=pieces).map(move |i| self.at(f64::from(i) / f64::from(pieces)))
    }

    /// The way of the wire's tip.
    pub fn tip_way(&self, cell: &Cell) -> TipWay {
        let begin = self.tip(cell, 0.0);
        let chord = self.tip(cell, 1.0).position - begin.position;
        let mut way = TipWay {
            length: 0.0,
            turn: 0.0,
            bow: 0.0,
            farthest: begin.position,
        };
        let mut before = begin;
        for values in self.places(cell) {
            let tip = cell.frames(&values).part_from_wire_tip();
            way.length += before.position.distance(tip.position);
            way.turn += before.orientation.angle_between(tip.orientation);
            let out = tip.position - begin.position;
            let share =
                (out.dot(chord) / chord.length_squared().max(NOTHING * NOTHING)).clamp(0.0, 1.0);
            let bow = out.distance(chord * share);
            if bow > way.bow {
                (way.bow, way.farthest) = (bow, tip.position);
            }
            before = tip;
        }
        way
    }

    /// The move as its controller's interpolation asks for it: its axes move for `time` s.
    pub fn course(&self, cell: &Cell, way: &TipWay, time: f64) -> Course {
        let place = |share: f64| self.tip(cell, share).position;
        let along = |from: f64, to: f64| (place(to) - place(from)).normalize_or_zero();
        Course {
            time,
            length: if way.length > NOTHING {
                way.length
            } else {
                0.0
            },
            directions: [along(0.0, BESIDE), along(1.0 - BESIDE, 1.0)],
        }
    }
}
