//! The build plane itself, hotter than the cells below it, against heat under a spot at rest.

use std::f64::consts::PI;

use meltpath_base::Silent;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::levels::{BEND, Ground, Levels, Setup};
use meltpath_thermal::material::Material;
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::watch::Watch;
use meltpath_thermal::solver::{Face, State};

const POWER: f64 = 30.0;
const SPOT: f64 = 0.4;
const TIME: f64 = 2e-3;
const LAWS: [f64; 2] = [0.03, 4e-3];
const START: f64 = 300.0;

/// Rise under the middle of the spot: of the surface, highest and as told there, and of the uppermost cells, with planes of `height` mm.
fn rises(height: f64, depth: Depth) -> [f64; 3] {
    let mut heights = vec![height; (0.2 / height).round() as usize];
    while heights.iter().sum::<f64>() < 1.2 {
        heights.insert(0, 1.3 * heights[0]);
    }
    let setup = Setup {
        covered: [[-1.0; 2], [1.0; 2]],
        cell: 0.025,
        coarser: 2,
        heights,
        layer: 0.1,
        tracked: 0.2,
        top: Surface::Insulated,
        beyond: Face::Imposed(START),
        step: 5e-6,
        focus: None,
        bend: BEND,
    };
    let material = Material::constant(LAWS[0], LAWS[1], START);
    let matter = setup.ground(&material, &|_| State::Dense);
    let mut levels = Levels::on(setup, material, Ground::from(matter), START).unwrap();
    let beam = Beam {
        efficiency: 1.0,
        depth,
    };
    let point = |time: f64, power: f64| BeamPoint {
        time,
        x: 0.0,
        y: 0.0,
        power,
        spot: SPOT,
    };
    let path = BeamPath::new(vec![point(0.0, POWER), point(TIME, 0.0)]).unwrap();
    let watch = Watch {
        places: vec![[0.0; 3]],
        every: 2e-5,
    };
    levels.draw(&path, &beam, &watch, &Silent).unwrap();
    let window = [[-0.1; 2], [0.1; 2]];
    let samples = levels.watched(window, Vec::new()).samples;
    let told = samples.iter().map(|s| s.value).fold(0.0, f64::max);
    let surface = levels.highest_of_surface(window).largest().0;
    let cells = levels.highest_temperature(window).largest().0;
    [surface - START, told - START, cells - START]
}

/// All heat on the surface of a half space: `T = I a/(k√π) atan(√(4αt)/a)`, with `a = φ/√8` and `I = P/(πa²)` (Carslaw and Jaeger 1959).
#[test]
fn the_surface_under_a_spot_is_that_of_carslaw_and_jaeger() {
    let a = SPOT / 8.0_f64.sqrt();
    let diffusivity = LAWS[0] / LAWS[1];
    let flux = POWER / (PI * a * a);
    let reach = (4.0 * diffusivity * TIME).sqrt() / a;
    let exact = flux * a / (LAWS[0] * PI.sqrt()) * reach.atan();
    for height in [0.05, 0.025] {
        let [surface, told, cells] = rises(height, Depth::Surface);
        println!("{height}: {surface:.0} {told:.0} {cells:.0}, exact {exact:.0}");
        assert!(
            (surface / exact - 1.0).abs() < 0.08,
            "{height}: {surface} {exact}"
        );
        assert!(
            (told / surface - 1.0).abs() < 0.02,
            "{height}: {told} {surface}"
        );
        assert!(cells < surface);
    }
}

/// Heat in 20 µm of planes of 25 and of 50 µm: the surface is that of planes of 10 µm.
#[test]
fn the_surface_does_not_hang_on_the_planes() {
    let depth = Depth::Falling { penetration: 0.02 };
    let [fine, _, _] = rises(0.01, depth);
    for height in [0.025, 0.05] {
        let [surface, _, cells] = rises(height, depth);
        println!("{height}: {surface:.0} {cells:.0}, fine {fine:.0}");
        assert!(
            (surface / fine - 1.0).abs() < 0.08,
            "{height}: {surface} {fine}"
        );
    }
}

/// Heat that vapour takes of a line on titanium, % of the beam's, and its highest surface, K: uppermost planes of `height` mm.
fn vapour(height: f64, [power, speed, spot]: [f64; 3]) -> [f64; 2] {
    let mut heights = vec![height; (0.2 / height).round() as usize];
    while heights.iter().sum::<f64>() < 1.2 {
        heights.insert(0, 1.3 * heights[0]);
    }
    let material = crate::support::titanium();
    let setup = Setup {
        covered: [[-1.0, -1.0], [3.0, 1.0]],
        cell: 0.025,
        coarser: 2,
        heights,
        layer: 0.1,
        tracked: 0.2,
        top: Surface::Evaporating {
            surroundings: material.start,
            ambient: 0.2,
        },
        beyond: Face::Imposed(material.start),
        step: 5e-6,
        focus: None,
        bend: BEND,
    };
    let matter = setup.ground(&material, &|_| State::Dense);
    let start = material.start;
    let mut levels = Levels::on(setup, material, Ground::from(matter), start).unwrap();
    let beam = Beam {
        efficiency: 1.0,
        depth: Depth::Falling { penetration: 0.018 },
    };
    let point = |x: f64, power: f64| BeamPoint {
        time: x / speed,
        x,
        y: 0.0,
        power,
        spot,
    };
    let path = BeamPath::new(vec![point(0.0, power), point(2.0, 0.0)]).unwrap();
    let watch = Watch {
        places: Vec::new(),
        every: 1e-3,
    };
    levels.draw(&path, &beam, &watch, &Silent).unwrap();
    let window = [[-0.3, -0.3], [2.3, 0.3]];
    [
        100.0 * levels.ledger().vapour_share(),
        levels.highest_of_surface(window).largest().0,
    ]
}

/// What leaves hangs little on the planes where the pool is deeper than one: on a plane as high as the layer two thirds of it and more
/// leave. By the temperature of cells a hundredth to a twelfth did.
#[test]
fn vapour_leaves_by_the_surface_on_planes_of_any_height() {
    for case in [
        [120.0, 500.0, 0.4],
        [150.0, 500.0, 0.4],
        [300.0, 980.0, 0.4],
    ] {
        let [fine, hottest] = vapour(0.0125, case);
        for (height, most) in [(0.1, 0.36), (0.05, 0.08), (0.025, 0.01)] {
            let [share, surface] = vapour(height, case);
            println!(
                "{case:?} {height}: {share:.2} %, {surface:.0} K; fine {fine:.2} %, {hottest:.0} K"
            );
            assert!((share / fine - 1.0).abs() < most, "{case:?} {height}");
            assert!((surface - hottest).abs() < 150.0, "{case:?} {height}");
        }
    }
}
