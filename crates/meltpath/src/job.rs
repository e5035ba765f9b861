//! Job files: short, strict TOML in which everything not written has a stated default.
//!
//! `process.kind` selects the tables; those that every process shares are in [`common`], those of one process in their own file.
//! Every key is declared there once; whatever is wrong in a file is found at once, each with its place.

pub mod common;
pub mod ebm;
pub mod lpbf;
pub mod waam;

use std::ops::Deref;
use std::path::{Path, PathBuf};

use meltpath_base::Provenance;
pub use meltpath_base::settings::Problems;
use meltpath_base::settings::{self, Kind, Problem, Table, Value};

pub use common::{Direction, OneOrMany, PartUnit, ProcessKind, ProcessTable};
pub use ebm::EbmJob;
pub use lpbf::LpbfJob;
pub use waam::WaamJob;

/// The largest job file that is read.
const MAX_JOB_BYTES: u64 = 1 << 20;

/// A job of any process.
#[derive(Debug, Clone, PartialEq)]
pub enum Job {
    /// Wire-arc deposition by robot.
    Waam(Box<Written<WaamJob>>),
    /// Powder bed by electron beam.
    Ebm(Box<Written<EbmJob>>),
    /// Laser powder bed: the scan head.
    Lpbf(Box<Written<LpbfJob>>),
}

/// What a file says, every value with its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Written<T> {
    /// The tables.
    pub tables: T,
    /// Every value written and every default.
    pub provenance: Provenance,
}

impl<T> Deref for Written<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.tables
    }
}

/// Why a job file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The file cannot be read.
    #[error("cannot read the job file {}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something written in the file is wrong.
    #[error("{}", lines(.problems))]
    Text {
        /// The file.
        path: PathBuf,
        /// The whole text of the file, to show the places in.
        text: String,
        /// Everything found wrong.
        problems: Vec<Problem>,
    },
}

fn lines(problems: &[Problem]) -> String {
    let lines: Vec<String> = problems.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

impl JobError {
    /// Problems of a file, with its name and text.
    pub fn in_file(path: &Path, text: &str, problems: impl Into<Problems>) -> Self {
        JobError::Text {
            path: path.to_path_buf(),
            text: text.to_owned(),
            problems: problems.into().0,
        }
    }
}

/// A job's text, read as far as it reads.
#[derive(Debug, Clone)]
pub struct Reading {
    /// The job; none where anything is wrong.
    pub job: Option<Job>,
    /// A job in which something is wrong, as far as it reads: values that do not read have their defaults.
    pub draft: Option<Job>,
    /// What may be written, once the process is known.
    pub table: Option<Table>,
    /// Every value that reads, and every default.
    pub provenance: Provenance,
    /// The dotted names of keys whose value does not read.
    pub wrong_keys: Vec<String>,
    /// Everything wrong.
    pub problems: Vec<Problem>,
}

/// The tables of a process.
pub fn table_of(kind: ProcessKind) -> Option<Table> {
    let kind = match kind {
        ProcessKind::Waam => WaamJob::KIND,
        ProcessKind::Ebm => EbmJob::KIND,
        ProcessKind::Lpbf => LpbfJob::KIND,
    };
    match kind {
        Kind::Table(table) => Some(table),
        _ => None,
    }
}

/// Reads a job's text; everything wrong in it is found.
pub fn read(text: &str) -> Reading {
    match kind_of(text) {
        Ok(kind) => {
            let reading = match kind {
                ProcessKind::Waam => of_process(text, WaamJob::check, Job::Waam),
                ProcessKind::Ebm => of_process(text, EbmJob::check, Job::Ebm),
                ProcessKind::Lpbf => of_process(text, LpbfJob::check, Job::Lpbf),
            };
            Reading {
                table: table_of(kind),
                ..reading
            }
        }
        Err(problems) => Reading {
            job: None,
            draft: None,
            table: None,
            provenance: Provenance::new(),
            wrong_keys: Vec::new(),
            problems,
        },
    }
}

fn of_process<T: Value>(
    text: &str,
    check: fn(&T) -> Vec<Problem>,
    job: fn(Box<Written<T>>) -> Job,
) -> Reading {
    let mut read = settings::read::<T>(text);
    read.problems.extend(read.settings.iter().flat_map(check));
    let provenance = read.provenance.clone();
    let found = read
        .settings
        .map(|tables| job(Box::new(Written { tables, provenance })));
    let (job, draft) = if read.problems.is_empty() {
        (found, None)
    } else {
        (None, found)
    };
    Reading {
        job,
        draft,
        table: None,
        provenance: read.provenance,
        wrong_keys: read.wrong_keys,
        problems: read.problems,
    }
}

impl<T: Value> Written<T> {
    /// Reads a file and checks what `check` says of its values.
    ///
    /// # Errors
    /// Everything wrong.
    pub fn parse(text: &str, check: fn(&T) -> Vec<Problem>) -> Result<Self, Vec<Problem>> {
        let read = settings::read::<T>(text);
        let mut problems = read.problems;
        problems.extend(read.settings.iter().flat_map(check));
        match read.settings {
            Some(tables) if problems.is_empty() => Ok(Written {
                tables,
                provenance: read.provenance,
            }),
            _ => Err(problems),
        }
    }
}

/// The process of a job: all that is read before its tables are known.
fn kind_of(text: &str) -> Result<ProcessKind, Vec<Problem>> {
    settings::peek(text, &["process", "kind"])
        .map_err(|e| e.0)?
        .ok_or_else(|| {
            let missing = Problem::new("the job does not say which process it is for");
            vec![missing.help("add\n[process]\nkind = \"waam\"")]
        })
}

/// Reads a job's text.
///
/// # Errors
/// Everything wrong, each with its place and what to write.
///
/// ```
/// let text = "part = \"a.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = 3\nmat = \"m.toml\"\n";
/// let problems = meltpath::job::parse(text).unwrap_err();
/// assert_eq!(problems.len(), 2);
/// assert_eq!(problems[1].fix.as_deref(), Some("map"));
/// ```
pub fn parse(text: &str) -> Result<Job, Vec<Problem>> {
    let reading = read(text);
    reading.job.ok_or(reading.problems)
}

/// A job file's text.
///
/// # Errors
/// [`JobError::Io`].
pub fn text_of(path: &Path) -> Result<String, JobError> {
    let io = |source| JobError::Io {
        path: path.to_path_buf(),
        source,
    };
    let size = std::fs::metadata(path).map_err(io)?.len();
    if size > MAX_JOB_BYTES {
        return Err(io(std::io::Error::other(format!(
            "{size} bytes are too many for a job file; is it the part?"
        ))));
    }
    crate::text_file::read(path).map_err(io)
}

/// Reads a job file: the job and its text.
///
/// # Errors
/// [`JobError`] with the file, the places in it and what to write.
pub fn load(path: &Path) -> Result<(Job, String), JobError> {
    let text = text_of(path)?;
    match parse(&text) {
        Ok(job) => Ok((job, text)),
        Err(problems) => Err(JobError::in_file(path, &text, problems)),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::parse;

    /// Rows of `what is written => what is written in its place => what is said`, with `\n` where a line ends: each mistake is told
    /// once, at its place.
    pub(crate) fn told_where_they_are(whole: &str, table: &str) {
        for row in table.trim().lines() {
            let row = row.replace("\\n", "\n");
            let columns: Vec<&str> = row.split("=>").map(str::trim).collect();
            let [right, wrong, said] = columns[..] else {
                panic!("three columns: {row}")
            };
            assert!(whole.contains(right), "{right}");
            let problems = parse(&whole.replace(right, wrong)).unwrap_err();
            assert_eq!(problems.len(), 1, "{problems:?}");
            let told = problems[0].to_string();
            assert!(told.contains(said), "{said}: {told}");
            assert!(problems[0].span.is_some(), "{told}");
        }
    }
}
