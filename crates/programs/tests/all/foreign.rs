//! Programs as other software writes them: read, nothing lost, executed or refused with the reason.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use meltpath_base::Reporter;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_programs::execute::Refusal;
use meltpath_programs::fanuc_ls::{self, ParseError, Parsed};
use meltpath_programs::program::{Coordinates, Instruction, PositionRef, Termination};
use meltpath_programs::{
    Executed, ExecutedKind, ExecutedMotion, ExecutedSpeed, ExecutionSettings, Program,
    execution_order,
};

const SIMPLE: &str = include_str!("../data/offline_simple.ls");
const TWO_GROUPS: &str = include_str!("../data/controller_two_groups.ls");
const LOGIC: &str = include_str!("../data/lower_case_logic.ls");

fn parsed(text: &str) -> Parsed {
    fanuc_ls::parse(text).unwrap()
}

fn execute(programs: &[Program]) -> Result<Vec<Executed>, Refusal> {
    execution_order(programs, &ExecutionSettings::default(), &Reporter::new()).map_err(|e| e.why)
}

fn motions(executed: &[Executed]) -> Vec<ExecutedMotion> {
    let moves = executed.iter().filter_map(|e| match e {
        Executed::Motion(m) => Some(*m),
        Executed::Wait { .. } => None,
    });
    moves.collect()
}

#[test]
fn every_line_is_kept() {
    for (text, instructions, positions) in [(SIMPLE, 16, 8), (TWO_GROUPS, 21, 9), (LOGIC, 17, 1)] {
        let p = parsed(text);
        assert_eq!(
            p.program.instructions.len(),
            instructions,
            "{}",
            p.program.name
        );
        assert_eq!(p.program.positions.len(), positions);
        assert_eq!(p.lines.len(), instructions);
        // and written again it is read the same
        let written = fanuc_ls::write(&p.program).unwrap();
        let again = parsed(&written);
        assert_eq!(again.program, p.program);
        assert_eq!(fanuc_ls::write(&again.program).unwrap(), written);
    }
}

#[test]
fn lines_that_are_not_modelled_are_listed_with_their_place() {
    let p = parsed(TWO_GROUPS);
    let unread: Vec<_> = p.unread.iter().map(|u| (u.line, u.text.as_str())).collect();
    assert_eq!(
        unread,
        [
            (32, "PAYLOAD[1]"),
            (33, "R[12:speed]=75"),
            (34, "R[13:cnt]=50"),
            (41, "Weave Sine[1]"),
            (46, "Weave End"),
        ]
    );
    let p = parsed(LOGIC);
    for text in [
        "for R[1]=1 to 10",
        "endfor",
        "SELECT R[2]=1,CALL A1",
        "=2,JMP LBL[9]",
        "ELSE,CALL A3",
        "Touch Offset PR[5]",
        "plain text without number",
    ] {
        let kept = p.unread.iter().any(|u| u.text == text);
        assert!(kept, "{text}: {:?}", p.unread);
    }
}

#[test]
fn a_simple_export_is_executed() {
    let p = parsed(SIMPLE);
    let executed = execute(&[p.program]).unwrap();
    let moves = motions(&executed);
    assert_eq!(moves.len(), 7);
    let arcs: Vec<_> = moves.iter().map(|m| m.arc).collect();
    assert_eq!(arcs, [None, None, Some(1), Some(1), Some(1), Some(1), None]);
    assert_eq!(moves[0].speed, ExecutedSpeed::Joint(1.0));
    assert_eq!(moves[2].speed, ExecutedSpeed::Path(12.0));
    assert_eq!((moves[2].smoothing, moves[5].smoothing), (Some(0.01), None));
    assert_eq!(
        moves[4].kind,
        ExecutedKind::Circular {
            via: DVec3::new(42.929, 47.071, 0.0)
        }
    );
    assert!(
        moves
            .iter()
            .all(|m| m.target.tool_axis().distance(DVec3::Z) < 1e-9)
    );
    assert_eq!((moves[6].line, moves[6].frames), (15, (9, 9)));
    assert!(
        executed
            .iter()
            .any(|e| matches!(e, Executed::Wait { time, arc: None, .. } if *time == 0.5))
    );
}

#[test]
fn a_controllers_program_with_two_groups_is_executed_with_warnings() {
    let p = parsed(TWO_GROUPS);
    assert_eq!(p.program.kind, "Macro");
    assert_eq!(p.program.attribute("comment"), Some("\"wall; 2 groups\""));
    assert_eq!(p.program.attribute("TCD").unwrap().matches('=').count(), 6);
    assert!(
        p.program
            .application
            .iter()
            .any(|l| l.contains("ARC Welding Equipment"))
    );
    let nine = p.program.positions.iter().find(|p| p.index == 9).unwrap();
    assert!(matches!(&nine.groups[0].coordinates, Coordinates::Unread(t) if t.contains("****")));

    let reporter = Reporter::new();
    let mut settings = ExecutionSettings {
        registers: BTreeMap::from([(14, 50.0)]),
        weld_speed: Some(12.5),
        ..ExecutionSettings::default()
    };
    let refused =
        execution_order(std::slice::from_ref(&p.program), &settings, &reporter).unwrap_err();
    assert_eq!(refused.why, Refusal::Call("TORCH_CLEAN".into()));
    assert_eq!((refused.program.as_str(), refused.line), ("WALL_CELL2", 19));

    settings.passed_over.insert("TORCH_CLEAN".into());
    let executed = execution_order(&[p.program], &settings, &reporter).unwrap();
    let moves = motions(&executed);
    // both moves to the joint position are left out
    assert_eq!(moves.len(), 7);
    assert_eq!(moves[2].speed, ExecutedSpeed::Path(12.5));
    assert_eq!(moves[2].smoothing, Some(0.5));
    let arcs: Vec<_> = moves.iter().map(|m| m.arc).collect();
    assert_eq!(
        arcs,
        [None, None, Some(2), Some(2), Some(2), Some(2), Some(2)]
    );
    // three A moves lie on one circle about (60, 20)
    let centre = DVec3::new(60.0, 20.0, 0.0);
    assert_eq!(moves[3].kind, ExecutedKind::Linear);
    for k in [4, 5] {
        let ExecutedKind::Circular { via } = moves[k].kind else {
            panic!("not a circle: {k}")
        };
        assert!((via.distance(centre) - 20.0).abs() < 1e-3);
        let arc =
            Arc::through(moves[k - 1].target.position, via, moves[k].target.position).unwrap();
        assert!(
            (arc.sweep - std::f64::consts::FRAC_PI_4).abs() < 1e-3,
            "{}",
            arc.sweep
        );
    }
    let codes: Vec<_> = reporter.warnings().iter().map(|w| w.code.clone()).collect();
    for code in [
        "joint-position-skipped",
        "positioner-not-simulated",
        "call-passed-over",
        "line-not-executed",
    ] {
        assert!(codes.iter().any(|c| c == code), "{code}: {codes:?}");
    }
}

#[test]
fn forms_of_speed_termination_and_reference() {
    let p = parsed(LOGIC).program;
    let found: Vec<_> = p
        .instructions
        .iter()
        .filter_map(|i| match i {
            Instruction::Motion(m) => {
                Some((m.target.clone(), m.termination.clone(), m.extra.clone()))
            }
            _ => None,
        })
        .collect();
    assert_eq!(found.len(), 4);
    assert_eq!(found[0].2, ["Offset,PR[3:\"shift x\"]"]);
    assert_eq!(found[1].0, PositionRef::Unresolved("PR[1:safe]".into()));
    assert_eq!(found[2].1, Termination::Fine);
    assert_eq!(found[3].1, Termination::Other("CD5".into()));
    assert!(matches!(&found[3].0, PositionRef::Point { index: 2, comment: Some(c) } if c == "a;b"));
}

/// A program with these instructions, and point 1 to 3 in frames 1.
fn program(name: &str, lines: &[&str]) -> Program {
    let mut text = format!("/PROG {name}\n/MN\n");
    for (i, line) in lines.iter().enumerate() {
        writeln!(text, "{:4}:{line} ;", i + 1).unwrap();
    }
    text += "/POS\n";
    for i in 1..=3 {
        write!(text, "P[{i}]{{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = {i} mm, Y = 0 mm, Z = 0 mm, W = 180 deg, P = 0 deg, R = 0 deg\n}};\n"
        ).unwrap();
    }
    text += "P[4]{\n GP1:\n UF : 1, UT : 1,\n J1= 0 deg, J2= 0 deg\n};\n/END\n";
    parsed(&text).program
}

#[test]
fn what_cannot_be_executed_is_refused_with_the_reason() {
    let frames = ["UFRAME_NUM=1", "UTOOL_NUM=1"];
    let refuse = |lines: &[&str]| {
        let all: Vec<_> = frames.iter().chain(lines).copied().collect();
        execute(&[program("P", &all)]).unwrap_err()
    };
    let go = "L P[1] 50mm/sec FINE";
    assert!(matches!(
        refuse(&["LBL[1]", go, "JMP LBL[1]"]),
        Refusal::Loop(_)
    ));
    assert!(matches!(
        refuse(&["FOR R[1]=1 TO 3", go, "ENDFOR"]),
        Refusal::Loop(_)
    ));
    assert!(matches!(refuse(&[go, "CALL P"]), Refusal::Loop(_)));
    assert!(matches!(
        refuse(&["IF R[1]=1,JMP LBL[2]"]),
        Refusal::Condition(_)
    ));
    assert_eq!(refuse(&["JMP LBL[7]"]), Refusal::Label(7));
    assert_eq!(refuse(&["L P[9] 50mm/sec FINE"]), Refusal::NoPosition(9));
    assert_eq!(refuse(&["L P[4] 50mm/sec FINE"]), Refusal::JointPosition(4));
    assert!(matches!(
        refuse(&["L PR[1] 50mm/sec FINE"]),
        Refusal::Unresolved(_)
    ));
    assert!(matches!(
        refuse(&["L P[1] 50mm/sec FINE Offset,PR[1]"]),
        Refusal::Unresolved(_)
    ));
    assert!(matches!(
        refuse(&["L P[1] R[3]mm/sec FINE"]),
        Refusal::Register(_)
    ));
    assert!(matches!(
        refuse(&["R[3]=DI[1]", "L P[1] R[3]mm/sec FINE"]),
        Refusal::Register(_)
    ));
    assert_eq!(refuse(&["L P[1] 50% FINE"]), Refusal::Speed);
    assert_eq!(
        refuse(&[go, "Arc Start[1]", "L P[2] 12mm/sec FINE Arc Start[1]"]),
        Refusal::ArcOn
    );
    assert_eq!(
        refuse(&["L P[1] 50mm/sec FINE Arc End[1]"]),
        Refusal::ArcOff
    );
    assert_eq!(
        refuse(&[go, "Arc Start[1]", "J P[2] 50% FINE"]),
        Refusal::ArcInJointMove
    );
    assert_eq!(
        refuse(&["L P[1] 50mm/sec FINE Arc Start[1]"]),
        Refusal::ArcLeftOn
    );
    assert_eq!(
        refuse(&["UFRAME_NUM=2", go]),
        Refusal::OtherFrame {
            index: 1,
            what: "user frame",
            taught: 1,
            selected: 2
        }
    );
    assert_eq!(
        execute(&[program("P", &["UFRAME_NUM=1", go])]).unwrap_err(),
        Refusal::NoFrame("UTOOL_NUM")
    );
    assert_eq!(
        execute(&[program("P", &["UTOOL_NUM=1", "UFRAME_NUM=R[5]", go])]).unwrap_err(),
        Refusal::NoFrame("UFRAME_NUM")
    );
    assert_eq!(execute(&[]).unwrap_err(), Refusal::NoProgram);
    let error = execution_order(
        &[program("P", &["L P[1] 50mm/sec FINE"])],
        &ExecutionSettings::default(),
        &Reporter::new(),
    );
    let text = error.unwrap_err().to_string();
    assert!(
        text.contains("P, line 1") && text.contains("set UFRAME_NUM"),
        "{text}"
    );
}

#[test]
fn calls_jumps_ends_and_aborts_are_followed() {
    let main = program(
        "MAIN",
        &[
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "R[5]=20",
            "CALL Sub",
            "JMP LBL[3]",
            "L P[3] 10mm/sec FINE",
            "LBL[3:on]",
            "CALL SUB",
            "ABORT",
            "L P[3] 10mm/sec FINE",
        ],
    );
    let sub = program(
        "SUB",
        &["L P[2] R[5]mm/sec CNT100", "END", "L P[1] 10mm/sec FINE"],
    );
    let executed = execute(&[main, sub]).unwrap();
    let moves = motions(&executed);
    assert_eq!(moves.len(), 2);
    assert!(
        moves
            .iter()
            .all(|m| m.speed == ExecutedSpeed::Path(20.0) && m.program == 1)
    );
}

#[test]
fn damaged_files_say_what_is_wrong() {
    assert_eq!(fanuc_ls::parse(""), Err(ParseError::NotAProgram));
    assert_eq!(
        fanuc_ls::parse("G1 X10 Y20\n"),
        Err(ParseError::NotAProgram)
    );
    assert!(matches!(
        fanuc_ls::parse("/PROG A\n/MN\n 1: END ;\n"),
        Err(ParseError::CutOff { line: 3 })
    ));
    assert!(matches!(
        fanuc_ls::parse("/PROG A\n/MN\n/POS\nP[1]{\n GP1:\n/END\n"),
        Err(ParseError::Position { line: 4, .. })
    ));
    assert!(matches!(
        fanuc_ls::parse("/PROG A\n/MN\n/POS\nP[1]{};\nP[1]{};\n/END\n"),
        Err(ParseError::RepeatedPosition { index: 1 })
    ));
    assert!(matches!(
        fanuc_ls::parse("/PROG A\n/MN\n/PROG B\n/END\n"),
        Err(ParseError::SecondProgram { line: 3 })
    ));
    let latin = fanuc_ls::read(b"/PROG A\n/MN\n 1: !caf\xe9 ;\n/END\n").unwrap();
    assert!(
        matches!(&latin.program.instructions[0], Instruction::Comment { text, .. } if text == "café")
    );
}

#[test]
fn lines_end_in_any_way() {
    // the sample has the line ends of its checkout
    let unix = SIMPLE.replace("\r\n", "\n");
    let windows = unix.replace('\n', "\r\n");
    assert_eq!(parsed(&windows), parsed(&unix));
    let marked = format!("\u{feff}{unix}");
    assert_eq!(parsed(&marked), parsed(&unix));
}
