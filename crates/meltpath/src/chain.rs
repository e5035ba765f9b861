//! One command for jobs of any process.

use std::path::Path;

use meltpath_base::Observer;

use crate::job::{self, Job};
use crate::outcome::{Outcome, RunError};
use crate::{ebm, lpbf, waam};

/// Runs the whole chain of a job: a new folder `out`, else the next free number in `runs`.
///
/// # Errors
/// [`RunError`]; nothing is written then.
pub fn run(
    job: &Path,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Outcome, RunError> {
    match job::load(job)? {
        (Job::Waam(_), _) => waam::run(job, out, runs, observer),
        (Job::Ebm(ebm), text) => ebm::run(job, &ebm, &text, out, runs, observer),
        (Job::Lpbf(lpbf), text) => lpbf::run(job, &lpbf, &text, out, runs, observer),
    }
}

/// What is missing, defaulted or inconsistent in a job.
///
/// # Errors
/// [`RunError`].
pub fn doctor(job: &Path) -> Result<Vec<String>, RunError> {
    match job::load(job)? {
        (Job::Waam(_), _) => waam::doctor(job),
        (Job::Ebm(ebm), text) => ebm::doctor(job, &ebm, &text),
        (Job::Lpbf(lpbf), text) => lpbf::doctor(job, &lpbf, &text),
    }
}
