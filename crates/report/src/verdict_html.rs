//! The verdict in words and signs: colour is never the only difference between outcomes.

use std::fmt::Write as _;

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status, Verdict, Warning};

use crate::escape::escape;
use crate::number::{duration, significant, with_uncertainty};

/// Warnings of one code that are listed one by one; the rest is counted.
const LISTED: usize = 20;

/// What a place leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Places {
    /// The 3D view of the same page flies there.
    InView,
    /// Nothing: the page has no view.
    InWords,
}

impl Places {
    /// Where something was found; a button where the view can show it.
    fn shown(self, place: &Place) -> String {
        let words = format!("at {}", escape(&place.to_string()));
        if self == Places::InWords || (place.position.is_none() && place.layer.is_none()) {
            return words;
        }
        let mut target = String::new();
        if let Some([x, y, z]) = place.position {
            // writing to a String cannot fail
            let _ = write!(target, " data-position=\"{x:.4} {y:.4} {z:.4}\"");
        }
        if let Some(layer) = place.layer {
            let _ = write!(target, " data-layer=\"{layer}\"");
        }
        format!(
            "<button type=\"button\" class=\"fly\" title=\"Show it in the 3D view\"{target}>{words}</button>"
        )
    }
}

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

/// The badge and the sentence.
pub fn headline(verdict: &Verdict) -> String {
    let status = verdict.status();
    format!(
        "<div class=\"headline {0}\" id=\"verdict\">{1}<div><strong>{2}</strong><p>{3}</p></div></div>",
        class(status),
        icon(status),
        status.words(),
        verdict.sentence(),
    )
}

/// Every check in reading order; nothing where nothing was judged.
pub fn checks(verdict: &Verdict, places: Places) -> String {
    if verdict.checks.is_empty() {
        return String::new();
    }
    let mut html = String::from(
        "<div class=\"scroll\"><table class=\"checks\"><thead><tr><th scope=\"col\">Outcome</th><th scope=\"col\">Check</th>\
         <th scope=\"col\" class=\"n\">Found</th><th scope=\"col\" class=\"n\">Limit</th><th scope=\"col\">Why, where, and what to do</th></tr></thead><tbody>",
    );
    for check in verdict.in_reading_order() {
        row(&mut html, check, places);
    }
    html.push_str("</tbody></table></div>");
    html
}

/// What is told without a limit: one tile each.
pub fn facts(facts: &[Fact], places: Places) -> String {
    if facts.is_empty() {
        return String::new();
    }
    let mut html = String::from("<h3>Told, without a limit</h3><dl class=\"facts\">");
    for fact in facts {
        // writing to a String cannot fail
        let _ = write!(
            html,
            "<div data-fact=\"{}\"><dt>{}</dt>",
            escape(&fact.id),
            escape(&fact.title)
        );
        if let Some(value) = &fact.value {
            let _ = write!(html, "<dd>{}</dd>", shown(value));
        }
        if !fact.reason.is_empty() {
            let _ = write!(html, "<dd class=\"why\">{}</dd>", escape(&fact.reason));
        }
        if let Some(place) = &fact.place {
            let _ = write!(html, "<dd class=\"why\">{}</dd>", places.shown(place));
        }
        html.push_str("</div>");
    }
    html.push_str("</dl>");
    html
}

/// A value with its uncertainty and unit; minutes as hours and minutes.
fn shown(measure: &Measure) -> String {
    let sigma = measure.sigma.unwrap_or(0.0);
    if measure.unit == "min" && sigma <= 0.0 {
        return duration(60.0 * measure.value);
    }
    let number = with_uncertainty(measure.value, sigma);
    if measure.unit.is_empty() {
        return number;
    }
    format!("{number} {}", escape(&measure.unit))
}

fn row(html: &mut String, check: &Check, places: Places) {
    let found = check.value.as_ref().map_or_else(|| "–".to_owned(), shown);
    let unit = check.value.as_ref().map_or("", |m| m.unit.as_str());
    let limit = match check.limit {
        Some(Limit::AtMost(bound)) => format!("≤ {} {}", significant(bound, 4), escape(unit)),
        Some(Limit::AtLeast(bound)) => format!("≥ {} {}", significant(bound, 4), escape(unit)),
        None => "–".to_owned(),
    };
    // writing to a String cannot fail
    let _ = write!(
        html,
        "<tr class=\"{}\" data-check=\"{}\"><td class=\"outcome\">{}{}</td><th scope=\"row\">{}</th>\
         <td class=\"n\" data-label=\"Found\">{found}</td><td class=\"n\" data-label=\"Limit\">{limit}</td><td>{}",
        class(check.status),
        escape(&check.id),
        icon(check.status),
        check.status.words(),
        escape(&check.title),
        escape(&check.reason),
    );
    if let Some(place) = &check.place {
        let _ = write!(html, "<div class=\"place\">{}</div>", places.shown(place));
    }
    if let Some(remedy) = &check.remedy {
        let _ = write!(html, "<div class=\"remedy\">→ {}</div>", escape(remedy));
    }
    html.push_str("</td></tr>");
}

/// The warnings by code, each with place and remedy.
pub fn warnings(warnings: &[Warning], places: Places) -> String {
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
                let _ = write!(html, "<div class=\"place\">{}</div>", places.shown(place));
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
            ..Verdict::default()
        }
    }

    #[test]
    fn checks_stand_worst_first_with_value_limit_place_and_remedy() {
        insta::assert_snapshot!(checks(&verdict(), Places::InWords).replace("<t", "\n<t"));
    }

    #[test]
    fn facts_are_tiles_apart_from_checks() {
        let fact = Fact::new(
            "time-total",
            "time in all",
            Measure::exact(123.9, "min"),
            "",
        );
        let bare = Fact::new(
            "coverage",
            "area that no bead covers",
            Measure::new(0.06, 0.0, "%"),
            "largest place 1.5 mm²",
        )
        .at(Place::layer(3));
        let html = facts(&[fact, bare], Places::InWords);
        assert!(html.contains("<dt>time in all</dt><dd>2 h 04 min</dd></div>"));
        assert!(html.contains(
            "<dd>0.06 %</dd><dd class=\"why\">largest place 1.5 mm²</dd><dd class=\"why\">at layer 3</dd>"
        ));
        assert!(facts(&[], Places::InWords).is_empty());
    }

    #[test]
    fn a_place_is_a_button_where_a_view_can_show_it() {
        let spot = Place {
            layer: Some(2),
            ..Place::at([1.0, -2.5, 3.25])
        };
        assert!(Places::InView.shown(&spot).starts_with(
            "<button type=\"button\" class=\"fly\" title=\"Show it in the 3D view\" \
             data-position=\"1.0000 -2.5000 3.2500\" data-layer=\"2\">at layer 2"
        ));
        let line = Place {
            file: Some("a.ls".to_owned()),
            line: Some(7),
            ..Place::default()
        };
        assert_eq!(Places::InView.shown(&line), "at a.ls, line 7");
        assert_eq!(Places::InWords.shown(&Place::layer(3)), "at layer 3");
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
        let html = warnings(&flood, Places::InView);
        assert_eq!(html.matches("<li>").count(), LISTED + 1);
        assert!(html.contains("and 480 more"));
    }
}
