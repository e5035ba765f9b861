//! Laws that hold for any path: volume, mirror images, independence of the grid and of how motion is cut in blocks.
use crate::support::*;
use meltpath_base::Reporter;
use meltpath_deposition::bead::PoolModel;
use meltpath_deposition::deposit::{Deposit, Deposition, Mode, Settings};
use meltpath_deposition::feed_response::FeedResponse;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};
use proptest::prelude::*;

fn lay(paths: &[Vec<DVec3>], cell: f64, mode: Option<Mode>) -> Deposit {
    let settings = Settings {
        mode: mode.unwrap_or(Settings::default().mode),
        ..Settings::default()
    };
    lay_with(settings, paths, cell)
}

fn lay_with(settings: Settings, paths: &[Vec<DVec3>], cell: f64) -> Deposit {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    let map = HeightMap::new(DVec2::splat(-60.0), DVec2::splat(60.0), cell, 0.0).unwrap();
    let mut d = Deposition::new(map, model, pool, settings).unwrap();
    let mut clock = 0.0;
    for p in paths {
        bead(&mut d, p, 1, &mut clock, model.area);
    }
    d.finish()
}

fn paths() -> impl Strategy<Value = Vec<Vec<DVec3>>> {
    let point = (-40.0f64..40.0, -40.0f64..40.0).prop_map(|(x, y)| xyz(x, y, 0.0));
    prop::collection::vec(prop::collection::vec(point, 2..5), 1..4)
}

/// Highest cell less the highest of its eight neighbours: a spike where large.
fn sharpest(map: &HeightMap) -> f64 {
    let mut worst = 0.0f64;
    for iy in 1..map.ny - 1 {
        for ix in 1..map.nx - 1 {
            let around = (iy - 1..=iy + 1)
                .flat_map(|jy| (ix - 1..=ix + 1).map(move |jx| (jx, jy)))
                .filter(|&j| j != (ix, iy))
                .map(|(jx, jy)| map.z[map.index(jx, jy)])
                .fold(f64::MIN, f64::max);
            worst = worst.max(map.z[map.index(ix, iy)] - around);
        }
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn waam_ac22_all_that_is_fed_is_laid(paths in paths(), plain in prop::bool::ANY) {
        let mode = plain.then_some(Mode::Plain);
        let d = lay(&paths, 0.5, mode);
        prop_assert_eq!(d.beside, 0.0);
        prop_assert!((d.map.volume() / d.volume - 1.0).abs() < 1e-9);
        prop_assert!((d.volume / (d.wire * seed_bead().wire_section) - 1.0).abs() < 1e-12);
        prop_assert!(d.map.z.iter().all(|z| z.is_finite() && *z >= 0.0));
    }

    #[test]
    fn all_that_the_source_feeds_is_laid(paths in paths(), height in -8.0..8.0f64, plain in prop::bool::ANY) {
        let paths: Vec<Vec<DVec3>> = paths.iter()
            .map(|path| path.iter().map(|p| *p + xyz(0.0, 0.0, height)).collect())
            .collect();
        let response = FeedResponse { reference: 15.0, slope: 0.0225, limits: (0.65, 1.09), measured: (5.47, 15.0) };
        let settings = Settings {
            mode: if plain { Mode::Plain } else { Settings::default().mode },
            feed_response: Some(response),
            ..Settings::default()
        };
        let (d, asked) = (lay_with(settings, &paths, 0.5), lay(&paths, 0.5, Some(settings.mode)));
        prop_assert!((d.map.volume() / d.volume - 1.0).abs() < 1e-9);
        prop_assert!((d.volume / (d.wire * seed_bead().wire_section) - 1.0).abs() < 1e-12);
        // metal under the wire only brings the tube nearer: never more than at this height over the plate
        let most = response.ratio(15.0 + height);
        prop_assert!(d.wire <= asked.wire * most * (1.0 + 1e-12) && d.wire >= asked.wire * 0.65);
    }

    #[test]
    fn random_beads_make_no_spikes(paths in paths()) {
        let d = lay(&paths, 0.5, None);
        prop_assert!(sharpest(&d.map) < 1.0, "{}", sharpest(&d.map));
    }

    #[test]
    fn a_mirrored_path_makes_a_mirrored_part(paths in paths()) {
        let mirrored: Vec<Vec<DVec3>> = paths.iter()
            .map(|p| p.iter().map(|q| xyz(-q.x, q.y, q.z)).collect())
            .collect();
        for mode in [None, Some(Mode::Plain)] {
            let (a, b) = (lay(&paths, 0.5, mode).map, lay(&mirrored, 0.5, mode).map);
            let mut square = 0.0;
            for iy in 0..a.ny {
                for ix in 0..a.nx {
                    square += (a.z[a.index(ix, iy)] - b.z[b.index(a.nx - 1 - ix, iy)]).powi(2);
                }
            }
            // sweeps run in the order of cells: what edges and supports decide by a hair may fall either way
            let rms = (square / a.z.iter().filter(|z| **z > 0.0).count() as f64).sqrt();
            prop_assert!(rms < if mode.is_some() { 1e-9 } else { 0.1 }, "{rms}");
        }
    }
}

#[test]
fn a_straight_bead_on_a_plate_is_the_bead_of_the_map() {
    for angle in [0.0, 0.4, 0.785, 1.3] {
        for cell in [0.5, 0.25] {
            let path = turned(&[xyz(-50.0, 0.1, 0.0), xyz(50.0, 0.1, 0.0)], angle);
            let map = lay(&[path], cell, None).map;
            let (model, turn) = (seed_bead(), DVec2::from_angle(angle));
            let (mut area, mut crest) = (0.0, 0.0);
            for i in 0..40 {
                for j in -80..80 {
                    let (u, v) = (0.5 * f64::from(i) - 10.0, 0.1 * f64::from(j));
                    let z = map.height(turn.rotate(DVec2::new(u, v + 0.1)));
                    area += 0.1 * z / 40.0;
                    if j == 0 {
                        crest += z / 40.0;
                    }
                    let parabola =
                        model.height() * (1.0 - (2.0 * v / model.width).powi(2)).max(0.0);
                    assert!(
                        (z - parabola).abs() < 0.06 + 0.25 * cell,
                        "{angle} {cell} v {v}: {z} {parabola}"
                    );
                }
            }
            assert!(
                (area / model.area - 1.0).abs() < 0.015,
                "{angle} {cell}: area {area}"
            );
            assert!(
                (crest / model.height() - 1.0).abs() < 0.02,
                "{angle} {cell}: crest {crest}"
            );
        }
    }
}

#[test]
fn records_tell_how_long_beads_are_and_how_long_they_took() {
    let paths = [
        vec![xyz(-20.0, 0.0, 0.0), xyz(25.0, 0.0, 0.0)],
        vec![xyz(-20.0, 30.0, 0.0), xyz(10.0, 30.0, 0.0)],
    ];
    let (model, mut records) = (seed_bead(), Vec::new());
    let pool = PoolModel::for_bead(&POOL, &model);
    let map = HeightMap::new(DVec2::splat(-60.0), DVec2::splat(60.0), 0.5, 0.0).unwrap();
    let mut d = Deposition::new(map, model, pool, Settings::default())
        .unwrap()
        .on_layer(|r, _| records.push((r.beads, r.length, r.arc_time)));
    let mut clock = 0.0;
    for path in &paths {
        bead(&mut d, path, 1, &mut clock, model.area);
    }
    d.finish();
    let [(2, length, time)] = records[..] else {
        panic!("{records:?}");
    };
    assert!((length - 75.0).abs() < 1e-9, "{length}");
    assert!((time - 75.0 / SPEED).abs() < 1e-9, "{time}");
}

#[test]
fn a_wall_does_not_depend_on_its_direction_or_its_place_on_the_grid() {
    let heights: Vec<f64> = [
        (0.0, 0.0),
        (0.0, 0.13),
        (0.0, 0.25),
        (0.3, 0.0),
        (0.785, 0.0),
        (1.3, 0.1),
    ]
    .iter()
    .map(|&(angle, shift)| {
        let paths: Vec<Vec<DVec3>> = (0..12)
            .map(|n| {
                let mut p = vec![xyz(-50.0, shift, 0.0), xyz(50.0, shift, 0.0)];
                if n % 2 == 1 {
                    p.reverse();
                }
                turned(&p, angle)
            })
            .collect();
        let map = lay(&paths, 0.5, None).map;
        let turn = DVec2::from_angle(angle);
        (0..40)
            .map(|i| map.height(turn.rotate(DVec2::new(0.5 * f64::from(i) - 10.0, shift))))
            .sum::<f64>()
            / 40.0
    })
    .collect();
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    for h in &heights {
        assert!((h / mean - 1.0).abs() < 0.02, "{heights:?}");
    }
}

#[test]
fn refining_the_grid_converges() {
    let paths: Vec<Vec<DVec3>> = (0..3)
        .map(|i| {
            vec![
                xyz(-40.0, 4.62 * f64::from(i), 0.0),
                xyz(40.0, 4.62 * f64::from(i), 0.0),
            ]
        })
        .collect();
    let profile = |cell: f64| -> Vec<f64> {
        let map = lay(&paths, cell, None).map;
        (-20..70)
            .map(|j| {
                let y = 0.2 * f64::from(j);
                (0..20)
                    .map(|i| map.height(DVec2::new(f64::from(i) - 10.0, y)))
                    .sum::<f64>()
                    / 20.0
            })
            .collect()
    };
    let (coarse, middle, fine) = (profile(0.5), profile(0.25), profile(0.125));
    let off = |a: &[f64]| {
        (a.iter()
            .zip(&fine)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            / fine.len() as f64)
            .sqrt()
    };
    assert!(
        off(&middle) < off(&coarse),
        "{} {}",
        off(&middle),
        off(&coarse)
    );
    assert!(
        off(&coarse) < 0.18 && off(&middle) < 0.09,
        "{} {}",
        off(&coarse),
        off(&middle)
    );
}

#[test]
fn blocks_of_motion_may_be_cut_anywhere() {
    let model = seed_bead();
    let mut whole: Vec<MotionBlock> = Vec::new();
    bead(
        &mut whole,
        &[
            xyz(-20.0, 0.0, 0.0),
            xyz(10.0, 0.0, 0.0),
            xyz(10.0, 20.0, 0.0),
        ],
        1,
        &mut 0.0,
        model.area,
    );
    let run = |cut: usize| {
        let pool = PoolModel::for_bead(&POOL, &model);
        let map = HeightMap::new(DVec2::splat(-40.0), DVec2::splat(40.0), 0.5, 0.0).unwrap();
        let mut d = Deposition::new(map, model, pool, Settings::default()).unwrap();
        for b in &whole {
            let mut i = 0;
            while i < b.len() {
                let to = (i + cut).min(b.len());
                d.block(&MotionBlock {
                    times: Times::Uniform {
                        t0: b.time(i),
                        dt: crate::support::DT,
                    },
                    position: b.position[i..to].to_vec(),
                    speed: b.speed[i..to].to_vec(),
                    wire: b.wire[i..to].to_vec(),
                    command: b.command[i..to].to_vec(),
                    axis: vec![],
                    ..MotionBlock::default()
                });
                i = to;
            }
        }
        d.finish().map.z
    };
    let bits = |z: Vec<f64>| z.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(run(1_000_000)), bits(run(7)));
}

#[test]
fn odd_motion_loses_no_metal() {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    let reporter = Reporter::new();
    let sample = |p: DVec3, wire: f64| MotionBlock {
        times: Times::Uniform { t0: 0.0, dt: 0.1 },
        position: vec![p],
        speed: vec![0.0],
        wire: vec![wire],
        command: vec![9],
        axis: vec![],
        ..MotionBlock::default()
    };
    for mode in [Mode::Plain, Settings::default().mode] {
        let map = HeightMap::new(DVec2::splat(-10.0), DVec2::splat(10.0), 0.5, 0.0).unwrap();
        let settings = Settings {
            mode,
            ..Settings::default()
        };
        let mut d = Deposition::new(map, model, pool, settings)
            .unwrap()
            .reporting_to(&reporter);
        // wire from the very first sample; a dwell; a sample that is not a number; an arc that never moves
        d.block(&sample(xyz(0.0, 0.0, 0.0), 5.0));
        d.block(&sample(xyz(0.0, 0.0, 0.0), 5.0));
        d.block(&sample(xyz(f64::NAN, 0.0, 0.0), 5.0));
        d.block(&sample(xyz(3.0, 0.0, 0.0), 5.0));
        d.block(&sample(xyz(3.0, 0.0, 0.0), 50.0));
        d.block(&sample(xyz(3.0, 0.0, 0.0), 0.0));
        d.block(&sample(xyz(-5.0, -5.0, 0.0), 0.0));
        d.block(&sample(xyz(-5.0, -5.0, 0.0), 20.0));
        let out = d.finish();
        assert_eq!(out.wire, 85.0);
        assert!((out.map.volume() / out.volume - 1.0).abs() < 1e-9);
        // a path far beside the map: told, not lost silently
        let map = HeightMap::new(DVec2::splat(-10.0), DVec2::splat(10.0), 0.5, 0.0).unwrap();
        let mut d = Deposition::new(map, model, pool, settings)
            .unwrap()
            .reporting_to(&reporter);
        bead(
            &mut d,
            &[xyz(50.0, 0.0, 0.0), xyz(80.0, 0.0, 0.0)],
            1,
            &mut 0.0,
            model.area,
        );
        let out = d.finish();
        assert!((out.beside / out.volume - 1.0).abs() < 1e-9);
    }
    let codes: Vec<_> = reporter.warnings().iter().map(|w| w.code.clone()).collect();
    assert!(
        codes.contains(&"motion-not-finite".to_owned())
            && codes.contains(&"metal-beside-map".to_owned())
    );
}

#[test]
fn a_bead_that_hangs_out_is_told_with_its_place() {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    let reporter = Reporter::new();
    let map = HeightMap::new(DVec2::splat(-60.0), DVec2::splat(60.0), 0.5, 0.0).unwrap();
    let mut d = Deposition::new(map, model, pool, Settings::default())
        .unwrap()
        .with_layers((0..=10).collect())
        .reporting_to(&reporter);
    let mut clock = 0.0;
    for n in 1..=8u32 {
        let y = if n == 8 { 2.8 } else { 0.0 };
        let z = 1.6 * f64::from(n - 1);
        bead(
            &mut d,
            &[xyz(-50.0, y, z), xyz(50.0, y, z)],
            n,
            &mut clock,
            model.area,
        );
    }
    let out = d.finish();
    assert!((out.map.volume() / out.volume - 1.0).abs() < 1e-9);
    let warnings = reporter.warnings();
    let overhang: Vec<_> = warnings.iter().filter(|w| w.code == "overhang").collect();
    assert_eq!(overhang.len(), 1, "{warnings:?}");
    assert_eq!(overhang[0].place.as_ref().unwrap().layer, Some(8));
    // it does not fill the air below down to the plate, nor climb to the sky
    assert!(out.map.height(DVec2::new(0.0, 5.5)) < 1.0);
    assert!(out.map.maximum() < 8.0 * 2.2 + 4.0, "{}", out.map.maximum());
}

/// 150 m of beads in steps of 0.15 mm on half a square metre.
fn a_million_stamps(mode: Mode) {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    let map = HeightMap::new(DVec2::splat(-10.0), DVec2::splat(510.0), 0.5, 0.0).unwrap();
    let settings = Settings {
        mode,
        ..Settings::default()
    };
    let mut d = Deposition::new(map, model, pool, settings)
        .unwrap()
        .with_layers((0..=4).collect());
    let mut clock = 0.0;
    for i in 0..300u32 {
        let (y, z) = (4.62 * f64::from(i % 100), 1.9 * f64::from(i / 100));
        let path = [xyz(0.0, y, z), xyz(500.0, y, z)];
        bead(&mut d, &path, 1 + i / 100, &mut clock, model.area);
    }
    let out = d.finish();
    assert!((out.map.volume() / out.volume - 1.0).abs() < 1e-9);
}

#[test]
#[ignore = "size: ten seconds"]
fn a_million_stamps_plain() {
    a_million_stamps(Mode::Plain);
}

#[test]
#[ignore = "size: ten seconds"]
fn a_million_stamps_levelling() {
    a_million_stamps(Settings::default().mode);
}

/// A wall of single beads there and back, 60 mm long, with samples at most `sample` mm apart: its map, and the contact tube's least and
/// greatest distance by layers.
fn wall(cell: f64, sample: f64) -> (HeightMap, Vec<[f64; 2]>) {
    let (model, pool) = (seed_bead(), PoolModel::for_bead(&POOL, &seed_bead()));
    let map = HeightMap::new(DVec2::splat(-12.0), DVec2::new(72.0, 12.0), cell, 0.0).unwrap();
    let mut distances = Vec::new();
    let mut d = Deposition::new(map, model, pool, Settings::default())
        .unwrap()
        .with_layers((0..7).collect())
        .on_layer(|r, _| distances.push(r.tube.unwrap().map(|t| t.distance)));
    let mut clock = 0.0;
    let pieces = (60.0 / sample).ceil();
    for layer in 0..6 {
        let along = |k: f64| if layer % 2 == 0 { k } else { pieces - k };
        let path: Vec<_> = (0..=pieces as u32)
            .map(|k| {
                let x = 60.0 * along(f64::from(k)) / pieces;
                xyz(x, 0.1, 1.65 * f64::from(layer))
            })
            .collect();
        bead(&mut d, &path, layer, &mut clock, model.area);
    }
    (d.finish().map, distances)
}

#[test]
fn finer_cells_lay_the_same_wall() {
    let (coarse, fine) = (wall(0.5, 60.0).1, wall(0.15, 60.0).1);
    for (layer, (a, b)) in coarse.iter().zip(&fine).enumerate() {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 0.06, "{layer}: {a} {b}");
        }
    }
}

#[test]
fn however_the_motion_is_sampled_the_wall_is_the_same() {
    let whole = wall(0.5, 60.0).0;
    for sample in [0.07, 0.11, 0.4] {
        let other = wall(0.5, sample).0;
        let most = whole
            .z
            .iter()
            .zip(&other.z)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(most < 1e-3, "{sample}: {most}");
    }
}

/// Of the distances outside the range that was measured the farthest is told, with its place, whichever came first.
#[test]
fn the_farthest_distance_outside_the_measured_range_is_told() {
    let model = seed_bead();
    let pool = PoolModel::for_bead(&POOL, &model);
    let response = FeedResponse {
        reference: 15.0,
        slope: 0.0,
        limits: (0.5, 1.5),
        measured: (12.0, 18.0),
    };
    let settings = Settings {
        feed_response: Some(response),
        ..Settings::default()
    };
    let reporter = Reporter::new();
    let map = HeightMap::new(DVec2::splat(-60.0), DVec2::splat(60.0), 0.5, 0.0).unwrap();
    let mut d = Deposition::new(map, model, pool, settings)
        .unwrap()
        .reporting_to(&reporter);
    let mut clock = 0.0;
    // tool points so far over the plate, side by side: 17, 20, 24 and 21 mm of contact tube distance
    for (n, over) in [2.0, 5.0, 9.0, 6.0].into_iter().enumerate() {
        let y = 20.0 * n as f64 - 30.0;
        let path = [xyz(-50.0, y, over), xyz(50.0, y, over)];
        bead(&mut d, &path, 1, &mut clock, model.area);
    }
    d.finish();
    let warnings = reporter.warnings();
    let told = warnings
        .iter()
        .find(|w| w.code == "feed-response-extrapolated")
        .unwrap();
    // three of four beads
    assert!(told.message.contains("300 mm of bead (75 %)"), "{told:?}");
    assert!(told.message.contains("farthest out: 24.0 mm"), "{told:?}");
    let at = told.place.as_ref().unwrap().position.unwrap();
    assert!((at[1] - 10.0).abs() < 1e-9, "{at:?}");
}
