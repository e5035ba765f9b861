//! Programs of others that leave open where the arm goes: nothing about the arm passes then, and the line is named.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::dialects::job_for;
use crate::reach::measured;
use crate::support::{check, refusal, says, thin_wall, warned, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Silent, Status, Verdict};
use meltpath_data::cells;

/// Checks that are judged from the arm's joints.
const ARM: [&str; 4] = ["reach", "joint-speed", "collision", "config"];

fn job(folder: &Path, cell: &str) -> PathBuf {
    let robot = measured(folder);
    let schedule = "[[program.schedule]]\nnumber = 7\nwire_feed = \"8 m/min\"\n";
    write(folder, "cell.toml", format!("{cell}\n{schedule}"));
    thin_wall(
        folder,
        &format!("[machine]\ncell = \"cell.toml\"\n{robot}\n[simulation]\ncell = \"1 mm\"\n"),
    )
}

/// A bead of a FANUC, with further lines before it, in frames that its positions name; `beside` stands behind every position.
fn wall(folder: &Path, before: &[&str], frames: [u32; 2], beside: &str) -> Verdict {
    let job = job(folder, cells::ARCMATE_120IC.text);
    simulated(folder, &job, before, frames, beside)
}

fn simulated(
    folder: &Path,
    job: &Path,
    before: &[&str],
    [frame, tool]: [u32; 2],
    beside: &str,
) -> Verdict {
    let select = [format!("UFRAME_NUM={frame}"), format!("UTOOL_NUM={tool}")];
    let bead = [
        "J P[1] 20% FINE",
        "L P[2] 20mm/sec FINE Arc Start[7]",
        "L P[3] 12mm/sec FINE Arc End[7]",
        "L P[1] 20mm/sec FINE",
    ];
    let lines = select.iter().map(String::as_str);
    let lines = lines.chain(before.iter().copied()).chain(bead);
    let mut text = "/PROG WALL\n/MN\n".to_owned();
    for (n, line) in (1..).zip(lines) {
        writeln!(text, "{n:4}:{line} ;").unwrap();
    }
    text += "/POS\n";
    let places = [
        (1, frame, [40.0, 60.0]),
        (2, frame, [0.0, 0.0]),
        (3, frame, [80.0, 0.0]),
        (9, 7, [2500.0, 60.0]),
    ];
    for (n, frame, [x, z]) in places {
        writeln!(
            text,
            "P[{n}]{{\n GP1:\n UF : {frame}, UT : {tool}, CONFIG : 'N U T, 0, 0, 0',\n X = {x} mm, Y = 0 mm, Z = {z} mm, W = 180 deg, P = 0 deg, R = 90 deg{beside}\n}};"
        )
        .unwrap();
    }
    let file = write(folder, "wall.ls", text + "/END\n");
    simulate_program(&file, Some(job), NextIn(&folder.join("runs")), &Silent)
        .unwrap()
        .verdict
}

fn undecided(verdict: &Verdict, told: &[&str], remedy: &str) {
    for id in ARM {
        let check = check(verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(&check.reason, told);
        says(check.remedy.as_ref().unwrap(), &[remedy]);
    }
}

#[test]
fn nothing_about_the_arm_passes_while_a_line_may_move_it() {
    let dir = tempfile::tempdir().unwrap();
    let plain = wall(dir.path(), &[], [1, 1], "");
    for id in ARM {
        let check = check(&plain, id);
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    for line in [
        "UFRAME[1]=PR[7]",
        "UTOOL[1]=PR[7]",
        "SFTON P000",
        "CALL SHIFT",
    ] {
        let verdict = wall(dir.path(), &[line], [1, 1], "");
        let told = format!("WALL, line 3, \"{line}\"");
        undecided(&verdict, &[&told], "");
    }
    // what the source is given moves no arm
    let source = wall(dir.path(), &["AO[1]=3"], [1, 1], "");
    assert_eq!(check(&source, "lines").status, Status::CannotSay);
    assert_eq!(check(&source, "reach").status, Status::Pass);
}

#[test]
fn an_arm_in_frames_that_nobody_tells_is_not_decided_about() {
    let dir = tempfile::tempdir().unwrap();
    // a travel far off in a frame of its own is no failure of reach
    let frame = ["UFRAME_NUM=7", "J P[9] 20% FINE", "UFRAME_NUM=1"];
    let travel = wall(dir.path(), &frame, [1, 1], "");
    let told = [
        "line 4",
        "in user frame 7 with tool frame 1, beads are in 1 and 1",
    ];
    let reach = check(&travel, "reach");
    assert_eq!(reach.status, Status::CannotSay, "{reach:?}");
    says(&reach.reason, &told);
    // nor is it known whether it clears the metal
    let travels = check(&travel, "travels");
    assert_eq!(travels.status, Status::CannotSay, "{travels:?}");
    says(&travels.reason, &told);
    // other numbers than the cell file's
    let others = wall(dir.path(), &[], [4, 2], "");
    let told = ["user frame 4 in place of 1, tool frame 2 in place of 1"];
    undecided(&others, &told, "program.user_frame");
    assert!(warned(&others, "other-frames"));
    assert_ne!(check(&others, "height").status, Status::CannotSay);
    // the robot's own frame is not that of the table: what it holds is laid where it says, inside the arm
    let own = wall(dir.path(), &[], [0, 1], "");
    assert!(warned(&own, "own-frame"));
    assert_ne!(check(&own, "reach").status, Status::CannotSay);
    assert_ne!(check(&own, "lack").status, Status::Pass);
    // by an axis that moves the part may lie elsewhere
    let moved = wall(dir.path(), &[], [0, 1], ", E1 = 300 mm");
    undecided(&moved, &["in the robot's own frame"], "program.user_frame");
    let lack = check(&moved, "lack");
    assert_eq!(lack.status, Status::CannotSay, "{lack:?}");
    says(&lack.reason, &["in the robot's own frame"]);
    // nor where no robot says where the part lies
    let job = job(dir.path(), cells::ARCMATE_120IC.text);
    let text = std::fs::read_to_string(&job).unwrap();
    let without = text.replace("robot = \"robot.toml\"", "");
    assert_ne!(text, without);
    std::fs::write(&job, without).unwrap();
    let alone = simulated(dir.path(), &job, &[], [0, 1], "");
    let lack = check(&alone, "lack");
    assert_eq!(lack.status, Status::CannotSay, "{lack:?}");
    says(&lack.reason, &["in the robot's own frame"]);
    says(
        lack.remedy.as_ref().unwrap(),
        &["program.user_frame", "machine.robot"],
    );
    assert_ne!(check(&alone, "height").status, Status::CannotSay);
}

#[test]
fn an_axis_that_the_robots_file_lacks_is_not_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let away = wall(dir.path(), &[], [1, 1], ", E1 = 300 mm");
    undecided(
        &away,
        &["external axis E1 stands at 300 mm", "has no such axis"],
        "[track]",
    );
    let zero = wall(dir.path(), &[], [1, 1], ", E1 = 0 mm");
    for id in ARM {
        assert_eq!(check(&zero, id).status, Status::Pass, "{id}");
    }
}

/// Frames that programs of other controllers move or declare unreadably, and axes beside the arm: `change` of the program that a run wrote.
#[test]
fn an_arm_of_other_controllers_is_not_decided_about_either() {
    let lines: [(&str, &str, &str, &str, &str, &str); 9] = [
        (
            "abb-rapid",
            "abb-irb2600-12-185",
            "JOB.mod",
            "PROC JOB()",
            "PROC JOB()\nPDispSet [[0,60,0],[1,0,0,0],[0,0,0,0,0,0]];",
            "PDispSet",
        ),
        (
            "abb-rapid",
            "abb-irb2600-12-185",
            "JOB.mod",
            "PROC JOB()",
            "PERS tooldata tTorch:=[TRUE,[[far,0,300],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC JOB()",
            "is not written in plain numbers",
        ),
        (
            "abb-rapid",
            "abb-irb2600-12-185",
            "JOB.mod",
            "PROC JOB()",
            "PERS tooldata tTorch:=[TRUE,[[0,0,400],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC JOB()",
            "by the program the wire tip is at [[0, 0, 400], [1, 0, 0, 0]] in the flange",
        ),
        (
            "abb-rapid",
            "abb-irb2600-12-185",
            "JOB.mod",
            "PROC JOB()",
            "PERS wobjdata wPart:=[FALSE,TRUE,\"\",[[900,0,300],[1,0,0,0]],[[0,0,0.2],[1,0,0,0]]];\nPROC JOB()",
            "by the program the part is at [[900, 0, 300.2], [1, 0, 0, 0]] in the arm's base, by the robot's file at [[1000, 0, 300], [1, 0, 0, 0]], 100.0 mm and 0.00 deg apart",
        ),
        (
            "abb-rapid",
            "abb-irb2600-12-185",
            "JOB.mod",
            "9E+09,9E+09,9E+09,9E+09,9E+09,9E+09",
            "300,9E+09,9E+09,9E+09,9E+09,9E+09",
            "external axis eax_a stands at 300 (",
        ),
        (
            "kuka-krl",
            "kuka-kr16-r2010-2",
            "JOB.src",
            "$BASE=BASE_DATA[1]",
            "BASE_DATA[1]={X 700,Y 300,Z 100,A 0,B 0,C 0}\n$BASE=BASE_DATA[1]",
            "by the program the part is at 700, 300, 100 mm, 0, 0, 0 deg in the arm's base",
        ),
        (
            "kuka-krl",
            "kuka-kr16-r2010-2",
            "JOB.src",
            "$TOOL=TOOL_DATA[1]",
            "TOOL_DATA[1]={X 0,Y 0,Z 400,A 0,B 0,C 0}\n$TOOL=TOOL_DATA[1]",
            "by the program the wire tip is at 0, 0, 400 mm, 0, 0, 0 deg in the flange",
        ),
        (
            "kuka-krl",
            "kuka-kr16-r2010-2",
            "JOB.src",
            "$BASE=BASE_DATA[1]",
            "BASE_DATA[1]={X xOff,Y 300,Z 100,A 0,B 0,C 0}\n$BASE=BASE_DATA[1]",
            "\"BASE_DATA[1]={X xOff",
        ),
        (
            "kuka-krl",
            "kuka-kr16-r2010-2",
            "JOB.src",
            "$BASE=BASE_DATA[1]",
            "$BASE={X 700,Y 300,Z 100,A 0,B 0,C 0}",
            "by the program the part is at 700, 300, 100 mm, 0, 0, 0 deg in the arm's base",
        ),
    ];
    let mut written: Option<(&str, tempfile::TempDir, PathBuf, PathBuf, PathBuf)> = None;
    for (dialect, robot, main, from, to, told) in lines {
        if written.as_ref().is_none_or(|w| w.0 != dialect) {
            let dir = tempfile::tempdir().unwrap();
            let (home, job) = job_for(dir.path(), dialect, robot);
            let ran = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
            assert_eq!(check(&ran.verdict, "config").status, Status::Pass);
            let program = ran.folder.join("program");
            written = Some((dialect, dir, home, job, program));
        }
        let (_, _, home, job, program) = written.as_ref().unwrap();
        let file = program.join(main);
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(text.contains(from), "{from} is not in {text}");
        std::fs::write(&file, text.replace(from, to)).unwrap();
        let again = simulate_program(&file, Some(job), NextIn(&home.join("again")), &Silent);
        std::fs::write(&file, text).unwrap();
        let verdict = again.unwrap().verdict;
        for id in ["reach", "config"] {
            let check = check(&verdict, id);
            assert_eq!(check.status, Status::CannotSay, "{check:?}");
            says(&check.reason, &[told]);
        }
    }
}

/// A FANUC program beside a KUKA's arm: how that would stand nobody knows.
#[test]
fn an_arm_of_another_maker_is_not_decided_about() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path(), cells::ARCMATE_120IC.text);
    let text = std::fs::read_to_string(&job).unwrap();
    let other = text.replace("robot = \"robot.toml\"", "robot = \"kuka-kr16-r2010-2\"");
    assert_ne!(text, other);
    let plain = simulated(dir.path(), &job, &[], [1, 1], "");
    std::fs::write(&job, other).unwrap();
    let verdict = simulated(dir.path(), &job, &[], [1, 1], "");
    for id in ARM {
        assert_eq!(check(&plain, id).status, Status::Pass, "{id}");
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(&check.reason, &["is one for FANUC", "KUKA KR 16 R2010-2"]);
        // the makers whose words are known are no reason
        assert!(!check.reason.contains("Yaskawa"), "{check:?}");
    }
}

/// A zero that was written in rad and meant in degrees.
#[test]
fn a_zero_of_many_turns_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path(), cells::ARCMATE_120IC.text);
    let file = dir.path().join("robot.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let (head, rest) = text.split_once("[joints]").unwrap();
    let rest: Vec<&str> = rest.lines().filter(|l| !l.starts_with("zero")).collect();
    let zero = "zero = [\"0 deg\", \"0 deg\", \"90 rad\", \"0 deg\", \"0 deg\", \"0 deg\"]";
    write(
        dir.path(),
        "robot.toml",
        format!("{head}[joints]\n{zero}{}", rest.join("\n")),
    );
    let refused = refusal(&job);
    says(&refused, &["joint 3", "14.3 turns"]);
    assert!(refused.contains("\"90 deg\""), "{refused}");
}
