//! H-infinity synthesis on 246 stored plants (tables/synthesis.json): random ones, SLICOT's published example, galvanometers,
//! and plants of the COMPleib kind. `gamma` is the level SLICOT reaches (tables/make_synthesis.py), `exact` the level in arithmetic
//! of 256 bits (tables/exact_levels.py).

use meltpath_control::h_infinity::{
    GeneralizedPlant, Obstacle, Synthesis, SynthesisError, SynthesisOptions, synthesise,
};
use meltpath_control::{Complex64, Matrix, StateSpace, frequency};
use serde::Deserialize;

#[derive(Deserialize)]
struct Table {
    plants: Vec<Plant>,
}

#[derive(Deserialize)]
struct Plant {
    name: String,
    controls: usize,
    measurements: usize,
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    c: Vec<Vec<f64>>,
    d: Vec<Vec<f64>>,
    gamma: f64,
    exact: f64,
}

fn matrix(rows: &[Vec<f64>]) -> Matrix {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

impl Plant {
    fn build(&self) -> GeneralizedPlant {
        let system = StateSpace::continuous(
            matrix(&self.a),
            matrix(&self.b),
            matrix(&self.c),
            matrix(&self.d),
        )
        .unwrap();
        GeneralizedPlant::new(system, self.controls, self.measurements).unwrap()
    }
}

fn plants() -> Vec<Plant> {
    let text = include_str!("../tables/synthesis.json");
    let table: Table = serde_json::from_str(text).unwrap();
    assert!(table.plants.len() >= 200);
    table.plants
}

/// The controller at this multiple of the smallest level there is.
fn at(plant: &Plant, margin: f64) -> Result<Synthesis, SynthesisError> {
    let options = SynthesisOptions {
        margin,
        ..SynthesisOptions::default()
    };
    synthesise(&plant.build(), &options)
}

/// Names of the plants for which `holds` returns a complaint, with it.
fn complaints(holds: impl Fn(&Plant) -> Option<String>) -> Vec<String> {
    plants()
        .iter()
        .filter_map(|p| holds(p).map(|why| format!("{}: {why}", p.name)))
        .collect()
}

/// A grid (rad/s, ascending) that resolves every root of a continuous system: `per_decade` points a decade from a tenth of
/// the slowest root to ten times the fastest, and a cluster as wide as the resonance round every lightly damped root.
fn round_roots(roots: &[Complex64], per_decade: usize) -> Vec<f64> {
    let sizes = roots.iter().map(|r| r.norm()).filter(|&r| r > 0.0);
    let (low, high) = sizes.fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(r), h.max(r)));
    let (low, high) = if high > 0.0 {
        (low / 10.0, high * 10.0)
    } else {
        (0.01, 100.0)
    };
    let decades = (high / low).log10();
    let mut grid =
        frequency::logarithmic(low, high, (decades * per_decade as f64).ceil() as usize + 2);
    for root in roots {
        let (width, centre) = (root.re.abs(), root.im.abs());
        if centre > 0.0 && width < 0.5 * centre {
            // the peak of |1/(s − p)| lies at the centre; its flanks are resolved geometrically
            let mut offset = 0.02 * width.max(1e-6 * centre);
            grid.push(centre);
            while offset < 0.3 * centre {
                grid.push(centre - offset);
                grid.push(centre + offset);
                offset *= 1.25;
            }
        }
    }
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

#[test]
fn lpbf_ac30_levels_are_exact() {
    let wrong = complaints(|p| {
        let design = match synthesise(&p.build(), &SynthesisOptions::default()) {
            Ok(design) => design,
            Err(error) => return Some(error.to_string()),
        };
        // one plant of the table can be controlled perfectly
        let right = (design.optimum - p.exact).abs() <= 1e-5 * p.exact + 1e-9;
        (!right).then(|| format!("{} instead of {}", design.optimum, p.exact))
    });
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn lpbf_ac30_slicot_agrees_or_stops_early() {
    let all = plants();
    let early: Vec<&Plant> = all
        .iter()
        .filter(|p| p.gamma > p.exact * (1.0 + 1e-5) + 1e-9)
        .collect();
    // SLICOT's controllers break their bound in double precision before the level is reached
    assert_eq!((all.len(), early.len()), (246, 39));
    assert!(all.iter().all(|p| p.gamma >= p.exact * (1.0 - 1e-5) - 1e-9));
    // ours keep a bound that SLICOT does not reach
    for p in early {
        // at 0.9 of the way; where that controller breaks its bound by rounding, a little beside it
        let design = [0.9, 0.95, 0.97, 0.98, 0.99, 0.8, 0.7, 0.5]
            .map(|share| (1.0 - share) * p.exact + share * p.gamma)
            .into_iter()
            .find_map(|level| {
                let design = at(p, level / p.exact).ok()?;
                (design.peak.bound < p.gamma).then_some(design)
            });
        assert!(design.is_some(), "{}", p.name);
    }
}

#[test]
fn lpbf_ac30_closed_loops_keep_their_bounds() {
    let wrong = complaints(|p| {
        let plant = p.build();
        let design = match synthesise(&plant, &SynthesisOptions::default()) {
            Ok(design) => design,
            Err(error) => return Some(error.to_string()),
        };
        // one plant of the table can be controlled perfectly: nothing is close to its level
        let close = (p.exact > 0.0).then(|| at(p, 1.001)).transpose();
        let close = match close {
            Ok(close) => close,
            Err(error) => return Some(error.to_string()),
        };
        for (k, limit) in std::iter::once((&design, 1.01)).chain(close.iter().map(|k| (k, 1.001))) {
            let limit = limit * design.optimum.max(1e-9) * (1.0 + 1e-6);
            // the loop is closed again from the controller as delivered, and its peak looked for on a grid of its own
            let loop_ = plant.closed_by(&k.controller).unwrap();
            let poles = loop_.poles().unwrap();
            if let Some(pole) = poles.iter().find(|pole| pole.re >= 0.0) {
                return Some(format!("pole at {pole}"));
            }
            let peak = round_roots(&poles, 60)
                .into_iter()
                .map(|omega| {
                    meltpath_numerics::dense::largest_singular_value(&loop_.response(omega))
                })
                .fold(0.0, f64::max);
            if peak > limit || k.peak.gain > limit {
                return Some(format!("{peak}, {} above {limit}", k.peak.gain));
            }
        }
        None
    });
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn lpbf_ac30_lower_levels_are_refused_with_the_reason() {
    let wrong = complaints(|p| {
        if p.exact == 0.0 {
            return None;
        }
        match at(p, 0.999) {
            Err(SynthesisError::Infeasible { obstacle, .. }) => match obstacle {
                Obstacle::DirectGain { floor } if floor < 0.998 * p.exact => {
                    Some(obstacle.to_string())
                }
                _ => None,
            },
            other => Some(format!("{:?}", other.map(|k| k.peak))),
        }
    });
    assert!(wrong.is_empty(), "{wrong:#?}");
}
