//! The files that a wire-arc job names: what is wrong with them.

use std::path::Path;

use meltpath_base::settings::Problem;
use meltpath_base::{Provenance, Reporter};

use super::{machine, process};
use crate::job::WaamJob;

/// What is wrong with the files that a job names in tables of which no key is `wrong`.
pub(crate) fn problems(job: &WaamJob, folder: &Path, wrong: impl Fn(&str) -> bool) -> Vec<Problem> {
    let reporter = Reporter::new();
    let mut found = Vec::new();
    if !wrong("part") {
        found.extend(absent_part(job, folder));
    }
    if !wrong("waam.") {
        let process = process::load(&job.waam, folder, &reporter);
        found.extend(process.err().unwrap_or_default());
    }
    if !wrong("machine.") {
        let machine = machine::load(&job.machine, folder, &reporter, &mut Provenance::new());
        found.extend(machine.err().unwrap_or_default());
    }
    found
}

/// Why the part cannot be opened, at its key.
pub(in crate::waam) fn absent_part(job: &WaamJob, folder: &Path) -> Option<Problem> {
    let file = folder.join(&**job.part);
    let error = std::fs::metadata(&file).err()?;
    let message = format!("cannot open the part {}: {error}", file.display());
    Some(job.part.problem(message))
}
