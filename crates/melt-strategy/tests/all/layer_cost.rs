//! What layers cost on the solver for whole layers as the judge uses it: computing per millimetre, memory, heat; squares whose
//! hatch is 10 mm to 25 m long, and a cube of 10 mm of fifty layers that keep their heat.

use crate::support::{beam, on_metal, settings, titanium};
use meltpath_base::Silent;
use meltpath_melt_strategy::bed::{Between, Body, Domain, Resolution};
use meltpath_melt_strategy::judgement::{Drawn, judge};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::surface::Surface;

/// Distance of lines, mm.
const APART: f64 = 0.1;
const SPEED: f64 = 980.0;
/// Furthest that a half space is drawn where heat is remembered, mm; that of the application.
const FAR: f64 = 32.0;

/// Seconds that this process has computed, all threads.
fn computed() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    // behind the name: the 12th and 13th are hundredths of a second, in the user's code and in the kernel's
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

/// Lines to and fro over a square, along x or along y, in the middle of a larger one that reaches from 0 to `side` mm.
fn square(side: f64, along_y: bool) -> BeamPath {
    let lines = (side / APART).round() as usize;
    let corners: Vec<[f64; 2]> = (0..lines)
        .flat_map(|n| {
            let y = (n as f64 + 0.5) * APART;
            let ends = [[0.0, y], [side, y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .map(|[x, y]| if along_y { [y, x] } else { [x, y] })
        .collect();
    BeamPath::along(&corners, SPEED, settings(300.0, 0.413_67)).unwrap()
}

/// How far heat goes in `time` s, mm.
fn reach(time: f64) -> f64 {
    let material = titanium();
    let diffusivity =
        material.conductivity(material.solidus) / material.heat_capacity(material.solidus - 1.0);
    (2.5 * (diffusivity * time).sqrt()).max(Domain::THESIS.below)
}

/// Draws paths on metal, each on what those before left, on one thread. Where layers follow each other the bed is held at the
/// start temperature: it radiates what it does above that.
fn drawn(paths: &[BeamPath], cell: f64, reach: f64, between: Option<Between>) -> Drawn {
    let (material, beam) = (titanium(), beam());
    let body = Body {
        surface: Surface::Evaporating {
            surroundings: match between {
                Some(_) => material.start,
                None => 300.0 + CELSIUS,
            },
            ambient: 0.2,
        },
        between,
        ..on_metal(&material, &beam)
    };
    let resolution = Resolution {
        cell,
        planes: 1,
        step: 2e-5,
        domain: Domain {
            below: reach,
            beside: reach,
        },
        power: 1.0,
    };
    let (last, lower) = paths.split_last().unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1);
    let one = one.build().unwrap();
    one.install(|| judge(&body, lower, last, &resolution, &Silent))
        .unwrap()
}

/// The lines of a square on cells of 30 µm: what they cost.
fn cost_of(side: f64) {
    let path = square(side, false);
    let (length, reach) = (SPEED * path.end(), reach(path.end()));
    let begun = computed();
    let drawn = drawn(std::slice::from_ref(&path), 0.03, reach, None);
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
    assert!(drawn.highest.largest().0 > titanium().liquidus);
}

/// A cube of 10 mm, `layers` of it 10 s apart, lines crossing; temperatures of the top before each layer, °C.
fn cube(layers: usize, cell: f64) -> Vec<[f64; 2]> {
    let between = Between {
        time: 10.0,
        powder: titanium().start,
    };
    let paths: Vec<BeamPath> = (0..layers).map(|n| square(10.0, n % 2 == 1)).collect();
    let all: f64 = paths.iter().map(|p| p.end() + between.time).sum();
    let begun = computed();
    let drawn = drawn(&paths, cell, reach(all).min(FAR), Some(between));
    let seconds = computed() - begun;
    for (n, layer) in drawn.layers.iter().enumerate() {
        let [mean, highest] = layer.before.map(|k| k - CELSIUS);
        if n < 3 || n % 5 == 4 {
            println!(
                "layer {}: top {mean:.1} °C in the mean, {highest:.1} °C at most; beam {:.1} J, vapour {:.1} J, radiated {:.1} J, heat not accounted for {:.1e}",
                n + 1,
                layer.ledger.absorbed,
                layer.ledger.evaporated,
                layer.ledger.radiated,
                layer.residual
            );
        }
        assert!(layer.residual.abs() < 1e-3, "{}", layer.residual);
    }
    println!(
        "{layers} layers of 10 x 10 mm, cells of {:.0} µm: {seconds:.0} CPU-s, {:.0} MiB at most; mean of the last layer's peaks {:.1} °C",
        1e3 * cell,
        peak_memory(),
        mean_peak(&drawn) - CELSIUS,
    );
    let tops = drawn.layers.iter().map(|layer| layer.before);
    tops.map(|t| t.map(|k| k - CELSIUS)).collect()
}

/// Mean highest temperature of the last layer well inside the square, K.
fn mean_peak(drawn: &Drawn) -> f64 {
    let grid = &drawn.highest.grid;
    let top = grid.planes() - 1;
    let columns = (0..grid.cells[1]).flat_map(|j| (0..grid.cells[0]).map(move |i| (i, j)));
    let inside = columns.filter(|(i, j)| {
        let c = grid.centre(*i, *j, top);
        (1.0..9.0).contains(&c.x) && (1.0..9.0).contains(&c.y)
    });
    let values: Vec<f64> = inside.map(|(i, j)| drawn.highest.at(i, j, top)).collect();
    values.iter().sum::<f64>() / values.len() as f64
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

/// What a layer finds warm hardly depends on the cells that those below were drawn on.
#[test]
#[ignore = "minutes of computing"]
fn a_cube_of_fifty_layers_keeps_its_heat() {
    let fine = cube(5, 0.12);
    let coarse = cube(50, 0.24);
    let start = titanium().start - CELSIUS;
    assert!(coarse[1][0] > start && coarse[49][0] > coarse[9][0]);
    for (a, b) in coarse.iter().zip(&fine) {
        assert!((a[0] - b[0]).abs() < 1.0, "{a:?} {b:?}");
    }
}

/// The first three layers of it.
#[test]
#[ignore = "half a minute of computing"]
fn three_layers_of_a_cube() {
    cube(1, 0.24);
    let tops = cube(3, 0.24);
    let start = titanium().start - CELSIUS;
    assert!(tops[0] == [start; 2] && tops[1][0] > start && tops[2][0] > tops[1][0]);
}
