//! Acceptance cases on the reference solver, through jobs: `[optimise] solver = "reference"`.
use std::fmt::Write as _;
use std::path::Path;

use crate::support::{plan_of, write};
use meltpath::ebm::optimise::search::OnReference;
use meltpath::ebm::simulate::simulate;
use meltpath_base::{Reporter, Silent};
use meltpath_thermal::criteria::{Classes, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::CELSIUS;

const JOB: &str = "[process]\nkind = \"ebm\"\n[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 1\nvoxel = \"0.1 mm\"\n";

/// What the reference solver says of a job's path, and of the better one.
fn looked_at(folder: &Path, text: &str) -> OnReference {
    let file = write(folder, "job.toml", super::previewed(text));
    let plan = plan_of(&file);
    let found = simulate(&plan, &Reporter::new(), &Silent).unwrap();
    found.found.unwrap().reference.unwrap()
}

/// Mean highest temperature of the top cells whose centres lie in a place, °C.
fn mean(field: &Field, place: impl Fn([f64; 2]) -> bool) -> f64 {
    let any = Classes {
        melting: 0.0,
        window: [0.0, f64::INFINITY],
    };
    let tally = Tally::of(field, &any, |[i, j, k]| {
        let c = field.grid.centre(i, j, k);
        k + 1 == field.grid.planes() && place([c.x, c.y])
    });
    tally.mean - CELSIUS
}

/// Concentric circles 0.1 mm apart, the inner ones first, 4 m/s (erratum E21): those inside come back to the same place
/// sooner.
#[test]
#[ignore = "a minute of computing"]
fn ebm_q03_the_disc_cools_towards_its_rim_through_a_job() {
    let dir = tempfile::tempdir().unwrap();
    let mut text = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n".to_owned();
    let (mut time, mut last) = (0.0, [0.0, 0.0]);
    for n in 0..79 {
        let radius = (f64::from(n) + 0.5) * 0.1;
        let sides = (8.0 * radius / 0.1).ceil().max(12.0);
        for k in 0..=sides as u32 {
            let a = std::f64::consts::TAU * f64::from(k) / sides;
            let [x, y] = [radius * a.cos(), radius * a.sin()];
            time += (x - last[0]).hypot(y - last[1]) / 4000.0;
            last = [x, y];
            writeln!(text, "{time:.9},{x:.6},{y:.6},60000,0.005,0.004,1").unwrap();
        }
    }
    std::fs::write(dir.path().join("disc.csv"), text).unwrap();
    let job = format!(
        "path = \"disc.csv\"\n{JOB}[optimise]\nmethod = \"learning\"\nsolver = \"reference\"\nrounds = 0\ncell = \"125 um\"\nstep = \"15 us\"\n"
    );
    let there = looked_at(dir.path(), &job);
    let ring = |radius: f64| mean(&there.given.0, |[x, y]| (x.hypot(y) - radius).abs() < 0.25);
    let found = [0.5, 1.0, 2.5, 4.0, 6.0, 7.5].map(ring);
    println!("Q3: {found:.0?} °C at 0.5, 1, 2.5, 4, 6, 7.5 mm");
    assert!(found.windows(2).all(|w| w[1] < w[0]), "{found:?}");
    assert!(found[5] < 1665.0);
}

/// A plate of `width` and `height` mm, metal below as far as `leg` mm: how much hotter it is over powder than over metal, and
/// the deviation of all of it, K; as given and as found.
fn overhang([width, height, leg]: [f64; 3], rest: &str) -> [(f64, f64); 2] {
    let ring = |x: [f64; 2], y: [f64; 2]| {
        let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
        let told = corners.map(|[x, y]| format!("[\"{x} mm\", \"{y} mm\"]"));
        told.join(", ")
    };
    let text = format!(
        "{JOB}[ebm]\nground = \"powder\"\n[region]\ninside = \"0.4 mm\"\ncontour = [{}]\nsupported = [{}]\n[window]\nbody = [\"4 mm\", \"2 mm\"]\n[optimise]\nmethod = \"learning\"\nsolver = \"reference\"\ncell = \"0.1 mm\"\nstep = \"20 us\"\n{rest}",
        ring([0.0, width], [0.0, height]),
        ring([-1.0, leg], [-1.0, height + 1.0]),
    );
    let dir = tempfile::tempdir().unwrap();
    let there = looked_at(dir.path(), &text);
    [&there.given, &there.better].map(|(field, tally)| {
        let within = |x: std::ops::Range<f64>| {
            mean(field, |p| {
                x.contains(&p[0]) && (0.4..height - 0.4).contains(&p[1])
            })
        };
        let step = within(leg + 0.4..width - 0.4) - within(0.4..leg - 0.4);
        (step, tally.deviation)
    })
}

/// Ramps of energy on the speed, chosen on the first overhang, checked on the second: less hot over powder, and more even.
#[test]
#[ignore = "a minute of computing"]
fn ebm_q09_an_overhang_is_evened_out_on_the_reference_solver() {
    let half = [6.0, 3.0, 3.0];
    let third = [5.0, 2.5, 1.5];
    for (name, shape) in [("half on metal", half), ("a third on metal", third)] {
        let [constant, ramps] = [(100, 100), (92, 97)].map(|(along, across)| {
            let law = format!(
                "rounds = 0\n[hatch]\nstrategy = \"one-way\"\n[modulation]\nalong = \"{along} %\"\nacross = \"{across} %\"\n"
            );
            overhang(shape, &law)[0]
        });
        println!("Q9, {name}: {constant:.0?} with constant energy, {ramps:.0?} with ramps");
        assert!(ramps.0.abs() < constant.0.abs(), "{ramps:?} {constant:?}");
        assert!(ramps.1 < constant.1, "{ramps:?} {constant:?}");
    }
    let lever = "rounds = 10\nchange = \"current\"\n[hatch]\nstrategy = \"one-way\"\n";
    let [given, better] = overhang(half, lever);
    println!("Q9, half on metal, current learned: {given:.0?} to {better:.0?}");
    assert!(better.0.abs() < given.0.abs(), "{given:?} {better:?}");
    assert!(better.1 < 0.8 * given.1, "{given:?} {better:?}");
}
