//! Ways that keep clear: the best way is held against what stands around, and where it comes too near all ways there are, and another
//! one is looked for.

use meltpath_base::Observer;

use super::Body;
use super::bodies::{Capsule, capsules, may_touch};
use super::distance::between;
use super::sweep::{Surroundings, table, to_table, way};
use crate::cell::{Cell, Values};
use crate::posture::{Follower, Held, NotHeld, Search, Task, Why, runs};

/// How often a way is looked for at most.
const ROUNDS: u32 = 6;
/// How far beside a place that is too near all ways are looked at, mm; twice as far each time.
const BESIDE: f64 = 40.0;
/// Room beyond this is of no interest, mm.
const AHEAD: f64 = 100.0;

/// A way, and whether it keeps clear.
#[derive(Debug, Clone, PartialEq)]
pub struct Cleared {
    /// The way.
    pub held: Held,
    /// What was found.
    pub found: Clearance,
}

/// Whether a way keeps clear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clearance {
    /// It does.
    Kept,
    /// None of the ways that were tried does.
    InVain,
}

/// How the arm holds the torch along a program so that it keeps `wanted` mm clear of what stands around, as far as there is a way.
///
/// # Errors
/// [`NotHeld`] where there is no way at all.
pub fn hold_clear(
    task: &Task<'_>,
    around: &Surroundings<'_>,
    wanted: f64,
    observer: &dyn Observer,
) -> Result<Cleared, NotHeld> {
    let chains = runs(task);
    let guard = |command: u32, values: &Values| {
        let bodies = capsules(task.cell, around.shapes, values);
        room(task.cell, around, (command, values), &bodies) - wanted
    };
    let mut search = Search::new(task, &chains, Some(&guard));
    let mut held = search.held(observer)?;
    for round in 0..ROUNDS {
        let near = nearing(task, &held, around, wanted)?;
        if near.is_empty() {
            let found = Clearance::Kept;
            return Ok(Cleared { held, found });
        }
        let beside = BESIDE * f64::from(1_u32 << round);
        let new = near
            .iter()
            .filter(|(run, [from, to])| search.guard(*run, [from - beside, to + beside]));
        if new.count() == 0 {
            break;
        }
        held = match search.held(observer) {
            Ok(other) => other,
            Err(not) if not.why == Why::Stopped => return Err(not),
            Err(_) => break,
        };
    }
    let found = Clearance::InVain;
    Ok(Cleared { held, found })
}

/// Stretches of a way, by run and length, where it comes nearer than wanted.
fn nearing(
    task: &Task<'_>,
    held: &Held,
    around: &Surroundings<'_>,
    wanted: f64,
) -> Result<Vec<(usize, [f64; 2])>, NotHeld> {
    let mut near: Vec<(usize, [f64; 2])> = Vec::new();
    for (run, chain) in held.chains.iter().enumerate() {
        let mut before: Option<Vec<Capsule>> = None;
        let (mut left, mut last, mut metal) = (0.0, 0.0, None);
        let mut follower = Follower::new(task, chain);
        while let Some(sample) = follower.next_sample()? {
            let values = Values::of(sample.joints, sample.external);
            let now = capsules(task.cell, around.shapes, &values);
            let gone = before.iter().flatten().zip(&now).map(|(b, n)| way(b, n));
            let gone = gone.fold(0.0, f64::max);
            // two bodies go towards each other by twice the way of the faster at most
            left -= 2.0 * gone;
            let here = (around.metal)(sample.command);
            let other = metal.replace(here).is_none_or(|m| !std::ptr::eq(m, here));
            if other || left < wanted {
                left = room(task.cell, around, (sample.command, &values), &now);
                // on the way here it may have been less
                if left - gone < wanted {
                    match near.last_mut().filter(|(of, b)| *of == run && b[1] >= last) {
                        Some((_, between)) => between[1] = sample.length,
                        None => near.push((run, [last, sample.length])),
                    }
                }
            }
            (before, last) = (Some(now), sample.length);
        }
    }
    Ok(near)
}

/// The least distance of any pair of bodies, mm, where it is less than [`AHEAD`].
fn room(
    cell: &Cell,
    around: &Surroundings<'_>,
    (command, values): (u32, &Values),
    bodies: &[Capsule],
) -> f64 {
    let metal = (around.metal)(command);
    let table = table(cell, around, values);
    let mut least = AHEAD;
    for capsule in bodies {
        let may = |other: Body| may_touch(capsule.body, other, cell.arrangement);
        if may(Body::Metal) {
            let most = least + capsule.radius;
            least = least.min(metal.distance(&capsule.line, most) - capsule.radius);
        }
        if let Some(table) = table.as_ref().filter(|_| may(Body::Table)) {
            least = least.min(to_table(table, capsule));
        }
        for other in bodies {
            if other.body > capsule.body && may(other.body) {
                let distance = between(&capsule.line, &other.line);
                least = least.min(distance - capsule.radius - other.radius);
            }
        }
    }
    least
}
