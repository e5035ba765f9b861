//! Programs of others whose beads hang out, or lie far beside each other: what the map of heights does not hold, and what no fusion is
//! simulated for, is not decided about.

use std::path::{Path, PathBuf};

use crate::foreign::{job, posed};
use crate::support::check;
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::simulate_program;
use meltpath_base::{Silent, Status, Verdict};

/// A program of straight beads, from and to, mm.
fn beads(folder: &Path, beads: &[[[f64; 3]; 2]]) -> PathBuf {
    let mut lines = vec!["UFRAME_NUM=1".to_owned(), "UTOOL_NUM=1".to_owned()];
    let mut places = Vec::new();
    for [from, to] in beads {
        let n = places.len() + 1;
        let above = [to[0], to[1], to[2] + 40.0];
        places.extend([*from, *to, above].map(|[x, y, z]| [x, y, z, 180.0, 0.0, 0.0]));
        lines.push(format!("L P[{n}] 20mm/sec FINE Arc Start[7]"));
        lines.push(format!("L P[{}] WELD_SPEED FINE Arc End[7]", n + 1));
        lines.push(format!("L P[{}] 100mm/sec FINE", n + 2));
    }
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    posed(folder, &lines, &places)
}

fn simulated(folder: &Path, program: &Path, job: &Path) -> Verdict {
    let runs = NextIn(&folder.join("runs"));
    simulate_program(program, Some(job), runs, &Silent)
        .unwrap()
        .verdict
}

/// Layers of so many parallel beads `apart` mm, to and fro.
fn layers(count: u32, across: u32, apart: f64, step: [f64; 2]) -> Vec<[[f64; 3]; 2]> {
    let mut all = Vec::new();
    for layer in 0..count {
        let [lean, z] = step.map(|by| by * f64::from(layer));
        for bead in 0..across {
            let y = f64::from(bead) * apart + lean;
            let ends = [[0.0, y, z], [60.0, y, z]];
            let is_back = (layer + bead) % 2 == 1;
            all.push(if is_back { [ends[1], ends[0]] } else { ends });
        }
    }
    all
}

/// A wall that leans by 6° hangs out by a quarter of its width from some layer on, though each layer moves but a fortieth of it.
#[test]
fn a_wall_that_hangs_out_over_its_foot_is_not_decided() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let decided = |lean: f64| {
        let program = beads(dir.path(), &layers(16, 1, 0.0, [lean, 1.7]));
        let verdict = simulated(dir.path(), &program, &job);
        check(&verdict, "flatness").clone()
    };
    let leans = decided(0.18);
    assert_eq!(leans.status, Status::CannotSay, "{leans:?}");
    assert!(leans.reason.contains("hang out"), "{leans:?}");
    let upright = decided(0.0);
    assert!(!upright.reason.contains("hang out"), "{upright:?}");
}

/// Valleys between beads count where a layer's plan is unknown, too: nothing but the distance of the beads differs.
#[test]
fn valleys_between_beads_of_a_program_count() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let flatness = |apart: f64| {
        let program = beads(dir.path(), &layers(3, 8, apart, [0.0, 2.4]));
        let verdict = simulated(dir.path(), &program, &job);
        check(&verdict, "flatness").value.as_ref().unwrap().value
    };
    let (near, far) = (flatness(4.8), flatness(7.5));
    assert!(near < 1.5 && far > 4.0, "{near} {far}");
}

/// Flat beads that touch at their toes are not taken to fuse; nearer ones, and tall ones as far apart, are.
#[test]
fn flat_beads_far_beside_each_other_are_not_decided() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let cell = dir.path().join("cell.toml");
    let tall = std::fs::read_to_string(&cell).unwrap();
    let flat = tall.replace("wire_feed = \"8 m/min\"", "wire_feed = \"4 m/min\"");
    assert_ne!(tall, flat);
    let feet = |cell_text: &str, apart: f64| {
        std::fs::write(&cell, cell_text).unwrap();
        let program = beads(dir.path(), &layers(2, 4, apart, [0.0, 1.4]));
        let verdict = simulated(dir.path(), &program, &job);
        verdict.checks.into_iter().find(|c| c.id == "feet")
    };
    let found = feet(&flat, 4.7).unwrap();
    assert_eq!(found.status, Status::CannotSay, "{found:?}");
    assert!(found.value.as_ref().unwrap().value > 90.0, "{found:?}");
    assert!(found.reason.contains("5.3"), "{found:?}");
    assert!(feet(&flat, 3.2).is_none());
    assert!(feet(&tall, 6.4).is_none());
}
