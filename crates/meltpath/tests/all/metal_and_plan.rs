//! Metal that is not as the plan takes it to be: travels through it, beads that hold another section than is fed, cells that are too coarse.

use std::fmt::Write as _;
use std::path::Path;

use crate::support::{check, part, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::run;
use meltpath_base::{Check, Silent, Status, Verdict};
use meltpath_data::cells;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes::cuboid;

/// A block of 30 x 20 x 8 mm, with lines of the job's tables.
fn verdict(clearance: &str, waam: &str, tables: &str) -> Verdict {
    let dir = tempfile::tempdir().unwrap();
    let folder: &Path = dir.path();
    let block = cuboid(DVec3::ZERO, DVec3::new(30.0, 20.0, 8.0));
    part(folder, "block.stl", &block);
    let cell = cells::ARCMATE_120IC.text;
    let own = "clearance = \"20 mm\"";
    assert!(cell.contains(own));
    let cell = cell.replace(own, &format!("clearance = \"{clearance}\""));
    write(folder, "cell.toml", cell);
    write(folder, "own.toml", table_of_beads());
    let text = format!(
        "part = \"block.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n{waam}\n\
         [waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[machine]\ncell = \"cell.toml\"\n{tables}"
    );
    let job = write(folder, "job.toml", text);
    let outcome = run(&job, NextIn(&folder.join("runs")), &Silent).unwrap();
    outcome.verdict
}

fn value(check: &Check) -> f64 {
    check.value.as_ref().unwrap().value
}

const CELL: &str = "[simulation]\ncell = \"1 mm\"\n";

/// Layers planned at half their growth: the build grows out of the travels' height.
#[test]
fn travels_through_metal_fail() {
    let low = format!("[layers]\nheight = \"1 mm\"\n{CELL}");
    let through = verdict("1 mm", "", &low);
    let travels = check(&through, "travels");
    assert_eq!(travels.status, Status::Fail, "{travels:?}");
    assert!(value(travels) < -1.0, "{travels:?}");
    let over = verdict("20 mm", "", &low);
    let travels = check(&over, "travels");
    assert_eq!(travels.status, Status::Pass, "{travels:?}");
}

/// A table of nine beads that hold all of their wire.
fn table_of_beads() -> String {
    let mut rows = String::new();
    for feed in [6.0_f64, 8.0, 10.0] {
        for travel in [0.5_f64, 0.75, 1.0] {
            let area = 0.25 * std::f64::consts::PI * feed / travel;
            let width = 2.34 * feed.powf(0.446) * travel.powf(-0.345);
            let height = 1.5 * area / width;
            writeln!(rows, "[{feed}, {travel}, {width:.3}, {height:.3}],").unwrap();
        }
    }
    format!(
        "schema = 1\nid = \"own\"\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\nkind = \"best\"\n\
         efficiency = {{ value = 1.0, unit = \"1\", source = \"test\", page = \"-\" }}\n\
         feed_factor = {{ value = 1.0, unit = \"1\", uncertainty = 0.05, source = \"test\", page = \"-\" }}\n\
         [validity]\nwire_feed = [\"6 m/min\", \"10 m/min\"]\ntravel_speed = [\"0.5 m/min\", \"1 m/min\"]\nsource = \"test\"\npage = \"-\"\n\
         [beads]\nsource = \"test\"\npage = \"-\"\nrows = [\n{rows}]\n"
    )
}

/// Half of the metal stays, and width and height are those of all of it.
#[test]
fn a_bead_that_holds_other_metal_than_is_fed_decides_nothing() {
    let half = verdict("20 mm", "map = \"own.toml\"\nefficiency = \"50 %\"", CELL);
    let height = check(&half, "height");
    assert_eq!(height.status, Status::CannotSay, "{height:?}");
    assert!(height.reason.contains("metal fed"), "{height:?}");
}

#[test]
fn cells_coarse_beside_the_bead_decide_nothing() {
    let coarse = verdict("20 mm", "", "[simulation]\ncell = \"2 mm\"\n");
    let lack = check(&coarse, "lack");
    assert_eq!(lack.status, Status::CannotSay, "{lack:?}");
    assert!(lack.reason.contains("coarse"), "{lack:?}");
    let remedy = lack.remedy.as_deref().unwrap_or_default();
    assert!(remedy.contains("simulation.cell"), "{lack:?}");
}
