//! What a wall stands on: its plate, its base, and its own ends that have sunk.

use std::f64::consts::TAU;

use meltpath_base::Status;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

use super::{BEAD, Ran, disc, job, leaning, refused, sheet};

/// The ends of an open wall sink; where the wall twists the arc strikes them along the torch, and finds the crest: nothing hangs.
#[test]
fn beads_of_a_twisting_wall_lie_on_its_sunk_ends() {
    let dir = tempfile::tempdir().unwrap();
    let twisted = shapes::sheet(
        30,
        80,
        |_, _| false,
        |i, k| {
            let (along, up) = (k / 80.0, i / 30.0);
            let aside = 12.0 * (TAU * along).sin() * up;
            DVec3::new(120.0 * along, aside, 40.0 * up)
        },
    );
    sheet(dir.path(), &twisted);
    let file = job(dir.path(), "sheet.stl", "auto", "torch = \"tangent\"");
    let text = std::fs::read_to_string(&file).unwrap();
    let text = text
        .replace("x90-ig-1.0", "er316l-0.9")
        .replace("m14", "m12");
    std::fs::write(&file, text).unwrap();
    let ran = Ran::of(&file, dir);
    let loose = ran.check("loose");
    assert_eq!(loose.status, Status::Pass, "{loose:?}");
    assert_eq!(loose.value.as_ref().unwrap().value, 0.0);
}

/// A wall of 60 mm on a plate of 40, and one whose base lies half way up: neither passes.
#[test]
fn a_wall_beyond_its_plate_fails_and_one_half_in_its_base_is_told() {
    let of = |extra: &str| {
        let dir = tempfile::tempdir().unwrap();
        sheet(dir.path(), &leaning(0.0, 16.0));
        let file = job(
            dir.path(),
            "sheet.stl",
            "1.48 mm",
            &format!("{extra}{BEAD}"),
        );
        Ran::of(&file, dir)
    };
    let small = of("[substrate]\nsize = [\"40 mm\", \"40 mm\"]\n");
    let plate = small.check("plate");
    assert_eq!(plate.status, Status::Fail, "{plate:?}");
    // half of what the wall is longer, and half a bead
    let beyond = plate.value.as_ref().unwrap().value;
    assert!((12.0..14.0).contains(&beyond), "{beyond}");
    let large = of("[substrate]\nsize = [\"80 mm\", \"40 mm\"]\n");
    assert_eq!(large.check("plate").status, Status::Pass);
    assert!(large.verdict.checks.iter().all(|c| c.id != "in-base"));

    let sunk = of("[surface.base]\norigin = [\"0 mm\", \"0 mm\", \"8 mm\"]\n");
    let told = sunk.check("in-base");
    assert_eq!(told.status, Status::Warn, "{told:?}");
    assert!((told.value.as_ref().unwrap().value - 50.0).abs() < 1e-6);
    let root = of("[surface.base]\norigin = [\"0 mm\", \"0 mm\", \"0.5 mm\"]\n");
    assert_eq!(root.check("in-base").status, Status::Pass);
}

/// On a cone, 12 mm from its axis where the disc stands on it.
#[test]
fn metal_on_a_body_of_revolution_begins_on_it() {
    let dir = tempfile::tempdir().unwrap();
    let disc = disc();
    sheet(dir.path(), &disc);
    let how = |profile: &str| {
        format!(
            "base.profile = {profile}\nbase.direction = [0.0, 0.0, 1.0]\ntorch = \"tangent\"\n{BEAD}"
        )
    };
    let cone = how("[[\"-16 mm\", \"16 mm\"], [\"24 mm\", \"6 mm\"]]");
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "1.48 mm", &cone), dir);
    let loose = ran.check("loose");
    assert_eq!(loose.status, Status::Pass, "{loose:?}");
    // the first pass lies one layer beside where the cone meets the disc
    for p in ran.pass(1) {
        let radius = p.truncate().length();
        assert!((radius - 12.0 - 1.48).abs() < 0.03, "{p}");
    }
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &disc);
    let back = how("[[\"0 mm\", \"16 mm\"], [\"0 mm\", \"6 mm\"]]");
    let told = refused(dir.path(), "sheet.stl", "1.48 mm", &back);
    assert!(told.contains("place 2 of the profile"), "{told}");
    let both = how("[[\"0 mm\", \"16 mm\"], [\"9 mm\", \"6 mm\"]]\nbase.radius = \"12 mm\"");
    let told = refused(dir.path(), "sheet.stl", "1.48 mm", &both);
    assert!(told.contains("a radius and a profile"), "{told}");
}
