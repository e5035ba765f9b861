//! Currents corrected on the judge's solver: the section comes into the window, shape holds, and the judge says what the last
//! rounds said.

use crate::support::{refusal, says};
use std::path::Path;

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Silent, Verdict};

/// Lines one way over a triangle of 2 x 1.5 mm, on cells so coarse that it takes seconds.
const JOB: &str = "[process]\nkind = \"ebm\"\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"0 mm\", \"1.5 mm\"]]\n[hatch]\nstrategy = \"one-way\"\nspacing = \"50 µm\"\nspeed = \"2450 mm/s\"\noverrun = \"0.1 mm\"\ncurrent = \"4 mA\"\n[charts]\npreview = \"none\"\n[window]\nbody = [\"2 mm\", \"2 mm\"]\n";
const JUDGE: &str = "[judge]\ncell = \"62.5 µm\"\n";

fn value(verdict: &Verdict, id: &str) -> f64 {
    let check = verdict.checks.iter().find(|c| c.id == id).unwrap();
    check.value.as_ref().unwrap().value
}

/// A column of the rounds.
fn column(out: &Path, wanted: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(out.join("series/correction.csv")).unwrap();
    let mut lines = text.lines();
    let mut heads = lines.next().unwrap().split(',');
    let at = heads.position(|h| h == wanted).unwrap();
    let cell = |line: &str| line.split(',').nth(at).unwrap().parse().unwrap();
    lines.map(cell).collect()
}

#[test]
fn currents_are_corrected_over_the_whole_section() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("job.toml");
    let text = format!("{JOB}{JUDGE}[correct]\nrounds = 4\nfinest = 1\ngain = \"100 %\"\n");
    std::fs::write(&file, text).unwrap();
    let out = dir.path().join("out");
    let verdict = chain::run(&file, At(&out), &Silent).unwrap().verdict;
    println!("{}", verdict.to_json());
    let of = |wanted: &str| column(&out, wanted);
    let [cells, good, outside, kept] = ["cell_mm", "in_window_pct", "outside_pct", "kept"].map(of);
    println!("{good:?} {outside:?}");
    // so small a section does not swing: four corrections and four other aims on coarse cells, one correction on
    // the judge's own, each resolution drawn once before
    let (coarse, fine) = cells.split_at(9);
    assert!(coarse.iter().all(|c| (c - 0.125).abs() < 1e-9), "{cells:?}");
    assert!(fine.len() == 2 && fine.iter().all(|c| (c - 0.0625).abs() < 1e-9));
    let best = kept.iter().position(|k| *k == 1.0).unwrap();
    assert!(best >= 9 && kept.iter().sum::<f64>() == 1.0);
    assert!(
        good[best] > good[0] + 10.0 && outside[best] < 0.3 * outside[0],
        "{good:?} {outside:?}"
    );
    // the judge draws the same path on the same cells, and knows nothing of the rounds
    for (id, wanted) in [("in-window", good[best]), ("molten-outside", outside[best])] {
        let judged = value(&verdict, id);
        assert!((judged - wanted).abs() < 1e-6, "{id}: {judged} {wanted}");
    }
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    let kept = format!("{best}, kept");
    says(
        &report,
        &[
            "Corrected currents",
            "Window against shape",
            "Porous against overheated",
            "Where the power drifts",
            &kept,
        ],
    );
    // the written path is the corrected one: currents within the bounds, and many
    let path = std::fs::read_to_string(out.join("path.csv")).unwrap();
    let rows = path
        .lines()
        .skip(1)
        .map(|l| l.split(',').collect::<Vec<_>>());
    let on = rows.filter(|row| row[6] == "1");
    let currents: Vec<f64> = on.map(|row| row[4].parse().unwrap()).collect();
    assert!(
        currents
            .iter()
            .all(|i| (0.0012 - 1e-9..=0.008 + 1e-9).contains(i))
    );
    let different: std::collections::BTreeSet<u64> = currents.iter().map(|i| i.to_bits()).collect();
    assert!(different.len() > 50, "{}", different.len());
}

/// What 3 % of the power move is more than a window of 60 K holds: the verdict says so of every path, and a wide window bears it.
#[test]
fn what_a_window_bears_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("job.toml");
    let out = |width: &str| dir.path().join(width);
    let run = |width: &str| {
        let window = format!("body = [\"2 mm\", \"2 mm\"]\nwidth = \"{width}\"\n");
        let job = JOB.replace("body = [\"2 mm\", \"2 mm\"]\n", &window);
        let asked = "[correct]\nrounds = 2\nfinest = 0\naims = 1\nrobust = \"3 %\"\n[checks]\ndrift = \"3 %\"\nin_window = \"99 %\"\n";
        std::fs::write(&file, format!("{job}{JUDGE}{asked}")).unwrap();
        let told = chain::run(&file, At(&out(width)), &Silent).unwrap().verdict;
        println!("{}", told.to_json());
        told
    };
    let fact = |verdict: &Verdict, id: &str| {
        let fact = verdict.facts.iter().find(|f| f.id == id).unwrap();
        fact.value.as_ref().unwrap().value
    };
    let narrow = run("60 K");
    let borne = fact(&narrow, "power-drift");
    assert!((0.7..2.2).contains(&borne), "{borne}");
    let ceiling = fact(&narrow, "in-window-ceiling");
    assert!((50.0..65.0).contains(&ceiling), "{ceiling}");
    let check = |id: &str| narrow.checks.iter().find(|c| c.id == id).unwrap();
    says(
        &check("in-window").reason,
        &["no place stays in it with both", "the edge of a beam of"],
    );
    assert!(
        check("in-window")
            .remedy
            .as_ref()
            .unwrap()
            .contains("a narrower spot")
    );
    assert!(value(&narrow, "drift") < 5.0);
    assert!(
        narrow
            .warnings
            .iter()
            .any(|w| w.code == "drift-beyond-window")
    );
    // a window four times as wide bears more than is asked, and hides nothing of the edge
    let wide = run("240 K");
    assert!(fact(&wide, "power-drift") > 3.0 && fact(&wide, "in-window-ceiling") > ceiling);
    assert!(
        !wide
            .warnings
            .iter()
            .any(|w| w.code == "drift-beyond-window")
    );
    assert!(value(&wide, "drift") > value(&narrow, "drift") + 10.0);
    for out in [out("60 K"), out("240 K")] {
        let of = |wanted: &str| column(&out, wanted);
        let [good, least, outside, most] = [
            "in_window_pct",
            "in_window_least_pct",
            "outside_pct",
            "outside_most_pct",
        ]
        .map(of);
        assert_eq!(good.len(), 4, "as it was, two rounds, one other aim");
        assert!(
            least.iter().zip(&good).all(|(l, g)| l <= g),
            "{least:?} {good:?}"
        );
        assert!(most.iter().zip(&outside).all(|(m, o)| m >= o));
        assert!(column(&out, "frontier").contains(&1.0));
    }
}

#[test]
fn corrections_that_cannot_be_are_refused_in_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("job.toml");
    for (rest, said) in [
        (
            "[judge]\nsolver = \"none\"\n[correct]\n",
            "[correct] draws on the solver",
        ),
        (
            "[correct]\nrounds = 0\nfinest = 0\n",
            "nothing is corrected",
        ),
        (
            "[correct]\ncurrents = [\"120 %\", \"80 %\"]\n",
            "leave nothing to change",
        ),
        (
            "[ebm]\ngun = \"open-beam-path\"\n[correct]\n",
            "between straight lines only",
        ),
    ] {
        let shown = JOB.replace("[charts]\npreview = \"none\"\n", "");
        std::fs::write(&file, format!("{shown}{rest}")).unwrap();
        says(&refusal(&file), &[said]);
    }
    // what lies above where vapour moves the pool is told before anything runs
    let hot = JOB.replace(
        "body = [\"2 mm\", \"2 mm\"]",
        "low = \"2950 °C\"\nhigh = \"3010 °C\"",
    );
    std::fs::write(&file, format!("{hot}[correct]\n")).unwrap();
    let told = chain::doctor(&file, &Silent).unwrap();
    let told = told.lines.join("\n");
    println!("{told}");
    assert!(told.contains("no path can be judged in it"), "{told}");
    assert!(told.contains("cost of the corrections"), "{told}");
}
