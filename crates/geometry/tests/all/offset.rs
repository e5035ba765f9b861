//! Offsets and boolean operations against second opinions: Clipper2's own offset and `i_overlay`'s booleans.

use clipper2_rust::core::{Paths64, Point64};
use clipper2_rust::offset::{ClipperOffset, EndType, JoinType};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;
use meltpath_geometry::boolean::{GRID_PER_MM, difference, intersection, union};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::{Join, inset, outset, stroke};
use meltpath_geometry::region::signed_area;
use meltpath_geometry::{Region, Ring};
use proptest::prelude::*;

const FINE: Join = Join::Round {
    arc_tolerance: 1e-4,
};

fn star(centre: DVec2, radii: &[f64]) -> Ring {
    let n = radii.len() as f64;
    let at = |i: usize| DVec2::from_angle(std::f64::consts::TAU * i as f64 / n);
    (0..radii.len())
        .map(|i| centre + at(i) * radii[i])
        .collect()
}

/// A random star with up to three random holes, cut out so that the region is valid.
fn region() -> impl Strategy<Value = Vec<Region>> {
    let outer = prop::collection::vec(8.0..30.0, 5..40);
    let hole = (
        0.0..std::f64::consts::TAU,
        0.0..14.0,
        prop::collection::vec(0.5..6.0, 3..12),
    );
    (outer, prop::collection::vec(hole, 0..4)).prop_map(|(outer, holes)| {
        let solid = [Region {
            outer: star(DVec2::ZERO, &outer),
            holes: vec![],
        }];
        let cut: Vec<_> = holes
            .iter()
            .map(|(angle, r, radii)| Region {
                outer: star(DVec2::from_angle(*angle) * *r, radii),
                holes: vec![],
            })
            .collect();
        difference(&solid, &cut).unwrap()
    })
}

fn area(regions: &[Region]) -> f64 {
    regions.iter().map(Region::area).sum()
}

fn perimeter(regions: &[Region]) -> f64 {
    regions
        .iter()
        .flat_map(Region::rings)
        .map(|r| {
            (0..r.len())
                .map(|i| r[i].distance(r[(i + 1) % r.len()]))
                .sum::<f64>()
        })
        .sum()
}

fn clipper_offset(regions: &[Region], distance: f64) -> f64 {
    let mut total = 0.0;
    let groups: Vec<&[Region]> = if distance < 0.0 {
        regions.chunks(1).collect()
    } else {
        vec![regions]
    };
    for group in groups {
        let paths: Paths64 = group
            .iter()
            .flat_map(Region::rings)
            .map(|r| {
                r.iter()
                    .map(|p| {
                        let p = *p * GRID_PER_MM;
                        Point64::new(p.x.round() as i64, p.y.round() as i64)
                    })
                    .collect()
            })
            .collect();
        let mut offset = ClipperOffset::new(2.0, 1e-4 * GRID_PER_MM, false, false);
        offset.add_paths(&paths, JoinType::Round, EndType::Polygon);
        let mut out = Paths64::new();
        offset.execute(distance * GRID_PER_MM, &mut out);
        for path in out {
            let ring: Ring = path
                .iter()
                .map(|p| DVec2::new(p.x as f64, p.y as f64) / GRID_PER_MM)
                .collect();
            total += signed_area(&ring);
        }
    }
    total
}

fn distance_to_boundary(regions: &[Region], p: DVec2) -> f64 {
    regions
        .iter()
        .flat_map(Region::rings)
        .flat_map(|r| (0..r.len()).map(move |i| (r[i], r[(i + 1) % r.len()])))
        .map(|(a, b)| {
            let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            p.distance(a.lerp(b, t))
        })
        .fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn offsets_agree_with_clippers_own(region in region(), d in 0.05..12.0_f64) {
        let shrunk = inset(&region, d, FINE).unwrap();
        let slack = 2e-4 * (perimeter(&region) + 7.0 * d * 40.0) + 1e-6;
        prop_assert!((area(&shrunk) - clipper_offset(&region, -d)).abs() < slack,
            "inset {d}: {} {}", area(&shrunk), clipper_offset(&region, -d));
        let grown = outset(&region, d, FINE).unwrap();
        prop_assert!((area(&grown) - clipper_offset(&region, d)).abs() < slack,
            "outset {d}: {} {}", area(&grown), clipper_offset(&region, d));
    }

    #[test]
    fn every_vertex_of_an_inset_lies_at_its_distance(region in region(), d in 0.05..6.0_f64) {
        for p in inset(&region, d, FINE).unwrap().iter().flat_map(Region::rings).flatten() {
            let away = distance_to_boundary(&region, *p);
            prop_assert!((away - d).abs() < 3e-4, "{p} lies {away} from the boundary, not {d}");
        }
    }

    #[test]
    fn booleans_agree_with_a_second_library(a in region(), b in region()) {
        let contours = |regions: &[Region]| -> Vec<Vec<[f64; 2]>> {
            regions.iter().flat_map(Region::rings).map(|r| r.iter().map(DVec2::to_array).collect()).collect()
        };
        let (ca, cb) = (contours(&a), contours(&b));
        let theirs = |rule| -> f64 {
            ca.overlay(&cb, rule, FillRule::NonZero).iter().flatten()
                .map(|c| signed_area(&c.iter().map(|p: &[f64; 2]| DVec2::from(*p)).collect::<Ring>()))
                .sum::<f64>().abs()
        };
        prop_assert!((area(&intersection(&a, &b).unwrap()) - theirs(OverlayRule::Intersect)).abs() < 1e-4);
        prop_assert!((area(&difference(&a, &b).unwrap()) - theirs(OverlayRule::Difference)).abs() < 1e-4);
        let both: Vec<_> = a.iter().chain(&b).cloned().collect();
        prop_assert!((area(&union(&both).unwrap()) - theirs(OverlayRule::Union)).abs() < 1e-4);
    }
}

#[test]
fn miters_keep_corners_and_strokes_have_round_ends() {
    let square = Region {
        outer: star(DVec2::ZERO, &[10.0; 4]),
        holes: vec![],
    };
    let grown = outset(
        std::slice::from_ref(&square),
        2.0,
        Join::Miter { limit: 2.0 },
    )
    .unwrap();
    let side = 10.0 * 2.0_f64.sqrt() + 4.0;
    assert!((area(&grown) - side * side).abs() < 1e-4);
    let line = stroke(&[vec![DVec2::ZERO, DVec2::X * 10.0]], 1.0, 1e-3).unwrap();
    assert!((area(&line) - 20.0 - std::f64::consts::PI).abs() < 0.01);
    assert!(inset(&[square], f64::NAN, FINE).is_err());
}

#[test]
fn bad_coordinates_are_named() {
    let mut bad = Region {
        outer: star(DVec2::ZERO, &[10.0; 4]),
        holes: vec![],
    };
    bad.outer[2].y = f64::NAN;
    let error = inset(
        &[
            Region {
                outer: star(DVec2::ZERO, &[9.0; 4]),
                holes: vec![],
            },
            bad,
        ],
        1.0,
        FINE,
    )
    .unwrap_err()
    .to_string();
    assert!(error.contains("vertex 2 of ring 0 of region 1"), "{error}");
}

#[test]
fn the_same_bits_on_any_thread_count() {
    let regions: Vec<_> = (0..40_u32)
        .map(|i| Region {
            outer: star(
                DVec2::new(100.0 * f64::from(i), 0.0),
                &[20.0, 33.0, 17.0, 29.0, 31.0, 12.0, 25.0],
            ),
            holes: vec![],
        })
        .collect();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build()
            .unwrap()
            .install(|| inset(&regions, 3.0, FINE).unwrap())
    };
    assert_eq!(on(1), on(4));
}
