//! What a layer costs on the solver for whole layers as the judge uses it: computing per millimetre, memory, heat; squares
//! whose hatch is 10 mm to 25 m long.

use crate::support::{beam, on_metal, settings, titanium};
use meltpath_base::Silent;
use meltpath_melt_strategy::bed::{Body, Domain, Resolution};
use meltpath_melt_strategy::judgement::judge;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::surface::Surface;

/// Distance of lines, mm.
const APART: f64 = 0.1;
const SPEED: f64 = 980.0;

/// Seconds that this process has computed, all threads.
fn computed() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    // what follows the name: the 12th and 13th are ticks of a hundredth, in the user's code and in the kernel's
    let fields: Vec<&str> = text.rsplit(')').next().unwrap().split(' ').collect();
    let ticks = |n: usize| fields[n].parse::<f64>().unwrap();
    0.01 * (ticks(12) + ticks(13))
}

/// The most memory that this process held, MiB.
fn peak_memory() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|l| l.starts_with("VmHWM")).unwrap();
    let kib = line.split_whitespace().nth(1).unwrap();
    kib.parse::<f64>().unwrap() / 1024.0
}

/// Draws the lines of a square on metal, 270 W on cells of 30 µm, as the judge does over a half space, and tells what it cost.
fn cost_of(side: f64) {
    let lines = (side / APART).round() as usize;
    let corners: Vec<[f64; 2]> = (0..lines)
        .flat_map(|n| {
            let y = (n as f64 + 0.5) * APART;
            let ends = [[0.0, y], [side, y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    let path = BeamPath::along(&corners, SPEED, settings(300.0, 0.413_67)).unwrap();
    let (material, beam) = (titanium(), beam());
    let body = Body {
        surface: Surface::Evaporating {
            surroundings: 300.0 + CELSIUS,
            ambient: 0.2,
        },
        ..on_metal(&material, &beam)
    };
    let diffusivity =
        material.conductivity(material.solidus) / material.heat_capacity(material.solidus - 1.0);
    let reach = (2.5 * (diffusivity * path.end()).sqrt()).max(Domain::THESIS.below);
    let resolution = Resolution {
        cell: 0.03,
        planes: 1,
        step: 2e-5,
        domain: Domain {
            below: reach,
            beside: reach,
        },
        power: 1.0,
    };
    let length = SPEED * path.end();
    let begun = computed();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1);
    let drawn = one
        .build()
        .unwrap()
        .install(|| judge(&body, &[], &path, &resolution, &Silent))
        .unwrap();
    let seconds = computed() - begun;
    println!(
        "{side} x {side} mm, {:.3} m of path in {:.3} s of process, half space of {reach:.1} mm: {seconds:.1} CPU-s, {:.4} per mm, {:.1} million updates per mm; {:.0} MiB at most; heat not accounted for {:.1e}; vapour takes {:.1} %",
        1e-3 * length,
        path.end(),
        seconds / length,
        1e-6 * drawn.updates as f64 / length,
        peak_memory(),
        drawn.residual,
        100.0 * drawn.ledger.vapour_share(),
    );
    assert!(drawn.residual.abs() < 1e-3, "{}", drawn.residual);
    assert!(drawn.highest.largest().0 > material.liquidus);
}

#[test]
#[ignore = "a second of computing: shown beside the others"]
fn a_layer_of_ten_millimetres_of_path() {
    cost_of(1.0);
}

#[test]
#[ignore = "minutes of computing"]
fn a_layer_of_a_metre_of_path() {
    cost_of(10.0);
}

#[test]
#[ignore = "an hour of computing"]
fn a_layer_of_twenty_five_metres_of_path() {
    cost_of(50.0);
}
