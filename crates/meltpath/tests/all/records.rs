//! `meltpath measure` of records: energies, the answer of the source, what is wrong with records, and a job that takes what was found.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::support::{check, has_files, says, warned, write};
use meltpath::chain;
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath::records::{Found, RecordsError, is_of_records, records};
use meltpath_base::{Silent, Status};
use meltpath_data::{find, gases};
use meltpath_deposition::energy::EnergyFile;
use meltpath_numerics::random::Random;

/// A bead: contact tube distance in mm, V, A, m/min fed.
type Bead = [f64; 4];

/// A record of 14 s at 50 Hz, with an ignition of 1 s at other values and noise.
fn record(bead: Bead) -> String {
    let mut random = Random::new(7);
    let mut text = String::from("t (s),U (V),I (A),feed (m/min)\n");
    for k in 0..=14 * 50 {
        let time = f64::from(k) / 50.0;
        let share = match time {
            t if !(0.3..13.7).contains(&t) => [3.0, 0.0, 0.0],
            t if t < 1.3 => [1.4, 0.7, 0.6],
            _ => [1.0; 3],
        };
        let [u, i, v] = [0, 1, 2].map(|n| bead[n + 1] * share[n] * (1.0 + 0.005 * random.normal()));
        writeln!(text, "{time},{u:.4},{i:.3},{v:.4}").unwrap();
    }
    text
}

const COLUMNS: &str =
    "[columns]\ntime = \"t\"\nvoltage = \"U\"\ncurrent = \"I\"\nfeed = \"feed\"\n";

/// A file of records with these beads at a wire feed that was set, m/min; `head` begins it.
fn file(folder: &Path, head: &str, set: f64, beads: &[Bead]) -> PathBuf {
    let mut text = format!("{head}{COLUMNS}");
    for (k, bead) in beads.iter().enumerate() {
        let name = format!("bead-{}.csv", k + 1);
        write(folder, &name, record(*bead));
        let distance = bead[0];
        write!(text, "[[record]]\nfile = \"{name}\"\ndistance = \"{distance} mm\"\nwire_feed = \"{set} m/min\"\ntravel_speed = \"0.75 m/min\"\n").unwrap();
    }
    write(folder, "records.toml", text)
}

fn found(folder: &Path, file: &Path) -> Result<Found, RecordsError> {
    let out = folder.join("out");
    let _ = std::fs::remove_dir_all(&out);
    records(file, At(&out), &Silent)
}

const X90: &str =
    "wire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\nstabiliser = \"2 m/min\"\n";
/// Layers 1 and 22 of the thin wall, Rouchon 2022, table 4.4.
const WALL: [Bead; 2] = [[15.0, 16.65, 190.0, 10.10], [5.47, 15.17, 205.0, 8.13]];

/// Energies of layers 1 and 22; what the voltage tells by the line of the map that ships, ignition left out; and currents of the circuit.
#[test]
fn waam_ac44_the_thin_wall_of_the_source() {
    let dir = tempfile::tempdir().unwrap();
    let head = format!("{X90}map = \"x90-ig-1.0-cmt-m14\"\n");
    let found = found(dir.path(), &file(dir.path(), &head, 8.0, &WALL)).unwrap();
    for (bead, (stated, energy)) in found.beads.iter().zip([(15.0, 23.9), (5.47, 29.2)]) {
        assert!(
            (bead.energy().value - energy).abs() < 0.2,
            "{:?}",
            bead.energy()
        );
        let told = bead.told.unwrap();
        assert!((told.distance - stated).abs() < 1.5, "{told:?}");
        let circuit = bead.circuit.as_ref().unwrap();
        assert!((circuit.current - bead.steady.current.value).abs() < 2.0);
        assert!((circuit.distance.unwrap() - stated).abs() < 0.5);
        let late = circuit.course.iter().skip(50);
        assert!(circuit.covered && late.clone().count() > 100);
        assert!(
            late.clone()
                .all(|[_, i]| (i - circuit.current).abs() < 10.0)
        );
    }
    let distance = check(&found.verdict, "distance");
    assert_eq!(distance.status, Status::Pass, "{distance:?}");
    // 8 m/min at 0.75 m/min are a ratio of 10.667 as set, 13.47 as fed
    assert!((found.beads[0].ratio() - 10.10 / 0.75).abs() < 0.05);
    assert!(warned(&found.verdict, "contact-tube-near"));
    // 9.53 mm are not enough to tell two lines from their records
    let response = found.response.unwrap();
    assert!((0.06 * response.feed.slope[0] - 0.2067).abs() < 0.002);
    assert!((response.voltage.slope[0] - 0.1553).abs() < 0.003);
    assert!((response.current.slope[0] + 1.574).abs() < 0.05);
    for bead in &found.beads {
        let distance = bead.setting.distance.unwrap();
        let power = response.power.at(distance)[0];
        assert!((power / bead.steady.power.value - 1.0).abs() < 1e-9);
    }
}

/// Distances in mirrored order follow lines of their own; that the feed then rises as the contact tube comes nearer tells them.
#[test]
fn distances_in_mirrored_order_fail() {
    let dir = tempfile::tempdir().unwrap();
    // V, A and m/min as they follow 16, 13 and 10 mm
    let means = [
        [16.8, 188.0, 10.2],
        [16.33, 192.7, 9.58],
        [15.87, 197.4, 8.96],
    ];
    let beads = |distances: [f64; 3]| {
        std::array::from_fn::<Bead, 3, _>(|k| {
            let [u, i, v] = means[k];
            [distances[k], u, i, v]
        })
    };
    let right = found(
        dir.path(),
        &file(dir.path(), X90, 8.0, &beads([16.0, 13.0, 10.0])),
    );
    let right = right.unwrap();
    assert!(right.verdict.checks.iter().all(|c| c.id != "falling"));
    let mirrored = found(
        dir.path(),
        &file(dir.path(), X90, 8.0, &beads([10.0, 13.0, 16.0])),
    );
    let mirrored = mirrored.unwrap();
    assert_eq!(check(&mirrored.verdict, "straight").status, Status::Pass);
    let falling = check(&mirrored.verdict, "falling");
    assert_eq!(falling.status, Status::Fail, "{falling:?}");
    let rise = falling.value.as_ref().unwrap().value;
    assert!((rise - 0.2067).abs() < 0.01, "{rise}");
    let factor = mirrored
        .verdict
        .facts
        .iter()
        .find(|f| f.id == "feed-factor");
    assert!(!factor.unwrap().reason.contains("feed_factor"));
}

/// Table 2.2: nine in ten of the wire set would make 29.3 J/mm³ of the 26.6.
#[test]
fn waam_ac04_energies_of_table_2_2() {
    // V, A, m/min set, m/min fed, m/min travel
    const ROWS: [[f64; 5]; 15] = [
        [12.49, 81.94, 2.0, 2.23, 0.5],
        [12.4, 81.38, 2.0, 2.294, 1.0],
        [12.44, 82.68, 2.0, 2.26, 1.5],
        [15.46, 143.78, 4.0, 4.545, 0.5],
        [15.65, 151.9, 4.0, 4.56, 1.0],
        [15.45, 157.88, 4.0, 4.63, 1.5],
        [17.6, 194.14, 6.0, 6.39, 0.5],
        [17.58, 196.54, 6.0, 6.59, 1.0],
        [17.49, 196.54, 6.0, 6.6, 1.5],
        [17.91, 243.74, 8.0, 8.435, 0.5],
        [18.48, 247.18, 8.0, 9.06, 1.0],
        [17.65, 254.75, 8.0, 8.97, 1.5],
        [18.2, 288.45, 10.0, 10.35, 0.5],
        [18.32, 295.64, 10.0, 10.76, 1.0],
        [18.29, 297.48, 10.0, 10.41, 1.5],
    ];
    let dir = tempfile::tempdir().unwrap();
    let head =
        "wire = \"g3si-1.2\"\ngas = \"speed\"\nmode = \"cmt\"\nignition = \"2 s\"\nend = \"1 s\"\n";
    let mut text = format!("{head}{COLUMNS}");
    for (k, [u, i, set, fed, travel]) in ROWS.into_iter().enumerate() {
        let name = format!("{k}.csv");
        write(dir.path(), &name, record([15.0, u, i, fed]));
        write!(text, "[[record]]\nfile = \"{name}\"\nwire_feed = \"{set} m/min\"\ntravel_speed = \"{travel} m/min\"\n").unwrap();
    }
    let found = found(dir.path(), &write(dir.path(), "records.toml", text)).unwrap();
    let table = EnergyFile::parse(found.energy.as_ref().unwrap()).unwrap();
    let energy = table.of("g3si-1.2", "cmt", "speed").unwrap();
    assert!((energy.mean - 26.6).abs() < 0.1, "{energy:?}");
    assert!((energy.sigma - (28.4 - 23.3) / 4.0).abs() < 0.05);
    let mean = found
        .beads
        .iter()
        .map(meltpath::records::Recorded::energy_by_set_feed);
    assert!((mean.sum::<f64>() / 15.0 - 29.3).abs() < 0.1);
    // errors of the feed, rows 1 and 10
    for (row, more) in [(0, 11.5), (9, 5.4)] {
        let factor = found.beads[row].factor().unwrap().value;
        assert!((100.0 * (factor - 1.0) - more).abs() < 0.1, "{factor}");
    }
    // energy per length and feed over travel of row 1
    assert!((found.beads[0].energy_per_length() - 122.8).abs() < 0.3);
    assert!((found.beads[0].ratio() - 2.23 / 0.5).abs() < 0.01);
}

/// Ratios of two speeds as the records of beads tell them.
#[test]
fn waam_ac02_feed_ratios_of_records() {
    let dir = tempfile::tempdir().unwrap();
    for (feed, travel, ratio) in [
        (6.0, 1.25, 4.8),
        (6.0, 0.25, 24.0),
        (8.0, 0.75, 10.667),
        (8.0, 0.5, 16.0),
        (4.0, 0.75, 5.333),
        (6.0, 0.5, 12.0),
    ] {
        let file = file(
            dir.path(),
            &format!("{X90}ignition = \"2 s\"\nend = \"2 s\"\n"),
            feed,
            &[[15.0, 16.0, 180.0, feed]],
        );
        let text = std::fs::read_to_string(&file)
            .unwrap()
            .replace("0.75 m/min", &format!("{travel} m/min"));
        std::fs::write(&file, text).unwrap();
        let found = found(dir.path(), &file).unwrap();
        assert!(
            (found.beads[0].ratio() / ratio - 1.0).abs() < 2e-3,
            "{ratio}"
        );
    }
}

/// A wall that grows more than the torch is lifted: 5.47 mm in layer 22, and the layer from which on it is too near.
#[test]
fn waam_ac38_the_distance_of_a_layer() {
    let dir = tempfile::tempdir().unwrap();
    let head = format!(
        "{X90}first_distance = \"15 mm\"\nlayer_height = \"1.2 mm\"\ngrowth = \"1.654 mm\"\nleast_distance = \"8 mm\"\n"
    );
    let file = file(dir.path(), &head, 8.0, &WALL);
    let text = std::fs::read_to_string(&file).unwrap();
    let text = text.replace("distance = \"15 mm\"\nwire", "layer = 1\nwire");
    let text = text.replace("distance = \"5.47 mm\"\nwire", "layer = 22\nwire");
    std::fs::write(&file, text).unwrap();
    let found = found(dir.path(), &file).unwrap();
    let distance = found.beads[1].setting.distance.unwrap();
    assert!((distance - 5.47).abs() < 0.01, "{distance}");
    let alarm = found
        .verdict
        .facts
        .iter()
        .find(|f| f.id == "first-layer-too-near")
        .unwrap();
    let layer = alarm.value.as_ref().unwrap().value;
    assert!((layer - 17.0).abs() < 1e-9 && layer <= 22.0, "{alarm:?}");
}

/// Another wire on another machine: feed, voltage and current follow lines of its own.
fn other_wall(distances: &[f64]) -> Vec<Bead> {
    let bead = |d: &f64| {
        [
            *d,
            17.5 + 0.2 * (d - 15.0),
            170.0 - 2.0 * (d - 15.0),
            6.6 + 0.15 * (d - 15.0),
        ]
    };
    distances.iter().map(bead).collect()
}

const OTHER: &str =
    "wire = \"er70s-6-0.9\"\ngas = \"m21\"\nmode = \"cmt\"\nmap = \"er70s-6-0.9-cmt-m21\"\n";

/// Files hold a gas by its identifier, as jobs compare it; what is no gas is refused.
#[test]
fn a_gas_of_ones_own_is_told_by_its_identifier() {
    let dir = tempfile::tempdir().unwrap();
    let gas = find(gases::ALL, "m21").unwrap().text;
    write(
        dir.path(),
        "bottle.toml",
        gas.replace("id = \"m21\"", "id = \"ours\""),
    );
    let records = |gas: &str| {
        let head = format!("wire = \"er70s-6-0.9\"\ngas = \"{gas}\"\nmode = \"cmt\"\n");
        let file = file(dir.path(), &head, 6.0, &other_wall(&[15.0]));
        found(dir.path(), &file)
    };
    let energy = EnergyFile::parse(&records("bottle.toml").unwrap().energy.unwrap()).unwrap();
    assert!(energy.of("er70s-6-0.9", "cmt", "ours").is_some());
    let error = records("steam").unwrap_err().to_string();
    says(&error, &["steam", "m21"]);
}

/// What was found is taken by a job as it is: its feed is known at each distance, and its energy is told.
#[test]
fn a_job_takes_what_records_show() {
    let dir = tempfile::tempdir().unwrap();
    let head = format!("{OTHER}stabiliser = \"2 m/min\"\n");
    let beads = other_wall(&[18.0, 15.0, 12.5, 9.0]);
    let found = found(dir.path(), &file(dir.path(), &head, 6.0, &beads)).unwrap();
    for check in &found.verdict.checks {
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    for bead in &found.beads {
        let (told, stated) = (bead.told.unwrap(), bead.setting.distance.unwrap());
        assert!(
            (told.distance - stated).abs() < 0.6 && told.sigma < 1.5,
            "{told:?}"
        );
    }
    has_files(
        &dir.path().join("out"),
        &[
            "report.html",
            "records.csv",
            "series.csv",
            "source.toml",
            "map.toml",
            "energy.toml",
            "verdict.json",
        ],
    );
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/thin-wall");
    std::fs::copy(example.join("wall.stl"), dir.path().join("wall.stl")).unwrap();
    let job = |map: &str| {
        let text = format!(
            "part = \"wall.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"er70s-6-0.9\"\ngas = \"m21\"\nmode = \"cmt\"\n{map}[waam.bead]\nwire_feed = \"6 m/min\"\ntravel_speed = \"0.6 m/min\"\n[layers]\ncount = 3\n"
        );
        let job = write(dir.path(), "job.toml", text);
        chain::run(&job, NextIn(dir.path()), &Silent)
            .unwrap()
            .verdict
    };
    let before = job("");
    assert_eq!(check(&before, "ctwd-known").status, Status::CannotSay);
    let after = job("map = \"out/map.toml\"\nenergy = \"out/energy.toml\"\n");
    let known = check(&after, "ctwd-known");
    assert_eq!(known.status, Status::Pass, "{known:?}");
    let fact = |id: &str| after.facts.iter().find(|f| f.id == id).unwrap();
    assert!(fact("energy").value.is_some(), "{:?}", fact("energy"));
    says(
        &fact("energy-per-volume").line(),
        &["J/mm³ in layer 1", "in layer 3"],
    );
}

#[test]
fn no_file_is_written_of_what_was_not_shown() {
    let dir = tempfile::tempdir().unwrap();
    let all = other_wall(&[18.0, 15.0, 12.5, 9.0]);
    let refused = |head: &str, beads: &[Bead], words: &[&str]| {
        let found = found(
            dir.path(),
            &file(dir.path(), &format!("{OTHER}{head}"), 6.0, beads),
        )
        .unwrap();
        says(found.source.as_ref().unwrap_err(), words);
        assert!(found.map.is_err() && warned(&found.verdict, "no-response"));
        assert!(!dir.path().join("out/map.toml").exists());
        found
    };
    let band = "stabiliser = \"2 m/min\"\n";
    let one = refused(band, &all[..1], &["two distances"]);
    assert!(one.energy.is_ok() && one.response.is_none());
    assert_eq!(check(&one.verdict, "distance").status, Status::NotChecked);
    refused("", &all, &["stabiliser is not told"]);
    refused(
        "stabiliser = \"0 m/min\"\n",
        &all,
        &["0.150 m/min per mm", "held"],
    );
    refused(
        band,
        &other_wall(&[15.0, 14.0]),
        &["four of their uncertainties"],
    );
    // the layers in the wrong order
    let mut turned = all.clone();
    for (bead, other) in turned.iter_mut().zip(all.iter().rev()) {
        bead[0] = other[0];
    }
    refused(band, &turned, &["checks fail", "falling"]);
    // one that does not belong
    let mut astray = all.clone();
    astray[1][0] = 9.5;
    let found = refused(band, &astray, &["checks fail", "distance"]);
    assert_eq!(check(&found.verdict, "distance").status, Status::Fail);
    // a source that holds its feed
    let held: Vec<Bead> = all.iter().map(|b| [b[0], b[1], b[2], 6.3]).collect();
    let found = self::found(
        dir.path(),
        &file(
            dir.path(),
            &format!("{OTHER}stabiliser = \"0 m/min\"\n"),
            6.0,
            &held,
        ),
    )
    .unwrap();
    says(
        found.source.as_ref().unwrap(),
        &["slope = { value = 0.00000", "is held"],
    );
}

#[test]
fn what_is_wrong_with_records_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let good = file(dir.path(), X90, 8.0, &WALL);
    let text = std::fs::read_to_string(&good).unwrap();
    assert!(is_of_records(&good));
    let told = |from: &str, to: &str| {
        let file = write(dir.path(), "wrong.toml", text.replace(from, to));
        let found = found(dir.path(), &file);
        found.map(|f| f.verdict).map_err(|e| e.to_string())
    };
    let error = |from: &str, to: &str, words: &[&str]| says(&told(from, to).unwrap_err(), words);
    error(
        "voltage = \"U\"",
        "voltage = \"Uarc\"",
        &["no column \"Uarc\"", "\"U (V)\""],
    );
    error(
        "voltage = \"U\"",
        "voltage = \"I\"",
        &["I (A)", "voltage", "unit = \"V\""],
    );
    error(
        "[columns]",
        "ignition = \"200 mm\"\n[columns]",
        &["bead-1.csv", "bead-2.csv", "13.4", "ignition"],
    );
    error(
        "current = \"I\"",
        "current = { column = \"I\", scale = -1.0 }",
        &["wrong sign", "-190"],
    );
    error(
        "feed = \"feed\"",
        "feed = { column = \"feed\", scale = 0.0 }",
        &["no wire"],
    );
    error("time = \"t\"\n", "", &["columns.time"]);
    error("bead-2", "bead-3", &["bead-3.csv"]);
    error("distance = \"15 mm\"", "layer = 4", &["distance", "growth"]);
    error(
        "gas = \"m14\"",
        "gas = \"m14\"\nmap = \"er70s-6-0.9-cmt-m21\"",
        &["er70s-6-0.9", "x90-ig-1.0"],
    );
    // exchanged columns with the units that they should have
    let swapped =
        "voltage = { column = \"I\", unit = \"V\" }\ncurrent = { column = \"U\", unit = \"A\" }";
    let verdict = told("voltage = \"U\"\ncurrent = \"I\"", swapped).unwrap();
    assert_eq!(check(&verdict, "columns").status, Status::Fail);
    // feed in the wrong unit
    let verdict = told(
        "feed = \"feed\"",
        "feed = { column = \"feed\", unit = \"mm/s\" }",
    )
    .unwrap();
    assert_eq!(check(&verdict, "energy-most").status, Status::Fail);
    assert_eq!(check(&verdict, "feed-least").status, Status::Fail);
    // without the feed
    let verdict = told("feed = \"feed\"\n", "").unwrap();
    assert_eq!(check(&verdict, "feed-most").status, Status::NotChecked);
    assert!(warned(&verdict, "no-energy") && warned(&verdict, "no-response"));
    // a thicker wire than was fed
    let verdict = told("x90-ig-1.0", "g3si-1.2").unwrap();
    assert_eq!(check(&verdict, "energy-least").status, Status::Pass);
}

/// A record is of one bead: the same file, or a copy of it, at several distances would show that nothing changes with them.
#[test]
fn records_that_are_one_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let three = [
        [16.0, 16.8, 188.0, 10.2],
        [13.0, 16.33, 192.7, 9.58],
        [10.0, 15.87, 197.4, 8.96],
    ];
    let right = file(dir.path(), X90, 8.0, &three);
    found(dir.path(), &right).unwrap();
    let text = std::fs::read_to_string(&right).unwrap();
    let again = write(
        dir.path(),
        "again.toml",
        text.replace("bead-2.csv", "bead-1.csv"),
    );
    let told = found(dir.path(), &again).unwrap_err().to_string();
    assert!(
        told.contains("records 1 and 2 take the same time of bead-1.csv"),
        "{told}"
    );
    // two pieces of one file are two beads
    let halves = text
        .replace(
            "file = \"bead-1.csv\"",
            "file = \"bead-1.csv\"\nto = \"7 s\"",
        )
        .replace(
            "file = \"bead-2.csv\"",
            "file = \"bead-1.csv\"\nfrom = \"7 s\"",
        );
    found(dir.path(), &write(dir.path(), "halves.toml", halves)).unwrap();
    std::fs::copy(dir.path().join("bead-1.csv"), dir.path().join("bead-3.csv")).unwrap();
    let told = found(dir.path(), &right).unwrap_err().to_string();
    assert!(
        told.contains("bead-1.csv and bead-3.csv hold the same samples"),
        "{told}"
    );
}

/// A feed that was set and is written wrong makes a feed factor that is not the map's, which is told.
#[test]
fn a_feed_factor_beside_the_maps_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let head = format!("{X90}map = \"x90-ig-1.0-cmt-m14\"\n");
    let told = |set: f64| {
        let three = [
            [15.0, 16.65, 190.0, 9.3],
            [12.0, 16.2, 194.5, 8.7],
            [9.0, 15.7, 199.0, 8.1],
        ];
        let found = found(dir.path(), &file(dir.path(), &head, set, &three)).unwrap();
        warned(&found.verdict, "feed-beside-map")
    };
    assert!(!told(8.0));
    assert!(told(7.0));
}

/// Slow samples are told, but not where they show the pulses: 50 Hz at 500 Hz are ten samples a cycle, 120 Hz are four.
#[test]
fn pulses_that_slow_samples_show_are_pulses() {
    let dir = tempfile::tempdir().unwrap();
    let told = |frequency: f64| {
        let mut text = String::from("t (s),U (V),I (A),feed (m/min)\n");
        for k in 0..=8 * 500 {
            let time = f64::from(k) / 500.0;
            let lit = (0.2..7.8).contains(&time);
            let high = (time * frequency).fract() < 0.4;
            let [u, i, v] = match (lit, high) {
                (false, _) => [0.0; 3],
                (true, true) => [26.0, 330.0, 9.0],
                (true, false) => [17.0, 90.0, 9.0],
            };
            writeln!(text, "{time},{u},{i},{v}").unwrap();
        }
        let path = file(dir.path(), X90, 8.0, &WALL[..1]);
        write(dir.path(), "bead-1.csv", text);
        warned(&found(dir.path(), &path).unwrap().verdict, "slow-samples")
    };
    assert!(!told(50.0));
    assert!(told(120.0));
}
