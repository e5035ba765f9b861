//! Layers on layers: what is warm below stays warm below, against heat in one dimension and against itself.

use crate::support::{beam, settings, titanium};
use meltpath_base::Silent;
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::levels::{BEND, Cooled, Ground, Levels, Setup};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::watch::Watch;
use meltpath_thermal::solver::{Face, State};

const LAYER: f64 = 0.1;
/// Edge of a plate, mm: one tile of the coarsest level.
const SIDE: f64 = 3.84;
const PLATE: f64 = 3.0;

fn nothing() -> Watch {
    Watch {
        places: Vec::new(),
        every: 1.0,
    }
}

/// Planes of half a layer down to two layers, then growing ones; bottom first.
fn heights(depth: f64) -> Vec<f64> {
    let mut out = vec![0.5 * LAYER; 4];
    let mut left = depth - 2.0 * LAYER;
    let mut height = 0.5 * LAYER;
    while left > 1e-9 {
        height = (1.3 * height).min(left);
        if left - height < 0.5 * height {
            height = left;
        }
        out.push(height);
        left -= height;
    }
    out.reverse();
    out
}

fn plate(layers: usize, top: Surface, beyond: Face) -> Setup {
    Setup {
        covered: [[0.0; 2], [SIDE; 2]],
        cell: 0.06,
        coarser: 2,
        heights: heights(PLATE + layers as f64 * LAYER),
        layer: LAYER,
        tracked: 2.0 * LAYER,
        top,
        beyond,
        step: 1.0,
        focus: None,
        bend: BEND,
    }
}

/// Lines over the whole plate.
fn everywhere(power: f64) -> BeamPath {
    let corners: Vec<[f64; 2]> = (0..16)
        .flat_map(|n| {
            let y = 0.24 * (f64::from(n) + 0.5);
            let ends = [[0.2, y], [SIDE - 0.2, y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    BeamPath::along(&corners, 2000.0, settings(power, 1.0)).unwrap()
}

/// Fine cells of one column, explicit: the same plate heated evenly, layer after layer. Mean temperature of each top before the
/// next layer, above the start.
fn in_one_dimension(
    [conductivity, capacity]: [f64; 2],
    heat: &[f64],
    drawn: f64,
    rest: f64,
    depth: Depth,
) -> Vec<f64> {
    let cell = 0.0125;
    let per_layer = (LAYER / cell).round() as usize;
    let step = 0.4 * cell * cell * capacity / conductivity;
    // top first
    let mut rise = vec![0.0; (PLATE / cell).round() as usize];
    let mut tops = Vec::new();
    for heat in heat {
        for _ in 0..per_layer {
            rise.insert(0, 0.0);
        }
        let shares: Vec<f64> = (0..rise.len())
            .map(|n| depth.share_above((n + 1) as f64 * cell) - depth.share_above(n as f64 * cell))
            .collect();
        let steps = ((drawn + rest) / step).ceil();
        let dt = (drawn + rest) / steps;
        for n in 0..steps as usize {
            let number = conductivity * dt / (capacity * cell * cell);
            let before = rise.clone();
            let last = before.len() - 1;
            let from = n as f64 * dt;
            let on = ((drawn.min(from + dt) - from) / drawn).max(0.0);
            for i in 0..=last {
                let up = before[i.saturating_sub(1)];
                let down = before[(i + 1).min(last)];
                rise[i] += number * (up - before[i] + (down - before[i]))
                    + on * heat * shares[i] / (capacity * cell);
            }
        }
        tops.push(1.5 * rise[0] - 0.5 * rise[1]);
    }
    tops
}

/// A whole section that is heated evenly is a problem in one dimension: the plan's mean temperature is that of a column.
#[test]
fn an_even_section_is_heat_in_one_dimension() {
    let laws = [0.025, 4e-3];
    let material = Material::constant(laws[0], laws[1], 1000.0);
    let depth = Depth::Falling { penetration: 0.1 };
    let beam = Beam {
        efficiency: 1.0,
        depth,
    };
    let path = everywhere(1000.0);
    let rest = 0.6;
    let mut ground = None;
    let (mut heat, mut means) = (Vec::new(), Vec::new());
    for layers in 1..=4 {
        let setup = plate(layers, Surface::Insulated, Face::Insulated);
        let under = match ground.take() {
            Some(ground) => ground,
            None => Ground::from(setup.ground(&material, &|_| State::Dense)),
        };
        let mut levels = Levels::on(setup, material.clone(), under, material.start).unwrap();
        levels.draw(&path, &beam, &nothing(), &Silent).unwrap();
        let (left, cooled) = levels.leave(rest, &Silent).unwrap();
        let [mean, highest] = left.top(0.0, [0.0; 2], &|_| true);
        let Cooled { ledger, stored } = cooled;
        assert!(highest >= mean && ledger.absorbed > 0.0);
        assert!(ledger.residual(stored).abs() < 1e-4, "{layers}");
        means.push(mean - material.start);
        heat.push(ledger.absorbed / (SIDE * SIDE));
        ground = Some(left);
    }
    let drawn = path.end() - path.begin();
    let expected = in_one_dimension(laws, &heat, drawn, rest, depth);
    println!("means {means:.2?} K, in one dimension {expected:.2?} K");
    for (mean, expected) in means.iter().zip(&expected) {
        assert!((mean / expected - 1.0).abs() < 5e-3, "{mean} {expected}");
    }
    // what was laid on and heated is in the metal: no heat is lost from layer to layer
    assert!(means[3] > 1.5 * means[0]);
}

/// Three layers on titanium, powder laid at `powder` K: the mean temperature of each top before the next one.
fn on_titanium(beyond: Face, rest: f64, powder: f64) -> Vec<f64> {
    let material = titanium();
    let path = everywhere(600.0);
    let mut ground = None;
    let of_layer = |layers: usize| {
        let top = Surface::Radiating {
            surroundings: 300.0 + CELSIUS,
        };
        let setup = plate(layers, top, beyond);
        let under = match ground.take() {
            Some(ground) => ground,
            None => Ground::from(setup.ground(&material, &|_| State::Dense)),
        };
        let mut levels = Levels::on(setup, material.clone(), under, powder).unwrap();
        levels.draw(&path, &beam(), &nothing(), &Silent).unwrap();
        let (left, Cooled { ledger, stored }) = levels.leave(rest, &Silent).unwrap();
        let off = ledger.residual(stored);
        assert!(off.abs() < 1e-4, "layer {layers}: {off}");
        assert!(ledger.radiated > 0.0);
        assert!((ledger.conducted != 0.0) == (beyond != Face::Insulated));
        let [mean, _] = left.top(0.0, [0.0; 2], &|_| true);
        ground = Some(left);
        mean
    };
    (1..=3).map(of_layer).collect()
}

/// With powder and radiation heat is accounted for in each layer; the top is warmer the more layers lie below, the shorter they
/// cool and the warmer the powder is. A face that is held at the start temperature carries nearly all of it away.
#[test]
fn layers_of_titanium_grow_warm() {
    let start = titanium().start;
    let warm = on_titanium(Face::Insulated, 0.3, start);
    let longer = on_titanium(Face::Insulated, 1.2, start);
    let cold = on_titanium(Face::Insulated, 0.3, start - 80.0);
    let held = on_titanium(Face::Imposed(start), 0.3, start);
    println!("{warm:.1?} {longer:.1?} {cold:.1?} {held:.1?} K");
    assert!(warm[0] > start + 50.0);
    for n in 0..3 {
        assert!(n == 0 || warm[n] > warm[n - 1] + 50.0);
        assert!(warm[n] > longer[n] && warm[n] > cold[n]);
        assert!((held[n] - start).abs() < 15.0);
    }
}

/// A layer that lies elsewhere is refused.
#[test]
fn a_layer_elsewhere_is_refused() {
    let material = Material::constant(0.025, 4e-3, 1000.0);
    let setup = plate(1, Surface::Insulated, Face::Insulated);
    let under = Ground::from(setup.ground(&material, &|_| State::Dense));
    let levels = Levels::on(setup, material.clone(), under, material.start).unwrap();
    let (left, _) = levels.leave(0.1, &Silent).unwrap();
    let mut moved = plate(2, Surface::Insulated, Face::Insulated);
    moved.covered = [[0.1, 0.0], [SIDE + 0.1, SIDE]];
    let refused = Levels::on(moved, material.clone(), left, material.start);
    assert!(refused.unwrap_err().to_string().contains("does not lie"));
}
