//! The highest temperatures that a path leads to, and when the beam caused each: what strategies learn from.

use meltpath_base::Observer;

use crate::error::StrategyError;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::charts::simulation::ChartSimulation;
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::solver::Solver;
use meltpath_thermal::solver::run::{Sink, draw};

/// Highest temperatures and when they were reached.
#[derive(Debug, Clone)]
pub struct Peaks {
    /// Highest temperatures, K.
    pub highest: Field,
    /// Time of the path at which each column's top voxel was hottest, s, row by row; not a number where the beam never came
    /// near.
    pub when: Vec<f64>,
}

/// What draws a path and tells the highest temperatures it leads to, always from the same start: charts or the reference
/// solver, see [`with_charts`] and [`with_reference`].
pub type Draw<'a> = dyn FnMut(&BeamPath, &dyn Observer) -> Result<Peaks, StrategyError> + 'a;

/// How far from the beam a voxel may still grow hotter, mm: pools are a millimetre long.
const REACH: f64 = 0.8;
/// Time between two looks, s: the beam moves by less than a voxel.
const LOOK: f64 = 2e-5;

/// Which columns of a grid the path crosses with the beam on, row by row.
///
/// Where lines lie so far apart that what lies between them must stay colder than a window is wide, only these can be taught.
pub fn crossed(grid: &Grid, path: &BeamPath) -> Vec<bool> {
    let [nx, ny] = grid.cells;
    let mut found = vec![false; nx * ny];
    let heats = |w: &&[BeamPoint]| w[0].is_on() && w[1].time > w[0].time;
    for pair in path.points().windows(2).filter(heats) {
        let (from, to) = ([pair[0].x, pair[0].y], [pair[1].x, pair[1].y]);
        let way = (to[0] - from[0]).hypot(to[1] - from[1]);
        let pieces = (4.0 * way / grid.edge[0].min(grid.edge[1])).ceil().max(1.0) as usize;
        for n in 0..=pieces {
            let share = n as f64 / pieces as f64;
            let at = |a: usize, origin: f64| {
                let p = from[a] + share * (to[a] - from[a]);
                ((p - origin) / grid.edge[a]).floor()
            };
            let (i, j) = (at(0, grid.origin.x), at(1, grid.origin.y));
            if i >= 0.0 && j >= 0.0 && i < nx as f64 && j < ny as f64 {
                found[j as usize * nx + i as usize] = true;
            }
        }
    }
    found
}

/// Remembers when each column was hottest.
struct Recorder {
    best: Vec<f64>,
    when: Vec<f64>,
}

impl Recorder {
    fn new(grid: &Grid) -> Self {
        let columns = grid.cells[0] * grid.cells[1];
        Recorder {
            best: vec![f64::NEG_INFINITY; columns],
            when: vec![f64::NAN; columns],
        }
    }

    fn look(
        &mut self,
        grid: &Grid,
        beam: [f64; 2],
        time: f64,
        warmth: impl Fn(usize, usize) -> f64,
    ) {
        let origin = [grid.origin.x, grid.origin.y];
        let range = |a: usize| {
            let index = |at: f64| (at.max(0.0) as usize).min(grid.cells[a]);
            let middle = (beam[a] - origin[a]) / grid.edge[a];
            let reach = REACH / grid.edge[a];
            index(middle - reach)..index(middle + reach + 1.0)
        };
        for j in range(1) {
            for i in range(0) {
                let column = j * grid.cells[0] + i;
                let now = warmth(i, j);
                if now > self.best[column] {
                    self.best[column] = now;
                    self.when[column] = time;
                }
            }
        }
    }
}

/// Draws with charts, from the state of `start`.
pub fn with_charts(
    start: &ChartSimulation,
) -> impl FnMut(&BeamPath, &dyn Observer) -> Result<Peaks, StrategyError> + '_ {
    move |path, observer| {
        let mut simulation = start.clone();
        let grid = simulation.grid().clone();
        let mut recorder = Recorder::new(&grid);
        let top = grid.planes() - 1;
        // looks end batches: as long as a batch, so that none is cut
        let settings = simulation.settings();
        let every = settings.step * settings.batch as f64;
        let count = ((path.end() - path.begin()) / every).ceil() as u64;
        let mut at: Vec<f64> = (1..=count)
            .map(|n| (path.begin() + n as f64 * every).min(path.end()))
            .collect();
        // what a spot heats is hottest at its end
        let rests: Vec<f64> = path.rests().map(|[_, end]| end).collect();
        let back = if rests.is_empty() {
            0.0
        } else {
            0.5 * settings.step
        };
        at.extend(rests);
        at.sort_by(f64::total_cmp);
        at.dedup();
        let mut look = |time: f64, s: &ChartSimulation| {
            // of a look at the end of a spot the time lies on the spot
            let time = time - back;
            let p = path.at(time);
            recorder.look(&grid, [p.x, p.y], time, |i, j| s.temperature_at(i, j, top));
        };
        simulation.draw(path, &at, &mut look, observer)?;
        Ok(Peaks {
            highest: simulation.highest_temperature(),
            when: recorder.when,
        })
    }
}

struct Listener<'a> {
    recorder: Recorder,
    path: &'a BeamPath,
    /// Time of the path at time 0 of the solver, s.
    shift: f64,
    /// When the beam's rests end, s: what a spot heats is hottest then.
    ends: Vec<f64>,
    /// Time at the step before, and when the next look is due at the latest, s.
    before: f64,
    due: f64,
}

impl<'a> Listener<'a> {
    fn new(solver: &Solver<f32>, path: &'a BeamPath) -> Self {
        Listener {
            recorder: Recorder::new(solver.grid()),
            path,
            shift: path.begin() - solver.time(),
            ends: path.rests().map(|[_, end]| end).collect(),
            before: path.begin(),
            due: path.begin(),
        }
    }

    /// Whether to look after the step from `before` to `time`, and where the beam then was.
    fn due(&mut self, time: f64) -> Option<f64> {
        if self.ends.is_empty() {
            return Some(time);
        }
        let step = time - self.before;
        let midway = time - 0.5 * step;
        self.before = time;
        // the rest that the middle of the step lies in ends before that of the next one
        let rest = self.ends.partition_point(|end| *end <= midway);
        let last = self.ends.get(rest).is_some_and(|end| *end <= midway + step);
        if !last && time < self.due {
            return None;
        }
        self.due = time + LOOK;
        Some(midway)
    }
}

impl Sink<f32> for Listener<'_> {
    fn interval(&self) -> f64 {
        if self.ends.is_empty() { LOOK } else { 0.0 }
    }

    fn look(&mut self, solver: &Solver<f32>) {
        let Some(time) = self.due(solver.time() + self.shift) else {
            return;
        };
        let p = self.path.at(time);
        let top = solver.grid().planes() - 1;
        // enthalpy grows with temperature, and needs no table
        let warmth = |i, j| solver.enthalpy_at(i, j, top);
        self.recorder.look(solver.grid(), [p.x, p.y], time, warmth);
    }
}

/// Draws with the reference solver in explicit steps of at most `step` s, from the state of `start`. The top plane of the field holds
/// the means over the uppermost `layer` mm.
pub fn with_reference<'a>(
    start: &'a Solver<f32>,
    beam: &'a Beam,
    step: f64,
    layer: f64,
) -> impl FnMut(&BeamPath, &dyn Observer) -> Result<Peaks, StrategyError> + 'a {
    move |path, observer| {
        let mut solver = start.clone();
        let mut listener = Listener::new(&solver, path);
        draw(
            &mut solver,
            path,
            beam,
            step,
            &mut [&mut listener],
            observer,
        )?;
        Ok(Peaks {
            highest: solver.highest_temperature().over_layer(layer),
            when: listener.recorder.when,
        })
    }
}
