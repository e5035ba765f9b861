//! Computes charts with the reference solver: a beam at rest over four arrangements of powder and metal.
//!
//! Béraud 2016, section 3.2.2.3; arrangements and grid: docs/theory/sources.md, charts.

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;
use rayon::prelude::*;

use crate::charts::{
    COOLING_POINTS, Chart, ChartSet, ChartSettings, CoolingCurve, HEATING_POINTS, HeatingCurve,
    WarmGround,
};
use crate::grid::Grid;
use crate::material::{CELSIUS, Material};
use crate::numeric::real::Real;
use crate::solver::source::Spot;
use crate::solver::surface::Surface;
use crate::solver::{Face, Faces, Solver, SolverError, State};

/// Metal between the powder layer and the powder below it in the third arrangement, mm.
const SLAB: f64 = 0.15;
/// Half the width and the depth of the solver's block, mm, at least; twice the heated zone where that is more.
const BLOCK: f64 = 0.5;
/// Heating is not followed longer than this, s: the solver's block is warm through by then.
const LONGEST_HEATING: f64 = 0.01;
/// Longest cooling followed, s.
const LONGEST_COOLING: f64 = 0.5;
/// Parts that the progress of one arrangement is told in.
const PARTS: u64 = 100;

/// Why charts could not be computed.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// A setting that no chart can have.
    #[error("{what} of the chart is {value}: {needed}")]
    Setting {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        needed: &'static str,
    },
    /// The beam is too weak for the temperature from which charts cool.
    #[error(
        "the hottest point has {reached:.0} °C after {} ms and never reaches {stop:.0} °C: lower the temperatures at which the charts stop and from which they cool, or use more power", LONGEST_HEATING * 1e3
    )]
    TooCold {
        /// Temperature reached, °C.
        reached: f64,
        /// Temperature from which the charts cool, °C.
        stop: f64,
    },
    /// The solver.
    #[error(transparent)]
    Solver(#[from] SolverError),
}

impl BuildError {
    fn check(settings: &ChartSettings, material: &Material) -> Result<(), Self> {
        let positive = [
            ("the power", settings.power),
            ("the spot", settings.spot),
            ("the efficiency", settings.efficiency),
            ("the layer", settings.layer),
            ("the cell", settings.cell),
            ("the radius of the heated zone", settings.radius),
            ("the depth of the heated zone", settings.reach),
        ];
        for (what, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(BuildError::Setting {
                    what,
                    value,
                    needed: "it must be finite and above zero",
                });
            }
        }
        if settings.stop <= material.liquidus || settings.stop > 4500.0 {
            return Err(BuildError::Setting {
                what: "the stop temperature (K)",
                value: settings.stop,
                needed: "it must lie between the liquidus and 4500 K",
            });
        }
        if settings.cooling_from <= material.liquidus || settings.cooling_from > settings.stop {
            return Err(BuildError::Setting {
                what: "the temperature from which the chart cools (K)",
                value: settings.cooling_from,
                needed: "it must lie between the liquidus and the stop temperature",
            });
        }
        if settings.cold <= material.start || settings.cold >= material.solidus {
            return Err(BuildError::Setting {
                what: "the temperature at which cooling ends (K)",
                value: settings.cold,
                needed: "it must lie between the start temperature and that from which charts cool",
            });
        }
        Ok(())
    }
}

/// An arrangement: what lies at a height above −∞ and below the build plane.
#[derive(Debug, Clone, Copy)]
enum Layout {
    Metal,
    FreshLayer,
    Slab,
    Powder,
}

impl Layout {
    fn state(self, depth: f64, layer: f64) -> State {
        let powder = match self {
            Layout::Metal => false,
            Layout::FreshLayer => depth < layer,
            Layout::Slab => depth < layer || depth > layer + SLAB,
            Layout::Powder => true,
        };
        if powder { State::Powder } else { State::Dense }
    }

    fn powder_share(self, settings: &ChartSettings) -> f64 {
        match self {
            Layout::Metal => 0.0,
            Layout::FreshLayer => settings.layer / settings.reach,
            Layout::Slab => (1.0 - SLAB / settings.reach).max(settings.layer / settings.reach),
            Layout::Powder => 1.0,
        }
    }
}

const LAYOUTS: [Layout; 4] = [
    Layout::Metal,
    Layout::FreshLayer,
    Layout::Slab,
    Layout::Powder,
];

/// Temperatures of the ground that histories are computed on for a simulation that remembers earlier lines, K: two of the
/// solid, one of the melt that a line comes back to soon.
pub fn warm_grounds(material: &Material) -> Vec<f64> {
    let solid = material.solidus - material.start;
    vec![
        material.start + 0.5 * solid,
        material.start + 0.95 * solid,
        material.liquidus + 0.25 * solid,
    ]
}

/// Computes the charts of one setting, over cold ground only; `observer` is told how far it is, in hundredths of each
/// arrangement.
///
/// # Errors
/// [`BuildError`], cancellation included.
pub fn compute(
    settings: &ChartSettings,
    material: &Material,
    observer: &dyn Observer,
) -> Result<ChartSet, BuildError> {
    BuildError::check(settings, material)?;
    // enough grid points for the interpolation to the rim of the heated zone
    let distances: Vec<f64> = (0..=(settings.radius / settings.cell).ceil() as usize)
        .map(|n| n as f64 * settings.cell)
        .collect();
    let depths: Vec<f64> = (0..=(settings.reach / settings.cell).ceil() as usize)
        .map(|n| (n as f64 + 0.5) * settings.cell)
        .collect();
    let charts = over(
        settings,
        material,
        material.start,
        [&depths, &distances],
        observer,
    )?;
    let fingerprint = crate::material::enthalpy::Enthalpy::new(material)
        .map_err(SolverError::from)?
        .fingerprint();
    Ok(ChartSet {
        settings: settings.clone(),
        material: material.name.clone(),
        fingerprint,
        depths,
        distances,
        charts,
        warm: Vec::new(),
    })
}

/// Adds histories over ground of the given temperatures (K, rising), each up to as much above the stop temperature as the
/// ground lies above the start temperature.
///
/// # Errors
/// [`BuildError`], cancellation included.
pub fn warm(
    set: &mut ChartSet,
    grounds: &[f64],
    material: &Material,
    observer: &dyn Observer,
) -> Result<(), BuildError> {
    let curve = crate::material::enthalpy::Enthalpy::new(material).map_err(SolverError::from)?;
    set.warm.clear();
    for &temperature in grounds {
        if !(temperature > material.start && temperature < set.settings.cooling_from - 100.0) {
            return Err(BuildError::Setting {
                what: "the temperature of the ground (K)",
                value: temperature,
                needed: "it must lie between the start temperature and that from which charts cool",
            });
        }
        let above = temperature - material.start;
        let settings = ChartSettings {
            stop: set.settings.stop + above,
            cold: set.settings.cold + above,
            ..set.settings.clone()
        };
        let grid = [set.depths.as_slice(), set.distances.as_slice()];
        set.warm.push(WarmGround {
            temperature,
            enthalpy: curve.of(temperature),
            charts: over(&settings, material, temperature, grid, observer)?,
        });
    }
    Ok(())
}

/// The four arrangements on ground of a temperature, K; depths and distances in `grid`.
fn over(
    settings: &ChartSettings,
    material: &Material,
    ground: f64,
    grid: [&[f64]; 2],
    observer: &dyn Observer,
) -> Result<Vec<Chart>, BuildError> {
    observer.stage(
        &format!(
            "charts of {:.0} W, beam {:.0} µm, ground at {:.0} °C",
            settings.heat(),
            1e3 * settings.spot,
            ground - CELSIUS
        ),
        PARTS * LAYOUTS.len() as u64,
    );
    LAYOUTS
        .par_iter()
        .map(|layout| one(settings, material, *layout, ground, grid, observer))
        .collect()
}

/// Enthalpies at the grid points, one row per moment.
struct Record {
    times: Vec<f64>,
    rows: Vec<Vec<f32>>,
}

impl Record {
    fn column(&self, n: usize) -> impl Iterator<Item = (f64, f64)> {
        self.times
            .iter()
            .zip(&self.rows)
            .map(move |(t, row)| (*t, f64::from(row[n])))
    }
}

fn one(
    settings: &ChartSettings,
    material: &Material,
    layout: Layout,
    ground: f64,
    [depths, distances]: [&[f64]; 2],
    observer: &dyn Observer,
) -> Result<Chart, BuildError> {
    let mut solver = block(settings, material, layout, ground)?;
    let from = solver.curve().of(ground);
    let spot = Spot {
        centre: [0.0, 0.0],
        diameter: settings.spot,
        power: settings.heat(),
        depth: settings.depth,
    };
    let dt = solver.stable_step().min(2.5e-6);
    let beam = spot.footprint(&solver.grid, &solver.depths);
    let plane = solver.block.plane();
    let top = solver.grid().planes() - 1;
    let place = |h: usize, r: usize| (top - h) * plane + r;
    let places: Vec<usize> = (0..depths.len())
        .flat_map(|h| (0..distances.len()).map(move |r| (h, r)))
        .map(|(h, r)| place(h, r))
        .collect();
    let look = |solver: &Solver<f32>, places: &[usize]| {
        let g = |n: &usize| (solver.block.enthalpy[*n].wide() - from) as f32;
        places.iter().map(g).collect::<Vec<f32>>()
    };
    let mut heating = Record {
        times: vec![0.0],
        rows: vec![look(&solver, &places)],
    };
    let mut told = 0;
    let mut tell = |share: f64| {
        let now = ((share * PARTS as f64) as u64).min(PARTS);
        observer.advance(now.saturating_sub(told));
        told = told.max(now);
    };
    let mut hot: Option<Solver<f32>> = None;
    while solver.hottest() < settings.stop {
        if heating.times.len().is_multiple_of(64) {
            observer.check().map_err(SolverError::from)?;
            // a tenth of the work is heating
            tell(0.1 * (solver.hottest() - ground) / (settings.stop - ground));
        }
        if solver.time() > LONGEST_HEATING {
            if hot.is_some() {
                // a wide or weak beam holds a steady pool below the stop temperature: its charts end there
                break;
            }
            return Err(BuildError::TooCold {
                reached: solver.hottest() - CELSIUS,
                stop: settings.cooling_from - CELSIUS,
            });
        }
        if hot.is_none() && solver.hottest() >= settings.cooling_from {
            hot = Some(solver.clone());
        }
        solver.step(dt, &[])?;
        solver.block.heat(&beam, spot.power * dt);
        heating.times.push(solver.time());
        heating.rows.push(look(&solver, &places));
    }
    let mut solver = hot.unwrap_or(solver);
    let axis: Vec<usize> = (0..depths.len()).map(|h| place(h, 0)).collect();
    let off = solver.time();
    let mut cooling = Record {
        times: vec![0.0],
        rows: vec![look(&solver, &axis)],
    };
    let all = (settings.cooling_from - settings.cold).ln_1p();
    while solver.hottest() > settings.cold && solver.time() - off < LONGEST_COOLING {
        if cooling.times.len().is_multiple_of(64) {
            observer.check().map_err(SolverError::from)?;
            let left = (solver.hottest() - settings.cold).max(0.0).ln_1p() / all;
            tell(1.0 - 0.9 * left);
        }
        solver.step(dt, &[])?;
        cooling.times.push(solver.time() - off);
        cooling.rows.push(look(&solver, &axis));
    }
    tell(1.0);
    Ok(Chart {
        powder_share: layout.powder_share(settings),
        heating: (0..places.len())
            .map(|n| heating_curve(heating.column(n)))
            .collect(),
        cooling: (0..axis.len())
            .map(|n| cooling_curve(&cooling.column(n).collect::<Vec<_>>()))
            .collect(),
    })
}

/// The solver's block: a quarter of what the beam heats, whose first column of cells lies under the axis of the beam.
fn block(
    settings: &ChartSettings,
    material: &Material,
    layout: Layout,
    ground: f64,
) -> Result<Solver<f32>, SolverError> {
    let edge = settings.cell;
    let half = BLOCK.max(1.5 * settings.radius);
    let cells = (half / edge).round() as usize + 1;
    let planes = (BLOCK.max(1.25 * settings.reach) / edge).round() as usize;
    let grid = Grid {
        origin: DVec3::new(-0.5 * edge, -0.5 * edge, -(planes as f64) * edge),
        cells: [cells, cells],
        edge: [edge, edge],
        heights: vec![edge; planes],
    };
    let faces = Faces {
        top: Surface::Radiating {
            surroundings: settings.surroundings,
        },
        sides: Face::Imposed(ground),
        bottom: Face::Imposed(ground),
    };
    let mut solver = Solver::new(grid, material.clone(), faces)?;
    solver.block.quarter = true;
    if ground < material.solidus {
        solver.set_state(|c| layout.state(-c.z, settings.layer));
    }
    solver.set_temperature(|_| ground);
    Ok(solver)
}

fn heating_curve(samples: impl Iterator<Item = (f64, f64)>) -> HeatingCurve {
    let mut highest = 0.0_f64;
    let rising: Vec<(f64, f64)> = samples
        .map(|(t, g)| {
            highest = highest.max(g);
            (t, highest)
        })
        .collect();
    let last = HEATING_POINTS - 1;
    let mut times = vec![0.0; HEATING_POINTS];
    let mut n = 1;
    for (i, time) in times.iter_mut().enumerate().skip(1) {
        let g = highest * i as f64 / last as f64;
        while n + 1 < rising.len() && rising[n].1 < g {
            n += 1;
        }
        let ((t0, g0), (t1, g1)) = (rising[n - 1], rising[n]);
        let share = if g1 > g0 { (g - g0) / (g1 - g0) } else { 1.0 };
        *time = (t0 + share.clamp(0.0, 1.0) * (t1 - t0)) as f32;
    }
    HeatingCurve {
        end: highest as f32,
        times,
    }
}

/// The part of a cooling history that falls, from where its relative rate has settled.
fn cooling_curve(samples: &[(f64, f64)]) -> CoolingCurve {
    let peak = samples.iter().enumerate().fold(
        0,
        |best, (n, s)| if s.1 > samples[best].1 { n } else { best },
    );
    let relative = |n: usize| {
        let ((t0, g0), (t1, g1)) = (samples[n], samples[n + 1]);
        (g0 - g1) / ((t1 - t0) * (0.5 * (g0 + g1)).max(1e-12))
    };
    let near = samples[peak..].partition_point(|s| s.1 > 0.8 * samples[peak].1) + peak;
    let fastest = (peak..near.min(samples.len() - 1))
        .map(relative)
        .fold(0.0, f64::max);
    let start = (peak..near.min(samples.len() - 1))
        .find(|n| relative(*n) >= 0.9 * fastest)
        .unwrap_or(peak);
    let falling = &samples[start..];
    let (from, to) = (falling[0].1, falling[falling.len() - 1].1.max(1e-9));
    let last = COOLING_POINTS - 1;
    let mut times = vec![0.0; COOLING_POINTS];
    let mut n = 1;
    for (i, time) in times.iter_mut().enumerate().skip(1) {
        let g = from + (to - from) * i as f64 / last as f64;
        while n + 1 < falling.len() && falling[n].1 > g {
            n += 1;
        }
        let index = n.min(falling.len() - 1);
        let ((t0, g0), (t1, g1)) = (falling[index.saturating_sub(1)], falling[index]);
        let share = if g0 > g1 { (g0 - g) / (g0 - g1) } else { 1.0 };
        *time = (t0 + share.clamp(0.0, 1.0) * (t1 - t0) - falling[0].0) as f32;
    }
    CoolingCurve {
        from: from as f32,
        to: to as f32,
        times,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::tests::titanium;

    #[test]
    fn a_quarter_heats_like_the_whole() {
        let material = titanium();
        let settings = ChartSettings {
            cell: 0.05,
            ..ChartSettings::for_beam(240.0, 0.4)
        };
        let spot = Spot {
            centre: [0.0, 0.0],
            diameter: settings.spot,
            power: settings.heat(),
            depth: settings.depth,
        };
        let layout = Layout::FreshLayer;
        let mut quarter = block(&settings, &material, layout, material.start).unwrap();
        let [n, _] = quarter.grid.cells;
        let far = quarter.grid.edge[0] * (n as f64 - 0.5);
        let grid = Grid {
            origin: DVec3::new(-far, -far, quarter.grid.origin.z),
            cells: [2 * n - 1, 2 * n - 1],
            ..quarter.grid.clone()
        };
        let mut whole = Solver::<f32>::new(grid, material.clone(), quarter.faces).unwrap();
        whole.set_state(|c| layout.state(-c.z, settings.layer));
        whole.set_temperature(|_| material.start);
        let beam = spot.footprint(&quarter.grid, &quarter.depths);
        let dt = quarter.stable_step();
        for step in 0..400 {
            let heated = step < 200;
            quarter.step(dt, &[]).unwrap();
            if heated {
                quarter.block.heat(&beam, spot.power * dt);
            }
            whole.step(dt, &[]).unwrap();
            if heated {
                whole.heat(&spot, dt).unwrap();
            }
        }
        assert!(whole.hottest() > 2000.0);
        for k in 0..quarter.grid.planes() {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let here = quarter.temperature_at(i, j, k);
                for (i, j) in [(n - 1 + i, n - 1 + j), (n - 1 - i, n - 1 + j)] {
                    let there = whole.temperature_at(i, j, k);
                    assert!((here - there).abs() < 0.05, "{i} {j} {k}: {here} {there}");
                }
            }
        }
    }
}
