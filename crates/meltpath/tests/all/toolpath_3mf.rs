//! Plans as 3MF toolpaths, from job to verdict: what is read back lays and marks the same, and what is not followed is not decided about.

use std::fs::{self, File};
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use crate::support::{check, part, says, thin_wall, warned, write};
use meltpath::chain;
use meltpath::outcome::Outcome;
use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath::waam::program::wanted::{Restart, Torch, Wanted};
use meltpath::waam::{LeftOpen, plan_to_file, program_to_folder, run, simulate_program};
use meltpath_base::{Reporter, Silent, Status, Verdict};
use meltpath_geometry::io::threemf::{MODEL_PART, Package, PackageWriter};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

const NAME: &str = "toolpath.build.3mf";

fn wall(folder: &Path, output: &str) -> PathBuf {
    thin_wall(
        folder,
        &format!(
            "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 3\n[simulation]\ncell = \"1 mm\"\n\
             [output]\n{output}\n"
        ),
    )
}

/// The values of checks and facts by their names.
fn values(verdict: &Verdict) -> Vec<(String, Option<f64>)> {
    let checks = verdict.checks.iter().map(|c| (&c.id, &c.value));
    let facts = verdict.facts.iter().map(|f| (&f.id, &f.value));
    let value = |(id, value): (&String, &Option<meltpath_base::Measure>)| {
        (id.clone(), value.as_ref().map(|v| v.value))
    };
    checks.chain(facts).map(value).collect()
}

fn simulated(file: &Path, job: &Path, name: &str) -> Outcome {
    simulate_program(file, Some(job), At(&job.with_file_name(name)), &Silent).unwrap()
}

/// The package with its model and first layer changed.
fn changed(package: &Path, change: impl Fn(&str) -> String) -> PathBuf {
    let mut from = Package::open(File::open(package).unwrap()).unwrap();
    let mut read = |name: &str| {
        let mut text = String::new();
        let mut part = from.part(name, "which is changed").unwrap();
        part.read_to_string(&mut text).unwrap();
        text
    };
    let model = change(&read(MODEL_PART));
    let layers = model.split("path=\"/").skip(1);
    let layers: Vec<&str> = layers.filter_map(|l| l.split('"').next()).collect();
    let mut to = PackageWriter::new(Cursor::new(Vec::new()), &[]).unwrap();
    let kind = "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03/layer";
    let links: Vec<(&str, &str)> = layers.iter().map(|l| (kind, *l)).collect();
    to.relations(MODEL_PART, &links).unwrap();
    for name in layers {
        let text = read(name);
        to.part(name).unwrap().write_all(text.as_bytes()).unwrap();
    }
    let mut part = to.part(MODEL_PART).unwrap();
    part.write_all(model.as_bytes()).unwrap();
    drop(part);
    let file = package.with_file_name("changed.3mf");
    fs::write(&file, to.finish().unwrap().into_inner()).unwrap();
    file
}

/// A flat wall is judged as the plan that it was written from, to the last digit.
#[test]
fn a_flat_wall_comes_back_as_its_plan() {
    let dir = tempfile::tempdir().unwrap();
    let job = wall(dir.path(), "toolpath = \"3mf\"");
    let native = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let again = simulated(&native.folder.join(NAME), &job, "again");
    assert_eq!(check(&again.verdict, "lines").status, Status::Pass);
    let beside = ["program", "lines", "coverage", "assembly"];
    let told = |verdict: &Verdict| {
        let mut all = values(verdict);
        all.retain(|(id, _)| !beside.contains(&id.as_str()));
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    };
    assert_eq!(told(&again.verdict), told(&native.verdict));
    for own in native.verdict.checks.iter().filter(|c| c.id != "program") {
        assert_eq!(check(&again.verdict, &own.id).status, own.status, "{own:?}");
    }
    // `meltpath program` writes the same; a part of a plan is no toolpath
    let plan = dir.path().join("plan.melt");
    plan_to_file(&job, &plan, LeftOpen::Chosen, &Silent).unwrap();
    let reporter = Reporter::new();
    let rest = Wanted {
        from: Some(Restart { layer: 2, bead: 1 }),
        torch: Torch::Burns,
    };
    for (name, wanted, whole) in [("whole", Wanted::WHOLE, true), ("rest", rest, false)] {
        let out = dir.path().join(name);
        let written = program_to_folder(&job, &plan, &out, wanted, (&reporter, &Silent));
        let files = written.unwrap().files;
        assert_eq!(files.contains(&NAME.to_owned()), whole, "{files:?}");
        assert_eq!(out.join(NAME).is_file(), whole);
    }
    let bytes = |folder: &Path| fs::read(folder.join(NAME)).unwrap();
    assert_eq!(bytes(&dir.path().join("whole")), bytes(&native.folder));
}

/// Of the plan of another job it is told what stays as the plan has it: a bead, and a part.
#[test]
fn the_plan_of_another_job_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let job = wall(dir.path(), "toolpath = \"3mf\"");
    let native = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let own = fs::read_to_string(&job).unwrap();
    let block = shapes::extrude(&[shapes::plate(30.0, 20.0)], 6.0);
    part(dir.path(), "block.stl", &block);
    let bead = own.replace("8 m/min", "7 m/min").replace("0.75", "0.8");
    let other_part = own.replace("wall.stl", "block.stl");
    for (name, text, words) in [
        ("own", own, [].as_slice()),
        (
            "bead",
            bead,
            &[
                "wire feed 8.00 m/min, the job's 7.00 m/min",
                "travel speed 0.75 m/min, the job's 0.80 m/min",
                "bead width",
            ],
        ),
        (
            "part",
            other_part,
            &["beads reach from", "the job's part from"],
        ),
    ] {
        let job = write(dir.path(), format!("{name}.toml"), text);
        let reporter = Reporter::new();
        let plan = native.folder.join("toolpath.melt");
        let out = dir.path().join(name);
        program_to_folder(&job, &plan, &out, Wanted::WHOLE, (&reporter, &Silent)).unwrap();
        let again = simulated(&native.folder.join(NAME), &job, &format!("again-{name}"));
        for warnings in [reporter.warnings(), again.verdict.warnings] {
            let told = warnings.iter().find(|w| w.code == "plan-of-another-job");
            assert_eq!(told.is_some(), !words.is_empty(), "{warnings:?}");
            if let Some(told) = told {
                says(&told.message, words);
            }
        }
    }
}

/// What a profile of other software does not say is that of the job, and the metal is not decided about.
#[test]
fn what_a_profile_does_not_say_or_says_more_leaves_the_metal_open() {
    let dir = tempfile::tempdir().unwrap();
    // lines alone, of one speed
    let raster = "toolpath = \"3mf\"\n[fill]\nstrategy = \"raster\"";
    let job = wall(dir.path(), raster);
    let native = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let file = native.folder.join(NAME);
    for (from, to, told) in [
        (
            " mp:wirefeed=\"133.33333333333334\"",
            "",
            "it says no wire feed",
        ),
        (" depositionspeed=\"12.5\"", "", "it says no speed"),
        (
            " depositionspeed",
            " prewaittime=\"5e5\" depositionspeed",
            "its waits",
        ),
        (
            " depositionspeed",
            " mp:later=\"3\" depositionspeed",
            "what its later=\"3\" does is not known",
        ),
    ] {
        let other = changed(&file, |model| {
            let text = model.replace(from, to);
            assert_ne!(text, model, "{from}");
            text
        });
        let outcome = simulated(&other, &job, told);
        for id in ["lines", "lack", "height"] {
            let check = check(&outcome.verdict, id);
            assert_eq!(check.status, Status::CannotSay, "{check:?}");
            says(&check.reason, &[told]);
        }
        // the same bead stands in
        let built = |v: &Verdict| {
            let all = values(v);
            all.iter().find(|(id, _)| id == "height-built").unwrap().1
        };
        assert_eq!(built(&outcome.verdict), built(&native.verdict), "{told}");
    }
}

/// The torch of a wall that leans comes back: the same metal as by the program of the same plan.
#[test]
fn a_leaning_wall_comes_back_with_its_torch() {
    let dir = tempfile::tempdir().unwrap();
    let angle = 25_f64.to_radians();
    let sheet = shapes::sheet(
        8,
        30,
        |_, _| false,
        |i, k| DVec3::new(2.0 * k, 2.0 * i * angle.sin(), 2.0 * i * angle.cos()),
    );
    part(dir.path(), "sheet.stl", &sheet);
    let text = "part = \"sheet.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
                [waam.bead]\nheight = \"2 mm\"\n[layers]\nheight = \"1.48 mm\"\n[surface]\ntorch = \"tangent\"\n[output]\ntoolpath = \"3mf\"\n";
    let job = write(dir.path(), "job.toml", text);
    let native = run(&job, NextIn(&dir.path().join("runs")), &Silent).unwrap();
    let programs = fs::read_dir(native.folder.join("program")).unwrap();
    let main = programs.map(|f| f.unwrap().path()).min().unwrap();
    let ours = simulated(&main, &job, "program");
    let theirs = simulated(&native.folder.join(NAME), &job, "toolpath");
    let [ours, theirs] = [ours, theirs].map(|o| values(&o.verdict));
    for id in ["time-arc", "time-travel", "wire-mass", "height-built"] {
        let value = |all: &[(String, Option<f64>)]| {
            all.iter().find(|(name, _)| name == id).unwrap().1.unwrap()
        };
        let (a, b) = (value(&ours), value(&theirs));
        assert!((a - b).abs() <= 1e-3 * a.abs(), "{id}: {a} {b}");
    }
    // z of the quaternion points from the wall to the torch, which leans as the sheet does
    let layer = changed(&native.folder.join(NAME), str::to_owned);
    let read = meltpath_programs::toolpath_3mf::read_spatial(File::open(layer).unwrap()).unwrap();
    let leant = DVec3::new(0.0, angle.sin(), angle.cos());
    for pass in read.toolpath.passes().skip(1) {
        let axis = pass.axis(1).unwrap();
        assert!(axis.angle_between(leant).to_degrees() < 0.1, "{axis}");
    }
}

#[test]
fn what_cannot_be_a_toolpath_is_refused_before_anything_runs() {
    let dir = tempfile::tempdir().unwrap();
    let job = wall(
        dir.path(),
        "toolpath = \"3mf\"\n[waam.bead.weave]\nshape = \"triangle\"\nfrequency = \"2 Hz\"\namplitude = \"3 mm\"",
    );
    let refused = chain::doctor(&job, &Silent).unwrap().refused.unwrap();
    says(
        &refused,
        &[
            "output",
            "no words for a weave",
            "plan without waam.bead.weave",
        ],
    );
    // a part is no toolpath
    let job = wall(dir.path(), "");
    let wall = dir.path().join("wall.3mf");
    let mesh = shapes::cuboid(DVec3::ZERO, DVec3::ONE);
    let named = meltpath_geometry::mesh::NamedMesh {
        name: String::new(),
        mesh,
    };
    meltpath_geometry::io::threemf::write_3mf(&[named], File::create(&wall).unwrap()).unwrap();
    let told = simulate_program(&wall, Some(&job), At(&dir.path().join("no")), &Silent);
    says(
        &told.unwrap_err(),
        &["wall.3mf", "holds no toolpath", "part of a job"],
    );
    assert!(!dir.path().join("no").exists());
}

fn laser(folder: &Path, name: &str, text: &str) -> Outcome {
    let head = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"two-axis-150\"\nrecipes = [\"industrial\"]\ndelays = \"recipe\"\n";
    let (part, rest) = text.split_once('|').unwrap();
    let job = write(
        folder,
        format!("{name}.toml"),
        format!("{part}{head}{rest}"),
    );
    chain::run(&job, At(&folder.join(name)), &Silent).unwrap()
}

/// A hatched part is marked the same from its toolpath, and not decided about where that says what is not followed.
#[test]
fn a_laser_hatch_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    part(
        dir.path(),
        "ring.stl",
        &shapes::extrude(&[shapes::ring(4.0, 2.0, 96)], 3.0),
    );
    let limits = "[checks]\ncontour_error = \"1 mm\"\ncontour_share = \"50 %\"\n";
    let native = laser(
        dir.path(),
        "native",
        &format!(
            "part = \"ring.stl\"\n|[section]\nheight = \"1.5 mm\"\nlayers = 2\n[hatch]\ncontours = 1\n[output]\ntoolpath = \"3mf\"\n{limits}"
        ),
    );
    let file = native.folder.join("toolpath-1.build.3mf");
    let layers = |file: &Path| {
        format!(
            "|layers = \"{}\"\n[layers]\nrange = [37, 38]\n{limits}",
            file.display()
        )
    };
    let again = laser(dir.path(), "again", &layers(&file));
    let same = |id: &str, off: f64| {
        let value = |o: &Outcome| {
            let all = values(&o.verdict);
            all.iter().find(|(name, _)| name == id).unwrap().1.unwrap()
        };
        let (a, b) = (value(&native), value(&again));
        assert!((a - b).abs() <= off, "{id}: {a} {b}");
    };
    same("time-1", 1e-4);
    same("contour-1", 0.1);
    same("fill-1", 0.5);
    // facets of a ring last some samples of this head, whole ones
    for told in [&native, &again] {
        let contour = check(&told.verdict, "contour-1");
        says(&contour.reason, &["takes whole samples"]);
        assert!(!contour.reason.contains("not followed"), "{contour:?}");
    }
    let defocused = changed(&file, |model| {
        model.replace(" laserspeed", " laserfocus=\"2\" laserspeed")
    });
    let told = laser(dir.path(), "defocused", &layers(&defocused));
    let contour = check(&told.verdict, "contour-1");
    assert_eq!(contour.status, Status::CannotSay);
    says(&contour.reason, &["laserfocus of 2 mm is not followed"]);
    assert!(warned(&told.verdict, "toolpath-not-followed"));
    // a path in space is none of a scan head, nor a planar one of a torch
    let wall_job = wall(dir.path(), "");
    let told = simulate_program(&file, Some(&wall_job), At(&dir.path().join("no")), &Silent);
    says(
        &told.unwrap_err(),
        &["the toolpath is planar", "lpbf.layers"],
    );
    let spaced = wall(dir.path(), "toolpath = \"3mf\"");
    let spaced = run(&spaced, At(&dir.path().join("spaced")), &Silent).unwrap();
    let job = write(
        dir.path(),
        "wrong.toml",
        format!(
            "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"two-axis-150\"\nrecipes = [\"industrial\"]\nlayers = \"{}\"\n",
            spaced.folder.join(NAME).display()
        ),
    );
    let told = chain::run(&job, At(&dir.path().join("no")), &Silent).unwrap_err();
    says(&told, &["the toolpath is 6axis", "meltpath simulate"]);
}
