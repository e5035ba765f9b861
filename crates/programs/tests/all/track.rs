//! Programs that move the arm along a track: written, read, executed where the arm is carried.

use meltpath_base::{Reporter, settings as files};
use meltpath_geometry::math::DVec3;
use meltpath_programs::positioner::Positioner;
use meltpath_programs::track::Track;
use meltpath_programs::{CellProgramming, Dialect, Missing, build, dialect, read_toolpath};
use meltpath_toolpath::{Layer, Move, Role, Toolpath};
use proptest::prelude::*;

use crate::built::{head, toolpath};
use crate::dialects::{asked, laid, text_of};

const FEED: f64 = 400.0 / 3.0;
const SPOKEN: [Dialect; 4] = [
    Dialect::FanucLs,
    Dialect::Krl,
    Dialect::Rapid,
    Dialect::Inform,
];

fn track() -> Track {
    let text = "[it]\nsource = \"test\"\nuser_frame = \"stands\"\nunit = \"TRACK1\"\npulses_per_millimetre = 1234.5\n";
    files::peek(text, &["it"]).unwrap().unwrap()
}

/// A table that turns about z.
fn table() -> Positioner {
    let text = r#"
[it]
source = "test"
unit = "STN1"
user_frame = "base"
axis = [{ origin = ["100 mm", "0 mm", "0 mm"], direction = [0, 0, 1], pulses_per_degree = 1019.7 }]
"#;
    files::peek(text, &["it"]).unwrap().unwrap()
}

/// A cell whose arm rides on a track.
fn cell() -> CellProgramming {
    let mut cell = crate::dialects::cell(&[FEED]);
    cell.track.value = Some(track());
    cell
}

/// The same, and the part on a table.
fn with_table() -> CellProgramming {
    let mut cell = cell();
    cell.positioner.value = Some(table());
    cell
}

/// A bead three metres long and round a corner, with the arm carried along.
fn plan(turns: bool) -> Toolpath {
    let mut layer = Layer::new(1, 0.0);
    let mut pass = layer.begin(head(1, Role::Contour), DVec3::ZERO);
    pass.external(0, -250.5);
    pass.line_to(DVec3::new(3000.0, 0.0, 0.0));
    pass.external(0, 2750.0);
    let via = DVec3::new(3_007.071_067, 2.928_933, 0.0);
    pass.go(Move::Arc { via }, DVec3::new(3010.0, 10.0, 0.0));
    pass.external(0, 2760.125);
    if turns {
        layer.stand(1, 0.25);
    }
    toolpath(FEED, vec![layer])
}

#[test]
fn golden_programs_along_a_track() {
    for dialect in SPOKEN {
        let (_, text) = text_of(&plan(false), &cell(), dialect);
        insta::assert_snapshot!(format!("track_{dialect:?}"), text);
        let (_, text) = text_of(&plan(true), &with_table(), dialect);
        insta::assert_snapshot!(format!("track_and_table_{dialect:?}"), text);
    }
}

#[test]
fn what_a_track_needs_is_asked_for() {
    let told = |cell: &CellProgramming, dialect| {
        let error = build(&plan(false), cell, &asked(dialect), &Reporter::new());
        error.unwrap_err().to_string()
    };
    for (dialect, why) in [
        (Dialect::UrScript, "joints go, and nothing else"),
        (Dialect::Val3, "its points"),
    ] {
        let told = told(&cell(), dialect);
        assert!(
            told.contains(why) && told.contains(dialect.name()),
            "{told}"
        );
    }
    let mut silent = cell();
    silent.track.value.as_mut().unwrap().unit.value = None;
    assert!(told(&silent, Dialect::Rapid).contains("program.track.unit"));
    silent
        .track
        .value
        .as_mut()
        .unwrap()
        .pulses_per_millimetre
        .value = None;
    let pulses = told(&silent, Dialect::Inform);
    assert!(
        pulses.contains("program.track.pulses_per_millimetre"),
        "{pulses}"
    );
    let rides = "[it]\nsource = \"test\"\nuser_frame = \"rides\"\n";
    let mut rides_along = cell();
    rides_along.track.value = files::peek(rides, &["it"]).unwrap();
    assert!(told(&rides_along, Dialect::Krl).contains("program.track.user_frame"));
    // a plan that turns a part which nobody told of
    let error = build(&plan(true), &cell(), &asked(Dialect::Krl), &Reporter::new());
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("program.positioner")
    );
    let error = build(
        &plan(false),
        &with_table(),
        &asked(Dialect::Krl),
        &Reporter::new(),
    );
    let told = error.unwrap_err().to_string();
    assert!(
        told.contains("is 1, but must be that of the cell's track and positioner"),
        "{told}"
    );
}

/// An axis of which nobody says that it carries the arm may move the part.
#[test]
fn a_bead_along_a_track_that_nobody_told_of_is_told() {
    for dialect in SPOKEN {
        let (program, _) = text_of(&plan(false), &cell(), dialect);
        let known = crate::dialects::cell(&[FEED]).execution(10.0);
        let reading = read_toolpath(&[program], &known, 1e3, &Reporter::new()).unwrap();
        let why: Vec<&Missing> = reading.gaps.iter().map(|g| &g.why).collect();
        assert!(
            why.contains(&&Missing::ExternalAxes),
            "{dialect:?}: {why:?}"
        );
        // jobs tell it in pulses, which nobody tells of either
        if dialect == Dialect::Inform {
            let (_, text) = text_of(&plan(false), &cell(), dialect);
            let job = text.split_once('\n').unwrap().1;
            let unknown = crate::dialects::cell(&[FEED]);
            let read = dialect::read(dialect, job.as_bytes(), None, &unknown).unwrap();
            assert!(read[0].unread.iter().any(|u| u.text.starts_with("MOVL C")));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn programs_along_a_track_lay_the_part(
        points in proptest::collection::vec((prop::array::uniform3(-900.0..900.0_f64), -3000.0..3000.0_f64, -3.0..3.0_f64), 2..12),
        turns in any::<bool>(),
    ) {
        let mut layer = Layer::new(1, 0.0);
        let at = |p: [f64; 3]| (DVec3::from_array(p) * 1e3).round() / 1e3;
        let mut pass = layer.begin(head(1, Role::Fill), at(points[0].0));
        for (i, (point, along, turn)) in points.iter().enumerate() {
            if i > 0 {
                pass.line_to(at(*point));
            }
            pass.external(0, *along);
            if turns {
                pass.external(1, *turn);
            }
        }
        let plan = toolpath(FEED, vec![layer]);
        let cell = if turns { with_table() } else { cell() };
        for dialect in SPOKEN {
            let (program, _) = text_of(&plan, &cell, dialect);
            let laid = laid(&program, &cell);
            prop_assert_eq!(laid.len(), points.len());
            for ((place, axes), (point, along, turn)) in laid.iter().zip(&points) {
                prop_assert!(place.distance(at(*point)) <= 1e-3, "{place} {point:?}");
                prop_assert!((axes[0] - along).abs() <= 5.1e-4, "{axes:?} {along}");
                prop_assert_eq!(axes.len(), 1 + usize::from(turns));
                if turns {
                    prop_assert!((axes[1] - turn).abs() < 1e-3_f64.to_radians());
                }
            }
        }
    }
}
