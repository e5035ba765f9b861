//! `meltpath fit`: the thesis' struts, and a beam that is found again from what it would build.
use crate::support::{check, write};
use std::path::Path;

use meltpath::fit::{fit, measurements};
use meltpath::outcome::RunFolder::At;
use meltpath::views::fit::lines;
use meltpath_base::{Silent, Status};

/// Thesis: 657 µm at 0.200 mm, 868 µm at 0.372 mm; the contour for 1.000 mm with and without that knowledge.
#[test]
#[ignore = "a minute of computing"]
fn the_struts_of_the_thesis_correct_the_beam() {
    let example =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/ebm-struts/measurements.toml");
    let dir = tempfile::tempdir().unwrap();
    // coarser charts than the example's: a third of the time
    let text = std::fs::read_to_string(example).unwrap();
    let file = dir.path().join("measurements.toml");
    std::fs::write(
        &file,
        text.replace("layers = 5", "layers = 4\nspacing = \"50 µm\""),
    )
    .unwrap();
    let out = dir.path().join("out");
    let found = fit(&file, At(&out), &Silent).unwrap();
    for line in lines(&found) {
        println!("{line}");
    }
    let p = found.prediction.as_ref().unwrap();
    let [plain, corrected] = p.candidates.map(|c| c.radius.unwrap());
    assert!((0.34..0.40).contains(&plain), "{plain}");
    assert!(corrected > plain + 0.02, "{corrected}");
    assert_eq!(p.build, Some(1));
    assert!(found.fitted.misfit < 4.0);
    assert!(p.candidates[1].diameter[1] > 0.005);
    for name in ["report.html", "fit.csv", "verdict.json"] {
        assert!(out.join(name).is_file(), "{name}");
    }
}

/// A wall, a strut and a block whose sizes are those that the model itself gives for 80 %: it comes back.
#[test]
#[ignore = "a minute of computing"]
fn a_beam_is_found_again_from_walls_struts_and_pores() {
    use meltpath_thermal::calibration::coupon::{BeamGuess, Bench, Charts};
    let dir = tempfile::tempdir().unwrap();
    let beam = "voltage = \"60 kV\"\nfocus = \"4 mA\"\n";
    let text = |wall: f64, strut: f64, pores: f64| {
        format!(
            "layers = 3\nspacing = \"50 µm\"\n[prior]\nefficiency_sigma = \"20 %\"\n\
             [[wall]]\nmeasured = \"{wall} mm\"\nsigma = \"5 µm\"\ncurrent = \"3 mA\"\nspeed = \"800 mm/s\"\n{beam}\
             [[strut]]\nmeasured = \"{strut} mm\"\nsigma = \"5 µm\"\nradii = [\"0.3 mm\"]\ncurrents = [\"2 mA\"]\nspeed = \"470 mm/s\"\n{beam}\
             [[porosity]]\nmeasured = \"{} %\"\nsigma = \"0.5 %\"\ncurrent = \"2 mA\"\nspeed = \"1375 mm/s\"\nspacing = \"0.25 mm\"\n{beam}",
            100.0 * pores
        )
    };
    let file = write(dir.path(), "m.toml", text(1.0, 1.0, 0.0));
    let measured = measurements::read(&file).unwrap();
    let material = meltpath_thermal::material::file::read(
        meltpath_data::materials::TI6AL4V_EBM.text,
        meltpath_thermal::material::file::Readings::default(),
    )
    .unwrap();
    let bench = Bench {
        material: &material,
        layer: 0.05,
        layers: 3,
        spacing: 0.05,
    };
    let truth = BeamGuess {
        efficiency: 0.8,
        width: 1.1,
    };
    let mut charts = Charts::default();
    let sizes: Vec<f64> = ["wall", "strut", "porosity"]
        .iter()
        .map(|kind| {
            let m = measured
                .all
                .iter()
                .find(|m| m.name.starts_with(kind))
                .unwrap();
            m.coupon.size(&bench, truth, &mut charts, &Silent).unwrap()
        })
        .collect();
    println!("sizes {sizes:.4?}");
    std::fs::write(&file, text(sizes[0], sizes[1], sizes[2])).unwrap();
    let out = dir.path().join("out");
    let found = fit(&file, At(&out), &Silent).unwrap();
    println!(
        "{:.4?} ± {:.4?}, misfit {:.2}",
        found.fitted.values, found.fitted.sigmas, found.fitted.misfit
    );
    assert!(
        (found.fitted.values[0] - 0.8).abs() < 0.04,
        "{:?}",
        found.fitted
    );
    assert!(
        (found.fitted.values[1] - 1.1).abs() < 0.08,
        "{:?}",
        found.fitted
    );
}

const BEAM: &str = "voltage = \"60 kV\"\nfocus = \"4 mA\"\n";

/// What the message of a file that does not read says to write is written, and the file reads.
#[test]
fn remedies_of_a_file_of_measurements_are_true() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("m.toml");
    let strut = format!(
        "[[strut]]\nmeasured = \"0.66 mm\"\nsigma = \"50 µm\"\nradii = [\"0.2 mm\", \"0.1 mm\"]\ncurrents = [\"2 mA\", \"2.4 mA\"]\nspeed = \"470 mm/s\"\n{BEAM}"
    );
    let wall = format!(
        "[[wall]]\nmeasured = \"0.8 mm\"\nsigma = \"5 µm\"\nlargest_grain = \"100 µm\"\ncurrent = \"3 mA\"\nspeed = \"800 mm/s\"\n{BEAM}"
    );
    let predict = "[predict]\ndiameter = \"1 mm\"\n";
    let (both, predicted) = (format!("{strut}{wall}"), format!("{predict}{strut}"));
    let with = |text: &str, from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    let thin = with(&wall, "0.8 mm", "0.02 mm");
    for (bad, named, cured) in [
        (
            with(&both, ", \"2.4 mA\"", ""),
            "one current for each circle",
            &both,
        ),
        ("layers = 3\n".to_owned(), "at least one [[strut]]", &both),
        (with(&both, "\"3 mA\"", "\"3\""), "mA", &both),
        (with(&both, "\"5 µm\"", "5"), "µm", &both),
        (
            format!("{predict}{wall}"),
            "struts like the last one",
            &predicted,
        ),
        (format!("focus = \"mine\"\n{both}"), "a1-beraud-2016", &both),
        (
            thin.clone(),
            "measured without them",
            &with(&thin, "largest_grain = \"100 µm\"\n", ""),
        ),
    ] {
        std::fs::write(&file, &bad).unwrap();
        let error = measurements::read(&file).unwrap_err().to_string();
        assert!(error.contains(named), "{error}");
        std::fs::write(&file, cured).unwrap();
        let read = measurements::read(&file);
        assert!(read.is_ok(), "{named}: {read:?}");
    }
}

/// A block that is dense with any beam teaches nothing: the verdict cannot say, where it printed the prior.
#[test]
fn a_fit_that_learns_nothing_cannot_say() {
    let dir = tempfile::tempdir().unwrap();
    let text = format!(
        "layers = 1\nspacing = \"100 µm\"\n[[porosity]]\nmeasured = \"0 %\"\nsigma = \"0.5 %\"\ncurrent = \"15 mA\"\nspeed = \"1600 mm/s\"\nspacing = \"0.1 mm\"\n{BEAM}"
    );
    let file = write(dir.path(), "m.toml", text);
    let found = fit(&file, At(&dir.path().join("out")), &Silent).unwrap();
    println!("{:?}", found.verdict.checks);
    assert_eq!(found.verdict.status(), Status::CannotSay);
    let remedy = check(&found.verdict, "taught").remedy.clone().unwrap();
    assert!(remedy.contains("finer charts"), "{remedy}");
}

/// A thickness in the wrong unit is explained by no beam: the warning says to look at it, and ends where it is right.
#[test]
fn remedies_of_a_fit_are_true() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("m.toml");
    let codes = |measured: &str, out: &str| {
        let text = format!(
            "layers = 1\nspacing = \"100 µm\"\n[[wall]]\nmeasured = \"{measured}\"\nsigma = \"20 µm\"\ncurrent = \"3 mA\"\nspeed = \"800 mm/s\"\n{BEAM}"
        );
        std::fs::write(&file, text).unwrap();
        let found = fit(&file, At(&dir.path().join(out)), &Silent).unwrap();
        super::names::in_style(&found.folder);
        println!(
            "{measured}: {:?} {:?} {:?}",
            found.fitted.before, found.fitted, found.verdict.warnings
        );
        let finer = &check(&found.verdict, "converged").reason;
        assert!(finer.contains("50.0 µm apart and 5 layers"), "{finer}");
        let warnings = found.verdict.warnings.into_iter();
        let all: Vec<(String, Option<String>)> = warnings.map(|w| (w.code, w.remedy)).collect();
        (all, found.fitted.before[0])
    };
    let (told, believed) = codes("8 mm", "wrong");
    let told = told.iter().find(|w| w.0 == "not-explained");
    let remedy = told.and_then(|w| w.1.clone()).unwrap_or_default();
    assert!(remedy.contains("look at the measurement"), "{told:?}");
    let (told, _) = codes(&format!("{believed:.3} mm"), "right");
    assert!(told.is_empty(), "{told:?}");
}
