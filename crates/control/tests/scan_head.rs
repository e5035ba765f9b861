//! Acceptance cases of the scan-head specification that concern control alone.

mod reference;

use meltpath_control::hinf::{MixedSensitivity, SynthesisOptions, Template, synthesise};

#[test]
fn lpbf_ac27_best_level_of_the_reference_plant() {
    let plant = reference::reference_plant().unwrap();
    let p = MixedSensitivity::new(plant)
        .sensitivity(Template::new(0.001, 1.001, 3000.0).unwrap())
        .command(Template::new(55.0, 0.1, 5e5).unwrap())
        .disturbance(Template::new(15.0, 0.9, 300.0).unwrap())
        .assemble()
        .unwrap();
    let design = synthesise(&p, &SynthesisOptions::default()).unwrap();
    assert!((design.optimum / 1.40206 - 1.0).abs() < 1e-5);
}
