//! What the judge says of vapour, where a pool of conduction ends, and without charts.

use std::path::Path;
use std::sync::Mutex;

use crate::support::{refusal, says};
use meltpath::chain::{self, RunError};
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Check, Observer, Silent, Status, Verdict};

use super::{path, verdict_of};

/// Vapour: what the verdict says of its mass and of the element that loses most, where a pool of conduction ends, and that the
/// remedy ends the doubt. A gas in the chamber holds vapour down; without the laws nobody knows.
#[test]
fn a_pool_that_vapour_moves_is_judged_once_it_is_colder() {
    let dir = tempfile::tempdir().unwrap();
    let verdict = |beam: &str| {
        let extra = format!(
            "[ebm]\n{beam}[region]\ncontour = [[\"0.2 mm\", \"0.1 mm\"], [\"1.8 mm\", \"0.1 mm\"], [\"1.8 mm\", \"0.5 mm\"], [\"0.2 mm\", \"0.5 mm\"]]\n[window]\nlow = \"1700 °C\"\nhigh = \"9000 °C\"\nmodel = \"solver\"\n[judge]\ncell = \"0.125 mm\"\nstep = \"10 us\"\n"
        );
        verdict_of(dir.path(), &extra)
    };
    let check = |verdict: &Verdict| {
        let mut checks = verdict.checks.iter();
        checks.find(|c| c.id == "in-window").unwrap().clone()
    };
    let fact = |verdict: &Verdict, id: &str| {
        let found = verdict.facts.iter().find(|f| f.id == id).unwrap().clone();
        (found.value.unwrap().value, found.title)
    };
    let hot = verdict("");
    let told = check(&hot);
    println!("{:?}: {}", told.status, told.reason);
    assert_eq!(told.status, Status::CannotSay);
    for said in ["2895 °C, where a still pool ends", "% of the section"] {
        assert!(told.reason.contains(said), "{said}: {}", told.reason);
    }
    let end = hot.facts.iter().find(|f| f.id == "pool-end").unwrap();
    for said in ["recoil of vapour", "radius of 0.21 mm"] {
        assert!(end.reason.contains(said), "{said}: {}", end.reason);
    }
    let remedy = told.remedy.unwrap();
    assert!(remedy.contains("less power"), "{remedy}");
    let (mass, _) = fact(&hot, "vapour-mass");
    let (aluminium, title) = fact(&hot, "vapour-element");
    println!("{mass:.4} mg, {title}: {aluminium:.2} %");
    assert!(title.contains("aluminium") && (0.1..50.0).contains(&aluminium));
    // the metal loses less of itself than of its aluminium
    let layer = 4309e-9 * 1e6 * 0.05 * 2.4 * 1.0;
    assert!(
        mass > 0.0 && 100.0 * mass / layer < aluminium,
        "{mass} {aluminium}"
    );
    // less power, as it says
    let cold = check(&verdict("efficiency = \"45 %\"\n"));
    assert_eq!(cold.status, Status::Pass, "{}", cold.reason);
    // a gas of a bar lets less go
    let (free, _) = fact(&hot, "vapour");
    let (held, _) = fact(&verdict("chamber = \"1 bar\"\n"), "vapour");
    assert!(held < 0.7 * free, "{held} {free}");
    // the same metal without its surface tension
    let text = meltpath_data::materials::TI6AL4V_EBM.text;
    let (before, _) = text.split_once("[surface_tension]").unwrap();
    std::fs::write(dir.path().join("own.toml"), before).unwrap();
    let unknown = check(&verdict("material = \"own.toml\"\nefficiency = \"45 %\"\n"));
    assert_eq!(unknown.status, Status::CannotSay);
    assert!(unknown.remedy.unwrap().contains("[surface_tension]"));
}

/// The solver judges alone: the same figures as beside charts, of which none is computed, drawn or told.
#[test]
fn the_solver_judges_without_charts() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("path.csv"), path(4, 4e-3)).unwrap();
    let file = dir.path().join("job.toml");
    let write = |charts: &str, rest: &str| {
        let text = format!(
            "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[charts]\n{charts}[window]\nlow = \"1700 °C\"\nhigh = \"9000 °C\"\nmodel = \"solver\"\n{rest}"
        );
        std::fs::write(&file, text).unwrap();
    };
    let judge = "[judge]\ncell = \"0.125 mm\"\nstep = \"10 us\"\n";
    let run = |charts: &str, name: &str| {
        write(charts, judge);
        let out = dir.path().join(name);
        let outcome = chain::run(&file, At(&out), &Silent).unwrap();
        (outcome.verdict, out)
    };
    let (alone, out) = run("preview = \"none\"\n", "alone");
    let (beside, _) = run("spacing = \"100 µm\"\nstop = \"3700 °C\"\n", "beside");
    // charts lay the grid otherwise: temperatures are a kelvin apart
    let told = |checks: &[Check]| -> Vec<_> {
        let all = checks.iter();
        all.map(|c| (c.id.clone(), c.status, c.value.clone()))
            .collect()
    };
    assert_eq!(told(&alone.checks), told(&beside.checks));
    for missing in ["charts", "fields/temperature.pvd", "series/voxels.csv"] {
        assert!(!out.join(missing).exists(), "{missing}");
    }
    for there in [
        "fields/voxels-reference.vti",
        "series/voxels-reference.csv",
        "path.csv",
    ] {
        assert!(out.join(there).is_file(), "{there}");
    }
    assert!(alone.facts.iter().all(|f| !f.id.ends_with("-charts")));
    write("preview = \"none\"\n", judge);
    let told = chain::doctor(&file, &Silent).unwrap();
    let charts = told.lines.iter().filter(|l| l.contains("charts of"));
    assert_eq!(charts.count(), 0, "{:?}", told.lines);
    for (rest, said) in [
        ("[judge]\nsolver = \"none\"\n", "nothing draws the path"),
        (
            "[optimise]\nmethod = \"learning\"\nsolver = \"charts\"\n",
            "takes temperatures from charts",
        ),
    ] {
        write("preview = \"none\"\n", rest);
        says(&refusal(&file), &[said]);
    }
}

/// What the path as given comes to on the judge's solver is told beside the found one, and where the found one melts more outside the
/// contour, which the search does not look at, a note says so.
#[test]
fn a_found_path_is_told_beside_the_given_one() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("job.toml");
    let job = "[process]\nkind = \"ebm\"\n[charts]\npreview = \"none\"\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"1 mm\", \"0 mm\"], [\"1 mm\", \"1 mm\"], [\"0 mm\", \"1 mm\"]]\n[window]\nlow = \"2900 °C\"\nhigh = \"3000 °C\"\nmodel = \"solver\"\n[hatch]\nstrategy = \"one-way\"\noverrun = \"0.1 mm\"\nspacing = \"0.1 mm\"\nspeed = \"1400 mm/s\"\ncurrent = \"2 mA\"\n[optimise]\nmethod = \"learning\"\nsolver = \"reference\"\nchange = \"current\"\nrounds = 4\ncell = \"0.125 mm\"\nstep = \"20 us\"\nspeeds = [\"40 %\", \"300 %\"]\n[judge]\ncell = \"0.04 mm\"\nstep = \"10 us\"\n";
    std::fs::write(&file, job).unwrap();
    let told = chain::run(&file, At(&dir.path().join("out")), &Silent);
    let verdict = told.unwrap().verdict;
    let fact = |id: &str| verdict.facts.iter().find(|f| f.id == id).unwrap();
    assert!(
        fact("in-window-given")
            .reason
            .contains("by the changed one")
    );
    let outside = verdict.checks.iter().find(|c| c.id == "molten-outside");
    let after = outside.unwrap().value.as_ref().unwrap().value;
    let given = fact("molten-outside-given");
    let before = given.value.as_ref().unwrap().value;
    assert!(
        given.reason.starts_with(&format!("{after:.2} %")),
        "{given:?}"
    );
    assert!(after > before + 0.1, "{after} {before}");
    let grew = verdict.warnings.iter().find(|w| w.code == "outside-grew");
    let remedy = grew.unwrap().remedy.as_ref().unwrap();
    assert!(remedy.contains("[correct]"), "{grew:?}");
    // and where it has less in the window, or more that is not molten
    let lost = verdict.warnings.iter().find(|w| w.code == "search-lost");
    let check = |id: &str| verdict.checks.iter().find(|c| c.id == id).unwrap();
    let value = |id: &str| check(id).value.as_ref().unwrap().value;
    let before = fact("in-window-given").value.as_ref().unwrap().value;
    println!("{before} {} {lost:?}", value("in-window"));
    let told = |what: &str| lost.is_some_and(|l| l.message.contains(what));
    assert_eq!(
        told("in the window"),
        value("in-window") < before - 1.0,
        "{lost:?}"
    );
}

/// What the path leaves out of the section counts, however far beside it lies: a strip ten times as long is as much less in the window.
#[test]
fn all_of_the_section_is_judged() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("path.csv"), path(17, 4e-3)).unwrap();
    let file = dir.path().join("job.toml");
    let verdict = |long: f64, name: &str| {
        let text = format!(
            "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"2 mm\", \"{long} mm\"], [\"0 mm\", \"{long} mm\"]]\n[charts]\npreview = \"none\"\n[window]\nlow = \"1700 °C\"\nhigh = \"9000 °C\"\nmodel = \"solver\"\n[judge]\ncell = \"0.125 mm\"\nstep = \"10 us\"\n"
        );
        std::fs::write(&file, text).unwrap();
        let out = dir.path().join(name);
        chain::run(&file, At(&out), &Silent).unwrap().verdict
    };
    let value = |verdict: &Verdict, id: &str| {
        let check = verdict.checks.iter().find(|c| c.id == id).unwrap();
        check.value.as_ref().unwrap().value
    };
    let (drawn, long) = (verdict(2.0, "drawn"), verdict(20.0, "long"));
    // beyond 2 mm a little melts beside the last line, which the short section does not count
    let share = |v: &Verdict| value(v, "in-window");
    assert!(share(&drawn) > 90.0, "{}", share(&drawn));
    assert!(
        (share(&long) - 0.1 * share(&drawn)).abs() < 1.5,
        "{}",
        share(&long)
    );
    assert!((value(&long, "unmelted") - 90.0).abs() < 1.5);
    assert!(value(&long, "unfused") > 88.0);
    let unmelted = long.checks.iter().find(|c| c.id == "unmelted").unwrap();
    assert_eq!(unmelted.status, Status::Fail);
    let remedy = unmelted.remedy.as_ref().unwrap();
    says(
        remedy,
        &["draws all of the section", "lie more than 0.5 mm beside"],
    );
}

/// Two layers: the second one stands on what the first one left warm, which the verdict, the report and a table tell; with
/// `memory = "metal"` it starts at the start temperature, as a layer alone does. Maps tell how the metal froze.
#[test]
fn a_layer_stands_on_what_the_one_below_left() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("path.csv"), path(4, 4e-3)).unwrap();
    let file = dir.path().join("job.toml");
    let run = |layers: u32, judge: &str| {
        let text = format!(
            "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[ebm]\nlayers = {layers}\nefficiency = \"45 %\"\n[charts]\npreview = \"none\"\n[window]\nlow = \"1700 °C\"\nhigh = \"9000 °C\"\nmodel = \"solver\"\n[judge]\ncell = \"0.125 mm\"\nstep = \"10 us\"\n{judge}"
        );
        std::fs::write(&file, text).unwrap();
        let out = dir.path().join("out");
        let outcome = chain::run(&file, At(&out), &Silent).unwrap();
        let table = std::fs::read_to_string(out.join("series/layers-reference.csv")).ok();
        let report = std::fs::read_to_string(out.join("report.html")).unwrap();
        let map = std::fs::read(out.join("fields/front-reference.vti")).unwrap();
        std::fs::remove_dir_all(&out).unwrap();
        let facts = &outcome.verdict.facts;
        let fact = facts.iter().find(|f| f.id == "ground-before").unwrap();
        let before = fact.value.as_ref().unwrap().value;
        (before, fact.reason.clone(), table, report, map)
    };
    let (before, told, table, report, map) = run(2, "between = \"0.5 s\"\n");
    println!("{before:.2} °C, {told}");
    assert!((751.0..900.0).contains(&before), "{before}");
    says(&told, &["1 layers drawn below", "0.5 s after each"]);
    says(&report, &["Layer after layer"]);
    let table = table.unwrap();
    println!("{table}");
    let of_last: Vec<f64> = table
        .lines()
        .last()
        .unwrap()
        .split(',')
        .map(|v| v.parse().unwrap())
        .collect();
    assert!((of_last[1] - before).abs() < 1e-3 && of_last[2] >= of_last[1]);
    assert!(of_last[8].abs() < 1e-3, "{of_last:?}");
    let map = String::from_utf8_lossy(&map);
    for name in ["gradient", "front_speed", "cooling_rate", "time_molten"] {
        assert!(map.contains(&format!("Name=\"{name}_")), "{name}");
    }
    // the longer it cools the less stays
    let (later, ..) = run(2, "between = \"5 s\"\n");
    assert!((750.0..before).contains(&later), "{later}");
    let (metal, told, ..) = run(2, "memory = \"metal\"\n");
    assert!((metal - 750.0).abs() < 1e-9, "{metal}");
    says(&told, &["assumed", "judge.memory"]);
    let (alone, told, table, report, _) = run(1, "");
    assert!((alone - 750.0).abs() < 1e-9 && table.is_none());
    assert!(!report.contains("Layer after layer"));
    says(&told, &["assumed", "ebm.layers"]);
    // powder that the laws do not know
    let text = std::fs::read_to_string(&file).unwrap();
    let text = text.replace("layers = 1", "layers = 2") + "powder = \"20 °C\"\n";
    std::fs::write(&file, text).unwrap();
    says(&refusal(&file), &["judge.powder is 20 °C", "leave it out"]);
}

/// Stops a run once a folder is there, and keeps what is noted.
struct Stop<'a>(Option<&'a Path>, Mutex<Vec<String>>);

impl Observer for Stop<'_> {
    fn stage(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn note(&self, text: &str) {
        self.1.lock().unwrap().push(text.to_owned());
    }
    fn cancelled(&self) -> bool {
        self.0.is_some_and(Path::exists)
    }
}

/// A run that is interrupted says that its layers are kept; the same command goes on from them, ends as if nothing had happened, and leaves
/// nothing behind.
#[test]
#[ignore = "layers that take more than a second each"]
fn an_interrupted_run_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("job.toml");
    let text = "[process]\nkind = \"ebm\"\n[ebm]\nlayers = 3\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"5 mm\", \"0 mm\"], [\"5 mm\", \"4 mm\"], [\"0 mm\", \"4 mm\"]]\n[hatch]\nstrategy = \"lines\"\n[charts]\npreview = \"none\"\n[window]\nlow = \"2000 °C\"\nhigh = \"2900 °C\"\nmodel = \"solver\"\n[judge]\ncell = \"0.06 mm\"\nbetween = \"1 s\"\n";
    std::fs::write(&file, text).unwrap();
    let [out, whole] = ["out", "whole"].map(|name| dir.path().join(name));
    let kept = dir.path().join("out-interrupted");
    let stop = Stop(Some(&kept), Mutex::default());
    let stopped = chain::run(&file, At(&out), &stop).unwrap_err();
    assert!(matches!(stopped, RunError::Cancelled(_)), "{stopped}");
    says(&stop.1.lock().unwrap().concat(), &["are kept"]);
    assert!(kept.exists() && !out.exists());
    let on = Stop(None, Mutex::default());
    let ended = chain::run(&file, At(&out), &on).unwrap();
    says(
        &on.1.lock().unwrap().concat(),
        &["an interrupted run of this job had drawn"],
    );
    assert!(!kept.exists());
    let other = chain::run(&file, At(&whole), &Silent).unwrap();
    assert_eq!(ended.verdict.checks, other.verdict.checks);
    assert_eq!(ended.verdict.facts, other.verdict.facts);
    let table = "series/layers-reference.csv";
    assert_eq!(
        std::fs::read(out.join(table)).unwrap(),
        std::fs::read(whole.join(table)).unwrap()
    );
}
