//! Where the metal goes as it levels out: conserved, downwards, within its reach.

use super::*;

const BEAD: LocalBead = LocalBead {
    half_width: 3.0,
    height: 1.8,
    rear: 100.0,
};

fn plate() -> HeightMap {
    HeightMap::new(DVec2::splat(-10.0), DVec2::new(30.0, 10.0), 0.5, 0.0).unwrap()
}

fn at(x: f64) -> Station {
    Station {
        centre: DVec2::new(x, 0.0),
        heading: DVec2::X,
        travelled: x,
        rise: 0.0,
    }
}

/// A bead along x from 0 to 12 mm with the metal of the bead on a plate, relaxed until it stands, and the last step.
fn laid(map: &mut HeightMap) -> (MoltenZone, StepReport) {
    let model = Levelling {
        settled: 1e-10,
        ..Levelling::default()
    };
    let mut zone = MoltenZone::new(map);
    let area = 4.0 / 3.0 * BEAD.half_width * BEAD.height;
    let mut last = StepReport::default();
    for k in 0..24 {
        let x = 0.5 * f64::from(k);
        last = zone.step(map, &model, &BEAD, &at(x), &at(x + 0.5), 0.5 * area);
        assert_eq!(last.lost, 0.0);
    }
    (zone, last)
}

/// Raises the map where `y` is beyond `from`, by `height` mm.
fn raise(map: &mut HeightMap, from: f64, height: f64) {
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            if map.centre(ix, iy).y > from {
                let i = map.index(ix, iy);
                map.z[i] = height;
            }
        }
    }
}

#[test]
fn ground_is_bilinear_inside_the_map_and_the_plate_outside() {
    let mut map = plate();
    map.base = -7.0;
    let plane = |p: DVec2| 1.0 + 0.3 * p.x - 0.2 * p.y + 0.05 * p.x * p.y;
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            let i = map.index(ix, iy);
            map.z[i] = plane(map.centre(ix, iy));
        }
    }
    let zone = MoltenZone::new(&map);
    for (x, y) in [(0.1, 0.2), (-3.35, 7.9), (12.49, -8.01), (29.0, 9.4)] {
        let p = DVec2::new(x, y);
        assert!((zone.ground_at(&map, p) - plane(p)).abs() < 1e-9, "{p}");
    }
    // up to half a cell beyond the outermost centres the last cells count, further out the plate
    let (first, last) = (map.centre(0, 0), map.centre(map.nx - 1, map.ny - 1));
    for (p, at) in [
        (first - 0.24, first),
        (last + 0.24, last),
        (
            DVec2::new(first.x - 0.24, last.y + 0.24),
            DVec2::new(first.x, last.y),
        ),
    ] {
        assert!((zone.ground_at(&map, p) - plane(at)).abs() < 1e-9, "{p}");
    }
    for out in [DVec2::X, -DVec2::X, DVec2::Y, -DVec2::Y] {
        let corner = if out.x + out.y > 0.0 { last } else { first };
        assert_eq!(zone.ground_at(&map, corner + 0.26 * out), -7.0);
    }
}

#[test]
fn on_a_plate_the_melt_stands_as_the_parabola() {
    let mut map = plate();
    let (zone, _) = laid(&mut map);
    assert!(zone.cell.len() > 200);
    assert_eq!(zone.surface_at(&map, DVec2::new(6.25, 8.0)), None);
    assert_eq!(zone.surface_at(&map, DVec2::new(-11.0, 0.0)), None);
    // 12 mm of the bead and its two half ends hold what was fed at the level L of 12·(4/3)·L·√(L/k) + π·L²/(2k)
    let level = 1.5325;
    for y in [0.25, -0.75, 1.25, -1.75, 2.25] {
        let parabola = level - BEAD.height * (y / BEAD.half_width).powi(2);
        let z = map.height(DVec2::new(6.25, y));
        assert!((z - parabola).abs() < 0.05, "{y}: {z} {parabola}");
        // the melt itself stands there too, between the centres of its cells as well
        for x in [6.25, 6.4] {
            let melt = zone.surface_at(&map, DVec2::new(x, y)).unwrap();
            assert!((melt - parabola).abs() < 0.05, "{y}: {melt} {parabola}");
        }
    }
}

/// The equation that the surface solves, written down by itself: where there is melt, what the pool's level and the
/// neighbours pull is in balance; where there is none, they pull down.
#[test]
fn level_and_neighbours_are_in_balance_beside_a_bead() {
    let mut map = plate();
    raise(&mut map, 2.0, 1.0);
    let (zone, _) = laid(&mut map);
    let coupling = (1.25_f64 / 0.5).powi(2);
    let phi = |s: usize| zone.top[s] + zone.psi[s];
    let (mut wet, mut dry, mut climbed) = (0, 0, 0);
    for s in 0..zone.cell.len() {
        let mut pull = zone.cover[s] * (zone.level - phi(s));
        for near in zone.pulls[s].near {
            let t = near as usize;
            pull += coupling * zone.cover[s].min(zone.cover[t]) * (phi(t) - phi(s));
        }
        if zone.top[s] > zone.floor[s] {
            assert!(pull.abs() < 1e-6, "{pull}");
            wet += 1;
            climbed += u32::from(zone.floor[s] > 0.5);
        } else {
            assert!(pull < 1e-6, "{pull}");
            dry += 1;
        }
    }
    // melt lies on the plate and on the step's edge, and the step is not covered
    assert!(
        wet > 100 && climbed > 10 && dry > 10,
        "{wet} {climbed} {dry}"
    );
    let fed = 12.0 * 4.0 / 3.0 * BEAD.half_width * BEAD.height;
    assert!((zone.held() * map.cell * map.cell / fed - 1.0).abs() < 1e-9);
}

#[test]
fn a_bead_on_a_wall_stands_at_nine_tenths_of_its_width() {
    let mut map = plate();
    // a wall as wide as the bead, twice as high
    raise(&mut map, -3.0, 3.6);
    raise(&mut map, 3.0, 0.0);
    let (zone, last) = laid(&mut map);
    assert!(!last.hangs);
    // width across the middle of the bead: whole cells and shares of cells, by how much of each is wall
    let column = map.cell_at(DVec2::new(6.1, 0.0)).unwrap().0;
    let on_column = |s: &usize| zone.cell[*s] as usize % map.nx == column;
    let slots: Vec<usize> = (0..zone.cell.len()).filter(on_column).collect();
    let width: f64 = slots.iter().map(|s| zone.cover[*s] * map.cell).sum();
    assert!((width - 2.0 * BEAD.half_width).abs() < 0.3, "{width}");
    // on a crest of one millimetre both its sides are free edges
    let mut map = plate();
    raise(&mut map, -0.5, 3.0);
    raise(&mut map, 0.5, 0.0);
    let (zone, last) = laid(&mut map);
    assert!(!last.hangs);
    let on_column = |s: &usize| zone.cell[*s] as usize % map.nx == column;
    let slots: Vec<usize> = (0..zone.cell.len()).filter(on_column).collect();
    let width: f64 = slots.iter().map(|s| zone.cover[*s] * map.cell).sum();
    assert!(
        (width - 2.0 * 0.9 * BEAD.half_width).abs() < 0.05,
        "{width}"
    );
}

#[test]
fn a_bead_beside_a_cliff_hangs_and_one_beside_a_wall_does_not() {
    // down by more than two bead heights on one side
    let mut map = plate();
    raise(&mut map, -1.0, 5.0);
    assert!(laid(&mut map).1.hangs);
    let mut map = plate();
    raise(&mut map, 1.0, 5.0);
    assert!(!laid(&mut map).1.hangs);
}
