//! What verdicts of flat jobs and of FANUC programs tell of themselves: metal under a torch that stands, how far a wall leans, how
//! sure the wire and the energy are, settings that contradict the part or one another.

use std::path::Path;

use crate::foreign::{job, posed};
use crate::support::{self, check, refusal, says, thin_wall, warned, write};
use meltpath::outcome::RunFolder::{self, NextIn};
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Fact, Measure, Silent, Status, Verdict};
use meltpath_geometry::shapes;

/// A bead of 100 mm with `line` at its middle, ended by `end`.
fn bead(folder: &Path, line: &str, end: &str) -> Verdict {
    straight(folder, &job(folder), line, end)
}

fn straight(folder: &Path, job: &Path, line: &str, end: &str) -> Verdict {
    let lines = [
        "UFRAME_NUM=1",
        "UTOOL_NUM=1",
        "L P[1] 20mm/sec FINE Arc Start[7]",
        "L P[2] WELD_SPEED FINE",
        line,
        "L P[3] WELD_SPEED FINE",
        end,
    ];
    let places = [0.0, 50.0, 100.0].map(|x| [x, 0.0, 0.0, 180.0, 0.0, 0.0]);
    let program = posed(folder, &lines, &places);
    let runs = folder.join("runs");
    simulate_program(&program, Some(job), NextIn(&runs), &Silent)
        .unwrap()
        .verdict
}

fn fact<'a>(verdict: &'a Verdict, id: &str) -> &'a Fact {
    verdict.facts.iter().find(|f| f.id == id).unwrap()
}

fn measured(verdict: &Verdict, id: &str) -> Measure {
    fact(verdict, id).value.clone().unwrap()
}

const TUBE: [&str; 3] = ["ctwd-min", "ctwd-max", "ctwd-known"];

/// Metal grows to the wire under a torch that stands: nothing is said of its distance. A dwell in which less than a pool is fed is one
/// as others.
#[test]
fn nothing_is_said_of_the_contact_tube_over_a_torch_that_stands() {
    let dir = tempfile::tempdir().unwrap();
    for (line, end) in [
        ("WAIT 15.00(sec)", "Arc End[7]"),
        ("!no wait", "Arc End[7,20.0s]"),
    ] {
        let stands = bead(dir.path(), line, end);
        assert_eq!(check(&stands, "lines").status, Status::Pass);
        for id in TUBE {
            let check = check(&stands, id);
            assert_eq!(check.status, Status::CannotSay, "{line}: {check:?}");
            says(&check.reason, &["stands for", "layer 1", "mm³"]);
            assert!(check.place.is_some() && check.remedy.is_some());
        }
    }
    let short = bead(dir.path(), "WAIT 0.50(sec)", "Arc End[7]");
    for id in TUBE {
        assert_eq!(check(&short, id).status, Status::Pass, "{id}");
    }
}

/// A plan whose craters the cell's schedule fills for longer than a pool is judged as its program is: of a source that feeds by the distance
/// no check of the metal is decided.
#[test]
fn a_plan_with_long_craters_says_no_more_than_its_program() {
    let dir = tempfile::tempdir().unwrap();
    let cell = |time: &str| {
        meltpath_data::cells::ARCMATE_120IC.text.to_owned()
            + &format!(
                "[[program.schedule]]\nnumber = 4\nwire_feed = \"7 m/min\"\ncrater_time = \"{time}\"\n"
            )
    };
    let verdict = |time: &str| {
        write(dir.path(), "cell.toml", cell(time));
        let tables =
            "[layers]\ncount = 2\n[simulation]\ncell = \"1 mm\"\n[machine]\ncell = \"cell.toml\"\n";
        let job = thin_wall(dir.path(), tables);
        let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
        let written = std::fs::read_dir(outcome.folder.join("program")).unwrap();
        let path = written
            .map(|f| f.unwrap().path())
            .find(|f| f.extension().is_some_and(|e| e == "LS"));
        let text = std::fs::read_to_string(path.unwrap()).unwrap();
        assert!(text.contains("Arc Start[4]"), "{text}");
        outcome.verdict
    };
    let (short, long) = (verdict("0.2 s"), verdict("6 s"));
    for id in ["lack", "excess", "height"] {
        assert_ne!(check(&short, id).status, Status::CannotSay, "{id}");
        let told = check(&long, id);
        assert_eq!(told.status, Status::CannotSay, "{id}");
        says(&told.reason, &["stands for"]);
    }
}

/// The metal of a crater is laid: 20 s at 8 m/min are 2.7 m of wire more.
#[test]
fn a_crater_takes_its_wire() {
    let dir = tempfile::tempdir().unwrap();
    let of = |end: &str| bead(dir.path(), "!no wait", end);
    let (plain, filled) = (of("Arc End[7]"), of("Arc End[7,20.0s]"));
    let arc = |verdict: &Verdict| measured(verdict, "time-arc").value;
    assert!((arc(&filled) - arc(&plain) - 20.0 / 60.0).abs() < 1e-6);
    let wire = |verdict: &Verdict| measured(verdict, "wire-mass").value;
    // fed as set or somewhat less, as the map says of this source
    let more = (wire(&filled) - wire(&plain)) / (0.25 * std::f64::consts::PI * 7850e-9);
    let set = 20.0 * 8000.0 / 60.0;
    assert!((0.8 * set..1.2 * set).contains(&more), "{more} for {set}");
    // what nobody tells is not left out without a word
    assert!(warned(&plain, "crater-not-told"));
    let unknown = of("Arc End[1]");
    let lines = check(&unknown, "lines");
    assert_eq!(lines.status, Status::CannotSay);
    says(&lines.reason, &["Arc End[1]", "crater", "line 7"]);
    assert_eq!(check(&unknown, "lack").status, Status::CannotSay);
}

/// The section of a wire is as uncertain as twice its diameter, and so is all that is counted from its length.
#[test]
fn the_wire_is_as_sure_as_its_diameter() {
    let dir = tempfile::tempdir().unwrap();
    let shipped = meltpath_data::wires::X90_IG_1_0.text;
    let squares = |uncertainty: &str| {
        let wire = shipped.replacen("uncertainty = 0.01", uncertainty, 1);
        write(dir.path(), "wire.toml", wire);
        let job = job(dir.path());
        let text = std::fs::read_to_string(&job).unwrap();
        let text = text.replace("wire = \"x90-ig-1.0\"", "wire = \"wire.toml\"");
        std::fs::write(&job, text).unwrap();
        let verdict = straight(dir.path(), &job, "!no wait", "Arc End[7]");
        ["wire-mass", "energy"].map(|id| {
            let told = measured(&verdict, id);
            (told.sigma.unwrap() / told.value).powi(2)
        })
    };
    // of 1 mm
    let (sure, unsure) = (squares("uncertainty = 0.0"), squares("uncertainty = 0.05"));
    for (sure, unsure) in sure.into_iter().zip(unsure) {
        let more = (unsure - sure).sqrt();
        assert!((more - 0.1).abs() < 1e-9, "{sure} {unsure}");
    }
    // the density, and the feed, which the map is not sure of
    assert!(sure[0] > (50.0_f64 / 7850.0).powi(2));
    // 21.6 to 24.7 J/mm³ about 23.1
    assert!(sure[1] > ((24.7 - 21.6) / 4.0 / 23.1_f64).powi(2));
}

/// A wall that leans by 45 degrees: each layer lies by its height beyond the one below, whether or not that is accepted.
#[test]
fn the_largest_shift_is_told_at_any_limit() {
    let dir = tempfile::tempdir().unwrap();
    let mut wall = shapes::extrude(&[shapes::plate(40.0, 14.0)], 8.0);
    for v in &mut wall.vertices {
        v.y += v.z;
    }
    support::part(dir.path(), "wall.stl", &wall);
    let told = |limit: &str| {
        let text = format!(
            "part = \"wall.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
             [layers]\nheight = \"1.6 mm\"\n[checks]\noverhang = \"{limit}\"\n[simulation]\ncell = \"1 mm\"\n"
        );
        let job = write(dir.path(), "job.toml", text);
        let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
        check(&outcome.verdict, "overhang").clone()
    };
    let (open, tight) = (told("60 %"), told("10 %"));
    assert_eq!(open.status, Status::Pass, "{open:?}");
    assert_eq!(tight.status, Status::Fail, "{tight:?}");
    let [open, tight] = [open, tight].map(|c| {
        assert!(c.place.unwrap().layer > Some(1));
        c.value.unwrap().value
    });
    assert_eq!(open, tight);
    // 1.6 mm over a bead of 6 to 8 mm
    assert!(
        (100.0 * 1.6 / 8.0..100.0 * 1.7 / 6.0).contains(&open),
        "{open}"
    );
}

#[test]
fn more_layers_than_the_part_has_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let tables = "[layers]\ncount = 99\n[simulation]\ncell = \"2 mm\"\n";
    let job = thin_wall(dir.path(), tables);
    let verdict = run(&job, NextIn(&dir.path().join("runs")), &Silent)
        .unwrap()
        .verdict;
    let told = verdict.warnings.iter().find(|w| w.code == "layers-count");
    says(
        &told.unwrap().message,
        &["layers.count is 99", "the part has"],
    );
}

/// A program leads the wire's tip, and where that is the controller's tool says.
#[test]
fn a_tool_that_is_set_for_another_distance_is_told() {
    let dir = tempfile::tempdir().unwrap();
    for (ctwd, differs) in [("15 mm", false), ("11 mm", true)] {
        let job = thin_wall(dir.path(), &format!("[machine]\nctwd = \"{ctwd}\"\n"));
        let out = dir.path().join(ctwd);
        let ran = run(&job, RunFolder::At(&out), &Silent).unwrap();
        let check = ran.verdict.checks.iter().find(|c| c.id == "tool-distance");
        assert_eq!(check.is_some(), differs, "{ctwd}");
        if let Some(check) = check {
            assert_eq!(check.status, Status::CannotSay);
            says(&check.reason, &["11.0 mm", "15.0 mm", "4.0 mm too high"]);
        }
    }
}

#[test]
fn a_contact_tube_that_begins_too_near_is_refused_by_both_names() {
    let dir = tempfile::tempdir().unwrap();
    for tables in [
        "[checks]\nctwd_min = \"15 mm\"\n",
        "[machine]\nctwd = \"7 mm\"\n",
    ] {
        let job = thin_wall(dir.path(), tables);
        says(&refusal(&job), &["checks.ctwd_min is", "machine.ctwd"]);
    }
}

/// Positions in centimetres are no positions that were not taught.
#[test]
fn another_unit_of_positions_is_told_as_such() {
    let dir = tempfile::tempdir().unwrap();
    let lines = [
        "UFRAME_NUM=1",
        "UTOOL_NUM=1",
        "L P[1] 20mm/sec FINE Arc Start[7]",
        "L P[2] WELD_SPEED FINE Arc End[7]",
    ];
    let places = [0.0, 50.0].map(|x| [x, 0.0, 0.0, 180.0, 0.0, 0.0]);
    let program = posed(dir.path(), &lines, &places);
    let text = std::fs::read_to_string(&program).unwrap();
    std::fs::write(&program, text.replace(" mm,", " cm,")).unwrap();
    let job = job(dir.path());
    let runs = dir.path().join("runs");
    let refused = simulate_program(&program, Some(&job), NextIn(&runs), &Silent).unwrap_err();
    says(&refused, &["P[1] is told in another unit than mm", "in mm"]);
}
