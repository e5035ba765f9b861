//! Hot loops of the room: synthesis of the scan head's problem and its certified peak.
#![expect(clippy::unwrap_used, reason = "a benchmark may stop")]
#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

#[path = "../tests/all/reference.rs"]
mod reference;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::h_infinity::{MixedSensitivity, SynthesisOptions, Template, synthesise};
use meltpath_control::norms;

fn synthesis(c: &mut Criterion) {
    let plant = reference::reference_plant().unwrap();
    let problem = MixedSensitivity::new(plant)
        .sensitivity(Template::new(0.001, 1.001, 3000.0).unwrap())
        .command(Template::new(55.0, 0.1, 5e5).unwrap())
        .disturbance(Template::new(15.0, 0.9, 300.0).unwrap())
        .assemble()
        .unwrap();
    let options = SynthesisOptions::default();
    c.bench_function("H-infinity of the scan head's problem", |b| {
        b.iter(|| synthesise(&problem, &options).unwrap());
    });
    let design = synthesise(&problem, &options).unwrap();
    c.bench_function("peak gain of its closed loop", |b| {
        b.iter(|| norms::peak_gain(&design.closed_loop, 1e-6).unwrap());
    });
    c.bench_function("triangle hold of its controller", |b| {
        b.iter(|| discretise(&design.controller, 50e-6, Hold::First).unwrap());
    });
}

criterion_group!(benches, synthesis);
criterion_main!(benches);
