//! The semi-analytic engine against closed forms and against its own full history.
use crate::closed_form::{eagar_tsai, rosenthal};
use crate::raster::raster;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::material::medium::{Body, Medium};
use meltpath_thermal::pool::history::Memory;
use meltpath_thermal::pool::moving_source::MovingSource;
use meltpath_thermal::solver::source::Depth;

fn medium(body: Body) -> Medium {
    // about Ti6Al4V between 750 °C and its liquidus
    Medium {
        conductivity: 0.0275,
        diffusivity: 8.0,
        ambient: 1023.0,
        body,
    }
}

fn beam() -> Beam {
    Beam {
        efficiency: 0.9,
        depth: Depth::Surface,
    }
}

fn path(corners: &[[f64; 2]], speed: f64, spot: f64) -> BeamPath {
    let start = BeamPoint::start(300.0, spot);
    BeamPath::along(corners, speed, start).unwrap()
}

#[test]
fn a_straight_track_is_that_of_eagar_and_tsai() {
    let medium = medium(Body::HalfSpace);
    for memory in [Memory::Full, Memory::Folded] {
        let mut engine = MovingSource::new(
            medium,
            path(&[[0.0, 0.0], [20.0, 0.0]], 980.0, 0.4137),
            beam(),
            memory,
        )
        .unwrap();
        let time = 20.0 / 980.0;
        engine.advance(time).unwrap();
        for place in [
            [0.0, 0.0, 0.0],
            [-0.5, 0.0, 0.0],
            [-1.0, 0.2, 0.05],
            [-3.0, 0.0, 0.2],
            [0.2, 0.1, 0.02],
            [-12.0, 0.5, 0.0],
        ] {
            let exact = eagar_tsai(&medium, [270.0, 0.4137], 980.0, time, place);
            let ours = engine.temperature(DVec3::new(20.0 + place[0], place[1], -place[2]));
            let error = (ours - exact) / (exact - medium.ambient);
            assert!(
                error.abs() < 5e-3,
                "{memory:?} {place:?}: {ours:.1} K, closed form {exact:.1} K"
            );
        }
    }
}

#[test]
fn a_narrow_beam_is_that_of_rosenthal() {
    let medium = medium(Body::HalfSpace);
    let mut engine = MovingSource::new(
        medium,
        path(&[[0.0, 0.0], [60.0, 0.0]], 200.0, 0.02),
        beam(),
        Memory::Folded,
    )
    .unwrap();
    engine.advance(60.0 / 200.0).unwrap();
    for place in [
        [-1.0, 0.0, 0.0],
        [-0.5, 0.2, 0.1],
        [0.0, 0.15, 0.0],
        [-2.0, 0.0, 0.3],
    ] {
        let exact = rosenthal(&medium, 270.0, 200.0, place);
        let ours = engine.temperature(DVec3::new(60.0 + place[0], place[1], -place[2]));
        let error = (ours - exact) / (exact - medium.ambient);
        assert!(
            error.abs() < 1e-2,
            "{place:?}: {ours:.1} K, Rosenthal {exact:.1} K"
        );
    }
}

#[test]
fn a_thin_plate_warms_evenly_by_all_the_heat() {
    // a spot at rest on a plate, long after: the rise integrates to the heat brought
    let medium = medium(Body::Plate { thickness: 0.5 });
    let start = BeamPoint::start(300.0, 0.4);
    let rest = BeamPath::new(vec![
        start,
        BeamPoint {
            time: 0.01,
            ..start
        },
    ])
    .unwrap();
    let mut engine = MovingSource::new(medium, rest, beam(), Memory::Folded).unwrap();
    engine.advance(0.5).unwrap();
    let mut sum = 0.0;
    let edge = 0.5;
    for i in -40..=40 {
        for j in -40..=40 {
            let p = DVec3::new(f64::from(i) * edge, f64::from(j) * edge, -0.3);
            sum += (engine.temperature(p) - medium.ambient) * edge * edge * 0.5;
        }
    }
    let joules = sum * medium.heat_capacity();
    assert!((joules / 2.7 - 1.0).abs() < 1e-3, "{joules}");
}

/// Pool length, width and depth within 2 % of the full-history sum on rasters of 42, 255 and 1,010 mm.
#[test]
fn pools_of_rasters_are_those_of_the_full_history() {
    let medium = medium(Body::HalfSpace);
    let liquidus = 1938.0;
    for (length, line) in [(42.0, 5.0), (255.0, 10.0), (1010.0, 10.0)] {
        let corners = raster(length, line, 0.125);
        let path = path(&corners, 980.0, 0.4137);
        let total = path.end() * 980.0;
        assert!((total / length - 1.0).abs() < 0.06, "{total}");
        let make = |memory| MovingSource::new(medium, path.clone(), beam(), memory).unwrap();
        let (mut folded, mut full) = (make(Memory::Folded), make(Memory::Full));
        let (mut worst, mut worst_kelvin, mut doubt) = (0.0_f64, 0.0_f64, 0.0_f64);
        let samples = 60;
        for n in 1..=samples {
            // not at the same place of every line
            let time = path.end() * (f64::from(n) - 0.37 * f64::from(n % 3)) / f64::from(samples);
            folded.advance(time).unwrap();
            full.advance(time).unwrap();
            let (a, b) = (
                folded.measure(liquidus).unwrap(),
                full.measure(liquidus).unwrap(),
            );
            for (what, a, b) in [
                ("length", a.pool.length, b.pool.length),
                ("width", a.pool.width, b.pool.width),
                ("depth", a.pool.depth, b.pool.depth),
            ] {
                if (a / b - 1.0).abs() > worst {
                    worst = (a / b - 1.0).abs();
                    println!("{n}: {what} {a:.4} {b:.4}");
                }
            }
            let here = path.at(time);
            let behind = DVec3::new(here.x, here.y - 1.0, 0.0);
            let error = (folded.temperature(behind) - full.temperature(behind)).abs();
            let bound = folded.doubt();
            assert!(error <= bound, "{error} K, bound {bound} K");
            worst_kelvin = worst_kelvin.max(error);
            doubt = doubt.max(bound);
        }
        println!(
            "{total:.0} mm: pool within {:.2} %, temperature within {worst_kelvin:.2} K (bound {doubt:.0} K), {} lumps of {}",
            100.0 * worst,
            folded.lumps(),
            full.lumps()
        );
        assert!(worst < 0.02, "{worst}");
    }
}
