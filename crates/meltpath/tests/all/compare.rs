//! `meltpath compare`: a run against samples of its own field, shifted ones, and tables that are wrong.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::support::{has_files, warned, write};
use meltpath::compare::quantity::Quantity;
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath::{chain, compare};
use meltpath_base::Silent;

use super::names::in_style;

/// A small run with pictures in time, and its folder.
fn run(folder: &Path) -> PathBuf {
    let mut path = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n".to_owned();
    for (time, x) in [(0.0, 0.0), (2.0 / 980.0, 2.0)] {
        writeln!(path, "{time},{x},0,60000,0.005,0.004,1").unwrap();
    }
    std::fs::write(folder.join("path.csv"), path).unwrap();
    let job = "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 3\n";
    let file = write(folder, "job.toml", crate::ebm::previewed(job));
    let out = folder.join("run");
    chain::run(&file, At(&out), &Silent).unwrap();
    out
}

#[test]
fn a_run_is_compared_with_a_table_and_with_itself() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let run = run(folder);
    // sensors that show 25 K more than anything at rest, one outside, one too late
    let mut table = "x_mm,y_mm,z_mm,t_ms,T_C\n".to_owned();
    for n in 0..40 {
        writeln!(
            table,
            "{},{},-0.02,{},775",
            0.05 * f64::from(n),
            0.4,
            0.001 * f64::from(n)
        )
        .unwrap();
    }
    table += "50,0,-0.02,0.1,775\n1,0,-0.02,500,775\n";
    let file = write(folder, "sensors.csv", &table);
    let out = folder.join("first");
    let found = compare::compare(&run, Some(&file), At(&out), &Silent).unwrap();
    assert_eq!(found.parts[0].left_out, [1, 1]);
    // 0.4 mm beside the line nothing is heated yet: the table is 25 K too high
    assert!(
        (found.parts[0].apart.bias - 25.0).abs() < 0.5,
        "{:?}",
        found.parts[0].apart
    );
    assert!(warned(&found.verdict, "samples-left-out"));
    has_files(
        &out,
        &[
            "report.html",
            "pairs.csv",
            "map.csv",
            "map.vti",
            "verdict.json",
        ],
    );
    // the pairs it wrote are a table themselves: the run's own temperatures, met again to the rounding of the file
    let pairs = std::fs::read_to_string(out.join("pairs.csv")).unwrap();
    let own: String = pairs
        .lines()
        .enumerate()
        .map(|(n, line)| {
            let cells: Vec<&str> = line.split(',').collect();
            if n == 0 {
                "x_mm,y_mm,z_mm,t_s,T_C\n".to_owned()
            } else {
                format!(
                    "{},{},{},{},{}\n",
                    cells[1], cells[2], cells[3], cells[4], cells[6]
                )
            }
        })
        .collect();
    let again = write(folder, "own.csv", own);
    let same = compare::compare(&run, Some(&again), At(&folder.join("second")), &Silent).unwrap();
    assert!(
        same.parts[0].apart.worst.difference().abs() < 0.05,
        "{:?}",
        same.parts[0].apart
    );
    // and one table against the other
    let tables = compare::compare(&again, Some(&file), At(&folder.join("third")), &Silent).unwrap();
    assert!(
        (tables.parts[0].apart.bias - 25.0).abs() < 0.5,
        "{:?}",
        tables.parts[0].apart
    );
}

/// A judged run is compared with its own judge by one command, and the judge's tables with themselves and with charts.
#[test]
fn charts_are_compared_with_their_judge() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let mut path = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n".to_owned();
    for (time, x) in [(0.0, 0.0), (2.5e-3, 1.0), (6.0e-3, 1.0)] {
        let on = i32::from(time < 1e-3);
        writeln!(path, "{time},{x},0,60000,0.002,0.004,{on}").unwrap();
    }
    std::fs::write(folder.join("path.csv"), path).unwrap();
    let job = "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[charts]\nstop = \"3300 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 1\n";
    let file = folder.join("job.toml");
    let plain = folder.join("plain");
    std::fs::write(&file, crate::ebm::previewed(job)).unwrap();
    chain::run(&file, At(&plain), &Silent).unwrap();
    let refused = compare::compare(&plain, None, NextIn(folder), &Silent).unwrap_err();
    let refused = refused.to_string();
    assert!(refused.contains("solver = \"reference\""), "{refused}");
    let judge = "[judge]\nsolver = \"reference\"\ncell = \"0.1 mm\"\nstep = \"10 us\"\nplaces = [[\"0.6 mm\", \"0 mm\"], [\"0.6 mm\", \"0 mm\", \"-0.1 mm\"], [\"9 mm\", \"0 mm\"]]\n";
    std::fs::write(&file, format!("{job}{judge}")).unwrap();
    let run = folder.join("run");
    let ran = chain::run(&file, At(&run), &Silent).unwrap();
    let told = |code: &str| ran.verdict.warnings.iter().find(|w| w.code == code);
    assert!(
        told("places-outside")
            .unwrap()
            .message
            .contains("(9, 0, 0)")
    );
    let out = folder.join("out");
    let found = compare::compare(&run, None, At(&out), &Silent).unwrap();
    let of = |q: Quantity| found.parts.iter().find(|p| p.quantity == q).unwrap();
    assert_eq!(found.parts.len(), 4);
    // two places every 50 µs of 6 ms, from the first look on
    assert_eq!(of(Quantity::Temperature).pairs.len(), 2 * 121);
    // one line, charts that do not end before it: within some 100 K and half a millisecond
    let highest = &of(Quantity::Highest).apart;
    assert!(highest.bias.abs() < 150.0, "{highest:?}");
    let froze = &of(Quantity::Solidified).apart;
    assert!(froze.mean < 5e-4, "{froze:?}");
    assert!(in_style(&out) > 10 && in_style(&run) > 10);
    has_files(
        &out,
        &[
            "pairs.csv",
            "pairs-highest.csv",
            "map-molten.vti",
            "map-solidified.csv",
        ],
    );
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("Time of freezing"));
    // tables against tables: each with itself, and charts with the solver within a twentieth of a millimetre
    let (ours, theirs) = (
        run.join("series/voxels-reference.csv"),
        run.join("series/voxels.csv"),
    );
    let same = compare::compare(&ours, Some(&ours), NextIn(&folder.join("same")), &Silent).unwrap();
    assert!(same.parts.iter().all(|p| p.apart.worst.difference() == 0.0));
    let near =
        compare::compare(&theirs, Some(&ours), NextIn(&folder.join("near")), &Silent).unwrap();
    assert_eq!(near.parts.len(), 3);
    let samples = run.join("series/temperatures-reference.csv");
    let error = compare::compare(&theirs, Some(&samples), NextIn(folder), &Silent).unwrap_err();
    let error = error.to_string();
    assert!(error.contains("nothing is told by both"), "{error}");
}

/// Each layer of a run is met at its own height and on its own clock, and told by itself.
#[test]
fn every_layer_is_compared() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let job = "[process]\nkind = \"ebm\"\n[ebm]\nlayers = 3\n[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 1\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"2 mm\", \"1 mm\"], [\"0 mm\", \"1 mm\"]]\n[hatch]\n";
    let file = write(folder, "job.toml", crate::ebm::previewed(job));
    let run = folder.join("run");
    chain::run(&file, At(&run), &Silent).unwrap();
    // on the surface, which is 750 °C until the beam comes
    let table = |name: &str, layers: &[u32]| {
        let mut text = "x,y,t_ms,T,layer\n".to_owned();
        for layer in layers {
            for n in 0..10 {
                writeln!(
                    text,
                    "{},0.5,0.001,{},{layer}",
                    0.2 * f64::from(n),
                    750 + 10 * layer
                )
                .unwrap();
            }
        }
        write(folder, name, text)
    };
    let out = folder.join("out");
    let found = compare::compare(&run, Some(&table("all.csv", &[1, 2, 3])), At(&out), &Silent);
    let found = found.unwrap();
    assert_eq!(found.parts[0].pairs.len(), 30);
    let height = |layer: usize| {
        let n = found.parts[0]
            .layers
            .iter()
            .position(|l| *l == layer)
            .unwrap();
        found.parts[0].pairs[n].sample.place[2]
    };
    assert!((height(3) - height(1) - 0.1).abs() < 1e-9);
    let of = |layer: usize| {
        let own = found.parts[0]
            .layers
            .iter()
            .zip(&found.parts[0].pairs)
            .filter(|(l, _)| **l == layer);
        own.map(|(_, p)| p.difference()).fold(0.0, f64::max)
    };
    for layer in 1..=3 {
        assert!(
            (of(layer) - 10.0 * layer as f64).abs() < 1.0,
            "{layer}: {}",
            of(layer)
        );
    }
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("By layer"));
    let wrong = table("wrong.csv", &[1, 4]);
    let error = compare::compare(&run, Some(&wrong), NextIn(folder), &Silent).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("layer 4 is not one of the run's 1 to 3"),
        "{error}"
    );
}

#[test]
fn what_cannot_be_compared_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let write = |name: &str, text: &str| write(folder, name, text);
    let table = write("a.csv", "x,y,z,t,T\n0,0,0,0,900\n");
    let away = write("b.csv", "x,y,z,t,T\n5,0,0,0,900\n");
    let told = |against: &Path, table: &Path| {
        let out = folder.join("out");
        let error = compare::compare(against, Some(table), At(&out), &Silent).unwrap_err();
        assert!(!out.exists());
        error.to_string()
    };
    assert!(told(&away, &table).contains("none of the 1 samples"));
    assert!(told(folder, &table).contains("it has no job.toml"));
    let kind = write("c.dat", "");
    assert!(
        told(&away, &kind).contains("c.dat"),
        "{}",
        told(&away, &kind)
    );
    assert!(told(&away, &folder.join("none.csv")).contains("none.csv"));
    let cut = write("d.parquet", "PAR1 and no more");
    assert!(told(&away, &cut).contains("d.parquet"));
    for (heads, both) in [
        ("x,y,z,t,T_C,T_K", "\"T_C\" and \"T_K\""),
        ("x_mm,y,z,t,T,x_m", "\"x_mm\" and \"x_m\""),
    ] {
        let twice = write("e.csv", &format!("{heads}\n0,0,0,0,900,900\n"));
        let told = told(&table, &twice);
        assert!(told.contains(both), "{told}");
    }
}

/// Pairs whose places lie apart have differences of their own; how far they lie apart is told.
#[test]
fn how_far_places_of_pairs_lie_apart_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let other = write(
        folder,
        "other.csv",
        "x,y,z,t,T\n0,0,0,0,900\n1,0,0,0,950\n5,0,0,0,700\n",
    );
    for (name, table, mean, greatest) in [
        (
            "moved",
            "x,y,z,t,T\n0.04,0,0,0,900\n1.02,0,0,0,950\n",
            0.03,
            0.04,
        ),
        ("same", "x,y,z,t,T\n0,0,0,0,900\n1,0,0,0,950\n", 0.0, 0.0),
    ] {
        let table = write(folder, "table.csv", table);
        let found = compare::compare(&other, Some(&table), At(&folder.join(name)), &Silent);
        let found = found.unwrap();
        // a place that only the other has is in no figure
        assert_eq!(found.parts[0].unmet, 1);
        assert!(warned(&found.verdict, "places-unmet"));
        let [told_mean, told_greatest] = found.parts[0].away.unwrap();
        assert!((told_mean - mean).abs() < 1e-9 && (told_greatest - greatest).abs() < 1e-9);
        let facts = &found.verdict.facts;
        let fact = facts.iter().find(|f| f.id == "pairs-apart").unwrap();
        let told = fact.value.as_ref().unwrap();
        assert!((told.value - 1e3 * mean).abs() < 1e-6 && told.unit == "µm");
        let most = format!("{:.1} µm at most", 1e3 * greatest);
        assert!(fact.reason.contains(&most), "{fact:?}");
    }
}
