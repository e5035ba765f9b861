//! The machine's gun in a job: what it can draw is told with its place, what it makes of the path is what the solver judges.

use crate::support::{says, write};
use std::path::Path;

use meltpath::chain;
use meltpath::outcome::RunFolder::NextIn;
use meltpath_base::{Check, Silent, Status, Verdict};

use super::{job, path};

/// Everything that a path of lines needs is known.
const OWN: &str = "schema = 1\nname = \"ours\"\nsource = \"its log\"\n\
    least_power = { value = \"20 W\", source = \"log\" }\ngreatest_power = { value = \"3 kW\", source = \"log\" }\n\
    [current]\nchange = \"between-lines\"\n[deflection]\nspeed = \"between-lines\"\nlag = { value = \"LAG\", source = \"log\" }\n";

fn check(verdict: &Verdict) -> &Check {
    verdict.checks.iter().find(|c| c.id == "gun").unwrap()
}

fn fact(verdict: &Verdict, id: &str) -> f64 {
    let found = verdict.facts.iter().find(|f| f.id == id);
    found
        .and_then(|f| f.value.as_ref())
        .map_or(f64::NAN, |v| v.value)
}

fn run(folder: &Path, name: &str, rest: &str) -> Verdict {
    let gun = if name.is_empty() {
        String::new()
    } else {
        format!("[ebm]\ngun = \"{name}\"\n")
    };
    let file = job(folder, &format!("{gun}{rest}"), 4e-3);
    chain::run(&file, NextIn(&folder.join("runs")), &Silent)
        .unwrap()
        .verdict
}

fn own(folder: &Path, lag: &str) {
    std::fs::write(folder.join("own.toml"), OWN.replace("LAG", lag)).unwrap();
}

/// The beam is behind by speed times lag, and cuts the turns; the solver sees that.
#[test]
fn the_solver_judges_what_the_gun_draws() {
    let dir = tempfile::tempdir().unwrap();
    let judge = "[charts]\npreview = \"none\"\n[window]\nlow = \"1700 °C\"\nhigh = \"9000 °C\"\nmodel = \"solver\"\n[region]\ncontour = [[\"0 mm\", \"-1 mm\"], [\"2 mm\", \"-1 mm\"], [\"2 mm\", \"2 mm\"], [\"0 mm\", \"2 mm\"]]\n[judge]\ncell = \"0.05 mm\"\nstep = \"10 us\"\n";
    let run = |name: &str, path: &str| {
        std::fs::write(dir.path().join("path.csv"), path).unwrap();
        let gun = if name.is_empty() {
            String::new()
        } else {
            format!("gun = \"{name}\"\n")
        };
        let text = format!("path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[ebm]\n{gun}{judge}");
        let file = write(dir.path(), "job.toml", text);
        chain::run(&file, NextIn(&dir.path().join("runs")), &Silent).unwrap()
    };
    let lines = path(6, 4e-3);
    let planned = run("", &lines).verdict;
    assert_eq!(check(&planned).status, Status::NotChecked);
    own(dir.path(), "400 µs");
    let outcome = run("own.toml", &lines);
    let drawn = outcome.verdict;
    let told = check(&drawn);
    // it is that far from the end of the last line when the beam goes off
    assert_eq!(told.status, Status::Fail, "{told:?}");
    assert!(told.reason.contains("undrawn"), "{}", told.reason);
    // nearly steady at the end of lines of 2 mm, five lags long
    let behind = fact(&drawn, "gun-behind");
    assert!((behind - 392.0).abs() < 4.0, "{behind}");
    let beside = fact(&drawn, "gun-beside");
    assert!((50.0..200.0).contains(&beside), "{beside}");
    // what the machine is fed with is the plan, beside what it draws
    let read = |name: &str| std::fs::read_to_string(outcome.folder.join(name)).unwrap();
    assert!(read("drawn.csv").lines().count() > 2 * read("path.csv").lines().count());
    assert!(read("inputs/own.toml").contains("ours"));
    // what it draws, drawn by a gun that draws what it is asked for
    let again = run("", &read("drawn.csv")).verdict;
    let checks = drawn.checks.iter().zip(&again.checks);
    for (drawn, again) in checks.filter(|(d, _)| d.id != "gun") {
        let [a, b] = [drawn, again].map(|check| check.value.as_ref().unwrap().value);
        assert!((a - b).abs() < 1e-3, "{}: {a} {b}", drawn.id);
    }
    let [before, after, again] = [&planned, &drawn, &again].map(|v| fact(v, "hottest"));
    assert!(
        (after - again).abs() < 0.1 && (after - before).abs() > 10.0,
        "{before} {after} {again}"
    );
}

/// What nobody knows, and what a gun cannot do, is no pass; both are told before the run.
#[test]
fn a_path_that_a_gun_cannot_draw_is_told_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let thesis = run(dir.path(), "arcam-a1-2016", "");
    let told = check(&thesis);
    assert_eq!(told.status, Status::CannotSay);
    assert!(told.reason.contains("deflection.lag"), "{}", told.reason);
    assert!(told.remedy.as_ref().unwrap().contains("schema gun"));
    // the path turns slowly to its next line: one speed along it, or the thesis' machine cannot draw it
    own(dir.path(), "20 µs");
    let lines = path(6, 4e-3);
    let faster = lines.clone();
    let slow: Vec<String> = lines
        .lines()
        .map(|line| match line.split_once(',') {
            Some((time, rest)) if rest.contains(",0.5,") || rest.contains(",0.625,") => {
                let time: f64 = time.parse().unwrap();
                format!("{},{rest}", time + 1e-3)
            }
            _ => line.to_owned(),
        })
        .collect();
    for (file, gun, said, place) in [
        (faster, "own.toml", "another current", None),
        (
            slow.join("\n"),
            "arcam-a1-2016",
            "another speed",
            Some([0.0, 0.375]),
        ),
    ] {
        let text = job(dir.path(), &format!("[ebm]\ngun = \"{gun}\"\n"), 4e-3);
        // of the first a piece of a line has another current
        let file = if place.is_none() {
            file.replacen(
                "0.0020408163265306124,2,0,",
                "0.0010204081632653062,1,0,60000,0.004,0.004,1\n0.0020408163265306124,2,0,",
                1,
            )
        } else {
            file
        };
        std::fs::write(dir.path().join("path.csv"), file).unwrap();
        let doctor = chain::doctor(&text, &Silent).unwrap().lines.join("\n");
        assert!(doctor.contains(said), "{said}: {doctor}");
        let verdict = chain::run(&text, NextIn(&dir.path().join("runs")), &Silent)
            .unwrap()
            .verdict;
        let told = check(&verdict);
        assert_eq!(
            (told.status, told.reason.contains(said)),
            (Status::Fail, true),
            "{told:?}"
        );
        let [x, y, _] = told.place.as_ref().unwrap().position.unwrap();
        let [at_x, at_y] = place.unwrap_or([1.0, 0.0]);
        assert!((x - at_x).abs() < 0.2 && (y - at_y).abs() < 0.13, "{x} {y}");
    }
}

/// Lines that are joined at their ends, drawn so fast that the beam turns before each of them: told before the run, and no pass.
#[test]
fn corners_that_are_not_drawn_are_told() {
    let dir = tempfile::tempdir().unwrap();
    for (lag, lines) in [("600 µs", Some("6 lines")), ("100 µs", None)] {
        own(dir.path(), lag);
        let file = job(dir.path(), "[ebm]\ngun = \"own.toml\"\n", 4e-3);
        std::fs::write(dir.path().join("path.csv"), path(6, 4e-3)).unwrap();
        let doctor = chain::doctor(&file, &Silent).unwrap().lines.join("\n");
        let run = chain::run(&file, NextIn(&dir.path().join("runs")), &Silent);
        let verdict = run.unwrap().verdict;
        let told = check(&verdict);
        let Some(lines) = lines else {
            assert_eq!(told.value.as_ref().unwrap().value, 0.0, "{told:?}");
            assert!(!doctor.contains("half its spot"), "{doctor}");
            continue;
        };
        assert_eq!(told.status, Status::Fail, "{told:?}");
        let said = format!("where {lines} of the layer end or turn");
        assert!(told.reason.contains(&said), "{told:?}");
        assert!(doctor.contains(&format!("gun: {said}")), "{doctor}");
        let [x, y, _] = told.place.as_ref().unwrap().position.unwrap();
        assert!((x - 2.0).abs() < 0.1 && y.abs() < 0.1, "{x} {y}");
        let remedy = told.remedy.as_ref().unwrap();
        assert!(remedy.contains("slower lines: up to 3"), "{remedy}");
    }
}

/// A beam whose width no focus current changes is known before the run.
#[test]
fn a_search_for_a_focus_that_changes_nothing_is_refused_beforehand() {
    let dir = tempfile::tempdir().unwrap();
    own(dir.path(), "20 µs");
    let search = "diameter = \"350 µm\"\n[optimise]\nmethod = \"learning\"\nchange = \"focus\"\nsolver = \"reference\"\ncontroller = \"per-line\"\n";
    let text = format!("[ebm]\ngun = \"own.toml\"\n{search}");
    let file = job(dir.path(), &text, 4e-3);
    let told = chain::doctor(&file, &Silent).unwrap().refused.unwrap();
    let told = told.to_string();
    says(&told, &["optimise.change", "350 µm wide", "ebm.diameter"]);
    let run = chain::run(&file, NextIn(&dir.path().join("runs")), &Silent);
    assert_eq!(run.map(|_| ()).unwrap_err().to_string(), told);
}

#[test]
fn a_gun_that_cannot_do_the_job_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |gun: &str, rest: &str| {
        let file = job(dir.path(), &format!("[ebm]\ngun = \"{gun}\"\n{rest}"), 4e-3);
        let run = chain::run(&file, NextIn(&dir.path().join("runs")), &Silent);
        run.map(|o| o.verdict.status()).unwrap_err().to_string()
    };
    let told = refused("arcam-a1-2016", "[optimise]\nmethod = \"learning\"\n");
    says(&told, &["between stretches, the beam off only"]);
    let told = refused(
        "open-beam-path",
        "[optimise]\nmethod = \"learning\"\nchange = \"current\"\nsolver = \"reference\"\n",
    );
    assert!(told.contains("between straight lines only"), "{told}");
    let told = refused("arcam-a1", "");
    says(&told, &["known are \"arcam-a1-2016\", \"open-beam-path\""]);
    let wrong = "schema = 1\nname = \"x\"\nsource = \"y\"\nleast_power = { value = \"2 kW\", source = \"log\" }\ngreatest_power = { value = \"1 kW\", source = \"log\" }\n\
        [deflection]\nlag = { value = \"20\", source = \"log\" }\n";
    std::fs::write(dir.path().join("wrong.toml"), wrong).unwrap();
    let told = refused("wrong.toml", "");
    says(&told, &["lag", "wrong.toml"]);
}

/// A layer below the last one that the gun cannot draw is told, too: of two layers of a hatch whose direction turns, one has short lines and
/// many pauses in which the beam stays on.
#[test]
fn every_layer_is_followed() {
    let dir = tempfile::tempdir().unwrap();
    let known = OWN.replace("LAG", "1 µs").replace(
        "[deflection]",
        "between = \"ramped\"\nslew = { value = \"100 mA/ms\", source = \"log\" }\nbandwidth = { value = \"50 kHz\", source = \"log\" }\n[deflection]\njump = { value = \"20 µs\", source = \"log\" }",
    );
    std::fs::write(dir.path().join("own.toml"), known).unwrap();
    let told = |layers: u32, angle: &str| {
        let text = format!(
            "[process]\nkind = \"ebm\"\n[ebm]\ngun = \"own.toml\"\ndiameter = \"0.3 mm\"\nlayers = {layers}\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"6 mm\", \"0 mm\"], [\"6 mm\", \"0.4 mm\"], [\"0 mm\", \"0.4 mm\"]]\n[hatch]\nstrategy = \"one-way\"\nspacing = \"0.1 mm\"\nspeed = \"2 m/s\"\nangle = \"{angle}\"\nturn = \"90 deg\"\ncurrent = \"3 mA\"\n"
        );
        let file = write(dir.path(), "job.toml", text);
        let lines = chain::doctor(&file, &Silent).unwrap().lines;
        let lines = lines.into_iter().filter(|l| l.contains("drawn besides"));
        lines.collect::<Vec<_>>().join("\n")
    };
    assert_eq!(told(1, "0 deg"), "");
    let first = told(1, "90 deg");
    assert!(!first.is_empty());
    // the last layer has long lines, the one below it short ones
    let below = told(2, "90 deg");
    assert!(below.contains("layer 1 (the worst of 2)"), "{below}");
}
