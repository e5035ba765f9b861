//! Acceptance cases of the scan-head specification that concern control alone.
use meltpath_control::hinf::{MixedSensitivity, SynthesisOptions, Template, synthesise};
use meltpath_control::{StateSpace, TransferFunction};

fn reference_plant() -> TransferFunction {
    // REF-2X with its current loop, deg/A (specification 15.5, annex R)
    let (r, l, kc, j, b) = (2.79, 180e-6, 6.17e-3, 4.530_873_193_067_997_5e-8, 3e-6);
    let (w, xi) = (2.0 * std::f64::consts::PI * 4000.0, 0.015);
    let kr = 0.3 * kc / j;
    let (k, t) = (1.91, 7e-5);
    let deg = 180.0 / std::f64::consts::PI;
    let ke = kc;
    TransferFunction::new(
        [
            deg * k * t * (kc + j * kr),
            deg * k * (kc + j * kr + 2.0 * kc * t * w * xi + b * kr * t),
            deg * k * (kc * t * w * w + 2.0 * kc * xi * w + b * kr),
            deg * k * kc * w * w,
        ],
        [
            j * l * t,
            t * (b * l + j * k + j * r + 2.0 * j * l * w * xi),
            j * k
                + b * k * t
                + b * r * t
                + kc * ke * t
                + j * l * t * w * w
                + 2.0 * b * l * t * w * xi
                + 2.0 * j * k * t * w * xi
                + 2.0 * j * r * t * w * xi
                + j * ke * kr * t,
            b * k
                + b * l * t * w * w
                + j * k * t * w * w
                + j * r * t * w * w
                + 2.0 * j * k * w * xi
                + 2.0 * b * k * t * w * xi
                + 2.0 * b * r * t * w * xi
                + 2.0 * kc * ke * t * w * xi
                + b * ke * kr * t,
            j * k * w * w
                + b * k * t * w * w
                + b * r * t * w * w
                + kc * ke * t * w * w
                + 2.0 * b * k * w * xi,
            b * k * w * w,
            0.0,
        ],
    )
    .unwrap()
}

fn plant() -> StateSpace {
    reference_plant().to_state_space().unwrap()
}

#[test]
fn lpbf_ac27_best_level_of_the_reference_plant() {
    let p = MixedSensitivity::new(plant())
        .sensitivity(Template::new(0.001, 1.001, 3000.0).unwrap())
        .command(Template::new(55.0, 0.1, 5e5).unwrap())
        .disturbance(Template::new(15.0, 0.9, 300.0).unwrap())
        .assemble()
        .unwrap();
    let t = std::time::Instant::now();
    let design = synthesise(&p, &SynthesisOptions::default()).unwrap();
    println!(
        "{:?} {} trials, {} {:?} {:?}",
        t.elapsed(),
        design.trials,
        design.optimum,
        design.peak,
        design.limit
    );
    println!("{:?}", design.controller.poles().unwrap());
    assert!((design.optimum / 1.40206 - 1.0).abs() < 1e-5);
}
