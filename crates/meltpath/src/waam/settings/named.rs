//! The files that a wire-arc job names: what is wrong with them.

use std::path::Path;

use meltpath_base::settings::{File, Problem, Setting};
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

/// Why the part, or the body that it grows out of, cannot be opened, at its key.
pub(in crate::waam) fn absent_part(job: &WaamJob, folder: &Path) -> Option<Problem> {
    let body = job.onto.as_ref().map(|onto| (&onto.body, "the body"));
    let mut files = std::iter::once((&job.part, "the part")).chain(body);
    let absent = |(key, what): (&Setting<File>, &str)| {
        let file = folder.join(&***key);
        let error = std::fs::metadata(&file).err()?;
        let message = format!("cannot open {what} {}: {error}", file.display());
        Some(key.problem(message))
    };
    files.find_map(absent)
}
