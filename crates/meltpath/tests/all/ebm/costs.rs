//! What no machine could do is refused before anything is allocated or drawn, alike by `doctor` and by a run, at the setting that asks
//! for it; what is large and real is not.

use crate::support::write;
use meltpath::outcome::RunFolder::At;
use meltpath::{chain, compare};
use meltpath_base::Silent;

/// A rectangle that is hatched and judged without charts, with more tables.
fn rectangle([width, height]: [&str; 2], hatch: &str, tables: &str) -> String {
    let preview = if tables.contains("[charts]") {
        ""
    } else {
        "[charts]\npreview = \"none\"\n"
    };
    format!(
        "[process]\nkind = \"ebm\"\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"{width}\", \"0 mm\"], [\"{width}\", \"{height}\"], [\"0 mm\", \"{height}\"]]\n[hatch]\n{hatch}\n{preview}{tables}"
    )
}

/// The whole of what `doctor` and a run say of a job: they refuse it alike.
fn refused(text: &str) -> String {
    let dir = tempfile::tempdir().unwrap();
    let file = write(dir.path(), "job.toml", text);
    let out = dir.path().join("out");
    let run = chain::run(&file, At(&out), &Silent)
        .unwrap_err()
        .to_string();
    let doctor = chain::doctor(&file, &Silent).unwrap().refused;
    assert_eq!(doctor.map(|e| e.to_string()).as_deref(), Some(run.as_str()));
    assert!(!out.exists());
    run
}

const LINES: &str = "spacing = \"0.2 mm\"";

/// Each slip is one that ended in an allocation that failed, or would have run for years, while doctor found no problem.
#[test]
fn slips_that_no_machine_could_do_are_told_at_their_setting() {
    let small = ["4 mm", "2 mm"];
    let judged = |hatch: &str, tables: &str| rectangle(small, hatch, tables);
    let drawn = |tables: &str| {
        let charts = if tables.starts_with("[charts]") {
            ""
        } else {
            "[charts]\n"
        };
        rectangle(small, LINES, &format!("{charts}{tables}"))
    };
    for (text, said) in [
        (
            rectangle(["4 m", "2 m"], LINES, ""),
            "region.contour reaches over 4000 x 2000 mm",
        ),
        (
            judged(LINES, "[judge]\ncell = \"0.1 µm\"\n"),
            "judge.cell is 0.0001 mm",
        ),
        (
            judged(LINES, "[judge]\nstep = \"1e-15 s\"\n"),
            "judge.step is 0.000000000000001 s",
        ),
        (
            judged(LINES, "[ebm]\nlayer = \"1 nm\"\n"),
            "ebm.layer is 0.000001 mm",
        ),
        (
            judged(
                "strategy = \"spots\"\nspacing = \"0.5 mm\"\ndwell = \"1 h\"",
                "",
            ),
            "hatch.dwell is 3600 s",
        ),
        (judged("speed = \"1e-6 mm/s\"", ""), "hatch.speed is"),
        (
            judged(LINES, "[window]\nbody = [\"4 m\", \"4 m\"]\n"),
            "window.body reaches over 4000 x 4000 mm",
        ),
        (
            judged(
                LINES,
                "[optimise]\nmethod = \"learning\"\nsolver = \"reference\"\ncell = \"0.1 µm\"\n",
            ),
            "optimise.cell is 0.0001 mm",
        ),
        (
            judged(LINES, "[correct]\nreach = \"0.001 nm\"\n"),
            "correct.reach is",
        ),
        (
            drawn("[simulation]\nvoxel = \"1 nm\"\n"),
            "simulation.voxel is 0.000001 mm",
        ),
        (
            drawn("[simulation]\nstep = \"1e-15 s\"\n"),
            "simulation.step is",
        ),
        (
            drawn("[simulation]\nmargin = \"10 m\"\n"),
            "simulation.margin is 10000 mm",
        ),
        (
            drawn("[charts]\nspacing = \"1 nm\"\n"),
            "charts.spacing is 0.000001 mm",
        ),
    ] {
        let told = refused(&text);
        assert!(
            told.contains(said) && told.contains("would take"),
            "{said}: {told}"
        );
    }
}

/// A path whose last row is at 1e9 s, and one in metres.
#[test]
fn paths_that_no_machine_could_draw_are_told() {
    let rows = |scale: f64, last: f64| {
        format!(
            "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n0,0,0,60000,0.005,0.004,1\n0.004,{0},0,60000,0.005,0.004,1\n0.008,{0},{1},60000,0.005,0.004,0\n{last},0,0,60000,0.005,0.004,0\n",
            4.0 * scale,
            2.0 * scale
        )
    };
    let dir = tempfile::tempdir().unwrap();
    let job = "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[charts]\npreview = \"none\"\n";
    let file = write(dir.path(), "job.toml", job);
    for (scale, last, said) in [
        (
            1.0,
            1e9,
            "the beam path takes 1e9 s, with the beam on for 0.008 of them",
        ),
        (1000.0, 1.0, "the beam path reaches over 4000 x 2000 mm"),
    ] {
        write(dir.path(), "path.csv", rows(scale, last));
        let refused = chain::doctor(&file, &Silent).unwrap().refused.unwrap();
        let told = refused.to_string();
        assert!(told.contains(said), "{told}");
    }
}

/// A layer of 50 x 50 mm with 25 m of path, and a thousand layers of a small one, are jobs like others.
#[test]
fn what_is_large_and_real_is_taken() {
    let large = rectangle(["50 mm", "50 mm"], "spacing = \"0.1 mm\"", "");
    let many = rectangle(
        ["1 mm", "1 mm"],
        LINES,
        "[ebm]\nlayers = 1000\n[judge]\nmemory = \"metal\"\n",
    );
    for text in [large, many] {
        let dir = tempfile::tempdir().unwrap();
        let file = write(dir.path(), "job.toml", text);
        let found = chain::doctor(&file, &Silent).unwrap();
        assert_eq!(found.problems(), 0, "{:?}", found.refused);
        let cost = found
            .lines
            .iter()
            .any(|l| l.starts_with("cost of the judge"));
        assert!(cost, "{:?}", found.lines);
    }
}

/// A part that the beam never enters is refused at its key, by doctor too.
#[test]
fn a_part_off_the_path_is_told_where_it_is_written() {
    let off = "[judge]\npart = [[\"40 mm\", \"0 mm\"], [\"41 mm\", \"1 mm\"]]\n";
    let told = refused(&rectangle(["4 mm", "2 mm"], LINES, off));
    assert!(
        told.contains("judge.part: the beam is never on there"),
        "{told}"
    );
    let dir = tempfile::tempdir().unwrap();
    let on = off.replace("40 mm", "1 mm").replace("41 mm", "2 mm");
    let file = write(
        dir.path(),
        "job.toml",
        rectangle(["4 mm", "2 mm"], LINES, &on),
    );
    assert_eq!(chain::doctor(&file, &Silent).unwrap().problems(), 0);
}

/// Shares above the whole, beams wider than any that melts, layers without names.
#[test]
fn values_that_cannot_be_are_refused_where_they_are_read() {
    for (hatch, tables, said) in [
        (
            LINES,
            "[checks]\nin_window = \"150 %\"\n",
            "checks.in_window",
        ),
        (LINES, "[checks]\nunmelted = \"150 %\"\n", "checks.unmelted"),
        (LINES, "[ebm]\ndiameter = \"40 mm\"\n", "ebm.diameter"),
        (
            LINES,
            "[ebm]\nlayers = 20000\n",
            "draws 16383 layers at most",
        ),
        (
            LINES,
            "[ebm]\nlayers = -1\n",
            "ebm.layers is -1: it must be a whole number from zero to 4294967295",
        ),
        (
            "spacing = \"1 nm\"",
            "",
            "hatch.spacing: the distance between lines is 0.000001 mm",
        ),
    ] {
        let told = refused(&rectangle(["4 mm", "2 mm"], hatch, tables));
        assert!(told.contains(said), "{told}");
    }
}

/// The folder of a run without charts is compared by its tables, and says so.
#[test]
fn a_run_without_charts_names_its_tables() {
    let dir = tempfile::tempdir().unwrap();
    write(
        dir.path(),
        "job.toml",
        rectangle(["4 mm", "2 mm"], LINES, ""),
    );
    write(dir.path(), "path.csv", "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n");
    let table = write(dir.path(), "t.csv", "x,y,t,T\n0,0,0,1000\n");
    let out = dir.path().join("out");
    let told = compare::compare(dir.path(), Some(&table), At(&out), &Silent);
    let told = told.unwrap_err().to_string();
    assert!(
        told.contains("charts.preview = \"none\"") && told.contains("voxels-reference.csv"),
        "{told}"
    );
}
