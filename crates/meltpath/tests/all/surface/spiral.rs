//! Walls of one bead that winds up from pass to pass.

use super::*;

const BEAD: &str = "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[simulation]\ncell = \"0.6 mm\"";

/// A cone with room for some turns.
fn cone(tall: f64) -> Mesh {
    shapes::tube(12, 120, |s, t| {
        let (sin, cos) = (TAU * t).sin_cos();
        let radius = 25.0 - 4.0 * s;
        DVec3::new(radius * cos, radius * sin, tall * s)
    })
}

const HOW: &str = "torch = \"tangent\"\npasses = \"spiral\"";

#[test]
fn a_spiral_is_one_bead_whose_metal_stands_as_planned() {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &cone(12.0));
    let how = format!("{HOW}\n{BEAD}");
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "1.4 mm", &how), dir);
    let starts = ran.fact("arc-starts").value.as_ref().unwrap().value;
    assert_eq!(starts, 1.0);
    assert!(ran.passes() > 6, "{}", ran.passes());
    for id in ["thickness", "loose", "program", "ctwd-min", "ctwd-max"] {
        let check = ran.check(id);
        assert_ne!(check.status, Status::Fail, "{check:?}");
    }
    assert_eq!(ran.check("thickness").status, Status::Pass);
    // the arc is struck once, and ends once
    let folder = std::fs::read_dir(ran.folder.join("program")).unwrap();
    let texts = folder.map(|f| std::fs::read_to_string(f.unwrap().path()).unwrap_or_default());
    let all: String = texts.collect();
    let count = |word: &str| all.matches(word).count();
    assert_eq!([count("Arc Start["), count("Arc End[")], [1, 1]);
    // layers are told on the way
    assert!(count("Layer 5") > 1);
    let path = read_toolpath(&ran.folder.join("toolpath.melt")).unwrap();
    let beads: Vec<_> = path.passes().collect();
    for pair in beads.windows(2) {
        assert_eq!(pair[0].head.id, pair[1].head.id);
        assert_eq!(pair[0].points.last(), pair[1].points.first());
    }
    // what was fed is what lies there, and the top is level but for its last wedge
    let laid = ran.fact("metal").value.as_ref().unwrap().value;
    let mesh = {
        let bytes = std::fs::read(ran.folder.join("as-built.stl")).unwrap();
        read_stl(&bytes[..], None, &Reporter::new(), &Silent)
            .unwrap()
            .mesh
    };
    let top = mesh.vertices.iter().map(|p| p.z).fold(0.0, f64::max);
    assert!(laid > 9.0 && (top - 11.2).abs() < 2.0, "{laid} {top}");
}

#[test]
fn a_spiral_that_is_none_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    sheet(dir.path(), &leaning(0.2, 16.0));
    let open = refused(dir.path(), "sheet.stl", "1.4 mm", HOW);
    says(&open, &["pass 1 is open", "surface.passes = \"each\""]);
    // a tube that leans over: its last passes run off its rim
    let bent = shapes::tube(30, 90, |s, t| {
        let ((sin, cos), (up, out)) = ((TAU * t).sin_cos(), (0.6 * s).sin_cos());
        let far = 60.0 + 14.0 * cos;
        DVec3::new(far * out - 60.0, 14.0 * sin, far * up)
    });
    sheet(dir.path(), &bent);
    let rim = refused(dir.path(), "sheet.stl", "1.4 mm", HOW);
    says(
        &rim,
        &["is open, it ends at (", "end it below (layers.count = 1"],
    );
    sheet(dir.path(), &cone(12.0));
    let constant = format!("{HOW}\nspeeds = \"constant\"");
    let said = refused(dir.path(), "sheet.stl", "1.4 mm", &constant);
    says(&said, &["a spiral begins and ends on a ramp"]);
    let paused = format!("{HOW}\n[waam.bead]\nheight = \"2 mm\"");
    let said = refused(dir.path(), "sheet.stl", "1.4 mm\"\npause = \"20 s", &paused);
    says(&said, &["the arc of a spiral does not"]);
}
