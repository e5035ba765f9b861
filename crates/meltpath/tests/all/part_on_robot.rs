//! A robot that holds the part before a torch that stands: its programs for KUKA and ABB, from job to verdict and back, and what is told of those that
//! say otherwise than the robot's file.

use std::path::{Path, PathBuf};

use crate::dialects::cell;
use crate::support::{check, thin_wall};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_robot::cell as robot;

/// A torch beside the arm that leans, and a holder that is turned.
const KUKA: [&str; 3] = [
    "kuka-krl",
    "position = [\"850 mm\", \"-650 mm\", \"700 mm\"]\nangles = [\"165 deg\", \"12 deg\", \"30 deg\"]",
    "position = [\"10 mm\", \"-15 mm\", \"120 mm\"]\nangles = [\"0 deg\", \"0 deg\", \"25 deg\"]",
];
const ABB: [&str; 3] = [
    "abb-rapid",
    "position = [\"1300 mm\", \"300 mm\", \"1300 mm\"]\nangles = [\"-160 deg\", \"8 deg\", \"-70 deg\"]",
    "position = [\"-20 mm\", \"5 mm\", \"100 mm\"]\nangles = [\"5 deg\", \"0 deg\", \"-40 deg\"]",
];

/// The lines of a text but for those that are left out.
fn without(text: &str, left_out: impl Fn(&str) -> bool) -> String {
    let lines: Vec<&str> = text.lines().filter(|l| !left_out(l)).collect();
    lines.join("\n") + "\n"
}

/// The arm of this controller that ships, with the part on its flange.
fn robot_file([dialect, torch, part]: [&str; 3]) -> String {
    let text = match dialect {
        "abb-rapid" => meltpath_data::robots::ABB_IRB2600_12_185.text,
        _ => meltpath_data::robots::KUKA_KR16_R2010_2.text,
    };
    let (arm, rest) = text.split_once("[torch]").unwrap();
    let (_, shapes) = rest.split_once("[shapes]").unwrap();
    let shapes = without(shapes, |l| l.starts_with("table"));
    let arm = arm.replacen("[arm]", "arrangement = \"part-on-robot\"\n[arm]", 1);
    format!(
        "{arm}[torch]\nsource = \"measured\"\n{torch}\nwire = \"15 mm\"\n[part]\nsource = \"measured\"\n{part}\n[shapes]\nsource = \"measured\"\n{shapes}"
    )
}

struct Job {
    dir: tempfile::TempDir,
    job: PathBuf,
}

impl Job {
    fn of(which: [&str; 3], more: &str) -> Job {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("cell.toml"), cell(which[0])).unwrap();
        std::fs::write(dir.path().join("robot.toml"), robot_file(which)).unwrap();
        let job = thin_wall(
            dir.path(),
            &format!(
                "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 2\n\
                 [machine]\ncell = \"cell.toml\"\nrobot = \"robot.toml\"\n[simulation]\ncell = \"1 mm\"\n{more}"
            ),
        );
        Job { dir, job }
    }

    fn run(&self) -> (PathBuf, Verdict) {
        let runs = self.dir.path().join("runs");
        let outcome = run(&self.job, NextIn(&runs), &Silent).unwrap();
        (outcome.folder, outcome.verdict)
    }

    fn simulate(&self, program: &Path) -> (PathBuf, Verdict) {
        let runs = self.dir.path().join("played");
        let outcome = simulate_program(program, Some(&self.job), NextIn(&runs), &Silent);
        let outcome = outcome.unwrap();
        (outcome.folder, outcome.verdict)
    }

    fn robot(&self) -> robot::Cell {
        let text = std::fs::read_to_string(self.dir.path().join("robot.toml")).unwrap();
        robot::read(&text).unwrap()
    }
}

/// Degrees about the x, y and z of the frame before, as KUKA's C, B, A are.
fn turned([x, y, z]: [f64; 3]) -> DQuat {
    let [x, y, z] = [x, y, z].map(f64::to_radians);
    DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x)
}

fn numbers(text: &str) -> Vec<f64> {
    let parts = text.split(|c: char| !(c.is_ascii_digit() || matches!(c, '-' | '.')));
    parts.filter_map(|p| p.parse().ok()).collect()
}

/// Where each position of a program puts the flange in the world, as its controller takes it: a KUKA is told the part's frame in the torch's, an ABB
/// the torch in the part.
fn flanges(dialect: &str, folder: &Path, cell: &robot::Cell) -> Vec<Pose> {
    let torch = cell.carrier_from_torch.then(cell.torch_from_wire_tip);
    let part = cell.carrier_from_part;
    let files = std::fs::read_dir(folder.join("program")).unwrap();
    let files = files.map(|f| f.unwrap().path());
    let texts = files.map(|p| std::fs::read_to_string(p).unwrap());
    let text: String = texts.collect();
    let at = |n: &[f64]| DVec3::new(n[0], n[1], n[2]);
    let flange = |line: &str| {
        if dialect == "kuka-krl" {
            let said = numbers(line.strip_prefix("DECL POS X")?.split_once('{')?.1);
            let part_in_torch = Pose {
                position: at(&said),
                orientation: turned([said[5], said[4], said[3]]),
            };
            Some(torch.then(part_in_torch).then(part.inverse()))
        } else {
            let (_, said) = line.trim().split_once("CONST robtarget ")?;
            let said = numbers(said.split_once(":=")?.1);
            let torch_in_part = Pose {
                position: at(&said),
                orientation: DQuat::from_xyzw(said[4], said[5], said[6], said[3]).normalize(),
            };
            Some(torch.then(torch_in_part.inverse()).then(part.inverse()))
        }
    };
    text.lines().filter_map(flange).collect()
}

/// Where the arm's chain puts the flange at each row of the joints' series.
fn driven(folder: &Path, cell: &robot::Cell) -> Vec<Pose> {
    let text = std::fs::read_to_string(folder.join("series/joints.csv")).unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let first = head.iter().position(|h| *h == "joint_1_deg").unwrap();
    let row = |line: &str| {
        let shown: Vec<f64> = line
            .split(',')
            .skip(first)
            .take(6)
            .map(|v| v.parse::<f64>().unwrap().to_radians())
            .collect();
        let joints = cell.arm.joints(shown.try_into().unwrap());
        let values = robot::Values {
            arm: joints,
            ..cell.at_rest()
        };
        cell.frames(&values).flange
    };
    lines.map(row).collect()
}

#[test]
fn programs_with_the_part_on_the_robot_run_and_are_read_back() {
    for which in [KUKA, ABB] {
        let dialect = which[0];
        let job = Job::of(which, "");
        let (folder, verdict) = job.run();
        for id in ["program", "reach", "joint-speed", "collision", "config"] {
            let found = check(&verdict, id);
            assert_eq!(found.status, Status::Pass, "{dialect}: {found:?}");
        }
        assert!(verdict.checks.iter().all(|c| c.id != "fixed-torch"));
        // the chain at the joints that were driven, and the program as its controller takes it
        let cell = job.robot();
        let (told, driven) = (flanges(dialect, &folder, &cell), driven(&folder, &cell));
        assert!(told.len() > 20, "{dialect}: {}", told.len());
        for flange in told {
            let off = |at: &Pose| {
                let turned = at.orientation.angle_between(flange.orientation);
                (at.position.distance(flange.position), turned.to_degrees())
            };
            let off = driven.iter().map(off);
            let near = off.filter(|(mm, deg)| *mm < 1e-3 && *deg < 1e-3).count();
            assert!(near > 0, "{dialect}: no arm stands at {flange:?}");
        }
        // the same metal and motion from the files alone
        let file = std::fs::read_dir(folder.join("program")).unwrap();
        let program = file.map(|f| f.unwrap().path());
        let mut program = program.filter(|p| p.extension().is_none_or(|e| e != "dat"));
        let (played, again) = job.simulate(&program.next().unwrap());
        for name in ["as-built.stl", "series/motion.csv", "series/joints.csv"] {
            let [a, b] = [&folder, &played].map(|f| std::fs::read(f.join(name)).unwrap());
            assert_eq!(a, b, "{dialect}: {name}");
        }
        for id in ["lines", "reach", "joint-speed", "collision", "config"] {
            assert_eq!(check(&again, id).status, Status::Pass, "{dialect}: {id}");
        }
    }
}

/// A Stäubli's project leads each point of the part to the torch; read back it is the same motion, and it says where torch and part are.
#[test]
fn a_staublis_project_with_the_part_on_the_robot_runs_and_is_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let words = cell("staubli-val3")
        .replace(
            "part_position = [\"500 mm\", \"0 mm\", \"0 mm\"]",
            "part_position = [\"0 mm\", \"0 mm\", \"80 mm\"]",
        )
        .replace(
            "tool_position = [\"8.6036 mm\", \"0 mm\", \"342.2873 mm\"]\ntool_angles = [\"0 deg\", \"35 deg\", \"0 deg\"]",
            "tool_position = [\"480 mm\", \"0 mm\", \"700 mm\"]\ntool_angles = [\"180 deg\", \"0 deg\", \"0 deg\"]",
        );
    std::fs::write(dir.path().join("cell.toml"), &words).unwrap();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let robot = std::fs::read_to_string(examples.join("torus-on-flange/robot.toml")).unwrap();
    std::fs::write(dir.path().join("robot.toml"), robot).unwrap();
    let job = thin_wall(
        dir.path(),
        "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 2\n\
         [machine]\ncell = \"cell.toml\"\nrobot = \"robot.toml\"\n[simulation]\ncell = \"1 mm\"\n",
    );
    let job = Job { dir, job };
    let (folder, verdict) = job.run();
    assert!(verdict.checks.iter().all(|c| c.id != "fixed-torch"));
    assert_eq!(check(&verdict, "program").status, Status::Pass);
    // torch and holder are guessed, so that no check passes by them
    let reach = check(&verdict, "reach");
    assert!(
        reach.value.is_some() && !reach.reason.contains("elsewhere"),
        "{reach:?}"
    );
    let programs = std::fs::read_dir(folder.join("program")).unwrap();
    let mut programs = programs.map(|f| f.unwrap().path());
    let program = programs.find(|p| {
        p.extension().is_some_and(|e| e == "pgx")
            && !p.ends_with("start.pgx")
            && !p.ends_with("stop.pgx")
    });
    let (played, again) = job.simulate(&program.unwrap());
    for name in ["as-built.stl", "series/motion.csv", "series/joints.csv"] {
        let [a, b] = [&folder, &played].map(|f| std::fs::read(f.join(name)).unwrap());
        assert_eq!(a, b, "{name}");
    }
    assert_eq!(check(&again, "lines").status, Status::Pass);
    // a cell file that says otherwise
    let aside = words.replace(
        "\"480 mm\", \"0 mm\", \"700 mm\"",
        "\"490 mm\", \"0 mm\", \"700 mm\"",
    );
    std::fs::write(job.dir.path().join("cell.toml"), aside).unwrap();
    let (_, found) = job.run();
    let reach = check(&found, "reach");
    for told in ["the wire tip is at", "in the world", "10.0 mm"] {
        assert!(reach.reason.contains(told), "{reach:?}");
    }
}

/// A program whose words say otherwise than the robot's file.
#[test]
fn a_program_that_holds_otherwise_than_the_robots_file_is_told() {
    let job = Job::of(KUKA, "");
    let (folder, _) = job.run();
    let dir = job.dir.path().join("edited");
    std::fs::create_dir(&dir).unwrap();
    let source = std::fs::read_dir(folder.join("program")).unwrap();
    let files: Vec<PathBuf> = source.map(|f| f.unwrap().path()).collect();
    let of = |ending: &str| {
        let ends = |p: &&PathBuf| p.extension().is_some_and(|e| e == ending);
        files.iter().find(ends).unwrap()
    };
    let name = of("src").file_name().unwrap();
    std::fs::copy(of("dat"), dir.join(of("dat").file_name().unwrap())).unwrap();
    let text = std::fs::read_to_string(of("src")).unwrap();
    let edited = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let path = dir.join(name);
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        path
    };
    let (_, found) = job.simulate(&edited("$IPO_MODE=#TCP\n", ""));
    for id in ["reach", "joint-speed", "collision", "config"] {
        let found = check(&found, id);
        assert_eq!(found.status, Status::CannotSay, "{found:?}");
        let told = "with the part on the robot, and by program";
        assert!(found.reason.contains(told), "{found:?}");
        assert!(found.reason.contains("line "), "{found:?}");
        let remedy = found.remedy.as_deref().unwrap_or_default();
        assert!(
            remedy.contains("arrangement of the robot's file"),
            "{remedy}"
        );
    }
    // the frames written out as the comments tell them: the torch is the base, the part the tool
    let written = |table: &str| {
        let told = text
            .lines()
            .find_map(|l| l.strip_prefix(&format!(";{table}[1]=")));
        let told = told.unwrap();
        told[..=told.find('}').unwrap()].to_owned()
    };
    let base = written("BASE_DATA");
    let out = |base: &str| {
        let tool = format!("$TOOL={}\n", written("TOOL_DATA"));
        let path = edited("$TOOL=TOOL_DATA[1]\n", &tool);
        let tooled = std::fs::read_to_string(&path).unwrap();
        let both = tooled.replacen("$BASE=BASE_DATA[1]\n", &format!("$BASE={base}\n"), 1);
        assert_ne!(both, tooled);
        std::fs::write(&path, both).unwrap();
        job.simulate(&path).1
    };
    assert_eq!(check(&out(&base), "reach").status, Status::Pass);
    let x = numbers(&base)[0];
    let aside = out(&base.replacen(&format!("X {x:.3}"), &format!("X {:.3}", x + 10.0), 1));
    let found = check(&aside, "reach");
    assert_eq!(found.status, Status::CannotSay, "{found:?}");
    for told in ["the wire tip is at", "in the world", "10.0 mm"] {
        assert!(found.reason.contains(told), "{found:?}");
    }
    let path = edited("$BASE=BASE_DATA[1]\n", "");
    let runs = NextIn(&dir);
    let error = simulate_program(&path, Some(&job.job), runs, &Silent).unwrap_err();
    assert!(error.to_string().contains("$BASE=BASE_DATA[n]"), "{error}");
}

/// What an ABB's module says of robhold and of its frames is held against the robot's file.
#[test]
fn the_data_of_a_module_are_held_against_the_robots_file() {
    let job = Job::of(ABB, "");
    let (folder, _) = job.run();
    let file = std::fs::read_dir(folder.join("program")).unwrap().next();
    let path = file.unwrap().unwrap().path();
    let text = std::fs::read_to_string(&path).unwrap();
    // as the comments tell them
    let told = |name: &str| {
        let line = text
            .lines()
            .find_map(|l| l.trim().strip_prefix('!')?.strip_prefix(name));
        let line = line.unwrap().trim_start_matches(": ");
        line[..=line.rfind(']').unwrap()].to_owned()
    };
    let load = "[5,[0,0,50],[1,0,0,0],0,0,0]";
    let tool = format!(
        "PERS tooldata tTorch:={};",
        told("tTorch").replace("load of the gripper", load)
    );
    let object = format!("PERS wobjdata wPart:={};", told("wPart"));
    let played = |tool: &str, object: &str, text: &str| {
        let (head, rest) = text.split_once('\n').unwrap();
        let path = job.dir.path().join("edited.mod");
        std::fs::write(&path, format!("{head}\n{tool}\n{object}\n{rest}")).unwrap();
        job.simulate(&path).1
    };
    let agrees = played(&tool, &object, &text);
    assert_eq!(check(&agrees, "reach").status, Status::Pass);
    assert_eq!(check(&agrees, "lines").status, Status::Pass);
    // the torch in the world, the part in the flange
    let place = numbers(&tool)[0];
    let aside = tool.replacen(&place.to_string(), &(place + 10.0).to_string(), 1);
    let found = played(&aside, &object, &text);
    let found = check(&found, "reach");
    assert_eq!(found.status, Status::CannotSay, "{found:?}");
    assert!(found.reason.contains("10.0 mm"), "{found:?}");
    assert!(found.reason.contains("in the world"), "{found:?}");
    let moved = object.replacen("[[-20,", "[[-30,", 1);
    assert_ne!(moved, object);
    let found = played(&tool, &moved, &text);
    let found = check(&found, "collision");
    assert!(found.reason.contains("in the flange"), "{found:?}");
    // held by the robot and standing, the other way round
    let (held, stands) = (
        tool.replacen("[FALSE,", "[TRUE,", 1),
        object.replacen("[TRUE,", "[FALSE,", 1),
    );
    let unguarded = without(&text, |l| l.contains("EXIT"));
    let found = played(&held, &stands, &unguarded);
    let found = check(&found, "reach");
    assert!(
        found.reason.contains("it holds the torch (robhold"),
        "{found:?}"
    );
    let found = played(&held, &object, &unguarded);
    let found = check(&found, "lines");
    assert_eq!(found.status, Status::CannotSay);
    assert!(found.reason.contains("both torch and part"), "{found:?}");
    // the program would end at once
    let found = played(&held, &stands, &text);
    assert_eq!(check(&found, "lines").status, Status::CannotSay);
}

/// Of several controllers those are named whose words are not known.
#[test]
fn controllers_without_known_words_are_named() {
    let job = Job::of(
        KUKA,
        "[output]\nprograms = [\"kuka-krl\", \"fanuc-ls\", \"abb-rapid\"]\n",
    );
    let (_, verdict) = job.run();
    let found = check(&verdict, "fixed-torch");
    assert_eq!(found.status, Status::CannotSay, "{found:?}");
    assert!(found.reason.contains("FANUC"), "{found:?}");
    for known in ["KUKA", "ABB"] {
        assert!(!found.reason.contains(known), "{found:?}");
    }
}

/// What the flange holds is the wrist's neighbour, and a torch that stands is not.
#[test]
fn a_wrist_comes_near_a_torch_that_stands() {
    let job = Job::of(KUKA, "");
    let told = |verdict: &Verdict| {
        let fact = verdict.facts.iter().find(|f| f.id == "clearances");
        fact.unwrap().reason.clone()
    };
    let (_, verdict) = job.run();
    let pairs = told(&verdict);
    for link in 4..=6 {
        assert!(
            pairs.contains(&format!("nozzle and link {link} ")),
            "{pairs}"
        );
    }
    let path = job.dir.path().join("robot.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let links = text.lines().find(|l| l.starts_with("links")).unwrap();
    let mut radii: Vec<&str> = links.split(", ").collect();
    radii[4] = "\"400 mm\"";
    std::fs::write(&path, text.replacen(links, &radii.join(", "), 1)).unwrap();
    let (_, verdict) = job.run();
    let collision = check(&verdict, "collision");
    assert_eq!(collision.status, Status::Fail, "{collision:?}");
    assert!(collision.reason.contains("link 5"), "{collision:?}");
}
