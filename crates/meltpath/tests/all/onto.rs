//! Jobs that build onto a body: a boss on a tube, a pad on a plate, and what is refused.

use std::path::{Path, PathBuf};

use crate::support::{self, check, refusal, says, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::run;
use meltpath_base::{Silent, Status, Verdict};
use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

fn job(folder: &Path, part: &Mesh, body: &Mesh, more: &str) -> PathBuf {
    support::part(folder, "part.stl", part);
    support::part(folder, "body.stl", body);
    let text = format!(
        "part = \"part.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [waam.bead]\nheight = \"2 mm\"\n[onto]\nbody = \"body.stl\"\n{more}"
    );
    write(folder, "job.toml", text)
}

fn verdict(job: &Path) -> Verdict {
    run(job, NextIn(&job.with_file_name("runs")), &Silent)
        .unwrap()
        .verdict
}

fn fact(verdict: &Verdict, id: &str) -> f64 {
    let found = verdict.facts.iter().find(|f| f.id == id).unwrap();
    found.value.as_ref().unwrap().value
}

fn cuboid(low: [f64; 3], high: [f64; 3]) -> Mesh {
    shapes::cuboid(DVec3::from_array(low), DVec3::from_array(high))
}

/// A tube of 40, 90 high, and on its side a pad 40 x 30 that ends 8 mm from it.
#[test]
fn a_pad_on_a_tube_covers_its_part() {
    let dir = tempfile::tempdir().unwrap();
    let tube = shapes::cone(40.0, 40.0, 90.0);
    let pad = cuboid([30.0, -20.0, 30.0], [48.0, 20.0, 60.0]);
    let verdict = verdict(&job(dir.path(), &pad, &tube, ""));
    let of = |id: &str| check(&verdict, id);
    for id in ["lack", "stock", "spacing", "loose", "ctwd-min", "program"] {
        assert_eq!(of(id).status, Status::Pass, "{id}: {:?}", of(id));
    }
    // the torch stands out of a tube that stands upright
    assert!((of("tilt").value.as_ref().unwrap().value - 90.0).abs() < 1.0);
    // the tube unrolls; voxels keep what was fed
    assert!(of("spacing").value.as_ref().unwrap().value < 1.0);
    let balance = verdict.facts.iter().find(|f| f.id == "metal").unwrap();
    let numbers: Vec<f64> = balance
        .reason
        .split_whitespace()
        .filter_map(|w| w.parse().ok())
        .collect();
    assert!(
        (numbers[1] / numbers[2] - 1.0).abs() < 1e-6,
        "{}",
        balance.reason
    );
    assert!(fact(&verdict, "layers") >= 4.0);
}

#[test]
fn a_layer_too_few_lacks_metal() {
    let dir = tempfile::tempdir().unwrap();
    let plate = cuboid([0.0; 3], [90.0, 70.0, 10.0]);
    let pad = cuboid([20.0, 15.0, 5.0], [70.0, 55.0, 18.0]);
    let one = verdict(&job(dir.path(), &pad, &plate, "[layers]\ncount = 2\n"));
    let lack = check(&one, "lack");
    assert_eq!(lack.status, Status::Fail, "{lack:?}");
    // two layers of some 2 mm of 8
    let share = lack.value.as_ref().unwrap().value;
    assert!((30.0..65.0).contains(&share), "{share}");
    assert!(check(&one, "stock").value.as_ref().unwrap().value < -3.0);
}

/// The same layers in a height map and in voxels: one measure of how flat they are, all over the layer once it is whole.
#[test]
fn layers_on_a_plate_are_as_flat_as_flat_layers() {
    let dir = tempfile::tempdir().unwrap();
    let plate = cuboid([0.0; 3], [100.0, 80.0, 10.0]);
    let pad = cuboid([22.0, 18.0, 10.0], [78.0, 62.0, 22.0]);
    let more = "[layers]\ncount = 3\n";
    let onto = job(dir.path(), &pad, &plate, more);
    let text = std::fs::read_to_string(&onto).unwrap();
    let flat = text.replace("[onto]\nbody = \"body.stl\"\n", "");
    let flat = write(dir.path(), "flat.toml", flat);
    let of = |job: &Path| {
        let verdict = verdict(job);
        let value = check(&verdict, "flatness").value.clone().unwrap();
        (value.value, fact(&verdict, "arc-starts"))
    };
    let (flat, onto) = (of(&flat), of(&onto));
    assert_eq!(flat.1, onto.1, "other beads");
    // along bead axes as each froze it would be twice that
    assert!(
        flat.0 > 0.3 && (onto.0 / flat.0 - 1.0).abs() < 0.15,
        "{flat:?} {onto:?}"
    );
}

#[test]
fn bodies_that_do_not_fit_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let plate = cuboid([0.0; 3], [90.0, 70.0, 10.0]);
    let apart = job(
        dir.path(),
        &cuboid([20.0, 15.0, 15.0], [70.0, 55.0, 18.0]),
        &plate,
        "",
    );
    says(
        &refusal(&apart),
        &["does not touch the body", "5.000 mm away"],
    );
    // told before anything is planned
    let more = "[output]\nprograms = [\"fanuc-ls\", \"kuka-krl\"]\n";
    let wordless = job(
        dir.path(),
        &cuboid([20.0, 15.0, 15.0], [70.0, 55.0, 18.0]),
        &plate,
        more,
    );
    says(&refusal(&wordless), &["ArcTech", "program.krl"]);
    let nothing = job(
        dir.path(),
        &cuboid([20.0, 15.0, 5.0], [70.0, 55.0, 10.2]),
        &plate,
        "",
    );
    says(&refusal(&nothing), &["nothing to lay"]);
    let both = "[surface]\n";
    let both = job(dir.path(), &plate, &plate, both);
    says(&refusal(&both), &["[surface] and [onto]"]);
    let missing = job(dir.path(), &plate, &plate, "");
    std::fs::remove_file(dir.path().join("body.stl")).unwrap();
    says(&refusal(&missing), &["cannot open the body"]);
    // two shells through each other
    let mut crossed = plate.clone();
    let other = cuboid([10.0, 10.0, -5.0], [20.0, 20.0, 20.0]);
    let shift = crossed.vertices.len() as u32;
    crossed.vertices.extend(other.vertices);
    crossed
        .triangles
        .extend(other.triangles.iter().map(|t| t.map(|v| v + shift)));
    let crossed = job(
        dir.path(),
        &cuboid([30.0, 15.0, 5.0], [70.0, 55.0, 18.0]),
        &crossed,
        "",
    );
    says(&refusal(&crossed), &["cross each other", "unite them"]);
}
