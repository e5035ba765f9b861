//! Contour errors of paths whose error is known.

use std::sync::Arc;

use meltpath_geometry::math::DVec2;
use meltpath_scan_head::head::block::{HeadBlock, HeadSink};
use meltpath_scan_head::head::interpolation::CommandBlock;
use meltpath_scan_head::head::prepared::Prepared;
use meltpath_scan_head::head::vector::{ScanJob, Vector};
use meltpath_scan_head::measures::contour_error::PathErrors;
use meltpath_scan_head::measures::dark_way::LightReach;
use meltpath_toolpath::Role;

/// What is measured of spots that hit where they are told, each during one of the vectors along a path.
fn measured(
    path: &[DVec2],
    hits: &[DVec2],
    vectors: &[u32],
    lit: impl Fn(usize) -> bool,
) -> PathErrors {
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
    let mut errors = PathErrors::new(1.0, 1e-5, LightReach::of(0.065, 0.03));
    errors.block(&HeadBlock {
        period: 1e-5,
        command: CommandBlock {
            first: 0,
            position: hits.iter().map(|p| p.extend(0.0)).collect(),
            vector: vectors.to_vec(),
            moving: vec![true; n],
        },
        layers: vec![Arc::new(Prepared::of(job))],
        lit: (0..n).map(|k| f64::from(u8::from(lit(k)))).collect(),
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
        let errors = measured(path, hits, vectors, |_| true);
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
    let errors = measured(&path, &hits, &vec![0; hits.len()], |_| true);
    assert!((errors.contour.share_below(0.03) - 0.98).abs() < 1e-9);
    assert!((errors.contour_way.share_below(0.03) - 0.8).abs() < 0.01);
}

/// Two contours in a row of which the spot passes over all but 2 mm round their common end: the stretch is one, as long as what no
/// light reaches, and counts as not within.
#[test]
fn what_no_light_reaches_is_dark() {
    let path = [DVec2::ZERO, DVec2::X * 10.0, DVec2::new(10.0, 10.0)];
    let hit = |k: u32| match f64::from(k) * 0.01 {
        at if at <= 10.0 => DVec2::X * at,
        at => DVec2::new(10.0, at - 10.0),
    };
    let samples: Vec<u32> = (0..=2000).collect();
    let hits: Vec<DVec2> = samples.iter().map(|k| hit(*k)).collect();
    let vectors: Vec<u32> = samples.iter().map(|k| u32::from(*k > 1000)).collect();
    let whole = measured(&path, &hits, &vectors, |_| true);
    assert!(whole.dark().length < 1e-6, "{:?}", whole.dark());
    let lit = |k: usize| !(900..1100).contains(&k);
    let errors = measured(&path, &hits, &vectors, lit);
    let dark = errors.dark();
    assert!((dark.commanded - 20.0).abs() < 1e-9);
    // a reach of 0.065 mm at either end, and a sample
    assert!(
        (dark.longest.length - (2.0 - 0.13)).abs() < 0.02,
        "{dark:?}"
    );
    assert!((dark.length - dark.longest.length).abs() < 1e-6);
    assert!(dark.longest.from.distance(DVec2::new(9.055, 0.0)) < 0.02);
    let share = errors.contour_share(0.03, None);
    assert!((share - (1.0 - dark.length / 20.0)).abs() < 2e-3, "{share}");
}

/// A corner that the lit spot cuts by 0.1 mm is beside its mark, not dark; a tip of 2 mm that it leaves out is.
#[test]
fn a_corner_that_is_cut_is_not_dark() {
    for (sides, dark) in [
        ([DVec2::X * 5.0, DVec2::new(5.0, 5.0)], 0.0),
        ([DVec2::X * 5.0, DVec2::new(0.0, 0.2)], 4.0),
    ] {
        let (corner, end) = (sides[0], sides[1]);
        let cut = if dark > 0.0 { 2.0 } else { 0.1 };
        let leave = corner - DVec2::X * cut;
        let enter = corner + (end - corner).normalize() * cut;
        let path = [DVec2::ZERO, corner, end];
        let way = [DVec2::ZERO, leave, enter, end];
        let mut hits = Vec::new();
        for ends in way.windows(2) {
            let count = (ends[0].distance(ends[1]) / 0.01).ceil() as usize;
            hits.extend((0..count).map(|k| ends[0].lerp(ends[1], k as f64 / count as f64)));
        }
        let mut vectors = vec![1; hits.len()];
        vectors[..250].fill(0);
        let found = measured(&path, &hits, &vectors, |_| true).dark();
        let off = (found.length - dark).abs();
        assert!(off < 0.3, "{found:?} {dark}");
        assert!(dark > 0.0 || found.length < 1e-6, "{found:?}");
    }
}

/// A jump back over the line that was just marked lies on it, and draws nothing.
#[test]
fn light_on_a_jump_back_over_the_line_is_stray() {
    let path = [DVec2::ZERO, DVec2::X * 3.0];
    // a line at 1000 mm/s, back over it at 4000 mm/s, a rest, and the line again
    let along = (0..=300).map(|k| 0.01 * f64::from(k));
    let back = (0..=75).map(|k| 3.0 - 0.04 * f64::from(k));
    let rest = std::iter::repeat_n(0.0, 50);
    let whole: Vec<f64> = along.clone().chain(back).chain(rest).chain(along).collect();
    let hits: Vec<DVec2> = whole.into_iter().map(|x| DVec2::new(x, 0.0)).collect();
    let vectors = vec![0; hits.len()];
    let errors = measured(&path, &hits, &vectors, |_| true);
    assert!(
        (errors.stray.longest.length - 3.0).abs() < 1e-9,
        "{:?}",
        errors.stray
    );
    assert!((errors.stray.jumped_share() - 1.0 / 3.0).abs() < 1e-9);
    // dark on the way back
    let dark = measured(&path, &hits, &vectors, |k| !(301..=377).contains(&k));
    assert_eq!(dark.stray.length, 0.0, "{:?}", dark.stray);
    // as fast as a jump in the line's own direction
    let fast: Vec<DVec2> = (0..=60).map(|k| DVec2::X * 0.05 * f64::from(k)).collect();
    let fast = measured(&path, &fast, &[0; 61], |_| true);
    assert!((fast.stray.longest.length - 3.0).abs() < 1e-9);
}
