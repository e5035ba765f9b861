//! The machine's gun in a job: its file, and whether it can do what the job changes.

pub mod drawn;
pub mod focus;

use std::path::Path;

use meltpath_base::settings::{Problem, Setting};
use meltpath_data::guns;
use meltpath_gun::machine::{self, Machine, Points};

use crate::data::{DataFileError, DataText};
use crate::job::ebm::{Change, ControllerKind, CorrectTable, EbmJob, OptimiseTable};

/// The gun `name`: one that ships, or, where the name ends in `.toml`, a file relative to `folder`.
///
/// # Errors
/// [`DataFileError`] listing what ships, or saying what is wrong with the file.
///
/// ```
/// let gun = meltpath::ebm::gun::load("arcam-a1-2016", std::path::Path::new(".")).unwrap();
/// assert!(gun.lag.is_none() && gun.speed.is_some());
/// ```
pub fn load(name: &str, folder: &Path) -> Result<Machine, DataFileError> {
    DataText::load("gun", name, guns::ALL, folder)?.read(machine::parse)
}

/// The gun of a job, where it names one: refused where it cannot do what `[optimise]` or `[correct]`
/// changes.
pub(super) fn of_job(job: &EbmJob, folder: &Path) -> Result<Option<Machine>, Vec<Problem>> {
    let key = &job.ebm.gun;
    let Some(name) = &**key else {
        return Ok(None);
    };
    let machine = load(name, folder).map_err(|e| e.at(key))?;
    let cannot = job
        .optimise
        .as_ref()
        .and_then(|table| cannot_change(table, &machine));
    let cannot = cannot.or(job
        .correct
        .as_ref()
        .and_then(|table| cannot_correct(table, &machine)));
    match cannot {
        Some(problem) => Err(vec![problem]),
        None => Ok(Some(machine)),
    }
}

/// Why a gun could not draw corrected currents.
fn cannot_correct(table: &CorrectTable, machine: &Machine) -> Option<Problem> {
    let needed = match *table.controller {
        ControllerKind::Continuous => machine::Change::Anywhere,
        ControllerKind::PerLine => machine::Change::BetweenLines,
    };
    let can = machine.current?;
    if can.allows(needed) {
        return None;
    }
    let problem = format!(
        "{} changes the current {} only: it could not draw what [correct] finds",
        machine.name,
        can.words()
    );
    let help = if can.allows(machine::Change::BetweenLines) {
        "correct.controller = \"per-line\" keeps to the gun"
    } else {
        "leave [correct] out, or name a gun that can"
    };
    Some(table.controller.problem(problem).help(help))
}

fn cannot_change(table: &OptimiseTable, machine: &Machine) -> Option<Problem> {
    let needed = match *table.controller {
        ControllerKind::Continuous => machine::Change::Anywhere,
        ControllerKind::PerLine => machine::Change::BetweenLines,
    };
    let change: &Setting<Change> = &table.change;
    let refused = |what: &str, can: &str, instead: &str| {
        let name = &machine.name;
        let problem = format!("{name} changes {what} {can}: it could not draw what is found");
        Some(change.problem(problem).help(instead))
    };
    let (can, what) = match **change {
        Change::Speed => (machine.speed?, "the speed"),
        Change::Current => (machine.current?, "the current"),
        Change::Dwell if machine.points == Some(Points::No) => {
            return refused(
                "no times on points",
                "at all",
                "let it change another thing",
            );
        }
        Change::Dwell | Change::Focus => return None,
    };
    if can.allows(needed) {
        return None;
    }
    let per_line = can.allows(machine::Change::BetweenLines) && needed == machine::Change::Anywhere;
    let instead = if per_line {
        "optimise.controller = \"per-line\" keeps to the gun"
    } else {
        "let optimise.change be another thing, or name a gun that can"
    };
    refused(what, &format!("{} only", can.words()), instead)
}
