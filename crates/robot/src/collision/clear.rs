//! Ways that keep clear: the best way is held against what stands around, and where it comes too near all ways there are, and another
//! one is looked for.

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;

use super::Body;
use super::bodies::{Capsule, capsules, may_touch};
use super::distance::between;
use super::passage::{Look, pass};
use super::surroundings::{Surroundings, table, to_table};
use crate::cell::{Cell, Values};
use crate::posture::{Held, NotHeld, Search, Task, Why, runs};

/// How often a way is looked for at most.
const ROUNDS: u32 = 6;
/// How far beside a place that is too near all ways are looked at, mm; twice as far each time.
const BESIDE: f64 = 40.0;
/// Pairs that may come this much nearer than wanted between two places count as too near, mm.
const EXACT: f64 = 0.1;
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
        room(task.cell, around, command, &bodies) - wanted
    };
    let mut search = Search::new(task, &chains, Some(&guard));
    let mut held = search.held(observer)?;
    for round in 0..=ROUNDS {
        let near = nearing(task, &held, around, wanted)?;
        if near.is_empty() {
            let found = Clearance::Kept;
            return Ok(Cleared { held, found });
        }
        if round == ROUNDS {
            break;
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
    let mut near = Near {
        wanted,
        here: (0, [0.0; 2]),
        told: false,
        found: Vec::new(),
    };
    pass(task, held, around, &mut near)?;
    Ok(near.found)
}

/// Stretches that come too near.
struct Near {
    wanted: f64,
    here: (usize, [f64; 2]),
    /// Whether this one is among them.
    told: bool,
    found: Vec<(usize, [f64; 2])>,
}

impl Look for Near {
    fn next(&mut self, run: usize, lengths: [f64; 2], _: u32, _: DVec3) {
        (self.here, self.told) = ((run, lengths), false);
    }

    fn below(&self, _: [Body; 2]) -> f64 {
        if self.told {
            f64::NEG_INFINITY
        } else {
            self.wanted
        }
    }

    fn settled(&self, _: [Body; 2], [least, most]: [f64; 2]) -> bool {
        most < self.wanted || most - least <= EXACT
    }

    fn tell(&mut self, _: [Body; 2], _: f64) {
        self.told = true;
        let (run, [from, to]) = self.here;
        let last = self.found.last_mut();
        match last.filter(|(of, b)| *of == run && b[1] >= from) {
            Some((_, between)) => between[1] = to,
            None => self.found.push((run, [from, to])),
        }
    }
}

/// The least distance of any pair of bodies, mm, where it is less than [`AHEAD`].
fn room(cell: &Cell, around: &Surroundings<'_>, command: u32, bodies: &[Capsule]) -> f64 {
    let metal = (around.metal)(command);
    let table = table(cell, around);
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
