//! The walls of Rouchon 2022, §4.3, by the full simulation.

mod support;

use meltpath_deposition::bead::PoolModel;
use meltpath_deposition::deposit::{Deposition, LayerRecord, Settings};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;
use support::*;

#[test]
fn waam_wall_thin_grows_like_the_measured_one() {
    let mut layers: Vec<LayerRecord> = Vec::new();
    let bead_ = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &bead_);
    let map = HeightMap::new(DVec2::new(-10.0, -10.0), DVec2::new(160.0, 10.0), 0.5, 0.0).unwrap();
    let mut d = Deposition::new(map, bead_, pool, Settings::default())
        .unwrap()
        .with_layers((0..=25).collect())
        .on_layer(|r, _| layers.push(r.clone()));
    let mut clock = 0.0;
    for n in 1..=25u32 {
        let z = 1.2 * f64::from(n - 1);
        let mut path = [xyz(0.0, 0.0, z), xyz(150.0, 0.0, z)];
        if n % 2 == 0 {
            path.reverse();
        }
        bead(&mut d, &path, n, &mut clock, bead_.area);
    }
    let out = d.finish();
    for l in &layers {
        println!("{} crest {:?} ctwd {:.2} acc {}", l.layer, l.crest.map(|c| (c.mean, c.least, c.greatest)), l.ctwd.unwrap().mean, l.accumulations.len());
    }
    println!("volume {} {}", out.map.volume(), out.volume);
    for x in 0..86 {
        let x = -5.0 + 2.0 * f64::from(x);
        print!("{x}:{:.2} ", out.map.height(DVec2::new(x, 0.0)));
    }
    println!();
}

fn raster(beads: usize, layers: u32, d: f64, dz: f64, length: f64, cell: f64, order: &[usize]) -> (Vec<LayerRecord>, HeightMap) {
    let mut records: Vec<LayerRecord> = Vec::new();
    let bead_ = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &bead_);
    let half = 0.5 * d * (beads - 1) as f64;
    let map = HeightMap::new(DVec2::new(-10.0, -half - 8.0), DVec2::new(length + 10.0, half + 8.0), cell, 0.0).unwrap();
    let mut dep = Deposition::new(map, bead_, pool, Settings::default())
        .unwrap()
        .with_layers((0..=layers).collect())
        .on_layer(|r, _| records.push(r.clone()));
    let mut clock = 0.0;
    for n in 1..=layers {
        let z = dz * f64::from(n - 1);
        for &i in order {
            let y = -half + d * i as f64;
            let mut path = [xyz(0.0, y, z), xyz(length, y, z)];
            if n % 2 == 0 {
                path.reverse();
            }
            bead(&mut dep, &path, n, &mut clock, bead_.area);
        }
    }
    let out = dep.finish();
    println!("volume error {:e}", out.map.volume() / out.volume - 1.0);
    let mean = |f: &dyn Fn(f64) -> f64| (0..40).map(|k| f(length * (0.3 + 0.4 * (f64::from(k) + 0.5) / 40.0))).sum::<f64>() / 40.0;
    for l in &records {
        let mut ct = vec![(0.0, 0); beads];
        for p in &l.path {
            if p.tool.x > 0.3 * length && p.tool.x < 0.7 * length {
                ct[p.bead as usize].0 += p.ctwd;
                ct[p.bead as usize].1 += 1;
            }
        }
        println!("{} crest {:.2} thick {:.2} ctwd {:.2} | {:?} acc {}", l.layer, l.crest.unwrap().mean, l.thickness.unwrap().mean, l.ctwd.unwrap().mean,
            ct.iter().map(|c| (100.0 * c.0 / f64::from(c.1)).round() / 100.0).collect::<Vec<_>>(), l.accumulations.len());
    }
    let mut y = -half - 4.0;
    while y < half + 4.0 {
        print!("{y:.2}:{:.2} ", mean(&|x| out.map.height(DVec2::new(x, y))));
        y += 0.5;
    }
    println!();
    (records, out.map)
}

#[test]
fn waam_wall_raster() {
    raster(6, 25, 4.62, 1.85, 100.0, 0.5, &[0, 1, 2, 3, 4, 5]);
}
