//! The verdict in words and signs: colour is never the only difference between outcomes.

use std::fmt::Write as _;

use meltpath_base::{Check, Limit, Status, Verdict, Warning};

use crate::escape::escape;
use crate::number::{significant, with_uncertainty};

/// Warnings of one code that are listed one by one; the rest is counted.
const LISTED: usize = 20;

/// Worst first: what a person must act on stands at the top.
const ORDER: [Status; 5] = [
    Status::Fail,
    Status::CannotSay,
    Status::Warn,
    Status::NotChecked,
    Status::Pass,
];

fn class(status: Status) -> &'static str {
    match status {
        Status::Pass => "pass",
        Status::NotChecked => "unchecked",
        Status::Warn => "warn",
        Status::CannotSay => "unsure",
        Status::Fail => "fail",
    }
}

/// A sign that reads without colour.
fn icon(status: Status) -> &'static str {
    match status {
        Status::Pass => {
            "<svg class=\"icon\" viewBox=\"0 0 20 20\" aria-hidden=\"true\"><circle cx=\"10\" cy=\"10\" r=\"9\"/><path d=\"M5.5 10.5l3 3 6-7\"/></svg>"
        }
        Status::NotChecked => {
            "<svg class=\"icon\" viewBox=\"0 0 20 20\" aria-hidden=\"true\"><circle cx=\"10\" cy=\"10\" r=\"9\"/><path d=\"M5.5 10h9\"/></svg>"
        }
        Status::Warn => {
            "<svg class=\"icon\" viewBox=\"0 0 20 20\" aria-hidden=\"true\"><path class=\"body\" d=\"M10 1.5L19.3 18H.7z\"/><path d=\"M10 7v5.5m0 2v.6\"/></svg>"
        }
        Status::CannotSay => {
            "<svg class=\"icon\" viewBox=\"0 0 20 20\" aria-hidden=\"true\"><circle cx=\"10\" cy=\"10\" r=\"9\"/><path d=\"M7.2 7.6a2.8 2.8 0 1 1 4.3 2.4c-1 .6-1.5 1.1-1.5 2.2m0 2.4v.6\"/></svg>"
        }
        Status::Fail => {
            "<svg class=\"icon\" viewBox=\"0 0 20 20\" aria-hidden=\"true\"><path class=\"body\" d=\"M6.2 1h7.6L19 6.2v7.6L13.8 19H6.2L1 13.8V6.2z\"/><path d=\"M6.5 6.5l7 7m0-7l-7 7\"/></svg>"
        }
    }
}

/// The sentence that stands first: what the checks say together.
///
/// ```
/// use meltpath_base::{Check, Verdict};
/// let verdict = Verdict { checks: vec![Check::not_checked("reach", "Reach", "no cell model")], warnings: vec![] };
/// assert_eq!(
///     meltpath_report::verdict_html::sentence(&verdict),
///     "Nothing fails, but 1 of 1 check was not made."
/// );
/// ```
pub fn sentence(verdict: &Verdict) -> String {
    let total = verdict.checks.len();
    let count = |status| verdict.checks.iter().filter(|c| c.status == status).count();
    let (fail, unsure, warn, unchecked) = (
        count(Status::Fail),
        count(Status::CannotSay),
        count(Status::Warn),
        count(Status::NotChecked),
    );
    let checks = if total == 1 { "check" } else { "checks" };
    let verb = |n: usize, one: &str, many: &str| {
        if n == 1 {
            one.to_owned()
        } else {
            many.to_owned()
        }
    };
    if total == 0 {
        return "Nothing was checked.".to_owned();
    }
    if fail > 0 {
        let more = if unsure > 0 {
            format!(" {unsure} more cannot be decided.")
        } else {
            String::new()
        };
        return format!(
            "{fail} of {total} {checks} {}: what was asked is not met.{more}",
            verb(fail, "fails", "fail")
        );
    }
    if unsure > 0 {
        return format!(
            "Nothing fails, but {unsure} of {total} {checks} cannot be decided: the uncertainty is larger than the limit."
        );
    }
    if warn > 0 {
        return format!(
            "Nothing fails, but {warn} of {total} {checks} {} to be looked at.",
            verb(warn, "asks", "ask")
        );
    }
    if unchecked > 0 {
        return format!(
            "Nothing fails, but {unchecked} of {total} {checks} {} not made.",
            verb(unchecked, "was", "were")
        );
    }
    if total == 1 {
        return "The check passes.".to_owned();
    }
    format!("All {total} checks pass.")
}

/// The badge and the sentence.
pub fn headline(verdict: &Verdict) -> String {
    let status = verdict.status();
    format!(
        "<div class=\"headline {0}\" id=\"verdict\">{1}<div><strong>{2}</strong><p>{3}</p></div></div>",
        class(status),
        icon(status),
        status.words(),
        sentence(verdict),
    )
}

/// Every check, worst first, otherwise in the order given.
pub fn checks(verdict: &Verdict) -> String {
    let mut html = String::from(
        "<div class=\"scroll\"><table class=\"checks\"><thead><tr><th scope=\"col\">Outcome</th><th scope=\"col\">Check</th>\
         <th scope=\"col\" class=\"n\">Found</th><th scope=\"col\" class=\"n\">Asked</th><th scope=\"col\">Why, where, and what to do</th></tr></thead><tbody>",
    );
    for status in ORDER {
        for check in verdict.checks.iter().filter(|c| c.status == status) {
            row(&mut html, check);
        }
    }
    html.push_str("</tbody></table></div>");
    html
}

fn row(html: &mut String, check: &Check) {
    let found = check.value.as_ref().map_or_else(
        || "–".to_owned(),
        |m| {
            let number = m
                .sigma
                .map_or_else(|| significant(m.value, 4), |s| with_uncertainty(m.value, s));
            format!("{number} {}", escape(&m.unit))
        },
    );
    let unit = check.value.as_ref().map_or("", |m| m.unit.as_str());
    let asked = match check.limit {
        Some(Limit::AtMost(bound)) => format!("≤ {} {}", significant(bound, 4), escape(unit)),
        Some(Limit::AtLeast(bound)) => format!("≥ {} {}", significant(bound, 4), escape(unit)),
        None => "–".to_owned(),
    };
    // writing to a String cannot fail
    let _ = write!(
        html,
        "<tr class=\"{}\" data-check=\"{}\"><td class=\"outcome\">{}{}</td><th scope=\"row\">{}</th>\
         <td class=\"n\" data-label=\"Found\">{found}</td><td class=\"n\" data-label=\"Asked\">{asked}</td><td>{}",
        class(check.status),
        escape(&check.id),
        icon(check.status),
        check.status.words(),
        escape(&check.title),
        escape(&check.reason),
    );
    if let Some(place) = &check.place {
        let _ = write!(
            html,
            "<div class=\"place\">at {}</div>",
            escape(&place.to_string())
        );
    }
    if let Some(remedy) = &check.remedy {
        let _ = write!(html, "<div class=\"remedy\">→ {}</div>", escape(remedy));
    }
    html.push_str("</td></tr>");
}

/// The warnings by code, each with place and remedy.
pub fn warnings(warnings: &[Warning]) -> String {
    if warnings.is_empty() {
        return "<p>None.</p>".to_owned();
    }
    let mut codes: Vec<&str> = warnings.iter().map(|w| w.code.as_str()).collect();
    codes.sort_unstable();
    codes.dedup();
    let mut html = String::from("<ul class=\"warnings\">");
    for code in codes {
        let of_code: Vec<&Warning> = warnings.iter().filter(|w| w.code == code).collect();
        for warning in of_code.iter().take(LISTED) {
            let _ = write!(
                html,
                "<li>{}<div><code>{}</code> {}",
                icon(Status::Warn),
                escape(code),
                escape(&warning.message)
            );
            if let Some(place) = &warning.place {
                let _ = write!(
                    html,
                    "<div class=\"place\">at {}</div>",
                    escape(&place.to_string())
                );
            }
            if let Some(remedy) = &warning.remedy {
                let _ = write!(html, "<div class=\"remedy\">→ {}</div>", escape(remedy));
            }
            html.push_str("</div></li>");
        }
        if of_code.len() > LISTED {
            let _ = write!(
                html,
                "<li><div>and {} more of <code>{}</code>: verdict.json lists all.</div></li>",
                of_code.len() - LISTED,
                escape(code)
            );
        }
    }
    html.push_str("</ul>");
    html
}

#[cfg(test)]
mod tests {
    use meltpath_base::{Measure, Place};

    use super::*;

    fn verdict() -> Verdict {
        let judge = |id: &str, v, s, limit| Check::judge(id, id, Measure::new(v, s, "mm"), limit);
        Verdict {
            checks: vec![
                judge("flatness", 0.2, 0.1, Limit::AtMost(1.0)),
                Check::not_checked("reach", "Reach <robot>", "no robot model"),
                judge("ctwd-min", 5.47, 1.5, Limit::AtLeast(8.0))
                    .at(Place::layer(22))
                    .remedy("raise the layer height to 1.65 mm & plan again"),
                judge("lack", 0.4, 2.0, Limit::AtMost(0.5)),
                judge("height", 0.95, 0.1, Limit::AtMost(1.0)),
            ],
            warnings: vec![],
        }
    }

    #[test]
    fn checks_stand_worst_first_with_value_limit_place_and_remedy() {
        insta::assert_snapshot!(checks(&verdict()).replace("<t", "\n<t"));
    }

    #[test]
    fn the_sentence_follows_the_worst_outcome() {
        let mut v = verdict();
        assert_eq!(
            sentence(&v),
            "1 of 5 checks fails: what was asked is not met. 1 more cannot be decided."
        );
        v.checks.remove(2);
        assert!(sentence(&v).contains("1 of 4 checks cannot be decided"));
        v.checks.remove(2);
        assert_eq!(
            sentence(&v),
            "Nothing fails, but 1 of 3 checks asks to be looked at."
        );
        v.checks.remove(2);
        assert_eq!(
            sentence(&v),
            "Nothing fails, but 1 of 2 checks was not made."
        );
        v.checks.remove(1);
        assert_eq!(sentence(&v), "The check passes.");
        v.checks.clear();
        assert_eq!(sentence(&v), "Nothing was checked.");
    }

    #[test]
    fn a_flood_of_warnings_is_counted() {
        let flood: Vec<Warning> = (0..500)
            .map(|i| Warning {
                code: "thin-region".to_owned(),
                message: format!("region {i}"),
                place: None,
                remedy: None,
            })
            .collect();
        let html = warnings(&flood);
        assert_eq!(html.matches("<li>").count(), LISTED + 1);
        assert!(html.contains("and 480 more"));
    }
}
