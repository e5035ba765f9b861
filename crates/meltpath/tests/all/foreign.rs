//! Programs of other software through `meltpath simulate`: nothing passes while a line that shapes metal was not simulated, or while
//! nobody says which wire lays it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::support::{check, says, thin_wall, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::simulate_program;
use meltpath_base::{Silent, Status, Verdict};

/// A wall of two beads, 100 mm long, with `lines` before its first bead.
fn program(folder: &Path, lines: &[&str]) -> PathBuf {
    let before = ["UFRAME_NUM=1", "UTOOL_NUM=1", "J P[1] 20% FINE"];
    let beads = [
        "L P[2] 20mm/sec FINE Arc Start[7]",
        "L P[3] WELD_SPEED FINE Arc End[7]",
        "L P[1] 100mm/sec CNT100",
        "L P[4] 20mm/sec FINE Arc Start[7]",
        "L P[5] WELD_SPEED FINE Arc End[7]",
    ];
    let all = [&before, lines, &beads].concat();
    let places = [
        [0.0, 60.0],
        [0.0, 0.0],
        [100.0, 0.0],
        [100.0, 1.7],
        [0.0, 1.7],
    ];
    written(folder, &all, &places)
}

/// A program of `lines` between places (x and z, mm) in the plane y = 0.
fn written(folder: &Path, lines: &[&str], places: &[[f64; 2]]) -> PathBuf {
    let places: Vec<[f64; 6]> = places
        .iter()
        .map(|[x, z]| [*x, 0.0, *z, 180.0, 0.0, 0.0])
        .collect();
    posed(folder, lines, &places)
}

/// A program of `lines` between poses: X, Y, Z, mm, and W, P, R, degrees.
pub(crate) fn posed(folder: &Path, lines: &[&str], places: &[[f64; 6]]) -> PathBuf {
    let mut text = "/PROG WALL\n/MN\n".to_owned();
    for (n, line) in lines.iter().enumerate() {
        writeln!(text, "{:4}:{line} ;", n + 1).unwrap();
    }
    text += "/POS\n";
    for (n, [x, y, z, w, p, r]) in places.iter().enumerate() {
        let n = n + 1;
        writeln!(text, "P[{n}]{{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = {x} mm, Y = {y} mm, Z = {z} mm, W = {w} deg, P = {p} deg, R = {r} deg\n}};").unwrap();
    }
    text += "/END\n";
    write(folder, "wall.ls", text)
}

/// A job for it, with a cell that knows schedule 7.
pub(crate) fn job(folder: &Path) -> PathBuf {
    let shipped = meltpath_data::cells::ARCMATE_120IC.text;
    let cell = format!(
        "{shipped}\n[[program.schedule]]\nnumber = 7\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n"
    );
    std::fs::write(folder.join("cell.toml"), cell).unwrap();
    thin_wall(
        folder,
        "[machine]\ncell = \"cell.toml\"\n[simulation]\ncell = \"1 mm\"\n",
    )
}

fn simulated(folder: &Path, lines: &[&str], job: Option<&Path>) -> Verdict {
    let program = program(folder, lines);
    let runs = folder.join("runs");
    simulate_program(&program, job, NextIn(&runs), &Silent)
        .unwrap()
        .verdict
}

/// A wall whose middle is bridged after eight layers with a gap: the contact tube is 26 to 30 mm from what lies in the gap, for four
/// layers, along a seventh of their length. The torch's gas does not reach there, and what the source feeds was not measured.
#[test]
fn a_contact_tube_that_drifts_in_the_middle_fails_there() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let mut lines = vec!["UFRAME_NUM=1".to_owned(), "UTOOL_NUM=1".to_owned()];
    let mut places = Vec::new();
    for layer in 0..12_u32 {
        let z = 1.7 * f64::from(layer);
        let beads: &[[f64; 2]] = match layer {
            0..8 => &[[0.0, 42.0], [58.0, 100.0]],
            _ => &[[0.0, 100.0]],
        };
        for &ends in beads {
            // to and fro: a bead's end fills what its start leaves low
            let ends = if layer % 2 == 0 {
                ends
            } else {
                [ends[1], ends[0]]
            };
            places.extend(ends.map(|x| [x, z]));
            let n = places.len();
            lines.push(format!("L P[{}] 20mm/sec FINE Arc Start[7]", n - 1));
            lines.push(format!("L P[{n}] WELD_SPEED FINE Arc End[7]"));
            places.push([ends[1], z + 40.0]);
            lines.push(format!("L P[{}] 100mm/sec FINE", places.len()));
        }
    }
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let program = written(dir.path(), &lines, &places);
    let verdict = simulate_program(
        &program,
        Some(&job),
        NextIn(&dir.path().join("runs")),
        &Silent,
    )
    .unwrap()
    .verdict;
    for (id, status) in [
        ("ctwd-max", Status::Fail),
        ("ctwd-known", Status::CannotSay),
    ] {
        let check = check(&verdict, id);
        assert_eq!(check.status, status, "{check:?}");
        let value = check.value.as_ref().unwrap().value;
        assert!(
            id != "ctwd-max" || (24.0..31.0).contains(&value),
            "{check:?}"
        );
        let place = check.place.as_ref().unwrap();
        assert!((9..=12).contains(&place.layer.unwrap()), "{place:?}");
        let x = place.position.unwrap()[0];
        assert!((43.0..57.0).contains(&x), "{place:?}");
        assert!(check.reason.contains(" min "), "{check:?}");
    }
}

fn change_cell(folder: &Path, change: impl FnOnce(String) -> String) {
    let cell = folder.join("cell.toml");
    let known = std::fs::read_to_string(&cell).unwrap();
    std::fs::write(&cell, change(known)).unwrap();
}

/// A program that feeds more than any bead of the map was fed: nothing is known of its beads.
#[test]
fn a_feed_outside_the_map_is_undecided_where_it_begins() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let usual = "wire_feed = \"8 m/min\"";
    assert!(
        simulated(dir.path(), &[], Some(&job))
            .checks
            .iter()
            .all(|c| c.id != "range")
    );
    change_cell(dir.path(), |text| {
        text.replace(usual, "wire_feed = \"14 m/min\"")
    });
    let verdict = simulated(dir.path(), &[], Some(&job));
    let range = check(&verdict, "range");
    assert_eq!(range.status, Status::CannotSay);
    assert!(range.reason.contains("14.00 m/min wire feed"), "{range:?}");
    assert_eq!(range.place.as_ref().unwrap().layer, Some(1));
    assert!(range.remedy.is_some());
}

/// Checks of the metal, which stand and fall with the whole program.
const METAL: [&str; 6] = [
    "lack", "excess", "flatness", "height", "ctwd-min", "ctwd-max",
];

#[test]
fn a_program_that_is_simulated_whole_is_decided() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let verdict = simulated(dir.path(), &["DO[3]=ON", "!clean plate"], Some(&job));
    assert_eq!(check(&verdict, "lines").status, Status::Pass);
    // a wall of two layers is far from a part of 25
    assert_eq!(check(&verdict, "lack").status, Status::Fail);
    assert_eq!(check(&verdict, "ctwd-min").status, Status::Pass);
    assert!(verdict.facts.iter().any(|f| f.id == "wire-mass"));
}

#[test]
fn nothing_is_decided_while_a_line_that_shapes_metal_was_not_simulated() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    for line in ["Weave Sine[1]", "CALL TORCH_CLEAN", "AO[1]=5"] {
        let verdict = simulated(dir.path(), &[line], Some(&job));
        let lines = check(&verdict, "lines");
        assert_eq!(lines.status, Status::CannotSay, "{line}");
        assert_eq!(lines.place.as_ref().unwrap().line, Some(4), "{line}");
        assert!(lines.reason.contains(line), "{}", lines.reason);
        assert!(lines.remedy.is_some());
        for id in METAL {
            let check = check(&verdict, id);
            assert_eq!(check.status, Status::CannotSay, "{line}: {id}");
            assert!(check.reason.contains("WALL, line 4"), "{}", check.reason);
        }
        assert_eq!(verdict.status(), Status::CannotSay);
    }
}

/// The main program of a folder is the one that no other calls; programs are called to any depth, by the name that they bear.
#[test]
fn a_folder_of_programs_is_simulated_from_its_main() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let folder = dir.path().join("cell");
    std::fs::create_dir(&folder).unwrap();
    program(&folder, &[]);
    let call = |name: &str, called: &str| {
        let text = format!("/PROG {name}\n/MN\n1:CALL {called} ;\n/POS\n/END\n");
        std::fs::write(folder.join(format!("{name}.LS")), text).unwrap();
    };
    call("MAIN", "FIRST");
    call("FIRST", "SECOND");
    call("SECOND", "WALL");
    let runs = dir.path().join("runs");
    let simulate = || simulate_program(&folder, Some(&job), NextIn(&runs), &Silent);
    let outcome = simulate().unwrap();
    assert_eq!(check(&outcome.verdict, "lines").status, Status::Pass);
    assert!(outcome.verdict.facts.iter().any(|f| f.id == "wire-mass"));
    // every program is among the inputs
    let provenance = std::fs::read_to_string(outcome.folder.join("provenance.json")).unwrap();
    says(
        &provenance,
        &["MAIN.LS", "FIRST.LS", "SECOND.LS", "wall.ls"],
    );
    call("OTHER", "WALL");
    let error = simulate().unwrap_err().to_string();
    assert!(error.contains("MAIN, OTHER"), "{error}");
    // routines of its own that a file calls make no other its main
    let folder = dir.path().join("kuka");
    std::fs::create_dir(&folder).unwrap();
    let place = |x: f64| format!("LIN {{X {x},Y 0,Z 0,A 0,B 0,C 180}}\n");
    let frames = "$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.1\n";
    let [from, to] = [0.0, 60.0].map(place);
    let main = format!("DEF WALL( )\n{frames}{from}LAY( )\nHELP( )\nEND\nDEF LAY( )\n{to}END\n");
    let help = format!("DEF HELP( )\nOWN( )\nEND\nDEF OWN( )\n{from}END\n");
    std::fs::write(folder.join("wall.src"), main).unwrap();
    std::fs::write(folder.join("help.src"), help).unwrap();
    let error = simulate_program(&folder, None, NextIn(&runs), &Silent).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("the program WALL never starts the arc"),
        "{error}"
    );
}

/// Heights count from the plate that the job tells; where nobody tells it, beads far from 0 decide nothing.
#[test]
fn the_plate_is_where_the_job_says() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let program = program(dir.path(), &[]);
    let text = std::fs::read_to_string(&program).unwrap();
    let raised = text
        .replace("Z = 0 mm", "Z = 412 mm")
        .replace("Z = 1.7 mm", "Z = 413.7 mm")
        .replace("Z = 60 mm", "Z = 472 mm");
    let runs = dir.path().join("runs");
    let simulate = || {
        simulate_program(&program, Some(&job), NextIn(&runs), &Silent)
            .unwrap()
            .verdict
    };
    let flat = simulate();
    std::fs::write(&program, raised).unwrap();
    let unknown = simulate();
    let nearest = check(&unknown, "ctwd-min");
    assert_eq!(nearest.status, Status::CannotSay);
    assert!(
        nearest.reason.contains("z = 412.0 mm"),
        "{}",
        nearest.reason
    );
    let written = std::fs::read_to_string(&job).unwrap();
    std::fs::write(&job, format!("{written}[substrate]\nheight = \"412 mm\"\n")).unwrap();
    let told = simulate();
    for id in METAL {
        assert_eq!(check(&told, id).status, check(&flat, id).status, "{id}");
    }
    let value = |v: &Verdict| check(v, "ctwd-min").value.as_ref().unwrap().value;
    assert!((value(&told) - value(&flat)).abs() < 1e-6);
}

/// A weave that the cell's table tells is simulated; what it makes of the bead is shown, and not decided by.
#[test]
fn woven_beads_are_simulated_and_not_decided() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let weave = "[[program.weave]]\nnumber = 1\nshape = \"sine\"\nfrequency = \"2 Hz\"\namplitude = \"3 mm\"\n";
    change_cell(dir.path(), |known| known + weave);
    let verdict = simulated(dir.path(), &["Weave Sine[1]"], Some(&job));
    assert_eq!(check(&verdict, "lines").status, Status::Pass);
    for id in METAL {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{id}");
        assert!(check.reason.contains("beads are woven"), "{}", check.reason);
    }
}

/// A weld line over a hump, and one on it: shown, and not decided by, for layers have one height.
#[test]
fn beads_that_go_up_and_down_are_simulated_and_not_decided() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let lines = [
        "J P[1] 20% FINE",
        "L P[2] 20mm/sec FINE Arc Start[7]",
        "L P[3] WELD_SPEED CNT50",
        "L P[4] WELD_SPEED FINE Arc End[7]",
        "L P[1] 100mm/sec CNT100",
        "L P[5] 20mm/sec FINE Arc Start[7]",
        "L P[6] WELD_SPEED CNT50",
        "L P[7] WELD_SPEED FINE Arc End[7]",
    ];
    let places = [
        [0.0, 60.0],
        [0.0, 0.0],
        [40.0, 8.0],
        [80.0, 0.0],
        [80.0, 1.7],
        [40.0, 9.7],
        [0.0, 1.7],
    ];
    let program = written(dir.path(), &lines, &places);
    let runs = dir.path().join("runs");
    let outcome = simulate_program(&program, Some(&job), NextIn(&runs), &Silent).unwrap();
    for id in METAL {
        let check = check(&outcome.verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{id}");
        let told = "beads of layer 1 lie between z = 0.0 and 8.0 mm";
        assert!(check.reason.contains(told), "{}", check.reason);
    }
    assert_eq!(check(&outcome.verdict, "lines").status, Status::Pass);
}

/// One stack of beads after another, without comments that tell layers: each bead is judged at its own height.
#[test]
fn stacks_one_after_the_other_are_simulated() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let mut lines = vec!["J P[1] 20% FINE".to_owned()];
    let mut places = vec![[0.0, 60.0]];
    for x in [0.0, 60.0] {
        for z in [0.0, 1.7, 3.4] {
            let n = places.len() + 1;
            places.extend([[x, z], [x + 40.0, z]]);
            lines.push(format!("L P[{n}] 20mm/sec FINE Arc Start[7]"));
            lines.push(format!("L P[{}] WELD_SPEED FINE Arc End[7]", n + 1));
            lines.push("L P[1] 100mm/sec FINE".to_owned());
        }
    }
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let program = written(dir.path(), &lines, &places);
    let runs = dir.path().join("runs");
    let outcome = simulate_program(&program, Some(&job), NextIn(&runs), &Silent).unwrap();
    let height = check(&outcome.verdict, "height");
    // against the top of another stack's layer it would be off by more
    assert!(height.value.as_ref().unwrap().value < 3.0, "{height:?}");
    assert_eq!(height.status, Status::Pass, "{height:?}");
}

#[test]
fn without_the_cells_table_a_schedule_is_not_guessed() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let shipped = meltpath_data::cells::ARCMATE_120IC.text;
    std::fs::write(dir.path().join("cell.toml"), shipped).unwrap();
    let verdict = simulated(dir.path(), &[], Some(&job));
    let lines = check(&verdict, "lines");
    assert_eq!(lines.status, Status::CannotSay);
    assert!(lines.reason.contains("Arc Start[7]"), "{}", lines.reason);
    assert!(lines.reason.contains("WELD_SPEED"), "{}", lines.reason);
}

#[test]
fn without_a_job_no_wire_is_assumed_in_the_verdict() {
    let dir = tempfile::tempdir().unwrap();
    let told = ["!Schedule 7 WFS 8.00 m/min"];
    let verdict = simulated(dir.path(), &told, None);
    for id in ["flatness", "height", "ctwd-min", "ctwd-max"] {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{id}");
        assert!(
            check.reason.contains("no job was given"),
            "{}",
            check.reason
        );
    }
    assert!(
        !verdict
            .facts
            .iter()
            .any(|f| f.id == "wire-mass" || f.id == "energy")
    );
}

/// A straight bead of 100 mm on a table that turns in the user frame, by the same angle for each step of it.
#[test]
fn coordinated_beads_are_laid_in_the_frame_of_the_part() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let mut text = "/PROG WALL\n/MN\n".to_owned();
    let mut lines = vec![
        "UFRAME_NUM=1".to_owned(),
        "UTOOL_NUM=1".to_owned(),
        "L P[1] 20mm/sec FINE Arc Start[7]".to_owned(),
    ];
    lines.extend((2..=10).map(|n| format!("L P[{n}] WELD_SPEED CNT50 COORD")));
    lines.push("L P[11] WELD_SPEED FINE COORD Arc End[7]".to_owned());
    for (n, line) in lines.iter().enumerate() {
        writeln!(text, "{:4}:{line} ;", n + 1).unwrap();
    }
    text += "/POS\n";
    for n in 0..11 {
        let (along, angle) = (10.0 * f64::from(n), 5.0 * f64::from(n));
        let (sine, cosine) = angle.to_radians().sin_cos();
        let [x, y] = [along * cosine, along * sine].map(|v| (v * 1e3).round() / 1e3);
        writeln!(
            text,
            "P[{}]{{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = {x} mm, Y = {y} mm, Z = 0 mm, \
             W = 180 deg, P = 0 deg, R = 0 deg\n GP2:\n UF : 1, UT : 1,\n J1= {angle} deg\n}};",
            n + 1
        )
        .unwrap();
    }
    text += "/END\n";
    let program = write(dir.path(), "wall.ls", text);
    let verdict = |name: &str| {
        let runs = dir.path().join(name);
        simulate_program(&program, Some(&job), NextIn(&runs), &Silent)
            .unwrap()
            .verdict
    };
    let unknown = verdict("unknown");
    assert_eq!(check(&unknown, "lines").status, Status::CannotSay);
    let cell = dir.path().join("cell.toml");
    let known = std::fs::read_to_string(&cell).unwrap()
        + "[program.positioner]\nsource = \"test\"\nuser_frame = \"base\"\n\
           [[program.positioner.axis]]\norigin = [\"0 mm\", \"0 mm\", \"0 mm\"]\ndirection = [0, 0, 1]\n";
    std::fs::write(&cell, known).unwrap();
    let known = verdict("known");
    assert_eq!(check(&known, "lines").status, Status::Pass);
    // 100 mm at 12.5 mm/s, though the arm goes another way
    let arc = known.facts.iter().find(|f| f.id == "time-arc").unwrap();
    assert!(
        (arc.value.as_ref().unwrap().value * 60.0 - 8.0).abs() < 0.5,
        "{arc:?}"
    );
    let lack = check(&known, "ctwd-max");
    assert_eq!(lack.status, Status::CannotSay, "{lack:?}");
    assert!(
        lack.reason.contains("a positioner turns the part"),
        "{lack:?}"
    );
}

/// The plate holds beads from their starts on, and arcs with their bulge: no metal is lost where every bead goes the same way, or round.
#[test]
fn all_metal_of_beads_that_go_one_way_or_round_is_laid() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let down = |x: f64, y: f64, z: f64| [x, y, z, 180.0, 0.0, 0.0];
    let straight = [
        "J P[1] 20% FINE",
        "L P[2] 20mm/sec FINE Arc Start[7]",
        "L P[3] 12mm/sec FINE Arc End[7]",
    ];
    let places = [
        down(0.0, 0.0, 60.0),
        down(0.0, 0.0, 0.0),
        down(100.0, 0.0, 0.0),
    ];
    let round = [
        "J P[1] 20% FINE",
        "L P[2] 20mm/sec FINE Arc Start[7]",
        "C P[3]\n    :  P[4] 12mm/sec CNT50",
        "C P[5]\n    :  P[2] 12mm/sec FINE Arc End[7]",
    ];
    let circle = [
        down(50.0, 0.0, 60.0),
        down(50.0, 0.0, 0.0),
        down(0.0, 50.0, 0.0),
        down(-50.0, 0.0, 0.0),
        down(0.0, -50.0, 0.0),
    ];
    for (name, lines, places) in [
        ("straight", &straight[..], &places[..]),
        ("round", &round, &circle),
    ] {
        let program = posed(dir.path(), lines, places);
        let runs = dir.path().join(name);
        let outcome = simulate_program(&program, Some(&job), NextIn(&runs), &Silent).unwrap();
        let lost = outcome.verdict.warnings.iter();
        let lost: Vec<_> = lost.filter(|w| w.message.contains("fell beside")).collect();
        assert!(lost.is_empty(), "{name}: {lost:?}");
        let height = check(&outcome.verdict, "height").value.as_ref().unwrap();
        assert!(height.value < 0.6, "{name}: {height:?}");
        // the feed of the program's schedule, whatever the job's bead is
        let mut facts = outcome.verdict.facts.iter();
        let feed = facts.find(|f| f.id == "wire-feed").unwrap();
        assert!(feed.reason.contains(", 8.00 programmed"), "{feed:?}");
    }
}

/// Metal is laid as by an upright torch: one that leans farther than beads were tried at decides nothing, one that points up least of all.
#[test]
fn a_torch_that_leans_far_cannot_be_decided_about() {
    let dir = tempfile::tempdir().unwrap();
    let job = job(dir.path());
    let lines = [
        "J P[1] 20% FINE",
        "L P[2] 20mm/sec FINE Arc Start[7]",
        "L P[3] 12mm/sec FINE Arc End[7]",
    ];
    let mut upright: Option<Verdict> = None;
    for (w, p, told) in [
        (180.0, 0.0, None),
        (180.0, 14.0, None),
        (180.0, 20.0, Some("leans by 20.0 deg")),
        (192.0, 0.0, Some("leans by 12.0 deg")),
        (0.0, 0.0, Some("leans by 180.0 deg")),
    ] {
        let places = [[0.0, 60.0], [0.0, 0.0], [100.0, 0.0]];
        let places = places.map(|[x, z]| [x, 0.0, z, w, p, 0.0]);
        let program = posed(dir.path(), &lines, &places);
        let runs = dir.path().join(format!("runs-{w}-{p}"));
        let outcome = simulate_program(&program, Some(&job), NextIn(&runs), &Silent).unwrap();
        for id in METAL {
            let check = check(&outcome.verdict, id);
            if let Some(told) = told {
                assert_eq!(check.status, Status::CannotSay, "{w} {p} {id}");
                assert!(check.reason.contains(told), "{}", check.reason);
            } else {
                // it is told, and decided all the same
                assert_eq!(check.reason.contains("leans"), p > 0.0, "{check:?}");
                let upright = upright
                    .as_ref()
                    .map(|v| crate::support::check(v, id).status);
                assert_eq!(check.status, upright.unwrap_or(check.status), "{check:?}");
            }
        }
        upright.get_or_insert(outcome.verdict);
    }
}
