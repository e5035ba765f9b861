//! Jobs whose torch leans: what decides how far it may.

use crate::support::{check, says, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::run;
use meltpath_base::{Silent, Status};
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
