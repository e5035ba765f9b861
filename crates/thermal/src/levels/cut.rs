//! Tiles become finer and coarser, and fall asleep. Heat is kept exactly, what stays of the layer is told by the record.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::matter::lifted;
use super::tile::{Half, Look, N, PLANE, SIDES, Shown, Tile};
use super::tree::{Tree, parts};
use super::{COLD, Levels, NOWHERE};
use crate::solver::source::Spot;

/// Tiles that bend less than this share of what divides them may become one with their neighbours: cells twice as large bend four
/// times as much.
const EASE: f32 = 0.25;
/// That share where metal that may melt is as hot as it ever was: these cells tell how far it does. With [`EASE`] there, cells at the
/// end of a path, where a pool spreads once the beam is off, were a fifth of the rise off (docs/theory/heat.md).
const EASE_RISING: f32 = 0.125;
/// Nor by more than this share of what the tile's hottest cell is above the start: of a pool that spreads cells twice as large would lose
/// some of its rise, and tell it the lower (docs/theory/heat.md).
const OF_RISE: f32 = 0.02;
/// What little bends is let go whatever the rise, as kelvins of the solid's conductivity at the solidus.
const LEAST: f64 = 5.0;
/// What may melt: above this share of the enthalpy from the start to the solidus.
const RISING: f32 = 0.75;
/// Cells on which the beam is drawn away from what is looked at, mm: a third of a usual spot, so that its heat is laid where it falls.
const ELSEWHERE: f64 = 0.13;
/// How near a beam the finest cells must lie, in its diameters: its intensity has fallen to 4 % there.
const NEAR: f64 = 0.65;

/// By how much the beam may heat a tile that takes long steps until the tiles are looked at again, K.
const HIT: f64 = 50.0;

/// Tiles by level and place.
type Pool = Vec<BTreeMap<[usize; 2], (Tile, Shown)>>;

impl Levels {
    /// Tiles of the coarsest level everywhere.
    pub(super) fn first_tiles(&mut self, roots: [usize; 2], tracked: usize) {
        let planes = self.setup.heights.len();
        for n in 0..roots[0] * roots[1] {
            let mut tile = Tile::new([n % roots[0], n / roots[0]], 0..planes, tracked);
            for k in 0..planes {
                for c in 0..PLANE {
                    tile.density[k * PLANE + c] = self.mean_of_matter(0, tile.at, k, c);
                }
            }
            let shown = self.shown(0, &mut tile);
            self.levels[0].tiles.push(tile);
            self.levels[0].shown.push(shown);
            self.levels[0].index[n] = n as u32;
        }
        self.make_boxes();
    }

    /// Mean relative density, as it was written down, of cell `c` of plane `k` of a tile.
    fn mean_of_matter(&self, level: usize, at: [usize; 2], k: usize, c: usize) -> f32 {
        let edge = 1 << (self.setup.coarser - level);
        let first = [(at[0] * N + c % N) * edge, (at[1] * N + c / N) * edge];
        let depth = self.depths[k];
        self.matter
            .mean(first, edge, [depth, depth + self.setup.heights[k]])
    }

    /// The lowest plane of the next finer level.
    fn split(&self, level: usize) -> usize {
        let finer = self.levels.get(level + 1);
        finer.map_or(self.levels[level].base, |finer| finer.base)
    }

    /// What a new tile shows; its densities tell how hot its powder was.
    pub(super) fn shown(&self, level: usize, tile: &mut Tile) -> Shown {
        for (settled, r) in tile.settled.iter_mut().zip(&tile.density) {
            *settled = self.offsets.highest(*r);
        }
        let mut shown = Shown::new(tile.planes());
        self.register.run(super::tile::Refresh {
            formulas: &self.formulas,
            tile: &mut *tile,
            shown: &mut shown,
            half: Half::Second,
            seen: 1.0,
            lift: None,
        });
        self.register.run(Look {
            tile,
            shown: &shown,
            split: self.split(level),
            warm: RISING * self.curve.at_solidus as f32,
        });
        shown
    }

    /// Makes tiles finer and coarser before the beam is at `spots`, and lets cold ones sleep.
    pub(super) fn cut(&mut self, spots: &[Spot], ahead: f64) {
        let mut tree = Tree::new(self.tree.size(0), self.setup.coarser);
        let conductivity = self.material.conductivity(self.material.solidus);
        let most = (self.setup.bend * conductivity) as f32;
        let floor = (LEAST * conductivity) as f32;
        let molten = self.curve.at_solidus as f32;
        let warm = RISING * molten;
        let mut smooth = Vec::new();
        for n in 0..self.levels.len() {
            let finest = n == self.setup.coarser;
            let split = self.split(n);
            for i in 0..self.levels[n].tiles.len() {
                let level = &mut self.levels[n];
                let (tile, shown) = (&mut level.tiles[i], &level.shown[i]);
                if !shown.asleep {
                    self.register.run(Look {
                        tile: &mut *tile,
                        shown,
                        split,
                        warm,
                    });
                }
                let tile = &self.levels[n].tiles[i];
                let (at, high) = (tile.at, tile.bend_high);
                let ease = if tile.rising { EASE_RISING } else { EASE };
                let may = (ease * most).min((OF_RISE * tile.highest).max(floor));
                if tile.bend > may || tile.warmth > molten {
                    tree.want(n, at);
                } else if n > 0 {
                    // one level at a time: what is smooth here may bend on the next coarser one
                    tree.want(n - 1, at.map(|t| t / 2));
                    smooth.push((n, i, may));
                }
                if high > most && !finest && n < self.finest_at(n + 1, at.map(|t| 2 * t)) {
                    tree.want(n + 1, at.map(|t| 2 * t));
                }
            }
        }
        for spot in spots {
            self.want_near(&mut tree, spot);
        }
        tree.settle();
        // most smooth tiles stay for those beside
        for (n, i, may) in smooth {
            let at = self.levels[n].tiles[i].at;
            if !tree.is_there(n, at) && self.bends_at_rim(n, i, may) {
                tree.want(n, at);
            }
        }
        tree.settle();
        if tree != self.tree {
            self.rebuild(tree);
        }
        self.look_for_beam(spots, ahead);
        self.fall_asleep();
    }

    /// The finest level that a tile may be divided to.
    fn finest_at(&self, level: usize, at: [usize; 2]) -> usize {
        let Some([low, high]) = self.setup.focus else {
            return self.setup.coarser;
        };
        let edge = self.levels[level].edge * N as f64;
        let inside = [0, 1].iter().all(|&a| {
            let from = self.matter.frame.origin[a] + at[a] as f64 * edge;
            from < high[a] && from + edge > low[a]
        });
        if inside {
            return self.setup.coarser;
        }
        let elsewhere = |level: &usize| self.levels[*level].edge <= ELSEWHERE;
        (0..self.setup.coarser)
            .find(elsewhere)
            .unwrap_or(self.setup.coarser)
    }

    fn want_near(&self, tree: &mut Tree, spot: &Spot) {
        let finest = self.setup.coarser;
        let edge = self.levels[finest].edge * N as f64;
        let size = tree.size(finest);
        let range = |a: usize| {
            let at = |x: f64| ((x - self.matter.frame.origin[a]) / edge).max(0.0) as usize;
            let near = NEAR * spot.diameter;
            at(spot.centre[a] - near)..(at(spot.centre[a] + near) + 1).min(size[a])
        };
        for y in range(1) {
            for x in range(0) {
                let level = self.finest_at(finest, [x, y]);
                tree.want(level, [x, y].map(|t| t >> (finest - level)));
            }
        }
    }

    /// The tiles of another tree.
    pub(super) fn rebuild(&mut self, tree: Tree) {
        let mut pool: Pool = Vec::new();
        for level in &mut self.levels {
            let tiles = level.tiles.drain(..).zip(level.shown.drain(..));
            pool.push(
                tiles
                    .map(|(tile, shown)| (tile.at, (tile, shown)))
                    .collect(),
            );
            level.index.fill(NOWHERE);
        }
        let [nx, ny] = tree.size(0);
        for n in 0..nx * ny {
            self.place(&tree, &mut pool, 0, [n % nx, n / nx]);
        }
        self.tree = tree;
        self.make_boxes();
    }

    /// Empty boxes for what tiles give to coarser or slower ones.
    fn make_boxes(&mut self) {
        for n in 0..self.levels.len() {
            for tile in &mut self.levels[n].tiles {
                for (s, way) in SIDES.iter().enumerate() {
                    let beside = self.tree.beside(n, tile.at, *way);
                    let cells = beside.map_or(0, |_| N * tile.planes().len());
                    tile.out[s].clear();
                    tile.out[s].resize(cells, 0.0);
                }
                tile.down.clear();
                tile.down.resize(if tile.base > 0 { PLANE } else { 0 }, 0.0);
            }
        }
    }

    /// Puts a tile where it belongs, or its trunk and all that it is divided into.
    fn place(&mut self, tree: &Tree, pool: &mut Pool, level: usize, at: [usize; 2]) {
        let (tile, shown) = if tree.is_divided(level, at) {
            let mut here = pool[level].remove(&at);
            if here.as_ref().is_some_and(|(tile, _)| self.is_whole(tile)) {
                here = here.and_then(|(tile, _)| self.divide(pool, level, tile));
            }
            for part in parts(at) {
                self.place(tree, pool, level + 1, part);
            }
            let Some(trunk) = here else {
                return;
            };
            trunk
        } else {
            self.gather(pool, level, at)
        };
        let place = at[1] * tree.size(level)[0] + at[0];
        let own = &mut self.levels[level];
        own.index[place] = own.tiles.len() as u32;
        own.tiles.push(tile);
        own.shown.push(shown);
    }

    /// Whether a tile reaches up to the build plane: it is no trunk.
    fn is_whole(&self, tile: &Tile) -> bool {
        tile.planes().end == self.setup.heights.len()
    }

    /// The tile at a place, made of finer ones and their trunk where it was divided.
    fn gather(&mut self, pool: &mut Pool, level: usize, at: [usize; 2]) -> (Tile, Shown) {
        let trunk = match pool[level].remove(&at) {
            Some(found) if self.is_whole(&found.0) => return found,
            trunk => trunk,
        };
        let base = self.levels[level].base;
        let planes = base..self.setup.heights.len();
        let tracked =
            self.record.peak.len() / (self.matter.frame.cells[0] * self.matter.frame.cells[1]);
        let mut whole = Tile::new(at, planes, tracked);
        if let Some((trunk, _)) = trunk {
            whole.enthalpy[..trunk.enthalpy.len()].copy_from_slice(&trunk.enthalpy);
            whole.density[..trunk.density.len()].copy_from_slice(&trunk.density);
            whole.lost.add(&trunk.lost);
        }
        for (n, part) in parts(at).into_iter().enumerate() {
            let (mut tile, _) = self.gather(pool, level + 1, part);
            self.record.take(
                &mut tile,
                1 << (self.setup.coarser - level - 1),
                &mut self.matter,
            );
            let corner = (n / 2 * N + n % 2) * (N / 2);
            for k in tile.planes() {
                let (own, below) = ((k - tile.base) * PLANE, (k - base) * PLANE);
                for c in 0..PLANE / 4 {
                    let (i, j) = (c % (N / 2), c / (N / 2));
                    let four = [0, 1, N, N + 1].map(|d| own + 2 * j * N + 2 * i + d);
                    let r = 0.25 * four.iter().map(|m| tile.density[*m]).sum::<f32>();
                    let heat = 0.25
                        * four
                            .iter()
                            .map(|m| self.offsets.stored(tile.enthalpy[*m], tile.density[*m]))
                            .sum::<f64>();
                    let to = below + corner + j * N + i;
                    whole.density[to] = r;
                    whole.enthalpy[to] = ((heat - self.offsets.at(r)) / f64::from(r)) as f32;
                }
            }
            whole.lost.add(&tile.lost);
        }
        whole.begin_anew();
        let shown = self.shown(level, &mut whole);
        (whole, shown)
    }

    /// Puts four tiles of the next finer level with the heat of one into the pool; its planes below theirs stay as their trunk.
    fn divide(&mut self, pool: &mut Pool, level: usize, mut tile: Tile) -> Option<(Tile, Shown)> {
        self.record.take(
            &mut tile,
            1 << (self.setup.coarser - level),
            &mut self.matter,
        );
        let tracked = tile.peak.len() / PLANE;
        let base = self.levels[level + 1].base;
        for (n, at) in parts(tile.at).into_iter().enumerate() {
            let mut part = Tile::new(at, base..self.setup.heights.len(), tracked);
            if n == 0 {
                part.lost = std::mem::take(&mut tile.lost);
            }
            let corner = (n / 2 * N + n % 2) * (N / 2);
            for k in part.planes() {
                let (own, below) = ((k - base) * PLANE, (k - tile.base) * PLANE);
                for c in 0..PLANE / 4 {
                    let (i, j) = (c % (N / 2), c / (N / 2));
                    let from = corner + j * N + i;
                    let four = [0, 1, N, N + 1].map(|d| 2 * j * N + 2 * i + d);
                    let was = (tile.enthalpy[below + from], tile.density[below + from]);
                    let r = if was.1 >= 1.0 {
                        [1.0; 4]
                    } else {
                        let bases = four.map(|m| self.mean_of_matter(level + 1, at, k, m));
                        let mean = 0.25 * bases.iter().sum::<f32>();
                        bases.map(|b| lifted(b, mean, was.1))
                    };
                    let [sx, sy] = slopes(&tile.enthalpy[below..][..PLANE], from);
                    let g = [-sx - sy, sx - sy, sy - sx, sx + sy].map(|d| was.0 + 0.25 * d);
                    let heat: f64 = (0..4).map(|m| self.offsets.stored(g[m], r[m])).sum();
                    let lack = 4.0 * self.offsets.stored(was.0, was.1) - heat;
                    let shift = (lack / r.iter().map(|r| f64::from(*r)).sum::<f64>()) as f32;
                    for m in 0..4 {
                        part.enthalpy[own + four[m]] = g[m] + shift;
                        part.density[own + four[m]] = r[m];
                    }
                }
            }
            part.begin_anew();
            let shown = self.shown(level + 1, &mut part);
            pool[level + 1].insert(at, (part, shown));
        }
        if base == 0 {
            return None;
        }
        let mut trunk = tile.trunk(base);
        let shown = self.shown(level, &mut trunk);
        Some((trunk, shown))
    }

    /// Which tiles the beam reaches in the next `ahead` s, and which it heats by much.
    fn look_for_beam(&mut self, spots: &[Spot], ahead: f64) {
        let fresh = self.material.relative_density(self.material.start);
        let capacity = fresh * self.material.heat_capacity(self.material.start);
        let steepest = |spot: &Spot| {
            let shares = spot.depth_shares(&self.setup.heights, &self.depths);
            let per_mm = shares.iter().zip(&self.setup.heights).map(|(s, h)| s / h);
            per_mm.fold(0.0, f64::max)
        };
        // the middle of each spot, and within which distance it heats powder by more than `HIT`, were it to stay, mm
        let rings: Vec<([f64; 2], f64, f64)> = spots
            .iter()
            .map(|spot| {
                let area = PI * spot.diameter.powi(2) / 8.0;
                let most = spot.power * ahead * steepest(spot) / (capacity * area);
                let near = spot.diameter * ((most / HIT).ln().max(0.0) / 8.0).sqrt();
                (spot.centre, spot.reach(), near.min(spot.reach()))
            })
            .collect();
        let origin = self.matter.frame.origin;
        // most tiles lie beside all of them
        let mut around = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for (centre, reach, _) in &rings {
            for (a, at) in centre.iter().enumerate() {
                around[0][a] = around[0][a].min(at - reach);
                around[1][a] = around[1][a].max(at + reach);
            }
        }
        for level in &mut self.levels {
            let edge = level.edge * N as f64;
            for (tile, shown) in level.tiles.iter().zip(&mut level.shown) {
                let from = [0, 1].map(|a| origin[a] + tile.at[a] as f64 * edge);
                let overlaps = |a: usize| from[a] <= around[1][a] && from[a] + edge >= around[0][a];
                let rings: &[_] = if overlaps(0) && overlaps(1) {
                    &rings
                } else {
                    &[]
                };
                let near = |place: [f64; 2], reach: f64| {
                    let beyond = [0, 1]
                        .map(|a| (from[a] - place[a]).max(place[a] - from[a] - edge).max(0.0));
                    beyond[0] * beyond[0] + beyond[1] * beyond[1] <= reach * reach
                };
                let told = self
                    .watching
                    .places
                    .iter()
                    .any(|[x, y, _]| near([*x, *y], level.edge));
                shown.lit = told || rings.iter().any(|(centre, reach, _)| near(*centre, *reach));
                shown.hit = told || rings.iter().any(|(centre, _, hit)| near(*centre, *hit));
            }
        }
    }

    /// Cold tiles among cold ones, away from the beam, sleep: those that no heat has reached. What radiates alone makes is left out
    /// there: a bed that cools as a whole would wake for nothing.
    fn fall_asleep(&mut self) {
        let cold = self.curve.of(self.material.start + COLD) as f32;
        let mut asleep: Vec<Vec<bool>> = Vec::new();
        for (n, level) in self.levels.iter().enumerate() {
            let quiet = |(tile, shown): (&Tile, &Shown)| {
                !shown.lit
                    && self.is_whole(tile)
                    && tile.warmth < cold
                    && self.warmth_below(n, tile) < cold
                    && SIDES
                        .iter()
                        .all(|way| self.warmth_beside(n, tile.at, *way) < cold)
            };
            asleep.push(level.tiles.iter().zip(&level.shown).map(quiet).collect());
        }
        for (level, asleep) in self.levels.iter_mut().zip(asleep) {
            for (shown, asleep) in level.shown.iter_mut().zip(asleep) {
                shown.asleep = asleep;
            }
        }
    }

    /// Largest enthalpy above the start in what lies beside a tile, J/mm³; of finer tiles there nothing is asked: they are warm.
    fn warmth_beside(&self, level: usize, at: [usize; 2], way: [isize; 2]) -> f32 {
        let Some(there) = self.tree.beside(level, at, way) else {
            return 0.0;
        };
        let of = |level: usize, at: [usize; 2]| {
            let own = &self.levels[level];
            let n = own.index[at[1] * self.tree.size(level)[0] + at[0]];
            own.tiles
                .get(n as usize)
                .map_or(f32::INFINITY, |t| t.warmth)
        };
        if self.tree.is_divided(level, there) {
            f32::INFINITY
        } else if self.tree.is_there(level, there) {
            of(level, there)
        } else {
            of(level - 1, there.map(|t| t / 2))
        }
    }

    /// Largest enthalpy above the start in the trunk under a tile, J/mm³.
    fn warmth_below(&self, level: usize, tile: &Tile) -> f32 {
        if tile.base == 0 {
            return 0.0;
        }
        let [x, y] = tile.at.map(|t| t / 2);
        let coarser = &self.levels[level - 1];
        let n = coarser.index[y * self.tree.size(level - 1)[0] + x];
        coarser.tiles[n as usize].warmth
    }
}

/// Slopes of `g` from cell to cell along x and y, the smaller of both ways and none at a summit or the tile's edge.
fn slopes(g: &[f32], cell: usize) -> [f32; 2] {
    let (i, j) = (cell % N, cell / N);
    let slope = |low: Option<usize>, high: Option<usize>| {
        let (Some(low), Some(high)) = (low, high) else {
            return 0.0;
        };
        let (a, b) = (g[cell] - g[low], g[high] - g[cell]);
        if a * b <= 0.0 {
            0.0
        } else if a.abs() < b.abs() {
            a
        } else {
            b
        }
    };
    [
        slope((i > 0).then(|| cell - 1), (i + 1 < N).then(|| cell + 1)),
        slope((j > 0).then(|| cell - N), (j + 1 < N).then(|| cell + N)),
    ]
}
