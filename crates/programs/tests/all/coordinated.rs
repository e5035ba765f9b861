//! Programs that turn the part together with the arm: written, read, executed in the frame of the part.

use meltpath_base::{Reporter, settings as files};
use meltpath_geometry::math::DVec3;
use meltpath_programs::positioner::{Positioner, UserFrame};
use meltpath_programs::program::{Axis, Coordinates, Instruction, Program};
use meltpath_programs::{CellProgramming, Dialect, Missing, build, dialect, read_toolpath};
use meltpath_toolpath::{Layer, Move, Role, Toolpath};
use proptest::prelude::*;

use crate::built::{head, toolpath};
use crate::dialects::{asked, laid, text_of};

const FEED: f64 = 400.0 / 3.0;
const SPOKEN: [Dialect; 3] = [Dialect::FanucLs, Dialect::Krl, Dialect::Rapid];

/// A table that tilts about x and turns about z, 200 mm under the part's origin at rest.
fn cell(user_frame: UserFrame) -> CellProgramming {
    let text = r#"
[it]
source = "test"
unit = "STN1"
axis = [
    { origin = ["0 mm", "0 mm", "-200 mm"], direction = [1, 0, 0], pulses_per_degree = 1019.7 },
    { origin = ["0 mm", "0 mm", "0 mm"], direction = [0, 0, 2], pulses_per_degree = -1333.3 },
]
"#;
    let mut positioner: Positioner = files::peek(text, &["it"]).unwrap().unwrap();
    positioner.user_frame.value = Some(user_frame);
    let mut cell = crate::dialects::cell(&[FEED]);
    cell.positioner.value = Some(positioner);
    cell
}

/// A bead round a corner and along an arc; the part is tilted, then turned.
fn plan() -> Toolpath {
    let mut layer = Layer::new(1, 0.0);
    let mut pass = layer.begin(head(1, Role::Contour), DVec3::new(0.0, 0.0, 0.0));
    let tilt = 90.0_f64.to_radians();
    pass.external(0, tilt).external(1, 0.0);
    pass.line_to(DVec3::new(50.0, 0.0, 0.0));
    pass.external(0, tilt).external(1, 0.25);
    let via = DVec3::new(57.071_067, 2.928_933, 0.0);
    pass.go(Move::Arc { via }, DVec3::new(60.0, 10.0, 0.0));
    pass.external(0, tilt).external(1, 0.5);
    toolpath(FEED, vec![layer])
}

#[test]
fn golden_coordinated_programs() {
    for dialect in SPOKEN {
        let (_, text) = text_of(&plan(), &cell(UserFrame::Part), dialect);
        insta::assert_snapshot!(format!("coordinated_{dialect:?}"), text);
    }
    let (_, text) = text_of(&plan(), &cell(UserFrame::Base), Dialect::Inform);
    insta::assert_snapshot!("coordinated_Inform", text);
}

#[test]
fn a_table_that_turns_in_the_user_frame_turns_the_positions() {
    let cell = cell(UserFrame::Base);
    let (program, _) = text_of(&plan(), &cell, Dialect::FanucLs);
    // the origin of the part, 200 mm over the axis that tilts, goes to the side at 90 deg
    let strike = program.instructions.iter().find_map(|i| match i {
        Instruction::Motion(m) if m.arc.is_some() => Some(m.target.clone()),
        _ => None,
    });
    let strike = strike.unwrap();
    let position = program
        .positions
        .iter()
        .find(|p| strike == meltpath_programs::program::PositionRef::point(p.index));
    let groups = &position.unwrap().groups;
    let Coordinates::Cartesian { xyz, .. } = &groups[0].coordinates else {
        panic!("{groups:?}")
    };
    assert_eq!(*xyz, [0.0, -200.0, -200.0]);
    let Coordinates::Joint(axes) = &groups[1].coordinates else {
        panic!("{groups:?}")
    };
    let axes: Vec<(&str, f64)> = axes.iter().map(|a| (a.name.as_str(), a.value)).collect();
    assert_eq!(axes, [("J1", 90.0), ("J2", 0.0)]);
    assert_eq!(program.attribute("DEFAULT_GROUP"), Some("1,1,*,*,*"));
}

#[test]
fn what_a_coordinated_program_needs_is_asked_for() {
    let told = |cell: &CellProgramming, dialect| {
        let error = build(&plan(), cell, &asked(dialect), &Reporter::new());
        error.unwrap_err().to_string()
    };
    let still = crate::dialects::cell(&[FEED]);
    for dialect in SPOKEN {
        assert!(told(&still, dialect).contains("write program.positioner"));
    }
    for dialect in [Dialect::UrScript, Dialect::Val3] {
        let told = told(&cell(UserFrame::Part), dialect);
        assert!(told.contains("are not written"), "{told}");
    }
    let without = |change: fn(&mut Positioner)| {
        let mut cell = cell(UserFrame::Base);
        change(cell.positioner.value.as_mut().unwrap());
        cell
    };
    let cell = without(|p| p.user_frame.value = None);
    assert!(told(&cell, Dialect::FanucLs).contains("program.positioner.user_frame"));
    let cell = without(|p| p.axes.value[1].direction.value = Some([0.0; 3]));
    assert!(told(&cell, Dialect::FanucLs).contains("program.positioner.axis"));
    assert!(told(&cell, Dialect::Inform).contains("program.positioner.axis"));
    let cell = without(|p| p.user_frame.value = Some(UserFrame::Part));
    let stands = told(&cell, Dialect::Inform);
    assert!(
        stands.contains("program.positioner.user_frame = \"base\""),
        "{stands}"
    );
    for pulses in [None, Some(0.0)] {
        let mut cell = self::cell(UserFrame::Base);
        let positioner = cell.positioner.value.as_mut().unwrap();
        positioner.axes.value[1].pulses_per_degree.value = pulses;
        let needed = "program.positioner.axis.pulses_per_degree";
        assert!(told(&cell, Dialect::Inform).contains(needed));
    }
    let cell = without(|p| p.unit.value = None);
    assert!(told(&cell, Dialect::Rapid).contains("program.positioner.unit"));
    let cell = without(|p| p.axes.value.truncate(1));
    assert!(
        told(&cell, Dialect::Krl)
            .contains("is 2, but must be that of the cell's track and positioner")
    );
}

#[test]
fn a_bead_whose_table_is_not_known_is_told() {
    let gaps = |program: &Program, cell: &CellProgramming| {
        let known = cell.execution(10.0);
        let all = std::slice::from_ref(program);
        let reading = read_toolpath(all, &known, 1e3, &Reporter::new()).unwrap();
        let mut why: Vec<Missing> = reading.gaps.into_iter().map(|g| g.why).collect();
        why.dedup();
        why
    };
    let known = cell(UserFrame::Part);
    let still = crate::dialects::cell(&[FEED]);
    let (mut fanuc, _) = text_of(&plan(), &known, Dialect::FanucLs);
    assert!(gaps(&fanuc, &still).contains(&Missing::Coordinated));
    for instruction in &mut fanuc.instructions {
        if let Instruction::Motion(m) = instruction {
            m.extra.clear();
        }
    }
    assert_eq!(gaps(&fanuc, &known), [Missing::Coordinated]);
    let (mut kuka, _) = text_of(&plan(), &known, Dialect::Krl);
    assert_eq!(gaps(&kuka, &known), []);
    // a base that turns and one that lies still in one program
    let text = |second: &str| {
        format!(
            "DEF P( )\n$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,BASE_DATA[1])\n{second}\nEND\n"
        )
    };
    for (second, kept) in [
        (
            "$BASE=EK(MACHINE_DEF[2].ROOT, MACHINE_DEF[2].MECH_TYPE, BASE_DATA[3])",
            0,
        ),
        (
            "$BASE=EK(MACHINE_DEF[3].ROOT,MACHINE_DEF[3].MECH_TYPE,BASE_DATA[1])",
            1,
        ),
        (
            "$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[3].MECH_TYPE,BASE_DATA[1])",
            1,
        ),
        ("$BASE=BASE_DATA[1]", 1),
    ] {
        let read = dialect::read(Dialect::Krl, text(second).as_bytes(), None, &known).unwrap();
        assert_eq!(read[0].unread.len(), kept, "{second}");
    }
    // the part hangs on another machine than the cell tells
    for attribute in &mut kuka.attributes {
        attribute.value = "3".to_owned();
    }
    assert_eq!(gaps(&kuka, &known), [Missing::ExternalAxes]);
    // the base lies still
    kuka.attributes.clear();
    assert_eq!(gaps(&kuka, &known), [Missing::ExternalAxes]);
    let (abb, _) = text_of(&plan(), &known, Dialect::Rapid);
    assert_eq!(gaps(&abb, &still), [Missing::ExternalAxes]);
}

/// A job as others write it: of a robot on a base axis with a table of one axis, some places in pulses.
fn job(moves: &str) -> String {
    format!(
        "/JOB\n//NAME SEAM\n//POS\n///NPOS 4,4,4,0,0,0\n///USER 1\n///TOOL 1\n///POSTYPE USER\n///RECTAN\n///RCONF 1,0,0,0,0,0,0,0\n\
         C00000=0.000,0.000,0.000,180.0000,0.0000,0.0000\n\
         C00001=50.000,0.000,0.000,180.0000,0.0000,0.0000\n\
         C00002=0.000,50.000,0.000,180.0000,0.0000,0.0000\n\
         C00003=0.000,50.000,20.000,180.0000,0.0000,0.0000\n\
         BC00000=100.000,0.000,0.000\n\
         ///POSTYPE PULSE\n///PULSE\n\
         BC00001=20000\nBC00002=20000\nBC00003=30000\n\
         EC00000=0,0\nEC00001=0,0\nEC00002=90000,0\nEC00003=90000,0\n\
         //INST\n///DATE 2020/01/01 00:00\n///ATTR SC,RW,RJ\n////FRAME USER 1\n///GROUP1 RB1,BS1\n///GROUP2 ST1\nNOP\n{moves}END\n"
    )
}

/// A base axis of 100 pulses a mm, and a table about the user frame's z of 1000 pulses a degree.
fn known() -> CellProgramming {
    let text = r#"
[on]
source = "test"
user_frame = "stands"
pulses_per_millimetre = 100
[under]
source = "test"
user_frame = "base"
axis = [{ origin = ["0 mm", "0 mm", "0 mm"], direction = [0, 0, 1], pulses_per_degree = 1000 }]
"#;
    let mut cell = crate::dialects::cell(&[FEED]);
    cell.track.value = files::peek(text, &["on"]).unwrap();
    cell.positioner.value = files::peek(text, &["under"]).unwrap();
    cell
}

#[test]
fn jobs_of_others_move_base_and_station() {
    let moves = "MOVJ C00000 BC00000 VJ=20.00  +MOVJ EC00000 VJ=50.00\n\
                 MOVL C00001 BC00001 V=50.0 PL=0 +MOVJ EC00001 VJ=10.00\n\
                 ARCON ASF#(1)\n\
                 SMOVL C00002 BC00002 V=8.0 PL=0 +MOVJ EC00002\n\
                 ARCOF\n\
                 MOVL C00003 BC00003 V=50.0 PL=0 +MOVJ EC00003 VJ=10.00\n";
    let cell = known();
    let read = |cell: &CellProgramming, text: &str| {
        dialect::read(Dialect::Inform, text.as_bytes(), None, cell)
            .unwrap()
            .remove(0)
    };
    let parsed = read(&cell, &job(moves));
    assert_eq!(parsed.unread, []);
    // what turned by 90 deg about the origin lies where it was: the bead is a point in the part that turns under the torch
    let laid = laid(&parsed.program, &cell);
    assert_eq!(laid.len(), 2);
    for (place, axes) in &laid {
        assert!(place.distance(DVec3::new(50.0, 0.0, 0.0)) < 1e-9, "{place}");
        assert!((axes[0] - 200.0).abs() < 1e-9, "{axes:?}");
    }
    assert!((laid[1].1[1].to_degrees() - 90.0).abs() < 1e-9);
    // written again, it is read as the same
    let again = dialect::write(&parsed.program, &cell).unwrap();
    assert!(
        again[0]
            .text
            .contains("MOVJ C00000 BC00000 VJ=20.00 +MOVJ EC00000 VJ=50.00\n")
    );
    let twice = read(&cell, &again[0].text).program;
    assert_eq!(twice.positions, parsed.program.positions);
    assert_eq!(twice.instructions, parsed.program.instructions);
    // degrees instead of pulses
    let degrees = job(moves).replace(
        "EC00000=0,0\nEC00001=0,0\nEC00002=90000,0\nEC00003=90000,0",
        "///POSTYPE ANGLE\n///ANGLE\nEC00000=0,0\nEC00001=0,0\nEC00002=90.0,0\nEC00003=90.0,0",
    );
    assert_eq!(
        read(&cell, &degrees).program.positions,
        parsed.program.positions
    );
    // without pulses nobody knows where it stands: kept and told, each move
    let silent = read(&crate::dialects::cell(&[FEED]), &job(moves));
    let kept: Vec<&str> = silent.unread.iter().map(|u| u.text.as_str()).collect();
    assert!(
        kept.contains(&"BC00001=20000") && kept.contains(&"EC00002=90000,0"),
        "{kept:?}"
    );
    assert_eq!(kept.iter().filter(|l| l.contains("+MOVJ")).count(), 4);
    // a second axis that the cell does not tell of, a robot as master, an S move that leads nothing
    for (from, to, told) in [
        ("EC00002=90000,0", "EC00002=90000,5", "EC00002=90000,5"),
        (
            "+MOVJ EC00002",
            "+MOVL C00002 V=8.0",
            "SMOVL C00002 BC00002 V=8.0 PL=0 +MOVL C00002 V=8.0",
        ),
        (" +MOVJ EC00002", "", "SMOVL C00002 BC00002 V=8.0 PL=0"),
    ] {
        let parsed = read(&cell, &job(moves).replace(from, to));
        assert!(
            parsed.unread.iter().any(|u| u.text == told),
            "{:?}",
            parsed.unread
        );
    }
}

/// A taught job has its arm in pulses, too.
#[test]
fn an_arm_in_pulses_stands_where_its_joints_do() {
    let mut cell = known();
    let scales = [1341.38, 1907.68, -1592.89, 1022.87, 980.24, 454.76];
    let pulses = [13_414, -19_077, 31_858, 0, 29_407, -4548];
    let line = pulses.map(|p: i32| p.to_string()).join(",");
    let text = format!(
        "/JOB\n//NAME T\n//POS\n///NPOS 1,1,1,0,0,0\n///TOOL 0\n///POSTYPE PULSE\n///PULSE\nC00000={line}\nBC00000=-5000\nEC00000=45000,0\n\
         //INST\n///DATE 2020/01/01 00:00\n///ATTR SC,RW\n///GROUP1 RB1,BS1\n///GROUP2 ST1\nNOP\nMOVJ C00000 BC00000 VJ=5.00 +MOVJ EC00000 VJ=5.00\nEND\n"
    );
    let read = |cell: &CellProgramming| {
        let read = dialect::read(Dialect::Inform, text.as_bytes(), None, cell);
        read.unwrap().remove(0)
    };
    let unit = |program: &Program| match &program.positions[0].groups[0].coordinates {
        Coordinates::Joint(axes) => axes.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(unit(&read(&cell).program)[0].unit, "pulse");
    let words = cell.inform.value.as_mut().unwrap();
    words.pulses_per_degree.value = Some(scales);
    let parsed = read(&cell);
    assert_eq!(parsed.unread, []);
    let axes = unit(&parsed.program);
    let (shown, beyond) = Axis::of_arm(&axes).unwrap();
    for ((shown, pulses), scale) in shown.iter().zip(pulses).zip(scales) {
        assert!((shown * scale - f64::from(pulses)).abs() < 1e-6, "{shown}");
    }
    assert_eq!((beyond.len(), beyond[0].value), (1, -50.0));
    let known = cell.execution(10.0);
    let external = known.external_axes(&parsed.program, &parsed.program.positions[0]);
    assert_eq!(external, [-50.0, 45.0_f64.to_radians()]);
    let again = dialect::write(&parsed.program, &cell).unwrap();
    assert!(
        again[0].text.contains(&format!("C00000={line}\n")),
        "{}",
        again[0].text
    );
}

#[test]
fn a_station_that_turns_along_a_bead_by_itself_is_told() {
    let moves = "MOVJ C00000 BC00000 VJ=20.00 +MOVJ EC00000\n\
                 MOVL C00001 BC00001 V=50.0 PL=0 +MOVJ EC00001 VJ=10.00\n\
                 ARCON ASF#(1)\n\
                 MOVL C00002 BC00002 V=8.0 PL=0 +MOVJ EC00002 VJ=10.00\n\
                 ARCOF\n";
    let cell = known();
    let parsed = dialect::read(Dialect::Inform, job(moves).as_bytes(), None, &cell).unwrap();
    let programs: Vec<Program> = parsed.into_iter().map(|p| p.program).collect();
    let known = cell.execution(10.0);
    let reading = read_toolpath(&programs, &known, 1e3, &Reporter::new()).unwrap();
    let why: Vec<Missing> = reading.gaps.into_iter().map(|g| g.why).collect();
    assert_eq!(why, [Missing::Coordinated]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn coordinated_programs_lay_the_part(
        points in proptest::collection::vec((prop::array::uniform3(-200.0..200.0_f64), -3.0..3.0_f64, -6.0..6.0_f64), 2..12)
    ) {
        let mut layer = Layer::new(1, 0.0);
        let at = |p: [f64; 3]| (DVec3::from_array(p) * 1e3).round() / 1e3;
        let mut pass = layer.begin(head(1, Role::Fill), at(points[0].0));
        for (i, (point, tilt, turn)) in points.iter().enumerate() {
            if i > 0 {
                pass.line_to(at(*point));
            }
            pass.external(0, *tilt).external(1, *turn);
        }
        let plan = toolpath(FEED, vec![layer]);
        for (dialect, frame) in [
            (Dialect::FanucLs, UserFrame::Part),
            (Dialect::FanucLs, UserFrame::Base),
            (Dialect::Krl, UserFrame::Part),
            (Dialect::Rapid, UserFrame::Base),
            (Dialect::Inform, UserFrame::Base),
        ] {
            let cell = cell(frame);
            let (program, _) = text_of(&plan, &cell, dialect);
            let laid = laid(&program, &cell);
            prop_assert_eq!(laid.len(), points.len());
            for ((place, axes), (point, tilt, turn)) in laid.iter().zip(&points) {
                prop_assert!(place.distance(at(*point)) <= 1e-3, "{place} {point:?}");
                let step = 1e-3_f64.to_radians();
                prop_assert!((axes[0] - tilt).abs() < step && (axes[1] - turn).abs() < step);
            }
        }
    }
}
