//! Jobs whose robot cannot keep the set speed: the slower motion reaches the metal.

use std::collections::BTreeMap;
use std::path::Path;

use crate::support::{check, part, says, write};
use meltpath::outcome::Outcome;
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Fact, Reporter, Silent, Status};
use meltpath_data::{find, robots};
use meltpath_geometry::io::stl::read_stl;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes::cuboid;

/// Distance of the wall from the first axis, mm, and the set speed, mm/s.
const R: f64 = 800.0;
const V: f64 = 12.5;
/// What the first axis can do, rad/s: 8.5 mm/s of the tip where it is nearest.
const OMEGA: f64 = 8.5 / R;

/// A KUKA with its torch straight under the flange, its first axis as fast as told. Its file names no maker, lest the programs of FANUC that
/// are judged are another's.
fn robot(folder: &Path, first: f64) {
    let text = find(robots::ALL, "kuka-kr16-r2010-2").unwrap().text;
    let (arm, _) = text.split_once("\n[torch]").unwrap();
    let arm = arm.replace("maker = \"kuka\"\n", "").replace(
        "speed = [\"200 deg/s\"",
        &format!("speed = [\"{} deg/s\"", first.to_degrees()),
    );
    let text = format!(
        "{arm}\n[torch]\nsource = \"test\"\nposition = [\"0 mm\", \"0 mm\", \"330 mm\"]\nwire = \"15 mm\"\n\
         [table]\nsource = \"test\"\nposition = [\"{R} mm\", \"0 mm\", \"300 mm\"]\n"
    );
    write(folder, "robot.toml", text);
}

/// A wall of one bead along y, 1.2 m long.
fn job(folder: &Path, cell: &str) -> std::path::PathBuf {
    let wall = cuboid(DVec3::new(-2.0, -600.0, 0.0), DVec3::new(2.0, 600.0, 3.0));
    part(folder, "wall.stl", &wall);
    write(
        folder,
        "job.toml",
        format!(
            "part = \"wall.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
             [waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 1\n\
             [fill]\nstrategy = \"raster\"\n[machine]\n{cell}robot = \"robot.toml\"\n[simulation]\ncell = \"1 mm\"\n"
        ),
    )
}

/// Runs the job with the first axis as fast as told.
fn ran(folder: &Path, first: f64, cell: &str) -> Outcome {
    robot(folder, first);
    run(&job(folder, cell), NextIn(&folder.join("runs")), &Silent).unwrap()
}

fn fact<'a>(outcome: &'a Outcome, id: &str) -> Option<&'a Fact> {
    outcome.verdict.facts.iter().find(|f| f.id == id)
}

fn value(outcome: &Outcome, id: &str) -> f64 {
    fact(outcome, id).unwrap().value.as_ref().unwrap().value
}

/// Area of the bead's section at each y of the height map, mm².
fn sections(outcome: &Outcome) -> Vec<(f64, f64)> {
    let bytes = std::fs::read(outcome.folder.join("as-built.stl")).unwrap();
    let mesh = read_stl(&bytes[..], None, &Reporter::new(), &Silent).unwrap();
    let key = |v: f64| (v * 100.0).round() as i64;
    let mut rows: BTreeMap<i64, BTreeMap<i64, f64>> = BTreeMap::new();
    for v in &mesh.mesh.vertices {
        let top = rows
            .entry(key(v.y))
            .or_default()
            .entry(key(v.x))
            .or_default();
        *top = top.max(v.z);
    }
    let area = |row: &BTreeMap<i64, f64>| row.values().sum::<f64>();
    rows.iter()
        .map(|(y, row)| (*y as f64 / 100.0, area(row)))
        .collect()
}

/// How much more metal lies at y by the hand's formula: the set speed over what the axis lets the tip do there.
fn thicker(y: f64) -> f64 {
    (V * R / (OMEGA * (R * R + y * y))).max(1.0)
}

#[test]
fn a_slow_axis_makes_the_bead_thicker_where_it_is_slow() {
    let dir = tempfile::tempdir().unwrap();
    let slow = ran(dir.path(), OMEGA, "");
    let fast = ran(dir.path(), 3.0, "");
    assert!(fact(&fast, "bead-axes").is_none());
    let areas = sections(&slow);
    let plain = sections(&fast);
    let mut seen = 0;
    for ((y, area), (same, plain)) in areas.iter().zip(&plain) {
        assert_eq!(y, same);
        // the pool follows a few millimetres behind, and ends are round
        if y.abs() < 580.0 {
            seen += 1;
            let ratio = area / plain;
            assert!(
                (ratio / thicker(*y) - 1.0).abs() < 0.01,
                "{y}: {ratio} {}",
                thicker(*y)
            );
        }
    }
    assert!(seen > 1000 && thicker(0.0) > 1.47);
    // wire is fed by the second
    let feed = |of: &Outcome| value(of, "wire-mass") / value(of, "time-arc");
    assert!((feed(&slow) / feed(&fast) - 1.0).abs() < 1e-6);
    let y0 = (R * V / OMEGA - R * R).sqrt();
    let delay = 2.0 * (y0 / R).atan() / OMEGA - 2.0 * y0 / V;
    let longer = 60.0 * (value(&slow, "time-arc") - value(&fast, "time-arc"));
    assert!((longer / delay - 1.0).abs() < 2e-3, "{longer} {delay}");
    assert!((value(&slow, "bead-axes") - longer).abs() < 1e-6);
    // volume laid is that of the wire
    let laid = |areas: &[(f64, f64)]| areas.iter().map(|a| a.1).sum::<f64>();
    let wire = value(&slow, "wire-mass") / value(&fast, "wire-mass");
    assert!((laid(&areas) / laid(&plain) / wire - 1.0).abs() < 1e-6);
    let failed = check(&slow.verdict, "joint-speed");
    assert_eq!(failed.status, Status::Fail);
    let words = [
        "joint 1",
        "goes 0.51 m/min",
        "1.47 times the metal",
        "a bead 7.5 mm wide",
    ];
    says(&failed.reason, &words);
    assert!(failed.place.as_ref().unwrap().position.unwrap()[1].abs() < 1.0);
    assert_eq!(check(&fast.verdict, "joint-speed").status, Status::Pass);
    // the program that was written says the set speed, and is slowed down as its job's
    let program = std::fs::read_dir(slow.folder.join("program")).unwrap();
    let program = program.map(|f| f.unwrap().path()).next().unwrap();
    robot(dir.path(), OMEGA);
    let job = dir.path().join("job.toml");
    let again = simulate_program(
        &program,
        Some(&job),
        NextIn(&dir.path().join("runs")),
        &Silent,
    );
    let again = again.unwrap();
    assert!((value(&again, "time-arc") - value(&slow, "time-arc")).abs() < 1e-6);
}

/// Where nobody says how the controller goes round corners, speeds slow the bead down all the same.
#[test]
fn without_the_controllers_motion_speeds_still_count() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "cell.toml", crate::dialects::cell("kuka-krl"));
    let slow = ran(dir.path(), OMEGA, "cell = \"cell.toml\"\n");
    let areas = sections(&slow);
    let near = |y: f64| {
        let found = areas
            .iter()
            .min_by(|a, b| (a.0 - y).abs().total_cmp(&(b.0 - y).abs()));
        found.unwrap().1
    };
    let ratio = near(0.0) / near(570.0);
    assert!((ratio / thicker(0.0) - 1.0).abs() < 0.01, "{ratio}");
    says(
        &check(&slow.verdict, "joint-speed").reason,
        &["1.47 times the metal"],
    );
    let hasty = check(&slow.verdict, "joint-acceleration");
    assert_eq!(hasty.status, Status::NotChecked);
}
