//! Programs for other controllers than FANUC's: golden texts, what is written is read, the arc by the text alone.

use std::fmt::Write as _;

use meltpath_base::{Reporter, settings as files};
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::{Coordinates, Instruction, Program, Speed};
use meltpath_programs::{
    BuildError, BuildSettings, Built, CellProgramming, Dialect, Parsed, Pause, TextFile,
    WriteError, build, dialect, read_toolpath,
};
use meltpath_toolpath::{Layer, Role, Toolpath};
use proptest::prelude::*;

use crate::built::{arcmate, head, random_toolpath, settings, toolpath, two_layers};
use crate::told::{Told, motions};

pub(crate) const OTHERS: [Dialect; 5] = [
    Dialect::Krl,
    Dialect::Rapid,
    Dialect::UrScript,
    Dialect::Inform,
    Dialect::Val3,
];

/// A cell that has words for every dialect, and schedules for these wire feeds, mm/s.
pub(crate) fn cell(feeds: &[f64]) -> CellProgramming {
    let text = meltpath_data::cells::ARCMATE_120IC.text;
    let mut text = text.replace(
        "name_length = 32",
        "name_length = 32\nblend = \"4 mm\"\narc_values = [\"schedule\", \"wire feed, m/min\", \"other\"]",
    );
    text += r#"
[program.krl]
source = "test"
job_mode = "Job mode"
preflow = "0.2 s"
[program.rapid]
source = "test"
tool = "tTorch"
work_object = "wPart"
seam = "sm1"
[program.script]
source = "test"
part = "Part"
arc_start = ["set_job({1})", "set_analog_out(0, {2})", "set_digital_out(0, True)"]
arc_end = ["set_digital_out(0, False)"]
[program.inform]
source = "test"
zones = ["0.5 mm", "1 mm", "2 mm", "4 mm"]
[program.val3]
source = "test"
part_position = ["500 mm", "0 mm", "100 mm"]
tool_position = ["0 mm", "0 mm", "330 mm"]
tool_angles = ["0 deg", "35 deg", "0 deg"]
output = [{ name = "doArc", link = "BasicIO-1\\%Q0" }, { name = "aoWire", kind = "aio", link = "A1" }, { name = "nJob", kind = "num" }]
arc_start = ["nJob={1}", "aioSet(aoWire,{2})", "doArc=true"]
arc_end = ["doArc=false"]
"#;
    for (n, feed) in (1..).zip(feeds) {
        let metres = feed * 0.06;
        write!(
            text,
            "[[program.schedule]]\nnumber = {n}\nwire_feed = \"{metres} m/min\"\nvalues = [{n}, {metres}, 0]\n"
        )
        .unwrap();
    }
    files::peek(&text, &["program"]).unwrap().unwrap()
}

pub(crate) fn asked(dialect: Dialect) -> BuildSettings {
    BuildSettings {
        dialect,
        ..settings(Pause::Wait(30.0))
    }
}

/// Built, with joints said where a dialect begins with them.
fn built(
    toolpath: &Toolpath,
    cell: &CellProgramming,
    dialect: Dialect,
) -> Result<Built, BuildError> {
    let built = build(toolpath, cell, &asked(dialect), &Reporter::new())?;
    Ok(held(built, dialect))
}

/// Says of every position how an arm stands.
pub(crate) fn held(mut built: Built, dialect: Dialect) -> Built {
    let said = match dialect {
        Dialect::UrScript => "0,-90.5,90,-90,-90,12.25",
        Dialect::Krl => "S 2, T 35",
        Dialect::Rapid => "0,-1,0,1",
        Dialect::Inform => "1,0,0,0,0,0",
        Dialect::Val3 => "lefty,epositive,wpositive",
        Dialect::FanucLs => return built,
    };
    for position in built.programs.iter_mut().flat_map(|p| &mut p.positions) {
        if let Coordinates::Cartesian { config, .. } = &mut position.groups[0].coordinates {
            said.clone_into(config);
        }
    }
    built
}

pub(crate) fn written(
    built: &Built,
    cell: &CellProgramming,
) -> Result<Vec<Vec<TextFile>>, WriteError> {
    built
        .programs
        .iter()
        .map(|p| dialect::write(p, cell))
        .collect()
}

/// The one program of its files.
pub(crate) fn read(dialect: Dialect, files: &[TextFile], cell: &CellProgramming) -> Parsed {
    let bytes = |i: usize| files.get(i).map(|f| f.text.as_bytes());
    let mut all = dialect::read(dialect, bytes(0).unwrap(), bytes(1), cell).unwrap();
    assert_eq!(all.len(), 1);
    all.remove(0)
}

/// The program of a plan and its text, written, read and written again.
pub(crate) fn text_of(
    plan: &Toolpath,
    cell: &CellProgramming,
    dialect: Dialect,
) -> (Program, String) {
    let built = built(plan, cell, dialect).unwrap();
    let written = dialect::write(&built.programs[0], cell).unwrap();
    let parsed = read(dialect, &written, cell);
    assert_eq!(dialect::write(&parsed.program, cell).unwrap(), written);
    (parsed.program, told(&written))
}

pub(crate) fn told(files: &[TextFile]) -> String {
    let texts = files
        .iter()
        .map(|f| format!("==> {} <==\n{}", f.name, f.text));
    texts.collect()
}

/// The points of the bead of a program as it is executed, mm, with the external axes there, mm or rad.
pub(crate) fn laid(program: &Program, cell: &CellProgramming) -> Vec<(DVec3, Vec<f64>)> {
    let known = cell.execution(10.0);
    let reading = read_toolpath(std::slice::from_ref(program), &known, 1e3, &Reporter::new());
    let reading = reading.unwrap();
    assert_eq!(reading.gaps, []);
    let mut passes = reading.toolpath.passes().filter(|p| p.head.role.deposits());
    let bead = passes.next().unwrap();
    let axes = |i: usize| bead.external(i).flatten().collect();
    (0..bead.points.len())
        .map(|i| (bead.points[i], axes(i)))
        .collect()
}

fn small() -> Toolpath {
    toolpath(400.0 / 3.0, two_layers().into())
}

fn golden(dialect: Dialect) -> String {
    let cell = cell(&[400.0 / 3.0, 100.0]);
    let built = built(&small(), &cell, dialect).unwrap();
    told(&written(&built, &cell).unwrap().concat())
}

#[test]
fn programs_are_those_of_the_files() {
    for (name, dialect) in [
        ("golden_krl", Dialect::Krl),
        ("golden_rapid", Dialect::Rapid),
        ("golden_ur_script", Dialect::UrScript),
        ("golden_inform", Dialect::Inform),
        ("golden_val3", Dialect::Val3),
    ] {
        insta::assert_snapshot!(name, golden(dialect));
    }
}

pub(crate) fn executed(programs: &[Program], cell: &CellProgramming) -> Vec<Told> {
    let reading = read_toolpath(programs, &cell.execution(10.0), 1000.0, &Reporter::new()).unwrap();
    assert_eq!(reading.gaps, []);
    motions(&reading)
}

/// The arc during each move, by the lines of the text alone.
pub(crate) fn arc_by_text(dialect: Dialect, text: &str) -> (Vec<bool>, bool) {
    let (mut on, mut queued, mut during) = (false, false, Vec::new());
    for line in text.lines().map(str::trim) {
        let word = line.split([' ', '(']).next().unwrap_or_default();
        match dialect {
            Dialect::Krl => {
                if ["PTP", "LIN", "CIRC"].contains(&word) {
                    during.push(on);
                }
                on |= line.starts_with("ArcMainNG(#ArcOnAfter");
                on &= !line.starts_with("ArcMainNG(#ArcOffAfter");
            }
            Dialect::Rapid => {
                let moves = ["MoveJ", "MoveL", "MoveC", "ArcLStart", "ArcCStart"].contains(&word);
                let lays = ["ArcL", "ArcC", "ArcLEnd", "ArcCEnd"].contains(&word);
                assert_eq!(on, lays || (on && !moves), "{line}");
                if moves || lays {
                    during.push(lays);
                }
                on = (on || word.ends_with("Start")) && !word.ends_with("End");
            }
            Dialect::UrScript => {
                if ["movej", "movel", "movec"].contains(&word) {
                    during.push(on);
                }
                on |= line == "set_digital_out(0, True)";
                on &= line != "set_digital_out(0, False)";
            }
            Dialect::Inform => {
                // those that say how they end are moves of the plan, the others begin circles
                if line.starts_with("MOV") && line.contains(" PL=") {
                    during.push(on);
                }
                on |= line.starts_with("ARCON") || line.starts_with("ARCSET");
                on &= line != "ARCOF";
            }
            Dialect::Val3 => {
                if ["movej", "movel", "movec"].contains(&word) {
                    during.push(on);
                    queued = true;
                }
                queued &= line != "waitEndMove()";
                assert!(!(queued && line.starts_with("doArc")), "{line}");
                on |= line == "doArc=true";
                on &= line != "doArc=false";
            }
            Dialect::FanucLs => {}
        }
    }
    (during, on)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_is_read(toolpath in random_toolpath(1..8)) {
        let cell = cell(&[100.0, 101.0, 102.0]);
        for dialect in OTHERS {
            let built = built(&toolpath, &cell, dialect).unwrap();
            let files = written(&built, &cell).unwrap();
            let parsed: Vec<Program> = files.iter().map(|f| read(dialect, f, &cell).program).collect();
            for (program, files) in parsed.iter().zip(&files) {
                prop_assert_eq!(&dialect::write(program, &cell).unwrap(), files);
            }
            let (wanted, found) = (executed(&built.programs, &cell), executed(&parsed, &cell));
            prop_assert_eq!(found.len(), wanted.len());
            for (a, b) in found.iter().zip(&wanted) {
                prop_assert!(a.to.distance(b.to) <= 1e-3 && a.axis.angle_between(b.axis) < 1e-3_f64.to_radians());
                prop_assert!((a.speed.unwrap() - b.speed.unwrap()).abs() < 2e-3, "{a:?} {b:?}");
                prop_assert!((a.wire_feed.unwrap_or(0.0) - b.wire_feed.unwrap_or(0.0)).abs() < 1e-6);
                prop_assert_eq!((a.burns, a.layer, a.bead), (b.burns, b.layer, b.bead));
                prop_assert!((a.control.smoothing.unwrap_or(-1.0) - b.control.smoothing.unwrap_or(-1.0)).abs() < 1e-6);
            }
            // by the text alone
            let parts = &files[usize::from(files.len() > 1)..];
            let text: String = parts.iter().map(|f| f[0].text.as_str()).collect();
            let (during, left_on) = arc_by_text(dialect, &text);
            prop_assert!(!left_on);
            prop_assert!(during.first() != Some(&true));
            prop_assert_eq!(during.get(1..).unwrap_or_default(), found.iter().map(|m| m.burns).collect::<Vec<_>>());
        }
    }
}

#[test]
fn sub_programs_are_called_and_a_bead_is_never_cut() {
    let mut cell = cell(&[400.0 / 3.0]);
    cell.lines_per_program.value = 50;
    cell.points_per_program.value = 20;
    let layers = (0..5).map(|i| {
        let mut layer = Layer::new(i + 1, 0.0);
        let points = (0..8).map(|k| DVec3::new(f64::from(k) * 10.0, 0.0, f64::from(i) * 1.6));
        layer.polyline(head(i, Role::Contour), points);
        layer
    });
    let short = toolpath(400.0 / 3.0, layers.collect());
    let mut long = Layer::new(1, 0.0);
    long.polyline(
        head(1, Role::Contour),
        (0..80).map(|k| DVec3::new(f64::from(k), 0.0, 0.0)),
    );
    let long = toolpath(400.0 / 3.0, vec![long]);
    for dialect in [Dialect::Krl, Dialect::Rapid, Dialect::Inform] {
        let built_short = built(&short, &cell, dialect).unwrap();
        assert!(built_short.programs.len() > 2);
        let files = written(&built_short, &cell).unwrap();
        let parsed: Vec<Program> = files
            .iter()
            .map(|f| read(dialect, f, &cell).program)
            .collect();
        let beads = executed(&parsed, &cell).iter().filter(|m| m.burns).count();
        assert_eq!(beads, 5 * 7);
        let refused = written(&built(&long, &cell, dialect).unwrap(), &cell).unwrap_err();
        assert!(
            refused.to_string().contains("goes on in another program"),
            "{refused}"
        );
    }
    // a script is one file, whatever its length, and a project has one of data
    for dialect in [Dialect::UrScript, Dialect::Val3] {
        assert_eq!(built(&long, &cell, dialect).unwrap().programs.len(), 1);
    }
}

#[test]
fn what_a_cell_does_not_say_is_asked_for() {
    let told =
        |cell: &CellProgramming, dialect| built(&small(), cell, dialect).unwrap_err().to_string();
    for (dialect, key) in [
        (Dialect::Krl, "krl"),
        (Dialect::Rapid, "rapid"),
        (Dialect::UrScript, "script"),
        (Dialect::Inform, "inform"),
        (Dialect::Val3, "val3"),
    ] {
        let found = told(&arcmate(), dialect);
        assert!(found.contains(&format!("write program.{key}")), "{found}");
        let mut silent = cell(&[100.0]);
        silent.blend.value = None;
        assert!(told(&silent, dialect).contains("write program.blend"));
        let found = told(&cell(&[100.0]), dialect);
        assert!(
            found.contains("8.00 m/min of pass 1") && found.contains("lists 6.00 m/min"),
            "{found}"
        );
        let mut other = cell(&[400.0 / 3.0, 100.0]);
        other.schedules.value[1].values.value[1] = 7.0;
        assert!(
            told(&other, dialect).contains("weld schedule 2"),
            "{}",
            told(&other, dialect)
        );
    }
}

#[test]
fn what_a_dialect_has_no_words_for_is_told() {
    let cell = cell(&[400.0 / 3.0, 100.0]);
    let mut program = built(&small(), &cell, Dialect::Krl)
        .unwrap()
        .programs
        .remove(0);
    let bead = program
        .instructions
        .iter()
        .position(|i| matches!(i, Instruction::Motion(m) if m.arc.is_some()));
    program
        .instructions
        .insert(bead.unwrap() + 1, Instruction::Wait(0.5));
    for dialect in [Dialect::Krl, Dialect::Rapid] {
        program.dialect = dialect;
        for instruction in &mut program.instructions {
            if let Instruction::Motion(m) = instruction
                && m.kind == meltpath_programs::program::MotionKind::Joint
            {
                m.speed = match dialect {
                    Dialect::Krl => m.speed.clone(),
                    _ => Speed::Maximum,
                };
            }
        }
        let told = dialect::write(&program, &cell).unwrap_err().to_string();
        assert!(told.contains("a wait with the arc on"), "{told}");
    }
    // no robot was named
    for dialect in [Dialect::UrScript, Dialect::Inform] {
        let plain = build(&small(), &cell, &asked(dialect), &Reporter::new()).unwrap();
        let told = dialect::write(&plain.programs[0], &cell).unwrap_err();
        assert!(told.to_string().contains("machine.robot"), "{told}");
    }
}
