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
