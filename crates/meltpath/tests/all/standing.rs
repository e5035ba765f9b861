//! What layers that are not flat stand on in a robot's cell: a cylinder clamped over the table, what holds it, and what is refused.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use crate::reach::measured;
use crate::support::{self, check, refusal, says, thin_wall, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Check, Silent, Status, Verdict};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

/// Two passes of a flange around a pipe of 60 that is clamped over the table, its lower side `high` mm over the table, with lines under [machine].
fn job(folder: &Path, high: f64, machine: &str) -> PathBuf {
    let robot = measured(folder);
    let flange = shapes::sheet(
        4,
        90,
        |_, _| false,
        |i, k| {
            let angle = TAU * (k % 90.0) / 90.0;
            let radius = 30.0 + 2.0 * i;
            DVec3::new(radius * angle.cos(), radius * angle.sin(), i)
        },
    );
    support::part(folder, "flange.stl", &flange);
    let text = format!(
        "part = \"flange.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [layers]\nheight = \"2.6 mm\"\ncount = 2\n[surface]\ntorch = \"fixed\"\n[surface.base]\nradius = \"30.2 mm\"\ndirection = [0.0, 0.0, 1.0]\n\
         [machine]\n{robot}\nplace = [\"0 mm\", \"0 mm\", \"{high} mm\"]\n{machine}\n"
    );
    write(folder, "job.toml", text)
}

/// A holder beside the pipe that reaches the table but not the pipe.
#[test]
fn a_holder_that_holds_nothing_is_no_stand() {
    let aside = "holders = [{ from = [\"90 mm\", \"0 mm\", \"-60 mm\"], to = [\"90 mm\", \"0 mm\", \"-20 mm\"], radius = \"10 mm\" }]";
    let verdict = verdict(60.0, aside);
    let standing = check(&verdict, "standing");
    assert_eq!(standing.status, Status::CannotSay, "{standing:?}");
    assert!(standing.reason.contains("touches nothing"), "{standing:?}");
}

/// A pipe whose middle is past the edge of the table tips.
#[test]
fn what_stands_beside_the_table_does_not_stand() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path(), 60.0, &holder("20 mm"));
    let text = std::fs::read_to_string(&job).unwrap();
    assert!(text.contains("place = [\"0 mm\","), "{text}");
    let at = |x: &str| {
        let moved = text.replace("place = [\"0 mm\",", &format!("place = [\"{x}\","));
        std::fs::write(&job, moved).unwrap();
        let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent);
        check(&outcome.unwrap().verdict, "standing").clone()
    };
    assert_eq!(at("0 mm").status, Status::Pass);
    let beside = at("-900 mm");
    assert_eq!(beside.status, Status::CannotSay, "{beside:?}");
    assert!(beside.reason.contains("beyond its edge"), "{beside:?}");
}

fn verdict(high: f64, machine: &str) -> Verdict {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path(), high, machine);
    run(&job, NextIn(&dir.path().join("runs")), &Silent)
        .unwrap()
        .verdict
}

fn holder(radius: &str) -> String {
    format!(
        "holders = [{{ from = [\"0 mm\", \"0 mm\", \"-60 mm\"], to = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"{radius}\" }}]"
    )
}

fn value(check: &Check) -> f64 {
    check.value.as_ref().unwrap().value
}

/// A shaft under the cylinder stands on the table; it is held against torch and beads.
#[test]
fn a_clamped_cylinder_stands_on_what_holds_it() {
    let held = verdict(60.0, &holder("20 mm"));
    let standing = check(&held, "standing");
    assert_eq!(standing.status, Status::Pass, "{standing:?}");
    assert!(value(standing).abs() < 0.5, "{standing:?}");
    let beside = check(&held, "holders");
    assert_eq!(beside.status, Status::Pass, "{beside:?}");
    assert_eq!(check(&held, "collision").status, Status::Pass);
    // nothing is known of what carries it without
    let floats = verdict(60.0, "");
    let standing = check(&floats, "standing");
    assert_eq!(standing.status, Status::CannotSay, "{standing:?}");
    assert!(value(standing) > 59.0, "{standing:?}");
    assert!(standing.reason.contains("nothing is named"), "{standing:?}");
    assert!(floats.checks.iter().all(|c| c.id != "holders"));
}

#[test]
fn what_reaches_into_the_table_or_the_beads_fails() {
    let deep = verdict(40.0, &holder("20 mm"));
    let standing = check(&deep, "standing");
    assert_eq!(standing.status, Status::Fail, "{standing:?}");
    assert!((value(standing) + 20.0).abs() < 0.5, "{standing:?}");
    let thick = verdict(60.0, &holder("34 mm"));
    let beside = check(&thick, "holders");
    assert_eq!(beside.status, Status::Fail, "{beside:?}");
    assert!(value(beside) < 0.0, "{beside:?}");
    assert!(beside.place.is_some());
}

#[test]
fn holders_of_nothing_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let flat = thin_wall(
        dir.path(),
        &format!("[machine]\n{robot}\n{}\n", holder("20 mm")),
    );
    says(&refusal(&flat), &["machine.holders", "flat"]);
    let empty = holder("20 mm").replace("-60 mm", "0 mm");
    says(
        &refusal(&job(dir.path(), 60.0, &empty)),
        &["ends where it begins"],
    );
    let job = job(dir.path(), 60.0, &holder("-20 mm"));
    says(&refusal(&job), &["radius"]);
    let text = std::fs::read_to_string(&job).unwrap();
    let text = text.replace(robot, "").replace("-20 mm", "20 mm");
    let alone = write(dir.path(), "job.toml", text);
    says(&refusal(&alone), &["machine.holders", "no robot"]);
}

/// A program is held against what its layers stand on and what holds that, as in the run that wrote it.
#[test]
fn a_simulated_program_meets_what_stands_there() {
    let dir = tempfile::tempdir().unwrap();
    let post = "holders = [{ from = [\"0 mm\", \"0 mm\", \"-60 mm\"], to = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"20 mm\" }, \
                { from = [\"58 mm\", \"0 mm\", \"-60 mm\"], to = [\"58 mm\", \"0 mm\", \"60 mm\"], radius = \"5 mm\" }]";
    let job = job(dir.path(), 60.0, post);
    let ran = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let program = ran.folder.join("program");
    let again = dir.path().join("again");
    let simulated = simulate_program(&program, Some(&job), NextIn(&again), &Silent).unwrap();
    for id in ["collision", "holders", "standing", "tilt"] {
        let [a, b] = [&ran.verdict, &simulated.verdict].map(|v| check(v, id));
        let off = (value(a) - value(b)).abs();
        assert!(off < 1e-3 && a.status == b.status, "{a:?} {b:?}");
    }
    // without the post there is more room: it is what comes nearest
    let free = job_without_post(&job);
    let without = dir.path().join("without");
    let without = simulate_program(&program, Some(&free), NextIn(&without), &Silent).unwrap();
    let [near, far] = [&simulated.verdict, &without.verdict].map(|v| value(check(v, "collision")));
    assert!(near < far - 1.0, "{near} {far}");
    says(
        &check(&simulated.verdict, "part").reason,
        &["a wall along a surface"],
    );
}

fn job_without_post(job: &Path) -> PathBuf {
    let text = std::fs::read_to_string(job).unwrap();
    let (from, to) = (
        text.find(", { from = [\"58 mm\"").unwrap(),
        text.rfind("}]").unwrap(),
    );
    let shorter = format!("{}{}", &text[..from], &text[to + 1..]);
    write(job.parent().unwrap(), "free.toml", shorter)
}

/// The place that is told is where a bead comes nearest, not where it ends.
#[test]
fn the_nearest_place_to_a_holder_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let wall = shapes::sheet(
        4,
        20,
        |_, _| false,
        |i, k| DVec3::new(2.5 * k - 25.0, 0.0, i),
    );
    support::part(dir.path(), "wall.stl", &wall);
    let text = format!(
        "part = \"wall.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [layers]\nheight = \"2 mm\"\n[surface]\n[machine]\n{robot}\n\
         holders = [{{ from = [\"7 mm\", \"30 mm\", \"0 mm\"], to = [\"7 mm\", \"30 mm\", \"20 mm\"], radius = \"5 mm\" }}]\n"
    );
    let job = write(dir.path(), "job.toml", text);
    let ran = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let holders = check(&ran.verdict, "holders");
    let [x, y, _] = holders.place.as_ref().unwrap().position.unwrap();
    assert!((x - 7.0).abs() < 0.1 && y == 0.0, "{holders:?}");
}

/// The plate of flat layers stands on the table: sunk into it, over it or beside it nothing passes.
#[test]
fn a_flat_plate_stands_on_its_table() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let at = |place: [f64; 2]| {
        let [x, z] = place;
        let job = thin_wall(
            dir.path(),
            &format!(
                "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 2\n\
                 [machine]\n{robot}\nplace = [\"{x} mm\", \"0 mm\", \"{z} mm\"]\n[simulation]\ncell = \"1 mm\"\n"
            ),
        );
        let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
        check(&outcome.verdict, "standing").clone()
    };
    let value = |check: &Check| check.value.as_ref().unwrap().value;
    let stands = at([0.0, 0.0]);
    assert_eq!(stands.status, Status::Pass, "{stands:?}");
    assert!(value(&stands).abs() < 1e-9, "{stands:?}");
    let sunk = at([0.0, -30.0]);
    assert_eq!(sunk.status, Status::Fail, "{sunk:?}");
    assert!((value(&sunk) + 30.0).abs() < 1e-9, "{sunk:?}");
    for (place, words) in [
        ([0.0, 50.0], "holds it there"),
        ([-900.0, 0.0], "beyond its edge"),
    ] {
        let check = at(place);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(&check.reason, &[words]);
    }
}
