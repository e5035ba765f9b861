//! The solver on levels once the beam is off: a pool that spreads stays as fine as it bends, however long the path idles after it.

use std::f64::consts::PI;

use crate::support::{self, beam, titanium};
use meltpath_base::Silent;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::levels::{Levels, Setup};
use meltpath_thermal::material::Material;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::watch::Watch;
use meltpath_thermal::solver::{Face, State};

const POWER: f64 = 60.0;
const SPOT: f64 = 0.4;

/// A beam at rest at the origin in each of `spells`, s; the path ends at `end`.
fn resting(spells: &[[f64; 2]], end: f64) -> BeamPath {
    let at = |time: f64, power: f64| BeamPoint {
        time,
        ..support::settings(power, SPOT)
    };
    let mut points = Vec::new();
    for [on, off] in spells {
        points.extend([at(*on, POWER), at(*off, 0.0)]);
    }
    points.push(at(end, 0.0));
    BeamPath::new(points).unwrap()
}

/// Ground `below` deep at least, cells in roots of `coarser` levels as wide beside the spot.
fn setup(cell: f64, coarser: usize, below: f64) -> Setup {
    let root = 16.0 * cell * f64::from(1_u32 << coarser);
    let wide = root * (2.0 * below / root).ceil();
    let mut heights = vec![0.05; 4];
    while heights.iter().sum::<f64>() < below {
        heights.push(1.5 * heights[heights.len() - 1]);
    }
    heights.reverse();
    support::on_levels(
        [[-0.5 * wide; 2], [0.5 * wide; 2]],
        (cell, coarser),
        heights,
    )
}

fn drawn(setup: &Setup, material: &Material, path: &BeamPath, places: Vec<[f64; 3]>) -> Levels {
    let matter = setup.ground(material, &|_| State::Dense);
    let mut levels = Levels::new(setup.clone(), material.clone(), matter).unwrap();
    let watch = Watch {
        places,
        every: 2e-5,
    };
    levels.draw(path, &beam(), &watch, &Silent).unwrap();
    levels
}

/// What was told of a place at a time, straight between two samples, K.
fn told(levels: &mut Levels, place: [f64; 3], time: f64) -> f64 {
    let corners = [[-0.5; 2], [0.5; 2]];
    let samples = levels.watched(corners, Vec::new()).samples;
    let of: Vec<[f64; 2]> = samples
        .iter()
        .filter(|s| s.place == place)
        .map(|s| [s.time, s.value])
        .collect();
    let after = of.partition_point(|[t, _]| *t < time);
    let [[t0, before], [t1, after]] = [of[after - 1], of[after]];
    before + (after - before) * (time - t0) / (t1 - t0)
}

/// Ground that is deeper and wider, with more levels of coarser cells, because the path idles the longer, changes nothing of what
/// was before; heat is kept, and every column that melted froze.
#[test]
fn how_long_a_path_idles_changes_nothing_before() {
    let material = titanium();
    let place = [0.0, 0.0, 0.0];
    for cell in [0.025, 0.031_25] {
        let run = |end: f64, coarser: usize, below: f64| {
            let path = resting(&[[0.0, 1e-3], [2e-3, 2.5e-3]], end);
            drawn(&setup(cell, coarser, below), &material, &path, vec![place])
        };
        let [mut short, mut long] = [run(4e-3, 1, 0.6), run(30e-3, 4, 1.5)];
        for time in [
            1e-3, 1.1e-3, 1.3e-3, 1.9e-3, 2.45e-3, 2.6e-3, 2.8e-3, 3.5e-3,
        ] {
            let [a, b] = [&mut short, &mut long].map(|l| told(l, place, time));
            println!("{cell} mm, {time} s: {a:.1} and {b:.1} K");
            let most = (0.002 * (a - material.start)).max(1.0);
            assert!((a - b).abs() < most, "{time}: {a} {b}");
        }
        let ledger = *long.ledger();
        assert!(ledger.residual(long.stored()).abs() < 1e-3, "{ledger:?}");
        let freezing = long.watched([[-0.5; 2], [0.5; 2]], Vec::new()).freezing;
        let mut froze = 0;
        for (above, fell) in freezing.above.values.iter().zip(&freezing.fell.values) {
            assert!(
                *above == 0.0 || !fell.is_nan(),
                "molten for {above} s, and never froze"
            );
            froze += usize::from(*above > 0.0);
        }
        assert!(froze > 30, "{froze}");
    }
}

/// Rise of a half space of constant laws, K, `depth` mm below the middle of a spot that rested from 0 to `off`; its heat falls with
/// the depth. Every instant of the beam leaves a bell that spreads (Carslaw and Jaeger 1959, chapter X).
fn spread([conductivity, capacity]: [f64; 2], off: f64, time: f64, depth: f64) -> f64 {
    let diffusivity = conductivity / capacity;
    let penetration = 0.1;
    let (steps, slices) = (400, 100);
    let mut sum = 0.0;
    for n in 0..steps {
        // the age of the heat grows with the square: the youngest spreads the quickest
        let [from, to] = [time - off, time].map(f64::sqrt);
        let width = (to - from) / f64::from(steps);
        let root = from + (f64::from(n) + 0.5) * width;
        let (age, weight) = (root * root, 2.0 * root * width);
        let across = 1.0 / (2.0 * PI * ((0.25 * SPOT).powi(2) + 2.0 * diffusivity * age));
        let mut along = 0.0;
        for k in 0..slices {
            let at = penetration * (f64::from(k) + 0.5) / f64::from(slices);
            let share = 2.0 / f64::from(slices) * (1.0 - at / penetration);
            let bell = |d: f64| (-d * d / (4.0 * diffusivity * age)).exp();
            along += share * (bell(depth - at) + bell(depth + at));
        }
        sum += weight * across * along / (4.0 * PI * diffusivity * age).sqrt();
    }
    beam().efficiency * POWER / capacity * sum
}

/// After its end a spot of 2 ms spreads as the closed form says, to within 3 % of the rise of the surface, on cells of any size and with any number of levels.
#[test]
fn heat_spreads_as_the_closed_form_says_once_the_beam_is_off() {
    let laws = [0.025, 3.2e-3];
    let material = Material::constant(laws[0], laws[1], 1000.0);
    let off = 2e-3;
    for (cell, coarser) in [(0.031_25, 4), (0.025, 3), (0.015_625, 2)] {
        let setup = Setup {
            top: Surface::Insulated,
            beyond: Face::Imposed(material.start),
            ..setup(cell, coarser, 1.5)
        };
        let places = [[0.0, 0.0, 0.0], [0.0, 0.0, -0.3]];
        let path = resting(&[[0.0, off]], 6e-3);
        let mut levels = drawn(&setup, &material, &path, places.to_vec());
        for after in [0.25e-3, 0.5e-3, 1e-3, 1.5e-3, 2e-3, 3e-3] {
            let surface = spread(laws, off, off + after, 0.0);
            for place in places {
                let rise = told(&mut levels, place, off + after) - material.start;
                let exact = spread(laws, off, off + after, -place[2]);
                println!(
                    "{cell} mm, {after} s after, {} mm: {rise:.1}, exact {exact:.1} K",
                    place[2]
                );
                assert!((rise - exact).abs() < 0.03 * surface, "{rise} {exact}");
            }
        }
    }
}
