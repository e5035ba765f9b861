//! Better paths looked for on the judge's solver: over the whole section, shape first, and never worse there than the path as given.

use crate::support::{refusal, says, warned};
use std::path::Path;

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Silent, Verdict};

/// Lines over a triangle of 2 x 1.5 mm, on cells so coarse that it takes seconds.
const JOB: &str = "[process]\nkind = \"ebm\"\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"0 mm\", \"1.5 mm\"]]\n[hatch]\nstrategy = \"one-way\"\nspacing = \"100 µm\"\nspeed = \"1225 mm/s\"\noverrun = \"0.1 mm\"\ncurrent = \"4 mA\"\n[window]\nbody = [\"2 mm\", \"2 mm\"]\n[judge]\ncell = \"62.5 µm\"\n";

fn run(folder: &Path, text: &str) -> Verdict {
    let file = folder.join("job.toml");
    std::fs::write(&file, text).unwrap();
    let told = chain::run(&file, At(&folder.join("out")), &Silent);
    told.unwrap().verdict
}

/// A column of the rounds.
fn column(folder: &Path, wanted: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(folder.join("out/series/search.csv")).unwrap();
    let mut lines = text.lines();
    let mut heads = lines.next().unwrap().split(',');
    let at = heads.position(|h| h == wanted).unwrap();
    let cell = |line: &str| line.split(',').nth(at).unwrap().parse().unwrap();
    lines.map(cell).collect()
}

/// How good each round is, shape first, and which one is kept.
fn merits(folder: &Path) -> (Vec<(bool, f64)>, usize) {
    let of = |wanted: &str| column(folder, wanted);
    let [good, outside, kept] = ["in_window_pct", "outside_pct", "kept"].map(of);
    let both = good.iter().zip(&outside);
    let merit = both.map(|(good, outside)| {
        let keeps = *outside <= 1.0;
        (keeps, if keeps { *good } else { -outside })
    });
    let kept = kept.iter().position(|k| *k == 1.0).unwrap();
    (merit.collect(), kept)
}

fn value(verdict: &Verdict, id: &str) -> f64 {
    let check = verdict.checks.iter().find(|c| c.id == id).unwrap();
    check.value.as_ref().unwrap().value
}

/// Without a word of the job it is the judge's solver that is looked on, and charts are not drawn; orders are tried there too.
#[test]
fn the_judges_solver_is_looked_on() {
    let dir = tempfile::tempdir().unwrap();
    let how = "[optimise]\nmethod = \"learning\"\nrounds = 4\norders = [\"backwards\"]\n";
    let told = run(dir.path(), &format!("{JOB}{how}"));
    println!("{}", told.to_json());
    let (merits, kept) = merits(dir.path());
    println!("{merits:?}, {kept} kept");
    assert!(kept > 0 && merits.iter().all(|merit| *merit <= merits[kept]));
    assert!(merits[kept] > merits[0]);
    let cells = column(dir.path(), "cell_mm");
    assert!(cells.iter().all(|c| (c - 0.125).abs() < 1e-9), "{cells:?}");
    assert!(
        column(dir.path(), "unfused_pct")
            .iter()
            .all(|u| u.is_finite())
    );
    let given = told.facts.iter().find(|f| f.id == "molten-outside-given");
    let before = given.unwrap().value.as_ref().unwrap().value;
    assert!(value(&told, "molten-outside") <= before.max(1.0));
    // nothing else needs charts
    assert!(told.facts.iter().all(|f| !f.id.ends_with("-charts")));
    let out = dir.path().join("out");
    assert!(!out.join("charts").exists());
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    says(
        &report,
        &[
            "Looked for on the judge",
            "Orders and strategies tried",
            "backwards",
            "Porous against overheated",
            "not fused to the layer below",
            "Speed along lines",
        ],
    );
    let provenance = std::fs::read_to_string(out.join("provenance.json")).unwrap();
    says(&provenance, &["optimise.solver", "charts.preview"]);
    let file = dir.path().join("job.toml");
    let told = chain::doctor(&file, &Silent).unwrap().lines;
    let cost = told.iter().filter(|l| l.contains("cost of the search"));
    assert_eq!(cost.count(), 1, "{told:?}");
    assert!(told.iter().all(|l| !l.contains("charts of")), "{told:?}");
}

/// Whatever is looked for, and however badly: what comes back is the path as given where nothing is better.
#[test]
fn what_is_handed_back_is_never_worse() {
    // slower alone makes it hotter; currents and drawing ahead find what they find
    for how in [
        "method = \"learning\"\nrounds = 1\nspeeds = [\"30 %\", \"31 %\"]\n",
        "method = \"learning\"\nrounds = 2\nchange = \"current\"\ncontroller = \"per-line\"\n",
        "method = \"predictive\"\n",
    ] {
        let dir = tempfile::tempdir().unwrap();
        let told = run(dir.path(), &format!("{JOB}[optimise]\n{how}"));
        let (merits, kept) = merits(dir.path());
        println!("{how}{merits:?}, {kept} kept");
        assert!(merits.iter().all(|merit| *merit <= merits[kept]));
        let given = told.facts.iter().find(|f| f.id == "in-window-given");
        let report = std::fs::read_to_string(dir.path().join("out/report.html")).unwrap();
        if how.contains("31 %") {
            assert!(kept == 0 && given.is_none(), "{merits:?}");
            says(&report, &["None was better than the path as given"]);
            let path = std::fs::read_to_string(dir.path().join("out/path.csv")).unwrap();
            // a row at the begin and the end of each of its 16 lines
            assert!(path.lines().count() < 40, "{}", path.lines().count());
        }
        // the same on the judge's own cells, or it is withdrawn
        let withdrawn = warned(&told, "search-withdrawn");
        assert!(!(withdrawn && given.is_some()));
        if let Some(given) = given {
            let before = given.value.as_ref().unwrap().value;
            let fact = |id: &str| told.facts.iter().find(|f| f.id == id).unwrap();
            let outside = fact("molten-outside-given").value.as_ref().unwrap().value;
            let both = |window: f64, outside: f64| {
                let keeps = outside <= 1.0;
                (keeps, if keeps { window } else { -outside })
            };
            let after = both(value(&told, "in-window"), value(&told, "molten-outside"));
            assert!(after >= both(before, outside), "{after:?}");
        }
    }
}

/// Times of spots, and charts beside where the job asks for them.
#[test]
fn times_of_spots_are_found_there_too() {
    let dir = tempfile::tempdir().unwrap();
    let spots = JOB
        .replace("\"one-way\"", "\"spots\"")
        .replace("overrun = \"0.1 mm\"\n", "")
        .replace("current = \"4 mA\"", "current = \"4.5 mA\"");
    let how = "[optimise]\nmethod = \"learning\"\nchange = \"dwell\"\nrounds = 3\n[charts]\npreview = \"drawn\"\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 1\n";
    let told = run(dir.path(), &format!("{spots}{how}"));
    let (merits, kept) = merits(dir.path());
    println!("{merits:?}, {kept} kept");
    assert!(merits.iter().all(|merit| *merit <= merits[kept]));
    assert!(told.facts.iter().any(|f| f.id == "in-window-charts"));
    let report = std::fs::read_to_string(dir.path().join("out/report.html")).unwrap();
    says(&report, &["Time on each spot"]);
}

#[test]
fn what_contradicts_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("job.toml");
    let search = "[optimise]\nmethod = \"learning\"\n";
    let off = JOB.replace("[judge]\n", "[judge]\nsolver = \"none\"\n");
    for (text, said) in [
        (
            format!("{off}{search}solver = \"judge\"\n"),
            "draws on the solver of [judge], which is",
        ),
        (
            format!("{JOB}{search}cell = \"0.1 mm\"\n"),
            "optimise.cell is of solver = ",
        ),
        (
            format!("{JOB}{search}planes = 2\n"),
            "optimise.planes is of solver = ",
        ),
        (
            format!("{JOB}{search}solver = \"charts\"\nchange = \"current\"\n"),
            "need a solver",
        ),
        (
            format!("{JOB}[optimise]\nmethod = \"pid\"\nsolver = \"judge\"\n"),
            "change the speed, on charts",
        ),
        (
            format!("{JOB}[optimise]\nmethod = \"pid\"\n[charts]\npreview = \"none\"\n"),
            "takes temperatures from charts",
        ),
        (format!("{JOB}{search}change = \"dwell\"\n"), "draw lines"),
    ] {
        std::fs::write(&file, text).unwrap();
        says(&refusal(&file), &[said]);
    }
    // what takes hours is looked for on charts, and told; where the job asks for it, it is not
    let slow = JOB.replace("speed = \"1225 mm/s\"", "speed = \"0.1 mm/s\"");
    let told = |how: &str| {
        std::fs::write(&file, format!("{slow}{search}{how}")).unwrap();
        let told = chain::doctor(&file, &Silent).unwrap();
        assert!(told.refused.is_none(), "{:?}", told.refused);
        told.lines.join("\n")
    };
    let usual = told("");
    says(
        &usual,
        &["looked for on charts, inside the contour", "charts of"],
    );
    let asked = told("solver = \"judge\"\n");
    says(&asked, &["cost of the search"]);
    assert!(!asked.contains("looked for on charts"), "{asked}");
}

/// Of the same rounds the one that bears 3 % of the power best is kept: its worst case is not below that of the round that is best as set.
#[test]
fn a_robust_choice_bears_drift_no_worse_than_the_plain_one() {
    let strip = JOB
        .replace(
            "[\"2 mm\", \"0 mm\"], [\"0 mm\", \"1.5 mm\"]",
            "[\"2.5 mm\", \"0 mm\"], [\"2.5 mm\", \"0.8 mm\"], [\"0 mm\", \"0.8 mm\"]",
        )
        .replace(
            "body = [\"2 mm\", \"2 mm\"]\n",
            "body = [\"2 mm\", \"2 mm\"]\nwidth = \"150 K\"\n",
        );
    let how = "[optimise]\nmethod = \"learning\"\nrounds = 5\n";
    let checks = "[checks]\noutside = \"40 %\"\ndrift = \"3 %\"\n";
    let plain = tempfile::tempdir().unwrap();
    let as_set = run(plain.path(), &format!("{strip}{how}{checks}"));
    let robust = tempfile::tempdir().unwrap();
    let told = run(
        robust.path(),
        &format!("{strip}{how}robust = \"3 %\"\n{checks}"),
    );
    let of = |wanted: &str| column(robust.path(), wanted);
    let [good, least, outside, kept] = [
        "in_window_pct",
        "in_window_least_pct",
        "outside_most_pct",
        "kept",
    ]
    .map(of);
    println!("{good:?}\n{least:?}\n{outside:?}\n{kept:?}");
    let chosen = |kept: &[f64]| kept.iter().position(|k| *k == 1.0).unwrap();
    let [by_worst, by_set] = [chosen(&kept), chosen(&column(plain.path(), "kept"))];
    println!(
        "{by_worst} {by_set} {} {}",
        value(&told, "drift"),
        value(&as_set, "drift")
    );
    assert!(outside.iter().all(|o| *o < 40.0), "{outside:?}");
    // the same rounds, worth something else
    let alone = column(plain.path(), "in_window_pct");
    assert!(
        alone.iter().zip(&good).all(|(a, b)| (a - b).abs() < 0.01),
        "{alone:?}"
    );
    assert!(least.iter().zip(&good).all(|(a, b)| *a <= b + 1e-9));
    assert!(least.iter().all(|l| *l <= least[by_worst]));
    assert!(least[by_worst] >= least[by_set]);
    assert!(value(&told, "drift") >= value(&as_set, "drift") - 1.0);
    let report = std::fs::read_to_string(robust.path().join("out/report.html")).unwrap();
    says(
        &report,
        &["worth the least that it does with 3.0 % less power"],
    );
    let file = robust.path().join("charts.toml");
    let charts = format!("{strip}{how}robust = \"3 %\"\nsolver = \"charts\"\n");
    std::fs::write(&file, charts).unwrap();
    says(&refusal(&file), &["optimise.robust", "another model"]);
}
