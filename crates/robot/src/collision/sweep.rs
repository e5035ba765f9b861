//! The least distance of every pair of bodies along a held program.

use std::collections::BTreeMap;

use meltpath_geometry::math::DVec3;

use super::bodies::Body;
use super::passage::{Look, pass};
use super::surroundings::Surroundings;
use crate::posture::{Held, NotHeld, Task};

/// Distances beyond this are of no interest, mm.
const FAR: f64 = 1000.0;

/// How exactly distances are found that are less than wanted, mm.
const EXACT: f64 = 0.1;

/// How exactly those beyond it, as a share of what is told beyond.
const ROUGH: f64 = 0.25;

/// No two bodies lie as deep in each other, mm.
const NEVER: f64 = -1e6;

/// Where two bodies come nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The bodies.
    pub bodies: [Body; 2],
    /// No more than their distance, mm: see [`sweep`]. Zero or less where they touch.
    pub distance: f64,
    /// The command.
    pub command: u32,
    /// The wire's tip in the part, mm.
    pub position: DVec3,
}

/// The least distance of each pair, the nearest pair first. None is less than told. One of less than `wanted` mm is more by 0.1 mm at
/// most, one beyond by a quarter of what is told beyond at most.
///
/// # Errors
/// [`NotHeld`], where the program is not held after all.
pub fn sweep(
    task: &Task<'_>,
    held: &Held,
    around: &Surroundings<'_>,
    wanted: f64,
) -> Result<Vec<Closest>, NotHeld> {
    let mut least = Least {
        wanted,
        command: 0,
        position: DVec3::ZERO,
        known: BTreeMap::new(),
    };
    pass(task, held, around, &mut least)?;
    let mut found: Vec<Closest> = least.known.into_values().collect();
    found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    Ok(found)
}

/// The least distance of any pair on the joint moves of a held program between two of its runs, mm, as exactly as [`sweep`] finds it;
/// nothing where there is no such move, or none comes within a metre.
pub(super) fn over_joint_moves(
    task: &Task<'_>,
    held: &Held,
    around: &Surroundings<'_>,
    wanted: f64,
) -> Result<Option<f64>, NotHeld> {
    let mut least = OnJointMoves {
        least: Least {
            wanted,
            command: 0,
            position: DVec3::ZERO,
            known: BTreeMap::new(),
        },
        begins: held.chains.iter().map(|c| c.first).collect(),
        here: false,
    };
    pass(task, held, around, &mut least)?;
    let found = least.least.known.values().map(|c| c.distance);
    Ok(found.reduce(f64::min))
}

/// Looks at joint moves alone.
struct OnJointMoves {
    least: Least,
    /// The joint moves that lead to the runs.
    begins: Vec<Option<u32>>,
    here: bool,
}

impl Look for OnJointMoves {
    fn next(&mut self, run: usize, lengths: [f64; 2], command: u32, tip: DVec3) {
        let begin = self.begins.get(run).copied().flatten();
        self.here = lengths[1] <= 0.0 && begin == Some(command);
        self.least.next(run, lengths, command, tip);
    }

    fn below(&self, bodies: [Body; 2]) -> f64 {
        if self.here {
            self.least.below(bodies)
        } else {
            NEVER
        }
    }

    fn settled(&self, bodies: [Body; 2], between: [f64; 2]) -> bool {
        self.least.settled(bodies, between)
    }

    fn tell(&mut self, bodies: [Body; 2], distance: f64) {
        self.least.tell(bodies, distance);
    }
}

/// The least distances so far.
struct Least {
    wanted: f64,
    command: u32,
    position: DVec3,
    known: BTreeMap<[Body; 2], Closest>,
}

impl Look for Least {
    fn next(&mut self, _: usize, _: [f64; 2], command: u32, tip: DVec3) {
        (self.command, self.position) = (command, tip);
    }

    fn below(&self, bodies: [Body; 2]) -> f64 {
        self.known.get(&bodies).map_or(FAR, |c| c.distance)
    }

    fn settled(&self, _: [Body; 2], [least, most]: [f64; 2]) -> bool {
        most - least <= EXACT.max(ROUGH * (least - self.wanted))
    }

    fn tell(&mut self, bodies: [Body; 2], distance: f64) {
        if distance < self.below(bodies) {
            let closest = Closest {
                bodies,
                distance,
                command: self.command,
                position: self.position,
            };
            self.known.insert(bodies, closest);
        }
    }
}
