//! A time step of all levels: the finer ones first, then what they gave is taken by the coarser.

use rayon::prelude::*;

use super::conduct::{Conduct, PlaneStep, Side, Under};
use super::pace::{CLASSES, Rate};
use super::tile::{Cells, Class, Follow, N, PLANE, Refresh, SIDES, Shown, Tile};
use super::tree::{Tree, parts};
use super::{Level, Levels, LevelsError, NOWHERE, Setup};
use crate::material::enthalpy::Formulas;
use crate::numeric::vector::CellLoop;
use crate::solver::Face;
use crate::solver::source::Spot;

/// Tiles below which one thread is faster than handing work to others.
const WORTH_SHARING: usize = 24;

/// Coefficients of the planes for steps of `step` s.
pub(super) fn planes(setup: &Setup, step: f64) -> Vec<PlaneStep> {
    let heights = &setup.heights;
    let last = heights.len() - 1;
    let held = matches!(setup.beyond, Face::Imposed(_));
    (0..=last)
        .map(|k| {
            let flows = |open: bool| {
                if open {
                    (2.0 * step / heights[k]) as f32
                } else {
                    0.0
                }
            };
            let below = match (k, held) {
                (0, true) => 0.0,
                _ => heights[k.saturating_sub(1)],
            };
            PlaneStep {
                along: [flows(k > 0 || held), flows(k < last)],
                height: heights[k] as f32,
                heights: [below as f32, heights[(k + 1).min(last)] as f32],
            }
        })
        .collect()
}

/// The level whose tiles step, as others of its tiles see it, with those above and below.
struct Around<'a> {
    tree: &'a Tree,
    level: usize,
    class: Class,
    /// See [`Levels::advance`].
    tick: u32,
    coarser: Option<&'a Level>,
    rates: &'a [Rate; 2],
    index: &'a [u32],
    shown: &'a [Shown],
    finer: Option<&'a Level>,
    held: Option<f32>,
}

/// Planes of a tile: those below the next finer level's lowest, or the others.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Deep,
    High,
}

impl<'a> Around<'a> {
    fn place(&self, level: usize, at: [usize; 2]) -> usize {
        at[1] * self.tree.size(level)[0] + at[0]
    }

    /// What lies beside a part of a tile on side `s`; nothing flows to what sleeps.
    fn side(&self, at: [usize; 2], s: usize, part: Part) -> Side<'a> {
        let (tree, level) = (self.tree, self.level);
        let Some(there) = tree.beside(level, at, SIDES[s]) else {
            return self.held.map_or(Side::Closed, Side::Held);
        };
        if !tree.is_there(level, there) {
            let half = if s < 2 { at[1] % 2 } else { at[0] % 2 };
            let place = self.place(level.saturating_sub(1), there.map(|t| t / 2));
            let shown = self.coarser.and_then(|c| awake(&c.shown, &c.index, place));
            return shown.map_or(Side::Closed, |shown| Side::Coarser(shown, half));
        }
        if part == Part::High && tree.is_divided(level, there) {
            // the two parts that touch, the lower one first; they look here from the opposite side
            let gave = |half: usize| {
                let [x, y] = there.map(|t| 2 * t);
                let part = match s {
                    0 => [x + 1, y + half],
                    1 => [x, y + half],
                    2 => [x + half, y + 1],
                    _ => [x + half, y],
                };
                given(&self.finer_tile(part)?.out[s ^ 1])
            };
            return Side::Finer([gave(0), gave(1)]);
        }
        let shown = awake(self.shown, self.index, self.place(level, there));
        match (self.class, shown) {
            (_, None) => Side::Closed,
            (Class::Quick, Some(shown)) if shown.class == Class::Slow => Side::Slower(shown),
            (Class::Slow, Some(shown)) if shown.class == Class::Quick => Side::Quicker,
            (_, Some(shown)) => Side::Same(shown),
        }
    }

    /// Whether what takes this tile's heat only at the end of its own longer step begins one with this step: beside, and below.
    fn first(&self, at: [usize; 2], base: usize) -> ([bool; 4], bool) {
        let begins = |rate: &Rate| self.tick.is_multiple_of(rate.ticks);
        let of_coarser = |at: [usize; 2]| {
            let coarser = self.coarser?;
            let n = coarser.index[self.place(self.level - 1, at.map(|t| t / 2))];
            let shown = coarser.shown.get(n as usize)?;
            Some(begins(&coarser.rates[shown.class as usize]))
        };
        let beside = |s: usize| {
            let there = self.tree.beside(self.level, at, SIDES[s]);
            let coarser = there.filter(|there| !self.tree.is_there(self.level, *there));
            let begins = match coarser {
                Some(there) => of_coarser(there),
                None => Some(begins(&self.rates[Class::Slow as usize])),
            };
            begins.unwrap_or(true)
        };
        let below = base > 0 && of_coarser(at).unwrap_or(true);
        ([beside(0), beside(1), beside(2), beside(3)], below)
    }

    /// What lies beside a tile below the next finer level's lowest plane, where it goes so deep, and above.
    fn sides(&self, at: [usize; 2], deep: bool) -> [[Side<'a>; 4]; 2] {
        let of = |part| {
            let side = |s| self.side(at, s, part);
            [side(0), side(1), side(2), side(3)]
        };
        let high = of(Part::High);
        [if deep { of(Part::Deep) } else { high }, high]
    }

    /// What lies under a tile whose lowest plane is `base`.
    fn under(&self, at: [usize; 2], base: usize) -> Under<'a> {
        if base == 0 {
            return self.held.map_or(Under::Closed, Under::Held);
        }
        let place = self.place(self.level.saturating_sub(1), at.map(|t| t / 2));
        let trunk = self.coarser.and_then(|c| awake(&c.shown, &c.index, place));
        trunk.map_or(Under::Closed, |shown| {
            Under::Trunk(shown, at.map(|t| t % 2))
        })
    }

    /// What the finer tiles on a trunk gave it.
    fn over(&self, at: [usize; 2]) -> [Option<&'a [f32]>; 4] {
        if !self.tree.is_divided(self.level, at) {
            return [None; 4];
        }
        parts(at).map(|part| given(&self.finer_tile(part)?.down))
    }

    /// A tile of the next finer level, if it is there and awake.
    fn finer_tile(&self, at: [usize; 2]) -> Option<&'a Tile> {
        let finer = self.finer?;
        let n = finer.index[self.place(self.level + 1, at)] as usize;
        finer.tiles.get(n).filter(|_| !finer.shown[n].asleep)
    }
}

/// Slow tiles get what quick ones beside gave them, and give the boxes back when called again.
fn exchange_boxes(tree: &Tree, level: usize, own: &mut Level) {
    let width = tree.size(level)[0];
    for a in 0..own.tiles.len() {
        if own.shown[a].class != Class::Slow || own.shown[a].asleep {
            continue;
        }
        for (s, way) in SIDES.iter().enumerate() {
            let Some([x, y]) = tree.beside(level, own.tiles[a].at, *way) else {
                continue;
            };
            let b = own.index[y * width + x] as usize;
            let Some(shown) = own.shown.get(b) else {
                continue;
            };
            if shown.class == Class::Quick && !shown.asleep {
                let given = std::mem::take(&mut own.tiles[b].out[s ^ 1]);
                let was = std::mem::replace(&mut own.tiles[a].inbox[s], given);
                own.tiles[b].out[s ^ 1] = was;
            }
        }
    }
}

/// What a tile shows, if it is there and awake.
fn awake<'a>(shown: &'a [Shown], index: &[u32], place: usize) -> Option<&'a Shown> {
    shown.get(index[place] as usize).filter(|s| !s.asleep)
}

/// What was given, where anything could be.
fn given(heat: &[f32]) -> Option<&[f32]> {
    (!heat.is_empty()).then_some(heat)
}

impl Levels {
    /// One step of a stage, with the steps of all shorter ones that it holds; `tick` of the shortest steps have gone since all levels
    /// were at the same time.
    ///
    /// Each level has two stages, slow tiles before quick ones; those of the coarsest come first.
    pub(super) fn advance(
        &mut self,
        stage: usize,
        tick: u32,
        heat: &mut dyn FnMut(&mut Levels, f64) -> Result<(), LevelsError>,
    ) -> Result<(), LevelsError> {
        let rate = |levels: &Levels, stage: usize| {
            let level = levels.levels.get(stage / 2)?;
            let rate = &level.rates[stage % 2];
            Some((rate.ticks, rate.step))
        };
        let Some((ticks, step)) = rate(self, stage) else {
            return Ok(());
        };
        let shorter = rate(self, stage + 1);
        if let Some((parts, _)) = shorter {
            for part in (0..ticks).step_by(parts as usize) {
                self.advance(stage + 1, tick + part, heat)?;
            }
        }
        self.conduct(stage, tick);
        if shorter.is_none() {
            heat(self, step)?;
            self.time += step;
        }
        self.refresh(stage);
        if shorter.is_none() {
            self.look();
        }
        Ok(())
    }

    /// Conduction and what the build plane loses, in the tiles of a stage.
    fn conduct(&mut self, stage: usize, tick: u32) {
        let (level, class) = (stage / 2, CLASSES[stage % 2]);
        let held = match self.setup.beyond {
            Face::Insulated => None,
            Face::Imposed(kelvin) => Some(self.curve.kirchhoff_at(kelvin) as f32),
        };
        let (coarser, rest) = self.levels.split_at_mut(level);
        let Some((own, finer)) = rest.split_first_mut() else {
            return;
        };
        if class == Class::Slow {
            exchange_boxes(&self.tree, level, own);
        }
        let around = Around {
            tree: &self.tree,
            level,
            class,
            tick,
            coarser: coarser.last(),
            rates: &own.rates,
            index: &own.index,
            shown: &own.shown,
            finer: finer.first(),
            held,
        };
        let (f, losses, register) = (&self.formulas, &self.losses, self.register);
        let Rate { step, planes, .. } = &own.rates[stage % 2];
        let (step, edge) = (*step, own.edge);
        let split = around.finer.map_or(own.base, |finer| finer.base);
        let top = planes.len() - 1;
        let height = self.setup.heights[top];
        let work = |(tile, shown): (&mut Tile, &Shown)| {
            if shown.asleep || shown.class != class {
                return;
            }
            let at = tile.at;
            register.run(Conduct {
                formulas: f,
                across: (step / (edge * edge)) as f32,
                planes,
                area: edge * edge,
                own: shown,
                sides: around.sides(at, shown.base < split),
                split,
                under: around.under(at, tile.base),
                over: around.over(at),
                first: around.first(at, tile.base),
                tile: &mut *tile,
            });
            if !losses.none && tile.planes().end == planes.len() {
                let cells = (top - tile.base) * PLANE..(top - tile.base + 1) * PLANE;
                let enthalpy = &mut tile.enthalpy[cells.clone()];
                let own = [enthalpy, &mut tile.density[cells]];
                let sizes = [step, height, edge * edge];
                losses.take(f, register, sizes, own, &mut tile.lost);
            }
        };
        let awake = || {
            around
                .shown
                .iter()
                .filter(|s| !s.asleep && s.class == class)
        };
        if awake().count() >= WORTH_SHARING && rayon::current_num_threads() > 1 {
            own.tiles.par_iter_mut().zip(around.shown).for_each(work);
        } else {
            own.tiles.iter_mut().zip(around.shown).for_each(work);
        }
        self.updates += awake().map(|s| s.theta.len() as u64).sum::<u64>();
        if class == Class::Slow {
            exchange_boxes(&self.tree, level, own);
        }
    }

    /// What the tiles of a stage show from now on.
    fn refresh(&mut self, stage: usize) {
        let class = CLASSES[stage % 2];
        let own = &mut self.levels[stage / 2];
        let (f, register, liquidus) = (&self.formulas, self.register, self.liquidus);
        let (step, now) = (own.rates[stage % 2].step, self.time);
        let work = |(tile, shown): (&mut Tile, &mut Shown)| {
            if shown.asleep || shown.class != class {
                return;
            }
            register.run(Refresh {
                formulas: f,
                tile: &mut *tile,
                shown,
            });
            register.run(Follow {
                tile,
                liquidus,
                passed: step,
                now,
            });
        };
        let awake = own.shown.iter().filter(|s| !s.asleep && s.class == class);
        if awake.count() >= WORTH_SHARING && rayon::current_num_threads() > 1 {
            own.tiles.par_iter_mut().zip(&mut own.shown).for_each(work);
        } else {
            own.tiles.iter_mut().zip(&mut own.shown).for_each(work);
        }
    }

    /// Heat of a beam at rest during `dt` s, in tiles of every level that it reaches.
    pub(super) fn heat(&mut self, spot: &Spot, dt: f64) -> Result<(), LevelsError> {
        if spot.power == 0.0 {
            return Ok(());
        }
        if !(spot.diameter > 0.0 && spot.diameter.is_finite()) {
            return Err(LevelsError::Diameter(spot.diameter));
        }
        let joules = spot.power * dt;
        let along = spot.depth_shares(&self.setup.heights, &self.depths);
        let origin = self.matter.frame.origin;
        let mut arrived = 0.0;
        for (n, level) in self.levels.iter_mut().enumerate() {
            let tile = level.edge * N as f64;
            let size = self.tree.size(n);
            let range = |a: usize| {
                let at = |x: f64| ((x - origin[a]) / tile).max(0.0) as usize;
                at(spot.centre[a] - spot.reach())
                    ..(at(spot.centre[a] + spot.reach()) + 1).min(size[a])
            };
            let bell = &self.bell;
            let shares = |a: usize, t: usize| {
                let low = origin[a] + t as f64 * tile - spot.centre[a];
                bell.shares(low, level.edge, spot.diameter)
            };
            let across: Vec<_> = range(0).map(|t| shares(0, t)).collect();
            for y in range(1) {
                let sy = shares(1, y);
                let of_row: f64 = sy.iter().sum();
                for (x, sx) in range(0).zip(&across) {
                    let index = level.index[y * size[0] + x];
                    if index == NOWHERE {
                        continue;
                    }
                    let tile = &mut level.tiles[index as usize];
                    let planes = tile.planes();
                    let deep: f64 = along[planes.clone()].iter().sum();
                    arrived += joules * deep * of_row * sx.iter().sum::<f64>();
                    let deposit = Deposit {
                        shares: [sx, &sy],
                        along: &along[planes.clone()],
                        per_area: joules / (level.edge * level.edge),
                        heights: &self.setup.heights[planes],
                    };
                    self.register.run(Laid {
                        deposit: &deposit,
                        formulas: &self.formulas,
                        tile,
                    });
                }
            }
        }
        if arrived.is_nan() || arrived <= 0.5 * joules {
            return Err(LevelsError::Outside {
                time: self.time,
                x: spot.centre[0],
                y: spot.centre[1],
                share: 100.0 * (1.0 - arrived / joules),
            });
        }
        self.ledger.absorbed += arrived;
        self.ledger.missed += joules - arrived;
        Ok(())
    }

    /// The tiles' losses go to the ledger, in the order of the tiles.
    pub(super) fn count(&mut self) {
        for tile in self.levels.iter_mut().flat_map(|l| &mut l.tiles) {
            self.ledger.add(&std::mem::take(&mut tile.lost));
        }
    }
}

/// A share of a spot's heat for the cells of one tile.
#[derive(Clone, Copy)]
struct Deposit<'a> {
    shares: [&'a [f64; N]; 2],
    along: &'a [f64],
    /// J/mm².
    per_area: f64,
    heights: &'a [f64],
}

/// A deposit in a tile.
struct Laid<'a> {
    deposit: &'a Deposit<'a>,
    formulas: &'a Formulas<f32>,
    tile: &'a mut Tile,
}

impl CellLoop for Laid<'_> {
    #[inline(always)]
    fn run(self) {
        let Deposit {
            shares: [sx, sy],
            along,
            per_area,
            heights,
        } = *self.deposit;
        let mut heat = [0.0_f32; PLANE];
        for (k, along) in along.iter().enumerate() {
            if *along <= 0.0 {
                continue;
            }
            let scale = per_area * along / heights[k];
            for (row, sy) in heat.chunks_exact_mut(N).zip(sy) {
                for i in 0..N {
                    row[i] = (scale * sy * sx[i]) as f32;
                }
            }
            let of_plane = k * PLANE..(k + 1) * PLANE;
            let mut cells = Cells {
                enthalpy: &mut self.tile.enthalpy[of_plane.clone()],
                density: &mut self.tile.density[of_plane.clone()],
                settled: &mut self.tile.settled[of_plane],
            };
            cells.warm(self.formulas, &heat);
        }
    }
}
