//! Cooling with the beam off for as long as a rake and a preheating take: steps that grow with the time, solved line by line.
//!
//! Heat of every line of cells along x, y and z in turn, forwards in one step and backwards in the next (Strang 1968), each line by the
//! Rosenbrock method ROS2 (Verwer, Spee, Blom, Hundsdorfer 1999): of second order, and stable however long the step. What flows out
//! of one cell flows into the next: no heat is lost.

use meltpath_base::{Cancelled, Observer};

use crate::material::enthalpy::Formulas;
use crate::solver::ledger::Ledger;
use crate::solver::steam::{Around, Lift};
use crate::solver::surface::{BuildPlane, Losses};
use meltpath_numerics::vector;

/// Coefficient of ROS2 that damps whatever is quicker than the step: `1 − 1/√2`.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Steps as a share of the time since the beam went off.
const RATE: f64 = 0.1;
/// Longest step where the build plane loses heat, which is that of the step's beginning, s.
const LOSING: f64 = 0.25;
/// Lines whose enthalpies all are this share of that at the solidus, or less, are left alone: some 0.01 K.
const NOTHING: f64 = 1e-5;

/// Cells of one size in the plan, planes bottom first.
pub(super) struct Block {
    pub(super) cells: [usize; 3],
    /// Edge of a cell in the plan, mm.
    pub(super) edge: f64,
    /// Heights of the planes, mm.
    pub(super) heights: Vec<f64>,
    /// Enthalpies, J/mm³ of dense metal.
    pub(super) enthalpy: Vec<f64>,
    /// Relative densities.
    pub(super) density: Vec<f64>,
    /// `θ` at which sides and floor are held; nothing flows there where absent, W/mm.
    pub(super) held: Option<f64>,
}

/// What cooling needs to know besides.
pub(super) struct Laws<'a> {
    pub(super) formulas: &'a Formulas<f64>,
    pub(super) losses: &'a Losses<f64>,
    pub(super) register: vector::Level,
}

/// A line of cells.
#[derive(Default)]
struct Line {
    enthalpy: Vec<f64>,
    density: Vec<f64>,
    /// Lengths along the line, mm.
    length: Vec<f64>,
    /// Conductance to the next cell, 1/mm; with `θ` it gives W/mm².
    face: Vec<f64>,
    /// Conductances to what is held before the first cell and after the last.
    ends: [f64; 2],
    /// What the last cell loses besides, W/mm³.
    taken: f64,
    theta: Vec<f64>,
    /// `dθ/du` of the heat `u` of a cell.
    slope: Vec<f64>,
    stages: [Vec<f64>; 2],
    /// The tridiagonal system of both stages: the lower diagonal, the inverses of the pivots, what elimination leaves above them.
    lower: Vec<f64>,
    inverse: Vec<f64>,
    upper: Vec<f64>,
}

impl Block {
    /// Cools for `time` s, the beam off since `since` s; what left goes to `ledger`.
    pub(super) fn cool(
        &mut self,
        laws: &Laws,
        [since, time]: [f64; 2],
        ledger: &mut Ledger,
        observer: &dyn Observer,
    ) -> Result<(), Cancelled> {
        let mut done = 0.0;
        let mut forwards = true;
        let mut line = Line::default();
        while done < time * (1.0 - 1e-12) {
            observer.check()?;
            let mut step = RATE * (since + done);
            if !laws.losses.none {
                step = step.min(LOSING);
            }
            // no crumb at the end
            let left = time - done;
            if left < 1.5 * step {
                step = left;
            }
            let axes = if forwards { [0, 1, 2] } else { [2, 1, 0] };
            for axis in axes {
                let taken = match axis {
                    2 => self.lost(laws, step, ledger),
                    _ => Vec::new(),
                };
                ledger.conducted += self.sweep(laws.formulas, axis, step, &taken, &mut line);
            }
            forwards = !forwards;
            done += step;
        }
        Ok(())
    }

    /// What each cell of the build plane loses in `step` s, W/mm³; nothing where nothing is lost.
    fn lost(&self, laws: &Laws, step: f64, ledger: &mut Ledger) -> Vec<f64> {
        if laws.losses.none {
            return Vec::new();
        }
        let [nx, ny, nz] = self.cells;
        let top = (nz - 1) * nx * ny;
        let before = &self.enthalpy[top..];
        let (mut after, mut density) = (before.to_vec(), self.density[top..].to_vec());
        // no beam: the surface is no hotter than its cells
        let nothing = vec![0.0; before.len()];
        let plane = BuildPlane {
            formulas: laws.formulas,
            level: laws.register,
            passed: step,
            height: self.heights[nz - 1],
            area: self.edge * self.edge,
            enthalpy: &mut after,
            density: &mut density,
            around: Around {
                lift: Lift {
                    per_heat: 0.0,
                    below: 0.0,
                },
                arrived: &nothing,
                below: &nothing,
            },
        };
        laws.losses.take(plane, ledger);
        let cells = before.iter().zip(&after).zip(&self.density[top..]);
        cells.map(|((g, h), r)| r * (g - h) / step).collect()
    }

    /// One step of all lines along an axis, with what their last cells lose besides, W/mm³; what flows out at their ends, J.
    fn sweep(
        &mut self,
        f: &Formulas<f64>,
        axis: usize,
        step: f64,
        taken: &[f64],
        line: &mut Line,
    ) -> f64 {
        let [nx, ny, nz] = self.cells;
        let count = self.cells[axis];
        let stride = [1, nx, nx * ny][axis];
        let nothing = NOTHING * f.solidus();
        line.length = match axis {
            2 => self.heights.clone(),
            _ => vec![self.edge; count],
        };
        let across = |n: usize| match axis {
            0 => (n % ny * nx + n / ny * nx * ny, n / ny),
            1 => (n % nx + n / nx * nx * ny, n / nx),
            _ => (n, 0),
        };
        let mut left = 0.0;
        for n in 0..nx * ny * nz / count {
            let (first, plane) = across(n);
            let area = match axis {
                2 => self.edge * self.edge,
                _ => self.edge * self.heights[plane],
            };
            let place = |i: usize| first + i * stride;
            line.enthalpy.clear();
            line.enthalpy
                .extend((0..count).map(|i| self.enthalpy[place(i)]));
            line.taken = taken.get(n).copied().unwrap_or_default();
            if line.taken == 0.0 && line.enthalpy.iter().all(|g| g.abs() < nothing) {
                continue;
            }
            line.density.clear();
            line.density
                .extend((0..count).map(|i| self.density[place(i)]));
            let open = if axis == 2 { [true, false] } else { [true; 2] };
            left += area * line.step(f, self.held, open, step);
            for i in 0..count {
                self.enthalpy[place(i)] = line.enthalpy[i];
            }
        }
        left
    }
}

/// `θ` of a cell.
fn theta(f: &Formulas<f64>, g: f64) -> f64 {
    if g <= f.solidus() {
        f.kirchhoff_solid(g)
    } else {
        f.kirchhoff(g)
    }
}

impl Line {
    /// One step; `open` tells at which ends what is held lies. Returns what flows out there, J/mm².
    fn step(&mut self, f: &Formulas<f64>, held: Option<f64>, open: [bool; 2], dt: f64) -> f64 {
        let n = self.enthalpy.len();
        let share = |i: usize| f.conduction(self.density[i]);
        let half = |i: usize| self.length[i] / share(i);
        self.face.clear();
        self.face
            .extend((1..n).map(|i| 2.0 / (half(i - 1) + half(i))));
        let end = |i: usize, open: bool| match held {
            Some(_) if open => 2.0 / half(i),
            _ => 0.0,
        };
        self.ends = [end(0, open[0]), end(n - 1, open[1])];
        let held = held.unwrap_or(0.0);
        self.prepare(f, dt);
        let first = self.flows(held, 0);
        self.solve(0);
        let lost_first = first + GAMMA * dt * self.slope_of_loss(0);
        for i in 0..n {
            let g = self.enthalpy[i] + dt * self.stages[0][i] / self.density[i];
            self.theta[i] = theta(f, g);
        }
        let second = self.flows(held, 1);
        for i in 0..n {
            self.stages[1][i] -= 2.0 * self.stages[0][i];
        }
        self.solve(1);
        let lost_second = second + GAMMA * dt * self.slope_of_loss(1);
        for i in 0..n {
            let heat = dt * (1.5 * self.stages[0][i] + 0.5 * self.stages[1][i]);
            self.enthalpy[i] += heat / self.density[i];
        }
        dt * 0.5 * (lost_first + lost_second)
    }

    /// `θ`, its slopes, and the factors of the system of a step.
    fn prepare(&mut self, f: &Formulas<f64>, dt: f64) {
        let n = self.enthalpy.len();
        let nudge = 1e-4 * f.solidus();
        self.theta.clear();
        self.slope.clear();
        for (g, r) in self.enthalpy.iter().zip(&self.density) {
            let here = theta(f, *g);
            self.theta.push(here);
            self.slope.push((theta(f, g + nudge) - here) / (nudge * r));
        }
        for values in [&mut self.lower, &mut self.inverse, &mut self.upper] {
            values.clear();
            values.resize(n, 0.0);
        }
        for stage in &mut self.stages {
            stage.resize(n, 0.0);
        }
        for i in 0..n {
            let scale = GAMMA * dt / self.length[i];
            let [before, after] = self.around(i);
            let mut pivot = 1.0 + scale * (before + after) * self.slope[i];
            if i > 0 {
                self.lower[i] = -scale * before * self.slope[i - 1];
                pivot -= self.lower[i] * self.upper[i - 1];
            }
            self.inverse[i] = 1.0 / pivot;
            if i + 1 < n {
                self.upper[i] = -scale * after * self.slope[i + 1] / pivot;
            }
        }
    }

    /// Conductances before and after a cell.
    fn around(&self, i: usize) -> [f64; 2] {
        let before = if i == 0 {
            self.ends[0]
        } else {
            self.face[i - 1]
        };
        let after = self.face.get(i).copied().unwrap_or(self.ends[1]);
        [before, after]
    }

    /// What flows into each cell, W/mm³, from the `θ` at hand; returns what flows out at the ends, W/mm².
    fn flows(&mut self, held: f64, stage: usize) -> f64 {
        let n = self.theta.len();
        let first = self.ends[0] * (self.theta[0] - held);
        let last = self.ends[1] * (self.theta[n - 1] - held);
        let mut from_before = -first;
        for i in 0..n {
            let to_next = match self.face.get(i) {
                Some(face) => face * (self.theta[i] - self.theta[i + 1]),
                None => last,
            };
            self.stages[stage][i] = (from_before - to_next) / self.length[i];
            from_before = to_next;
        }
        self.stages[stage][n - 1] -= self.taken;
        first + last
    }

    /// Solves the system of a stage.
    fn solve(&mut self, stage: usize) {
        let k = &mut self.stages[stage];
        let mut before = 0.0;
        for ((k, lower), inverse) in k.iter_mut().zip(&self.lower).zip(&self.inverse) {
            before = (*k - lower * before) * inverse;
            *k = before;
        }
        for i in (0..k.len().saturating_sub(1)).rev() {
            k[i] -= self.upper[i] * k[i + 1];
        }
    }

    /// What a stage adds to the flow out at the ends per time.
    fn slope_of_loss(&self, stage: usize) -> f64 {
        let k = &self.stages[stage];
        let n = k.len() - 1;
        self.ends[0] * self.slope[0] * k[0] + self.ends[1] * self.slope[n] * k[n]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::material::enthalpy::Enthalpy;
    use crate::solver::surface::Surface;
    use meltpath_base::Silent;
    use std::f64::consts::PI;

    const CONDUCTIVITY: f64 = 0.02;
    const CAPACITY: f64 = 4e-3;

    /// A block of 8 x 4 x 2 mm whose heat is that of its slowest wave, cooled for `time` s since `since` s: the rise of the
    /// warmest cell against what the closed form leaves of it, and what was lost of the heat.
    fn wave(held: bool, since: f64, time: f64) -> [f64; 2] {
        let material = Material::constant(CONDUCTIVITY, CAPACITY, 300.0);
        let curve = Enthalpy::new(&material).unwrap();
        let formulas = curve.formulas::<f64>();
        let losses = Losses::new(&Surface::Insulated, &material, &curve, 1.0);
        let laws = Laws {
            formulas: &formulas,
            losses: &losses,
            register: vector::Level::PORTABLE,
        };
        let size = [8.0, 4.0, 2.0];
        let cells = [64, 32, 24];
        let heights: Vec<f64> = {
            let all: Vec<f64> = (0..24).map(|k| 1.06_f64.powi(k)).collect();
            let sum: f64 = all.iter().sum();
            all.into_iter().rev().map(|h| h * size[2] / sum).collect()
        };
        // held at five faces: sines, and a quarter of a wave down to the floor; nothing flows: cosines
        let middle = |k: usize| heights[..k].iter().sum::<f64>() + 0.5 * heights[k];
        let form = |i: usize, j: usize, k: usize| {
            let x = PI * (i as f64 + 0.5) / 64.0;
            let y = PI * (j as f64 + 0.5) / 32.0;
            let z = middle(k) / size[2];
            if held {
                x.sin() * y.sin() * (0.5 * PI * z).sin()
            } else {
                x.cos() * y.cos() * (PI * z).cos()
            }
        };
        let rise = 400.0;
        let mut enthalpy = Vec::new();
        for k in 0..24 {
            for j in 0..32 {
                enthalpy.extend((0..64).map(|i| CAPACITY * rise * form(i, j, k)));
            }
        }
        let stored = |g: &[f64]| {
            let volume = (0.125_f64).powi(2);
            let planes = g.chunks(64 * 32).zip(&heights);
            planes
                .map(|(p, h)| p.iter().sum::<f64>() * h * volume)
                .sum::<f64>()
        };
        let before = stored(&enthalpy);
        let mut block = Block {
            cells,
            edge: 0.125,
            density: vec![1.0; enthalpy.len()],
            enthalpy,
            heights: heights.clone(),
            held: held.then_some(0.0),
        };
        let mut ledger = Ledger::default();
        block
            .cool(&laws, [since, time], &mut ledger, &Silent)
            .unwrap();
        let waves = if held {
            [PI / 8.0, PI / 4.0, PI / 4.0]
        } else {
            [PI / 8.0, PI / 4.0, PI / 2.0]
        };
        let rate = CONDUCTIVITY / CAPACITY * waves.iter().map(|w| w * w).sum::<f64>();
        let (i, j, k) = (20, 10, 17);
        let there = block.enthalpy[(k * 32 + j) * 64 + i] / (CAPACITY * rise * form(i, j, k));
        let lost = before - stored(&block.enthalpy) - ledger.conducted;
        [
            there / (-rate * time).exp(),
            lost / (CAPACITY * rise * 64.0),
        ]
    }

    #[test]
    fn waves_decay_as_the_closed_form_says() {
        for held in [true, false] {
            let [ratio, lost] = wave(held, 0.05, 0.2);
            assert!((ratio - 1.0).abs() < 4e-3, "{held}: {ratio}");
            assert!(lost.abs() < 1e-10, "{held}: {lost}");
        }
    }

    /// Steps far longer than any cell bears explicitly neither swing nor grow.
    #[test]
    fn long_steps_are_stable() {
        let [ratio, lost] = wave(true, 50.0, 5.0);
        // one step over more than ten times: what is left is small beside what was
        let left = ratio * (-CONDUCTIVITY / CAPACITY * 1.388 * 5.0_f64).exp();
        assert!(left.abs() < 0.2, "{left}");
        assert!(lost.abs() < 1e-10, "{lost}");
    }
}
