//! Programs as other software writes them: read, nothing lost, executed or refused with the reason.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use meltpath_base::Reporter;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::{Axis, Coordinates, Group, Instruction, PositionRef, Termination};
use meltpath_programs::{ExecutionSettings, Gap, Missing, NoPose, Refusal, Way, WeldSettings};
use meltpath_programs::{ParseError, fanuc_ls};
use meltpath_toolpath::Move;

use crate::told::{execute, motions, parsed, program, read};

const SIMPLE: &str = include_str!("../data/offline_simple.ls");
const TWO_GROUPS: &str = include_str!("../data/controller_two_groups.ls");
const LOGIC: &str = include_str!("../data/lower_case_logic.ls");

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
    // the first move leads to where the toolpath starts
    assert_eq!(moves.len(), 6);
    let start = executed.toolpath.passes().next().unwrap().points[0];
    assert_eq!(start, DVec3::Z * 100.0);
    let burns: Vec<_> = moves.iter().map(|m| m.burns).collect();
    assert_eq!(burns, [false, true, true, true, true, false]);
    assert_eq!(moves[1].speed, Some(12.0));
    let smoothing = |k: usize| moves[k].control.smoothing;
    assert_eq!((smoothing(1), smoothing(4)), (Some(0.01), None));
    assert_eq!(
        moves[3].shape,
        Move::Arc {
            via: DVec3::new(42.929, 47.071, 0.0)
        }
    );
    assert!(moves.iter().all(|m| m.axis.distance(DVec3::Z) < 1e-9));
    let last = moves[5].control;
    assert_eq!((last.line, last.frames), (15, (9, 9)));
    let waits: Vec<_> = executed
        .toolpath
        .passes()
        .flat_map(|p| {
            p.moves()
                .map(move |m| (m, p.head.role.deposits()))
                .collect::<Vec<_>>()
        })
        .filter(|(m, _)| matches!(m, Move::Spot { .. }))
        .collect();
    assert_eq!(waits, [(Move::Spot { time: 0.5 }, false)]);
    // what the schedule sets is not known: no wire feed is said
    assert!(moves.iter().all(|m| m.wire_feed.is_none()));
    assert_eq!(executed.gaps.len(), 1);
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
        ..ExecutionSettings::default()
    };
    let program = std::slice::from_ref(&p.program);
    let whys = |settings: &ExecutionSettings| -> Vec<(u32, Missing)> {
        let executed = read(program, settings, &Reporter::new()).unwrap();
        executed.gaps.into_iter().map(|g| (g.line, g.why)).collect()
    };
    assert_eq!(
        whys(&settings),
        [
            (10, Missing::Positioner(2)),
            (11, Missing::Schedule("Weld Start[1,2]".into())),
            (12, Missing::Weave),
            (13, Missing::Word("ACC80".into())),
            // the position before says nothing of the axis, this one that it stands at 250 mm
            (13, Missing::ExternalAxes),
            (18, Missing::Speed("WELD_SPEED".into())),
            (19, Missing::Call("TORCH_CLEAN".into())),
        ]
    );
    // what the cell knows is no gap any more
    settings.passed_over.insert("TORCH_CLEAN".into());
    let set = WeldSettings {
        wire_feed: 100.0,
        speed: Some(12.5),
        crater: None,
    };
    settings.schedules.insert((Some(1), 2), set);
    let left: Vec<u32> = whys(&settings).into_iter().map(|(line, _)| line).collect();
    assert_eq!(left, [10, 12, 13, 13]);
    // where the cleaning leaves the torch nobody knows, unless the cell says so
    let on = |settings: &ExecutionSettings| {
        let executed = read(program, settings, &Reporter::new()).unwrap();
        let returns = |g: &&Gap| matches!(g.why, Missing::Returns(_));
        executed.left_out.iter().filter(returns).count()
    };
    assert_eq!(on(&settings), 1);
    settings.returning.insert("TORCH_CLEAN".into());
    assert_eq!(on(&settings), 0);

    let executed = read(program, &settings, &reporter).unwrap();
    let moves = motions(&executed);
    // both moves to the joint position are left out, the first of the others leads to the start
    assert_eq!(moves.len(), 6);
    assert_eq!(moves[1].speed, Some(12.5));
    assert_eq!(moves[1].control.smoothing, Some(0.5));
    assert_eq!(moves[1].wire_feed, Some(100.0));
    let burns: Vec<_> = moves.iter().map(|m| m.burns).collect();
    assert_eq!(burns, [false, true, true, true, true, true]);
    // three A moves lie on one circle about (60, 20)
    let centre = DVec3::new(60.0, 20.0, 0.0);
    assert_eq!(moves[2].shape, Move::Line);
    for k in [3, 4] {
        let Move::Arc { via } = moves[k].shape else {
            panic!("not a circle: {k}")
        };
        assert!((via.distance(centre) - 20.0).abs() < 1e-3);
        let arc = Arc::through(moves[k - 1].to, via, moves[k].to).unwrap();
        assert!(
            (arc.sweep - std::f64::consts::FRAC_PI_4).abs() < 1e-3,
            "{}",
            arc.sweep
        );
    }
    let codes: Vec<_> = reporter.warnings().iter().map(|w| w.code.clone()).collect();
    for code in [
        "joint-position-skipped",
        "call-passed-over",
        "line-passed-over",
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

/// A controller moves to a position in the frames it was taught in: where no line selects them, they are those.
#[test]
fn frames_that_no_line_selects_are_those_of_the_positions() {
    let go = "L P[1] 50mm/sec FINE";
    for lines in [
        &[go, go] as &[_],
        &["UFRAME_NUM=1", go, go],
        &["UFRAME_NUM=R[5]", go, go],
    ] {
        let executed = execute(&[program("P", lines)]).unwrap();
        let all: Vec<_> = executed.controls.iter().map(|c| c.frames).collect();
        assert_eq!(all, [(1, 1)], "{lines:?}");
    }
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
        refuse(&["FOR R[1]=1 TO R[2]", go, "ENDFOR"]),
        Refusal::Condition(_)
    ));
    assert_eq!(refuse(&["FOR R[1]=2 TO 1", go]), Refusal::Unpaired);
    assert_eq!(refuse(&[go, "ENDFOR"]), Refusal::Unpaired);
    assert!(matches!(refuse(&[go, "CALL P"]), Refusal::Loop(_)));
    assert!(matches!(
        refuse(&["IF R[1]=1,JMP LBL[2]"]),
        Refusal::Condition(_)
    ));
    assert_eq!(refuse(&["JMP LBL[7]"]), Refusal::Label(7));
    assert_eq!(refuse(&["L P[9] 50mm/sec FINE"]), Refusal::NoPosition(9));
    assert_eq!(refuse(&["L P[1] 9999999mm/sec FINE"]), Refusal::Speed);
    assert_eq!(refuse(&["L P[1] 9999999sec FINE"]), Refusal::Speed);
    assert_eq!(refuse(&["WAIT 9999999(sec)"]), Refusal::Wait(9_999_999.0));
    assert_eq!(refuse(&["L P[1] 50% FINE"]), Refusal::Speed);
    assert_eq!(
        refuse(&["UFRAME_NUM=2", go]),
        Refusal::OtherFrame {
            name: "P[1]".to_owned(),
            what: "user frame",
            taught: 1,
            selected: 2
        }
    );
    let mut nowhere = program("P", &["UFRAME_NUM=1", go]);
    for position in &mut nowhere.positions {
        position.groups[0].tool = None;
    }
    assert_eq!(
        execute(std::slice::from_ref(&nowhere)).unwrap_err(),
        Refusal::NoFrame("UTOOL_NUM")
    );
    assert_eq!(execute(&[]).unwrap_err(), Refusal::NoProgram);
    let mut far = program("P", &[go]);
    if let Coordinates::Cartesian { xyz, .. } = &mut far.positions[0].groups[0].coordinates {
        xyz[2] = 1e9;
    }
    assert_eq!(execute(&[far]).unwrap_err(), Refusal::Far(1));
    let error = read(&[nowhere], &ExecutionSettings::default(), &Reporter::new());
    let text = error.unwrap_err().to_string();
    assert!(
        text.contains("P, line 2") && text.contains("of a FANUC UFRAME_NUM"),
        "{text}"
    );
}

/// Every line is executed, or shapes no metal, or is told with its reason; never passed over in silence.
#[test]
fn lines_that_shape_metal_and_are_not_simulated_are_told() {
    let start = [
        "UFRAME_NUM=1",
        "UTOOL_NUM=1",
        "!Schedule 1 WFS 8.00 m/min",
        "L P[1] 50mm/sec FINE Arc Start[1]",
    ];
    let end = ["L P[2] 10mm/sec FINE", "L P[3] 10mm/sec FINE Arc End[1]"];
    let gaps = |lines: &[&str]| -> Vec<Missing> {
        let all: Vec<_> = start.iter().chain(lines).chain(&end).copied().collect();
        let executed = execute(&[program("P", &all)]).unwrap();
        let at = start.len() as u32 + 1;
        let gaps = executed.gaps.into_iter();
        gaps.inspect(|g| assert!(g.line >= at && !g.text.is_empty(), "{g:?}"))
            .map(|g| g.why)
            .collect()
    };
    // what shapes no metal
    for line in [
        "DO[1]=ON",
        "F[2]=(OFF)",
        "MESSAGE[hello]",
        "TIMER[1]=START",
        "PR[3]=LPOS",
        "R[4]=R[4]+1",
        "--eg:a comment",
        "COL DETECT ON",
        "$x",
        "",
    ] {
        let expected = usize::from(line == "$x");
        assert_eq!(gaps(&[line]).len(), expected, "{line}");
    }
    // what does
    for (line, why) in [
        ("Weave Sine[1]", Missing::Weave),
        ("Weave[3]", Missing::Weave),
        ("CALL NOWHERE", Missing::Call("NOWHERE".into())),
        ("AO[2]=20.5", Missing::Output("AO[2]=20.5".into())),
        ("WAIT DI[1]=ON", Missing::WaitWithArc),
        ("OVERRIDE=50%", Missing::Setting("OVERRIDE=50%".into())),
        (
            "UFRAME[1]=PR[2]",
            Missing::Setting("UFRAME[1]=PR[2]".into()),
        ),
        ("Track TAST[1]", Missing::Setting("Track TAST[1]".into())),
        (
            "Touch Offset PR[5]",
            Missing::Unknown("Touch Offset PR[5]".into()),
        ),
        ("L PR[1] 10mm/sec FINE", Missing::Position("PR[1]".into())),
        (
            "L P[R[2]] 10mm/sec FINE",
            Missing::Position("P[R[2]]".into()),
        ),
        (
            "L P[4] 10mm/sec FINE",
            Missing::JointPosition("P[4]".to_owned(), NoPose::NoRobot),
        ),
        ("L P[2] R[3]mm/sec FINE", Missing::Speed("R[3]".into())),
        (
            "L P[2] WELD_SPEED FINE",
            Missing::Speed("WELD_SPEED".into()),
        ),
        (
            "L P[2] 10mm/sec CNT R[9]",
            Missing::Termination("CNT R[9]".into()),
        ),
        ("L P[2] 10mm/sec CD5", Missing::Termination("CD5".into())),
        (
            "L P[2] 10mm/sec FINE Offset,PR[1]",
            Missing::Offset("Offset,PR[1]".into()),
        ),
        ("L P[2] 10mm/sec FINE COORD", Missing::Coordinated),
        ("L P[2] 10mm/sec FINE ACC80", Missing::Word("ACC80".into())),
        ("Arc Start[2]", Missing::Schedule("Arc Start[2]".into())),
        (
            "Arc Start[1,R[2]]",
            Missing::Schedule("Arc Start[1,R[2]]".into()),
        ),
        (
            "Arc Start[20,190]",
            Missing::Schedule("Arc Start[20,190]".into()),
        ),
    ] {
        assert_eq!(gaps(&[line]), [why], "{line}");
    }
    // a weave's end, a wait and an unknown speed without arc shape nothing
    assert_eq!(gaps(&["Weave End"]), []);
    let travel = [
        "UFRAME_NUM=1",
        "UTOOL_NUM=1",
        "WAIT DI[1]=ON",
        "L P[1] R[7]mm/sec FINE",
        "L P[2] 10mm/sec FINE ACC80",
    ];
    assert_eq!(execute(&[program("P", &travel)]).unwrap().gaps, []);
}

/// Positions count in their frame: beads of two frames do not lie where their numbers say.
#[test]
fn beads_of_two_frames_are_told() {
    let text = "/PROG P\n/MN\n1:UFRAME_NUM=1 ;\n2:UTOOL_NUM=1 ;\n3:!Schedule 1 WFS 8 m/min ;\n\
        4:L P[1] 50mm/sec FINE Arc Start[1] ;\n5:L P[1] 10mm/sec FINE Arc End[1] ;\n\
        6:UFRAME_NUM=2 ;\n7:L P[2] 50mm/sec FINE Arc Start[1] ;\n8:L P[2] 10mm/sec FINE Arc End[1] ;\n/POS\n";
    let positions = [1, 2].map(|f| {
        format!("P[{f}]{{\n GP1:\n UF : {f}, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = 1 mm, Y = 0 mm, Z = 0 mm, W = 180 deg, P = 0 deg, R = 0 deg\n}};\n")
    });
    let program = parsed(&format!("{text}{}/END\n", positions.concat())).program;
    let found = execute(&[program]).unwrap().gaps;
    let found: Vec<_> = found.into_iter().map(|g| (g.line, g.why)).collect();
    assert_eq!(
        found,
        [(8, Missing::Frames("2".to_owned(), "1".to_owned()))]
    );
}

/// Beside a positioner that stands still a coordinated bead is the one written.
#[test]
fn coordinated_beads_count_where_the_positioner_stands_still() {
    let gaps = |angles: [f64; 2]| {
        let lines = [
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "!Schedule 1 WFS 8 m/min",
            "L P[1] 9mm/sec FINE Arc Start[1]",
            "L P[2] 9mm/sec FINE COORD Arc End[1]",
        ];
        let mut program = program("P", &lines);
        for (position, angle) in program.positions.iter_mut().zip(angles) {
            let axis = Axis {
                name: "J1".to_owned(),
                value: angle,
                unit: "deg".to_owned(),
            };
            let second = Group {
                number: 2,
                coordinates: Coordinates::Joint(vec![axis]),
                ..position.groups[0].clone()
            };
            position.groups.push(second);
        }
        let gaps = execute(&[program]).unwrap().gaps;
        gaps.into_iter().map(|g| g.why).collect::<Vec<_>>()
    };
    assert_eq!(gaps([0.0; 2]), []);
    assert_eq!(
        gaps([0.0, 5.0]),
        [Missing::Positioner(2), Missing::Coordinated]
    );
}

/// Where external axes stand is carried; beads along which they move are told.
#[test]
fn external_axes_are_carried_and_told_where_they_move() {
    let text = |places: [f64; 3]| {
        let mut text =
            "/PROG P\n/MN\n1:!Schedule 1 WFS 8 m/min ;\n2:L P[1] 50mm/sec FINE Arc Start[1] ;\n\
            3:L P[2] 10mm/sec FINE ;\n4:L P[3] 10mm/sec FINE Arc End[1] ;\n/POS\n"
                .to_owned();
        for (i, e) in places.iter().enumerate() {
            writeln!(text, "P[{0}]{{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = {0} mm, Y = 0 mm, Z = 0 mm, \
                W = 180 deg, P = 0 deg, R = 0 deg, E1 = {e} mm\n GP2:\n UF : 1, UT : 1,\n J1= 0 deg, J2= 0 deg\n}};", i + 1)
                .unwrap();
        }
        parsed(&format!("{text}/END\n")).program
    };
    let still = execute(&[text([700.0; 3])]).unwrap();
    assert_eq!(still.gaps, []);
    let bead = still.toolpath.passes().next().unwrap();
    for i in 0..bead.points.len() {
        let axes: Vec<_> = bead.external(i).collect();
        assert_eq!(axes, [Some(700.0), Some(0.0), Some(0.0)]);
    }
    let moving = execute(&[text([0.0, 0.0, 10.0])]).unwrap();
    let found: Vec<_> = moving.gaps.into_iter().map(|g| (g.line, g.why)).collect();
    assert_eq!(found, [(4, Missing::ExternalAxes)]);
}

#[test]
fn a_move_that_is_left_out_still_switches_the_arc() {
    let lines = [
        "UFRAME_NUM=1",
        "UTOOL_NUM=1",
        "L PR[1] 50mm/sec FINE Arc Start[1]",
        "L P[2] 10mm/sec FINE Arc End[1]",
    ];
    let executed = execute(&[program("P", &lines)]).unwrap();
    let moves = motions(&executed);
    // the first move that is known, though the arc burns on it, leads to the start
    assert_eq!(moves.len(), 0);
    assert_eq!(executed.gaps.len(), 2);
    assert_eq!(executed.gaps[0].why, Missing::Position("PR[1]".into()));
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
    assert_eq!(moves.len(), 1);
    let only = moves[0];
    assert_eq!((only.speed, only.control.program), (Some(20.0), 1));
    assert_eq!(only.control.way, Way::Path);
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

/// Joints with an external axis are joints; one coordinate among them makes the whole unread.
#[test]
fn joints_with_external_axes_are_read() {
    let of = |axes: &str| {
        let text = format!("/PROG P\n/MN\n/POS\nP[1]{{ GP1: UF : 0, UT : 1, {axes} }};\n/END\n");
        let mut positions = parsed(&text).program.positions;
        positions.remove(0).groups.remove(0).coordinates
    };
    let six = "J1= 1 deg, J2= -2 deg, J3= 3 deg, J4= 4 deg, J5= 5 deg, J6= 6 deg";
    let Coordinates::Joint(axes) = of(&format!("{six}, E1= 120.5 mm")) else {
        panic!("not joints")
    };
    let (arm, beyond) = Axis::of_arm(&axes).unwrap();
    assert_eq!(arm, [1.0, -2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!((beyond[0].name.as_str(), beyond[0].value), ("E1", 120.5));
    for (axes, joints) in [
        ("E1= 3 mm", false),
        ("X= 1 mm, J2= 2 deg", false),
        (
            "J1= 1 deg, J3= 3 deg, J2= 2 deg, J4= 4 deg, J5= 5 deg, J6= 6 deg",
            true,
        ),
        ("J1= 1 deg", true),
        (
            "J1= 1 mm, J2= 2 mm, J3= 3 mm, J4= 4 mm, J5= 5 mm, J6= 6 mm",
            true,
        ),
    ] {
        let told = of(axes);
        assert_eq!(matches!(told, Coordinates::Joint(_)), joints, "{axes}");
        // none of them are an arm's six joints
        if let Coordinates::Joint(axes) = told {
            assert_eq!(Axis::of_arm(&axes), None);
        }
    }
}
