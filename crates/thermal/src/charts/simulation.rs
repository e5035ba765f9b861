//! Draws a beam path with charts: every voxel near the beam follows the history of a point near a beam at rest.
//!
//! Béraud 2016, section 3.2.3.2 and annex E, with the corrections of docs/theory/sources.md. Only voxels in the
//! heated zone are computed step by step; the others cool by a closed form when they are next looked at. Powder counts are
//! brought up to date between batches of a few steps, within which columns do not see each other and may run on any
//! thread: the bits do not depend on how many there are.

mod batch;
mod ground;
mod readings;
mod refusal;

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;
use rayon::prelude::*;

use crate::beam::{BeamPath, BeamPoint};
use crate::charts::neighbourhood::Neighbourhood;
use crate::charts::rates::{PastTheEnd, Rates};
use crate::charts::{ChartError, ChartSet};
use crate::grid::Grid;
use crate::material::Material;
use crate::material::enthalpy::Enthalpy;
use crate::material::medium::Body;
use crate::solver::State;

use batch::{Batch, Column, Step, Under, Voxel};
use ground::{Deposit, Ground};
pub use refusal::ChartSimulationError;
use refusal::check_step;

/// What the ground keeps of earlier beam positions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Memory {
    /// Nothing beyond what the charts themselves cool by: the thesis' model.
    #[default]
    None,
    /// The heat of the path so far, spread in this body.
    Ground(Body),
}

/// How a simulation is carried out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Time step, s; the beam rests during one.
    pub step: f64,
    /// Steps between two looks at how much powder is left round a column.
    pub batch: usize,
    /// What a voxel does that is hotter than the end of its heating curve.
    pub past_the_end: PastTheEnd,
    /// Temperature from which powder is metal for ever, K.
    pub fusion: f64,
    /// Temperature whose crossing is timed, K.
    pub timed: f64,
    /// What the ground keeps of earlier beam positions.
    pub memory: Memory,
    /// How far a power may lie from that of the charts that serve it, as a share of it; 0 for those of the power alone.
    pub nearest: f64,
}

impl Settings {
    /// Steps of 2.5 µs in batches of 16, fusion at the solidus, times taken at the liquidus.
    pub fn of(material: &Material) -> Self {
        Settings {
            step: 2.5e-6,
            batch: 16,
            past_the_end: PastTheEnd::default(),
            fusion: material.solidus,
            timed: material.liquidus,
            memory: Memory::None,
            nearest: 0.0,
        }
    }
}

/// Voxels under a beam.
#[derive(Debug, Clone)]
pub struct ChartSimulation {
    grid: Grid,
    material: Material,
    curve: Enthalpy,
    settings: Settings,
    sets: Vec<ChartSet>,
    rates: Vec<Rates>,
    /// Columns one after the other, top voxel first.
    voxels: Vec<Voxel>,
    columns: Vec<Column>,
    around: Neighbourhood,
    ground: Option<Ground>,
    /// Depths of the planes, mm.
    depths: Vec<f32>,
    fusion: f32,
    timed: f32,
    time: f64,
    /// Highest enthalpy under the beam at the end of the last batch.
    under_beam: f32,
}

impl ChartSimulation {
    /// Voxels on `grid`, whose planes reach at least as deep as the charts' heated zone, all metal at the start
    /// temperature. `sets` serve the settings that paths may have.
    ///
    /// # Errors
    /// [`ChartSimulationError`]: a grid without cells or with uneven planes, charts of other laws, settings not above zero.
    pub fn new(
        grid: &Grid,
        material: Material,
        sets: Vec<ChartSet>,
        settings: Settings,
    ) -> Result<Self, ChartSimulationError> {
        grid.check()?;
        for (what, value) in [
            ("the time step", settings.step),
            ("the batch", settings.batch as f64),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ChartSimulationError::Setting { what, value });
            }
        }
        let curve = Enthalpy::new(&material)?;
        for set in &sets {
            if set.fingerprint != curve.fingerprint() {
                return Err(ChartError::Material {
                    found: set.material.clone(),
                    wanted: material.name.clone(),
                }
                .into());
            }
        }
        for set in &sets {
            check_step(set, &curve, settings.step)?;
        }
        let reach = sets.iter().map(|s| s.settings.reach).fold(0.0, f64::max);
        let height = grid.heights[0];
        let even = grid.heights.iter().all(|h| (h - height).abs() < 1e-9);
        let planes = (reach / height - 1e-6).ceil() as usize;
        if !even || planes == 0 || grid.planes() < planes {
            return Err(ChartSimulationError::Planes {
                reach,
                planes: grid.planes(),
                height,
            });
        }
        // deeper voxels are never heated
        let top = grid.top();
        let grid = Grid {
            origin: DVec3::new(grid.origin.x, grid.origin.y, top - planes as f64 * height),
            heights: vec![height; planes],
            ..*grid
        };
        let depths: Vec<f64> = (0..planes).map(|k| (k as f64 + 0.5) * height).collect();
        let rates: Vec<Rates> = sets
            .iter()
            .map(|s| Rates::new(s, &depths, settings.past_the_end, settings.step))
            .collect();
        let radius = rates.iter().map(|r| r.radius).fold(0.0, f64::max);
        let columns = grid.cells[0] * grid.cells[1];
        let between = rates.first().map(|r| r.between(0.0));
        let between = between.ok_or_else(|| ChartError::Missing {
            power: 0.0,
            spot: 0.0,
            time: 0.0,
            known: "none".to_owned(),
        })?;
        let ground = match settings.memory {
            Memory::None => None,
            Memory::Ground(body) => {
                let narrowest = sets.iter().map(|s| s.settings.spot / 4.0);
                let variance = narrowest.fold(f64::INFINITY, f64::min).powi(2);
                let depth = sets[0].settings.depth;
                Some(Ground::new(&material, body, variance, depth, reach))
            }
        };
        Ok(ChartSimulation {
            ground,
            depths: depths.iter().map(|d| *d as f32).collect(),
            voxels: vec![Voxel::fresh(false); columns * planes],
            columns: vec![Column::fresh(between, 0); columns],
            around: Neighbourhood::new(grid.cells, grid.edge, radius, planes, &vec![0; columns]),
            fusion: curve.of(settings.fusion) as f32,
            timed: curve.of(settings.timed) as f32,
            grid,
            material,
            curve,
            settings,
            sets,
            rates,
            time: 0.0,
            under_beam: 0.0,
        })
    }

    /// The voxels, down to the depth that the beam heats.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Time since the layer began, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The material.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// The hottest temperature in the heated zone at the end of the last batch, K; the start temperature when the beam was off.
    pub fn hottest_under_beam(&self) -> f64 {
        self.curve.temperature(f64::from(self.under_beam))
    }

    /// How it is carried out.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The charts.
    pub fn sets(&self) -> &[ChartSet] {
        &self.sets
    }

    fn planes(&self) -> usize {
        self.grid.planes()
    }

    /// Sets the state of matter of every voxel from its centre.
    pub fn set_state(&mut self, state: impl Fn(DVec3) -> State) {
        let [nx, _] = self.grid.cells;
        let planes = self.planes();
        for (n, voxels) in self.voxels.chunks_mut(planes).enumerate() {
            for (k, voxel) in voxels.iter_mut().enumerate() {
                let centre = self.grid.centre(n % nx, n / nx, planes - 1 - k);
                voxel.powder = state(centre) == State::Powder;
            }
        }
        self.count_powder();
    }

    fn count_powder(&mut self) {
        let powder: Vec<u32> = self
            .voxels
            .chunks(self.planes())
            .map(|v| v.iter().filter(|v| v.powder).count() as u32)
            .collect();
        self.around.count(&powder);
    }

    /// Share of powder round a column.
    pub fn powder_share(&self, i: usize, j: usize) -> f64 {
        self.around.share(j * self.grid.cells[0] + i)
    }

    /// Puts a layer of fresh powder on top: everything is back at the start temperature, states of matter stay, highest
    /// temperatures and times begin anew (Béraud 2016, section 3.2.2.1.2).
    pub fn add_layer(&mut self) {
        let planes = self.planes();
        for voxels in self.voxels.chunks_mut(planes) {
            voxels.rotate_right(1);
            voxels[0].powder = true;
            for voxel in voxels {
                *voxel = Voxel::fresh(voxel.powder);
            }
        }
        self.grid.origin.z += self.grid.heights[0];
        for column in &mut self.columns {
            *column = Column::fresh(column.between, column.set);
        }
        if let Some(ground) = &mut self.ground {
            ground.clear();
        }
        self.time = 0.0;
        self.count_powder();
    }

    /// Draws `path` from where the simulation stands: `at` are times of the path at which `look` is called with the
    /// simulation, besides at its end. Time goes on by the path's duration.
    ///
    /// # Errors
    /// [`ChartSimulationError`]: no chart for a setting, a beam outside the voxels, cancellation.
    pub fn draw(
        &mut self,
        path: &BeamPath,
        at: &[f64],
        look: &mut dyn FnMut(f64, &ChartSimulation),
        observer: &dyn Observer,
    ) -> Result<(), ChartSimulationError> {
        let begun = self.time;
        let dt = self.settings.step;
        let count = ((path.end() - path.begin()) / dt - 1e-9).ceil().max(0.0) as u64;
        observer.stage("draw the beam path with charts", count);
        let mut looks = at.to_vec();
        looks.sort_by(f64::total_cmp);
        let mut looks = looks.into_iter().peekable();
        let mut done = 0;
        while done < count {
            observer.check()?;
            let mut end = (done + self.settings.batch as u64).min(count);
            if let Some(next) = looks.peek() {
                let step = ((next - path.begin()) / dt).round().max(0.0) as u64;
                end = end.min(step.max(done + 1));
            }
            let steps: Vec<BeamPoint> = (done..end)
                .map(|n| path.at(path.begin() + (n as f64 + 0.5) * dt))
                .collect();
            self.advance(&steps)?;
            observer.advance(end - done);
            done = end;
            while looks
                .next_if(|t| *t <= path.begin() + (done as f64 + 0.5) * dt)
                .is_some()
            {
                look(path.begin() + done as f64 * dt, self);
            }
        }
        self.time = begun + path.end() - path.begin();
        Ok(())
    }

    /// One batch: the beam rests at each point for a step. For controllers that choose the next point from the
    /// temperatures.
    ///
    /// # Errors
    /// [`ChartSimulationError::Chart`] and [`ChartSimulationError::Outside`].
    pub fn advance(&mut self, points: &[BeamPoint]) -> Result<(), ChartSimulationError> {
        let dt = self.settings.step;
        let start = self.time;
        let mut steps = Vec::with_capacity(points.len());
        for (n, p) in points.iter().enumerate() {
            let time = start + n as f64 * dt;
            if p.is_on() {
                steps.push(Step {
                    time,
                    x: p.x,
                    y: p.y,
                    set: self.set_for(p, time)?,
                });
            }
        }
        self.time = start + points.len() as f64 * dt;
        self.check_inside(&steps)?;
        self.heat(&steps);
        if let Some(ground) = &mut self.ground {
            for step in &steps {
                let beam = &self.sets[usize::from(step.set)].settings;
                ground.add(&Deposit {
                    heat: beam.heat() * dt,
                    time: step.time + 0.5 * dt,
                    centre: [step.x, step.y],
                    variance: (beam.spot / 4.0).powi(2),
                });
            }
        }
        Ok(())
    }

    fn set_for(&self, p: &BeamPoint, time: f64) -> Result<u8, ChartError> {
        let serves = |s: &ChartSet| s.settings.serves(p.power, p.spot);
        let found = self.sets.iter().position(serves);
        let found = found.or_else(|| self.nearest(p));
        found.and_then(|n| u8::try_from(n).ok()).ok_or_else(|| {
            let told = |s: &ChartSet| {
                let (power, spot) = (s.settings.power, s.settings.spot);
                format!("{power:.1} W on {:.1} µm", spot * 1e3)
            };
            let known: Vec<String> = self.sets.iter().map(told).collect();
            ChartError::Missing {
                power: p.power,
                spot: p.spot,
                time,
                known: known.join("; "),
            }
        })
    }

    /// The charts whose power comes nearest, if one comes near enough.
    fn nearest(&self, p: &BeamPoint) -> Option<usize> {
        let away = |s: &ChartSet| (s.settings.power / p.power).ln().abs();
        let alike = |s: &ChartSet| s.settings.serves(s.settings.power, p.spot);
        let near = self.sets.iter().enumerate().filter(|(_, s)| alike(s));
        let (n, set) = near.min_by(|a, b| away(a.1).total_cmp(&away(b.1)))?;
        (away(set) <= self.settings.nearest).then_some(n)
    }

    fn check_inside(&self, steps: &[Step]) -> Result<(), ChartSimulationError> {
        let low = [self.grid.origin.x, self.grid.origin.y];
        let high: [f64; 2] =
            std::array::from_fn(|a| low[a] + self.grid.cells[a] as f64 * self.grid.edge[a]);
        let outside = |s: &&Step| s.x < low[0] || s.x > high[0] || s.y < low[1] || s.y > high[1];
        match steps.iter().find(outside) {
            Some(s) => Err(ChartSimulationError::Outside {
                time: s.time,
                x: s.x,
                y: s.y,
                low,
                high,
            }),
            None => Ok(()),
        }
    }

    fn heat(&mut self, steps: &[Step]) {
        self.under_beam = 0.0;
        let Some(rows) = self.rows(steps) else {
            return;
        };
        let (nx, planes) = (self.grid.cells[0], self.planes());
        let [dx, dy] = self.grid.edge;
        let origin = self.grid.origin;
        let batch = Batch {
            steps,
            rates: &self.rates,
            around: &self.around,
            ground: self.ground.as_ref(),
            depths: &self.depths,
            dt: self.settings.step,
            fusion: self.fusion,
            timed: self.timed,
        };
        let reach = |y: f64| {
            let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
            for s in steps {
                let radius = self.rates[usize::from(s.set)].radius;
                let half = radius * radius - (y - s.y).powi(2);
                if half >= 0.0 {
                    let half = half.sqrt();
                    ends = [ends[0].min(s.x - half), ends[1].max(s.x + half)];
                }
            }
            ends
        };
        let range = rows.start * nx..rows.end * nx;
        let outcomes: Vec<(f32, Vec<(usize, u32)>)> = self.voxels
            [range.start * planes..range.end * planes]
            .par_chunks_mut(nx * planes)
            .zip(self.columns[range].par_chunks_mut(nx))
            .enumerate()
            .map(|(n, (voxels, columns))| {
                let j = rows.start + n;
                let y = origin.y + (j as f64 + 0.5) * dy;
                let [from, to] = reach(y);
                let first = (((from - origin.x) / dx - 0.5).ceil().max(0.0)) as usize;
                let end = ((((to - origin.x) / dx - 0.5).floor() + 1.0).max(0.0) as usize).min(nx);
                let mut melted = Vec::new();
                let mut hottest = 0.0_f32;
                let mut under = vec![Under::default(); planes];
                for i in first..end {
                    let x = origin.x + (i as f64 + 0.5) * dx;
                    let (count, hot) = batch.column(
                        j * nx + i,
                        [x, y],
                        &mut columns[i],
                        &mut voxels[i * planes..(i + 1) * planes],
                        &mut under,
                    );
                    hottest = hottest.max(hot);
                    if count > 0 {
                        melted.push((j * nx + i, count));
                    }
                }
                (hottest, melted)
            })
            .collect();
        for (hottest, melted) in outcomes {
            self.under_beam = self.under_beam.max(hottest);
            for (column, count) in melted {
                self.around.melted(column, count);
            }
        }
    }

    /// Rows of columns that the steps may heat.
    fn rows(&self, steps: &[Step]) -> Option<std::ops::Range<usize>> {
        let radius = |s: &Step| self.rates[usize::from(s.set)].radius;
        let low = steps
            .iter()
            .map(|s| s.y - radius(s))
            .fold(f64::INFINITY, f64::min);
        let high = steps
            .iter()
            .map(|s| s.y + radius(s))
            .fold(f64::NEG_INFINITY, f64::max);
        if low > high {
            return None;
        }
        let index = |y: f64| {
            ((y - self.grid.origin.y) / self.grid.edge[1])
                .floor()
                .max(0.0) as usize
        };
        let end = (index(high) + 1).min(self.grid.cells[1]);
        (index(low) < end).then(|| index(low)..end)
    }
}
