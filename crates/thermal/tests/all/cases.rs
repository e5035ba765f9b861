//! Acceptance cases of the electron beam that concern the reference solver. Values in the comments: the thesis, then the
//! check by an independent solver (docs/theory/sources.md).
use crate::support::{beam, circle, faces, fresh_layer, settings, titanium, titanium_read};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::material::file::{DensityReading, PorosityReading, Readings};
use meltpath_thermal::pool::MeltPool;
use meltpath_thermal::solver::run::{Sink, draw};
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::{Faces, Solver, State};

/// Largest pool and temperature seen while the beam is on its way.
struct Largest {
    liquidus: f64,
    pool: MeltPool,
}

impl Sink<f32> for Largest {
    fn interval(&self) -> f64 {
        100e-6
    }
    fn look(&mut self, solver: &Solver<f32>) {
        let pool = MeltPool::of(&solver.temperature(), self.liquidus, [1.0, 0.0]);
        let best = &mut self.pool;
        best.length = best.length.max(pool.length);
        best.width = best.width.max(pool.width);
        best.depth = best.depth.max(pool.depth);
        best.hottest = best.hottest.max(pool.hottest);
    }
}

/// The bead of table 3.2.2: one track of 3 mm on 100 µm of powder over dense metal.
fn single_bead(readings: Readings, edge: DVec3) -> (MeltPool, f64) {
    let readings = Readings {
        initial_porosity: Some(0.3),
        ..readings
    };
    let material = titanium_read(readings);
    let liquidus = material.liquidus;
    let grid = Grid::covering(
        DVec3::new(-0.5, -0.6, -0.6),
        DVec3::new(3.5, 0.6, 0.0),
        edge,
    )
    .unwrap();
    let faces = faces(&material);
    let mut solver = Solver::<f32>::new(grid, material, faces).unwrap();
    solver.set_state(|c| {
        if c.z > -0.1 {
            State::Powder
        } else {
            State::Dense
        }
    });
    let path = BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 400.0, settings(120.0, 0.4)).unwrap();
    let mut largest = Largest {
        liquidus,
        pool: MeltPool::default(),
    };
    let step = solver.stable_step().min(2e-6);
    draw(
        &mut solver,
        &path,
        &beam(),
        step,
        &mut [&mut largest],
        &Silent,
    )
    .unwrap();
    let residual = solver.ledger().residual(solver.stored());
    assert!(residual.abs() < 1e-3, "energy balance {residual:.2e}");
    (largest.pool, residual)
}

/// Thesis 2635 °C, 810 × 360 × 100 µm; check 2613 to 2722 °C by reading, 720-760 × 300-340 × 100-120 µm.
#[test]
fn ebm_t01_t02_single_bead() {
    let thesis = DVec3::new(0.06, 0.06, 0.04);
    let mut table = Vec::new();
    for (name, porosity, density) in [
        (
            "corrected",
            PorosityReading::Physical,
            DensityReading::Corrected,
        ),
        (
            "E1 printed",
            PorosityReading::PrintedAsDensity,
            DensityReading::Corrected,
        ),
        (
            "E2 printed",
            PorosityReading::Physical,
            DensityReading::Printed,
        ),
    ] {
        let readings = Readings {
            porosity,
            density,
            ..Readings::default()
        };
        let (pool, residual) = single_bead(readings, thesis);
        println!(
            "{name}: {:.0} °C, {:.0} x {:.0} x {:.0} µm, balance {residual:.1e}",
            pool.hottest - CELSIUS,
            1e3 * pool.length,
            1e3 * pool.width,
            1e3 * pool.depth
        );
        table.push(pool);
    }
    let pool = table[0];
    let hottest = pool.hottest - CELSIUS;
    assert!(
        (0.9 * 2535.0..1.1 * 2635.0).contains(&hottest),
        "T1: {hottest:.0} °C"
    );
    assert!(
        (pool.length - 0.810).abs() < 0.15 * 0.810 + 1e-9,
        "T2 length {:.3}",
        pool.length
    );
    assert!(
        (pool.width - 0.360).abs() < 0.060 + 1e-6,
        "T2 width {:.3}",
        pool.width
    );
    assert!(
        (pool.depth - 0.100).abs() < 0.040 + 1e-6,
        "T2 depth {:.3}",
        pool.depth
    );
}

/// A block under a beam at rest, 50 µm of powder on dense metal unless `state` says otherwise.
fn fixed_beam(state: impl Fn(DVec3) -> State) -> Solver<f32> {
    let material = titanium();
    let grid = Grid::covering(
        DVec3::new(-0.5, -0.5, -0.5),
        DVec3::new(0.5, 0.5, 0.0),
        DVec3::splat(0.025),
    )
    .unwrap();
    let faces = faces(&material);
    let mut solver = Solver::new(grid, material, faces).unwrap();
    solver.set_state(state);
    solver
}

/// Heats under a beam at rest until the hottest cell reaches `celsius`; returns the time, s.
fn heat_to(solver: &mut Solver<f32>, power: f64, spot: f64, celsius: f64, dt: f64) -> f64 {
    let spot = beam().spot(&settings(power, spot));
    let before = solver.time();
    while solver.hottest() < celsius + CELSIUS {
        solver.step(dt, &[spot]).unwrap();
        assert!(solver.time() < 0.1, "{celsius} °C are never reached");
    }
    solver.time() - before
}

/// Cools until the hottest cell is at `celsius`; returns the time, s.
fn cool_to(solver: &mut Solver<f32>, celsius: f64, dt: f64) -> f64 {
    let before = solver.time();
    while solver.hottest() > celsius + CELSIUS {
        solver.step(dt, &[]).unwrap();
        assert!(solver.time() < 0.2, "{celsius} °C are never reached");
    }
    solver.time() - before
}

const STEP: f64 = 2e-6;

/// Thesis: 2750 to 800 °C in 11.5 ms; check 15.2-15.6 ms (2 mA), 8.5 ms from 2800 °C (5 mA).
#[test]
fn ebm_t06_cooling_of_a_fixed_spot() {
    let mut solver = fixed_beam(fresh_layer);
    heat_to(&mut solver, 120.0, 0.551_67, 2750.0, STEP);
    let slow = cool_to(&mut solver, 800.0, STEP);
    let mut solver = fixed_beam(fresh_layer);
    heat_to(&mut solver, 300.0, 0.413_67, 2800.0, STEP);
    let fast = cool_to(&mut solver, 800.0, STEP);
    println!(
        "T6: 2750 to 800 °C in {:.2} ms at 2 mA; 2800 to 800 °C in {:.2} ms at 5 mA",
        1e3 * slow,
        1e3 * fast
    );
    assert!((11.5e-3 / 1.5..11.5e-3 * 1.5).contains(&slow));
    assert!((11.5e-3 / 1.5..11.5e-3 * 1.5).contains(&fast));
}

/// Check: plateau 0.74 and 1.54 ms, 1605 to 800 °C in 10.2 and 13.1 ms, from 2200 and 2800 °C.
#[test]
fn ebm_t07_a_hotter_pool_freezes_longer() {
    let cool = |top: f64| {
        let mut solver = fixed_beam(fresh_layer);
        heat_to(&mut solver, 120.0, 0.551_67, top, STEP);
        cool_to(&mut solver, 1665.0, STEP);
        let plateau = cool_to(&mut solver, 1605.0, STEP);
        let tail = cool_to(&mut solver, 800.0, STEP);
        [plateau, tail]
    };
    let (low, high) = (cool(2200.0), cool(2800.0));
    println!(
        "T7: plateau {:.2} and {:.2} ms, tail {:.2} and {:.2} ms from 2200 and 2800 °C",
        1e3 * low[0],
        1e3 * high[0],
        1e3 * low[1],
        1e3 * high[1]
    );
    assert!(high[0] > low[0]);
    assert!(high[1] / low[1] < 1.35 && high[1] >= low[1]);
}

/// A vertical strut: per layer a circle of `outer` (2 mA), then one of `inner` (2.4 mA), 0.4 mm overlap each, 470 mm/s.
/// Returns the diameter of the circle with the molten area of each layer, mm.
fn strut(outer: f64, inner: f64, layers: usize) -> Vec<f64> {
    let material = titanium();
    let half = outer + 0.35 + 0.5;
    let grid = Grid::covering(
        DVec3::new(-half, -half, -0.5),
        DVec3::new(half, half, 0.0),
        DVec3::new(0.04, 0.04, 0.025),
    )
    .unwrap();
    let faces = faces(&material);
    let planes = grid.planes();
    let plane = grid.cells[0] * grid.cells[1];
    let mut solver = Solver::<f32>::new(grid, material, faces).unwrap();
    // the strut stands in powder: nothing dense below
    solver.set_state(|_| State::Powder);
    for layer in 0..layers {
        if layer > 0 {
            solver.add_layer(0.05).unwrap();
            solver.freeze_below(0.6);
        }
        for (radius, power) in [(outer, 120.0), (inner, 144.0)] {
            let path = circle(radius, power);
            draw(&mut solver, &path, &beam(), STEP, &mut [], &Silent).unwrap();
        }
    }
    let dense = solver.relative_density();
    (0..layers)
        .map(|layer| {
            let top = planes - 2 + 2 * layer;
            let cells = dense.values[top * plane..(top + 2) * plane]
                .iter()
                .filter(|r| **r >= 1.0)
                .count();
            let area = 0.5 * cells as f64 * 0.04 * 0.04;
            (4.0 * area / std::f64::consts::PI).sqrt()
        })
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Thesis: solver 731 µm, measured 657 µm; check 719 µm (layers 699 to 739).
#[test]
#[ignore = "half a minute of computing"]
fn ebm_t08_strut_of_the_vendor() {
    let layers = strut(0.2, 0.1, 8);
    let diameter = mean(&layers);
    println!("T8: {:.0} µm, layers {:.3?}", 1e3 * diameter, layers);
    assert!((diameter / 0.731 - 1.0).abs() < 0.05, "{diameter}");
}

/// Chosen in the thesis for 1.000 mm; check 1047 µm, independent of the inner circle.
#[test]
#[ignore = "half a minute of computing"]
fn ebm_t09_strut_with_the_optimised_contour() {
    let wide = mean(&strut(0.372, 0.272, 5));
    println!("T9: {:.0} µm", 1e3 * wide);
    assert!((wide - 1.0).abs() < 0.07, "{wide}");
}

/// A layer is back at 750 °C within 1 °C after the 18 s of raking and consolidation.
#[test]
fn ebm_t10_a_layer_starts_at_the_consolidation_temperature() {
    let mut solver = fixed_beam(fresh_layer);
    heat_to(&mut solver, 120.0, 0.551_67, 2750.0, STEP);
    let (end, step) = (solver.time(), solver.stable_step());
    // what remains after 75 ms is what the plane radiates: it stays so for the rest of the 18 s
    let furthest = [0.075, 0.1].map(|after| {
        while solver.time() < end + after {
            solver.step(step, &[]).unwrap();
        }
        let start = solver.material().start;
        let apart = |t: &f32| (f64::from(*t) - start).abs();
        let field = solver.temperature();
        field.values.iter().map(apart).fold(0.0, f64::max)
    });
    println!(
        "T10: {furthest:.3?} K from 750 °C after 75 and 100 ms, balance {:.1e}",
        solver.ledger().residual(solver.stored())
    );
    assert!(furthest[1] < 1.0, "{furthest:?}");
    let change = furthest[1] - furthest[0];
    assert!(change.abs() < 0.01, "still cooling: {furthest:?}");
}

/// Check: at equal times at most 116 (M = 1/7) to 155 °C (M = 1) hotter than over dense metal; steps to 2800 °C 843
/// (dense), 812 (1/7), 725 (powder).
#[test]
fn ebm_t11_powder_heats_faster() {
    let curve = |state: fn(DVec3) -> State| {
        let mut solver = fixed_beam(state);
        let spot = beam().spot(&settings(120.0, 0.551_67));
        let mut hottest = vec![solver.hottest()];
        while solver.hottest() < 2800.0 + CELSIUS {
            // the check's steps of 2.5 µs, in halves
            solver.step(1.25e-6, &[spot]).unwrap();
            solver.step(1.25e-6, &[spot]).unwrap();
            hottest.push(solver.hottest());
        }
        hottest
    };
    let dense = curve(|_| State::Dense);
    let mut differences = Vec::new();
    for (name, curve) in [
        ("M = 1/7", curve(fresh_layer)),
        ("M = 1", curve(|_| State::Powder)),
    ] {
        let largest = curve
            .iter()
            .zip(&dense)
            .map(|(a, b)| a - b)
            .fold(0.0, f64::max);
        println!(
            "T11: {name}: {} steps to 2800 °C ({} over dense metal), at most {largest:.0} K hotter",
            curve.len() - 1,
            dense.len() - 1
        );
        assert!(curve.len() < dense.len());
        differences.push(largest);
    }
    assert!(
        differences.iter().all(|d| (50.0..200.0).contains(d)),
        "{differences:?}"
    );
    assert!(differences[1] > differences[0]);
}

/// Thesis: H spans more than 2200 °C, R more than 1800 °C. The independent solver's table spans 1940 and 1662 °C at the
/// stop of 2800 °C, where neither can exceed 2050 °C (erratum E10).
#[test]
fn ebm_t12_influence_of_depth_and_distance() {
    let mut solver = fixed_beam(fresh_layer);
    let time = heat_to(&mut solver, 120.0, 0.551_67, 2800.0, STEP);
    let field = solver.temperature();
    let top = field.grid.planes() - 1;
    let at = |i: usize, k: usize| field.at(i, 20, k) - CELSIUS;
    let depth: Vec<f64> = (0..7).map(|n| at(20, top - 2 * n)).collect();
    let distance: Vec<f64> = [20, 23, 26, 29, 32, 35].map(|i| at(i, top - 1)).to_vec();
    println!(
        "T12: {:.2} ms; depth {depth:.0?}; distance {distance:.0?}",
        1e3 * time
    );
    // the table of the check, H = 12.5 to 312.5 µm and R = 12.5 to 387.5 µm
    for (ours, check) in depth
        .iter()
        .zip([2800.0, 2461.0, 1910.0, 1457.0, 1164.0, 969.0, 860.0])
    {
        assert!((ours - check).abs() < 60.0, "{ours:.0} {check}");
    }
    for (ours, check) in distance[1..]
        .iter()
        .zip([2495.0, 2106.0, 1621.0, 1275.0, 995.0])
    {
        assert!((ours - check).abs() < 60.0, "{ours:.0} {check}");
    }
    assert!(depth[0] - depth[6] > 1800.0 && distance[0] - distance[5] > 1500.0);
}

/// The independent solver: a line at 300 W and 980 mm/s on fresh powder reaches 3398 °C, 1520 × 400 × 100 µm; and what evaporation takes.
#[test]
fn ebm_line_at_300_w_and_the_effect_of_evaporation() {
    let material = titanium();
    let liquidus = material.liquidus;
    let steam = Surface::Evaporating {
        surroundings: 300.0 + CELSIUS,
        ambient: 0.2,
    };
    let line = |top: Surface| {
        let grid = Grid::covering(
            DVec3::new(-0.5, -0.6, -0.5),
            DVec3::new(3.5, 0.6, 0.0),
            DVec3::new(0.04, 0.04, 0.025),
        )
        .unwrap();
        let faces = Faces {
            top,
            ..faces(&material)
        };
        let mut solver = Solver::<f32>::new(grid, material.clone(), faces).unwrap();
        solver.set_state(fresh_layer);
        let path =
            BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 980.0, settings(300.0, 0.413_67)).unwrap();
        let mut largest = Largest {
            liquidus,
            pool: MeltPool::default(),
        };
        draw(
            &mut solver,
            &path,
            &beam(),
            STEP,
            &mut [&mut largest],
            &Silent,
        )
        .unwrap();
        (largest.pool, *solver.ledger())
    };
    let (dry, _) = line(faces(&material).top);
    let (boiling, ledger) = line(steam);
    println!(
        "300 W line: {:.0} °C, {:.0} x {:.0} x {:.0} µm; with evaporation {:.0} °C, {:.2} % of the heat",
        dry.hottest - CELSIUS,
        1e3 * dry.length,
        1e3 * dry.width,
        1e3 * dry.depth,
        boiling.hottest - CELSIUS,
        100.0 * ledger.evaporated / ledger.absorbed
    );
    assert!((dry.hottest - CELSIUS - 3398.0).abs() < 0.05 * 3398.0);
    assert!(boiling.hottest < dry.hottest - 20.0 && ledger.evaporated > 0.0);
}

/// Walls of single tracks, `layers` high: mean width of the molten metal in the upper half, mm.
fn wall(power: f64, speed: f64, spot: f64, layers: usize) -> f64 {
    let material = titanium();
    let grid = Grid::covering(
        DVec3::new(-0.5, -0.6, -0.4),
        DVec3::new(2.5, 0.6, 0.0),
        DVec3::new(0.02, 0.02, 0.025),
    )
    .unwrap();
    let planes = grid.planes();
    let [nx, ny] = grid.cells;
    let faces = faces(&material);
    let mut solver = Solver::<f32>::new(grid, material, faces).unwrap();
    solver.set_state(|_| State::Powder);
    for layer in 0..layers {
        if layer > 0 {
            solver.add_layer(0.05).unwrap();
            solver.freeze_below(0.5);
        }
        let path =
            BeamPath::along(&[[0.0, 0.0], [2.0, 0.0]], speed, settings(power, spot)).unwrap();
        let step = solver.stable_step().min(STEP);
        draw(&mut solver, &path, &beam(), step, &mut [], &Silent).unwrap();
    }
    let dense = solver.relative_density();
    let (mut cells, mut rows) = (0, 0);
    for k in planes + layers..planes + 2 * (layers - 1) {
        for i in nx / 3..2 * nx / 3 {
            cells += (0..ny)
                .filter(|j| dense.values[(k * ny + j) * nx + i] >= 1.0)
                .count();
            rows += 1;
        }
    }
    cells as f64 / f64::from(rows) * 0.02
}

/// Thesis: 300 µm at φ = 300 µm; check 300 to 320 µm. Then 420 and 600 µm; check 340-400 and 340-440 µm (erratum E18).
#[test]
#[ignore = "minutes of computing"]
fn ebm_t03_t04_walls_against_beam_diameter() {
    let widths = [0.3, 0.5, 0.8].map(|spot| wall(300.0, 1400.0, spot, 6));
    println!(
        "T3, T4: {:.0?} µm at 300, 500, 800 µm",
        widths.map(|w| 1e3 * w)
    );
    assert!((widths[0] / 0.3 - 1.0).abs() < 0.1, "{}", widths[0]);
    // recorded: it grows, then stays where a wider beam no longer melts its rim
    assert!(widths[1] > widths[0]);
    for width in &widths[1..] {
        assert!((width - 0.340).abs() < 0.021, "{width}");
    }
}

/// Thesis: 443.5, 363.5, 282.5 µm once the grains are taken off; check 338-360, 340-360, 220-240 µm.
#[test]
#[ignore = "minutes of computing"]
fn ebm_t05_walls_of_the_validation() {
    let cases = [
        (180.0, 800.0, 0.471_09, 0.4435),
        (420.0, 1400.0, 0.310_17, 0.3635),
        (180.0, 1400.0, 0.310_17, 0.2825),
    ];
    let widths = cases.map(|(power, speed, spot, _)| wall(power, speed, spot, 6));
    println!("T5: {:.0?} µm", widths.map(|w| 1e3 * w));
    for (width, (.., thesis)) in widths.iter().zip(cases) {
        assert!((width / thesis - 1.0).abs() < 0.25, "{width} {thesis}");
    }
}
