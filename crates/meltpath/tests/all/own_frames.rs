//! Programs of others whose positions are in the robot's own frame: the robot's file says where the part lies in it, and they are judged as the same positions in the part's frame are.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::dialects::job_for;
use crate::support::{check, says, warned, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_data::{find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

/// Checks of the arm along the way, and those of cells of metal.
const ARM: [&str; 2] = ["reach", "joint-speed"];
const METAL: [&str; 5] = ["lack", "excess", "height", "travels", "collision"];

/// The metal's cells are 1 mm wide, one of them 0.009 % of the part's 10 849 mm³. Some are filled or not by the last digit, as points lie on their edges: 1e-9 mm more
/// or less at every point of a program in the part's frame moves `lack` by 0.003 %. This is eleven cells (%, mm).
const CELLS: f64 = 0.1;

/// deg: KUKA and FANUC say angles, here in 1e-9°. Quaternions and rotation vectors are read in steps of 1e-4°, twice here.
const ANGLES: f64 = 1e-6;
const STEPS: f64 = 2e-4;

/// Where arm and table stand in the world, W, P, R in deg.
const BASE: ([f64; 3], [f64; 3]) = ([120.0, -60.0, 250.0], [6.0, -9.0, 20.0]);
const TURNED: [f64; 3] = [8.0, -11.0, 37.0];

fn pose((position, wpr): ([f64; 3], [f64; 3])) -> Pose {
    let wpr = DVec3::from_array(wpr.map(f64::to_radians));
    Pose::from_wpr(DVec3::from_array(position), wpr)
}

/// Where the table stands in the arm's base.
fn table(position: [f64; 3]) -> Pose {
    pose(BASE).inverse().then(pose((position, TURNED)))
}

/// A frame of a robot's file.
fn frame(name: &str, (position, angles): ([f64; 3], [f64; 3])) -> String {
    let [at, turned] = [(position, "mm"), (angles, "deg")]
        .map(|(all, unit)| all.map(|v| format!("\"{v} {unit}\"")).join(", "));
    format!("\n[{name}]\nposition = [{at}]\nangles = [{turned}]\n")
}

/// A robot that ships, without positioner, with this table.
fn robot(folder: &Path, name: &str, at: [f64; 3]) {
    let text = find(robots::ALL, name).unwrap().text;
    let (arm, rest) = text.split_once("\n[torch]").unwrap();
    let arm = arm.split_once("\n[positioner]").map_or(arm, |(arm, _)| arm);
    let (torch, rest) = match rest.split_once("\n[table]") {
        Some((torch, rest)) => (torch, rest),
        None => rest.split_at(rest.find("\n[shapes]").unwrap()),
    };
    let shapes = &rest[rest.find("[shapes]").unwrap()..];
    let shapes = shapes.replace("[shapes]", "[shapes]\nsource = \"measured\"\n#");
    let base = frame("base", BASE);
    let table = frame("table", (at, TURNED)) + "source = \"measured\"\n";
    let text = format!("{arm}\n[torch]\nsource = \"measured\"\n{torch}{base}{table}\n{shapes}");
    write(folder, "robot.toml", text);
}

/// The program that a run wrote, and its job.
fn written(folder: &Path, dialect: &str, name: &str, at: [f64; 3]) -> (PathBuf, PathBuf, PathBuf) {
    let (home, job) = job_for(folder, dialect, name);
    robot(&home, name, at);
    let text = std::fs::read_to_string(&job).unwrap();
    let text = text.replace(&format!("robot = \"{name}\""), "robot = \"robot.toml\"");
    write(&home, "job.toml", text);
    let ran = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
    (home, job, ran.folder.join("program"))
}

fn simulated(program: &Path, (home, job): (&Path, &Path)) -> Verdict {
    let runs = NextIn(&home.join("again"));
    simulate_program(program, Some(job), runs, &Silent)
        .unwrap()
        .verdict
}

/// Both were judged alike, the arm to within `arm`.
fn alike(part: &Verdict, own: &Verdict, arm: f64) {
    for (id, most) in ARM
        .map(|id| (id, arm))
        .into_iter()
        .chain(METAL.map(|id| (id, CELLS)))
    {
        let [a, b] = [part, own].map(|v| check(v, id));
        assert_eq!(a.status, b.status, "{id}");
        let [a, b] = [a, b].map(|c| c.value.as_ref().map(|m| m.value));
        let off = a.zip(b).map_or(0.0, |(a, b)| (a - b).abs());
        assert!(
            a.is_some() == b.is_some() && off < most,
            "{id}: {a:?} {b:?}"
        );
    }
    assert!(warned(own, "own-frame") && !warned(part, "own-frame"));
}

/// Where the job names no robot, nothing of the part is decided, and why is told first.
fn not_decided(program: &Path, (home, job): (&Path, &Path)) {
    let text = std::fs::read_to_string(job).unwrap();
    let without = text.replace("robot = \"robot.toml\"", "");
    assert_ne!(text, without);
    let job = write(home, "without.toml", without);
    let verdict = simulated(program, (home, &job));
    for id in ["lack", "excess", "stock"] {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        let first = check.reason.split(';').next().unwrap();
        says(&first, &["in the robot's own frame", "is not known"]);
        says(check.remedy.as_ref().unwrap(), &["machine.robot"]);
    }
    assert!(!warned(&verdict, "own-frame"));
}

/// The numbers of `text` that begins with them, joined by commas, each behind a word.
fn numbers<const N: usize>(text: &str) -> [f64; N] {
    let mut all = text.split(',').map(|field| {
        let digits = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
        let field = field.trim_matches(|c: char| !digits(c));
        let word = field.rsplit(|c: char| c.is_whitespace() || c == '=');
        word.into_iter()
            .find_map(|w| w.parse::<f64>().ok())
            .unwrap()
    });
    std::array::from_fn(|_| all.next().unwrap())
}

/// A pose of x, y, z in mm and W, P, R in deg, moved.
fn moved([x, y, z, w, p, r]: [f64; 6], by: &Pose) -> [f64; 6] {
    let wpr = DVec3::new(w, p, r) * std::f64::consts::PI / 180.0;
    let to = by.then(Pose::from_wpr(DVec3::new(x, y, z), wpr));
    let [w, p, r] = to.wpr().to_array().map(f64::to_degrees);
    let [x, y, z] = to.position.to_array();
    [x, y, z, w, p, r]
}

/// Every stretch of a text from `begins` to before `ends` made anew, of as many as there are.
fn each(text: &str, begins: &str, ends: &str, change: impl Fn(&str) -> String) -> String {
    let mut parts = text.split(begins);
    let mut out = parts.next().unwrap().to_owned();
    for part in parts {
        let at = part.find(ends).unwrap();
        out += begins;
        out += &change(&part[..at]);
        out += &part[at..];
    }
    assert!(text.contains(begins));
    out
}

fn edit(file: &Path, change: impl Fn(String) -> String) {
    let text = std::fs::read_to_string(file).unwrap();
    let changed = change(text.clone());
    assert_ne!(changed, text);
    std::fs::write(file, changed).unwrap();
}

#[test]
fn a_kuka_in_its_world_is_judged_as_in_the_parts_frame() {
    let dir = tempfile::tempdir().unwrap();
    let at = [1150.0, 100.0, 520.0];
    let (home, job, program) = written(dir.path(), "kuka-krl", "kuka-kr16-r2010-2", at);
    let (source, data) = (program.join("JOB.src"), program.join("JOB.dat"));
    let part = simulated(&source, (&home, &job));
    edit(&data, |text| {
        each(&text, "{X ", ",S ", |pose| {
            let [x, y, z, a, b, c] = numbers(pose);
            let [x, y, z, c, b, a] = moved([x, y, z, c, b, a], &table(at));
            format!("{x:.9},Y {y:.9},Z {z:.9},A {a:.9},B {b:.9},C {c:.9}")
        })
    });
    let text = std::fs::read_to_string(&source).unwrap();
    for base in ["$WORLD", "$NULLFRAME", "BASE_DATA[0]"] {
        write(
            &program,
            "JOB.src",
            text.replace("$BASE=BASE_DATA[1]", &format!("$BASE={base}")),
        );
        alike(&part, &simulated(&source, (&home, &job)), ANGLES);
        not_decided(&source, (&home, &job));
    }
}

#[test]
fn an_abb_in_wobj0_is_judged_as_in_the_parts_frame() {
    let dir = tempfile::tempdir().unwrap();
    let at = [1050.0, 60.0, 520.0];
    let (home, job, program) = written(dir.path(), "abb-rapid", "abb-irb2600-12-185", at);
    let module = program.join("JOB.mod");
    let part = simulated(&module, (&home, &job));
    edit(&module, |text| {
        let text = text.replace("\\WObj:=wPart", "\\WObj:=wobj0");
        let lines = text.lines().map(|line| {
            let Some((head, rest)) = line
                .split_once(":=[[")
                .filter(|_| line.contains("robtarget"))
            else {
                return line.to_owned();
            };
            let (xyz, rest) = rest.split_once("],[").unwrap();
            let (turn, rest) = rest.split_once("],[").unwrap();
            let ([x, y, z], [w, i, j, k]) = (numbers(xyz), numbers(turn));
            let from = Pose {
                position: DVec3::new(x, y, z),
                orientation: DQuat::from_xyzw(i, j, k, w).normalize(),
            };
            let to = table(at).then(from);
            let ([x, y, z], q) = (to.position.to_array(), to.orientation);
            format!(
                "{head}:=[[{x:.9},{y:.9},{z:.9}],[{:.12},{:.12},{:.12},{:.12}],[{rest}",
                q.w, q.x, q.y, q.z
            )
        });
        lines.collect::<Vec<_>>().join("\n")
    });
    alike(&part, &simulated(&module, (&home, &job)), STEPS);
    not_decided(&module, (&home, &job));
}

#[test]
fn a_fanuc_in_user_frame_0_is_judged_as_in_the_parts_frame() {
    let dir = tempfile::tempdir().unwrap();
    let at = [1150.0, 60.0, 700.0];
    let (home, job, program) = written(dir.path(), "fanuc-ls", "fanuc-arcmate-120ic", at);
    let file = program.join("JOB.LS");
    let part = simulated(&file, (&home, &job));
    // the controller's world lies at the height of the second axis
    let world = Pose::at(-525.0 * DVec3::Z).then(table(at));
    edit(&file, |text| {
        let text = text
            .replace("UFRAME_NUM=1", "UFRAME_NUM=0")
            .replace("UF : 1,", "UF : 0,");
        each(&text, "\tX =", "\n};", |pose| {
            let [x, y, z, w, p, r] = moved(numbers(&pose.replace(['\n', '\t'], " ")), &world);
            format!(
                "{x:.9} mm,\tY ={y:.9} mm,\tZ ={z:.9} mm,\n\tW ={w:.9} deg,\tP ={p:.9} deg,\tR ={r:.9} deg"
            )
        })
    });
    let own = simulated(&file, (&home, &job));
    alike(&part, &own, ANGLES);
    not_decided(&file, (&home, &job));
    // numbers of a composition beside this one, by hand
    let told = own.warnings.iter().find(|w| w.code == "own-frame").unwrap();
    says(
        &told.message,
        &[
            "525.0 mm above the arm's base",
            "1066.9, -208.245, -214.905 mm, 4.8771, -0.6521, 16.8457 deg",
        ],
    );
}

#[test]
fn plain_poses_of_a_script_are_judged_as_in_the_parts_frame() {
    let dir = tempfile::tempdir().unwrap();
    let at = [700.0, -20.0, 400.0];
    let (home, job, program) = written(dir.path(), "ur-script", "universal-ur10e", at);
    let script = program.join("JOB.script");
    let part = simulated(&script, (&home, &job));
    edit(&script, |text| {
        let text = each(&text, "pose_trans(Part,p[", "])", |pose| {
            let [x, y, z, a, b, c] = numbers(pose);
            let from = Pose {
                position: 1000.0 * DVec3::new(x, y, z),
                orientation: DQuat::from_scaled_axis(DVec3::new(a, b, c)),
            };
            let to = table(at).then(from);
            let ([x, y, z], turn) = (
                (to.position / 1000.0).to_array(),
                to.orientation.to_scaled_axis(),
            );
            format!(
                "{x:.12},{y:.12},{z:.12},{:.12},{:.12},{:.12}",
                turn.x, turn.y, turn.z
            )
        });
        let mut all = text.split("pose_trans(Part,");
        let first = all.next().unwrap().to_owned();
        all.fold(first, |out, pose| out + &pose.replacen("])", "]", 1))
    });
    alike(&part, &simulated(&script, (&home, &job)), STEPS);
    not_decided(&script, (&home, &job));
}

/// Points of a bead that lie 0.2 mm apart at 12 mm/s take 16 ms each: none for a FANUC to tell, who drives in 8 ms; at 40 mm/s they take 5 ms.
#[test]
fn points_that_lie_too_close_for_the_controller_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let job = crate::support::thin_wall(
        dir.path(),
        "[simulation]\ncell = \"1 mm\"\n[layers]\ncount = 1\n",
    );
    let simulated = |speed: u32| {
        let mut lines = vec![
            "UFRAME_NUM=1".to_owned(),
            "UTOOL_NUM=1".to_owned(),
            "J P[1] 20% FINE".to_owned(),
            "L P[2] 20mm/sec FINE Arc Start[1]".to_owned(),
        ];
        let points = 3..=102;
        lines.extend(
            points
                .clone()
                .map(|n| format!("L P[{n}] {speed}mm/sec CNT100")),
        );
        lines.push(format!("L P[103] {speed}mm/sec FINE Arc End[1]"));
        let mut text = "/PROG FINE\n/MN\n".to_owned();
        for (n, line) in (1..).zip(&lines) {
            writeln!(text, "{n:4}:{line} ;").unwrap();
        }
        text += "/POS\n";
        for n in 1..=103_u32 {
            let (x, z) = (
                0.2 * f64::from(n.saturating_sub(2)),
                if n == 1 { 50.0 } else { 0.0 },
            );
            writeln!(
                text,
                "P[{n}]{{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = {x:.1} mm, Y = 0 mm, Z = {z} mm, W = 180 deg, P = 0 deg, R = 0 deg\n}};"
            ).unwrap();
        }
        let file = write(dir.path(), "fine.ls", text + "/END\n");
        let runs = NextIn(&dir.path().join("runs"));
        simulate_program(&file, Some(&job), runs, &Silent)
            .unwrap()
            .verdict
    };
    assert!(!warned(&simulated(12), "moves-too-short"));
    let fast = simulated(40);
    let told = fast
        .warnings
        .iter()
        .find(|w| w.code == "moves-too-short")
        .unwrap();
    says(
        &told.message,
        &[
            "101 moves of beads",
            "8.000 ms",
            "0.200 mm at 40.0 mm/s, 5.0 ms",
        ],
    );
    says(
        told.remedy.as_ref().unwrap(),
        &["0.32 mm apart", "program.shortest_move"],
    );
}
