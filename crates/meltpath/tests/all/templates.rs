//! The templates of `meltpath new waam`, run as they come: which plans pass their own verdict.

use std::fs;
use std::path::Path;

use meltpath::{chain, start, waam};
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

/// What `doctor` says mends a plan, written into the job, lets the run pass.
#[test]
#[ignore = "half a minute of computing"]
fn what_is_said_to_mend_a_plan_mends_it() {
    let dir = tempfile::tempdir().unwrap();
    for (shape, expected) in [
        ("tee", "fill.strategy = \"zigzag\""),
        ("box-wall", "machine.smoothing = \"25 %\""),
        (
            "bracket",
            "fill.spacing = \"exact\" and target.allowance = \"3 mm\"",
        ),
    ] {
        let job = start::waam(&dir.path().join(shape), shape, None).unwrap();
        let lines = chain::doctor(&job, &Silent).unwrap().lines;
        let mut told = lines.iter().filter_map(|l| {
            let (_, rest) = l.split_once("foretold: with ")?;
            rest.strip_suffix(" no check is expected to fail")
        });
        let told = told.next().unwrap_or_else(|| panic!("{shape}: {lines:?}"));
        assert_eq!(told, expected);
        let mut text = fs::read_to_string(&job).unwrap();
        for setting in told.split(" and ") {
            let (key, value) = setting.split_once(" = ").unwrap();
            let key = key.split_once('.').unwrap().1;
            let written = |l: &str| l.trim_start_matches("# ").starts_with(&format!("{key} = "));
            let lines: Vec<String> = text
                .lines()
                .map(|l| {
                    if written(l) {
                        format!("{key} = {value}")
                    } else {
                        l.to_owned()
                    }
                })
                .collect();
            text = lines.join("\n");
        }
        fs::write(&job, text).unwrap();
        let out = dir.path().join(format!("{shape}-mended"));
        let verdict = waam::run(&job, Some(&out), dir.path(), &Silent)
            .unwrap()
            .verdict;
        let none: [&str; 0] = [];
        assert_eq!(hindered(&verdict), none, "{shape}");
        // a plan that is expected to fail nothing is tried with no other setting
        let after = chain::doctor(&job, &Silent).unwrap().lines;
        assert!(
            after.iter().any(|l| l.contains("foretold: no check")),
            "{after:?}"
        );
    }
}
