//! One bead on a plate: a torch that leans or climbs, and a plate that ends.
use super::*;
use meltpath_deposition::workpiece::{Laid, Support};

/// So many mm of a bead lack metal under them in this way.
fn hangs(laid: &Laid, support: Support, wanted: f64, within: f64) {
    let stretches = laid.loose.iter().filter(|l| l.support == support);
    let length: f64 = stretches.map(|l| l.length).sum();
    assert!((length - wanted).abs() < within, "{:?}", laid.loose);
}

/// A bead of one layer on an upright plate, from (0, 0) to `end`, by a torch that leans: heights over its middle, along x.
fn on_plate(end: DVec3, axis: DVec3) -> Vec<f64> {
    let voxels = plate(Turn::NONE, (LO, HI, 12.0), 0.5);
    let before = voxels.volume();
    let mut d = laying(voxels, Settings::default());
    let path: Vec<(DVec3, DVec3)> = (0..=400)
        .map(|i| (f64::from(i) / 400.0 * end, axis))
        .collect();
    lay_along(&mut d, &path, &mut 0.0);
    let laid = d.finish();
    let error = (laid.voxels.volume() - before) / laid.volume - 1.0;
    assert!(error.abs() < 1e-6, "{error}");
    assert!(laid.loose.is_empty());
    (20..50)
        .map(|x| height(&laid, Turn::NONE, DVec2::new(f64::from(x), 0.25)))
        .collect()
}

#[test]
fn leaning_ahead_or_climbing_the_torch_lays_the_bead_of_the_plate() {
    let plate = seed_bead().height();
    let (end, tilt) = (xyz(60.0, 0.0, 0.0), 15_f64.to_radians());
    let leaning = |angle: f64| xyz(angle.sin(), 0.0, angle.cos());
    for (what, end, axis) in [
        ("upright", end, DVec3::Z),
        ("pushed", end, leaning(-tilt)),
        ("dragged", end, leaning(tilt)),
        ("climbing", xyz(60.0, 0.0, 3.0), DVec3::Z),
    ] {
        let heights = on_plate(end, axis);
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        // the wire's path is longer by a thousandth where it climbs
        assert!((mean / plate - 1.0).abs() < 0.04, "{what}: {mean}");
        for h in &heights {
            assert!((h - mean).abs() < 0.1 * plate, "{what}: {h} of {mean}");
        }
    }
}

#[test]
fn what_hangs_free_is_told_with_its_length_and_place() {
    let over = |edge: DVec3| {
        let (lo, hi) = (DVec3::new(-20.0, -20.0, -8.0), DVec3::new(80.0, 20.0, 12.0));
        let mut voxels = Voxels::new(lo, hi, 0.5).unwrap();
        voxels.fill_box(lo, edge).unwrap();
        let before = voxels.volume();
        let mut d = laying(voxels, Settings::default());
        let path: Vec<(DVec3, DVec3)> = (0..=400)
            .map(|i| (xyz(0.15 * f64::from(i), 0.0, 0.0), DVec3::Z))
            .collect();
        lay_along(&mut d, &path, &mut 0.0);
        let laid = d.finish();
        let error = (laid.voxels.volume() - before) / laid.volume - 1.0;
        assert!(error.abs() < 1e-6, "{error}");
        laid
    };
    // the bead leaves its plate at x = 30; its pool ends 1.5 mm behind the wire, at 58.5
    let laid = over(xyz(30.0, 20.0, 0.0));
    hangs(&laid, Support::None, 28.5, 0.5);
    assert_eq!(laid.loose.len(), 1, "{:?}", laid.loose);
    assert!(laid.loose[0].position.distance(xyz(30.0, 0.0, 0.0)) < 0.6);
    // all of it, less the half pool that still leans on the plate, and the round end
    assert!(
        (laid.loose_volume / seed_bead().area - 30.0).abs() < 8.0,
        "{}",
        laid.loose_volume
    );
    // along the edge, which supports the axis alone
    let laid = over(xyz(80.0, 0.8, 0.0));
    hangs(&laid, Support::Partial, 60.0, 1.0);
    // and on the middle of the plate nothing hangs
    assert!(over(xyz(80.0, 20.0, 0.0)).loose.is_empty());
}

/// A rib of a millimetre under a bead that hangs free does not divide what hangs; ten millimetres of metal do.
#[test]
fn a_rib_does_not_divide_a_stretch_that_hangs() {
    let stretches = |rib: [f64; 2]| {
        let (lo, hi) = (DVec3::new(-20.0, -20.0, -8.0), DVec3::new(80.0, 20.0, 12.0));
        let mut voxels = Voxels::new(lo, hi, 0.5).unwrap();
        voxels.fill_box(lo, xyz(20.0, 20.0, 0.0)).unwrap();
        voxels
            .fill_box(xyz(rib[0], -20.0, -8.0), xyz(rib[1], 20.0, 0.0))
            .unwrap();
        let mut d = laying(voxels, Settings::default());
        let path: Vec<(DVec3, DVec3)> = (0..=400)
            .map(|i| (xyz(0.15 * f64::from(i), 0.0, 0.0), DVec3::Z))
            .collect();
        lay_along(&mut d, &path, &mut 0.0);
        let free = d.finish().loose;
        free.into_iter()
            .filter(|l| l.support == Support::None)
            .count()
    };
    assert_eq!(stretches([35.0, 36.0]), 1);
    assert_eq!(stretches([35.0, 45.0]), 2);
}

/// The contact tube's distance to the metal under the wire: a flat plate seen from above, by a torch that leans, and
/// from within.
#[test]
fn the_distance_is_measured_along_the_axis() {
    let lean = 45_f64.to_radians();
    let leaning = xyz(0.0, lean.sin(), lean.cos());
    for (mode, cell) in [(Settings::default().mode, 0.5), (Mode::Plain, 2.0)] {
        for (over, axis) in [(1.0, DVec3::Z), (7.0, leaning), (-0.7, DVec3::Z)] {
            let (lo, hi) = (DVec3::new(-20.0, -20.0, -8.0), DVec3::new(80.0, 20.0, 24.0));
            let mut voxels = Voxels::new(lo, hi, cell).unwrap();
            voxels.fill_box(lo, xyz(40.0, 20.0, 0.0)).unwrap();
            let settings = Settings {
                mode,
                ..Settings::default()
            };
            let mut d = laying(voxels, settings);
            let path: Vec<(DVec3, DVec3)> = (0..=400)
                .map(|i| (xyz(0.15 * f64::from(i), 0.0, over), axis))
                .collect();
            lay_along(&mut d, &path, &mut 0.0);
            let laid = d.finish();
            assert!(laid.path.len() > 90, "{}", laid.path.len());
            for p in laid.path.iter().filter(|p| p.tool.x < 36.0) {
                let wanted = settings.nominal_ctwd + over / axis.z;
                assert!(
                    (p.ctwd - wanted).abs() < 0.3,
                    "{over} {}: {} not {wanted}",
                    p.tool,
                    p.ctwd
                );
            }
        }
    }
}

/// Stamps that fall between the columns of coarse voxels are owed until one takes them: no metal is lost or made.
#[test]
fn stamps_between_columns_are_laid_with_the_next() {
    let mut voxels =
        Voxels::new(DVec3::new(-20.0, -20.0, -8.0), xyz(80.0, 20.0, 12.0), 4.0).unwrap();
    voxels
        .fill_box(DVec3::new(-20.0, -20.0, -8.0), xyz(80.0, 20.0, 0.0))
        .unwrap();
    let before = voxels.volume();
    let model = meltpath_deposition::bead::BeadModel {
        width: 1.6,
        area: 0.9,
        ..seed_bead()
    };
    let pool = PoolModel::for_bead(&POOL, &model);
    let settings = Settings {
        mode: Mode::Plain,
        ..Settings::default()
    };
    let mut d = Laying::new(voxels, model, pool, settings).unwrap();
    let path: Vec<(DVec3, DVec3)> = (0..=400)
        .map(|i| (xyz(0.15 * f64::from(i), 0.02 * f64::from(i), 0.0), DVec3::Z))
        .collect();
    lay_along(&mut d, &path, &mut 0.0);
    let laid = d.finish();
    let error = (laid.voxels.volume() - before + laid.beside) / laid.volume - 1.0;
    assert!(error.abs() < 1e-6, "{error}");
    assert!(laid.beside < 0.1 * laid.volume, "{}", laid.beside);
}
