//! The height map: volumes, heights, sections and its mesh.

use std::collections::HashMap;

use meltpath_geometry::{
    Mesh,
    math::DVec2,
    workpiece::{Crop, HeightMap, WorkpieceError},
};
use proptest::prelude::*;

/// Every edge is used exactly once in each direction.
fn assert_closed(mesh: &Mesh) {
    let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            *edges.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
    }
    for (&(a, b), &n) in &edges {
        assert_eq!(n, 1, "edge {a}-{b} used {n} times in one direction");
        assert!(edges.contains_key(&(b, a)), "edge {a}-{b} has no partner");
    }
}

fn bumpy(nx: usize, ny: usize, seed: u64) -> HeightMap {
    let mut state = seed | 1;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31)
    };
    let z = (0..nx * ny)
        .map(|_| if next() < 0.6 { 0.0 } else { 5.0 * next() })
        .collect();
    HeightMap {
        origin: DVec2::new(-3.0, 2.0),
        cell: 0.5,
        nx,
        ny,
        base: 0.0,
        z,
    }
}

#[test]
fn grid_covers_bounds_without_a_stray_cell() {
    let map = HeightMap::new(DVec2::ZERO, DVec2::new(10.0, 4.05), 0.1, 0.0).unwrap();
    assert_eq!((map.nx, map.ny), (100, 41));
    let (lo, hi) = map.bounds();
    assert!(lo.length() < 1e-12 && hi.x >= 10.0 - 1e-9 && hi.y >= 4.05);
    assert_eq!(map.cell_at(DVec2::new(-0.01, 1.0)), None);
    assert_eq!(map.cell_at(DVec2::new(0.05, 0.0)), Some((0, 0)));
}

#[test]
fn absurd_sizes_are_refused_with_the_count_and_the_remedy() {
    let err = HeightMap::new(DVec2::ZERO, DVec2::splat(100_000.0), 0.1, 0.0).unwrap_err();
    let WorkpieceError::TooLarge { cells, remedy, .. } = err.clone() else {
        panic!("{err}")
    };
    assert!((cells - 1e12).abs() < 1e7);
    assert!(HeightMap::new(DVec2::ZERO, DVec2::splat(100_000.0), remedy, 0.0).is_ok());
    assert!(err.to_string().contains("cells"));
    for cell in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(HeightMap::new(DVec2::ZERO, DVec2::ONE, cell, 0.0).is_err());
    }
    assert!(HeightMap::new(DVec2::ONE, DVec2::ZERO, 0.1, 0.0).is_err());
    assert!(HeightMap::new(DVec2::ZERO, DVec2::splat(f64::NAN), 0.1, 0.0).is_err());
}

#[test]
fn bilinear_height_reproduces_a_bilinear_surface() {
    let mut map = HeightMap::new(DVec2::new(-2.0, 1.0), DVec2::new(8.0, 6.0), 0.25, 0.0).unwrap();
    let f = |p: DVec2| 1.0 + 0.3 * p.x - 0.2 * p.y + 0.05 * p.x * p.y;
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            let i = map.index(ix, iy);
            map.z[i] = f(map.centre(ix, iy));
        }
    }
    for p in [
        DVec2::new(0.0, 3.0),
        DVec2::new(7.3, 5.77),
        DVec2::new(-1.87, 1.13),
    ] {
        assert!((map.height(p) - f(p)).abs() < 1e-12);
    }
    assert_eq!(
        map.height(DVec2::new(100.0, 3.0)),
        0.0,
        "the plate goes on outside"
    );
}

#[test]
fn built_mesh_is_closed_and_has_the_deposited_volume() {
    let mut map = HeightMap::new(DVec2::ZERO, DVec2::new(30.0, 20.0), 0.5, 0.0).unwrap();
    // two blocks that touch at a corner, and one apart
    for (x, y) in [(4.0, 4.0), (8.0, 8.0), (20.0, 12.0)] {
        for iy in 0..8 {
            for ix in 0..8 {
                let (cx, cy) = map
                    .cell_at(DVec2::new(
                        x + 0.25 + 0.5 * f64::from(ix),
                        y + 0.25 + 0.5 * f64::from(iy),
                    ))
                    .unwrap();
                let i = map.index(cx, cy);
                map.z[i] += 3.0;
            }
        }
    }
    let volume = 3.0 * 64.0 * 0.75;
    assert!((map.volume() - volume).abs() < 1e-9);
    let mesh = map.to_mesh(Crop::Built { threshold: 0.0 }, 2.0);
    assert_closed(&mesh);
    let (lo, _) = mesh.bounds().unwrap();
    assert_eq!(lo.z, -2.0);
    // plan area from the bottom faces
    let area: f64 = mesh
        .triangles
        .iter()
        .filter(|t| t.iter().all(|&v| mesh.vertices[v as usize].z == -2.0))
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    assert!((mesh.volume() - (volume + 2.0 * area)).abs() < 1e-9);
    let whole = map.to_mesh(Crop::Whole, 1.0);
    assert_closed(&whole);
    assert!((whole.volume() - volume - 29.5 * 19.5).abs() < 1e-9);
}

#[test]
fn sections_see_the_wall() {
    let mut map = HeightMap::new(DVec2::ZERO, DVec2::new(40.0, 20.0), 0.5, 1.0).unwrap();
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            let p = map.centre(ix, iy);
            let i = map.index(ix, iy);
            map.z[i] += (2.0 * (1.0 - ((p.y - 10.0) / 3.5).powi(2))).max(0.0) * (1.0 + 0.01 * p.x);
        }
    }
    let across = map.section(&[DVec2::new(10.0, 2.0), DVec2::new(10.0, 18.0)], 0.1);
    let top = across.iter().map(|p| p.y).fold(0.0, f64::max);
    assert!((top - 3.2).abs() < 0.02, "{top}");
    assert!((across.last().unwrap().x - 16.0).abs() < 1e-12);
}

/// A step: bare for y below 5, 2 mm high above, in cells of 0.5 mm.
fn step_across_y() -> HeightMap {
    let mut map = HeightMap::new(DVec2::ZERO, DVec2::splat(10.0), 0.5, 0.0).unwrap();
    for iy in 10..20 {
        for ix in 0..20 {
            let i = map.index(ix, iy);
            map.z[i] = 2.0;
        }
    }
    map
}

#[test]
fn a_section_counts_its_length_round_corners() {
    let map = step_across_y();
    let corner = [
        DVec2::new(1.0, 1.0),
        DVec2::new(4.0, 1.0),
        DVec2::new(4.0, 9.0),
    ];
    let profile = map.section(&corner, 0.25);
    assert!((profile.last().unwrap().x - 11.0).abs() < 1e-12);
    assert!(profile.windows(2).all(|w| w[1].x > w[0].x));
    let rise = profile.iter().find(|p| p.y > 1.0).unwrap().x;
    assert!((rise - 7.0).abs() < 0.26, "{rise}");
}

proptest! {
        #[test]
    fn any_built_mesh_is_closed(seed in any::<u64>(), nx in 2usize..24, ny in 2usize..24) {
        let map = bumpy(nx, ny, seed);
        assert_closed(&map.to_mesh(Crop::Built { threshold: 0.0 }, 1.0));
        assert_closed(&map.to_mesh(Crop::Whole, 0.0));
    }

    #[test]
    fn volume_has_the_same_bits_on_any_thread_count(seed in any::<u64>()) {
        let map = bumpy(200, 150, seed);
        let on = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| map.volume());
        prop_assert_eq!(on(1).to_bits(), on(4).to_bits());
    }
}
