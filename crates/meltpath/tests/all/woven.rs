//! Jobs whose beads are woven, from the job through the program of the controller to the verdict.

use std::path::{Path, PathBuf};

use crate::dialects::cell;
use crate::support::{check, refusal, says, thin_wall, warned, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{examine, read_toolpath, run, simulate_program};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_toolpath::{Event, Weave, WeaveShape};

const METAL: [&str; 6] = ["lack", "excess", "stock", "flatness", "height", "overhang"];
const SINE: &str =
    "shape = \"sine\"\nfrequency = \"2 Hz\"\namplitude = \"2 mm\"\ndwell_right = \"0.1 s\"\n";
const ZIGZAG: &str = "shape = \"triangle\"\nfrequency = \"2 Hz\"\namplitude = \"2 mm\"\n";

/// So much beside the wall that woven beads fit into it.
const WIDE: &str = "[target]\nallowance = \"6 mm\"\n";

/// A folder after which programs are called.
fn home(folder: &Path) -> PathBuf {
    let home = folder.join("job");
    std::fs::create_dir(&home).unwrap();
    home
}

/// Two layers of the thin wall, woven, with further tables.
fn job(folder: &Path, weave: &str, tables: &str) -> PathBuf {
    thin_wall(
        folder,
        &format!(
            "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.5 m/min\"\n[waam.bead.weave]\n{weave}\
             [layers]\ncount = 2\n[simulation]\ncell = \"1 mm\"\n{tables}"
        ),
    )
}

fn undecided(verdict: &Verdict) {
    for id in METAL {
        let check = check(verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(
            &check.reason,
            &["beads are woven", "no woven bead was measured"],
        );
    }
}

#[test]
fn a_woven_job_is_written_driven_and_not_decided() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(&home(dir.path()), SINE, WIDE);
    let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    undecided(&outcome.verdict);
    assert!(warned(&outcome.verdict, "weave-damped"));
    assert_eq!(check(&outcome.verdict, "program").status, Status::Pass);
    let plan = read_toolpath(&outcome.folder.join("toolpath.melt")).unwrap();
    let weave = Weave {
        shape: WeaveShape::Sine,
        frequency: 2.0,
        amplitude: 2.0,
        dwell: [0.0, 0.1],
    };
    assert!((plan.weaves[0].frequency - 2.0).abs() < 1e-12);
    assert_eq!(plan.weaves.len(), 1);
    assert_eq!(
        (plan.weaves[0].shape, plan.weaves[0].dwell),
        (weave.shape, weave.dwell)
    );
    for pass in plan.passes() {
        let events: Vec<_> = pass.events().collect();
        let on = pass.head.role.deposits();
        assert_eq!(events, [(0, Event::Weave(1))][..usize::from(on)]);
    }
    let main = outcome.folder.join("program/JOB.LS");
    let text = std::fs::read_to_string(&main).unwrap();
    let beads = text.matches("Arc Start[").count();
    assert_eq!(
        text.matches("Weave Sine[2.0Hz,2.0mm,0.100s,0.000s]")
            .count(),
        beads
    );
    assert_eq!(text.matches("Weave End").count(), beads);
    // the assumed width is told, with where it comes from
    let told = std::fs::read_to_string(outcome.folder.join("provenance.json")).unwrap();
    says(
        &told,
        &["waam.bead.weave.bead_width", "no woven bead was measured"],
    );
    // read back it is the plan's own program, as little decided
    let again = simulate_program(
        &main,
        Some(&job),
        NextIn(&dir.path().join("again")),
        &Silent,
    );
    let again = again.unwrap().verdict;
    undecided(&again);
    assert_eq!(check(&again, "lines").status, Status::Pass);
    let value = |v: &Verdict| check(v, "flatness").value.as_ref().unwrap().value;
    let off: f64 = value(&again) - value(&outcome.verdict);
    assert!(off.abs() < 1e-9, "{off}");
}

/// The plan takes a woven bead for wider: fewer of them fill a block, and they lie farther apart.
#[test]
fn woven_beads_lie_farther_apart() {
    let step = |weave: &str| -> f64 {
        let dir = tempfile::tempdir().unwrap();
        let doctor = meltpath::chain::doctor(&job(dir.path(), weave, WIDE), &Silent).unwrap();
        let told = doctor.lines.iter().flat_map(|l| l.lines());
        let mut told = told.filter_map(|l| l.trim().strip_prefix("stepover = "));
        let words = told.next().unwrap().split(' ').next();
        words.unwrap().parse().unwrap()
    };
    let near = step(SINE);
    let far = step(&SINE.replace("2 mm", "3 mm"));
    let told = step(&format!("{SINE}bead_width = \"9 mm\"\n"));
    assert!((far - near - 2.0 * 0.7378).abs() < 0.02, "{near} {far}");
    assert!((told - 9.0 * 0.7378).abs() < 0.02, "{told}");
}

#[test]
fn a_zigzag_is_written_for_three_makers_and_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let words =
        cell("kuka-krl").replace("[program.krl]", "[program.krl]\nweave_amplitude = \"side\"");
    let listed = "[[program.weave]]\nnumber = 5\nshape = \"triangle\"\nfrequency = \"2 Hz\"\namplitude = \"2 mm\"\n";
    let home = home(dir.path());
    write(&home, "cell.toml", words + listed);
    let job = job(
        &home,
        ZIGZAG,
        &format!(
            "{WIDE}[machine]\ncell = \"cell.toml\"\n[output]\nprograms = [\"kuka-krl\", \"abb-rapid\", \"fanuc-ls\"]\n"
        ),
    );
    let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    assert_eq!(check(&outcome.verdict, "program").status, Status::Pass);
    undecided(&outcome.verdict);
    let programs = outcome.folder.join("program");
    for (name, told) in [
        ("JOB.dat", "Pattern #Triangle"),
        ("JOB.mod", "\\Weave:=wv1"),
        ("JOB.LS", "Weave[5]"),
    ] {
        let text = std::fs::read_to_string(programs.join(name)).unwrap();
        assert!(text.contains(told), "{name}: {told}");
    }
    for name in ["JOB.src", "JOB.mod", "JOB.LS"] {
        let (out, program) = (dir.path().join(name), programs.join(name));
        let again = simulate_program(&program, Some(&job), NextIn(&out), &Silent).unwrap();
        assert_eq!(
            check(&again.verdict, "lines").status,
            Status::Pass,
            "{name}"
        );
        undecided(&again.verdict);
    }
}

#[test]
fn a_weave_that_makes_no_bead_is_refused_at_its_key() {
    let dir = tempfile::tempdir().unwrap();
    let told = |weave: &str, tables: &str| refusal(&job(dir.path(), weave, tables));
    for (from, to, wanted) in [
        ("\"2 mm\"", "\"20 mm\"", "swings no farther than its width"),
        ("\"2 Hz\"", "\"0.2 Hz\"", "they would not run together"),
        ("\"2 Hz\"", "\"6 Hz\"", "too fast for this controller"),
        (
            "\"2 mm\"",
            "\"2 mm\"\nbead_width = \"3 mm\"",
            "bead that is not woven",
        ),
        ("\"2 Hz\"", "\"2.05 Hz\"", "steps of 0.1 Hz"),
    ] {
        says(&told(&SINE.replace(from, to), WIDE), &[wanted]);
    }
    says(&told(SINE, "[surface]\n"), &["planned without a weave"]);
}

/// A plan is followed in the words of the program that is delivered, whatever the cell's own controller reads.
#[test]
fn a_weave_is_followed_in_the_words_of_what_is_delivered() {
    let dir = tempfile::tempdir().unwrap();
    let home = home(dir.path());
    write(&home, "cell.toml", cell("abb-rapid"));
    let sine = "shape = \"sine\"\nfrequency = \"2 Hz\"\namplitude = \"2 mm\"\n";
    let job = |program: &str| {
        let tables = format!(
            "[machine]\ncell = \"cell.toml\"\n{WIDE}[output]\nprograms = [\"{program}\"]\n"
        );
        job(&home, sine, &tables)
    };
    says(&refusal(&job("abb-rapid")), &["weave"]);
    examine(&job("fanuc-ls"), &Silent).unwrap();
}
