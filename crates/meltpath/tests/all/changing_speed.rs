//! A bead whose travel speed changes in steps, through a program of other software: its sizes follow the process map, however fine the steps.

use std::collections::BTreeMap;
use std::path::Path;

use crate::foreign::{job, posed};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::simulate_program;
use meltpath_base::{Reporter, Silent};
use meltpath_deposition::process_map::ProcessMap;
use meltpath_geometry::io::stl::read_stl;

const M_PER_MIN: f64 = 1e3 / 60.0;
/// Speeds at the ends, m/min, and where they change, mm.
const SPEEDS: [f64; 2] = [0.3, 1.5];
const CHANGES: [f64; 2] = [20.0, 170.0];
const LENGTH: f64 = 190.0;
/// How far behind the wire tip the metal comes to lie, mm.
const BEHIND: f64 = 5.0;

/// Speed that the steps are steps of, m/min.
fn speed(x: f64) -> f64 {
    let share = ((x - CHANGES[0]) / (CHANGES[1] - CHANGES[0])).clamp(0.0, 1.0);
    SPEEDS[0] + (SPEEDS[1] - SPEEDS[0]) * share
}

/// Height of the crest and area of the section, mm and mm², each millimetre along the bead.
fn sizes(folder: &Path, step: f64) -> Vec<[f64; 3]> {
    let count = ((CHANGES[1] - CHANGES[0]) / step) as usize;
    let ends = (0..=count).map(|k| CHANGES[0] + step * k as f64);
    let mut lines = vec![
        "UFRAME_NUM=1".to_owned(),
        "UTOOL_NUM=1".to_owned(),
        "J P[1] 20% FINE".to_owned(),
        "L P[2] 20mm/sec FINE Arc Start[7]".to_owned(),
    ];
    let pose = |x: f64, z: f64| [x, 0.0, z, 180.0, 0.0, 0.0];
    let mut places = vec![pose(0.0, 60.0), pose(0.0, 0.0)];
    let mut from = 0.0;
    for to in ends.chain([LENGTH]) {
        let set = speed(0.5 * (from + to)) * M_PER_MIN;
        places.push(pose(to, 0.0));
        let (n, last) = (places.len(), to == LENGTH);
        let end = if last { "FINE Arc End[7]" } else { "CNT100" };
        lines.push(format!("L P[{n}] {set:.4}mm/sec {end}"));
        from = to;
    }
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let program = posed(folder, &lines, &places);
    let runs = folder.join("runs");
    let outcome = simulate_program(&program, Some(&job(folder)), NextIn(&runs), &Silent).unwrap();
    let bytes = std::fs::read(outcome.folder.join("as-built.stl")).unwrap();
    let mesh = read_stl(&bytes[..], None, &Reporter::new(), &Silent)
        .unwrap()
        .mesh;
    // cells of 1 mm: heights of a row of cells across the bead sum to its area
    let key = |v: f64| (v * 100.0).round() as i64;
    let mut rows: BTreeMap<i64, BTreeMap<i64, f64>> = BTreeMap::new();
    for v in &mesh.vertices {
        let top = rows
            .entry(key(v.x))
            .or_default()
            .entry(key(v.y))
            .or_default();
        *top = top.max(v.z);
    }
    let row = |(x, row): (&i64, &BTreeMap<i64, f64>)| {
        let crest = row.values().copied().fold(0.0, f64::max);
        [*x as f64 / 100.0, crest, row.values().sum()]
    };
    rows.iter().map(row).collect()
}

#[test]
fn waam_ac10_beads_of_changing_speed_follow_the_map() {
    let dir = tempfile::tempdir().unwrap();
    let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
    let [coarse, middle, fine] = [10.0, 5.0, 1.0].map(|step| sizes(dir.path(), step));
    // the start and the end of the bead, where its pool still grows and where the robot stops, are no part of it
    let inner = |x: f64| (60.0..178.0).contains(&x);
    let mut seen = 0;
    for ((coarse, middle), fine) in coarse.iter().zip(&middle).zip(&fine) {
        let [x, crest, area] = *fine;
        if !inner(x) {
            continue;
        }
        seen += 1;
        for other in [coarse, middle] {
            assert_eq!(x, other[0]);
            for k in 1..3 {
                assert!((other[k] / fine[k] - 1.0).abs() < 0.03, "{x}: {other:?}");
            }
        }
        let bead = map.bead(8.0 * M_PER_MIN, speed(x - BEHIND) * M_PER_MIN);
        let [height, section] = [bead.height.value, bead.area.value];
        assert!((crest / height - 1.0).abs() < 0.03, "{x}: {crest} {height}");
        assert!((area / section - 1.0).abs() < 0.03, "{x}: {area} {section}");
        // of the source's parabola; the bead is as wide as its section needs
        let width = 1.5 * area / crest;
        assert!(
            (width / bead.width.value - 1.0).abs() < 0.05,
            "{x}: {width}"
        );
    }
    assert!(seen > 115);
}
