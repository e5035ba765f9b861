//! What a welding cell needs each day: programs cut at layers, restart, dry run, calls between beads, waits, heights.

use meltpath_base::{Length, Reporter, Time};
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::{Coordinates, Instruction, MotionKind, Program};
use meltpath_programs::upkeep::{Cooled, Service, Split};
use meltpath_programs::{
    BuildSettings, CellProgramming, Dialect, Pause, Restart, TextFile, build, dialect, dry_run,
    laid_from,
};
use meltpath_toolpath::{Channel, Layer, Role, Toolpath};
use proptest::prelude::*;

use crate::built::{head, random_toolpath, settings, toolpath};
use crate::dialects::{OTHERS, arc_by_text, executed, held, read, written};

const FEEDS: [f64; 2] = [400.0 / 3.0, 100.0];

fn cell() -> CellProgramming {
    let mut cell = crate::dialects::cell(&FEEDS);
    let text = "call = \"CLEAN\"\nbeads = 2\n";
    cell.services.value = vec![table::<Service>(text)];
    cell.cooled.value = Some(table::<Cooled>("input = 3\nname = \"diCool\"\n"));
    cell.split.value = Split::Layer;
    cell.approach_height.value = Some(Length(5.0));
    cell.retract_height.value = Some(Length(8.0));
    cell
}

fn table<T: meltpath_base::settings::Value>(text: &str) -> T {
    let text = format!("[it]\n{text}");
    meltpath_base::settings::peek(&text, &["it"])
        .unwrap()
        .unwrap()
}

/// Three layers of two beads; the torch leans in the second, the feed changes in the third.
fn plan() -> Toolpath {
    let layers = (0..3).map(|k| {
        let z = f64::from(k) * 2.0;
        let mut layer = Layer::new(k + 1, 0.0);
        for bead in 0..2 {
            let y = 6.0 * f64::from(bead);
            let mut pass = layer.begin(head(2 * k + bead + 1, Role::Fill), DVec3::new(0.0, y, z));
            let axis = match k {
                1 => DVec3::new(0.0, 0.6, 0.8),
                _ => DVec3::Z,
            };
            pass.axis(axis).line_to(DVec3::new(60.0, y, z)).axis(axis);
            if k == 2 {
                pass.set(Channel::WireFeed, FEEDS[1]);
            }
        }
        layer
    });
    toolpath(FEEDS[0], layers.collect())
}

fn asked(dialect: Dialect) -> BuildSettings {
    BuildSettings {
        dialect,
        ..settings(Pause::Cooled(10.0))
    }
}

fn all() -> impl Iterator<Item = Dialect> {
    std::iter::once(Dialect::FanucLs).chain(OTHERS)
}

fn files(
    toolpath: &Toolpath,
    cell: &CellProgramming,
    asked: &BuildSettings,
) -> (Vec<Program>, Vec<Vec<TextFile>>) {
    let built = build(toolpath, cell, asked, &Reporter::new()).unwrap();
    let built = held(built, asked.dialect);
    let files = written(&built, cell).unwrap();
    let parsed = files.iter().map(|f| read(asked.dialect, f, cell).program);
    let parsed: Vec<Program> = parsed.collect();
    for (program, files) in parsed.iter().zip(&files) {
        assert_eq!(&dialect::write(program, cell).unwrap(), files);
    }
    (parsed, files)
}

fn texts(dialect: Dialect) -> String {
    let (_, files) = files(&plan(), &cell(), &asked(dialect));
    // positions are told by the other golden files
    let told = files.iter().flat_map(|f| f.iter().take(1)).map(|f| {
        let lines = f.text.lines().filter(|l| {
            let l = l.trim_start();
            !(l.starts_with("LOCAL") || l.starts_with("C0") || l.starts_with("///"))
        });
        let body: Vec<&str> = lines.take_while(|l| !l.starts_with("/POS")).collect();
        format!("==> {} <==\n{}\n", f.name, body.join("\n"))
    });
    told.collect()
}

#[test]
fn golden_layers_with_calls_waits_and_heights() {
    for dialect in all() {
        insta::assert_snapshot!(format!("daily_{dialect:?}"), texts(dialect));
    }
}

#[test]
fn programs_cut_at_layers_lay_the_same() {
    let whole = CellProgramming {
        split: crate::dialects::cell(&FEEDS).split,
        ..cell()
    };
    for dialect in all() {
        let (cut, files) = files(&plan(), &cell(), &asked(dialect));
        let names: Vec<&str> = cut.iter().map(|p| p.name.as_str()).collect();
        if matches!(dialect, Dialect::UrScript | Dialect::Val3) {
            assert_eq!(names, ["TEST_PART"]);
        } else {
            let wanted = [
                "TEST_PART",
                "TEST_PART_L001",
                "TEST_PART_L002",
                "TEST_PART_L003",
            ];
            assert_eq!(names, wanted);
            let main = &files[0][0].text;
            for told in ["Layer 1", "Layer 2", "Layer 3", "TEST_PART_L003"] {
                assert!(main.contains(told), "{main}");
            }
        }
        let (one, _) = self::files(&plan(), &whole, &asked(dialect));
        assert_eq!(one.len(), 1);
        let [a, b] = [executed(&cut, &cell()), executed(&one, &whole)];
        assert_eq!(a.len(), b.len());
        assert!(
            a.iter()
                .zip(&b)
                .all(|(a, b)| a.to == b.to && a.burns == b.burns)
        );
    }
    // a layer longer than a program takes several
    let mut small = cell();
    small.lines_per_program.value = 50;
    small.points_per_program.value = 20;
    let mut long = Layer::new(7, 0.0);
    for bead in 0..6 {
        let y = f64::from(bead) * 6.0;
        let points = (0..4).map(|i| DVec3::new(10.0 * f64::from(i), y, 0.0));
        long.polyline(head(bead, Role::Fill), points);
    }
    let two = Layer::new(8, 0.0);
    let long = toolpath(FEEDS[0], vec![long, two]);
    let (cut, _) = self::files(&long, &small, &asked(Dialect::FanucLs));
    let names: Vec<&str> = cut.iter().skip(1).map(|p| p.name.as_str()).collect();
    assert_eq!(names[..2], ["TEST_PART_L007", "TEST_PART_L007_2"]);
    assert!(
        cut.iter()
            .all(|p| p.instructions.len() <= 50 && p.positions.len() <= 20)
    );
}

#[test]
fn a_restart_strikes_its_bead_over_what_stands() {
    for dialect in all() {
        let from = Restart { layer: 3, bead: 2 };
        let asked = BuildSettings {
            from: Some(from),
            variant: "R3B2".to_owned(),
            ..asked(dialect)
        };
        let (programs, _) = files(&plan(), &cell(), &asked);
        assert_eq!(programs[0].name, "TEST_PART_R3B2");
        let moves = executed(&programs, &cell());
        let laid: Vec<_> = moves.iter().filter(|m| m.burns).collect();
        assert_eq!(laid.len(), 1);
        assert!((laid[0].wire_feed.unwrap() - FEEDS[1]).abs() < 1e-6);
        assert_eq!(laid[0].layer, 3);
        // over the three layers of 2 mm, and the bead beside
        let first = &programs.last().unwrap().positions[0].groups[0].coordinates;
        let Coordinates::Cartesian { xyz, .. } = first else {
            panic!("{first:?}")
        };
        assert_eq!(*xyz, [0.0, 6.0, 26.0]);
        assert_eq!(laid_from(&plan(), Some(from)).unwrap(), 60.0);
    }
    // FANUC's schedules keep the numbers that they have in the whole
    let from = |layer, bead| BuildSettings {
        from: Some(Restart { layer, bead }),
        ..asked(Dialect::FanucLs)
    };
    let rest = build(&plan(), &cell(), &from(3, 1), &Reporter::new()).unwrap();
    let numbers: Vec<u32> = rest.schedules.iter().map(|s| s.number).collect();
    assert_eq!(numbers, [1, 2]);
    for (asked, told) in [
        (from(3, 3), "no bead 3 in layer 3: this layer has 2"),
        (
            from(9, 1),
            "no bead 1 in layer 9: the plan has layers 1 to 3",
        ),
        (from(1, 0), "no bead 0 in layer 1"),
    ] {
        let error = build(&plan(), &cell(), &asked, &Reporter::new()).unwrap_err();
        assert!(error.to_string().contains(told), "{error}");
    }
}

#[test]
fn a_dry_run_moves_as_the_whole_and_never_strikes() {
    for dialect in all() {
        let asked = asked(dialect);
        let built = build(&plan(), &cell(), &asked, &Reporter::new()).unwrap();
        let built = held(built, dialect);
        let mut dry = built.clone();
        dry_run(&mut dry.programs);
        let mut parsed = Vec::new();
        for (program, wet) in dry.programs.iter().zip(&built.programs) {
            let files = dialect::write(program, &cell()).unwrap();
            let text = &files[0].text;
            for word in [
                "Arc Start",
                "ArcMain",
                "ArcL",
                "ARCON",
                "doArc",
                "set_digital_out",
            ] {
                assert!(!text.contains(word), "{text}");
            }
            assert_eq!(program.positions, wet.positions);
            parsed.push(read(dialect, &files, &cell()).program);
        }
        let [dry, wet] = [&parsed, &built.programs].map(|p| executed(p, &cell()));
        assert_eq!(dry.len(), wet.len());
        for (a, b) in dry.iter().zip(&wet) {
            assert!(!a.burns && a.to.distance(b.to) <= 1e-3);
            assert!((a.speed.unwrap() - b.speed.unwrap()).abs() < 2e-3);
        }
    }
}

#[test]
fn the_cell_is_served_between_beads() {
    let mut cell = cell();
    // beads take 4.8 s of arc: after three of them
    cell.services.value = vec![
        table::<Service>("call = \"CLEAN\"\nbeads = 2\n"),
        table::<Service>("call = \"CUT\"\narc_time = \"12 s\"\n"),
    ];
    let programs = build(&plan(), &cell, &asked(Dialect::FanucLs), &Reporter::new()).unwrap();
    let programs = programs.programs;
    let (mut beads, mut calls) = (0, Vec::new());
    let main = &programs[0];
    let in_order = main.instructions.iter().flat_map(|i| {
        let part = match i {
            Instruction::Call { program, .. } => programs.iter().find(|p| p.name == *program),
            _ => None,
        };
        part.map_or(std::slice::from_ref(i), |p| &p.instructions)
    });
    let mut called = false;
    for instruction in in_order {
        match instruction {
            Instruction::Call { program, .. } => {
                calls.push((program.clone(), beads));
                called = true;
            }
            Instruction::Motion(m) => {
                // from wherever the call ended
                assert!(!called || m.kind == MotionKind::Joint);
                called = false;
                beads += usize::from(m.arc.as_ref().is_some_and(|w| {
                    w.to_string() == "Arc Start[1]" || w.to_string() == "Arc Start[2]"
                }));
            }
            _ => {}
        }
    }
    let wanted = [("CLEAN", 2), ("CUT", 3), ("CLEAN", 4)];
    assert_eq!(calls, wanted.map(|(name, beads)| (name.to_owned(), beads)));
    cell.services.value = vec![table::<Service>("call = \"CLEAN\"\n")];
    assert_refused(&cell, Dialect::FanucLs, "write beads or arc_time");
}

/// A plan that has no words in a cell, and what to write there.
fn assert_refused(cell: &CellProgramming, dialect: Dialect, words: &str) {
    let error = build(&plan(), cell, &asked(dialect), &Reporter::new()).unwrap_err();
    assert!(error.to_string().contains(words), "{error}");
}

#[test]
fn what_the_cell_does_not_say_of_cooling_is_asked_for() {
    let mut cell = cell();
    for (text, dialect, key) in [
        ("name = \"diCool\"\n", Dialect::Krl, "program.cooled.input"),
        ("input = 1\n", Dialect::Rapid, "program.cooled.name"),
    ] {
        cell.cooled.value = Some(table::<Cooled>(text));
        assert_refused(&cell, dialect, key);
    }
    cell.cooled.value = None;
    assert_refused(&cell, Dialect::FanucLs, "write program.cooled");
}

#[test]
fn wires_go_down_and_back_along_the_torch() {
    let (programs, _) = files(&plan(), &cell(), &asked(Dialect::FanucLs));
    let moves = executed(&programs, &cell());
    // the first bead of the layer in which the torch leans
    let at = moves.iter().position(|m| m.burns && m.layer == 2).unwrap();
    let near = |p: DVec3, q: DVec3| p.distance(q) < 2e-3;
    assert!(near(moves[at - 1].to, DVec3::new(0.0, 0.0, 2.0)));
    assert!(near(moves[at - 2].to, DVec3::new(0.0, 3.0, 6.0)));
    assert_eq!(moves[at - 2].to.truncate(), moves[at - 3].to.truncate());
    assert!(near(moves[at + 1].to, DVec3::new(60.0, 4.8, 8.4)));
    assert!((moves[at + 1].speed.unwrap() - 25.0).abs() < 1e-6);
    assert_eq!(moves[at + 2].to.truncate(), moves[at + 1].to.truncate());
}

#[test]
fn files_and_moves_have_limits() {
    let mut cell = cell();
    cell.bytes_per_file.value = Some(2000);
    let built = build(&plan(), &cell, &asked(Dialect::FanucLs), &Reporter::new()).unwrap();
    let error = written(&built, &cell).unwrap_err().to_string();
    assert!(
        error.contains("more than the 2000 of program.bytes_per_file"),
        "{error}"
    );
    // 60 mm at 12.5 mm/s take 4.8 s
    for (least, told) in [(4.7, 0), (5.0, 1)] {
        cell.shortest_move.value = Some(Time(least));
        let reporter = Reporter::new();
        build(&plan(), &cell, &asked(Dialect::FanucLs), &reporter).unwrap();
        assert_eq!(reporter.warnings().len(), told);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_arc_never_burns_in_a_travel(
        plan in random_toolpath(1..8), beads in 1_u32..4, start in 0_usize..8, by_layer in proptest::bool::ANY,
    ) {
        let mut cell = crate::dialects::cell(&[100.0, 101.0, 102.0]);
        cell.services.value = vec![table::<Service>(&format!("call = \"CLEAN\"\nbeads = {beads}\n"))];
        cell.approach_height.value = Some(Length(5.0));
        cell.retract_height.value = Some(Length(8.0));
        cell.split.value = if by_layer { Split::Layer } else { Split::Limits };
        let places: Vec<(u32, Role)> = plan.passes().map(|p| (p.layer, p.head.role)).collect();
        let laying: Vec<usize> = (0..places.len()).filter(|i| places[*i].1.deposits()).collect();
        prop_assume!(!laying.is_empty());
        let at = laying[start % laying.len()];
        let layer = places[at].0;
        let bead = laying.iter().filter(|i| **i <= at && places[**i].0 == layer).count() as u32;
        for dialect in OTHERS {
            let asked = BuildSettings { from: Some(Restart { layer, bead }), ..settings(Pause::Wait(1.0)) };
            let (programs, files) = files(&plan, &cell, &BuildSettings { dialect, ..asked });
            let moves = executed(&programs, &cell);
            let laid: f64 = laid_from(&plan, Some(Restart { layer, bead })).unwrap();
            prop_assert!(laid == 0.0 || moves.iter().any(|m| m.burns));
            let parts = &files[usize::from(files.len() > 1)..];
            let text: String = parts.iter().map(|f| f[0].text.as_str()).collect();
            let (during, left_on) = arc_by_text(dialect, &text);
            prop_assert!(!left_on && during.first() != Some(&true));
            prop_assert_eq!(during.get(1..).unwrap_or_default(), moves.iter().map(|m| m.burns).collect::<Vec<_>>());
        }
    }
}
