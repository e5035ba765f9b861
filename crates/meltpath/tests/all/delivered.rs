//! What is judged is what is delivered: axes of a positioner that cell and robot file both tell, and programs for several controllers.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::dialects::cell;
use crate::support::{check, says, thin_wall, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{examine, run, simulate_program};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_data::{find, robots};

/// A robot that ships before a table that lies 10 deg out of level while its axes stand at zero: the first tilts it, the second turns it.
fn robot(folder: &Path, name: &str) {
    let text = find(robots::ALL, name).unwrap().text;
    let (arm, rest) = text.split_once("\n[torch]").unwrap();
    let arm = arm.split_once("\n[positioner]").map_or(arm, |(arm, _)| arm);
    let (torch, shapes) = rest.split_once("\n[shapes]").unwrap();
    let torch = torch
        .split_once("\n[table]")
        .map_or(torch, |(torch, _)| torch);
    let text = format!(
        "{arm}\n[torch]{torch}\n[table]\nposition = [\"0 mm\", \"0 mm\", \"0 mm\"]\nangles = [\"10 deg\", \"0 deg\", \"0 deg\"]\n\
         [positioner]\nsource = \"test\"\n\
         axes = [{{ position = [\"1200 mm\", \"0 mm\", \"600 mm\"], axis = [1, 0, 0] }}, {{ position = [\"0 mm\", \"0 mm\", \"0 mm\"], axis = [0, 0, 1] }}]\n\
         low = [\"-60 deg\", \"-360 deg\"]\nhigh = [\"60 deg\", \"360 deg\"]\nspeed = [\"120 deg/s\", \"180 deg/s\"]\n\
         [shapes]{shapes}"
    );
    write(folder, "robot.toml", text);
}

/// Two layers of the thin wall on that table, lifted by 30 mm.
fn job(folder: &Path, cell: String, programs: &str) -> PathBuf {
    write(folder, "cell.toml", cell);
    thin_wall(
        folder,
        &format!(
            "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 2\n\
             [machine]\ncell = \"cell.toml\"\nrobot = \"robot.toml\"\nexternal = \"free\"\nsmoothing = \"50 %\"\n\
             place = [\"0 mm\", \"0 mm\", \"30 mm\"]\n\
             [simulation]\ncell = \"1 mm\"\n[output]\nprograms = [{programs}]\n"
        ),
    )
}

/// A cell for FANUC whose file tells these axes, in the user frame of the part with all of them at zero.
fn told([first, second]: [&str; 2]) -> String {
    cell("fanuc-ls")
        + &format!(
            "[program.positioner]\nsource = \"test\"\nuser_frame = \"base\"\ngroup = 2\n\
             [[program.positioner.axis]]\n{first}\n[[program.positioner.axis]]\n{second}\n"
        )
}

/// A point of an axis may be told anywhere along it; of the second the direction is that of a table 10 deg out of level.
const FIRST: &str = "origin = [\"500 mm\", \"0 mm\", \"-30 mm\"]\ndirection = [1, 0, 0]";
const SECOND: &str =
    "origin = [\"0 mm\", \"17.3648 mm\", \"68.4808 mm\"]\ndirection = [0, 0.17364818, 0.98480775]";

const ELSEWHERE: &str = "the cell's file tells other axes of the positioner than the robot's";

/// Whether all checks of the arm say this of it, and cannot say more.
fn of_the_arm(verdict: &Verdict, words: Option<&[&str]>) {
    for id in ["reach", "joint-speed", "collision", "config", "tilt"] {
        let check = check(verdict, id);
        match words {
            Some(words) => {
                assert_eq!(check.status, Status::CannotSay, "{check:?}");
                says(&check.reason, words);
                let right = [
                    "program.positioner.axis",
                    "origin = [\"0 mm\", \"0 mm\", \"-30 mm\"], direction = [1, 0, 0]",
                    "direction = [0, 0.173648, 0.984808]",
                ];
                says(check.remedy.as_ref().unwrap(), &right);
            }
            None => assert!(!check.reason.contains(ELSEWHERE), "{check:?}"),
        }
    }
}

#[test]
fn axes_that_cell_and_robot_file_tell_otherwise_leave_the_arm_open() {
    let beside = "origin = [\"0 mm\", \"0 mm\", \"70 mm\"]\ndirection = [1, 0, 0]";
    let turned = "origin = [\"0 mm\", \"0 mm\", \"-30 mm\"]\ndirection = [-1, 0, 0]";
    let leaning = "origin = [\"0 mm\", \"0 mm\", \"-30 mm\"]\ndirection = [0, 0, 1]";
    for (axes, differs) in [
        ([FIRST, SECOND], None),
        (
            [beside, SECOND],
            Some("axis 1: 100.0 mm beside that of the robot's file"),
        ),
        (
            [turned, SECOND],
            Some("axis 1: its direction 180.00 deg off"),
        ),
        (
            [FIRST, leaning],
            Some("axis 2: 5.2 mm beside that of the robot's file, its direction 10.00 deg off"),
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let home = dir.path().join("job");
        std::fs::create_dir(&home).unwrap();
        robot(&home, "fanuc-arcmate-120ic");
        let job = job(&home, told(axes), "\"fanuc-ls\"");
        let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
        let file = outcome.folder.join("program/JOB.LS");
        let again =
            simulate_program(&file, Some(&job), NextIn(&home.join("again")), &Silent).unwrap();
        let words = differs.map(|differs| [ELSEWHERE, differs]);
        of_the_arm(&outcome.verdict, words.as_ref().map(|w| &w[..]));
        for id in ["reach", "collision", "config"] {
            let check = check(&again.verdict, id);
            assert_eq!(
                check.reason.contains(ELSEWHERE),
                differs.is_some(),
                "{check:?}"
            );
        }
        // and before anything is simulated
        let warnings = examine(&job, &Silent).unwrap().warnings;
        let warned = warnings.iter().any(|w| w.code == "positioner-axes");
        assert_eq!(warned, differs.is_some(), "{warnings:?}");
    }
}

/// The shipped cell with the words of several controllers, which does not say what its controller reads.
fn unsaid() -> String {
    let text = cell("fanuc-ls");
    let without = text.replace("dialect = \"fanuc-ls\"\n", "");
    assert_ne!(text, without);
    without
        + "[program.positioner]\nsource = \"test\"\nuser_frame = \"part\"\nmachine = 2\nunit = \"STN1\"\n\
           [[program.positioner.axis]]\n[[program.positioner.axis]]\n"
}

/// The turns that positions of a KUKA program tell, and those of the joints that were checked.
fn turns(folder: &Path) -> [BTreeSet<u32>; 2] {
    let data = std::fs::read_to_string(folder.join("program/JOB.dat")).unwrap();
    let told = data.split(",T ").skip(1);
    let told = told.map(|t| t.split([',', '}']).next().unwrap().parse().unwrap());
    let joints = std::fs::read_to_string(folder.join("series/joints.csv")).unwrap();
    let mut lines = joints.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let first = names.iter().position(|n| *n == "joint_1_deg").unwrap();
    let checked = lines.map(|line| {
        let joints = line.split(',').skip(first).take(6).enumerate();
        let below = joints.filter(|(_, angle)| angle.starts_with('-'));
        below.map(|(i, _)| 1 << i).sum()
    });
    [told.collect(), checked.collect()]
}

/// Where the cell's file does not say what its controller reads the program is judged that the arm's maker reads, and the arm goes the same way
/// along all of them.
#[test]
fn the_programs_that_are_delivered_are_judged() {
    for programs in [
        "\"kuka-krl\"",
        "\"kuka-krl\", \"abb-rapid\"",
        "\"fanuc-ls\", \"kuka-krl\", \"abb-rapid\"",
    ] {
        let dir = tempfile::tempdir().unwrap();
        let home = dir.path().join("job");
        std::fs::create_dir(&home).unwrap();
        robot(&home, "kuka-kr16-r2010-2");
        let job = job(&home, unsaid(), programs);
        let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
        let verdict = &outcome.verdict;
        let [told, checked] = turns(&outcome.folder);
        println!("{programs}: T {told:?}, checked {checked:?}");
        assert!(!told.is_empty() && told.is_subset(&checked), "{programs}");
        let config = check(verdict, "config");
        assert_eq!(config.status, Status::Pass, "{config:?}");
        // as the simulation of the program itself says
        let file = outcome.folder.join("program/JOB.src");
        let again =
            simulate_program(&file, Some(&job), NextIn(&home.join("again")), &Silent).unwrap();
        let again = &again.verdict;
        assert_eq!(config.reason, check(again, "config").reason);
        for id in ["reach", "collision"] {
            let [a, b] = [verdict, again].map(|v| check(v, id).value.as_ref().unwrap().value);
            assert!((a - b).abs() < 0.01, "{id}: {a}, {b}");
        }
    }
}
