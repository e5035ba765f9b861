//! Joint moves of a program of others through the whole chain: what they hit, how long they take, where they are shown.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::dialects::job_for;
use crate::reach::measured;
use crate::support::{check, says, thin_wall, write};
use meltpath::outcome::{Outcome, RunFolder::NextIn};
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Fact, Silent, Status, Verdict};
use meltpath_data::cells;
use meltpath_geometry::math::DVec3;
use meltpath_robot::cell::{Cell, Values, read};

/// Layers of the wall that stands in the way, and their height, mm.
const LAYERS: u32 = 20;
const HEIGHT: f64 = 1.7;

/// A wall at x = 30 mm from y = -60 to 60 mm, then a travel past it at x = 0, 5 mm over the plate, from y = -250 to 250 mm as `past` says,
/// and a bead there.
fn program(folder: &Path, past: &str, config: &str) -> PathBuf {
    let (mut lines, mut positions) = (String::new(), String::new());
    let mut count = 0;
    let mut position = |x: f64, y: f64, z: f64| {
        count += 1;
        write!(
            positions,
            "P[{count}]{{\n GP1:\n UF : 1, UT : 1, {config}\n X = {x} mm, Y = {y} mm, Z = {z} mm, W = 180 deg, P = 0 deg, R = 150 deg\n}};\n"
        )
        .unwrap();
        format!("P[{count}]")
    };
    let mut line = |text: String| writeln!(lines, "   1:{text} ;").unwrap();
    line("UFRAME_NUM=1".to_owned());
    line("UTOOL_NUM=1".to_owned());
    line(format!("J {} 20% FINE", position(30.0, -60.0, 60.0)));
    for layer in 0..LAYERS {
        let z = f64::from(layer) * HEIGHT;
        let y = if layer % 2 == 0 { -60.0 } else { 60.0 };
        line(format!(
            "L {} 20mm/sec FINE Arc Start[7]",
            position(30.0, y, z)
        ));
        line(format!(
            "L {} WELD_SPEED FINE Arc End[7]",
            position(30.0, -y, z)
        ));
    }
    for [x, y, z] in [[30.0, -60.0, 60.0], [0.0, -250.0, 60.0], [0.0, -250.0, 5.0]] {
        line(format!("L {} 200mm/sec FINE", position(x, y, z)));
    }
    line(past.replace("P[]", &position(0.0, 250.0, 5.0)));
    line(format!(
        "L {} 20mm/sec FINE Arc Start[7]",
        position(0.0, 250.0, 0.0)
    ));
    line(format!(
        "L {} WELD_SPEED FINE Arc End[7]",
        position(0.0, 200.0, 0.0)
    ));
    let text = format!("/PROG WALL\n/MN\n{lines}/POS\n{positions}/END\n");
    write(folder, "wall.ls", text)
}

const NAMED: &str = "CONFIG : 'N U T, 0, 0, 0',";
/// The command that leads past the wall.
const PAST: u32 = 2 * LAYERS + 3;

fn judged(folder: &Path, machine: &str, past: &str, config: &str) -> Outcome {
    let shipped = cells::ARCMATE_120IC.text;
    let schedule = "[[program.schedule]]\nnumber = 7\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n";
    write(folder, "cell.toml", format!("{shipped}\n{schedule}"));
    let machine = format!("[machine]\ncell = \"cell.toml\"\n{machine}\n");
    let job = thin_wall(folder, &format!("{machine}[simulation]\ncell = \"2 mm\"\n"));
    let program = program(folder, past, config);
    simulate_program(&program, Some(&job), NextIn(&folder.join("runs")), &Silent).unwrap()
}

fn fact<'a>(verdict: &'a Verdict, id: &str) -> Option<&'a Fact> {
    verdict.facts.iter().find(|f| f.id == id)
}

/// The rows of a table that belong to a command, the columns by their names.
fn rows<const N: usize>(
    outcome: &Outcome,
    table: &str,
    columns: [&str; N],
    command: u32,
) -> Vec<[f64; N]> {
    let text = std::fs::read_to_string(outcome.folder.join(table)).unwrap();
    let mut lines = text.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let column = |name: &str| heads.iter().position(|h| *h == name).unwrap();
    let (columns, of) = (columns.map(column), column("command"));
    let value = |row: &[&str], i: usize| row[i].parse().unwrap_or(f64::NAN);
    let own = lines.filter(|row| value(row, of) == f64::from(command));
    own.map(|row| columns.map(|i| value(&row, i))).collect()
}

/// Where the tip is at the rows of `series/joints.csv` of a command.
fn tips(outcome: &Outcome, cell: &Cell, command: u32) -> Vec<DVec3> {
    let columns = [
        "joint_1_deg",
        "joint_2_deg",
        "joint_3_deg",
        "joint_4_deg",
        "joint_5_deg",
        "joint_6_deg",
    ];
    let rows = rows(outcome, "series/joints.csv", columns, command);
    let tip = |shown: [f64; 6]| {
        let values = Values {
            arm: cell.arm.joints(shown.map(f64::to_radians)),
            ..cell.at_rest()
        };
        cell.frames(&values).part_from_wire_tip().position
    };
    rows.into_iter().map(tip).collect()
}

fn from_line(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let along = b - a;
    let share = ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    p.distance(a + along * share)
}

/// A straight travel passes beside the wall with room; the joint move between the same places swings out and meets it. What is checked,
/// driven and shown is one curve, in the time of the slowest axis.
#[test]
fn a_joint_move_meets_what_the_straight_line_passes() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let straight = judged(dir.path(), robot, "L P[] 400mm/sec FINE", NAMED);
    let passed = check(&straight.verdict, "collision");
    assert_eq!(passed.status, Status::Pass, "{passed:?}");
    assert!(fact(&straight.verdict, "joint-moves").is_none());
    let bent = judged(dir.path(), robot, "J P[] 50% FINE", NAMED);
    let met = check(&bent.verdict, "collision");
    println!("{} {}", met.line(), met.reason);
    assert_eq!(met.status, Status::Fail, "{met:?}");
    says(&met.reason, &["nozzle and part"]);
    let [x, y, _] = met.place.as_ref().unwrap().position.unwrap();
    assert!((20.0..30.0).contains(&x) && y.abs() < 80.0, "{x} {y}");
    let told = fact(&bent.verdict, "joint-moves").unwrap();
    println!("{}", told.reason);
    says(
        &told.reason,
        &["27.9 mm beside the straight line", "joint 1 the slowest"],
    );
    // one curve in the table of joints and in the motion
    let cell = read(&std::fs::read_to_string(dir.path().join("robot.toml")).unwrap()).unwrap();
    let tips = tips(&bent, &cell, PAST);
    let [first, last] = [tips[0], tips[tips.len() - 1]];
    assert!(last.distance(DVec3::new(0.0, 250.0, 5.0)) < 1e-4, "{last}");
    assert!(first.y < -200.0 && tips.len() > 40, "{}", tips.len());
    let moved = rows(
        &bent,
        "series/motion.csv",
        ["time_s", "x_mm", "y_mm", "z_mm"],
        PAST,
    );
    let curve: Vec<DVec3> = std::iter::once(DVec3::new(0.0, -250.0, 5.0))
        .chain(tips)
        .collect();
    for [_, x, y, z] in &moved {
        let p = DVec3::new(*x, *y, *z);
        let far = curve.windows(2).map(|w| from_line(p, [w[0], w[1]]));
        let far = far.fold(f64::INFINITY, f64::min);
        // the chords, and the digits of both tables
        assert!(far < 0.06, "{p}: {far}");
    }
    let out = moved.iter().map(|m| m[1]).fold(0.0, f64::max);
    assert!((out - 27.5).abs() < 0.2, "{out}");
    // half of what joint 1 can do, and the averages of the controller
    let first = |command| rows(&bent, "series/joints.csv", ["joint_1_deg"], command);
    let [before, after] = [PAST - 1, PAST].map(|command| first(command).last().unwrap()[0]);
    let wanted = (after - before).abs() / (0.5 * 195.0) + 0.216;
    let taken = moved[moved.len() - 1][0] - moved[0][0];
    println!("{taken:.3} s, {wanted:.3} s by hand");
    assert!((taken - wanted).abs() < 0.02, "{taken} {wanted}");
}

/// Where nobody says how the arm stands at the end, its way is a choice: it may hit, but it does not pass.
#[test]
fn an_end_without_a_configuration_does_not_pass() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let clear = "J P[] 50% FINE";
    // without the wall in the way
    let verdict = |config: &str| {
        let program = program(dir.path(), clear, config);
        let text = std::fs::read_to_string(&program).unwrap();
        let text = text
            .replace("X = 30 mm", "X = -130 mm")
            .replace("Y = -250 mm", "Y = -150 mm");
        std::fs::write(&program, text).unwrap();
        let job = dir.path().join("job.toml");
        let runs = dir.path().join("runs");
        simulate_program(&program, Some(&job), NextIn(&runs), &Silent)
            .unwrap()
            .verdict
    };
    // writes cell and job
    judged(dir.path(), robot, clear, NAMED);
    let said = verdict(NAMED);
    assert_eq!(
        check(&said, "collision").status,
        Status::Pass,
        "{:?}",
        check(&said, "collision")
    );
    let unsaid = verdict("CONFIG : '',");
    let open = check(&unsaid, "collision");
    println!("{} {}", open.line(), open.reason);
    assert_eq!(open.status, Status::CannotSay, "{open:?}");
    says(&open.reason, &["joint moves is not said: 1, first", "line"]);
}

/// Without a robot a joint move stays straight, and it is told.
#[test]
fn without_a_robot_the_straight_line_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let outcome = judged(dir.path(), "", "J P[] 50% FINE", NAMED);
    assert_eq!(
        check(&outcome.verdict, "collision").status,
        Status::NotChecked
    );
    let told = fact(&outcome.verdict, "joint-moves").unwrap();
    println!("{}", told.reason);
    says(
        &told.reason,
        &["taken as straight lines", "names no robot", "line"],
    );
    let moved = rows(&outcome, "series/motion.csv", ["x_mm", "z_mm"], PAST);
    assert!(
        moved
            .iter()
            .all(|[x, z]| x.abs() < 1e-6 && (z - 5.0).abs() < 1e-6)
    );
}

/// ABB gives joint moves the speed of the tool, KUKA a share of what the axes can do: travels of a plan that become joint moves take as long as
/// before there, and the time of their axes here.
#[test]
fn joint_moves_take_the_time_that_their_controller_gives_them() {
    for (dialect, robot, file, (line, joint), as_before) in [
        (
            "abb-rapid",
            "abb-irb2600-12-185",
            "JOB.mod",
            ("MoveL ", "MoveJ "),
            true,
        ),
        (
            "kuka-krl",
            "kuka-kr16-r2010-2",
            "JOB.src",
            ("LIN ", "PTP "),
            false,
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let (home, job) = job_for(dir.path(), dialect, robot);
        let planned = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
        let program = planned.folder.join("program").join(file);
        let text = std::fs::read_to_string(&program).unwrap();
        // beads are ArcL of RAPID; in KRL they lie between a trigger and the end of the arc
        let (mut off, mut travels, mut bent) = (as_before, 0, String::new());
        for text in text.lines() {
            off =
                as_before || (off || text.contains("ArcOffAfterMove")) && !text.contains("TRIGGER");
            let travel = off && text.trim_start().starts_with(line);
            travels += u32::from(travel);
            let text = if travel {
                text.replace(line, joint).replace("C_DIS", "C_PTP")
            } else {
                text.to_owned()
            };
            writeln!(bent, "{text}").unwrap();
        }
        assert!(travels >= 2, "{dialect}: {travels}");
        let simulated = |text: String| {
            std::fs::write(&program, text).unwrap();
            simulate_program(&program, Some(&job), NextIn(&home.join("again")), &Silent)
                .unwrap()
                .verdict
        };
        let before = simulated(text.clone());
        let after = simulated(bent);
        assert!(fact(&before, "joint-moves").is_none());
        let told = fact(&after, "joint-moves").unwrap();
        let times = [&before, &after].map(|v| {
            fact(v, "time-travel")
                .unwrap()
                .value
                .as_ref()
                .unwrap()
                .value
        });
        println!("{dialect}: {times:?} min; {}", told.reason);
        assert!(
            ((times[0] - times[1]).abs() < 0.02 * times[0]) == as_before,
            "{times:?}"
        );
        assert!(times[1] <= times[0] * 1.02);
    }
}
