//! Jobs whose torch leans: what decides how far it may.

use std::path::Path;

use crate::support::{check, says, thin_wall, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Check, Silent, Status, Verdict};
use meltpath_data::{find, process_maps};
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

const SEEN: &str = "source = \"own beads\"\npage = \"3\"\n";
const JOB: &str = "part = \"sheet.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\nmap = \"map.toml\"\n\
    [layers]\nheight = \"2 mm\"\n[surface]\ntorch = \"tangent\"\n";

/// Tilt is judged by what the process map saw of pools as large, with its source; where they were smaller nothing is said.
#[test]
fn a_tilt_is_judged_by_pools_that_were_seen() {
    let seed = find(process_maps::ALL, "x90-ig-1.0-cmt-m14").unwrap().text;
    let wall = shapes::sheet(10, 20, |_, _| false, |i, k| DVec3::new(i, 2.0 * k, 2.0 * i));
    let judged = |rows: &str| {
        let dir = tempfile::tempdir().unwrap();
        let mut bytes = Vec::new();
        write_stl(&wall, "sheet", &mut bytes).unwrap();
        write(dir.path(), "sheet.stl", bytes);
        write(
            dir.path(),
            "map.toml",
            format!("{seed}\n[tilt]\nrows = {rows}\n{SEEN}"),
        );
        let job = write(dir.path(), "job.toml", JOB);
        let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
        check(&outcome.verdict, "tilt").clone()
    };
    // the wall leans by atan(1/2)
    let lean = 0.5_f64.atan().to_degrees();
    for (rows, status, words) in [
        (
            "[[100.0, 30.0]]",
            Status::Pass,
            "were seen to stay so far: own beads, 3",
        ),
        ("[[100.0, 20.0], [1.0, 90.0]]", Status::Fail, "own beads"),
        (
            "[[1.0, 90.0]]",
            Status::CannotSay,
            "pools of 1.0 mm² at most were seen to stay",
        ),
    ] {
        let tilt = judged(rows);
        assert_eq!(tilt.status, status, "{tilt:?}");
        assert!(
            (tilt.value.as_ref().unwrap().value - lean).abs() < 0.1,
            "{tilt:?}"
        );
        says(&tilt.reason, &[words]);
    }
}

/// A torch that stands upright leans no farther than on the beads that were measured: it passes without a limit of anyone.
#[test]
fn an_upright_wall_needs_no_limit_of_its_lean() {
    let dir = tempfile::tempdir().unwrap();
    let wall = shapes::sheet(10, 20, |_, _| false, |i, k| DVec3::new(2.0 * k, 0.0, i));
    let mut bytes = Vec::new();
    write_stl(&wall, "sheet", &mut bytes).unwrap();
    write(dir.path(), "sheet.stl", bytes);
    let job = write(
        dir.path(),
        "job.toml",
        JOB.replace("map = \"map.toml\"\n", ""),
    );
    let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let tilt = check(&outcome.verdict, "tilt");
    assert_eq!(tilt.status, Status::Pass, "{tilt:?}");
    says(&tilt.reason, &["as level as the beads that were measured"]);
}

fn value(check: &Check) -> f64 {
    check.value.as_ref().unwrap().value
}

fn simulated(program: &Path, job: &Path) -> Verdict {
    let runs = job.with_file_name("again");
    simulate_program(program, Some(job), NextIn(&runs), &Silent)
        .unwrap()
        .verdict
}

/// The torch of a program leans as it says, not as the table lies: the run's own lean of a wall that leans by atan(1/2).
#[test]
fn a_simulated_wall_leans_as_in_its_run() {
    let dir = tempfile::tempdir().unwrap();
    let wall = shapes::sheet(10, 20, |_, _| false, |i, k| DVec3::new(i, 2.0 * k, 2.0 * i));
    let mut bytes = Vec::new();
    write_stl(&wall, "sheet", &mut bytes).unwrap();
    write(dir.path(), "sheet.stl", bytes);
    let text = JOB.replace("map = \"map.toml\"\n", "") + "[checks]\ntilt = \"10 deg\"\n";
    let job = write(dir.path(), "job.toml", text);
    let ran = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let again = simulated(&ran.folder.join("program"), &job);
    let [ran, again] = [&ran.verdict, &again].map(|v| check(v, "tilt"));
    assert_eq!(ran.status, Status::Fail, "{ran:?}");
    assert_eq!(again.status, Status::Fail, "{again:?}");
    assert!(
        (value(ran) - value(again)).abs() < 0.02,
        "{ran:?} {again:?}"
    );
}

/// A flat program whose torch is turned: its lean is judged, and the checks of the metal tell it.
#[test]
fn a_turned_torch_of_flat_layers_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let job = thin_wall(
        dir.path(),
        "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 2\n[simulation]\ncell = \"1 mm\"\n\
         [checks]\ntilt = \"5 deg\"\n",
    );
    let ran = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let mut files = std::fs::read_dir(ran.folder.join("program")).unwrap();
    let file = files.next().unwrap().unwrap().path();
    let text = std::fs::read_to_string(&file).unwrap();
    let upright = simulated(&file, &job);
    let tilt = check(&upright, "tilt");
    assert!(
        tilt.status == Status::Pass && value(tilt) < 0.01,
        "{tilt:?}"
    );
    let height = check(&upright, "height");
    assert!(!height.reason.contains("upright"), "{height:?}");
    let turned = text.replace("180.000 deg", "172.000 deg");
    assert_ne!(text, turned);
    let turned = simulated(&write(dir.path(), "TURNED.LS", turned), &job);
    let tilt = check(&turned, "tilt");
    assert_eq!(tilt.status, Status::Fail, "{tilt:?}");
    assert!((value(tilt) - 8.0).abs() < 0.01, "{tilt:?}");
    says(
        &check(&turned, "height").reason,
        &[
            "as by a torch upright on its layers",
            "leans by up to 8.0 deg",
        ],
    );
}
