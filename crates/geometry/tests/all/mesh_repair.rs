//! Diagnosis and repair: every kind of defect, put in on purpose, is counted, placed and mended.

use crate::solids::{cube, joined, shifted};
use meltpath_base::{Reporter, Silent};
use meltpath_geometry::{
    Mesh, Plane, Region,
    diagnosis::{Defect, Diagnosis, DiagnosisOptions, diagnose},
    math::{DVec2, DVec3},
    overhang::{largest_shift, overhangs},
    repair::{RepairAction, RepairOptions, repair},
    section::{Slice, SlicePlan, slice},
    shapes,
};
use proptest::prelude::*;

/// Shift between layers that is accepted, as a share of the bead's width.
const FRACTION: f64 = 0.25;

fn examine(mesh: &Mesh) -> Diagnosis {
    diagnose(mesh, &DiagnosisOptions::default(), &Silent).unwrap()
}

fn mend(mesh: &mut Mesh) -> Vec<RepairAction> {
    repair(mesh, &RepairOptions::default(), &Reporter::new(), &Silent).unwrap()
}

fn flange() -> Mesh {
    shapes::flange((60.0, 12.0), (30.0, 35.0), 18.0, 6, 45.0, 5.5)
}

#[test]
fn generated_parts_are_sound_and_repair_leaves_them_alone() {
    let parts = [
        flange(),
        shapes::impeller_blank((18.0, 40.0), (60.0, 6.0), 8.0),
        shapes::boss_on_plate((80.0, 60.0, 10.0), 20.0, 10.0, 25.0),
        shapes::ribbed_bracket((120.0, 60.0, 8.0), 4, 7.0, 30.0),
        shapes::box_wall(60.0, 40.0, 7.0, 20.0),
        shapes::cone(30.0, 10.0, 40.0),
        shapes::vase(40.0, 12.0, 6.0, 90.0, 96, 60),
        shapes::extrude(&[shapes::honeycomb(5, 4, 20.0, 6.0)], 15.0),
        shapes::extrude(&[shapes::truss(5, 40.0, 7.0)], 15.0),
        shapes::extrude(&[shapes::spiral(10.0, 16.0, 6.0, 3.0)], 15.0),
        shapes::extrude(&[shapes::gear(18, 40.0, 48.0, 12.0)], 15.0),
        shapes::extrude(&shapes::islands(4, 3, 20.0, 8.0), 15.0),
    ];
    for (k, part) in parts.into_iter().enumerate() {
        let found = examine(&part);
        assert!(found.findings.is_empty(), "part {k}: {:?}", found.findings);
        assert!(found.volume > 0.0 && found.shells.iter().all(|s| s.closed));
        let total: f64 = found.shells.iter().map(|s| s.volume).sum();
        assert!((total / found.volume - 1.0).abs() < 1e-12);
        let mut again = part.clone();
        assert!(mend(&mut again).is_empty(), "part {k}");
        assert_eq!(again, part);
    }
}

#[test]
fn reversed_triangles_are_counted_placed_and_turned() {
    let mut part = flange();
    let volume = part.volume();
    let places: Vec<DVec3> = [3, 100, 500]
        .into_iter()
        .map(|t| {
            part.triangles[t].swap(0, 1);
            part.corners(t).iter().sum::<DVec3>() / 3.0
        })
        .collect();
    let found = examine(&part);
    assert_eq!(found.count(Defect::ReversedTriangle), 3);
    let finding = found
        .findings
        .iter()
        .find(|f| f.defect == Defect::ReversedTriangle)
        .unwrap();
    assert_eq!(finding.places, places);
    let actions = mend(&mut part);
    assert!(
        matches!(
            actions[..],
            [RepairAction::TurnedTriangles { triangles: 3, .. }]
        ),
        "{actions:?}"
    );
    assert!(examine(&part).is_sound());
    assert!((part.volume() / volume - 1.0).abs() < 1e-12);
}

#[test]
fn an_inside_out_part_with_a_cavity_is_turned_whole() {
    let mut cavity = cube(DVec3::splat(3.0), 4.0);
    cavity.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let mut part = joined(&cube(DVec3::ZERO, 10.0), &cavity);
    assert!(examine(&part).is_sound());
    assert!((part.volume() - 936.0).abs() < 1e-9);
    assert_eq!(examine(&part).shells[1].inside, Some(0));
    part.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert_eq!(examine(&part).count(Defect::InsideOutShell), 1);
    let actions = mend(&mut part);
    assert!(
        matches!(actions[..], [RepairAction::TurnedShells { shells: 2, .. }]),
        "{actions:?}"
    );
    assert!((part.volume() - 936.0).abs() < 1e-9);
    assert!(examine(&part).is_sound());
}

#[test]
fn holes_are_counted_placed_and_filled_when_small() {
    let mut part = flange();
    let volume = part.volume();
    let gone = part.corners(200).iter().sum::<DVec3>() / 3.0;
    part.triangles.remove(200);
    let found = examine(&part);
    assert_eq!(
        (found.count(Defect::Hole), found.count(Defect::LooseEdge)),
        (1, 3)
    );
    let hole = found
        .findings
        .iter()
        .find(|f| f.defect == Defect::Hole)
        .unwrap();
    assert!(hole.places[0].distance(gone) < 1e-9);
    // its loose edges are told at their middles
    let corners = flange().corners(200);
    let middles: Vec<DVec3> = (0..3)
        .map(|k| corners[k].midpoint(corners[(k + 1) % 3]))
        .collect();
    let edges = found.findings.iter();
    let edges = edges.filter(|f| f.defect == Defect::LooseEdge);
    for place in edges.flat_map(|f| &f.places) {
        assert!(middles.iter().any(|m| m.distance(*place) < 1e-9), "{place}");
    }
    let whole_options = RepairOptions {
        hole: 1.0,
        ..RepairOptions::default()
    };
    let reporter = Reporter::new();
    let actions = repair(&mut part, &whole_options, &reporter, &Silent).unwrap();
    assert!(
        matches!(
            actions[..],
            [RepairAction::FilledHoles {
                holes: 1,
                triangles: 1,
                ..
            }]
        ),
        "{actions:?}"
    );
    assert_eq!(reporter.warnings()[0].code, "mesh-repaired");
    assert!(examine(&part).is_sound());
    assert!((part.volume() / volume - 1.0).abs() < 1e-12);
    // a cube without its lid: too wide to guess by default, exact when asked for
    let mut open = cube(DVec3::ZERO, 10.0);
    open.triangles.retain(|t| {
        t.iter()
            .any(|&v| cube(DVec3::ZERO, 10.0).vertices[v as usize].z == 0.0)
    });
    assert_eq!(open.triangles.len(), 10);
    assert!(mend(&mut open.clone()).is_empty());
    repair(&mut open, &whole_options, &reporter, &Silent).unwrap();
    assert!((open.volume() - 1000.0).abs() < 1e-9);
    assert!(examine(&open).is_sound());
}

#[test]
fn cracks_are_welded() {
    // every triangle on its own, corners moved by up to 0.2 µm
    let whole = flange();
    let mut loose = Mesh::default();
    for t in 0..whole.triangles.len() {
        for (k, p) in whole.corners(t).into_iter().enumerate() {
            loose
                .vertices
                .push(p + DVec3::splat(1e-4 * ((7 * t + k) % 3) as f64 / 3.0));
        }
        let v = 3 * t as u32;
        loose.triangles.push([v, v + 1, v + 2]);
    }
    assert_eq!(
        examine(&loose).count(Defect::Hole),
        whole.triangles.len() as u64
    );
    let actions = mend(&mut loose);
    assert!(matches!(actions[0], RepairAction::Welded { .. }));
    assert!(examine(&loose).is_sound(), "{:?}", examine(&loose).findings);
    assert_eq!(loose.vertices.len(), whole.vertices.len());
    assert!((loose.volume() / whole.volume() - 1.0).abs() < 1e-5);
}

#[test]
fn degenerate_duplicate_and_stray_triangles_are_dropped() {
    let mut part = flange();
    let clean = part.clone();
    let copy = part.triangles[17];
    part.triangles.push(copy);
    part.triangles.push([5, 5, 9]);
    let part = joined(&part, &cube(DVec3::new(0.0, 0.0, 60.0), 0.05));
    let found = examine(&part);
    assert_eq!(found.count(Defect::Duplicate), 1);
    assert_eq!(found.count(Defect::Degenerate), 1);
    assert_eq!(found.count(Defect::StrayShell), 1);
    let mut mended = part;
    let actions = mend(&mut mended);
    assert!(
        actions
            .iter()
            .any(|a| matches!(a, RepairAction::DroppedDuplicates { triangles: 1, .. }))
    );
    assert!(
        actions
            .iter()
            .any(|a| matches!(a, RepairAction::DroppedDegenerate { triangles: 1 }))
    );
    assert!(actions.iter().any(|a| matches!(
        a,
        RepairAction::DroppedStrays {
            shells: 1,
            triangles: 12,
            ..
        }
    )));
    assert_eq!(mended, clean);
}

#[test]
fn solids_that_share_a_face_become_one() {
    let a = cube(DVec3::ZERO, 10.0);
    // the mirror image has its triangles on the shared face where the first one has them
    let mut b = a.clone();
    b.vertices.iter_mut().for_each(|p| p.x = 20.0 - p.x);
    b.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let mut part = joined(&a, &b);
    meltpath_geometry::weld::weld(&mut part, 0.0);
    let found = examine(&part);
    assert_eq!(
        found.count(Defect::NonManifoldEdge),
        5,
        "{:?}",
        found.findings
    );
    assert_eq!(found.count(Defect::Duplicate), 2);
    let actions = mend(&mut part);
    assert!(
        matches!(
            actions[..],
            [RepairAction::DroppedDuplicates { triangles: 4, .. }]
        ),
        "{actions:?}"
    );
    assert!(examine(&part).is_sound());
    assert!((part.volume() - 2000.0).abs() < 1e-9);
}

/// A block, and a frame of the same outline with a window: their outer faces are the same triangles.
#[test]
fn solids_that_share_triangles_stay_closed_each() {
    let (block, tall) = (
        shapes::extrude(&[shapes::plate(40.0, 20.0)], 10.0),
        shapes::extrude(&[shapes::plate(40.0, 20.0)], 30.0),
    );
    let mut framed = shapes::plate(40.0, 20.0);
    let middle = |ring: &[DVec2]| ring.iter().sum::<DVec2>() / ring.len() as f64;
    let window = shapes::plate(20.0, 10.0).outer;
    let by = middle(&framed.outer) - middle(&window);
    let hole = window.iter().rev().map(|p| p + by);
    framed.holes.push(hole.collect());
    let frame = shapes::extrude(&[framed], 10.0);
    let all = [&block, &frame, &tall].map(Mesh::volume);
    for (parts, volume, dropped) in [
        (vec![&block, &frame], all[0] + all[1], 0),
        // one bottom
        (vec![&block, &tall], all[0] + all[2], 0),
        (vec![&block, &frame, &tall], all[0] + all[1] + all[2], 0),
        // the whole block once more goes
        (vec![&block, &frame, &block], all[0] + all[1], 12),
    ] {
        let mut part = parts[1..]
            .iter()
            .fold(parts[0].clone(), |whole, next| joined(&whole, next));
        meltpath_geometry::weld::weld(&mut part, 0.0);
        assert!(examine(&part).count(Defect::Duplicate) > 0);
        // one facet twice besides, which closes nothing
        let facet = part.triangles[0];
        part.triangles.push(facet);
        let actions = mend(&mut part);
        let of = |a: &RepairAction| match a {
            RepairAction::DroppedDuplicates { triangles, .. } => *triangles,
            other => panic!("{other:?}"),
        };
        let total: u64 = actions.iter().map(of).sum();
        assert_eq!(total, dropped + 1);
        let found = examine(&part);
        for defect in [
            Defect::Duplicate,
            Defect::LooseEdge,
            Defect::NonManifoldEdge,
        ] {
            assert_eq!(found.count(defect), 0, "{:?}", found.findings);
        }
        assert!((part.volume() - volume).abs() < 1e-9 * volume);
        // above the least of them there is what is there
        let plan = SlicePlan::new(Plane::horizontal(0.0), vec![5.0]);
        let cut = slice(&part, &plan, &Reporter::new(), &Silent).unwrap();
        assert!((cut[0].area() - 800.0).abs() < 1e-6, "{}", cut[0].area());
    }
}

/// A face that is there twice, once the wrong way round, is not a wall of no thickness: without it the solid is open.
#[test]
fn a_face_written_again_in_the_other_sense_goes_alone() {
    let whole = cube(DVec3::ZERO, 10.0);
    let mut part = whole.clone();
    for t in 0..2 {
        let [a, b, c] = part.triangles[t];
        part.triangles.push([a, c, b]);
    }
    let actions = mend(&mut part);
    assert!(
        matches!(
            actions[..],
            [RepairAction::DroppedDuplicates { triangles: 2, .. }]
        ),
        "{actions:?}"
    );
    assert_eq!(part, whole);
}

/// Thousands of triangles at one place are many copies of one.
#[test]
fn many_copies_of_one_triangle_take_no_time() {
    let whole = cube(DVec3::ZERO, 10.0);
    let mut part = whole.clone();
    let facet = part.triangles[3];
    part.triangles.extend(std::iter::repeat_n(facet, 20_000));
    mend(&mut part);
    assert_eq!(part, whole);
}

#[test]
fn two_cubes_that_intersect_are_told_with_places_on_the_cut() {
    let part = joined(
        &cube(DVec3::ZERO, 10.0),
        &cube(DVec3::new(5.1, 5.2, 5.3), 10.0),
    );
    let found = examine(&part);
    assert!(found.count(Defect::Intersection) >= 6);
    assert_eq!(found.shells.len(), 2);
    let finding = found
        .findings
        .iter()
        .find(|f| f.defect == Defect::Intersection)
        .unwrap();
    assert!(
        finding
            .places
            .iter()
            .all(|p| p.min_element() >= 0.0 && p.max_element() <= 15.3)
    );
    let apart = joined(
        &cube(DVec3::ZERO, 10.0),
        &cube(DVec3::new(10.5, 0.0, 0.0), 10.0),
    );
    assert!(examine(&apart).is_sound());
    let reporter = Reporter::new();
    found.warn(&reporter);
    assert_eq!(reporter.warnings()[0].code, "mesh-intersection");
}

#[test]
fn vertices_that_are_not_finite_are_told_and_left_alone() {
    let mut part = flange();
    part.vertices[7].x = f64::NAN;
    let found = examine(&part);
    assert_eq!(found.count(Defect::NotFinite), 1);
    assert!(mend(&mut part).is_empty());
    assert!(examine(&Mesh::default()).findings.is_empty());
}

#[test]
fn t_junctions_are_hinted() {
    // one rim edge of an open box split on one side only
    let whole = cube(DVec3::ZERO, 10.0);
    let mut part = whole.clone();
    part.triangles
        .retain(|t| t.iter().any(|&v| whole.vertices[v as usize].z == 0.0));
    let lid = Mesh {
        vertices: vec![
            DVec3::new(0.0, 0.0, 10.0),
            DVec3::new(5.0, 0.0, 10.0),
            DVec3::new(10.0, 0.0, 10.0),
            DVec3::new(10.0, 10.0, 10.0),
            DVec3::new(0.0, 10.0, 10.0),
        ],
        triangles: vec![[0, 1, 4], [1, 2, 3], [1, 3, 4]],
    };
    let mut part = joined(&part, &lid);
    meltpath_geometry::weld::weld(&mut part, 0.0);
    let found = examine(&part);
    assert_eq!(found.count(Defect::TJunction), 1);
    let finding = found
        .findings
        .iter()
        .find(|f| f.defect == Defect::TJunction)
        .unwrap();
    assert_eq!(finding.places[0], DVec3::new(5.0, 0.0, 10.0));
}

#[test]
fn overhangs_are_flagged_beyond_the_accepted_shift() {
    // walls that lean: 1 mm a layer over 2 mm layers
    let part = shapes::cone(20.0, 35.0, 30.0);
    let heights: Vec<f64> = (0..15).map(|k| 1.0 + 2.0 * f64::from(k)).collect();
    let plan = SlicePlan::new(Plane::horizontal(0.0), heights);
    let slices = slice(&part, &plan, &Reporter::new(), &Silent).unwrap();
    let reporter = Reporter::new();
    let found = overhangs(&slices, 7.0, FRACTION, &reporter, &Silent).unwrap();
    assert!(found.is_empty(), "1 mm is within 0.25 x 7 mm");
    let found = overhangs(&slices, 3.0, FRACTION, &reporter, &Silent).unwrap();
    assert_eq!(found.len(), 14);
    assert!(
        found.iter().all(|o| (o.shift.unwrap() - 1.0).abs() < 0.01),
        "{found:?}"
    );
    // how far they reach is told at any limit
    let largest = largest_shift(&slices, 6.0, &Silent).unwrap().unwrap();
    assert!((largest.shift - 1.0).abs() < 0.01, "{largest:?}");
    assert_eq!(largest.place.z, slices[largest.slice].height);
    let upright: Vec<_> = [0.0, 2.0].map(|_| slices[0].clone()).into();
    assert_eq!(largest_shift(&upright, 6.0, &Silent).unwrap(), None);
    assert_eq!(reporter.warnings().len(), 1);
    assert!(overhangs(&slices, -1.0, 0.25, &reporter, &Silent).is_err());
    // a table: the plate starts in the air beyond its foot
    let foot = shapes::extrude(&[shapes::plate(10.0, 10.0)], 10.0);
    let table = joined(
        &foot,
        &shifted(
            &shapes::extrude(&[shapes::plate(40.0, 10.0)], 5.0),
            DVec3::new(0.0, 0.0, 10.0),
        ),
    );
    let plan = SlicePlan::new(Plane::horizontal(0.0), vec![2.0, 8.0, 12.0]);
    let slices = slice(&table, &plan, &Reporter::new(), &Silent).unwrap();
    let found = overhangs(&slices, 6.0, FRACTION, &reporter, &Silent).unwrap();
    assert_eq!((found.len(), found[0].slice), (1, 2));
    assert!((found[0].shift.unwrap() - 30.0).abs() < 1e-3);
    let largest = largest_shift(&slices, 6.0, &Silent).unwrap().unwrap();
    assert_eq!(largest.slice, 2);
    assert!((largest.shift - 30.0).abs() < 1e-3, "{largest:?}");
    // beyond 10 + 1.5 mm, and the round corners of the grown foot
    assert!((found[0].area - 285.0).abs() < 1.0, "{}", found[0].area);
    // an island in the air
    let mut slices = slices;
    slices[1].regions.clear();
    let found = overhangs(&slices, 6.0, FRACTION, &reporter, &Silent).unwrap();
    assert_eq!(found[0].shift, None);
}

/// A lintel on two posts, a roof over a cavity: every corner of what hangs lies on the rim that holds it, its middle does not.
#[test]
fn what_is_held_on_two_sides_hangs_in_its_middle() {
    let square = |half: f64| {
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        corners.map(|(x, y)| DVec2::new(x, y)).to_vec()
    };
    let moved = |region: Region, x: f64| Region {
        outer: region
            .outer
            .iter()
            .map(|p| *p + DVec2::new(x, 0.0))
            .collect(),
        holes: Vec::new(),
    };
    let posts = vec![
        moved(shapes::plate(10.0, 8.0), 0.0),
        moved(shapes::plate(10.0, 8.0), 34.0),
    ];
    let whole = |outer, holes| vec![Region { outer, holes }];
    let cavity: Vec<DVec2> = square(8.0).into_iter().rev().collect();
    let layer = |height: f64, regions: &[Region]| Slice {
        surface: Plane::horizontal(height),
        height,
        regions: regions.to_vec(),
    };
    for (below, above, shift) in [
        (posts, vec![shapes::plate(44.0, 8.0)], 12.0),
        (
            whole(square(20.0), vec![cavity]),
            whole(square(20.0), Vec::new()),
            8.0,
        ),
    ] {
        let slices = [layer(1.0, &below), layer(3.0, &above), layer(5.0, &above)];
        let largest = largest_shift(&slices, 6.0, &Silent).unwrap().unwrap();
        assert_eq!(largest.slice, 1);
        assert!((largest.shift - shift).abs() < 0.06, "{largest:?}");
        let reporter = Reporter::new();
        let found = overhangs(&slices, 6.0, FRACTION, &reporter, &Silent).unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].shift.unwrap() - shift).abs() < 0.06, "{found:?}");
        let told = format!("{:.2} mm beyond", found[0].shift.unwrap());
        assert!(reporter.warnings()[0].message.contains(&told));
    }
}

proptest! {
    #[test]
    fn repair_mends_random_damage(seed in any::<u64>(), turned in prop::collection::vec(any::<prop::sample::Index>(), 0..6), gone in any::<prop::sample::Index>()) {
        let whole = shapes::extrude(&[shapes::random_star(seed, 40, 20.0, 40.0)], 20.0);
        let mut part = whole.clone();
        for i in &turned {
            let t = i.index(part.triangles.len());
            part.triangles[t].swap(0, 2);
        }
        let t = gone.index(part.triangles.len());
        part.triangles.remove(t);
        let options = RepairOptions { hole: 2.0, ..RepairOptions::default() };
        repair(&mut part, &options, &Reporter::new(), &Silent).unwrap();
        let found = examine(&part);
        prop_assert!(found.is_sound(), "{:?}", found.findings);
        prop_assert!((part.volume() / whole.volume() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn any_soup_is_examined_and_repaired_without_panic(
        points in prop::collection::vec(prop::array::uniform3(-3i8..4), 3..30),
        corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..100)
    ) {
        let mut mesh = Mesh {
            vertices: points.iter().map(|p| DVec3::from(p.map(f64::from))).collect(),
            triangles: corners.iter().map(|t| t.map(|i| i.index(points.len()) as u32)).collect(),
        };
        let on = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| examine(&mesh));
        prop_assert_eq!(on(1), on(4));
        mend(&mut mesh);
        let found = examine(&mesh);
        let one_sided = found.count(Defect::OneSided) > 0;
        prop_assert!(one_sided || found.count(Defect::ReversedTriangle) == 0);
        prop_assert_eq!(found.count(Defect::Degenerate) + found.count(Defect::Duplicate), 0);
    }
}

/// Twenty thousand triangles that meet in a point, two hundred million pairs: bounded, and said so. A cap of two thousand is not crowded.
#[test]
fn thousands_of_triangles_in_a_point_are_examined_in_bounded_time() {
    let fan = |count: u32| {
        let mut mesh = Mesh::default();
        for k in 0..count {
            let turn = |by: f64| std::f64::consts::TAU * (f64::from(k) + by) / f64::from(count);
            let (a, b) = (turn(0.0), turn(0.4));
            let first = mesh.vertices.len() as u32;
            // through the origin, each tilted a little more
            let tilt = 5.0 * (7.0 * a).sin();
            mesh.vertices.extend([
                DVec3::new(30.0 * a.cos(), 30.0 * a.sin(), tilt),
                DVec3::new(30.0 * b.cos(), 30.0 * b.sin(), -tilt),
                DVec3::new(-15.0 * a.cos(), -15.0 * a.sin(), 0.0),
            ]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh
    };
    let found = examine(&fan(20_000));
    assert!(found.crowded > 0);
    let count = found.count(Defect::Intersection);
    assert!((1_000..6_000_000 + 2_500 * 512).contains(&count), "{count}");
    let reporter = Reporter::new();
    found.warn(&reporter);
    assert!(reporter.warnings().iter().any(|w| w.code == "mesh-crowded"));
    assert_eq!(examine(&fan(2_000)).crowded, 0);
}
