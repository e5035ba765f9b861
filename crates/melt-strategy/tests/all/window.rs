//! The moving window of the reference solver against the same grid without it: temperatures, heat, cost.
use crate::support::{beam, faces, fresh_layer, on_metal, settings, titanium};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_melt_strategy::bed::{Domain, Resolution};
use meltpath_melt_strategy::judgement::judge;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::Solver;
use meltpath_thermal::solver::run::draw;

fn solver(low: DVec3, high: DVec3, edge: f64) -> Solver<f32> {
    let material = titanium();
    let faces = faces(&material);
    let grid = Grid::covering(low, high, DVec3::new(edge, edge, 0.05)).unwrap();
    let mut solver = Solver::new(grid, material, faces).unwrap();
    solver.set_state(fresh_layer);
    solver
}

/// Two groups of lines 4 mm apart, so that rows between them sleep, and the first group cools while the second is drawn.
fn lines(length: f64) -> BeamPath {
    let corners: Vec<[f64; 2]> = [0.0, 0.125, 0.25, 4.0, 4.125, 4.25]
        .iter()
        .enumerate()
        .flat_map(|(n, y)| {
            let ends = [[0.0, *y], [length, *y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    BeamPath::along(&corners, 980.0, settings(300.0, 0.413_67)).unwrap()
}

#[test]
#[ignore = "half a minute of computing"]
fn sleeping_rows_change_temperatures_by_less_than_a_stated_bound() {
    let path = lines(3.0);
    let (low, high) = (DVec3::new(-0.5, -0.5, -0.5), DVec3::new(3.5, 4.75, 0.0));
    let mut whole = solver(low, high, 0.0625);
    let mut window = whole.clone();
    let tolerance = 2.0;
    window.let_rows_sleep(tolerance);
    for s in [&mut whole, &mut window] {
        draw(s, &path, &beam(), 4e-6, &mut [], &Silent).unwrap();
    }
    let (a, b) = (whole.highest_temperature(), window.highest_temperature());
    let liquidus = titanium().liquidus as f32;
    let (mut hot, mut any, mut state) = (0.0_f32, 0.0_f32, 0);
    for (a, b) in a.values.iter().zip(&b.values) {
        any = any.max((a - b).abs());
        if *a > liquidus {
            hot = hot.max((a - b).abs());
        }
        state += u32::from((*a > liquidus) != (*b > liquidus));
    }
    let now = whole
        .temperature()
        .values
        .iter()
        .zip(&window.temperature().values)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0_f32, f32::max);
    let residual = window.ledger().residual(window.stored());
    let share = window.updates() as f64 / whole.updates() as f64;
    println!(
        "window: highest temperatures within {any:.2} K, of molten cells {hot:.3} K, {state} cells of other class; at the end within {now:.2} K; heat lost {:.1e}; {:.0} % of the updates",
        residual,
        100.0 * share
    );
    // what sleeps is within the tolerance, and so is what it does
    assert!(any < 1.5 * tolerance as f32 && now < 1.5 * tolerance as f32);
    assert!(hot < 1.0 && state == 0);
    assert!(residual.abs() < 1e-3);
    assert!(share < 0.75);
}

/// Three times the track, little more per millimetre: without a window it would be three times as much.
#[test]
#[ignore = "half a minute of computing"]
fn a_long_track_costs_where_it_is_hot() {
    let material = titanium();
    let beam = beam();
    let body = on_metal(&material, &beam);
    let resolution = Resolution {
        cell: 0.0625,
        planes: 1,
        step: 4e-6,
        domain: Domain::NARROW,
        power: 1.0,
    };
    let cost = |length: f64| {
        let path = BeamPath::along(
            &[[0.0, 0.0], [length, 0.0]],
            200.0,
            settings(60.0, 0.413_67),
        )
        .unwrap();
        let drawn = judge(&body, &[], &path, &resolution, &Silent).unwrap();
        let most = drawn.highest.largest().0 - CELSIUS;
        println!(
            "track of {length} mm: {:.2e} updates per mm, {most:.0} °C, heat lost {:.1e}",
            drawn.updates as f64 / length,
            drawn.residual
        );
        assert!(drawn.residual.abs() < 1e-3);
        // the field lies where the path does, turned or not
        let [nx, ny] = drawn.highest.grid.cells;
        assert!(nx > 2 * ny);
        drawn.updates as f64 / length
    };
    let (short, long) = (cost(16.0), cost(48.0));
    assert!(long < 1.5 * short, "{short} {long}");
}

#[test]
fn the_bits_with_a_window_do_not_depend_on_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let (low, high) = (DVec3::new(-0.5, -0.5, -0.3), DVec3::new(2.5, 2.5, 0.0));
            let mut s = solver(low, high, 0.1);
            s.let_rows_sleep(2.0);
            let path = BeamPath::along(&[[0.0, 0.0], [2.0, 2.0]], 980.0, settings(300.0, 0.413_67))
                .unwrap();
            draw(&mut s, &path, &beam(), 4e-6, &mut [], &Silent).unwrap();
            (s.highest_temperature(), s.ledger().radiated.to_bits())
        })
    };
    assert_eq!(on(1), on(3));
}
