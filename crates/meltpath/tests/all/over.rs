//! The robot along its real motion, through jobs: axes that are too weak, travels that axes make longer, ways that change in the air.

use std::path::{Path, PathBuf};

use crate::support::{check, part, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::run;
use meltpath_base::{Fact, Silent, Status, Verdict};
use meltpath_data::robots;
use meltpath_geometry::Region;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::shapes::{extrude, plate};

/// The ARC Mate as if it had been measured, with a table behind it and lines more in `[joints]`; something behind its second axis keeps it
/// from going over its own head.
fn robot(folder: &Path, joints: &str) {
    let text = robots::FANUC_ARCMATE_120IC.text;
    let (arm, around) = text.split_once("\n[torch]").unwrap();
    let (arm, _) = arm.split_once("\n# A table that tilts").unwrap();
    let lows = "low = [\"-170 deg\", \"-100 deg\"";
    assert!(arm.contains(lows));
    let arm = arm.replace(lows, "low = [\"-170 deg\", \"-10 deg\"");
    let around = around.replace("[shapes]", "[shapes]\nsource = \"measured\"\n#");
    let table = "[table]\nsource = \"measured\"\nposition = [\"-1000 mm\", \"0 mm\", \"500 mm\"]\n";
    let text = format!("{arm}{joints}\n[torch]\nsource = \"measured\"\n{around}\n{table}");
    write(folder, "robot.toml", text);
}

/// Walls of 100 mm along x at some y.
fn walls(folder: &Path, at: &[f64]) {
    let regions: Vec<Region> = at
        .iter()
        .map(|y| Region {
            outer: plate(100.0, 6.0)
                .outer
                .iter()
                .map(|p| *p + DVec2::new(-50.0, y - 3.0))
                .collect(),
            holes: Vec::new(),
        })
        .collect();
    part(folder, "walls.stl", &extrude(&regions, 6.0));
}

fn judged(folder: &Path, at: &[f64], joints: &str) -> (Verdict, PathBuf) {
    robot(folder, joints);
    walls(folder, at);
    let text = "part = \"walls.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
        [layers]\ncount = 1\n[fill]\nstrategy = \"raster\"\n[machine]\nrobot = \"robot.toml\"\n[simulation]\ncell = \"2 mm\"\n";
    let job = write(folder, "job.toml", text);
    let outcome = run(&job, NextIn(&folder.join("runs")), &Silent).unwrap();
    (outcome.verdict, outcome.folder)
}

fn fact<'a>(verdict: &'a Verdict, id: &str) -> Option<&'a Fact> {
    verdict.facts.iter().find(|f| f.id == id)
}

/// Two walls behind the robot, one on each side of where its first joint ends: no way holds both. The arm goes over between them by a joint move,
/// the program says the other way, and the verdict tells why.
#[test]
fn two_sides_that_no_way_holds_are_built_with_a_change_in_the_air() {
    let dir = tempfile::tempdir().unwrap();
    let (verdict, folder) = judged(dir.path(), &[-350.0, 350.0], "");
    for id in ["reach", "joint-speed", "collision", "config"] {
        let check = check(&verdict, id);
        println!("{id}: {} {}", check.line(), check.reason);
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    let told = fact(&verdict, "way-changes").unwrap();
    println!("{}", told.reason);
    assert!(told.value.as_ref().unwrap().value >= 1.0);
    assert!(told.place.is_some() && told.reason.contains("as no way from before leads past"));
    // the first move, and one where the arm goes over, at rest at both its ends
    let files = std::fs::read_dir(folder.join("program")).unwrap();
    let path = files.map(|f| f.unwrap().path()).next().unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let moves: Vec<&str> = text
        .lines()
        .filter(|l| l.contains(" P[") && l.contains(':'))
        .collect();
    let joint = |l: &&&str| l.contains(":J P[");
    assert!(moves.iter().filter(joint).count() >= 2, "{moves:#?}");
    let over = moves.iter().rposition(|l| joint(&l)).unwrap();
    assert!(
        moves[over].contains("FINE") && moves[over - 1].contains("FINE"),
        "{moves:#?}"
    );
    // the joints end where one way does and begin where the other does
    let csv = std::fs::read_to_string(folder.join("series/joints.csv")).unwrap();
    let first: Vec<f64> = csv
        .lines()
        .skip(1)
        .map(|l| l.split(',').nth(4).unwrap().parse().unwrap())
        .collect();
    let least = first.iter().copied().fold(f64::INFINITY, f64::min);
    let most = first.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!(least < -140.0 && most > 140.0, "{least} {most}");
    // the first joint turns by 310 degrees or more at 195 deg/s: the travel takes as long as that
    let slow = fact(&verdict, "joint-moves").unwrap();
    println!("{}", slow.reason);
    assert!(slow.reason.contains("joint 1 the slowest"), "{slow:?}");
    assert!(fact(&verdict, "travel-axes").is_none());
}

/// One wall alone needs no change, and says none.
#[test]
fn one_side_is_built_by_one_way() {
    let dir = tempfile::tempdir().unwrap();
    let (verdict, _) = judged(dir.path(), &[350.0], "");
    assert_eq!(check(&verdict, "reach").status, Status::Pass);
    assert!(fact(&verdict, "way-changes").is_none());
    // without a figure nothing passes, and the line says where to write it
    let hasty = check(&verdict, "joint-acceleration");
    assert_eq!(hasty.status, Status::NotChecked, "{hasty:?}");
    assert!(
        hasty.reason.contains("acceleration in its [joints]"),
        "{hasty:?}"
    );
}

/// Accelerations that the file tells are judged; where they are too little the line says what bead follows, and travels take longer.
#[test]
fn weak_axes_fail_with_the_bead_that_follows() {
    let dir = tempfile::tempdir().unwrap();
    let with = |each: &str| {
        let six = vec![format!("\"{each}\""); 6].join(", ");
        judged(dir.path(), &[350.0], &format!("acceleration = [{six}]\n")).0
    };
    let strong = with("500 deg/s²");
    let passed = check(&strong, "joint-acceleration");
    println!("{}", passed.line());
    assert_eq!(passed.status, Status::Pass, "{passed:?}");
    let weak = with("1 deg/s²");
    let failed = check(&weak, "joint-acceleration");
    println!("{} {}", failed.line(), failed.reason);
    assert_eq!(failed.status, Status::Fail, "{failed:?}");
    for words in [
        "times the metal per length",
        "m/min there",
        "mm of beads an axis cannot follow",
    ] {
        assert!(failed.reason.contains(words), "{words}: {failed:?}");
    }
    assert!(failed.place.as_ref().unwrap().bead.is_some());
    let time = |v: &Verdict| {
        fact(v, "time-travel")
            .unwrap()
            .value
            .as_ref()
            .unwrap()
            .value
    };
    assert!(
        time(&weak) > time(&strong) + 0.05,
        "{} {}",
        time(&weak),
        time(&strong)
    );
    assert!(fact(&weak, "travel-axes").is_some());
}

/// The moments that decide stand as pictures in the folder, and in a table of the report.
#[test]
fn key_moments_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let (_, folder) = judged(dir.path(), &[350.0], "");
    let report = std::fs::read_to_string(folder.join("report.html")).unwrap();
    for name in [
        "clearance",
        "joint-limit",
        "axis-speed",
        "singularity",
        "end",
    ] {
        let file = format!("pictures/{name}.png");
        assert!(report.contains(&file), "{file}");
        let bytes = std::fs::read(folder.join(&file)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{file}");
        let side = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
        assert!(side(16) >= 1000 && side(20) >= 600, "{file}");
        // something is drawn: one colour alone takes a few kilobytes
        assert!(bytes.len() > 20_000, "{file}: {}", bytes.len());
    }
}

/// A body of the part that hangs free over the plate, with heights between that have no section at all: planned, simulated and not decided about.
#[test]
fn a_body_that_hangs_free_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let mut mesh = extrude(&[plate(30.0, 20.0)], 6.0);
    let above = extrude(&[plate(20.0, 20.0)], 4.0);
    let first = mesh.vertices.len() as u32;
    let lift = DVec3::new(60.0, 0.0, 16.0);
    mesh.vertices
        .extend(above.vertices.iter().map(|v| *v + lift));
    let triangles = above.triangles.iter().map(|t| t.map(|i| i + first));
    mesh.triangles.extend(triangles);
    part(dir.path(), "bodies.stl", &mesh);
    let text = "part = \"bodies.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
        [fill]\nstrategy = \"hybrid\"\n[simulation]\ncell = \"2 mm\"\n";
    let job = write(dir.path(), "job.toml", text);
    let verdict = run(&job, NextIn(&dir.path().join("runs")), &Silent)
        .unwrap()
        .verdict;
    assert_eq!(check(&verdict, "overhang").status, Status::Fail);
    let lack = check(&verdict, "lack");
    assert_eq!(lack.status, Status::CannotSay, "{lack:?}");
    assert!(lack.reason.contains("holds nothing that hangs"), "{lack:?}");
}
