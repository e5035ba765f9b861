//! Charts interpolated between two currents beside charts computed for the current.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that fails stops here; its figures are shown with --nocapture"
)]

mod support;

use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::chart::{ChartSet, ChartSettings};
use meltpath_thermal::chart_between::{WIDEST, between};
use meltpath_thermal::chart_build::compute;
use meltpath_thermal::chart_simulation::{ChartSimulation, Settings};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::material::CELSIUS;
use support::{fresh_layer, settings, titanium};

/// Charts of the fast beam at a current, A; coarse, since only their differences count.
fn charts(current: f64) -> ChartSet {
    let settings = ChartSettings {
        stop: 3700.0 + CELSIUS,
        cell: 0.05,
        ..ChartSettings::of_thesis(60e3, current, 4e-3, 0.413_67)
    };
    compute(&settings, &titanium(), &Silent).unwrap()
}

/// Highest temperatures of three lines of 3 mm.
fn drawn(set: &ChartSet) -> Field {
    let low = DVec3::new(-0.5, -0.5, -0.35);
    let high = DVec3::new(3.5, 0.75, 0.0);
    let grid = Grid::covering(low, high, DVec3::new(0.057, 0.057, 0.05)).unwrap();
    let options = Settings::of(&titanium());
    let mut simulation =
        ChartSimulation::new(&grid, titanium(), vec![set.clone()], options).unwrap();
    simulation.set_state(fresh_layer);
    let corners = [
        [0.0, 0.0],
        [3.0, 0.0],
        [3.0, 0.125],
        [0.0, 0.125],
        [0.0, 0.25],
        [3.0, 0.25],
    ];
    let start = settings(set.settings.current, 4e-3);
    let path = BeamPath::along(&corners, 980.0, start).unwrap();
    simulation
        .draw(&path, &[], &mut |_, _| (), &Silent)
        .unwrap();
    simulation.highest_temperature()
}

/// Mean and largest difference of highest temperatures where the metal melts, K.
fn apart(a: &Field, b: &Field) -> [f64; 2] {
    let liquidus = titanium().liquidus as f32;
    let pairs = a.values.iter().zip(&b.values);
    let all: Vec<f64> = pairs
        .filter(|(_, b)| **b > liquidus)
        .map(|(a, b)| f64::from((a - b).abs()))
        .collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    [mean, all.iter().copied().fold(0.0, f64::max)]
}

#[test]
fn charts_between_two_currents_are_those_of_their_own() {
    let own = charts(5e-3);
    let truth = drawn(&own);
    // both ends as far from 5 mA as the ratio allows, evenly on the logarithm
    let half = WIDEST.sqrt();
    let (low, high) = (charts(5e-3 / half), charts(5e-3 * half));
    let mixed = between(&high, &low, 5e-3).unwrap();
    let [mean, most] = apart(&drawn(&mixed), &truth);
    let [nearest, _] = apart(
        &drawn(&ChartSet {
            settings: own.settings.clone(),
            ..low.clone()
        }),
        &truth,
    );
    println!(
        "5 mA between {:.2} and {:.2} mA: {mean:.1} K in the mean, {most:.1} K at most; the nearest chart instead {nearest:.0} K",
        5.0 / half,
        5.0 * half
    );
    assert!(mean < 10.0 && most < 60.0, "{mean} {most}");
    assert!(nearest > 5.0 * mean);
    // beyond the validity, outside the two, or of another beam: nothing
    let wide = |factor: f64| {
        let mut set = high.clone();
        set.settings.current = 5e-3 / half * factor;
        between(&low, &set, 5e-3).is_some()
    };
    assert!(wide(WIDEST) && !wide(1.01 * WIDEST));
    assert!(between(&low, &high, 6e-3).is_none());
    let mut other = high.clone();
    other.settings.efficiency = 0.8;
    assert!(between(&low, &other, 5e-3).is_none());
}
