//! One command for jobs of any process.

use std::path::Path;

use meltpath_base::settings::listing;
use meltpath_base::{Cancelled, Observer};

use crate::cancel::Stop;
use crate::ebm::{self, EbmError};
use crate::job::{self, Job, JobError, Reading};
use crate::lpbf::{self, LpbfError};
use crate::outcome::{Examined, Outcome, RunFolder, warning_line};
use crate::waam::{self, WaamError};

meltpath_base::passes_on! {
    /// Why a job could not be run. Everything here is the input's or the system's doing; nothing was written.
    pub enum RunError {
        /// The person stopped it.
        Cancelled[Cancelled],
        /// The job file.
        Job(JobError),
        /// A wire-arc job.
        Waam[WaamError],
        /// An electron-beam job.
        Ebm[EbmError],
        /// A scan-head job.
        Lpbf[LpbfError],
    }
}

/// What every process says alike is told apart from what is its own.
macro_rules! of_process {
    ($error:ident, $variant:ident) => {
        impl From<$error> for RunError {
            fn from(error: $error) -> Self {
                match error {
                    $error::Stop(Stop::Cancelled(c)) => RunError::Cancelled(c),
                    $error::Stop(Stop::Job(job)) => RunError::Job(job),
                    other => RunError::$variant(other),
                }
            }
        }
    };
}
of_process!(WaamError, Waam);
of_process!(EbmError, Ebm);
of_process!(LpbfError, Lpbf);

/// Runs the whole chain of a job.
///
/// # Errors
/// [`RunError`]; nothing is written then.
pub fn run(job: &Path, home: RunFolder, observer: &dyn Observer) -> Result<Outcome, RunError> {
    let text = job::text_of(job)?;
    let reading = job::read(&text);
    Ok(match &reading.job {
        None => return Err(refused(job, &text, reading).into()),
        Some(Job::Waam(_)) => waam::run(job, home, observer)?,
        Some(Job::Ebm(ebm)) => ebm::run(job, ebm, &text, home, observer)?,
        Some(Job::Lpbf(lpbf)) => lpbf::run(job, lpbf, &text, home, observer)?,
    })
}

/// Why a job that does not read is refused: what is wrong in its text, and with the files that its sound tables name.
fn refused(file: &Path, text: &str, reading: Reading) -> JobError {
    let folder = file.parent().unwrap_or(Path::new(""));
    let wrong = |table: &str| reading.wrong_keys.iter().any(|key| key.starts_with(table));
    let named = match &reading.draft {
        Some(Job::Waam(waam)) => waam::settings::named::problems(waam, folder, wrong),
        Some(Job::Ebm(ebm)) => ebm::settings::named(ebm, folder, wrong),
        Some(Job::Lpbf(lpbf)) => lpbf::settings::named(lpbf, folder, wrong),
        None => Vec::new(),
    };
    let mut problems = reading.problems;
    problems.extend(named);
    JobError::in_file(file, text, problems)
}

/// What `meltpath doctor` says of a job.
#[derive(Debug)]
pub struct Diagnosis {
    /// Every key by section with its value and where that comes from; notes and warnings.
    pub lines: Vec<String>,
    /// Why a run would refuse the job before it computes.
    pub refused: Option<RunError>,
}

impl Diagnosis {
    /// How many things are wrong.
    pub fn problems(&self) -> usize {
        match &self.refused {
            None => 0,
            Some(RunError::Job(JobError::Text { problems, .. })) => problems.len(),
            Some(_) => 1,
        }
    }
}

/// What is written, defaulted, computed and wrong in a job.
///
/// # Errors
/// [`RunError`] of a job file that cannot be read at all, or when cancelled.
pub fn doctor(file: &Path, observer: &dyn Observer) -> Result<Diagnosis, RunError> {
    let text = job::text_of(file)?;
    let reading = job::read(&text);
    let (table, provenance) = (reading.table, reading.provenance.clone());
    let wrong_keys = reading.wrong_keys.clone();
    let examined = match &reading.job {
        None => Err(refused(file, &text, reading).into()),
        Some(Job::Waam(_)) => waam::examine(file, observer).map_err(RunError::from),
        Some(Job::Ebm(ebm)) => ebm::examine(file, ebm, &text, observer).map_err(RunError::from),
        Some(Job::Lpbf(lpbf)) => lpbf::examine(file, lpbf, &text, observer).map_err(RunError::from),
    };
    let (examined, refused) = match examined {
        Ok(examined) => (examined, None),
        Err(RunError::Cancelled(c)) => return Err(RunError::Cancelled(c)),
        Err(refused) => {
            let examined = Examined {
                provenance,
                notes: Vec::new(),
                warnings: Vec::new(),
            };
            (examined, Some(refused))
        }
    };
    let mut lines = Vec::new();
    if let Some(table) = &table {
        lines = listing(table, &examined.provenance, &wrong_keys);
        lines.push(String::new());
    }
    lines.extend(examined.notes);
    lines.extend(examined.warnings.iter().map(warning_line));
    Ok(Diagnosis { lines, refused })
}
