//! Implicit steps of any length for the reference solver: backward Euler in enthalpy, Newton with conjugate gradients.
//!
//! In the Kirchhoff integral the linearised equation `(r/θ′ − dt ∇·c∇) δθ = −F` is symmetric and positive, also in the
//! middle of melting. For cooling between layers, where explicit steps would be counted in millions.

use crate::numeric::real::Real;
use crate::solver::block::Beyond;
use crate::solver::source::Spot;
use crate::solver::{Solver, SolverError};

const NEWTON: usize = 60;
/// Residual at which a step is done, as a share of the heat that moves in it.
const DONE: f64 = 1e-7;

/// Heat that flows between cells, per unit difference of `θ`, J/(W/mm).
struct Conductances {
    cells: [usize; 3],
    /// To the next cell along x, y, z.
    next: [Vec<f64>; 3],
    /// To imposed faces.
    outside: Vec<f64>,
    face: Vec<f64>,
}

impl Conductances {
    /// `out = A x`, with `A` the negative Laplacian without its imposed faces.
    fn apply(&self, x: &[f64], out: &mut [f64]) {
        let [nx, ny, nz] = self.cells;
        for (o, (d, x)) in out.iter_mut().zip(self.outside.iter().zip(x)) {
            *o = d * x;
        }
        for (axis, step) in [1, nx, nx * ny].into_iter().enumerate() {
            let next = &self.next[axis];
            for n in 0..nx * ny * nz - step {
                let flow = next[n] * (x[n] - x[n + step]);
                out[n] += flow;
                out[n + step] -= flow;
            }
        }
    }

    fn diagonal(&self) -> Vec<f64> {
        let [nx, ny, nz] = self.cells;
        let mut out = self.outside.clone();
        for (axis, step) in [1, nx, nx * ny].into_iter().enumerate() {
            for n in 0..nx * ny * nz - step {
                out[n] += self.next[axis][n];
                out[n + step] += self.next[axis][n];
            }
        }
        out
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // fixed chunks, so that the sum does not depend on how it is compiled
    a.chunks(4096)
        .zip(b.chunks(4096))
        .map(|(a, b)| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>())
        .sum()
}

impl<R: Real> Solver<R> {
    /// One implicit step of `dt` seconds under `spots` at rest; any length is stable, the accuracy is first order.
    ///
    /// # Errors
    /// [`SolverError::Convergence`], [`SolverError::Outside`], [`SolverError::Value`].
    pub fn step_implicit(&mut self, dt: f64, spots: &[Spot]) -> Result<(), SolverError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(SolverError::Value {
                what: "the time step",
                value: dt,
            });
        }
        self.wake_all();
        // double precision throughout: the residual of a long step is a small difference
        let f = self.curve.formulas::<f64>();
        let first = self.block.frozen * self.block.plane();
        let before: Vec<f64> = self.block.enthalpy[first..]
            .iter()
            .map(|g| g.wide())
            .collect();
        let density_before: Vec<R> = self.block.density[first..].to_vec();
        // the beam enters as heat that the step distributes: its share per cell is what it would add explicitly
        for spot in spots {
            self.heat(spot, dt)?;
        }
        let beam: Vec<f64> = self.block.enthalpy[first..]
            .iter()
            .zip(&self.block.density[first..])
            .zip(before.iter().zip(&density_before))
            .map(|((g, r), (g0, r0))| 0.5 * (r.wide() + r0.wide()) * (g.wide() - g0))
            .collect();
        let conductances = self.conductances(dt);
        let volumes = self.volumes();
        let [nx, ny] = self.grid.cells;
        let top = (self.grid.planes() - 1 - self.block.frozen) * nx * ny;
        let area = self.grid.edge[0] * self.grid.edge[1] * dt;
        let theta_of = |g: f64| f.kirchhoff(g);
        let slope_of = |g: f64| {
            let h = 1e-3 * self.curve.at_solidus;
            ((theta_of(g + h) - theta_of(g - h)) / (2.0 * h)).max(1e-3 * self.curve.diffusivity_max)
        };
        let n = before.len();
        let mut g: Vec<f64> = self.block.enthalpy[first..]
            .iter()
            .map(|g| g.wide())
            .collect();
        let mut mean_density: Vec<f64> = density_before.iter().map(|r| r.wide()).collect();
        let mut flow = vec![0.0; n];
        let mut residual = vec![0.0; n];
        let mut relative = f64::INFINITY;
        let diagonal = conductances.diagonal();
        for iteration in 0..NEWTON {
            for (m, (g, r)) in mean_density.iter_mut().zip(g.iter().zip(&density_before)) {
                let after = f.relative_density(*g).larger(r.wide());
                *m = 0.5 * (r.wide() + after);
            }
            let theta: Vec<f64> = g.iter().map(|g| theta_of(*g)).collect();
            conductances.apply(&theta, &mut flow);
            let (mut size, mut scale) = (0.0, 0.0);
            for i in 0..n {
                let mut out = flow[i] - conductances.outside[i] * conductances.face[i];
                if i >= top {
                    out += area * self.losses.flux(R::of(g[i]), density_before[i]);
                }
                let stored = volumes[i] * (mean_density[i] * (g[i] - before[i]) - beam[i]);
                residual[i] = stored + out;
                size += residual[i].abs();
                scale += volumes[i] * (mean_density[i] * (g[i] - before[i])).abs()
                    + flow[i].abs()
                    + (volumes[i] * beam[i]).abs();
            }
            relative = size / scale.max(1e-12);
            if relative < DONE {
                self.finish_implicit(dt, &g, &density_before, &conductances, first, top);
                return Ok(());
            }
            let slopes: Vec<f64> = g.iter().map(|g| slope_of(*g)).collect();
            let mut shift: Vec<f64> = (0..n)
                .map(|i| volumes[i] * mean_density[i] / slopes[i])
                .collect();
            for i in top..n {
                shift[i] += area * self.loss_slope(g[i], density_before[i]) / slopes[i];
            }
            let change = solve(
                &conductances,
                &diagonal,
                &shift,
                &residual,
                if iteration < 2 { 1e-3 } else { 1e-6 },
            );
            for i in 0..n {
                // of the two ways to follow a bent curve the shorter one never overshoots a phase change
                let straight = change[i] / slopes[i];
                let bent = self.enthalpy_at_kirchhoff(theta[i] + change[i], g[i], straight) - g[i];
                g[i] += if bent.abs() < straight.abs() {
                    bent
                } else {
                    straight
                };
            }
        }
        Err(SolverError::Convergence {
            step: dt,
            time: self.time,
            iterations: NEWTON,
            residual: relative,
        })
    }

    /// How the loss of the surface grows with its enthalpy `g`; never negative.
    fn loss_slope(&self, g: f64, density: R) -> f64 {
        let h = 1e-3 * self.curve.at_solidus;
        let rise =
            self.losses.flux(R::of(g + h), density) - self.losses.flux(R::of(g - h), density);
        (rise / (2.0 * h)).max(0.0)
    }

    /// `g` with `θ(g) = theta`, sought from `g` on in the direction of `step` within twice its length.
    fn enthalpy_at_kirchhoff(&self, theta: f64, g: f64, step: f64) -> f64 {
        let f = self.curve.formulas::<f64>();
        let at = |g: f64| f.kirchhoff(g);
        let (mut a, mut b) = (g, g + step);
        if (at(b) - theta) * step.signum() < 0.0 {
            return b;
        }
        for _ in 0..24 {
            let middle = 0.5 * (a + b);
            if (at(middle) - theta) * step.signum() < 0.0 {
                a = middle;
            } else {
                b = middle;
            }
        }
        0.5 * (a + b)
    }

    fn finish_implicit(
        &mut self,
        dt: f64,
        g: &[f64],
        density: &[R],
        conductances: &Conductances,
        first: usize,
        top: usize,
    ) {
        let area = self.grid.edge[0] * self.grid.edge[1] * dt;
        let f = self.curve.formulas::<f64>();
        for (i, (&exact, &r)) in g.iter().zip(density).enumerate() {
            let g = R::of(exact);
            if i >= top {
                let all = area * self.losses.flux(g, r);
                let steam = area * self.losses.steam_flux(g);
                self.ledger.evaporated += steam;
                self.ledger.radiated += all - steam;
            }
            self.ledger.conducted +=
                conductances.outside[i] * (f.kirchhoff(exact) - conductances.face[i]);
            self.block.enthalpy[first + i] = g;
            self.block.density[first + i] = R::of(f.relative_density(exact)).larger(r);
            self.block.highest[first + i] = self.block.highest[first + i].larger(g);
        }
        self.block.mark_powder();
        self.time += dt;
    }

    fn volumes(&self) -> Vec<f64> {
        let [nx, ny] = self.grid.cells;
        (self.block.frozen..self.grid.planes())
            .flat_map(|k| std::iter::repeat_n(self.grid.volume(k), nx * ny))
            .collect()
    }

    fn conductances(&self, dt: f64) -> Conductances {
        let [nx, ny] = self.grid.cells;
        let [dx, dy] = self.grid.edge;
        let from = self.block.frozen;
        let nz = self.grid.planes() - from;
        let n = nx * ny * nz;
        let heights = &self.grid.heights[from..];
        let f = self.curve.formulas::<f64>();
        let share: Vec<f64> = self.block.density[from * nx * ny..]
            .iter()
            .map(|r| f.conduction(r.wide()))
            .collect();
        let mut next = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut outside = vec![0.0; n];
        let mut face = vec![0.0; n];
        let imposed = |b: Beyond| match b {
            Beyond::Imposed(theta) => Some(theta),
            Beyond::Nothing => None,
        };
        let sides = imposed(self.beyond(self.faces.sides));
        let bottom = imposed(self.beyond(self.faces.bottom));
        let between = |a: f64, b: f64, ha: f64, hb: f64| 2.0 * a * b / (ha * b + hb * a);
        for m in 0..n {
            let (i, j, k) = (m % nx, m / nx % ny, m / (nx * ny));
            let h = heights[k];
            if i + 1 < nx {
                next[0][m] = dt * dy * h * between(share[m], share[m + 1], dx, dx);
            }
            if j + 1 < ny {
                next[1][m] = dt * dx * h * between(share[m], share[m + nx], dy, dy);
            }
            if k + 1 < nz {
                next[2][m] =
                    dt * dx * dy * between(share[m], share[m + nx * ny], h, heights[k + 1]);
            }
            let mut out = |conductance: f64, theta: f64| {
                // all imposed faces of a cell at once: their mean, weighted
                let sum = outside[m] + conductance;
                face[m] = (face[m] * outside[m] + theta * conductance) / sum;
                outside[m] = sum;
            };
            if let Some(theta) = sides {
                for touches in [i == 0, i + 1 == nx] {
                    if touches {
                        out(dt * dy * h * 2.0 * share[m] / dx, theta);
                    }
                }
                for touches in [j == 0, j + 1 == ny] {
                    if touches {
                        out(dt * dx * h * 2.0 * share[m] / dy, theta);
                    }
                }
            }
            if let Some(theta) = bottom.filter(|_| k == 0) {
                out(dt * dx * dy * 2.0 * share[m] / h, theta);
            }
        }
        Conductances {
            cells: [nx, ny, nz],
            next,
            outside,
            face,
        }
    }
}

/// `(diag(shift) + A) x = −residual` by conjugate gradients with the diagonal as preconditioner, to `share` of the residual.
fn solve(
    a: &Conductances,
    diagonal: &[f64],
    shift: &[f64],
    residual: &[f64],
    share: f64,
) -> Vec<f64> {
    let n = residual.len();
    let mut x = vec![0.0; n];
    let mut r: Vec<f64> = residual.iter().map(|v| -v).collect();
    let precondition =
        |r: &[f64]| -> Vec<f64> { (0..n).map(|i| r[i] / (diagonal[i] + shift[i])).collect() };
    let mut z = precondition(&r);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let goal = share * share * rz;
    let mut ap = vec![0.0; n];
    for _ in 0..2000 {
        if rz <= goal || rz == 0.0 {
            break;
        }
        a.apply(&p, &mut ap);
        for i in 0..n {
            ap[i] += shift[i] * p[i];
        }
        let step = rz / dot(&p, &ap);
        for i in 0..n {
            x[i] += step * p[i];
            r[i] -= step * ap[i];
        }
        z = precondition(&r);
        let next = dot(&r, &z);
        let turn = next / rz;
        rz = next;
        for i in 0..n {
            p[i] = z[i] + turn * p[i];
        }
    }
    x
}
