//! How far bodies go on a stretch of a way, and how far from straight: what bounds their distances between two places.
//!
//! Between its ends every point of a body goes along its chord but for a bend. That of a point is an eighth of its second derivative
//! at most: of a chain of joints that is, joint by joint, lever · step · (step + twice the steps before it), and lever · bend of the joint;
//! of what is fixed to the torch, lever · turn², and the bend of the tip's path.

use meltpath_geometry::math::DVec3;

use super::bodies::{Bar, Body};
use crate::cell::{AXES, Arrangement, Cell, Values};
use crate::posture::Stretch;

/// How far a body goes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Gone {
    /// From place to place, straight, mm.
    pub(super) chord: f64,
    /// Beside the straight way, mm.
    pub(super) bend: f64,
}

impl Gone {
    /// No more than the distance of two bodies anywhere on a stretch at whose ends it is `distances`, mm, where they go so.
    pub(super) fn least(distances: [f64; 2], gone: &[Gone]) -> f64 {
        let chord: f64 = gone.iter().map(|g| g.chord).sum();
        let bend: f64 = gone.iter().map(|g| g.bend).sum();
        let [a, b] = distances;
        0.5 * (a + b - chord) - bend
    }

    /// Two that are farther apart than some distance by this at both ends of a stretch are so all along, mm.
    pub(super) fn room(gone: &[Gone]) -> f64 {
        -Gone::least([0.0; 2], gone)
    }
}

/// How far each body goes against the part, and against the arm's base.
pub(super) struct BodiesGone {
    pub(super) in_part: Vec<Gone>,
    pub(super) in_base: Vec<Gone>,
}

/// Joints in the order in which they lie between a frame and a body: what a step of each moves, mm per rad or, of a track, per mm.
#[derive(Debug, Clone, PartialEq, Default)]
struct Levers(Vec<(Axis, f64)>);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Axis {
    Positioner(usize),
    Track,
    Arm(usize),
}

/// The greatest levers of a cell, whatever its joints.
pub(crate) struct Reach {
    arrangement: Arrangement,
    /// Of the torch and of each link, in the base.
    torch: Levers,
    links: Vec<Levers>,
    /// The same, in the part.
    torch_in_part: Levers,
    links_in_part: Vec<Levers>,
    /// Of what the base is.
    still: Levers,
}

impl Reach {
    /// Of bodies with levers so far beside the nozzle's axis, or from its torch, and of each link beyond its end, mm.
    pub(super) fn of(cell: &Cell, beside_nozzle: f64, beside_links: [f64; 6]) -> Self {
        let arm = &cell.arm.chain;
        let joints = arm.joints.iter().map(|j| j.parent_from_joint.position);
        let offsets = joints.chain([arm.last_from_end.position]);
        let offsets: Vec<f64> = offsets.map(DVec3::length).collect();
        let held = match cell.arrangement {
            Arrangement::TorchOnRobot => cell.carrier_from_torch.position.length() + beside_nozzle,
            Arrangement::PartOnRobot => cell.carrier_from_part.position.length(),
        };
        // from a joint to the end of a link, and to what the flange holds
        let lever = |joint: usize, last: usize, more: f64| {
            let between = offsets.get(joint + 1..=last).unwrap_or_default();
            between.iter().sum::<f64>() + more
        };
        let count = arm.joints.len();
        let link = |n: usize| {
            let aside = beside_links.get(n - 1).copied().unwrap_or(0.0);
            Levers((0..n).map(|j| (Axis::Arm(j), lever(j, n, aside))).collect())
        };
        let held_at = Levers(
            (0..count)
                .map(|j| (Axis::Arm(j), lever(j, count, held)))
                .collect(),
        );
        let links: Vec<Levers> = (1..=count).map(link).collect();
        let whole = offsets.iter().sum::<f64>() + held;
        match cell.arrangement {
            Arrangement::TorchOnRobot => {
                let between = whole + beside(cell);
                Reach {
                    arrangement: cell.arrangement,
                    torch_in_part: held_at.after(cell, between),
                    links_in_part: links.iter().map(|l| l.after(cell, between)).collect(),
                    torch: held_at,
                    links,
                    still: Levers::default(),
                }
            }
            // the part goes with the arm: all of it turns against it
            Arrangement::PartOnRobot => {
                let far = whole + cell.carrier_from_torch.position.length() + beside(cell);
                let all = Levers((0..count).rev().map(|j| (Axis::Arm(j), far)).collect());
                Reach {
                    arrangement: cell.arrangement,
                    torch: Levers(cell.track.iter().map(|_| (Axis::Track, 1.0)).collect()),
                    torch_in_part: all.clone(),
                    links_in_part: vec![all; count],
                    links,
                    still: Levers::default(),
                }
            }
        }
    }

    /// How far the wire's tip may leave its chord in the part where every axis goes evenly from one place to another, mm, and how far the
    /// torch's turn may leave an even one, rad.
    pub(crate) fn tip(cell: &Cell, ends: [Values; 2]) -> [f64; 2] {
        let reach = Reach::of(cell, cell.torch_from_wire_tip.position.length(), [0.0; 6]);
        let (levers, steps) = (&reach.torch_in_part, steps(ends));
        [levers.bend(&steps, 0.0), levers.turn_bend(&steps)]
    }

    /// How far bodies go from one place to the next.
    pub(super) fn motion(
        &self,
        stretch: &Stretch<'_>,
        before: &[Bar<'_>],
        now: &[Bar<'_>],
    ) -> BodiesGone {
        let [from, to] = stretch.ends;
        let steps = steps(stretch.ends.map(|end| Values::of(end.joints, end.external)));
        let of_torch = |body| match (body, self.arrangement) {
            (Body::Nozzle | Body::Torch, _) => true,
            (body, Arrangement::TorchOnRobot) => body == Body::Link(6),
            (_, Arrangement::PartOnRobot) => false,
        };
        let turn = from.tip.orientation.angle_between(to.tip.orientation);
        let in_part = before.iter().zip(now).map(|(b, n)| {
            let bend = match stretch.tip_bend() {
                Some(tip) if of_torch(b.body) => {
                    let lever = b.in_part.lever_about(from.tip.position);
                    tip + lever * turn * turn / 8.0
                }
                _ => self.levers(b.body, true).bend(&steps, stretch.bend),
            };
            Gone {
                chord: b.in_part.gone(&n.in_part),
                bend,
            }
        });
        let in_base = before.iter().zip(now).map(|(b, n)| Gone {
            chord: b.in_base.gone(&n.in_base),
            bend: self.levers(b.body, false).bend(&steps, stretch.bend),
        });
        BodiesGone {
            in_part: in_part.collect(),
            in_base: in_base.collect(),
        }
    }

    fn levers(&self, body: Body, in_part: bool) -> &Levers {
        let (links, torch) = if in_part {
            (&self.links_in_part, &self.torch_in_part)
        } else {
            (&self.links, &self.torch)
        };
        match body {
            Body::Link(0) if !in_part => &self.still,
            Body::Link(n) => links.get(usize::from(n).wrapping_sub(1)).unwrap_or(torch),
            _ => torch,
        }
    }
}

/// How far the arm's base and the part stand apart at most, but for what the arm spans, mm.
fn beside(cell: &Cell) -> f64 {
    let track = cell.track.iter().flat_map(|t| &t.joints);
    let track = track.map(|j| {
        j.parent_from_joint.position.length() + j.limits.low.abs().max(j.limits.high.abs())
    });
    let positioner = cell.positioner.iter().flat_map(|p| &p.joints);
    let positioner = positioner.map(|j| j.parent_from_joint.position.length());
    let fixed = [
        cell.carrier_from_base,
        cell.carrier_from_table,
        cell.carrier_from_part,
    ];
    let fixed: f64 = fixed.map(|p| p.position.length()).into_iter().sum();
    fixed + track.chain(positioner).sum::<f64>()
}

impl Levers {
    /// Behind the joints of positioner and track, whose lever is `far`.
    fn after(&self, cell: &Cell, far: f64) -> Levers {
        let turning = cell.positioner.as_ref().map_or(0, |p| p.joints.len());
        let turning = (0..turning).rev().map(|i| (Axis::Positioner(i), far));
        let sliding = cell.track.iter().map(|_| (Axis::Track, 1.0));
        Levers(
            turning
                .chain(sliding)
                .chain(self.0.iter().copied())
                .collect(),
        )
    }

    /// How far a body leaves its chord where the axes go such steps and the arm's joints bend so far, mm.
    fn bend(&self, steps: &[f64; AXES], joints: f64) -> f64 {
        let (mut bend, mut turned) = (0.0, 0.0);
        for (axis, lever) in &self.0 {
            match axis {
                Axis::Track => bend += lever * steps[6] * 2.0 * turned / 8.0,
                Axis::Positioner(i) => {
                    let step = steps[7 + i];
                    bend += lever * step * (step + 2.0 * turned) / 8.0;
                    turned += step;
                }
                Axis::Arm(i) => {
                    // a joint that bends goes faster than its step somewhere
                    let step = steps[*i] + 4.0 * joints;
                    bend += lever * (step * (step + 2.0 * turned) / 8.0 + joints);
                    turned += step;
                }
            }
        }
        bend
    }

    /// How far a frame's turn leaves an even one where the axes go such steps, rad.
    fn turn_bend(&self, steps: &[f64; AXES]) -> f64 {
        let (mut bend, mut turned) = (0.0, 0.0);
        for (axis, _) in &self.0 {
            let step = match axis {
                Axis::Track => continue,
                Axis::Positioner(i) => steps[7 + i],
                Axis::Arm(i) => steps[*i],
            };
            bend += step * turned / 8.0;
            turned += step;
        }
        bend
    }
}

/// How far each axis goes, rad or mm.
fn steps([from, to]: [Values; 2]) -> [f64; AXES] {
    let [a, b] = [from.external().0, to.external().0];
    std::array::from_fn(|i| match i.checked_sub(6) {
        None => (to.arm[i] - from.arm[i]).abs(),
        Some(axis) => (b[axis] - a[axis]).abs(),
    })
}
