//! Programs of toolpaths: golden text, and laws over random toolpaths, all from the text that the controller would read.

use std::collections::BTreeMap;

use meltpath_base::{Length, Ratio, Reporter, Speed};
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::{ArcStyle, Coordinates, Instruction, Program};
use meltpath_programs::{
    BuildError, BuildSettings, Built, CellProgramming, Dialect, ExecutionSettings, PathSpeedUnit,
    Pause, Way, build, fanuc_ls, read_toolpath,
};
use meltpath_toolpath::{Channel, Event, Layer, Move, PassHead, PassId, Profile, Role, Toolpath};
use proptest::prelude::*;

use crate::told::{Told, motions};

pub(crate) fn arcmate() -> CellProgramming {
    let text = meltpath_data::cells::ARCMATE_120IC.text;
    meltpath_base::settings::peek(text, &["program"])
        .unwrap()
        .unwrap()
}

pub(crate) fn settings(pause: Pause) -> BuildSettings {
    BuildSettings {
        name: "test part".to_owned(),
        comment: "test part".to_owned(),
        dialect: Dialect::FanucLs,
        smoothing: Ratio(0.5),
        pause,
        from: None,
        variant: String::new(),
        standing: None,
    }
}

pub(crate) fn head(id: u32, role: Role) -> PassHead {
    PassHead {
        id: PassId(id),
        role,
        ..PassHead::default()
    }
}

/// A toolpath of one profile.
pub(crate) fn toolpath(wire_feed: f64, layers: Vec<Layer>) -> Toolpath {
    Toolpath {
        profiles: vec![profile(wire_feed)],
        layers,
        ..Toolpath::default()
    }
}

fn profile(wire_feed: f64) -> Profile {
    Profile {
        name: "bead".to_owned(),
        speed: 12.5,
        wire_feed,
        height: 2.0,
        ..Profile::default()
    }
}

/// Text of every program, parsed back.
fn through_text(built: &Built) -> Vec<Program> {
    let parse = |p: &Program| {
        let text = fanuc_ls::write(p).unwrap();
        let parsed = fanuc_ls::parse(&text).unwrap();
        assert!(parsed.unread.is_empty(), "{:?}", parsed.unread);
        parsed.program
    };
    built.programs.iter().map(parse).collect()
}

/// Two layers: a contour with an arc; a bead with changing feed, speed and torch.
pub(crate) fn two_layers() -> [Layer; 2] {
    let p = DVec3::new;
    let mut first = Layer::new(1, 0.0);
    first
        .begin(head(1, Role::Contour), p(0.0, 0.0, 0.0))
        .line_to(p(50.0, 0.0, 0.0))
        .go(
            Move::Arc {
                via: p(57.071_067, 2.928_933, 0.0),
            },
            p(60.0, 10.0, 0.0),
        )
        .line_to(p(60.0, 40.0, 0.0));
    let mut second = Layer::new(2, 0.0);
    let mut pass = second.begin(head(2, Role::Fill), p(0.0, 5.0, 1.6));
    pass.axis(DVec3::Z)
        .line_to(p(30.0, 5.0, 1.6))
        .axis(DVec3::Z);
    pass.set(Channel::WireFeed, 400.0 / 3.0);
    pass.set(Channel::Speed, 10.0);
    pass.line_to(p(30.0, 25.0, 1.6));
    pass.axis(p(0.0, -0.5, 1.0).normalize());
    pass.set(Channel::WireFeed, 100.0).set(Channel::Speed, 8.0);
    [first, second]
}

fn small() -> Toolpath {
    let [first, mut second] = two_layers();
    let at = DVec3::new(10.0, 10.0, 1.6);
    let mut spot = second.begin(head(3, Role::Fill), at);
    spot.go(Move::Spot { time: 0.4 }, at);
    let small = toolpath(400.0 / 3.0, vec![first, second]);
    small.sanity_check().unwrap();
    small
}

/// The programs of a toolpath for the ARC Mate.
fn built(toolpath: &Toolpath, pause: Pause) -> Built {
    build(toolpath, &arcmate(), &settings(pause), &Reporter::new()).unwrap()
}

#[test]
fn golden_program() {
    let built = built(&small(), Pause::Wait(30.0));
    assert_eq!(built.programs.len(), 1);
    insta::assert_snapshot!(fanuc_ls::write(&built.programs[0]).unwrap());
}

#[test]
fn golden_program_with_weld_words_and_sub_programs() {
    let mut cell = arcmate();
    cell.arc.style.value = ArcStyle::Weld;
    cell.speed_unit.value = PathSpeedUnit::MillimetrePerSecond;
    cell.name_length.value = 8;
    cell.lines_per_program.value = 50;
    cell.points_per_program.value = 20;
    let layers = (0..5).map(|i| {
        let z = f64::from(i) * 1.6;
        let mut layer = Layer::new(i + 1, 0.0);
        let points = (0..8).map(|k| DVec3::new(f64::from(k) * 10.0, 0.0, z));
        layer.polyline(head(i, Role::Contour), points);
        layer
    });
    let toolpath = toolpath(400.0 / 3.0, layers.collect());
    let pause = Pause::Call("COOL".to_owned());
    let built = build(&toolpath, &cell, &settings(pause), &Reporter::new()).unwrap();
    let names: Vec<_> = built.programs.iter().map(|p| p.name.as_str()).collect();
    assert!(
        names.len() > 2 && names.iter().all(|n| n.len() <= 8),
        "{names:?}"
    );
    for p in &built.programs {
        assert!(p.instructions.len() <= 50 && p.positions.len() <= 20);
    }
    insta::assert_snapshot!(fanuc_ls::write(&built.programs[0]).unwrap());
    insta::assert_snapshot!(fanuc_ls::write(&built.programs[1]).unwrap());
}

/// The moves of the text of a toolpath's programs, in order, with waits left out; and where they start.
fn executed(built: &Built) -> (DVec3, Vec<Told>) {
    let mut settings = ExecutionSettings::default();
    settings.passed_over.insert("COOL".to_owned());
    let reading = read_toolpath(&through_text(built), &settings, 1000.0, &Reporter::new()).unwrap();
    assert_eq!(reading.gaps, []);
    for layer in &reading.toolpath.layers {
        layer.sanity_check().unwrap();
    }
    let start = reading.toolpath.passes().next().map(|p| p.points[0]);
    (start.unwrap_or(DVec3::ZERO), motions(&reading))
}

#[test]
fn speeds_schedules_and_places_survive_the_text() {
    let built = built(&small(), Pause::None);
    let feeds: Vec<_> = built
        .schedules
        .iter()
        .map(|s| (s.number, s.wire_feed))
        .collect();
    assert_eq!(feeds, [(1, 400.0 / 3.0), (2, 100.0)]);
    let (_, moves) = executed(&built);
    let depositing: Vec<_> = moves.iter().filter(|m| m.burns).collect();
    assert_eq!(depositing.len(), 5);
    // to the digits of the comments that say it
    let metres = |m: &Told| (m.wire_feed.unwrap() * 0.06 * 100.0).round() as u32;
    let seen: Vec<_> = depositing
        .iter()
        .map(|m| (m.layer, m.bead, metres(m), m.control.smoothing))
        .collect();
    assert_eq!(
        seen,
        [
            (1, 1, 800, Some(0.5)),
            (1, 1, 800, Some(0.5)),
            (1, 1, 800, None),
            (2, 1, 800, Some(0.5)),
            (2, 1, 600, None),
        ]
    );
    assert!(matches!(depositing[1].shape, Move::Arc { .. }));
    assert_eq!(depositing[4].speed, Some(8.0));
    let axis = DVec3::new(0.0, -0.5, 1.0).normalize();
    assert!(depositing[4].axis.distance(axis) < 1e-4);
}

#[test]
fn travels_clear_the_highest_surface() {
    let built = built(&small(), Pause::None);
    let (start, moves) = executed(&built);
    let mut a = start;
    for m in &moves {
        let b = m.to;
        if !m.burns && a.truncate().distance(b.truncate()) > 1e-3 {
            let height = if b.z > 21.0 + 1.6 { 1.6 } else { 0.0 };
            assert!(a.z.min(b.z) >= height + 20.0, "{a} {b}");
        }
        a = b;
    }
    assert!(moves.iter().all(|m| m.control.way == Way::Path));
}

#[test]
fn unsound_passes_are_refused_by_number() {
    let refused = |change: fn(&mut Toolpath)| {
        let mut toolpath = small();
        change(&mut toolpath);
        build(
            &toolpath,
            &arcmate(),
            &settings(Pause::None),
            &Reporter::new(),
        )
        .unwrap_err()
    };
    assert!(matches!(
        refused(|t| t.layers[1].translate(DVec3::X * f64::NAN)),
        BuildError::Pass { pass, .. } if (pass.number, pass.layer) == (1, 2)
    ));
    let weave = |t: &mut Toolpath| {
        let mut pass = t.layers[0].begin(head(9, Role::Fill), DVec3::ZERO);
        pass.event(Event::Weave(1)).line_to(DVec3::X);
    };
    assert!(refused(weave).to_string().contains("weaves"));
    let turned = |t: &mut Toolpath| {
        let mut pass = t.layers[0].begin(head(9, Role::Fill), DVec3::ZERO);
        pass.line_to(DVec3::X).external(0, 0.5);
    };
    assert!(refused(turned).to_string().contains("external axis"));
    assert!(
        refused(|t| t.profiles[0].speed = 0.0)
            .to_string()
            .contains("speed")
    );
    assert!(
        refused(|t| t.profiles[0].wire_feed = -1.0)
            .to_string()
            .contains("wire feed")
    );
    let other_profile = |t: &mut Toolpath| {
        let bead = PassHead {
            profile: 7,
            ..head(9, Role::Fill)
        };
        t.layers[0].polyline(bead, [DVec3::ZERO, DVec3::X]);
    };
    assert!(refused(other_profile).to_string().contains("profile"));
    assert_eq!(refused(|t| t.layers.clear()), BuildError::Empty);
    let mut cell = arcmate();
    cell.arc.schedules.value = 1;
    let reporter = Reporter::new();
    assert_eq!(
        build(&small(), &cell, &settings(Pause::None), &reporter),
        Err(BuildError::Schedules {
            available: 1,
            pass: small().layers[1].pass(0).place(),
        })
    );
}

/// A schedule that the cell's file lists is called for its wire feed, and for no other: the controller feeds what it sets.
#[test]
fn listed_schedules_are_called_for_their_own_wire_feed() {
    let numbers = |listed: &[(u32, &str)]| {
        let schedules: Vec<String> = listed
            .iter()
            .map(|(number, feed)| {
                format!("[[program.schedule]]\nnumber = {number}\nwire_feed = \"{feed}\"\n")
            })
            .collect();
        let text = meltpath_data::cells::ARCMATE_120IC.text.to_owned() + &schedules.concat();
        let cell: CellProgramming = meltpath_base::settings::peek(&text, &["program"])
            .unwrap()
            .unwrap();
        let built = build(&small(), &cell, &settings(Pause::None), &Reporter::new())?;
        let schedules = built.schedules.into_iter();
        Ok::<_, BuildError>(schedules.map(|s| s.number).collect::<Vec<u32>>())
    };
    // 8 and 6 m/min are asked for, in this order
    assert_eq!(numbers(&[(5, "8 m/min"), (1, "6 m/min")]), Ok(vec![5, 1]));
    assert_eq!(numbers(&[(1, "5 m/min")]), Ok(vec![2, 3]));
    assert_eq!(numbers(&[(2, "8 m/min")]), Ok(vec![2, 1]));
    let all: Vec<(u32, &str)> = (1..=31).map(|n| (n, "5 m/min")).collect();
    assert!(matches!(numbers(&all), Err(BuildError::Schedules { .. })));
}

#[test]
fn infinite_numbers_are_not_written() {
    let mut program = built(&small(), Pause::None).programs.remove(0);
    if let Coordinates::Cartesian { xyz, .. } = &mut program.positions[3].groups[0].coordinates {
        xyz[1] = f64::INFINITY;
    }
    let error = fanuc_ls::write(&program).unwrap_err().to_string();
    assert!(error.contains("P[4]"), "{error}");
}

/// One pass in a layer of its own.
fn random_pass(id: u32, kinds: std::ops::Range<u8>) -> impl Strategy<Value = Layer> {
    let point = (-200.0..200.0, -200.0..200.0, 0.0..60.0).prop_map(|(x, y, z)| DVec3::new(x, y, z));
    let step = (point, kinds, -30.0..30.0, 0.5..20.0, 0_u8..3, 0.0..0.5);
    let role = prop_oneof![4 => Just(Role::Fill), 1 => Just(Role::Travel)];
    (role, 1_u32..6, proptest::collection::vec(step, 1..12)).prop_map(
        move |(role, number, steps)| {
            let mut layer = Layer::new(number, 0.0);
            let mut pass = layer.begin(head(id, role), steps[0].0);
            for (&(from, kind, bulge, speed, feed, time), &(to, ..)) in
                steps.iter().zip(&steps[1..])
            {
                let middle = 0.5 * (from + to);
                let shape = match kind {
                    1 => Move::Arc {
                        via: middle + DVec3::new(bulge, -bulge, 0.0),
                    },
                    0 => Move::Spot { time },
                    _ => Move::Line,
                };
                pass.go(shape, to).set(Channel::Speed, speed);
                pass.set(Channel::WireFeed, 100.0 + f64::from(feed));
            }
            layer
        },
    )
}

/// Passes over lines, arcs and, where kinds begin with 0, waits.
pub(crate) fn random_toolpath(kinds: std::ops::Range<u8>) -> impl Strategy<Value = Toolpath> {
    let layers: Vec<_> = (0..5).map(|id| random_pass(id, kinds.clone())).collect();
    layers.prop_map(|mut layers| {
        layers.sort_by_key(|l| l.number);
        toolpath(150.0, layers)
    })
}

/// The arc as the lines of the text switch it, without any of this crate's understanding: state during each move.
fn arc_by_text(programs: &[String]) -> (Vec<bool>, bool) {
    let (mut on, mut during) = (false, Vec::new());
    for line in programs.iter().flat_map(|p| p.lines()) {
        let words: Vec<_> = line.split([':', ' ']).collect();
        let moves = words.iter().any(|w| ["L", "J", "C"].contains(w));
        if moves {
            during.push(on);
        }
        on |= line.contains("Arc Start[");
        on &= !line.contains("Arc End[");
    }
    (during, on)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_arc_is_never_on_in_a_travel_and_off_at_the_end(toolpath in random_toolpath(0..8), small_programs in any::<bool>()) {
        let mut cell = arcmate();
        if small_programs {
            cell.lines_per_program.value = 50;
            cell.points_per_program.value = 20;
        }
        let built = build(&toolpath, &cell, &settings(Pause::None), &Reporter::new()).unwrap();
        let (_, moves) = executed(&built);
        // by the text alone
        let parts = &built.programs[usize::from(built.programs.len() > 1)..];
        let texts: Vec<_> = parts.iter().map(|p| fanuc_ls::write(p).unwrap()).collect();
        let (during, left_on) = arc_by_text(&texts);
        prop_assert!(!left_on);
        // the first move leads to the start
        prop_assert_eq!(during.first(), Some(&false));
        prop_assert_eq!(&during[1..], moves.iter().map(|m| m.burns).collect::<Vec<_>>());
        // what is deposited is what the toolpath deposits, move by move, and nothing else
        let mut wanted = Vec::new();
        let mut beads = BTreeMap::<u32, u32>::new();
        for pass in toolpath.passes().filter(|p| p.head.role.deposits()) {
            let bead = beads.entry(pass.layer).or_default();
            *bead += 1;
            for (i, pair) in pass.points.windows(2).enumerate() {
                if pair[0].distance(pair[1]) > 1e-3 {
                    let feed = pass.value(Channel::WireFeed, i).unwrap();
                    wanted.push((*bead, pair[1], feed));
                }
            }
        }
        let found: Vec<_> = moves.iter().filter(|m| m.burns).collect();
        prop_assert_eq!(found.len(), wanted.len());
        for (m, (bead, to, feed)) in found.iter().zip(wanted) {
            prop_assert_eq!(m.bead, bead);
            prop_assert!(m.to.distance(to) < 1e-3);
            // to the digits of the comment
            prop_assert!((m.wire_feed.unwrap() - feed).abs() < 0.005 / 0.06 + 1e-9);
        }
    }

    #[test]
    fn what_is_written_is_read(toolpath in random_toolpath(0..8), clearance in 1.0..50.0, speed in 1.0..200.0) {
        let mut cell = arcmate();
        cell.clearance.value = Length(clearance);
        cell.travel_speed.value = Speed(speed);
        let built = build(&toolpath, &cell, &settings(Pause::Wait(1.25)), &Reporter::new()).unwrap();
        for (program, read) in built.programs.iter().zip(through_text(&built)) {
            prop_assert_eq!(&read.attributes, &program.attributes);
            prop_assert_eq!(&read.application, &program.application);
            prop_assert_eq!(read.instructions.len(), program.instructions.len());
            for (a, b) in program.instructions.iter().zip(&read.instructions) {
                if let (Instruction::Wait(x), Instruction::Wait(y)) = (a, b) {
                    prop_assert!((x - y).abs() < 1e-9);
                } else {
                    prop_assert_eq!(a, b);
                }
            }
            for (a, b) in program.positions.iter().zip(&read.positions) {
                let (Coordinates::Cartesian { xyz: p, wpr_degrees: v, .. }, Coordinates::Cartesian { xyz: q, wpr_degrees: w, .. }) =
                    (&a.groups[0].coordinates, &b.groups[0].coordinates) else { panic!("not Cartesian") };
                for k in 0..3 {
                    prop_assert!((p[k] - q[k]).abs() <= 1e-3 && (v[k] - w[k]).abs() <= 1e-3);
                }
            }
            let text = fanuc_ls::write(&read).unwrap();
            prop_assert_eq!(fanuc_ls::parse(&text).unwrap().program, read);
        }
    }
}
