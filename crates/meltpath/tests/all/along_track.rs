//! Jobs whose arm rides on a track while it lays metal: a wall farther than the arm reaches, from job to programs and back.

use std::path::{Path, PathBuf};

use crate::dialects::cell;
use crate::support::{check, part, refusal, says, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Silent, Status};
use meltpath_data::{find, robots};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes::cuboid;

/// How long the wall is, mm: farther than the arm reaches from one place.
const LONG: f64 = 4400.0;

/// A KUKA on a track along y, before a table that stands still.
fn robot(folder: &Path) {
    let text = find(robots::ALL, "kuka-kr16-r2010-2").unwrap().text;
    write(folder, "robot.toml", on_track(text));
}

/// An arm that ships, on that track.
fn on_track(text: &str) -> String {
    let (arm, after) = text.split_once("\n[table]").unwrap();
    let (_, shapes) = after.split_once("\n[shapes]").unwrap();
    format!(
        "{arm}\n[table]\nposition = [\"1300 mm\", \"0 mm\", \"500 mm\"]\n\
         [track]\nsource = \"test\"\naxis = [0, 1, 0]\nlow = \"-3 m\"\nhigh = \"3 m\"\nspeed = \"1 m/s\"\n\
         [shapes]{shapes}"
    )
}

/// A wall along y, 4 mm thick, with its middle at the origin.
fn wall(folder: &Path) {
    let wall = cuboid(
        DVec3::new(-2.0, -0.5 * LONG, 0.0),
        DVec3::new(2.0, 0.5 * LONG, 3.0),
    );
    part(folder, "long.stl", &wall);
}

const TRACK: &str =
    "[program.track]\nsource = \"test\"\nuser_frame = \"stands\"\nunit = \"TRACK1\"\n";

fn job(folder: &Path, track: &str, programs: &str) -> PathBuf {
    robot(folder);
    wall(folder);
    write(folder, "cell.toml", cell("kuka-krl") + track);
    write(
        folder,
        "job.toml",
        format!(
            "part = \"long.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
             [waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 1\n[fill]\nstrategy = \"raster\"\n\
             [machine]\ncell = \"cell.toml\"\nrobot = \"robot.toml\"\nexternal = \"free\"\nsmoothing = \"50 %\"\n\
             [simulation]\ncell = \"2 mm\"\n[output]\nprograms = {programs}\n"
        ),
    )
}

/// The values behind a word in a text.
fn values(text: &str, before: &str, after: char) -> Vec<f64> {
    let all = text.split(before).skip(1);
    all.filter_map(|rest| rest.split(after).next()?.trim().parse().ok())
        .collect()
}

fn spread(all: &[f64]) -> f64 {
    let (low, high) = all
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low
}

#[test]
fn a_wall_beyond_reach_is_laid_along_the_track() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let programs = "[\"kuka-krl\", \"abb-rapid\", \"fanuc-ls\"]";
    let job = job(&home, TRACK, programs);
    let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let verdict = &outcome.verdict;
    println!("{}", check(verdict, "reach").line());
    assert_ne!(check(verdict, "reach").status, Status::Fail);
    assert_eq!(check(verdict, "program").status, Status::Pass);
    let folder = outcome.folder.join("program");
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let kuka = values(&text("JOB.dat"), "E1 ", '}');
    assert!(spread(&kuka) > LONG - 2.0 * 2010.0, "{kuka:?}");
    let fanuc = values(&text("JOB.LS"), "E1=", 'm');
    assert_eq!(kuka.len(), fanuc.len());
    let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-3;
    assert!(kuka.iter().zip(&fanuc).all(near), "{kuka:?} {fanuc:?}");
    says(&text("JOB.mod"), &["ActUnit TRACK1;"]);
    // positions stand where the part does: the wall is as long in them as it is
    let ys = values(&text("JOB.dat"), ",Y ", ',');
    assert!(spread(&ys) > LONG - 20.0, "{ys:?}");
    for name in ["JOB.src", "JOB.mod", "JOB.LS"] {
        let (out, program) = (dir.path().join(name), folder.join(name));
        let again = simulate_program(&program, Some(&job), NextIn(&out), &Silent).unwrap();
        let again = &again.verdict;
        assert_eq!(check(again, "lines").status, Status::Pass, "{name}");
        let excess = check(again, "excess");
        assert!(!excess.reason.contains("positioner"), "{excess:?}");
        let value = |v| check(v, "reach").value.as_ref().unwrap().value;
        let off: f64 = value(again) - value(verdict);
        assert!(off.abs() < 0.2, "{name}: {off}");
    }
}

#[test]
fn a_track_of_which_the_cell_says_nothing_is_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let told = refusal(&job(dir.path(), "", "[\"kuka-krl\"]"));
    says(&told, &["is told the track", "[program.track]"]);
    yaskawa(dir.path(), TRACK);
    let told = refusal(&dir.path().join("job.toml"));
    says(
        &told,
        &["Yaskawa INFORM", "program.track.pulses_per_millimetre"],
    );
}

/// The same wall before a Yaskawa.
fn yaskawa(folder: &Path, track: &str) -> PathBuf {
    let job = job(folder, track, "[\"yaskawa-inform\"]");
    let text = find(robots::ALL, "yaskawa-ar2010").unwrap().text;
    write(folder, "robot.toml", on_track(text));
    write(folder, "cell.toml", cell("yaskawa-inform") + track);
    job
}

/// A Yaskawa is told its base axis in pulses; read back the arm is where it was chosen to be.
#[test]
fn the_base_axis_of_a_yaskawa_is_told_in_pulses() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let track = format!("{TRACK}pulses_per_millimetre = 200\n");
    let job = yaskawa(&home, &track);
    let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let verdict = &outcome.verdict;
    assert_eq!(check(verdict, "program").status, Status::Pass);
    assert_ne!(check(verdict, "reach").status, Status::Fail);
    let program = outcome.folder.join("program/JOB.JBI");
    let text = std::fs::read_to_string(&program).unwrap();
    says(&text, &["///GROUP1 RB1,BS1\n", "MOVL C00002 BC00002 V="]);
    let lines = text.lines().filter(|l| l.starts_with("BC"));
    let pulses: Vec<f64> = lines
        .map(|l| l.split_once('=').unwrap().1.parse().unwrap())
        .collect();
    assert!(
        spread(&pulses) > 200.0 * (LONG - 2.0 * 2010.0),
        "{pulses:?}"
    );
    let again = simulate_program(
        &program,
        Some(&job),
        NextIn(&dir.path().join("out")),
        &Silent,
    );
    let again = &again.unwrap().verdict;
    assert_eq!(check(again, "lines").status, Status::Pass);
    let value = |v| check(v, "reach").value.as_ref().unwrap().value;
    let off: f64 = value(again) - value(verdict);
    assert!(off.abs() < 0.2, "{off}");
}
