//! What a plan is expected to fail is what its run fails, and the other way round.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use meltpath::{start, waam};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::{Mesh, shapes};

/// The checks foretold and not happened (`+`), and happened and not foretold (`-`).
fn misses(verdict: &Verdict) -> String {
    let fact = verdict.facts.iter().find(|f| f.id == "foretold").unwrap();
    let foretold: BTreeSet<&str> = match fact.reason.as_str() {
        "no check" => BTreeSet::new(),
        ids => ids.split(", ").collect(),
    };
    let hinders = |s: Status| matches!(s, Status::Fail | Status::CannotSay);
    let checks = verdict.checks.iter();
    let happened: BTreeSet<&str> = checks
        .filter(|c| hinders(c.status))
        .map(|c| c.id.as_str())
        .collect();
    let only = |a: &BTreeSet<&str>, b: &BTreeSet<&str>, sign: char| -> Vec<String> {
        a.difference(b).map(|id| format!("{sign}{id}")).collect()
    };
    let missed = only(&happened, &foretold, '-');
    [only(&foretold, &happened, '+'), missed].concat().join(" ")
}

/// Plans that pass, that lean, whose layers are thinner than the growth, and whose contact tube begins too near; each with a line of the
/// job changed.
fn plain() -> Vec<(&'static str, Mesh, [&'static str; 2])> {
    let block = || shapes::extrude(&[shapes::plate(36.0, 30.0)], 12.0);
    vec![
        ("block", block(), ["", ""]),
        ("outward cone", shapes::cone(16.0, 30.0, 24.0), ["", ""]),
        (
            "layers too thin",
            shapes::thin_wall(50.0, 3.0, 24.0),
            ["height = \"auto\"", "height = \"1.1 mm\""],
        ),
        (
            "contact tube too near",
            block(),
            ["ctwd = \"15 mm\"", "ctwd = \"9 mm\""],
        ),
    ]
}

fn run_plain(name: &str, mesh: &Mesh, [from, to]: [&str; 2], dir: &Path) -> Verdict {
    let folder = dir.join(name);
    let job = start::waam(&folder, "plate", None).unwrap();
    let mut file = fs::File::create(folder.join("plate.stl")).unwrap();
    write_stl(mesh, name, &mut file).unwrap();
    let text = fs::read_to_string(&job).unwrap();
    assert!(text.contains(from), "{from}");
    if !from.is_empty() {
        fs::write(&job, text.replacen(from, to, 1)).unwrap();
    }
    waam::run(&job, Some(&dir.join(format!("{name}-run"))), dir, &Silent)
        .unwrap()
        .verdict
}

#[test]
fn plans_foretell_what_their_runs_fail() {
    let dir = tempfile::tempdir().unwrap();
    for (name, mesh, change) in plain() {
        let verdict = run_plain(name, &mesh, change, dir.path());
        assert_eq!(misses(&verdict), "", "{name}");
    }
}
