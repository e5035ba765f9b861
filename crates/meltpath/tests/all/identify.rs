//! From a bench's file to a motor.
use crate::support::{says, write};
use std::fmt::Write;
use std::fs;
use std::path::Path;

use meltpath::identify::{Identification, IdentifyError, add_friction, identify};
use meltpath_base::{Reporter, Status};
use meltpath_numerics::random::Random;
use meltpath_perception::RecordError;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::axis::galvanometer::Galvanometer;
use meltpath_scan_head::axis::plant::Plant;
use meltpath_scan_head::files;
use meltpath_scan_head::servo::compare::run;

const MAPPING: &str = "time = { column = \"t\", unit = \"us\" }
[channels.voltage]
column = \"U\"
unit = \"V\"
[channels.current]
column = \"i\"
unit = \"mA\"
[channels.angle]
column = \"n\"
unit = \"deg\"
scale = 1e-5
offset = 1000000
";

/// A bench's record of the two-axis head's Y motor without dry friction, `samples` long: voltage of a pseudo-random
/// sequence, current held within `limit` A by the probe's range, angle in counts.
fn bench(motor: &Galvanometer, samples: u32, limit: f64) -> String {
    // steps so short that the plant's friction is that of the law
    let mut plant = Plant::<5>::new(motor, &[2e-6], 0.0).unwrap();
    let mut text = String::from("t,U,i,n\n");
    let mut register = 0x1u32;
    for k in 0..samples {
        // a shift register of 16 stages
        let bit = (register ^ (register >> 1) ^ (register >> 3) ^ (register >> 12)) & 1;
        register = (register >> 1) | (bit << 15);
        let voltage = if register & 1 == 1 { 0.5 } else { -0.5 };
        let counts = 1e6 + (plant.angle().to_degrees() * 1e5).round();
        writeln!(
            text,
            "{},{voltage},{:.4},{counts}",
            50 * k,
            1e3 * plant.current().clamp(-limit, limit)
        )
        .unwrap();
        for _ in 0..25 {
            plant.advance(0, voltage, 0.0);
        }
    }
    text
}

fn motor() -> Galvanometer {
    let head = files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text).unwrap();
    Galvanometer {
        friction: Friction::None,
        ..head.head.mirrors[1].motor().unwrap().motor.clone()
    }
}

#[test]
fn a_csv_of_counts_gives_the_motor_that_made_it() {
    let motor = motor();
    let text = bench(&motor, 90_000, f64::INFINITY);
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("bench.csv"), &text).unwrap();
    fs::write(at("map.toml"), MAPPING).unwrap();
    let found = identify(&at("bench.csv"), &at("map.toml"), &Reporter::new()).unwrap();
    let off = |a: f64, b: f64| (a / b - 1.0).abs();
    let got = &found.found.motor;
    assert!(off(got.resistance, motor.resistance) < 0.02, "{got:?}");
    assert!(off(got.inertia, motor.inertia) < 0.03, "{got:?}");
    assert!(
        off(got.torque_constant, motor.torque_constant) < 0.03,
        "{got:?}"
    );
    assert!(
        found.prediction.current.fit > 0.9,
        "{:?}",
        found.prediction.current
    );
    assert!(found.lines(&at("bench.csv"))[2].contains("Ω"));

    // angle and current exchanged: what comes out is no motor, or the record is noted as odd
    let swapped = MAPPING
        .replace("\"i\"", "\"x\"")
        .replace("\"n\"", "\"i\"")
        .replace("\"x\"", "\"n\"");
    fs::write(at("swapped.toml"), swapped).unwrap();
    let reporter = Reporter::new();
    let result = identify(&at("bench.csv"), &at("swapped.toml"), &reporter);
    let noted = reporter
        .warnings()
        .iter()
        .any(|w| w.code == "channels-exchanged");
    assert!(noted || result.is_err());
    let error = identify(&at("bench.csv"), &at("absent.toml"), &Reporter::new()).unwrap_err();
    assert!(matches!(
        error,
        IdentifyError::Record(RecordError::File { .. })
    ));
}

/// Whether a record gives a motor by a mapping, or why not.
fn tried(folder: &Path, record: &str, mapping: &str) -> Result<(), String> {
    let record = write(folder, "bench.csv", record);
    let mapping = write(folder, "map.toml", mapping);
    let found = identify(&record, &mapping, &Reporter::new());
    found.map(drop).map_err(|e| e.to_string())
}

#[test]
fn bad_records_are_named_with_what_to_change() {
    let folder = tempfile::tempdir().unwrap();
    let text = bench(&motor(), 3_000, f64::INFINITY);
    let refused = |record: &str, mapping: &str| tried(folder.path(), record, mapping).unwrap_err();
    let without = |gap: std::ops::Range<usize>| {
        let kept = text.lines().enumerate().filter(|(n, _)| !gap.contains(n));
        let kept: Vec<&str> = kept.map(|(_, line)| line).collect();
        kept.join("\n")
    };
    let gap = refused(&without(1001..1011), MAPPING);
    says(&gap, &["samples are missing", "rows = [1001, 2990]"]);
    let blank = text.replacen(&format!("\n{},", 50 * 2_000), "\n,", 1);
    let blank = refused(&blank, MAPPING);
    says(&blank, &["row 2001", "rows = [1, 2000]"]);
    let wrong_rate = refused(&text, &format!("sample_time = \"40 us\"\n{MAPPING}"));
    says(&wrong_rate, &["the mapping says 0.000040000 s"]);
    let missing = refused(&text, &MAPPING.replace("channels.current", "channels.amps"));
    assert!(missing.contains("[channels.current]"), "{missing}");
    let short = refused(&text, MAPPING);
    assert!(short.contains("record longer"), "{short}");
}

/// A record of ramps up and down of the two-axis head's Y axis, friction included: current in mA, angle in counts.
fn ramps() -> String {
    let head = files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text).unwrap();
    let mut set_points = vec![(-15f64).to_radians(); 2000];
    for speed in [20.0f64, 50.0, 100.0, 200.0, 400.0] {
        let step = speed.to_radians() * 50e-6;
        for sign in [1.0, -1.0] {
            let from = set_points.last().copied().unwrap();
            let count = (30f64.to_radians().min(0.25 * speed.to_radians()) / step) as usize;
            set_points.extend((1..=count).map(|k| from + sign * step * k as f64));
            let end = set_points.last().copied().unwrap();
            set_points.extend(vec![end; 600]);
        }
    }
    let record = run(head.head.mirrors[1].motor().unwrap(), &set_points, 50e-6, 1).unwrap();
    let mut text = String::from("t,U,i,n\n");
    for (k, (i, a)) in record.current.iter().zip(&record.angle).enumerate() {
        let counts = 1e6 + (a.to_degrees() * 1e5).round();
        writeln!(text, "{},0,{:.4},{counts}", 50 * k, 1e3 * i).unwrap();
    }
    text
}

#[test]
fn ramps_bring_the_friction_in_the_form_of_a_motors_file() {
    let motor = motor();
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("bench.csv"), bench(&motor, 90_000, f64::INFINITY)).unwrap();
    fs::write(at("ramps.csv"), ramps()).unwrap();
    fs::write(at("map.toml"), MAPPING).unwrap();
    let reporter = Reporter::new();
    let mut found = identify(&at("bench.csv"), &at("map.toml"), &reporter).unwrap();
    add_friction(&mut found, &at("ramps.csv"), &at("map.toml"), &reporter).unwrap();
    let lines = found.lines(&at("bench.csv"));
    let file: Vec<&str> = lines
        .iter()
        .map(String::as_str)
        .filter(|l| !l.starts_with('#'))
        .collect();
    let shipped = files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text).unwrap();
    let shipped = &shipped.head.mirrors[1].motor().unwrap().motor;
    let read = files::parse_motor(&file.join("\n"), shipped).unwrap().motor;
    let (
        Friction::Coulomb { coulomb, .. },
        Friction::Coulomb {
            coulomb: wanted, ..
        },
    ) = (read.friction, shipped.friction)
    else {
        unreachable!("the head has dry friction");
    };
    assert!((coulomb / wanted - 1.0).abs() < 0.1, "{coulomb} {wanted}");
    assert!(
        (read.viscous / shipped.viscous - 1.0).abs() < 0.25,
        "{} {}",
        read.viscous,
        shipped.viscous
    );
    // no mode, no share that it feels; written, it is the motor's
    assert!(found.found.felt.is_none() && read.felt == shipped.felt);
    let felt = r#"friction_felt = { value = "0.9 1", source = "identified" }"#;
    let read = files::parse_motor(felt, shipped).unwrap();
    assert_eq!((read.motor.felt, read.misfit), (0.9, None));
    // a share that the record does not tell is left out, one beyond its range is printed within it; a file holds no other
    for (told, line) in [
        ([-1.0, 754.0], "# friction_felt is undetermined"),
        ([1.04, 0.05], "friction_felt = { value = \"1.000 1\""),
        ([0.8, 0.05], "friction_felt = { value = \"0.800 1\""),
    ] {
        let mut found = found.clone();
        found.found.felt = Some(told);
        let lines = found.lines(&at("bench.csv"));
        let felt: Vec<_> = lines
            .iter()
            .filter(|l| l.contains("friction_felt"))
            .collect();
        assert!(felt.len() == 1 && felt[0].starts_with(line), "{lines:?}");
    }
    assert!(files::parse_motor(&felt.replace("0.9", "-50"), shipped).is_err());
    // a record without ramps, and one whose current is reversed
    let error = add_friction(&mut found, &at("bench.csv"), &at("map.toml"), &reporter).unwrap_err();
    assert!(error.to_string().contains("ramps"), "{error}");
    let reversed = MAPPING.replace("unit = \"mA\"", "unit = \"mA\"\nscale = -1.0");
    fs::write(at("reversed.toml"), reversed).unwrap();
    let error = add_friction(
        &mut found,
        &at("ramps.csv"),
        &at("reversed.toml"),
        &reporter,
    )
    .unwrap_err();
    assert!(error.to_string().contains("sign is reversed"), "{error}");
    let error = identify(&at("bench.csv"), &at("reversed.toml"), &reporter).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("the current answers against its cause"),
        "{error}"
    );
}

/// The record of a motor with noise of current (0.5 mA) and angle (8 microradians) on it.
fn noisy(motor: &Galvanometer, samples: u32) -> String {
    let mut random = Random::new(7);
    let text = bench(motor, samples, f64::INFINITY);
    let mut lines = text.lines();
    let head = lines.next().map(str::to_owned);
    let rows = lines.map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let [current, counts] = [2, 3].map(|k| cells[k].parse::<f64>().unwrap());
        let current = current + 0.5 * random.normal();
        let counts = counts + (8e-6f64.to_degrees() * 1e5 * random.normal()).round();
        format!("{},{},{current:.4},{counts}", cells[0], cells[1])
    });
    head.into_iter().chain(rows).collect::<Vec<_>>().join("\n")
}

/// Where the motor explains its record but for noise its deviations are told, and where friction of another law leaves more they are not;
/// the file that is printed carries that to whatever is judged with it.
#[test]
fn a_motor_that_does_not_explain_its_record_promises_nothing() {
    let dry = Friction::Coulomb {
        coulomb: 3e-5,
        bias: 2e-6,
    };
    let bristles = Friction::LuGre {
        coulomb: 3e-5,
        stiction: 4e-5,
        stribeck: 0.5,
        stiffness: 0.5,
        damping: 5e-6,
    };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("map.toml"), MAPPING).unwrap();
    for (friction, held) in [(dry, true), (bristles, false)] {
        let motor = Galvanometer {
            friction,
            ..motor()
        };
        fs::write(at("bench.csv"), noisy(&motor, 18_000)).unwrap();
        let reporter = Reporter::new();
        let found = identify(&at("bench.csv"), &at("map.toml"), &reporter).unwrap();
        let over = found.found.over_noise().map(Option::unwrap);
        let warned = reporter.warnings();
        let warned = warned.iter().any(|w| w.code == "motor-misfit");
        let wanted = if held {
            Status::Pass
        } else {
            Status::CannotSay
        };
        let verdict = found.verdict();
        assert_eq!(
            (verdict.status(), warned),
            (wanted, !held),
            "{over:?} {verdict:?}"
        );
        let lines = found.lines(&at("bench.csv")).join("\n");
        assert_eq!(lines.contains("± cannot say"), !held, "{lines}");
        assert_eq!(
            lines.contains("kg·m²\", source = \"identified from bench.csv, ± 0."),
            held,
            "{lines}"
        );
        let read = files::parse_motor(&lines, &motor).unwrap().misfit.unwrap();
        assert!(
            (read - over[0].max(over[1])).abs() < 1e-3,
            "{read} {over:?}"
        );
        if held {
            assert!(over.iter().all(|o| (o - 1.0).abs() < 0.05), "{over:?}");
            ramps_beside(&found, &motor, folder.path());
        } else {
            assert!(over[1] > 2.0, "{over:?}");
        }
    }
}

/// What is wrong with the ammeter while ramps are recorded, mA: what it reads beside, and what that grows by.
#[derive(Clone, Copy)]
struct Ammeter {
    beside: f64,
    drift: f64,
}

/// A record of a motor at constant speeds (deg/s) up and down, as the mapping has it, with noise of 0.5 mA.
fn at_speeds(motor: &Galvanometer, speeds: &[f64], ammeter: Ammeter) -> String {
    let Friction::Coulomb { coulomb, bias } = motor.friction else {
        unreachable!("the motor has dry friction");
    };
    let mut random = Random::new(11);
    let both = speeds.iter().flat_map(|s| [*s, -*s]);
    let speeds: Vec<f64> = both
        .flat_map(|s| [vec![0.0; 300], vec![s; 1_000]].concat())
        .collect();
    let (mut text, mut at) = (String::from("t,U,i,n\n"), 0.0);
    for (k, s) in speeds.iter().enumerate() {
        let (speed, sign) = (s.to_radians(), if *s == 0.0 { 0.0 } else { s.signum() });
        let torque = motor.viscous * speed + coulomb * sign + bias * sign.abs();
        let wrong = ammeter.beside + ammeter.drift * k as f64 / speeds.len() as f64;
        let current = 1e3 * torque / motor.torque_constant + wrong + 0.5 * random.normal();
        writeln!(
            text,
            "{},0,{current:.4},{}",
            50 * k,
            1e6 + f64::round(at * 1e5)
        )
        .unwrap();
        at += s * 50e-6;
    }
    text
}

/// Ramps that their friction explains, and that tell what the record tells, promise something; others cannot say, and say why.
fn ramps_beside(found: &Identification, motor: &Galvanometer, folder: &Path) {
    let many = [10.0, 30.0, 80.0, 200.0, 400.0];
    let right = Ammeter {
        beside: 0.0,
        drift: 0.0,
    };
    for (what, speeds, ammeter, check) in [
        ("right", &many[..], right, None),
        (
            "drifts",
            &many,
            Ammeter {
                drift: 2.0,
                ..right
            },
            Some("ramps-misfit"),
        ),
        (
            "beside",
            &many,
            Ammeter {
                beside: 0.5,
                ..right
            },
            Some("ramps-record"),
        ),
        ("two speeds", &[10.0, 400.0], right, Some("ramps-misfit")),
    ] {
        let text = at_speeds(motor, speeds, ammeter);
        let record = write(folder, "ramps.csv", text);
        let mut found = found.clone();
        add_friction(
            &mut found,
            &record,
            &folder.join("map.toml"),
            &Reporter::new(),
        )
        .unwrap();
        let (verdict, lines) = (found.verdict(), found.lines(&record).join("\n"));
        let status = if check.is_some() {
            Status::CannotSay
        } else {
            Status::Pass
        };
        assert_eq!(verdict.status(), status, "{what}: {verdict:?}");
        let failed = |id: &str| {
            verdict
                .checks
                .iter()
                .any(|c| c.id == id && c.status == status)
        };
        assert!(check.is_none_or(failed), "{what}: {verdict:?}");
        assert_eq!(
            lines.contains("ramps, ± cannot say"),
            check.is_some(),
            "{what}: {lines}"
        );
    }
}

/// A motor is one for all of its record: what changes after the part that was fitted fails. An ammeter that reads beside zero, and a record
/// that begins in motion, are as good as others.
#[test]
fn the_unseen_part_is_judged_wherever_the_record_begins() {
    let motor = Galvanometer {
        friction: Friction::Coulomb {
            coulomb: 3e-5,
            bias: 2e-6,
        },
        ..motor()
    };
    let text = noisy(&motor, 27_000);
    let folder = tempfile::tempdir().unwrap();
    let record = |keep: std::ops::Range<usize>, changed: &dyn Fn(usize, f64) -> f64| {
        let rows = text
            .lines()
            .enumerate()
            .filter(|(n, _)| *n == 0 || keep.contains(n));
        let rows = rows.map(|(n, line)| {
            let cells: Vec<&str> = line.split(',').collect();
            match cells[2].parse::<f64>() {
                Ok(current) => {
                    let current = changed(n, current);
                    format!("{},{},{current:.4},{}", cells[0], cells[1], cells[3])
                }
                Err(_) => line.to_owned(),
            }
        });
        let record = write(
            folder.path(),
            "bench.csv",
            rows.collect::<Vec<_>>().join("\n"),
        );
        let mapping = write(folder.path(), "map.toml", MAPPING);
        let found = identify(&record, &mapping, &Reporter::new()).unwrap();
        let lines = found.lines(&record).join("\n");
        println!(
            "{:?} {:?}",
            found.found.over_noise(),
            found.unseen_over_noise()
        );
        (found, lines)
    };
    let all = 0..usize::MAX;
    // a channel that reads a fifth more from three quarters of the record on
    let (other, _) = record(all.clone(), &|n, i| if n > 20_000 { 1.2 * i } else { i });
    let verdict = other.verdict();
    let check = verdict
        .checks
        .iter()
        .find(|c| c.id == "current-unseen")
        .unwrap();
    assert_eq!(
        (verdict.status(), check.status),
        (Status::Fail, Status::Fail)
    );
    let (beside, lines) = record(all, &|_, current| current + 30.0);
    assert_eq!(
        beside.verdict().status(),
        Status::Pass,
        "{:?}",
        beside.verdict()
    );
    assert!(
        (beside.found.zero[0] - 0.030).abs() < 1e-4,
        "{:?}",
        beside.found.zero
    );
    assert!(lines.contains("mA) where none flows"), "{lines}");
    assert!(!beside.moving, "{lines}");
    let (cut, lines) = record(9_000..usize::MAX, &|_, current| current);
    assert_eq!(cut.verdict().status(), Status::Pass, "{:?}", cut.verdict());
    assert!(cut.moving && lines.contains("begins in motion"), "{lines}");
    assert!(cut.prediction.angle.fit > 0.9, "{:?}", cut.prediction.angle);
}

#[test]
fn a_probe_at_the_end_of_its_range_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let peak = bench(&motor(), 6_000, f64::INFINITY)
        .lines()
        .skip(1)
        .map(|l| l.split(',').nth(2).unwrap().parse::<f64>().unwrap().abs())
        .fold(0.0, f64::max)
        * 1e-3;
    fs::write(at("bench.csv"), bench(&motor(), 90_000, 0.5 * peak)).unwrap();
    fs::write(at("map.toml"), MAPPING).unwrap();
    let reporter = Reporter::new();
    let result = identify(&at("bench.csv"), &at("map.toml"), &reporter);
    let warnings = reporter.warnings();
    let noted = warnings.iter().find(|w| w.code == "channel-saturated");
    assert!(
        noted.is_some_and(|w| w.message.contains("current") && w.remedy.is_some()),
        "{warnings:?} {result:?}"
    );
}

/// What a complaint about a record says to write in the mapping, or to record, is done; a motor is found then.
#[test]
fn remedies_of_a_bad_record_are_true() {
    let folder = tempfile::tempdir().unwrap();
    let text = bench(&motor(), 30_000, f64::INFINITY);
    let tried = |record: &str, mapping: &str| tried(folder.path(), record, mapping);
    let kept = |keep: &dyn Fn(usize) -> bool| {
        let lines = text.lines().enumerate().filter(|(n, _)| keep(*n));
        lines.map(|(_, line)| line).collect::<Vec<_>>().join("\n")
    };
    let whole = |error: &str| {
        let rows = &error[error.find("rows = [").unwrap()..];
        format!("{}\n{MAPPING}", &rows[..=rows.find(']').unwrap()])
    };
    let gap = kept(&|n| !(1001..1011).contains(&n));
    let blank = text.replacen(&format!("\n{},", 50 * 26_000), "\n,", 1);
    for record in [&gap, &blank] {
        let error = tried(record, MAPPING).unwrap_err();
        assert_eq!(tried(record, &whole(&error)), Ok(()), "{error}");
    }
    let turned = MAPPING.replace("unit = \"mA\"", "unit = \"mA\"\nscale = -1.0");
    for (record, mapping, named) in [
        (
            &text,
            format!("sample_time = \"40 us\"\n{MAPPING}"),
            "correct or remove sample_time",
        ),
        (
            &text,
            MAPPING.replace("channels.current", "channels.amps"),
            "add [channels.current]",
        ),
        (
            &text,
            MAPPING.replace("\"i\"", "\"I\""),
            "it has \"t\", \"U\", \"i\", \"n\"",
        ),
        (&text, turned, "a negative `scale` in the mapping turns it"),
        (&kept(&|n| n < 3_000), MAPPING.to_owned(), "record longer"),
    ] {
        let error = tried(record, &mapping).unwrap_err();
        assert!(error.contains(named), "{error}");
    }
    let upside_down = text.lines().map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        match cells[2].parse::<f64>() {
            Ok(current) => format!("{},{},{},{}\n", cells[0], cells[1], -current, cells[3]),
            Err(_) => format!("{line}\n"),
        }
    });
    let upside_down: String = upside_down.collect();
    let error = tried(&upside_down, MAPPING).unwrap_err();
    assert!(error.contains("a negative `scale`"), "{error}");
    let turned = MAPPING.replace("unit = \"mA\"", "unit = \"mA\"\nscale = -1.0");
    assert_eq!(tried(&upside_down, &turned), Ok(()));
    assert_eq!(tried(&text, MAPPING), Ok(()));
}
