//! The health test from records and from the simulated bench to its history.
use crate::support::{rows, says};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use meltpath::health::{Bench, Circumstances, HealthError, History, Subject, test};
use meltpath_base::{Reporter, Status};
use meltpath_scan_head::axis::plant::Plant;
use meltpath_scan_head::files;
use meltpath_scan_head::health::bench::{simulate_first_stage, simulate_second_stage};
use meltpath_scan_head::health::rating::Rating;
use meltpath_scan_head::health::signal::Km0Signal;

fn at(time: &str) -> Circumstances {
    Circumstances {
        time: time.to_owned(),
        temperature: Some(22.0),
        accept: false,
    }
}

fn simulated(folder: &Path, time: &str, changes: &[&str]) -> meltpath::health::Outcome {
    let subject = Subject::find("demo", "two-axis-150", "Y").unwrap();
    let changes = changes.iter().map(|c| (*c).to_owned()).collect();
    let bench = Bench::Simulated(changes);
    let outcome = test(&subject, &bench, folder, &at(time), &Reporter::new()).unwrap();
    super::names::in_style(&outcome.folder);
    outcome
}

#[test]
fn drift_is_told_against_the_history_with_fault_and_action() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("history");
    let first = simulated(&folder, "2026-01-05T08:00:00Z", &[]);
    assert_eq!((first.tests, first.rating), (1, Rating::Good));
    let same = simulated(&folder, "2026-02-05T08:00:00Z", &[]);
    assert_eq!(same.rating, Rating::Good);
    assert_eq!(same.verdict.status(), Status::Pass);
    let worn = simulated(&folder, "2026-03-05T08:00:00Z", &["coulomb=1.4"]);
    assert_eq!(worn.rating, Rating::Watch);
    let bad = simulated(&folder, "2026-04-05T08:00:00Z", &["coulomb=2"]);
    assert_eq!((bad.tests, bad.rating), (4, Rating::Intervene));
    assert_eq!(bad.verdict.status(), Status::Fail);
    let worst = bad.verdict.checks.first().unwrap();
    assert!(
        worst.remedy.as_ref().unwrap().contains("lubrication"),
        "{worst:?}"
    );
    let page = fs::read_to_string(bad.folder.join("report.html")).unwrap();
    says(
        &page,
        &[
            "intervention needed",
            "Coulomb torque",
            "2026-03-05",
            "lubrication",
        ],
    );
    // the file: one line a test, readable by anyone
    let history = History::open(&folder, "demo/two-axis-150/y").unwrap();
    assert_eq!(history.entries().len(), 4);
    assert!(
        history.entries()[3]
            .reasons
            .iter()
            .any(|r| r.contains("Coulomb"))
    );
    let file = folder.join("demo_two-axis-150_y.jsonl");
    let text = fs::read_to_string(&file).unwrap();
    let line: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(line["rating"], "intervene");
    assert_eq!(
        line["record"]["stage2"]["ramps"].as_array().unwrap().len(),
        20
    );

    // a broken line is named, and nothing is added; without it the history goes on
    fs::write(&file, format!("{text}{{\"schema\":\n")).unwrap();
    let subject = Subject::find("demo", "two-axis-150", "y").unwrap();
    let as_new = || {
        let (bench, when) = (Bench::Simulated(Vec::new()), at("2026-05-05T08:00:00Z"));
        test(&subject, &bench, &folder, &when, &Reporter::new())
    };
    let error = as_new().unwrap_err().to_string();
    says(&error, &["line 5", "remove the line"]);
    assert!(
        fs::read_to_string(&file)
            .unwrap()
            .ends_with("{\"schema\":\n")
    );
    fs::write(&file, text).unwrap();
    assert_eq!(as_new().unwrap().tests, 5);
}

/// Each part of an axis that is changed fails a check, whose remedy names that part; as it was, all passes. What was replaced on
/// purpose passes once it was accepted.
#[test]
fn remedies_of_a_drift_are_true() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("history");
    simulated(&folder, "2026-01-05T08:00:00Z", &[]);
    let time = "2026-02-05T08:00:00Z";
    for [change, id, named] in &rows(
        r"
        resistance=1.4 => drift-resistance => the coil
        inductance=1.4 => drift-inductance => short-circuited turns
        torque-constant=0.7 => drift-torque-constant => replace the galvanometer
        inertia=1.12 => drift-inertia => check the mirror
        mode=0.85 => drift-mode-1 => check the mount
        viscous=2 => drift-viscous-coefficient => replace the bearings
        coulomb=2 => drift-Coulomb-torque => replace the bearings",
    ) {
        let bad = simulated(&folder, time, &[change]);
        let failed = bad.verdict.checks.iter().find(|c| c.id == *id).unwrap();
        assert_ne!(failed.status, Status::Pass, "{failed:?}");
        let remedy = failed.remedy.as_ref().unwrap();
        assert!(
            remedy.starts_with("likely") && remedy.contains(named),
            "{remedy}"
        );
        // what is found by way of the coil sends there first
        let (part, _) = change.split_once('=').unwrap();
        let coil = ["resistance", "inductance", "torque-constant"].contains(&part);
        let coil_part = part.replace('-', " ");
        for other in bad.verdict.checks.iter().filter(|c| coil && c.id != *id) {
            let first = |remedy: &String| remedy.starts_with(&format!("mend what the {coil_part}"));
            assert!(
                other.remedy.as_ref().is_none_or(first),
                "{change}: {other:?}"
            );
        }
    }
    let mended = simulated(&folder, time, &[]);
    assert_eq!(mended.verdict.status(), Status::Pass, "{:?}", mended.drifts);
    // a mode that lies where none was is not that of before, which is not there: nothing is said of it
    let gone = simulated(&folder, time, &["mode=0.55"]).verdict;
    let mode = gone.checks.iter().find(|c| c.id == "drift-mode-1").unwrap();
    assert_eq!(mode.status, Status::CannotSay, "{mode:?}");
    says(&mode.reason, &["Hz of the accepted test is not found"]);
    assert!(
        gone.warnings.iter().any(|w| w.code == "modes"),
        "{:?}",
        gone.warnings
    );
    assert_ne!(gone.status(), Status::Pass);
    // in a first test the head's file says what is to be found
    let first = simulated(&dir.path().join("other"), time, &["mode=0.55"]).verdict;
    let mode = first
        .checks
        .iter()
        .find(|c| c.id == "drift-mode-1")
        .unwrap();
    says(&mode.reason, &["Hz of the head's file is not found"]);
    let subject = Subject::find("demo", "two-axis-150", "y").unwrap();
    let mirror = Bench::Simulated(vec!["inertia=1.12".to_owned()]);
    let accepted = Circumstances {
        accept: true,
        ..at(time)
    };
    test(&subject, &mirror, &folder, &accepted, &Reporter::new()).unwrap();
    let passed = simulated(&folder, time, &["inertia=1.12"]);
    assert_eq!(passed.verdict.status(), Status::Pass, "{:?}", passed.drifts);
}

#[test]
fn axes_heads_and_changes_that_are_none_are_named() {
    assert!(matches!(
        Subject::find("demo", "two-axis-150", "z"),
        Err(HealthError::Axis { .. })
    ));
    let error = Subject::find("demo", "nowhere", "x")
        .unwrap_err()
        .to_string();
    assert!(error.contains("three-axis-350"), "{error}");
    let dir = tempfile::tempdir().unwrap();
    let subject = Subject::find("demo", "two-axis-150", "x").unwrap();
    for change in ["coulomb", "colomb=2", "coulomb=-1", "coulomb=x"] {
        let bench = Bench::Simulated(vec![change.to_owned()]);
        let when = at("2026-01-05");
        let error = test(&subject, &bench, dir.path(), &when, &Reporter::new()).unwrap_err();
        assert!(error.to_string().contains("NAME=FACTOR"), "{error}");
    }
    let healthy = Bench::Simulated(Vec::new());
    let frozen = Circumstances {
        temperature: Some(-300.0),
        ..at("2026-01-05T08:00:00Z")
    };
    for (when, words) in [
        (at("yesterday"), "\"yesterday\" cannot be"),
        (at("2026-01-05T08:00:00"), "with its zone"),
        (frozen, "\"-300\" cannot be"),
    ] {
        let error = test(&subject, &healthy, dir.path(), &when, &Reporter::new()).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    // what a message says there is, there is
    let error = Subject::find("demo", "two-axis-150", "z")
        .unwrap_err()
        .to_string();
    let (_, axes) = error.split_once("it has ").unwrap();
    for axis in axes.split(", ") {
        assert!(
            Subject::find("demo", "two-axis-150", axis).is_ok(),
            "{axis}"
        );
    }
}

/// Records made by the simulated bench and written as another program would write them give the simulated test's own values.
#[test]
fn records_give_what_the_bench_gave() {
    let dir = tempfile::tempdir().unwrap();
    let head = files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text)
        .unwrap()
        .head;
    let axis = head.mirrors[1].motor().unwrap();
    let first = simulate_first_stage(axis, head.period).unwrap();
    let mut text = String::from("t,U,i,angle,asked\n");
    for k in 0..first.voltage.len() {
        writeln!(
            text,
            "{:.6},{},{:.9},{:.9},0",
            k as f64 * head.period,
            first.voltage[k],
            1e3 * first.current[k],
            first.angle[k].to_degrees()
        )
        .unwrap();
    }
    fs::write(dir.path().join("one.csv"), &text).unwrap();
    let signal = Km0Signal::for_axis(axis).samples(head.period).unwrap();
    let second = simulate_second_stage(axis, &signal, head.period).unwrap();
    let late = 777;
    let mut text = String::from("t,U,i,angle,asked\n");
    for k in 0..signal.set_points.len() + late {
        let j = k.saturating_sub(late);
        writeln!(
            text,
            "{:.6},{:.6},{:.9},{:.9},{:.9}",
            k as f64 * head.period,
            second.voltage[j],
            1e3 * second.current[j],
            second.angle[j].to_degrees(),
            signal.set_points[j].to_degrees()
        )
        .unwrap();
    }
    fs::write(dir.path().join("two.csv"), &text).unwrap();
    let mapping = "time = { column = \"t\", unit = \"s\" }\n[channels.voltage]\ncolumn = \"U\"\nunit = \"V\"\n\
        [channels.current]\ncolumn = \"i\"\nunit = \"mA\"\n[channels.angle]\ncolumn = \"angle\"\nunit = \"deg\"\n\
        [channels.set-point]\ncolumn = \"asked\"\nunit = \"deg\"\n";
    fs::write(dir.path().join("map.toml"), mapping).unwrap();
    let folder = dir.path().join("history");
    simulated(&folder, "2026-01-05T08:00:00Z", &[]);
    let subject = Subject::find("demo", "two-axis-150", "y").unwrap();
    // a voltage that was played in open loop has no set-points; the mapping of both records names them
    let bare = |line: &str| line.rsplit_once(',').unwrap().0.to_owned() + "\n";
    let open: String = fs::read_to_string(dir.path().join("one.csv"))
        .unwrap()
        .lines()
        .map(bare)
        .collect();
    fs::write(dir.path().join("open.csv"), open).unwrap();
    let tried = |second: &str, mapping: &str, history: &Path| {
        let bench = Bench::Records {
            first: dir.path().join("open.csv"),
            second: dir.path().join(second),
            mapping: dir.path().join(mapping),
        };
        let when = at("2026-02-05T08:00:00Z");
        test(&subject, &bench, history, &when, &Reporter::new())
    };
    let outcome = tried("two.csv", "map.toml", &folder).unwrap();
    assert_eq!(outcome.rating, Rating::Good, "{:?}", outcome.drifts[0]);
    for d in &outcome.drifts {
        assert!(d.change.abs() < 0.01, "{d:?}");
    }
    // without its set-points the second stage is taken to begin at once; what is said to record ends that
    let told = |outcome: &meltpath::health::Outcome| {
        let mut all = outcome.verdict.warnings.iter();
        all.any(|w| w.code == "no-set-point")
    };
    assert!(!told(&outcome));
    let blind = mapping.split_once("[channels.set-point]").unwrap().0;
    fs::write(dir.path().join("blind.toml"), blind).unwrap();
    let other = dir.path().join("blind");
    assert!(told(&tried("two.csv", "blind.toml", &other).unwrap()));
    // a record at another period than the head's
    let slow = text.lines().enumerate().filter(|(n, _)| n % 2 == 0);
    let slow: Vec<&str> = slow.map(|(_, line)| line).collect();
    fs::write(dir.path().join("slow.csv"), slow.join("\n")).unwrap();
    let refused = |second: &str| tried(second, "map.toml", &folder).unwrap_err().to_string();
    let error = refused("slow.csv");
    says(&error, &["record at the head's sample time"]);
    // another signal in the second stage: named, and the history stays as it was
    let error = refused("one.csv");
    assert!(error.contains("second stage"), "{error}");
    let history = History::open(&folder, &subject.name()).unwrap();
    assert_eq!(history.entries().len(), 2);
}

/// A head whose friction has another law wears, too; what its file lacks cannot.
#[test]
fn friction_of_any_law_grows_and_what_is_not_there_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    // the bias is of the printed law alone
    let lines = meltpath_data::scan_heads::TWO_AXIS_150.text.lines();
    let head: Vec<&str> = lines
        .map(|line| match line.split_once(" = ") {
            Some(("bias", _)) => "bias = { value = \"0 N·m\", source = \"none\" }",
            _ => line,
        })
        .collect();
    let laws = [
        "kind = \"karnopp\"\nstiction = { value = \"10 µN·m\", source = \"a guess\" }\n\
         rest = { value = \"0.001 rad/s\", source = \"a guess\" }\n",
        "kind = \"lugre\"\nstiction = { value = \"95 µN·m\", source = \"a guess\" }\n\
         stribeck = { value = \"0.5 rad/s\", source = \"a guess\" }\n\
         stiffness = { value = \"0.05 N·m/rad\", source = \"a guess\" }\n\
         damping = { value = \"1e-6 N·m·s/rad\", source = \"a guess\" }\n",
    ];
    for (n, law) in laws.iter().enumerate() {
        let file = dir.path().join(format!("own-{n}.toml"));
        fs::write(&file, format!("{}\n[y.friction]\n{law}", head.join("\n"))).unwrap();
        let tested = |change: &[&str]| {
            let subject = Subject::find("own", &file.display().to_string(), "y").unwrap();
            let bench = Bench::Simulated(change.iter().map(|c| (*c).to_owned()).collect());
            let history = dir.path().join(format!("history-{n}"));
            let when = at("2026-01-05T08:00:00Z");
            test(&subject, &bench, &history, &when, &Reporter::new())
        };
        tested(&[]).unwrap();
        let worn = tested(&["coulomb=3"]).unwrap();
        assert_eq!(worn.rating, Rating::Intervene, "{law}{:?}", worn.drifts);
        let coulomb = worn.drifts.iter().find(|d| d.quantity == "Coulomb torque");
        assert_eq!(coulomb.unwrap().rating, Rating::Intervene, "{law}");
    }
}

/// The first stage that is written does not drive the head's own motor into its stops.
#[test]
fn a_written_first_stage_stays_within_the_travel() {
    for (head, axis) in [
        ("two-axis-150", "x"),
        ("two-axis-150", "y"),
        ("three-axis-350", "x"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let subject = Subject::find("own", head, axis).unwrap();
        let folder = match subject.write_signal(&dir.path().join("signal")) {
            Ok(folder) => folder,
            Err(refused) => {
                let refused = refused.to_string();
                println!("{head} {axis}: {refused}");
                assert!(
                    refused.contains("with the position loop closed"),
                    "{refused}"
                );
                continue;
            }
        };
        let text = fs::read_to_string(folder.join("stage1.csv")).unwrap();
        let volts = text.lines().skip(1).map(|l| l.split(',').nth(1).unwrap());
        let volts: Vec<f64> = volts.map(|v| v.parse().unwrap()).collect();
        println!("{head} {axis}: {} V", volts[0]);
        let data = files::parse_head(match head {
            "two-axis-150" => meltpath_data::scan_heads::TWO_AXIS_150.text,
            _ => meltpath_data::scan_heads::THREE_AXIS_350.text,
        });
        let data = data.unwrap().head;
        let axis = data.mirrors[usize::from(axis == "y")]
            .motor()
            .unwrap()
            .clone();
        let mut plant = Plant::<5>::new(&axis.motor, &[data.period], 0.0);
        if axis.motor.modes.len() != 1 {
            continue;
        }
        let plant = plant.as_mut().unwrap();
        for volt in volts {
            plant.advance(0, volt, 0.0);
            assert!(plant.angle().abs() < axis.travel, "{head}");
        }
    }
}

/// A factor that no axis takes is told with what factors are.
#[test]
fn changes_have_a_factor_above_zero() {
    let dir = tempfile::tempdir().unwrap();
    let subject = Subject::find("demo", "two-axis-150", "Y").unwrap();
    for change in ["resistance=-1", "inertia=0"] {
        let bench = Bench::Simulated(vec![change.to_owned()]);
        let now = at("2026-01-05T08:00:00Z");
        let told = test(&subject, &bench, dir.path(), &now, &Reporter::new());
        let told = told.map(|_| ()).unwrap_err().to_string();
        assert!(told.contains("a FACTOR above zero"), "{told}");
    }
}
