//! `meltpath measure`: beads of a scan, what is wrong with scans, and a process map that predicts a bead that was left out.

use std::fmt::Write;
use std::path::Path;

use crate::support::{check, has_files, says, warned, write};
use meltpath::measure::{Found, MeasureError, measure};
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Reporter, Silent, Status};
use meltpath_deposition::consumable::Wire;
use meltpath_deposition::process_map::ProcessMap;
use meltpath_numerics::random::Random;

/// Section of a wire of 1.2 mm, mm².
const WIRE: f64 = 0.36 * std::f64::consts::PI;
/// mm/s in one m/min.
const M_PER_MIN: f64 = 1000.0 / 60.0;
/// Metal that stays in a bead of the scans.
const KEPT: f64 = 0.96;

/// A bead of a law of the tests' own: feed and travel speed in m/min, width and height in mm.
fn sizes([feed, travel]: [f64; 2]) -> [f64; 2] {
    let area = KEPT * WIRE * feed / travel;
    let width = 2.4 * area.powf(0.45);
    [width, 1.5 * area / width]
}

/// Lines of a plate on which beads lie 20 mm apart, from x = 10 to 90 mm; tilted and moved as a scanner sees it, in units of `unit` mm.
fn scan(beads: &[[f64; 2]], unit: f64) -> String {
    let mut text = String::from("x y z\n");
    let mut random = Random::new(3);
    let rows = 20 * i32::try_from(beads.len()).unwrap() + 10;
    for i in 0..=100 {
        for j in 0..=8 * rows {
            let (x, y) = (f64::from(i), f64::from(j) / 8.0);
            let bead = beads.get(((y - 5.0) / 20.0).max(0.0) as usize);
            let height = bead.map_or(0.0, |setting| {
                let [w, h] = sizes(*setting);
                let u = 2.0 * ((y - 5.0).rem_euclid(20.0) - 10.0) / w;
                h * (1.0 - u * u)
            });
            let noise = 0.03 * random.normal();
            let z = if (10..=90).contains(&i) {
                height.max(0.0)
            } else {
                0.0
            } + noise;
            let [x, y, z] = [x + 40.0, 0.96 * y - 0.28 * z, 0.28 * y + 0.96 * z].map(|v| v / unit);
            writeln!(text, "{x:.5} {y:.5} {z:.5}").unwrap();
        }
    }
    text
}

const SETTINGS: [[f64; 2]; 6] = [
    [5.0, 0.5],
    [5.0, 0.8],
    [7.0, 0.5],
    [7.0, 0.8],
    [9.0, 0.5],
    [9.0, 0.8],
];

fn file(folder: &Path, head: &str, feeds: Option<f64>) -> std::path::PathBuf {
    let mut text = format!("scan = \"plate.xyz\"\n{head}");
    for [feed, travel] in SETTINGS {
        write!(
            text,
            "[[bead]]\nwire_feed = \"{feed} m/min\"\ntravel_speed = \"{travel} m/min\"\n"
        )
        .unwrap();
        if let Some(factor) = feeds {
            writeln!(text, "measured_feed = \"{} m/min\"", feed * factor).unwrap();
        }
    }
    write(folder, "scan.toml", text)
}

const PROCESS: &str = "wire = \"g3si-1.2\"\ngas = \"m21\"\nmode = \"cmt\"\n";

fn measured(folder: &Path, file: &Path) -> Result<Found, MeasureError> {
    measure(file, At(&folder.join("out")), &Silent)
}

/// The map that a scan made, as a job reads it.
fn map(found: &Found) -> ProcessMap {
    let wire = Wire::builtin("g3si-1.2").unwrap();
    let text = found.map.as_ref().unwrap();
    ProcessMap::parse("map.toml", text, &wire, &Reporter::new()).unwrap()
}

#[test]
fn beads_of_a_scan_make_a_map_that_predicts_another() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "plate.xyz", scan(&SETTINGS, 1.0));
    let found = measured(dir.path(), &file(dir.path(), PROCESS, Some(1.0))).unwrap();
    for (bead, setting) in found.beads.iter().zip(SETTINGS) {
        let [w, h] = sizes(setting);
        assert!(
            (bead.width[0] - w).abs() < 0.05,
            "{setting:?}: {} for {w}",
            bead.width[0]
        );
        assert!(
            (bead.height[0] - h).abs() < 0.05,
            "{setting:?}: {} for {h}",
            bead.height[0]
        );
        let kept = bead.kept(0.0).unwrap()[0];
        assert!(
            (kept - KEPT).abs() < 0.015,
            "{setting:?}: {kept}, form {}",
            bead.form()
        );
    }
    assert_eq!(found.verdict.checks.len(), 8);
    for check in &found.verdict.checks {
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    has_files(
        &dir.path().join("out"),
        &[
            "report.html",
            "beads.csv",
            "sections.csv",
            "map.toml",
            "verdict.json",
        ],
    );
    let map = map(&found);
    let between = [6.0, 0.65];
    let bead = map.bead(between[0] * M_PER_MIN, between[1] * M_PER_MIN);
    let [w, h] = sizes(between);
    assert!((bead.width.value / w - 1.0).abs() < 0.02, "{bead:?}");
    assert!((bead.height.value / h - 1.0).abs() < 0.02, "{bead:?}");
    let area = KEPT * WIRE * between[0] / between[1];
    assert!((bead.area.value / area - 1.0).abs() < 0.02 && bead.valid);
}

/// Wire and gas of files of one's own: the map names both by what their files call them, as a job does that reads the map.
#[test]
fn a_map_names_a_gas_of_ones_own_by_its_identifier() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "plate.xyz", scan(&SETTINGS, 1.0));
    let gas = meltpath_data::gases::M21.text;
    let own = gas.replace("id = \"m21\"", "id = \"own-82-18\"");
    assert_ne!(own, gas);
    write(dir.path(), "my-gas.toml", own);
    let process = PROCESS.replace("gas = \"m21\"", "gas = \"my-gas.toml\"");
    let found = measured(dir.path(), &file(dir.path(), &process, Some(1.0))).unwrap();
    let text = found.map.as_ref().unwrap();
    says(
        text,
        &[
            "\ngas = \"own-82-18\"\n",
            "\nid = \"g3si-1.2-cmt-own-82-18-measured\"\n",
        ],
    );
    // a gas that is none is refused as a job refuses it
    let process = PROCESS.replace("gas = \"m21\"", "gas = \"m22\"");
    let at = file(dir.path(), &process, Some(1.0));
    let refused = measure(&at, At(&dir.path().join("other")), &Silent).unwrap_err();
    says(&refused, &["there is no gas \"m22\"", "m21"]);
}

/// Where the feed was not measured the beads tell how much more is fed than set; a scan in inches is the same scan.
#[test]
fn what_is_fed_more_than_set_is_the_maps_factor() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "plate.xyz", scan(&SETTINGS, 25.4));
    let found = measured(
        dir.path(),
        &file(dir.path(), &format!("unit = \"in\"\n{PROCESS}"), None),
    )
    .unwrap();
    let text = found.map.as_ref().unwrap();
    says(text, &["feed_factor", "assumed", "rows"]);
    let bead = map(&found).bead(7.0 * M_PER_MIN, 0.5 * M_PER_MIN);
    let area = KEPT * WIRE * 7.0 / 0.5;
    assert!((bead.area.value / area - 1.0).abs() < 0.015, "{bead:?}");
    // of whose feed a third was told less than was fed
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "plate.xyz", scan(&SETTINGS, 1.0));
    let found = measured(dir.path(), &file(dir.path(), PROCESS, Some(0.7))).unwrap();
    assert!(found.map.is_none() && warned(&found.verdict, "no-map"));
}

/// waam AC-27: more metal measured than wire fed raises a flag.
#[test]
fn waam_ac27_more_metal_than_wire_fails() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "plate.xyz", scan(&SETTINGS, 1.0));
    for (feeds, status) in [
        (Some(1.0), Status::Pass),
        (Some(0.9), Status::Fail),
        (None, Status::Pass),
    ] {
        let _ = std::fs::remove_dir_all(dir.path().join("out"));
        let found = measured(dir.path(), &file(dir.path(), PROCESS, feeds)).unwrap();
        let flag = check(&found.verdict, "metal-most");
        assert_eq!(flag.status, status, "{feeds:?}: {flag:?}");
        assert!(flag.place.as_ref().unwrap().bead.is_some());
    }
    // a wire half as thick cannot fill these beads, measured or not
    let _ = std::fs::remove_dir_all(dir.path().join("out"));
    let thin = PROCESS.replace("g3si-1.2", "er70s-6-0.9");
    let found = measured(dir.path(), &file(dir.path(), &thin, None)).unwrap();
    assert_eq!(check(&found.verdict, "metal-most").status, Status::Fail);
}

#[test]
fn sizes_alone_need_no_settings() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "plate.xyz", scan(&SETTINGS[..2], 1.0));
    let file = write(dir.path(), "scan.toml", "scan = \"plate.xyz\"\n");
    let found = measured(dir.path(), &file).unwrap();
    assert_eq!(found.beads.len(), 2);
    assert_eq!(
        check(&found.verdict, "metal-most").status,
        Status::NotChecked
    );
    assert!(found.map.is_none() && warned(&found.verdict, "no-map"));
}

/// Two beads that touch are one cluster: no map is made of them.
#[test]
fn two_beads_that_touch_do_not_pass() {
    let dir = tempfile::tempdir().unwrap();
    let mut random = Random::new(5);
    let mut text = String::new();
    for (i, j) in (0..120).flat_map(|i| (0..300).map(move |j| (i, j))) {
        let (x, y) = (f64::from(i), 0.2 * f64::from(j));
        let bead = |middle: f64| 2.0 * (1.0 - ((y - middle) / 3.5).powi(2));
        let height = if i < 10 {
            0.0
        } else {
            bead(28.0).max(bead(33.0)).max(0.0)
        };
        writeln!(text, "{x} {y} {}", height + 0.03 * random.normal()).unwrap();
    }
    write(dir.path(), "plate.xyz", text);
    let file = write(dir.path(), "scan.toml", "scan = \"plate.xyz\"\n");
    let found = measured(dir.path(), &file).unwrap();
    assert_eq!(found.beads.len(), 1);
    assert_eq!(check(&found.verdict, "form").status, Status::Fail);
    assert!(warned(&found.verdict, "no-parabola"));
}

/// Two beads 6 mm wide and 2 mm high along x, 20 mm apart, of a form: its share of the height at a share of half the width.
struct Two {
    form: fn(f64) -> f64,
    high: f64,
    /// Rows of points so far apart, mm; at any place where zero.
    rows: f64,
    /// What is not seen, by the distance from the middle of the nearest bead, mm.
    hidden: [f64; 2],
    /// How far the plate is bowed along the beads, mm, and the scanner's noise.
    bowed: f64,
    noise: f64,
}

const TWO: Two = Two {
    form: |u| 1.0 - u * u,
    high: 2.0,
    rows: 0.0,
    hidden: [0.0; 2],
    bowed: 0.0,
    noise: 0.03,
};

impl Two {
    fn scan(&self) -> String {
        let mut random = Random::new(8);
        let mut text = String::new();
        for _ in 0..60_000 {
            let (x, mut y) = (random.between(-10.0, 60.0), random.between(0.0, 40.0));
            if self.rows > 0.0 {
                y = self.rows * ((y / self.rows).floor() + 0.4);
            }
            let off = y.rem_euclid(20.0) - 10.0;
            if (self.hidden[0]..self.hidden[1]).contains(&off) {
                continue;
            }
            let u: f64 = off / 3.0;
            let on = (0.0..50.0).contains(&x) && u.abs() < 1.0;
            let z = if on { self.high * (self.form)(u) } else { 0.0 }
                + self.bowed * ((x - 25.0) / 35.0).powi(2)
                + self.noise * random.normal();
            writeln!(text, "{x:.4} {y:.4} {z:.4}").unwrap();
        }
        text
    }
}

/// What a scan does not show is not told as a width: rows far apart, low beads, a hidden foot, a bell.
#[test]
fn widths_that_a_scan_does_not_show_cannot_be_told() {
    let dir = tempfile::tempdir().unwrap();
    let file = write(dir.path(), "scan.toml", "scan = \"plate.xyz\"\n");
    let bell: fn(f64) -> f64 = |u| (0.5 * std::f64::consts::PI * u).cos().powi(2);
    for (two, told) in [
        (TWO, ""),
        (Two { rows: 0.8, ..TWO }, "width-known"),
        (Two { high: 0.4, ..TWO }, "width-known"),
        (
            Two {
                hidden: [1.75, 3.8],
                ..TWO
            },
            "shown",
        ),
        (Two { form: bell, ..TWO }, "full-least"),
    ] {
        write(dir.path(), "plate.xyz", two.scan());
        let _ = std::fs::remove_dir_all(dir.path().join("out"));
        let found = measured(dir.path(), &file).unwrap();
        for id in ["width-known", "shown", "full-least", "full-most"] {
            let check = check(&found.verdict, id);
            let known = check.status == Status::Pass;
            assert!(known || check.status == Status::CannotSay, "{check:?}");
            assert!(known || !told.is_empty(), "{check:?}");
            assert!(!known || id != told, "{told}: {check:?}");
            assert!(known || check.remedy.is_some(), "{check:?}");
            assert!(check.place.as_ref().unwrap().bead.is_some());
        }
        // a bell's area is its own all the same, and nothing but its width is wrong
        let width = found.beads[0].width[0];
        let off = (width - 6.0).abs() / found.beads[0].width_sigma;
        assert!(off < 2.0 || told == "full-least", "{told}: {width}");
    }
}

/// A plate that is bowed, or noisy, by more than `near`: the message tells which `near` shows the beads, and it does.
#[test]
fn the_near_that_shows_beads_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let settings = "[[bead]]\nwire_feed = \"5 m/min\"\ntravel_speed = \"0.5 m/min\"\n".repeat(2);
    for two in [Two { bowed: 0.7, ..TWO }, Two { noise: 0.15, ..TWO }] {
        write(dir.path(), "plate.xyz", two.scan());
        let with = |head: &str| {
            let text = format!("scan = \"plate.xyz\"\n{head}{settings}");
            let _ = std::fs::remove_dir_all(dir.path().join("out"));
            measured(dir.path(), &write(dir.path(), "scan.toml", text))
        };
        let error = with("").unwrap_err().to_string();
        let near = error
            .split("write ")
            .nth(1)
            .and_then(|t| t.split(',').next());
        let near = near.unwrap_or_default();
        assert!(near.starts_with("near = \"0."), "{error}");
        let found = with(&format!("{near}\n")).unwrap();
        let [width, sigma] = [found.beads[0].width[0], found.beads[0].width_sigma];
        assert!(
            (width - 6.0).abs() < 2.0 * sigma,
            "{near}: {width} ± {sigma}"
        );
    }
}

#[test]
fn what_is_wrong_with_a_scan_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let told = |head: &str, cloud: &str| {
        write(dir.path(), "plate.xyz", cloud);
        let error = measured(dir.path(), &file(dir.path(), head, None)).unwrap_err();
        assert!(!dir.path().join("out").exists());
        error.to_string()
    };
    let good = scan(&SETTINGS[..2], 1.0);
    says(&told("", &good), &["tells of 6 beads", "shows 2", "x 90.0"]);
    says(
        &told("wire = \"no-such\"\n", &good),
        &["no-such", "g3si-1.2"],
    );
    says(&told("near = \"0 mm\"\n", &good), &["near"]);
    says(&told("", "1 2 3\n4 five 6\n"), &["line 2"]);
    says(&told("", "1 2 3\n4 5 6\n"), &["2 points", "no plate"]);
    let bare: String = good.split_inclusive('\n').take(4000).collect();
    says(&told("", &bare), &["no straight bead"]);
    // in the wrong unit nothing is as long as a bead
    says(
        &told("unit = \"m\"\n", &scan(&SETTINGS[..2], 1.0)),
        &["plate"],
    );
    let file = write(dir.path(), "scan.toml", "scan = \"plate.las\"\n");
    says(&measured(dir.path(), &file).unwrap_err(), &[".ply", ".xyz"]);
    let file = write(
        dir.path(),
        "scan.toml",
        "scan = \"plate.xyz\"\n[[bead]]\nwire_feed = \"5 m/min\"\ntravel_speed = \"0.5 m/min\"\nmeasured_feed = \"5 m/min\"\n[[bead]]\nwire_feed = \"5 m/min\"\ntravel_speed = \"0.5 m/min\"\n",
    );
    says(
        &measured(dir.path(), &file).unwrap_err(),
        &["measured_feed", "1 of 2"],
    );
}
