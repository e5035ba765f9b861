//! The reference solver: transient heat with phase change on a uniform grid, by enthalpy, explicit in time.
//!
//! Finite volumes in `g` and `θ` (see [`crate::material::enthalpy`]), harmonic shares of conductivity between cells, heat source
//! integrated exactly over cells. Second order in space, first order in time; every joule is in the [`Ledger`].

mod block;
pub(crate) mod kernel;
pub mod ledger;
pub mod run;
pub mod source;
pub(crate) mod steam;
pub mod surface;
pub mod watch;
mod window;

use meltpath_geometry::math::DVec3;

use crate::grid::{Field, Grid, GridError, TemperatureField};
use crate::material::Material;
use crate::material::enthalpy::{CurveError, Enthalpy};
use crate::numeric::real::Real;
use crate::solver::block::{Beyond, Block, Shape};
use crate::solver::ledger::Ledger;
use crate::solver::source::Spot;
use crate::solver::steam::{Around, Lift};
use crate::solver::surface::{BuildPlane, Losses, Surface};

/// What lets rows sleep.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sleep {
    /// Enthalpy below which a cell is as at the start, J/mm³.
    cold: f64,
    /// Steps since the last look.
    since: u32,
}

/// What a lateral or the lower face of the domain does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Face {
    /// No heat flows.
    Insulated,
    /// The face is at this temperature, K.
    Imposed(f64),
}

/// The state of matter a cell starts in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Powder as it lies before the beam comes.
    Powder,
    /// Dense metal.
    Dense,
}

/// Why the solver refused.
#[derive(Debug, thiserror::Error)]
pub enum SolverError {
    /// The grid.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The material.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// The explicit scheme would blow up.
    #[error(
        "a time step of {step:.3e} s is unstable on cells of {edge:?} mm: use at most {limit:.3e} s, or larger cells"
    )]
    Step {
        /// The step asked for, s.
        step: f64,
        /// The largest stable one, s.
        limit: f64,
        /// Smallest cell edges, mm.
        edge: [f64; 3],
    },
    /// The beam is outside the domain.
    #[error(
        "at {time:.6} s the beam at ({x:.3}, {y:.3}) mm leaves {share:.1} % of its power outside the domain {low:?} to {high:?} mm: enlarge the domain (0.5 mm beyond the path is usual) or move the path"
    )]
    Outside {
        /// When, s.
        time: f64,
        /// Where, mm.
        x: f64,
        /// Where, mm.
        y: f64,
        /// Share of the power outside, %.
        share: f64,
        /// Lowest corner, mm.
        low: [f64; 2],
        /// Highest corner, mm.
        high: [f64; 2],
    },
    /// A layer that is not whole planes of cells.
    #[error(
        "a layer of {thickness} mm on planes of {plane} mm: the layer must be a whole number of planes"
    )]
    Layer {
        /// Thickness, mm.
        thickness: f64,
        /// Height of the top plane, mm.
        plane: f64,
    },
    /// A value that is not finite or not above zero.
    #[error("{what} is {value}: it must be finite and above zero")]
    Value {
        /// What.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] meltpath_base::Cancelled),
}

/// What surrounds the domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Faces {
    /// The build plane.
    pub top: Surface,
    /// The four lateral faces.
    pub sides: Face,
    /// The lower face.
    pub bottom: Face,
}

/// Temperature, phase and relative density of every cell, and how they change. `R` is the precision of the fields.
#[derive(Debug, Clone)]
pub struct Solver<R: Real = f32> {
    pub(crate) grid: Grid,
    pub(crate) depths: Vec<f64>,
    pub(crate) material: Material,
    pub(crate) curve: Enthalpy,
    pub(crate) losses: Losses<R>,
    pub(crate) faces: Faces,
    pub(crate) block: Block<R>,
    pub(crate) time: f64,
    pub(crate) ledger: Ledger,
    /// How much hotter than its cells the surface is, [`source::Depth::lift`] of the last spot, mm.
    lift: f64,
    sleep: Option<Sleep>,
    pub(crate) updates: u64,
    stored_at_start: f64,
}

impl<R: Real> Solver<R> {
    /// A solver whose cells are all dense and at the material's start temperature.
    ///
    /// # Errors
    /// [`SolverError::Grid`] and [`SolverError::Curve`].
    pub fn new(grid: Grid, material: Material, faces: Faces) -> Result<Self, SolverError> {
        grid.check()?;
        let curve = Enthalpy::new(&material)?;
        let shape = Shape {
            cells: grid.cells,
            edge: grid.edge,
            heights: grid.heights.clone(),
        };
        let mut solver = Solver {
            depths: grid.depths(),
            losses: Losses::new(
                &faces.top,
                &material,
                &curve,
                grid.heights[grid.planes() - 1],
            ),
            block: Block::new(&shape, curve.formulas()),
            grid,
            material,
            curve,
            faces,
            time: 0.0,
            ledger: Ledger::default(),
            lift: 0.0,
            sleep: None,
            updates: 0,
            stored_at_start: 0.0,
        };
        solver.stored_at_start = solver.stored_absolute();
        Ok(solver)
    }

    /// The cells.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The material.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Enthalpy curves of the material.
    pub fn curve(&self) -> &Enthalpy {
        &self.curve
    }

    /// Time since the solver was made, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Where the heat went.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    fn reset(&mut self) {
        let now = self.stored();
        self.ledger.reset += now - self.ledger.net();
    }

    /// Sets the state of matter of every cell from its centre.
    pub fn set_state(&mut self, state: impl Fn(DVec3) -> State) {
        let fresh = R::of(self.material.relative_density(self.material.start));
        self.each_cell(|solver, n, centre| {
            solver.block.density[n] = match state(centre) {
                State::Powder => fresh,
                State::Dense => R::ONE,
            };
        });
        self.block.mark_powder();
        self.reset();
    }

    /// Sets the temperature of every cell from its centre, K; powder hotter than it has been becomes denser.
    pub fn set_temperature(&mut self, kelvin: impl Fn(DVec3) -> f64) {
        self.each_cell(|solver, n, centre| {
            let g = R::of(solver.curve.of(kelvin(centre)));
            solver.block.enthalpy[n] = g;
            solver.block.highest[n] = g;
            let r = solver.block.density[n];
            solver.block.density[n] = solver.block.formulas.relative_density(g).larger(r);
        });
        self.block.mark_powder();
        self.wake_all();
        self.reset();
    }

    fn each_cell(&mut self, mut f: impl FnMut(&mut Self, usize, DVec3)) {
        let [nx, ny] = self.grid.cells;
        for k in 0..self.grid.planes() {
            let corner = self.grid.centre(0, 0, k);
            for j in 0..ny {
                for i in 0..nx {
                    let offset = DVec3::new(
                        i as f64 * self.grid.edge[0],
                        j as f64 * self.grid.edge[1],
                        0.0,
                    );
                    f(self, (k * ny + j) * nx + i, corner + offset);
                }
            }
        }
    }

    /// The largest stable explicit time step, s: the worst diffusivity of the laws on the smallest cells, with a
    /// margin for powder, which is never molten, beside dense metal.
    pub fn stable_step(&self) -> f64 {
        stable_step(&self.material, &self.curve, self.smallest_edges())
    }

    fn smallest_edges(&self) -> [f64; 3] {
        let dz = self
            .grid
            .heights
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        [self.grid.edge[0], self.grid.edge[1], dz]
    }

    /// One explicit step of `dt` seconds under `spots`.
    ///
    /// # Errors
    /// [`SolverError::Step`] where the step is unstable, [`SolverError::Outside`] where a spot misses the domain.
    pub fn step(&mut self, dt: f64, spots: &[Spot]) -> Result<(), SolverError> {
        let limit = self.stable_step();
        if !(dt > 0.0 && dt <= limit * 1.06) {
            return Err(SolverError::Step {
                step: dt,
                limit,
                edge: self.smallest_edges(),
            });
        }
        self.look_for_rows(spots);
        let planes = self.block.planes() - self.block.frozen;
        self.updates += (planes * self.block.awake_rows() * self.grid.cells[0]) as u64;
        let sides = self.beyond(self.faces.sides);
        let bottom = self.beyond(self.faces.bottom);
        self.block.refresh(sides);
        self.conduct_out(dt, sides, bottom);
        // before the losses, so that these see it: vapour that lags lets a small spot grow too hot
        for spot in spots {
            self.heat(spot, dt)?;
        }
        self.block.advance(dt, bottom);
        self.lose(dt);
        self.time += dt;
        Ok(())
    }

    pub(crate) fn beyond(&self, face: Face) -> Beyond {
        match face {
            Face::Insulated => Beyond::Nothing,
            Face::Imposed(kelvin) => Beyond::Imposed(self.curve.kirchhoff_at(kelvin)),
        }
    }

    pub(crate) fn heat(&mut self, spot: &Spot, dt: f64) -> Result<(), SolverError> {
        if spot.power == 0.0 {
            return Ok(());
        }
        if !(spot.diameter > 0.0 && spot.diameter.is_finite()) {
            return Err(SolverError::Value {
                what: "the beam diameter",
                value: spot.diameter,
            });
        }
        let footprint = spot.footprint(&self.grid, &self.depths);
        let total = footprint.total();
        if total.is_nan() || total <= 0.5 {
            let low = [self.grid.origin.x, self.grid.origin.y];
            return Err(SolverError::Outside {
                time: self.time,
                x: spot.centre[0],
                y: spot.centre[1],
                share: 100.0 * (1.0 - total),
                low,
                high: std::array::from_fn(|a| {
                    low[a] + self.grid.cells[a] as f64 * self.grid.edge[a]
                }),
            });
        }
        let joules = spot.power * dt;
        self.ledger.absorbed += joules * total;
        self.ledger.missed += joules * (1.0 - total);
        self.lift = spot.depth.lift(self.grid.heights[self.grid.planes() - 1]);
        self.block.heat(&footprint, joules);
        Ok(())
    }

    /// Radiation and evaporation of the top plane.
    pub(crate) fn lose(&mut self, dt: f64) {
        if self.losses.none {
            return;
        }
        let top = self.block.planes() - 1;
        let height = self.grid.heights[top];
        let under = top.saturating_sub(1);
        let mut lift = Lift::new(self.lift, dt, [height, self.grid.heights[under]]);
        if top == 0 {
            lift.below = R::ZERO;
        }
        let plane = self.block.plane();
        let area = self.grid.edge[0] * self.grid.edge[1];
        let block = &mut self.block;
        let [nx, ny] = block.shape.cells;
        let below = block.theta[under * (nx + 2) * (ny + 2)..]
            .chunks_exact(nx + 2)
            .skip(1);
        let below: Vec<R> = below
            .take(ny)
            .flat_map(|row| &row[1..=nx])
            .copied()
            .collect();
        for rows in &block.awake {
            let columns = rows.start * nx..rows.end * nx;
            let cells = top * plane + columns.start..top * plane + columns.end;
            let plane = BuildPlane {
                formulas: &block.formulas,
                level: block.level,
                passed: dt,
                height,
                area,
                enthalpy: &mut block.enthalpy[cells.clone()],
                density: &mut block.density[cells],
                around: Around {
                    lift,
                    arrived: &block.arrived[columns.clone()],
                    below: &below[columns],
                },
            };
            self.losses.take(plane, &mut self.ledger);
        }
        self.block.arrived.fill(R::ZERO);
    }

    /// Counts the heat that leaves through imposed faces in this step.
    fn conduct_out(&mut self, dt: f64, sides: Beyond, bottom: Beyond) {
        let [nx, ny] = self.grid.cells;
        let [dx, dy] = self.grid.edge;
        let ghost = self.block.ghost_plane();
        let stride = nx + 2;
        let mut out = 0.0;
        // rows counted from 1, as with their ghosts
        let awake = || self.block.awake.iter().cloned().flatten().map(|j| j + 1);
        if let Beyond::Imposed(face) = sides {
            for k in self.block.frozen..self.block.planes() {
                let theta = &self.block.theta[k * ghost..][..ghost];
                let share = &self.block.conduction[k * ghost..][..ghost];
                let row = |j: usize| j * stride + 1..j * stride + 1 + nx;
                let mut along_x = 0.0;
                for n in awake().flat_map(|j| [j * stride + 1, j * stride + nx]) {
                    along_x += share[n].wide() * (theta[n].wide() - face);
                }
                let along_y: f64 = awake()
                    .filter(|j| *j == 1 || *j == ny)
                    .map(|j| flow(&share[row(j)], &theta[row(j)], face))
                    .sum();
                out += 2.0 * self.grid.heights[k] * (along_x * dy / dx + along_y * dx / dy);
            }
        }
        if let Beyond::Imposed(face) = bottom {
            let k = self.block.frozen;
            let mut sum = 0.0;
            for j in awake() {
                let row = k * ghost + j * stride + 1..k * ghost + j * stride + 1 + nx;
                sum += flow(
                    &self.block.conduction[row.clone()],
                    &self.block.theta[row],
                    face,
                );
            }
            out += 2.0 * sum * dx * dy / self.grid.heights[k];
        }
        self.ledger.conducted += out * dt;
    }

    /// Heat in the domain above its beginning, J.
    pub fn stored(&self) -> f64 {
        self.stored_absolute() - self.stored_at_start
    }

    fn stored_absolute(&self) -> f64 {
        let plane = self.block.plane();
        let mut sum = 0.0;
        for k in 0..self.block.planes() {
            let mut of_plane = 0.0;
            for n in k * plane..(k + 1) * plane {
                let (g, r) = (self.block.enthalpy[n].wide(), self.block.density[n].wide());
                of_plane += self.curve.stored(g, r);
            }
            sum += of_plane * self.grid.volume(k);
        }
        sum
    }

    /// Puts a layer of fresh powder on top and brings everything back to the start temperature, as after raking and
    /// consolidation; cells keep their state of matter, highest temperatures begin anew (Béraud 2016, section 3.2.2.1.2).
    ///
    /// # Errors
    /// [`SolverError::Layer`] where the layer is not a whole number of planes.
    pub fn add_layer(&mut self, thickness: f64) -> Result<(), SolverError> {
        let height = self.grid.heights[self.grid.planes() - 1];
        let planes = (thickness / height).round();
        if !(planes >= 1.0 && (planes * height - thickness).abs() < 1e-6 * height) {
            return Err(SolverError::Layer {
                thickness,
                plane: height,
            });
        }
        let before = self.block.density.len();
        let new = vec![height; planes as usize];
        self.grid.heights.extend_from_slice(&new);
        self.block.append(&new);
        let fresh = R::of(self.material.relative_density(self.material.start));
        self.block.density[before..].fill(fresh);
        self.block.enthalpy.fill(R::ZERO);
        self.block.highest.fill(R::ZERO);
        self.block.mark_powder();
        self.wake_all();
        self.depths = self.grid.depths();
        self.reset();
        Ok(())
    }

    /// Computes only what lies within `depth` mm of the build plane; the rest keeps its state and acts as an imposed or
    /// insulated lower face. For tall builds, after [`Solver::add_layer`].
    pub fn freeze_below(&mut self, depth: f64) {
        self.block.frozen = self
            .depths
            .iter()
            .take_while(|d| **d >= depth)
            .count()
            .min(self.grid.planes() - 1);
    }

    fn field(&self, value: impl Fn(usize) -> f64) -> Field {
        Field {
            grid: self.grid.clone(),
            values: (0..self.block.enthalpy.len())
                .map(|n| value(n) as f32)
                .collect(),
        }
    }

    /// Temperatures, K.
    pub fn temperature(&self) -> TemperatureField {
        self.field(|n| self.curve.temperature(self.block.enthalpy[n].wide()))
    }

    /// Highest temperatures since the layer began, K.
    pub fn highest_temperature(&self) -> TemperatureField {
        self.field(|n| {
            let g = self.block.highest[n].larger(self.block.enthalpy[n]);
            self.curve.temperature(g.wide())
        })
    }

    /// Relative densities, 1 for metal that is or was molten.
    pub fn relative_density(&self) -> Field {
        self.field(|n| self.block.density[n].wide())
    }

    /// Temperature of cell `(i, j, k)`, K.
    pub fn temperature_at(&self, i: usize, j: usize, k: usize) -> f64 {
        self.curve.temperature(self.enthalpy_at(i, j, k))
    }

    /// Enthalpy of cell `(i, j, k)` as if it were dense, J/mm³.
    pub fn enthalpy_at(&self, i: usize, j: usize, k: usize) -> f64 {
        let [nx, ny] = self.grid.cells;
        self.block.enthalpy[(k * ny + j) * nx + i].wide()
    }

    /// The hottest temperature anywhere, K.
    pub fn hottest(&self) -> f64 {
        let plane = self.block.plane();
        let top = self.block.enthalpy[self.block.frozen * plane..]
            .iter()
            .fold(R::of(f64::MIN / 2.0), |a, b| a.larger(*b));
        self.curve.temperature(top.wide())
    }
}

/// The largest stable explicit step on cells of these edges, mm; see [`Solver::stable_step`].
pub(crate) fn stable_step(material: &Material, curve: &Enthalpy, [dx, dy, dz]: [f64; 3]) -> f64 {
    let worst = (curve.diffusivity_solid * material.powder_contrast()).max(curve.diffusivity_max);
    let rate = 2.0 * worst * (dx.powi(-2) + dy.powi(-2) + dz.powi(-2));
    0.95 / rate
}

/// `Σ c (θ − face)` over a row of cells, in eight sums so that they do not wait for each other.
fn flow<R: Real>(share: &[R], theta: &[R], face: f64) -> f64 {
    let mut sums = [0.0; 8];
    for (share, theta) in share.chunks(8).zip(theta.chunks(8)) {
        for (sum, (c, t)) in sums.iter_mut().zip(share.iter().zip(theta)) {
            *sum += c.wide() * (t.wide() - face);
        }
    }
    sums.iter().sum()
}
