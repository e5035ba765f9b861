//! The dated tests of an axis: `NAME.jsonl`, one line a test.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use meltpath_scan_head::health::rating::{Drift, Km0Record, Rating};
use serde::{Deserialize, Serialize};

/// The form of a line.
const SCHEMA: &str = "meltpath-km0/2";
/// Tests whose motors were fitted without their modes: inertia some 10 % high.
const WITHOUT_MODES: &str = "meltpath-km0/1";

/// Why a history cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    /// The system refused.
    #[error("cannot use the history {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A line that is no test.
    #[error(
        "line {line} of the history {} cannot be used ({message}); nothing was added. Repair or remove the line", path.display()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
}

/// A test as it stands in the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The form of the line.
    pub schema: String,
    /// Whether later tests are compared with this one.
    pub accepted: bool,
    /// The rating at the time of the test.
    pub rating: Rating,
    /// The quantities behind a rating that is not good.
    pub reasons: Vec<String>,
    /// What was found.
    pub record: Km0Record,
}

impl Entry {
    /// A test with its rating.
    pub fn new(record: Km0Record, accepted: bool, rating: Rating, drifts: &[Drift]) -> Self {
        let reasons = drifts
            .iter()
            .filter(|d| d.rating != Rating::Good)
            .map(|d| format!("{} {:+.1} %", d.quantity, 100.0 * d.change))
            .collect();
        Entry {
            schema: SCHEMA.to_owned(),
            accepted,
            rating,
            reasons,
            record,
        }
    }
}

/// The tests of an axis, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    path: PathBuf,
    entries: Vec<Entry>,
}

impl History {
    /// Opens the history of an axis in a folder; an absent one is empty.
    ///
    /// # Errors
    /// [`HistoryError`] with the line that cannot be read.
    pub fn open(folder: &Path, name: &str) -> Result<Self, HistoryError> {
        let plain: String = name
            .chars()
            .map(|c| {
                if c.is_alphanumeric() || c == '-' {
                    c
                } else {
                    '_'
                }
            })
            .collect();
        let path = folder.join(format!("{plain}.jsonl"));
        let io = |source| HistoryError::Io {
            path: path.clone(),
            source,
        };
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(e) => return Err(io(e)),
        };
        let mut entries = Vec::new();
        for (k, line) in text.lines().enumerate() {
            let wrong = |message: String| HistoryError::Line {
                path: path.clone(),
                line: k + 1,
                message,
            };
            let entry: Entry = serde_json::from_str(line).map_err(|e| wrong(e.to_string()))?;
            if entry.schema == WITHOUT_MODES {
                return Err(wrong(
                    "it was analysed by an earlier version, which fitted motors without their modes: its figures do not compare. Begin a new history in another folder, and analyse the healthy axis' records anew first".to_owned(),
                ));
            }
            if entry.schema != SCHEMA {
                return Err(wrong(format!(
                    "its schema is \"{}\", this version reads \"{SCHEMA}\"",
                    entry.schema
                )));
            }
            if entry.record.axis != name {
                return Err(wrong(format!(
                    "it is a test of \"{}\", not of \"{name}\"",
                    entry.record.axis
                )));
            }
            entries.push(entry);
        }
        Ok(History { path, entries })
    }

    /// The tests, oldest first.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The test to compare with: the last accepted one, else the first.
    pub fn reference(&self) -> Option<&Km0Record> {
        let accepted = self.entries.iter().rev().find(|e| e.accepted);
        accepted.or(self.entries.first()).map(|e| &e.record)
    }

    /// Adds a test at the end of the file.
    ///
    /// # Errors
    /// [`HistoryError::Io`].
    pub fn add(&mut self, entry: Entry) -> Result<(), HistoryError> {
        let io = |source| HistoryError::Io {
            path: self.path.clone(),
            source,
        };
        let mut line = serde_json::to_string(&entry).map_err(|e| io(e.into()))?;
        line.push('\n');
        // a last line that was written by hand may lack its end
        let open = fs::read(&self.path).is_ok_and(|t| t.last().is_some_and(|end| *end != b'\n'));
        if open {
            line.insert(0, '\n');
        }
        if let Some(folder) = self.path.parent() {
            fs::create_dir_all(folder).map_err(io)?;
        }
        // one write of one whole line
        OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.path)
            .and_then(|mut f| f.write_all(line.as_bytes()))
            .map_err(io)?;
        self.entries.push(entry);
        Ok(())
    }
}
