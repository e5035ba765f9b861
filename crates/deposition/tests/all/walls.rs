//! The three walls of Rouchon 2022, §4.3, by the full simulation: same bead, same parameters, 0.5 mm cells.
//!
//! Bead: the seed at V_f 8, V_r 0.75 m/min with k_f = 1.15, for the thin wall with the 10.10 m/min measured in its first
//! layer; the wire feed follows the contact tube distance. Stepover 0.66 of the expected 7 mm. The thesis does not give the
//! length of the thick walls: 150 mm here, like the thin one.
use crate::support::*;
use meltpath_deposition::bead::PoolModel;
use meltpath_deposition::deposit::{Deposit, Deposition, LayerRecord, Settings};
use meltpath_deposition::process_map::ProcessMap;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;

const D: f64 = 4.62;

/// A wall along x: its records, its mean section over the central part after each layer, and what is left in the end.
struct Wall {
    records: Vec<LayerRecord>,
    sections: Vec<Vec<f64>>,
    deposit: Deposit,
}

/// Lateral positions of the sections, mm.
fn lateral() -> impl Iterator<Item = f64> + Clone {
    (-300..=300).map(|j| 0.1 * f64::from(j))
}

/// The map of the walls, and their settings, mm/s.
const WIRE_FEED: f64 = 8000.0 / 60.0;

fn map() -> ProcessMap {
    ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap()
}

fn build(
    map: &ProcessMap,
    layers: u32,
    (centre, half): (f64, f64),
    paths: impl Fn(u32) -> Vec<Vec<DVec3>>,
) -> Wall {
    let model = map.bead(WIRE_FEED, SPEED).model(map);
    let settings = Settings {
        feed_response: map.response(WIRE_FEED, None),
        ..Settings::default()
    };
    let pool = PoolModel::for_bead(&POOL, &model);
    let map = HeightMap::new(DVec2::new(-25.0, -30.0), DVec2::new(175.0, 30.0), 0.5, 0.0).unwrap();
    let (mut records, mut sections) = (Vec::new(), Vec::new());
    let deposit = {
        let mut d = Deposition::new(map, model, pool, settings)
            .unwrap()
            .with_layers((0..=layers).collect())
            .on_layer(|r, map| {
                records.push(r.clone());
                let mean = |y: f64| {
                    (0..60)
                        .map(|i| centre + half * (f64::from(i) - 29.5) / 30.0)
                        .map(|x| map.height(DVec2::new(x, y)))
                        .sum::<f64>()
                        / 60.0
                };
                sections.push(lateral().map(mean).collect());
            });
        let mut clock = 0.0;
        for n in 1..=layers {
            for path in paths(n) {
                bead(&mut d, &path, n, &mut clock, model.area);
            }
        }
        d.finish()
    };
    assert!(
        (deposit.map.volume() / deposit.volume - 1.0).abs() < 1e-6,
        "deposited volume is fed volume"
    );
    Wall {
        records,
        sections,
        deposit,
    }
}

impl Wall {
    /// Height at lateral position `y` after layer `n`.
    fn at(&self, n: usize, y: f64) -> f64 {
        self.sections[n - 1][((y + 30.0) / 0.1).round() as usize]
    }

    /// Mean distance from contact tube to part of each bead of layer `n` for tool points with x in a range.
    fn distances(&self, n: usize, from: f64, to: f64) -> Vec<f64> {
        let record = &self.records[n - 1];
        (0..record.beads)
            .map(|b| {
                let inside: Vec<f64> = record
                    .path
                    .iter()
                    .filter(|p| p.bead == b && p.tool.x > from && p.tool.x < to)
                    .map(|p| p.ctwd)
                    .collect();
                inside.iter().sum::<f64>() / inside.len() as f64
            })
            .collect()
    }

    /// Width of the section above `z` after layer `n`.
    fn width_at(&self, n: usize, z: f64) -> f64 {
        0.1 * self.sections[n - 1].iter().filter(|h| **h > z).count() as f64
    }
}

#[test]
fn waam_wall_thin_grows_1_65_mm_a_layer() {
    let wall = build(
        &map().with_feed_factor(10.10 / 8.0),
        25,
        (75.0, 45.0),
        |n| {
            let z = 1.2 * f64::from(n - 1);
            let mut path = vec![xyz(0.0, 0.0, z), xyz(150.0, 0.0, z)];
            if n % 2 == 0 {
                path.reverse();
            }
            vec![path]
        },
    );
    // growth as the source counts it: what the distance lost, over the layers below
    let distance = wall.distances(22, 30.0, 120.0)[0];
    let growth = (15.0 + 21.0 * 1.2 - distance) / 21.0;
    assert!((growth - 1.65).abs() < 0.1, "growth {growth}");
    // 7.0 without the robot's stops at the ends, which feed them; 6.8 with them (tests of the whole chain)
    assert!((distance - 7.0).abs() < 0.05, "distance {distance}");
    assert!((wall.at(21, 0.0) / 21.0 - growth).abs() < 0.02);
    // near-vertical flanks: over the middle 60 % of the height the half width changes by less than a cell
    let top = wall.at(25, 0.0);
    let (low, high) = (wall.width_at(25, 0.2 * top), wall.width_at(25, 0.8 * top));
    let lean = (0.5 * (low - high)).atan2(0.6 * top).to_degrees();
    assert!(lean.abs() < 2.0, "flanks {lean} degrees off vertical");
    assert!(
        (0.5 * (low + high) / (0.9 * 6.82) - 1.0).abs() < 0.08,
        "{low} {high}"
    );
    // lower at the ends than at the centre, and no accumulation but where a bead ends on a sloping end
    let end = wall.deposit.map.height(DVec2::new(3.0, 0.0));
    assert!(end < top - 1.0 && end > top - 6.0, "end {end} top {top}");
}

/// The raster wall: six beads a layer, each layer from the other end.
fn raster(map: &ProcessMap, layers: u32) -> Wall {
    build(map, layers, (75.0, 30.0), |n| {
        (0..6)
            .map(|i| {
                let (y, z) = (D * (f64::from(i) - 2.5), 1.85 * f64::from(n - 1));
                let mut path = vec![xyz(0.0, y, z), xyz(150.0, y, z)];
                if n % 2 == 0 {
                    path.reverse();
                }
                path
            })
            .collect()
    })
}

#[test]
fn the_source_regulates_an_error_of_the_process_map() {
    // two builds by a map that is 5 % wrong and by the right one: the error of height is the closed form's
    let seed = map();
    let off = seed.clone().with_feed_factor(1.15 * 1.05);
    let mean = |w: &Wall, n: usize| {
        let inside = lateral().filter(|y| y.abs() <= 2.0 * D);
        inside.clone().map(|y| w.at(n, y)).sum::<f64>() / inside.count() as f64
    };
    let (right, wrong) = (raster(&seed, 25), raster(&off, 25));
    let response = seed.response(WIRE_FEED, None).unwrap();
    for n in [5, 15, 25] {
        let error = mean(&wrong, n) - mean(&right, n);
        let expected = response.height_error(0.05, mean(&right, n));
        // 0.51, 1.07 and 1.42 mm; without the source's answer it would be 2.41 mm at layer 25
        assert!((error - expected).abs() < 0.08, "{n}: {error} {expected}");
    }
}

#[test]
fn waam_wall_raster_grows_flat_with_lower_edges() {
    let centre = |i: usize| D * (i as f64 - 2.5);
    let wall = raster(&map(), 25);
    // growth inside: beads 3 and 4
    let inner = |n: usize| 0.5 * (wall.at(n, centre(2)) + wall.at(n, centre(3)));
    let growth = (inner(25) - inner(5)) / 20.0;
    assert!((1.9..=2.1).contains(&growth), "growth {growth}");
    let distances = wall.distances(25, 45.0, 105.0);
    // between 15 and 12 mm for all beads, as measured: 15.2 on the first of each layer
    assert!(
        distances.iter().all(|d| *d > 12.0 && *d < 15.3),
        "{distances:?}"
    );
    // ripple: the valleys between neighbouring bead centres inside, below the line through the two centres
    let valleys = |n: usize| -> Vec<f64> {
        (1..4)
            .map(|i| {
                let (a, b) = (centre(i), centre(i + 1));
                let chord = |y: f64| wall.at(n, a) + (wall.at(n, b) - wall.at(n, a)) * (y - a) / D;
                (0..=46)
                    .map(|j| a + 0.1 * f64::from(j))
                    .map(|y| chord(y) - wall.at(n, y))
                    .fold(0.0, f64::max)
            })
            .collect()
    };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (early, late) = (valleys(5), valleys(25));
    for n in [5, 10, 15, 20, 25] {
        assert!(valleys(n).iter().all(|v| *v <= 1.0), "{:?}", valleys(n));
    }
    assert!(mean(&late) <= mean(&early) + 0.02, "{early:?} {late:?}");
    // the one beside the edge bead follows the slope that the edge's sag gives it: 0.62 to 0.72 mm
    assert!(late[0] <= early[0] + 0.11, "{early:?} {late:?}");
    // lower free edges
    let sag = |n: usize| inner(n) - wall.at(n, centre(0));
    let sags: Vec<f64> = [5, 10, 15, 20, 25].iter().map(|&n| sag(n)).collect();
    let more: Vec<f64> = sags.windows(2).map(|w| w[1] - w[0]).collect();
    assert!(
        more.windows(2).all(|w| w[1] < w[0]) && more[3] < 0.3,
        "{sags:?}"
    );
    for n in [5, 15, 25] {
        assert!(wall.at(n, centre(0)) < inner(n) - 0.5 && wall.at(n, centre(5)) < inner(n) - 0.3);
    }
}

#[test]
fn waam_wall_contour_is_flat_on_top() {
    let wall = build(&map(), 20, (75.0, 20.0), |n| {
        let z = 1.85 * f64::from(n - 1);
        let mut path = Vec::new();
        for i in 0..4 {
            // from inside out; the link to the next rectangle leaves from the lower left corner
            let (a, b) = (55.0 + D * f64::from(i), D * (f64::from(i) + 0.5));
            for (x, y) in [(-a, -b), (a, -b), (a, b), (-a, b), (-a, -b)] {
                path.push(xyz(75.0 + x, y, z));
            }
        }
        vec![path]
    });
    // flat: crests and valleys of the six inner beads
    let top: Vec<f64> = lateral()
        .filter(|y| y.abs() <= 2.5 * D)
        .map(|y| wall.at(20, y))
        .collect();
    let (low, high) = (
        top.iter().copied().fold(f64::MAX, f64::min),
        top.iter().copied().fold(f64::MIN, f64::max),
    );
    assert!(high - low < 2.0, "{low} {high}");
    let edges = 0.5 * (wall.at(20, 3.5 * D) + wall.at(20, -3.5 * D));
    let mean = top.iter().sum::<f64>() / top.len() as f64;
    assert!(edges < mean, "{edges} {mean}");
    let growth = (wall.at(20, 0.5 * D) - wall.at(5, 0.5 * D)) / 15.0;
    assert!((1.8..=2.15).contains(&growth), "{growth}");
    // the corners and the links accumulate, moderately
    let highest = wall.deposit.map.maximum();
    assert!(highest < mean * 1.15, "{highest} {mean}");
}
