//! One bead on a plate by stamps, Rouchon 2022, §3.5.
use crate::support::*;
use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
use meltpath_deposition::corner::Passage;
use meltpath_deposition::deposit::{Deposit, Deposition, Mode, Settings};
use meltpath_deposition::pursuit::PursuitMode;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_toolpath::motion::{MotionBlock, MotionSink, Times};

fn plain_settings(pursuit: PursuitMode) -> Settings {
    Settings {
        mode: Mode::Plain,
        pursuit,
        ..Settings::default()
    }
}

/// S57 and its relatives: the bead keeps its width (constants of table 3.3).
fn s57(pool: &PoolModel, wire_feed: f64, travel: f64) -> BeadModel {
    BeadModel {
        width: 2.0 * pool.half_width,
        area: std::f64::consts::FRAC_PI_4 * wire_feed / travel,
        width_exponent: 0.0,
        feed_exponent: 0.0,
        ..seed_bead()
    }
}

fn straight(pool: PoolModel, model: BeadModel, cell: f64, angle: f64) -> Deposit {
    let map = HeightMap::new(DVec2::splat(-60.0), DVec2::splat(60.0), cell, 0.0).unwrap();
    let mut d = Deposition::new(map, model, pool, plain_settings(PursuitMode::Rigid)).unwrap();
    let path = turned(&[xyz(-40.0, 0.0, 0.0), xyz(40.0, 0.0, 0.0)], angle);
    bead(&mut d, &path, 1, &mut 0.0, model.area);
    d.finish()
}

#[test]
fn waam_ac21_a_straight_bead_is_the_parabola() {
    let slow = PoolModel {
        front: 4.14,
        half_width: 4.14,
        rear: 11.73,
        offset: 1.85,
        ..POOL
    };
    let odd = PoolModel {
        front: 2.5,
        rear: 7.0,
        offset: 0.4,
        ..POOL
    };
    for (pool, vf, vr, height) in [
        (POOL, 8.0, 0.75, 1.745),
        (POOL, 9.25, 0.75, 2.018),
        (slow, 8.0, 0.50, 2.277),
        // independent of the pool's length and offset
        (odd, 8.0, 0.75, 1.745),
    ] {
        let model = s57(&pool, vf, vr);
        let map = straight(pool, model, 0.1, 0.0).map;
        let (mut area, mut width) = (0.0, 0.0);
        for i in -60..60 {
            let v = 0.1 * (f64::from(i) + 0.5);
            let z = map.height(DVec2::new(0.05, v));
            area += 0.1 * z;
            if z > 0.0 {
                width += 0.1;
            }
            let parabola = height * (1.0 - (v / pool.half_width).powi(2)).max(0.0);
            assert!(
                (z - parabola).abs() < 0.01 * height,
                "v {v} z {z} parabola {parabola}"
            );
        }
        assert!((map.height(DVec2::new(0.05, 0.0)) / height - 1.0).abs() < 0.01);
        assert!((area / model.area - 1.0).abs() < 0.01);
        assert!((width - 2.0 * pool.half_width).abs() < 0.21);
    }
}

#[test]
fn beads_do_not_depend_on_direction_nor_much_on_the_grid() {
    let model = s57(&POOL, 8.0, 0.75);
    let crest = |cell: f64, angle: f64| {
        let d = straight(POOL, model, cell, angle);
        let along = DVec2::from_angle(angle);
        let n = 41;
        (0..n)
            .map(|i| d.map.height(along * (f64::from(i) - 20.0)))
            .sum::<f64>()
            / f64::from(n)
    };
    let exact = 1.745;
    let error: Vec<f64> = [1.0, 0.5, 0.25]
        .iter()
        .map(|&c| (crest(c, 0.3) - exact).abs())
        .collect();
    assert!(error[2] < error[0] && error[2] < 0.005, "{error:?}");
    for angle in [0.0, 0.5, 1.1, 2.0, 3.0] {
        assert!((crest(0.25, angle) - exact).abs() < 0.01, "{angle}");
    }
}

/// Two legs of 45 mm with a corner of `angle`, through the robot's two moving averages (132 and 84 ms) with the dwell of
/// the smoothing option at the corner: Rouchon 2022, §3.3.1.
fn robot_corner(angle: f64, dwell: f64, wire_feed: f64) -> MotionBlock {
    let (dt, speed, leg) = (0.002, 12.5, 45.0);
    let n = (leg / speed / dt) as usize;
    let mut velocity = vec![DVec2::X * speed; n];
    velocity.extend(vec![DVec2::ZERO; (dwell / dt).round() as usize]);
    velocity.extend(vec![DVec2::from_angle(angle) * speed; n]);
    for window in [0.132, 0.084] {
        let m = (window / dt) as usize;
        velocity.extend(vec![DVec2::ZERO; m]);
        velocity = (0..velocity.len())
            .map(|i| {
                velocity[i.saturating_sub(m - 1)..=i]
                    .iter()
                    .copied()
                    .sum::<DVec2>()
                    / m as f64
            })
            .collect();
    }
    let mut p = DVec2::new(-leg, 0.0);
    let mut block = MotionBlock {
        times: Times::Uniform { t0: 0.0, dt },
        ..MotionBlock::default()
    };
    for v in velocity {
        p += v * dt;
        block.position.push(p.extend(0.0));
        block.speed.push(v.length());
        block.wire.push(wire_feed * 1000.0 / 60.0 * dt);
        block.command.push(1);
    }
    block
}

fn corner_ratio(angle: f64, length: f64, dwell: f64) -> f64 {
    let pool = PoolModel {
        pursuit: PursuitLength::Fixed(length),
        ..POOL
    };
    let model = s57(&pool, 9.25, 0.75);
    let map = HeightMap::new(DVec2::splat(-60.0), DVec2::splat(60.0), 0.1, 0.0).unwrap();
    let mut d = Deposition::new(map, model, pool, plain_settings(PursuitMode::Rigid)).unwrap();
    d.block(&robot_corner(angle.to_radians(), dwell, 9.25));
    let out = d.finish();
    assert!((out.map.volume() / out.volume - 1.0).abs() < 1e-9);
    let straight = out.map.height(DVec2::new(-22.0, 0.0));
    assert!((straight / 2.018 - 1.0).abs() < 0.01, "{straight}");
    let (columns, rows) = out
        .map
        .cells_within(DVec2::splat(-12.0), DVec2::splat(12.0));
    let mut top = 0.0f64;
    for iy in rows {
        for ix in columns.clone() {
            top = top.max(out.map.z[out.map.index(ix, iy)]);
        }
    }
    top / straight
}

#[test]
fn waam_ac23_corners_pile_up() {
    let mut last = 1.0;
    for (angle, length, ratio) in [(45.0, 4.0, 1.10), (90.0, 5.0, 1.31), (135.0, 6.0, 1.96)] {
        let smooth = corner_ratio(angle, length, 0.0495);
        assert!(
            (smooth / ratio - 1.0).abs() < 0.05,
            "{angle}: {smooth} against {ratio}"
        );
        assert!(smooth > corner_ratio(angle, length, 0.0));
        assert!(smooth > last);
        last = smooth;
    }
}

#[test]
fn beads_on_a_plate_add_up() {
    let model = s57(&POOL, 8.0, 0.75);
    let one = vec![xyz(-30.0, 0.0, 0.0), xyz(30.0, 5.0, 0.0)];
    let two = vec![xyz(-5.0, -30.0, 0.0), xyz(10.0, 30.0, 0.0)];
    let lay = |paths: &[&Vec<DVec3>]| {
        let map = HeightMap::new(DVec2::splat(-50.0), DVec2::splat(50.0), 0.5, 0.0).unwrap();
        let mut d = Deposition::new(map, model, POOL, plain_settings(PursuitMode::Rigid)).unwrap();
        for p in paths {
            bead(&mut d, p, 1, &mut 0.0, model.area);
        }
        d.finish().map
    };
    let (a, b, both) = (lay(&[&one]), lay(&[&two]), lay(&[&one, &two]));
    for ((a, b), both) in a.z.iter().zip(&b.z).zip(&both.z) {
        assert!((a + b - both).abs() < 1e-12);
    }
}

/// The ground that counts for the contact tube is the one under the wire, wherever the bead runs: over a step of 2 mm the distance
/// changes by 2 mm, at the step.
#[test]
fn the_distance_follows_a_step_in_the_ground() {
    let model = s57(&POOL, 8.0, 0.75);
    for (along, place) in [
        (DVec2::X, DVec2::new(-20.0, 17.0)),
        (DVec2::Y, DVec2::new(31.0, -20.0)),
    ] {
        let mut map = HeightMap::new(DVec2::splat(-60.0), DVec2::splat(60.0), 0.5, 0.0).unwrap();
        let step = 10.0;
        for i in 0..map.z.len() {
            if map.centre(i % map.nx, i / map.nx).dot(along) > step {
                map.z[i] = 2.0;
            }
        }
        let mut path = Vec::new();
        let mut d = Deposition::new(map, model, POOL, plain_settings(PursuitMode::Rigid))
            .unwrap()
            .on_layer(|record, _| path.extend(record.path.iter().map(|p| (p.tool, p.ctwd))));
        let tool = |at: f64| (place + at * along).extend(2.0);
        bead(&mut d, &[tool(0.0), tool(60.0)], 1, &mut 0.0, model.area);
        d.finish();
        assert!(path.len() > 90, "{}", path.len());
        for (tool, distance) in path {
            let from_step = tool.truncate().dot(along) - step;
            // the first millimetres are laid before any ground was seen ahead
            if from_step.abs() > 0.6 && from_step > -25.0 {
                let wanted = if from_step < 0.0 { 17.0 } else { 15.0 };
                assert!((distance - wanted).abs() < 1e-9, "{tool}: {distance}");
            }
        }
    }
}

/// What slowing down at a corner adds, by the motion of the source's robot: S57, whose mean section is about 9.7 mm².
#[test]
fn waam_ac26_slowing_down_adds_what_the_robots_motion_says() {
    let slowing = |angle: f64| {
        let angle = angle.to_radians();
        let block = robot_corner(angle, 0.0495, 9.25);
        let at = |(k, p): (usize, &DVec3)| (0.002 * k as f64, p.truncate());
        let samples: Vec<_> = block.position.iter().enumerate().map(at).collect();
        let passage = Passage::of(&samples, angle).unwrap();
        (passage.kinematic(9.7, 12.5), 40.0 - passage.length)
    };
    let mut last = (0.0, 0.0);
    for (angle, ours, of_spec, measured) in [(45.0, 6.4, 6.4, 8.40), (150.0, 9.6, 9.6, 9.39)] {
        let (added, shorter) = slowing(angle);
        assert!((added - ours).abs() < 0.2, "{angle}: {added}");
        for other in [of_spec, measured] {
            assert!(
                (added / other - 1.0).abs() < 0.3,
                "{angle}: {added} {other}"
            );
        }
        // the way is cut shorter, and more at the sharper corner
        assert!(shorter > last.1 && added > last.0, "{shorter}");
        last = (added, shorter);
    }
    let (_, blunt) = slowing(10.0);
    assert!(blunt > 0.0 && blunt < 0.01, "{blunt}");
}
