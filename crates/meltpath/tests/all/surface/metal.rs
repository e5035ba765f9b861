//! The metal of walls along surfaces: where it stands, and when that cannot be said.

use super::*;

/// What a wall of such beads grows by a pass, mm.
const GROWTH: f64 = 1.48;

fn as_built(ran: &Ran) -> Mesh {
    let bytes = std::fs::read(ran.folder.join("as-built.stl")).unwrap();
    let stl = read_stl(&bytes[..], None, &Reporter::new(), &Silent);
    stl.unwrap().mesh
}

#[test]
fn metal_of_a_leaning_wall_stands_along_the_torch() {
    let dir = tempfile::tempdir().unwrap();
    let angle = 25_f64.to_radians();
    sheet(dir.path(), &leaning(angle, 16.0));
    let how = format!("torch = \"tangent\"\n{BEAD}");
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "1.48 mm", &how), dir);
    for id in [
        "height",
        "flatness",
        "accumulation",
        "ctwd-min",
        "ctwd-max",
        "loose",
    ] {
        let check = ran.check(id);
        assert_eq!(check.status, Status::Pass, "{check:?}");
    }
    // along the wall, in its middle: as thick as a bead is wide, and as high as its passes
    let (up, out) = (
        DVec3::new(0.0, angle.sin(), angle.cos()),
        DVec3::new(0.0, angle.cos(), -angle.sin()),
    );
    let mesh = as_built(&ran);
    let wall = || {
        let middle = mesh.vertices.iter().filter(|p| (10.0..50.0).contains(&p.x));
        middle.filter(|p| p.dot(up) > 6.0 && p.z > 2.0).copied()
    };
    assert!(wall().count() > 1000);
    let aside = wall().map(|p| p.dot(out).abs()).fold(0.0, f64::max);
    assert!((2.6..4.2).contains(&aside), "{aside}");
    let top = wall().map(|p| p.dot(up)).fold(0.0, f64::max);
    let planned = GROWTH * f64::from(ran.passes());
    assert!((top - planned).abs() < 1.5, "{top} of {planned}");
    // what was fed is what lies there
    let laid = ran.fact("metal").value.as_ref().unwrap().value;
    let fed = ran.fact("wire-mass").value.as_ref().unwrap().value;
    assert!(laid > 5.0 && fed > 0.0, "{laid} {fed}");
    assert!(ran.folder.join("fields/beads.vtp").exists());
}

#[test]
fn metal_beside_the_torch_cannot_be_said() {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &leaning(25_f64.to_radians(), 16.0));
    let how = format!("torch = \"fixed\"\n{BEAD}");
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "1.48 mm", &how), dir);
    ran.cannot_say(&["height", "ctwd-max", "loose"], "25.0 deg aside");
}

#[test]
fn metal_that_stays_behind_its_passes_fails() {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &leaning(0.0, 32.0));
    let how = format!("torch = \"tangent\"\n{BEAD}");
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "3.2 mm", &how), dir);
    let tube = ran.check("ctwd-max");
    assert_eq!(tube.status, Status::Fail, "{tube:?}");
    assert!(tube.place.as_ref().unwrap().layer >= Some(4), "{tube:?}");
    assert_eq!(ran.check("height").status, Status::Fail);
    assert_eq!(ran.check("ctwd-known").status, Status::CannotSay);
}

#[test]
fn metal_on_a_cylinder_begins_on_it() {
    let dir = tempfile::tempdir().unwrap();
    let disc = disc();
    sheet(dir.path(), &disc);
    let how = format!(
        "base.radius = \"12 mm\"\nbase.direction = [0.0, 0.0, 1.0]\ntorch = \"tangent\"\n{BEAD}"
    );
    let text = job(dir.path(), "sheet.stl", "1.48 mm", &how);
    let ran = Ran::of(&text, dir);
    let loose = ran.check("loose");
    assert_eq!(loose.status, Status::Pass, "{loose:?}");
    let near = ran.check("ctwd-max").value.as_ref().unwrap().value;
    assert!((near - 15.0).abs() < 0.6, "{near}");
    // nothing is known of a pool that lies on its side
    assert_eq!(ran.check("tilt").status, Status::CannotSay);
}

#[test]
fn metal_of_a_controller_that_nobody_knows_cannot_be_said() {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &leaning(0.0, 16.0));
    let cell = crate::dialects::cell("kuka-krl");
    std::fs::write(dir.path().join("cell.toml"), cell).unwrap();
    let how = "torch = \"tangent\"\n[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[machine]\ncell = \"cell.toml\"\n[output]\nprograms = []";
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "1.48 mm", how), dir);
    ran.cannot_say(&["height", "ctwd-min", "loose"], "no corner model");
}

/// A dome is laid up to where a pass has no room for its pool, and the verdict fails by the opening.
#[test]
fn a_dome_keeps_an_opening_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    // the pole itself is a hole of a hundredth of a millimetre, as meshes of domes have it
    let dome = shapes::tube(60, 120, |s, t| {
        let (lat, lon) = ((1.0 - s) * 0.25 * TAU, t * TAU);
        30.0 * DVec3::new(lat.sin() * lon.cos(), lat.sin() * lon.sin(), lat.cos())
    });
    sheet(dir.path(), &dome);
    let ran = Ran::of(
        &job(dir.path(), "sheet.stl", "1.5 mm", "torch = \"tangent\""),
        dir,
    );
    let opening = ran.check("opening");
    assert_eq!(opening.status, Status::Fail, "{opening:?}");
    let width = opening.value.as_ref().unwrap().value;
    let pass = f64::from(opening.place.as_ref().unwrap().layer.unwrap());
    // the first pass that four pools do not fit into, by the sphere's own circles
    let round = |n: f64| 60.0 * (2.0 * n * (0.75_f64 / 30.0).asin()).cos();
    assert!((width - round(pass)).abs() < 0.1, "{width} {pass}");
    assert_eq!(f64::from(ran.passes()), pass - 1.0);
    assert!(width * std::f64::consts::PI < 53.0 && round(pass - 1.0) > 16.0);
    // what is laid is laid evenly
    assert_eq!(ran.check("flatness").status, Status::Pass);
    assert_eq!(ran.check("loose").status, Status::Pass);
}

/// Wire that is used is wire that is laid, at any distance of the contact tube; and a count of layers that cuts a surface is told.
#[test]
fn wire_is_laid_and_a_count_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let wall = shapes::sheet(10, 20, |_, _| false, |i, k| DVec3::new(2.0 * k, 0.0, i));
    sheet(dir.path(), &wall);
    let file = job(dir.path(), "sheet.stl", "2 mm", "");
    let text = std::fs::read_to_string(&file).unwrap();
    let text = text.replace("height = \"2 mm\"", "height = \"2 mm\"\ncount = 2");
    std::fs::write(&file, text + "[machine]\nctwd = \"11 mm\"\n").unwrap();
    let ran = run(&file, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let fact = |id: &str| {
        let found = ran.verdict.facts.iter().find(|f| f.id == id);
        found.unwrap_or_else(|| panic!("no fact {id}"))
    };
    let [wire, metal] = ["wire-mass", "metal"].map(|id| fact(id).value.as_ref().unwrap().value);
    // g of steel
    let laid = 7.85 * metal;
    assert!(
        (1e3 * wire / laid - 1.0).abs() < 1e-6,
        "{wire} kg, {laid} g"
    );
    let told = ["2 of 5 passes, by layers.count"];
    says(&support::check(&ran.verdict, "unreached").reason, &told);
    says(&fact("layers").reason, &told);
    let left = ran.verdict.facts.iter().find(|f| f.id == "left-over");
    let layer = left.and_then(|f| f.place.as_ref()?.layer);
    assert!(layer.is_none_or(|layer| layer <= 2), "{left:?}");
}
