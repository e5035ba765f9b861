//! Charts that remember what earlier lines left in the ground, against the reference solver (erratum E10).
use std::time::Instant;

use crate::support::{compute_warm_charts, fresh_layer, on_solver, settings, titanium};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::ChartSet;
use meltpath_thermal::charts::simulation::{ChartSimulation, Memory, Settings};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::material::medium;

/// Cells and voxels in the plane, mm.
const CELL: f64 = 0.06;

/// Cold half a millimetre below the build plane, as the reference solver's domain is.
const GROUND: Memory = Memory::Ground(medium::Body::Cooled { thickness: 0.5 });

/// Lines between `ends` (x of left and right ends at y), to and fro, with one speed and power.
fn lines(
    rows: impl Iterator<Item = (f64, [f64; 2])>,
    speed: f64,
    power: f64,
    spot: f64,
) -> BeamPath {
    let corners: Vec<[f64; 2]> = rows
        .enumerate()
        .flat_map(|(n, (y, [a, b]))| {
            let ends = [[a, y], [b, y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    BeamPath::along(&corners, speed, settings(power, spot)).unwrap()
}

fn hatch(count: u32, length: f64, spacing: f64) -> BeamPath {
    let rows = (0..count).map(|n| (spacing * f64::from(n), [0.0, length]));
    lines(rows, 980.0, 300.0, 0.413_67)
}

/// The last 2 mm of the thesis' triangle: lines that grow shorter up to the apex.
fn apex() -> BeamPath {
    let rows = (44..60).map(|n| {
        let y = (f64::from(n) + 0.5) * 0.125;
        let half = 8.75 * (1.0 - y / 7.5);
        (y, [-half, half])
    });
    lines(rows, 980.0, 300.0, 0.413_67)
}

fn box_of(path: &BeamPath) -> [DVec3; 2] {
    let mut ends = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for p in path.points() {
        let p = DVec3::new(p.x, p.y, 0.0);
        ends = [ends[0].min(p), ends[1].max(p)];
    }
    ends
}

/// On the solver's own cells.
fn on_charts(path: &BeamPath, like: &Grid, set: &ChartSet, memory: Memory) -> Field {
    let grid = Grid {
        origin: DVec3::new(like.origin.x, like.origin.y, -0.35),
        heights: vec![0.05; 7],
        ..like.clone()
    };
    let options = Settings {
        memory,
        ..Settings::of(&titanium())
    };
    let mut simulation =
        ChartSimulation::new(&grid, titanium(), vec![set.clone()], options).unwrap();
    simulation.set_state(fresh_layer);
    simulation.draw(path, &[], &mut |_, _| (), &Silent).unwrap();
    simulation.highest_temperature()
}

/// How charts lie beside the solver on voxels of the top plane that the solver melts, more than 0.2 mm inside the path's box.
#[derive(Debug)]
struct Beside {
    /// Mean of charts less solver, K.
    bias: f64,
    /// Spread of the difference, K.
    spread: f64,
    /// Correlation over the voxels.
    correlation: f64,
    /// Largest temperatures, °C: solver and charts.
    hottest: [f64; 2],
}

fn beside(charts: &Field, solver: &Field, path: &BeamPath) -> Beside {
    let (grid, top) = (&solver.grid, solver.grid.planes() - 1);
    let [low, high] = box_of(path);
    let plane = charts.grid.planes() - 1;
    let mut pairs = Vec::new();
    for n in 0..grid.cells[0] * grid.cells[1] {
        let (i, j) = (n % grid.cells[0], n / grid.cells[0]);
        let c = grid.centre(i, j, top);
        let inside = c.x > low.x + 0.2 && c.x < high.x - 0.2 && c.y > low.y && c.y < high.y;
        let (ours, theirs) = (
            charts.at(i, j, plane) - CELSIUS,
            solver.at(i, j, top) - CELSIUS,
        );
        if inside && theirs > 1665.0 {
            pairs.push([ours, theirs]);
        }
    }
    let n = pairs.len() as f64;
    let mean = |f: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().map(f).sum::<f64>() / n;
    let [a, b] = [mean(&|p| p[0]), mean(&|p| p[1])];
    let cross = |x: usize, y: usize| mean(&|p| (p[x] - [a, b][x]) * (p[y] - [a, b][y]));
    let most = |n: usize| pairs.iter().map(|p| p[n]).fold(0.0, f64::max);
    Beside {
        bias: a - b,
        spread: (cross(0, 0) + cross(1, 1) - 2.0 * cross(0, 1)).sqrt(),
        correlation: cross(0, 1) / (cross(0, 0) * cross(1, 1)).sqrt(),
        hottest: [most(1), most(0)],
    }
}

fn told(name: &str, path: &BeamPath, set: &ChartSet) -> [Beside; 2] {
    let solver = on_solver(path, CELL, 1);
    [("none", Memory::None), ("ground", GROUND)].map(|(memory, how)| {
        let begun = Instant::now();
        let charts = on_charts(path, &solver.grid, set, how);
        let found = beside(&charts, &solver, path);
        println!(
            "{name}, charts to {:.0} °C, memory {memory}: bias {:+.0} K, spread {:.0} K, correlation {:.2}, hottest {:.0} °C (solver {:.0}), {:.2} s",
            set.settings.stop - CELSIUS,
            found.bias,
            found.spread,
            found.correlation,
            found.hottest[1],
            found.hottest[0],
            begun.elapsed().as_secs_f64()
        );
        found
    })
}

/// Highest temperature in the middle of the last of 1, 2, 3 and 7 lines.
#[test]
#[ignore = "half a minute of computing"]
fn ebm_e10_charts_remember_earlier_lines() {
    let sets = [3700.0, 4200.0].map(|stop| compute_warm_charts(300.0, 0.413_67, stop));
    for count in [1, 2, 3, 7] {
        let path = hatch(count, 3.0, 0.125);
        let solver = on_solver(&path, CELL, 1);
        let top = solver.grid.planes() - 1;
        let middle = |field: &Field, plane: usize| {
            let y = 0.125 * f64::from(count - 1);
            let grid = &field.grid;
            (0..grid.cells[0] * grid.cells[1])
                .map(|n| (n % grid.cells[0], n / grid.cells[0]))
                .filter(|(i, j)| {
                    let c = grid.centre(*i, *j, plane);
                    (c.y - y).abs() < 0.07 && (1.35..=1.65).contains(&c.x)
                })
                .map(|(i, j)| field.at(i, j, plane) - CELSIUS)
                .fold(0.0, f64::max)
        };
        let reference = middle(&solver, top);
        let of = |memory| {
            sets.each_ref()
                .map(|set| middle(&on_charts(&path, &solver.grid, set, memory), 6))
        };
        let (none, ground) = (of(Memory::None), of(GROUND));
        println!(
            "{count} lines: solver {reference:.0}, charts to 3700 and 4200 °C: memory none {none:.0?}, ground {ground:.0?}"
        );
        // one line: what charts leave out at their end; then earlier lines too
        let missing = ground.map(|t| reference - t);
        assert!((0.0..300.0).contains(&missing[0]), "{count}: {missing:?}");
        assert!((-50.0..200.0).contains(&missing[1]), "{count}: {missing:?}");
        assert!(count == 1 || reference - none[1] > 400.0);
    }
}

/// Whole fields: lines closer together, longer lines, lines that grow shorter, a slow beam.
#[test]
#[ignore = "a minute of computing"]
fn ebm_e10_memory_ranks_places_as_the_solver_does() {
    let fast = compute_warm_charts(300.0, 0.413_67, 3700.0);
    let slow = compute_warm_charts(120.0, 0.551_67, 2800.0);
    let wide = (0..5).map(|n| (0.3 * f64::from(n), [0.0, 3.0]));
    let cases = [
        (
            "13 lines of 3 mm every 0.0625 mm",
            hatch(13, 3.0, 0.0625),
            &fast,
        ),
        (
            "7 lines of 6 mm every 0.125 mm",
            hatch(7, 6.0, 0.125),
            &fast,
        ),
        ("last 2 mm of the triangle", apex(), &fast),
        (
            "5 lines of 3 mm every 0.3 mm, 120 W, 400 mm/s",
            lines(wide, 400.0, 120.0, 0.551_67),
            &slow,
        ),
    ];
    for (name, path, set) in &cases {
        let [none, ground] = told(name, path, set);
        assert!(ground.correlation > 0.93, "{name}: {ground:?}");
        assert!(ground.spread < 0.8 * none.spread, "{name}: {ground:?}");
        assert!(
            ground.bias.abs() < 0.5 * none.bias.abs(),
            "{name}: {ground:?}"
        );
    }
}
