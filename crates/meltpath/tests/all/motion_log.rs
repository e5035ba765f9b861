//! `meltpath measure` of a log of the tool: `[motion]` for a cell, and controllers of another form.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::support::{check, has_files, says, warned, write};
use meltpath::data::Cell;
use meltpath::motion_log::{Found, MotionLogError, is_of_motion, motion_log};
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath_base::{Silent, Status};
use meltpath_data::{cells, find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_numerics::random::Random;

/// Filters of the made-up controller, and its dwell at 50 %, s.
const FILTERS: [f64; 2] = [0.12, 0.06];
const DWELL: f64 = 0.04;
/// Turns at the points, degrees.
const TURNS: [f64; 7] = [60.0, 90.0, -120.0, 150.0, -90.0, 60.0, 100.0];
const LEG: f64 = 24.0;

/// Points, with the speed of the way to each and its smoothing: nothing for a stop.
fn points() -> Vec<([f64; 2], f64, Option<f64>)> {
    let (mut place, mut heading) = ([0.0, 0.0], 0.0_f64);
    let mut points = vec![(place, 0.0, None)];
    for speed in [10.0, 20.0] {
        for smoothing in [0.5, 1.0] {
            for (k, turn) in TURNS.iter().enumerate() {
                place = [
                    place[0] + LEG * heading.cos(),
                    place[1] + LEG * heading.sin(),
                ];
                let ends = (k + 1 < TURNS.len()).then_some(smoothing);
                points.push((place, speed, ends));
                heading += turn.to_radians();
            }
        }
    }
    points
}

/// The file of a log, with more keys.
fn file(folder: &Path, keys: &str) -> PathBuf {
    let mut text = format!("log = \"log.csv\"\n{keys}");
    for ([x, y], speed, smoothing) in points() {
        write!(text, "[[point]]\nx = \"{x:.9} mm\"\ny = \"{y:.9} mm\"\n").unwrap();
        if speed > 0.0 {
            writeln!(text, "speed = \"{speed} mm/s\"").unwrap();
        }
        if let Some(share) = smoothing {
            writeln!(text, "distance = \"{} mm\"", 4.0 * share).unwrap();
        }
    }
    write(folder, "corners.toml", text)
}

/// Pulses of speed, averaged twice: cubics in closed form.
fn averaged(t: f64) -> [f64; 2] {
    let [t1, t2] = FILTERS;
    let cubic = |t: f64| t.max(0.0).powi(3) / 6.0;
    let ramp = |t: f64| (cubic(t) - cubic(t - t1) - cubic(t - t2) + cubic(t - t1 - t2)) / (t1 * t2);
    let all = points();
    let (mut place, mut begin) = (all[0].0, 0.0);
    for pair in all.windows(2) {
        let [x, y] = [0, 1].map(|c| pair[1].0[c] - pair[0].0[c]);
        let lasts = x.hypot(y) / pair[1].1;
        let gone = (ramp(t - begin) - ramp(t - begin - lasts)) / lasts;
        place = [place[0] + x * gone, place[1] + y * gone];
        begin += lasts
            + match pair[1].2 {
                None => t1 + t2,
                Some(share) => DWELL * f64::from(u8::from(share < 0.9)),
            };
    }
    place
}

/// Corners rounded from 2 mm or 4 mm before them by a parabola at an even pace; starts and stops at 300 mm/s².
fn rounded(t: f64) -> [f64; 2] {
    const ACCELERATION: f64 = 300.0;
    let all = points();
    let mut begin = 0.0;
    let mut radius_before = None;
    for (k, pair) in all.windows(2).enumerate() {
        let speed = pair[1].1;
        let [x, y] = [0, 1].map(|c| (pair[1].0[c] - pair[0].0[c]) / LEG);
        let ramp = speed / ACCELERATION;
        let slow = 0.5 * speed * ramp;
        let radius = pair[1].2.map(|share| 4.0 * share);
        let at = |s: f64| [pair[0].0[0] + x * s, pair[0].0[1] + y * s];
        let from = radius_before.unwrap_or(0.0);
        if radius_before.is_none() {
            if t < begin + ramp {
                return at(0.5 * ACCELERATION * (t - begin).max(0.0).powi(2));
            }
            begin += ramp;
        }
        let from = if radius_before.is_none() { slow } else { from };
        let to = LEG - radius.unwrap_or(slow);
        let even = (to - from) / speed;
        if t < begin + even {
            return at(from + speed * (t - begin));
        }
        begin += even;
        match radius {
            None => {
                if t < begin + ramp {
                    let s = t - begin;
                    return at(to + speed * s - 0.5 * ACCELERATION * s * s);
                }
                begin += ramp;
            }
            Some(radius) => {
                let lasts = 2.0 * radius / speed;
                if t < begin + lasts {
                    let s = t - begin;
                    let next = &all[k + 2].0;
                    let out = [0, 1].map(|c| (next[c] - pair[1].0[c]) / LEG);
                    let here = at(to);
                    let v = [x * speed, y * speed];
                    return [0, 1].map(|c| {
                        here[c] + v[c] * s + 0.5 * (out[c] * speed - v[c]) / lasts * s * s
                    });
                }
                begin += lasts;
            }
        }
        radius_before = radius;
    }
    all.last().unwrap().0
}

/// A log every 8 ms, turned by 30° and moved, with noise of a hundredth of a millimetre.
fn log(place: fn(f64) -> [f64; 2], unit: f64) -> String {
    let mut text = String::from("time (s),x (mm),y (mm),z (mm)\n");
    let mut random = Random::new(4);
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    for i in 0..7400 {
        let t = 0.008 * f64::from(i);
        let [x, y] = place(t - 0.7);
        let at = [cos * x - sin * y + 900.0, sin * x + cos * y - 40.0, 500.0];
        let [x, y, z] = at.map(|v| (v + 0.01 * random.normal()) / unit);
        writeln!(text, "{t:.3},{x:.6},{y:.6},{z:.6}").unwrap();
    }
    text
}

fn measured(folder: &Path, file: &Path) -> Result<Found, MotionLogError> {
    motion_log(file, At(&folder.join("out")), &Silent)
}

#[test]
fn a_log_makes_the_motion_of_a_cell() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "log.csv", log(averaged, 1.0));
    let file = file(dir.path(), "");
    assert!(is_of_motion(&file));
    let found = measured(dir.path(), &file).unwrap();
    for c in &found.verdict.checks {
        println!("{}", c.line());
    }
    for f in &found.verdict.facts {
        println!("{}", f.line());
    }
    for c in &found.verdict.checks {
        assert_eq!(c.status, Status::Pass, "{c:?}");
    }
    assert_eq!(found.driven.blend, Some(4.0));
    assert!(found.held.len() >= 6, "{:?}", found.held);
    has_files(
        &dir.path().join("out"),
        &[
            "report.html",
            "corners.csv",
            "log-and-model.csv",
            "motion.toml",
            "verdict.json",
        ],
    );
    let motion = found.motion.unwrap();
    println!("{motion}");
    let (head, rest) = cells::ARCMATE_120IC.text.split_once("[motion]").unwrap();
    let (_, program) = rest.split_once("[program]").unwrap();
    write(
        dir.path(),
        "cell.toml",
        format!("{head}{motion}\n[program]{program}"),
    );
    let cell = Cell::load("cell.toml", dir.path()).unwrap();
    let controller = cell.motion.value.unwrap();
    assert!((controller.transition() - 0.18).abs() < 1.5e-3);
    assert!(
        (controller.t1.value.0 - FILTERS[0]).abs() < 3.0 * controller.t1.uncertainty.unwrap().0
    );
    assert!((controller.dwell(0.5) - DWELL).abs() < 1e-3);
    assert!(controller.dwell(1.0) < 1e-3);
    let [low, high] = controller.speeds.value.unwrap();
    assert!((low.0 - 10.0).abs() < 1e-6 && (high.0 - 20.0).abs() < 1e-6);
}

#[test]
fn a_controller_of_another_form_gets_no_file() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "log.csv", log(rounded, 1.0));
    let found = measured(dir.path(), &file(dir.path(), "")).unwrap();
    for c in &found.verdict.checks {
        println!("{}", c.line());
    }
    assert!(found.motion.is_none());
    assert!(warned(&found.verdict, "no-motion"));
    assert!(!dir.path().join("out/motion.toml").exists());
    let place = check(&found.verdict, "place-fitted");
    assert_eq!(place.status, Status::Fail, "{place:?}");
    assert!(place.reason.contains("at 20.0 mm/s"), "{place:?}");
    assert_eq!(check(&found.verdict, "place-unseen").status, Status::Fail);
}

#[test]
fn what_is_wrong_is_told_with_its_line_and_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    let sound = log(averaged, 1.0);
    let refused = |text: String, keys: &str| {
        write(dir.path(), "log.csv", text);
        measured(dir.path(), &file(dir.path(), keys))
            .unwrap_err()
            .to_string()
    };
    let metres = refused(log(averaged, 1000.0), "");
    says(&metres, &["unit = \"m\""]);
    let swapped = {
        let mut lines: Vec<&str> = sound.lines().collect();
        lines.swap(99, 100);
        lines.join("\n")
    };
    says(&refused(swapped, ""), &["line 101", "sort the log"]);
    let nan = sound.replacen("0.800,", "0.800,nan,", 1);
    assert!(!refused(nan, "").is_empty());
    let empty = {
        let mut lines: Vec<String> = sound.lines().map(str::to_owned).collect();
        lines[50] = "0.392,,1,2".to_owned();
        lines.join("\n")
    };
    says(&refused(empty, ""), &["line 51", "no number"]);
    says(
        &refused(sound.clone(), "time = \"zeit\"\n"),
        &["column \"zeit\"", "\"time (s)\""],
    );
    says(
        &refused(sound.clone(), "frame = \"same\"\n"),
        &["frame = \"fit\""],
    );
    says(
        &refused(sound.clone(), "to = \"20 s\"\n"),
        &["log the whole run"],
    );
    says(
        &refused(sound.clone(), "time_unit = \"ms\"\n"),
        &["times in seconds"],
    );
    says(&refused(String::new(), ""), &["empty"]);
    write(dir.path(), "log.csv", &sound);
    let none = write(dir.path(), "none.toml", "log = \"log.csv\"\n");
    let told = measured(dir.path(), &none).unwrap_err();
    assert!(matches!(told, MotionLogError::Stop(_)), "{told}");
}

/// The same drive, logged by the joints of a KUKA, in degrees as it shows them.
#[test]
fn a_log_by_joints_goes_through_the_robots_chain() {
    let robot = find(robots::ALL, "kuka-kr16-r2010-2").unwrap();
    let robot = meltpath_robot::cell::read(robot.text).unwrap();
    let rest = robot.at_rest();
    let mut random = Random::new(9);
    let mut text = String::from("time,A1,A2,A3,A4,A5,A6\n");
    let mut last: Option<[f64; 6]> = None;
    for i in 0..7400 {
        let t = 0.008 * f64::from(i);
        let [x, y] = averaged(t - 0.7);
        let tip = Pose {
            position: DVec3::new(x, y, 0.0),
            orientation: DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
        };
        let found = robot
            .arm
            .inverse(robot.base_from_flange(tip, &rest))
            .unwrap();
        let near = |joints: &[f64; 6]| {
            let from = last.unwrap_or_default();
            let pairs = joints.iter().zip(from);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let ways = found.solutions.iter().filter(|s| s.margin > 0.0);
        let ways = ways.map(|s| s.angles);
        let joints = ways.min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
        last = Some(joints);
        write!(text, "{t:.3}").unwrap();
        for angle in robot.arm.shown(joints) {
            write!(text, ",{:.5}", angle.to_degrees() + 2e-4 * random.normal()).unwrap();
        }
        text.push('\n');
    }
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "log.csv", text);
    let keys = "robot = \"kuka-kr16-r2010-2\"\nframe = \"same\"\njoints = [\"A1\", \"A2\", \"A3\", \"A4\", \"A5\", \"A6\"]\n";
    let found = measured(dir.path(), &file(dir.path(), keys)).unwrap();
    let fitted = &found.fitted;
    println!("{:?} {:?}", fitted.law, fitted.sigma);
    assert!((fitted.law.sum - 0.18).abs() < 3.0 * fitted.sigma[0]);
    assert!((fitted.law.dwells[0] - DWELL).abs() < 3.0 * fitted.sigma[2]);
    assert!(found.motion.is_some(), "{:?}", found.verdict.warnings);
}

/// A corner model counts at the speeds at which it was identified: beads of 12.5 mm/s are one of them, or not.
#[test]
fn beads_at_speeds_that_were_not_logged_are_not_decided_about() {
    for (speeds, open) in [
        ("10 mm/s\", \"15 mm/s", false),
        ("20 mm/s\", \"30 mm/s", true),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let shipped = meltpath_data::cells::ARCMATE_120IC.text;
        let cell = shipped.replacen("[motion]", &format!("[motion]\nspeeds = [\"{speeds}\"]"), 1);
        std::fs::write(dir.path().join("cell.toml"), cell).unwrap();
        let job = crate::dialects::job(dir.path(), "cell = \"cell.toml\"", "");
        let runs = NextIn(&dir.path().join("runs"));
        let verdict = meltpath::waam::run(&job, runs, &Silent).unwrap().verdict;
        let lack = check(&verdict, "lack");
        let told = lack.reason.contains("motion.speeds");
        assert_eq!(
            (told, lack.status == Status::CannotSay),
            (open, open),
            "{lack:?}"
        );
    }
}
