//! A time step of all levels: shorter steps first, then what they gave is taken by those that go on more slowly.

use super::around::{Around, exchange_boxes};
use super::conduct::{Conduct, PlaneStep};
use super::pace::{CLASSES, PAIR, Rate};
use super::sharing::share;
use super::tile::{Cells, Class, Follow, Half, N, PLANE, Refresh, Shown, Tile, Uppermost};
use super::{Levels, LevelsError, NOWHERE, Setup};
use crate::material::enthalpy::Formulas;
use crate::solver::Face;
use crate::solver::source::Spot;
use crate::solver::steam::{Around as OnTop, Lift};
use crate::solver::surface::BuildPlane;
use meltpath_numerics::vector::Loop;

/// Shortest steps whose radiation is taken together: it is slow (0.3 K of a cell of 30 µm at 3000 K in 40 µs).
const RADIATED: u32 = 4;

/// What heats during a step, s.
pub(super) type Heat<'a> = &'a mut (dyn FnMut(&mut Levels, f64) -> Result<(), LevelsError> + Send);

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

/// What lies on and under the highest plane of a tile that reaches the build plane.
fn on_top<'a>(lift: Lift<f32>, arrived: &'a [f32], shown: &'a Shown) -> OnTop<'a, f32> {
    match shown.dense.len().checked_sub(2) {
        Some(below) => OnTop {
            lift,
            arrived,
            below: shown.theta(shown.base + below),
        },
        // what the only plane stands on is not shown: nothing is known of what it gives there
        None => OnTop {
            lift: Lift { below: 0.0, ..lift },
            arrived,
            below: shown.theta(shown.base),
        },
    }
}

impl Levels {
    /// Two steps of the coarsest level: after them all levels are at the same time, and at the end of a pair.
    pub(super) fn advance_pair(&mut self, heat: Heat<'_>) -> Result<(), LevelsError> {
        let ticks = self.levels[0].rates[0].ticks;
        for n in 0..PAIR {
            self.advance(0, n * ticks, heat)?;
        }
        Ok(())
    }

    /// One step of a stage, with the steps of all shorter ones that it holds; `tick` of the shortest steps have gone since all levels
    /// were at the same time.
    ///
    /// Each level has two stages, slow tiles before quick ones; those of the coarsest come first.
    fn advance(&mut self, stage: usize, tick: u32, heat: Heat<'_>) -> Result<(), LevelsError> {
        let rate = |levels: &Levels, stage: usize| {
            let level = levels.levels.get(stage / 2)?;
            let rate = &level.rates[stage % 2];
            Some((rate.ticks, rate.step, rate.half(tick)))
        };
        let Some((ticks, step, half)) = rate(self, stage) else {
            return Ok(());
        };
        let shorter = rate(self, stage + 1);
        if let Some((parts, ..)) = shorter {
            for part in (0..ticks).step_by(parts as usize) {
                self.advance(stage + 1, tick + part, heat)?;
            }
        }
        // before the losses, so that these see it: vapour that lags lets a small spot grow too hot
        if shorter.is_none() {
            heat(self, step)?;
        }
        self.conduct(stage, tick);
        if shorter.is_none() {
            self.time += step;
        }
        self.refresh(stage, half);
        // a longer step that ends at the same time goes before
        let longer = stage.checked_sub(1).and_then(|longer| rate(self, longer));
        let ended = tick + ticks;
        if longer.is_none_or(|(ticks, ..)| !ended.is_multiple_of(ticks)) {
            self.look(ended);
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
        let all = self.levels[0].rates[0].ticks;
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
        let Rate {
            step,
            ticks,
            planes,
            ..
        } = &own.rates[stage % 2];
        let (step, edge) = (*step, own.edge);
        let together = RADIATED.min(PAIR * all).max(PAIR * ticks);
        let radiates = !losses.none && (tick + ticks).is_multiple_of(together);
        let radiated = step * f64::from(together / ticks);
        let split = around.finer.map_or(own.base, |finer| finer.base);
        let top = planes.len() - 1;
        let height = self.setup.heights[top];
        let lift = Lift::new(self.lift, step, self.setup.uppermost());
        let work = |(tile, shown): (&mut Tile, &Shown)| {
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
            if let Some(Uppermost {
                enthalpy,
                density,
                arrived,
                lost,
            }) = tile.top(planes.len())
            {
                let mut plane = BuildPlane {
                    formulas: f,
                    level: register,
                    passed: radiated,
                    height,
                    area: edge * edge,
                    enthalpy,
                    density,
                    around: on_top(lift, arrived, shown),
                };
                if radiates {
                    losses.radiate(&mut plane, lost);
                }
                plane.passed = step;
                losses.evaporate(&mut plane, lost);
            }
        };
        let tiles = own.tiles.iter_mut().zip(around.shown);
        let awake: Vec<_> = tiles.filter(|(_, s)| s.steps(class)).collect();
        self.updates += awake.iter().map(|(_, s)| s.theta.len() as u64).sum::<u64>();
        share(awake, work);
        if class == Class::Slow {
            exchange_boxes(&self.tree, level, own);
        }
    }

    /// What the tiles of a stage show from now on.
    fn refresh(&mut self, stage: usize, half: Half) {
        let class = CLASSES[stage % 2];
        let own = &mut self.levels[stage / 2];
        let (f, register, liquidus) = (&self.formulas, self.register, self.liquidus);
        let (step, now) = (own.rates[stage % 2].step, self.time);
        let seen = own.rates[stage % 2].seen;
        let planes = self.setup.heights.len();
        let lift = Lift::new(self.lift, step, self.setup.uppermost());
        let work = |(tile, shown): (&mut Tile, &mut Shown)| {
            let lift = (tile.planes().end == planes).then_some(lift);
            register.run(Refresh {
                formulas: f,
                tile: &mut *tile,
                shown,
                half,
                seen,
                lift,
            });
            if half == Half::Second {
                register.run(Follow {
                    tile,
                    liquidus,
                    passed: f64::from(PAIR) * step,
                    now,
                });
            }
        };
        let tiles = own.tiles.iter_mut().zip(&mut own.shown);
        share(tiles.filter(|(_, s)| s.steps(class)).collect(), work);
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
        let highest = self.setup.heights.len();
        self.lift = spot.depth.lift(self.setup.heights[highest - 1]);
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
                        heights: &self.setup.heights[planes.clone()],
                        on_top: planes.end == highest,
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
    /// Whether the tile reaches the build plane.
    on_top: bool,
}

/// A deposit in a tile.
struct Laid<'a> {
    deposit: &'a Deposit<'a>,
    formulas: &'a Formulas<f32>,
    tile: &'a mut Tile,
}

impl Loop for Laid<'_> {
    #[inline(always)]
    fn run(self) {
        let Deposit {
            shares: [sx, sy],
            along,
            per_area,
            heights,
            on_top,
        } = *self.deposit;
        let mut across = [0.0_f32; N];
        for i in 0..N {
            across[i] = sx[i] as f32;
        }
        let mut heat = [0.0_f32; PLANE];
        if on_top {
            let skin = &mut self.tile.skin;
            skin.lit = true;
            for (row, sy) in skin.arrived.as_chunks_mut::<N>().0.iter_mut().zip(sy) {
                let of_row = (per_area * sy) as f32;
                for i in 0..N {
                    row[i] += of_row * across[i];
                }
            }
        }
        for (k, along) in along.iter().enumerate() {
            if *along <= 0.0 {
                continue;
            }
            let scale = per_area * along / heights[k];
            for (row, sy) in heat.as_chunks_mut::<N>().0.iter_mut().zip(sy) {
                let of_row = (scale * sy) as f32;
                for i in 0..N {
                    row[i] = of_row * across[i];
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
