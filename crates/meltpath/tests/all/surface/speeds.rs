//! Walls whose passes lie unevenly, laid by speeds that follow the distance.

use super::*;

/// In the middle of its process map.
const BEAD: &str = "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[simulation]\ncell = \"0.6 mm\"";

/// A round cone of a sheet that leans out on one side: lines of equal height lie by half farther apart there.
fn slanted() -> Mesh {
    shapes::tube(24, 120, |s, t| {
        let (sin, cos) = (TAU * t).sin_cos();
        let out = 20.0 * s * (0.5 + 0.5 * cos);
        DVec3::new((25.0 + out) * cos, (25.0 + out) * sin, 18.0 * s)
    })
}

fn ran(height: &str, speeds: &str) -> Ran {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &slanted());
    let how = format!("strategy = \"planes\"\ntorch = \"tangent\"\n{speeds}{BEAD}");
    Ran::of(&job(dir.path(), "sheet.stl", height, &how), dir)
}

/// Speed of each move of the last layers and how far it lies over the pass before, of a plan.
fn told(ran: &Ran) -> Vec<f64> {
    let path = read_toolpath(&ran.folder.join("toolpath.melt")).unwrap();
    let last = path.layers.last().unwrap();
    let pass = last.passes().next().unwrap();
    let speed = |i: usize| pass.value(meltpath_toolpath::Channel::Speed, i);
    (0..pass.move_count()).filter_map(speed).collect()
}

fn value(ran: &Ran, id: &str) -> f64 {
    ran.check(id).value.as_ref().unwrap().value
}

/// The check that fails tells the height that does, and with it the metal stands as high as planned all round.
#[test]
fn speeds_lay_what_planes_leave_uneven() {
    let constant = ran("1.4 mm", "");
    let spacing = constant.check("spacing");
    assert_eq!(spacing.status, Status::Fail, "{spacing:?}");
    says(spacing.remedy.as_ref().unwrap(), &["surface.speeds"]);
    let adapted = ran("1.4 mm", "speeds = \"adapted\"\n");
    let thickness = adapted.check("thickness");
    assert_eq!(thickness.status, Status::Pass, "{thickness:?}");
    let ratio = adapted
        .fact("thickness-ratio")
        .value
        .as_ref()
        .unwrap()
        .value;
    assert!(ratio > 1.3, "{ratio}");
    let speeds = told(&adapted);
    let [slow, fast] = [f64::min, f64::max].map(|f| speeds.iter().copied().reduce(f).unwrap());
    assert!(slow < 12.5 && fast / slow > 1.4, "{slow} {fast}");
    // steps of a machine, not jumps
    for pair in speeds.windows(2) {
        assert!((pair[0] / pair[1]).ln().abs() < 0.12, "{pair:?}");
    }
    // the metal: uneven at one speed, even at those that follow
    let [rough, even] = [&constant, &adapted].map(|ran| value(ran, "flatness"));
    assert!(even < 0.6 * rough, "{even} of {rough}");
    assert_ne!(adapted.check("flatness").status, Status::Fail);
}

#[test]
fn speeds_beyond_the_map_are_told_with_what_mends_them() {
    let ran = ran("2.6 mm", "speeds = \"adapted\"\n");
    let thickness = ran.check("thickness");
    assert_eq!(thickness.status, Status::Fail, "{thickness:?}");
    assert!(thickness.place.as_ref().unwrap().position.is_some());
    says(&thickness.reason, &["m/min lay", "mm thick in"]);
    says(
        thickness.remedy.as_ref().unwrap(),
        &["layers.height = \"1."],
    );
    // the slowest that is known stays
    assert!(told(&ran).iter().all(|s| *s >= 6.24));
}

/// Lines of a parameter on the source's torus, by 65/35 apart, laid with a bead of variable height.
#[test]
fn multiaxis_ma6_variable_bead_height_lays_lines_of_a_parameter() {
    let dir = tempfile::tempdir().unwrap();
    let how = format!(
        "faces = [1]\nstrategy = \"parameter\"\nspeeds = \"adapted\"\ntorch = \"tangent\"\n{BEAD}"
    );
    let ran = Ran::of(&job(dir.path(), TORUS, "1.94 mm", &how), dir);
    let ratio = ran.fact("thickness-ratio").value.as_ref().unwrap().value;
    assert!((ratio - 65.0 / 35.0).abs() < 2e-3, "{ratio}");
    let thickness = ran.check("thickness");
    assert_eq!(thickness.status, Status::Pass, "{thickness:?}");
    assert!(ran.verdict.checks.iter().all(|c| c.id != "spacing"));
    // at one speed it is 3.9 mm
    let flat = value(&ran, "flatness");
    assert!(flat < 1.7, "{flat}");
    assert_ne!(ran.check("height").status, Status::Fail);
}
