//! Charts interpolated between two powers beside charts computed for the power.
use crate::support::{fresh_layer, settings, titanium};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::between::{WIDEST, between};
use meltpath_thermal::charts::build::compute;
use meltpath_thermal::charts::simulation::{ChartSimulation, Settings};
use meltpath_thermal::charts::{ChartSet, ChartSettings};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::material::CELSIUS;

/// A beam: power (W), spot (mm), stop of its charts (°C), speed (mm/s).
struct Case {
    power: f64,
    spot: f64,
    stop: f64,
    speed: f64,
}

/// The hatch of the thesis' prisms, and its slow line.
const CASES: [Case; 2] = [
    Case {
        power: 300.0,
        spot: 0.413_67,
        stop: 3700.0,
        speed: 980.0,
    },
    Case {
        power: 120.0,
        spot: 0.551_67,
        stop: 2800.0,
        speed: 400.0,
    },
];

impl Case {
    /// Charts for a power, W; coarse, since only their differences count.
    fn charts(&self, power: f64) -> ChartSet {
        let settings = ChartSettings {
            stop: self.stop + CELSIUS,
            cell: 0.05,
            ..ChartSettings::for_beam(power, self.spot)
        };
        compute(&settings, &titanium(), &Silent).unwrap()
    }

    /// Highest temperatures of three lines of 3 mm.
    fn drawn(&self, set: &ChartSet) -> Field {
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
        let start = settings(set.settings.power, self.spot);
        let path = BeamPath::along(&corners, self.speed, start).unwrap();
        simulation
            .draw(&path, &[], &mut |_, _| (), &Silent)
            .unwrap();
        simulation.highest_temperature()
    }
}

/// Mean difference of highest temperatures where the metal melts, what 95 % of them stay below, and the largest, K.
fn apart(a: &Field, b: &Field) -> [f64; 3] {
    let liquidus = titanium().liquidus as f32;
    let pairs = a.values.iter().zip(&b.values);
    let mut all: Vec<f64> = pairs
        .filter(|(_, b)| **b > liquidus)
        .map(|(a, b)| f64::from((a - b).abs()))
        .collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    all.sort_by(f64::total_cmp);
    [mean, all[all.len() * 95 / 100], all[all.len() - 1]]
}

#[test]
fn charts_between_two_powers_are_those_of_their_own() {
    for case in CASES {
        let power = case.power;
        let own = case.charts(power);
        let truth = case.drawn(&own);
        // both ends as far away as the ratio allows, evenly on the logarithm
        let half = WIDEST.sqrt();
        let (low, high) = (case.charts(power / half), case.charts(power * half));
        let mixed = between(&high, &low, power).unwrap();
        let [mean, nearly, most] = apart(&case.drawn(&mixed), &truth);
        let as_own = ChartSet {
            settings: own.settings,
            ..low
        };
        let [nearest, ..] = apart(&case.drawn(&as_own), &truth);
        println!(
            "{:.0} W between {:.1} and {:.1} W: {mean:.1} K in the mean, 95 % within {nearly:.1} K, {most:.1} K at most; the nearest chart instead {nearest:.0} K",
            power,
            power / half,
            power * half
        );
        // recorded: 38 and 125 K at most, in single voxels
        assert!(mean < 10.0 && most < 150.0, "{mean} {most}");
        assert!(nearest > 5.0 * mean);
    }
}

/// Beyond the validity, outside the two, or of another beam: nothing.
#[test]
fn charts_that_do_not_enclose_a_power_are_not_mixed() {
    let half = WIDEST.sqrt();
    let low = CASES[0].charts(300.0 / half);
    let with = |change: fn(&mut ChartSettings, f64)| {
        let mut set = low.clone();
        change(&mut set.settings, 300.0 * half);
        set
    };
    let high = with(|s, power| s.power = power);
    assert!(between(&low, &high, 300.0).is_some());
    assert!(between(&low, &high, 360.0).is_none());
    let wide = with(|s, power| s.power = 1.01 * power);
    assert!(between(&low, &wide, 300.0).is_none());
    let other = with(|s, power| (s.power, s.efficiency) = (power, 0.8));
    assert!(between(&low, &other, 300.0).is_none());
}
