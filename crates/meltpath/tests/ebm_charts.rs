//! Charts of electron-beam jobs: files that cannot be used, and what the ground keeps of earlier lines.
#![allow(clippy::unwrap_used, reason = "a test that fails stops here")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use meltpath::chain;
use meltpath_base::Silent;
use meltpath_base::container::Container;
use meltpath_thermal::chart_file;

/// Six lines of 2 mm every 0.125 mm at 980 mm/s.
fn path() -> String {
    let mut text = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n".to_owned();
    let mut time = 0.0;
    for n in 0..6 {
        let y = 0.125 * f64::from(n);
        let ends = if n % 2 == 0 { [0.0, 2.0] } else { [2.0, 0.0] };
        for (x, way) in ends.into_iter().zip([2.0, 0.125]) {
            writeln!(text, "{time},{x},{y},60000,0.005,0.004,1").unwrap();
            time += way / 980.0;
        }
    }
    text
}

fn job(folder: &Path, name: &str, charts: &str) -> PathBuf {
    std::fs::write(folder.join("path.csv"), path()).unwrap();
    let file = folder.join(format!("{name}.toml"));
    let text = format!(
        "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n{charts}\n[simulation]\nframes = 1\n"
    );
    std::fs::write(&file, text).unwrap();
    file
}

/// Hottest place on the charts, °C.
fn hottest(outcome: &meltpath::outcome::Outcome) -> f64 {
    let check = outcome.verdict.checks.iter().find(|c| c.id == "hottest");
    check.unwrap().value.as_ref().unwrap().value
}

/// Charts written without memory serve a job with memory: what is missing is computed, and kept.
#[test]
fn charts_with_memory_are_hotter_on_a_hatch() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let run = |name: &str, charts: &str| {
        let out = folder.join(name);
        let found = chain::run(&job(folder, name, charts), Some(&out), folder, &Silent).unwrap();
        let mut file = std::fs::File::open(out.join("charts/1.melt")).unwrap();
        (
            hottest(&found),
            chart_file::read(&mut file).unwrap().warm.len(),
        )
    };
    let (plain, cold) = run("none", "memory = \"none\"");
    let again = "files = [\"none/charts/1.melt\"]\nmemory = \"ground\"";
    let (warm, grounds) = run("ground", again);
    // the solver's seventh line is a thousand degrees hotter than charts without memory
    assert!(warm > plain + 300.0, "{plain} {warm}");
    assert!(cold == 0 && grounds > 1);
    // and the other way round nothing is remembered
    let (back, _) = run("back", "files = [\"ground/charts/1.melt\"]");
    assert!((back - plain).abs() < 1e-9, "{back} {plain}");
    let lines = chain::doctor(&job(folder, "doctor", "")).unwrap();
    assert!(
        lines
            .iter()
            .any(|l| l.starts_with("charts.memory") && l.contains("none"))
    );
    let wrong = job(folder, "wrong", "memory = \"ice\"");
    let error = chain::run(&wrong, None, folder, &Silent).unwrap_err();
    assert!(
        error.to_string().contains("expected `none` or `ground`"),
        "{error}"
    );
}

/// Charts of another version, cut short, or of another material: named, with what to do, and no folder is left.
#[test]
fn charts_that_cannot_be_used_are_refused_by_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let first = folder.join("first");
    chain::run(&job(folder, "first", ""), Some(&first), folder, &Silent).unwrap();
    let bytes = std::fs::read(first.join("charts/1.melt")).unwrap();
    let refused = |bytes: &[u8]| {
        std::fs::write(folder.join("a.melt"), bytes).unwrap();
        let out = folder.join("out");
        let file = job(folder, "again", "files = [\"a.melt\"]");
        let error = chain::run(&file, Some(&out), folder, &Silent).unwrap_err();
        assert!(!out.exists());
        error.to_string()
    };
    let name = b"meltpath-chart/2";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap();
    let mut older = bytes.clone();
    older[at + name.len() - 1] = b'1';
    let told = refused(&older);
    assert!(
        told.contains("a.melt")
            && told.contains("holds meltpath-chart/1, this meltpath reads meltpath-chart/2"),
        "{told}"
    );
    assert!(
        told.contains("left out of charts.files, they are computed"),
        "{told}"
    );
    let mut other = Container::read(&mut bytes.as_slice()).unwrap();
    other.meta["fingerprint"] = 1.into();
    let mut foreign = Vec::new();
    other.write(&mut foreign).unwrap();
    let told = refused(&foreign);
    assert!(told.contains("Ti6Al4V"), "{told}");
    for length in [bytes.len() - 5, bytes.len() / 2, 40] {
        let told = refused(&bytes[..length]);
        assert!(
            told.contains("cannot use the charts") && told.contains("a.melt"),
            "{told}"
        );
    }
    assert!(
        refused(&{
            let mut harmed = bytes.clone();
            let middle = harmed.len() / 2;
            harmed[middle] ^= 1;
            harmed
        })
        .contains("checksum")
    );
}
