//! What the cell tells that programs read: position registers, outputs of the source; and what has to be told, named at once.

use std::collections::BTreeMap;

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::{
    ExecutionSettings, Lacking, Missing, NoPose, Reading, Refusal, ToldOutput, ToldPosition,
    WeldSettings,
};

use crate::told::{execute, motions, parsed, program, read};

const ONE: &str = "L P[1] 50mm/sec FINE";
const GO: &str = "L PR[91] 50mm/sec FINE";

fn place(x: f64, y: f64) -> ToldPosition {
    ToldPosition {
        elements: [x, y, 5.0, 180.0, 0.0, 0.0].map(Some),
        ..ToldPosition::default()
    }
}

fn knowing(registers: &[(u32, ToldPosition)]) -> ExecutionSettings {
    ExecutionSettings {
        positions: registers.iter().cloned().collect(),
        ..ExecutionSettings::default()
    }
}

fn run(lines: &[&str], known: &ExecutionSettings) -> Reading {
    let all: Vec<_> = [ONE].iter().chain(lines).copied().collect();
    read(&[program("P", &all)], known, &Reporter::new()).unwrap()
}

fn ends(reading: &Reading) -> Vec<[f64; 3]> {
    motions(reading).iter().map(|m| m.to.to_array()).collect()
}

#[test]
fn position_registers_that_the_cell_tells_are_moved_to_and_reckoned_with() {
    let known = knowing(&[(90, place(100.0, 50.0)), (4, place(1.0, 2.0))]);
    for (lines, end) in [
        (&["PR[91]=PR[90]", GO] as &[&str], [100.0, 50.0, 5.0]),
        (
            &["PR[91]=PR[90]", "PR[91,1] = PR[90,1] + 19.5", GO],
            [119.5, 50.0, 5.0],
        ),
        (&["PR[91]=PR[90]-PR[4]+PR[4]", GO], [100.0, 50.0, 5.0]),
        (
            &["PR[91]=PR[90]", "PR[91,3]=(-PR[90,3])*2", GO],
            [100.0, 50.0, -10.0],
        ),
        (&["L PR[90] 50mm/sec FINE"], [100.0, 50.0, 5.0]),
    ] {
        let reading = run(lines, &known);
        assert_eq!(reading.gaps, [], "{lines:?}");
        assert_eq!(ends(&reading), [end], "{lines:?}");
    }
    // what is not told of it is not guessed
    let mut partly = place(1.0, 2.0);
    partly.elements[5] = None;
    let reading = run(&["L PR[90] 50mm/sec FINE"], &knowing(&[(90, partly)]));
    assert_eq!((ends(&reading).len(), reading.gaps.len()), (0, 1));
}

#[test]
fn registers_told_in_other_frames_are_refused() {
    let mut told = place(1.0, 2.0);
    told.frames = (Some(2), None);
    let known = knowing(&[(90, told)]);
    for lines in [
        &[ONE, "L PR[90] 9mm/sec FINE"] as &[&str],
        &[ONE, "PR[91]=PR[90]", "PR[91,1]=7", GO],
    ] {
        let refused = read(&[program("P", lines)], &known, &Reporter::new());
        let why = refused.map_err(|e| e.why);
        assert!(matches!(why, Err(Refusal::OtherFrame { .. })), "{lines:?}");
    }
}

#[test]
fn registers_that_hold_joints_lead_to_where_the_arm_says() {
    let joints = ToldPosition {
        joints: Some([0.0; 6]),
        ..ToldPosition::default()
    };
    let mut known = knowing(&[(90, joints)]);
    let bare = run(&["L PR[90] 50mm/sec FINE"], &known);
    let why = Missing::JointPosition("PR[90]".to_owned(), NoPose::NoRobot);
    assert_eq!(bare.gaps[0].why, why);
    let at = Pose {
        position: DVec3::new(7.0, 8.0, 9.0),
        ..Pose::IDENTITY
    };
    known.register_poses = BTreeMap::from([(90, Ok(at))]);
    for lines in [
        &["L PR[90] 50mm/sec FINE"] as &[&str],
        &["PR[91]=PR[90]", GO],
    ] {
        let reading = run(lines, &known);
        assert_eq!(ends(&reading), [[7.0, 8.0, 9.0]], "{lines:?}");
        assert_eq!(reading.gaps, []);
    }
    // one of its elements is a joint: no coordinates come of it, set one by one neither
    for set in ["PR[91,1]=PR[90,1]", "PR[91,1]=5"] {
        let lines = [
            "PR[91]=PR[90]",
            set,
            "PR[91,1]=1",
            "PR[91,2]=1",
            "PR[91,3]=1",
            "PR[91,4]=1",
            "PR[91,5]=1",
            "PR[91,6]=1",
            GO,
        ];
        let reading = run(&lines, &known);
        assert_eq!((ends(&reading).len(), reading.gaps.len()), (0, 1), "{set}");
    }
}

#[test]
fn a_register_that_nobody_tells_names_what_it_hangs_on() {
    let lines = [
        "PR[92]=PR[91]",
        "PR[92,3]=PR[92,3]+R[101]",
        "PR[91]=PR[90]",
        "L PR[92] 9mm/sec FINE",
    ];
    let reading = run(&lines, &knowing(&[]));
    let Missing::Register { name, untold } = &reading.gaps[0].why else {
        panic!("{:?}", reading.gaps);
    };
    assert_eq!(name, "PR[92]");
    assert_eq!(untold.join(" "), "PR[90] R[101]");
    assert!(reading.gaps[0].why.remedy().contains("position_register"));
}

fn output(value: Option<f64>, schedule: Option<u32>) -> ToldOutput {
    ToldOutput {
        name: "GO".to_owned(),
        number: Some(2),
        value,
        schedule,
    }
}

fn set(wire_feed: f64) -> WeldSettings {
    WeldSettings {
        wire_feed,
        speed: None,
        crater: Some(0.0),
    }
}

fn feeds(line: &str, outputs: Vec<ToldOutput>) -> (Vec<Option<f64>>, Vec<Missing>) {
    let known = ExecutionSettings {
        schedules: BTreeMap::from([((None, 3), set(100.0)), ((None, 5), set(150.0))]),
        registers: BTreeMap::from([(1, 3.0)]),
        outputs,
        ..ExecutionSettings::default()
    };
    let lines = [
        "Arc Start[5]",
        "L P[2] 9mm/sec FINE",
        line,
        "L P[3] 9mm/sec FINE",
        "Arc End[5]",
    ];
    let reading = run(&lines, &known);
    let told = motions(&reading).iter().map(|m| m.wire_feed).collect();
    (told, reading.gaps.into_iter().map(|g| g.why).collect())
}

#[test]
fn outputs_set_the_source_to_what_the_cell_tells() {
    let (five, three) = (Some(150.0), Some(100.0));
    let calls = output(Some(3.0), Some(3));
    assert_eq!(
        feeds("GO[2]=3", vec![calls.clone()]),
        (vec![five, three], vec![])
    );
    assert_eq!(
        feeds("GO[2]=R[1]", vec![calls.clone()]),
        (vec![five, three], vec![])
    );
    // no metal by any value, and by one alone
    let none = output(None, None);
    assert_eq!(
        feeds("GO[2]=R[9]", vec![none.clone()]),
        (vec![five, five], vec![])
    );
    assert_eq!(
        feeds("GO[2]=0", vec![none.clone(), calls.clone()]),
        (vec![five, five], vec![])
    );
    for (line, told) in [
        // nobody tells it, nor this value, nor which value it is
        ("GO[2]=3", vec![]),
        ("GO[1]=3", vec![calls.clone()]),
        ("GO[2]=4", vec![calls.clone()]),
        ("GO[2]=R[9]", vec![calls.clone(), none]),
        ("AO[2]=3", vec![calls]),
    ] {
        let (_, gaps) = feeds(line, told);
        assert_eq!(gaps, [Missing::Output(line.to_owned())], "{line}");
    }
    // a schedule that nobody tells
    let (_, gaps) = feeds("GO[2]=3", vec![output(None, Some(9))]);
    assert!(matches!(gaps[..], [Missing::Schedule(_)]), "{gaps:?}");
}

#[test]
fn an_arc_word_and_an_output_that_call_two_schedules_are_told() {
    let start = |word: &'static str| {
        let known = ExecutionSettings {
            schedules: BTreeMap::from([((None, 3), set(100.0)), ((None, 5), set(150.0))]),
            outputs: vec![output(Some(3.0), Some(3))],
            ..ExecutionSettings::default()
        };
        let lines = ["GO[2]=3", word, "L P[2] 9mm/sec FINE", "Arc End[5]"];
        let reading = run(&lines, &known);
        (motions(&reading)[0].wire_feed, reading.gaps.len())
    };
    assert_eq!(start("Arc Start[3]"), (Some(100.0), 0));
    assert_eq!(start("Arc Start[20.0,5.0]"), (Some(100.0), 0));
    assert_eq!(start("Arc Start[5]").1, 1);
}

#[test]
fn all_that_decides_is_named_at_once() {
    let lines = [
        ONE,
        "R[7]=R[6]+1",
        "R[8]=R[8]+1",
        "IF (R[7]=1 AND DI[3]=ON) THEN",
        "CALL Q(R[5])",
        "ENDIF",
        "SELECT R[20]=1,JMP LBL[1]",
        "=R[21],JMP LBL[1]",
        "LBL[1]",
    ];
    let called = [
        "IF AR[1]>2,JMP LBL[1]",
        "WHILE (R[8]<PR[3,2])",
        "ENDWHILE",
        "LBL[1]",
        "JMP LBL[R[30]]",
        "R[99]=R[98]",
    ];
    let programs = [program("P", &lines), program("Q", &called)];
    let mut known = ExecutionSettings::default();
    let refused = read(&programs, &known, &Reporter::new()).unwrap_err();
    assert_eq!(
        refused.untold.join(" "),
        "DI[3] PR[3] R[5] R[6] R[8] R[20] R[21] R[30]"
    );
    assert!(
        refused
            .to_string()
            .contains("nobody tells: DI[3], PR[3], R[5]"),
        "{refused}"
    );
    known.registers = [5, 6, 8].map(|n| (n, 1.0)).into();
    let refused = read(&programs, &known, &Reporter::new()).unwrap_err();
    assert_eq!(refused.untold.join(" "), "DI[3] PR[3] R[20] R[21] R[30]");
}

#[test]
fn a_position_that_lacks_a_component_says_which() {
    let text = "/PROG P\n/MN\n1:L P[1] 9mm/sec FINE ;\n/POS\nP[1]{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n \
        X = 1 mm, Y = 0 mm, Z = 0 mm,\n W = 180 deg, P = 0 deg\n};\n/END\n";
    let reading = execute(&[parsed(text).program]).unwrap();
    let lacks = Lacking([false, false, false, false, false, true]);
    let why = &reading.gaps[0].why;
    assert_eq!(
        *why,
        Missing::JointPosition("P[1]".to_owned(), NoPose::Lacks(lacks))
    );
    assert_eq!(why.to_string(), "P[1] lacks R: the move is left out");
}
