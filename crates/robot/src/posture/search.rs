//! The search for how the arm holds the torch along the runs of a program.

use meltpath_base::Observer;

use super::chain::{Chain, chains};
use super::follow::{Broken, Sample, verify};
use super::free::Free;
use super::ladder::{self, Blocked};
use super::task::{Axes, Guard, Near, NotHeld, Task, Why};
use super::{Held, Margins};
use crate::cell::Values;

/// How often a way that breaks between its key places is blocked and another one looked for.
const ATTEMPTS: usize = 40;

/// How the arm holds the torch along a program.
///
/// # Errors
/// [`NotHeld`] at the first place from which no way goes on.
pub fn hold(task: &Task<'_>, observer: &dyn Observer) -> Result<Held, NotHeld> {
    let chains = chains(task);
    Search::new(task, &chains, None).held(observer)
}

/// The runs of a program between its joint moves, for a [`Search`].
pub fn runs(task: &Task<'_>) -> Vec<Chain> {
    chains(task)
}

/// A search that is taken up again where nothing may touch any more.
pub struct Search<'a> {
    task: &'a Task<'a>,
    runs: Vec<Run<'a>>,
}

/// The search along one run.
struct Run<'a> {
    chain: &'a Chain,
    way: Way<'a>,
    found: Option<Found>,
}

/// A run whose way was chosen.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) chain: Chain,
    margins: Margins,
    /// Where every axis stands at its end.
    pub(super) end: Values,
}

enum Way<'a> {
    /// Of the arm alone.
    Arm(Blocked<'a>),
    /// Of arm, track and positioner.
    All(Box<Free<'a>>),
}

impl<'a> Search<'a> {
    /// Along `chains`, which are the [`runs`] of the task. `guard` says where something touches: it is asked only where
    /// [`Search::guard`] says so.
    pub fn new(task: &'a Task<'a>, chains: &'a [Chain], guard: Option<Guard<'a>>) -> Self {
        let run = |chain| Run {
            chain,
            way: match task.axes {
                Axes::Free => Way::All(Box::new(Free::new(task, chain, guard))),
                Axes::Standing | Axes::Written { .. } => Way::Arm(Blocked::new(guard)),
            },
            found: None,
        };
        Search {
            task,
            runs: chains.iter().map(run).collect(),
        }
    }

    /// The best way along each run.
    ///
    /// # Errors
    /// [`NotHeld`] at the first place from which no way goes on.
    pub fn held(&mut self, observer: &dyn Observer) -> Result<Held, NotHeld> {
        let mut held = Held {
            chains: Vec::with_capacity(self.runs.len()),
            margins: Margins::default(),
        };
        let mut before = None;
        for run in &mut self.runs {
            let found = match run.found.take() {
                Some(found) => found,
                None => run.search(self.task, before, observer)?,
            };
            held.margins = held.margins.and(&found.margins);
            held.chains.push(found.chain.clone());
            // a run that goes nowhere is one place, wherever the arm comes from
            before = (!found.chain.legs.is_empty()).then_some(found.end);
            run.found = Some(found);
        }
        Ok(held)
    }

    /// Lets nothing touch on a piece of a run from now on; whether that is new.
    pub fn guard(&mut self, run: usize, near: Near) -> bool {
        let Some(run) = self.runs.get_mut(run) else {
            return false;
        };
        let new = match &mut run.way {
            Way::Arm(blocked) => blocked.guard(run.chain, near),
            Way::All(free) => free.guard(near),
        };
        if new {
            run.found = None;
        }
        new
    }
}

impl Run<'_> {
    /// A way that holds, and what it comes near to; a joint move leads there from `before`.
    fn search(
        &mut self,
        task: &Task<'_>,
        before: Option<Values>,
        observer: &dyn Observer,
    ) -> Result<Found, NotHeld> {
        let chain = match &mut self.way {
            Way::Arm(blocked) => {
                return of_arm(task, (self.chain, before), blocked, observer);
            }
            Way::All(free) => free.best(before, observer)?,
        };
        verified(task, &chain).map_err(|broken| broken.not_held)
    }
}

/// A chosen run that was followed to its end.
fn verified(task: &Task<'_>, chain: &Chain) -> Result<Found, Broken> {
    let mut margins = Margins::default();
    let mut end = Values::of(chain.joints, chain.external);
    let add = |sample: &Sample| {
        margins.add(task.cell, sample);
        end = Values::of(sample.joints, sample.external);
    };
    verify(task, chain, add)?;
    Ok(Found {
        chain: chain.clone(),
        margins,
        end,
    })
}

/// A way of the arm alone, and what it comes near to; it begins near `from`, where a joint move leads there from other beads.
pub(super) fn of_arm(
    task: &Task<'_>,
    (chain, from): (&Chain, Option<Values>),
    blocked: &mut Blocked<'_>,
    observer: &dyn Observer,
) -> Result<Found, NotHeld> {
    let mut first = None;
    for _ in 0..ATTEMPTS {
        let chosen = ladder::climb(task, (chain, from), blocked, observer)
            .map_err(|e| first.unwrap_or(e))?;
        let broken = match verified(task, &chosen.chain) {
            Ok(found) => return Ok(found),
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
