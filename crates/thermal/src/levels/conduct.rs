//! One explicit step of conduction in a tile, with what lies beside it on its own level, a coarser or a finer one.

use super::tile::{Cells, N, PLANE, Shown, Tile};
use crate::material::enthalpy::Formulas;
use crate::numeric::vector::CellLoop;

/// Length of a row with a ghost on each side.
const ROW: usize = N + 2;
/// Cells of a plane with its ghosts.
const GHOSTED: usize = ROW * ROW;
/// What lies beside a tile.
#[derive(Clone, Copy)]
pub(crate) enum Side<'a> {
    /// Nothing flows: the face of the domain, or a tile that sleeps.
    Closed,
    /// The face is held at this `θ`.
    Held(f32),
    /// A tile of the same level.
    Same(&'a Shown),
    /// A tile of the next coarser level, of which the lower or the upper half.
    Coarser(&'a Shown, usize),
    /// What two finer tiles gave during this step.
    Finer([Option<&'a [f32]>; 2]),
}

/// Coefficients of a plane for a time step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaneStep {
    /// `2 dt/dz` towards below and above, zero where nothing flows.
    pub(crate) along: [f32; 2],
    pub(crate) height: f32,
    /// Heights of the planes below and above, zero for a face that is held.
    pub(crate) heights: [f32; 2],
}

/// One explicit step of conduction in a tile.
pub(crate) struct Conduct<'a> {
    pub(crate) formulas: &'a Formulas<f32>,
    /// `dt/dx²`.
    pub(crate) across: f32,
    pub(crate) planes: &'a [PlaneStep],
    /// `θ` of the lower face, where it is held.
    pub(crate) floor: f32,
    /// Area of a column, mm².
    pub(crate) area: f64,
    pub(crate) tile: &'a mut Tile,
    pub(crate) own: &'a Shown,
    pub(crate) sides: [Side<'a>; 4],
    /// Whether the coarser level beside begins a step with this one.
    pub(crate) first: bool,
}

impl CellLoop for Conduct<'_> {
    #[inline(always)]
    fn run(self) {
        conduct(self);
    }
}

/// The cells of a tile that lie along a side.
#[inline(always)]
fn along(plane: &[f32], side: usize) -> [f32; N] {
    let mut out = [0.0; N];
    match side {
        0 => {
            for n in 0..N {
                out[n] = plane[n * N];
            }
        }
        1 => {
            for n in 0..N {
                out[n] = plane[n * N + N - 1];
            }
        }
        2 => out.copy_from_slice(&plane[..N]),
        _ => out.copy_from_slice(&plane[(N - 1) * N..PLANE]),
    }
    out
}

/// Of a plane with ghosts, the cells `depth` rows inside a side; 0 are the ghosts.
#[inline(always)]
fn inside(padded: &[f32; GHOSTED], side: usize, depth: usize) -> [f32; N] {
    let mut out = [0.0; N];
    match side {
        0 => {
            for n in 0..N {
                out[n] = padded[(n + 1) * ROW + depth];
            }
        }
        1 => {
            for n in 0..N {
                out[n] = padded[(n + 2) * ROW - 1 - depth];
            }
        }
        2 => out.copy_from_slice(&padded[depth * ROW + 1..][..N]),
        _ => out.copy_from_slice(&padded[(N + 1 - depth) * ROW + 1..][..N]),
    }
    out
}

/// Sets the ghosts of a side.
#[inline(always)]
fn put(padded: &mut [f32; GHOSTED], side: usize, values: &[f32; N]) {
    match side {
        0 => {
            for n in 0..N {
                padded[(n + 1) * ROW] = values[n];
            }
        }
        1 => {
            for n in 0..N {
                padded[(n + 2) * ROW - 1] = values[n];
            }
        }
        2 => padded[1..][..N].copy_from_slice(values),
        _ => padded[(N + 1) * ROW + 1..][..N].copy_from_slice(values),
    }
}

/// What a coarser neighbour has before the middles of the fine cells of a side, straight between its cells.
#[inline(always)]
fn between(coarse: &[f32; N], half: usize) -> [f32; N] {
    let mut out = [0.0; N];
    for (n, out) in out.iter_mut().enumerate() {
        let c = half * (N / 2) + n / 2;
        let (low, high) = (c.saturating_sub(1), (c + 1).min(N - 1));
        let slope = (coarse[high] - coarse[low]) / (high - low) as f32;
        *out = coarse[c] + slope * if n % 2 == 0 { -0.25 } else { 0.25 };
    }
    out
}

#[inline(always)]
fn fill(padded: &mut [f32; GHOSTED], own: &[f32]) {
    for j in 0..N {
        padded[(j + 1) * ROW + 1..][..N].copy_from_slice(&own[j * N..][..N]);
    }
}

/// `θ` of plane `k` with its ghosts. Towards coarser cells a parabola through two cells inside and the one outside.
#[inline(always)]
fn pad_theta(padded: &mut [f32; GHOSTED], own: &Shown, sides: &[Side; 4], k: usize) {
    let range = k * PLANE..(k + 1) * PLANE;
    fill(padded, &own.theta[range.clone()]);
    for (s, side) in sides.iter().enumerate() {
        let mut values = inside(padded, s, 1);
        match side {
            Side::Closed | Side::Finer(_) => {}
            Side::Held(theta) => {
                for v in &mut values {
                    *v = theta + theta - *v;
                }
            }
            Side::Same(shown) => values = along(&shown.theta[range.clone()], s ^ 1),
            Side::Coarser(shown, half) => {
                let there = between(&along(&shown.theta[range.clone()], s ^ 1), *half);
                let second = inside(padded, s, 2);
                for n in 0..N {
                    values[n] =
                        (8.0 * there[n] + 10.0 * values[n] - 3.0 * second[n]) * (1.0 / 15.0);
                }
            }
        }
        put(padded, s, &values);
    }
}

/// Shares of the conductivity with their ghosts.
#[inline(always)]
fn pad_share(padded: &mut [f32; GHOSTED], own: &Shown, sides: &[Side; 4], k: usize) {
    let range = k * PLANE..(k + 1) * PLANE;
    fill(padded, &own.share[range.clone()]);
    for (s, side) in sides.iter().enumerate() {
        let mut values = inside(padded, s, 1);
        match side {
            Side::Closed | Side::Finer(_) | Side::Held(_) => {}
            Side::Same(shown) => values = along(&shown.share[range.clone()], s ^ 1),
            Side::Coarser(shown, half) => {
                let there = along(&shown.share[range.clone()], s ^ 1);
                for n in 0..N {
                    values[n] = there[half * (N / 2) + n / 2];
                }
            }
        }
        put(padded, s, &values);
    }
}

#[inline(always)]
fn harmonic(a: f32, b: f32) -> f32 {
    (a + a) * b / (a + b)
}

#[inline(always)]
fn conduct(step: Conduct) {
    let Conduct {
        formulas,
        across,
        planes,
        floor,
        area,
        tile,
        own,
        sides,
        first,
    } = step;
    let mut theta = [0.0_f32; GHOSTED];
    let mut share = [1.0_f32; GHOSTED];
    let last = planes.len() - 1;
    let mut left = 0.0_f64;
    for (k, plane) in planes.iter().enumerate() {
        pad_theta(&mut theta, own, &sides, k);
        let beside = |side: &Side| match side {
            Side::Same(shown) | Side::Coarser(shown, _) => shown.dense[k],
            _ => true,
        };
        let (below, above) = (k.saturating_sub(1), (k + 1).min(last));
        let dense =
            own.dense[k] && own.dense[below] && own.dense[above] && sides.iter().all(beside);
        let of_plane = k * PLANE..(k + 1) * PLANE;
        let mut cells = Cells {
            enthalpy: &mut tile.enthalpy[of_plane.clone()],
            density: &mut tile.density[of_plane.clone()],
            settled: &mut tile.settled[of_plane],
        };
        let held = plane.heights[0] == 0.0;
        let upright = [
            &own.theta[below * PLANE..][..PLANE],
            &own.theta[above * PLANE..][..PLANE],
        ];
        if dense {
            conduct_dense(
                across,
                plane,
                &theta,
                upright,
                held.then_some(floor),
                cells.enthalpy,
            );
        } else {
            pad_share(&mut share, own, &sides, k);
            let shares = [
                &own.share[below * PLANE..][..PLANE],
                &own.share[above * PLANE..][..PLANE],
            ];
            let around = Powdery {
                across,
                plane,
                theta: &theta,
                share: &share,
                upright,
                shares,
                floor: held.then_some(floor),
            };
            conduct_powder(formulas, &around, &mut cells);
        }
        if held {
            // twice the conductance of half a cell; counted before the step, as the cells saw it
            for n in 0..PLANE {
                let c = if dense { 1.0 } else { own.share[k * PLANE + n] };
                let flow = plane.along[0] / plane.height * c * (own.theta[k * PLANE + n] - floor);
                left += f64::from(flow) * area * f64::from(plane.height);
            }
        }
        let edge = Edge {
            across,
            theta: &theta,
            share: (!dense).then_some(&share),
            first,
            k,
        };
        let (g, r) = (cells.enthalpy, cells.density);
        left += exchange(&edge, &sides, &mut tile.out, g, r) * area * f64::from(plane.height);
    }
    tile.lost.conducted += left;
}

/// The rim of a plane in a step.
struct Edge<'a> {
    across: f32,
    theta: &'a [f32; GHOSTED],
    /// Shares of the conductivity where not all are one.
    share: Option<&'a [f32; GHOSTED]>,
    first: bool,
    k: usize,
}

/// Counts what flows out to coarser cells and through faces that are held, and takes what finer cells gave. Returns what leaves
/// through the faces, J/mm³.
#[inline(always)]
fn exchange(
    edge: &Edge,
    sides: &[Side; 4],
    out: &mut [Vec<f32>; 4],
    g: &mut [f32],
    r: &[f32],
) -> f64 {
    let mut left = 0.0_f64;
    for (s, side) in sides.iter().enumerate() {
        match side {
            Side::Coarser(..) | Side::Held(_) => {
                let (inner, ghost) = (inside(edge.theta, s, 1), inside(edge.theta, s, 0));
                let mut shares = [1.0; N];
                if let Some(share) = edge.share {
                    let (a, b) = (inside(share, s, 1), inside(share, s, 0));
                    for n in 0..N {
                        shares[n] = harmonic(a[n], b[n]);
                    }
                }
                let mut sum = 0.0_f64;
                for n in 0..N {
                    let heat = edge.across * shares[n] * (inner[n] - ghost[n]);
                    sum += f64::from(heat);
                    if let Some(out) = out[s].get_mut(edge.k * N + n) {
                        *out = if edge.first { heat } else { *out + heat };
                    }
                }
                if matches!(side, Side::Held(_)) {
                    left += sum;
                }
            }
            Side::Finer(halves) => {
                for n in 0..N {
                    let Some(gave) = halves[n / (N / 2)] else {
                        continue;
                    };
                    let from = edge.k * N + 2 * (n % (N / 2));
                    let heat = 0.25 * (gave[from] + gave[from + 1]);
                    let cell = match s {
                        0 => n * N,
                        1 => n * N + N - 1,
                        2 => n,
                        _ => (N - 1) * N + n,
                    };
                    g[cell] += heat / r[cell];
                }
            }
            Side::Closed | Side::Same(_) => {}
        }
    }
    left
}

#[inline(always)]
fn conduct_dense(
    across: f32,
    plane: &PlaneStep,
    theta: &[f32; GHOSTED],
    [below, above]: [&[f32]; 2],
    floor: Option<f32>,
    g: &mut [f32],
) {
    let bd = plane.along[0] / (plane.height + plane.heights[0]);
    let bu = plane.along[1] / (plane.height + plane.heights[1]);
    let held = [floor.unwrap_or(0.0); N];
    for j in 0..N {
        let row = (j + 1) * ROW;
        let [t, west, east, south, north] = star(theta, row);
        let down = if floor.is_some() {
            &held[..]
        } else {
            &below[j * N..][..N]
        };
        let up = &above[j * N..][..N];
        let g = &mut g[j * N..][..N];
        for i in 0..N {
            g[i] += across
                * ((west[i] - t[i]) + (east[i] - t[i]) + (south[i] - t[i]) + (north[i] - t[i]))
                + bd * (down[i] - t[i])
                + bu * (up[i] - t[i]);
        }
    }
}

/// What surrounds the cells of a plane that holds powder or touches it.
struct Powdery<'a> {
    across: f32,
    plane: &'a PlaneStep,
    theta: &'a [f32; GHOSTED],
    share: &'a [f32; GHOSTED],
    upright: [&'a [f32]; 2],
    shares: [&'a [f32]; 2],
    floor: Option<f32>,
}

/// A row of cells and those west, east, south and north of it.
#[inline(always)]
fn star(values: &[f32; GHOSTED], row: usize) -> [&[f32]; 5] {
    [
        &values[row + 1..][..N],
        &values[row..][..N],
        &values[row + 2..][..N],
        &values[row + 1 - ROW..][..N],
        &values[row + 1 + ROW..][..N],
    ]
}

/// What flows from a row of cells to another, from where their first cells are.
#[inline(always)]
fn between_rows(around: &Powdery, from: usize, to: usize) -> [f32; N] {
    let (a, b) = (&around.share[from..][..N], &around.share[to..][..N]);
    let (t, u) = (&around.theta[from..][..N], &around.theta[to..][..N]);
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = harmonic(a[i], b[i]) * (t[i] - u[i]);
    }
    out
}

/// Harmonic shares of the conductivity between cells; each face once.
#[inline(always)]
fn conduct_powder(f: &Formulas<f32>, around: &Powdery, cells: &mut Cells) {
    let PlaneStep {
        along: [bd, bu],
        height: h,
        heights: [hd, hu],
    } = *around.plane;
    let held = [around.floor.unwrap_or(0.0); N];
    let mut heat = [0.0_f32; PLANE];
    // what the row gives to the one south of it, which took as much
    let mut to_south = between_rows(around, ROW + 1, 1);
    for (j, heat) in heat.chunks_exact_mut(N).enumerate() {
        let row = (j + 1) * ROW;
        let ([t, west, east, _, north], [c, cw, ce, _, cn]) =
            (star(around.theta, row), star(around.share, row));
        let down = match around.floor {
            Some(_) => &held[..],
            None => &around.upright[0][j * N..][..N],
        };
        let up = &around.upright[1][j * N..][..N];
        let [cd, cu] = [
            &around.shares[0][j * N..][..N],
            &around.shares[1][j * N..][..N],
        ];
        for i in 0..N {
            // one division for all five means
            let ci = c[i];
            let (w, e, n) = (ci + cw[i], ci + ce[i], ci + cn[i]);
            let (below, above) = (h * cd[i] + hd * ci, h * cu[i] + hu * ci);
            let (flat, upright) = (w * e, below * above);
            let shares = ci / (flat * n * upright);
            let (of_flat, of_rest) = (2.0 * shares * n * upright, shares * flat);
            let from_north = 2.0 * of_rest * upright * cn[i] * (north[i] - t[i]);
            let beside = of_flat * (e * cw[i] * (west[i] - t[i]) + w * ce[i] * (east[i] - t[i]));
            let vertical =
                bd * cd[i] * above * (down[i] - t[i]) + bu * cu[i] * below * (up[i] - t[i]);
            heat[i] =
                around.across * (beside + (from_north - to_south[i])) + of_rest * n * vertical;
            to_south[i] = from_north;
        }
    }
    cells.warm(f, &heat);
}
