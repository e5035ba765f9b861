//! `meltpath measure` on beads with a corner: pursuit lengths, volumes, the deposit's model against the scan, and what is wrong with them.

use std::fmt::Write;
use std::path::Path;

use crate::support::{check, has_files, says, thin_wall, warned, write};
use meltpath::chain;
use meltpath::measure::{Found, MeasureError, measure};
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath_base::{Silent, Status};
use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
use meltpath_deposition::consumable::PoolFile;
use meltpath_deposition::deposit::{Deposition, Settings};
use meltpath_deposition::pursuit::{PursuitMode, pursuit_curve};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;
use meltpath_numerics::random::Random;
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};

const WIDTH: f64 = 7.0;
const HEIGHT: f64 = 2.0;
/// 5 m/min of a wire of 1.2 mm at 0.6 m/min: 9.42 mm², of which a parabola 7 mm wide and 2 mm high takes 99 %.
const SETTINGS: &str = "[[bead]]\nwire_feed = \"5 m/min\"\ntravel_speed = \"0.6 m/min\"\n";
const PROCESS: &str = "wire = \"g3si-1.2\"\ngas = \"m21\"\nmode = \"cmt\"\n";

/// A bead with a corner: its torch's path, and the curve that its middle follows.
struct Bead {
    curve: Vec<DVec2>,
    width: f64,
}

fn torch(at: DVec2, direction: f64, turn: f64) -> [DVec2; 3] {
    let [into, out] =
        [direction, direction + turn].map(|a| DVec2::from_angle(a.to_radians()) * 45.0);
    [at - into, at, at + out]
}

fn bead(at: [f64; 2], direction: f64, turn: f64, length: f64) -> Bead {
    let path = torch(DVec2::from_array(at), direction, turn);
    let all = pursuit_curve(&path, length, PursuitMode::Rope, 0.05);
    let mut curve = vec![path[0]];
    let mut last = DVec2::ZERO;
    for w in all.windows(2) {
        let Some(heading) = (w[1] - w[0]).try_normalize() else {
            continue;
        };
        let inside = (w[0] - path[0]).dot(path[1] - path[0]) > 0.0;
        if inside && heading.dot(last) < 0.9995 {
            curve.push(w[0]);
            last = heading;
        }
    }
    curve.push(path[2]);
    Bead {
        curve,
        width: WIDTH,
    }
}

impl Bead {
    fn height(&self, p: DVec2) -> f64 {
        let off = |w: &[DVec2]| {
            let way = w[1] - w[0];
            let share = (p - w[0]).dot(way) / way.length_squared();
            p.distance(w[0] + share.clamp(0.0, 1.0) * way)
        };
        let off = self.curve.windows(2).map(off).fold(f64::INFINITY, f64::min);
        HEIGHT * (1.0 - (2.0 * off / self.width).powi(2))
    }
}

/// Lines of a plate as a scanner sees it, tilted and elsewhere, in units of `unit` mm.
fn scan(size: [f64; 2], noise: f64, unit: f64, height: impl Fn(DVec2) -> f64) -> String {
    let mut text = String::new();
    let mut random = Random::new(7);
    let pitch = 0.3;
    for i in 0..(size[0] / pitch) as i32 {
        for j in 0..(size[1] / pitch) as i32 {
            let p = pitch * DVec2::new(f64::from(i), f64::from(j));
            let (x, y) = (p.x, p.y);
            let z = height(p).max(0.0) + noise * random.normal();
            let [x, y, z] = [x + 40.0, 0.96 * y - 0.28 * z, 0.28 * y + 0.96 * z].map(|v| v / unit);
            writeln!(text, "{x:.5} {y:.5} {z:.5}").unwrap();
        }
    }
    text
}

fn file(folder: &Path, head: &str, corners: &[&str]) -> std::path::PathBuf {
    let mut text = format!("scan = \"plate.xyz\"\n{head}");
    for corner in corners {
        writeln!(text, "{SETTINGS}{corner}").unwrap();
    }
    write(folder, "scan.toml", text)
}

fn measured(folder: &Path, file: &Path) -> Result<Found, MeasureError> {
    let _ = std::fs::remove_dir_all(folder.join("out"));
    measure(file, At(&folder.join("out")), &Silent)
}

/// Two corners of a wire whose lengths are none of the table: found, written, and taken by a job.
#[test]
fn lengths_of_corners_are_found_and_a_job_takes_them() {
    let dir = tempfile::tempdir().unwrap();
    let beads = [
        bead([60.0, 15.0], 0.0, 90.0, 3.5),
        bead([130.0, 95.0], -80.0, -120.0, 7.0),
    ];
    let height = |p: DVec2| beads.iter().map(|b| b.height(p)).fold(0.0, f64::max);
    write(
        dir.path(),
        "plate.xyz",
        scan([170.0, 150.0], 0.05, 1.0, height),
    );
    let told = ["corner = \"90°\"", "corner = \"-120°\""];
    let found = measured(dir.path(), &file(dir.path(), PROCESS, &told)).unwrap();
    for (corner, length) in found.corners.iter().zip([3.5, 7.0]) {
        let p = corner.pursuit.as_ref().unwrap();
        assert!(
            (p.length / length - 1.0).abs() < 0.04,
            "{length}: {} {}",
            p.length,
            p.sigma
        );
        assert!(
            p.off < 0.1 && p.sigma < 0.03 * length,
            "{} {}",
            p.off,
            p.sigma
        );
        let [width, tall, area] = corner.mean;
        assert!((width - WIDTH).abs() < 0.05 && (tall - HEIGHT).abs() < 0.03);
        assert!((area / (WIDTH * HEIGHT / 1.5) - 1.0).abs() < 0.01, "{area}");
        // moments of the sections as they are are those of the parabola that they make
        for (ours, parabola) in [
            (corner.balance.fold.lacunar, corner.parabola.lacunar),
            (corner.balance.fold.redundant, corner.parabola.redundant),
        ] {
            assert!((ours / parabola - 1.0).abs() < 0.02, "{ours} {parabola}");
        }
        let b = &corner.balance;
        let parts = b.kinematic() - b.chord() + b.geometric();
        assert!((b.accumulation() - parts).abs() < 1e-9);
    }
    for id in [
        "corner-angle",
        "corner-fit",
        "corner-way",
        "pursuit-length",
        "corner-shown",
        "corner-metal-most",
    ] {
        let one = check(&found.verdict, id);
        assert_eq!(one.status, Status::Pass, "{one:?}");
    }
    let files = ["corners.csv", "corner-crests.csv", "corner-deviations.csv"];
    has_files(&dir.path().join("out"), &files);
    let text = std::fs::read_to_string(dir.path().join("out/pursuit.toml")).unwrap();
    let law = PoolFile::parse(&text).unwrap().law().unwrap();
    assert!((law.length(90f64.to_radians()) - 3.5).abs() < 0.15);

    // a job of another wire: what is measured for that wire is borrowed here, and said so
    let job = thin_wall(
        dir.path(),
        "pursuit = \"out/pursuit.toml\"\n[layers]\ncount = 1\n",
    );
    let run = chain::run(&job, NextIn(dir.path()), &Silent).unwrap();
    let provenance = std::fs::read_to_string(run.folder.join("provenance.json")).unwrap();
    says(&provenance, &["waam.pursuit", "g3si-1.2-cmt-m21-measured"]);
    assert!(warned(&run.verdict, "pursuit-borrowed"));
    let borrowed = check(&run.verdict, "borrowed");
    assert_eq!(borrowed.status, Status::CannotSay);
    says(&borrowed.reason, &["corners", "g3si-1.2-cmt-m21-measured"]);
}

/// A corner told by the wrong angle, the wrong way, or in another unit.
#[test]
fn what_is_told_wrong_is_seen() {
    let dir = tempfile::tempdir().unwrap();
    let one = bead([60.0, 15.0], 0.0, 90.0, 5.0);
    let plate = |unit: f64| scan([120.0, 75.0], 0.03, unit, |p| one.height(p));
    write(dir.path(), "plate.xyz", plate(1.0));
    let told = |head: &str, corner: &str| {
        let head = format!("{PROCESS}{head}");
        measured(dir.path(), &file(dir.path(), &head, &[corner]))
    };
    for (corner, id) in [
        ("corner = \"80°\"", "corner-angle"),
        ("corner = \"-90°\"", "corner-way"),
    ] {
        let found = told("", corner).unwrap();
        let check = check(&found.verdict, id);
        assert_eq!(check.status, Status::Fail, "{check:?}");
        assert!(found.pursuit.is_none() && warned(&found.verdict, "no-pursuit"));
    }
    let missing = told("", "").unwrap_err();
    says(&missing, &["corner"]);
    let blunt = told("", "corner = \"4°\"").unwrap_err();
    says(&blunt, &["20°"]);
    write(dir.path(), "plate.xyz", plate(25.4));
    let found = told("unit = \"in\"\n", "corner = \"90°\"").unwrap();
    let length = found.corners[0].pursuit.as_ref().unwrap().length;
    assert!((length - 5.0).abs() < 0.2, "{length}");
}

/// Beads that cross, a bead with two corners, and a scan of which nothing bends.
#[test]
fn beads_that_are_no_corner_are_refused_with_why() {
    let dir = tempfile::tempdir().unwrap();
    let straight = |a: [f64; 2], b: [f64; 2]| Bead {
        curve: vec![DVec2::from_array(a), DVec2::from_array(b)],
        width: WIDTH,
    };
    let refused = |beads: &[Bead], words: &[&str]| {
        let height = |p: DVec2| beads.iter().map(|b| b.height(p)).fold(0.0, f64::max);
        let plate = scan([120.0, 100.0], 0.03, 1.0, height);
        write(dir.path(), "plate.xyz", plate);
        let file = file(dir.path(), PROCESS, &["corner = \"90°\""]);
        says(&measured(dir.path(), &file).unwrap_err(), words);
    };
    let cross = [
        straight([10.0, 50.0], [110.0, 50.0]),
        straight([60.0, 8.0], [60.0, 92.0]),
    ];
    refused(&cross, &["without a corner", "shows 1"]);
    let zigzag = Bead {
        curve: [[10.0, 10.0], [60.0, 10.0], [60.0, 60.0], [110.0, 60.0]]
            .map(DVec2::from_array)
            .to_vec(),
        width: WIDTH,
    };
    refused(&[zigzag], &["more than one corner"]);
    refused(
        &[straight([10.0, 50.0], [110.0, 50.0])],
        &["without a corner", "shows 1"],
    );
    let short = Bead {
        curve: [[10.0, 10.0], [60.0, 10.0], [60.0, 30.0]]
            .map(DVec2::from_array)
            .to_vec(),
        width: WIDTH,
    };
    refused(&[short], &["without a corner", "shows 1"]);
}

/// The deposit of jobs at a corner of 90° or more, as a surface.
fn laid(turn: f64, length: f64) -> HeightMap {
    let area = WIDTH * HEIGHT / 1.5;
    let model = BeadModel {
        width: WIDTH,
        area,
        wire_section: 1.131,
        efficiency: 1.0,
        width_exponent: 0.345,
        feed_exponent: 0.0,
    };
    let text = meltpath_data::pools::X90_IG_1_0_CMT_M14.text;
    let row = &PoolFile::parse(text).unwrap().pool.value[0];
    let pool = PoolModel::for_bead(&row.model(PursuitLength::Fixed(length)), &model);
    let map = HeightMap::new(DVec2::ZERO, DVec2::new(125.0, 85.0), 0.25, 0.0).unwrap();
    let mut deposition = Deposition::new(map, model, pool, Settings::default()).unwrap();
    let mut block = MotionBlock::default();
    let mut times = Vec::new();
    let mut time = 0.0;
    let way = torch(DVec2::new(65.0, 20.0), 0.0, turn);
    for w in way.windows(2) {
        for k in 0..450 {
            let first = times.is_empty();
            time += 0.01;
            times.push(time);
            block
                .position
                .push(w[0].lerp(w[1], f64::from(k) / 450.0).extend(0.0));
            block.speed.push(10.0);
            block
                .wire
                .push(if first { 0.0 } else { area / 1.131 * 0.1 });
            block.command.push(1);
        }
    }
    block.times = Times::Each(times);
    deposition.block(&block);
    deposition.finish().map
}

/// waam AC-24, as far as it goes without a scan of the source: the map of deviations shows nothing where the scan is the model's own, and of
/// a bead whose metal does not pile up in its corner a model that is too high there.
#[test]
fn waam_ac24_a_map_of_deviations_shows_where_the_model_piles_up() {
    let dir = tempfile::tempdir().unwrap();
    let zone = |found: &Found, name: &str| {
        let all = &found.corners[0].deviation.as_ref().unwrap().zones;
        let one = all.iter().find(|z| z.name == name).unwrap();
        [one.mean, one.rms]
    };
    let told = |corner: &str| measured(dir.path(), &file(dir.path(), PROCESS, &[corner])).unwrap();
    let straight = ["before the corner", "straight after it"];
    let mut strays = Vec::new();
    for turn in [90.0, 135.0] {
        let corner = format!("corner = \"{turn}°\"");
        let map = laid(turn, 5.0);
        let plate = scan([125.0, 85.0], 0.02, 1.0, |p| map.height(p));
        write(dir.path(), "plate.xyz", plate);
        let own = told(&corner);
        let one = &own.corners[0];
        // the crest of a deposit is not the curve that its pool follows: it cuts the corner by less
        let length = one.pursuit.as_ref().unwrap().length;
        assert!(length < 4.8, "{turn}: {length}");
        for name in straight {
            let [mean, _] = zone(&own, name);
            assert!(mean.abs() < 0.1, "{turn}, own, {name}: {mean}");
        }
        let even = bead([65.0, 20.0], 0.0, turn, 5.0);
        let plate = scan([125.0, 85.0], 0.02, 1.0, |p| even.height(p));
        write(dir.path(), "plate.xyz", plate);
        let found = told(&corner);
        let d = found.corners[0].deviation.as_ref().unwrap();
        for name in straight {
            let [mean, _] = zone(&found, name);
            assert!(mean.abs() < 0.1, "{turn}, even, {name}: {mean}");
        }
        assert!(zone(&found, "corner, centre")[0] < 0.0 && d.tops[1] > d.tops[0]);
        strays.push(d.stray);
    }
    // metal of the model outside the corner, more at the sharper one
    assert!(strays[1] > strays[0] && strays[0] > 5.0, "{strays:?}");
}

/// A torch that slows down at the corner: what its record says is fed is what the volumes find.
#[test]
fn a_record_of_the_torch_splits_the_accumulation() {
    let dir = tempfile::tempdir().unwrap();
    let one = bead([60.0, 15.0], 0.0, 90.0, 5.0);
    write(
        dir.path(),
        "plate.xyz",
        scan([120.0, 75.0], 0.03, 1.0, |p| one.height(p)),
    );
    // 10 mm/s, and half as fast for 2 mm on both sides of the corner, which it cuts by an arc
    let mut record = String::from("time,x,y\n");
    let mut time = 0.0;
    let radius = 1.0;
    let mut last: Option<DVec2> = None;
    for k in -900..=900 {
        let s = 0.05 * f64::from(k);
        let p = if s < -radius {
            DVec2::new(s, 0.0)
        } else if s > radius {
            DVec2::new(0.0, s)
        } else {
            let angle = (s / radius + 1.0) * std::f64::consts::FRAC_PI_4;
            DVec2::new(
                -radius + radius * angle.sin(),
                radius - radius * angle.cos(),
            )
        };
        let speed = if s.abs() < 2.0 { 5.0 } else { 10.0 };
        time += last.map_or(0.0, |l| l.distance(p) / speed);
        last = Some(p);
        writeln!(record, "{time:.5},{:.5},{:.5}", 12.0 - p.y, 3.0 + p.x).unwrap();
    }
    write(dir.path(), "torch.csv", record);
    let told = "corner = \"90°\"\ntorch = \"torch.csv\"";
    let found = measured(dir.path(), &file(dir.path(), PROCESS, &[told])).unwrap();
    let c = &found.corners[0];
    let b = &c.balance;
    // of the two millimetres of the corner an arc leaves 1.57
    let shorter = 2.0 - std::f64::consts::FRAC_PI_2;
    assert!(
        (b.chord() - shorter * c.mean[2]).abs() < 0.05 * c.mean[2],
        "{}",
        b.chord()
    );
    // four millimetres of path at half the speed take as long again as they are long
    let expected = c.mean[2] * (4.0 - shorter);
    let slowing = c.slowing.unwrap();
    assert!(
        (slowing / expected - 1.0).abs() < 0.03,
        "{slowing} {expected}"
    );
    let wrong = "corner = \"-90°\"\ntorch = \"torch.csv\"";
    let error = measured(dir.path(), &file(dir.path(), PROCESS, &[wrong])).unwrap_err();
    says(&error, &["torch.csv", "90"]);
}
