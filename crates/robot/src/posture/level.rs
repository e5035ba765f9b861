//! Where a positioner stands so that the torch of a place points straight down: in closed form, as where two circles on a ball meet
//! (Paden 1986, his second subproblem).

use std::f64::consts::FRAC_PI_2;

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

use super::choice::Carried;
use super::task::Task;
use crate::cell::{Arrangement, External};

/// A torch nearer than this to the last axis is level wherever that stands, as the sine of the angle: 0.3°, well below what verdicts ask for.
const ALONG: f64 = 0.005;

/// Where the axes of a positioner stand, rad, but for whole turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stand {
    pub(super) first: f64,
    /// Nothing where the second may stand anywhere, or where there is none.
    pub(super) second: Option<f64>,
}

/// The axes of a positioner while it rests.
pub(super) struct Level {
    rest: External,
    world_from_part: DQuat,
    first: DVec3,
    second: Option<DVec3>,
}

impl Level {
    /// Nothing where no positioner turns the part under a torch that the arm holds.
    pub(super) fn of(task: &Task<'_>, rest: External) -> Option<Level> {
        if task.cell.arrangement != Arrangement::TorchOnRobot {
            return None;
        }
        task.cell.external_joint(1)?;
        let part = |external| Carried::at(task, external).world_from_part;
        let world_from_part = part(rest);
        let direction = |axis: usize| {
            let mut turned = rest;
            turned.0[axis] += FRAC_PI_2;
            let turn = part(turned) * world_from_part.inverse();
            turn.to_scaled_axis().normalize()
        };
        Some(Level {
            rest,
            world_from_part,
            first: direction(1),
            second: task.cell.external_joint(2).map(|_| direction(2)),
        })
    }

    /// Both ways to stand; of a single axis the one at which the torch leans least.
    pub(super) fn at(&self, tip: Pose) -> [Option<Stand>; 2] {
        let wire = self.world_from_part * tip.orientation * DVec3::Z;
        let down = DVec3::NEG_Z;
        let n1 = self.first;
        let first = |from: DVec3| Some(self.rest.0[1] + angle(from, down, n1)?);
        let Some(n2) = self.second else {
            let only = first(wire).map(|first| Stand {
                first,
                second: None,
            });
            return [only, None];
        };
        if wire.cross(n2).length() < ALONG {
            let only = first(wire).map(|first| Stand {
                first,
                second: None,
            });
            return [only, None];
        }
        // where the second axis leads the wire, so that the first leads it on to straight down
        let between = n1.dot(n2);
        let across = n1.cross(n2).length_squared();
        let (high, along) = (n1.dot(down), n2.dot(wire));
        let p = (high - between * along) / across;
        let q = (along - between * high) / across;
        let rest = (1.0 - p * p - q * q - 2.0 * p * q * between) / across;
        if !(rest >= 0.0 && rest.is_finite()) {
            return [None, None];
        }
        [1.0, -1.0].map(|side| {
            let led = p * n1 + q * n2 + side * rest.sqrt() * n1.cross(n2);
            Some(Stand {
                first: first(led)?,
                second: Some(self.rest.0[2] + angle(wire, led, n2)?),
            })
        })
    }
}

/// By how much a turn about an axis leads a direction as near to another as it can, rad; nothing where it is all the same.
fn angle(from: DVec3, to: DVec3, axis: DVec3) -> Option<f64> {
    let (a, b) = (from - axis * from.dot(axis), to - axis * to.dot(axis));
    let known = a.length() > ALONG && b.length() > ALONG;
    known.then(|| axis.dot(a.cross(b)).atan2(a.dot(b)))
}
