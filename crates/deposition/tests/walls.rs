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
    for v in 0..40 {
        let y = -5.0 + 0.25 * f64::from(v);
        println!("{y} {:.3}", out.map.height(DVec2::new(75.0, y)));
    }
}
