//! Planar slicing: areas, volumes, orientation, planes on facets, damaged meshes, thread counts.

use std::f64::consts::PI;

use crate::solids::{cube, joined};
use meltpath_base::{Cancelled, Reporter, Silent};
use meltpath_geometry::{
    Mesh, Plane,
    math::{DAffine3, DQuat, DVec2, DVec3},
    region::signed_area,
    section::{LastLayer, LayerHeight, Slice, SliceError, SlicePlan, layers, slice},
    shapes,
};
use proptest::prelude::*;

fn cut(mesh: &Mesh, heights: &[f64]) -> (Vec<Slice>, Vec<String>) {
    let reporter = Reporter::new();
    let plan = SlicePlan::new(Plane::horizontal(0.0), heights.to_vec());
    let slices = slice(mesh, &plan, &reporter, &Silent).unwrap();
    (
        slices,
        reporter.warnings().into_iter().map(|w| w.code).collect(),
    )
}

fn moved(mesh: &Mesh, by: DAffine3) -> Mesh {
    Mesh {
        vertices: mesh
            .vertices
            .iter()
            .map(|&p| by.transform_point3(p))
            .collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// Outer rings counter-clockwise, holes clockwise, no repeated points.
fn assert_sound(slices: &[Slice]) {
    for region in slices.iter().flat_map(|s| &s.regions) {
        assert!(signed_area(&region.outer) > 0.0);
        assert!(region.holes.iter().all(|h| signed_area(h) < 0.0));
        for ring in region.rings() {
            assert!(ring.len() >= 3);
            assert!((0..ring.len()).all(|i| ring[i] != ring[(i + 1) % ring.len()]));
        }
    }
}

/// The generator's parts with their plan regions, extruded.
fn outlines() -> Vec<(&'static str, Vec<meltpath_geometry::Region>)> {
    vec![
        ("plate", vec![shapes::plate(60.0, 30.0)]),
        ("ring", vec![shapes::ring(40.0, 25.0, 128)]),
        ("cross", vec![shapes::cross(80.0, 15.0)]),
        ("tee", vec![shapes::tee(60.0, 50.0, 12.0)]),
        ("ell", vec![shapes::ell(60.0, 40.0, 10.0)]),
        ("star", vec![shapes::star(7, 40.0, 18.0)]),
        ("gear", vec![shapes::gear(18, 40.0, 48.0, 12.0)]),
        ("honeycomb", vec![shapes::honeycomb(5, 4, 20.0, 6.0)]),
        ("spiral", vec![shapes::spiral(10.0, 16.0, 6.0, 3.0)]),
        ("truss", vec![shapes::truss(5, 40.0, 7.0)]),
        ("islands", shapes::islands(4, 3, 20.0, 8.0)),
        ("random", vec![shapes::random_star(42, 31, 10.0, 50.0)]),
    ]
}

/// To the bit: what layers of the same sections share hangs on that. Sides in many pieces bend by about what collinear points may: no cut of
/// an edge inside such a piece may stand in for a corner.
#[test]
fn sections_of_an_upright_part_are_the_same_at_every_height() {
    for (name, mut regions) in outlines() {
        for ring in regions
            .iter_mut()
            .flat_map(|r| std::iter::once(&mut r.outer).chain(&mut r.holes))
        {
            let corners = ring.clone();
            let sides = corners.iter().zip(corners.iter().cycle().skip(1));
            *ring = sides
                .flat_map(|(a, b)| (0..9).map(move |k| a.lerp(*b, f64::from(k) / 9.0)))
                .zip(0_u32..)
                .map(|(p, i)| {
                    let bent = 2e-6 * f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65536.0;
                    p.rotate(DVec2::from_angle(0.3)) + DVec2::new(bent, -bent)
                })
                .collect();
        }
        let part = shapes::extrude(&regions, 12.0);
        let heights: Vec<f64> = (0..40).map(|k| 0.07 + 0.29 * f64::from(k)).collect();
        let (slices, _) = cut(&part, &heights);
        for slice in &slices {
            assert!(
                slice.regions == slices[0].regions,
                "{name} at {}",
                slice.height
            );
        }
    }
}

#[test]
fn extrusions_have_their_outline_at_every_height_including_the_top_facet() {
    for (name, regions) in outlines() {
        let area: f64 = regions.iter().map(meltpath_geometry::Region::area).sum();
        let part = shapes::extrude(&regions, 12.0);
        assert!(
            (part.volume() / (12.0 * area) - 1.0).abs() < 1e-12,
            "{name}"
        );
        let (slices, warnings) = cut(&part, &[-1.0, 0.0, 1e-9, 3.7, 12.0, 12.1]);
        assert_sound(&slices);
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
        for k in [0, 1, 5] {
            assert!(
                slices[k].regions.is_empty(),
                "{name}: nothing below, at the bottom, above"
            );
        }
        for s in &slices[2..5] {
            assert!(
                (s.area() / area - 1.0).abs() < 1e-9,
                "{name} at {}",
                s.height
            );
            assert_eq!(s.regions.len(), regions.len(), "{name}");
            let holes =
                |r: &[meltpath_geometry::Region]| r.iter().map(|r| r.holes.len()).sum::<usize>();
            assert_eq!(holes(&s.regions), holes(&regions), "{name}");
            let corners: usize = s
                .regions
                .iter()
                .flat_map(meltpath_geometry::Region::rings)
                .map(Vec::len)
                .sum();
            let wanted: usize = regions
                .iter()
                .flat_map(meltpath_geometry::Region::rings)
                .map(Vec::len)
                .sum();
            assert_eq!(
                corners, wanted,
                "{name}: diagonals of the walls leave no points"
            );
        }
    }
}

#[test]
fn bodies_of_revolution_have_their_circles() {
    let cone = shapes::cone(30.0, 10.0, 40.0);
    let polygon = 180.0 * (2.0 * PI / 180.0).sin() / 2.0;
    let (slices, _) = cut(&cone, &[10.0, 20.0, 40.0]);
    for s in slices {
        let r = 30.0 - s.height / 2.0;
        assert!(
            (s.area() / (polygon * r * r) - 1.0).abs() < 1e-6,
            "at {}",
            s.height
        );
    }
    for part in [
        shapes::flange((60.0, 12.0), (30.0, 35.0), 18.0, 6, 45.0, 5.5),
        shapes::impeller_blank((18.0, 40.0), (60.0, 6.0), 8.0),
        shapes::boss_on_plate((80.0, 60.0, 10.0), 20.0, 10.0, 25.0),
        shapes::ribbed_bracket((120.0, 60.0, 8.0), 4, 7.0, 30.0),
        shapes::box_wall(60.0, 40.0, 7.0, 20.0),
        shapes::thin_wall(100.0, 7.0, 30.0),
    ] {
        let (lo, hi) = part.bounds().unwrap();
        let n = 2000;
        let step = (hi.z - lo.z) / f64::from(n);
        let heights: Vec<f64> = (0..n).map(|k| lo.z + (f64::from(k) + 0.5) * step).collect();
        let (slices, warnings) = cut(&part, &heights);
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_sound(&slices);
        let volume: f64 = slices.iter().map(|s| s.area() * step).sum();
        assert!(
            (volume / part.volume() - 1.0).abs() < 2e-3,
            "{volume} {}",
            part.volume()
        );
    }
}

#[test]
fn volume_from_slices_converges_to_the_mesh_volume() {
    let part = shapes::vase(40.0, 12.0, 6.0, 90.0, 96, 60);
    let error = |n: u32| {
        let step = 90.0 / f64::from(n);
        let heights: Vec<f64> = (0..n).map(|k| (f64::from(k) + 0.5) * step).collect();
        let volume: f64 = cut(&part, &heights).0.iter().map(|s| s.area() * step).sum();
        (volume / part.volume() - 1.0).abs()
    };
    let (coarse, fine) = (error(30), error(480));
    assert!(fine < 1e-5 && fine < coarse / 10.0, "{coarse} then {fine}");
}

#[test]
fn two_cubes_that_intersect_give_their_union_and_say_so() {
    let part = joined(
        &cube(DVec3::ZERO, 10.0),
        &cube(DVec3::new(5.0, 5.0, 0.0), 10.0),
    );
    let (slices, warnings) = cut(&part, &[3.0, 7.0]);
    assert_eq!(warnings, ["slice-contours-united"]);
    assert_sound(&slices);
    assert!(
        slices
            .iter()
            .all(|s| (s.area() - 175.0).abs() < 1e-4 && s.regions.len() == 1)
    );
    let inside = joined(&cube(DVec3::ZERO, 10.0), &cube(DVec3::splat(2.0), 4.0));
    let (slices, warnings) = cut(&inside, &[3.0]);
    assert_eq!(warnings, ["slice-solid-in-solid"]);
    assert!((slices[0].area() - 100.0).abs() < 1e-9);
}

#[test]
fn an_inside_out_part_still_fills() {
    let mut part = shapes::extrude(&[shapes::ring(20.0, 10.0, 64)], 5.0);
    let (right, _) = cut(&part, &[2.0]);
    part.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let (turned, _) = cut(&part, &[2.0]);
    assert_sound(&turned);
    assert!((right[0].area() - turned[0].area()).abs() < 1e-9);
}

#[test]
fn cracks_are_closed_and_holes_are_told_with_their_place() {
    // one wall of a cube unwelded and shifted by 20 µm
    let mut part = cube(DVec3::ZERO, 10.0);
    let top: Vec<usize> = (0..part.triangles.len())
        .filter(|&t| part.corners(t).iter().all(|p| p.x == 10.0))
        .collect();
    for &t in &top {
        for k in 0..3 {
            let p = part.vertices[part.triangles[t][k] as usize] + DVec3::new(0.02, 0.0, 0.0);
            part.triangles[t][k] = part.vertices.len() as u32;
            part.vertices.push(p);
        }
    }
    let (slices, warnings) = cut(&part, &[5.0]);
    assert_eq!(warnings, ["slice-gap-closed"]);
    assert!((slices[0].area() - 100.0).abs() < 0.25);
    // the wall missing altogether
    let mut part = cube(DVec3::ZERO, 10.0);
    for &t in top.iter().rev() {
        part.triangles.remove(t);
    }
    let reporter = Reporter::new();
    let plan = SlicePlan::new(Plane::horizontal(0.0), vec![5.0]);
    let slices = slice(&part, &plan, &reporter, &Silent).unwrap();
    assert!(slices[0].regions.is_empty());
    let warning = &reporter.warnings()[0];
    assert_eq!(warning.code, "slice-contour-open");
    let place = warning.place.as_ref().unwrap().position.unwrap();
    assert!((place[0] - 10.0).abs() < 1e-9 && (place[2] - 5.0).abs() < 1e-9);
}

#[test]
fn plans_and_meshes_that_make_no_sense_are_refused() {
    let part = cube(DVec3::ZERO, 10.0);
    let run = |mesh: &Mesh, plan: &SlicePlan| slice(mesh, plan, &Reporter::new(), &Silent);
    let good = SlicePlan::new(Plane::horizontal(0.0), vec![1.0, 2.0]);
    for heights in [vec![2.0, 1.0], vec![1.0, 1.0], vec![f64::NAN]] {
        let plan = SlicePlan {
            heights,
            ..good.clone()
        };
        assert!(matches!(run(&part, &plan), Err(SliceError::Heights { .. })));
    }
    let plan = SlicePlan {
        join: -1.0,
        ..good.clone()
    };
    assert!(matches!(
        run(&part, &plan),
        Err(SliceError::Tolerance { name: "join", .. })
    ));
    let mut plan = good.clone();
    plan.base.normal = DVec3::ZERO;
    assert_eq!(run(&part, &plan), Err(SliceError::Frame));
    let mut bad = part.clone();
    bad.vertices[3].y = f64::NAN;
    assert_eq!(run(&bad, &good), Err(SliceError::Vertex { vertex: 3 }));
    let mut bad = part.clone();
    bad.triangles[2][1] = 99;
    assert_eq!(run(&bad, &good), Err(SliceError::Index { triangle: 2 }));
    assert!(
        run(&Mesh::default(), &good)
            .unwrap()
            .iter()
            .all(|s| s.regions.is_empty())
    );
}

#[test]
fn cancelling_stops_the_stage() {
    let plan = SlicePlan::new(Plane::horizontal(0.0), vec![1.0]);
    let result = slice(
        &cube(DVec3::ZERO, 10.0),
        &plan,
        &Reporter::new(),
        &crate::Stop,
    );
    assert_eq!(result, Err(SliceError::Cancelled(Cancelled)));
}

#[test]
fn layers_reach_the_target() {
    let even = |h: f64| LayerHeight::Constant(h);
    let made = layers(0.0, 30.0, &even(1.5), LastLayer::Adapted).unwrap();
    assert_eq!(made.len(), 20);
    let made = layers(-3.0, 9.5, &even(2.0), LastLayer::Full).unwrap();
    assert_eq!((made.len(), made[6].top), (7, 11.0));
    let made = layers(0.0, 0.5, &even(2.0), LastLayer::Adapted).unwrap();
    assert_eq!((made.len(), made[0].top), (1, 0.5));
    let list = LayerHeight::PerLayer(vec![3.0, 2.0, 1.0]);
    let made = layers(0.0, 8.2, &list, LastLayer::Adapted).unwrap();
    assert_eq!(
        made.iter().map(|l| l.top).collect::<Vec<_>>(),
        [3.0, 5.0, 6.0, 7.0, 8.2]
    );
    assert!(layers(0.0, 5.0, &even(-1.0), LastLayer::Full).is_err());
    assert!(layers(0.0, 5.0, &even(1e-9), LastLayer::Full).is_err());
    assert!(layers(5.0, 5.0, &even(1.0), LastLayer::Full).is_err());
}

proptest! {
    #[test]
    fn layers_are_whole_and_within_bounds(top in 0.1..100.0f64, h in 0.05..5.0f64) {
        let made = layers(0.0, top, &LayerHeight::Constant(h), LastLayer::Adapted).unwrap();
        prop_assert_eq!(made[0].bottom, 0.0);
        prop_assert_eq!(made[made.len() - 1].top, top);
        for w in made.windows(2) {
            prop_assert_eq!(w[0].top, w[1].bottom);
        }
        for l in &made[..made.len() - 1] {
            prop_assert!((l.height() - h).abs() < 1e-9);
        }
        let last = made[made.len() - 1].height() / h;
        prop_assert!(last < 1.5 + 1e-6 && (last > 0.5 - 1e-6 || made.len() == 1));
    }

    #[test]
    fn turning_part_and_planes_together_changes_no_area(
        seed in any::<u64>(), axis in prop::array::uniform3(-1.0..1.0f64), angle in 0.0..6.0f64
    ) {
        let axis = DVec3::from(axis).try_normalize().unwrap_or(DVec3::Z);
        let turn = DAffine3::from_rotation_translation(DQuat::from_axis_angle(axis, angle), DVec3::new(11.0, -7.0, 3.0));
        let part = shapes::extrude(&[shapes::random_star(seed, 17, 8.0, 40.0)], 20.0);
        let heights = vec![0.3, 7.7, 19.99];
        let plan = SlicePlan::new(Plane::horizontal(0.0), heights.clone());
        let straight = slice(&part, &plan, &Reporter::new(), &Silent).unwrap();
        let base = Plane {
            origin: turn.transform_point3(DVec3::ZERO),
            normal: turn.transform_vector3(DVec3::Z),
            x: turn.transform_vector3(DVec3::X),
        };
        let turned = slice(&moved(&part, turn), &SlicePlan::new(base, heights), &Reporter::new(), &Silent).unwrap();
        for (a, b) in straight.iter().zip(&turned) {
            prop_assert!((a.area() - b.area()).abs() < 1e-6 * a.area());
        }
        // and lying on its side: the mean section times the width is the volume
        let across = Plane::new(DVec3::new(0.0, -40.0, 0.0), DVec3::Y).unwrap();
        let step = 80.0 / 1500.0;
        let plan = SlicePlan::new(across, (0..1500).map(|k| (f64::from(k) + 0.5) * step).collect());
        let volume: f64 = slice(&part, &plan, &Reporter::new(), &Silent).unwrap().iter().map(|s| s.area() * step).sum();
        prop_assert!((volume / part.volume() - 1.0).abs() < 5e-3);
    }

    #[test]
    fn any_soup_of_triangles_slices_without_panic(
        points in prop::collection::vec(prop::array::uniform3(-3i8..4), 3..40),
        corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..120)
    ) {
        let mesh = Mesh {
            vertices: points.iter().map(|p| DVec3::from(p.map(f64::from))).collect(),
            triangles: corners.iter().map(|t| t.map(|i| i.index(points.len()) as u32)).collect(),
        };
        let (slices, _) = cut(&mesh, &[-3.0, -1.5, 0.0, 0.5, 1.0, 3.0]);
        assert_sound(&slices);
    }

    #[test]
    fn the_same_bits_on_one_and_four_threads(seed in any::<u64>()) {
        let part = joined(
            &shapes::extrude(&[shapes::random_star(seed, 200, 10.0, 40.0)], 15.0),
            &moved(&shapes::cone(30.0, 5.0, 25.0), DAffine3::from_translation(DVec3::new(20.0, 3.0, -4.0))),
        );
        let heights: Vec<f64> = (0..40).map(|k| -3.5 + 0.6 * f64::from(k)).collect();
        let on = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| cut(&part, &heights))
        };
        prop_assert_eq!(on(1), on(4));
    }
}
