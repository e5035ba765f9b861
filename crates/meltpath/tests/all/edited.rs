//! Programs of a job's own plan that somebody edited: what they say is judged, not what the plan said.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{check, says, thin_wall, warned};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Silent, Status, Verdict, Warning};

/// The program of a thin wall's run, with its text and its job.
fn written(folder: &Path) -> (String, PathBuf) {
    written_with(folder, "")
}

/// See [`written`]; its layers are so.
fn written_with(folder: &Path, layers: &str) -> (String, PathBuf) {
    let job = thin_wall(
        folder,
        &format!(
            "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 3\n{layers}[simulation]\ncell = \"1 mm\"\n"
        ),
    );
    let outcome = run(&job, NextIn(&folder.join("runs")), &Silent).unwrap();
    let mut files = fs::read_dir(outcome.folder.join("program")).unwrap();
    let file = files.next().unwrap().unwrap().path();
    let text = fs::read_to_string(file).unwrap();
    (text, job)
}

fn simulated(folder: &Path, text: &str, job: &Path) -> Verdict {
    let program = folder.join("WALL.LS");
    fs::write(&program, text).unwrap();
    let runs = folder.join("again");
    let outcome = simulate_program(&program, Some(job), NextIn(&runs), &Silent).unwrap();
    outcome.verdict
}

fn told(verdict: &Verdict) -> &Warning {
    let edited = verdict.warnings.iter().find(|w| w.code == "edited");
    edited.unwrap_or_else(|| panic!("{:?}", verdict.warnings))
}

#[test]
fn an_edited_feed_is_judged_by_what_the_program_says() {
    let dir = tempfile::tempdir().unwrap();
    let (text, job) = written(dir.path());
    let same = simulated(dir.path(), &text, &job);
    assert!(!warned(&same, "edited"), "{:?}", same.warnings);
    assert!(same.checks.iter().all(|c| c.id != "range"));
    assert!(same.checks.iter().any(|c| c.id == "overhang"));

    assert!(text.contains("WFS 8.00"));
    let weak = simulated(dir.path(), &text.replace("WFS 8.00", "WFS 1.50"), &job);
    let range = check(&weak, "range");
    assert_eq!(range.status, Status::CannotSay, "{range:?}");
    says(&range.reason, &["first at 1.50 m/min wire feed"]);
    says(
        &told(&weak).message,
        &["fed at 1.50 m/min, planned 8.00 m/min"],
    );
    assert_eq!(told(&weak).place.as_ref().unwrap().layer, Some(1));
}

#[test]
fn pauses_that_were_taken_out_or_shortened_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let (text, job) = written_with(dir.path(), "pause = \"30 s\"\n");
    let same = simulated(dir.path(), &text, &job);
    assert!(!warned(&same, "pauses"), "{:?}", same.warnings);
    let waits = |line: &&str| line.contains("WAIT") && line.contains("30.00(sec)");
    let wait = text.lines().find(waits).unwrap();
    let short = text.replace("30.00(sec)", "3.00(sec)");
    let without = text.replace(wait.split_once(':').unwrap().1, "  ;");
    for (edited, found) in [(short, "3.0 s"), (without, "0.0 s")] {
        let verdict = simulated(dir.path(), &edited, &job);
        let told = verdict.warnings.iter().find(|w| w.code == "pauses");
        let told = told.unwrap_or_else(|| panic!("{:?}", verdict.warnings));
        let line = &format!("{found}, planned 30.0 s, line ");
        says(
            &told.message,
            &["a bead of layer 2", line, "and 1 pause more"],
        );
        // what is laid is the plan's all the same
        assert!(!warned(&verdict, "edited"), "{:?}", verdict.warnings);
        assert!(verdict.checks.iter().any(|c| c.id == "overhang"));
    }
}

#[test]
fn the_first_edited_place_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let (text, job) = written(dir.path());
    let (before, last) = text.split_at(text.find("!Layer 3 ").unwrap());
    let ends: Vec<&str> = last.lines().filter(|l| l.contains("Arc End")).collect();
    let [end] = ends[..] else {
        panic!("{last}");
    };
    let (_, speed) = end.split_once("] ").unwrap();
    let (speed, _) = speed.split_once("cm/min").unwrap();
    let faster = format!("{:.1}", 1.2 * speed.parse::<f64>().unwrap());
    let line = end.replace(&format!("{speed}cm/min"), &format!("{faster}cm/min"));
    assert_ne!(line, end);
    let verdict = simulated(
        dir.path(),
        &format!("{before}{}", last.replace(end, &line)),
        &job,
    );
    let told = told(&verdict);
    says(
        &told.message,
        &["a bead is laid at", "moves with the arc on"],
    );
    assert_eq!(told.place.as_ref().unwrap().layer, Some(3));

    // other software's begins elsewhere, and has nothing to do with the plan
    let swapped = [("X =", "Q ="), ("Y =", "X ="), ("Q =", "Y =")];
    let moved = swapped.iter().fold(text, |t, (a, b)| t.replace(a, b));
    let moved = simulated(dir.path(), &moved, &job);
    assert!(!warned(&moved, "edited"), "{:?}", moved.warnings);
}
