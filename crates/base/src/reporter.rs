//! Warnings as data: stages collect them through `&Reporter` and go on; they end in the verdict and the report.

use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::place::Place;

/// Something a person should know though the stage could go on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    /// Stable kebab-case identifier, such as `mesh-repaired`.
    pub code: String,
    /// What happened, with the numbers.
    pub message: String,
    /// Where, if it has a place.
    pub place: Option<Place>,
    /// What to do about it.
    pub remedy: Option<String>,
}

/// Collects warnings from any thread.
#[derive(Debug, Default)]
pub struct Reporter {
    warnings: Mutex<Vec<Warning>>,
}

impl Reporter {
    /// An empty reporter.
    pub fn new() -> Self {
        Self::default()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Warning>> {
        // a panic elsewhere leaves the list readable: pushing is its only mutation
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a warning.
    pub fn push(&self, warning: Warning) {
        self.lock().push(warning);
    }

    /// Adds a warning without place, with a remedy.
    ///
    /// ```
    /// use meltpath_base::Reporter;
    /// let reporter = Reporter::new();
    /// reporter.warn("unit-suspect", "the part is 0.06 mm wide", "say `part_unit = \"m\"` if it is in metres");
    /// assert_eq!(reporter.warnings()[0].code, "unit-suspect");
    /// ```
    pub fn warn(&self, code: &str, message: impl Into<String>, remedy: impl Into<String>) {
        let remedy = remedy.into();
        self.push(Warning {
            code: code.to_owned(),
            message: message.into(),
            place: None,
            remedy: (!remedy.is_empty()).then_some(remedy),
        });
    }

    /// Adds a warning that has a place.
    pub fn warn_at(
        &self,
        code: &str,
        message: impl Into<String>,
        place: Place,
        remedy: impl Into<String>,
    ) {
        let remedy = remedy.into();
        self.push(Warning {
            code: code.to_owned(),
            message: message.into(),
            place: Some(place),
            remedy: (!remedy.is_empty()).then_some(remedy),
        });
    }

    /// Takes what another has collected, in its order.
    pub fn absorb(&self, other: Reporter) {
        let warnings = other.warnings.into_inner();
        self.lock()
            .extend(warnings.unwrap_or_else(PoisonError::into_inner));
    }

    /// Everything collected so far, sorted by code, then by message, so that the order does not depend on threads.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut all = self.lock().clone();
        all.sort_by(|a, b| (&a.code, &a.message).cmp(&(&b.code, &b.message)));
        all
    }

    /// The warnings for people: of many with the same code the first `most` (in order of collection), and one that
    /// counts the others.
    ///
    /// ```
    /// let reporter = meltpath_base::Reporter::new();
    /// (1..=9).for_each(|i| reporter.warn("overhang", format!("layer {i}"), ""));
    /// let shown = reporter.digest(2);
    /// assert_eq!(shown.len(), 3);
    /// assert_eq!(shown[2].message, "and 7 more of the kind `overhang`");
    /// ```
    pub fn digest(&self, most: usize) -> Vec<Warning> {
        let mut all = self.lock().clone();
        all.sort_by(|a, b| a.code.cmp(&b.code));
        let mut shown: Vec<Warning> = Vec::new();
        for kind in all.chunk_by(|a, b| a.code == b.code) {
            shown.extend(kind.iter().take(most).cloned());
            if kind.len() > most {
                shown.push(Warning {
                    code: kind[0].code.clone(),
                    message: format!(
                        "and {} more of the kind `{}`",
                        kind.len() - most,
                        kind[0].code
                    ),
                    place: None,
                    remedy: None,
                });
            }
        }
        shown
    }
}
