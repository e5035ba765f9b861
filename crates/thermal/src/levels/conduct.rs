//! One explicit step of conduction in a tile, with what lies beside it on its own level, a coarser or a finer one.

use super::beneath::{Under, look_beneath};
use super::tile::{Beneath, Cells, N, PLANE, Shown, Tile};
use crate::material::enthalpy::Formulas;
use meltpath_numerics::vector::Loop;

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
    /// One that takes longer steps.
    Slower(&'a Shown),
    /// One that takes shorter steps: what it gave during this one is in the inbox.
    Quicker,
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
    /// Area of a column, mm².
    pub(crate) area: f64,
    pub(crate) tile: &'a mut Tile,
    pub(crate) own: &'a Shown,
    /// What lies beside the planes below `split`, and beside the others.
    pub(crate) sides: [[Side<'a>; 4]; 2],
    /// The lowest plane of the next finer level.
    pub(crate) split: usize,
    pub(crate) under: Under<'a>,
    /// What the four finer tiles on a trunk gave it during this step.
    pub(crate) over: [Option<&'a [f32]>; 4],
    pub(crate) first: First,
}

/// Whether what takes a tile's heat at the end of its own longer step begins one with this step: what was given before is taken.
#[derive(Clone, Copy)]
pub(crate) struct First {
    /// What lies beside, coarser or slower.
    pub(crate) beside: [bool; 4],
    /// The trunk below.
    pub(crate) below: bool,
}

impl Loop for Conduct<'_> {
    #[inline(always)]
    fn run(self) {
        conduct(self);
    }
}

/// The first cells of a row.
#[inline(always)]
#[expect(
    clippy::manual_memcpy,
    reason = "the library's function is called in place of one move of a register"
)]
fn copy(to: &mut [f32], from: &[f32]) {
    let (to, from) = (&mut to[..N], &from[..N]);
    for i in 0..N {
        to[i] = from[i];
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
        2 => copy(&mut out, plane),
        _ => copy(&mut out, &plane[(N - 1) * N..]),
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
        2 => copy(&mut out, &padded[depth * ROW + 1..]),
        _ => copy(&mut out, &padded[(N + 1 - depth) * ROW + 1..]),
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
        2 => copy(&mut padded[1..], values),
        _ => copy(&mut padded[(N + 1) * ROW + 1..], values),
    }
}

/// What a coarser neighbour has before the middles of the fine cells of a side, straight between its cells.
#[inline(always)]
#[expect(
    clippy::manual_memcpy,
    reason = "the library's function is called in place of one move of a register"
)]
fn between(coarse: &[f32; N], half: usize) -> [f32; N] {
    // one cell beyond each end of the half, at the ends of the side the last one again
    let from = half * (N / 2);
    let mut near = [0.0; N / 2 + 2];
    for n in 0..N / 2 {
        near[n + 1] = coarse[from + n];
    }
    near[0] = coarse[from.saturating_sub(1)];
    near[N / 2 + 1] = coarse[(from + N / 2).min(N - 1)];
    let mut slopes = [0.0; N / 2];
    for n in 0..N / 2 {
        slopes[n] = 0.125 * (near[n + 2] - near[n]);
    }
    if half == 0 {
        slopes[0] *= 2.0;
    } else {
        slopes[N / 2 - 1] *= 2.0;
    }
    let mut out = [0.0; N];
    for n in 0..N / 2 {
        out[2 * n] = near[n + 1] - slopes[n];
        out[2 * n + 1] = near[n + 1] + slopes[n];
    }
    out
}

#[inline(always)]
fn fill(padded: &mut [f32; GHOSTED], own: &[f32]) {
    for j in 0..N {
        copy(&mut padded[(j + 1) * ROW + 1..], &own[j * N..]);
    }
}

/// `θ` of plane `k` with its ghosts. Towards coarser cells a parabola through two cells inside and the one outside.
#[inline(always)]
fn pad_theta(padded: &mut [f32; GHOSTED], own: &Shown, sides: &[Side; 4], k: usize) {
    fill(padded, own.theta(k));
    for (s, side) in sides.iter().enumerate() {
        let values = match side {
            Side::Closed | Side::Quicker | Side::Finer(_) => inside(padded, s, 1),
            Side::Held(theta) => {
                let mut values = inside(padded, s, 1);
                for v in &mut values {
                    *v = theta + theta - *v;
                }
                values
            }
            Side::Same(shown) | Side::Slower(shown) => along(shown.theta(k), s ^ 1),
            Side::Coarser(shown, half) => {
                let there = between(&along(shown.theta(k), s ^ 1), *half);
                let (mut values, second) = (inside(padded, s, 1), inside(padded, s, 2));
                for n in 0..N {
                    values[n] =
                        (8.0 * there[n] + 10.0 * values[n] - 3.0 * second[n]) * (1.0 / 15.0);
                }
                values
            }
        };
        put(padded, s, &values);
    }
}

/// Shares of the conductivity with their ghosts.
#[inline(always)]
fn pad_share(padded: &mut [f32; GHOSTED], own: &Shown, sides: &[Side; 4], k: usize) {
    fill(padded, own.share(k));
    for (s, side) in sides.iter().enumerate() {
        let values = match side {
            Side::Closed | Side::Quicker | Side::Finer(_) | Side::Held(_) => inside(padded, s, 1),
            Side::Same(shown) | Side::Slower(shown) => along(shown.share(k), s ^ 1),
            Side::Coarser(shown, half) => {
                let there = along(shown.share(k), s ^ 1);
                let mut values = [0.0; N];
                for n in 0..N {
                    values[n] = there[half * (N / 2) + n / 2];
                }
                values
            }
        };
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
        area,
        tile,
        own,
        sides,
        split,
        under,
        over,
        first,
    } = step;
    let mut theta = [0.0_f32; GHOSTED];
    let mut share = [1.0_f32; GHOSTED];
    let beneath = beneath(tile, &under, first.below);
    let (base, end) = (own.base, own.base + own.dense.len());
    let mut left = 0.0_f64;
    for k in base..end {
        let mut plane = planes[k];
        let (lowest, above) = (k == base, (k + 1).min(end - 1));
        if lowest && matches!(under, Under::Closed) {
            plane.along[0] = 0.0;
        }
        if k + 1 == end {
            plane.along[1] = 0.0;
        }
        let sides = &sides[usize::from(k >= split)];
        pad_theta(&mut theta, own, sides, k);
        let beside = |side: &Side| match side {
            Side::Same(shown) | Side::Slower(shown) | Side::Coarser(shown, _) => shown.dense(k),
            _ => true,
        };
        let below_dense = if lowest {
            beneath.dense
        } else {
            own.dense(k - 1)
        };
        let dense = own.dense(k) && below_dense && own.dense(above) && sides.iter().all(beside);
        let of_plane = (k - base) * PLANE..(k - base + 1) * PLANE;
        let mut cells = Cells {
            enthalpy: &mut tile.enthalpy[of_plane.clone()],
            density: &mut tile.density[of_plane.clone()],
            settled: &mut tile.settled[of_plane],
        };
        let upright = if lowest {
            [&beneath.theta[..], own.theta(above)]
        } else {
            [own.theta(k - 1), own.theta(above)]
        };
        if dense {
            conduct_dense(across, &plane, &theta, upright, cells.enthalpy);
        } else {
            pad_share(&mut share, own, sides, k);
            let shares = if lowest {
                [&beneath.share[..], own.share(above)]
            } else {
                [own.share(k - 1), own.share(above)]
            };
            let around = Powdery {
                across,
                plane: &plane,
                theta: &theta,
                share: &share,
                upright,
                shares,
            };
            conduct_powder(formulas, &around, &mut cells);
        }
        if lowest {
            let heat = downwards(&plane, own, &beneath);
            if matches!(under, Under::Held(_)) {
                let sum: f64 = heat.iter().map(|h| f64::from(*h)).sum();
                left += sum * area * f64::from(plane.height);
            }
            for (down, heat) in tile.down.iter_mut().zip(heat) {
                *down = if first.below { heat } else { *down + heat };
            }
        }
        let edge = Edge {
            across,
            theta: &theta,
            share: (!dense).then_some(&share),
            first: first.beside,
            row: (k - base) * N,
            finer: k.saturating_sub(split) * N,
        };
        let (g, r) = (cells.enthalpy, cells.density);
        let boxes = (&mut tile.out, &tile.inbox);
        left += exchange(&edge, sides, boxes, g, r) * area * f64::from(plane.height);
        if k + 1 == end && end < planes.len() {
            take_from_above(over, planes[end].height / plane.height, g, r);
        }
    }
    tile.beneath = Some(beneath);
    tile.lost.conducted += left;
}

/// What lies under a tile: what a trunk shows changes when it begins a step, else it is known.
#[inline(always)]
fn beneath(tile: &mut Tile, under: &Under, first: bool) -> Box<Beneath> {
    match tile.beneath.take() {
        Some(known) if !first => known,
        before => {
            let mut beneath = before.unwrap_or_default();
            look_beneath(&mut beneath, under);
            beneath
        }
    }
}

/// What the cells of the lowest plane give downwards, J/mm³.
#[inline(always)]
fn downwards(plane: &PlaneStep, own: &Shown, beneath: &Beneath) -> [f32; PLANE] {
    let theta = own.theta(own.base);
    let [h, hd] = [plane.height, plane.heights[0]];
    let mut heat = [0.0_f32; PLANE];
    if own.dense(own.base) && beneath.dense {
        let flows = plane.along[0] / (h + hd);
        for n in 0..PLANE {
            heat[n] = flows * (theta[n] - beneath.theta[n]);
        }
        return heat;
    }
    let share = own.share(own.base);
    for n in 0..PLANE {
        let (c, cd) = (share[n], beneath.share[n]);
        heat[n] = plane.along[0] * c * cd / (h * cd + hd * c) * (theta[n] - beneath.theta[n]);
    }
    heat
}

/// Takes what four finer tiles gave to the highest plane of a trunk; `heights` is theirs over its own.
#[inline(always)]
fn take_from_above(over: [Option<&[f32]>; 4], heights: f32, g: &mut [f32], r: &[f32]) {
    for (q, down) in over.iter().enumerate() {
        let Some(down) = down else {
            continue;
        };
        for n in 0..PLANE / 4 {
            let (i, j) = (n % (N / 2), n / (N / 2));
            let from = 2 * j * N + 2 * i;
            let four = down[from] + down[from + 1] + down[from + N] + down[from + N + 1];
            let cell = (q / 2 * (N / 2) + j) * N + q % 2 * (N / 2) + i;
            g[cell] += 0.25 * heights * four / r[cell];
        }
    }
}

/// The rim of a plane in a step.
struct Edge<'a> {
    across: f32,
    theta: &'a [f32; GHOSTED],
    /// Shares of the conductivity where not all are one.
    share: Option<&'a [f32; GHOSTED]>,
    first: [bool; 4],
    /// Where the row's cells begin in what the tile gives to coarser ones, and in what finer ones gave.
    row: usize,
    finer: usize,
}

/// Counts what flows out to coarser cells and through faces that are held, and takes what finer cells gave. Returns what leaves
/// through the faces, J/mm³.
#[inline(always)]
fn exchange(
    edge: &Edge,
    sides: &[Side; 4],
    (out, inbox): (&mut [Vec<f32>; 4], &[Vec<f32>; 4]),
    g: &mut [f32],
    r: &[f32],
) -> f64 {
    let mut left = 0.0_f64;
    for (s, side) in sides.iter().enumerate() {
        match side {
            Side::Coarser(..) | Side::Slower(_) | Side::Held(_) => {
                let (inner, ghost) = (inside(edge.theta, s, 1), inside(edge.theta, s, 0));
                let mut shares = [1.0; N];
                if let Some(share) = edge.share {
                    let (a, b) = (inside(share, s, 1), inside(share, s, 0));
                    for n in 0..N {
                        shares[n] = harmonic(a[n], b[n]);
                    }
                }
                let mut heat = [0.0_f32; N];
                for n in 0..N {
                    heat[n] = edge.across * shares[n] * (inner[n] - ghost[n]);
                }
                if matches!(side, Side::Held(_)) {
                    left += heat.iter().map(|h| f64::from(*h)).sum::<f64>();
                }
                let out = out[s].get_mut(edge.row..edge.row + N);
                for (out, heat) in out.into_iter().flatten().zip(heat) {
                    *out = if edge.first[s] { heat } else { *out + heat };
                }
            }
            Side::Finer(halves) => {
                for n in 0..N {
                    let Some(gave) = halves[n / (N / 2)] else {
                        continue;
                    };
                    let from = edge.finer + 2 * (n % (N / 2));
                    let heat = 0.25 * (gave[from] + gave[from + 1]);
                    let cell = rim(s, n);
                    g[cell] += heat / r[cell];
                }
            }
            Side::Quicker => {
                for (n, heat) in inbox[s].iter().skip(edge.row).take(N).enumerate() {
                    let cell = rim(s, n);
                    g[cell] += heat / r[cell];
                }
            }
            Side::Closed | Side::Same(_) => {}
        }
    }
    left
}

/// The cell of a plane that is the `n`th along a side.
#[inline(always)]
fn rim(side: usize, n: usize) -> usize {
    match side {
        0 => n * N,
        1 => n * N + N - 1,
        2 => n,
        _ => (N - 1) * N + n,
    }
}

#[inline(always)]
fn conduct_dense(
    across: f32,
    plane: &PlaneStep,
    theta: &[f32; GHOSTED],
    [below, above]: [&[f32]; 2],
    g: &mut [f32],
) {
    let bd = plane.along[0] / (plane.height + plane.heights[0]);
    let bu = plane.along[1] / (plane.height + plane.heights[1]);
    for j in 0..N {
        let row = (j + 1) * ROW;
        let [t, west, east, south, north] = star(theta, row);
        let down = &below[j * N..][..N];
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
    let mut heat = [0.0_f32; PLANE];
    // what the row gives to the one south of it, which took as much
    let mut to_south = between_rows(around, ROW + 1, 1);
    for (j, heat) in heat.chunks_exact_mut(N).enumerate() {
        let row = (j + 1) * ROW;
        let ([t, west, east, _, north], [c, cw, ce, _, cn]) =
            (star(around.theta, row), star(around.share, row));
        let down = &around.upright[0][j * N..][..N];
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
