//! The build plane itself, hotter than the cells below it, against heat under a spot at rest.

use std::f64::consts::PI;

use meltpath_base::Silent;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::levels::{BEND, Ground, Levels, Setup};
use meltpath_thermal::material::Material;
use meltpath_thermal::material::enthalpy::Enthalpy;
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

/// Heat that an area of dense metal loses to vapour, J/mm², under `flux` W/mm² for `time` s: finite differences in one dimension, cells
/// of 4 µm.
fn in_one_dimension(material: &Material, flux: f64, time: f64) -> f64 {
    let curve = Enthalpy::new(material).unwrap();
    let law = material.evaporation.as_ref().unwrap();
    let (dz, cells) = (4e-3, 150);
    let dt = 0.4 * dz * dz / curve.diffusivity_max;
    let mut enthalpy = vec![0.0; cells];
    let mut theta = vec![0.0; cells + 1];
    let (mut lost, mut kelvin) = (0.0, material.start);
    for _ in 0..(time / dt).round() as usize {
        let black = 5.670_374_419e-14 * (kelvin.powi(4) - material.start.powi(4));
        let vapour = if kelvin > material.liquidus {
            law.flux(kelvin, AMBIENT)
        } else {
            0.0
        };
        for (theta, g) in theta.iter_mut().zip(&enthalpy) {
            *theta = curve.kirchhoff_at(curve.temperature(*g));
        }
        let arrives = flux - material.emissivity * black - vapour;
        let mut from_above = arrives;
        for k in 0..cells {
            let below = (theta[k] - theta[k + 1]) / dz;
            enthalpy[k] += dt / dz * (from_above - below);
            from_above = below;
        }
        // half a cell above the middle of the first
        kelvin = curve.of_kirchhoff(theta[0] + 0.5 * dz * arrives);
        lost += dt * vapour;
    }
    lost
}

const AMBIENT: f64 = 0.2;

/// A spot at rest so wide that heat goes straight down: what leaves as vapour, J, with uppermost planes of `height` mm.
fn vapour_of_a_spot(material: &Material, height: f64, [power, spot, time]: [f64; 3]) -> f64 {
    let mut heights = vec![height; (0.4 / height).round() as usize];
    while heights.iter().sum::<f64>() < 1.2 {
        heights.insert(0, 1.3 * heights[0]);
    }
    let setup = Setup {
        covered: [[-0.84 * spot; 2], [0.84 * spot; 2]],
        cell: spot / 30.0,
        coarser: 1,
        heights,
        layer: 0.1,
        tracked: 0.4,
        top: Surface::Evaporating {
            surroundings: material.start,
            ambient: AMBIENT,
        },
        beyond: Face::Imposed(material.start),
        step: 5e-6,
        focus: None,
        bend: BEND,
    };
    let ground = Ground::from(setup.ground(material, &|_| State::Dense));
    let mut levels = Levels::on(setup, material.clone(), ground, material.start).unwrap();
    let beam = Beam {
        efficiency: 1.0,
        depth: Depth::Surface,
    };
    let point = |time: f64, power: f64| BeamPoint {
        time,
        x: 0.0,
        y: 0.0,
        power,
        spot,
    };
    let path = BeamPath::new(vec![point(0.0, power), point(time, 0.0)]).unwrap();
    levels
        .draw(&path, &beam, &crate::support::nothing(), &Silent)
        .unwrap();
    levels.ledger().evaporated
}

/// The rings of a wide spot one by one in one dimension, by another program: the same heat leaves as vapour.
#[test]
fn vapour_of_a_wide_spot_is_that_of_one_dimension() {
    const SPOT: f64 = 6.0;
    const RINGS: f64 = 16.0;
    // the highest flux of the spot, W/mm²
    for (most, time) in [(600.0, 1.2e-3), (1000.0, 0.8e-3)] {
        // fresh powder holds less heat than the metal below: here it is as dense
        let material = crate::support::dense_titanium();
        let ring = 1.0 / RINGS;
        let of_ring = |n: i32| {
            // of the power beyond the ring, and with it of the highest flux
            let beyond = 1.0 - (f64::from(n) + 0.5) * ring;
            // an area between two fluxes is πφ²/8 times the logarithm of their ratio
            let area = PI * SPOT * SPOT / 8.0 * (ring / beyond);
            in_one_dimension(&material, most * beyond, time) * area
        };
        let exact: f64 = (0..RINGS as i32).map(of_ring).sum();
        let power = most * PI * SPOT * SPOT / 8.0;
        for height in [0.05, 0.025] {
            let ratio = vapour_of_a_spot(&material, height, [power, SPOT, time]) / exact;
            println!("{most} {height}: {ratio:.3} of {exact:.4} J");
            assert!((ratio - 1.0).abs() < 0.12, "{most} {height}: {ratio}");
        }
    }
}
