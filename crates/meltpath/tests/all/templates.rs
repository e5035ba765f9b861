//! The templates of `meltpath new waam`, run as they come: which plans pass their own verdict.

use std::path::Path;

use meltpath::{start, waam};
use meltpath_base::{Silent, Status, Verdict};

fn verdict(shape: &str, dir: &Path) -> Verdict {
    let job = start::waam(&dir.join(shape), shape, None).unwrap();
    let out = dir.join(format!("{shape}-run"));
    waam::run(&job, Some(&out), dir, &Silent).unwrap().verdict
}

/// The checks of a verdict that hinder a pass, apart from what no job without a robot checks.
fn hindered(verdict: &Verdict) -> Vec<&str> {
    let hinders = |s: Status| matches!(s, Status::Fail | Status::CannotSay);
    let checks = verdict.checks.iter();
    checks
        .filter(|c| hinders(c.status))
        .map(|c| c.id.as_str())
        .collect()
}

/// Right angles and sharp tips: metal reaches into the corners.
#[test]
fn plates_and_stars_have_stock_in_their_corners() {
    let dir = tempfile::tempdir().unwrap();
    for shape in ["plate", "star"] {
        let verdict = verdict(shape, dir.path());
        let none: [&str; 0] = [];
        assert_eq!(hindered(&verdict), none, "{shape}");
    }
}

/// Those that do not pass are listed with the checks that hinder them: one that passes later leaves the list.
#[test]
#[ignore = "a minute of computing"]
fn templates_pass_their_own_verdict() {
    let dir = tempfile::tempdir().unwrap();
    let found: Vec<(&str, String)> = start::shape_names()
        .into_iter()
        .map(|shape| (shape, hindered(&verdict(shape, dir.path())).join(" ")))
        .filter(|(_, hindered)| !hindered.is_empty())
        .collect();
    let known = [
        ("tee", "flatness"),
        ("honeycomb", "stock flatness accumulation"),
        ("truss", "lack stock flatness accumulation ctwd-known"),
        ("box-wall", "stock"),
        // it leans: nothing is decided
        (
            "vase",
            "lack excess stock height flatness accumulation ctwd-min ctwd-max ctwd-known",
        ),
        ("bracket", "flatness"),
    ];
    let known = known.map(|(shape, hindered)| (shape, hindered.to_owned()));
    assert_eq!(found, known);
}
