//! Optimised paths on the reference solver itself (case ebm Q4): what learning reaches on the last 2 mm of the
//! thesis' triangle, what limits it, and whether it is converged.
use crate::support::{
    HATCH, SPEED, faces, fresh_layer, good_body, serpentine, settings, side, titanium, window_round,
};
use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_melt_strategy::learning::{Freedom, Learned, Learning, learn};
use meltpath_melt_strategy::lever::Lever;
use meltpath_melt_strategy::order::{Order, reorder};
use meltpath_melt_strategy::peaks::with_reference;
use meltpath_melt_strategy::prediction::{Prediction, Reference, predict};
use meltpath_melt_strategy::speed::SpeedProfile;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::Solver;
use meltpath_thermal::solver::run::draw;
use meltpath_thermal::solver::source::Depth;

/// How far inside the last 2 mm of the triangle a point lies, mm.
fn depth([x, y]: [f64; 2]) -> f64 {
    (7.5 * (side(y) - x.abs()) / 8.75_f64.hypot(7.5)).min(y - 5.5)
}

/// Lines of the last 2 mm, all in the same direction, the beam off for no time between them; as much energy per area as the
/// thesis has, whatever the spacing.
fn one_way(spacing: f64) -> BeamPath {
    let lines = (2.0 / spacing).round() as usize;
    let speed = SPEED * HATCH / spacing;
    let mut time = 0.0;
    let mut points = Vec::new();
    for n in 0..lines {
        let y = 5.5 + (n as f64 + 0.5) * spacing;
        let half = side(y);
        for (x, power) in [(-half, 300.0), (half, 0.0)] {
            points.push(BeamPoint {
                time,
                x,
                y,
                ..settings(power, 0.413_67)
            });
            if power > 0.0 {
                time += 2.0 * half / speed;
            }
        }
    }
    BeamPath::new(points).unwrap()
}

/// Cells, longest step and power of a solver.
#[derive(Clone, Copy)]
struct Resolution {
    cell: f64,
    height: f64,
    step: f64,
    power: f64,
}

const COARSE: Resolution = Resolution {
    cell: 0.0625,
    height: 0.05,
    step: 8e-6,
    power: 1.0,
};

impl Resolution {
    fn beam(self) -> Beam {
        Beam {
            efficiency: 0.9 * self.power,
            depth: Depth::Falling { penetration: 0.1 },
        }
    }

    /// Fresh powder on metal, 0.5 mm of margin on all sides.
    fn solver(self, path: &BeamPath) -> (Solver<f32>, f64) {
        let material = titanium();
        let (mut low, mut high) = (DVec3::ZERO.with_x(9.0).with_y(9.0), DVec3::ZERO);
        for p in path.points() {
            let p = DVec3::new(p.x, p.y, 0.0);
            (low, high) = (low.min(p), high.max(p));
        }
        let margin = DVec3::new(0.5, 0.5, 0.0);
        let edge = DVec3::new(self.cell, self.cell, self.height);
        let grid = Grid::covering((low - margin).with_z(-0.5), high + margin, edge).unwrap();
        let faces = faces(&material);
        let mut solver = Solver::new(grid, material, faces).unwrap();
        solver.set_state(fresh_layer);
        let step = solver.stable_step().min(self.step);
        (solver, step)
    }

    fn highest(self, path: &BeamPath) -> Field {
        let (solver, step) = self.solver(path);
        let beam = self.beam();
        let mut draw = with_reference(&solver, &beam, step, 0.05);
        draw(path, &Silent).unwrap().highest
    }

    /// 60 K round what the middle of the rectangle reaches.
    fn window(self) -> Classes {
        window_round(&self.highest(&good_body()))
    }
}

fn tally(field: &Field, classes: &Classes, beyond: f64) -> Tally {
    Tally::of(field, classes, |[i, j, k]| {
        let c = field.grid.centre(i, j, k);
        k + 1 == field.grid.planes() && depth([c.x, c.y]) > beyond
    })
}

fn share(field: &Field, classes: &Classes) -> f64 {
    tally(field, classes, 0.2).share(Class::Good)
}

fn centre(classes: &Classes) -> f64 {
    0.5 * (classes.window[0] + classes.window[1])
}

fn learned(
    at: Resolution,
    path: &BeamPath,
    lever: Lever,
    rounds: u32,
    classes: &Classes,
    first: Option<SpeedProfile>,
) -> Learned {
    let (solver, step) = at.solver(path);
    let beam = at.beam();
    let learning = Learning {
        aim: centre(classes),
        rounds,
        gain: 0.5,
        bounds: [0.25, 4.0],
        length: 0.0625,
        lever,
        levels: Vec::new(),
        freedom: Freedom::Continuous,
    };
    learn(
        &mut with_reference(&solver, &beam, step, 0.05),
        &titanium(),
        path,
        &learning,
        first,
        &|p| depth(p) > 0.15,
        &|f| share(f, classes),
        &Silent,
    )
    .unwrap()
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// The same path judged with other cells, steps and powers: in the window as it was, and in the one found alike.
fn judged(what: &str, at: Resolution, path: &BeamPath, fixed: &Classes) -> [f64; 2] {
    let own = at.window();
    let field = at.highest(path);
    let (old, new) = (share(&field, fixed), share(&field, &own));
    let deep = tally(&field, &own, 0.6);
    println!(
        "{what}: {} in the window as it was, {} in that round its own {:.0} °C; deeper than 0.6 mm {:.0} ± {:.0} °C",
        percent(old),
        percent(new),
        centre(&own) - CELSIUS,
        deep.mean - CELSIUS,
        deep.deviation
    );
    [old, new]
}

/// Lines to and fro, speed changed, against lines in one direction, power changed.
#[test]
#[ignore = "a minute of computing"]
fn ebm_q04_levers_on_the_reference_solver() {
    let classes = COARSE.window();
    println!("window round {:.0} °C", centre(&classes) - CELSIUS);
    let fro = learned(
        COARSE,
        &serpentine(5.5, 7.5, side),
        Lever::Speed,
        16,
        &classes,
        None,
    );
    println!("to and fro, 0.125 mm, speed: {:.3?}", fro.scores);
    let path = one_way(0.0625);
    let narrow = learned(COARSE, &path, Lever::Power, 12, &classes, None);
    println!("one way, 0.0625 mm, power: {:.3?}", narrow.scores);
    let best = |l: &Learned| l.scores.iter().copied().fold(0.0, f64::max);
    assert!(best(&narrow) > 0.9, "{:?}", narrow.scores);
    assert!(best(&narrow) > best(&fro) + 0.2);
    let half = Resolution {
        step: 0.5 * COARSE.step,
        ..COARSE
    };
    let [_, found] = judged("half step", half, &narrow.path, &classes);
    assert!((found - best(&narrow)).abs() < 0.05, "{found}");
    for power in [0.95, 1.05] {
        let other = Resolution { power, ..COARSE };
        let [old, new] = judged(&format!("power x {power}"), other, &narrow.path, &classes);
        // 5 % of power are 120 K: twice the window, whatever the path
        assert!(old < 0.05 && new > 0.8, "{old} {new}");
    }
}

/// Other levers and orders of the same lines do as well as the power on lines in their order; lines twice as far apart do not.
#[test]
#[ignore = "a minute of computing"]
fn ebm_q04_other_levers_and_orders() {
    let classes = COARSE.window();
    let best = |l: &Learned| l.scores.iter().copied().fold(0.0, f64::max);
    let wide = learned(COARSE, &one_way(HATCH), Lever::Power, 8, &classes, None);
    println!("one way, 0.125 mm, power: {:.3?}", wide.scores);
    let path = one_way(0.0625);
    let speed = learned(COARSE, &path, Lever::Speed, 12, &classes, None);
    println!("one way, 0.0625 mm, speed: {:.3?}", speed.scores);
    let found = [Order::Every(2), Order::Backwards].map(|order| {
        let other = reorder(&path, order, 0.15).unwrap();
        let found = learned(COARSE, &other, Lever::Power, 8, &classes, None);
        println!("{order:?}: {:.3?}", found.scores);
        best(&found)
    });
    assert!(best(&speed) > 0.9 && best(&wide) < 0.6);
    assert!(found.iter().all(|f| *f > 0.9), "{found:?}");
}

/// One drawing under predictive control, without any learning.
#[test]
#[ignore = "half a minute of computing"]
fn ebm_q04_prediction_on_the_reference_solver() {
    let classes = COARSE.window();
    let path = one_way(0.0625);
    let (solver, step) = COARSE.solver(&path);
    let beam = COARSE.beam();
    let before = share(&COARSE.highest(&path), &classes);
    let prediction = Prediction {
        aim: centre(&classes),
        bounds: [0.25, 4.0],
        length: 0.125,
        ahead: 1e-4,
        lever: Lever::Power,
        levels: Vec::new(),
    };
    let mut engine = Reference {
        solver,
        beam: &beam,
        step,
    };
    let profile = predict(&mut engine, &titanium(), &path, &prediction, &Silent).unwrap();
    let found = share(&engine.solver.highest_temperature(), &classes);
    println!("prediction: {} to {}", percent(before), percent(found));
    assert!(found > 2.0 * before, "{before} {found}");
    // drawn for itself the path does what was predicted
    let again = Lever::Power.apply(&profile, &path).unwrap();
    let again = share(&COARSE.highest(&again), &classes);
    assert!((again - found).abs() < 0.05, "{again} {found}");
}

/// Learned with coarse cells first and half the cells then, on lines half a thesis' spacing apart: the side towards earlier lines gets
/// 55 K hotter than the other, nearly the whole window.
#[test]
#[ignore = "a minute of computing"]
fn ebm_q04_finer_cells_teach_again() {
    let (path, spacing) = (one_way(0.0625), 0.0625);
    let coarse = learned(COARSE, &path, Lever::Power, 10, &COARSE.window(), None);
    let fine = Resolution {
        cell: 0.031_25,
        ..COARSE
    };
    let classes = fine.window();
    let found = learned(fine, &path, Lever::Power, 6, &classes, Some(coarse.profile));
    println!(
        "coarse {:.3?}, then fine {:.3?}",
        coarse.scores, found.scores
    );
    let field = &found.highest;
    let [earlier, later] = [-1.0, 1.0].map(|side| {
        let of_side = Tally::of(field, &classes, |[i, j, k]| {
            let c = field.grid.centre(i, j, k);
            let off = ((c.y - 5.5) / spacing).rem_euclid(1.0) - 0.5;
            k + 1 == field.grid.planes() && depth([c.x, c.y]) > 0.6 && off * side > 0.01
        });
        of_side.mean - CELSIUS
    });
    println!("towards earlier lines {earlier:.0} °C, towards later ones {later:.0} °C");
    assert!(
        (40.0..70.0).contains(&(earlier - later)),
        "{earlier} {later}"
    );
    let best = found.scores.iter().copied().fold(0.0, f64::max);
    assert!((0.5..0.75).contains(&best), "{best}");
}

/// Squares of 1.5 mm, 12 mm apart, one after the other: the second becomes as hot as alone (hypothesis H2 of the thesis).
#[test]
fn ebm_q12_parts_far_apart_do_not_feel_each_other() {
    let square = |x: f64, time: f64| {
        let corners: Vec<[f64; 2]> = (0..12)
            .flat_map(|n| {
                let y = (f64::from(n) + 0.5) * HATCH;
                let ends = [[x, y], [x + 1.5, y]];
                if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
            })
            .collect();
        let start = BeamPoint {
            time,
            ..settings(300.0, 0.413_67)
        };
        BeamPath::along(&corners, SPEED, start).unwrap()
    };
    let at = Resolution {
        step: 1e-5,
        ..COARSE
    };
    let first = square(0.0, 0.0);
    let second = square(12.0, first.end());
    let both = BeamPath::new([first.points(), second.points()].concat()).unwrap();
    let (solver, step) = at.solver(&both);
    let beam = at.beam();
    let drawn = |paths: &[&BeamPath]| {
        let mut solver = solver.clone();
        for path in paths {
            draw(&mut solver, path, &beam, step, &mut [], &Silent).unwrap();
        }
        solver.highest_temperature()
    };
    let together = drawn(&[&first, &second]);
    let alone = drawn(&[&second]);
    let planes = alone.grid.planes();
    let [nx, ny] = alone.grid.cells;
    let mut worst = 0.0_f64;
    let mut hottest = 0.0_f64;
    for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
        if alone.grid.centre(i, j, 0).x > 11.0 {
            let (a, b) = (alone.at(i, j, planes - 1), together.at(i, j, planes - 1));
            worst = worst.max((a - b).abs());
            hottest = hottest.max(a);
        }
    }
    println!(
        "Q12: {worst:.3} K apart, hottest {:.0} °C",
        hottest - CELSIUS
    );
    assert!(hottest > 3000.0, "{hottest}");
    // single precision at 4500 °C
    assert!(worst < 1.0, "{worst}");
}
