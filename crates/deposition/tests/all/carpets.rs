//! Carpets of four beads, Rouchon 2022, table 4.3: where the wetting length comes from.
use crate::support::*;
use meltpath_deposition::bead::{BeadModel, PoolModel};
use meltpath_deposition::deposit::{Deposition, Levelling, Mode, Settings};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;

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
            let z = (0..60)
                .map(|j| out.map.height(DVec2::new(20.5 + f64::from(j), y)))
                .sum::<f64>()
                / 60.0;
            (y, z)
        })
        .collect();
    let span = |slope: f64| {
        let z = profile.iter().map(|(y, z)| z - slope * y);
        z.clone().fold(f64::MIN, f64::max) - z.fold(f64::MAX, f64::min)
    };
    let flatness = (-150..=150)
        .map(|k| span(1e-3 * f64::from(k)))
        .fold(f64::MAX, f64::min);
    (flatness, span(0.0))
}

type Campaign = (f64, [(f64, f64, f64); 5], f64, f64);

/// Table 4.3: stepover over the reference width, flatness and parallelism measured; reference width, first bead's width
/// and height.
const CARPETS: [Campaign; 2] = [
    (
        6.54,
        [
            (0.6, 0.36, 0.61),
            (0.66, 0.36, 0.47),
            (0.7, 0.41, 0.49),
            (0.738, 0.47, 0.46),
            (0.8, 0.71, 0.69),
        ],
        6.8,
        2.0,
    ),
    (
        4.8,
        [
            (0.6, 0.44, 0.50),
            (0.66, 0.30, 0.31),
            (0.7, 0.55, 0.53),
            (0.738, 0.56, 0.56),
            (0.8, 0.45, 0.43),
        ],
        5.6,
        1.6,
    ),
];

/// Root mean square of flatness and parallelism against the measurement, per group of five carpets.
fn misfit(levelling: Levelling, cell: f64) -> [f64; 2] {
    CARPETS.map(|(reference, rows, width, height)| {
        let square: f64 = rows
            .iter()
            .map(|(k, flat, parallel)| {
                let (f, p) = carpet(width, height, k * reference, levelling, cell);
                (f - flat).powi(2) + (p - parallel).powi(2)
            })
            .sum();
        (square / 10.0).sqrt()
    })
}

#[test]
fn carpets_are_as_flat_as_measured() {
    let [bulged, flat] = misfit(Levelling::default(), 0.25);
    // the polynomial assembly of the thesis misses the same measurements by 0.21 and 0.12 mm; the flat beads scatter
    // by defects of fusion (table 4.3 itself)
    assert!(bulged < 0.08, "{bulged}");
    assert!(flat < 0.16, "{flat}");
}

#[test]
#[ignore = "identifies the default wetting length: a minute"]
fn the_default_wetting_length_fits_best() {
    let total = |length: f64| {
        let levelling = Levelling {
            wetting_length: length,
            ..Levelling::default()
        };
        let [a, b] = misfit(levelling, 0.25);
        (0.5 * (a * a + b * b)).sqrt()
    };
    let best = total(Levelling::default().wetting_length);
    for length in [0.5, 0.75, 2.0, 3.0] {
        assert!(
            total(length) > best,
            "{length}: {} below {best}",
            total(length)
        );
    }
}
