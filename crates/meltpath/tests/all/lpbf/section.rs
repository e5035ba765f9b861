//! Layers of a part, hatched and marked: what is drawn lies in the part, and what cannot be drawn is told at its place.

use std::fs;
use std::path::Path;

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::Silent;
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::{Mesh, shapes};

use super::{run, value};

fn write(folder: &Path, name: &str, mesh: &Mesh) {
    let mut bytes = Vec::new();
    write_stl(mesh, name, &mut bytes).unwrap();
    fs::write(folder.join(name), bytes).unwrap();
}

fn job(part: &str, more: &str) -> String {
    format!(
        "part = \"{part}\"\n[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"two-axis-150\"\nrecipes = [\"industrial\"]\ndelays = \"recipe\"\n{more}\n"
    )
}

/// Points of the first layer where the laser is on.
fn lit(out: &Path) -> Vec<DVec2> {
    let text = fs::read_to_string(out.join("marked-path-1.csv")).unwrap();
    let rows = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').collect::<Vec<_>>());
    rows.filter(|row| row[2] == "1")
        .map(|row| DVec2::new(row[0].parse().unwrap(), row[1].parse().unwrap()))
        .collect()
}

/// Length of all marks, mm.
fn marked(out: &Path) -> f64 {
    let text = fs::read_to_string(out.join("series/recipes.csv")).unwrap();
    let row = text.lines().find(|l| l.starts_with("\"mark length, m"));
    1000.0
        * row
            .unwrap()
            .rsplit(',')
            .next()
            .unwrap()
            .parse::<f64>()
            .unwrap()
}

/// A ring far from the origin of its file: it is marked round the centre of the field, and its hole stays powder. The lines are
/// as long as area and spacing ask for.
#[test]
fn a_ring_is_marked_round_the_centre_of_the_field() {
    let dir = tempfile::tempdir().unwrap();
    let mut ring = shapes::extrude(&[shapes::ring(4.0, 2.0, 96)], 3.0);
    for v in &mut ring.vertices {
        *v += DVec3::new(500.0, -200.0, 40.0);
    }
    write(dir.path(), "ring.stl", &ring);
    let told = "[section]\nheight = \"1 mm\"\n[hatch]\nspacing = \"0.1 mm\"\nangle = \"30 deg\"";
    let out = run(dir.path(), "ring", &job("ring.stl", told));
    let lit = lit(&out);
    assert!(lit.len() > 1000);
    // 0.2 mm: corners of lines, and what the head's lag leaves beside them
    let inside = lit.iter().filter(|p| (1.8..4.2).contains(&p.length()));
    assert!(inside.count() as f64 > 0.97 * lit.len() as f64);
    for side in [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y] {
        assert!(lit.iter().any(|p| p.distance(3.0 * side) < 0.3), "{side}");
    }
    let area = std::f64::consts::PI * 12.0;
    let marked = marked(&out);
    assert!((marked * 0.1 / area - 1.0).abs() < 0.06, "{marked} mm");
    assert!(value(&out, "fill-1") > 50.0);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("layer 25 of 75 of ring.stl"));
    let said = fs::read_to_string(out.join("provenance.json")).unwrap();
    assert!(said.contains("section.origin") && said.contains("ring.stl"));
    assert!(!said.contains("\"plate.") && !said.contains("\"layers."));
    // elsewhere in the field
    let aside = told.replace("[hatch]", "origin = [\"490 mm\", \"-200 mm\"]\n[hatch]");
    let out = run(dir.path(), "aside", &job("ring.stl", &aside));
    let lit = self::lit(&out);
    let far = lit.iter().filter(|p| p.x > 5.0).count();
    assert!(far as f64 > 0.97 * lit.len() as f64);
}

/// Several layers lie one over the other and are turned; all separate areas are marked, or the one that is chosen.
#[test]
fn layers_of_two_legs_are_marked_one_over_the_other() {
    let dir = tempfile::tempdir().unwrap();
    let mut legs = shapes::extrude(&[shapes::plate(2.0, 2.0)], 2.0);
    let other = shapes::extrude(&[shapes::plate(1.0, 1.0)], 2.0);
    let offset = legs.vertices.len() as u32;
    let moved = other.vertices.iter().map(|v| *v + DVec3::X * 5.0);
    legs.vertices.extend(moved);
    let triangles = other.triangles.iter().map(|t| t.map(|v| v + offset));
    legs.triangles.extend(triangles);
    write(dir.path(), "legs.stl", &legs);
    let told = "[section]\nlayers = 3\nlayer = \"0.05 mm\"\n[hatch]\nstrategy = \"one-way\"\nspacing = \"0.2 mm\"\n[output]\nmotion = \"csv\"";
    let out = run(dir.path(), "both", &job("legs.stl", told));
    let motion = fs::read_to_string(out.join("series/motion-1.csv")).unwrap();
    let rows: Vec<Vec<f64>> = motion
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|f| f.parse().unwrap()).collect())
        .collect();
    let mut heights: Vec<f64> = rows.iter().map(|r| r[3]).collect();
    heights.dedup();
    // the last holds the middle of the part
    let wanted = [0.9, 0.95, 1.0];
    assert!(
        heights.len() == 3
            && heights
                .iter()
                .zip(wanted)
                .all(|(a, b)| (a - b).abs() < 1e-9),
        "{heights:?}"
    );
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("3 layers of 40, 18 to 20, of legs.stl"));
    let both = marked(&out);
    let chosen = told.replace("layers = 3", "layers = 3\nisland = 2");
    let small = run(dir.path(), "small", &job("legs.stl", &chosen));
    let small = marked(&small);
    assert!((small / both - 0.2).abs() < 0.05, "{small} {both}");
}

/// Whether contours that have no room are told.
fn told_of_contours(out: &Path) -> bool {
    let verdict = fs::read_to_string(out.join("verdict.json")).unwrap();
    verdict.contains("contours-left-out")
}

/// A wall narrower than the spacing has one line, and of contours and islands what fits.
#[test]
fn a_wall_narrower_than_the_spacing_is_one_line() {
    let dir = tempfile::tempdir().unwrap();
    write(
        dir.path(),
        "wall.stl",
        &shapes::extrude(&[shapes::plate(6.0, 0.08)], 2.0),
    );
    let thin = "[hatch]\nspacing = \"0.1 mm\"\ncontours = 2";
    let out = run(dir.path(), "wall", &job("wall.stl", thin));
    let marked = marked(&out);
    assert!((marked - 5.9).abs() < 0.2, "{marked}");
    assert!(told_of_contours(&out));
    let plate = shapes::extrude(&[shapes::plate(6.0, 4.0)], 2.0);
    write(dir.path(), "plate.stl", &plate);
    let wide = "[hatch]\nspacing = \"0.5 mm\"\ncontours = 2";
    let out = run(dir.path(), "plate", &job("plate.stl", wide));
    assert!(!told_of_contours(&out));
    let far = wide.replace("0.5 mm", "3 mm");
    let out = run(dir.path(), "far", &job("plate.stl", &far));
    assert!(told_of_contours(&out));
    // a ring so thin that contours take it whole: they fill it as lines would
    let ring = shapes::extrude(&[shapes::ring(3.0, 2.7, 96)], 2.0);
    write(dir.path(), "thin.stl", &ring);
    let two = "[hatch]\nspacing = \"0.15 mm\"\ncontours = 2\n[checks]\nfill_rate = \"50 %\"";
    let out = run(dir.path(), "thin", &job("thin.stl", two));
    let verdict = fs::read_to_string(out.join("verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&verdict).unwrap();
    let checks = verdict["checks"].as_array().unwrap();
    let fill = checks.iter().find(|c| c["id"] == "fill-1").unwrap();
    let rate = fill["value"]["value"].as_f64().unwrap();
    assert!((20.0..90.0).contains(&rate), "{rate}");
}

/// Part, what the job says more, how the line begins that is to blame, and words of the refusal.
const REFUSED: [(&str, &str, &str, &str); 14] = [
    ("none.stl", "", "part = ", "none.stl"),
    ("sheet.stl", "", "part = ", "has no area"),
    (
        "block.stl",
        "[section]\nheight = \"2.5 mm\"",
        "height",
        "2.000 mm high",
    ),
    (
        "gap.stl",
        "[section]\nheight = \"3 mm\"",
        "height",
        "has no area",
    ),
    (
        "block.stl",
        "[section]\nisland = 2",
        "island",
        "1 separate areas",
    ),
    (
        "block.stl",
        "[section]\nlayer = \"3 mm\"",
        "part = ",
        "less than a layer",
    ),
    (
        "block.stl",
        "[hatch]\nspacing = \"40 mm\"",
        "spacing",
        "narrower than the spacing",
    ),
    ("wide.stl", "", "part = ", "leaves the head's field"),
    ("wide.stl", "", "part = ", "larger than the field"),
    (
        "block.stl",
        "[section]\norigin = [\"300 mm\", \"0 mm\"]",
        "part = ",
        "origin = [\"2.0 mm\"",
    ),
    (
        "block.stl",
        "[hatch]\nstrategy = \"islands\"\ncontours = 1",
        "contours",
        "not before islands",
    ),
    (
        "block.stl",
        "[hatch]\nstrategy = \"spots\"",
        "strategy",
        "one of \"lines\", \"one-way\", \"islands\"",
    ),
    (
        "block.stl",
        "[plate]\nside = \"3 mm\"",
        "[plate]",
        "a part and a plate",
    ),
    (
        "block.stl",
        "layers = \"a.cli\"",
        "layers",
        "a part and layers",
    ),
];

#[test]
fn parts_that_cannot_be_marked_are_refused_at_their_place() {
    let dir = tempfile::tempdir().unwrap();
    let block = shapes::extrude(&[shapes::plate(4.0, 4.0)], 2.0);
    write(dir.path(), "block.stl", &block);
    let wide = shapes::extrude(&[shapes::plate(400.0, 4.0)], 2.0);
    write(dir.path(), "wide.stl", &wide);
    let mut gap = shapes::extrude(&[shapes::plate(4.0, 4.0)], 2.0);
    let more = block.vertices.iter().map(|v| *v + DVec3::Z * 5.0);
    let offset = gap.vertices.len() as u32;
    gap.vertices.extend(more);
    let triangles = block.triangles.iter().map(|t| t.map(|v| v + offset));
    gap.triangles.extend(triangles);
    write(dir.path(), "gap.stl", &gap);
    let mut sheet = block.clone();
    sheet.triangles.truncate(2);
    write(dir.path(), "sheet.stl", &sheet);
    for (part, more, at, words) in REFUSED {
        let path = dir.path().join("job.toml");
        let text = job(part, more);
        fs::write(&path, &text).unwrap();
        let out = dir.path().join("out");
        let error = chain::run(&path, At(&out), &Silent).unwrap_err();
        assert!(!out.exists(), "nothing is left behind");
        let said = error.to_string();
        assert!(said.contains(words), "{part} {more}: {said}");
        let chain::RunError::Job(meltpath::job::JobError::Text { problems, .. }) = error else {
            panic!("{part} {more}: not at its place: {said}")
        };
        let span = problems[0].span.clone();
        let span = span.unwrap_or_else(|| panic!("{part} {more}: no place: {said}"));
        let line = text[..span.start].rfind('\n').map_or(0, |n| n + 1);
        assert!(
            text[line..].starts_with(at),
            "{part} {more}: {}",
            &text[span]
        );
        let before = chain::doctor(&path, &Silent).unwrap().refused.unwrap();
        assert_eq!(before.to_string(), said);
    }
}

/// A triangle is missing: it is told, and what cannot be closed is refused.
#[test]
fn an_open_mesh_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let mut open = shapes::extrude(&[shapes::plate(4.0, 4.0)], 2.0);
    open.triangles.pop();
    write(dir.path(), "open.stl", &open);
    let path = crate::support::write(dir.path(), "open.toml", job("open.stl", ""));
    let found = chain::doctor(&path, &Silent).unwrap();
    let said = found.lines.join("\n");
    assert!(found.refused.is_some() || said.contains("note: "), "{said}");
}
