//! A short piece of a way: its two ends, and the place half-way between them as the controller passes it.

use meltpath_geometry::Pose;

use super::chain::{Chain, Leg, turned};
use super::task::{Task, Why};
use crate::cell::{External, Values};

/// Where the arm, track and positioner stand at a place of a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The wire's tip in the part, turned as chosen.
    pub tip: Pose,
    /// Joint angles, rad.
    pub joints: [f64; 6],
    /// Where track and positioner stand.
    pub external: External,
}

/// A piece of a way between two places.
#[derive(Debug, Clone, Copy)]
pub struct Stretch<'a> {
    task: &'a Task<'a>,
    course: Course<'a>,
    /// Where it begins and ends.
    pub ends: [Place; 2],
    /// How far a joint may bend away from the straight step between the ends, rad.
    pub bend: f64,
}

/// What leads from one end to the other.
#[derive(Debug, Clone, Copy)]
enum Course<'a> {
    /// The wire's tip goes along a move, between two shares of it.
    Move(&'a Chain, &'a Leg, [f64; 2]),
    /// Every joint goes evenly.
    Joints,
}

impl<'a> Stretch<'a> {
    /// Along a move between two shares of it.
    pub(super) fn of_move(
        task: &'a Task<'a>,
        (chain, leg, shares): (&'a Chain, &'a Leg, [f64; 2]),
        ends: [Place; 2],
        bend: f64,
    ) -> Self {
        Stretch {
            task,
            course: Course::Move(chain, leg, shares),
            ends,
            bend,
        }
    }

    /// In the joints.
    pub(crate) fn of_joints(task: &'a Task<'a>, ends: [Place; 2]) -> Self {
        Stretch {
            task,
            course: Course::Joints,
            ends,
            bend: 0.0,
        }
    }

    /// How far the wire's tip may leave the straight line between the ends, mm; nothing where its way follows from the joints alone.
    pub fn tip_bend(&self) -> Option<f64> {
        let Course::Move(_, leg, [from, to]) = self.course else {
            return None;
        };
        let [a, b] = self.ends.map(|end| end.tip.position);
        Some(leg.at(0.5 * (from + to)).position.distance(a.midpoint(b)))
    }

    /// Its two halves.
    ///
    /// # Errors
    /// [`Why`] the place between them cannot be held.
    pub fn halves(&self) -> Result<[Stretch<'a>; 2], Why> {
        let [a, b] = self.ends;
        let straight = std::array::from_fn(|i| 0.5 * (a.joints[i] + b.joints[i]));
        let (place, courses) = match self.course {
            Course::Joints => {
                let external = a.external.lerp(b.external, 0.5);
                let frames = self.task.cell.frames(&Values::of(straight, external));
                let place = Place {
                    tip: frames.part_from_wire_tip(),
                    joints: straight,
                    external,
                };
                (place, [Course::Joints; 2])
            }
            Course::Move(chain, leg, [from, to]) => {
                let share = 0.5 * (from + to);
                let place = place_on(self.task, (chain, leg), share, &straight)?;
                let halves =
                    [[from, share], [share, to]].map(|shares| Course::Move(chain, leg, shares));
                (place, halves)
            }
        };
        // half of a smooth way bends by a quarter of the whole; half of a way with a kink by twice what is seen in the middle at most
        let bend = 2.0 * apart(&place.joints, &straight);
        let half = |course, ends| Stretch {
            task: self.task,
            course,
            ends,
            bend,
        };
        Ok([half(courses[0], [a, place]), half(courses[1], [place, b])])
    }
}

/// The place at a share of a move: of all ways to hold it the one nearest to `near`, limits aside.
pub(super) fn place_on(
    task: &Task<'_>,
    (chain, leg): (&Chain, &Leg),
    share: f64,
    near: &[f64; 6],
) -> Result<Place, Why> {
    let tip = tip_on(chain, leg, share);
    let external = leg.external_at(share);
    let values = Values::of(task.values.arm, external);
    let flange = task.cell.base_from_flange(tip, &values);
    let joints = task.cell.arm.nearest(flange, near);
    Ok(Place {
        tip,
        joints: joints.map_err(Why::Unreachable)?,
        external,
    })
}

/// The wire's tip at a share of a move, turned as chosen.
pub(super) fn tip_on(chain: &Chain, leg: &Leg, share: f64) -> Pose {
    let (turn, _) = chain.turn_at(leg.begin + leg.length * share);
    turned(leg.at(share), turn)
}

/// The greatest difference of two sets of angles, rad.
pub(crate) fn apart(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let differ = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differ.fold(0.0, f64::max)
}
