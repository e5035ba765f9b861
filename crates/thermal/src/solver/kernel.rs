//! The loops over cells, one plane at a time: Kirchhoff integral from enthalpy, and the heat that flows between cells.
//!
//! Rows, and stretches of rows, that are dense or not molten take short cuts that give the same bits. There is no fused
//! multiply-add, so the bits are the same with any vector registers.

use std::ops::Range;

use crate::material::enthalpy::Formulas;
use crate::numeric::real::Real;
use meltpath_numerics::vector::Loop;

/// Cells of a row that take the same short cut: a few vector registers.
const STRETCH: usize = 64;

/// What surrounds a plane of cells: the planes' own `θ` and conduction share with one ghost cell on each side in x and
/// y, and what lies below and above.
#[derive(Clone, Copy)]
pub(crate) struct Neighbourhood<'a, R> {
    pub(crate) theta: [&'a [R]; 3],
    pub(crate) conduction: [&'a [R]; 3],
    /// Whether rows `−1..=ny` of the plane hold powder; then of the planes below and above.
    pub(crate) powder: [&'a [bool]; 3],
}

/// Coefficients of one plane for one time step.
#[derive(Clone, Copy)]
pub(crate) struct PlaneStep<R> {
    pub(crate) cells: [usize; 2],
    /// `dt/dx²`, `dt/dy²`.
    pub(crate) across: [R; 2],
    /// `2 dt/dz` towards below and above, zero where nothing flows.
    pub(crate) along: [R; 2],
    pub(crate) height: R,
    /// Heights of the cells below and above, zero for a face at an imposed temperature.
    pub(crate) heights: [R; 2],
}

/// Fills `θ`, the conduction share and the highest enthalpy of a plane from its enthalpy and relative density.
pub(crate) struct Refresh<'a, R> {
    pub(crate) formulas: &'a Formulas<R>,
    pub(crate) cells: [usize; 2],
    /// Rows to do.
    pub(crate) rows: &'a [Range<usize>],
    pub(crate) enthalpy: &'a [R],
    pub(crate) density: &'a [R],
    pub(crate) powder: &'a [bool],
    pub(crate) highest: &'a mut [R],
    pub(crate) theta: &'a mut [R],
    pub(crate) conduction: &'a mut [R],
}

impl<R: Real> Loop for Refresh<'_, R> {
    #[inline(always)]
    fn run(self) {
        refresh_plane(self);
    }
}

#[inline(always)]
fn refresh_plane<R: Real>(plane: Refresh<R>) {
    let Refresh {
        formulas,
        cells,
        rows,
        enthalpy,
        density,
        powder,
        highest,
        theta,
        conduction,
    } = plane;
    let f = *formulas;
    let [nx, _] = cells;
    for j in rows.iter().cloned().flatten() {
        let g = &enthalpy[j * nx..][..nx];
        let peak = &mut highest[j * nx..][..nx];
        let out = &mut theta[(j + 1) * (nx + 2) + 1..][..nx];
        let stretches = g.chunks(STRETCH).zip(peak.chunks_mut(STRETCH));
        for ((g, peak), out) in stretches.zip(out.chunks_mut(STRETCH)) {
            refresh_stretch(&f, g, peak, out);
        }
        if powder[j + 1] {
            let r = &density[j * nx..][..nx];
            let c = &mut conduction[(j + 1) * (nx + 2) + 1..][..nx];
            for i in 0..nx {
                c[i] = f.conduction(r[i]);
            }
        }
    }
}

#[inline(always)]
fn refresh_stretch<R: Real>(f: &Formulas<R>, g: &[R], peak: &mut [R], out: &mut [R]) {
    let n = g.len();
    let (peak, out) = (&mut peak[..n], &mut out[..n]);
    let mut molten = 0_u32;
    for i in 0..n {
        peak[i] = peak[i].larger(g[i]);
        molten |= u32::from(g[i] > f.solidus());
    }
    if molten == 0 {
        for i in 0..n {
            out[i] = f.kirchhoff_solid(g[i]);
        }
    } else {
        for i in 0..n {
            out[i] = f.kirchhoff(g[i]);
        }
    }
}

/// Lets heat flow into the cells of a plane for one time step; `still` tells which rows hold powder after it.
pub(crate) struct Advance<'a, R> {
    pub(crate) formulas: &'a Formulas<R>,
    /// Rows to do.
    pub(crate) rows: &'a [Range<usize>],
    pub(crate) step: PlaneStep<R>,
    pub(crate) around: Neighbourhood<'a, R>,
    pub(crate) enthalpy: &'a mut [R],
    pub(crate) density: &'a mut [R],
    pub(crate) still: &'a mut [bool],
}

impl<R: Real> Loop for Advance<'_, R> {
    #[inline(always)]
    fn run(self) {
        advance_plane(self);
    }
}

#[inline(always)]
fn advance_plane<R: Real>(plane: Advance<R>) {
    let Advance {
        formulas,
        rows,
        step,
        around,
        enthalpy,
        density,
        still,
    } = plane;
    let f = *formulas;
    let [nx, _] = step.cells;
    let stride = nx + 2;
    for j in rows.iter().cloned().flatten() {
        let g = &mut enthalpy[j * nx..][..nx];
        let row = (j + 1) * stride;
        let [below, plane, above] = around.theta;
        let t = &plane[row + 1..][..nx];
        let (west, east) = (&plane[row..][..nx], &plane[row + 2..][..nx]);
        let (south, north) = (
            &plane[row + 1 - stride..][..nx],
            &plane[row + 1 + stride..][..nx],
        );
        let (down, up) = (&below[row + 1..][..nx], &above[row + 1..][..nx]);
        let [pb, pp, pa] = around.powder;
        // beyond the ends of a row lies what lies within: a dense row has dense ends
        let powder = pp[j] | pp[j + 1] | pp[j + 2] | pb[j + 1] | pa[j + 1];
        let theta = Star {
            here: t,
            sides: [west, east, south, north, down, up],
        };
        if !powder {
            conduct_dense(&step, &theta, g);
            still[j] = false;
            continue;
        }
        let [cb, cp, ca] = around.conduction;
        let shares = Star {
            here: &cp[row + 1..][..nx],
            sides: [
                &cp[row..][..nx],
                &cp[row + 2..][..nx],
                &cp[row + 1 - stride..][..nx],
                &cp[row + 1 + stride..][..nx],
                &cb[row + 1..][..nx],
                &ca[row + 1..][..nx],
            ],
        };
        let r = &mut density[j * nx..][..nx];
        let mut left = false;
        for from in (0..nx).step_by(STRETCH) {
            let part = from..(from + STRETCH).min(nx);
            let (theta, shares) = (theta.part(&part), shares.part(&part));
            if shares.dense() {
                conduct_dense(&step, &theta, &mut g[part]);
            } else {
                left |= conduct_powder(
                    &f,
                    &step,
                    &theta,
                    &shares,
                    &mut g[part.clone()],
                    &mut r[part],
                );
            }
        }
        still[j] = left;
    }
}

/// A row of cells, or a stretch of it, and its neighbours: west, east, south, north, below, above.
#[derive(Clone, Copy)]
struct Star<'a, R> {
    here: &'a [R],
    sides: [&'a [R]; 6],
}

impl<'a, R: Real> Star<'a, R> {
    #[inline(always)]
    fn part(&self, range: &Range<usize>) -> Star<'a, R> {
        Star {
            here: &self.here[range.clone()],
            sides: {
                let [w, e, s, n, d, u] = self.sides;
                let (from, to) = (range.start, range.end);
                [
                    &w[from..to],
                    &e[from..to],
                    &s[from..to],
                    &n[from..to],
                    &d[from..to],
                    &u[from..to],
                ]
            },
        }
    }

    /// All sides cut to the same length, so that loops over them need no checks.
    #[inline(always)]
    fn cut(&self) -> (&'a [R], [&'a [R]; 6]) {
        let n = self.here.len();
        let [w, e, s, north, d, u] = self.sides;
        (
            self.here,
            [&w[..n], &e[..n], &s[..n], &north[..n], &d[..n], &u[..n]],
        )
    }

    /// Whether all shares of the conductivity are one.
    #[inline(always)]
    fn dense(&self) -> bool {
        let (here, [w, e, s, north, d, u]) = self.cut();
        let mut powder = 0_u32;
        for i in 0..here.len() {
            let least = here[i]
                .smaller(w[i].smaller(e[i]))
                .smaller(s[i].smaller(north[i]))
                .smaller(d[i].smaller(u[i]));
            powder |= u32::from(least < R::ONE);
        }
        powder == 0
    }
}

/// The sums of [`conduct_powder`] with every share 1, in the same order.
#[inline(always)]
fn conduct_dense<R: Real>(step: &PlaneStep<R>, theta: &Star<R>, g: &mut [R]) {
    let (t, [west, east, south, north, down, up]) = theta.cut();
    let n = t.len();
    let g = &mut g[..n];
    let [ax, ay] = step.across;
    let bd = step.along[0] * (R::ONE / (step.height + step.heights[0]));
    let bu = step.along[1] * (R::ONE / (step.height + step.heights[1]));
    for i in 0..n {
        let heat = ax * ((west[i] - t[i]) + (east[i] - t[i]))
            + ay * ((south[i] - t[i]) + (north[i] - t[i]))
            + bd * (down[i] - t[i])
            + bu * (up[i] - t[i]);
        g[i] += heat;
    }
}

/// Harmonic shares of conductivity between cells; whether powder is left.
#[inline(always)]
fn conduct_powder<R: Real>(
    f: &Formulas<R>,
    step: &PlaneStep<R>,
    theta: &Star<R>,
    shares: &Star<R>,
    g: &mut [R],
    r: &mut [R],
) -> bool {
    let (t, [west, east, south, north, down, up]) = theta.cut();
    let n = t.len();
    let (c, [cw, ce, cs, cn, cd, cu]) = shares.part(&(0..n)).cut();
    let (g, r) = (&mut g[..n], &mut r[..n]);
    let [ax, ay] = step.across;
    let (h, [hd, hu], [bd, bu]) = (step.height, step.heights, step.along);
    let mut left = 0_u32;
    for i in 0..n {
        let ci = c[i];
        let flat = |cj: R| (ci + ci) * cj / (ci + cj);
        let upright = |cj: R, hj: R| ci * cj / (h * cj + hj * ci);
        let heat = ax * (flat(cw[i]) * (west[i] - t[i]) + flat(ce[i]) * (east[i] - t[i]))
            + ay * (flat(cs[i]) * (south[i] - t[i]) + flat(cn[i]) * (north[i] - t[i]))
            + bd * upright(cd[i], hd) * (down[i] - t[i])
            + bu * upright(cu[i], hu) * (up[i] - t[i]);
        (g[i], r[i]) = warm(f, g[i], r[i], heat);
        left |= u32::from(r[i] < R::ONE);
    }
    left != 0
}

/// Adds `heat` (J/mm³ of the cell) to a cell with enthalpy `g` and relative density `r`: second order in the heat where
/// powder is heated for the first time and becomes denser.
#[inline(always)]
pub(crate) fn warm<R: Real>(f: &Formulas<R>, g: R, r: R, heat: R) -> (R, R) {
    let first = f.relative_density(g + heat / r).larger(r);
    let after = g + (heat + heat) / (r + first);
    (after, f.relative_density(after).larger(r))
}

/// Adds `scale·share[i]` J/mm³ to a row of cells.
pub(crate) struct HeatRow<'a, R> {
    pub(crate) formulas: &'a Formulas<R>,
    pub(crate) share: &'a [R],
    pub(crate) scale: R,
    pub(crate) powder: bool,
    pub(crate) enthalpy: &'a mut [R],
    pub(crate) density: &'a mut [R],
}

impl<R: Real> Loop for HeatRow<'_, R> {
    #[inline(always)]
    fn run(self) {
        let n = self.share.len();
        let (share, scale, f) = (self.share, self.scale, *self.formulas);
        let (enthalpy, density) = (&mut self.enthalpy[..n], &mut self.density[..n]);
        if self.powder {
            for i in 0..n {
                (enthalpy[i], density[i]) = warm(&f, enthalpy[i], density[i], scale * share[i]);
            }
        } else {
            for i in 0..n {
                enthalpy[i] += scale * share[i];
            }
        }
    }
}
