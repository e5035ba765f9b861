//! Jobs whose table moves with the arm: `machine.external = "free"`, from job to programs of two controllers and back.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use crate::dialects::cell;
use crate::support::{check, part, thin_wall, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::program::wanted::Wanted;
use meltpath::waam::{LeftOpen, plan_to_file, program_to_folder, run, simulate_program};
use meltpath_base::{Observer, Reporter, Silent, Status};
use meltpath_data::{find, robots};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

/// A KUKA before a table that lies 10 deg out of level while its axes stand at zero: the first tilts it, the second turns it.
fn robot(folder: &Path) -> PathBuf {
    before_table(folder, "kuka-kr16-r2010-2")
}

/// An arm that ships before that table.
fn before_table(folder: &Path, arm: &str) -> PathBuf {
    let text = find(robots::ALL, arm).unwrap().text;
    let (arm, after) = text.split_once("\n[table]").unwrap();
    let (_, shapes) = after.split_once("\n[shapes]").unwrap();
    let text = format!(
        "{arm}\n[table]\nposition = [\"0 mm\", \"0 mm\", \"0 mm\"]\nangles = [\"10 deg\", \"0 deg\", \"0 deg\"]\n\
         [positioner]\nsource = \"test\"\n\
         axes = [{{ position = [\"1200 mm\", \"0 mm\", \"600 mm\"], axis = [1, 0, 0] }}, {{ position = [\"0 mm\", \"0 mm\", \"0 mm\"], axis = [0, 0, 1] }}]\n\
         low = [\"-60 deg\", \"-360 deg\"]\nhigh = [\"60 deg\", \"360 deg\"]\nspeed = [\"120 deg/s\", \"180 deg/s\"]\n\
         [shapes]{shapes}"
    );
    write(folder, "robot.toml", text)
}

/// Two layers of the thin wall on that table, for KUKA and ABB.
fn job(folder: &Path) -> PathBuf {
    robot(folder);
    let words = "[program.positioner]\nsource = \"test\"\nuser_frame = \"part\"\nmachine = 2\nunit = \"STN1\"\n\
        [[program.positioner.axis]]\n[[program.positioner.axis]]\n";
    write(folder, "cell.toml", cell("kuka-krl") + words);
    thin_wall(
        folder,
        "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 2\n\
         [machine]\ncell = \"cell.toml\"\nrobot = \"robot.toml\"\nexternal = \"free\"\nsmoothing = \"50 %\"\n\
         [simulation]\ncell = \"1 mm\"\n[output]\nprograms = [\"kuka-krl\", \"abb-rapid\"]\n",
    )
}

/// Hears which stages begin, and stops at one.
#[derive(Default)]
struct Stages {
    heard: Mutex<Vec<String>>,
    stop_at: Option<&'static str>,
}

impl Stages {
    fn count(&self, name: &str) -> usize {
        let heard = self.heard.lock().unwrap();
        heard.iter().filter(|n| *n == name).count()
    }
}

impl Observer for Stages {
    fn stage(&self, name: &str, _: u64) {
        self.heard.lock().unwrap().push(name.to_owned());
    }
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        self.stop_at.is_some_and(|name| self.count(name) > 0)
    }
}

const SEARCH: &str = "way of the robot";

/// The first angles of the table in a program, deg, between words.
fn angles(text: &str, before: &str, after: char) -> Vec<f64> {
    let all = text.split(before).skip(1);
    all.filter_map(|rest| rest.split(after).next()?.trim().parse().ok())
        .collect()
}

#[test]
fn the_table_of_a_kuka_and_an_abb_is_levelled_and_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let job = job(&home);
    let stages = Stages::default();
    let outcome = run(&job, NextIn(&home.join("runs")), &stages).unwrap();
    let verdict = &outcome.verdict;
    for id in ["program", "tilt"] {
        let check = check(verdict, id);
        println!("{}", check.line());
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    assert_eq!(check(verdict, "reach").status, Status::CannotSay);
    let programs = outcome.folder.join("program");
    let text = |name: &str| std::fs::read_to_string(programs.join(name)).unwrap();
    // the way is looked for once, and both controllers are told of the same table
    assert_eq!(stages.count(SEARCH), 1);
    let kuka = angles(&text("JOB.dat"), "E1 ", ',');
    println!("{} positions, E1 {:?}", kuka.len(), kuka.first());
    assert!(kuka.len() > 4);
    // turned by half a turn about its own axis it is levelled the other way
    assert!(
        kuka.iter().all(|a| (a.abs() - 10.0).abs() < 1.0),
        "{kuka:?}"
    );
    let rapid = text("JOB.mod");
    let told = |angle: f64| {
        rapid.contains(&format!("[{angle},")) || rapid.contains(&format!("[{angle:.3},"))
    };
    assert!(kuka.iter().all(|a| told(*a)), "{kuka:?} {rapid}");
    // read back they turn the part as it was planned
    for name in ["JOB.src", "JOB.mod"] {
        let again = simulate_program(
            &programs.join(name),
            Some(&job),
            NextIn(&home.join(name)),
            &Silent,
        )
        .unwrap();
        let again = &again.verdict;
        assert_eq!(check(again, "lines").status, Status::Pass, "{name}");
        // the arm is where it was chosen to be only if the table is, too
        for id in ["reach", "collision"] {
            let value = |v| check(v, id).value.as_ref().unwrap().value;
            let off: f64 = value(again) - value(verdict);
            assert!(off.abs() < 0.2, "{name}: {id} {off}");
        }
    }
}

/// A Yaskawa's station is told in pulses, beside positions in a frame that stands: read back, part and torch are where they were chosen to be.
#[test]
fn the_table_of_a_yaskawa_is_levelled_and_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let job = job(&home);
    before_table(&home, "yaskawa-ar2010");
    // as the table lies in the frame that stands where the part does at rest, 10 deg out of level
    let words = "[program.positioner]\nsource = \"test\"\nuser_frame = \"base\"\n\
        [[program.positioner.axis]]\norigin = [\"0 mm\", \"0 mm\", \"0 mm\"]\ndirection = [1, 0, 0]\npulses_per_degree = 1000\n\
        [[program.positioner.axis]]\norigin = [\"0 mm\", \"0 mm\", \"0 mm\"]\ndirection = [0, 0.173648178, 0.984807753]\npulses_per_degree = -1333.3\n";
    write(&home, "cell.toml", cell("yaskawa-inform") + words);
    let text = std::fs::read_to_string(&job).unwrap();
    let text = text.replace("[\"kuka-krl\", \"abb-rapid\"]", "[\"yaskawa-inform\"]");
    std::fs::write(&job, text).unwrap();
    let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
    let verdict = &outcome.verdict;
    for id in ["program", "tilt"] {
        let check = check(verdict, id);
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    let reach = check(verdict, "reach");
    assert!(!reach.reason.contains("elsewhere"), "{reach:?}");
    let program = outcome.folder.join("program/JOB.JBI");
    let text = std::fs::read_to_string(&program).unwrap();
    for words in ["///GROUP2 ST1\n", "\nSMOVL C00001 V="] {
        assert!(text.contains(words), "{text}");
    }
    let lines = text.lines().filter_map(|l| l.strip_prefix("EC"));
    let tilts: Vec<f64> = lines
        .map(|l| l.split(['=', ',']).nth(1).unwrap().parse().unwrap())
        .collect();
    assert!(
        tilts.iter().all(|p| (p.abs() - 10_000.0).abs() < 1000.0),
        "{tilts:?}"
    );
    let again = simulate_program(&program, Some(&job), NextIn(&home.join("out")), &Silent);
    let again = &again.unwrap().verdict;
    assert_eq!(check(again, "lines").status, Status::Pass);
    for id in ["reach", "collision", "tilt"] {
        let value = |v| check(v, id).value.as_ref().unwrap().value;
        let off: f64 = value(again) - value(verdict);
        assert!(off.abs() < 0.2, "{id} {off}");
    }
}

/// However far out of level the table lies, near a step of the search or between two, it is levelled: all places lean alike.
#[test]
fn a_table_is_levelled_from_wherever_it_lies() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let file = dir.path().join("robot.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    for angle in [4, 8, 13] {
        let lies = text.replace(
            "angles = [\"10 deg\"",
            &format!("angles = [\"{angle} deg\""),
        );
        assert_ne!(lies, text);
        std::fs::write(&file, lies).unwrap();
        let runs = dir.path().join(format!("runs-{angle}"));
        let verdict = run(&job, NextIn(&runs), &Silent).unwrap().verdict;
        let tilt = check(&verdict, "tilt");
        assert!(
            tilt.value.as_ref().unwrap().value < 0.7,
            "{angle}: {tilt:?}"
        );
    }
}

/// A positioner whose limit is only just beyond what levels the part: it is led off its limit, and its margin counts as a joint's does.
#[test]
fn a_positioner_keeps_off_its_limits_and_is_judged_by_them() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let file = dir.path().join("robot.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let limited = |low: f64, high: f64| {
        let own = "low = [\"-60 deg\", \"-360 deg\"]\nhigh = [\"60 deg\", \"360 deg\"]";
        assert!(text.contains(own));
        let new =
            format!("low = [\"{low} deg\", \"-360 deg\"]\nhigh = [\"{high} deg\", \"360 deg\"]");
        std::fs::write(&file, text.replace(own, &new)).unwrap();
    };
    limited(-14.0, 14.0);
    let outcome = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let programs = std::fs::read_dir(outcome.folder.join("program")).unwrap();
    let mut programs = programs.map(|file| file.unwrap().path());
    let is_kuka = |file: &PathBuf| file.extension().is_some_and(|e| e == "src");
    let program = programs.find(is_kuka).unwrap();
    let data = std::fs::read_to_string(program.with_extension("dat")).unwrap();
    let tilts = angles(&data, "E1 ", ',');
    let most = tilts.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
    assert!(most > 5.0 && 14.0 - most > 2.0, "{tilts:?}");
    // the same programs before limits that they come within a degree of
    limited(-most - 1.0, most + 1.0);
    let again = simulate_program(
        &program,
        Some(&job),
        NextIn(&dir.path().join("again")),
        &Silent,
    );
    let again = again.unwrap().verdict;
    let reach = check(&again, "reach");
    let margin = reach.value.as_ref().unwrap().value;
    assert!((margin - 1.0).abs() < 0.01, "{reach:?}");
    assert_eq!(reach.status, Status::Fail, "{reach:?}");
    assert!(reach.reason.contains("positioner"), "{reach:?}");
}

/// The programs of a plan show what they do, look for the way once, and stop when asked to.
#[test]
fn programs_of_a_plan_show_their_progress_and_stop() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let plan = dir.path().join("plan.melt");
    plan_to_file(&job, &plan, LeftOpen::Chosen, &Silent).unwrap();
    let reporter = Reporter::new();
    let write = |stages: &Stages, name: &str| {
        let out = dir.path().join(name);
        program_to_folder(&job, &plan, &out, Wanted::WHOLE, (&reporter, stages))
    };
    let all = Stages::default();
    let files = write(&all, "whole").unwrap().files;
    assert_eq!(all.count(SEARCH), 1, "{:?}", all.heard);
    assert_eq!(files.len(), 3, "{files:?}");
    let stopped = Stages {
        stop_at: Some(SEARCH),
        ..Stages::default()
    };
    let told = write(&stopped, "stopped");
    assert!(told.is_err_and(|e| e.to_string() == "cancelled"));
    assert!(!dir.path().join("stopped").exists());
}

/// A boss on each of two flanks of a block: no way of the arm turns the table by half a turn along a straight travel. Between them it goes over
/// in a joint move, in which the table turns, and both programs say so.
#[test]
fn a_table_turns_the_part_over_in_a_joint_move() {
    let dir = tempfile::tempdir().unwrap();
    let home = &dir.path().join("job");
    std::fs::create_dir(home).unwrap();
    let body = [[-30.0, -20.0, 0.0], [30.0, 20.0, 40.0]];
    let boss = |low: f64, high: f64| [[low, -8.0, 14.0], [high, 8.0, 30.0]];
    let parts = [
        ("body.stl", body),
        ("right.stl", boss(28.0, 34.0)),
        ("left.stl", boss(-34.0, -28.0)),
    ];
    for (name, ends) in parts {
        let [low, high] = ends.map(DVec3::from_array);
        part(home, name, &shapes::cuboid(low, high));
    }
    let shipped = find(robots::ALL, "fanuc-arcmate-120ic").unwrap().text;
    let wide = "table = [\"1000 mm\", \"1000 mm\"]";
    assert!(shipped.contains(wide));
    let face_plate = shipped.replace(wide, "table = [\"400 mm\", \"400 mm\"]");
    write(home, "robot.toml", face_plate);
    let words = "[program.positioner]\nsource = \"test\"\nuser_frame = \"part\"\nmachine = 2\n\
        [[program.positioner.axis]]\n[[program.positioner.axis]]\n";
    write(home, "cell.toml", cell("fanuc-ls") + words);
    let job = write(
        home,
        "job.toml",
        "part = \"right.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[onto]\nbody = \"body.stl\"\nthen = [\"left.stl\"]\n\
         [machine]\ncell = \"cell.toml\"\nrobot = \"robot.toml\"\nexternal = \"free\"\nplace = [\"0 mm\", \"0 mm\", \"100 mm\"]\n\
         [simulation]\ncell = \"1 mm\"\n[output]\nprograms = [\"fanuc-ls\", \"kuka-krl\"]\n",
    );
    let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
    let verdict = &outcome.verdict;
    // within limits and clear, but by guesses of the robot's file
    for id in ["reach", "collision"] {
        let check = check(verdict, id);
        println!("{}", check.line());
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        assert!(check.reason.contains("guesses"), "{check:?}");
    }
    let told = verdict
        .facts
        .iter()
        .find(|f| f.id == "way-changes")
        .unwrap();
    println!("{}", told.reason);
    assert!(
        told.reason
            .contains("the torch goes on in another direction")
    );
    let text = |name: &str| std::fs::read_to_string(outcome.folder.join("program").join(name));
    let fanuc = text("JOB.LS").unwrap();
    let joint: Vec<&str> = fanuc.lines().filter(|l| l.contains(":J P[")).collect();
    assert_eq!(joint.len(), 2, "{joint:?}");
    // from one side to the other
    let tilts = angles(&fanuc, "J1=", 'd');
    let ends = tilts
        .iter()
        .fold([0.0_f64; 2], |[low, high], a| [low.min(*a), high.max(*a)]);
    let turns = angles(&fanuc, "J2=", 'd');
    let turned = turns.iter().any(|a| (a - turns[0]).abs() > 150.0);
    assert!(ends[1] - ends[0] > 150.0 || turned, "{ends:?} {turns:?}");
    // the second program makes joint moves of the same travels
    let kuka = text("JOB.src").unwrap();
    assert_eq!(kuka.matches("PTP XP").count(), 2, "{kuka}");
    let told: Vec<f64> = angles(&text("JOB.dat").unwrap(), "E1 ", ',');
    for tilt in &tilts {
        assert!(
            told.iter().any(|t| (t - tilt).abs() < 1e-3),
            "{tilt} {told:?}"
        );
    }
    for name in ["JOB.LS", "JOB.src"] {
        let program = outcome.folder.join("program").join(name);
        let again = simulate_program(&program, Some(&job), NextIn(&home.join(name)), &Silent);
        let again = again.unwrap().verdict;
        for id in ["reach", "collision"] {
            let value = |v| check(v, id).value.as_ref().unwrap().value;
            let off: f64 = value(&again) - value(verdict);
            assert!(off.abs() < 0.2, "{name}: {id} {off}");
        }
    }
}

/// Where no way is found it is told what the search came to, not where the arm ends while the axes stand at rest.
#[test]
fn what_free_axes_do_not_reach_is_told_of_where_they_serve_best() {
    let dir = tempfile::tempdir().unwrap();
    let file = job(dir.path());
    let text = std::fs::read_to_string(&file).unwrap();
    // turned to the arm the place is 2.4 m nearer
    let far = text.replace(
        "[machine]",
        "[machine]\nplace = [\"4500 mm\", \"0 mm\", \"0 mm\"]",
    );
    let beyond = |external: &str| {
        let text = far.replace("external = \"free\"", &format!("external = \"{external}\""));
        let file = write(dir.path(), "far.toml", text);
        let done = run(&file, NextIn(&dir.path().join("runs")), &Silent).unwrap();
        let reach = check(&done.verdict, "reach").clone();
        assert_eq!(reach.status, Status::Fail, "{reach:?}");
        println!("{}", reach.reason);
        reach.reason
    };
    let [free, standing] = ["free", "standing"].map(beyond);
    assert!(free.contains("where they serve best"), "{free}");
    assert!(!standing.contains("where they serve best"), "{standing}");
    let by = |reason: &str| -> f64 {
        let mut words = reason.split_whitespace();
        words.find_map(|w| w.parse().ok()).unwrap()
    };
    assert!(by(&free) < by(&standing) - 1000.0, "{free}; {standing}");
}
