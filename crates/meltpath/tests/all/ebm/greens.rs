//! What must not pass in silence: a surface hotter than its cells, holes melted shut, cells coarser than what they have to show.

use std::path::Path;

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Check, Silent, Status, Verdict};

use crate::support::write;

/// A hatch in one direction, 0.1 mm apart, on cells of 62.5 µm.
fn verdict(folder: &Path, ebm: &str, region: &str, rest: &str) -> Verdict {
    let text = format!(
        "[process]\nkind = \"ebm\"\n[ebm]\ndiameter = \"400 µm\"\n{ebm}[region]\n{region}[hatch]\nstrategy = \"one-way\"\nspacing = \"0.1 mm\"\nspeed = \"2 m/s\"\ncurrent = \"3.5 mA\"\noverrun = \"0.09 mm\"\n[charts]\npreview = \"none\"\n[window]\nlow = \"1700 °C\"\nhigh = \"2890 °C\"\nmodel = \"solver\"\n[checks]\noutside = \"30 %\"\nfarthest = \"0.4 mm\"\n{rest}"
    );
    let file = write(folder, "job.toml", text);
    let out = folder.join("out");
    let verdict = chain::run(&file, At(&out), &Silent).unwrap().verdict;
    std::fs::remove_dir_all(&out).unwrap();
    verdict
}

const PLATE: &str = "contour = [[\"0 mm\", \"0 mm\"], [\"1.5 mm\", \"0 mm\"], [\"1.5 mm\", \"1.2 mm\"], [\"0 mm\", \"1.2 mm\"]]\n";
const JUDGE: &str = "[judge]\ncell = \"0.0625 mm\"\n";

fn check<'a>(verdict: &'a Verdict, id: &str) -> &'a Check {
    verdict.checks.iter().find(|c| c.id == id).unwrap()
}

fn surface(verdict: &Verdict) -> [f64; 2] {
    let fact = verdict.facts.iter().find(|f| f.id == "surface").unwrap();
    let value = fact.value.as_ref().unwrap();
    [value.value, value.sigma.unwrap()]
}

/// Heat that stays in 18 µm of planes of 50 µm: the middle of the plane stays below the end of a still pool, the surface does not. With
/// four planes a layer it is as hot, where the cells are hundreds of kelvins apart.
#[test]
fn the_end_of_a_pool_is_judged_on_the_surface_itself() {
    let dir = tempfile::tempdir().unwrap();
    let shallow = "penetration = \"0.018 mm\"\n";
    let coarse = verdict(dir.path(), shallow, PLATE, JUDGE);
    let fine = verdict(dir.path(), shallow, PLATE, &format!("{JUDGE}planes = 4\n"));
    let [one, four] = [surface(&coarse), surface(&fine)];
    println!("{one:?} {four:?}");
    assert!((one[0] - four[0]).abs() < 100.0, "{one:?} {four:?}");
    for verdict in [&coarse, &fine] {
        let told = check(verdict, "in-window");
        assert_eq!(told.status, Status::CannotSay, "{}", told.reason);
        assert!(
            told.reason.contains("where a still pool ends"),
            "{}",
            told.reason
        );
    }
}

/// A slot of 0.2 mm that melts shut lies within the rim of its own contour; so does one that the job lets melt.
#[test]
fn a_hole_that_melts_shut_is_told_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let hole = "holes = [[[\"0.65 mm\", \"0.3 mm\"], [\"0.85 mm\", \"0.3 mm\"], [\"0.85 mm\", \"0.9 mm\"], [\"0.65 mm\", \"0.9 mm\"]]]\n";
    let shut = verdict(dir.path(), "", &format!("{PLATE}{hole}"), JUDGE);
    let told = check(&shut, "holes");
    assert_eq!(told.status, Status::Fail, "{told:?}");
    assert!(told.value.as_ref().unwrap().value > 90.0, "{told:?}");
    let [x, y, _] = told.place.as_ref().unwrap().position.unwrap();
    assert!((x - 0.75).abs() < 0.01 && (y - 0.6).abs() < 0.01);
    // a slit that is open to the outside is no less shut
    let corners = [
        "1.5 mm|1.2 mm",
        "0.84 mm|1.2 mm",
        "0.84 mm|0.3 mm",
        "0.66 mm|0.3 mm",
        "0.66 mm|1.2 mm",
    ];
    let corners = corners.map(|c| format!("[\"{}\"]", c.replace('|', "\", \"")));
    let slit = PLATE.replace("[\"1.5 mm\", \"1.2 mm\"]", &corners.join(", "));
    let shut = verdict(dir.path(), "", &slit, JUDGE);
    let told = check(&shut, "holes");
    assert_eq!(told.status, Status::Fail, "{told:?}");
    assert!(told.reason.contains("a gap of the outline"), "{told:?}");
    let [x, y, _] = told.place.as_ref().unwrap().position.unwrap();
    assert!((x - 0.75).abs() < 0.01 && (y - 0.75).abs() < 0.01);
    let whole = verdict(dir.path(), "", PLATE, JUDGE);
    assert!(whole.checks.iter().all(|c| c.id != "holes"));
    // over powder nothing is there to melt down to, and cells coarser than the rim do not show what lies beyond it
    let ground = "ground = \"powder\"\n";
    let hanging = verdict(dir.path(), ground, PLATE, "[judge]\ncell = \"0.125 mm\"\n");
    let told = check(&hanging, "unfused");
    assert_eq!(told.status, Status::NotChecked);
    assert!(
        told.reason.contains("no metal lies below"),
        "{}",
        told.reason
    );
    for id in ["molten-outside", "molten-farthest"] {
        let told = check(&hanging, id);
        assert!(matches!(told.status, Status::CannotSay | Status::Fail));
        assert!(
            told.reason.contains("larger than the 100 µm"),
            "{}",
            told.reason
        );
    }
    assert_ne!(check(&whole, "unfused").status, Status::NotChecked);
}

/// The middle of a plane as thick as a layer of 0.2 mm stays solid; on two planes the upper one melts. Neither is known to be right.
#[test]
fn what_melts_on_more_planes_does_not_fail_for_lack_of_power() {
    let dir = tempfile::tempdir().unwrap();
    let judge = format!("{JUDGE}planes = 1\ndepth = \"0 mm\"\n");
    let of = |share: u32| {
        let ebm = format!("layer = \"0.2 mm\"\nefficiency = \"{share} %\"\n");
        let verdict = verdict(dir.path(), &ebm, PLATE, &judge);
        check(&verdict, "unmelted").clone()
    };
    let told = of(70);
    assert_eq!(told.status, Status::CannotSay, "{told:?}");
    assert!(told.reason.contains("with twice the planes"), "{told:?}");
    let remedy = told.remedy.unwrap();
    assert!(
        remedy.contains("judge.planes") && !remedy.contains("power"),
        "{remedy}"
    );
    let told = of(50);
    assert_eq!(told.status, Status::Fail, "{told:?}");
    assert!(told.remedy.unwrap().contains("more power"));
}
