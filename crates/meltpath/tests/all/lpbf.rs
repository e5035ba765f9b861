//! Scan-head jobs from their files to the folder of results.

mod data_sheet;
mod filled;
mod friction;
mod heat;
mod marked_again;
mod options;
mod paced;
mod promised;
mod refused;
mod section;

use crate::support::{check, write};
use std::fs;
use std::path::{Path, PathBuf};

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Silent, Status};
use meltpath_geometry::math::DVec2;
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_programs::cli::{self, Form};
use meltpath_programs::vectors;
use meltpath_scan_head::files;
use meltpath_scan_head::head::job::prepare;
use meltpath_toolpath::{Channel, Layer, PassHead, Role};

const THREE: &str = meltpath_data::scan_heads::THREE_AXIS_350.text;
const INDUSTRIAL: &str = meltpath_data::recipes::INDUSTRIAL.text;
const JOB: &str = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"two-axis-150\"\nrecipes = [\"industrial\"]\ndelays = \"recipe\"\n";

/// Runs a job text in `folder`; the folder of results.
fn run(folder: &Path, name: &str, text: &str) -> PathBuf {
    let job = write(folder, format!("{name}.toml"), text);
    let out = folder.join(name);
    chain::run(&job, At(&out), &Silent).unwrap();
    out
}

fn refused(folder: &Path, text: &str) -> String {
    let job = write(folder, "wrong.toml", text);
    let out = folder.join("wrong");
    let error = chain::run(&job, At(&out), &Silent).unwrap_err();
    assert!(!out.exists(), "nothing is left behind");
    error.to_string()
}

/// The figures of the row of the report's first table whose name begins so, one a recipe.
fn figures(out: &Path, name: &str) -> Vec<f64> {
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    let begin = page.find(&format!("<td>{name}")).unwrap();
    let row = &page[begin..begin + page[begin..].find("</tr>").unwrap()];
    row.split("</td>")
        .skip(1)
        .filter_map(|cell| cell.rsplit('>').next().and_then(|text| text.parse().ok()))
        .collect()
}

/// A value of the verdict, of a check or of a fact.
fn value(out: &Path, id: &str) -> f64 {
    let text = fs::read_to_string(out.join("verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&text).unwrap();
    let [checks, facts] = ["checks", "facts"].map(|key| verdict[key].as_array().unwrap());
    let found = checks.iter().chain(facts).find(|c| c["id"] == id).unwrap();
    found["value"]["value"].as_f64().unwrap()
}

/// What the verdict says of the first recipe: share of contour points, fill rate.
fn shares(out: &Path) -> [f64; 2] {
    ["contour-1", "fill-1"].map(|id| value(out, id))
}

/// Small squares as layers of a CLI file, moved by `shift`.
fn squares(plate: &SquarePlate, layers: u32, shift: DVec2) -> Vec<Layer> {
    let layer = |number: u32| {
        let mut layer = Layer::new(number, 0.03 * f64::from(number));
        for part in 0..plate.squares() {
            let half = 0.5 * plate.side;
            let ring = [
                (1.0, -1.0),
                (1.0, 1.0),
                (-1.0, 1.0),
                (-1.0, -1.0),
                (1.0, -1.0),
            ]
            .map(|(x, y)| plate.centre(part) + shift + DVec2::new(x, y) * half);
            let mut head = PassHead {
                part,
                role: Role::Contour,
                ..PassHead::default()
            };
            layer.polyline(head, ring.map(|p| p.extend(0.0)));
            head.role = Role::Fill;
            for line in plate.hatch_lines(part) {
                layer.polyline(head, line.map(|p| (p + shift).extend(0.0)));
            }
        }
        layer
    };
    (1..=layers).map(layer).collect()
}

fn cli_file(layers: &[Layer], form: Form) -> Vec<u8> {
    let mut bytes = Vec::new();
    let parts = [(0, "first".to_owned())].into();
    let mut writer = cli::Writer::new(&mut bytes, form, &parts, Some(layers.len())).unwrap();
    for layer in layers {
        writer.layer(layer).unwrap();
    }
    writer.finish().unwrap();
    bytes
}

fn small() -> SquarePlate {
    let head = files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text).unwrap();
    SquarePlate {
        columns: 2,
        rows: 1,
        column_pitch: head.plate.column_pitch.0,
        row_pitch: head.plate.row_pitch.0,
        side: 2.0,
        contour_distance: head.plate.contour_distance.0,
        hatch: head.plate.hatch.0,
        inset: head.plate.inset.0,
    }
}

#[test]
fn layers_of_a_cli_file_run_as_text_and_as_binary() {
    let dir = tempfile::tempdir().unwrap();
    let shift = DVec2::new(75.0, 75.0);
    let layers = squares(&small(), 3, shift);
    for (name, form) in [("a.cli", Form::Ascii), ("b.cli", Form::Binary)] {
        fs::write(dir.path().join(name), cli_file(&layers, form)).unwrap();
    }
    let job = |file: &str| {
        format!(
            "{JOB}layers = \"{file}\"\n[layers]\nrange = [2, 3]\norigin = [\"75 mm\", \"75 mm\"]\n[output]\nmotion = \"csv\"\n"
        )
    };
    let (a, b) = (
        run(dir.path(), "a", &job("a.cli")),
        run(dir.path(), "b", &job("b.cli")),
    );
    let found = shares(&a);
    assert!(found[1] > 40.0, "{found:?}");
    // coordinates of binary files have 32 bits
    for (x, y) in found.iter().zip(shares(&b)) {
        assert!((x - y).abs() < 1.0, "{x} {y}");
    }
    let motion = fs::read_to_string(a.join("series/motion-1.csv")).unwrap();
    let mut lines = motion.lines();
    assert_eq!(
        lines.next().unwrap(),
        "time_s,x_mm,y_mm,z_mm,speed_mm_s,power_W,vector"
    );
    let rows: Vec<Vec<f64>> = lines
        .map(|l| l.split(',').map(|f| f.parse().unwrap()).collect())
        .collect();
    let heights: Vec<f64> = [rows.first().unwrap()[3], rows.last().unwrap()[3]].to_vec();
    assert_eq!(heights, [0.06, 0.09]);
    // energy: the power of lit samples only, for about the time that marks take
    let energy: f64 = rows.iter().map(|r| r[5]).sum::<f64>() * 50e-6;
    let most = rows.iter().map(|r| r[5]).fold(0.0, f64::max);
    assert!(energy > 0.0 && energy < most * rows.len() as f64 * 50e-6);
    assert!(rows.iter().any(|r| r[5] == 0.0));
    // the part lies where the job puts it, but for light before the first jump has settled
    let lit = rows.iter().filter(|r| r[5] > 0.0);
    let reach = lit.map(|r| r[1].abs()).fold(0.0, f64::max);
    let plate = small();
    assert!(
        (reach - (0.5 * plate.column_pitch + 1.0)).abs() < 0.6,
        "{reach}"
    );
    let page = fs::read_to_string(a.join("report.html")).unwrap();
    assert!(page.contains("2 layers of 3, 2 to 3, of a.cli"));
}

/// A head's motor that left more than noise of its record: no verdict on that head passes.
#[test]
fn a_motor_with_a_misfit_leaves_the_verdict_open() {
    let dir = tempfile::tempdir().unwrap();
    let head = meltpath_data::scan_heads::TWO_AXIS_150.text;
    let misfit = "[x]\nmisfit = { value = \"3.5 1\", source = \"identified from bench.csv\" }\n";
    write(dir.path(), "head.toml", head.replacen("[x]\n", misfit, 1));
    let layers = squares(&small(), 1, DVec2::ZERO);
    fs::write(dir.path().join("a.cli"), cli_file(&layers, Form::Ascii)).unwrap();
    let job = JOB.replace("two-axis-150", "head.toml") + "layers = \"a.cli\"\n";
    let job = write(dir.path(), "job.toml", job);
    let outcome = chain::run(&job, At(&dir.path().join("out")), &Silent).unwrap();
    let found = check(&outcome.verdict, "x-motor");
    assert_eq!(found.status, Status::CannotSay, "{found:?}");
    assert_eq!(found.value.as_ref().map(|v| v.value), Some(3.5));
    assert!(!matches!(
        outcome.verdict.status(),
        Status::Pass | Status::Warn
    ));
    assert!(outcome.verdict.checks.iter().all(|c| c.id != "y-motor"));
}

/// A layer of a CLI file in text, each unit a micrometre.
fn micrometres(entities: &[String]) -> String {
    format!(
        "$$HEADERSTART\n$$ASCII\n$$UNITS/0.001\n$$VERSION/200\n$$LAYERS/1\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/30\n{}\n$$GEOMETRYEND\n",
        entities.join("\n")
    )
}

fn polyline(points: &[[i64; 2]]) -> String {
    let numbers: Vec<String> = points.iter().flatten().map(ToString::to_string).collect();
    format!("$$POLYLINE/1,2,{},{}", points.len(), numbers.join(","))
}

fn hatches(lines: &[[i64; 4]]) -> String {
    let numbers: Vec<String> = lines.iter().flatten().map(ToString::to_string).collect();
    format!("$$HATCHES/1,{},{}", lines.len(), numbers.join(","))
}

#[test]
fn layers_of_other_hatchers_run_whatever_their_marks() {
    let dir = tempfile::tempdir().unwrap();
    // a square with doubled points and a step of a micrometre
    let outline = polyline(&[
        [0, 0],
        [0, 0],
        [2000, 0],
        [2001, 0],
        [2001, 2000],
        [2001, 2000],
        [0, 2000],
        [0, 0],
    ]);
    let lines: Vec<[i64; 4]> = (1..20).map(|k| [100, 100 * k, 1900, 100 * k]).collect();
    // islands of half a millimetre, each with specks of a few micrometres and one without length at its corner
    let islands: Vec<String> = (0..4)
        .map(|i| {
            let at = [500 * i, 700 * i];
            let mut lines: Vec<[i64; 4]> = (0..5)
                .map(|k| [at[0], at[1] + 90 * k, at[0] + 450, at[1] + 90 * k])
                .collect();
            for length in [0, 1, 4, 30] {
                let y = at[1] + 460;
                lines.push([at[0], y, at[0] + length, y]);
            }
            hatches(&lines)
        })
        .collect();
    let far = |points: &[[i64; 2]]| {
        let moved: Vec<[i64; 2]> = points.iter().map(|p| p.map(|c| c + 400_000_000)).collect();
        polyline(&moved)
    };
    for (name, entities, origin) in [
        ("contours", vec![outline.clone()], 1.0),
        ("lines", vec![hatches(&lines)], 1.0),
        ("both", vec![outline, hatches(&lines)], 1.0),
        ("islands", islands, 1.0),
        (
            "far",
            vec![far(&[[0, 0], [2000, 0], [2000, 2000], [0, 0]])],
            400_001.0,
        ),
    ] {
        fs::write(
            dir.path().join(format!("{name}.cli")),
            micrometres(&entities),
        )
        .unwrap();
        let job = |delays: &str| {
            let first = JOB.replace("\"recipe\"", &format!("\"{delays}\""));
            format!(
                "{first}layers = \"{name}.cli\"\n[layers]\norigin = [\"{origin} mm\", \"{origin} mm\"]\n[checks]\nfill_rate = \"20 %\"\n"
            )
        };
        let out = run(dir.path(), name, &job("recipe"));
        let verdict = fs::read_to_string(out.join("verdict.json")).unwrap();
        let filled = name != "contours" && name != "far";
        assert!(verdict.contains("\"fill-1\""), "{name}: {verdict}");
        let nothing = verdict.contains("checks.fill_rate asks for a fill");
        assert_ne!(nothing, filled, "{name}: {verdict}");
        assert_eq!(
            verdict.contains("short-marks"),
            !matches!(name, "lines" | "far"),
            "{name}"
        );
    }
}

/// Lines that a file lost are missed in what its contours enclose, though what lies beside the others is filled as well as before; a ring
/// round nothing does not count, for nobody says that it is to be filled.
#[test]
fn lines_that_are_missing_are_missed_in_the_fill() {
    let dir = tempfile::tempdir().unwrap();
    let square = |low: i64, high: i64| {
        polyline(&[
            [low, low],
            [high, low],
            [high, high],
            [low, high],
            [low, low],
        ])
    };
    let lines = |kept: fn(i64) -> bool| {
        let all = (1..30).filter(|k| kept(*k));
        let lines: Vec<[i64; 4]> = all.map(|k| [80, 70 * k, 2020, 70 * k]).collect();
        hatches(&lines)
    };
    let fill = |name: &str, entities: &[String]| {
        fs::write(
            dir.path().join(format!("{name}.cli")),
            micrometres(entities),
        )
        .unwrap();
        let job =
            format!("{JOB}layers = \"{name}.cli\"\n[layers]\norigin = [\"1 mm\", \"1 mm\"]\n");
        value(&run(dir.path(), name, &job), "fill-1")
    };
    let whole = fill("whole", &[square(0, 2100), lines(|_| true)]);
    let lacks = fill("lacks", &[square(0, 2100), lines(|k| k % 3 != 0)]);
    let beside = fill("beside", &[lines(|k| k % 3 != 0)]);
    assert!(lacks < whole - 8.0, "{whole} {lacks}");
    assert!(beside > lacks + 4.0, "{beside} {lacks}");
    let ring = [square(0, 2100), lines(|_| true), square(3000, 5000)];
    let besides = fill("ring", &ring);
    assert!((besides - whole).abs() < 4.0, "{whole} {besides}");
}

/// A plate written as a vector list with every value of its recipe gives the plate's own figures.
#[test]
fn a_vector_list_does_what_the_plate_does() {
    let dir = tempfile::tempdir().unwrap();
    let recipe = files::parse_recipe(INDUSTRIAL).unwrap();
    let path = small().toolpath().unwrap();
    let job = prepare(&path.layers, &recipe).unwrap();
    let mut layer = Layer::new(7, 0.21);
    let mut at = job.start;
    for v in &job.vectors {
        let head = PassHead {
            part: v.block,
            role: v.kind,
            ..PassHead::default()
        };
        let mut pass = layer.begin(head, at);
        pass.line_to(v.end).set(Channel::Speed, v.speed);
        pass.set(Channel::Power, v.power)
            .set(Channel::Dwell, v.wait);
        at = v.end;
    }
    let mut list = Vec::new();
    let mut writer = vectors::Writer::new(&mut list).unwrap();
    writer.layer(&layer).unwrap();
    writer.finish().unwrap();
    fs::write(dir.path().join("v.csv"), list).unwrap();
    let listed = run(dir.path(), "listed", &format!("{JOB}layers = \"v.csv\"\n"));
    let plate = run(
        dir.path(),
        "plate",
        &format!("{JOB}[plate]\nblock = [2, 1]\nside = \"2 mm\"\n"),
    );
    // the contour share is the same to the bit; surfaces to fill are not defined in the same way
    assert_eq!(shares(&listed)[0].to_bits(), shares(&plate)[0].to_bits());
    let path = |out: &Path| fs::read_to_string(out.join("marked-path-1.csv")).unwrap();
    let (a, b) = (path(&listed), path(&plate));
    assert!(
        a.starts_with(&b[..b.len() - 1]),
        "the plate's file ends after its first square"
    );
    let page = fs::read_to_string(listed.join("report.html")).unwrap();
    assert!(page.contains("layer 7 of 1 of v.csv"));
}

#[test]
fn layers_that_cannot_be_run_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let layers = squares(&small(), 2, DVec2::new(200.0, 0.0));
    let text = cli_file(&layers, Form::Ascii);
    fs::write(dir.path().join("far.cli"), &text).unwrap();
    fs::write(dir.path().join("cut.cli"), &text[..text.len() / 2]).unwrap();
    fs::write(
        dir.path().join("bad.csv"),
        "kind,x [mm],y [mm]\nstart,0,0\nfill,a,0\n",
    )
    .unwrap();
    fs::write(
        dir.path().join("dark.csv"),
        "kind,x [mm],y [mm]\nstart,0,0\njump,1,0\n",
    )
    .unwrap();
    fs::write(dir.path().join("a.step"), "x").unwrap();
    for (name, more, words) in [
        ("none.cli", "", "cannot read the layers"),
        ("a.step", "", ".cli files"),
        ("cut.cli", "", "layer file"),
        ("bad.csv", "", "line 3"),
        ("dark.csv", "", "marks nothing"),
        ("far.cli", "[layers]\nrange = [5, 9]\n", "the layers 1 to 2"),
        ("far.cli", "", "field"),
    ] {
        let error = refused(dir.path(), &format!("{JOB}layers = \"{name}\"\n{more}"));
        assert!(error.contains(words), "{name}: {error}");
    }
    // what cannot run is no news after a doctor, who tells it too
    let doctor = |more: &str| {
        let path = write(
            dir.path(),
            "seen.toml",
            format!("{JOB}layers = \"far.cli\"\n{more}"),
        );
        chain::doctor(&path, &Silent).unwrap()
    };
    let refused = doctor("").refused.unwrap();
    assert!(refused.to_string().contains("field"));
    let told = doctor("[layers]\norigin = [\"200 mm\", \"0 mm\"]\n");
    assert!(
        told.refused.is_none() && told.lines.iter().any(|l| l.starts_with("range = [")),
        "{told:?}"
    );
}

/// The found recipe keeps its bounds on the work that is run, not only on the small one it was found on, and is faster.
#[test]
fn a_faster_recipe_is_found_and_run() {
    let dir = tempfile::tempdir().unwrap();
    // the mirrors settle from their jumps: light would lie where no mark is
    let shipped = meltpath_data::recipes::INDUSTRIAL.text;
    let waits = shipped.replace(
        "jump_wait = { value = \"0 ms\"",
        "jump_wait = { value = \"1 ms\"",
    );
    assert_ne!(waits, shipped);
    fs::write(dir.path().join("waits.toml"), waits).unwrap();
    let text = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"two-axis-150\"\nrecipes = [\"waits.toml\"]\n\
        [plate]\nblock = [2, 1]\nside = \"3 mm\"\n[checks]\ncontour_error = \"300 µm\"\ncontour_share = \"80 %\"\n\
        [optimise]\nmark_waits = [\"0.5 ms\", \"1.5 ms\"]\nfilter_factors = [\"100 %\"]\njump_factors = [\"100 %\"]\n";
    let out = run(dir.path(), "best", text);
    let saved = value(&out, "optimise");
    assert!(saved > 5.0, "{saved}");
    let of = value;
    let value = |id: &str| of(&out, id);
    assert!(value("contour-2") >= 80.0, "{}", value("contour-2"));
    assert!(
        value("fill-2") >= value("fill-1") - 2.0,
        "{} {}",
        value("fill-2"),
        value("fill-1")
    );
    // the found recipe is a recipe file: run from it, it does the same
    let found = fs::read_to_string(out.join("recipe-optimised.toml")).unwrap();
    files::parse_recipe(&found).unwrap().check().unwrap();
    let again = text
        .split_once("[optimise]")
        .unwrap()
        .0
        .replace("waits.toml", "found.toml");
    let again = again.replace("[plate]", "delays = \"recipe\"\n[plate]");
    fs::write(dir.path().join("found.toml"), &found).unwrap();
    let same = run(dir.path(), "again", &again);
    for id in ["contour", "stray", "unlit"] {
        let alone = of(&same, &format!("{id}-1"));
        let judged = value(&format!("{id}-2"));
        assert!(
            (alone - judged).abs() < 0.02 * judged.abs() + 1e-3,
            "{id}: {alone} {judged}"
        );
    }
    assert!(super::names::in_style(&out) > 10);
    let tried = fs::read_to_string(out.join("series/recipes-tried.csv")).unwrap();
    assert!(tried.lines().count() > 10);
    assert!(out.join("series/delays-2.csv").exists());

    // bounds that nothing keeps are told with the nearest
    let out = run(
        dir.path(),
        "none",
        &text
            .replace("\"80 %\"", "\"100 %\"")
            .replace("\"300 µm\"", "\"1 µm\""),
    );
    let page = fs::read_to_string(out.join("verdict.json")).unwrap();
    assert!(page.contains("keeps the bounds; the nearest has"), "{page}");
    assert!(!out.join("recipe-optimised.toml").exists());
}
