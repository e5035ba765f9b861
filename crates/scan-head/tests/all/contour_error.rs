//! Contour errors of paths whose error is known.

use std::sync::Arc;

use meltpath_geometry::math::DVec2;
use meltpath_scan_head::head::block::{HeadBlock, HeadSink};
use meltpath_scan_head::head::interpolation::CommandBlock;
use meltpath_scan_head::head::prepared::Prepared;
use meltpath_scan_head::head::vector::{ScanJob, Vector};
use meltpath_scan_head::measures::contour_error::PathErrors;
use meltpath_toolpath::Role;

/// What is measured of spots that hit where they are told, each during one of the vectors along a path.
fn measured(path: &[DVec2], hits: &[DVec2], vectors: &[u32]) -> PathErrors {
    let contour = |p: &DVec2| Vector {
        kind: Role::Contour,
        end: p.extend(0.0),
        speed: 1000.0,
        power: 200.0,
        wait: 0.0,
        block: 0,
    };
    let job = ScanJob {
        start: path[0].extend(0.0),
        vectors: path[1..].iter().map(contour).collect(),
    };
    let n = hits.len();
    let mut errors = PathErrors::new(1.0, 1e-5);
    errors.block(&HeadBlock {
        period: 1e-5,
        command: CommandBlock {
            first: 0,
            position: hits.iter().map(|p| p.extend(0.0)).collect(),
            vector: vectors.to_vec(),
            moving: vec![true; n],
        },
        layers: vec![Arc::new(Prepared::of(job))],
        lit: vec![1.0; n],
        focus: vec![0.0; n],
        hit: hits.to_vec(),
        ..HeadBlock::default()
    });
    errors
}

/// AC-37 (M): two shapes of known error; never more than the tracking error at the same instant.
#[test]
fn lpbf_ac37_contour_error() {
    let errors = |path: &[DVec2], hits: &[DVec2], vectors: &[u32]| {
        let errors = measured(path, hits, vectors);
        assert_eq!(errors.contour.total(), hits.len() as u64);
        [errors.contour.mean(), errors.contour.largest]
    };
    // a line in pieces of 0.05 mm, 0.25 mm late and 0.03 mm aside: far less than the 0.252 mm between points of one instant
    let asked: Vec<_> = (0..400)
        .map(|k| DVec2::new(f64::from(k) * 0.05, 0.0))
        .collect();
    let late = DVec2::new(-0.25, 0.03);
    let done: Vec<_> = asked[10..390].iter().map(|p| *p + late).collect();
    let vectors: Vec<u32> = (4..384).collect();
    for e in errors(&asked, &done, &vectors) {
        assert!((e - 0.03).abs() < 1e-9, "{e}");
    }
    // a circle of 5 mm in 20,000 chords, which sag by 6e-8 mm, marked at 5.02 mm
    let circle = |r: f64, n: u32| -> Vec<DVec2> {
        (0..n)
            .map(|k| DVec2::from_angle(f64::from(k) / f64::from(n) * std::f64::consts::TAU) * r)
            .collect()
    };
    let vectors: Vec<u32> = (0..999).map(|k| 20 * k).collect();
    for e in errors(&circle(5.0, 20_000), &circle(5.02, 1000)[..999], &vectors) {
        assert!((e - 0.02).abs() < 1e-6, "{e}");
    }
}

/// A corner cut by 0.2 mm, the spot standing lit at its end: most points are on the contour, a fifth of the way is not.
#[test]
fn a_spot_that_stands_makes_no_contour_better() {
    let aside = |k: u32| if k < 200 { 0.2 } else { 0.0 };
    let mut hits: Vec<DVec2> = (0..1000)
        .map(|k| DVec2::new(0.01 * f64::from(k), aside(k)))
        .collect();
    hits.extend(vec![DVec2::new(9.99, 0.0); 9000]);
    let path = [DVec2::ZERO, DVec2::new(10.0, 0.0)];
    let errors = measured(&path, &hits, &vec![0; hits.len()]);
    assert!((errors.contour.share_below(0.03) - 0.98).abs() < 1e-9);
    assert!((errors.contour_way.share_below(0.03) - 0.8).abs() < 0.01);
}
