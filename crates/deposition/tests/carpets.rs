//! Carpets of four beads, Rouchon 2022, table 4.3: where the wetting length comes from.

mod support;

use meltpath_deposition::bead::{BeadModel, PoolModel};
use meltpath_deposition::deposit::{Deposition, Levelling, Mode, Settings};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;
use support::*;

/// Flatness (least distance of two parallel lines around the profile, any slope) and parallelism (highest less lowest)
/// of the mean profile between the centres of the first and the last of four beads.
fn carpet(width: f64, height: f64, d: f64, levelling: Levelling, cell: f64) -> (f64, f64) {
    let bead_ = BeadModel {
        width,
        area: 2.0 / 3.0 * width * height,
        ..seed_bead()
    };
    let pool = PoolModel::for_bead(&POOL, &bead_);
    let map = HeightMap::new(DVec2::new(-10.0, -16.0), DVec2::new(110.0, 16.0), cell, 0.0).unwrap();
    let settings = Settings {
        mode: Mode::Build(levelling),
        ..Settings::default()
    };
    let mut dep = Deposition::new(map, bead_, pool, settings).unwrap();
    let mut clock = 0.0;
    for i in 0..4 {
        let y = d * (f64::from(i) - 1.5);
        let path = [xyz(0.0, y, 0.0), xyz(100.0, y, 0.0)];
        bead(&mut dep, &path, 1, &mut clock, bead_.area);
    }
    let out = dep.finish();
    let profile: Vec<(f64, f64)> = (0..=120)
        .map(|k| {
            let y = 1.5 * d * (f64::from(k) / 60.0 - 1.0);
            let z = (0..60).map(|j| out.map.height(DVec2::new(20.5 + f64::from(j), y))).sum::<f64>() / 60.0;
            (y, z)
        })
        .collect();
    let span = |slope: f64| {
        let z = profile.iter().map(|(y, z)| z - slope * y);
        z.clone().fold(f64::MIN, f64::max) - z.fold(f64::MAX, f64::min)
    };
    let flatness = (-150..=150).map(|k| span(1e-3 * f64::from(k))).fold(f64::MAX, f64::min);
    (flatness, span(0.0))
}

/// Table 4.3: stepover over the reference width, flatness and parallelism measured; reference width, first bead's width
/// and height.
const CARPETS: [(f64, [(f64, f64, f64); 5], f64, f64); 2] = [
    (
        6.54,
        [(0.6, 0.36, 0.61), (0.66, 0.36, 0.47), (0.7, 0.41, 0.49), (0.738, 0.47, 0.46), (0.8, 0.71, 0.69)],
        6.8,
        2.0,
    ),
    (
        4.8,
        [(0.6, 0.44, 0.50), (0.66, 0.30, 0.31), (0.7, 0.55, 0.53), (0.738, 0.56, 0.56), (0.8, 0.45, 0.43)],
        5.6,
        1.6,
    ),
];

fn misfit(levelling: Levelling, cell: f64) -> (f64, f64, String) {
    let mut rms = [0.0; 2];
    let mut text = String::new();
    for (group, (reference, rows, w, h)) in CARPETS.iter().enumerate() {
        for (k, flat, parallel) in rows {
            let (f, p) = carpet(*w, *h, k * reference, levelling, cell);
            rms[group] += (f - flat).powi(2) + (p - parallel).powi(2);
            text.push_str(&format!("{f:.2}/{p:.2} "));
        }
    }
    ((rms[0] / 10.0).sqrt(), (rms[1] / 10.0).sqrt(), text)
}

#[test]
#[ignore = "identification"]
fn wetting_length_of_the_carpets() {
    for length in [0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0] {
        let levelling = Levelling { wetting_length: length, ..Levelling::default() };
        let (a, b, text) = misfit(levelling, 0.25);
        println!("{length}: {a:.3} {b:.3} all {:.3} {text}", (0.5 * (a * a + b * b)).sqrt());
    }
    for cell in [0.5, 0.25] {
        for (sweeps, step) in [(2, 0.25), (4, 0.25), (8, 0.25), (16, 0.25), (4, 0.5), (8, 0.5)] {
            let levelling = Levelling { sweeps, step, ..Levelling::default() };
            let (a, b, text) = misfit(levelling, cell);
            println!("cell {cell} sweeps {sweeps} step {step}: {a:.3} {b:.3} {text}");
        }
    }
}
