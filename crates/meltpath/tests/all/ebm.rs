//! The electron-beam chain on a small job: what it writes, what it says, what it refuses.

mod cake;
mod charts;
mod corrected;
mod costs;
mod greens;
mod gun;
mod judged;
mod material;
mod part;
mod quality;
mod reference_solver;
mod searched;
mod spots;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::support::{check, has_files, plan_of, refusal, rows, says, warned, write};
use meltpath::ebm::plan::planned;
use meltpath::ebm::settings::resolve;
use meltpath::ebm::simulate::simulate;
use meltpath::job::{Job, load};
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath::{chain, compare};
use meltpath_base::{Reporter, Silent, Status, Verdict};

/// Lines of 2 mm every 0.125 mm at 980 mm/s, 60 kV, 5 mA and `focus` A.
fn path(lines: u32, focus: f64) -> String {
    let mut text = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n".to_owned();
    let mut time = 0.0;
    for n in 0..lines {
        let y = 0.125 * f64::from(n);
        let ends = if n % 2 == 0 { [0.0, 2.0] } else { [2.0, 0.0] };
        for (m, x) in ends.into_iter().enumerate() {
            writeln!(text, "{time},{x},{y},60000,0.005,{focus},1").unwrap();
            time += if m == 0 { 2.0 / 980.0 } else { 0.125 / 980.0 };
        }
    }
    text
}

const JOB: &str = "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 3\n";

/// A job text whose charts decide nothing, unless it says how it is judged: most tests look at charts, and judging takes long.
pub(crate) fn previewed(text: &str) -> String {
    if text.contains("[judge]") {
        text.to_owned()
    } else {
        format!("{text}[judge]\nsolver = \"none\"\n")
    }
}

/// A job without a file of its path, with more tables.
fn hatched(folder: &Path, tables: &str) -> PathBuf {
    let text = JOB.replace("path = \"path.csv\"\n", "") + tables;
    write(folder, "job.toml", previewed(&text))
}

/// The path that a run of a job writes.
fn drawn(file: &Path, out: &Path) -> String {
    chain::run(file, At(out), &Silent).unwrap();
    std::fs::read_to_string(out.join("path.csv")).unwrap()
}

/// What a job of six lines says; its folder is gone.
fn verdict_of(folder: &Path, extra: &str) -> Verdict {
    let file = job(folder, extra, 4e-3);
    let outcome = chain::run(&file, At(&folder.join("out")), &Silent).unwrap();
    std::fs::remove_dir_all(&outcome.folder).unwrap();
    outcome.verdict
}

fn job(folder: &Path, extra: &str, focus: f64) -> PathBuf {
    std::fs::write(folder.join("path.csv"), path(6, focus)).unwrap();
    write(folder, "job.toml", previewed(&format!("{JOB}{extra}")))
}

#[test]
fn a_small_job_runs_and_learns() {
    let dir = tempfile::tempdir().unwrap();
    let extra = "sections = [[\"1 mm\", \"0.25 mm\"], [\"50 mm\", \"0 mm\"]]\n[window]\ngood = \"path.csv\"\n[region]\ninside = \"0.1 mm\"\n[optimise]\nmethod = \"learning\"\nrounds = 3\n[checks]\nin_window = \"5 %\"\n";
    let file = job(dir.path(), extra, 4e-3);
    let out = dir.path().join("out");
    let outcome = chain::run(&file, At(&out), &Silent).unwrap();
    // charts preview: what they say is kept, and nothing passes by it
    assert_eq!(outcome.verdict.status(), Status::CannotSay);
    let share = &outcome.verdict.checks[0];
    assert_eq!(
        (share.id.as_str(), share.status),
        ("in-window", Status::CannotSay)
    );
    assert!(share.remedy.as_ref().unwrap().contains("out of [judge]"));
    for id in ["in-window-charts", "unmelted-charts"] {
        let fact = outcome.verdict.facts.iter().find(|f| f.id == id).unwrap();
        assert!(fact.value.is_some() && fact.reason == "preview by charts");
    }
    let told = warned(&outcome.verdict, "laws-extrapolated");
    assert!(told, "{:?}", outcome.verdict.warnings);
    has_files(
        &out,
        &[
            "report.html",
            "verdict.json",
            "provenance.json",
            "path.csv",
            "charts/1.melt",
            "series/voxels.csv",
            "fields/temperature.pvd",
            "fields/frames/003.vti",
            "fields/voxels.vti",
        ],
    );
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    says(
        &report,
        &[
            "Section along x through the hottest place, charts",
            "Section along y through x 1 mm, y 0.25 mm, charts",
            "x 50 mm, y 0 mm lies outside the voxels",
            "as given",
            "better path",
        ],
    );
    // the charts it wrote serve the next run, and the path it wrote is one
    let again = dir.path().join("again.toml");
    let text = format!("{JOB}files = [\"out/charts/1.melt\"]\n")
        .replace("path.csv", "out/path.csv")
        .replace("[simulation]\nframes = 3\nfiles", "files");
    std::fs::write(&again, previewed(&text)).unwrap();
    let second = chain::run(&again, At(&dir.path().join("second")), &Silent).unwrap();
    assert_eq!(
        std::fs::read(out.join("charts/1.melt")).unwrap(),
        std::fs::read(second.folder.join("charts/1.melt")).unwrap()
    );
}

/// A region with a hole, two layers of lines that cross: no file of a path is needed, and the one that is written is one.
#[test]
fn a_region_is_hatched_layer_by_layer() {
    let dir = tempfile::tempdir().unwrap();
    let tables = "[ebm]\nlayers = 2\n[hatch]\nspacing = \"0.1 mm\"\n[window]\nbody = [\"2 mm\", \"2 mm\"]\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"2 mm\", \"2 mm\"], [\"0 mm\", \"2 mm\"]]\nholes = [[[\"0.8 mm\", \"0.8 mm\"], [\"1.2 mm\", \"0.8 mm\"], [\"1.2 mm\", \"1.2 mm\"]]]\n[checks]\nin_window = \"1 %\"\n";
    let file = hatched(dir.path(), tables);
    let text = std::fs::read_to_string(&file).unwrap();
    let out = dir.path().join("out");
    let csv = drawn(&file, &out);
    // the second layer's lines run along y
    let upright = csv.lines().skip(1).filter(|l| !l.starts_with('#'));
    let first: Vec<Vec<f64>> = upright
        .take(2)
        .map(|l| l.split(',').map(|c| c.parse().unwrap()).collect())
        .collect();
    assert!((first[0][1] - first[1][1]).abs() < 1e-9, "{first:?}");
    assert!(out.join("path.parquet").is_file());
    for (extra, what) in [
        ("path = \"p.csv\"\n", "either `path` or the table [hatch]"),
        ("", "has nothing to fill"),
    ] {
        let wrong = if extra.is_empty() {
            text.replace("contour = ", "# ").replace("holes = ", "# ")
        } else {
            format!("{extra}{text}")
        };
        std::fs::write(&file, wrong).unwrap();
        says(&refusal(&file), &[what]);
    }
}

/// The reference solver finds a path whose current changes along it; the report stands beside the un-optimised one.
#[test]
fn a_path_is_found_on_the_reference_solver() {
    let dir = tempfile::tempdir().unwrap();
    let plain = JOB.replace("[charts]\n", "[charts]\nmemory = \"none\"\n");
    let text = plain.replace("path = \"path.csv\"\n", "")
        + "[hatch]\nstrategy = \"one-way\"\n[window]\nbody = [\"2 mm\", \"1.5 mm\"]\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"0 mm\", \"1.2 mm\"]]\n[optimise]\nmethod = \"learning\"\nsolver = \"reference\"\nchange = \"current\"\norders = [\"backwards\"]\nrounds = 4\ncell = \"0.1 mm\"\n[checks]\nin_window = \"5 %\"\n";
    let file = write(dir.path(), "job.toml", previewed(&text));
    let out = dir.path().join("out");
    let outcome = chain::run(&file, At(&out), &Silent).unwrap();
    // one run of the solver shows no convergence
    assert_eq!(outcome.verdict.status(), Status::CannotSay);
    let fact = outcome
        .verdict
        .facts
        .iter()
        .find(|f| f.id == "in-window-search");
    assert!(fact.unwrap().value.as_ref().unwrap().value > 5.0);
    // what lies beyond the laws is said of the solver too, not of charts alone
    let warnings = &outcome.verdict.warnings;
    let warned = |code: &str| warnings.iter().find(|w| w.code == code);
    let beyond = &warned("laws-extrapolated-reference").unwrap().message;
    // and of which path
    assert!(beyond.contains(", that of the path as given "), "{beyond}");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    says(
        &report,
        &[
            "laws of",
            "Beam current along lines",
            "What the search saw: voxels inside the contour, its rim left out",
            "Orders and strategies tried",
            "backwards",
        ],
    );
    let csv = std::fs::read_to_string(out.join("path.csv")).unwrap();
    let currents: std::collections::BTreeSet<&str> = csv
        .lines()
        .skip(1)
        .filter_map(|l| l.split(',').nth(4))
        .collect();
    assert!(currents.len() > 5, "{currents:?}");
    // the run drew it with charts too, for some of its currents, and comparing draws the same, but for currents halfway
    // between two steps
    assert!(warned("charts-in-steps").is_some());
    let voxels = out.join("series/voxels.csv");
    let same = compare::compare(&out, Some(&voxels), NextIn(dir.path()), &Silent).unwrap();
    let apart = same.parts.iter().map(|p| p.apart.mean);
    assert!(apart.fold(0.0, f64::max) < 1.0);
    let wrong = text.replace("solver = \"reference\"\n", "solver = \"charts\"\n");
    std::fs::write(&file, wrong).unwrap();
    says(&refusal(&file), &["need a solver"]);
}

/// Optimiser and judge read the good body's middle alike: with the same cells and steps both have the same window.
#[test]
fn optimiser_and_judge_speak_of_one_window() {
    let dir = tempfile::tempdir().unwrap();
    let text = JOB.replace("path = \"path.csv\"\n", "")
        + "[hatch]\n[window]\nbody = [\"2 mm\", \"1.5 mm\"]\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"1.5 mm\", \"0 mm\"], [\"0 mm\", \"1.2 mm\"]]\n[optimise]\nmethod = \"learning\"\nsolver = \"reference\"\nrounds = 1\ncell = \"0.06 mm\"\nstep = \"10 us\"\n[judge]\nsolver = \"reference\"\nground = \"thesis-box\"\nbeyond = \"0.1 mm\"\ncell = \"0.06 mm\"\nstep = \"10 us\"\n";
    let file = write(dir.path(), "job.toml", previewed(&text));
    let plan = plan_of(&file);
    let outcome = simulate(&plan, &Reporter::new(), &Silent).unwrap();
    let found = outcome.found.unwrap().reference.unwrap();
    let judged = outcome.judged.unwrap();
    let apart = found.classes.window[0] - judged.classes.window[0];
    println!("windows {apart:.2} K apart");
    assert!(apart.abs() < 3.0, "{apart} K");
}

#[test]
fn what_cannot_be_is_refused_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |extra: &str, focus: f64| {
        let file = job(dir.path(), extra, focus);
        let out = dir.path().join("out");
        let error = chain::run(&file, At(&out), &Silent).unwrap_err();
        assert!(!out.exists());
        error.to_string()
    };
    assert!(refused("", 0.05).contains("outside the calibration"));
    assert!(refused("[window]\nwidth = \"60 °C\"\n", 4e-3).contains("one of \"K\""));
    assert!(
        refused("[window]\nlow = \"2800 °C\"\nhigh = \"2700 °C\"\n", 4e-3).contains("not below")
    );
    assert!(
        refused("[ebm]\nmaterial = \"gold\"\n", 4e-3)
            .contains("known are \"in625-laser\", \"in718-laser\", \"ti6al4v-ebm\"")
    );
    assert!(refused("[ebm]\nspeed = 3\n", 4e-3).contains("there is no key `speed` in [ebm]"));
    // nothing lies between layers where there is one, or where layers forget their heat
    for (judge, told) in [
        ("powder = \"500 °C\"", "judge.powder is of several layers"),
        ("between = \"3 s\"", "judge.between is of several layers"),
        ("memory = \"metal\"", "judge.memory is of several layers"),
    ] {
        let told_of = refused(&format!("[judge]\n{judge}\n"), 4e-3);
        assert!(told_of.contains(told), "{told_of}");
    }
    let cold = "[ebm]\nlayers = 2\n[judge]\nmemory = \"metal\"\nbetween = \"5 ms\"\n";
    assert!(refused(cold, 4e-3).contains("judge.between is of layers that keep heat"));
    let cool = JOB.replace("3700 °C", "100 °C");
    let file = write(dir.path(), "cool.toml", previewed(&cool));
    says(&refusal(&file), &["charts.stop is 100 °C", "its liquidus"]);
    assert!(refused("[ebm]\nlayer = \"5 m\"\n", 4e-3).contains("ebm.layer"));
    // a step in which a voxel would melt whole
    let file = job(dir.path(), "step = \"0.5 ms\"\n", 4e-3);
    says(
        &refusal(&file),
        &[
            "simulation.step",
            "loses the phase change",
            "left out it is",
        ],
    );
    // charts that are cut short, and what is none
    for (bytes, said) in [(&b"MELT"[..], "cut"), (&b"no chart at all"[..], "none")] {
        std::fs::write(dir.path().join("a.melt"), bytes).unwrap();
        let text = JOB.replace("[charts]\n", "[charts]\nfiles = [\"a.melt\"]\n");
        let file = write(dir.path(), "charts.toml", previewed(&text));
        let error = refusal(&file);
        assert!(
            error.contains("cannot use the charts") && error.contains("a.melt"),
            "{said}: {error}"
        );
    }
    let file = job(dir.path(), "", 4e-3);
    std::fs::write(dir.path().join("path.csv"), "t_s,x_mm\n").unwrap();
    says(&refusal(&file), &["the columns are"]);
}

/// Every file that is not there and every value that cannot be, at once; values alone are resolved without reading any of them.
#[test]
fn all_that_is_missing_is_told_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let text = "path = \"beam.csv\"\n[process]\nkind = \"ebm\"\n[ebm]\nmaterial = \"gold\"\n[charts]\nfiles = [\"one.melt\", \"two.melt\"]\n[window]\ngood = \"good.csv\"\n";
    let file = write(dir.path(), "job.toml", text);
    let told = chain::doctor(&file, &Silent).unwrap();
    assert_eq!(told.problems(), 5);
    let refused = told.refused.unwrap().to_string();
    says(
        &refused,
        &["beam.csv", "one.melt", "two.melt", "good.csv", "gold"],
    );
    // files that are there and do not read: both
    for name in ["beam.csv", "good.csv"] {
        std::fs::write(dir.path().join(name), "no path\n").unwrap();
    }
    let text = "path = \"beam.csv\"\n[process]\nkind = \"ebm\"\n[window]\ngood = \"good.csv\"\n";
    std::fs::write(&file, text).unwrap();
    let (Job::Ebm(read), _) = load(&file).unwrap() else {
        unreachable!("the job is an electron-beam job")
    };
    assert!(resolve(&read, dir.path()).is_ok());
    assert_eq!(planned(&read, dir.path(), &Silent).unwrap_err().0.len(), 2);
}

/// A record in which the gun changes its voltage, or the side of its focus, is drawn as it is and written back otherwise.
#[test]
fn a_record_of_several_voltages_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let file = job(dir.path(), "", 4e-3);
    let told = |text: String| {
        std::fs::write(dir.path().join("path.csv"), text).unwrap();
        let told = chain::doctor(&file, &Silent).unwrap();
        told.lines
            .into_iter()
            .find(|l| l.contains("rows with the beam on"))
    };
    let one = path(6, 4e-3);
    assert_eq!(told(one.clone()), None);
    let two = told(one.replacen("60000,0.005,0.004,1\n", "50000,0.006,0.004,1\n", 3)).unwrap();
    // the first three rows, so that the other eight with the beam on are otherwise
    assert!(two.contains("path.csv: 8 of its 11 rows"), "{two}");
    assert!(two.contains("50000 V"), "{two}");
}

#[test]
fn a_doctor_tells_every_default() {
    let dir = tempfile::tempdir().unwrap();
    let told = chain::doctor(&job(dir.path(), "", 4e-3), &Silent).unwrap();
    assert!(told.refused.is_none());
    let lines = told.lines.join("\n");
    for line in [
        "\n[ebm]\n",
        "\nporosity = physical    (default: erratum E1: the printed law is no porosity)\n",
        "\ndensity = corrected    (default: ",
        "\nefficiency = 90 %    (default: ",
        "\nlow = 2700 °C    (default: ",
        "\n[optimise] not written: ",
        "\n[judge]\nsolver = none    (the job)\n",
    ] {
        assert!(lines.contains(line), "{line}: {lines}");
    }
}

#[test]
fn a_part_without_beam_or_area_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |part: &str| {
        let extra = format!("[judge]\nsolver = \"reference\"\nbeyond = \"0 mm\"\npart = {part}\n");
        let file = job(dir.path(), &extra, 4e-3);
        chain::run(&file, At(&dir.path().join("out")), &Silent)
            .unwrap_err()
            .to_string()
    };
    let away = refused("[[\"5 mm\", \"5 mm\"], [\"6 mm\", \"6 mm\"]]");
    assert!(
        away.contains("judge.part: the beam is never on there"),
        "{away}"
    );
    let flat = refused("[[\"1 mm\", \"0 mm\"], [\"1 mm\", \"1 mm\"]]");
    assert!(flat.contains("judge.part has no area"), "{flat}");
}

/// A few lines, judged with coarse cells: every run in the report and in the verdict.
#[test]
fn a_small_job_is_judged() {
    let dir = tempfile::tempdir().unwrap();
    let extra = "[judge]\nsolver = \"reference\"\nbeyond = \"0.1 mm\"\ncell = \"0.125 mm\"\nstep = \"10 us\"\npart = [[\"0.5 mm\", \"0.2 mm\"], [\"1.5 mm\", \"0.5 mm\"]]\n";
    let file = job(dir.path(), extra, 4e-3);
    let out = dir.path().join("out");
    let outcome = chain::run(&file, At(&out), &Silent).unwrap();
    let check = &outcome.verdict.checks[0];
    assert!(check.title.ends_with("on the reference solver"));
    for said in ["cells of 125.0 µm", "in the window as it was"] {
        assert!(check.reason.contains(said), "{said}: {}", check.reason);
    }
    let told = &outcome.verdict.facts;
    assert!(told.iter().any(|f| f.id == "in-window-charts"), "{told:?}");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(out.join("fields/voxels-reference.vti").is_file());
    says(
        &report,
        &[
            "Judged on the reference solver",
            "Section along x through the hottest place, reference solver",
            "twice the cell",
            "1 % more power",
        ],
    );
}

/// The whole section is judged, what melts outside it too; a part of it, or one in which nothing melts, never passes.
#[test]
fn the_whole_section_is_judged() {
    let dir = tempfile::tempdir().unwrap();
    let checked = |extra: &str| {
        let extra = format!(
            "[ebm]\nefficiency = \"45 %\"\n[window]\nlow = \"1700 °C\"\nhigh = \"9000 °C\"\nmodel = \"solver\"\n[judge]\nsolver = \"reference\"\ncell = \"0.125 mm\"\nstep = \"10 us\"\n{extra}"
        );
        let verdict = verdict_of(dir.path(), &extra);
        println!("{}", verdict.to_json());
        move |id: &str| {
            let check = check(&verdict, id);
            (
                check.status,
                check.value.as_ref().unwrap().value,
                check.reason.clone(),
            )
        }
    };
    // lines beyond the contour: all of it melts, and what lies beside it
    let whole = checked(
        "[region]\ncontour = [[\"0.2 mm\", \"0.1 mm\"], [\"1.8 mm\", \"0.1 mm\"], [\"1.8 mm\", \"0.5 mm\"], [\"0.2 mm\", \"0.5 mm\"]]\n[checks]\nfarthest = \"0.1 mm\"\n",
    );
    let (status, share, reason) = whole("in-window");
    assert_eq!(status, Status::Pass, "{reason}");
    assert!(share > 99.0, "{share}");
    says(
        &reason,
        &[
            "twice the planes",
            "the ground twice as deep",
            "the ground twice as wide",
        ],
    );
    assert_eq!(whole("unmelted").0, Status::Pass);
    assert_eq!(whole("unfused").0, Status::Pass);
    // nothing passes on a ground that no machine has
    let boxed = checked(
        "ground = \"thesis-box\"\n[region]\ncontour = [[\"0.2 mm\", \"0.1 mm\"], [\"1.8 mm\", \"0.1 mm\"], [\"1.8 mm\", \"0.5 mm\"], [\"0.2 mm\", \"0.5 mm\"]]\n",
    );
    let (status, _, reason) = boxed("unmelted");
    assert_eq!(status, Status::CannotSay, "{reason}");
    says(&reason, &["thesis-box"]);
    let (status, share, _) = whole("molten-outside");
    assert!(status == Status::Fail && share > 10.0, "{status:?} {share}");
    let (status, away, _) = whole("molten-farthest");
    assert!(status == Status::Fail && away > 0.15, "{status:?} {away}");
    // a part of it
    let part = checked("part = [[\"0.5 mm\", \"0.2 mm\"], [\"1.5 mm\", \"0.5 mm\"]]\n");
    let (status, _, reason) = part("in-window");
    assert_eq!(status, Status::CannotSay, "{reason}");
    assert!(reason.contains("only judge.part"), "{reason}");
    // a corner of the region that the beam does not reach, and one that no cell lies in
    let region = "[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"4 mm\", \"0 mm\"], [\"4 mm\", \"0.5 mm\"], [\"0 mm\", \"0.5 mm\"]]\n[checks]\nin_window = \"0 %\"\nunmelted = \"100 %\"\n";
    let nothing = checked(&format!(
        "beyond = \"1 mm\"\npart = [[\"2.375 mm\", \"0.1 mm\"], [\"2.5 mm\", \"0.5 mm\"]]\n{region}"
    ));
    for id in ["in-window", "unmelted", "molten-outside"] {
        let (status, _, reason) = nothing(id);
        assert!(
            status == Status::Fail && reason.contains("nothing melts"),
            "{id}: {reason}"
        );
    }
    let empty = checked(&format!(
        "beyond = \"2 mm\"\npart = [[\"3.4 mm\", \"0.1 mm\"], [\"3.45 mm\", \"0.15 mm\"]]\n{region}"
    ));
    let (status, _, reason) = empty("in-window");
    assert!(
        status == Status::CannotSay && reason.contains("no cell"),
        "{reason}"
    );
}

/// Lines go beyond the contour where the job says so; the region that is judged stays, on voxels of two planes a layer.
#[test]
fn lines_overrun_the_contour() {
    let dir = tempfile::tempdir().unwrap();
    let tables = "[hatch]\nstrategy = \"one-way\"\noverrun = \"0.2 mm\"\n[window]\nbody = [\"1.5 mm\", \"1 mm\"]\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"1.5 mm\", \"0 mm\"], [\"0 mm\", \"1 mm\"]]\n[optimise]\nmethod = \"learning\"\nsolver = \"reference\"\nchange = \"current\"\nrounds = 3\ncell = \"0.1 mm\"\nplanes = 2\n[checks]\nin_window = \"0 %\"\n";
    let file = hatched(dir.path(), tables);
    let text = std::fs::read_to_string(&file).unwrap();
    let out = dir.path().join("out");
    let csv = drawn(&file, &out);
    let column = |n: usize| -> Vec<f64> {
        let rows = csv
            .lines()
            .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
        rows.map(|l| l.split(',').nth(n).unwrap().parse().unwrap())
            .collect()
    };
    let least = |values: Vec<f64>| values.into_iter().fold(f64::INFINITY, f64::min);
    let (x, y) = (least(column(1)), least(column(2)));
    // half a spacing stays between the lines and where they end
    assert!(
        (-0.2..-0.1).contains(&x) && (-0.2..-0.05).contains(&y),
        "{x} {y}"
    );
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("hatch.overrun") && report.contains("optimise.planes"));
    for [from, to, what] in &rows(
        r"
        planes = 2 => planes = 0 => optimise.planes is 0: it must be 1 to 16
        [hatch] => [modulation]\n[hatch] => beyond the contour, where [modulation]",
    ) {
        std::fs::write(&file, text.replace(from, to)).unwrap();
        says(&refusal(&file), &[what]);
    }
}

/// Contours that cross themselves or each other, and holes where nothing is, are refused with key, place and remedy; what only touches is not.
#[test]
fn regions_that_bound_no_area_are_refused() {
    let square = [[0, 0], [3, 0], [3, 3], [0, 3]];
    let ring = |corners: &[[i32; 2]]| {
        let corners = corners
            .iter()
            .map(|[x, y]| format!("[\"{x} mm\", \"{y} mm\"]"));
        format!("[{}]", corners.collect::<Vec<_>>().join(", "))
    };
    let told = |contour: &[[i32; 2]], holes: &[&[[i32; 2]]]| {
        let dir = tempfile::tempdir().unwrap();
        let holes: Vec<String> = holes.iter().map(|h| ring(h)).collect();
        let region = format!(
            "[region]\ncontour = {}\nholes = [{}]\n[hatch]\n",
            ring(contour),
            holes.join(", ")
        );
        let file = hatched(dir.path(), &region);
        load(&file).err().map(|e| e.to_string())
    };
    for (contour, holes, words) in [
        (
            [[0, 0], [3, 3], [3, 0], [0, 3]],
            vec![],
            ["region.contour crosses itself", "x 1.500, y 1.500 mm"],
        ),
        (
            [[0, 0], [1, 1], [2, 2], [3, 3]],
            vec![],
            ["region.contour holds no area", ""],
        ),
        (
            square,
            vec![[[2, 1], [4, 1], [4, 2], [2, 2]]],
            ["hole 1 leaves the contour", "x 3.000, y 1.000 mm"],
        ),
        (
            square,
            vec![[[5, 1], [6, 1], [6, 2], [5, 2]]],
            ["hole 1 leaves the contour", "x 5.000, y 1.000 mm"],
        ),
        (
            square,
            vec![[[3, 1], [4, 1], [4, 2], [3, 2]]],
            ["hole 1 leaves the contour", "x 3.500, y 1.000 mm"],
        ),
        (
            square,
            vec![
                [[0, 0], [2, 0], [2, 2], [0, 2]],
                [[1, 1], [3, 1], [3, 3], [1, 3]],
            ],
            ["hole 2 overlaps hole 1", "x 2.000, y 1.000 mm"],
        ),
    ] {
        let holes: Vec<&[[i32; 2]]> = holes.iter().map(|h| &h[..]).collect();
        let told = told(&contour, &holes).unwrap_or_default();
        says(&told, &words);
    }
    // a slit to an inner outline, and a hole on the contour
    let slit = [
        [0, 0],
        [3, 0],
        [3, 3],
        [0, 3],
        [0, 0],
        [1, 1],
        [1, 2],
        [2, 2],
        [2, 1],
        [1, 1],
    ];
    assert_eq!(told(&slit, &[]), None);
    assert_eq!(told(&square, &[&[[0, 1], [1, 1], [1, 2], [0, 2]]]), None);
}
