//! Programs that weave: each controller's words, written, read, and executed as the plan weaves.

use meltpath_base::{Reporter, settings as files};
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::{Instruction, Program};
use meltpath_programs::{
    CellProgramming, Dialect, Missing, Reading, build, dialect, dry_run, read_toolpath,
};
use meltpath_toolpath::{Channel, Event, Layer, Role, Toolpath, Weave, WeaveShape};

use crate::built::{head, toolpath};
use crate::dialects::{asked, held, read, text_of};

const FEED: f64 = 400.0 / 3.0;
const WOVEN: [Dialect; 4] = [
    Dialect::FanucLs,
    Dialect::Krl,
    Dialect::Rapid,
    Dialect::Inform,
];

const ARCTECH: &str = r#"
[it]
source = "test"
job_mode = "Job mode"
weave_amplitude = "across"
"#;
const LISTED: &str = r#"
[[program.weave]]
number = 7
shape = "triangle"
frequency = "2.5 Hz"
amplitude = "3 mm"
[[program.weave]]
number = 3
shape = "sine"
frequency = "2 Hz"
amplitude = "2 mm"
dwell_right = "0.1 s"
"#;

/// A cell whose weave 7 is the zigzag of the plan, and 3 a sine.
fn cell() -> CellProgramming {
    let shipped = meltpath_data::cells::ARCMATE_120IC.text;
    let listed = files::peek::<CellProgramming>(&format!("{shipped}{LISTED}"), &["program"]);
    let mut cell = crate::dialects::cell(&[FEED]);
    cell.krl.value = files::peek(ARCTECH, &["it"]).unwrap();
    cell.weaves = listed.unwrap().unwrap().weaves;
    cell
}

fn zigzag() -> Weave {
    Weave {
        shape: WeaveShape::Triangle,
        frequency: 2.5,
        amplitude: 3.0,
        dwell: [0.0; 2],
    }
}

/// A woven bead whose speed changes, and one that is woven from its second move on; a travel between them.
fn plan(weave: Weave) -> Toolpath {
    let mut layer = Layer::new(1, 0.0);
    layer
        .begin(head(1, Role::Contour), DVec3::ZERO)
        .event(Event::Weave(1))
        .line_to(DVec3::new(50.0, 0.0, 0.0))
        .line_to(DVec3::new(50.0, 30.0, 0.0))
        .set(Channel::Speed, 7.3);
    layer.polyline(
        head(2, Role::Travel),
        [DVec3::new(50.0, 30.0, 9.0), DVec3::new(0.0, 30.0, 9.0)],
    );
    layer
        .begin(head(3, Role::Fill), DVec3::new(0.0, 30.0, 0.0))
        .line_to(DVec3::new(20.0, 30.0, 0.0))
        .event(Event::Weave(1))
        .line_to(DVec3::new(40.0, 30.0, 0.0));
    Toolpath {
        weaves: vec![weave],
        ..toolpath(FEED, vec![layer])
    }
}

fn reading(program: &Program, cell: &CellProgramming) -> Reading {
    let known = cell.execution(10.0);
    let all = std::slice::from_ref(program);
    read_toolpath(all, &known, 1e3, &Reporter::new()).unwrap()
}

/// The weave of each move that lays metal.
fn woven(path: &Toolpath) -> Vec<Option<Weave>> {
    let mut all = Vec::new();
    for pass in path.passes() {
        assert!(pass.head.role.deposits() || pass.events().all(|(_, Event::Weave(n))| n == 0));
        for i in (0..pass.move_count()).filter(|_| pass.head.role.deposits()) {
            let said = pass.events().take_while(|(point, _)| *point <= i).last();
            let number = said.map_or(0, |(_, Event::Weave(n))| n as usize);
            all.push(number.checked_sub(1).map(|n| path.weaves[n]));
        }
    }
    all
}

#[test]
fn golden_weaves() {
    for dialect in WOVEN {
        let (_, text) = text_of(&plan(zigzag()), &cell(), dialect);
        insta::assert_snapshot!(format!("weaving_{dialect:?}"), text);
    }
}

/// What is executed of the text weaves where the plan does, at the frequency of the plan whatever the speed.
#[test]
fn a_written_weave_is_the_one_that_is_executed() {
    let cell = cell();
    for (dialect, weave) in WOVEN.map(|d| (d, zigzag())) {
        let plan = plan(weave);
        let (program, text) = text_of(&plan, &cell, dialect);
        let reading = reading(&program, &cell);
        assert_eq!(reading.gaps, [], "{text}");
        assert_eq!(woven(&reading.toolpath), woven(&plan), "{text}");
        assert_eq!(woven(&plan), [Some(weave), Some(weave), None, Some(weave)]);
    }
    // by its values, by its number, and with dwells: FANUC's own
    for (weave, line) in [
        (
            Weave {
                shape: WeaveShape::Sine,
                frequency: 2.0,
                amplitude: 8.0,
                dwell: [0.075, 0.1],
            },
            "Weave Sine[2.0Hz,8.0mm,0.100s,0.075s]",
        ),
        (
            Weave {
                shape: WeaveShape::Sine,
                frequency: 2.0,
                amplitude: 2.0,
                dwell: [0.0, 0.1],
            },
            "Weave Sine[3]",
        ),
        (
            Weave {
                shape: WeaveShape::Circle,
                ..zigzag()
            },
            "Weave Circle[2.5Hz,3.0mm,0.000s,0.000s]",
        ),
    ] {
        let plan = plan(weave);
        let (program, text) = text_of(&plan, &cell, Dialect::FanucLs);
        assert!(text.contains(line), "{text}");
        assert_eq!(woven(&reading(&program, &cell).toolpath), woven(&plan));
    }
}

/// Whatever the frequency and the speed, the digits of a length tell the frequency again.
#[test]
fn lengths_tell_frequencies_again() {
    let cell = cell();
    for frequency in [0.1, 0.333, 1.7, 3.333, 9.999, 19.5] {
        for dialect in [Dialect::Krl, Dialect::Rapid] {
            let weave = Weave {
                frequency,
                amplitude: 1.234,
                ..zigzag()
            };
            let plan = plan(weave);
            let (program, text) = text_of(&plan, &cell, dialect);
            assert_eq!(
                woven(&reading(&program, &cell).toolpath),
                woven(&plan),
                "{text}"
            );
        }
    }
}

#[test]
fn a_weave_without_words_is_refused_by_name() {
    let told = |weave: Weave, dialect, cell: &CellProgramming| {
        let error = build(&plan(weave), cell, &asked(dialect), &Reporter::new());
        error.unwrap_err().to_string()
    };
    let sine = Weave {
        shape: WeaveShape::Sine,
        ..zigzag()
    };
    let dwells = Weave {
        dwell: [0.1, 0.0],
        ..zigzag()
    };
    let odd = Weave {
        frequency: 2.25,
        ..sine
    };
    let plain = crate::dialects::cell(&[FEED]);
    for (weave, dialect, cell, wanted) in [
        (sine, Dialect::Krl, &cell(), "shape = \"triangle\""),
        (sine, Dialect::Rapid, &cell(), "shape = \"triangle\""),
        (dwells, Dialect::Rapid, &cell(), "without dwell_left"),
        (
            zigzag(),
            Dialect::Krl,
            &plain,
            "program.krl.weave_amplitude",
        ),
        (sine, Dialect::Inform, &cell(), "[[program.weave]]"),
        (zigzag(), Dialect::FanucLs, &plain, "[[program.weave]]"),
        (odd, Dialect::FanucLs, &plain, "steps of 0.1 Hz"),
        (sine, Dialect::UrScript, &cell(), "waam.bead.weave"),
        (sine, Dialect::Val3, &cell(), "waam.bead.weave"),
    ] {
        let told = told(weave, dialect, cell);
        assert!(
            told.contains(wanted) && told.contains(dialect.name()),
            "{told}"
        );
        assert!(told.contains("layer 1"), "{told}");
    }
    let mut none = plan(zigzag());
    none.weaves.clear();
    let error = build(&none, &cell(), &asked(Dialect::Rapid), &Reporter::new()).unwrap_err();
    assert!(
        error.to_string().contains("not among the weaves"),
        "{error}"
    );
}

#[test]
fn a_dry_run_does_not_weave() {
    for dialect in WOVEN {
        let mut built = build(&plan(zigzag()), &cell(), &asked(dialect), &Reporter::new()).unwrap();
        dry_run(&mut built.programs);
        let built = held(built, dialect);
        let texts = dialect::write(&built.programs[0], &cell()).unwrap();
        for file in texts {
            let woven = ["Weave", "WVON", "WVOF", "weavedata"];
            assert!(
                !woven.iter().any(|w| file.text.contains(w)),
                "{}",
                file.text
            );
        }
        let of = |i: &Instruction| matches!(i, Instruction::Weave(_));
        assert!(!built.programs[0].instructions.iter().any(of));
    }
}

/// Weaves of other programs that are not known stay told: another pattern, dwells along the path, a condition file that nobody lists.
#[test]
fn unknown_weaves_are_told() {
    let cell = cell();
    for (dialect, known, other) in [
        (Dialect::Krl, "Pattern #Triangle", "Pattern #Spiral"),
        (Dialect::Krl, "LeftSideDelay 0.0", "LeftSideDelay 0.2"),
        (Dialect::Rapid, ":=[1,0,", ":=[2,0,"),
        (Dialect::Rapid, ":=[1,0,", ":=[1,2,"),
        (Dialect::Rapid, ",6,0,0,0,", ",6,0,1,0,"),
        (Dialect::Inform, "WEV#(7)", "WEV#(8)"),
        (Dialect::Inform, "WEV#(7)", "AMP=3 FREQ=2"),
    ] {
        let built = build(&plan(zigzag()), &cell, &asked(dialect), &Reporter::new()).unwrap();
        let mut written = dialect::write(&held(built, dialect).programs[0], &cell).unwrap();
        assert!(
            written.iter().any(|f| f.text.contains(known)),
            "{written:?}"
        );
        for file in &mut written {
            file.text = file.text.replace(known, other);
        }
        let program = read(dialect, &written, &cell).program;
        let gaps = reading(&program, &cell).gaps;
        assert!(!gaps.is_empty(), "{other}");
        let weaves = |why: &Missing| matches!(why, Missing::Weave | Missing::Unknown(_));
        assert!(gaps.iter().all(|g| weaves(&g.why)), "{gaps:?}");
    }
    // what the amplitude of ArcTech is, nobody says
    let mut silent = cell.clone();
    silent.krl.value.as_mut().unwrap().weave_amplitude.value = None;
    let built = build(
        &plan(zigzag()),
        &cell,
        &asked(Dialect::Krl),
        &Reporter::new(),
    )
    .unwrap();
    let written = dialect::write(&held(built, Dialect::Krl).programs[0], &cell).unwrap();
    let program = read(Dialect::Krl, &written, &silent).program;
    assert!(!reading(&program, &silent).gaps.is_empty());
}
