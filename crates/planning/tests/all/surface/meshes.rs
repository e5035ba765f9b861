//! Fronts on meshes: caps, holes, leaves beside each other, bases, and what is refused.

use super::*;
use meltpath_geometry::sheet::SheetError;
use meltpath_planning::surface::{Base, MeshPasses, SurfaceError, plan_mesh};
use proptest::prelude::*;

const FLOOR: Base = Base::Plane {
    origin: DVec3::ZERO,
    normal: DVec3::Z,
};

fn fronts(mesh: &Mesh) -> MeshPasses {
    plan_mesh(mesh, &FLOOR, &settings(SurfaceStrategy::Distance)).unwrap()
}

fn refused(mesh: &Mesh, base: &Base, spacing: f64) -> SurfaceError {
    let settings = SurfaceSettings {
        spacing,
        ..settings(SurfaceStrategy::Distance)
    };
    let error = plan_mesh(mesh, base, &settings).unwrap_err();
    // what, where, and what to do
    assert!(error.to_string().contains([':', ';']), "{error}");
    error
}

fn sphere(radius: f64, rows: u32, columns: u32) -> Mesh {
    // just short of the poles, which close themselves by welding below
    let mut mesh = shapes::tube(rows, columns, |s, t| {
        let (lat, lon) = ((s - 0.5) * TAU / 2.0, t * TAU);
        radius * DVec3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin())
    });
    let last = rows * columns;
    for v in mesh.triangles.iter_mut().flatten() {
        if *v < columns {
            *v = 0;
        } else if *v >= last {
            *v = last;
        }
    }
    mesh
}

#[test]
fn fronts_on_a_dome_close_at_its_cap() {
    let radius = 40.0;
    let found = fronts(&sphere(radius, 180, 360));
    // each front is a circle, the same chord higher
    let step = 2.0 * (STEP / 2.0 / radius).asin();
    assert_eq!(found.passes.len(), (FRAC_PI_2 / step) as usize);
    for pass in &found.passes {
        assert!(pass.is_closed());
        let latitude = f64::from(pass.number) * step;
        for p in &pass.points {
            assert!(
                (p.position.z - radius * latitude.sin()).abs() < 0.02,
                "{}",
                p.position
            );
            assert!(p.normal.dot(p.position) > 0.999 * radius);
            assert!(p.growth.z > 0.0 && p.growth.dot(p.normal).abs() < 1e-9);
        }
    }
    // the last one is told, with what is left over it
    assert_eq!(found.ends.len(), 1);
    let end = found.ends[0];
    assert_eq!(end.front as usize, found.passes.len());
    let left = 2.0 * radius * (0.5 * (FRAC_PI_2 - f64::from(end.front) * step)).sin();
    assert!((end.left - left).abs() < 0.02 && end.left < STEP, "{end:?}");
    assert_eq!(found.unreached, 0.0);
}

#[test]
fn fronts_split_around_a_window_and_merge_over_it() {
    // 60 mm wide, 50 high, with a window from 20 to 40 mm and from 15 to 30 mm high
    let window = |i: u32, k: u32| (15..30).contains(&i) && (20..40).contains(&k);
    let wall = shapes::sheet(50, 60, window, |z, x| DVec3::new(x, 0.0, z));
    let found = fronts(&wall);
    let count = |n: u32| numbered(&found.passes, n).len();
    assert_eq!([1, 2, 3].map(count), [1, 1, 1].map(|x: usize| x));
    assert_eq!([4, 5].map(count), [2, 2]);
    assert_eq!(count(9), 1);
    for number in 1..=3 {
        for pass in numbered(&found.passes, number) {
            assert!(
                pass.points
                    .iter()
                    .all(|p| (p.position.z - STEP * f64::from(number)).abs() < 1e-6)
            );
        }
    }
    let far = |p: &SurfacePass| {
        let before = numbered(&found.passes, p.number - 1);
        let near = |q: DVec3| {
            before
                .iter()
                .map(|b| distance(q, b))
                .fold(f64::INFINITY, f64::min)
        };
        p.points
            .iter()
            .map(|q| (near(q.position) - STEP).abs())
            .fold(0.0, f64::max)
    };
    let later = found.passes.iter().filter(|p| p.number > 1);
    assert!(later.map(far).fold(0.0, f64::max) < 2e-3);
    assert_eq!(found.unreached, 0.0);
}

/// A wall that turns over and comes down 2 mm beside itself: nearer than the spacing, and yet no front jumps over.
#[test]
fn fronts_do_not_jump_to_a_leaf_beside() {
    let ways = [(0.0, 0.0), (0.0, 30.0), (2.0, 30.0), (2.0, 10.0)];
    let wall = shapes::sheet(
        3,
        40,
        |_, _| false,
        |i, x| {
            let (y, z) = ways[i as usize];
            DVec3::new(x, y, z)
        },
    );
    let found = fronts(&wall);
    let last = found.passes.last().unwrap();
    // 6 up, then down: the way over the top is shorter through space than along the surface
    assert!((9..=10).contains(&last.number), "{}", last.number);
    assert!(
        last.points
            .iter()
            .all(|p| p.position.y == 2.0 && p.position.z < 20.0)
    );
}

#[test]
fn a_flange_grows_from_a_cylinder() {
    let disc = shapes::tube(20, 360, |s, t| {
        let r = 10.0 + 20.5 * s;
        DVec3::new(r * (t * TAU).cos(), r * (t * TAU).sin(), 7.0)
    });
    let base = Base::Cylinder {
        origin: DVec3::ZERO,
        axis: 3.0 * DVec3::Z,
        radius: 10.0,
    };
    let found = plan_mesh(&disc, &base, &settings(SurfaceStrategy::Distance)).unwrap();
    assert_eq!(found.passes.len(), 4);
    for pass in &found.passes {
        assert!(pass.is_closed());
        let radius = 10.0 + STEP * f64::from(pass.number);
        for p in &pass.points {
            assert!((p.position.truncate().length() - radius).abs() < 0.01);
        }
    }
}

#[test]
fn large_triangles_make_the_same_fronts_as_small_ones() {
    let of = |rows, columns| {
        let wall = shapes::sheet(
            rows,
            columns,
            |_, _| false,
            |i, k| {
                DVec3::new(
                    80.0 * k / f64::from(columns),
                    0.0,
                    42.0 * i / f64::from(rows),
                )
            },
        );
        fronts(&wall).passes
    };
    let (coarse, fine) = (of(1, 1), of(42, 80));
    assert_eq!((coarse.len(), fine.len()), (8, 8));
    for pass in coarse.iter().chain(&fine) {
        assert!((pass.length() - 80.0).abs() < 1e-6);
        // a straight line has two ends and nothing between
        assert_eq!(pass.points.len(), 2);
    }
}

#[test]
fn what_is_no_wall_on_a_base_is_refused_with_its_place() {
    let wall = shapes::sheet(
        4,
        4,
        |_, _| false,
        |i, k| DVec3::new(10.0 * k, 0.0, 10.0 * i),
    );
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            refused(&wall, &FLOOR, spacing),
            SurfaceError::Setting { .. }
        ));
    }
    let SurfaceError::TooSmall { reach, .. } = refused(&wall, &FLOOR, 100.0) else {
        panic!()
    };
    assert_eq!(reach, 40.0);
    let below = |z: f64, normal: DVec3| Base::Plane {
        origin: DVec3::new(0.0, 0.0, z),
        normal,
    };
    assert!(matches!(
        refused(&wall, &below(-3.0, DVec3::Z), STEP),
        SurfaceError::Sheet(SheetError::NoBase { gap: 3.0, .. })
    ));
    assert!(matches!(
        refused(&wall, &below(50.0, DVec3::Z), STEP),
        SurfaceError::Sheet(SheetError::Behind { depth: 50.0, .. })
    ));
    assert!(matches!(
        refused(&wall, &below(0.0, DVec3::ZERO), STEP),
        SurfaceError::Setting { .. }
    ));
    let sheet = |mesh: &Mesh| match refused(mesh, &FLOOR, STEP) {
        SurfaceError::Sheet(error) => error,
        other => panic!("{other}"),
    };
    let mut third = wall.clone();
    third.vertices.push(DVec3::new(5.0, 20.0, 5.0));
    let [a, b, _] = third.triangles[10];
    third.triangles.push([b, a, 25]);
    assert!(matches!(
        sheet(&third),
        SheetError::Branch { triangles: 3, .. }
    ));
    let mut turned = wall.clone();
    turned.triangles[7].swap(0, 1);
    assert!(matches!(sheet(&turned), SheetError::Turned { .. }));
    let mut lost = wall.clone();
    lost.triangles[3][1] = 99;
    assert_eq!(sheet(&lost), SheetError::Vertex { vertex: 99 });
    lost.triangles[3][1] = 4;
    lost.vertices[4].x = f64::NAN;
    assert_eq!(sheet(&lost), SheetError::Vertex { vertex: 4 });
    assert_eq!(sheet(&Mesh::default()), SheetError::Empty);
    assert!(matches!(
        refused(&wall, &FLOOR, 1e-4),
        SurfaceError::Sheet(SheetError::TooFine { .. })
    ));
    let none = settings(SurfaceStrategy::Parameter);
    assert_eq!(
        plan_mesh(&wall, &FLOOR, &none),
        Err(SurfaceError::NoParameter)
    );
}

/// A piece that floats over the base is told, not built.
#[test]
fn a_piece_that_no_front_reaches_is_told() {
    let gap = |i: u32, _: u32| i == 2;
    let wall = shapes::sheet(4, 4, gap, |i, k| DVec3::new(10.0 * k, 0.0, 10.0 * i));
    let found = fronts(&wall);
    assert!((found.unreached - 400.0).abs() < 1e-9);
    assert!(
        found
            .passes
            .iter()
            .flat_map(|p| &p.points)
            .all(|p| p.position.z < 20.0 + 1e-9)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Tubes of any shape: every pass keeps its distance, and growth is along the surface.
    #[test]
    fn passes_keep_their_distance_on_bent_and_bulging_tubes(
        radius in 8.0..25.0, bulge in -0.3..0.3, waves in 0.0..0.2, lobes in 1..5_u32, bend in -0.4..0.4,
        spacing in 1.5..6.0,
    ) {
        let mesh = shapes::tube(40, 90, |s, t| {
            let angle = t * TAU;
            let r = radius
                * (1.0 + bulge * (3.0 * s).sin() + waves * s * (f64::from(lobes) * angle).cos());
            DVec3::new(r * angle.cos() + 50.0 * bend * s * s, r * angle.sin(), 50.0 * s)
        });
        let settings = SurfaceSettings { spacing, ..settings(SurfaceStrategy::Distance) };
        let found = plan_mesh(&mesh, &FLOOR, &settings).unwrap();
        prop_assert_eq!(found.unreached, 0.0);
        prop_assert!(found.passes.last().unwrap().number >= (45.0 / spacing) as u32);
        for pass in &found.passes {
            prop_assert!(pass.points.len() > 1);
            for p in &pass.points {
                prop_assert!((p.spacing().unwrap() - spacing).abs() < 1e-6);
                prop_assert!(p.normal.is_normalized() && p.growth.is_normalized());
            }
            for pair in pass.points.windows(2).filter(|_| pass.number > 1) {
                let middle = pair[0].position.midpoint(pair[1].position);
                let before = numbered(&found.passes, pass.number - 1);
                let near = before.iter().map(|b| distance(middle, b));
                // the facets of this mesh lie within 0.2 mm of its tube
                prop_assert!((near.fold(f64::INFINITY, f64::min) - spacing).abs() < 0.05);
            }
        }
    }

    /// Anything at all is planned or refused.
    #[test]
    fn no_mesh_makes_it_stumble(
        corners in proptest::collection::vec((0..4_i32, 0..4_i32, 0..4_i32), 3..20),
        triangles in proptest::collection::vec([0..20_u32, 0..20, 0..20], 0..14),
        spacing in 0.05..3.0,
    ) {
        let mesh = Mesh {
            vertices: corners.iter().map(|&(x, y, z)| DVec3::new(x.into(), y.into(), z.into())).collect(),
            triangles,
        };
        for strategy in [SurfaceStrategy::Distance, PLANES] {
            let settings = SurfaceSettings { strategy, spacing, chord_error: 0.01 };
            if let Ok(found) = plan_mesh(&mesh, &FLOOR, &settings) {
                for pass in &found.passes {
                    prop_assert!(pass.points.iter().all(|p| p.position.is_finite()));
                }
            }
        }
    }
}

/// Planes begin at their base as fronts do: a wall that hangs above it has nothing to stand on.
#[test]
fn planes_over_a_gap_are_refused() {
    let planes = settings(SurfaceStrategy::Planes {
        direction: DVec3::Z,
    });
    let base = |z: f64| Base::Plane {
        origin: DVec3::new(0.0, 0.0, z),
        normal: DVec3::Z,
    };
    let tube = shapes::tube(20, 60, |s, t| {
        let turned = DVec3::new((t * TAU).cos(), (t * TAU).sin(), 0.0);
        20.0 * turned + 30.0 * s * DVec3::Z
    });
    let plan = |z: f64| plan_mesh(&tube, &base(z), &planes);
    assert!(plan(0.0).is_ok());
    let SurfaceError::Sheet(SheetError::NoBase { gap, .. }) = plan(-3.0).unwrap_err() else {
        panic!("laid over a gap of 3 mm");
    };
    assert!((gap - 3.0).abs() < 1e-9, "{gap}");
}

/// A plane crosses every edge of a fine mesh: what says nothing of the course is left out, as of passes at one distance.
#[test]
fn planes_leave_no_more_points_than_the_course_asks_for() {
    let radius = 20.0;
    let mesh = shapes::tube(24, 720, |s, t| {
        let (sine, cosine) = (t * TAU).sin_cos();
        DVec3::new(radius * cosine, radius * sine, 20.0 * s)
    });
    let settings = SurfaceSettings {
        chord_error: 0.02,
        ..settings(PLANES)
    };
    let planned = plan_mesh(&mesh, &FLOOR, &settings).unwrap();
    let chords = TAU / (2.0 * (1.0 - 0.01 / radius).acos());
    assert!(planned.passes.len() > 2);
    for pass in &planned.passes {
        let count = pass.points.len() as f64;
        assert!(count > chords && count < 3.0 * chords, "{count} {chords}");
        let off = |p: DVec3| (p.truncate().length() - radius).abs();
        assert!(pass.points.iter().all(|p| off(p.position) < 0.01));
    }
}
