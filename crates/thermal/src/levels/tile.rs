//! A tile: a square of columns of cells on one level, and the loops over its cells.

use std::ops::Range;

use super::skin::{LookAtSkin, Skin};
use crate::material::enthalpy::Formulas;
use crate::solver::kernel::warm;
use crate::solver::ledger::Ledger;
use crate::solver::steam::Lift;
use meltpath_numerics::vector::Loop;

/// Cells along an edge of a tile.
pub(crate) const N: usize = 16;
/// Cells that loops take together: enough that one does not wait for the other.
const LANES: usize = 64;
/// Cells of a plane of a tile.
pub(crate) const PLANE: usize = N * N;
/// Highest planes whose freezing is followed.
pub(crate) const FOLLOWED: usize = 2;

/// How much hotter powder may be than its density tells, as a share of the enthalpy from the start to the solidus: some 4 K.
const LAG: f32 = 0.005;

/// West, east, south, north.
pub(crate) const SIDES: [[isize; 2]; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];

/// How the highest planes froze; values of [`FOLLOWED`] planes, bottom first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Froze {
    pub(crate) before: Vec<f32>,
    /// Time above the liquidus, s.
    pub(crate) above: Vec<f32>,
    /// When it last fell through the liquidus, s; not a number where it has not.
    pub(crate) fell: Vec<f32>,
    /// How fast it then cooled, K/s.
    pub(crate) rate: Vec<f32>,
}

/// State of the cells of a tile, planes bottom first.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    /// Column and row of the tile on its level.
    pub(crate) at: [usize; 2],
    /// Its lowest plane, counted from the bottom of all.
    pub(crate) base: usize,
    pub(crate) enthalpy: Vec<f32>,
    /// Enthalpies at the begin of the present pair of steps.
    pub(crate) begun: Vec<f32>,
    pub(crate) density: Vec<f32>,
    /// Enthalpies at which powder grew as dense as it is, see [`Cells::warm`].
    pub(crate) settled: Vec<f32>,
    /// Highest enthalpies of the highest planes since the tile was made.
    pub(crate) peak: Vec<f32>,
    pub(crate) froze: Froze,
    /// The build plane over it.
    pub(crate) skin: Skin,
    /// Heat given to coarser or slower cells beside during their step, J/mm³ of these cells.
    pub(crate) out: [Vec<f32>; 4],
    /// What quicker tiles of the same level gave, while this one takes it; see [`super::step`].
    pub(crate) inbox: [Vec<f32>; 4],
    /// Heat given to the trunk below during its step, J/mm³ of the cells of the lowest plane; empty where none lies there.
    pub(crate) down: Vec<f32>,
    /// What that trunk shows, since it began its step.
    pub(crate) beneath: Option<Box<Beneath>>,
    /// Largest enthalpy above the start, J/mm³, and how strongly `θ` bends from cell to cell, W/mm, in all planes and in those
    /// that the next finer level has too; of the last look.
    pub(crate) warmth: f32,
    pub(crate) bend: f32,
    pub(crate) bend_high: f32,
    /// Largest `θ`, W/mm, of the last look.
    pub(crate) highest: f32,
    /// Some cell that may melt is as hot as it ever was.
    pub(crate) rising: bool,
    /// What was radiated, evaporated and conducted out since the last count.
    pub(crate) lost: Ledger,
}

/// The highest plane of a tile that reaches the build plane.
pub(crate) struct Uppermost<'a> {
    pub(crate) enthalpy: &'a mut [f32],
    pub(crate) density: &'a mut [f32],
    /// Heat that arrived on it, J/mm².
    pub(crate) arrived: &'a [f32],
    /// Where its losses are written down.
    pub(crate) lost: &'a mut Ledger,
}

/// What others see of a tile during a step.
#[derive(Debug, Clone)]
pub(crate) struct Shown {
    /// Its lowest plane, counted from the bottom of all.
    pub(crate) base: usize,
    /// `θ`, W/mm.
    pub(crate) theta: Vec<f32>,
    /// Share of the dense conductivity; one where the plane is dense.
    pub(crate) share: Vec<f32>,
    /// Whether a plane holds no powder.
    pub(crate) dense: Vec<bool>,
    /// As cold as at the start, as all beside: nothing is computed.
    pub(crate) asleep: bool,
    /// The beam reaches it before the tiles are looked at again, or temperatures are told there.
    pub(crate) lit: bool,
    /// The beam heats it by much until then, or temperatures are told there: it takes short steps.
    pub(crate) hit: bool,
    pub(crate) class: Class,
}

/// What lies under the cells of the lowest plane: `θ`, and shares of the dense conductivity.
#[derive(Debug, Clone)]
pub(crate) struct Beneath {
    pub(crate) theta: [f32; PLANE],
    pub(crate) share: [f32; PLANE],
    pub(crate) dense: bool,
}

impl Default for Beneath {
    fn default() -> Self {
        Beneath {
            theta: [0.0; PLANE],
            share: [1.0; PLANE],
            dense: true,
        }
    }
}

/// Which of the two steps of its level a tile takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Class {
    Slow,
    Quick,
}

/// Which step of a pair; see [`super::pace`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Half {
    First,
    Second,
}

impl Shown {
    /// Whether it goes on with the steps of a class.
    pub(crate) fn steps(&self, class: Class) -> bool {
        !self.asleep && self.class == class
    }

    pub(crate) fn new(planes: Range<usize>) -> Self {
        let count = planes.len();
        Shown {
            base: planes.start,
            theta: vec![0.0; count * PLANE],
            share: vec![1.0; count * PLANE],
            dense: vec![false; count],
            asleep: false,
            lit: false,
            hit: false,
            class: Class::Quick,
        }
    }

    /// `θ` of a plane, counted from the bottom of all.
    pub(crate) fn theta(&self, plane: usize) -> &[f32] {
        &self.theta[(plane - self.base) * PLANE..][..PLANE]
    }

    /// Shares of the dense conductivity of a plane.
    pub(crate) fn share(&self, plane: usize) -> &[f32] {
        &self.share[(plane - self.base) * PLANE..][..PLANE]
    }

    /// Whether a plane holds no powder.
    pub(crate) fn dense(&self, plane: usize) -> bool {
        self.dense[plane - self.base]
    }
}

impl Tile {
    /// A tile of dense cells at the start temperature, of whose `tracked` highest planes the highest enthalpies are kept.
    pub(crate) fn new(at: [usize; 2], planes: Range<usize>, tracked: usize) -> Self {
        let followed = FOLLOWED.min(tracked) * PLANE;
        let count = planes.len();
        Tile {
            at,
            base: planes.start,
            enthalpy: vec![0.0; count * PLANE],
            begun: vec![0.0; count * PLANE],
            density: vec![1.0; count * PLANE],
            settled: vec![0.0; count * PLANE],
            peak: vec![0.0; tracked * PLANE],
            froze: Froze {
                before: vec![0.0; followed],
                above: vec![0.0; followed],
                fell: vec![f32::NAN; followed],
                rate: vec![f32::NAN; followed],
            },
            skin: Skin::new(PLANE),
            out: Default::default(),
            inbox: Default::default(),
            down: Vec::new(),
            beneath: None,
            warmth: 0.0,
            bend: 0.0,
            bend_high: 0.0,
            highest: 0.0,
            rising: false,
            lost: Ledger::default(),
        }
    }

    /// Its planes, counted from the bottom of all.
    pub(crate) fn planes(&self) -> Range<usize> {
        self.base..self.base + self.enthalpy.len() / PLANE
    }

    /// The highest of `planes` planes, where it goes so high.
    pub(crate) fn top(&mut self, planes: usize) -> Option<Uppermost<'_>> {
        if self.planes().end != planes {
            return None;
        }
        let cells = self.enthalpy.len() - PLANE..self.enthalpy.len();
        Some(Uppermost {
            enthalpy: &mut self.enthalpy[cells.clone()],
            density: &mut self.density[cells],
            arrived: &self.skin.arrived,
            lost: &mut self.lost,
        })
    }

    /// Its planes below `plane`: what lies under the finer tiles that take the place of the others.
    pub(crate) fn trunk(mut self, plane: usize) -> Self {
        let cells = (plane - self.base) * PLANE;
        for values in [
            &mut self.enthalpy,
            &mut self.begun,
            &mut self.density,
            &mut self.settled,
        ] {
            values.truncate(cells);
        }
        self.peak.clear();
        self.froze = Froze::default();
        self
    }

    /// Highest enthalpies and freezing begin anew from the present state.
    pub(crate) fn begin_anew(&mut self) {
        self.skin.begin_anew();
        let first = self.enthalpy.len() - self.peak.len();
        self.peak.copy_from_slice(&self.enthalpy[first..]);
        let first = self.enthalpy.len() - self.froze.before.len();
        self.froze.before.copy_from_slice(&self.enthalpy[first..]);
    }
}

/// Some cells of a plane of a tile.
pub(crate) struct Cells<'a> {
    pub(crate) enthalpy: &'a mut [f32],
    pub(crate) density: &'a mut [f32],
    pub(crate) settled: &'a mut [f32],
}

impl Cells<'_> {
    /// Adds `heat` (J/mm³ of the cell). Where powder grows hotter than it was, its density follows by [`warm`] once it is
    /// [`LAG`] hotter, with all the heat since it last followed: most steps need no formula, and no heat is lost.
    #[inline(always)]
    pub(crate) fn warm(&mut self, f: &Formulas<f32>, heat: &[f32]) {
        let lag = LAG * f.solidus();
        let groups = self.enthalpy.as_chunks_mut().0.iter_mut();
        let groups = groups
            .zip(self.density.as_chunks_mut().0)
            .zip(self.settled.as_chunks_mut().0)
            .zip(heat.as_chunks().0);
        for (((g, r), settled), heat) in groups {
            let (g, r, settled): (&mut [f32; LANES], &mut [f32; LANES], &mut [f32; LANES]) =
                (g, r, settled);
            let heat: &[f32; LANES] = heat;
            let mut powder = 0_u32;
            for r in r.iter() {
                powder |= u32::from(*r < 1.0);
            }
            if powder == 0 {
                for i in 0..LANES {
                    g[i] += heat[i];
                }
                continue;
            }
            let mut after = [0.0_f32; LANES];
            let mut hotter = 0_u32;
            for i in 0..LANES {
                after[i] = g[i] + heat[i] / r[i];
                hotter |= u32::from(after[i] > settled[i] + lag) & u32::from(r[i] < 1.0);
            }
            if hotter == 0 {
                *g = after;
            } else {
                follow(f, &after, g, r, settled);
            }
        }
    }
}

/// Densities follow to where the enthalpies are `after`.
#[inline(always)]
fn follow(
    f: &Formulas<f32>,
    after: &[f32; LANES],
    g: &mut [f32; LANES],
    r: &mut [f32; LANES],
    settled: &mut [f32; LANES],
) {
    for i in 0..LANES {
        let from = settled[i];
        let (hot, dense) = warm(f, from, r[i], (after[i] - from) * r[i]);
        let grows = after[i] > from;
        g[i] = if grows { hot } else { after[i] };
        r[i] = if grows { dense } else { r[i] };
        settled[i] = if grows { hot } else { from };
    }
}

/// Fills what others see of a tile, and the highest enthalpies.
pub(crate) struct Refresh<'a> {
    pub(crate) formulas: &'a Formulas<f32>,
    pub(crate) tile: &'a mut Tile,
    pub(crate) shown: &'a mut Shown,
    /// The step that ends.
    pub(crate) half: Half,
    /// Of what the first step of a pair gives, the share that others see before the second.
    pub(crate) seen: f32,
    /// What makes the build plane hotter than its cells, of tiles that reach it.
    pub(crate) lift: Option<Lift<f32>>,
}

impl Loop for Refresh<'_> {
    #[inline(always)]
    fn run(self) {
        let (f, tile, shown) = (*self.formulas, self.tile, self.shown);
        let mut seen = [0.0_f32; PLANE];
        let planes = shown.dense.len();
        let untracked = planes - tile.peak.len() / PLANE;
        for k in 0..planes {
            let range = k * PLANE..(k + 1) * PLANE;
            let g = &tile.enthalpy[range.clone()];
            let begun = &mut tile.begun[range.clone()];
            match self.half {
                Half::First => {
                    for n in 0..PLANE {
                        seen[n] = begun[n] + self.seen * (g[n] - begun[n]);
                    }
                }
                Half::Second => {
                    begun.copy_from_slice(g);
                    seen.copy_from_slice(g);
                }
            }
            let g = &seen;
            let out = &mut shown.theta[range.clone()];
            let cells = g.as_chunks().0.iter().zip(out.as_chunks_mut().0);
            for (g, out) in cells {
                f.kirchhoff_of_all::<LANES>(g, out);
            }
            if k >= untracked {
                let peak = &mut tile.peak[(k - untracked) * PLANE..][..PLANE];
                for n in 0..PLANE {
                    peak[n] = if peak[n] > g[n] { peak[n] } else { g[n] };
                }
            }
            if !shown.dense[k] {
                let r = &tile.density[range.clone()];
                let share = &mut shown.share[range];
                let mut powder = 0_u32;
                for n in 0..PLANE {
                    powder |= u32::from(r[n] < 1.0);
                    share[n] = f.conduction(r[n]);
                }
                if powder == 0 {
                    shown.dense[k] = true;
                    share.fill(1.0);
                }
            }
        }
        let told = tile.skin.lit || shown.lit;
        if let (Some(lift), true, 2..) = (self.lift, told, planes) {
            let (below, top) = shown.theta.split_at((planes - 1) * PLANE);
            LookAtSkin {
                skin: &mut tile.skin,
                lift,
                theta: [top, &below[(planes - 2) * PLANE..]],
                share: &shown.share[(planes - 1) * PLANE..],
            }
            .run();
        } else if tile.skin.lit {
            tile.skin.forget();
        }
    }
}

/// Looks at how much warmer a tile is than the start and how strongly `θ` bends between its cells.
pub(crate) struct Look<'a> {
    pub(crate) tile: &'a mut Tile,
    pub(crate) shown: &'a Shown,
    /// The lowest plane of the next finer level, counted from the bottom of all.
    pub(crate) split: usize,
    /// Enthalpy from which on a cell may melt, J/mm³.
    pub(crate) warm: f32,
}

impl Loop for Look<'_> {
    #[inline(always)]
    fn run(self) {
        let mut warmth = [0.0_f32; LANES];
        for group in self.tile.enthalpy.as_chunks::<LANES>().0 {
            for i in 0..LANES {
                let w = group[i];
                warmth[i] = if w > warmth[i] { w } else { warmth[i] };
            }
        }
        let first = self.tile.enthalpy.len() - self.tile.peak.len();
        let tracked = self.tile.enthalpy[first..].iter().zip(&self.tile.peak);
        let mut rising = 0_u32;
        for (g, peak) in tracked {
            rising |= u32::from(*g > self.warm) & u32::from(g >= peak);
        }
        self.tile.rising = rising != 0;
        let (mut deep, mut high) = (0.0_f32, 0.0_f32);
        for (k, plane) in self.shown.theta.as_chunks::<PLANE>().0.iter().enumerate() {
            let bend = bend(plane);
            if self.shown.base + k < self.split {
                deep = deep.max(bend);
            } else {
                high = high.max(bend);
            }
        }
        let mut highest = [0.0_f32; LANES];
        for group in self.shown.theta.as_chunks::<LANES>().0 {
            for i in 0..LANES {
                let t = group[i];
                highest[i] = if t > highest[i] { t } else { highest[i] };
            }
        }
        self.tile.highest = highest.iter().copied().fold(0.0, f32::max);
        self.tile.warmth = warmth.iter().copied().fold(0.0, f32::max);
        self.tile.bend_high = high;
        self.tile.bend = deep.max(high);
    }
}

/// How strongly `θ` bends from cell to cell in a plane; rows and columns at its rim along themselves are left out.
#[inline(always)]
fn bend(plane: &[f32; PLANE]) -> f32 {
    /// Nothing is known beyond the ends of a row.
    const INNER: [f32; N] = {
        let mut inner = [1.0; N];
        (inner[0], inner[N - 1]) = (0.0, 0.0);
        inner
    };
    let mut largest = [0.0_f32; N];
    for at in (N..PLANE - N).step_by(N) {
        let (t, west, east) = (
            &plane[at..][..N],
            &plane[at - 1..][..N],
            &plane[at + 1..][..N],
        );
        let (south, north) = (&plane[at - N..][..N], &plane[at + N..][..N]);
        for i in 0..N {
            let upright = (south[i] - t[i] + (north[i] - t[i])).abs();
            let flat = (west[i] - t[i] + (east[i] - t[i])).abs() * INNER[i];
            let bend = if upright > flat { upright } else { flat };
            largest[i] = if bend > largest[i] { bend } else { largest[i] };
        }
    }
    largest.iter().copied().fold(0.0, f32::max)
}

/// What freezing is told by: `g` at the liquidus, heat capacity just above it, J/(mm³·K).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Liquidus {
    pub(crate) enthalpy: f32,
    pub(crate) capacity: f32,
}

/// Follows what froze since the last look.
pub(crate) struct Follow<'a> {
    pub(crate) tile: &'a mut Tile,
    pub(crate) liquidus: Liquidus,
    /// Since the last look, s.
    pub(crate) passed: f64,
    pub(crate) now: f64,
}

impl Loop for Follow<'_> {
    #[inline(always)]
    fn run(self) {
        let Follow {
            tile,
            liquidus,
            passed,
            now,
        } = self;
        let line = liquidus.enthalpy;
        let first = tile.enthalpy.len() - tile.froze.before.len();
        let froze = &mut tile.froze;
        let rows = tile.enthalpy[first..].as_chunks::<N>().0.iter();
        let rows = rows
            .zip(froze.before.as_chunks_mut::<N>().0)
            .zip(froze.above.as_chunks_mut::<N>().0);
        for (row, ((g, before), above)) in rows.enumerate() {
            let mut hot = 0_u32;
            for i in 0..N {
                hot |= u32::from(g[i] > line) | u32::from(before[i] > line);
            }
            let was = std::mem::replace(before, *g);
            if hot == 0 {
                continue;
            }
            // the share of the time before the liquidus was passed
            let mut share = [0.0_f32; N];
            let mut fell = 0_u32;
            for i in 0..N {
                share[i] = (line - was[i]) / (g[i] - was[i]);
                let (hot_before, hot) = (was[i] > line, g[i] > line);
                fell |= u32::from(hot_before) & u32::from(!hot);
                let rising = if hot { 1.0 - share[i] } else { 0.0 };
                let falling = if hot { 1.0 } else { share[i] };
                above[i] += passed as f32 * if hot_before { falling } else { rising };
            }
            if fell == 0 {
                continue;
            }
            for i in (0..N).filter(|&i| was[i] > line && g[i] <= line) {
                let n = row * N + i;
                froze.fell[n] = (now - passed + f64::from(share[i]) * passed) as f32;
                froze.rate[n] = (was[i] - g[i]) / (passed as f32 * liquidus.capacity);
            }
        }
    }
}
