//! What a layer leaves for the one on top of it: after its path it cools, then powder is laid and the heat below lies a layer
//! deeper. Finer cells than the coarsest are given up on the way: where heat has spread for a quarter of a second nothing bends in them.

use meltpath_base::Observer;
use serde::{Deserialize, Serialize};

use super::cool::{Block, Laws};
use super::matter::Frame;
use super::pace::LONGEST;
use super::tile::{N, PLANE};
use super::tree::Tree;
use super::{Levels, LevelsError, Matter, Setup};
use crate::material::Material;
use crate::solver::Face;
use crate::solver::ledger::Ledger;
use crate::solver::surface::Losses;

/// How long after the beam cells stay as fine as heat bends, s; then all are as coarse as can be: heat spreads by some 2.5 mm in that
/// time, the coarsest cells of a usual job measure 0.5 to 1 mm.
const FINE: f64 = 0.25;

/// Metal, powder and heat under the next layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ground {
    pub(super) matter: Matter,
    pub(super) warmth: Option<Warmth>,
}

/// Heat on the coarsest cells of a layer that has cooled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Warmth {
    frame: Frame,
    cells: [usize; 2],
    /// Planes, bottom first, mm.
    heights: Vec<f64>,
    /// Of the layer to come, mm.
    layer: f64,
    /// Heat of the cells, J/mm³, and their relative densities.
    heat: Vec<f64>,
    density: Vec<f64>,
    /// Temperatures of the top plane, K.
    top: Vec<f64>,
}

/// How a layer cooled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cooled {
    /// Where its heat went, from the path's beginning to the next layer.
    pub ledger: Ledger,
    /// Heat that stayed, J, above what was there when the path began.
    pub stored: f64,
}

impl From<Matter> for Ground {
    /// All at the start temperature.
    fn from(matter: Matter) -> Self {
        Ground {
            matter,
            warmth: None,
        }
    }
}

impl Ground {
    /// Mean and highest temperature of the top before the next layer of powder, K, where `inside` says; of the coarsest cells
    /// whose middles lie there, or of the nearest one to `near`. The start temperature where no heat is remembered.
    pub fn top(&self, start: f64, near: [f64; 2], inside: &dyn Fn([f64; 2]) -> bool) -> [f64; 2] {
        let Some(warmth) = &self.warmth else {
            return [start; 2];
        };
        let [nx, ny] = warmth.cells;
        let edge = warmth.frame.edge * warmth.frame.cells[0] as f64 / nx as f64;
        let middle = |n: usize| {
            let at = [n % nx, n / nx];
            [0, 1].map(|a| warmth.frame.origin[a] + (at[a] as f64 + 0.5) * edge)
        };
        let away = |n: usize| {
            let [x, y] = middle(n);
            (x - near[0]).hypot(y - near[1])
        };
        let mut chosen: Vec<usize> = (0..nx * ny).filter(|n| inside(middle(*n))).collect();
        if chosen.is_empty() {
            chosen.extend((0..nx * ny).min_by(|a, b| away(*a).total_cmp(&away(*b))));
        }
        let of = chosen.iter().map(|n| warmth.top[*n]);
        let mean = of.clone().sum::<f64>() / chosen.len().max(1) as f64;
        [mean, of.fold(f64::NEG_INFINITY, f64::max)]
    }
}

impl Setup {
    /// Whether heat on another setup's coarsest cells can be laid under this one's layer.
    fn stands_on(&self, warmth: &Warmth) -> bool {
        let (_, frame) = self.frame();
        let cells = frame.cells.map(|n| n >> self.coarser);
        frame == warmth.frame && cells == warmth.cells && (self.layer - warmth.layer).abs() < 1e-9
    }
}

impl Levels {
    /// A layer of powder on what another one left, its top at `powder` K; what is below lies a layer deeper. What falls below the
    /// lowest plane leaves; deeper planes than before are at the start temperature.
    ///
    /// # Errors
    /// [`LevelsError`]: laws, cells, a layer that does not lie where the one below does.
    pub fn on(
        setup: Setup,
        material: Material,
        ground: Ground,
        powder: f64,
    ) -> Result<Self, LevelsError> {
        let Ground { matter, warmth } = ground;
        if warmth.as_ref().is_some_and(|w| !setup.stands_on(w)) {
            return Err(LevelsError::Moved);
        }
        let mut levels = Levels::new(setup, material, matter)?;
        levels.warm(warmth.as_ref(), powder);
        levels.stored_at_start = levels.stored_absolute();
        Ok(levels)
    }

    /// Fills the coarsest tiles, the only ones yet, with the heat that was left.
    fn warm(&mut self, warmth: Option<&Warmth>, powder: f64) {
        let heights = self.setup.heights.clone();
        let laid = self.curve.of(powder) as f32;
        let dense = self.material.relative_density(powder) as f32;
        let layer = self.setup.layer;
        let below = warmth.map(|w| overlaps(&heights, &self.depths, &w.heights, layer));
        for n in 0..self.levels[0].tiles.len() {
            let mut tile = self.levels[0].tiles[n].clone();
            for k in 0..heights.len() {
                let of_layer = self.depths[k] + heights[k] < layer * (1.0 + 1e-6);
                for c in 0..PLANE {
                    let m = k * PLANE + c;
                    if of_layer {
                        tile.enthalpy[m] = laid;
                        tile.density[m] = tile.density[m].max(dense);
                        continue;
                    }
                    let Some((warmth, below)) = warmth.zip(below.as_ref()) else {
                        continue;
                    };
                    let [nx, ny] = warmth.cells;
                    let column = (tile.at[1] * N + c / N) * nx + tile.at[0] * N + c % N;
                    let own = f64::from(tile.density[m]);
                    let (mut heat, mut density, mut rest) = (0.0, 0.0, 1.0);
                    for (old, share) in &below[k] {
                        heat += share * warmth.heat[old * nx * ny + column];
                        density += share * warmth.density[old * nx * ny + column];
                        rest -= share;
                    }
                    if rest > 1e-9 {
                        heat += rest * self.offsets.at(tile.density[m]);
                        density += rest * own;
                    }
                    tile.density[m] = if density > 1.0 - 1e-6 {
                        1.0
                    } else {
                        density as f32
                    };
                    let r = tile.density[m];
                    tile.enthalpy[m] = ((heat - self.offsets.at(r)) / f64::from(r)) as f32;
                }
            }
            tile.begin_anew();
            let shown = self.shown(0, &mut tile);
            self.levels[0].tiles[n] = tile;
            self.levels[0].shown[n] = shown;
        }
    }

    /// Lets the layer cool for `time` s with the beam off; what the next one stands on.
    ///
    /// # Errors
    /// [`LevelsError::Cancelled`].
    pub fn leave(
        mut self,
        time: f64,
        observer: &dyn Observer,
    ) -> Result<(Ground, Cooled), LevelsError> {
        let begun = self.time;
        let fine = |levels: &Levels| levels.levels.iter().skip(1).any(|l| !l.tiles.is_empty());
        let solidus = self.curve.at_solidus as f32;
        let molten = |levels: &Levels| {
            let mut tiles = levels.levels.iter().flat_map(|l| &l.tiles);
            tiles.any(|tile| tile.warmth > solidus)
        };
        // the long steps that follow are for heat that is only conducted
        loop {
            let left = time - (self.time - begun);
            let soon = self.time - begun < FINE;
            if left <= 1e-9 * time || !(molten(&self) || soon && fine(&self)) {
                break;
            }
            observer.check()?;
            self.cut(&[], 0.0);
            self.set_pace(LONGEST.min(0.5 * left));
            self.advance_pair(&mut |_, _| Ok(()))?;
            self.count();
        }
        self.write_down();
        self.rebuild(Tree::new(self.tree.size(0), self.setup.coarser));
        self.count();
        let mut block = self.block();
        let since = (self.time - begun).max(1e-3);
        let left = time - (self.time - begun);
        let formulas = self.curve.formulas::<f64>();
        let losses = Losses::new(
            &self.setup.top,
            &self.material,
            &self.curve,
            self.setup.uppermost()[0],
        );
        let laws = Laws {
            formulas: &formulas,
            losses: &losses,
            register: self.register,
        };
        block.cool(&laws, [since, left], &mut self.ledger, observer)?;
        let [nx, ny, nz] = block.cells;
        let cells = block.enthalpy.iter().zip(&block.density);
        let heat: Vec<f64> = cells
            .map(|(g, r)| self.offsets.at(*r as f32) + r * g)
            .collect();
        let stored: f64 = heat
            .chunks_exact(nx * ny)
            .zip(&block.heights)
            .map(|(plane, height)| plane.iter().sum::<f64>() * height * block.edge * block.edge)
            .sum();
        let top = &block.enthalpy[(nz - 1) * nx * ny..];
        let warmth = Warmth {
            frame: self.matter.frame,
            cells: [nx, ny],
            layer: self.setup.layer,
            top: top.iter().map(|g| self.curve.temperature(*g)).collect(),
            heat,
            density: block.density,
            heights: block.heights,
        };
        let ground = Ground {
            matter: self.matter,
            warmth: Some(warmth),
        };
        let cooled = Cooled {
            ledger: self.ledger,
            stored: stored - self.stored_at_start,
        };
        Ok((ground, cooled))
    }

    /// The tiles of the coarsest level, the only ones now, as one block.
    fn block(&self) -> Block {
        let [tx, ty] = self.tree.size(0);
        let nz = self.setup.heights.len();
        let [nx, ny] = [tx * N, ty * N];
        let mut block = Block {
            cells: [nx, ny, nz],
            edge: self.levels[0].edge,
            heights: self.setup.heights.clone(),
            enthalpy: vec![0.0; nx * ny * nz],
            density: vec![1.0; nx * ny * nz],
            held: match self.setup.beyond {
                Face::Insulated => None,
                Face::Imposed(kelvin) => Some(self.curve.kirchhoff_at(kelvin)),
            },
        };
        for tile in &self.levels[0].tiles {
            for k in 0..nz {
                for c in 0..PLANE {
                    let at = (k * ny + tile.at[1] * N + c / N) * nx + tile.at[0] * N + c % N;
                    block.enthalpy[at] = f64::from(tile.enthalpy[k * PLANE + c]);
                    block.density[at] = f64::from(tile.density[k * PLANE + c]);
                }
            }
        }
        block
    }
}

/// Of each new plane, bottom first, the old planes that lie in it and their shares of its height: the old ones lie `layer` mm
/// deeper than they did.
fn overlaps(heights: &[f64], depths: &[f64], old: &[f64], layer: f64) -> Vec<Vec<(usize, f64)>> {
    let mut ends = Vec::with_capacity(old.len());
    let mut depth = layer;
    for (k, height) in old.iter().enumerate().rev() {
        ends.push((k, depth, depth + height));
        depth += height;
    }
    let of = |(depth, height): (&f64, &f64)| {
        ends.iter()
            .filter_map(|(k, from, to)| {
                let shared = to.min(depth + height) - from.max(*depth);
                (shared > 1e-9 * height).then_some((*k, shared / height))
            })
            .collect()
    };
    depths.iter().zip(heights).map(of).collect()
}
