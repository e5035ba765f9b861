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
    // with the usual 2 mm the corners of the pad, where its metal is round, are bare by tenths of a millimetre or have as much
    let more = "[target]\nallowance = \"3 mm\"\n";
    let verdict = verdict(&job(dir.path(), &pad, &tube, more));
    let of = |id: &str| check(&verdict, id);
    for id in ["lack", "spacing", "loose", "ctwd-min", "program"] {
        assert_eq!(of(id).status, Status::Pass, "{id}: {:?}", of(id));
    }
    let stock = of("stock");
    assert!(
        matches!(stock.status, Status::Pass | Status::Warn),
        "{stock:?}"
    );
    assert!(stock.value.as_ref().unwrap().value > 0.3, "{stock:?}");
    // the torch stands out of a tube that stands upright
    assert!((of("tilt").value.as_ref().unwrap().value - 90.0).abs() < 1.0);
    // the tube unrolls; voxels keep what was fed
    assert!(of("spacing").value.as_ref().unwrap().value < 1.0);
    keeps_its_metal(&verdict);
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

/// A block on the plate whose top rises along x, so long and so wide.
fn wedge(low: f64, high: f64, [length, width]: [f64; 2]) -> Mesh {
    let mut block = cuboid([25.0, 20.0, 5.0], [25.0 + length, 20.0 + width, 12.0]);
    for p in block.vertices.iter_mut().filter(|p| p.z > 10.0) {
        p.z = 10.0 + low + (high - low) * (p.x - 25.0) / length;
    }
    block
}

fn thick_plate() -> Mesh {
    cuboid([0.0; 3], [110.0, 90.0, 10.0])
}

/// What was fed is in the voxels, to a millionth.
fn keeps_its_metal(verdict: &Verdict) {
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
}

/// The metal of layers that go to a top is as high as planned, within what is predicted.
fn as_high_as_planned(verdict: &Verdict) {
    let height = check(verdict, "height").value.clone().unwrap();
    assert!(height.value < height.sigma.unwrap(), "{height:?}");
}

/// 8 to 14 mm on a plate: all layers whole, the metal as high as the top where that is low and where it is high, by speeds in the program.
#[test]
fn layers_go_to_a_top_that_leans() {
    let dir = tempfile::tempdir().unwrap();
    let more =
        "top = \"auto\"\n[target]\nallowance = \"3 mm\"\n[output]\nprograms = [\"fanuc-ls\"]\n";
    let part = wedge(8.0, 14.0, [60.0, 50.0]);
    let job = job(dir.path(), &part, &thick_plate(), more);
    let out = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let verdict = &out.verdict;
    for id in [
        "thickness",
        "lack",
        "stock",
        "flatness",
        "ctwd-min",
        "program",
    ] {
        let check = check(verdict, id);
        assert_eq!(check.status, Status::Pass, "{id}: {check:?}");
    }
    keeps_its_metal(verdict);
    as_high_as_planned(verdict);
    let ratio = fact(verdict, "thickness-ratio");
    assert!((1.3..1.75).contains(&ratio), "{ratio}");
    // the program has them: from the thinnest to the thickest place in steps
    let mut speeds = Vec::new();
    for file in std::fs::read_dir(out.folder.join("program")).unwrap() {
        let text = std::fs::read_to_string(file.unwrap().path()).unwrap();
        let words = text.split_whitespace();
        let own = words.filter_map(|w| w.strip_suffix("cm/min"));
        speeds.extend(own.filter_map(|w| w.parse::<f64>().ok()));
    }
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    assert!(speeds.len() > 10, "{speeds:?}");
    let span = speeds.last().unwrap() / speeds.first().unwrap();
    assert!(span > ratio, "{span} {ratio}");
}

/// A face 10° askew on the side of a tube of 45.
#[test]
fn layers_go_from_a_tube_to_a_face_that_leans() {
    let dir = tempfile::tempdir().unwrap();
    let mut pad = cuboid([30.0, -22.0, 30.0], [57.0, 22.0, 75.0]);
    let lean = 10.0_f64.to_radians().tan();
    for p in pad.vertices.iter_mut().filter(|p| p.x > 40.0) {
        p.x += lean * (p.z - 52.5);
    }
    let tube = shapes::cone(45.0, 45.0, 110.0);
    let more = "top = \"auto\"\n[target]\nallowance = \"3 mm\"\n";
    let job = job(dir.path(), &pad, &tube, more);
    // a bead in the middle of its map can be laid thinner and thicker
    let text = std::fs::read_to_string(&job).unwrap();
    let middle = "wire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"";
    std::fs::write(&job, text.replace("height = \"2 mm\"", middle)).unwrap();
    let verdict = verdict(&job);
    for id in ["thickness", "lack", "spacing", "program"] {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::Pass, "{id}: {check:?}");
    }
    // how certain they are hangs on where voxels of two sizes see a rim
    for id in ["stock", "loose", "flatness", "accumulation"] {
        let check = check(&verdict, id);
        assert_ne!(check.status, Status::Fail, "{id}: {check:?}");
    }
    keeps_its_metal(&verdict);
    as_high_as_planned(&verdict);
}

/// Five times as much to lay at one end as at the other: what cannot be is said where, and the remedy is true.
#[test]
fn layers_thicker_than_beads_can_be_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let more = "top = \"auto\"\n[target]\nallowance_top = \"0 mm\"\n";
    let part = wedge(3.0, 24.0, [40.0, 30.0]);
    let job = job(dir.path(), &part, &thick_plate(), more);
    let verdict = verdict(&job);
    let thickness = check(&verdict, "thickness");
    assert_eq!(thickness.status, Status::Fail, "{thickness:?}");
    says(&thickness.reason, &["a ratio of", "m/min lay"]);
    let remedy = thickness.remedy.clone().unwrap_or_default();
    says(&remedy, &["leave onto.top out"]);
}

#[test]
fn tops_that_are_none_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let of = |part: &Mesh, top: &str| {
        let more = format!("top = {top}\n");
        refusal(&job(dir.path(), part, &thick_plate(), &more))
    };
    let part = wedge(8.0, 14.0, [60.0, 50.0]);
    says(&of(&part, "[2]"), &["no faces with numbers", "\"auto\""]);
    says(&of(&part, "[]"), &["names no face"]);
    // two steps, both of which look away
    let stepped = shapes::boss_on_plate((90.0, 70.0, 14.0), 15.0, 4.0, 12.0);
    says(
        &of(&stepped, "\"auto\""),
        &["above its top", "divide the part"],
    );
    let body = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/parts");
    let text = format!(
        "part = \"{}\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [onto]\nbody = \"{}\"\ntop = [99]\n",
        body.join("boss.step").display(),
        body.join("pipe.step").display()
    );
    let far = write(dir.path(), "far.toml", text);
    says(&refusal(&far), &["no face 99", "meltpath inspect"]);
}

/// The body stands on its table: what grows out of its underside, or through it, has no room there.
#[test]
fn layers_below_the_table_are_refused_with_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |part: &Mesh, more: &str| refusal(&job(dir.path(), part, &thick_plate(), more));
    let words = ["mm below the table", "build_direction", "machine.place"];
    // a pad on top, turned down: 8 mm of it grow
    let pad = cuboid([30.0, 20.0, 5.0], [70.0, 60.0, 18.0]);
    let down = job(dir.path(), &pad, &thick_plate(), "");
    let text = std::fs::read_to_string(&down).unwrap();
    let text = format!("build_direction = [0.0, 0.0, -1.0]\n{text}");
    let told = refusal(&write(dir.path(), "down.toml", text));
    says(&told, &words);
    says(&told, &["8.0 mm below"]);
    // a pin through the plate
    let through = cuboid([40.0, 30.0, -12.0], [60.0, 50.0, 20.0]);
    says(&refused(&through, ""), &words);
    says(&refused(&through, ""), &["12.0 mm below", "-12.0)"]);
    // a pad on the side whose allowance alone reaches under the plate
    let block = cuboid([0.0; 3], [110.0, 90.0, 60.0]);
    let side = cuboid([-8.0, 20.0, 2.0], [5.0, 60.0, 40.0]);
    let more = "[target]\nallowance = \"5 mm\"\n";
    let told = refusal(&job(dir.path(), &side, &block, more));
    says(&told, &words);
    says(&told, &["3.0 mm below"]);
}

/// What is named as the top is a side of the part, and a file in another unit: both are told as what they are.
#[test]
fn tops_and_units_that_are_mistaken_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let pad = cuboid([30.0, 20.0, 5.0], [70.0, 60.0, 18.0]);
    let inches = job(dir.path(), &pad, &thick_plate(), "");
    let text = std::fs::read_to_string(&inches).unwrap();
    let text = format!("part_unit = \"in\"\n{text}");
    let told = refusal(&write(dir.path(), "inches.toml", text));
    says(&told, &["1016 x 1016 x 330 mm", "part_unit"]);
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
    // a scan of the upper side alone
    let waves = |i: u32| 10.0 + 0.2 * f64::from(i % 7);
    let at = |i: u32| DVec3::new(f64::from(i % 31) * 3.0, f64::from(i / 31) * 3.0, waves(i));
    let squares = (0..23 * 31).filter(|i| i % 31 < 30);
    let scan = Mesh {
        vertices: (0..24 * 31).map(at).collect(),
        triangles: squares
            .flat_map(|i| [[i, i + 1, i + 32], [i, i + 32, i + 31]])
            .collect(),
    };
    let pad = cuboid([20.0, 15.0, 5.0], [70.0, 55.0, 18.0]);
    let open = job(dir.path(), &pad, &scan, "");
    says(&refusal(&open), &["body.stl", "is open", "close the scan"]);
}

/// A trunk on a plate, a boss out of its side close above the plate, and another on the first.
fn tee(dir: &Path, more: &str) -> PathBuf {
    let plate = cuboid([-45.0, -35.0, -10.0], [45.0, 35.0, 0.0]);
    let trunk = cuboid([-20.0, -15.0, -1.0], [20.0, 15.0, 26.0]);
    support::part(
        dir,
        "boss.stl",
        &cuboid([18.0, -12.0, 8.0], [36.0, 12.0, 20.0]),
    );
    support::part(
        dir,
        "cap.stl",
        &cuboid([-10.0, -12.0, 24.0], [10.0, 12.0, 38.0]),
    );
    let then = format!("then = [\"boss.stl\", \"cap.stl\"]\n{more}");
    job(dir, &trunk, &plate, &then)
}

#[test]
fn parts_grow_out_of_one_another_each_in_its_own_direction() {
    let dir = tempfile::tempdir().unwrap();
    let job = tee(dir.path(), "");
    let done = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let verdict = &done.verdict;
    for id in ["lack", "loose", "ctwd-min", "flatness", "program"] {
        let check = check(verdict, id);
        assert!(
            matches!(check.status, Status::Pass | Status::Warn),
            "{id}: {check:?}"
        );
    }
    keeps_its_metal(verdict);
    let table = std::fs::read_to_string(done.folder.join("series/surface.csv")).unwrap();
    let rows = table.lines().skip(1);
    let rows: Vec<Vec<f64>> = rows
        .map(|row| row.split(',').map(|v| v.parse().unwrap()).collect())
        .collect();
    // pass, x, y, z, axis: out of plate, flank and top, one after the other
    let ways: Vec<&[f64]> = rows.iter().map(|row| &row[4..7]).collect();
    let along = |way: &[f64], axis: usize| (way[axis] - 1.0).abs() < 1e-9;
    let first = |axis: usize| ways.iter().position(|way| along(way, axis)).unwrap();
    let last = |axis: usize| ways.iter().rposition(|way| along(way, axis)).unwrap();
    assert!(ways.iter().all(|way| along(way, 0) || along(way, 2)));
    let boss = first(0)..last(0) + 1;
    assert!(ways[boss.clone()].iter().all(|way| along(way, 0)));
    assert!(boss.start > 0 && boss.end < rows.len());
    // the plate is nearer to the boss's far end than the trunk: its layers stay upright and as wide
    let low = |range: &[Vec<f64>]| range.iter().map(|r| r[3]).fold(f64::INFINITY, f64::min);
    let end = &rows[boss.end - 30..boss.end];
    assert!((low(end) - low(&rows[boss.clone()])).abs() < 1.0);
    // numbers go on, and the cap begins where the trunk's metal ends
    assert!(rows.windows(2).all(|w| w[1][0] - w[0][0] <= 1.0));
    let top = rows[boss.start - 1][3];
    assert!((rows[boss.end][3] - top - rows[boss.end][7]).abs() < 1e-6);
}

#[test]
fn further_parts_that_do_not_fit_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let job = tee(dir.path(), "");
    support::part(
        dir.path(),
        "cap.stl",
        &cuboid([-10.0, -12.0, 60.0], [10.0, 12.0, 70.0]),
    );
    says(&refusal(&job), &["cap.stl", "does not touch"]);
    let text = std::fs::read_to_string(&job).unwrap();
    std::fs::write(&job, text.replace("cap.stl", "hat.stl")).unwrap();
    says(&refusal(&job), &["cannot open a part", "hat.stl"]);
    std::fs::write(&job, text.replace("[onto]", "[onto]\ntop = [1]")).unwrap();
    says(&refusal(&job), &["onto.then", "onto.top"]);
}

/// Layers that are asked for end within the second part: what the third lacks is told.
#[test]
fn layers_are_counted_over_all_parts() {
    let dir = tempfile::tempdir().unwrap();
    let verdict = verdict(&tee(dir.path(), "[layers]\ncount = 16\n"));
    assert_eq!(fact(&verdict, "layers"), 16.0);
    assert_eq!(check(&verdict, "lack").status, Status::Fail);
}
