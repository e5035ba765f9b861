//! What a drawing leaves: temperatures, times and metal of the voxels, and warnings.

use meltpath_base::Reporter;
use rayon::prelude::*;

use super::ChartSimulation;
use super::batch::{Standing, Voxel, cool};
use crate::charts::ChartSet;
use crate::grid::Field;
use crate::material::CELSIUS;
use crate::solver::watch::{Freezing, upper};

/// How fast a voxel fell through the timed temperature, K/s; NaN where it has not.
fn rate_of(voxel: &Voxel, capacity: f64) -> f32 {
    if voxel.fell.is_nan() {
        f32::NAN
    } else {
        (f64::from(voxel.rate) / capacity) as f32
    }
}

impl ChartSimulation {
    /// Enthalpy of a voxel now.
    fn now(&self, column: usize, k: usize) -> f32 {
        let voxel = &self.voxels[column * self.planes() + k];
        let c = &self.columns[column];
        let rates = &self.rates[usize::from(c.set)];
        let under = Standing::when(c, self.ground.as_ref(), rates, self.time).at(self.depths[k]);
        let g = voxel.enthalpy;
        if g <= 0.0 {
            return under.enthalpy;
        }
        let own = rates.cooled(c.between, under.warmth, k, g, self.time - c.since);
        under.enthalpy + own
    }

    fn field(&self, value: impl Fn(usize, usize) -> f64 + Sync) -> Field {
        let columns = self.columns.len();
        let planes = self.planes();
        let values = (0..columns * planes)
            .into_par_iter()
            .map(|n| value(n % columns, planes - 1 - n / columns) as f32)
            .collect();
        Field {
            grid: self.grid.clone(),
            values,
        }
    }

    /// One number per column, row by row.
    fn surface(&self, value: impl Fn(usize) -> f64 + Sync) -> Vec<f32> {
        let columns = (0..self.columns.len()).into_par_iter();
        columns.map(|c| value(c) as f32).collect()
    }

    /// Temperatures of the build plane now, K, row by row.
    pub fn surface_temperature(&self) -> Vec<f32> {
        self.surface(|c| self.curve.temperature(f64::from(self.now(c, 0))))
    }

    /// Highest temperatures of the build plane since the layer began, K, row by row.
    pub fn surface_highest(&self) -> Vec<f32> {
        let planes = self.planes();
        self.surface(|c| {
            let highest = self.voxels[c * planes].highest;
            self.curve.temperature(f64::from(highest))
        })
    }

    /// How the voxels near the build plane froze.
    pub fn freezing(&self) -> Freezing {
        let grid = upper(&self.grid);
        let columns = self.columns.len();
        let planes = grid.planes();
        let settled: Vec<Voxel> = (0..columns * planes)
            .into_par_iter()
            .map(|n| self.settled(n % columns, planes - 1 - n / columns))
            .collect();
        let capacity = self.capacity();
        let field = |value: &dyn Fn(&Voxel) -> f32| Field {
            grid: grid.clone(),
            values: settled.iter().map(value).collect(),
        };
        Freezing {
            above: field(&|v| v.above),
            fell: field(&|v| v.fell),
            rate: field(&|v| rate_of(v, capacity)),
        }
    }

    /// Heat capacity just above the timed temperature, J/(mm³·K).
    fn capacity(&self) -> f64 {
        self.material.heat_capacity(self.settings.timed + 1e-3)
    }

    /// Temperatures now, K.
    pub fn temperature(&self) -> Field {
        self.field(|c, k| self.curve.temperature(f64::from(self.now(c, k))))
    }

    /// Temperature of cell `(i, j, k)` now, K.
    pub fn temperature_at(&self, i: usize, j: usize, k: usize) -> f64 {
        let g = self.now(j * self.grid.cells[0] + i, self.planes() - 1 - k);
        self.curve.temperature(f64::from(g))
    }

    /// Highest temperatures since the layer began, K.
    pub fn highest_temperature(&self) -> Field {
        let planes = self.planes();
        self.field(|c, k| {
            self.curve
                .temperature(f64::from(self.voxels[c * planes + k].highest))
        })
    }

    /// Time above the timed temperature since the layer began, s; what is still above it counts up to now.
    pub fn time_above(&self) -> Field {
        self.field(|c, k| f64::from(self.settled(c, k).above))
    }

    /// When each voxel last fell through the timed temperature, s since the layer began; NaN where it has not yet.
    pub fn fell(&self) -> Field {
        self.field(|c, k| f64::from(self.settled(c, k).fell))
    }

    /// The voxel as it stands now.
    fn settled(&self, column: usize, k: usize) -> Voxel {
        let c = &self.columns[column];
        let mut voxel = self.voxels[column * self.planes() + k];
        let rates = &self.rates[usize::from(c.set)];
        let under = Standing::of(c, self.ground.as_ref(), rates).at(self.depths[k]);
        cool(rates, c, k, &mut voxel, under, self.time, self.timed);
        voxel
    }

    /// Metal or powder, 1 or 0.
    pub fn metal(&self) -> Field {
        let planes = self.planes();
        self.field(|c, k| f64::from(!self.voxels[c * planes + k].powder))
    }

    /// Warns where temperatures lie beyond what laws or charts tell.
    pub fn tell(&self, reporter: &Reporter) {
        let highest = self.voxels.iter().map(|v| v.highest).fold(0.0, f32::max);
        let hottest = self.curve.temperature(f64::from(highest));
        if hottest > self.material.range[1] {
            reporter.warn(
                "laws-extrapolated",
                format!(
                    "the hottest voxel reaches {:.0} °C, the laws of {} are meant up to {:.0} °C",
                    hottest - CELSIUS,
                    self.material.name,
                    self.material.range[1] - CELSIUS
                ),
                "compare temperatures of one model with each other, not with the boiling point; calibrate the window on a built part",
            );
        }
        self.tell_of_ground(reporter);
        let stop = self
            .sets
            .iter()
            .map(|s| s.settings.stop)
            .fold(f64::INFINITY, f64::min);
        if hottest > stop - 0.05 * (stop - self.material.start) {
            reporter.warn(
                "charts-saturated",
                format!(
                    "the hottest voxel reaches {:.0} °C, the charts end at {:.0} °C: what lies near their end is told apart badly",
                    hottest - CELSIUS,
                    stop - CELSIUS
                ),
                // beyond the laws no chart tells more
                if stop < self.material.range[1] {
                    "charts that go on to a higher temperature (charts.stop)"
                } else {
                    "less power, faster lines or lines further apart: the charts end beyond the material's laws, and know no vapour; what a higher charts.stop adds is no metal's temperature"
                },
            );
        }
    }

    /// Warns where the ground became warmer than that of the charts.
    fn tell_of_ground(&self, reporter: &Reporter) {
        if self.ground.is_none() {
            return;
        }
        let last = |s: &ChartSet| s.warm.last().map_or(0.0, |w| w.enthalpy as f32);
        let known = self.sets.iter().map(last).fold(f32::INFINITY, f32::min);
        let beyond = self.columns.iter().filter(|c| c.warmest > known).count();
        if beyond > 0 {
            let warmest = self.columns.iter().map(|c| c.warmest);
            let celsius = |g: f32| self.curve.temperature(f64::from(g)) - CELSIUS;
            reporter.warn(
                "ground-beyond-charts",
                format!(
                    "earlier lines left the ground at up to {:.0} °C, the charts know it up to {:.0} °C: {:.1} % of the columns go on as on the warmest they know",
                    celsius(warmest.fold(0.0, f32::max)),
                    celsius(known),
                    100.0 * beyond as f64 / self.columns.len() as f64
                ),
                "judge the hottest places on the reference solver, or give lines more time to cool before the next",
            );
        }
    }
}
