//! What the reference solver shows besides highest temperatures agrees with itself, and with a path whose axes are exchanged.
use crate::support::{beam, on_metal, settings, titanium};
use meltpath_base::Silent;
use meltpath_melt_strategy::bed::{Domain, Resolution};
use meltpath_melt_strategy::judgement::{Drawn, watched};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::solver::watch::Watch;

/// Lines to and fro, and what is seen at three places.
fn drawn(corners: &[[f64; 2]], places: Vec<[f64; 3]>) -> Drawn {
    let (material, beam) = (titanium(), beam());
    let body = on_metal(&material, &beam);
    let path = BeamPath::along(corners, 400.0, settings(120.0, 0.413_67)).unwrap();
    let resolution = Resolution {
        cell: 0.1,
        planes: 1,
        step: 1e-5,
        domain: Domain::NARROW,
        power: 1.0,
    };
    let watch = Watch {
        places,
        every: 1e-5,
    };
    watched(&body, &[], &path, &resolution, (None, &watch), &Silent).unwrap()
}

const LINES: [[f64; 2]; 4] = [[0.0, 0.0], [2.5, 0.0], [2.5, 0.3], [0.0, 0.3]];

/// Temperatures in time at the middle of a cell peak at its highest temperature, and pass the liquidus when it is said to freeze;
/// the time above it is that of the samples.
#[test]
fn crossings_are_those_of_the_temperatures_in_time() {
    // the cells of this grid have their centres there
    let grid = drawn(&LINES, Vec::new()).highest.grid;
    let place = grid.centre(15, 6, grid.planes() - 1);
    let seen = drawn(&LINES, vec![place.to_array(), [9.0, 0.0, 0.0]]);
    let watched = seen.watched;
    assert_eq!(watched.outside, [[9.0, 0.0, 0.0]]);
    let top = seen.highest.grid.planes() - 1;
    let samples = &watched.samples;
    let most = samples.iter().map(|s| s.value).fold(0.0, f64::max);
    let highest = seen.highest.at(15, 6, top);
    assert!((most - highest).abs() < 5.0, "{most} {highest}");
    let liquidus = titanium().liquidus;
    let last = samples.iter().rposition(|s| s.value > liquidus).unwrap();
    let fell = watched.freezing.fell.at(15, 6, 1);
    let between = samples[last].time..samples[last + 1].time;
    assert!(between.contains(&fell), "{fell} {between:?}");
    let hot = samples.iter().filter(|s| s.value > liquidus).count() as f64;
    let above = watched.freezing.above.at(15, 6, 1);
    assert!((above - 1e-5 * hot).abs() < 4e-5, "{above} {hot}");
    // solid metal of this pool cools at some 1e5 K/s
    let rate = watched.freezing.rate.at(15, 6, 1);
    assert!((1e4..1e6).contains(&rate), "{rate}");
    assert!(
        watched.freezing.fell.at(0, 0, 1).is_nan() && watched.freezing.above.at(0, 0, 1) == 0.0
    );
}

/// Lines along y are drawn with x and y exchanged, and everything seen is exchanged back.
#[test]
fn a_path_along_y_is_seen_where_it_lies() {
    let place = [1.2, 0.2, -0.02];
    let [along_x, along_y] = [false, true].map(|turned| {
        let turn = |[x, y]: [f64; 2]| if turned { [y, x] } else { [x, y] };
        let [x, y] = turn([place[0], place[1]]);
        drawn(&LINES.map(turn), vec![[x, y, place[2]]])
    });
    let (a, b) = (along_x.watched, along_y.watched);
    assert_eq!(a.samples.len(), b.samples.len());
    for (a, b) in a.samples.iter().zip(&b.samples) {
        let [x, y, z] = b.place;
        assert_eq!(a.place, [y, x, z]);
        assert!((a.value - b.value).abs() < 0.5, "{a:?} {b:?}");
    }
    let [nx, ny] = a.freezing.above.grid.cells;
    assert_eq!(b.freezing.above.grid.cells, [ny, nx]);
    for i in 0..nx {
        for j in 0..ny {
            let (a, b) = (a.freezing.above.at(i, j, 1), b.freezing.above.at(j, i, 1));
            assert!((a - b).abs() < 2e-6, "{i} {j}: {a} {b}");
        }
    }
}

/// Between the centres of two cells lies what is between their temperatures, however coarse the cells have become behind the beam.
#[test]
fn temperatures_in_time_are_straight_between_cells() {
    let first = drawn(&LINES, Vec::new()).highest.grid.centre(15, 6, 0);
    let at = |x: f64| [first.x + x, first.y, 0.0];
    let watched = drawn(&LINES, vec![at(0.0), at(0.05), at(0.1)]).watched;
    let mut steep = 0;
    for now in watched.samples.as_chunks::<3>().0 {
        let [before, between, after] = now.map(|s| s.value);
        let apart = (after - before).abs();
        let off = (between - 0.5 * (before + after)).abs();
        assert!(off < 0.1 * apart + 1.0, "{now:?}");
        steep += usize::from(apart > 100.0);
    }
    assert!(steep > 10, "{steep}");
}
