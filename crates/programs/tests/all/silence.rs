//! Lines that would end a program, hold it or change its beads without a word, and what a program says of its frames: followed, or told.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_programs::frame_text::shown;
use meltpath_programs::said_frames::SaidFrames;
use meltpath_programs::{
    CellProgramming, Dialect, ExecutionSettings, Missing, Reading, WeldSettings, dialect,
    read_toolpath,
};

use crate::dialects::cell;
use crate::told::{execute, motions, program};

/// Two beads, with lines where `HERE`, `BEAD` and `BETWEEN` stand.
const SCRIPT: &str = "def wall():
  movel(p[0, 0, 0, 0, 3.14159265, 0], 1.2, 0.1)
HERE
  set_job(1)
  set_digital_out(0, True)
BEAD
  movel(p[0.1, 0, 0, 0, 3.14159265, 0], 1.2, 0.0125)
  set_digital_out(0, False)
BETWEEN
  movel(p[0, 0, 0.002, 0, 3.14159265, 0], 1.2, 0.1)
  set_job(1)
  set_digital_out(0, True)
  movel(p[0.1, 0, 0.002, 0, 3.14159265, 0], 1.2, 0.0125)
  set_digital_out(0, False)
end
";

/// A cell whose arc is standard output 0 of a Universal Robot.
pub(crate) fn script_cell() -> CellProgramming {
    let mut cell = cell(&[100.0]);
    let words = cell.script.value.as_mut().unwrap();
    words.arc_start.value = vec![
        "set_job({1})".to_owned(),
        "set_digital_out(0, True)".to_owned(),
    ];
    words.arc_end.value = vec!["set_digital_out(0, False)".to_owned()];
    cell
}

/// What the script does with a line in place of `at`, and what is told.
fn script(cell: &CellProgramming, at: &str, line: &str) -> (Reading, Vec<String>) {
    let text = SCRIPT.replace(at, &format!("  {line}"));
    let text = ["HERE\n", "BEAD\n", "BETWEEN\n"]
        .iter()
        .fold(text, |text, mark| text.replace(mark, ""));
    let parsed = dialect::read(Dialect::UrScript, text.as_bytes(), None, cell).unwrap();
    let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
    let reporter = Reporter::new();
    let reading = read_toolpath(&programs, &cell.execution(10.0), 1000.0, &reporter).unwrap();
    let told = reporter.digest(9).into_iter().map(|w| w.message);
    (reading, told.collect())
}

fn beads(reading: &Reading) -> usize {
    motions(reading).iter().filter(|m| m.burns).count()
}

#[test]
fn a_script_ends_where_it_halts() {
    let cell = script_cell();
    assert_eq!(beads(&script(&cell, "HERE", "# on").0), 2);
    let (reading, told) = script(&cell, "BETWEEN", "halt");
    assert_eq!((beads(&reading), reading.gaps), (1, vec![]));
    let line = "line 7 (\"halt\"): the program ends there, what stands behind it is not executed";
    assert!(told.iter().any(|t| t == line), "{told:?}");
    // whether a block that is not followed comes to it nobody knows
    let (reading, _) = script(
        &cell,
        "BETWEEN",
        "if get_standard_digital_in(2):\n    halt\n  end",
    );
    assert_eq!(beads(&reading), 2);
    let may = Missing::MayEnd("halt".to_owned());
    assert!(reading.gaps.iter().any(|g| g.why == may), "{reading:?}");
}

/// A user's alarm holds the program as a pause does: in a bead the arc burns on in place.
#[test]
fn a_users_alarm_holds_a_bead() {
    let start = [
        "UFRAME_NUM=1",
        "UTOOL_NUM=1",
        "!Schedule 1 WFS 8.00 m/min",
        "L P[1] 50mm/sec FINE Arc Start[1]",
    ];
    let end = [
        "L P[2] 10mm/sec FINE",
        "L P[3] 10mm/sec FINE Arc End[1]",
        "UALM[1]",
        "PAUSE",
    ];
    for line in ["UALM[1]", "PAUSE"] {
        let lines = [&start[..], &[line], &end].concat();
        let gaps = execute(&[program("P", &lines)]).unwrap().gaps;
        assert_eq!(gaps.len(), 1, "{gaps:?}");
        let gap = (gaps[0].line, &gaps[0].why);
        assert_eq!(gap, (5, &Missing::WaitWithArc));
    }
}

#[test]
fn lines_that_are_passed_over_are_told_with_the_first_of_them() {
    let cell = script_cell();
    let (_, told) = script(&cell, "BETWEEN", "sync()\n  sync()");
    let line =
        "2 lines, first line 7 (\"sync()\"): SYNC is kept, not executed, no metal is laid by it";
    assert!(told.iter().any(|t| t == line), "{told:?}");
}

/// Both names of an output are the same one, whichever the cell file has; what may set it otherwise is told.
#[test]
fn an_output_of_the_arc_has_several_names() {
    let mut cell = script_cell();
    for line in [
        "set_standard_digital_out(0, False)",
        "set_digital_out(0,False) # off",
        "set_digital_out(b=False, n=0)",
    ] {
        let (reading, _) = script(&cell, "BEAD", line);
        assert_eq!(beads(&reading), 1, "{line}");
        // the arc's end behind finds it off
        assert_eq!(reading.gaps.len(), 1, "{line}");
        assert_eq!(reading.gaps[0].why, Missing::ArcOff);
    }
    let told = |cell: &CellProgramming, line: &str| {
        let (reading, _) = script(cell, "BEAD", line);
        let gaps = reading.gaps.iter();
        gaps.filter(|g| g.why == Missing::ArcOutput(line.to_owned()))
            .count()
    };
    assert_eq!(told(&cell, "set_standard_digital_out(0, bOff)"), 1);
    assert_eq!(told(&cell, "set_digital_out(nArc, False)"), 1);
    for other in [
        "set_standard_digital_out(1, False)",
        "set_configurable_digital_out(0, False)",
        "set_tool_digital_out(0, False)",
    ] {
        let (reading, _) = script(&cell, "BEAD", other);
        assert_eq!((beads(&reading), reading.gaps), (2, vec![]), "{other}");
    }
    let words = cell.script.value.as_mut().unwrap();
    words.arc_start.value[1] = "set_standard_digital_out(0, True)".to_owned();
    words.arc_end.value = vec!["set_standard_digital_out(0, False)".to_owned()];
    let (reading, _) = script(&cell, "BETWEEN", "sync()");
    assert_eq!((beads(&reading), reading.gaps), (2, vec![]));
}

/// Where tools and objects lie is known as far as the program says it in numbers.
#[test]
fn a_program_says_where_its_frames_lie() {
    let cell = script_cell();
    let said = |dialect, text: &str, data: Option<&str>, cell: &CellProgramming| {
        let data = data.map(str::as_bytes);
        let parsed = dialect::read(dialect, text.as_bytes(), data, cell).unwrap();
        let program = parsed.into_iter().next().unwrap().program;
        let SaidFrames { user, tool, .. } = program.said_frames;
        let shown = |all: BTreeMap<u32, Pose>| -> Vec<String> {
            all.values().map(|pose| shown(dialect, pose)).collect()
        };
        (shown(user), shown(tool))
    };
    let module = "MODULE m
PERS tooldata tGun:=[TRUE,[[8.5,0,342],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
TASK PERS wobjdata wTable:=[FALSE,TRUE,\"\",[[500,0,100],[1,0,0,0]],[[0,20,0],[0.7071067812,0,0,0.7071067812]]];
PERS wobjdata wMoved:=[FALSE,FALSE,\"STN1\",[[500,0,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
PROC main()
MoveL [[0,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tGun\\WObj:=wTable;
MoveL [[0,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tGun\\WObj:=wMoved;
MoveL [[0,0,50],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tOther;
ENDPROC
ENDMODULE
";
    let object = "[[500, 20, 100], [0.7071068, 0, 0, 0.7071068]]";
    let base = "[[0, 0, 0], [1, 0, 0, 0]]";
    let tool = "[[8.5, 0, 342], [1, 0, 0, 0]]";
    let wanted = (
        vec![object.to_owned(), base.to_owned()],
        vec![tool.to_owned()],
    );
    assert_eq!(said(Dialect::Rapid, module, None, &cell), wanted);
    let script = "def s():
  set_tcp(p[0, 0, 0.3, 0, 0.5, 0])
  movel(p[0, 0, 0, 0, 3.14159265, 0], 1.2, 0.1)
end
";
    let wanted = (
        vec!["p[0, 0, 0, 0, 0, 0]".to_owned()],
        vec!["p[0, 0, 0.3, 0, 0.5, 0]".to_owned()],
    );
    assert_eq!(said(Dialect::UrScript, script, None, &cell), wanted);
}

/// A bead that gains its speed slowly is told, whoever's words say so; what the metal does not show counts as none.
#[test]
fn slow_accelerations_of_beads_are_told() {
    let told = |gaps: &[meltpath_programs::Gap]| {
        let of = |g: &&meltpath_programs::Gap| matches!(g.why, Missing::Acceleration(_));
        gaps.iter().filter(of).count()
    };
    let cell = script_cell();
    for (acceleration, count) in [("0.01", 1), ("slow", 1), ("1.2", 0), ("0.5", 0)] {
        let text = SCRIPT.replacen("], 1.2, 0.0125)", &format!("], {acceleration}, 0.0125)"), 1);
        let text = ["HERE\n", "BEAD\n", "BETWEEN\n"]
            .iter()
            .fold(text, |text, mark| text.replace(mark, ""));
        let parsed = dialect::read(Dialect::UrScript, text.as_bytes(), None, &cell).unwrap();
        let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
        let read = read_toolpath(&programs, &cell.execution(10.0), 1000.0, &Reporter::new());
        let gaps = read.unwrap().gaps;
        assert_eq!((told(&gaps), gaps.len()), (count, count), "{acceleration}");
    }
    let cell = crate::dialects::cell(&[100.0]);
    let src = include_str!("../data/arctech_seam.src");
    let dat = include_str!("../data/arctech_seam.dat");
    let seam = |line: &str, dat: &str| {
        let src = src.replacen(
            "LDAT_ACT = LCPDAT2\n",
            &format!("LDAT_ACT = LCPDAT2\n{line}\n"),
            1,
        );
        let data = Some(dat.as_bytes());
        let parsed = dialect::read(Dialect::Krl, src.as_bytes(), data, &cell).unwrap();
        let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
        let read = read_toolpath(&programs, &cell.execution(10.0), 1000.0, &Reporter::new());
        told(&read.unwrap().gaps)
    };
    assert_eq!(seam("", dat), 0);
    assert_eq!(seam("$ACC.CP=2.3", dat), 0);
    assert_eq!(seam("$ACC.CP=0.01", dat), 2);
    assert_eq!(seam("$ACC.CP=aBead", dat), 2);
    assert_eq!(seam("BAS(#ACC_CP,30)", dat), 2);
    let lower = dat.replace("LCPDAT2={VEL 0.1,ACC 100.0", "LCPDAT2={VEL 0.1,ACC 50.0");
    assert_ne!(lower, dat);
    assert_eq!(seam("", &lower), 2);
    let dtx = include_str!("../data/bead.dtx");
    let pgx = include_str!("../data/bead.pgx");
    let cell = crate::dialects::cell(&[100.0, 120.0]);
    for (said, some) in [("accel=\"100\"", false), ("decel=\"20\"", true)] {
        let data = dtx.replace("tmax=\"8\"", &format!("{said} tmax=\"8\""));
        let data = Some(data.as_bytes());
        let parsed = dialect::read(Dialect::Val3, pgx.as_bytes(), data, &cell).unwrap();
        let programs: Vec<_> = parsed.into_iter().map(|p| p.program).collect();
        let read = read_toolpath(&programs, &cell.execution(10.0), 1000.0, &Reporter::new());
        assert_eq!(told(&read.unwrap().gaps) > 0, some, "{said}");
    }
}

/// What runs on the way of a move is one line and one fault.
#[test]
fn a_program_that_runs_on_the_way_is_told_once() {
    let lines = |word: &str| {
        let bead = format!("L P[2] 10mm/sec CNT50 {word}");
        let lines = [
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "!Schedule 1 WFS 8.00 m/min",
            "L P[1] 50mm/sec FINE Arc Start[1]",
            &bead,
            "L P[3] 10mm/sec FINE Arc End[1]",
        ];
        program("P", &lines)
    };
    let word = "TB .10sec,CALL WIREOFF";
    let gaps = execute(&[lines(word)]).unwrap().gaps;
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    assert_eq!(
        (gaps[0].line, &gaps[0].why),
        (5, &Missing::OnTheWay(word.to_owned()))
    );
    assert!(gaps[0].text.contains(word));
    let known = ExecutionSettings {
        passed_over: BTreeSet::from(["WIREOFF".to_owned()]),
        ..ExecutionSettings::default()
    };
    let read = read_toolpath(&[lines(word)], &known, 1000.0, &Reporter::new());
    assert_eq!(read.unwrap().gaps, []);
}

/// A circular move whose points tell no circle is told at its line; a point between the ends of a straight line tells that line.
#[test]
fn circular_moves_that_are_no_circle_are_told() {
    let gaps = |first: &str, via: &str, end: &str| {
        let start = format!("L P[{first}] 50mm/sec FINE Arc Start[1]");
        let round = format!("C P[{via}]    \n    :    P[{end}] 10mm/sec FINE");
        let lines = [
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "!Schedule 1 WFS 8.00 m/min",
            &start,
            &round,
            "L P[3] 10mm/sec FINE Arc End[1]",
        ];
        let gaps = execute(&[program("P", &lines)]).unwrap().gaps;
        let told = gaps.into_iter().map(|g| (g.line, g.why));
        told.collect::<Vec<_>>()
    };
    assert_eq!(gaps("1", "2", "3"), []);
    // ends where it begins, over its start, over its end, over a point beyond its end
    for [first, via, end] in [
        ["1", "2", "1"],
        ["1", "1", "2"],
        ["1", "2", "2"],
        ["1", "3", "2"],
    ] {
        let told = gaps(first, via, end);
        assert!(
            matches!(told[..], [(5, Missing::Circle(_))]),
            "{first} {via} {end}: {told:?}"
        );
    }
}

/// A travel of that kind leaves the way of the arm open, not the metal; a chain of circle-arc moves is looked at as well.
#[test]
fn travels_and_chains_that_are_no_circle_are_told() {
    let read = |lines: &[&str]| {
        let frames = ["UFRAME_NUM=1", "UTOOL_NUM=1", "!Schedule 1 WFS 8.00 m/min"];
        execute(&[program("P", &[&frames[..], lines].concat())]).unwrap()
    };
    let travel = read(&[
        "L P[1] 50mm/sec FINE",
        "C P[3]    \n    :    P[2] 10mm/sec FINE",
        "L P[1] 50mm/sec FINE Arc Start[1]",
        "L P[3] 10mm/sec FINE Arc End[1]",
    ]);
    assert_eq!(travel.gaps, []);
    let open: Vec<_> = travel.left_out.iter().map(|g| g.line).collect();
    assert_eq!(open, [5]);
    let chain = read(&[
        "L P[2] 50mm/sec FINE Arc Start[1]",
        "A P[1] 10mm/sec CNT100",
        "A P[3] 10mm/sec CNT100",
        "A P[2] 10mm/sec FINE Arc End[1]",
    ]);
    let told = chain
        .gaps
        .iter()
        .filter(|g| matches!(g.why, Missing::Circle(_)));
    assert_eq!(told.map(|g| g.line).collect::<Vec<_>>(), [6, 7]);
}

/// Two comments on one schedule that contradict each other tell nothing, wherever the second stands; both lines are named.
#[test]
fn comments_that_contradict_each_other_tell_no_feed() {
    let gaps = |second: &str| {
        let lines = [
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "!Schedule 1 WFS 8.00 m/min",
            "L P[1] 50mm/sec FINE Arc Start[1]",
            "L P[2] 10mm/sec FINE",
            "L P[3] 10mm/sec FINE Arc End[1]",
            second,
        ];
        execute(&[program("P", &lines)]).unwrap().gaps
    };
    assert_eq!(gaps("!Schedule 1 WFS 8.0 m/min"), []);
    assert_eq!(gaps("!Schedule 2 WFS 4.00 m/min"), []);
    let told = gaps("!Schedule 1 WFS 4.00 m/min");
    assert_eq!((told.len(), told[0].line), (1, 4), "{told:?}");
    assert_eq!(
        told[0].why.to_string(),
        "which wire feed Arc Start[1] sets is not known: of schedule 1, line 3 says 8 m/min and line 7 says 4 m/min"
    );
}

/// A schedule belongs to its weld procedure: a comment that names none counts where there is one procedure, or the cell's table tells.
#[test]
fn a_comment_is_of_the_only_procedure() {
    let lines = |second: &str| {
        let second = format!("L P[1] 50mm/sec FINE Weld Start[{second},1]");
        let lines = [
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "!Schedule 1 WFS 8.00 m/min",
            "R[1]=2",
            "L P[1] 50mm/sec FINE Weld Start[1,1]",
            "L P[2] 10mm/sec FINE Weld End[1,1]",
            &second,
            "L P[3] 10mm/sec FINE Weld End[1,1]",
        ];
        program("P", &lines)
    };
    let gaps = |second: &str, settings: &ExecutionSettings| {
        let read = read_toolpath(&[lines(second)], settings, 1000.0, &Reporter::new());
        let gaps = read.unwrap().gaps.into_iter();
        gaps.map(|g| (g.line, g.why.to_string()))
            .collect::<Vec<_>>()
    };
    let bare = ExecutionSettings::default();
    assert_eq!(gaps("1", &bare), []);
    let why = "sets is not known: the comment on schedule 1 names no weld procedure, and the program uses procedures 1 and 2";
    let both = [(5, "1"), (7, "2")]
        .map(|(line, p)| (line, format!("which wire feed Weld Start[{p},1] {why}")));
    assert_eq!(gaps("2", &bare), both);
    // a register tells its procedure when it comes to it
    let told = gaps("R[1]", &bare);
    assert_eq!((told.len(), told[0].0), (1, 7), "{told:?}");
    let set = |wire_feed| WeldSettings {
        wire_feed,
        speed: None,
        crater: None,
    };
    let listed = ExecutionSettings {
        schedules: BTreeMap::from([((Some(1), 1), set(133.0)), ((Some(2), 1), set(66.0))]),
        ..ExecutionSettings::default()
    };
    assert!(gaps("2", &listed).is_empty());
}
