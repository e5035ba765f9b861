//! How an arm holds the torch along a whole program: one way for each place, chosen for all places together and then verified
//! between them.
//!
//! The rotation about the wire is free: wire and arc are the same all around. It is chosen at key places by dynamic programming over
//! rotations and all ways of the arm to hold each of them ([`hold`]), least in joint motion and far from limits and singularities. Then
//! every move is followed finely, the joints always the nearest continuation, so that a jump of branch is found and never taken.

mod chain;
mod follow;
mod ladder;
mod task;

use meltpath_geometry::math::DVec3;

pub use chain::{Chain, End};
pub use follow::{Follower, Sample};
pub use task::{NotHeld, Rotation, Task, Why};

use crate::cell::Cell;

/// How the arm goes along a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Runs of moves without a joint move between them.
    pub chains: Vec<Chain>,
    /// What it comes near to on the way.
    pub margins: Margins,
}

/// What the arm comes near to along a program, each at its worst place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Margins {
    /// Least distance of a joint from its limits, rad.
    pub limit: Option<Least>,
    /// Greatest speed of a joint while the arc burns at the set speed, as a share of what it can do; nothing where that is not known.
    pub speed: Option<Least>,
    /// Least distance of the wrist from its singularity, rad.
    pub wrist: Option<Least>,
    /// Least distance of the elbow from the stretched arm, rad.
    pub elbow: Option<Least>,
    /// Least distance of the wrist's centre from the first axis, mm.
    pub shoulder: Option<Least>,
}

/// A worst value, and where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Least {
    /// The value.
    pub value: f64,
    /// The joint it is of, from 0.
    pub joint: usize,
    /// The command.
    pub command: u32,
    /// The wire's tip in the part, mm.
    pub position: DVec3,
}

/// How the arm holds the torch along a program.
///
/// # Errors
/// [`NotHeld`] at the first place from which no way goes on.
pub fn hold(task: &Task<'_>) -> Result<Held, NotHeld> {
    let mut chains = chain::chains(task);
    let mut margins = Margins::default();
    for chain in &mut chains {
        (*chain, margins) = held_chain(task, chain, &margins)?;
    }
    Ok(Held { chains, margins })
}

/// How often a way that breaks between its key places is blocked and another one looked for.
const ATTEMPTS: usize = 40;

/// A run with a way that holds, and what it comes near to beside what is known of the runs before.
fn held_chain(
    task: &Task<'_>,
    chain: &Chain,
    known: &Margins,
) -> Result<(Chain, Margins), NotHeld> {
    let mut blocked = ladder::Blocked::default();
    let mut first = None;
    for _ in 0..ATTEMPTS {
        let chosen = ladder::climb(task, chain, &blocked).map_err(|e| first.unwrap_or(e))?;
        let mut margins = *known;
        let add = |sample: &Sample| margins.add(task.cell, sample);
        let broken = match follow::verify(task, &chosen.chain, add) {
            Ok(()) => return Ok((chosen.chain, margins)),
            Err(broken) => broken,
        };
        first.get_or_insert(broken.not_held);
        blocked.add(&chosen, broken.rung);
    }
    Err(first.unwrap_or(NotHeld {
        command: 0,
        position: task.start.position,
        why: Why::Change,
    }))
}

impl Margins {
    /// Takes a place into account.
    fn add(&mut self, cell: &Cell, sample: &Sample) {
        let place = |value: f64, joint: usize| Least {
            value,
            joint,
            command: sample.command,
            position: sample.tip.position,
        };
        let least = |kept: &mut Option<Least>, new: Least| {
            if kept.is_none_or(|k| new.value < k.value) {
                *kept = Some(new);
            }
        };
        let (margin, joint) = cell.arm.margin(sample.joints);
        least(&mut self.limit, place(margin - sample.curve, joint));
        if let Some(near) = cell.arm.nearness(sample.joints) {
            least(&mut self.wrist, place(near.wrist - sample.curve, 4));
            least(&mut self.elbow, place(near.elbow - sample.curve, 2));
            least(&mut self.shoulder, place(near.shoulder.abs(), 0));
        }
        if let Some((share, joint)) = sample.speed
            && self.speed.is_none_or(|k| share > k.value)
        {
            self.speed = Some(place(share, joint));
        }
    }
}
