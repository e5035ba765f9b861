//! Beads that no way of the arm holds as a whole: they end, the arm goes over in the air, they begin anew.

use std::path::{Path, PathBuf};

use crate::dialects::cell;
use crate::support::{check, part, write};
use meltpath::outcome::Outcome;
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath::waam::{LeftOpen, plan_to_file, read_toolpath, run, simulate_program};
use meltpath_base::{Fact, Silent, Status, Verdict};
use meltpath_data::robots;
use meltpath_geometry::shapes::{self, extrude};
use meltpath_toolpath::Toolpath;

/// Round walls of 6 mm about the z axis.
fn ring(folder: &Path, radius: f64) {
    let walls = shapes::ring(radius + 3.0, radius - 3.0, 120);
    part(folder, "ring.stl", &extrude(&[walls], 6.0));
}

/// An arm that ships on a plate of its own, as if torch and table had been measured: it stands `beside` mm off the middle of the part.
fn robot(folder: &Path, text: &str, beside: f64) {
    let (arm, _) = text.split_once("\n[torch]").unwrap();
    let arm = arm
        .split_once("\n# A table that tilts")
        .map_or(arm, |a| a.0);
    let around = "\n[torch]\nsource = \"measured\"\nposition = [\"0 mm\", \"0 mm\", \"330 mm\"]\n\
        angles = [\"0 deg\", \"35 deg\", \"0 deg\"]\nwire = \"15 mm\"\n[table]\nsource = \"measured\"\n";
    let text = format!("{arm}{around}position = [\"{beside} mm\", \"0 mm\", \"200 mm\"]\n");
    write(folder, "robot.toml", text);
}

fn job(folder: &Path, machine: &str) -> PathBuf {
    let text = format!(
        "part = \"ring.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 1\n\
         [fill]\nstrategy = \"contour\"\nspacing = \"adjust\"\n[machine]\nsmoothing = \"50 %\"\n{machine}\n[simulation]\ncell = \"4 mm\"\n"
    );
    write(folder, "job.toml", text)
}

/// The plan as it is where no robot is named.
fn without_robot(folder: &Path) -> Toolpath {
    let file = folder.join("whole.melt");
    plan_to_file(&job(folder, ""), &file, LeftOpen::Chosen, &Silent).unwrap();
    read_toolpath(&file).unwrap()
}

fn fact<'a>(verdict: &'a Verdict, id: &str) -> Option<&'a Fact> {
    verdict.facts.iter().find(|f| f.id == id)
}

fn value(verdict: &Verdict, id: &str) -> f64 {
    let fact = fact(verdict, id).unwrap_or_else(|| panic!("{id}"));
    fact.value.as_ref().unwrap().value
}

/// The ring is built by parts, and what its program says is what was planned and simulated.
fn in_parts(folder: &Path, machine: &str) -> Outcome {
    ring(folder, 600.0);
    let whole = without_robot(folder);
    let job = job(folder, machine);
    let outcome = run(&job, NextIn(&folder.join("runs")), &Silent).unwrap();
    let verdict = &outcome.verdict;
    for id in ["reach", "config", "program"] {
        let check = check(verdict, id);
        println!("{id}: {} {}", check.line(), check.reason);
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    let told = fact(verdict, "divided-beads").unwrap();
    println!("{}", told.reason);
    assert!(
        told.reason.contains("joint 1 reaches its limit of"),
        "{told:?}"
    );
    assert!(told.place.as_ref().unwrap().bead.is_some());
    let divided = value(verdict, "divided-beads");
    assert!(divided >= 1.0 && value(verdict, "way-changes") >= divided);
    // as many more beads, each with an arc of its own, of the same length together
    let plan = read_toolpath(&outcome.folder.join("toolpath.melt")).unwrap();
    plan.sanity_check().unwrap();
    let beads = plan.pass_count() as f64;
    assert_eq!(beads, whole.pass_count() as f64 + divided);
    assert_eq!(value(verdict, "arc-starts"), beads);
    let [long, laid] = [&whole, &plan].map(Toolpath::deposited_length);
    assert!((long - laid).abs() < 1e-6 * long, "{long} {laid}");
    // the program alone builds the same
    let files = std::fs::read_dir(outcome.folder.join("program")).unwrap();
    let main = files.map(|f| f.unwrap().path());
    let main = main.max().unwrap();
    let alone = simulate_program(&main, Some(&job), At(&folder.join("alone")), &Silent).unwrap();
    for id in ["reach", "config"] {
        assert_eq!(check(&alone.verdict, id).status, Status::Pass);
    }
    for id in [
        "arc-starts",
        "time-arc",
        "time-travel",
        "way-changes",
        "height-built",
    ] {
        let [a, b] = [verdict, &alone.verdict].map(|v| value(v, id));
        assert!((a - b).abs() <= 1e-9 * a.abs(), "{id}: {a} {b}");
    }
    outcome
}

/// The first axis of an ARC Mate ends before it has gone round: the ring ends there, the arm turns back in the air, and the ring goes on.
#[test]
fn a_ring_around_a_fanuc_is_laid_in_parts() {
    let dir = tempfile::tempdir().unwrap();
    robot(dir.path(), robots::FANUC_ARCMATE_120IC.text, 0.0);
    let outcome = in_parts(dir.path(), "robot = \"robot.toml\"");
    let mut text = String::new();
    for file in std::fs::read_dir(outcome.folder.join("program")).unwrap() {
        text += &std::fs::read_to_string(file.unwrap().path()).unwrap();
    }
    // with a crater, a stop over its end, a joint move and a strike of its own
    let moves: Vec<&str> = text
        .lines()
        .filter(|l| l.contains(" P[") && l.contains(':'))
        .collect();
    let over = moves
        .iter()
        .skip(1)
        .position(|l| l.contains(":J P["))
        .unwrap()
        + 1;
    assert!(
        moves[over - 2].contains("Arc End["),
        "{:#?}",
        &moves[over - 2..]
    );
    assert!(moves[over - 1].contains("FINE") && moves[over].contains("FINE"));
    assert!(moves[over + 1].contains("Arc Start["));
}

#[test]
fn a_ring_around_a_kuka_is_laid_in_parts() {
    let dir = tempfile::tempdir().unwrap();
    robot(dir.path(), robots::KUKA_KR16_R2010_2.text, 0.0);
    write(dir.path(), "cell.toml", cell("kuka-krl"));
    in_parts(dir.path(), "robot = \"robot.toml\"\ncell = \"cell.toml\"");
}

/// What lies beyond the arm is not laid in parts either: the beads stay whole, and the verdict names the place.
#[test]
fn a_ring_that_is_too_far_stays_whole() {
    let dir = tempfile::tempdir().unwrap();
    ring(dir.path(), 600.0);
    robot(dir.path(), robots::FANUC_ARCMATE_120IC.text, 1500.0);
    let whole = without_robot(dir.path());
    let job = job(dir.path(), "robot = \"robot.toml\"");
    let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let reach = check(&outcome.verdict, "reach");
    assert_eq!(reach.status, Status::Fail, "{reach:?}");
    assert!(reach.place.is_some() && fact(&outcome.verdict, "divided-beads").is_none());
    let plan = read_toolpath(&outcome.folder.join("toolpath.melt")).unwrap();
    assert_eq!(plan.pass_count(), whole.pass_count());
}
