//! What drifted in a health test, and what was not found, as checks.

use meltpath_base::{Check, Limit, Measure, Reporter, Status};
use meltpath_scan_head::health::rating::{Drift, Rating, matched};

/// What tells of the coil and its magnet; the other quantities of the first stage are found through them.
const COIL: [&str; 3] = ["resistance", "inductance", "torque constant"];

/// Every drift as a check.
pub(super) fn of(drifts: &[Drift]) -> Vec<Check> {
    if drifts.is_empty() {
        return vec![Check::not_checked(
            "drift",
            "drift",
            "this is the first test: later ones are compared with it",
        )];
    }
    // what is found by way of the coil drifts with it
    let coil = |d: &&Drift| {
        let drifted = d.rating != Rating::Good && d.doubt.is_none();
        drifted && COIL.contains(&d.quantity.as_str())
    };
    let first: Vec<&str> = drifts
        .iter()
        .filter(coil)
        .map(|d| d.quantity.as_str())
        .collect();
    let after = |d: &Drift| {
        if first.is_empty() || d.doubt.is_none() && COIL.contains(&d.quantity.as_str()) {
            return String::new();
        }
        let first = first.join(" and ");
        format!("mend what the {first} tells first, it shows here too; else ")
    };
    let check = |d: &Drift| {
        let limit = Limit::AtMost(100.0 * d.limits.1);
        let id = format!("drift-{}", d.quantity.replace(' ', "-"));
        let mut check = Check::judge(&id, &d.quantity, Measure::exact(100.0 * d.size, "%"), limit);
        check.status = match (&d.doubt, d.rating) {
            (Some(_), _) => Status::CannotSay,
            (None, Rating::Good) => Status::Pass,
            (None, Rating::Watch) => Status::Warn,
            (None, Rating::Intervene) => Status::Fail,
        };
        let words = d.doubt.as_deref().unwrap_or(d.rating.words());
        let room = d.room.filter(|room| room.is_finite());
        let room = room.map_or(String::new(), |room| format!(" ± {:.1}", 100.0 * room));
        check.reason = format!(
            "{words}: {:+.1}{room} % ({:.4e} → {:.4e}); good below {:.0} %, intervention from {:.0} % on",
            100.0 * d.change,
            d.reference,
            d.now,
            100.0 * d.limits.0,
            100.0 * d.limits.1
        );
        if d.doubt.is_some() {
            check.remedy(format!(
                "{}a stronger first stage and a finer encoder, which show modes that are faint and let the figures scatter less",
                after(d)
            ))
        } else if d.rating == Rating::Good {
            check
        } else {
            check.remedy(format!(
                "{}likely {}: {}; where something was replaced on purpose, --accept makes this test the one to compare with",
                after(d),
                d.fault,
                d.action
            ))
        }
    };
    drifts.iter().map(check).collect()
}

/// A check that cannot say for each mode (Hz) that is known of the axis, by the accepted test or by the head's file, and was not found
/// in this one. Modes that are new since the accepted test are told.
pub(super) fn missing_modes(
    of_file: &[f64],
    accepted: &[f64],
    now: &[f64],
    reporter: &Reporter,
) -> Vec<Check> {
    let beside = matched(of_file, accepted);
    let beside = of_file.iter().zip(beside).filter(|(_, m)| m.is_none());
    let known: Vec<f64> = accepted
        .iter()
        .chain(beside.map(|(f, _)| f))
        .copied()
        .collect();
    let new: Vec<String> = matched(now, &known)
        .iter()
        .zip(now)
        .filter(|(known, _)| known.is_none())
        .map(|(_, f)| format!("{f:.0}"))
        .collect();
    // a first test has nothing that a mode could be new to
    if !new.is_empty() && !accepted.is_empty() {
        reporter.warn(
            "modes",
            format!(
                "modes are found that neither the accepted test nor the head's file has, at {} Hz",
                new.join(", ")
            ),
            "look at the response of the first stage: a mode that comes is a mount",
        );
    }
    let found = matched(&known, now);
    let missing = known.iter().zip(found).enumerate();
    missing
        .filter(|(_, (_, found))| found.is_none())
        .map(|(k, (frequency, _))| {
            let source = if k < accepted.len() {
                "the accepted test"
            } else {
                "the head's file"
            };
            let title = format!("mode {}", k + 1);
            Check {
                status: Status::CannotSay,
                ..Check::not_checked(
                    &format!("drift-mode-{}", k + 1),
                    &title,
                    &format!("the mode at {frequency:.0} Hz of {source} is not found in this test: it may have moved far, or vanished in noise or damping"),
                )
            }
            .remedy("look at the response of the first stage in the report; a stronger first stage or a finer encoder shows a faint mode, and a mirror or mount that was changed moves it: then --accept, or mend the head's file")
        })
        .collect()
}
