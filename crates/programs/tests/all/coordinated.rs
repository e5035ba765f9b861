//! Programs that turn the part together with the arm: written, read, executed in the frame of the part.

use meltpath_base::{Reporter, settings as files};
use meltpath_geometry::math::DVec3;
use meltpath_programs::positioner::{Positioner, UserFrame};
use meltpath_programs::program::{Coordinates, Instruction, Program};
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
    { origin = ["0 mm", "0 mm", "-200 mm"], direction = [1, 0, 0] },
    { origin = ["0 mm", "0 mm", "0 mm"], direction = [0, 0, 2] },
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
    for dialect in [Dialect::UrScript, Dialect::Inform, Dialect::Val3] {
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
    // the base lies still
    kuka.attributes.clear();
    assert_eq!(gaps(&kuka, &known), [Missing::ExternalAxes]);
    let (abb, _) = text_of(&plan(), &known, Dialect::Rapid);
    assert_eq!(gaps(&abb, &still), [Missing::ExternalAxes]);
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
