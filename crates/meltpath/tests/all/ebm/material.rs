//! Materials of an electron-beam job from files: used, kept with the run, named in its report; refused with what, where and why.
use std::path::{Path, PathBuf};

use crate::support::{foretold, says, write};
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath::{chain, compare};
use meltpath_base::Silent;

const TITANIUM: &str = meltpath_data::materials::TI6AL4V_EBM.text;
const PATH: &str =
    "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n0,0,0,60000,0.005,0.004,1\n0.001,1,0,60000,0.005,0.004,1\n";

fn job(folder: &Path, material: &str) -> PathBuf {
    std::fs::write(folder.join("path.csv"), PATH).unwrap();
    let text = format!(
        "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[ebm]\nmaterial = \"{material}\"\n[charts]\nspacing = \"50 µm\"\n[simulation]\nframes = 1\n"
    );
    write(folder, "job.toml", super::previewed(&text))
}

/// Highest temperatures of the molten voxels, °C.
fn highest(run: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(run.join("series/voxels.csv")).unwrap();
    let of = |line: &str| line.split(',').nth(3).unwrap().parse::<f64>().unwrap();
    text.lines().skip(1).map(of).collect()
}

/// Of the hottest voxel, °C.
fn hottest(run: &Path) -> f64 {
    highest(run).into_iter().fold(0.0, f64::max)
}

#[test]
fn a_material_of_ones_own_is_used_and_kept() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let heavy = TITANIUM
        .replace(
            "polynomial = [4425.0, -0.155]",
            "polynomial = [6000.0, -0.155]",
        )
        .replace(
            "polynomial = [3920.0, -0.68]",
            "polynomial = [5500.0, -0.68]",
        )
        .replace("Ti6Al4V, electron-beam", "Heavy alloy, electron-beam");
    std::fs::create_dir(folder.join("metals")).unwrap();
    std::fs::write(folder.join("metals/heavy.toml"), &heavy).unwrap();
    let run = |material: &str, name: &str| {
        let out = folder.join(name);
        let ran = chain::run(&job(folder, material), At(&out), &Silent).unwrap();
        (out, ran)
    };
    let (titanium, plain) = run("ti6al4v-ebm", "titanium");
    let (own, ran) = run("metals/heavy.toml", "own");
    // more metal under the same beam
    assert!(hottest(&own) < hottest(&titanium) - 50.0);
    let told = |w: &meltpath_base::Warning| w.code == "window-of-another-material";
    assert!(ran.verdict.warnings.iter().any(told));
    assert!(!plain.verdict.warnings.iter().any(told));
    let text = |name: &str| std::fs::read_to_string(own.join(name)).unwrap();
    assert_eq!(text("inputs/heavy.toml"), heavy);
    for name in ["report.html", "provenance.json"] {
        let text = text(name);
        for wanted in ["Heavy alloy", "metals/heavy.toml", "2016GREAI052"] {
            assert!(text.contains(wanted), "{name}: {wanted}");
        }
    }
    // drawn again from its folder alone
    std::fs::remove_dir_all(folder.join("metals")).unwrap();
    let voxels = own.join("series/voxels.csv");
    let same =
        compare::compare(&own, Some(&voxels), NextIn(&folder.join("same")), &Silent).unwrap();
    assert!(same.parts[0].apart.worst.difference().abs() < 0.1);
}

/// Both solvers begin at the bed's temperature, and more melts and leaves as vapour on a hotter one.
#[test]
fn a_bed_as_hot_as_the_job_says() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let preheated = |bed: &str| {
        let text = std::fs::read_to_string(job(folder, "ti6al4v-ebm")).unwrap();
        let ebm = format!("[ebm]\npreheat = \"{bed}\"");
        let text = text.replace("[ebm]", &ebm).replace(
            "[judge]\nsolver = \"none\"",
            "[judge]\ncell = \"0.125 mm\"\nstep = \"10 us\"",
        );
        write(folder, "job.toml", text)
    };
    let melts = |bed: &str| {
        let out = folder.join(bed);
        let ran = chain::run(&preheated(bed), At(&out), &Silent).unwrap();
        let fact = |id: &str| {
            let fact = ran.verdict.facts.iter().find(|f| f.id == id).unwrap();
            fact.value.as_ref().unwrap().value
        };
        // one line on a hull without area: no place of it is the hottest
        assert!(ran.verdict.facts.iter().all(|f| f.id != "hottest"));
        (
            highest(&out).len(),
            hottest(&out),
            fact("vapour"),
            fact("ground-before"),
        )
    };
    let (cold, warm) = (melts("750 °C"), melts("950 °C"));
    println!("{cold:?} {warm:?}");
    assert!(warm.0 > cold.0 && warm.1 > cold.1 + 5.0 && warm.2 > 1.3 * cold.2);
    assert!((cold.3 - 750.0).abs() < 1e-9 && (warm.3 - 950.0).abs() < 1e-9);
    for bed in ["700 °C", "1605 °C"] {
        let file = preheated(bed);
        let error = chain::run(&file, NextIn(folder), &Silent).unwrap_err();
        foretold(&error, &file);
        says(&error.to_string(), &["the bed is at", "hold from 750 °C"]);
    }
}

#[test]
fn what_is_no_material_is_named_in_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let refused = |material: &str| {
        let file = job(folder, material);
        let text = std::fs::read_to_string(&file).unwrap();
        let error = chain::run(&file, NextIn(folder), &Silent).unwrap_err();
        foretold(&error, &file);
        let place = format!("{error:?}");
        let at = text.find(&format!("\"{material}\"")).unwrap();
        // in the job, or, for a file that was read, in that file
        let of_file = place.contains("FileText") && place.contains(material);
        assert!(
            of_file || place.contains(&format!("Some({at}..")),
            "{at}: {place}"
        );
        error.to_string()
    };
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    assert!(refused("gold").contains(
        "known are \"in625-laser\", \"in718-laser\", \"ti6al4v-ebm\"; or name a TOML file"
    ));
    assert!(refused("none.toml").contains("cannot read the material"));
    let (before, _) = TITANIUM.split_once(" 750.0\nunit").unwrap();
    write("cut.toml", before);
    assert!(refused("cut.toml").contains("expected literal string"));
    write(
        "cold.toml",
        &TITANIUM.replace("polynomial = [7.0, 0.0125]", "polynomial = [-30.0, 0.0125]"),
    );
    let cold = refused("cold.toml");
    says(&cold, &["conductivity", "above zero"]);
    write(
        "short.toml",
        &TITANIUM.replace("[750.0, 3000.0]", "[900.0, 3000.0]"),
    );
    assert!(refused("short.toml").contains("from the consolidation, 750 °C"));
}
