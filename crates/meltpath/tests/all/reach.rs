//! Jobs that name a robot: their programs carry its configuration, and their verdicts say where it reaches and what it may touch.

use std::path::{Path, PathBuf};

use crate::support::{check, thin_wall, write};
use meltpath::job::PartUnit;
use meltpath::outcome::RunFolder::NextIn;
use meltpath::reach::{Found, Map};
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Reporter, Silent, Status, Verdict};
use meltpath_data::robots;
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

/// The first layers of the thin wall, with lines under `[machine]`.
fn job(folder: &Path, machine: &str) -> PathBuf {
    let machine = format!("[layers]\ncount = 3\n[machine]\n{machine}\n");
    thin_wall(folder, &format!("{machine}[simulation]\ncell = \"1 mm\"\n"))
}

/// The ARC Mate as if it had been measured.
pub(crate) fn measured(folder: &Path) -> &'static str {
    let text = robots::FANUC_ARCMATE_120IC.text;
    let (arm, around) = text.split_once("\n[torch]").unwrap();
    let (arm, _) = arm.split_once("\n# A table that tilts").unwrap();
    let text = format!("{arm}\n[torch]\nsource = \"measured\"\n{around}")
        .replace("[shapes]", "[shapes]\nsource = \"measured\"\n#");
    let table =
        "\n[table]\nsource = \"measured\"\nposition = [\"1100 mm\", \"0 mm\", \"500 mm\"]\n";
    std::fs::write(folder.join("robot.toml"), text + table).unwrap();
    "robot = \"robot.toml\""
}

fn verdict(folder: &Path, machine: &str) -> (Verdict, PathBuf) {
    let job = job(folder, machine);
    let outcome = run(&job, NextIn(&folder.join("runs")), &Silent).unwrap();
    (outcome.verdict, outcome.folder)
}

fn program(folder: &Path) -> (PathBuf, String) {
    let files = std::fs::read_dir(folder.join("program")).unwrap();
    let path = files.map(|f| f.unwrap().path()).next().unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    (path, text)
}

#[test]
fn multiaxis_ma9_a_job_that_names_a_robot_is_judged() {
    let dir = tempfile::tempdir().unwrap();
    let (verdict, folder) = verdict(dir.path(), measured(dir.path()));
    for id in ["reach", "joint-speed", "collision", "config"] {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::Pass, "{check:?}");
        println!("{id}: {}", check.line());
    }
    let collision = check(&verdict, "collision");
    assert_eq!(collision.reason, "nozzle and part");
    let pairs = verdict.facts.iter().find(|f| f.id == "clearances").unwrap();
    for pair in [
        "nozzle and part",
        "torch and part",
        "nozzle and table",
        "link 3 and table",
    ] {
        assert!(pairs.reason.contains(pair), "{pair}: {pairs:?}");
    }
    // the contact tube stands 15 mm over the plate and less over the metal
    let distance = collision.value.as_ref().unwrap().value;
    assert!(distance > 5.0 && distance < 15.0, "{distance}");
    assert!(
        check(&verdict, "reach")
            .place
            .as_ref()
            .unwrap()
            .layer
            .is_some()
    );
    assert!(verdict.facts.iter().any(|f| f.id == "singular-wrist"));
    // what is written is computed, and the same everywhere
    let (_, text) = program(&folder);
    let words: Vec<&str> = text
        .lines()
        .filter_map(|l| l.split("CONFIG : ").nth(1))
        .collect();
    assert!(words.len() >= 3 * 3, "{words:?}");
    let told = check(&verdict, "config").reason.clone();
    assert!(
        words
            .iter()
            .all(|w| told.contains(w.trim_matches(|c| c == '\'' || c == ','))),
        "{told} {words:?}"
    );
}

/// Beads are measured level: on a table that leans flat layers are not decided about, planned here or read from a program.
#[test]
fn flat_layers_on_a_table_that_leans_cannot_be_said() {
    let dir = tempfile::tempdir().unwrap();
    let machine = measured(dir.path());
    let robot = std::fs::read_to_string(dir.path().join("robot.toml")).unwrap();
    let leaning = robot + "angles = [\"0 deg\", \"20 deg\", \"0 deg\"]\n";
    std::fs::write(dir.path().join("robot.toml"), leaning).unwrap();
    let (silent, folder) = verdict(dir.path(), machine);
    let (file, _) = program(&folder);
    let read = simulate_program(
        &file,
        Some(&job(dir.path(), machine)),
        NextIn(&dir.path().join("read")),
        &Silent,
    );
    for told in [&silent, &read.unwrap().verdict] {
        let tilt = check(told, "tilt");
        assert_eq!(tilt.status, Status::CannotSay, "{tilt:?}");
        assert!((tilt.value.as_ref().unwrap().value - 20.0).abs() < 1e-9);
        let metal = check(told, "ctwd-min");
        assert_eq!(metal.status, Status::CannotSay, "{metal:?}");
        assert!(metal.reason.contains("20.0 deg from level"), "{metal:?}");
    }
    let limits = format!("{machine}\n[checks]\ntilt = \"10 deg\"");
    let (limited, _) = verdict(dir.path(), &limits);
    assert_eq!(check(&limited, "tilt").status, Status::Fail);
}

/// The arm stands as near as the job's contact tube distance asks, however long the wire of its file is.
#[test]
fn collisions_are_looked_for_at_the_distance_of_the_job() {
    let dir = tempfile::tempdir().unwrap();
    let machine = measured(dir.path());
    let at = |more: &str| {
        let (verdict, _) = verdict(dir.path(), &format!("{machine}{more}"));
        let collision = check(&verdict, "collision").value.as_ref().unwrap().value;
        let told = verdict.warnings.iter().any(|w| w.code == "robot-wire");
        (collision, told)
    };
    let (far, silent) = at("");
    let (near, told) = at("\nctwd = \"11 mm\"\n[checks]\nctwd_min = \"5 mm\"");
    assert!(told && !silent);
    // the nozzle is the nearest and ends with the tube: it comes nearer by what the wire is shorter, less what layers are lower that a
    // nearer tube feeds less for
    assert!(
        near < 11.0 && (2.0..4.5).contains(&(far - near)),
        "{far} {near}"
    );
}

#[test]
fn a_part_out_of_reach_fails_with_place_and_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let place = "\nplace = [\"2 m\", \"0 mm\", \"0 mm\"]";
    let (verdict, _) = verdict(dir.path(), &format!("{}{place}", measured(dir.path())));
    let reach = check(&verdict, "reach");
    assert_eq!(reach.status, Status::Fail, "{reach:?}");
    assert!(reach.reason.contains("too far by"), "{reach:?}");
    let remedy = reach.remedy.as_ref().unwrap();
    assert!(remedy.contains("machine.place"));
    // what helps is said once
    let said = format!("{} {remedy}", reach.reason);
    assert_eq!(said.matches("move the part").count(), 1, "{said}");
    assert!(reach.place.as_ref().unwrap().position.is_some());
    assert_eq!(check(&verdict, "collision").status, Status::NotChecked);
}

/// Nothing passes by the guesses of a robot that ships; without a robot the lines say what to write.
#[test]
fn guesses_do_not_pass_and_no_robot_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let (verdict, _) = verdict(dir.path(), "robot = \"fanuc-arcmate-120ic\"");
    for id in ["reach", "joint-speed", "collision"] {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        assert!(check.reason.contains("torch"), "{check:?}");
    }
    assert_eq!(check(&verdict, "config").status, Status::Pass);
    let (verdict, _) = self::verdict(dir.path(), "");
    for id in ["reach", "collision", "config"] {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::NotChecked);
        assert!(check.reason.contains("machine.robot"), "{check:?}");
    }
}

/// A program is judged by the CONFIG that it carries: its own passes, one that is wrong somewhere fails there.
#[test]
fn a_program_with_a_wrong_configuration_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let machine = measured(dir.path());
    let (_, folder) = verdict(dir.path(), machine);
    let job = job(dir.path(), machine);
    let (path, text) = program(&folder);
    let judged = |name: &str, text: &str| {
        let path = path.with_file_name(name);
        std::fs::write(&path, text).unwrap();
        simulate_program(&path, Some(&job), NextIn(&dir.path().join("runs")), &Silent)
            .unwrap()
            .verdict
    };
    let own = judged("OWN.LS", &text);
    assert_eq!(check(&own, "config").status, Status::Pass);
    assert_eq!(check(&own, "reach").status, Status::Pass);
    let at = text.rfind("CONFIG : '").unwrap() + "CONFIG : '".len();
    let flipped = if text[at..].starts_with('N') {
        "F"
    } else {
        "N"
    };
    let wrong = format!("{}{flipped}{}", &text[..at], &text[at + 1..]);
    let wrong = judged("WRONG.LS", &wrong);
    let config = check(&wrong, "config");
    assert_eq!(config.status, Status::Fail, "{config:?}");
    assert!((config.value.as_ref().unwrap().value - 1.0).abs() < 1e-12);
}

/// The map's best place is one where the part is held, and places beyond the arm are not.
#[test]
fn a_map_tells_where_a_part_can_stand() {
    let wall = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/thin-wall/wall.stl");
    let map = |robot: &str| {
        let unit = PartUnit::Millimetre;
        meltpath::reach::reach(&wall, unit, robot, &Reporter::new(), &Silent)
    };
    let lines = map("staubli-rx60bl").unwrap().lines;
    let rows = lines[3..18].iter();
    let cells: Vec<&str> = rows.flat_map(|l| l.split_whitespace()).collect();
    assert_eq!(cells.len(), 15 * 15, "{lines:#?}");
    // the middle of its own table is where a shipped robot can work
    let middle: f64 = cells[7 * 15 + 7].parse().unwrap();
    assert!(middle > 5.0, "{lines:#?}");
    let best = lines.iter().find(|l| l.starts_with("best: place = ["));
    let told = best.unwrap().split("], ").nth(1).unwrap();
    let told: f64 = told.trim_end_matches(" deg").parse().unwrap();
    let greatest = cells.iter().filter_map(|c| c.parse::<f64>().ok());
    let greatest = greatest.fold(0.0, f64::max);
    assert!((told - greatest).abs() <= 0.5 + 1e-9, "{best:?} {greatest}");
    assert!(
        lines
            .iter()
            .any(|l| l.contains("GUESSED") && l.contains("torch"))
    );
    let nobody = map("nobody").unwrap_err().to_string();
    assert!(nobody.contains("kuka-kr16-r2010-2"), "{nobody}");
}

/// A map is that of the part in its unit.
#[test]
fn a_map_is_of_the_unit_of_the_part() {
    let dir = tempfile::tempdir().unwrap();
    let map = |size: f64, unit: PartUnit| {
        let part = shapes::cuboid(DVec3::ZERO, size * DVec3::new(8.0, 4.0, 2.0));
        let mut bytes = Vec::new();
        write_stl(&part, "part", &mut bytes).unwrap();
        let file = write(dir.path(), "part.stl", bytes);
        let robot = "fanuc-arcmate-120ic";
        meltpath::reach::reach(&file, unit, robot, &Reporter::new(), &Silent).unwrap()
    };
    let inches = map(1.0, PartUnit::Inch);
    assert_eq!(inches, map(25.4, PartUnit::Millimetre));
    assert_ne!(inches, map(1.0, PartUnit::Millimetre));
}

/// An arm of one's own, and a block on its table or in its flange.
fn map_of_a_block(around: &str, limits: [&str; 2]) -> Map {
    let dir = tempfile::tempdir().unwrap();
    let block = shapes::cuboid(DVec3::ZERO, DVec3::new(60.0, 40.0, 20.0));
    let mut bytes = Vec::new();
    write_stl(&block, "block", &mut bytes).unwrap();
    let part = write(dir.path(), "block.stl", bytes);
    let [low, high] = limits;
    let robot = format!(
        "name = \"arm\"\n{around}\n[arm]\nsource = \"sheet\"\nshoulder_height = \"500 mm\"\nshoulder_forward = \"150 mm\"\n\
         upper_arm = \"800 mm\"\nforearm = \"800 mm\"\nflange = \"120 mm\"\n[joints]\nsource = \"sheet\"\n{low}\n{high}\n"
    );
    let robot = write(dir.path(), "arm.toml", robot);
    let (unit, robot) = (PartUnit::Millimetre, robot.to_str().unwrap());
    meltpath::reach::reach(&part, unit, robot, &Reporter::new(), &Silent).unwrap()
}

const WIDE: [&str; 2] = [
    "low = [\"-170 deg\", \"-130 deg\", \"-150 deg\", \"-180 deg\", \"-120 deg\", \"-350 deg\"]",
    "high = [\"170 deg\", \"130 deg\", \"150 deg\", \"180 deg\", \"120 deg\", \"350 deg\"]",
];

fn best(map: &Map) -> [f64; 3] {
    let line = map.lines.iter().find(|l| l.starts_with("best: ")).unwrap();
    let numbers: Vec<f64> = line
        .split(['"', ' '])
        .filter_map(|w| w.parse().ok())
        .collect();
    [numbers[0], numbers[1], numbers[2]]
}

/// A part that the robot holds is held by the flange: its axis goes through the part, in the height that the file says.
#[test]
fn a_part_in_the_flange_is_not_held_far_aside() {
    let map = map_of_a_block(
        "arrangement = \"part-on-robot\"\ntorch = { position = [\"900 mm\", \"100 mm\", \"1200 mm\"], angles = [\"180 deg\", \"0 deg\", \"20 deg\"], source = \"me\" }\n\
         part = { position = [\"0 mm\", \"0 mm\", \"100 mm\"], source = \"me\" }",
        WIDE,
    );
    assert_eq!(map.found, Found::APlace, "{map:#?}");
    let text = map.lines.join("\n");
    assert!(text.contains("block.stl in the flange of arm"), "{text}");
    assert!(!text.contains("table"), "{text}");
    let [x, y, z] = best(&map);
    // the block begins at its corner
    assert!(
        (x + 30.0).abs() <= 30.0 && (y + 20.0).abs() <= 20.0,
        "{text}"
    );
    assert!((z - 100.0).abs() < 1e-9, "{text}");
}

/// A place that a run must refuse is told as such, with the joint, what is asked and what to change.
#[test]
fn a_place_without_the_room_that_a_run_asks_is_told() {
    let around = "torch = { position = [\"10 mm\", \"0 mm\", \"330 mm\"], angles = [\"0 deg\", \"35 deg\", \"0 deg\"], source = \"me\" }\n\
         table = { position = [\"1100 mm\", \"0 mm\", \"300 mm\"], source = \"me\" }\n\
         shapes = { links = [\"150 mm\", \"110 mm\", \"100 mm\", \"80 mm\", \"70 mm\", \"55 mm\"], torch = \"45 mm\", nozzle = [\"80 mm\", \"12 mm\"], table = [\"100 mm\", \"100 mm\"], source = \"me\" }";
    let wide = map_of_a_block(around, WIDE);
    assert_eq!(wide.found, Found::APlace, "{wide:#?}");
    assert!(
        !wide.lines.iter().any(|l| l.contains("a run fails")),
        "{wide:#?}"
    );
    // the first joint goes as far as the block needs, and no farther
    let tight = |first: f64| {
        let of = |line: &str, sign: &str| {
            line.replace(
                &format!("[\"{sign}170 deg"),
                &format!("[\"{sign}{first} deg"),
            )
        };
        let limits = [of(WIDE[0], "-"), of(WIDE[1], "")];
        map_of_a_block(around, [&limits[0], &limits[1]])
    };
    let map = (10..60)
        .map(|i| tight(0.2 * f64::from(i)))
        .find(|m| m.lines.iter().any(|l| l.starts_with("best: ")))
        .unwrap();
    assert_eq!(map.found, Found::NoPlace, "{map:#?}");
    let told = map
        .lines
        .iter()
        .find(|l| l.contains("a run fails there"))
        .unwrap();
    for part in [
        "joint 1 comes to",
        "a run asks for 2 deg (checks.joint_margin)",
        "Move the table",
    ] {
        assert!(told.contains(part), "{part} is not in {told}");
    }
    // and where no place is in reach at all
    assert_eq!(tight(0.5).found, Found::NoPlace);
}
