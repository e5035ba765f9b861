//! A layer of a part drawn by the electron beam: cut, scaled, hatched, over the metal and the powder that lie below it.
use std::path::{Path, PathBuf};

use crate::support::{plan_of, says, write};
use meltpath::chain;
use meltpath::chain::RunError;
use meltpath::ebm::plan::region::Below;
use meltpath::ebm::simulate::{Outcome, simulate};
use meltpath::outcome::RunFolder::At;
use meltpath_base::{Observer, Reporter, Silent, Status};
use meltpath_thermal::criteria::{Classes, Tally};

const JOB: &str = "[process]\nkind = \"ebm\"\n[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 3\nvoxel = \"100 µm\"\n[hatch]\n";

fn bridge() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/parts/bridge.step")
}

fn job(folder: &Path, extra: &str) -> PathBuf {
    std::fs::copy(bridge(), folder.join("bridge.step")).unwrap();
    let text = format!("part = \"bridge.step\"\n{JOB}{extra}");
    write(folder, "job.toml", super::previewed(&text))
}

/// Of the two legs of the bridge one is drawn: a job that does not say which decides nothing of the layer.
#[test]
fn areas_that_nobody_chose_are_not_left_out_in_silence() {
    let dir = tempfile::tempdir().unwrap();
    let of = |island: &str| {
        let file = job(
            dir.path(),
            &format!("[section]\nheight = \"1.02 mm\"\n{island}"),
        );
        let out = dir.path().join("out");
        let verdict = chain::run(&file, At(&out), &Silent).unwrap().verdict;
        std::fs::remove_dir_all(out).unwrap();
        verdict.checks.into_iter().find(|c| c.id == "areas")
    };
    let told = of("").unwrap();
    assert_eq!(told.status, Status::CannotSay);
    says(&told.reason, &["of 2", "number 1"]);
    says(&told.remedy.unwrap(), &["section.island"]);
    assert_eq!(of("island = 2\n"), None);
}

#[test]
fn a_layer_of_a_part_is_drawn_over_metal_and_powder() {
    let dir = tempfile::tempdir().unwrap();
    let extra = "[section]\nheight = \"6.02 mm\"\n[checks]\nin_window = \"0 %\"\n";
    let file = job(dir.path(), extra);
    // the memory of the ground takes powder below for metal
    let text = std::fs::read_to_string(&file).unwrap();
    let plain = text.replace("[charts]\n", "[charts]\nmemory = \"none\"\n");
    std::fs::write(&file, plain).unwrap();
    let plan = plan_of(&file);
    let part = plan.part.as_ref().unwrap();
    // 16 x 4 mm, 0.86 % larger each way
    assert!((part.area - 64.0 * 1.0086_f64.powi(2)).abs() < 1e-6);
    // 8 mm of steps of 50 µm, 0.93 % higher
    assert_eq!(part.layer, [122, 161]);
    // the opening in the middle of the layer below: a half ellipse of 4 and 2 mm over z = 4 mm
    let height = (120.5 * 0.05 / 1.0093 - 4.0) / 2.0;
    let open = 8.0 * (1.0_f64 - height * height).sqrt();
    // the mesh of the arch may lie 5 µm off, which is 0.11 mm of the opening where it is so flat
    assert!(
        (part.carried - (1.0 - open / 16.0)).abs() < 0.11 / 16.0,
        "{}",
        part.carried
    );
    assert!(plan.below.is_metal([6.0, 0.0]) && !plan.below.is_metal([0.0, 0.0]));

    let out = dir.path().join("out");
    let first = chain::run(&file, At(&out), &Silent).unwrap();
    let report = std::fs::read_to_string(first.folder.join("report.html")).unwrap();
    says(
        &report,
        &["What is built", "122 of 161", "Roughness to expect"],
    );
    // the run holds all that is needed to draw it again
    assert_eq!(
        std::fs::read(first.folder.join("inputs/bridge.step")).unwrap(),
        std::fs::read(bridge()).unwrap()
    );
    let voxels = std::fs::read_to_string(first.folder.join("series/voxels.csv")).unwrap();
    let mut lines = voxels.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |wanted: &str| names.iter().position(|n| n.starts_with(wanted)).unwrap();
    let (x, y, hottest) = (column("x"), column("y"), column("highest_temperature"));
    let mut sums = [[0.0; 2]; 2];
    for line in lines {
        let v: Vec<&str> = line.split(',').collect();
        let [x, y, hottest] = [x, y, hottest].map(|n| v[n].parse::<f64>().unwrap());
        let away = x.abs();
        if y.abs() < 1.5 && (away < 0.5 || (away > 3.0 && away < 6.0)) {
            let place = usize::from(away > 1.0);
            sums[place][0] += hottest;
            sums[place][1] += 1.0;
        }
    }
    let [over_powder, over_metal] = sums.map(|[sum, count]| sum / count);
    assert!(
        over_powder > over_metal + 10.0,
        "{over_powder} {over_metal}"
    );
}

/// The measured roughness shows no influence of the beam: neither does what is told of it.
#[test]
fn ebm_q11_roughness_knows_nothing_of_the_beam() {
    let told = |extra: &str| {
        let dir = tempfile::tempdir().unwrap();
        let file = job(dir.path(), extra);
        let plan = plan_of(&file);
        (
            plan.settings.material.roughness.unwrap(),
            plan.gun.current(plan.path.points()[0].power),
        )
    };
    let (slow, fast) = (
        told("current = \"3 mA\"\nspeed = \"500 mm/s\"\nfocus = \"0 mA\"\n"),
        told("current = \"15 mA\"\nspeed = \"1400 mm/s\"\nfocus = \"21 mA\"\n"),
    );
    assert!(slow.1 < fast.1);
    assert_eq!(slow.0, fast.0);
    // table A.2 of the thesis
    assert_eq!(slow.0.in_plane, [21.45, 14.01, 29.62]);
    assert_eq!(slow.0.along_build, [22.44, 16.256, 24.88]);
    assert_eq!(slow.0.any_face, [10.0, 35.0]);
}

#[test]
fn a_section_that_is_not_there_is_refused_where_it_is_written() {
    let dir = tempfile::tempdir().unwrap();
    for (extra, told) in [
        (
            "[section]\nheight = \"9 mm\"\n",
            "the part is 8.000 mm high",
        ),
        (
            "[section]\nheight = \"2 mm\"\nisland = 3\n",
            "2 separate areas",
        ),
        ("[ebm]\nground = \"powder\"\n", "says it again"),
    ] {
        let file = job(dir.path(), extra);
        let out = dir.path().join("out");
        let refused = chain::run(&file, At(&out), &Silent).unwrap_err();
        assert!(refused.to_string().contains(told), "{refused}");
        assert!(!out.exists());
    }
}

/// Stops at once.
struct Stopped;

impl Observer for Stopped {
    fn stage(&self, _name: &str, _total: u64) {}
    fn advance(&self, _done: u64) {}
    fn cancelled(&self) -> bool {
        true
    }
}

#[test]
fn stopping_while_the_part_is_read_is_no_fault_of_the_job() {
    let dir = tempfile::tempdir().unwrap();
    let file = job(dir.path(), "");
    let out = dir.path().join("out");
    let stopped = chain::run(&file, At(&out), &Stopped).unwrap_err();
    assert!(matches!(stopped, RunError::Cancelled(_)), "{stopped}");
    assert!(!out.exists());
}

/// The reference solver judges the layer just above the opening: hotter over powder, and the window is that of a body on metal.
#[test]
fn a_layer_that_hangs_over_is_judged_on_the_reference_solver() {
    let dir = tempfile::tempdir().unwrap();
    let extra = "[section]\nheight = \"6.02 mm\"\n[window]\nbody = [\"1.5 mm\", \"1.5 mm\"]\n[checks]\nin_window = \"0 %\"\n[judge]\nsolver = \"reference\"\nground = \"thesis-box\"\nbeyond = \"0 mm\"\ncell = \"0.2 mm\"\nstep = \"40 us\"\npart = [[\"-3 mm\", \"-0.3 mm\"], [\"3 mm\", \"0.3 mm\"]]\n";
    let file = job(dir.path(), extra);
    let plan = plan_of(&file);
    let found = simulate(&plan, &Reporter::new(), &Silent).unwrap();
    let on_charts = found.preview.as_ref().unwrap().classes;
    let judged = found.judged.unwrap().given;
    let any = Classes {
        melting: 0.0,
        window: [0.0, f64::INFINITY],
    };
    // all of it on metal: colder where the opening was, as warm elsewhere, and the same window
    let mut carried = plan.clone();
    carried.below = Below::Metal;
    let on_metal = simulate(&carried, &Reporter::new(), &Silent).unwrap();
    let other = on_metal.judged.clone().unwrap().given;
    let difference = |away: std::ops::Range<f64>| {
        let [here, there] = [&judged.highest, &other.highest].map(|field| {
            Tally::of(field, &any, |[i, j, k]| {
                let c = field.grid.centre(i, j, k);
                k + 1 == field.grid.planes() && away.contains(&c.x.abs()) && c.y.abs() < 0.3
            })
            .mean
        });
        here - there
    };
    let [powder, metal] = [0.0..0.6, 1.5..2.5].map(difference);
    println!("over powder {powder:.1} K hotter than over metal, beside it {metal:.2} K");
    // tiles are cut and stepped by how hot they are: that moves the mean by 0.05 % of the rise, here 1.4 K
    assert!(powder > 10.0 && metal.abs() < 2.0, "{powder} {metal}");
    assert_eq!(other.runs[0].classes, judged.runs[0].classes);
    // on charts too the good body lies on metal
    let classes = |outcome: Outcome| outcome.preview.unwrap().classes;
    assert_eq!(classes(on_metal), on_charts);
}
