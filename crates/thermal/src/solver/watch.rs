//! What the reference solver shows besides highest temperatures: how long the cells near the build plane are molten and when
//! they freeze, and the temperature in time at chosen places. The same readings as those of the chart simulation.

use meltpath_geometry::math::DVec3;

use crate::grid::sample::{Sample, around};
use crate::grid::{Field, Grid};
use crate::solver::Solver;
use crate::solver::run::Sink;

/// Time between two looks, s; crossings are taken straight between them.
const LOOK: f64 = 1e-5;
/// Planes that are watched: the build plane, and the one below for the gradient's slope.
const PLANES: usize = 2;

/// What is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Watch {
    /// Places whose temperature is kept in time, mm.
    pub places: Vec<[f64; 3]>,
    /// Time between two samples of a place, s.
    pub every: f64,
}

/// How cells near the build plane froze while a layer was drawn; the two highest planes. Times count from the beginning of its
/// path.
#[derive(Debug, Clone, PartialEq)]
pub struct Freezing {
    /// Time above the liquidus, s.
    pub above: Field,
    /// When each last fell through the liquidus, s; not a number where it has not.
    pub fell: Field,
    /// How fast it then cooled, K/s; not a number where it did not.
    pub rate: Field,
}

/// The highest planes of a grid that are looked at.
pub(crate) fn upper(grid: &Grid) -> Grid {
    let heights = grid.heights[grid.planes().saturating_sub(PLANES)..].to_vec();
    let bottom = grid.top() - heights.iter().sum::<f64>();
    Grid {
        origin: DVec3::new(grid.origin.x, grid.origin.y, bottom),
        heights,
        ..*grid
    }
}

/// What was seen while the last layer was drawn. Times count from the beginning of its path.
#[derive(Debug, Clone, PartialEq)]
pub struct Watched {
    /// How the metal froze.
    pub freezing: Freezing,
    /// Temperatures at the places inside the grid, in order of time, straight between the centres of cells.
    pub samples: Vec<Sample>,
    /// Places outside the grid, mm.
    pub outside: Vec<[f64; 3]>,
}

/// Looks at a solver while it draws a path.
pub struct Watcher {
    planes: Grid,
    liquidus: f64,
    /// Heat capacity just above the liquidus, J/(mm³·K).
    capacity: f64,
    /// Time of the solver at the beginning of the path, s.
    begun: f64,
    last: f64,
    before: Vec<f64>,
    above: Vec<f64>,
    fell: Vec<f64>,
    rate: Vec<f64>,
    every: f64,
    due: f64,
    /// Places with the cells round them.
    places: Vec<([f64; 3], Around)>,
    outside: Vec<[f64; 3]>,
    samples: Vec<Sample>,
}

/// Cells and their weights.
type Around = Vec<([usize; 3], f64)>;

impl Watcher {
    /// A watcher of what `solver` draws from now on.
    pub fn new(watch: &Watch, solver: &Solver<f32>) -> Self {
        let grid = solver.grid();
        let planes = upper(grid);
        let liquidus = solver.material().liquidus;
        let cells = planes.len();
        let mut places = Vec::new();
        let mut outside = Vec::new();
        for place in &watch.places {
            match around(grid, *place) {
                Some(cells) => places.push((*place, cells)),
                None => outside.push(*place),
            }
        }
        Watcher {
            before: Self::enthalpies(solver).collect(),
            planes,
            liquidus: solver.curve().of(liquidus),
            capacity: solver.material().heat_capacity(liquidus + 1e-3),
            begun: solver.time(),
            last: solver.time(),
            above: vec![0.0; cells],
            fell: vec![f64::NAN; cells],
            rate: vec![f64::NAN; cells],
            every: watch.every,
            due: 0.0,
            places,
            outside,
            samples: Vec::new(),
        }
    }

    /// Enthalpies of the watched planes, in the order of the grid.
    fn enthalpies(solver: &Solver<f32>) -> impl Iterator<Item = f64> + '_ {
        let [nx, ny] = solver.grid().cells;
        let first = solver.grid().planes().saturating_sub(PLANES) * nx * ny;
        (first..solver.grid().len())
            .map(move |n| solver.enthalpy_at(n % nx, n / nx % ny, n / (nx * ny)))
    }

    /// What was seen.
    pub fn seen(self) -> Watched {
        let field = |values: &[f64]| Field {
            grid: self.planes.clone(),
            values: values.iter().map(|v| *v as f32).collect(),
        };
        Watched {
            freezing: Freezing {
                above: field(&self.above),
                fell: field(&self.fell),
                rate: field(&self.rate),
            },
            samples: self.samples,
            outside: self.outside,
        }
    }
}

impl Sink<f32> for Watcher {
    fn interval(&self) -> f64 {
        LOOK
    }

    fn look(&mut self, solver: &Solver<f32>) {
        let now = solver.time();
        let passed = now - self.last;
        let since = self.last - self.begun;
        for (n, g) in Self::enthalpies(solver).enumerate() {
            let was = std::mem::replace(&mut self.before[n], g);
            let (hot_before, hot) = (was > self.liquidus, g > self.liquidus);
            if !(hot_before || hot) {
                continue;
            }
            let share = if hot_before == hot {
                1.0
            } else {
                (self.liquidus - was) / (g - was)
            };
            self.above[n] += passed
                * match (hot_before, hot) {
                    (false, true) => 1.0 - share,
                    _ => share,
                };
            if hot_before && !hot {
                self.fell[n] = since + share * passed;
                self.rate[n] = (was - g) / (passed * self.capacity);
            }
        }
        let elapsed = now - self.begun;
        if elapsed >= self.due - 1e-12 {
            self.due += self.every * ((elapsed - self.due) / self.every).floor().max(0.0);
            self.due += self.every;
            let kelvin = |cells: &Around| {
                let at = |&([i, j, k], w): &([usize; 3], f64)| w * solver.temperature_at(i, j, k);
                cells.iter().map(at).sum()
            };
            self.samples
                .extend(self.places.iter().map(|(place, cells)| Sample {
                    place: *place,
                    time: elapsed,
                    value: kelvin(cells),
                }));
        }
        self.last = now;
    }
}
