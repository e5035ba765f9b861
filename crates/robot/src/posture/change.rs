//! Where no way of the arm holds a whole run: at which travels it is to go over to another one.
//!
//! A run is followed by one way as far as any leads. The last travel before that place, whose way in the air is the arm's own business, ends the
//! stretch, and another way begins after it. So there are as few changes as can be.

use std::collections::BTreeSet;

use meltpath_base::Observer;

use super::chain::{Chain, chains};
use super::free::Free;
use super::ladder::Blocked;
use super::search::of_arm;
use super::task::{Axes, NotHeld, Task, Why};

/// So many travels before a place are tried, the last one first.
const TRIED: usize = 8;

/// A travel on which the arm goes over to another way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// The travel.
    pub command: u32,
    /// Why.
    pub why: Because,
}

/// Why the arm goes over to another way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Because {
    /// No way from before goes on past a place.
    NotHeld(NotHeld),
    /// The beads before and after ask for other directions of the torch.
    OtherDirection,
    /// The positioner turns back, as it has not turns enough to keep the torch upright.
    TurnedBack,
}

/// The travels among `travels` on which the arm must go over to another way, in order; none where one way holds each run.
///
/// # Errors
/// [`NotHeld`] where no way holds a stretch between two travels, or the search was stopped.
pub fn changes(
    task: &Task<'_>,
    travels: &BTreeSet<u32>,
    observer: &dyn Observer,
) -> Result<Vec<Change>, NotHeld> {
    let mut found = Vec::new();
    for run in chains(task) {
        let mut rest = run;
        while let Err(why) = holds(task, &rest, observer) {
            if why.why == Why::Stopped {
                return Err(why);
            }
            let (command, tail) = cut(task, &rest, (why.command, travels), observer).ok_or(why)?;
            found.push(Change {
                command,
                why: Because::NotHeld(why),
            });
            rest = tail;
        }
    }
    Ok(found)
}

/// The travels among `travels` on which a positioner that is free turns back, so that it can keep the torch upright along the beads: none
/// where it has turns enough, or where turning back does not help.
///
/// # Errors
/// [`NotHeld`] where no way holds a run, or the search was stopped.
pub fn turned_back(
    task: &Task<'_>,
    travels: &BTreeSet<u32>,
    observer: &dyn Observer,
) -> Result<Vec<Change>, NotHeld> {
    let mut found = Vec::new();
    for run in chains(task) {
        let over = Free::turned_back(task, &run, travels, observer)?;
        found.extend(over.into_iter().map(|command| Change {
            command,
            why: Because::TurnedBack,
        }));
    }
    Ok(found)
}

/// Whether one way holds a run.
pub(super) fn holds(task: &Task<'_>, run: &Chain, observer: &dyn Observer) -> Result<(), NotHeld> {
    if task.axes == Axes::Free {
        return Free::new(task, run, None).best(None, observer).map(|_| ());
    }
    of_arm(task, (run, None), &mut Blocked::new(None), observer).map(|_| ())
}

/// The last travel up to a command before which one way holds the run, and the run after it.
pub(super) fn cut(
    task: &Task<'_>,
    run: &Chain,
    (until, travels): (u32, &BTreeSet<u32>),
    observer: &dyn Observer,
) -> Option<(u32, Chain)> {
    // a travel of no length has no leg: the run is cut before the leg that follows it
    let begun = run.legs.first()?.command;
    let here = travels.range(..=until).rev().take_while(|c| **c > begun);
    here.take(TRIED).find_map(|command| {
        let at = run.legs.partition_point(|l| l.command < *command);
        let head = Chain {
            legs: run.legs.get(..at)?.to_vec(),
            ..run.clone()
        };
        let goes = run.legs.get(at).is_some_and(|l| l.command == *command);
        let last = if goes { at } else { at.checked_sub(1)? };
        let tail = Chain {
            first: Some(*command),
            ..run.after(last)?
        };
        holds(task, &head, observer).ok()?;
        Some((*command, tail))
    })
}
