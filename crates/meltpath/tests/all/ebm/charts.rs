//! Charts of electron-beam jobs: files that cannot be used, and what the ground keeps of earlier lines.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::support::{foretold, refusal, says};
use meltpath::chain;
use meltpath::compare::compare;
use meltpath::outcome::RunFolder::At;
use meltpath_base::Silent;
use meltpath_base::container::Container;
use meltpath_thermal::charts::file as chart_file;

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
    std::fs::write(&file, super::previewed(&text)).unwrap();
    file
}

/// Hottest place on the charts, °C.
fn hottest(outcome: &meltpath::outcome::Outcome) -> f64 {
    let fact = outcome.verdict.facts.iter().find(|f| f.id == "hottest");
    fact.unwrap().value.as_ref().unwrap().value
}

/// Charts written without memory serve a job with memory: what is missing is computed, and kept.
#[test]
fn charts_with_memory_are_hotter_on_a_hatch() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let run = |name: &str, charts: &str| {
        let out = folder.join(name);
        let found = chain::run(&job(folder, name, charts), At(&out), &Silent).unwrap();
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
    let (back, _) = run(
        "back",
        "memory = \"none\"\nfiles = [\"ground/charts/1.melt\"]",
    );
    assert!((back - plain).abs() < 1e-9, "{back} {plain}");
    let told = chain::doctor(&job(folder, "doctor", ""), &Silent).unwrap();
    assert!(told.lines.iter().any(|l| l.starts_with("memory = ground")));
    let wrong = job(folder, "wrong", "memory = \"ice\"");
    says(&refusal(&wrong), &["is one of \"none\", \"ground\""]);
}

/// Charts of another version, cut short, or of another material: named, with what to do, and no folder is left.
#[test]
fn charts_that_cannot_be_used_are_refused_by_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let first = folder.join("first");
    chain::run(&job(folder, "first", ""), At(&first), &Silent).unwrap();
    let bytes = std::fs::read(first.join("charts/1.melt")).unwrap();
    let refused = |bytes: &[u8]| {
        std::fs::write(folder.join("a.melt"), bytes).unwrap();
        let out = folder.join("out");
        let file = job(folder, "again", "files = [\"a.melt\"]");
        let error = chain::run(&file, At(&out), &Silent).unwrap_err();
        assert!(!out.exists());
        error.to_string()
    };
    let name = b"meltpath-chart/3";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap();
    let mut older = bytes.clone();
    older[at + name.len() - 1] = b'1';
    says(
        &refused(&older),
        &[
            "a.melt",
            "holds meltpath-chart/1, this meltpath reads meltpath-chart/3",
            "left out of charts.files, they are computed",
        ],
    );
    let mut other = Container::read(&mut bytes.as_slice()).unwrap();
    other.meta["fingerprint"] = 1.into();
    let mut foreign = Vec::new();
    other.write(&mut foreign).unwrap();
    says(&refused(&foreign), &["Ti6Al4V"]);
    for length in [bytes.len() - 5, bytes.len() / 2, 40] {
        let told = refused(&bytes[..length]);
        says(&told, &["cannot use the charts", "a.melt"]);
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

/// Charts that were computed for another beam are refused, otherwise computed ones are used and told; between two currents that
/// enclose the job's they are mixed. `doctor` says beforehand what comes from where and what it costs.
#[test]
fn charts_serve_what_they_were_computed_for() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    // charts for two currents, and what charts of its own say of the one between
    let with_current = |name: &str, current: f64, charts: &str, rest: &str| {
        let file = job(folder, name, charts);
        let table = path().replace("0.005", &format!("{current}"));
        std::fs::write(folder.join(format!("{name}.csv")), table).unwrap();
        let text = std::fs::read_to_string(&file).unwrap();
        let text = text.replace("path.csv", &format!("{name}.csv"));
        std::fs::write(&file, format!("{text}{rest}")).unwrap();
        file
    };
    let run = |name: &str, current: f64, charts: &str| {
        let file = with_current(name, current, charts, "");
        chain::run(&file, At(&folder.join(name)), &Silent).unwrap()
    };
    run("low", 4.5e-3, "");
    run("high", 5.5e-3, "");
    let own = run("own", 5e-3, "");
    let both = "files = [\"low/charts/1.melt\", \"high/charts/1.melt\"]";
    let between = run("between", 5e-3, both);
    let told = |o: &meltpath::outcome::Outcome, code: &str| {
        let warnings = &o.verdict.warnings;
        warnings
            .iter()
            .find(|w| w.code == code)
            .map(|w| w.message.clone())
    };
    let words = told(&between, "charts-between").unwrap();
    says(&words, &["300.0 W", "270.0 and 330.0 W"]);
    assert!((hottest(&between) - hottest(&own)).abs() < 30.0);
    let report = std::fs::read_to_string(folder.join("between/report.html")).unwrap();
    assert!(report.contains("taken between those") && report.contains("class=\"film\""));
    let doctor = |file: &Path| chain::doctor(file, &Silent).unwrap().lines.join("\n");
    let lines = doctor(&with_current("asked", 5e-3, both, ""));
    says(&lines, &["on 413.7 µm: between", "cost: "]);
    let lines = doctor(&with_current("plain", 5e-3, "", ""));
    assert!(lines.contains("computed by the run, about"), "{lines}");
    // computed for a lower end: used, and told
    let one = "files = [\"own/charts/1.melt\"]";
    let file = with_current("stop", 5e-3, one, "");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("3700 °C", "3600 °C")).unwrap();
    let lines = doctor(&file);
    says(&lines, &["stop 3700 °C in place of 3600 °C"]);
    // for another efficiency: refused by both
    let file = with_current("other", 5e-3, one, "[ebm]\nefficiency = \"80 %\"\n");
    let refused = refusal(&file);
    says(
        &refused,
        &["efficiency of 0.9, the job has 0.8", "own/charts"],
    );
    let before = |file: &Path| {
        chain::doctor(file, &Silent)
            .unwrap()
            .refused
            .unwrap()
            .to_string()
    };
    assert_eq!(before(&file), refused);
    // cut short: told by doctor too
    let bytes = std::fs::read(folder.join("own/charts/1.melt")).unwrap();
    std::fs::write(folder.join("cut.melt"), &bytes[..bytes.len() / 2]).unwrap();
    let file = with_current("cut", 5e-3, "files = [\"cut.melt\"]", "");
    let refused = before(&file);
    says(&refused, &["cut.melt", "they are computed"]);
}

/// Paths that cannot be meant: outside the region, not in mm, with more settings than charts can serve. Each is refused before
/// anything is computed, by `doctor` too.
#[test]
fn paths_that_cannot_be_meant_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let refused = |table: &str, rest: &str| {
        let file = job(folder, "job", "");
        std::fs::write(folder.join("path.csv"), table).unwrap();
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, format!("{text}{rest}")).unwrap();
        let out = folder.join("out");
        let error = chain::run(&file, At(&out), &Silent).unwrap_err();
        assert!(!out.exists());
        foretold(&error, &file);
        (error.to_string(), format!("{error:?}"))
    };
    let region = "[region]\ncontour = [[\"10 mm\", \"0 mm\"], [\"12 mm\", \"0 mm\"], [\"12 mm\", \"2 mm\"]]\n";
    let (told, place) = refused(&path(), region);
    says(
        &told,
        &[
            "path.csv: the beam is on between [0.0, 0.0] and [2.0, 0.625] mm, and nowhere inside region.contour",
        ],
    );
    assert!(place.contains("Some(7..17)"), "{place}");
    let head = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n";
    let micrometres =
        format!("{head}0,0,0,60000,0.005,0.004,1\n60,60000,40000,60000,0.005,0.004,1\n");
    let (told, _) = refused(&micrometres, "");
    says(
        &told,
        &["the beam path reaches over 60000 x 40000 mm", "of memory"],
    );
    let mut many = head.to_owned();
    for n in 0..90 {
        writeln!(
            many,
            "{},{},0,60000,0.005,{},1",
            1e-4 * f64::from(n),
            0.1 * f64::from(n),
            4e-3 + 1e-5 * f64::from(n)
        )
        .unwrap();
    }
    let (told, _) = refused(&many, "");
    assert!(told.contains("different beam settings"), "{told}");
}

/// A path whose current changes all the time is drawn with charts for some of its currents; `compare` finds them again.
#[test]
fn charts_serve_a_current_that_changes_all_the_time() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    // six currents, one a line, and the same with every point a little off
    let drawn = |name: &str, off: f64| {
        let mut rows = path();
        let mut n = 0.0;
        while let Some(at) = rows.find(",0.005,") {
            let current = 4.5e-3 + 0.2e-3 * f64::floor(0.5 * n) + off * n;
            rows.replace_range(at..at + 7, &format!(",{current},"));
            n += 1.0;
        }
        let file = job(folder, name, "");
        std::fs::write(folder.join("path.csv"), rows).unwrap();
        let out = folder.join(name);
        let found = chain::run(&file, At(&out), &Silent).unwrap();
        (found, out)
    };
    let charts = |out: &Path| std::fs::read_dir(out.join("charts")).unwrap().count();
    let (own, of_own) = drawn("own", 0.0);
    let (many, of_many) = drawn("many", 1e-9);
    assert_eq!([charts(&of_own), charts(&of_many)], [6, 2]);
    assert!((hottest(&own) - hottest(&many)).abs() < 20.0);
    assert!(hottest(&own) > 1800.0);
    let warnings = &many.verdict.warnings;
    let told = warnings.iter().find(|w| w.code == "charts-in-steps");
    let told = &told.unwrap().message;
    says(
        &told,
        &["11 beam powers from 270.0 to 330.0 W", "for 2 of them"],
    );
    let table = of_many.join("series/voxels.csv");
    let out = folder.join("compared");
    let same = compare(&of_many, Some(&table), At(&out), &Silent).unwrap();
    assert!(same.parts.iter().all(|p| p.apart.mean < 0.1));
}
