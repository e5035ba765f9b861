//! Checks and verdicts: what was asked, what was found, how sure we are, where, and what to do.
//!
//! The decision rule keeps one standard uncertainty on either side of the limit, after the guard bands of ISO 14253-1:
//! a value clearly beyond the limit fails; a value clearly within passes; between the two, a warning, or, where the
//! uncertainty alone exceeds the limit, the honest answer: "cannot say".

use serde::{Deserialize, Serialize};

use crate::place::Place;

/// Version of the JSON written for a [`Verdict`].
pub const VERDICT_SCHEMA: &str = "meltpath-verdict/1";

/// The outcome of a check, from best to worst for the whole verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// No model computed it; the reason says which. It does not count for the whole.
    NotChecked,
    /// Within the limit by more than the uncertainty.
    Pass,
    /// Within one standard uncertainty of the limit, or informative and unusual.
    Warn,
    /// The uncertainty exceeds the limit.
    CannotSay,
    /// Beyond the limit by more than the uncertainty.
    Fail,
}

impl Status {
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
    /// What was asked.
    pub limit: Option<Limit>,
    /// Where the value was found.
    pub place: Option<Place>,
    /// The outcome explained in a sentence.
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
    /// ```
    pub fn judge(id: &str, title: &str, value: Measure, limit: Limit) -> Self {
        let sigma = value.sigma.unwrap_or(0.0);
        let (bound, beyond, word) = match limit {
            Limit::AtMost(bound) => (bound, value.value - bound, "at most"),
            Limit::AtLeast(bound) => (bound, bound - value.value, "at least"),
        };
        let status = if !beyond.is_finite() || !sigma.is_finite() {
            Status::CannotSay
        } else if beyond > sigma {
            Status::Fail
        } else if beyond <= -sigma {
            Status::Pass
        } else if sigma > bound.abs() {
            Status::CannotSay
        } else {
            Status::Warn
        };
        let unit = &value.unit;
        let spaced = if unit.is_empty() {
            String::new()
        } else {
            format!(" {unit}")
        };
        let found = if sigma > 0.0 {
            format!("{} ± {}{spaced}", digits(value.value), digits(sigma))
        } else {
            format!("{}{spaced}", digits(value.value))
        };
        let asked = format!("{word} {}{spaced}", digits(bound));
        let reason = match status {
            Status::Pass => format!("{found}, asked {asked}"),
            Status::Warn => {
                format!("{found}: within one standard uncertainty of the limit, {asked}")
            }
            Status::CannotSay => {
                format!("{found}: the uncertainty is larger than the limit, {asked}")
            }
            Status::Fail | Status::NotChecked => format!("{found}, but asked {asked}"),
        };
        Check {
            id: id.to_owned(),
            title: title.to_owned(),
            status,
            value: Some(value),
            limit: Some(limit),
            place: None,
            reason,
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

/// Four significant digits, without an exponent.
fn digits(v: f64) -> String {
    if !v.is_finite() {
        return "unknown".to_owned();
    }
    let magnitude = if v == 0.0 {
        0.0
    } else {
        v.abs().log10().floor()
    };
    let decimals = (3.0 - magnitude).clamp(0.0, 6.0) as usize;
    let text = format!("{v:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Every check of a run and the warnings collected on the way.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// The checks, in the order a person reads them.
    pub checks: Vec<Check>,
    /// The warnings of all stages.
    pub warnings: Vec<crate::reporter::Warning>,
}

impl Verdict {
    /// The worst status over the checks; `NotChecked` where nothing was checked.
    pub fn status(&self) -> Status {
        self.checks
            .iter()
            .map(|c| c.status)
            .max()
            .unwrap_or(Status::Pass)
    }

    /// The verdict as JSON with its schema version.
    pub fn to_json(&self) -> serde_json::Value {
        serde_json::json!({
            "schema": VERDICT_SCHEMA,
            "status": self.status(),
            "checks": self.checks,
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
        assert_eq!(
            judge(3.9, 3.0).reason,
            "3.9 ± 3 mm, but asked at least 8 mm"
        );
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
            warnings: vec![],
        };
        assert_eq!(verdict.status(), Status::Warn);
        assert_eq!(verdict.to_json()["status"], "warn");
    }
}
