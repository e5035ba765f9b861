//! The solver on levels against the reference solver on the finest cells everywhere: highest temperatures, shares, heat, cost.

use crate::support::{self, beam, ground, nothing, settings, titanium};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::levels::{BEND, Levels, Setup};
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::run::draw;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::{Face, Faces, Solver, State};

const LAYER: f64 = 0.05;

/// Lines along x over a field of `size` mm.
fn hatch(size: [f64; 2], distance: f64) -> BeamPath {
    let count = (size[1] / distance).round() as usize;
    let corners: Vec<[f64; 2]> = (0..=count)
        .flat_map(|n| {
            let y = n as f64 * distance;
            let ends = [[0.0, y], [size[0], y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    rested(&BeamPath::along(&corners, 980.0, settings(300.0, 0.413_67)).unwrap())
}

/// A path and two milliseconds without a beam.
fn rested(path: &BeamPath) -> BeamPath {
    let mut points = path.points().to_vec();
    // the one grid stops with the path, the levels a little later: give both that time
    let last = points[points.len() - 1].off();
    points.push(last);
    points.push(BeamPoint {
        time: last.time + 2e-3,
        ..last
    });
    BeamPath::new(points).unwrap()
}

fn setup(size: [f64; 2], cell: f64, coarser: usize) -> Setup {
    let root = 16.0 * cell * f64::from(1_u32 << coarser);
    let fit = |s: f64| root * ((s + 1.2) / root).ceil();
    let (w, h) = (fit(size[0]), fit(size[1]));
    let low = [0.5 * (size[0] - w), 0.5 * (size[1] - h)];
    let mut heights = vec![0.05; 4];
    heights.extend([0.07, 0.1, 0.15, 0.2, 0.28]);
    heights.reverse();
    support::on_levels([low, [low[0] + w, low[1] + h]], (cell, coarser), heights)
}

fn on_levels(setup: &Setup, size: [f64; 2], path: &BeamPath) -> Levels {
    let material = titanium();
    let matter = setup.ground(&material, &ground(size));
    let mut levels = Levels::new(setup.clone(), material, matter).unwrap();
    levels.draw(path, &beam(), &nothing(), &Silent).unwrap();
    levels
}

/// The same on one grid of the finest cells.
fn on_one_grid(setup: &Setup, size: [f64; 2], path: &BeamPath) -> Solver<f32> {
    let material = titanium();
    let [low, high] = setup.covered;
    let depth: f64 = setup.heights.iter().sum();
    let mut grid = Grid::covering(
        DVec3::new(low[0], low[1], -depth),
        DVec3::new(high[0], high[1], 0.0),
        DVec3::new(setup.cell, setup.cell, LAYER),
    )
    .unwrap();
    grid.heights.clone_from(&setup.heights);
    let faces = Faces {
        top: setup.top,
        sides: setup.beyond,
        bottom: setup.beyond,
    };
    let mut solver = Solver::<f32>::new(grid, material, faces).unwrap();
    let under = ground(size);
    solver.set_state(|c| {
        if c.z > -LAYER {
            State::Powder
        } else {
            under([c.x, c.y])
        }
    });
    let step = solver.stable_step();
    draw(&mut solver, path, &beam(), step, &mut [], &Silent).unwrap();
    solver
}

/// Largest and mean difference of a plane's highest temperatures, counted from the top, as shares of the rise, over molten cells;
/// share within a window of 60 K round the mean of the one grid, of both.
fn compare(one: &Field, levels: &Field, plane: usize) -> [f64; 4] {
    assert_eq!(one.grid.cells, levels.grid.cells);
    let cells = one.grid.cells[0] * one.grid.cells[1];
    let of = |f: &Field| f.values[f.values.len() - (plane + 1) * cells..][..cells].to_vec();
    let (a, b) = (of(one), of(levels));
    let material = titanium();
    let molten: Vec<(f64, f64)> = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (f64::from(*a), f64::from(*b)))
        .filter(|(a, _)| *a > material.liquidus)
        .collect();
    let off = |(a, b): &(f64, f64)| (b - a).abs() / (a - material.start);
    let largest = molten.iter().map(off).fold(0.0, f64::max);
    for n in (0..a.len())
        .filter(|n| {
            f64::from(a[*n]) > material.liquidus
                && off(&(f64::from(a[*n]), f64::from(b[*n]))) > 0.6 * largest
        })
        .take(4)
    {
        let c = one
            .grid
            .centre(n % one.grid.cells[0], n / one.grid.cells[0], 0);
        println!("   far off at {:.2} {:.2}: {} {}", c.x, c.y, a[n], b[n]);
    }
    let n = molten.len() as f64;
    let mean = molten.iter().map(off).sum::<f64>() / n;
    let centre = molten.iter().map(|(a, _)| a).sum::<f64>() / n;
    let share = |of: &dyn Fn(&(f64, f64)) -> f64| {
        molten
            .iter()
            .filter(|p| (of(p) - centre).abs() < 30.0)
            .count() as f64
            / n
    };
    [largest, mean, share(&|p| p.0), share(&|p| p.1)]
}

/// Seconds that all threads of this process have computed.
fn computed() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let of = |task: std::path::PathBuf| -> Option<f64> {
        let text = std::fs::read_to_string(task.join("schedstat")).ok()?;
        text.split(' ').next()?.parse().ok()
    };
    tasks.filter_map(|task| of(task.ok()?.path())).sum::<f64>() * 1e-9
}

#[test]
#[ignore = "a minute of computing"]
fn levels_draw_what_one_grid_of_their_finest_cells_draws() {
    let size = [3.0, 1.0];
    let path = hatch(size, 0.125);
    let length = 9.0 * size[0] + 1.0;
    let setup = setup(size, 0.03, 2);
    let begun = computed();
    let one = on_one_grid(&setup, size, &path);
    let slow = computed() - begun;
    let residual = one.ledger().residual(one.stored());
    println!(
        "one grid: {:.4} s/mm, {:.0} M updates/s, residual {residual:.1e}",
        slow / length,
        1e-6 * one.updates() as f64 / slow,
    );
    for bend in [100.0, BEND, 1000.0, 3000.0] {
        let setup = Setup {
            bend,
            ..setup.clone()
        };
        let begun = computed();
        let mut levels = on_levels(&setup, size, &path);
        let quick = computed() - begun;
        let residual = levels.ledger().residual(levels.stored());
        let highest = levels.highest_temperature(setup.covered);
        let [largest, mean, on_one, on_these] = compare(&one.highest_temperature(), &highest, 0);
        println!(
            "bend {bend}: {:.4} s/mm ({:.0} M updates/s, {:.0} updates/mm, step {:.2} us); off by {:.2} % at most, {:.3} % in the mean; in the window {:.2} % and {:.2} %; residual {residual:.1e}; tiles {:?}",
            quick / length,
            1e-6 * levels.updates() as f64 / quick,
            levels.updates() as f64 / length,
            1e6 * levels.step(),
            100.0 * largest,
            100.0 * mean,
            100.0 * on_one,
            100.0 * on_these,
            levels.tiles(),
        );
        assert!(residual.abs() < 1e-3, "{residual}");
        if bend > BEND {
            continue;
        }
        assert!(mean < 2e-3, "{mean}");
        assert!((on_one - on_these).abs() < 0.01, "{on_one} {on_these}");
    }
}

/// A slow line melts below the finest cells: coarser ones there tell what the finest would.
#[test]
fn levels_draw_a_pool_deeper_than_their_finest_cells() {
    let size = [1.2, 0.4];
    let corners = [[0.0, 0.2], [size[0], 0.2]];
    let slow = BeamPath::along(&corners, 60.0, settings(120.0, 0.413_67)).unwrap();
    let path = rested(&slow);
    let mut setup = setup(size, 0.04, 2);
    setup.heights = vec![0.28, 0.15, 0.1, 0.07];
    setup.heights.extend([0.05; 8]);
    setup.tracked = 0.4;
    let one = on_one_grid(&setup, size, &path).highest_temperature();
    let below = one.grid.cells[0] * one.grid.cells[1] * (one.grid.planes() - 5);
    let deepest = one.values[..below].iter().copied().fold(0.0, f32::max);
    assert!(f64::from(deepest) > titanium().liquidus, "{deepest}");
    // the finest cells end at 0.4 mm or at 0.25 mm, as deep as is kept; the pool at 0.3 mm
    for tracked in [0.4, 0.2] {
        setup.tracked = tracked;
        let levels = on_levels(&setup, size, &path).highest_temperature(setup.covered);
        for plane in 0..4 {
            let [largest, mean, ..] = compare(&one, &levels, plane);
            println!("kept to {tracked} mm, plane {plane}: {largest:.4}, {mean:.5}");
            assert!(largest < 0.015 && mean < 5e-3, "{largest} {mean}");
        }
    }
}

/// Whatever becomes finer or coarser, the beam's heat is in the metal, and the same on any number of threads.
#[test]
fn heat_is_kept_and_threads_change_no_bit() {
    let size = [2.0, 0.25];
    let path = hatch(size, 0.125);
    let setup = Setup {
        top: Surface::Insulated,
        beyond: Face::Insulated,
        ..setup(size, 0.03, 2)
    };
    let drawn = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut levels = on_levels(&setup, size, &path);
            let (ledger, stored) = (*levels.ledger(), levels.stored());
            let heat = 270.0 * (3.0 * size[0] + 0.25) / 980.0;
            assert!((ledger.absorbed / heat - 1.0).abs() < 1e-6, "{ledger:?}");
            assert!(ledger.residual(stored).abs() < 1e-4, "{ledger:?} {stored}");
            levels.highest_temperature(setup.covered)
        })
    };
    let [one, three] = [1, 3].map(drawn);
    assert!(one.largest().0 > titanium().liquidus);
    assert!(one.values == three.values);
}

/// On cells of 60 µm a line reads higher where it runs through the middle of cells than where it runs along their edges, on one
/// grid as on the levels: what of a difference is owed to the cells' place is none of the solver's.
#[test]
fn ebm_e10_where_cells_lie_moves_what_a_line_reads() {
    let size = [3.0, 0.0];
    let path =
        BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 980.0, settings(300.0, 0.413_67)).unwrap();
    let read = |shift: f64| {
        let mut setup = setup(size, 0.06, 1);
        for corner in &mut setup.covered {
            corner[1] += shift;
        }
        let middle = |field: &Field| {
            let grid = &field.grid;
            let top = grid.planes() - 1;
            (0..grid.cells[0] * grid.cells[1])
                .map(|n| (n % grid.cells[0], n / grid.cells[0]))
                .filter(|(i, j)| (1.35..=1.65).contains(&grid.centre(*i, *j, top).x))
                .map(|(i, j)| field.at(i, j, top) - CELSIUS)
                .fold(0.0, f64::max)
        };
        let one = middle(&on_one_grid(&setup, size, &path).highest_temperature());
        let levels = middle(&on_levels(&setup, size, &path).highest_temperature(setup.covered));
        println!("cells shifted by {shift} mm: one grid {one:.0} °C, levels {levels:.0} °C");
        assert!(
            (levels - one).abs() < 0.006 * (one - 750.0),
            "{levels} {one}"
        );
        one
    };
    let [edge, centre] = [0.0, 0.03].map(read);
    assert!((50.0..90.0).contains(&(centre - edge)), "{centre} {edge}");
}
