//! Parts of a plan's programs: the rest from a bead on, and copies without arc, each judged on what stands there.

use std::fs;
use std::path::{Path, PathBuf};

use crate::reach::measured;
use crate::support::{self, check, says, thin_wall, write};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::program::wanted::{Restart, Torch, Wanted};
use meltpath::waam::{program_to_folder, run, simulate_program};
use meltpath_base::{Reporter, Silent, Status, Verdict};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes;

const THIRD: Option<Restart> = Some(Restart { layer: 3, bead: 1 });
/// So high that a program of which nobody knew the plan would be asked where its plate lies.
const FOURTH: Option<Restart> = Some(Restart { layer: 4, bead: 1 });

/// The plan of a job's run, with its verdict.
fn planned(job: &Path) -> (PathBuf, Verdict) {
    let ran = run(job, NextIn(&job.with_file_name("runs")), &Silent).unwrap();
    (ran.folder.join("toolpath.melt"), ran.verdict)
}

/// What is said of programs of a plan.
fn judged(job: &Path, plan: &Path, from: Option<Restart>, torch: Torch) -> Verdict {
    let out = tempfile::tempdir().unwrap();
    let program = out.path().join("program");
    let wanted = Wanted { from, torch };
    let told = (&Reporter::new(), &Silent as _);
    program_to_folder(job, plan, &program, wanted, told).unwrap();
    simulated(job, &program)
}

fn simulated(job: &Path, program: &Path) -> Verdict {
    let runs = job.with_file_name("again");
    simulate_program(program, Some(job), NextIn(&runs), &Silent)
        .unwrap()
        .verdict
}

fn value(verdict: &Verdict, id: &str) -> f64 {
    check(verdict, id).value.as_ref().unwrap().value
}

fn begins(verdict: &Verdict) -> Option<&str> {
    let fact = verdict.facts.iter().find(|f| f.id == "begins");
    fact.map(|f| f.reason.as_str())
}

const FLAT: &str = "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n[layers]\ncount = 4\n[simulation]\ncell = \"1 mm\"\n";

#[test]
fn the_rest_of_a_flat_plan_stands_on_its_beads() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let job = thin_wall(dir.path(), &format!("{FLAT}[machine]\n{robot}\n"));
    let (plan, whole) = planned(&job);
    let rest = judged(&job, &plan, FOURTH, Torch::Burns);
    says(&begins(&rest).unwrap(), &["layer 4, bead 1 of its plan"]);
    for id in ["lack", "excess", "stock"] {
        let off = (value(&rest, id) - value(&whole, id)).abs();
        assert!(off < 0.05 * value(&whole, id).abs() + 0.02, "{id}: {off}");
    }
    for id in ["height", "ctwd-max", "ctwd-known"] {
        assert_eq!(
            check(&rest, id).status,
            Status::Pass,
            "{:?}",
            check(&rest, id)
        );
    }
    // the beads below are there for torch and arm, too
    let near = value(&whole, "collision") + 1.0;
    assert!(
        value(&rest, "collision") < near,
        "{near} {:?}",
        check(&rest, "collision")
    );
    let dry = judged(&job, &plan, FOURTH, Torch::Dry);
    assert_eq!(check(&dry, "metal").status, Status::NotChecked);
    says(&check(&dry, "joint-speed").reason, &["no bead is laid"]);
    says(&begins(&dry).unwrap(), &["layer 4, bead 1 of its plan"]);
    assert!(
        value(&dry, "collision") < near + 2.5,
        "{:?}",
        check(&dry, "collision")
    );
    for id in ["reach", "collision", "config"] {
        assert_eq!(
            check(&dry, id).status,
            Status::Pass,
            "{:?}",
            check(&dry, id)
        );
    }
    let place = check(&dry, "collision").place.clone().unwrap();
    assert_eq!(place.layer, None, "{place:?}");
    // over the bare plate there is more room
    let all = judged(&job, &plan, None, Torch::Dry);
    assert_eq!(begins(&all), None);
    assert_eq!(check(&all, "collision").status, Status::Pass);
}

/// An edited rest is no rest of the plan: what it stands on is not known.
#[test]
fn an_edited_rest_stands_on_nothing_that_is_known() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let job = thin_wall(dir.path(), &format!("{FLAT}[machine]\n{robot}\n"));
    let (plan, _) = planned(&job);
    let program = dir.path().join("rest");
    let (from, torch) = (THIRD, Torch::Burns);
    let told = (&Reporter::new(), &Silent as _);
    program_to_folder(&job, &plan, &program, Wanted { from, torch }, told).unwrap();
    let mut files = fs::read_dir(&program).unwrap();
    let file = files.next().unwrap().unwrap().path();
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.contains("WFS 8.00"), "{text}");
    fs::write(&file, text.replace("WFS 8.00", "WFS 7.00")).unwrap();
    let verdict = simulated(&job, &file);
    for id in ["lack", "height", "ctwd-max", "collision"] {
        let check = check(&verdict, id);
        assert_eq!(check.status, Status::CannotSay, "{check:?}");
        says(&check.reason, &["begins with layer 3, on metal"]);
    }
}

#[test]
fn the_rest_of_a_wall_along_a_surface_stands_on_its_passes() {
    let dir = tempfile::tempdir().unwrap();
    let robot = measured(dir.path());
    let wall = shapes::sheet(
        3,
        20,
        |_, _| false,
        |i, k| DVec3::new(2.5 * k - 25.0, 0.0, 2.0 * i),
    );
    support::part(dir.path(), "wall.stl", &wall);
    let text = format!(
        "part = \"wall.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\ngas = \"m14\"\nmode = \"cmt\"\n\
         [layers]\nheight = \"2 mm\"\n[surface]\n[machine]\n{robot}\n"
    );
    let job = write(dir.path(), "job.toml", text);
    let (plan, whole) = planned(&job);
    for torch in [Torch::Burns, Torch::Dry] {
        let rest = judged(&job, &plan, THIRD, torch);
        let collision = check(&rest, "collision");
        assert_eq!(collision.status, Status::Pass, "{collision:?}");
        let near = value(&whole, "collision") + 2.5;
        assert!(value(&rest, "collision") < near, "{near} {collision:?}");
        let bare = judged(&job, &plan, None, Torch::Dry);
        assert!(value(&rest, "collision") < value(&bare, "collision") + 1e-6);
    }
}

#[test]
fn a_program_without_arc_needs_a_robot() {
    let dir = tempfile::tempdir().unwrap();
    let job = thin_wall(dir.path(), FLAT);
    let (plan, _) = planned(&job);
    let program = dir.path().join("dry");
    let wanted = Wanted {
        from: None,
        torch: Torch::Dry,
    };
    let told = (&Reporter::new(), &Silent as _);
    program_to_folder(&job, &plan, &program, wanted, told).unwrap();
    let runs = dir.path().join("again");
    let refused = simulate_program(&program, Some(&job), NextIn(&runs), &Silent);
    says(
        &refused.unwrap_err(),
        &["never starts the arc", "machine.robot"],
    );
}
