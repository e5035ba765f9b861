//! What the laser melts, from a job to the folder.
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::support::{rows, says, warned, write};
use meltpath::job::{Job, parse};
use meltpath::outcome::RunFolder::NextIn;
use meltpath_base::{Silent, Status};

const JOB: &str = r#"
[process]
kind = "lpbf"
[lpbf]
head = "three-axis-350"
recipes = ["soft.toml"]
delays = "recipe"
[plate]
block = [1, 1]
side = "3 mm"
hatch = "0.05 mm"
[heat]
layer = "10 µm"
"#;

/// A recipe of 70 W: a surface that does not boil under a spot of 70 µm.
const SOFT: &str = meltpath_data::recipes::INDUSTRIAL.text;

fn run(place: &Path, job: &str, recipe: &str) -> Result<meltpath::outcome::Outcome, String> {
    fs::write(place.join("soft.toml"), recipe).unwrap();
    let file = write(place, "job.toml", job);
    let Job::Lpbf(parsed) = parse(job).map_err(|e| e[0].to_string())? else {
        return Err("this is no scan-head job".to_owned());
    };
    meltpath::lpbf::run(&file, &parsed, job, NextIn(&place.join("runs")), &Silent)
        .map_err(|e| e.to_string())
}

fn soft(power: &str) -> String {
    SOFT.replace("300 W", power)
}

#[test]
fn slow_mirrors_leave_powder_that_the_commanded_path_melts() {
    let place = tempfile::tempdir().unwrap();
    let outcome = run(place.path(), JOB, &soft("70 W")).unwrap();
    let find = |o: &meltpath::outcome::Outcome| {
        let all = &o.verdict.checks;
        all.iter().find(|c| c.id == "fusion-1").unwrap().clone()
    };
    let check = find(&outcome);
    let share = check.value.clone().unwrap();
    assert!(share.value > 60.0 && share.value <= 100.0, "{share:?}");
    assert!(!warned(&outcome.verdict, "keyhole"));
    // light that comes on late leaves the starts of lines
    let late = soft("70 W").replace("395 µs", "1000 µs");
    let worse = find(&run(place.path(), JOB, &late).unwrap());
    assert!(
        worse.value.clone().unwrap().value < share.value - 5.0,
        "{worse:?}"
    );
    assert_eq!(worse.status, Status::Fail);
    let page = fs::read_to_string(outcome.folder.join("report.html")).unwrap();
    says(
        &page,
        &[
            "What melts",
            "as commanded",
            "a fifth less absorbed",
            "a fifth more absorbed",
            "Boiling number",
        ],
    );
    let pools = fs::read_to_string(outcome.folder.join("series/pools-1.csv")).unwrap();
    assert!(pools.lines().count() > 100);
    assert!(outcome.folder.join("fields/melted-1.vti").is_file());
}

#[test]
fn a_boiling_surface_is_told_and_not_judged_against() {
    let place = tempfile::tempdir().unwrap();
    let outcome = run(place.path(), &JOB.replace("10 µm", "90 µm"), &soft("300 W")).unwrap();
    assert!(warned(&outcome.verdict, "keyhole"));
    let all = &outcome.verdict.checks;
    let check = all.iter().find(|c| c.id == "fusion-1").unwrap();
    assert_eq!(check.status, Status::CannotSay, "{check:?}");
    says(
        &check.reason,
        &["lower bound", "cannot be said: a spot of 70 µm"],
    );
}

#[test]
fn mistakes_are_named() {
    let place = tempfile::tempdir().unwrap();
    for [wrong, right, words] in &rows(
        r#"
        layer = "10 µm" => material = "cheese" => no material "cheese"
        layer = "10 µm" => absorptivity = "140 %" => 140 %
        layer = "10 µm" => preheat = "1500 degC" => begins to melt at 1137
        layer = "10 µm" => preheat = "1300 degC" => begins to melt at 1137
        layer = "10 µm" => preheat = "-500 degC" => below absolute zero
        layer = "10 µm" => cell = "0.1 µm" => larger cells
        layer = "10 µm" => layer = "0 µm" => above zero"#,
    ) {
        let text = JOB.replace(wrong, right);
        let told = run(place.path(), &text, &soft("70 W")).unwrap_err();
        assert!(told.contains(words), "{right}: {told}");
        assert!(
            !place.path().join("runs").exists()
                || fs::read_dir(place.path().join("runs"))
                    .unwrap()
                    .next()
                    .is_none()
        );
    }
}

/// A wait between marks is one in the light: it is judged where the beam stands, melts what is below it, and is told where it brings most
/// of the energy.
#[test]
fn a_lit_beam_that_stands_is_judged() {
    let place = tempfile::tempdir().unwrap();
    let rows = "kind,x_mm,y_mm\nstart,0,0\ncontour,1,0\ncontour,1,1\ncontour,0,1\ncontour,0,0\n";
    fs::write(place.path().join("square.csv"), rows).unwrap();
    let job = JOB
        .replace(
            "[plate]\nblock = [1, 1]\nside = \"3 mm\"\nhatch = \"0.05 mm\"",
            "",
        )
        .replace("[lpbf]", "[lpbf]\nlayers = \"square.csv\"");
    let waits = |power: &str, wait: &str| {
        let recipe = soft(power);
        let lines = recipe.lines().map(|line| match line.split_once(" = ") {
            Some(("polygon_wait", _)) => {
                format!("polygon_wait = {{ value = \"{wait}\", source = \"own\" }}")
            }
            _ => line.to_owned(),
        });
        let recipe = lines.collect::<Vec<_>>().join("\n");
        run(place.path(), &job, &recipe).unwrap().verdict
    };
    let dwell = |verdict: &meltpath_base::Verdict| {
        let check = verdict.checks.iter().find(|c| c.id == "dwell-1");
        check.map(|c| (c.status, c.value.clone().unwrap().value))
    };
    let none = waits("70 W", "0 ms");
    assert_eq!(dwell(&none), None);
    assert!(!warned(&none, "waits-in-the-light"));
    let long = waits("70 W", "2 ms");
    let (status, number) = dwell(&long).unwrap();
    assert!(status == Status::CannotSay && number > 1.0, "{number}");
    assert!(warned(&long, "waits-in-the-light"));
    let faint = waits("8 W", "2 ms");
    let (status, number) = dwell(&faint).unwrap();
    assert!(status == Status::Pass && number < 0.5, "{number}");
    // what melts while the beam stands is commanded to
    let fusion = |verdict: &meltpath_base::Verdict| {
        let check = verdict.checks.iter().find(|c| c.id == "fusion-1");
        check.unwrap().value.is_some()
    };
    assert!(!fusion(&waits("8 W", "0 ms")) && fusion(&waits("20 W", "2 ms")));
}

/// The margin is room for what melts beside the marks, not a cut through what is judged.
#[test]
fn a_narrow_margin_leaves_the_surface_whole() {
    let place = tempfile::tempdir().unwrap();
    let share = |more: &str| {
        let job = JOB.replace("layer = \"10 µm\"", &format!("layer = \"10 µm\"\n{more}"));
        // cells so fine that where they lie does not matter
        let job = job.replace("[heat]", "[heat]\ncell = \"4 µm\"");
        let job = job.replace("0.05 mm", "0.1 mm").replace("3 mm", "1 mm");
        let outcome = run(place.path(), &job, &soft("70 W")).unwrap();
        let check = outcome.verdict.checks.iter().find(|c| c.id == "fusion-1");
        check.unwrap().value.clone().unwrap().value
    };
    let (usual, narrow) = (share(""), share("margin = \"0.01 mm\""));
    assert!((usual - narrow).abs() < 2.0, "{usual} {narrow}");
}

/// One-way lines, as a layer file: the powder of a part that is drawn too faintly to melt counts, and all of each line is looked at.
#[test]
fn what_is_drawn_and_never_melts_counts_as_surface() {
    let place = tempfile::tempdir().unwrap();
    let job = JOB
        .replace(
            "[plate]\nblock = [1, 1]\nside = \"3 mm\"\nhatch = \"0.05 mm\"",
            "[layers]\nhatch = \"0.05 mm\"",
        )
        .replace("[lpbf]", "[lpbf]\nlayers = \"two.csv\"");
    let share = |powers: &[f64]| {
        let mut rows = "kind,x_mm,y_mm,speed_mm_s,power_W,wait_s,part,layer,height_mm\n".to_owned();
        for (part, power) in powers.iter().enumerate() {
            let x = 2.0 * part as f64;
            for line in 0..20 {
                let y = 0.05 * f64::from(line);
                writeln!(rows, "jump,{x},{y},,,,{part},1,0.02").unwrap();
                writeln!(rows, "fill,{},{y},300,{power},,{part},1,0.02", x + 1.0).unwrap();
            }
        }
        fs::write(
            place.path().join("two.csv"),
            rows.replacen("jump", "start", 1),
        )
        .unwrap();
        let outcome = run(place.path(), &job, SOFT).unwrap();
        let check = outcome
            .verdict
            .checks
            .into_iter()
            .find(|c| c.id == "fusion-1");
        (check.unwrap(), outcome.folder)
    };
    let (good, folder) = share(&[70.0]);
    let good = good.value.unwrap().value;
    let (half, _) = share(&[70.0, 2.0]);
    let value = half.value.clone().unwrap().value;
    assert!(
        good > 70.0 && (value - 0.5 * good).abs() < 5.0,
        "{good} {value}"
    );
    assert_ne!(half.status, Status::Pass, "{half:?}");
    // the map reaches beyond both ends of the lines
    let map = fs::read_to_string(folder.join("fields/melted-1.vti")).unwrap_or_else(|_| {
        String::from_utf8_lossy(&fs::read(folder.join("fields/melted-1.vti")).unwrap()).into_owned()
    });
    let cells = map
        .split_once("WholeExtent=\"")
        .unwrap()
        .1
        .split_once('"')
        .unwrap()
        .0;
    let across: Vec<f64> = cells.split(' ').map(|n| n.parse().unwrap()).collect();
    let spot = 0.07;
    assert!(across[1] * 0.25 * spot > 1.2, "{cells}");
}

/// Rows of a layers' file: in each layer, of a number, a height and a power, lines of 1 mm at 600 mm/s, 40 µm apart.
fn stack(layers: &[(u32, f64, f64)]) -> String {
    let mut rows = "kind,x_mm,y_mm,speed_mm_s,power_W,wait_s,part,layer,height_mm\n".to_owned();
    for (layer, height, power) in layers {
        for line in 0..8 {
            let (kind, y) = (
                if line == 0 { "start" } else { "jump" },
                0.04 * f64::from(line),
            );
            writeln!(rows, "{kind},0,{y},,,,1,{layer},{height}").unwrap();
            writeln!(rows, "fill,1,{y},600,{power},0.002,1,{layer},{height}").unwrap();
        }
    }
    rows
}

/// Every layer of a file is judged, not the first alone: the weakest is drawn at its own thickness, the hottest marks are looked for in all.
#[test]
fn layers_of_other_recipes_and_thicknesses_are_judged() {
    let place = tempfile::tempdir().unwrap();
    let head = "delays = \"recipe\"\n[plate]\nblock = [1, 1]\nside = \"3 mm\"\nhatch = \"0.05 mm\"\n[heat]\nlayer = \"10 µm\"";
    let job = |range: [u32; 2], heat: &str| {
        let own = format!(
            "delays = \"recipe\"\nlayers = \"stack.csv\"\n[layers]\nrange = {range:?}\n[checks]\nfusion = \"20 %\"\n[heat]\n{heat}"
        );
        JOB.replace(head, &own)
    };
    let judged = |layers: &[(u32, f64, f64)], heat: &str| {
        fs::write(place.path().join("stack.csv"), stack(layers)).unwrap();
        let range = [layers[0].0, layers[layers.len() - 1].0];
        run(place.path(), &job(range, heat), &soft("70 W")).map(|outcome| outcome.verdict)
    };
    let check = |verdict: &meltpath_base::Verdict, id: &str| {
        let check = verdict.checks.iter().find(|c| c.id == id);
        check.unwrap().clone()
    };
    let layer = |check: &meltpath_base::Check| check.place.as_ref().unwrap().layer;
    // one recipe again and again
    let alike = judged(&[(1, 0.01, 90.0), (2, 0.02, 90.0), (3, 0.03, 90.0)], "").unwrap();
    let told = check(&alike, "fusion-1");
    assert_eq!(told.status, Status::Pass, "{told:?}");
    assert!(told.title.contains("10 µm"), "{told:?}");
    // a later layer that melts nothing, and one that boils
    let mixed = judged(&[(1, 0.01, 90.0), (2, 0.02, 5.0), (3, 0.03, 400.0)], "").unwrap();
    let told = check(&mixed, "fusion-1");
    assert_eq!(
        (told.status, layer(&told)),
        (Status::Fail, Some(2)),
        "{told:?}"
    );
    let dug = check(&mixed, "keyhole-1");
    assert!(
        dug.status != Status::Pass && layer(&dug) == Some(3),
        "{dug:?}"
    );
    // a thick layer of more power, a thin one of less: neither tells of the other
    let other = judged(&[(1, 0.01, 90.0), (2, 0.02, 90.0), (3, 0.05, 120.0)], "").unwrap();
    let told = check(&other, "fusion-1");
    assert_eq!(
        (told.status, layer(&told)),
        (Status::CannotSay, Some(3)),
        "{told:?}"
    );
    says(told.remedy.as_ref().unwrap(), &["[layers] range = [3, 3]"]);
    // a depth that is written goes, and is told where the file says another
    let deep = judged(&[(1, 0.1, 90.0), (2, 0.2, 90.0)], "layer = \"10 µm\"").unwrap();
    assert!(warned(&deep, "heat-other-thickness"));
    assert!(check(&deep, "fusion-1").title.contains("10 µm"));
    let thick = judged(&[(1, 0.1, 90.0), (2, 0.2, 90.0)], "").unwrap();
    let told = check(&thick, "fusion-1");
    assert!(
        told.title.contains("100 µm") && told.status != Status::Pass,
        "{told:?}"
    );
    let told = judged(&[(1, 0.0, 90.0), (2, 0.0, 90.0)], "").unwrap_err();
    says(&told, &["how thick layer 1 is", "heat.layer"]);
}

/// A laser-off delay that outlasts its mark leaves the light on a spot that stands: the same beam as one that waits between marks.
#[test]
fn light_that_outlasts_its_marks_is_judged() {
    let place = tempfile::tempdir().unwrap();
    let head = "delays = \"recipe\"\n[plate]\nblock = [1, 1]\nside = \"3 mm\"\nhatch = \"0.05 mm\"\n[heat]\nlayer = \"10 µm\"";
    let own = "delays = \"recipe\"\nlayers = \"stack.csv\"\n[layers]\nrange = [1, 1]\n[heat]\n";
    fs::write(place.path().join("stack.csv"), stack(&[(1, 0.01, 90.0)])).unwrap();
    let judged = |off: &str| {
        let recipe = soft("70 W");
        let lines = recipe.lines().map(|line| match line.split_once(" = ") {
            Some(("laser_off_delay", _)) => {
                format!("laser_off_delay = {{ value = \"{off}\", source = \"own\" }}")
            }
            _ => line.to_owned(),
        });
        let recipe = lines.collect::<Vec<_>>().join("\n");
        run(place.path(), &JOB.replace(head, own), &recipe)
            .unwrap()
            .verdict
    };
    let status = |verdict: &meltpath_base::Verdict, id: &str| {
        let check = verdict.checks.iter().find(|c| c.id == id);
        check.map(|c| c.status)
    };
    let late = judged("1.2 ms");
    assert_eq!(status(&late, "dwell-1"), Some(Status::CannotSay));
    let usual = judged("107 µs");
    assert!(!matches!(
        status(&usual, "dwell-1"),
        Some(Status::CannotSay | Status::Fail)
    ));
}
