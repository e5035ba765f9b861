//! Corners, rings, crossings, reversals.

mod support;
use meltpath_deposition::bead::PoolModel;
use meltpath_deposition::deposit::*;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use support::*;

fn lay(paths: &[(u32, Vec<DVec3>)], lo: DVec2, hi: DVec2, cell: f64) -> (Deposit, Vec<LayerRecord>, Vec<meltpath_base::Warning>) {
    let bead_ = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &bead_);
    let map = HeightMap::new(lo, hi, cell, 0.0).unwrap();
    let reporter = meltpath_base::Reporter::new();
    let mut records = Vec::new();
    let out = {
        let top = paths.iter().map(|p| p.0).max().unwrap();
        let mut dep = Deposition::new(map, bead_, pool, Settings::default()).unwrap()
            .with_layers((0..=top).collect())
            .on_layer(|r, _| records.push(r.clone()))
            .reporting_to(&reporter);
        let mut clock = 0.0;
        for (n, p) in paths {
            bead(&mut dep, p, *n, &mut clock, bead_.area);
        }
        dep.finish()
    };
    (out, records, reporter.warnings())
}

fn ppm(map: &HeightMap, name: &str) {
    let max = map.maximum();
    let mut s = format!("P3\n{} {}\n255\n", map.nx, map.ny);
    for iy in (0..map.ny).rev() {
        for ix in 0..map.nx {
            let t = (map.z[map.index(ix, iy)] / max).clamp(0.0, 1.0);
            let r = (255.0 * (1.5 - (4.0 * t - 3.0).abs()).clamp(0.0, 1.0)) as u8;
            let g = (255.0 * (1.5 - (4.0 * t - 2.0).abs()).clamp(0.0, 1.0)) as u8;
            let b = (255.0 * (1.5 - (4.0 * t - 1.0).abs()).clamp(0.0, 1.0)) as u8;
            s.push_str(&format!("{r} {g} {b}\n"));
        }
    }
    std::fs::write(format!("/tmp/{name}.ppm"), s).unwrap();
}

#[test]
fn look() {
    let z = 0.0;
    let corner = vec![(1, vec![xyz(0., 0., z), xyz(40., 0., z), xyz(40., 40., z)])];
    let ring: Vec<_> = (1..=20u32).map(|n| (n, (0..=240).map(|i| { let a = std::f64::consts::TAU * f64::from(i) / 240.0 + f64::from(n); xyz(30.0 * a.cos(), 30.0 * a.sin(), 1.6 * f64::from(n - 1)) }).collect::<Vec<_>>())).collect();
    let cross = vec![(1, vec![xyz(-30., 0., z), xyz(30., 0., z)]), (1, vec![xyz(0., -30., z), xyz(0., 30., z)])];
    let mut zz = Vec::new();
    for i in 0..8 { let (a, b) = if i % 2 == 0 { (0., 40.) } else { (40., 0.) }; zz.push(xyz(a, 4.6 * f64::from(i), z)); zz.push(xyz(b, 4.6 * f64::from(i), z)); }
    let zigzag: Vec<_> = (1..=5u32).map(|n| { let mut p: Vec<_> = zz.iter().map(|q| xyz(q.x, q.y, 1.95 * f64::from(n - 1))).collect(); if n % 2 == 0 { p.reverse(); } (n, p) }).collect();
    let square: Vec<_> = (1..=10u32).map(|n| { let z = 1.6 * f64::from(n - 1); (n, vec![xyz(0., 20., z), xyz(0., 0., z), xyz(40., 0., z), xyz(40., 40., z), xyz(0., 40., z), xyz(0., 20., z)]) }).collect();
    let slant: Vec<_> = (1..=15u32).map(|n| (n, turned(&[xyz(-40., 0., 1.6 * f64::from(n - 1)), xyz(40., 0., 1.6 * f64::from(n - 1))], 0.5))).collect();
    for (name, paths) in [("corner", corner), ("ring", ring), ("cross", cross), ("zigzag", zigzag), ("square", square), ("slant", slant)] {
        let (out, records, warnings) = lay(&paths, DVec2::splat(-50.0), DVec2::splat(60.0), 0.5);
        println!("{name}: max {:.2} vol err {:.1e}", out.map.maximum(), out.map.volume() / out.volume - 1.0);
        for r in records.iter().filter(|r| r.layer == 1 || r.layer % 5 == 0) {
            let c = r.crest.unwrap(); let t = r.thickness.unwrap();
            println!("  layer {} crest {:.2} [{:.2} {:.2}] thick {:.2} [{:.2} {:.2}] acc {:?}", r.layer, c.mean, c.least, c.greatest, t.mean, t.least, t.greatest, r.accumulations.iter().map(|a| (a.position.x.round(), a.position.y.round(), (100.0 * a.ratio).round())).collect::<Vec<_>>());
        }
        for w in warnings { println!("  {} {}", w.code, w.message); }
        ppm(&out.map, name);
        // sharpest point: height over the mean of its four neighbours
        let m = &out.map;
        let mut worst = (0.0, DVec2::ZERO);
        for iy in 1..m.ny - 1 { for ix in 1..m.nx - 1 { let i = m.index(ix, iy);
            let around = [m.z[i - 1], m.z[i + 1], m.z[i - m.nx], m.z[i + m.nx]];
            let over = m.z[i] - around.iter().copied().fold(f64::MIN, f64::max);
            if over > worst.0 { worst = (over, m.centre(ix, iy)); } } }
        println!("  sharpest {worst:?}");
    }
}
