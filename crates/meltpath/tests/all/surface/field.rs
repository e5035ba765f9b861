//! Walls whose torch is held as a file says.

use std::fmt::Write as _;

use super::*;

/// Directions along a wall of 60 mm by 16 mm that leans by 0.2 rad: of the wall at one end, turned by so many rad about it at the other.
fn directions(turn: f64) -> String {
    let mut text = "x,y,z,u,v,w\n".to_owned();
    for i in 0..=6 {
        for k in 0..=2 {
            let (x, up) = (10.0 * f64::from(i), 8.0 * f64::from(k));
            let (sin, cos) = (0.2 + turn * x / 60.0).sin_cos();
            let (y, z) = (up * 0.2_f64.sin(), up * 0.2_f64.cos());
            writeln!(text, "{x},{y},{z},0,{sin},{cos}").unwrap();
        }
    }
    text
}

const HOW: &str = "torch = \"field\"\nfield = \"torch.csv\"";

#[test]
fn the_torch_is_held_as_a_file_says() {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &leaning(0.2, 16.0));
    std::fs::write(dir.path().join("torch.csv"), directions(0.1)).unwrap();
    let how = format!("{HOW}\n{BEAD}");
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "1.48 mm", &how), dir);
    for row in &ran.rows {
        let (x, leans) = (row[1], row[5].atan2(row[6]));
        assert!(row[4].abs() < 1e-9, "{row:?}");
        assert!((leans - 0.2 - 0.1 * x / 60.0).abs() < 0.02, "{row:?}");
    }
    // of the build: the part is turned, and the file with it
    let provenance = std::fs::read_to_string(ran.folder.join("provenance.json")).unwrap();
    assert!(provenance.contains("torch.csv"));
}

#[test]
fn a_file_that_says_nothing_of_the_wall_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &leaning(0.2, 16.0));
    let said = |text: &str| {
        std::fs::write(dir.path().join("torch.csv"), text).unwrap();
        refused(dir.path(), "sheet.stl", "1.48 mm", HOW)
    };
    says(
        &said("0,0,0,0,0,1\n"),
        &["mm from every place", "surface.field"],
    );
    // one row of places shows down
    let mut down = String::new();
    for line in directions(0.0).lines() {
        match line.split(',').collect::<Vec<_>>()[..] {
            ["30", y, z, ..] => writeln!(down, "31,{y},{z},0,0,-1"),
            _ => writeln!(down, "{line}"),
        }
        .unwrap();
    }
    says(&said(&down), &["show against each other"]);
    says(&said("0,0,0,1\n"), &["it has 4 columns"]);
    says(&said("0,0,0,0,0,0\n"), &["place 1 has no direction"]);
    let alone = refused(dir.path(), "sheet.stl", "1.48 mm", "torch = \"field\"");
    says(&alone, &["go together"]);
    std::fs::remove_file(dir.path().join("torch.csv")).unwrap();
    let absent = refused(dir.path(), "sheet.stl", "1.48 mm", HOW);
    says(&absent, &["torch.csv"]);
}
