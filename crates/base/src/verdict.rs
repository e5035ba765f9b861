//! Verdicts: checks (what was found, its limit, how sure we are, where, what to do) and facts (told, without a limit).
//!
//! The decision rule keeps one standard uncertainty on either side of the limit, after the guard bands of ISO 14253-1:
//! a value clearly beyond the limit fails; a value clearly within passes; between the two, a warning, or, where the
//! uncertainty alone exceeds the limit, the honest answer: "cannot say".

use serde::{Deserialize, Serialize};

use crate::number::{significant, with_uncertainty};
use crate::place::Place;

/// Version of the JSON written for a [`Verdict`].
pub const VERDICT_SCHEMA: &str = "meltpath-verdict/2";

/// The outcome of a check, from best to worst for the whole verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// No model computed it; the reason says which. It does not count for the whole.
    NotChecked,
    /// Within the limit by more than the uncertainty.
    Pass,
    /// Within one standard uncertainty of the limit, or to be looked at for the reason told.
    Warn,
    /// The uncertainty exceeds the limit.
    CannotSay,
    /// Beyond the limit by more than the uncertainty.
    Fail,
}

impl Status {
    /// The order in which a person reads checks: what fails, what cannot be said, what is near its limit, what was not
    /// checked, what passes.
    pub const READING: [Status; 5] = [
        Status::Fail,
        Status::CannotSay,
        Status::Warn,
        Status::NotChecked,
        Status::Pass,
    ];

    /// The words a report shows.
    pub fn words(self) -> &'static str {
        match self {
            Status::Pass => "pass",
            Status::NotChecked => "not checked",
            Status::Warn => "warn",
            Status::CannotSay => "cannot say",
            Status::Fail => "fail",
        }
    }
}

/// A measured or predicted value with its unit and standard uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// The value in `unit`.
    pub value: f64,
    /// One standard deviation, in `unit`; `None` when not known.
    pub sigma: Option<f64>,
    /// Unit as written for people, such as `mm` or `%`.
    pub unit: String,
}

impl Measure {
    /// A value with its standard uncertainty.
    pub fn new(value: f64, sigma: f64, unit: &str) -> Self {
        Measure {
            value,
            sigma: Some(sigma),
            unit: unit.to_owned(),
        }
    }

    /// A value counted or computed exactly.
    pub fn exact(value: f64, unit: &str) -> Self {
        Measure {
            value,
            sigma: Some(0.0),
            unit: unit.to_owned(),
        }
    }
}

impl std::fmt::Display for Measure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let number = match self.sigma {
            Some(sigma) => with_uncertainty(self.value, sigma),
            None => significant(self.value, 4),
        };
        f.write_str(&number)?;
        if self.unit.is_empty() {
            return Ok(());
        }
        write!(f, " {}", self.unit)
    }
}

/// A bound on a measure, in the measure's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// The value must not exceed this.
    AtMost(f64),
    /// The value must not fall below this.
    AtLeast(f64),
}

/// One named check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Stable kebab-case identifier, such as `ctwd-min`.
    pub id: String,
    /// What was checked, in words.
    pub title: String,
    /// The outcome.
    pub status: Status,
    /// What was found.
    pub value: Option<Measure>,
    /// What it is held against.
    pub limit: Option<Limit>,
    /// Where the value was found.
    pub place: Option<Place>,
    /// What value and limit do not say of the outcome; often nothing.
    pub reason: String,
    /// What to change.
    pub remedy: Option<String>,
}

impl Check {
    /// Judges `value` against `limit` by the module's decision rule.
    ///
    /// ```
    /// use meltpath_base::{Check, Limit, Measure, Status};
    /// let judge = |v, s| Check::judge("x", "X", Measure::new(v, s, "mm"), Limit::AtMost(1.0)).status;
    /// assert_eq!(judge(0.5, 0.1), Status::Pass);
    /// assert_eq!(judge(0.95, 0.1), Status::Warn);
    /// assert_eq!(judge(1.2, 0.1), Status::Fail);
    /// assert_eq!(judge(0.5, 2.0), Status::CannotSay);
    /// assert_eq!(judge(9.0, 2.0), Status::Fail);
    /// assert_eq!(judge(f64::NAN, 0.1), Status::CannotSay);
    /// let share = Measure::new(89.0, 40.0, "%");
    /// assert_eq!(Check::judge("x", "X", share, Limit::AtLeast(98.0)).status, Status::CannotSay);
    /// ```
    pub fn judge(id: &str, title: &str, value: Measure, limit: Limit) -> Self {
        let sigma = value.sigma.unwrap_or(0.0);
        let (bound, beyond) = match limit {
            Limit::AtMost(bound) => (bound, value.value - bound),
            Limit::AtLeast(bound) => (bound, bound - value.value),
        };
        // of a share of a hundred what may lack is the limit
        let room = match limit {
            Limit::AtLeast(bound) if value.unit == "%" && (0.0..100.0).contains(&bound) => {
                bound.min(100.0 - bound)
            }
            _ => bound.abs(),
        };
        let status = if !beyond.is_finite() || !sigma.is_finite() {
            Status::CannotSay
        } else if beyond > sigma {
            Status::Fail
        } else if beyond <= -sigma {
            Status::Pass
        } else if sigma > room {
            Status::CannotSay
        } else {
            Status::Warn
        };
        let reason = match status {
            Status::Warn => "within one standard uncertainty of the limit",
            Status::CannotSay if !beyond.is_finite() => "the value is not known",
            Status::CannotSay => "the uncertainty is larger than the limit",
            Status::Pass | Status::Fail | Status::NotChecked => "",
        };
        Check {
            id: id.to_owned(),
            title: title.to_owned(),
            status,
            value: Some(value),
            limit: Some(limit),
            place: None,
            reason: reason.to_owned(),
            remedy: None,
        }
    }

    /// A check that no model of this version computes; `reason` says so.
    pub fn not_checked(id: &str, title: &str, reason: &str) -> Self {
        Check {
            id: id.to_owned(),
            title: title.to_owned(),
            status: Status::NotChecked,
            value: None,
            limit: None,
            place: None,
            reason: reason.to_owned(),
            remedy: None,
        }
    }

    /// The same check with the place of its value.
    #[must_use]
    pub fn at(self, place: Place) -> Self {
        Check {
            place: Some(place),
            ..self
        }
    }

    /// The same check with one more reason.
    #[must_use]
    pub fn because(mut self, reason: &str) -> Self {
        if !self.reason.is_empty() {
            self.reason.push_str("; ");
        }
        self.reason.push_str(reason);
        self
    }

    /// Value, limit and reason in one line.
    ///
    /// ```
    /// use meltpath_base::{Check, Limit, Measure};
    /// let check = Check::judge("x", "X", Measure::new(0.95, 0.1, "mm"), Limit::AtMost(1.0));
    /// assert_eq!(check.line(), "0.95 ± 0.1 mm, limit at most 1 mm; within one standard uncertainty of the limit");
    /// ```
    pub fn line(&self) -> String {
        let mut parts = Vec::new();
        if let Some(value) = &self.value {
            let bound = match self.limit {
                Some(Limit::AtMost(bound)) => Some(("at most", bound)),
                Some(Limit::AtLeast(bound)) => Some(("at least", bound)),
                None => None,
            };
            let bound = bound.map_or(String::new(), |(word, bound)| {
                format!(
                    ", limit {word} {}",
                    Measure {
                        value: bound,
                        sigma: None,
                        ..value.clone()
                    }
                )
            });
            parts.push(format!("{value}{bound}"));
        }
        if !self.reason.is_empty() {
            parts.push(self.reason.clone());
        }
        parts.join("; ")
    }

    /// The same check with what to change, kept only where something is to be changed.
    #[must_use]
    pub fn remedy(self, remedy: impl Into<String>) -> Self {
        let wanted = matches!(self.status, Status::Warn | Status::Fail | Status::CannotSay);
        Check {
            remedy: wanted.then(|| remedy.into()),
            ..self
        }
    }
}

/// Something a run tells that has no limit, such as the wire it takes: nothing passes or fails by it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fact {
    /// Stable kebab-case identifier, such as `time-total`.
    pub id: String,
    /// What it is, in words.
    pub title: String,
    /// How much; `None` where it is told in words or not known.
    pub value: Option<Measure>,
    /// Where it was found.
    pub place: Option<Place>,
    /// What the value does not say; often nothing.
    pub reason: String,
}

impl Fact {
    /// A value and what is to be said of it beyond the number.
    pub fn new(id: &str, title: &str, value: Measure, reason: &str) -> Self {
        Fact {
            value: Some(value),
            ..Fact::words(id, title, reason)
        }
    }

    /// Something told in words alone.
    pub fn words(id: &str, title: &str, reason: &str) -> Self {
        Fact {
            id: id.to_owned(),
            title: title.to_owned(),
            value: None,
            place: None,
            reason: reason.to_owned(),
        }
    }

    /// Value and words in one line.
    pub fn line(&self) -> String {
        match (&self.value, self.reason.as_str()) {
            (Some(value), "") => value.to_string(),
            (Some(value), reason) => format!("{value}, {reason}"),
            (None, reason) => reason.to_owned(),
        }
    }

    /// The same fact with its place.
    #[must_use]
    pub fn at(self, place: Place) -> Self {
        Fact {
            place: Some(place),
            ..self
        }
    }
}

/// Every check of a run, what it tells beside them, and the warnings collected on the way.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The checks, in the order in which they were made.
    pub checks: Vec<Check>,
    /// What is told without a limit.
    pub facts: Vec<Fact>,
    /// The warnings of all stages.
    pub warnings: Vec<crate::reporter::Warning>,
}

impl Verdict {
    /// The worst status over the checks; `NotChecked` where nothing was judged.
    pub fn status(&self) -> Status {
        self.checks
            .iter()
            .map(|c| c.status)
            .max()
            .unwrap_or(Status::NotChecked)
    }

    /// The checks in the order of [`Status::READING`], otherwise as they were made.
    pub fn in_reading_order(&self) -> Vec<&Check> {
        let mut checks: Vec<&Check> = self.checks.iter().collect();
        checks.sort_by_key(|c| Status::READING.iter().position(|s| *s == c.status));
        checks
    }

    /// The sentence that stands first: what the checks say together.
    ///
    /// ```
    /// use meltpath_base::{Check, Verdict};
    /// let checks = vec![Check::not_checked("reach", "Reach", "no cell model")];
    /// let verdict = Verdict { checks, ..Verdict::default() };
    /// assert_eq!(verdict.sentence(), "1 of 1 check was not made.");
    /// ```
    pub fn sentence(&self) -> String {
        let total = self.checks.len();
        let checks = if total == 1 { "check" } else { "checks" };
        let said = |status, one: &str, many: &str| {
            let n = self.checks.iter().filter(|c| c.status == status).count();
            let verb = if n == 1 { one } else { many };
            (n > 0).then(|| format!("{n} of {total} {checks} {verb}."))
        };
        let told: Vec<String> = [
            said(Status::Fail, "fails", "fail"),
            said(Status::CannotSay, "cannot be decided", "cannot be decided"),
            said(Status::Warn, "asks to be looked at", "ask to be looked at"),
            said(Status::NotChecked, "was not made", "were not made"),
        ]
        .into_iter()
        .flatten()
        .collect();
        match (total, told.is_empty()) {
            (0, _) => "Nothing was judged.".to_owned(),
            (1, true) => "The check passes.".to_owned(),
            (_, true) => format!("All {total} checks pass."),
            (_, false) => told.join(" "),
        }
    }

    /// The verdict as JSON with its schema version, checks in reading order.
    pub fn to_json(&self) -> serde_json::Value {
        serde_json::json!({
            "schema": VERDICT_SCHEMA,
            "status": self.status(),
            "checks": self.in_reading_order(),
            "facts": self.facts,
            "warnings": self.warnings,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lower_limits_mirror_upper_ones() {
        let judge = |v, s| Check::judge("c", "C", Measure::new(v, s, "mm"), Limit::AtLeast(8.0));
        assert_eq!(judge(12.0, 1.0).status, Status::Pass);
        assert_eq!(judge(8.5, 1.0).status, Status::Warn);
        assert_eq!(judge(3.9, 3.0).status, Status::Fail);
        assert_eq!(judge(12.0, 9.0).status, Status::CannotSay);
        assert_eq!(judge(3.9, 3.0).line(), "3.9 ± 3 mm, limit at least 8 mm");
    }

    #[test]
    fn an_exact_zero_limit_can_be_judged() {
        let check = Check::judge("n", "N", Measure::exact(0.0, ""), Limit::AtMost(0.0));
        assert_eq!(check.status, Status::Pass);
        let check = Check::judge("n", "N", Measure::exact(2.0, ""), Limit::AtMost(0.0));
        assert_eq!(check.status, Status::Fail);
    }

    #[test]
    fn the_worst_check_decides() {
        let check = |status| Check {
            status,
            ..Check::not_checked("a", "A", "")
        };
        let verdict = Verdict {
            checks: vec![check(Status::NotChecked), check(Status::Warn)],
            ..Verdict::default()
        };
        assert_eq!(verdict.status(), Status::Warn);
        assert_eq!(verdict.to_json()["status"], "warn");
        let both = Verdict {
            checks: vec![check(Status::CannotSay), check(Status::Fail)],
            ..Verdict::default()
        };
        assert_eq!(both.status(), Status::Fail);
        assert_eq!(Verdict::default().status(), Status::NotChecked);
    }

    #[test]
    fn what_fails_is_read_first_and_what_passes_last() {
        let check = |id: &str, status| Check {
            status,
            ..Check::not_checked(id, id, "")
        };
        let verdict = Verdict {
            checks: vec![
                check("pass", Status::Pass),
                check("unchecked", Status::NotChecked),
                check("warn", Status::Warn),
                check("fail-1", Status::Fail),
                check("unsure", Status::CannotSay),
                check("fail-2", Status::Fail),
            ],
            facts: vec![Fact::new("wire", "wire", Measure::exact(2.0, "kg"), "")],
            ..Verdict::default()
        };
        let json = verdict.to_json();
        let ids: Vec<&str> = json["checks"]
            .as_array()
            .unwrap()
            .iter()
            .map(|c| c["id"].as_str().unwrap())
            .collect();
        assert_eq!(
            ids,
            ["fail-1", "fail-2", "unsure", "warn", "unchecked", "pass"]
        );
        assert_eq!(json["facts"][0]["id"], "wire");
        assert_eq!(
            verdict.sentence(),
            "2 of 6 checks fail. 1 of 6 checks cannot be decided. 1 of 6 checks asks to be looked at. 1 of 6 checks was not made."
        );
    }

    #[test]
    fn nothing_is_said_twice() {
        let pass = Check::judge("n", "N", Measure::new(0.2, 0.1, "mm"), Limit::AtMost(1.0));
        assert_eq!(pass.reason, "");
        assert_eq!(pass.line(), "0.2 ± 0.1 mm, limit at most 1 mm");
        let more = pass.because("layer 3").because("at a corner");
        assert_eq!(more.reason, "layer 3; at a corner");
        let unknown = Check::judge("n", "N", Measure::exact(f64::NAN, "mm"), Limit::AtMost(1.0));
        assert_eq!(unknown.reason, "the value is not known");
    }
}
