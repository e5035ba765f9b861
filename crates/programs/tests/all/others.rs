//! Programs that others wrote for other controllers than FANUC's: read line by line, nothing lost, and damaged.

use meltpath_base::{Reporter, settings as files};
use meltpath_programs::program::{Instruction, Program, Termination};
use meltpath_programs::{
    CellProgramming, Dialect, ExecutionSettings, Gap, Missing, ParseError, Reading, dialect,
    read_toolpath,
};
use meltpath_toolpath::Move;

use crate::built::arcmate;
use crate::dialects::{OTHERS, cell};
use crate::told::{Told, motions};

const SEAM_SRC: &str = include_str!("../data/arctech_seam.src");
const SEAM_DAT: &str = include_str!("../data/arctech_seam.dat");
const MODULE: &str = include_str!("../data/two_seams.mod");
const SCRIPT: &str = include_str!("../data/hand_written.script");
const JOB: &str = include_str!("../data/taught.JBI");
const PGX: &str = include_str!("../data/bead.pgx");
const DTX: &str = include_str!("../data/bead.dtx");

fn executed(programs: &[Program], cell: &CellProgramming) -> Reading {
    read_toolpath(programs, &cell.execution(10.0), 1000.0, &Reporter::new()).unwrap()
}

/// The number of the first line that holds `words`.
fn line_of(text: &str, words: &str) -> u32 {
    text.lines().position(|l| l.contains(words)).unwrap() as u32 + 1
}

/// Whether metal is laid, how fast, where to, how it ends.
fn smoothed(moves: &[Told]) -> Vec<(bool, Option<f64>, f64, Option<f64>)> {
    let told = |m: &Told| (m.burns, m.speed, m.to.x, m.control.smoothing);
    moves.iter().map(told).collect()
}

/// Whether metal is laid, how fast, of how much wire (mm/s, rounded), where to.
fn laid(moves: &[Told]) -> Vec<(bool, Option<f64>, Option<f64>, f64)> {
    let told = |m: &Told| (m.burns, m.speed, m.wire_feed.map(f64::round), m.to.x);
    moves.iter().map(told).collect()
}

/// The programs of a file with its data.
fn programs(
    dialect: Dialect,
    text: &str,
    data: Option<&str>,
    cell: &CellProgramming,
) -> Vec<Program> {
    let all = dialect::read(dialect, text.as_bytes(), data.map(str::as_bytes), cell);
    all.unwrap().into_iter().map(|p| p.program).collect()
}

fn names(programs: &[Program]) -> Vec<&str> {
    programs.iter().map(|p| p.name.as_str()).collect()
}

fn places(gaps: &[Gap]) -> Vec<(u32, &str)> {
    gaps.iter().map(|g| (g.line, g.text.as_str())).collect()
}

#[test]
fn a_kuka_program_of_inline_forms_is_read() {
    let cell = cell(&[100.0]);
    let programs = programs(Dialect::Krl, SEAM_SRC, Some(SEAM_DAT), &cell);
    assert_eq!(names(&programs), ["SEAM", "HELP"]);
    let reading = executed(&programs, &cell);
    let moves = motions(&reading);
    assert_eq!(
        smoothed(&moves),
        [
            (false, Some(25.0), 100.0, None),
            (true, Some(6.0), 150.0, Some(0.5)),
            (true, Some(7.5), 200.0, None),
            (false, Some(200.0), 200.0, None),
        ]
    );
    assert_eq!(moves[1].wire_feed, Some(8000.0 / 60.0));
    assert_eq!(moves[1].control.frames, (10, 1));
    // the unknown word is kept and told, with its line, and what follows is read
    let gaps: Vec<_> = reading
        .gaps
        .iter()
        .map(|g| (g.line, g.text.as_str(), &g.why))
        .collect();
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    assert_eq!(gaps[0].0, line_of(SEAM_SRC, "TS_Search"));
    assert!(
        matches!(gaps[0].2, Missing::Call(name) if name == "TS_SEARCH"),
        "{gaps:?}"
    );
}

/// A track and a table of one axis: inline forms list six axes and write no units.
#[test]
fn external_axes_are_those_of_the_robot_in_its_units() {
    let data = SEAM_DAT.replace("E1 0.0,E2 0.0", "E1 500.0,E2 30.0");
    let programs = programs(Dialect::Krl, SEAM_SRC, Some(&data), &cell(&[100.0]));
    let (program, position) = (&programs[0], &programs[0].positions[0]);
    let said = |turning: &[(usize, Vec<bool>)]| {
        let known = ExecutionSettings {
            turning: turning.iter().cloned().collect(),
            ..ExecutionSettings::default()
        };
        known.external_axes(program, position)
    };
    assert_eq!(said(&[]), [500.0, 30.0, 0.0, 0.0, 0.0, 0.0]);
    let both = (2, vec![false, true]);
    let known = [(1, vec![true]), both];
    assert_eq!(said(&known), [500.0, 30_f64.to_radians()]);
    // another robot than the program's: nothing that stands elsewhere than at zero is left out
    assert_eq!(said(&[(1, vec![true])]).len(), 6);
}

#[test]
fn an_abb_module_of_another_is_read() {
    let mut cell = cell(&[100.0]);
    cell.arc_values.value = files::peek::<CellProgramming>(
        &meltpath_data::cells::ARCMATE_120IC.text.replace(
            "name_length = 32",
            "name_length = 32\narc_values = [\"schedule\", \"other\", \"other\", \"wire feed, mm/s\"]",
        ),
        &["program"],
    )
    .unwrap()
    .unwrap()
    .arc_values
    .value;
    let programs = programs(Dialect::Rapid, MODULE, None, &cell);
    assert_eq!(names(&programs), ["main", "rSeam"]);
    let reading = executed(&programs, &cell);
    let moves = motions(&reading);
    assert_eq!(
        laid(&moves),
        [
            (false, Some(100.0), None, 10.0),
            (true, Some(6.0), Some(120.0), 60.0),
            (true, Some(8.0), Some(140.0), 80.0),
            (false, Some(200.0), None, 80.0),
        ]
    );
    assert_eq!(
        (moves[1].wire_feed, moves[1].control.smoothing),
        (Some(120.0), Some(0.25))
    );
    assert_eq!(
        places(&reading.gaps),
        [(
            line_of(MODULE, "SearchL"),
            "SearchL \\Stop,diTouch,pFound,p10,v20,tGun\\WObj:=wTable"
        )]
    );
}

#[test]
fn a_script_of_another_is_read() {
    let mut cell = cell(&[100.0]);
    let words = cell.script.value.as_mut().unwrap();
    words.part.value = "plane".to_owned();
    let program = programs(Dialect::UrScript, SCRIPT, None, &cell).remove(0);
    let reading = executed(std::slice::from_ref(&program), &cell);
    let moves = motions(&reading);
    assert_eq!(
        laid(&moves),
        [
            (true, Some(10.0), Some(133.0), 150.0),
            (true, Some(12.0), Some(133.0), 200.0),
            (true, Some(10.0), Some(133.0), 200.0),
            (false, Some(100.0), None, 200.0),
        ]
    );
    assert_eq!(
        places(&reading.gaps),
        [(
            line_of(SCRIPT, "movep("),
            "movep(pose_trans(plane,p[0.2,0.0,0.0,0,3.14159265,0]),a=1.2,v=0.01,r=0.001)"
        )]
    );
    assert!(
        program
            .instructions
            .iter()
            .any(|i| matches!(i, Instruction::Motion(m) if m.termination == Termination::Fine))
    );
}

/// Arguments of a script's moves stand at their places or by their names. One that is a variable is told where metal is laid with it,
/// and another tool than that of the beads before.
#[test]
fn arguments_of_a_script_count_by_their_places() {
    let mut cell = cell(&[100.0]);
    let words = cell.script.value.as_mut().unwrap();
    words.arc_start.value = vec!["arc(True)".to_owned()];
    words.arc_end.value = vec!["arc(False)".to_owned()];
    let script = "def wall():
  set_tcp(p[0,0,0.3,0,0,0])
  movel(p[0, 0, 0, 0, 3.14159265, 0], 1.2, 0.1)
  arc(True)
  movel(p[0.1, 0, 0, 0, 3.14159265, 0], 1.2, 0.05)
  movec(p[0.15, 0.05, 0, 0, 3.14159265, 0], p[0.2, 0, 0, 0, 3.14159265, 0], 1.2, 0.02)
  movel(p[0.3, 0, 0, 0, 3.14159265, 0])
  movel(p[0.4, 0, 0, 0, 3.14159265, 0], a=1.2, v=slow)
  movel(p[0.5, 0, 0, 0, 3.14159265, 0], 1.2, 0.05, 4)
  arc(False)
  movel(p[0.5, 0, 0.1, 0, 3.14159265, 0], v=quick)
  set_tcp(p[0,0,0.35,0,0,0])
  movel(p[0.5, 0, 0, 0, 3.14159265, 0], 1.2, 0.1)
  arc(True)
  movel(p[0.6, 0, 0, 0, 3.14159265, 0], 1.2, 0.05)
  arc(False)
end
";
    let programs = programs(Dialect::UrScript, script, None, &cell);
    let read = executed(&programs, &cell);
    let moves = motions(&read);
    let burning: Vec<_> = moves.iter().filter(|m| m.burns).collect();
    let speeds: Vec<_> = burning.iter().map(|m| m.speed).collect();
    // the script manual's 0.25 m/s where none is said
    // 10 mm/s for one that is not known; 100 mm in the 4 s that stand in the place of a speed
    let known = [50.0, 20.0, 250.0, 10.0, 25.0, 50.0].map(Some);
    assert_eq!(speeds, known);
    let gaps = &read.gaps;
    for (line, told) in [
        (8, "the speed v=slow"),
        (9, "t=4"),
        (15, "with tool frame 2"),
    ] {
        let gap = gaps.iter().find(|g| g.line == line);
        let why = gap.map(|g| g.why.to_string()).unwrap_or_default();
        assert!(why.contains(told), "{line}: {gaps:?}");
    }
}

/// A pose within another one stands where both together place it, where neither is the part's.
#[test]
fn a_pose_within_a_pose_is_known() {
    let cell = cell(&[100.0]);
    let at = |target: &str| {
        let script =
            format!("def w():\n  movel(p[0,0,0,0,0,0], v=0.1)\n  movel({target}, v=0.1)\nend\n");
        let program = programs(Dialect::UrScript, &script, None, &cell).remove(0);
        let read = executed(std::slice::from_ref(&program), &cell);
        assert!(read.gaps.is_empty(), "{:?}", read.gaps);
        let moves = motions(&read);
        let (to, axis) = (moves[0].to, moves[0].axis);
        [to.to_array(), axis.to_array()]
    };
    // a quarter turn about z, then a half turn about y
    let within = at("pose_trans(p[0.5,0,0.02,0,0,1.5707963268],p[0.1,0,0,0,3.1415926536,0])");
    let alone = at("p[0.5,0.1,0.02,-2.2214414691,2.2214414691,0]");
    for (within, alone) in within.iter().flatten().zip(alone.iter().flatten()) {
        assert!((within - alone).abs() < 1e-6, "{within} {alone}");
    }
}

/// Targets that are displaced by numbers are known; by what is computed they are not.
#[test]
fn targets_beside_others_are_known() {
    let cell = cell(&[100.0]);
    let module = "MODULE Wall
  TASK PERS welddata wd1:=[12.5,0,[5,8,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  CONST robtarget p10:=[[10,20,30],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(p10,0,0,50),v500,z10,tTorch;
    ArcLStart Offs(p10, 1, -2, 3),v100,sm1,wd1,fine,tTorch;
    ArcLEnd RelTool(p10,100,0,-5),v100,sm1,wd1,fine,tTorch;
    MoveL Offs(p10,0,0,h),v500,z10,tTorch;
  ENDPROC
ENDMODULE
";
    let programs = programs(Dialect::Rapid, module, None, &cell);
    let read = executed(&programs, &cell);
    let moves = motions(&read);
    let to: Vec<_> = moves.iter().map(|m| m.to.to_array()).collect();
    // the tool is turned by 180 degrees about y: its x and z point back
    let wanted = [[11.0, 18.0, 33.0], [-90.0, 20.0, 35.0]];
    for (to, wanted) in to.iter().zip(wanted) {
        let apart = to.iter().zip(wanted).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-6, "{to:?} {wanted:?}");
    }
    assert_eq!(moves.len(), 2);
    let gap = read.gaps.last().unwrap();
    assert!(gap.why.to_string().contains("Offs(p10,0,0,h)"), "{gap:?}");
}

/// What is missing is called as its controller calls it.
#[test]
fn a_kuka_program_without_a_base_is_told_so() {
    let cell = cell(&[100.0]);
    let text = "DEF WALL( )\n$VEL.CP=0.1\nLIN {X 0,Y 0,Z 0,A 0,B 0,C 180}\nEND\n";
    let programs = programs(Dialect::Krl, text, None, &cell);
    let settings = cell.execution(10.0);
    let error = read_toolpath(&programs, &settings, 1000.0, &Reporter::new()).unwrap_err();
    let told = error.to_string();
    assert!(told.contains("any $BASE=BASE_DATA[n]"), "{told}");
}

#[test]
fn a_yaskawa_job_of_another_is_read() {
    let cell = cell(&[100.0, 120.0]);
    let parsed = dialect::read(Dialect::Inform, JOB.as_bytes(), None, &cell)
        .unwrap()
        .remove(0);
    let line = |text: &str| JOB.lines().position(|l| l.starts_with(text)).unwrap() as u32 + 1;
    // a station's position stands outside the instructions
    let outside: Vec<u32> = parsed.unread.iter().map(|u| u.line).collect();
    assert!(outside.contains(&line("EC00000")), "{outside:?}");
    let program = parsed.program;
    let reading = executed(std::slice::from_ref(&program), &cell);
    let moves = motions(&reading);
    assert_eq!(
        laid(&moves),
        [
            (true, Some(6.0), Some(120.0), 60.0),
            (true, Some(8.0), Some(120.0), 80.0),
            (true, Some(6.0), Some(120.0), 10.0),
            (false, Some(200.0), None, 80.0),
        ]
    );
    assert!(matches!(moves[1].shape, Move::Arc { via } if via.x == 75.0));
    assert_eq!(moves[0].control.frames, (3, 2));
    assert_eq!(moves[0].control.smoothing, Some(0.125));
    let gaps: Vec<_> = reading.gaps.iter().map(|g| (g.line, &g.why)).collect();
    // how a circle without a level ends is the controller's; the shift and the call are not known
    let [
        (circle, Missing::Termination(_)),
        (shift, Missing::Unknown(_)),
        (call, _),
    ] = gaps[..]
    else {
        panic!("{gaps:?}")
    };
    let wanted = [line("MOVC C00005"), line("SFTON"), line("CALL")];
    assert_eq!([circle, shift, call], wanted);
    // as the job writes it, not in words of another controller
    let quoted = &reading.gaps[0].text;
    assert!(quoted.starts_with("MOVC C00005"), "{quoted}");
    assert!(JOB.lines().any(|l| l.trim() == quoted), "{quoted}");
}

/// A move whose joints go at a hundredth of their speeds may not keep the speed of its bead: it is told, in the project's own words.
#[test]
fn slow_joints_of_a_staubli_bead_are_told() {
    let cell = cell(&[100.0, 120.0]);
    let gaps = |vel: &str| {
        let data = DTX.replace(
            "key=\"0\" tmax=\"8\"",
            &format!("key=\"0\" vel=\"{vel}\" tmax=\"8\""),
        );
        assert_ne!(data, DTX);
        let program = programs(Dialect::Val3, PGX, Some(&data), &cell).remove(0);
        executed(std::slice::from_ref(&program), &cell).gaps
    };
    let told = &gaps("1")[0];
    assert_eq!(told.why, Missing::SlowJoints(1.0));
    let line = "movel(pWall[1],tGun,mLay[0])";
    assert_eq!((told.line, told.text.as_str()), (line_of(PGX, line), line));
    let slow = |g: &Gap| matches!(g.why, Missing::SlowJoints(_));
    assert!(!gaps("20").iter().any(slow));
}

/// Lines that begin as the arc's do are one with the line that goes on otherwise: that one is told, not the ones before it.
#[test]
fn lines_of_an_arc_that_go_on_otherwise_are_told_where_they_do() {
    let cell = cell(&[100.0, 120.0]);
    for (from, to) in [
        ("  doArc=true\n", "  doArc=bBurn\n"),
        ("aioSet(aoWire,7.2)", "aioSet(aoWire,nFeed)"),
    ] {
        let text = PGX.replacen(from, to, 1);
        assert_ne!(text, PGX);
        let program = programs(Dialect::Val3, &text, Some(DTX), &cell).remove(0);
        let reading = executed(std::slice::from_ref(&program), &cell);
        let first = &reading.gaps[0];
        let line = to.trim();
        assert_eq!(
            (first.line, first.text.as_str()),
            (line_of(&text, line), line)
        );
        assert_eq!(first.why, Missing::ArcLines(line.to_owned()));
        assert!(
            reading.gaps.iter().all(|g| g.text != "nJob=2"),
            "{:?}",
            reading.gaps
        );
        // what is kept is written as it was
        let files = dialect::write(&program, &cell).unwrap();
        let lines: Vec<&str> = files
            .iter()
            .flat_map(|f| f.text.lines())
            .map(str::trim)
            .collect();
        assert!(
            lines.contains(&line) && lines.contains(&"nJob=2"),
            "{lines:?}"
        );
    }
}

#[test]
fn a_staubli_project_of_another_is_read() {
    let cell = cell(&[100.0, 120.0]);
    let program = programs(Dialect::Val3, PGX, Some(DTX), &cell).remove(0);
    assert_eq!(program.name, "bead");
    let reading = executed(std::slice::from_ref(&program), &cell);
    let moves = motions(&reading);
    assert_eq!(
        smoothed(&moves),
        [
            (true, Some(8.0), 60.0, Some(0.5)),
            (true, Some(8.0), 80.0, None),
            (false, Some(250.0), 80.0, None),
        ]
    );
    assert!(matches!(moves[1].shape, Move::Arc { via } if via.x == 75.0));
    // an output that is switched while moves are queued is no arc word
    let line = |text: &str| line_of(PGX, text);
    let gaps: Vec<u32> = reading.gaps.iter().map(|g| g.line).collect();
    let told = ["call clean", "nJob=3", "aioSet(aoWire,9)", "doArc=true //"];
    assert_eq!(gaps, told.map(line));
}

/// Found by damaging texts: numbers and names that none has, and lines that would mean something else when written anew.
#[test]
fn what_no_controller_has_is_not_taken_for_it() {
    let cell = cell(&[100.0]);
    let feeds = SEAM_DAT.replace("Channel2 8.0", "Channel2 1e308");
    assert_ne!(feeds, SEAM_DAT);
    let programs = programs(Dialect::Krl, SEAM_SRC, Some(&feeds), &cell);
    let reading = executed(&programs, &cell);
    let schedule = |g: &Gap| matches!(g.why, Missing::Schedule(_));
    assert!(reading.gaps.iter().any(schedule), "{:?}", reading.gaps);
    let nameless = dialect::read(Dialect::Rapid, b"MODULE m\nPROC];\nENDPROC\n", None, &cell);
    assert!(
        matches!(nameless, Err(ParseError::Other { .. })),
        "{nameless:?}"
    );
    let endless = JOB.replace("T=0.30", "T=99999999999999999999");
    let job = dialect::read(Dialect::Inform, endless.as_bytes(), None, &cell).unwrap();
    let told = dialect::write(&job[0].program, &cell).unwrap_err();
    assert!(told.to_string().contains("more than a day"), "{told}");
    let open = b"MODULE m\nCONST\"\n4;PROC m;\nENDPROC\n";
    // a text ends on its line; one that does not would swallow the lines behind it
    let mut module = dialect::read(Dialect::Rapid, open, None, &cell).unwrap();
    let files = dialect::write(&module[0].program, &cell).unwrap();
    assert!(files[0].text.contains("CONST\"\" 4;"), "{}", files[0].text);
    let raw = Instruction::Raw("TPWrite \"a".to_owned());
    module[0].program.instructions.push(raw);
    let told = dialect::write(&module[0].program, &cell).unwrap_err();
    assert!(
        matches!(told, meltpath_programs::WriteError::Text { .. }),
        "{told}"
    );
    let text = JOB.replace("SFTON P010", "MOVL C00001 V=6.0 UNTIL IN#(1)=ON");
    let job = dialect::read(Dialect::Inform, text.as_bytes(), None, &cell).unwrap();
    let told = dialect::write(&job[0].program, &cell).unwrap_err();
    assert!(told.to_string().contains("by its number"), "{told}");
}

#[test]
fn texts_that_are_no_programs_are_refused() {
    let cell = arcmate();
    for dialect in OTHERS {
        let none = dialect::read(dialect, b"G1 X10 Y20\n", None, &cell);
        assert!(matches!(none, Err(ParseError::Other { .. })), "{none:?}");
    }
    for (dialect, text) in [
        (Dialect::Krl, "DEF A( )\nLIN XP1\n"),
        (Dialect::Rapid, "MODULE m\nPROC a()\nMoveL p1,v10,fine,t;\n"),
        (Dialect::UrScript, "def a():\n  sleep(1)\n"),
        (Dialect::Inform, "/JOB\n//INST\nNOP\n"),
        (Dialect::Val3, "<Program name=\"a\"><![CDATA[\nbegin\n]]>"),
    ] {
        let cut = dialect::read(dialect, text.as_bytes(), None, &cell);
        assert!(matches!(cut, Err(ParseError::Unended { .. })), "{cut:?}");
    }
}

/// Each move names its tool where a controller has it so: a probe's travel hinders no bead, beads of two tools do not lie where their
/// numbers say.
#[test]
fn moves_with_another_tool_are_told_where_they_lay_metal() {
    let cell = cell(&[100.0, 120.0]);
    let frames = |dialect, text: &str, data| {
        let programs = programs(dialect, text, data, &cell);
        let gaps = executed(&programs, &cell).gaps.into_iter();
        let told = gaps.filter_map(|g| match g.why {
            Missing::Frames(frame, tool) => Some((frame, tool)),
            _ => None,
        });
        (programs, told.collect::<Vec<_>>())
    };
    let probe = MODULE.replacen("v200,z10,tGun", "v200,z10,tProbe", 1);
    let (programs, told) = frames(Dialect::Rapid, &probe, None);
    assert_eq!(told, []);
    let written = dialect::write(&programs[1], &cell).unwrap();
    assert!(written[0].text.contains("tGun\\WObj:=wTable") && !written[0].text.contains("tProbe"));
    let two = MODULE.replacen("wd2,fine,tGun", "wd2,fine,tOther", 1);
    let (_, told) = frames(Dialect::Rapid, &two, None);
    assert_eq!(told, [("wtable".to_owned(), "tother".to_owned())]);

    let probe = PGX.replacen("jHome[0],tGun", "jHome[0],tProbe", 1);
    assert_eq!(frames(Dialect::Val3, &probe, Some(DTX)).1, []);
    let two = PGX.replacen("pWall[3],tGun", "pWall[3],tOther", 1);
    let (programs, told) = frames(Dialect::Val3, &two, Some(DTX));
    assert_eq!(told.len(), 1, "{told:?}");
    assert_eq!(told[0].1, "tother");
    let refused = dialect::write(&programs[0], &cell).unwrap_err();
    assert!(refused.to_string().contains("a second user frame or tool"));
}

/// An arc that stands at a bead's ends lays metal there.
#[test]
fn an_arc_that_stands_is_simulated() {
    let cell = cell(&[100.0]);
    let stands = SEAM_DAT
        .replace("StartTime 0.0", "StartTime 0.5")
        .replace("={Weld {", "={Crater {CraterTime 0.75},Weld {");
    let waits = |data: &str| -> Vec<f64> {
        let programs = programs(Dialect::Krl, SEAM_SRC, Some(data), &cell);
        let all = programs[0].instructions.iter();
        let waits = all.filter_map(|i| match i {
            meltpath_programs::program::Instruction::Wait(seconds) => Some(*seconds),
            _ => None,
        });
        waits.collect()
    };
    assert_eq!(waits(SEAM_DAT), [0.0; 0]);
    assert_eq!(waits(&stands), [0.5, 0.75]);
}
