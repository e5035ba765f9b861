//! The whole chain of a job of any process.

use std::path::Path;

use meltpath_base::Observer;

use crate::job::{self, Job};
use crate::waam::{Outcome, RunError};
use crate::{lpbf, waam};

/// Runs a job: a new folder `out`, else the next free number in `runs`.
///
/// # Errors
/// [`RunError`]; nothing is written then.
pub fn run(
    path: &Path,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Outcome, RunError> {
    match job::load(path)? {
        (Job::Waam(_), _) => waam::run(path, out, runs, observer),
        (Job::Lpbf(job), text) => lpbf::run(path, &job, &text, out, runs, observer),
    }
}
