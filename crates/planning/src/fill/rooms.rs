//! What room beads have: how many cells of a grid lie nearer to each short piece of a bead than to any other, tile by tile. A tile through
//! which the same straight sides run as on another layer is not counted again.

use std::cmp::Ordering;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::inset;
use meltpath_geometry::raster::{Grid, Mask, rasterise};
use meltpath_geometry::{Region, segments};
use rayon::prelude::*;

use crate::fill::outline::turned;
use crate::fill::settings::FillSettings;

/// Cells of the grid per bead width.
const CELLS_PER_WIDTH: f64 = 12.0;
/// Fewest cells per bead width that still tell rooms apart.
const FEWEST_PER_WIDTH: f64 = 5.0;
/// Largest number of cells.
const MOST_CELLS: f64 = 1.6e7;
/// A free edge of the metal lies this far from a bead's axis, bead widths.
const FREE_EDGE: f64 = 0.45;
/// Room farther from a bead than this is nobody's, bead widths.
const REACH: f64 = 0.75;
/// The grid lies turned against the layer by the angle whose tangent is the golden section: along straight sides, most often
/// parallel to an axis, cells then count their share and no row more or less.
const GRID_TURN: f64 = 0.553_574_358_897_045_3;
/// Cells along the side of a tile.
const TILE: usize = 64;
/// Pieces of a side that are looked at together: a box round a long slanting side is mostly empty.
const TOGETHER: u32 = 16;
/// Most sets of sides that a tile knows of: more come where lines are turned from layer to layer, and seldom again.
const MOST_KNOWN: usize = 16;

/// A straight side of a bead in pieces, all as long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Side {
    /// Its ends, in the layer's coordinates, mm.
    pub(crate) ends: [DVec2; 2],
    /// Number of pieces.
    pub(crate) pieces: u32,
}

/// A piece of a side: indices of both.
type PieceOf = (u32, u32);

/// How many cells pieces of some sides have in a tile.
#[derive(Default)]
struct Shares {
    /// Cells nearer to one piece than to any other: side, first piece, cells of that and the next ones.
    alone: Vec<(u32, u32, Vec<u16>)>,
    /// Cells as near to several pieces, as outside the corner in which two sides meet. The first bead of a layer gets them, and which
    /// one that is hangs on the layer.
    equal: Vec<(Vec<PieceOf>, u32)>,
}

/// Sides with what they have in a tile.
type Known = (Vec<Side>, Arc<Shares>);

/// What is nearest to the cells of a tile.
struct Nearest {
    /// Of each cell the square of the distance, mm², and a piece so near.
    first: Vec<(f32, PieceOf)>,
    /// Cells with further pieces as near, in order.
    others: Vec<(usize, PieceOf)>,
}

/// Where rooms are counted; what layers of the same sections share.
pub(crate) struct Rooms {
    /// Where beads feed, turned.
    fed_to: Vec<Region>,
    width: f64,
    /// The grids of layers whose beads reach as far.
    grids: Mutex<Vec<Arc<Cells>>>,
}

/// A grid round beads.
struct Cells {
    grid: Grid,
    /// Tiles along both directions.
    tiles: [usize; 2],
    /// Where beads feed.
    fed: Mask,
    reach: f64,
    /// How far a bead feeds at a free edge, mm.
    own: f64,
    /// What tiles told, with the sides they told that of.
    known: Mutex<HashMap<usize, Vec<Known>>>,
}

impl Rooms {
    /// Over the regions of a layer.
    pub(crate) fn new(regions: &[Region], settings: &FillSettings) -> Result<Self, PlanarError> {
        let width = settings.width;
        let fed_to = inset(regions, (0.5 - FREE_EDGE) * width, settings.join())?;
        Ok(Rooms {
            fed_to: turned(&fed_to, GRID_TURN),
            width,
            grids: Mutex::default(),
        })
    }

    /// The room of each piece of the sides, mm², side after side; `None` where they are too far apart for their width.
    pub(crate) fn of(&self, sides: &[Side]) -> Option<Vec<f64>> {
        let turn = DVec2::from_angle(GRID_TURN);
        let turned: Vec<Side> = sides
            .iter()
            .map(|side| Side {
                ends: side.ends.map(|p| turn.rotate(p)),
                ..*side
            })
            .collect();
        Some(self.cells(&turned)?.of(&turned))
    }

    /// The grid round sides.
    fn cells(&self, sides: &[Side]) -> Option<Arc<Cells>> {
        let width = self.width;
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in sides.iter().flat_map(|side| side.ends) {
            (low, high) = (low.min(p), high.max(p));
        }
        let size = high - low + 2.0 * REACH * width;
        let cell = (width / CELLS_PER_WIDTH).max((size.x * size.y / MOST_CELLS).sqrt());
        if cell > width / FEWEST_PER_WIDTH {
            return None;
        }
        let tiles = (size / cell).to_array().map(|n| n as usize / TILE + 1);
        let grid = Grid {
            origin: low - REACH * width,
            cell,
            nx: tiles[0] * TILE,
            ny: tiles[1] * TILE,
        };
        let grids = || self.grids.lock().unwrap_or_else(PoisonError::into_inner);
        let known = grids().iter().find(|cells| cells.grid == grid).cloned();
        if known.is_some() {
            return known;
        }
        let cells = Arc::new(Cells {
            fed: rasterise(&self.fed_to, &grid),
            grid,
            tiles,
            reach: REACH * width,
            own: FREE_EDGE * width,
            known: Mutex::default(),
        });
        let mut grids = grids();
        if grids.len() < MOST_KNOWN {
            grids.push(cells.clone());
        }
        Some(cells)
    }
}

impl Cells {
    /// The room of each piece of the sides, mm², side after side.
    fn of(&self, sides: &[Side]) -> Vec<f64> {
        // the same whichever way a side runs
        let (turned, backwards): (Vec<Side>, Vec<bool>) = sides
            .iter()
            .map(|side| {
                let [a, b] = side.ends;
                let backwards = before(a, b).is_gt();
                let ends = if backwards { [b, a] } else { [a, b] };
                let pieces = side.pieces;
                (Side { ends, pieces }, backwards)
            })
            .unzip();
        let told: Vec<(Vec<u32>, Arc<Shares>)> = self
            .tiles_of(&turned)
            .into_par_iter()
            .map(|(tile, mut here)| {
                here.sort_by(|&i, &j| order(&turned[i as usize], &turned[j as usize]));
                let there = here.iter().map(|&i| turned[i as usize]).collect();
                let shares = self.shares(tile, there);
                (here, shares)
            })
            .collect();
        let mut firsts = Vec::with_capacity(sides.len());
        let mut count = 0;
        for side in sides {
            firsts.push(count);
            count += side.pieces as usize;
        }
        let mut cells = vec![0_u32; count];
        // where a piece stands among those of the layer
        let index = |side: usize, piece: usize| {
            let last = sides[side].pieces as usize - 1;
            firsts[side] + if backwards[side] { last - piece } else { piece }
        };
        for (here, shares) in &told {
            for (side, from, counts) in &shares.alone {
                let side = here[*side as usize] as usize;
                for (piece, &cells_of_it) in (*from as usize..).zip(counts) {
                    cells[index(side, piece)] += u32::from(cells_of_it);
                }
            }
            for (pieces, count) in &shares.equal {
                let of_layer = pieces
                    .iter()
                    .map(|&(side, piece)| index(here[side as usize] as usize, piece as usize));
                if let Some(first) = of_layer.min() {
                    cells[first] += count;
                }
            }
        }
        let area = self.grid.cell * self.grid.cell;
        cells.into_iter().map(|n| f64::from(n) * area).collect()
    }

    /// The sides that may have cells in each tile, of those that have any.
    fn tiles_of(&self, sides: &[Side]) -> Vec<(usize, Vec<u32>)> {
        let side = TILE as f64 * self.grid.cell;
        let tiles = Grid {
            origin: self.grid.origin + 0.5 * (side - self.grid.cell),
            cell: side,
            nx: self.tiles[0],
            ny: self.tiles[1],
        };
        // from the middle of a tile to its corner
        let within = self.reach + side * std::f64::consts::FRAC_1_SQRT_2;
        let mut of_tile = vec![Vec::new(); tiles.nx * tiles.ny];
        for (i, side) in (0..).zip(sides) {
            for (iy, row) in tiles.rows_beside(side.ends[0], side.ends[1], within) {
                for tile in &mut of_tile[iy * tiles.nx..][row] {
                    tile.push(i);
                }
            }
        }
        let of_tile = of_tile.into_iter().enumerate();
        of_tile.filter(|(_, sides)| !sides.is_empty()).collect()
    }

    /// What the sides have in a tile.
    fn shares(&self, tile: usize, sides: Vec<Side>) -> Arc<Shares> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let before = known().get(&tile).and_then(|told| {
            let same = told.iter().find(|(of, _)| *of == sides)?;
            Some(same.1.clone())
        });
        if let Some(shares) = before {
            return shares;
        }
        let shares = Arc::new(self.shared_out(tile, &sides));
        let mut known = known();
        let told = known.entry(tile).or_default();
        if told.len() < MOST_KNOWN {
            told.push((sides, shares.clone()));
        }
        shares
    }

    /// Gives every cell of a tile to what is nearest to it.
    fn shared_out(&self, tile: usize, sides: &[Side]) -> Shares {
        let (tx, ty) = (tile % self.tiles[0] * TILE, tile / self.tiles[0] * TILE);
        let grid = Grid {
            origin: self.grid.origin + DVec2::new(tx as f64, ty as f64) * self.grid.cell,
            nx: TILE,
            ny: TILE,
            ..self.grid
        };
        let nearest = nearest(&grid, sides, self.reach);
        let (own, reach) = (self.own * self.own, self.reach * self.reach);
        let mut others = nearest.others.into_iter().peekable();
        let mut alone = Vec::new();
        let mut equal = Vec::new();
        for (i, (away, piece)) in nearest.first.into_iter().enumerate() {
            let mut as_near = Vec::new();
            while let Some((_, other)) = others.next_if(|(cell, _)| *cell == i) {
                as_near.push(other);
            }
            let away = f64::from(away);
            let is_fed = || self.fed.contains(tx + i % TILE, ty + i / TILE);
            // beside a narrow section a bead feeds what it would anywhere
            if away <= own || (away <= reach && is_fed()) {
                if as_near.is_empty() {
                    alone.push(piece);
                } else {
                    as_near.push(piece);
                    equal.push(as_near);
                }
            }
        }
        alone.sort_unstable();
        equal.sort_unstable();
        let mut shares = Shares::default();
        for (side, piece) in alone {
            match shares.alone.last_mut() {
                Some((of, first, counts)) if *of == side => {
                    counts.resize((piece - *first + 1) as usize, 0);
                    counts[(piece - *first) as usize] += 1;
                }
                _ => shares.alone.push((side, piece, vec![1])),
            }
        }
        for pieces in equal {
            match shares.equal.last_mut() {
                Some((of, count)) if *of == pieces => *count += 1,
                _ => shares.equal.push((pieces, 1)),
            }
        }
        shares
    }
}

/// The pieces of sides nearest to each cell of a grid, within `reach`.
fn nearest(grid: &Grid, sides: &[Side], reach: f64) -> Nearest {
    let mut first = vec![(f32::INFINITY, (0_u32, 0_u32)); grid.nx * grid.ny];
    let mut others = Vec::new();
    for (i, side) in (0..).zip(sides) {
        let [a, b] = side.ends;
        let at = |k: u32| a.lerp(b, f64::from(k) / f64::from(side.pieces));
        for from in (0..side.pieces).step_by(TOGETHER as usize) {
            let count = TOGETHER.min(side.pieces - from);
            let (a, b) = (at(from), at(from + count));
            let way = b - a;
            let square = way.length_squared();
            for (iy, row) in grid.rows_beside(a, b, reach) {
                for ix in row {
                    let p = grid.origin + DVec2::new(ix as f64, iy as f64) * grid.cell;
                    let share = segments::nearest_share((p - a).dot(way), square);
                    let away = p.distance_squared(a.lerp(b, share)) as f32;
                    let index = iy * grid.nx + ix;
                    let cell = &mut first[index];
                    if away > cell.0 {
                        continue;
                    }
                    let piece = (i, from + ((share * f64::from(count)) as u32).min(count - 1));
                    if away < cell.0 {
                        *cell = (away, piece);
                    } else if cell.1.0 != i {
                        others.push((index, piece, away));
                    }
                }
            }
        }
    }
    // what something nearer came after is no longer so near
    others.retain(|&(cell, _, away)| first[cell].0 == away);
    others.sort_unstable_by_key(|&(cell, piece, _)| (cell, piece));
    let others = others.into_iter();
    Nearest {
        first,
        others: others.map(|(cell, piece, _)| (cell, piece)).collect(),
    }
}

fn before(a: DVec2, b: DVec2) -> Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}

fn order(one: &Side, other: &Side) -> Ordering {
    before(one.ends[0], other.ends[0])
        .then(before(one.ends[1], other.ends[1]))
        .then(one.pieces.cmp(&other.pieces))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines 3 mm apart have 3 mm beside each other and 0.45 widths at the edge, counted again or from other ends the same.
    #[test]
    fn rooms_are_the_same_whichever_way_beads_run() {
        let corner = |x, y| DVec2::new(x, y);
        let plate = Region::rectangle(corner(0.0, 0.0), corner(60.0, 10.0));
        let settings = FillSettings::new(4.0, 3.0);
        let rooms = Rooms::new(std::slice::from_ref(&plate), &settings).unwrap();
        let lines = [2.0, 5.0, 8.0].map(|y| Side {
            ends: [corner(2.0, y), corner(58.0, y)],
            pieces: 112,
        });
        let there = rooms.of(&lines).unwrap();
        let per_length =
            |line: usize| there[112 * line + 40..112 * line + 72].iter().sum::<f64>() / 16.0;
        for (line, wanted) in [3.3, 3.0, 3.3].into_iter().enumerate() {
            assert!(
                (per_length(line) - wanted).abs() < 0.02,
                "{}",
                per_length(line)
            );
        }
        let mut back = lines;
        back.reverse();
        for side in &mut back {
            side.ends.reverse();
        }
        let mut again = rooms.of(&back).unwrap();
        again.reverse();
        assert_eq!(again, there);
        let afresh = Rooms::new(&[plate], &settings).unwrap();
        assert_eq!(afresh.of(&lines).unwrap(), there);
        // of fewer sides a tile tells something else
        assert!(rooms.of(&lines[..2]).unwrap().iter().sum::<f64>() < there.iter().sum::<f64>());
    }

    /// Rooms of beads one after the other, without tiles: every cell goes to the first piece that is nearest to it.
    fn anew(rooms: &Rooms, sides: &[Side]) -> Vec<f64> {
        let turn = DVec2::from_angle(GRID_TURN);
        let turned: Vec<[DVec2; 2]> = sides
            .iter()
            .map(|side| side.ends.map(|p| turn.rotate(p)))
            .collect();
        let at_ends: Vec<Side> = turned
            .iter()
            .zip(sides)
            .map(|(&ends, side)| Side { ends, ..*side })
            .collect();
        let cells = rooms.cells(&at_ends).unwrap();
        let grid = cells.grid;
        let mut room = vec![vec![]; sides.len()];
        for (room, side) in room.iter_mut().zip(sides) {
            room.resize(side.pieces as usize, 0.0);
        }
        for (ix, iy) in (0..grid.nx).flat_map(|ix| (0..grid.ny).map(move |iy| (ix, iy))) {
            let p = grid.origin + DVec2::new(ix as f64, iy as f64) * grid.cell;
            let mut best = (f64::INFINITY, 0, 0.0);
            for (i, &[a, b]) in turned.iter().enumerate() {
                let share = segments::nearest_share((p - a).dot(b - a), a.distance_squared(b));
                let away = p.distance(a.lerp(b, share));
                if away < best.0 - 1e-9 {
                    best = (away, i, share);
                }
            }
            let (away, side, share) = best;
            if away <= cells.own || (away <= cells.reach && cells.fed.contains(ix, iy)) {
                let pieces = sides[side].pieces;
                let piece = ((share * f64::from(pieces)) as u32).min(pieces - 1);
                room[side][piece as usize] += grid.cell * grid.cell;
            }
        }
        room.concat()
    }

    /// Outside corners, where beads meet and where one is gone back, cells are as near to two pieces: they go to the layer's first, whatever
    /// layer a tile was counted for.
    #[test]
    fn what_tiles_tell_is_what_every_layer_has_by_itself() {
        let corner = |x, y| DVec2::new(x, y);
        let plate = Region::rectangle(corner(0.0, 0.0), corner(50.0, 40.0));
        let settings = FillSettings::new(4.0, 3.0);
        let points = [
            (2.0, 2.0),
            (47.0, 3.0),
            (46.0, 21.0),
            (30.0, 37.0),
            (2.0, 2.0),
        ];
        let mut beads: Vec<[DVec2; 2]> = points
            .windows(2)
            .map(|w| [w[0], w[1]].map(|(x, y)| corner(x, y)))
            .collect();
        // there and back
        let (from, to) = (corner(15.0, 7.0), corner(33.0, 12.0));
        beads.extend([[from, to], [to, from]]);
        let sides = |beads: &[[DVec2; 2]]| -> Vec<Side> {
            let pieces = |[a, b]: [DVec2; 2]| (a.distance(b) / 0.5).ceil() as u32;
            let beads = beads.iter();
            beads
                .map(|&ends| Side {
                    ends,
                    pieces: pieces(ends),
                })
                .collect()
        };
        let rooms = Rooms::new(&[plate], &settings).unwrap();
        let mut layers = vec![sides(&beads)];
        beads.rotate_left(1);
        layers.push(sides(&beads));
        beads.reverse();
        for ends in &mut beads {
            ends.reverse();
        }
        layers.push(sides(&beads));
        for layer in &layers {
            let told = rooms.of(layer).unwrap();
            let anew = anew(&rooms, layer);
            let apart: f64 = told.iter().zip(&anew).map(|(a, b)| (a - b).abs()).sum();
            let all: f64 = anew.iter().sum();
            // cells on the line between two pieces fall either way
            assert!(apart < 1e-3 * all, "{apart} of {all}");
        }
    }
}
