//! What a command leaves: a folder with its verdict, or the reason why not; and what every run writes of itself.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Provenance, Verdict, Warning};
use meltpath_report::html::{Report, ReportError, write_html};

use crate::job::JobError;

/// What a run made.
#[derive(Debug)]
pub struct Outcome {
    /// The folder.
    pub folder: PathBuf,
    /// The verdict.
    pub verdict: Verdict,
}

/// What a process says of a job that it can run.
#[derive(Debug, Clone)]
pub struct Examined {
    /// Every value with its origin.
    pub provenance: Provenance,
    /// What it will cost and where its data come from.
    pub notes: Vec<String>,
    /// What should be known though it runs.
    pub warnings: Vec<Warning>,
}

pub(crate) fn json(
    folder: &OutputFolder,
    name: &str,
    value: &serde_json::Value,
) -> Result<(), OutputError> {
    folder.write(name, |w| {
        serde_json::to_writer_pretty(&mut *w, value)?;
        w.write_all(b"\n")
    })
}

/// What every run tells of itself: the report's page, its verdict, and where its values come from.
pub(crate) fn tell(folder: &OutputFolder, report: &Report) -> Result<(), OutputError> {
    folder.write("report.html", |w| {
        write_html(w, report).map_err(|e| match e {
            ReportError::Io(e) => e,
            ReportError::Scene(e) => std::io::Error::other(e),
        })
    })?;
    json(folder, "verdict.json", &report.verdict.to_json())?;
    // plain structs of numbers and strings: their JSON exists
    let provenance = serde_json::to_value(&report.provenance).unwrap_or_default();
    json(folder, "provenance.json", &provenance)
}

/// Writes a command's folder: what every run tells, and what else `files` writes.
pub(crate) fn leave(
    home: RunFolder,
    report: &Report,
    files: impl FnOnce(&OutputFolder) -> Result<(), OutputError>,
) -> Result<PathBuf, OutputError> {
    let folder = home.create()?;
    tell(&folder, report)?;
    files(&folder)?;
    folder.commit()
}

/// Where a command leaves what it makes.
#[derive(Debug, Clone, Copy)]
pub enum RunFolder<'a> {
    /// This new folder.
    At(&'a Path),
    /// The next free number in this one.
    NextIn(&'a Path),
}

impl<'a> RunFolder<'a> {
    /// `out` where a folder was asked for, else the next in `runs`.
    pub fn asked(out: Option<&'a Path>, runs: &'a Path) -> Self {
        out.map_or(RunFolder::NextIn(runs), RunFolder::At)
    }

    /// Where a run keeps what it needs to go on after it was interrupted: beside its folder, or beside the other runs'.
    pub(crate) fn interrupted(&self) -> PathBuf {
        match self {
            RunFolder::At(folder) => {
                let name = folder.file_name().unwrap_or_default().to_string_lossy();
                folder.with_file_name(format!("{name}-interrupted"))
            }
            RunFolder::NextIn(runs) => runs.join("interrupted"),
        }
    }

    pub(crate) fn create(self) -> Result<OutputFolder, OutputError> {
        match self {
            RunFolder::At(folder) => OutputFolder::create(folder),
            RunFolder::NextIn(runs) => OutputFolder::create_numbered(runs),
        }
    }
}

pub(crate) fn record_inputs(provenance: &mut Provenance, files: &[&Path]) -> Result<(), JobError> {
    for path in files {
        let failed = |source| JobError::Io {
            path: path.to_path_buf(),
            source,
        };
        let mut reader = BufReader::new(File::open(path).map_err(failed)?);
        let hash = meltpath_base::provenance::sha256(&mut reader).map_err(failed)?;
        let name = path
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        provenance.inputs.insert(name, hash);
    }
    Ok(())
}

/// A warning with what to do about it.
pub(crate) fn warning_line(warning: &Warning) -> String {
    let remedy = warning.remedy.iter().map(|r| format!("; {r}"));
    format!("note: {}{}", warning.message, remedy.collect::<String>())
}
