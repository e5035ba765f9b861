//! Ways that keep clear: the best way is held against what stands around, and where it comes too near all ways there are, and another
//! one is looked for.

use std::ops::RangeInclusive;

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;

use super::Body;
use super::bodies::bars;
use super::passage::{Look, pass};
use super::surroundings::{Surroundings, foot, table, to_table};
use super::sweep::over_joint_moves;
use crate::cell::{Cell, Values};
use crate::posture::{Held, Near, NotHeld, Search, Task, Why, runs};

/// How often a way is looked for at most.
const ROUNDS: u32 = 6;
/// How far beside a place that is too near all ways are looked at, mm; twice as far each time.
const BESIDE: f64 = 40.0;
/// Pairs that may come this much nearer than wanted between two places count as too near, mm.
const EXACT: f64 = 0.1;
/// What lacks more than this share of what it lacked before is given up.
const LESS: f64 = 0.9;
/// How exactly it is found how much room others lack, mm.
const ROUGH: f64 = 2.0;
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

/// Room beyond what is wanted is of no interest but for rounding, mm.
const BEYOND: f64 = 1.0;

/// How much more room than `wanted` mm the cell has where it stands so while a command is executed, mm, up to [`BEYOND`].
fn spare(
    task: &Task<'_>,
    around: &Surroundings<'_>,
    wanted: f64,
    (command, values): (u32, &Values),
) -> f64 {
    room(task.cell, around, (command, values), wanted + BEYOND) - wanted
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
    let guard = |command: u32, values: &Values, more: f64| {
        spare(task, around, wanted + more, (command, values))
    };
    let mut search = Search::new(task, &chains, Some(&guard));
    let mut held = search.held(observer)?;
    let mut best: Option<(f64, Held)> = None;
    let mut before = Vec::new();
    for round in 0..=ROUNDS {
        let beside = BESIDE * f64::from(1_u32 << round);
        let near = nearing(task, &held, around, (wanted, beside))?;
        if near.is_empty() {
            let found = Clearance::Kept;
            return Ok(Cleared { held, found });
        }
        let lack = near.iter().map(|(_, near)| near.lack).sum();
        if best.as_ref().is_none_or(|(least, _)| lack < *least) {
            best = Some((lack, held.clone()));
        }
        if round == ROUNDS {
            break;
        }
        let hopeful = near.iter().filter(|n| round < 2 || !in_vain(n, &before));
        let new = hopeful.filter(|(run, near)| search.guard(*run, *near));
        if new.count() == 0 {
            break;
        }
        before = near;
        held = match search.held(observer) {
            Ok(other) => other,
            Err(not) if not.why == Why::Stopped => return Err(not),
            Err(_) => break,
        };
    }
    let held = best.map_or(held, |(_, held)| held);
    let found = Clearance::InVain;
    Ok(Cleared { held, found })
}

/// Whether what comes nearest of all, nearer than `wanted` mm, does so along some of a program's moves.
///
/// # Errors
/// [`NotHeld`], where the program is not held after all.
pub fn is_nearest_on(
    task: &Task<'_>,
    held: &Held,
    around: &Surroundings<'_>,
    (wanted, moves): (f64, &[RangeInclusive<u32>]),
) -> Result<bool, NotHeld> {
    let nearest = along(task, held, around, (wanted, 0.0))?.nearest;
    Ok(nearest.is_some_and(|(_, command)| moves.iter().any(|m| m.contains(&command))))
}

/// How much more room than `wanted` mm the joint moves between the runs of a program leave to what stands around, each run begun so that the
/// move to it keeps clear as far as there is such a way, mm; infinite where nothing comes near.
///
/// # Errors
/// [`NotHeld`] where there is no way at all.
pub fn room_over(
    task: &Task<'_>,
    around: &Surroundings<'_>,
    wanted: f64,
    observer: &dyn Observer,
) -> Result<f64, NotHeld> {
    let chains = runs(task);
    let guard = |command: u32, values: &Values, more: f64| {
        spare(task, around, wanted + more, (command, values))
    };
    let held = Search::new(task, &chains, Some(&guard)).held(observer)?;
    let least = over_joint_moves(task, &held, around, wanted)?;
    Ok(least.unwrap_or(f64::INFINITY) - wanted)
}

/// Whether more room was asked for on a stretch, and it lacks as much as before.
fn in_vain((run, near): &(usize, Near), before: &[(usize, Near)]) -> bool {
    let [from, to] = near.between;
    let same = before
        .iter()
        .filter(|(of, b)| of == run && b.between[0] <= to && from <= b.between[1]);
    same.map(|(_, b)| b.lack)
        .reduce(f64::min)
        .is_some_and(|lack| near.lack > LESS * lack)
}

/// Stretches of a way, with their runs, where it comes nearer than wanted.
fn nearing(
    task: &Task<'_>,
    held: &Held,
    around: &Surroundings<'_>,
    (wanted, beside): (f64, f64),
) -> Result<Vec<(usize, Near)>, NotHeld> {
    along(task, held, around, (wanted, beside)).map(|places| places.found)
}

/// What comes nearer than wanted along a way.
fn along(
    task: &Task<'_>,
    held: &Held,
    around: &Surroundings<'_>,
    (wanted, beside): (f64, f64),
) -> Result<Nearing, NotHeld> {
    let mut places = Nearing {
        wanted,
        beside,
        here: (0, [0.0; 2]),
        command: 0,
        least: wanted,
        nearest: None,
        found: Vec::new(),
    };
    pass(task, held, around, &mut places)?;
    Ok(places)
}

/// Stretches that come too near.
struct Nearing {
    wanted: f64,
    beside: f64,
    here: (usize, [f64; 2]),
    /// What is executed on this one.
    command: u32,
    /// The least distance on this one.
    least: f64,
    /// The least of all, and what is executed there.
    nearest: Option<(f64, u32)>,
    found: Vec<(usize, Near)>,
}

impl Look for Nearing {
    fn next(&mut self, run: usize, lengths: [f64; 2], command: u32, _: DVec3) {
        (self.here, self.command, self.least) = ((run, lengths), command, self.wanted);
    }

    fn below(&self, _: [Body; 2]) -> f64 {
        self.least
    }

    fn settled(&self, _: [Body; 2], [least, most]: [f64; 2]) -> bool {
        let exact = if most < self.wanted { ROUGH } else { EXACT };
        most - least <= exact
    }

    fn tell(&mut self, _: [Body; 2], distance: f64) {
        self.least = distance;
        if self.nearest.is_none_or(|(least, _)| distance < least) {
            self.nearest = Some((distance, self.command));
        }
        let (run, [from, to]) = self.here;
        let lack = self.wanted - distance;
        let last = self.found.last_mut();
        match last.filter(|(of, near)| *of == run && near.between[1] >= from) {
            Some((_, near)) => {
                near.between[1] = to;
                near.lack = near.lack.max(lack);
            }
            None => self.found.push((
                run,
                Near {
                    between: [from, to],
                    beside: self.beside,
                    lack,
                },
            )),
        }
    }
}

/// The least distance of any pair of bodies where the cell stands so while a command is executed, mm, where it is less than `most`; else `most`.
pub fn room(
    cell: &Cell,
    stands: &Surroundings<'_>,
    (command, values): (u32, &Values),
    most: f64,
) -> f64 {
    let bodies = bars(cell, stands.shapes, values);
    let metal = (stands.metal)(command);
    let (table, foot) = (table(cell, stands), foot(cell, stands));
    let mut least = most;
    for bar in &bodies {
        let may = |other: Body| stands.pairs.may_touch(bar.body, other);
        if may(Body::Metal) {
            least = least.min(metal.distance(&bar.in_part, least, foot));
        }
        if let Some(table) = table.as_ref().filter(|_| may(Body::Table)) {
            least = least.min(to_table(table, &bar.in_part, least));
        }
        for other in &bodies {
            if other.body > bar.body && may(other.body) {
                least = least.min(bar.in_base.apart(&other.in_base, least));
            }
        }
    }
    least
}
