//! From a tuning file to controllers, and from controllers to a whole job.
use crate::support::{check, says, write};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use meltpath::outcome::RunFolder::NextIn;
use meltpath::{chain, tune};
use meltpath_base::{Silent, Status};
use meltpath_scan_head::axis::control::Controller;
use meltpath_scan_head::files;
use meltpath_scan_head::servo::compare::{MultiStep, run};
use meltpath_scan_head::servo::file::ControllerFile;

/// A tuning that takes a second.
const SHORT: &str = "head = \"two-axis-150\"
[cascade.refine]
on = \"nothing\"
[robust]
mode_shift = \"5 %\"
delay = \"0 us\"
particles = 6
iterations = 3
[compare]
hold = \"10 ms\"
levels = 4
draws = 4
";

fn tuned(folder: &Path, text: &str) -> Result<meltpath::outcome::Outcome, String> {
    fs::write(folder.join("tune.toml"), text).unwrap();
    tune::tune(
        &folder.join("tune.toml"),
        NextIn(&folder.join("runs")),
        &Silent,
    )
    .map_err(|e| e.to_string())
}

/// What a drive needs beside an exported law is told where the law leaves.
fn tells_the_drive(folder: &Path) {
    // the drive's current regulator is told with the controller that needs it, and what becomes of it with the head's own
    let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    says(
        &read("controller-y.c"),
        &[
            "Set the drive's current regulator",
            "V/A",
            "backward Euler at every T",
            "double controller_y_drive(",
            "set-point and measured angle in rad",
            "the error of the angle in deg",
        ],
    );
    says(
        &read("controller-y.json"),
        &[
            "current_regulator",
            "gain_V_per_A",
            "feed_forward",
            "gain_A_s2_per_rad",
            "error of the angle, deg",
        ],
    );
    let own = "the head's file has K = 2.15 V/A, T = 80 µs, with which the distance to the critical point is 0.";
    says(
        &read("verdict.json"),
        &[
            "y-current",
            "set the drive to it",
            own,
            "y-feed-forward",
            "controller_y_drive",
        ],
    );
}

#[test]
fn a_head_is_tuned_and_a_whole_job_runs_with_what_was_exported() {
    let place = tempfile::tempdir().unwrap();
    let outcome = tuned(place.path(), SHORT).unwrap();
    assert_ne!(
        outcome.verdict.status(),
        Status::Fail,
        "{:?}",
        outcome.verdict
    );
    for name in [
        "report.html",
        "verdict.json",
        "provenance.json",
        "tuning.json",
        "tune.toml",
        "controllers.json",
        "controller-x.c",
        "controller-x.json",
        "controller-y.mat",
        "multi-step-y.csv",
    ] {
        assert!(outcome.folder.join(name).is_file(), "{name}");
    }
    let page = fs::read_to_string(outcome.folder.join("report.html")).unwrap();
    // frequencies on decades
    says(
        &page,
        &[
            "after the synthesis",
            "those of the head&#39;s file",
            "Current loop, open: phase",
            "10000",
            "Scattered motors",
        ],
    );
    tells_the_drive(&outcome.folder);
    let text = fs::read_to_string(outcome.folder.join("controllers.json")).unwrap();
    let file: ControllerFile = serde_json::from_str(&text).unwrap();
    assert_eq!(file.axes.len(), 2);

    let job = |controller: &str| {
        format!(
            "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"two-axis-150\"\nrecipes = [\"industrial\"]\ncontroller = \"{controller}\"\n[plate]\nblock = [1, 1]\n[checks]\ncontour_error = \"300 µm\"\ncontour_share = \"90 %\"\n"
        )
    };
    let run = |controller: &str| {
        let path = write(place.path(), "job.toml", job(controller));
        chain::run(&path, NextIn(&place.path().join("jobs")), &Silent).map_err(|e| e.to_string())
    };
    // with the most friction of the head's file a preview on the cascade strays; the other leaves a millimetre dark where contours begin
    let both = [("cascade", Status::CannotSay), ("h-infinity", Status::Fail)];
    for (controller, status) in both {
        let previewed = run(&format!("{controller}\"\npath = \"preview")).unwrap();
        assert_eq!(
            previewed.verdict.status(),
            status,
            "{controller} {:?}",
            previewed.verdict
        );
    }
    for controller in ["runs/001/controllers.json", "h-infinity"] {
        let done = run(controller).unwrap();
        // contours are followed whatever the friction; with the most of it light comes late where they begin
        let contours = check(&done.verdict, "contour-1").status;
        assert_eq!(contours, Status::Pass, "{:?}", done.verdict);
        assert_ne!(done.verdict.status(), Status::Fail, "{:?}", done.verdict);
        let told = fs::read_to_string(done.folder.join("provenance.json")).unwrap();
        assert!(told.contains(controller) && told.contains("lpbf.prefilter"));
    }
    let error = run("pid").unwrap_err();
    assert!(error.contains("h-infinity"), "{error}");
    // a file that holds another axis only
    let only = ControllerFile {
        axes: file.axes[1..].to_vec(),
        ..file
    };
    fs::write(
        place.path().join("only.json"),
        serde_json::to_string(&only).unwrap(),
    )
    .unwrap();
    let error = run("only.json").unwrap_err();
    assert!(error.contains("no controller for the x axis"), "{error}");
}

#[test]
fn an_identified_motor_takes_the_place_of_the_heads() {
    let place = tempfile::tempdir().unwrap();
    fs::write(
        place.path().join("motor.toml"),
        "inertia = { value = \"6e-8 kg·m²\", source = \"bench\" }\nmisfit = { value = \"12 1\", source = \"bench\" }\n",
    )
    .unwrap();
    let text = SHORT
        .replace(
            "[cascade",
            "axes = [\"y\"]\nmotor.y = \"motor.toml\"\n[cascade",
        )
        .replace("\"5 %\"", "\"0 %\"")
        + "[export]\ncontroller = \"cascade\"\n";
    let outcome = tuned(place.path(), &text).unwrap();
    let json = fs::read_to_string(outcome.folder.join("controllers.json")).unwrap();
    let file: ControllerFile = serde_json::from_str(&json).unwrap();
    assert!((file.axes[0].motor.inertia - 6e-8).abs() < 1e-15);
    // its figures promise nothing: it left twelve times the noise of its record
    let status = check(&outcome.verdict, "y-motor").status;
    assert_eq!(status, Status::CannotSay, "{:?}", outcome.verdict);
    assert_ne!(outcome.verdict.status(), Status::Pass);
    assert!(json.contains("\"cascade\""));
}

#[test]
fn refined_gains_are_shown_with_their_runs_and_never_follow_worse() {
    let place = tempfile::tempdir().unwrap();
    let text = |refine: &str| {
        SHORT
            .replace(
                "[cascade.refine]\non = \"nothing\"",
                &format!("axes = [\"y\"]\n[cascade.refine]\n{refine}"),
            )
            .replace("\"5 %\"", "\"0 %\"")
            + "[export]\ncontroller = \"cascade\"\n"
    };
    let rms = |refine: &str| {
        let outcome = tuned(place.path(), &text(refine)).unwrap();
        let page = fs::read_to_string(outcome.folder.join("report.html")).unwrap();
        let json = fs::read_to_string(outcome.folder.join("tuning.json")).unwrap();
        let told: serde_json::Value = serde_json::from_str(&json).unwrap();
        (page, told)
    };
    let (page, plain) = rms("on = \"nothing\"");
    assert!(!page.contains("Refinement") && plain[0]["refined"].is_null());
    let (page, told) = rms("particles = 10\niterations = 12");
    says(
        &page,
        &[
            "Refinement: the swarm",
            "heavier, modes lower, coil warm, late, noise",
            "as the head has it",
        ],
    );
    // the gains that leave are the swarm's, or those of the start with a warning
    let axis = &told[0];
    let kept = axis["cascade"] == axis["refined"]["gains"];
    assert_eq!(axis["synthesis"], plain[0]["synthesis"]);
    assert_eq!(page.contains("The gains of the synthesis are kept"), !kept);
    let error = |told: &serde_json::Value| {
        let all = told[0]["candidates"].as_array().unwrap();
        all[0]["rms_deg"].as_f64().unwrap()
    };
    assert!(error(&told) <= error(&plain));
}

/// A bench's multi-step of the two-axis head's Y axis, whose drive has other gains than the synthesis finds: CSV in degrees.
fn multi_step() -> String {
    let head = files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text).unwrap();
    let mut axis = head.head.mirrors[1].motor().unwrap().clone();
    let Controller::Cascade(gains) = &mut axis.controller else {
        unreachable!("the shipped head has a cascade");
    };
    // table 2.1 of the thesis, after the swarm
    gains.speed_integral_time = 0.005;
    gains.position_gain = 24.0;
    gains.position_derivative_time = 0.09;
    let signal = MultiStep {
        hold: 10e-3,
        levels: 4,
        ..MultiStep::thesis()
    };
    let set_points = signal.samples(head.head.period).unwrap();
    let angles = run(&axis, &set_points, head.head.period, 1).unwrap().angle;
    let mut text = String::from("set,encoder\n");
    for (s, a) in set_points.iter().zip(angles) {
        writeln!(text, "{:.6},{:.6}", s.to_degrees(), a.to_degrees()).unwrap();
    }
    text
}

#[test]
fn gains_are_refined_on_a_record_of_the_drive() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("bench.csv"), multi_step()).unwrap();
    let mapping = |time: &str| {
        let text = format!(
            "sample_time = \"{time}\"\n[channels.set-point]\ncolumn = \"set\"\nunit = \"deg\"\n[channels.angle]\ncolumn = \"encoder\"\nunit = \"deg\"\n"
        );
        fs::write(place.path().join("map.toml"), text).unwrap();
    };
    let text = SHORT
        .replace(
            "[cascade.refine]\non = \"nothing\"",
            "axes = [\"y\"]\n[cascade.refine]\non = \"record\"\nrecord = \"bench.csv\"\nmapping = \"map.toml\"\niterations = 60",
        )
        .replace("\"5 %\"", "\"0 %\"")
        + "[export]\ncontroller = \"cascade\"\n";
    mapping("50 us");
    let outcome = tuned(place.path(), &text).unwrap();
    let json = fs::read_to_string(outcome.folder.join("tuning.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&json).unwrap();
    let refined = &told[0]["refined"];
    let run = &refined["runs"][0];
    let [before, after] = ["rms_before_deg", "rms_after_deg"].map(|key| run[key].as_f64().unwrap());
    assert_eq!(run["name"], "the record");
    assert!(after < 0.2 * before, "{before} {after}");
    // towards what the drive has, away from what the synthesis would give it; one record does not tell all eight apart
    let product = |gains: &serde_json::Value| {
        let of = |key: &str| gains[key].as_f64().unwrap();
        of("position_gain") * of("position_derivative_time")
    };
    let [start, found] =
        [&told[0]["synthesis"], &refined["gains"]].map(|g| (product(g) - 24.0 * 0.09).abs());
    assert!(found < 0.5 * start, "{found} {start}");
    assert_eq!(told[0]["cascade"], refined["gains"]);
    // a record at another rate is refused, with both rates
    mapping("40 us");
    let error = tuned(place.path(), &text).unwrap_err();
    assert!(error.contains("40") && error.contains("50"), "{error}");
}

#[test]
fn the_focus_axis_gets_an_h_infinity_controller() {
    let place = tempfile::tempdir().unwrap();
    let text = SHORT
        .replace("two-axis-150", "three-axis-350")
        .replace("[cascade", "axes = [\"z\"]\n[cascade")
        .replace("\"5 %\"", "\"0 %\"")
        + "[export]\ncontroller = \"h-infinity\"\n";
    let outcome = tuned(place.path(), &text).unwrap();
    let json = fs::read_to_string(outcome.folder.join("controllers.json")).unwrap();
    let file: ControllerFile = serde_json::from_str(&json).unwrap();
    assert_eq!((file.axes.len(), file.axes[0].axis), (1, 'z'));
    let json = fs::read_to_string(outcome.folder.join("tuning.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&json).unwrap();
    // continuous and sampled
    for loops in told[0]["h_infinity"]["loops"].as_array().unwrap() {
        assert_eq!(loops["stable"], true);
        assert!(loops["modulus_margin"].as_f64().unwrap() > 0.4, "{loops}");
    }
    let [cascade, h_infinity] =
        [0, 1].map(|k| told[0]["candidates"][k]["rms_deg"].as_f64().unwrap());
    assert!(h_infinity < 2.0 * cascade, "{h_infinity} {cascade}");
}

#[test]
fn mistakes_are_named() {
    let place = tempfile::tempdir().unwrap();
    for (wrong, right, expected) in [
        ("two-axis-150", "four-axis", "three-axis-350"),
        ("[cascade", "axes = [\"z\"]\n[cascade", "no z axis"),
        ("[cascade", "axes = []\n[cascade", "1 or more"),
        ("draws = 4", "draw = 4", "draw"),
        (
            "levels = 4",
            "levels = 4\namplitude = \"25 deg\"",
            "travels",
        ),
        ("\"nothing\"", "\"record\"", "mapping"),
        ("\"nothing\"", "\"tracking\"\nslower = \"100 %\"", "slower"),
        (
            "[cascade",
            "[h-infinity]\nsensitivity = { low = 0.001, high = 0.9, crossover = \"3000 rad/s\" }\n[cascade",
            "three templates",
        ),
        (
            "[cascade",
            "[h-infinity]\nsensitivity = { low = 0.001, high = 0.9, crossover = \"3000 rad/s\" }\ncommand = { low = 55.0, high = 0.1, crossover = \"5e5 rad/s\" }\ndisturbance = { low = 15.0, high = 0.9, crossover = \"300 rad/s\" }\n[cascade",
            "never crosses 1",
        ),
        (
            "[cascade",
            "[h-infinity]\nbandwidth = \"3000\"\n[cascade",
            "rad/s",
        ),
        (
            "[cascade.refine]",
            "[cascade]\nfirst_maximum = [\"600 us\", \"300 us\", \"1 ms\"]\n[cascade.refine]",
            "not below",
        ),
        (
            "draws = 4",
            "draws = 4\n[export]\nword = \"fixed\"\nbits = [31, 22]",
            "fit",
        ),
        ("delay = \"0 us\"", "delay = \"1 s\"", "robust.delay"),
        (
            "delay = \"0 us\"",
            "modulus_margin = 0.0",
            "robust.modulus_margin",
        ),
        (
            "delay = \"0 us\"",
            "modulus_margin = -1.0",
            "robust.modulus_margin",
        ),
        ("delay = \"0 us\"", "order = 2", "robust.order is 2"),
        ("delay = \"0 us\"", "resonance = 0.1", "robust.resonance"),
        ("\"5 %\"", "\"500 %\"", "robust.mode_shift"),
        (
            "[cascade",
            "axes = [\"y\"]\n[h-infinity]\nbandwidth = \"60000 rad/s\"\n[cascade",
            "write a lower h-infinity.bandwidth",
        ),
    ] {
        let error = tuned(place.path(), &SHORT.replace(wrong, right)).unwrap_err();
        assert!(error.contains(expected), "{expected}: {error}");
    }
    assert!(
        !place.path().join("runs").exists(),
        "nothing is left behind"
    );
}

/// A controller for motors that differ that cannot be found is told, with what was in its way; it fails where it was asked for. What is not drawn
/// is told, too.
#[test]
fn a_robust_controller_that_is_not_found_is_told() {
    let place = tempfile::tempdir().unwrap();
    let text = SHORT
        .replace("[cascade", "axes = [\"y\"]\n[cascade")
        .replace("particles = 6", "resonance = 1.0\nparticles = 6")
        .replace("draws = 4", "draws = 0");
    let verdict = tuned(place.path(), &text).unwrap().verdict;
    let robust = check(&verdict, "y-robust");
    assert_eq!(robust.status, Status::Warn, "{robust:?}");
    says(
        &robust.reason,
        &["largest gain", "the H-infinity controller leaves"],
    );
    says(robust.remedy.as_ref().unwrap(), &["robust.resonance"]);
    assert_eq!(check(&verdict, "y-scatter").status, Status::NotChecked);
    let asked = text + "[export]\ncontroller = \"robust\"\n";
    let verdict = tuned(place.path(), &asked).unwrap().verdict;
    assert_eq!(check(&verdict, "y-robust").status, Status::Fail);
}

/// An unstable loop fails with the smallest distance that may be asked for; one that comes too near since its controller acts seldom is told so.
#[test]
fn an_unstable_loop_fails_whatever_the_limit() {
    let place = tempfile::tempdir().unwrap();
    let mode = |robust: &str, export: &str| {
        let text = SHORT
            .replace("[cascade", "axes = [\"y\"]\n[cascade")
            .replace("delay = \"0 us\"\n", robust)
            .replace("\"5 %\"", "\"10 %\"")
            + "[export]\ncontroller = \"h-infinity\"\n"
            + export;
        let verdict = tuned(place.path(), &text).unwrap().verdict;
        check(&verdict, "y-mode").clone()
    };
    let unstable = mode("modulus_margin = 0.01\n", "");
    assert_eq!(unstable.status, Status::Fail, "{unstable:?}");
    says(&unstable.reason, &["unstable"]);
    let seldom = mode("", "every = 2\n");
    assert_eq!(seldom.status, Status::Fail, "{seldom:?}");
    says(seldom.remedy.as_ref().unwrap(), &["export.every = 1"]);
}

/// What would be tuned twice is told at its key.
#[test]
fn an_axis_is_named_once() {
    let place = tempfile::tempdir().unwrap();
    let text = SHORT.replace("[cascade", "axes = [\"y\", \"x\", \"y\"]\n[cascade");
    let told = tuned(place.path(), &text).unwrap_err();
    assert!(told.contains("axes names y twice"), "{told}");
}

/// A motor of an axis that is not tuned does nothing: it is refused.
#[test]
fn motors_of_other_axes_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let text = SHORT.replacen('\n', "\naxes = [\"y\"]\nmotor.x = \"own.toml\"\n", 1);
    let told = tuned(place.path(), &text).unwrap_err();
    says(&told, &["motor.x is given", "axes does not name x"]);
}

/// A sampled cascade has no distance that its continuous loop would have, here by three modes that are hardly damped.
#[test]
fn a_cascade_that_loses_motors_has_no_distance() {
    let place = tempfile::tempdir().unwrap();
    let mut motor = String::new();
    for (name, value) in [
        ("resistance", "1.35 Ω"),
        ("inductance", "260 µH"),
        ("torque_constant", "9.4e-3 N·m/A"),
        ("back_emf", "9.4e-3 V·s/rad"),
        ("inertia", "1.1e-7 kg·m²"),
        ("viscous", "8e-6 N·m·s/rad"),
        ("coulomb", "9e-5 N·m"),
        ("bias", "1.5e-5 N·m"),
    ] {
        writeln!(
            motor,
            "{name} = {{ value = \"{value}\", source = \"own\" }}"
        )
        .unwrap();
    }
    for (frequency, damping, gain) in [(2900, 0.002, 0.4), (4100, 0.003, 0.3), (8300, 0.004, 0.2)] {
        writeln!(
            motor,
            "[[mode]]\nfrequency = {{ value = \"{frequency} Hz\", source = \"own\" }}\ndamping = {{ value = {damping}, source = \"own\" }}\ngain_ratio = {{ value = {gain}, source = \"own\" }}"
        )
        .unwrap();
    }
    fs::write(place.path().join("own.toml"), motor).unwrap();
    // refined gains keep their distance from the critical point here, and written ones do not
    let text = SHORT
        .replacen('\n', "\naxes = [\"y\"]\nmotor.y = \"own.toml\"\n", 1)
        .replace("[cascade.refine]\non = \"nothing\"\n", "")
        + "[export]\ncontroller = \"cascade\"\n";
    let verdict = tuned(place.path(), &text).unwrap().verdict;
    let distance = check(&verdict, "y-mode");
    assert_eq!(distance.status, Status::Fail, "{distance:?}");
    says(&distance.reason, &["with the modes at"]);
}

/// The two-axis head's cascade swings with voltages half a sample late, whether scattered motors are drawn or not.
#[test]
fn a_cascade_is_judged_as_it_runs_with_late_voltages() {
    let place = tempfile::tempdir().unwrap();
    for (delay, status) in [("0 us", Status::Pass), ("25 us", Status::Fail)] {
        let text = SHORT
            .replacen('\n', "\naxes = [\"y\"]\n", 1)
            .replace(
                "\"5 %\"\ndelay = \"0 us\"",
                &format!("\"0 %\"\ndelay = \"{delay}\"\nmodulus_margin = 0.45"),
            )
            .replace("draws = 4", "draws = 0")
            + "[export]\ncontroller = \"cascade\"\n";
        let verdict = tuned(place.path(), &text).unwrap().verdict;
        let distance = check(&verdict, "y-mode");
        assert_eq!(distance.status, status, "{distance:?}");
        if status == Status::Fail {
            says(&distance.reason, &["unstable", "25.0 µs late"]);
        }
    }
}

/// A short word moves poles and zeros: what is told is what is left then, in the distance and in the scattered motors.
#[test]
fn a_rounded_controller_is_judged_as_it_leaves() {
    let place = tempfile::tempdir().unwrap();
    let distance = |word: &str| {
        let text = SHORT
            .replacen('\n', "\naxes = [\"y\"]\n", 1)
            .replace("\"5 %\"", "\"0 %\"")
            .replace("draws = 4", "draws = 0")
            + &format!("[export]\ncontroller = \"h-infinity\"\n{word}\n");
        let verdict = tuned(place.path(), &text).unwrap().verdict;
        let distance = check(&verdict, "y-mode");
        (distance.value.as_ref().unwrap().value, distance.status)
    };
    let (exact, long, short) = (
        distance("word = \"double\""),
        distance("word = \"fixed\"\nbits = [22, 22]"),
        distance("word = \"fixed\"\nbits = [6, 22]"),
    );
    assert!((long.0 / exact.0 - 1.0).abs() < 1e-3, "{exact:?} {long:?}");
    assert!(
        (short.0 / exact.0 - 1.0).abs() > 0.02,
        "{exact:?} {short:?}"
    );
}
