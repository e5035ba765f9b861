//! The templates of `meltpath new waam`, run as they come: which plans pass their own verdict.

use crate::support::says;
use std::fs;
use std::path::Path;

use meltpath::outcome::RunFolder::{At, NextIn};
use meltpath::waam::program::wanted::Wanted;
use meltpath::{chain, start, waam};
use meltpath_base::{Reporter, Silent, Status, Verdict};
use meltpath_geometry::io::stl::write_stl;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::{Mesh, shapes};

use super::foretold::hindered;
use super::support::check;

fn verdict(shape: &str, dir: &Path) -> Verdict {
    let job = start::waam(&dir.join(shape), shape, None).unwrap();
    let out = dir.join(format!("{shape}-run"));
    waam::run(&job, At(&out), &Silent).unwrap().verdict
}

/// Right angles and sharp tips, where metal has to reach into the corners.
const CORNERS: [&str; 2] = ["plate", "star"];

/// What the defaults are expected to fail on, and what a plan takes then.
const MENDED: [&str; 3] = ["tee", "box-wall", "bracket"];

#[test]
fn plates_and_stars_have_stock_in_their_corners() {
    let dir = tempfile::tempdir().unwrap();
    for shape in CORNERS {
        let verdict = verdict(shape, dir.path());
        let none: [&str; 0] = [];
        assert_eq!(hindered(&verdict), none, "{shape}");
    }
}

/// A part that no template has, and that fails with the defaults: where the job leaves them open, another setting is taken and told; where
/// it says one, that stays.
#[test]
fn a_bar_keeps_the_distance_of_its_beads() {
    let dir = tempfile::tempdir().unwrap();
    let job = start::waam(&dir.path().join("bar"), "plate", None).unwrap();
    let mut file = fs::File::create(dir.path().join("bar/plate.stl")).unwrap();
    let bar = shapes::extrude(&[shapes::plate(70.0, 12.0)], 14.0);
    write_stl(&bar, "bar", &mut file).unwrap();
    let run = |out: &str| {
        waam::run(&job, At(&dir.path().join(out)), &Silent)
            .unwrap()
            .verdict
    };
    let open = run("open");
    let none: [&str; 0] = [];
    assert_eq!(hindered(&open), none);
    let chosen = open.facts.iter().find(|f| f.id == "chosen").unwrap();
    let words = "fill.spacing = \"exact\": with the default flatness was expected to fail";
    assert_eq!(chosen.reason, words);
    let record = fs::read_to_string(dir.path().join("open/provenance.json")).unwrap();
    says(&record, &["chosen by the plan: with the default flatness"]);
    let record: serde_json::Value = serde_json::from_str(&record).unwrap();
    assert_eq!(
        record["parameters"]["fill.spacing"]["origin"]["kind"],
        "computed"
    );
    // the stages by themselves choose the same
    let (plan, stages) = (dir.path().join("bar.melt"), dir.path().join("stages"));
    waam::plan_to_file(&job, &plan, waam::LeftOpen::Chosen, &Silent).unwrap();
    let kept = fs::read(dir.path().join("open/toolpath.melt")).unwrap();
    assert!(fs::read(&plan).unwrap() == kept);
    let quick = dir.path().join("quick.melt");
    let told = waam::plan_to_file(&job, &quick, waam::LeftOpen::Defaults, &Silent).unwrap();
    says(&told, &["keeps its default", "may choose otherwise"]);
    assert!(fs::read(&quick).unwrap() != kept);
    let told = Reporter::new();
    let names = waam::program_to_folder(&job, &plan, &stages, Wanted::WHOLE, (&told, &Silent));
    for name in names.unwrap().files {
        let [stage, run] = [&stages, &dir.path().join("open/program")].map(|f| f.join(&name));
        assert!(fs::read(stage).unwrap() == fs::read(run).unwrap(), "{name}");
    }
    // what the plan chose, `simulate` judges its program with
    let (program, none_there) = (dir.path().join("open/program"), dir.path().join("none"));
    let again = waam::simulate_program(&program, Some(&job), NextIn(&none_there), &Silent).unwrap();
    let told = again.verdict.facts.iter().find(|f| f.id == "chosen");
    assert!(told.unwrap().reason.contains("fill.spacing"), "{told:?}");
    let text = fs::read_to_string(&job).unwrap();
    fs::write(&job, said(&text)).unwrap();
    let said = run("said");
    assert_eq!(hindered(&said), ["flatness"]);
    assert!(said.facts.iter().all(|f| f.id != "chosen"));
}

/// A thin upright across the middle of a foot.
fn clamp() -> Mesh {
    let mut both = shapes::extrude(&[shapes::plate(60.0, 40.0)], 10.0);
    let upright = shapes::extrude(&[shapes::plate(60.0, 8.0)], 30.0);
    let first = both.vertices.len() as u32;
    let raised = upright
        .vertices
        .iter()
        .map(|v| *v + DVec3::new(0.0, 16.0, 10.0));
    both.vertices.extend(raised);
    both.triangles
        .extend(upright.triangles.iter().map(|t| t.map(|v| v + first)));
    both
}

/// The corners of a thin wall get more allowance than the foot below it has room for: the wall leans out no farther than the part, and keeps
/// its stock. `simulate` judges its program alike.
#[test]
fn a_clamp_does_not_lean_and_is_judged_as_it_was_planned() {
    let dir = tempfile::tempdir().unwrap();
    let job = start::waam(&dir.path().join("clamp"), "plate", None).unwrap();
    let mut file = fs::File::create(dir.path().join("clamp/plate.stl")).unwrap();
    write_stl(&clamp(), "clamp", &mut file).unwrap();
    let (open, none) = (fs::read_to_string(&job).unwrap(), dir.path().join("none"));
    let value = |verdict: &Verdict, id: &str| check(verdict, id).value.as_ref().unwrap().value;
    for (text, name) in [(said(&open), "said"), (open, "open")] {
        fs::write(&job, text).unwrap();
        let out = dir.path().join(name);
        let run = waam::run(&job, At(&out), &Silent).unwrap().verdict;
        assert!(value(&run, "overhang") < 1.0, "{name}");
        assert_eq!(check(&run, "stock").status, Status::Pass);
        let program = out.join("program");
        let again = waam::simulate_program(&program, Some(&job), NextIn(&none), &Silent).unwrap();
        for id in [
            "lack",
            "excess",
            "stock",
            "height",
            "flatness",
            "accumulation",
            "overhang",
        ] {
            let [a, b] = [&run, &again.verdict].map(|v| value(v, id));
            assert!((a - b).abs() < 1e-9, "{name} {id}: {a} {b}");
        }
        let chosen = |v: &Verdict| v.facts.iter().any(|f| f.id == "chosen");
        assert_eq!([chosen(&run), chosen(&again.verdict)], [false; 2]);
    }
}

/// Those that do not pass are listed with the checks that hinder them: one that passes later leaves the list. Some have tests
/// of their own.
#[test]
#[ignore = "a minute of computing"]
fn templates_pass_their_own_verdict() {
    let dir = tempfile::tempdir().unwrap();
    let mut found = Vec::new();
    for shape in start::shape_names() {
        if CORNERS.contains(&shape) || MENDED.contains(&shape) {
            continue;
        }
        let verdict = verdict(shape, dir.path());
        found.push((shape, hindered(&verdict).join(" ")));
    }
    found.retain(|(_, hindered)| !hindered.is_empty());
    let known = [
        ("honeycomb", "stock flatness accumulation"),
        ("truss", "stock accumulation"),
        // it leans: nothing is decided
        (
            "vase",
            "lack excess stock height flatness accumulation ctwd-min ctwd-max ctwd-known travels",
        ),
    ];
    let known = known.map(|(shape, hindered)| (shape, hindered.to_owned()));
    assert_eq!(found, known);
}

/// Settings that a plan may choose, written as they are by default.
fn said(text: &str) -> String {
    let keys =
        ["strategy", "spacing", "reversal", "smoothing", "allowance"].map(|k| format!("# {k} = "));
    let line = |l: &str| {
        let open = keys.iter().any(|k| l.starts_with(k));
        let rest = if open { &l[2..] } else { l };
        format!("{rest}\n")
    };
    text.lines().map(line).collect()
}

/// Where a plan with the defaults is expected to fail and the job leaves them open, it takes what mends it; where the job says them,
/// they stay, and `doctor` tells what mends them: the same, or what it tries before that and a plan does not.
#[test]
#[ignore = "half a minute of computing"]
fn a_plan_takes_what_doctor_says_mends_it() {
    let dir = tempfile::tempdir().unwrap();
    let more = "target.allowance = \"3 mm\"";
    let kept =
        "fill.spacing = \"exact\" and fill.reversal = \"50 %\" and target.allowance = \"3 mm\"";
    let wanted = [
        (more, more),
        (more, more),
        (kept, "fill.strategy = \"contour\""),
    ];
    for (shape, (words, doctors)) in MENDED.into_iter().zip(wanted) {
        let job = start::waam(&dir.path().join(shape), shape, None).unwrap();
        let open = fs::read_to_string(&job).unwrap();
        let out = dir.path().join(format!("{shape}-open"));
        let verdict = waam::run(&job, At(&out), &Silent).unwrap().verdict;
        let none: [&str; 0] = [];
        assert_eq!(hindered(&verdict), none, "{shape}");
        let chosen = verdict.facts.iter().find(|f| f.id == "chosen").unwrap();
        assert!(chosen.reason.starts_with(words), "{chosen:?}");
        fs::write(&job, said(&open)).unwrap();
        let lines = chain::doctor(&job, &Silent).unwrap().lines;
        let told = format!("foretold: with {doctors} no check is expected to fail");
        assert!(lines.contains(&told), "{lines:?}");
        assert!(!lines.iter().any(|l| l.contains("chosen by the plan")));
    }
}
