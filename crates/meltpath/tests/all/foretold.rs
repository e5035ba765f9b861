//! What `doctor` says of a plan is what its run finds; and what hinders shapes of many kinds from passing.

use crate::support::says;
use std::fs;
use std::path::Path;

use meltpath::outcome::RunFolder::At;
use meltpath::{start, waam};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::{Mesh, Region, shapes};

/// The checks of a verdict that hinder a pass.
pub(super) fn hindered(verdict: &Verdict) -> Vec<&str> {
    let hinders = |s: Status| matches!(s, Status::Fail | Status::CannotSay);
    let checks = verdict.checks.iter();
    checks
        .filter(|c| hinders(c.status))
        .map(|c| c.id.as_str())
        .collect()
}

/// What `doctor` says of a job before a run, beside what the run found: the same checks, with the same values.
pub(super) fn told_as_found(job: &Path, verdict: &Verdict) {
    let notes = waam::examine(job, &Silent).unwrap().notes;
    let told: Vec<&String> = notes
        .iter()
        .filter(|n| n.starts_with("foretold: ") && !n.contains("other settings"))
        .filter(|n| !n.contains("no check is expected to fail"))
        .collect();
    let found = hindered(verdict);
    assert_eq!(told.len(), found.len(), "{told:?} {found:?}");
    for id in found {
        let check = verdict.checks.iter().find(|c| c.id == id).unwrap();
        let words = format!("{}: {}", check.status.words(), check.title);
        let line = told.iter().find(|n| n.contains(&words));
        assert!(line.unwrap().contains(&check.line()), "{told:?} {check:?}");
    }
}

fn polygon(points: &[[f64; 2]]) -> Region {
    Region {
        outer: points.iter().copied().map(DVec2::from_array).collect(),
        holes: Vec::new(),
    }
}

fn letter_h() -> Region {
    let (b, l) = (12.0, 50.0);
    polygon(&[
        [0.0, 0.0],
        [b, 0.0],
        [b, 20.0],
        [30.0, 20.0],
        [30.0, 0.0],
        [30.0 + b, 0.0],
        [30.0 + b, l],
        [30.0, l],
        [30.0, 32.0],
        [b, 32.0],
        [b, l],
        [0.0, l],
    ])
}

fn plate_with_hole(radius: f64) -> Region {
    let mut region = shapes::plate(60.0, 44.0);
    let middle = DVec2::new(30.0, 22.0);
    let hole = shapes::ring(radius, 0.5 * radius, 48).outer;
    region.holes = vec![hole.iter().rev().map(|p| *p + middle).collect()];
    region
}

/// Shapes that no template has, each with a line of the job changed.
fn plain() -> Vec<(&'static str, Mesh, [&'static str; 2])> {
    let flat = |region: Region, height: f64| shapes::extrude(&[region], height);
    let none = ["", ""];
    let height = "height = \"auto\"";
    let allowance = "# allowance = \"2 mm\"";
    vec![
        ("bar", flat(shapes::plate(70.0, 12.0), 14.0), none),
        ("block", flat(shapes::plate(36.0, 30.0), 12.0), none),
        ("tube", flat(shapes::ring(26.0, 20.0, 90), 16.0), none),
        ("thin tube", flat(shapes::ring(24.0, 21.5, 90), 20.0), none),
        ("hole", flat(plate_with_hole(10.0), 12.0), none),
        ("small hole", flat(plate_with_hole(4.0), 12.0), none),
        ("letter H", flat(letter_h(), 12.0), none),
        (
            "wedge",
            flat(polygon(&[[0.0, 0.0], [80.0, 0.0], [0.0, 18.0]]), 12.0),
            none,
        ),
        (
            "five points",
            flat(shapes::random_star(3, 5, 18.0, 34.0), 12.0),
            none,
        ),
        ("inward cone", shapes::cone(26.0, 16.0, 24.0), none),
        ("outward cone", shapes::cone(16.0, 30.0, 24.0), none),
        ("post", flat(shapes::ring(7.0, 1.0, 40), 20.0), none),
        (
            "layers too thin",
            shapes::thin_wall(50.0, 3.0, 24.0),
            [height, "height = \"1.1 mm\""],
        ),
        (
            "layers too thick",
            shapes::thin_wall(50.0, 3.0, 24.0),
            [height, "height = \"2.4 mm\""],
        ),
        (
            "contact tube too near",
            flat(shapes::plate(36.0, 30.0), 12.0),
            ["ctwd = \"15 mm\"", "ctwd = \"9 mm\""],
        ),
        (
            "no allowance",
            flat(shapes::plate(36.0, 30.0), 12.0),
            [allowance, "allowance = \"0 mm\"\nallowance_top = \"0 mm\""],
        ),
        (
            "wide stepover",
            flat(shapes::plate(36.0, 30.0), 12.0),
            ["stepover = \"auto\"", "stepover = \"0.95 w\""],
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
    waam::run(&job, At(&dir.join(format!("{name}-run"))), &Silent)
        .unwrap()
        .verdict
}

/// What hinders a pass of each shape.
fn plain_outcomes(wanted: impl Fn(&str) -> bool) -> Vec<(&'static str, String)> {
    let dir = tempfile::tempdir().unwrap();
    let shapes = plain().into_iter().filter(|(name, ..)| wanted(name));
    shapes
        .map(|(name, mesh, change)| {
            let verdict = run_plain(name, &mesh, change, dir.path());
            (name, hindered(&verdict).join(" "))
        })
        .filter(|(_, hindered)| !hindered.is_empty())
        .collect()
}

fn known(list: &[(&'static str, &str)]) -> Vec<(&'static str, String)> {
    list.iter().map(|&(n, m)| (n, m.to_owned())).collect()
}

/// A bead that no bead of the process map is like: nothing is known of it, in the plan as in the run.
#[test]
fn a_bead_outside_the_map_is_undecided_and_foretold() {
    let dir = tempfile::tempdir().unwrap();
    let job = start::waam(&dir.path().join("job"), "thin-wall", None).unwrap();
    let mut text = fs::read_to_string(&job).unwrap();
    for (from, to) in [
        (
            "travel_speed = \"0.75 m/min\"",
            "travel_speed = \"1.8 m/min\"",
        ),
        ("# count = 20", "count = 2"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    fs::write(&job, text).unwrap();
    let told = waam::examine(&job, &Silent).unwrap().notes.join("\n");
    says(
        &told,
        &["cannot say: beads laid at settings outside the process map"],
    );
    let out = dir.path().join("run");
    let verdict = waam::run(&job, At(&out), &Silent).unwrap().verdict;
    let range = verdict.checks.iter().find(|c| c.id == "range").unwrap();
    assert_eq!(range.status, Status::CannotSay);
    assert!(range.reason.contains("1.800 m/min travel"), "{range:?}");
    assert!(
        range.remedy.as_ref().unwrap().contains("waam.bead"),
        "{range:?}"
    );
    let place = range.place.as_ref().unwrap();
    assert_eq!((place.layer, place.bead), (Some(1), Some(1)));
    assert!(place.position.is_some());
    // the plan's own slower and faster beads stay inside the map
    let plain = run_plain(
        "wall",
        &shapes::thin_wall(50.0, 3.0, 6.0),
        [
            "travel_speed = \"0.75 m/min\"",
            "travel_speed = \"1.45 m/min\"",
        ],
        dir.path(),
    );
    assert!(plain.checks.iter().all(|c| c.id != "range"), "{plain:?}");
}

/// One shape that passes, and plans that fail by layers, by the contact tube and by a lean: `doctor` says beforehand what the run finds.
#[test]
fn plans_foretell_what_their_runs_fail() {
    let quick = [
        "block",
        "layers too thin",
        "contact tube too near",
        "outward cone",
    ];
    let dir = tempfile::tempdir().unwrap();
    for (name, mesh, change) in plain() {
        if quick.contains(&name) {
            let verdict = run_plain(name, &mesh, change, dir.path());
            told_as_found(&dir.path().join(name).join("job.toml"), &verdict);
        }
    }
}

#[test]
#[ignore = "a minute of computing"]
fn plain_shapes_come_out_as_the_book_says() {
    let outcomes = [
        ("wedge", "stock accumulation"),
        // it leans: nothing is decided
        (
            "outward cone",
            "lack excess stock height flatness accumulation ctwd-min ctwd-max ctwd-known travels",
        ),
        (
            "layers too thin",
            "excess height accumulation ctwd-min ctwd-known",
        ),
        (
            "layers too thick",
            "lack excess stock accumulation ctwd-known",
        ),
        (
            "contact tube too near",
            "stock height ctwd-min tool-distance",
        ),
        ("no allowance", "lack stock flatness"),
        ("wide stepover", "stock flatness accumulation ctwd-max"),
    ];
    assert_eq!(plain_outcomes(|_| true), known(&outcomes));
}
