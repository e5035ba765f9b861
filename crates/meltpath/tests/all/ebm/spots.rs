//! Spots through jobs: their times are learned on charts and on the reference solver; what has no spots is refused.
use std::path::Path;

use crate::support::{plan_of, refusal, says, write};
use meltpath::chain;
use meltpath::ebm::simulate::simulate;
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Reporter, Silent};
use meltpath_thermal::criteria::Class;

const REGION: &str = "[process]\nkind = \"ebm\"\n[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 1\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"1.5 mm\", \"0 mm\"], [\"1.5 mm\", \"1.5 mm\"], [\"0 mm\", \"1.5 mm\"]]\n";

fn job(folder: &Path, strategy: &str, optimise: &str) -> std::path::PathBuf {
    let hatch =
        format!("[hatch]\nstrategy = \"{strategy}\"\n[window]\nbody = [\"3 mm\", \"2 mm\"]\n");
    let text = format!("{REGION}{hatch}[optimise]\n{optimise}");
    write(folder, "job.toml", super::previewed(&text))
}

/// Predicted and learned on the reference solver: the window is reached where it was not, by times that differ from spot to spot.
#[test]
fn times_of_spots_are_found_through_a_job() {
    let dir = tempfile::tempdir().unwrap();
    let how = |rounds: u32| {
        format!(
            "method = \"predictive\"\nchange = \"dwell\"\nsolver = \"reference\"\nrounds = {rounds}\norders = [\"every-second\"]\ncell = \"0.1 mm\"\nstep = \"15 us\"\n"
        )
    };
    let file = job(dir.path(), "spots", &how(2));
    let plan = plan_of(&file);
    let found = simulate(&plan, &Reporter::new(), &Silent).unwrap();
    let found = found.found.unwrap();
    let there = found.reference.unwrap();
    let [given, better] = [&there.given, &there.better].map(|(_, t)| t.share(Class::Good));
    println!("spots: {given:.3} to {better:.3}; {:?}", found.trials);
    assert!(better > given + 0.2, "{given} {better}");
    assert_eq!(found.trials.len(), 2);
    let times: Vec<f64> = found.path.rests().map(|[a, b]| b - a).collect();
    assert_eq!(times.len(), 144);
    let [least, most] = [f64::min, f64::max].map(|f| times.iter().copied().reduce(f).unwrap());
    assert!(most > 1.1 * least, "{least} {most}");
    // the report of a shorter search tells as much
    let file = job(dir.path(), "spots", &how(1));
    let out = dir.path().join("out");
    let outcome = chain::run(&file, At(&out), &Silent).unwrap();
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("Time on each spot") && report.contains("distance to the contour"));
    assert!(!outcome.verdict.checks.is_empty());
}

#[test]
fn times_of_spots_are_learned_on_charts() {
    let dir = tempfile::tempdir().unwrap();
    let file = job(
        dir.path(),
        "spots",
        "method = \"learning\"\nchange = \"dwell\"\nrounds = 4\n",
    );
    let outcome = chain::run(&file, At(&dir.path().join("out")), &Silent);
    let report = std::fs::read_to_string(dir.path().join("out/report.html")).unwrap();
    assert!(outcome.is_ok() && report.contains("Time on each spot"));
}

#[test]
fn what_has_no_spots_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |strategy: &str, how: &str| {
        let file = job(
            dir.path(),
            strategy,
            &format!("method = \"learning\"\nchange = \"dwell\"\n{how}"),
        );
        refusal(&file)
    };
    assert!(refused("one-way", "").contains("draw lines"));
    assert!(refused("spots", "strategies = [\"lines\"]\n").contains("draw lines"));
    let path = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n0,0,0,60000,0.005,0.004,1\n0.001,1.5,0,60000,0.005,0.004,0\n";
    std::fs::write(dir.path().join("line.csv"), path).unwrap();
    let file = dir.path().join("job.toml");
    let text = format!(
        "path = \"line.csv\"\n{REGION}[optimise]\nmethod = \"learning\"\nchange = \"dwell\"\n"
    );
    std::fs::write(&file, super::previewed(&text)).unwrap();
    says(&refusal(&file), &["rests nowhere"]);
}
