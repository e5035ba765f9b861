//! Programs whose positions are given by joints: with the job's robot they are simulated as the same positions told by X, Y, Z, W, P, R
//! are, and without it the line says what to name.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::reach::measured;
use crate::support::{check, says, thin_wall, warned, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::simulate_program;
use meltpath_base::{Silent, Status, Verdict};
use meltpath_data::{cells, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_robot::cell::{Cell, Values, read};

/// How a position is told.
#[derive(Clone, Copy, PartialEq)]
enum By {
    Place,
    Joints,
}

/// Where a position lies: x, y, z of the user frame, mm, and what further axes say: E1, mm, and those of group 2, deg.
#[derive(Clone, Copy)]
struct At([f64; 3], Option<f64>, Option<[f64; 2]>);

const fn at(xyz: [f64; 3]) -> At {
    At(xyz, None, None)
}

/// The joints of an arm that holds a pose with CONFIG N U T, deg as they are shown.
fn shown(cell: &Cell, pose: Pose, values: &Values) -> [f64; 6] {
    let found = cell
        .arm
        .inverse(cell.base_from_flange(pose, values))
        .unwrap();
    let named = |angles: [f64; 6]| cell.arm.configuration(angles).unwrap().to_string();
    let all = found.solutions.iter().map(|s| s.angles);
    let joints = all.into_iter().find(|a| named(*a) == "N U T, 0, 0, 0");
    cell.arm.shown(joints.unwrap()).map(f64::to_degrees)
}

/// The text of position `n`; its tool looks straight down. `height` is that of the plate in the user frame, mm.
fn position(n: usize, by: By, At(xyz, track, table): At, cell: &Cell, height: f64) -> String {
    let mut text = format!("P[{n}]{{\n GP1:\n UF : 1, UT : 1,");
    let pose = Pose::from_wpr(
        DVec3::from_array(xyz),
        DVec3::new(std::f64::consts::PI, 0.0, 0.0),
    );
    match by {
        By::Place => {
            let [x, y, z] = xyz;
            let z = z + height;
            write!(text, " CONFIG : 'N U T, 0, 0, 0',\n X = {x} mm, Y = {y} mm, Z = {z} mm, W = 180 deg, P = 0 deg, R = 0 deg").unwrap();
        }
        By::Joints => {
            let values = Values {
                track: track.unwrap_or(0.0),
                positioner: table.unwrap_or_default().map(f64::to_radians),
                ..cell.at_rest()
            };
            let joints = shown(cell, pose, &values);
            let told: Vec<String> = (1..)
                .zip(joints)
                .map(|(j, a)| format!("J{j} = {a:.9} deg"))
                .collect();
            write!(text, " {}", told.join(", ")).unwrap();
        }
    }
    if let Some(e) = track {
        write!(text, ", E1 = {e} mm").unwrap();
    }
    if let Some([a, b]) = table {
        write!(text, "\n GP2:\n UF : 1, UT : 1, J1 = {a} deg, J2 = {b} deg").unwrap();
    }
    text + "\n};\n"
}

/// Two beads of a wall one over the other, and a way to them from beside.
const WALL: [&str; 8] = [
    "UFRAME_NUM=1",
    "UTOOL_NUM=1",
    "J P[1] 20% FINE",
    "J P[2] 20% FINE Arc Start[7]",
    "L P[3] WELD_SPEED FINE Arc End[7]",
    "J P[1] 50% CNT100",
    "L P[4] 20mm/sec FINE Arc Start[7]",
    "L P[5] WELD_SPEED FINE Arc End[7]",
];
const PLACES: [At; 5] = [
    at([40.0, 30.0, 60.0]),
    at([0.0, 0.0, 0.0]),
    at([100.0, 0.0, 0.0]),
    at([100.0, 0.0, 1.7]),
    at([0.0, 0.0, 1.7]),
];

fn program(folder: &Path, name: &str, lines: &[&str], positions: &[String]) -> PathBuf {
    let mut text = "/PROG WALL\n/MN\n".to_owned();
    for (n, line) in lines.iter().enumerate() {
        writeln!(text, "{:4}:{line} ;", n + 1).unwrap();
    }
    let text = format!("{text}/POS\n{}/END\n", positions.concat());
    write(folder, name, text)
}

/// A job whose cell knows schedule 7, with further lines of its tables `machine`, `program` and others.
fn job(folder: &Path, machine: &str, of_cell: &str, tables: &str) -> PathBuf {
    let shipped = cells::ARCMATE_120IC.text;
    let schedule = "[[program.schedule]]\nnumber = 7\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n";
    write(
        folder,
        "cell.toml",
        format!("{shipped}\n{schedule}{of_cell}"),
    );
    thin_wall(
        folder,
        &format!(
            "[machine]\ncell = \"cell.toml\"\n{machine}\n[simulation]\ncell = \"1 mm\"\n{tables}"
        ),
    )
}

fn judged(job: &Path, program: &Path) -> Verdict {
    let runs = job.with_file_name("runs");
    simulate_program(program, Some(job), NextIn(&runs), &Silent)
        .unwrap()
        .verdict
}

/// The robot of a folder.
fn robot(folder: &Path) -> Cell {
    read(&std::fs::read_to_string(folder.join("robot.toml")).unwrap()).unwrap()
}

/// Both verdicts say the same, but for what the last digits of joints in a file do to columns of metal.
#[track_caller]
fn same(a: &Verdict, b: &Verdict) {
    assert_eq!(a.checks.len(), b.checks.len());
    for (a, b) in a.checks.iter().zip(&b.checks) {
        assert_eq!((&a.id, a.status), (&b.id, b.status), "{a:?} {b:?}");
        let value = |c: &meltpath_base::Check| c.value.as_ref().map_or(0.0, |v| v.value);
        let (x, y) = (value(a), value(b));
        // a column more or less at an edge, by the rounding of places, is 0.1 % of what is uneven, and moves a percentile of few columns by 1 %
        let digits = if a.id == "flatness" { 2e-2 } else { 3e-3 };
        assert!((x - y).abs() <= digits * x.abs().max(1.0), "{a:?} {b:?}");
    }
}

/// The verdicts of a program whose positions are told by places, and of it with those of `by_joints` told by joints.
fn both(
    folder: &Path,
    job: &Path,
    lines: &[&str],
    places: &[At],
    by_joints: &[usize],
) -> [Verdict; 2] {
    let cell = robot(folder);
    [&[][..], by_joints].map(|joints| {
        let by = |n| {
            if joints.contains(&n) {
                By::Joints
            } else {
                By::Place
            }
        };
        let positions: Vec<String> = (1..)
            .zip(places)
            .map(|(n, at)| position(n, by(n), *at, &cell, 412.0))
            .collect();
        judged(job, &program(folder, "wall.ls", lines, &positions))
    })
}

const PLATE: &str = "[substrate]\nheight = \"412 mm\"\n";

#[test]
fn joints_lead_to_the_place_that_they_hold() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path(), measured(dir.path()), "", PLATE);
    for by_joints in [&[1][..], &[2, 3], &[1, 2, 3, 4, 5]] {
        let [places, joints] = both(dir.path(), &job, &WALL, &PLACES, by_joints);
        for id in ["lines", "reach", "config"] {
            let check = check(&joints, id);
            assert_eq!(check.status, Status::Pass, "{by_joints:?} {check:?}");
        }
        same(&places, &joints);
    }
    // an arm goes to joints before any frame is selected
    let early = [&["J P[1] 20% FINE"], &WALL[..]].concat();
    let [_, joints] = both(dir.path(), &job, &early, &PLACES, &[1]).map(|v| v);
    assert_eq!(check(&joints, "lines").status, Status::Pass);
}

/// Beads on a table that turns: both groups by joints.
#[test]
fn joints_of_both_groups_lay_coordinated_beads() {
    let dir = tempfile::tempdir().unwrap();
    let text = robots::FANUC_ARCMATE_120IC.text;
    write(dir.path(), "robot.toml", text);
    let words = "[program.positioner]\nsource = \"test\"\nuser_frame = \"part\"\n[[program.positioner.axis]]\n[[program.positioner.axis]]\n";
    let job = job(dir.path(), "robot = \"robot.toml\"", words, PLATE);
    let turned = [
        [0.0, 0.0],
        [0.0, 0.0],
        [10.0, 30.0],
        [10.0, 30.0],
        [0.0, 10.0],
    ];
    let places: Vec<At> = PLACES
        .iter()
        .zip(turned)
        .map(|(at, t)| At(at.0, None, Some(t)))
        .collect();
    let lines: Vec<String> = WALL
        .iter()
        .map(|l| {
            if l.starts_with("L ") {
                format!("{l} COORD")
            } else {
                (*l).to_owned()
            }
        })
        .collect();
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let [places, joints] = both(dir.path(), &job, &lines, &places, &[1, 2, 3, 4, 5]);
    println!("{}", check(&joints, "reach").line());
    assert_eq!(check(&joints, "lines").status, Status::Pass);
    same(&places, &joints);
}

/// An arm on a track: E1 moves its base, and the same joints hold another place.
#[test]
fn a_track_carries_the_arm() {
    let dir = tempfile::tempdir().unwrap();
    measured(dir.path());
    let text = std::fs::read_to_string(dir.path().join("robot.toml")).unwrap();
    let track = "[track]\nsource = \"test\"\naxis = [0, 1, 0]\nlow = \"-500 mm\"\nhigh = \"500 mm\"\nspeed = \"1 m/s\"\n";
    write(dir.path(), "robot.toml", format!("{text}\n{track}"));
    let job = job(dir.path(), "robot = \"robot.toml\"", "", PLATE);
    let along = |e: f64| PLACES.map(|at| At(at.0, Some(e), None));
    let [places, joints] = both(dir.path(), &job, &WALL, &along(400.0), &[1, 2, 3, 4, 5]);
    println!("{}", check(&joints, "reach").line());
    assert_eq!(check(&joints, "reach").status, Status::Pass);
    same(&places, &joints);
    let [still, _] = both(dir.path(), &job, &WALL, &along(0.0), &[]);
    println!("{}", check(&still, "reach").line());
    let value = |v: &Verdict| check(v, "reach").value.as_ref().unwrap().value;
    assert!(
        (value(&still) - value(&joints)).abs() > 0.5,
        "the track does not carry the arm"
    );
}

/// Where the wrist is stretched, joints four and six share their turn: the arm stands as the position says, not as some way to hold it does.
#[test]
fn joints_of_a_stretched_wrist_are_those_told() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path(), measured(dir.path()), "", PLATE);
    let cell = robot(dir.path());
    let mut positions: Vec<String> = (1..)
        .zip(PLACES)
        .map(|(n, at)| position(n, By::Place, at, &cell, 412.0))
        .collect();
    // no straight move leads on from there
    let lines = WALL.map(|l| l.replace("L P[4] 20mm/sec", "J P[4] 20%"));
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    for (wound, wanted) in [(197.0, 3.0), (-199.0, 1.0)] {
        positions[0] = format!(
            "P[1]{{ GP1: UF:0, UT:1, J1= 0 deg, J2= -20 deg, J3= 10 deg, J4= {wound} deg, J5= 0 deg, J6= {} deg }};\n",
            -wound
        );
        let verdict = judged(&job, &program(dir.path(), "wall.ls", &lines, &positions));
        let reach = check(&verdict, "reach");
        println!("{}", reach.line());
        assert!(
            (reach.value.as_ref().unwrap().value - wanted).abs() < 1e-6,
            "{reach:?}"
        );
        assert!(reach.reason.contains("joint 4"), "{reach:?}");
    }
}

#[test]
fn joints_that_lead_nowhere_are_told_with_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    measured(dir.path());
    let cell = robot(dir.path());
    let told = |by_joints: &[usize], change: &dyn Fn(usize, String) -> String, machine: &str| {
        let job = job(dir.path(), machine, "", PLATE);
        let positions: Vec<String> = (1..)
            .zip(PLACES)
            .map(|(n, at)| {
                let by = if by_joints.contains(&n) {
                    By::Joints
                } else {
                    By::Place
                };
                change(n, position(n, by, at, &cell, 412.0))
            })
            .collect();
        judged(&job, &program(dir.path(), "wall.ls", &WALL, &positions))
    };
    let plain = |_: usize, text: String| text;
    // without a robot a travel is left out and a bead undecided
    let travel = told(&[1], &plain, "");
    assert_eq!(check(&travel, "lines").status, Status::Pass);
    assert!(warned(&travel, "joint-position-skipped"));
    let bead = told(&[3], &plain, "");
    let lines = check(&bead, "lines");
    assert_eq!(lines.status, Status::CannotSay);
    says(
        &lines.reason,
        &["P[3] is given by joints, and no robot is named"],
    );
    says(&lines.remedy.clone().unwrap(), &["machine.robot"]);
    // another maker's robot has other joints
    let other = told(&[3], &plain, "robot = \"kuka-kr16-r2010-2\"");
    says(&check(&other, "lines").reason, &["another maker's"]);
    // axes that the robot lacks, too few joints, joints in mm
    let own = "robot = \"robot.toml\"";
    for (from, to) in [
        ("J6 =", "E1 = 3 mm, J6 ="),
        ("J6 =", "J7 ="),
        (" deg", " mm"),
    ] {
        let change = |n: usize, text: String| if n == 3 { text.replace(from, to) } else { text };
        let verdict = told(&[3], &change, own);
        says(
            &check(&verdict, "lines").reason,
            &["P[3] is given by other axes"],
        );
    }
    let untaught = |n: usize, text: String| {
        if n == 3 {
            "P[3]{ GP1: UF : 1, UT : 1, J1 = ******** deg };\n".to_owned()
        } else {
            text
        }
    };
    says(
        &check(&told(&[], &untaught, own), "lines").reason,
        &["P[3] is not taught"],
    );
    // a joint beyond its limit
    let beyond = |n: usize, text: String| match n {
        1 => {
            let (before, after) = text.split_once("J4 = ").unwrap();
            format!("{before}J4 = 240 deg,{}", after.split_once(',').unwrap().1)
        }
        _ => text,
    };
    let verdict = told(&[1], &beyond, own);
    let reach = check(&verdict, "reach");
    assert_eq!(reach.status, Status::Fail);
    says(&reach.reason, &["joint 4"]);
}

/// The columns of a table and its rows, NaN where nothing stands.
fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines().map(|l| l.split(','));
    let heads = lines.next().unwrap().map(str::to_owned).collect();
    let value = |text: &str| text.parse().unwrap_or(f64::NAN);
    (heads, lines.map(|l| l.map(value).collect()).collect())
}

/// The table of joints says what the positions say, keeps the limits of the robot's file, and ends when the program does. A table that
/// turns slowly makes travels longer.
#[test]
fn the_joints_of_a_program_are_a_table_and_slow_axes_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let text = robots::FANUC_ARCMATE_120IC.text;
    let slow = "speed = [\"120 deg/s\", \"180 deg/s\"]";
    let words = "[program.positioner]\nsource = \"test\"\nuser_frame = \"part\"\n[[program.positioner.axis]]\n[[program.positioner.axis]]\n";
    let turned = [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 30.0], [0.0, 30.0]];
    let places = PLACES.iter().zip(turned);
    let places: Vec<At> = places.map(|(at, t)| At(at.0, None, Some(t))).collect();
    let job = job(dir.path(), "robot = \"robot.toml\"", words, PLATE);
    let mut facts = Vec::new();
    for speed in [slow, "speed = [\"2 deg/s\", \"2 deg/s\"]"] {
        assert!(text.contains(slow));
        write(dir.path(), "robot.toml", text.replace(slow, speed));
        let cell = robot(dir.path());
        let positions: Vec<String> = (1..)
            .zip(&places)
            .map(|(n, at)| position(n, By::Joints, *at, &cell, 412.0))
            .collect();
        let file = program(dir.path(), "wall.ls", &WALL, &positions);
        let runs = dir.path().join("runs");
        let outcome = simulate_program(&file, Some(&job), NextIn(&runs), &Silent).unwrap();
        let facts_of = outcome.verdict.facts.iter();
        facts.push(
            facts_of
                .filter(|f| f.id == "travel-axes")
                .cloned()
                .collect::<Vec<_>>(),
        );
        if speed != slow {
            continue;
        }
        let csv = std::fs::read_to_string(outcome.folder.join("series/joints.csv")).unwrap();
        let (heads, rows) = table(&csv);
        println!("{heads:?}\n{:?}\n{:?}", rows[0], rows.last().unwrap());
        let wanted = "time_s,command,layer,bead,joint_1_deg,joint_2_deg,joint_3_deg,joint_4_deg,joint_5_deg,joint_6_deg,\
            positioner_1_deg,positioner_2_deg,limit_margin_deg,limit_joint,wrist_from_singular_deg,fastest_percent,fastest_axis";
        assert_eq!(heads, wanted.split(',').collect::<Vec<_>>());
        // both beads of 100 mm in steps of 5 mm, and the ends of the joint moves
        assert!(rows.len() > 42, "{}", rows.len());
        assert!(
            rows.windows(2).all(|w| w[0][0] <= w[1][0]),
            "time goes back"
        );
        let end =
            table(&std::fs::read_to_string(outcome.folder.join("series/motion.csv")).unwrap());
        let (last, total) = (rows.last().unwrap()[0], end.1.last().unwrap()[0]);
        assert!((last - total).abs() < 0.2, "{last} {total}");
        // the ends of moves stand as the positions say
        let down = Pose::from_wpr(DVec3::ZERO, DVec3::new(std::f64::consts::PI, 0.0, 0.0));
        for (command, at) in [(0.0, 1), (1.0, 2), (2.0, 0), (3.0, 3), (4.0, 4)] {
            let At(xyz, _, table) = places[at];
            let values = Values {
                positioner: table.unwrap().map(f64::to_radians),
                ..cell.at_rest()
            };
            let pose = Pose {
                position: DVec3::from_array(xyz),
                ..down
            };
            let joints = shown(&cell, pose, &values);
            let row = rows.iter().rev().find(|r| r[1] == command).unwrap();
            for (a, b) in row[4..10].iter().zip(joints) {
                assert!((a - b).abs() < 1e-5, "{command}: {row:?} {joints:?}");
            }
            assert!((row[11] - table.unwrap()[1]).abs() < 1e-9);
            // beads alone are counted
            assert_eq!(
                row[3].is_nan(),
                command == 0.0 || command == 2.0 || command == 3.0
            );
        }
        // limits as the file says them
        let low = [-170.0, -100.0, -185.0, -200.0, -140.0, -270.0];
        let high = [170.0, 160.0, 273.0, 200.0, 140.0, 270.0];
        for row in &rows {
            let margins = (0..6).map(|j| (row[4 + j] - low[j]).min(high[j] - row[4 + j]));
            let least = margins.fold(f64::INFINITY, f64::min);
            assert!((row[12] - least).abs() < 1e-9, "{row:?}");
            let j = row[13] as usize - 1;
            assert!(((row[4 + j] - low[j]).min(high[j] - row[4 + j]) - least).abs() < 1e-9);
            assert!(
                (row[14] - row[8].abs()).abs() < 1e-9 || row[8].abs() > 90.0,
                "{row:?}"
            );
        }
    }
    assert!(facts[0].is_empty(), "{facts:?}");
    // 30 deg at 2 deg/s: the straight travel of 86 mm at 20 mm/s is done before
    let told = &facts[1][0];
    println!("{told:?}");
    says(
        &told.reason,
        &[
            "axis 2 of the positioner: 15.0 s in place of ",
            "without accelerations",
        ],
    );
    let value = told.value.as_ref().unwrap().value;
    assert!((9.0..12.0).contains(&value), "{told:?}");
}

/// A wall run for a KUKA, its robot and further settings said by `machine`: the job and its program.
fn kuka_wall(home: &Path, layers: u32, machine: &str) -> (PathBuf, PathBuf) {
    write(home, "cell.toml", crate::dialects::cell("kuka-krl"));
    let job = thin_wall(
        home,
        &format!(
            "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = {layers}\n\
             [machine]\ncell = \"cell.toml\"\n{machine}\n[simulation]\ncell = \"1 mm\"\n"
        ),
    );
    let ran = meltpath::waam::run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
    (job, ran.folder.join("program/JOB.src"))
}

/// A KUKA's joints are A1 to A6, counted as its controller does: the way to the wall that a run wrote, told by joints instead.
#[test]
fn axes_of_a_kuka_lead_to_the_place_that_they_hold() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let machine = "robot = \"kuka-kr16-r2010-2\"\nsmoothing = \"50 %\"";
    let (job, file) = kuka_wall(&home, 2, machine);
    let data = file.with_extension("dat");
    let text = std::fs::read_to_string(&data).unwrap();
    let line = text.lines().find(|l| l.contains("XP1={")).unwrap();
    let value = |name: &str| -> f64 {
        let after = line.split_once(&format!("{name} ")).unwrap().1;
        let end = after.find([',', '}']).unwrap();
        after[..end].trim().parse().unwrap()
    };
    let [x, y, z] = ["{X", "Y", "Z"].map(value);
    let wpr = ["C", "B", "A"].map(|n| value(&format!(",{n}")).to_radians());
    let pose = Pose::from_wpr(DVec3::new(x, y, z), DVec3::from_array(wpr));
    let robot = read(
        meltpath_data::find(robots::ALL, "kuka-kr16-r2010-2")
            .unwrap()
            .text,
    )
    .unwrap();
    let stands = format!("S {}, T {}", value(",S"), value(",T"));
    let held = robot.base_from_flange(pose, &robot.at_rest());
    let found = robot.arm.inverse(held).unwrap().solutions;
    let joints = found
        .iter()
        .map(|s| s.angles)
        .find(|a| robot.stance(*a).unwrap().to_string() == stands);
    let axes = robot.arm.shown(joints.unwrap()).map(f64::to_degrees);
    let told: Vec<String> = (1..)
        .zip(axes)
        .map(|(n, a)| format!("A{n} {a:.9}"))
        .collect();
    let places = judged(&job, &file);
    let by_axes = text.replace(line, &format!("DECL E6AXIS XP1={{{}}}", told.join(",")));
    println!("{line}\n{}", told.join(","));
    std::fs::write(&data, by_axes).unwrap();
    let joints = judged(&job, &file);
    assert_eq!(check(&joints, "lines").status, Status::Pass);
    assert!(!warned(&joints, "joint-position-skipped"));
    // the same way of the arm; metal on sharp corners answers to the last digits of time
    let of_arm = |verdict: Verdict| {
        let arm = ["lines", "reach", "joint-speed", "config"];
        let checks = verdict.checks.into_iter();
        Verdict {
            checks: checks.filter(|c| arm.contains(&c.id.as_str())).collect(),
            ..Verdict::default()
        }
    };
    same(&of_arm(places), &of_arm(joints));
    // positions that say nothing of the arm: it may begin otherwise, and goes another way then
    let silent: String = text
        .split_inclusive('\n')
        .map(|line| match (line.find(",S "), line.rfind('}')) {
            (Some(from), Some(to)) => format!("{}{}", &line[..from], &line[to..]),
            _ => line.to_owned(),
        })
        .collect();
    assert_ne!(silent, text);
    std::fs::write(&data, silent).unwrap();
    let open = judged(&job, &file);
    for id in ["reach", "joint-speed", "collision", "config"] {
        let check = check(&open, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(&check.reason, &["first position is not said", "ways"]);
    }
}

/// Inline forms of KUKA list six external axes without units: the one that the robot has turns its table by degrees.
#[test]
fn a_table_that_stands_turned_in_a_kuka_program_does_so_by_degrees() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let shipped = meltpath_data::find(robots::ALL, "kuka-kr16-r2010-2").unwrap();
    let (arm, rest) = shipped.text.split_once("[table]").unwrap();
    let (_, shapes) = rest.split_once("[shapes]").unwrap();
    let table = "[positioner]\nsource = \"own\"\nlow = [\"-360 deg\"]\nhigh = [\"360 deg\"]\nspeed = [\"90 deg/s\"]\n\
                 [[positioner.axes]]\nposition = [\"1100 mm\", \"0 mm\", \"300 mm\"]\naxis = [0, 0, 1]\n";
    write(&home, "robot.toml", format!("{arm}{table}[shapes]{shapes}"));
    let (job, file) = kuka_wall(&home, 1, "robot = \"robot.toml\"");
    let data = file.with_extension("dat");
    let text = std::fs::read_to_string(&data).unwrap();
    let turned = text
        .replace("DECL POS", "DECL E6POS")
        .replace('}', ",E1 45.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}");
    std::fs::write(&data, turned).unwrap();
    let told = simulate_program(&file, Some(&job), NextIn(&home.join("turned")), &Silent).unwrap();
    let table = std::fs::read_to_string(told.folder.join("series/joints.csv")).unwrap();
    let mut rows = table.lines().filter(|l| !l.starts_with('#'));
    let mut names = rows.next().unwrap().split(',');
    let column = names.position(|c| c == "positioner_1_deg").unwrap();
    let mut places = 0;
    for row in rows {
        let angle: f64 = row.split(',').nth(column).unwrap().parse().unwrap();
        assert!((angle - 45.0).abs() < 1e-9, "{row}");
        places += 1;
    }
    assert!(places > 10);
}
