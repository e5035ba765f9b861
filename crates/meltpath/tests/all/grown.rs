//! Heights of layers against the growth of the simulated deposit.

use std::fs;
use std::path::Path;

use meltpath::outcome::RunFolder::At;
use meltpath::waam;
use meltpath_base::{Check, Silent, Status, Verdict};
use meltpath_geometry::shapes;

use crate::support::{check, part, write};

/// Wire, gas and mode, wire feed and travel speed in m/min.
type Process = ([&'static str; 3], [f64; 2]);

const X90: Process = (["x90-ig-1.0", "m14", "cmt"], [8.0, 1.0]);
const STEEL: Process = (["er70s-6-0.9", "m21", "cmt"], [5.0, 0.5]);
const ALUMINIUM: Process = (["er4043-1.2", "i1", "cmt"], [4.5, 0.5]);

/// Runs a block of a length, a thickness and a height, mm; its planned and its simulated tops, layer by layer.
fn block(
    ([wire, gas, mode], [feed, travel]): Process,
    size: [f64; 3],
    (layers, more): (&str, &str),
    folder: &Path,
) -> (Verdict, Vec<[f64; 2]>) {
    let [length, thickness, height] = size;
    let mesh = shapes::extrude(&[shapes::plate(length, thickness)], height);
    part(folder, "block.stl", &mesh);
    let job = write(
        folder,
        "job.toml",
        format!(
            "part = \"block.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"{wire}\"\ngas = \"{gas}\"\nmode = \"{mode}\"\n\
             [waam.bead]\nwire_feed = \"{feed} m/min\"\ntravel_speed = \"{travel} m/min\"\n[layers]\nheight = {layers}\n{more}"
        ),
    );
    let out = folder.join("out");
    let _ = fs::remove_dir_all(&out);
    let verdict = waam::run(&job, At(&out), &Silent).unwrap().verdict;
    let table = fs::read_to_string(out.join("series/layers.csv")).unwrap();
    let tops = |line: &str| {
        let mut cells = line.split(',').skip(2).map(|c| c.parse().unwrap());
        [(); 2].map(|()| cells.next().unwrap())
    };
    (verdict, table.lines().skip(1).map(tops).collect())
}

/// Narrow blocks of a few beads: the torch waits at their corners and cuts across them, so they grow up to 28 % more than straight beads would.
#[test]
fn layers_of_narrow_blocks_are_as_high_as_they_grow() {
    let folder = tempfile::tempdir().unwrap();
    for (process, sizes) in [
        (
            X90,
            [[14.0, 12.0], [20.0, 20.0], [40.0, 12.0], [40.0, 20.0]],
        ),
        (
            STEEL,
            [[14.0, 12.0], [25.0, 25.0], [40.0, 16.0], [60.0, 15.0]],
        ),
        (
            ALUMINIUM,
            [[20.0, 20.0], [25.0, 25.0], [40.0, 16.0], [60.0, 15.0]],
        ),
    ] {
        for [length, thickness] in sizes {
            let size = [length, thickness, 24.0];
            let (_, tops) = block(process, size, ("\"auto\"", ""), folder.path());
            // the last layer ends at the part's top
            let (first, last) = (tops[0], tops[tops.len() - 2]);
            let [planned, grown] = [0, 1].map(|k| last[k] - first[k]);
            let ratio = grown / planned;
            println!("{:?} {length} x {thickness}: {ratio:.3}", process.0);
            assert!((ratio - 1.0).abs() < 0.04, "{process:?} {size:?}: {ratio}");
        }
    }
}

/// The height that a check's remedy says to write.
fn named(check: &Check) -> &str {
    let remedy = check.remedy.as_ref().unwrap();
    let after = remedy.split("layers.height = \"").nth(1);
    after.and_then(|text| text.split('"').next()).unwrap()
}

/// What a plan would choose otherwise: the same beads are laid at both heights.
const KEPT: &str = "[fill]\nstrategy = \"hybrid\"\nspacing = \"adjust\"\nreversal = \"28 %\"\n[target]\nallowance = \"2 mm\"\n";

/// Written heights that are no growth: the remedies name it, and with it the checks pass.
#[test]
fn the_height_that_a_remedy_names_is_that_of_the_build() {
    let folder = tempfile::tempdir().unwrap();
    let size = [60.0, 15.0, 24.0];
    for (process, wrong) in [(X90, "1.2 mm"), (STEEL, "1.1 mm"), (ALUMINIUM, "3.2 mm")] {
        let run = |height: &str| {
            let height = format!("\"{height}\"");
            block(process, size, (&height, KEPT), folder.path()).0
        };
        let bad = run(wrong);
        let failing = |verdict: &Verdict| {
            let checks = verdict.checks.iter();
            let by_it = checks.filter(|c| ["height", "ctwd-min", "ctwd-max"].contains(&&*c.id));
            by_it
                .filter(|c| c.status != Status::Pass)
                .cloned()
                .collect::<Vec<Check>>()
        };
        let told = failing(&bad);
        let height = named(check(&bad, "height")).to_owned();
        assert!(told.len() > 1 && told.iter().all(|c| c.id == "height" || c.remedy.is_some()));
        let good = run(&height);
        let off = |verdict: &Verdict| check(verdict, "height").value.as_ref().unwrap().value;
        println!(
            "{process:?}: {wrong} {:.1} mm off, {height} {:.1} mm",
            off(&bad),
            off(&good)
        );
        assert!(off(&good) < 0.3 * off(&bad), "{} {}", off(&good), off(&bad));
        let left = failing(&good);
        assert!(left.iter().all(|c| c.status != Status::Fail), "{left:?}");
    }
}
