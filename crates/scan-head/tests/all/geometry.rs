//! Geometry, correction tables, focus.

use crate::rays::rays_of;
use meltpath_geometry::math::{DMat2, DVec2};
use meltpath_numerics::random::Random;
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::prepared::alone;
use meltpath_scan_head::optics::correction::{CorrectionError, CorrectionTable};
use meltpath_scan_head::optics::focus::{Focus, FocusProjection};
use meltpath_scan_head::optics::geometry::{
    FTheta, Geometry, GeometryError, PathSign, ThreeAxis, TwoAxis,
};

use super::reference::{job_of, one, recipes, three_axis, three_axis_data, two_axis};

fn deg(x: f64, y: f64) -> DVec2 {
    DVec2::new(x.to_radians(), y.to_radians())
}

fn head() -> ThreeAxis {
    match three_axis().geometry {
        Geometry::ThreeAxis(h) => h,
        _ => panic!("three axes"),
    }
}

fn focus(projection: FocusProjection) -> Focus {
    let head = three_axis();
    let mut lenses = head.focus.unwrap().1;
    lenses.projection = projection;
    Focus::new(lenses, head.geometry).unwrap()
}

/// AC-22 (M): the two-axis inverse is exact on ±20°; one value.
#[test]
fn lpbf_ac22_two_axis_inverse_is_exact() {
    let g = two_axis().geometry;
    for i in -20..=20 {
        for j in -20..=20 {
            let angles = deg(f64::from(i), f64::from(j));
            let back = g.inverse(g.direct(angles)).unwrap();
            assert!((back - angles).length() < 1e-12, "{angles}: {back}");
        }
    }
    let p = g.direct(deg(20.0, 20.0));
    assert!(
        (p.x - 330.605).abs() < 1e-3 && (p.y - 240.402).abs() < 1e-3,
        "{p}"
    );
    assert!((g.path(deg(20.0, 20.0)) - 514.329).abs() < 1e-3);
}

/// The derivatives of the simple model are those of its points, off both axes too.
#[test]
fn the_two_axis_jacobian_is_that_of_differences() {
    let g = two_axis().geometry;
    let step = 1e-6;
    for angles in [deg(0.0, 0.0), deg(7.0, -4.0), deg(-15.0, 12.0)] {
        let slope = |d: DVec2| (g.direct(angles + d) - g.direct(angles - d)) / (2.0 * step);
        let jacobian = g.jacobian(angles);
        for (column, d) in [(jacobian.x_axis, DVec2::X), (jacobian.y_axis, DVec2::Y)] {
            let off = (column - slope(d * step)).length();
            assert!(off < 1e-5, "{off} mm/rad of {column} at {angles}");
        }
    }
}

/// AC-23 (M/R): the closed form is the ray tracer on 500 random heads; the reference head's table (docs/theory/sources.md); Newton in at most 6 steps.
#[test]
fn lpbf_ac23_three_axis_closed_form_is_the_ray_tracer() {
    let mut random = Random::new(9);
    let (mut worst, mut worst_path) = (0.0f64, 0.0f64);
    for _ in 0..500 {
        let mut r = |low, high| random.between(low, high);
        let tilt = (-90.0 + r(-10.0, 10.0)).to_radians();
        let h = ThreeAxis {
            plane: [r(-10.0, 10.0), r(-10.0, 40.0), r(-700.0, -300.0)],
            x_axis: [r(-5.0, 5.0), r(-5.0, 5.0)],
            // the closed form is that of beams that leave X along the line of mirrors and Y downwards
            x_rest: 45f64.to_radians(),
            x_tilt: tilt,
            y_axis: [r(20.0, 40.0), r(-5.0, 5.0)],
            y_rest: 0.5 * tilt + std::f64::consts::PI,
            mirror_offset: r(0.0, 6.0),
            window: r(0.0, 8.0),
            atmosphere_index: 1.0,
            window_index: r(1.3, 1.8),
            objective: -60.0,
            path_sign: PathSign::Traced,
        };
        let angles = deg(r(-8.0, 8.0), r(-8.0, 8.0));
        let g = Geometry::ThreeAxis(h);
        let trace = rays_of(&h).trace(angles).unwrap();
        worst = worst.max((trace.hit - g.direct(angles)).length());
        worst_path = worst_path.max((trace.length - g.path(angles)).abs());
        let step = 1e-6;
        let slope = |d: DVec2| (g.direct(angles + d) - g.direct(angles - d)) / (2.0 * step);
        let differences = DMat2::from_cols(slope(DVec2::X * step), slope(DVec2::Y * step));
        let jacobian = g.jacobian(angles);
        let off = (jacobian - differences)
            .to_cols_array()
            .into_iter()
            .fold(0.0f64, |a, b| a.max(b.abs()));
        assert!(off < 1e-3, "{off} mm/rad of {jacobian}");
    }
    println!("closed form against ray tracer: {worst:.2e} mm, path {worst_path:.2e} mm");
    assert!(worst < 1e-9 && worst_path < 1e-9, "{worst} {worst_path}");

    let h = head();
    let g = Geometry::ThreeAxis(h);
    for (x, y, px, py, path) in [
        (0.0, 0.0, 0.0, 0.0, 631.5147),
        (1.0, 0.0, 20.314, 0.0, 631.7938),
        (0.0, 1.0, 0.0, 19.4146, 631.7781),
        (10.0, 0.0, 211.4835, 0.0, 667.9089),
        (0.0, 10.0, 0.0, 202.1086, 666.2558),
        (-10.0, -10.0, -225.0823, -202.4652, 708.0980),
    ] {
        let p = g.direct(deg(x, y));
        assert!((p - DVec2::new(px, py)).length() < 1e-3, "({x}, {y}): {p}");
        assert!(
            (g.path(deg(x, y)) - path).abs() < 1e-3,
            "({x}, {y}): {}",
            g.path(deg(x, y))
        );
        assert!((rays_of(&h).trace(deg(x, y)).unwrap().length - g.path(deg(x, y))).abs() < 1e-9);
    }
    for (x, y, ax, ay) in [
        (175.0, 175.0, 8.037_044, 8.745_817),
        (175.0, 0.0, 8.378_699, 0.0),
        (0.0, 175.0, 0.0, 8.744_503),
        (-175.0, 175.0, -8.025_805, 8.745_813),
    ] {
        let a = g.inverse(DVec2::new(x, y)).unwrap();
        assert!((a - deg(ax, ay)).length() < 1e-7, "({x}, {y}): {a}");
    }
    let mut most = 0;
    for i in -35..=35 {
        for j in -35..=35 {
            let (_, steps) = g
                .inverse_counted(DVec2::new(f64::from(i), f64::from(j)) * 5.0)
                .unwrap();
            most = most.max(steps);
        }
    }
    println!("Newton steps: {most}");
    assert!(most <= 6, "{most}");
}

/// Erratum 5: the printed sign of K1 tan 2θx takes the path between the mirrors away; it stays reachable.
#[test]
fn erratum_5_the_printed_sign_is_an_option() {
    let mut h = head();
    let traced = Geometry::ThreeAxis(h).direct(deg(3.0, 0.0)).x;
    h.path_sign = PathSign::Printed;
    let printed = Geometry::ThreeAxis(h).direct(deg(3.0, 0.0)).x;
    // 2 K1 tan 2θx with K1 = |from the origin to mirror Y along d|
    let k1 = (3.0 + 30.0 * -(135f64.to_radians().sin())) / (225f64.to_radians().cos());
    assert!(
        (traced - printed - 2.0 * k1 * 6f64.to_radians().tan()).abs() < 1e-9,
        "{k1}"
    );
}

/// AC-24 (T/R): the 65 × 65 table is within 6 µm (+10 %) everywhere.
#[test]
fn lpbf_ac24_table_of_65_points() {
    let head = three_axis();
    let travel = DVec2::splat(10f64.to_radians());
    let table = CorrectionTable::new(&head.geometry, None, 175.0, 65, travel).unwrap();
    let errors = table.errors(&head.geometry, 8);
    println!(
        "table: largest {:.3} µm at {}, mean {:.3} µm",
        errors.largest * 1e3,
        errors.at,
        errors.mean * 1e3
    );
    assert!(errors.largest < 6.6e-3, "{errors:?}");
    assert!((errors.mean - 2.5e-3).abs() < 0.5e-3, "{errors:?}");
    assert!(errors.largest < 0.030);
}

/// AC-25 (T): bowl without correction, flat with it, inverses of each other, numbers of the reference head.
#[test]
fn lpbf_ac25_dynamic_focus() {
    let g = three_axis().geometry;
    for projection in [FocusProjection::Exact, FocusProjection::Thesis] {
        let f = focus(projection);
        let at_rest = |angles| f.direct(angles, f.lenses().rest_angle);
        let spacing = f.lenses().spacing(g.path(g.inverse(DVec2::ZERO).unwrap()));
        assert!((spacing - 85.93959).abs() < 1e-4, "{spacing}");
        assert!(at_rest(DVec2::ZERO).abs() < 1e-9);
        let (mut last, mut left) = ([0.0; 2], 0.0);
        for k in 1..=20 {
            let t = 0.5 * f64::from(k);
            let z = [at_rest(deg(t, 0.0)), at_rest(deg(0.0, t))];
            assert!(z[0] > last[0] && z[1] > last[1], "{t}: {z:?}");
            // the mirror's offset makes the two sides differ, but both rise
            let other = at_rest(deg(-t, 0.0));
            assert!(other > left, "{t}: {other}");
            left = other;
            last = z;
        }
        if projection == FocusProjection::Exact {
            assert!(
                (last[0] - 34.2).abs() < 0.05 && (last[1] - 32.6).abs() < 0.05,
                "{last:?}"
            );
        }
        for (x, y) in [(0.0, 0.0), (175.0, 0.0), (-175.0, 175.0), (60.0, -120.0)] {
            let angles = g.inverse(DVec2::new(x, y)).unwrap();
            for z in [0.0, -2.0, 5.0] {
                let cam = f.inverse(angles, z);
                assert!(
                    (f.direct(angles, cam) - z).abs() < 1e-9,
                    "{projection:?} ({x}, {y}, {z})"
                );
            }
        }
        for spacing in [70.0, 85.0, 90.0] {
            let l = f.lenses();
            assert!((l.spacing(l.focus_distance(spacing)) - spacing).abs() < 1e-9);
        }
        let angles = g.inverse(DVec2::new(175.0, 0.0)).unwrap();
        let path = g.path(angles);
        assert!((path - 656.5623).abs() < 1e-4, "{path}");
        assert!((f.lenses().spacing(path) - 84.98868).abs() < 1e-4);
        assert!((f.inverse(angles, 0.0).to_degrees() + 2.72416).abs() < 1e-4);
        let slope = -(105.0f64 / (631.5147 - 105.0)).powi(2);
        assert!((slope + 0.03977).abs() < 1e-5);
    }
}

#[test]
fn what_cannot_be_reached_is_named() {
    let g = Geometry::ThreeAxis(head());
    let travel = DVec2::splat(10f64.to_radians());
    let error = g
        .inverse_within(DVec2::new(250.0, 0.0), travel)
        .unwrap_err();
    assert!(
        matches!(error, GeometryError::Travel { axis: 'X', .. }),
        "{error}"
    );
    let mut flat = head();
    flat.y_rest = flat.x_tilt + std::f64::consts::FRAC_PI_2;
    assert!(matches!(
        Geometry::ThreeAxis(flat).check(),
        Err(GeometryError::Parameter { .. })
    ));
    // axes of both mirrors parallel: they steer in one direction
    let mut rays = rays_of(&head());
    rays.mirrors[1].axis = rays.mirrors[0].axis;
    rays.mirrors[1].normal = -rays.mirrors[0].normal;
    let error = rays.inverse(DVec2::new(5.0, 5.0)).unwrap_err();
    assert!(
        matches!(
            error,
            GeometryError::Singular { .. } | GeometryError::OutOfReach { .. }
        ),
        "{error}"
    );
    let table = CorrectionTable::new(&g, None, 260.0, 65, travel);
    assert!(matches!(
        table,
        Err(CorrectionError::Geometry(GeometryError::Travel { .. }))
    ));
}

/// A cam that does not travel as far as the field asks: the point that asks most is named, in a table and without one.
#[test]
fn a_focus_beyond_its_travel_is_named_with_its_place() {
    let mut shifted = head();
    // the beam lands off the middle of the field: one corner is farther than the others
    shifted.plane[1] = -20.0;
    let g = Geometry::ThreeAxis(shifted);
    let focus = Focus::new(three_axis().focus.unwrap().1, g).unwrap();
    let travel = DVec2::splat(20f64.to_radians());
    let table = CorrectionTable::new(&g, Some(&focus), 160.0, 3, travel).unwrap();
    let asked = |x: f64, y: f64| focus.inverse(g.inverse(DVec2::new(x, y)).unwrap(), 0.0);
    let (most, place) = [-160.0, 0.0, 160.0]
        .iter()
        .flat_map(|&x| [-160.0, 0.0, 160.0].map(|y| (asked(x, y).abs(), [x, y])))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap();
    assert!(table.require_cam(1.001 * most).is_ok());
    let Err(GeometryError::Travel {
        axis: 'Z',
        x,
        y,
        angle_deg,
        travel_deg,
    }) = table.require_cam(0.999 * most)
    else {
        panic!("the cam does not travel that far")
    };
    assert!(
        (DVec2::new(x, y) - DVec2::from(place)).length() < 1e-9,
        "{x} {y}"
    );
    assert!((angle_deg.abs() - most.to_degrees()).abs() < 1e-9);
    assert!((travel_deg - 0.999 * most.to_degrees()).abs() < 1e-9);

    // (175, 0) needs −2.724° of the cam (AC-25), the middle none
    let mut data = three_axis_data();
    data.head.table = None;
    data.head
        .focus
        .as_mut()
        .unwrap()
        .0
        .driven_mut()
        .unwrap()
        .travel = 2.5f64.to_radians();
    let ready = data.head.ready().unwrap();
    let mut job = job_of(&one(data.plate), &recipes()[0]);
    assert!(ready.survey(alone(&job)).is_ok());
    job.vectors[1].end = job.vectors[1].end.with_x(175.0).with_y(0.0);
    let refused = ready.survey(alone(&job)).unwrap_err();
    let HeadError::Field {
        index: 1,
        source:
            CorrectionError::Geometry(GeometryError::Travel {
                axis: 'Z',
                x,
                y,
                angle_deg,
                ..
            }),
    } = refused
    else {
        panic!("{refused}")
    };
    assert_eq!((x, y), (175.0, 0.0));
    assert!((angle_deg + 2.72416).abs() < 1e-4, "{angle_deg}");
}

/// Dimensions that no head has are refused by name, each alone; those of the reference heads are not.
#[test]
fn dimensions_that_no_head_has_are_refused() {
    let refused = |g: Geometry, named: &str| {
        let Err(GeometryError::Parameter { what, .. }) = g.check() else {
            panic!("{named} of {g:?}")
        };
        assert!(what.contains(named), "{what} is not {named}");
    };
    for g in [two_axis().geometry, Geometry::ThreeAxis(head())] {
        assert_eq!(g.check(), Ok(()));
    }
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    assert_eq!(
        Geometry::FTheta(FTheta { focal_length: 1e-3 }).check(),
        Ok(())
    );
    for focal_length in [0.0, -100.0, inf, nan] {
        refused(Geometry::FTheta(FTheta { focal_length }), "focal length");
    }
    let simple = TwoAxis {
        plane_distance: 300.0,
        mirror_distance: 0.0,
    };
    assert_eq!(Geometry::TwoAxis(simple).check(), Ok(()));
    for plane_distance in [0.0, -1.0, inf, nan] {
        let wrong = TwoAxis {
            plane_distance,
            ..simple
        };
        refused(Geometry::TwoAxis(wrong), "plane distance");
    }
    for mirror_distance in [-0.1, inf, nan] {
        let wrong = TwoAxis {
            mirror_distance,
            ..simple
        };
        refused(Geometry::TwoAxis(wrong), "mirror distance");
    }
    let wrong = |named: &str, change: &dyn Fn(&mut ThreeAxis, f64), values: &[f64]| {
        for value in values {
            let mut h = head();
            change(&mut h, *value);
            refused(Geometry::ThreeAxis(h), named);
        }
    };
    wrong(
        "plane height",
        &|h, v| h.plane[2] = v,
        &[0.0, 600.0, -inf, nan],
    );
    wrong("window thickness", &|h, v| h.window = v, &[-0.1, inf, nan]);
    wrong(
        "atmosphere",
        &|h, v| h.atmosphere_index = v,
        &[0.99, 5.0, nan],
    );
    wrong("windows", &|h, v| h.window_index = v, &[0.99, 5.0, nan]);
    wrong("dimension", &|h, v| h.objective = v, &[inf, nan]);
    wrong("dimension", &|h, v| h.mirror_offset = v, &[inf, nan]);
    wrong("dimension", &|h, v| h.x_axis[1] = v, &[inf, nan]);
    wrong(
        "A_ax0",
        &|h, v| h.x_rest = v,
        &[0.0, 5e-4, std::f64::consts::PI],
    );
    let right = std::f64::consts::FRAC_PI_2;
    wrong(
        "B_ax0",
        &|h, v| h.y_rest = h.x_tilt + v,
        &[right, right + 5e-4, -right],
    );
}
