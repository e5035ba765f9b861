//! Corners, rings, crossings, reversals: where beads turn, meet themselves or cross others, nothing spikes.
use crate::support::*;
use meltpath_deposition::bead::PoolModel;
use meltpath_deposition::deposit::{Deposit, Deposition, LayerRecord, Settings};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;

fn lay(layers: u32, paths: impl Fn(u32) -> Vec<Vec<DVec3>>) -> (Deposit, Vec<LayerRecord>) {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    let map = HeightMap::new(DVec2::splat(-50.0), DVec2::splat(60.0), 0.5, 0.0).unwrap();
    let mut records = Vec::new();
    let out = {
        let mut d = Deposition::new(map, model, pool, Settings::default())
            .unwrap()
            .with_layers((0..=layers).collect())
            .on_layer(|r, _| records.push(r.clone()));
        let mut clock = 0.0;
        for n in 1..=layers {
            for p in paths(n) {
                bead(&mut d, &p, n, &mut clock, model.area);
            }
        }
        d.finish()
    };
    assert!((out.map.volume() / out.volume - 1.0).abs() < 1e-9);
    assert!(sharpest(&out.map) < 0.2, "spike of {}", sharpest(&out.map));
    (out, records)
}

/// Greatest height of a cell over the highest of its four neighbours.
fn sharpest(map: &HeightMap) -> f64 {
    let mut worst = 0.0f64;
    for iy in 1..map.ny - 1 {
        for ix in 1..map.nx - 1 {
            let i = map.index(ix, iy);
            let around = [i - 1, i + 1, i - map.nx, i + map.nx];
            let highest = around.iter().map(|&j| map.z[j]).fold(f64::MIN, f64::max);
            worst = worst.max(map.z[i] - highest);
        }
    }
    worst
}

#[test]
fn a_right_angle_piles_up_little() {
    let (out, records) = lay(1, |_| {
        vec![vec![
            xyz(0.0, 0.0, 0.0),
            xyz(40.0, 0.0, 0.0),
            xyz(40.0, 40.0, 0.0),
        ]]
    });
    let h = seed_bead().height();
    assert!(out.map.maximum() < 1.2 * h, "{}", out.map.maximum());
    // the bead cuts the corner on its inside, after the turn
    let (inside, outside) = (
        out.map.height(DVec2::new(37.5, 2.5)),
        out.map.height(DVec2::new(42.5, -2.5)),
    );
    assert!(inside > outside + 0.3, "{inside} {outside}");
    assert!(records[0].accumulations.is_empty());
    assert_eq!(records[0].arc_starts.len(), 1);
}

#[test]
fn a_closed_ring_grows_evenly() {
    let (_, records) = lay(20, |n| {
        let point = |i: u32| {
            let a = std::f64::consts::TAU * f64::from(i) / 240.0 + f64::from(n);
            xyz(30.0 * a.cos(), 30.0 * a.sin(), 1.6 * f64::from(n - 1))
        };
        vec![(0..=240).map(point).collect()]
    });
    let crest = |n: usize| records[n - 1].crest.unwrap();
    let growth = (crest(20).mean - crest(1).mean) / 19.0;
    // no ends to run down to: the section over 0.9 of the width
    let expected = seed_bead().area / (0.9 * seed_bead().width);
    assert!(
        (growth / expected - 1.0).abs() < 0.03,
        "{growth} {expected}"
    );
    assert!(crest(20).greatest - crest(20).least < 1.0);
}

#[test]
fn a_crossing_is_higher_than_a_bead_and_lower_than_two() {
    let (out, _) = lay(1, |_| {
        vec![
            vec![xyz(-30.0, 0.0, 0.0), xyz(30.0, 0.0, 0.0)],
            vec![xyz(0.0, -30.0, 0.0), xyz(0.0, 30.0, 0.0)],
        ]
    });
    let h = seed_bead().height();
    let top = out.map.height(DVec2::ZERO);
    assert!(top > 1.05 * h && top < 2.0 * h, "{top}");
}

#[test]
fn reversals_at_stepover_distance_pile_up_moderately() {
    let (out, records) = lay(5, |n| {
        let z = 1.95 * f64::from(n - 1);
        let mut path: Vec<DVec3> = (0..8)
            .flat_map(|i| {
                let y = 4.6 * f64::from(i);
                let (a, b) = if i % 2 == 0 { (0.0, 40.0) } else { (40.0, 0.0) };
                [xyz(a, y, z), xyz(b, y, z)]
            })
            .collect();
        if n % 2 == 0 {
            path.reverse();
        }
        vec![path]
    });
    let inside = out.map.height(DVec2::new(20.0, 16.1));
    assert!(
        out.map.maximum() < inside + 2.0,
        "{} {inside}",
        out.map.maximum()
    );
    // told as accumulations at the turns, where there are any
    for a in &records[4].accumulations {
        assert!(
            a.ratio > 1.3 && !(8.0..32.0).contains(&a.position.x),
            "{a:?}"
        );
    }
}
