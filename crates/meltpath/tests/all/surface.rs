//! Jobs that build a wall along a surface: the torus of Campocasso 2017 from its STEP file, sheets of triangles, and what is refused.

mod field;
mod metal;
mod speeds;
mod spiral;
mod stands;

use crate::support::{self, says, write};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::{Path, PathBuf};

use meltpath::cancel::Stop;
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{LeftOpen, WaamError, plan_to_file, read_toolpath, run};
use meltpath_base::{Check, Fact, Reporter, Silent, Status, Verdict};
use meltpath_geometry::Mesh;
use meltpath_geometry::io::stl::{read_stl, write_stl};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;
use tempfile::TempDir;

const TORUS: &str = "torus.step";

/// A job of `part` with lines of `[surface]` and further tables.
fn job(folder: &Path, part: &str, height: &str, surface: &str) -> PathBuf {
    let parts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/parts");
    if part == TORUS {
        std::fs::copy(parts.join(part), folder.join(part)).unwrap();
    }
    let text = format!(
        "part = \"{part}\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [layers]\nheight = \"{height}\"\n[surface]\n{surface}\n"
    );
    write(folder, "job.toml", text)
}

fn sheet(folder: &Path, mesh: &Mesh) {
    let mut bytes = Vec::new();
    write_stl(mesh, "sheet", &mut bytes).unwrap();
    std::fs::write(folder.join("sheet.stl"), bytes).unwrap();
}

/// What a run of a job says, and the rows of series/surface.csv.
struct Ran {
    verdict: Verdict,
    folder: PathBuf,
    /// Holds the folder.
    _dir: TempDir,
    rows: Vec<Vec<f64>>,
}

impl Ran {
    fn of(job: &Path, dir: TempDir) -> Self {
        let outcome = run(job, NextIn(&job.with_file_name("runs")), &Silent).unwrap();
        let csv = std::fs::read_to_string(outcome.folder.join("series/surface.csv")).unwrap();
        let row = |line: &str| -> Vec<f64> {
            let value = |v: &str| v.parse().unwrap_or(f64::NAN);
            line.split(',').map(value).collect()
        };
        let rows = csv.lines().filter(|l| !l.starts_with('#')).map(row);
        let rows = rows.filter(|r| r[0].is_finite()).collect();
        Ran {
            verdict: outcome.verdict,
            folder: outcome.folder,
            _dir: dir,
            rows,
        }
    }

    fn check(&self, id: &str) -> &Check {
        support::check(&self.verdict, id)
    }

    #[track_caller]
    fn cannot_say(&self, ids: &[&str], why: &str) {
        for id in ids {
            let check = self.check(id);
            assert_eq!(check.status, Status::CannotSay, "{check:?}");
            assert!(check.reason.contains(why), "{check:?}");
        }
    }

    fn fact(&self, id: &str) -> &Fact {
        let found = self.verdict.facts.iter().find(|c| c.id == id);
        found.unwrap_or_else(|| panic!("no fact {id}: {:?}", self.verdict.facts))
    }

    fn passes(&self) -> u32 {
        self.fact("layers").value.as_ref().unwrap().value as u32
    }

    /// Places of a pass.
    fn pass(&self, number: u32) -> impl Iterator<Item = DVec3> {
        let own = self.rows.iter().filter(move |r| r[0] as u32 == number);
        own.map(|r| DVec3::new(r[1], r[2], r[3]))
    }

    /// The place of a pass at the source's v, deg.
    fn at(&self, number: u32, v: f64) -> Option<DVec3> {
        let off = |p: &DVec3| {
            let d = (parameters(*p)[1] - v.to_radians()).rem_euclid(TAU);
            d.min(TAU - d)
        };
        let nearest = self.pass(number).min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.filter(|p| off(p) < 1e-6)
    }
}

/// The source's u and v of a point of the torus, rad.
fn parameters(p: DVec3) -> [f64; 2] {
    let rho = (p.x + 50.0).hypot(p.z);
    [p.z.atan2(p.x + 50.0), p.y.atan2(rho - 50.0)]
}

fn torus(strategy: &str) -> Ran {
    let dir = tempfile::tempdir().unwrap();
    let how = format!("faces = [1]\nstrategy = \"{strategy}\"");
    Ran::of(&job(dir.path(), TORUS, "5 mm", &how), dir)
}

#[test]
fn multiaxis_ma1_ma2_ma3_a_job_follows_the_parameter_of_the_torus() {
    let ran = torus("parameter-distance");
    for (v, steps, count) in [(0.0, 4.4085, 20), (90.0, 5.7320, 15), (180.0, 8.1921, 10)] {
        let mut before = 0.0;
        for number in 1..=10 {
            let u = parameters(ran.at(number, v).unwrap())[0].to_degrees();
            assert!(
                (u - before - steps).abs() < 1e-4,
                "{number} at {v}: {}",
                u - before
            );
            before = u;
        }
        let found = (1..=30).filter(|n| ran.at(*n, v).is_some()).count();
        assert_eq!(found, count, "at {v}");
    }
    let [outer, inner] = [0.0, 180.0].map(|v| ran.at(10, v).unwrap());
    assert!(
        outer.distance(DVec3::new(-3.3096, 0.0, 45.2217)) < 1e-3,
        "{outer}"
    );
    assert!(
        inner.distance(DVec3::new(-45.0811, 0.0, 34.6527)) < 1e-3,
        "{inner}"
    );
    // beyond the tenth they are open, and none leaves the tube
    for p in ran.rows.iter().map(|r| DVec3::new(r[1], r[2], r[3])) {
        assert!(parameters(p)[0] < FRAC_PI_2 + 1e-9);
    }
    // passes that lean over each other lie closer than what they were laid from
    let spacing = ran.check("spacing");
    assert_eq!(spacing.status, Status::Fail, "{spacing:?}");
}

#[test]
fn multiaxis_ma4_a_job_cuts_the_torus_by_planes() {
    let ran = torus("planes");
    assert_eq!(ran.passes(), 12);
    // points stand where the course asks for them: between two of them on either side of the plane of symmetry
    let points: Vec<DVec3> = ran.pass(6).collect();
    let crossed = points.windows(2).filter(|w| w[0].y * w[1].y <= 0.0);
    let crossed: Vec<DVec3> = crossed
        .map(|w| w[0].lerp(w[1], w[0].y / (w[0].y - w[1].y)))
        .filter(|p| p.is_finite())
        .collect();
    for (v, wanted) in [(0.0, 27.486), (180.0, 58.997)] {
        let near = |p: &&DVec3| (parameters(**p)[1].to_degrees().abs() - v).abs() < 0.5;
        let of_u = |p: &DVec3| parameters(*p)[0].to_degrees();
        let u: Vec<f64> = crossed.iter().filter(near).map(of_u).collect();
        assert!(
            !u.is_empty() && u.iter().all(|u| (u - wanted).abs() < 0.1),
            "{u:?}"
        );
        assert!(ran.pass(6).all(|p| (p.z - 30.0).abs() < 1e-6));
    }
    // above R - r nothing is left inside the bend
    assert!(
        ran.pass(10)
            .all(|p| parameters(p)[1].abs() < 0.9 * TAU / 2.0)
    );
    assert_eq!(ran.check("spacing").status, Status::Fail);
}

#[test]
fn multiaxis_ma5_a_job_keeps_the_distance_on_a_face() {
    let ran = torus("distance");
    let spacing = ran.check("spacing");
    assert_eq!(spacing.status, Status::Pass, "{spacing:?}");
    assert!(spacing.value.as_ref().unwrap().value < 1.5, "{spacing:?}");
    let from = ran.rows.iter().map(|r| (r[7] - 5.0).abs());
    assert!(from.fold(0.0, f64::max) < 2e-3);
    // the wire's tip goes over the pass before, as on flat layers
    let path = read_toolpath(&ran.folder.join("toolpath.melt")).unwrap();
    let first = path.layers[0].passes().next().unwrap();
    assert!(first.points.iter().all(|p| p.z.abs() < 1e-9));
    for pass in path.passes() {
        for i in 0..pass.points.len() {
            let axis = pass.axis(i).unwrap();
            assert!(axis.is_normalized() && axis.z > 0.7);
        }
    }
    // what is not known is told, and never passes
    assert_eq!(ran.check("tilt").status, Status::CannotSay);
    // beads of 2.4 mm laid 5 mm apart: the metal stays behind
    for id in ["loose", "ctwd-max", "height"] {
        assert_ne!(ran.check(id).status, Status::Pass, "{id}");
    }
    assert_eq!(ran.check("program").status, Status::Pass);
    assert_ne!(ran.verdict.status(), Status::Pass);
}

#[test]
fn multiaxis_ma6_a_job_tells_lines_of_a_parameter_as_uneven() {
    let ran = torus("parameter");
    let ratio = ran.fact("thickness-ratio").value.as_ref().unwrap().value;
    assert!((ratio - 65.0 / 35.0).abs() < 1e-6, "{ratio}");
    let spacing = ran.check("spacing");
    assert_eq!(spacing.status, Status::Fail);
    assert!(spacing.place.as_ref().unwrap().position.unwrap()[0] < -15.0);
    assert_eq!(ran.passes(), 20);
}

/// A wall that leans, with a window, far from the origin of its file and lying on its side there.
#[test]
fn a_leaning_sheet_with_a_window_is_planned_around_it() {
    let dir = tempfile::tempdir().unwrap();
    let window = |i: u32, k: u32| (8..14).contains(&i) && (20..30).contains(&k);
    let wall = shapes::sheet(20, 50, window, |i, k| {
        let (along, up) = (2.0 * k, 2.0 * i);
        DVec3::new(300.0 + up, along, 0.01 * up * up)
    });
    sheet(dir.path(), &wall);
    let text = job(
        dir.path(),
        "sheet.stl",
        "2 mm",
        "torch = \"tangent\"\ntilt = \"30 deg\"",
    );
    let turned = std::fs::read_to_string(&text).unwrap();
    let turned = turned.replacen('\n', "\nbuild_direction = [1.0, 0.0, 0.0]\n", 1);
    std::fs::write(&text, turned + "[checks]\ntilt = \"35 deg\"\n").unwrap();
    let ran = Ran::of(&text, dir);
    assert_eq!(ran.check("spacing").status, Status::Pass);
    assert_eq!(ran.check("unreached").status, Status::Pass);
    let tilt = ran.check("tilt");
    assert_eq!(tilt.status, Status::Pass, "{tilt:?}");
    assert!((tilt.value.as_ref().unwrap().value - 30.0).abs() < 1e-6);
    // two beads beside the window, one below it
    let path = read_toolpath(&ran.folder.join("toolpath.melt")).unwrap();
    assert_eq!(path.layers[4].len(), 1);
    assert_eq!(path.layers[10].len(), 2);
    let starts = ran.fact("arc-starts").value.as_ref().unwrap().value;
    assert!(starts > f64::from(ran.passes()), "{starts}");
}

/// A flange around a pipe grows away from the pipe's axis.
#[test]
fn a_wall_grows_from_a_cylinder() {
    let dir = tempfile::tempdir().unwrap();
    let disc = shapes::sheet(
        10,
        90,
        |_, _| false,
        |i, k| {
            let angle = TAU * (k % 90.0) / 90.0;
            let radius = 30.0 + 2.0 * i;
            DVec3::new(radius * angle.cos(), radius * angle.sin(), 40.0)
        },
    );
    sheet(dir.path(), &disc);
    let how = "base.radius = \"30 mm\"\nbase.direction = [0.0, 0.0, 1.0]\ntorch = \"tangent\"";
    let ran = Ran::of(&job(dir.path(), "sheet.stl", "2.6 mm", how), dir);
    assert_eq!(ran.passes(), 7);
    for p in ran.pass(4) {
        assert!(
            (p.truncate().length() - 40.4).abs() < 0.1 && p.z.abs() < 1e-9,
            "{p}"
        );
    }
}

fn refused(folder: &Path, part: &str, height: &str, surface: &str) -> String {
    let job = job(folder, part, height, surface);
    let error = run(&job, NextIn(&folder.join("runs")), &Silent).unwrap_err();
    assert!(!folder.join("runs/001").exists());
    // the plan alone refuses it likewise
    let other = plan_to_file(&job, &folder.join("a.melt"), LeftOpen::Chosen, &Silent).unwrap_err();
    assert_eq!(error.to_string(), other.to_string());
    match error {
        WaamError::Stop(Stop::Job(e)) => e.to_string(),
        e => e.to_string(),
    }
}

#[test]
fn what_is_no_wall_is_refused_with_place_and_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let torus = |height: &str, surface: &str| refused(dir.path(), TORUS, height, surface);
    for (said, words) in [
        (
            torus("5 mm", "faces = [7]"),
            "no face 7: they run from 1 to 3",
        ),
        (torus("5 mm", "faces = [0]"), "no face 0"),
        (torus("5 mm", ""), "closed"),
        (torus("0 mm", "faces = [1]"), "above 0 mm"),
        (
            torus(
                "5 mm",
                "faces = [1]\nbase.origin = [\"0 mm\", \"0 mm\", \"-4 mm\"]",
            ),
            "does not touch the surface",
        ),
        (
            torus(
                "5 mm",
                "faces = [1]\nbase.origin = [\"0 mm\", \"0 mm\", \"90 mm\"]",
            ),
            "behind the base",
        ),
        (
            torus(
                "5 mm",
                "faces = [1]\nstrategy = \"parameter\"\nbase.origin = [\"0 mm\", \"0 mm\", \"20 mm\"]",
            ),
            "no side of the face lies on the base",
        ),
        (
            torus("5 mm", "faces = [1, 2]\nstrategy = \"parameter-distance\""),
            "follows the parameters of one face",
        ),
        (
            torus("5 mm", "faces = [1]\n[fill]\ncontours = 2"),
            "[fill] is of flat layers",
        ),
        (
            torus("5 mm", "faces = [1]\n[target]\nallowance = \"1 mm\""),
            "[target]",
        ),
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    sheet(dir.path(), &shapes::thin_wall(60.0, 10.0, 20.0));
    let said = refused(dir.path(), "sheet.stl", "2 mm", "");
    assert!(said.contains("closed") && said.contains("sheet"), "{said}");
    let said = refused(dir.path(), "sheet.stl", "2 mm", "faces = [1]");
    assert!(said.contains("no faces with numbers"), "{said}");
    let low = shapes::sheet(1, 8, |_, _| false, |i, k| DVec3::new(4.0 * k, 0.0, 3.0 * i));
    sheet(dir.path(), &low);
    let said = refused(dir.path(), "sheet.stl", "5 mm", "");
    says(&said, &["3.000 mm from its base", "smaller distance"]);
}

/// The source's arrangement: the torch stands, and what the controller would need to know of it is not written.
#[test]
fn multiaxis_ma8_a_job_turns_the_part_under_a_torch_that_stands() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let dir = tempfile::tempdir().unwrap();
    let how = "faces = [1]\nstrategy = \"parameter-distance\"\n[machine]\nrobot = \"robot.toml\"\n[checks]\ntilt = \"5 deg\"";
    let text = job(dir.path(), TORUS, "5 mm", how);
    let robot = std::fs::read_to_string(examples.join("torus-on-flange/robot.toml")).unwrap();
    std::fs::write(dir.path().join("robot.toml"), &robot).unwrap();
    let ran = Ran::of(&text, dir);
    // the pool stays level, whatever the part does
    let tilt = ran.check("tilt");
    assert_eq!(tilt.status, Status::Pass, "{tilt:?}");
    assert!(tilt.value.as_ref().unwrap().value < 1e-9);
    // the program is for another maker's controller
    assert_eq!(ran.check("config").status, Status::CannotSay);
    assert_eq!(ran.check("fixed-torch").status, Status::CannotSay);
    // the torch leans against the part by half of the angle of the wall
    for row in &ran.rows {
        let u = parameters(DVec3::new(row[1], row[2], row[3]))[0];
        // a mean over a bead's width: at ends of open passes over half of it
        let near = if row[0] <= 5.0 { 2e-3 } else { 0.03 };
        assert!((row[8].to_radians() - 0.5 * u).abs() < near, "{row:?}");
    }
    // guesses do not pass, and every joint keeps its speed
    let speed = ran.check("joint-speed");
    assert_eq!(speed.status, Status::CannotSay, "{speed:?}");
    assert!(speed.value.as_ref().unwrap().value < 50.0);
    assert!(speed.reason.contains("guesses"), "{speed:?}");
    assert!(
        ran.check("reach").value.is_some(),
        "{:?}",
        ran.check("reach")
    );
}

/// The programs of two controllers lay the same, each read back.
#[test]
fn a_wall_is_written_for_two_controllers() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("cell.toml"),
        crate::dialects::cell("kuka-krl"),
    )
    .unwrap();
    let how = "faces = [1]\n[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[machine]\ncell = \"cell.toml\"\n\
               robot = \"kuka-kr16-r2010-2\"\n[output]\nprograms = [\"kuka-krl\", \"abb-rapid\"]";
    let text = job(dir.path(), TORUS, "5 mm", how);
    let ran = Ran::of(&text, dir);
    let program = ran.check("program");
    assert_eq!(program.status, Status::Pass, "{program:?}");
    let names = std::fs::read_dir(ran.folder.join("program")).unwrap();
    let names: Vec<String> = names
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .collect();
    for ending in [".src", ".dat", ".mod"] {
        assert!(
            names.iter().any(|n| n.ends_with(ending)),
            "{ending}: {names:?}"
        );
    }
}

/// Lines of a bead of its own, so that `layers.height` is what the test says.
const BEAD: &str = "[waam.bead]\nheight = \"2 mm\"";

/// A plane sheet that leans by `angle` rad towards +y, 60 mm long and `wide` mm wide.
fn leaning(angle: f64, wide: f64) -> Mesh {
    shapes::sheet(
        8,
        30,
        |_, _| false,
        |i, k| {
            let (along, up) = (2.0 * k, wide / 8.0 * i);
            DVec3::new(along, up * angle.sin(), up * angle.cos())
        },
    )
}

/// A flat ring, from 12 to 20 mm from the z axis.
fn disc() -> Mesh {
    shapes::sheet(
        4,
        48,
        |_, _| false,
        |i, k| {
            let angle = TAU * (k % 48.0) / 48.0;
            let radius = 12.0 + 2.0 * i;
            DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
        },
    )
}
