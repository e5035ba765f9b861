//! `meltpath focus`: a calibration of walls that a job reads, and what is refused.

use std::fmt::Write;

use crate::support::{check, has_files, says, write};
use meltpath::ebm::gun::focus::load;
use meltpath::focus::calibrate;
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Silent, Status};

const BEAM: &str = "voltage = \"60 kV\"\ncurrent = \"5 mA\"\nspeed = \"1400 mm/s\"\n";

/// Walls of another machine: sharpest at 2 mA with 250 µm, 20 and 30 µm/mA; thickness 0.5 of the diameter and 150 µm, grains of 120 µm.
fn walls(scatter: f64) -> String {
    let mut text = String::new();
    for k in 0..11 {
        let focus = f64::from(k) * 2.0 - 8.0;
        let diameter = (250.0 + 20.0 * (2.0 - focus)).max(250.0 + 30.0 * (focus - 2.0));
        let thickness =
            150.0 + 0.5 * diameter + 180.0 + scatter * [1.0, -1.0, -1.0][k as usize % 3];
        writeln!(
            text,
            "[[wall]]\nfocus = \"{focus} mA\"\nmeasured = \"{thickness} µm\""
        )
        .unwrap();
    }
    text
}

const LINE: &str = "[thickness]\nintercept = \"150 µm\"\nslope = 0.5\ndiameters = [\"200 µm\", \"600 µm\"]\nsource = \"walls cut and looked at\"\n";

#[test]
fn walls_of_ones_own_machine_calibrate_its_focus() {
    let dir = tempfile::tempdir().unwrap();
    let head = format!("name = \"ours, March\"\nlargest_grain = \"120 µm\"\n{BEAM}{LINE}");
    let file = write(dir.path(), "walls.toml", head.clone() + &walls(0.0));
    let out = dir.path().join("out");
    let found = calibrate(&file, At(&out), &Silent).unwrap();
    for id in [
        "scatter",
        "walls-apart",
        "straight",
        "spot-known",
        "thickness-known",
    ] {
        assert_eq!(check(&found.verdict, id).status, Status::Pass, "{id}");
    }
    // of exact walls nothing is left to tell but rounding
    let scatter = check(&found.verdict, "scatter").value.clone();
    assert_eq!(scatter.map(|v| v.value), Some(0.0));
    for fact in &found.verdict.facts {
        let sigma = fact.value.as_ref().unwrap().sigma.unwrap();
        assert!(sigma > 0.0 && sigma < 1.0, "{fact:?}");
    }
    has_files(
        &out,
        &[
            "report.html",
            "focus.toml",
            "walls.csv",
            "verdict.json",
            "provenance.json",
        ],
    );
    let (focus, told) = load("focus.toml", &out).unwrap();
    says(&told, &["ours, March", "walls cut"]);
    for (current, diameter) in [(-8e-3, 0.45), (0.0, 0.29), (2e-3, 0.25), (12e-3, 0.55)] {
        assert!((focus.diameter(current).unwrap() - diameter).abs() < 1e-6);
    }
    assert!(focus.diameter(13e-3).is_err());
    let file = write(dir.path(), "walls.toml", head + &walls(60.0));
    let found = calibrate(&file, At(&dir.path().join("scattered")), &Silent).unwrap();
    assert_eq!(check(&found.verdict, "scatter").status, Status::Fail);
}

/// Walls follow the line of the source to some 0.4 mm of diameter: beyond, nothing passes by it.
#[test]
fn the_line_of_the_source_is_not_trusted_beyond_what_follows_it() {
    let dir = tempfile::tempdir().unwrap();
    let wide = |most: f64| {
        let mut text = format!("name = \"a\"\n{BEAM}");
        for k in 0..9 {
            let focus = f64::from(k) - 4.0;
            let diameter = 310.0 + (most - 310.0) / 4.0 * focus.abs();
            let thickness = 120.0 + 0.6 * diameter;
            writeln!(
                text,
                "[[wall]]\nfocus = \"{focus} mA\"\nmeasured = \"{thickness} µm\""
            )
            .unwrap();
        }
        let file = write(dir.path(), "walls.toml", text);
        let out = dir.path().join(format!("out-{most}"));
        let verdict = calibrate(&file, At(&out), &Silent).unwrap().verdict;
        check(&verdict, "thickness-known").clone()
    };
    assert_eq!(wide(395.0).status, Status::Pass);
    let beyond = wide(450.0);
    assert_eq!(beyond.status, Status::CannotSay);
    assert!((beyond.value.unwrap().value - 50.0).abs() < 1e-6);
    says(&beyond.reason, &["Béraud 2016", "400 µm"]);
}

/// A wall measured wrong is named, walls on a caustic and walls far from the focus are told: none of them passes.
#[test]
fn walls_that_are_not_to_be_trusted_cannot_say() {
    let dir = tempfile::tempdir().unwrap();
    let line = LINE.replace("200 µm\", \"600", "100 µm\", \"3000");
    let told = |currents: &[f64], thickness: &dyn Fn(f64) -> f64| {
        let mut text = format!("name = \"a\"\n{BEAM}{line}");
        for focus in currents {
            let measured = thickness(*focus);
            writeln!(
                text,
                "[[wall]]\nfocus = \"{focus} mA\"\nmeasured = \"{measured:.1} µm\""
            )
            .unwrap();
        }
        let file = write(dir.path(), "walls.toml", text);
        let out = dir.path().join("out");
        let verdict = calibrate(&file, At(&out), &Silent).unwrap().verdict;
        std::fs::remove_dir_all(out).unwrap();
        verdict
    };
    let twelve = [
        -5.0, -2.0, 0.0, 2.0, 4.0, 6.0, 8.0, 11.0, 14.0, 18.0, 22.0, 26.0,
    ];
    let straight = |x: f64| 150.0 + 0.5 * (380.0 + (-35.0 * (x - 5.0)).max(22.0 * (x - 5.0)));
    let sound = told(&twelve, &straight);
    assert_eq!(sound.status(), Status::Pass, "{:?}", sound.checks);
    let wrong = told(&twelve, &|x| {
        straight(x) * if x == 4.0 { 1.35 } else { 1.0 }
    });
    let apart = check(&wrong, "walls-apart");
    assert_eq!(apart.status, Status::CannotSay);
    says(&apart.reason, &["the wall at 4 mA"]);
    let caustic = told(&twelve, &|x| {
        150.0 + 0.5 * (320.0_f64.powi(2) + (28.0 * (x - 6.0)).powi(2)).sqrt()
    });
    assert_eq!(check(&caustic, "straight").status, Status::CannotSay);
    assert_eq!(caustic.status(), Status::CannotSay);
    // far from the focus, with some micrometres of noise
    let noise = |x: f64| 5.0 * (12.9898 * x).sin();
    let far = told(&[-30.0, -25.0, -20.0, 40.0, 50.0, 60.0], &|x| {
        straight(x) + noise(x)
    });
    assert_eq!(check(&far, "spot-known").status, Status::CannotSay);
    assert_eq!(check(&far, "straight").status, Status::NotChecked);
    // a caustic that looks like two lines where one side is short: the bounds hold its waist, and the report tells it
    let book: [f64; 12] = std::array::from_fn(|k| -3.0 + 3.0 * k as f64);
    let scatter = |x: f64| 6.0 * (12.9898 * x).sin();
    let either = told(&book, &|x| {
        150.0 + 0.5 * 320.0_f64.hypot(24.0 * (x - 7.15)) + scatter(x)
    });
    for (fact, truth) in either.facts.iter().zip([7.15, 320.0]) {
        let value = fact.value.as_ref().unwrap();
        let off = (value.value - truth).abs();
        assert!(off <= 2.0 * value.sigma.unwrap(), "{fact:?}");
        says(&fact.reason, &["a caustic explains the walls"]);
    }
}

#[test]
fn walls_that_tell_nothing_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let told = |text: String| {
        let file = write(dir.path(), "walls.toml", text);
        let out = dir.path().join("out");
        let error = calibrate(&file, At(&out), &Silent).unwrap_err();
        assert!(!out.exists());
        error.to_string()
    };
    let few: String = walls(0.0).split_inclusive('\n').take(12).collect();
    says(
        &told(format!("name = \"a\"\n{BEAM}{LINE}{few}")),
        &["4 walls", "five"],
    );
    let slower = BEAM.replace("1400", "900");
    says(
        &told(format!("name = \"a\"\n{slower}{}", walls(0.0))),
        &["[thickness]", "1400 mm/s"],
    );
    says(
        &told(format!(
            "name = \"a\"\nlargest_grain = \"400 µm\"\n{BEAM}{LINE}{}",
            walls(0.0)
        )),
        &["stuck grains"],
    );
    let swapped = LINE.replace("200 µm\", \"600", "600 µm\", \"200");
    says(
        &told(format!("name = \"a\"\n{BEAM}{swapped}{}", walls(0.0))),
        &["diameters", "the other way round"],
    );
    let rising: String = walls(0.0).split_inclusive('\n').skip(18).collect();
    says(
        &told(format!("name = \"a\"\n{BEAM}{LINE}{rising}")),
        &["either side"],
    );
}
