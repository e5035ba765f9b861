//! How strongly `θ` bends at the rim of a tile, from its cells to those of the tiles beside: a pool whose middle lies where tiles meet
//! bends nowhere else as strongly.

use super::tile::{N, SIDES, Shown};
use super::tree::parts;
use super::{Level, Levels};

/// What lies beside a row of cells of a plane.
enum Beside<'a> {
    /// Cells of the same size.
    Same(&'a Shown),
    /// Half of a row of cells twice as large.
    Coarser(&'a Shown, usize),
    /// Two tiles of cells half as large.
    Finer([&'a Shown; 2]),
}

impl Levels {
    /// The largest bend of `θ` across the edges of a tile, W/mm.
    pub(super) fn bend_at_rim(&self, n: usize, i: usize) -> f32 {
        let level = &self.levels[n];
        let (tile, own) = (&level.tiles[i], &level.shown[i]);
        let mut largest = 0.0_f32;
        for (s, way) in SIDES.iter().enumerate() {
            let Some(there) = self.tree.beside(n, tile.at, *way) else {
                continue;
            };
            for plane in tile.planes() {
                let theta = own.theta(plane);
                let [edge, inner] = [0, 1].map(|deep| row(theta, s, deep));
                let Some(beside) = self.beside(n, (tile.at, there), s, plane) else {
                    continue;
                };
                largest = largest.max(bend(edge, inner, &beside, s, plane));
            }
        }
        largest
    }

    /// What lies beside a plane of the tile at `at`, on side `s`.
    fn beside(
        &self,
        n: usize,
        (at, there): ([usize; 2], [usize; 2]),
        s: usize,
        plane: usize,
    ) -> Option<Beside<'_>> {
        let shown = |level: usize, at: [usize; 2]| -> Option<&Shown> {
            let own: &Level = self.levels.get(level)?;
            let place = at[1] * self.tree.size(level)[0] + at[0];
            let shown = own.shown.get(own.index[place] as usize)?;
            let planes = shown.base..shown.base + shown.dense.len();
            planes.contains(&plane).then_some(shown)
        };
        if !self.tree.is_there(n, there) {
            let half = if s < 2 { at[1] % 2 } else { at[0] % 2 };
            let coarser = shown(n.checked_sub(1)?, there.map(|t| t / 2))?;
            return Some(Beside::Coarser(coarser, half));
        }
        if let Some(same) = shown(n, there) {
            return Some(Beside::Same(same));
        }
        let all = parts(there);
        let [a, b] = match s {
            0 => [all[1], all[3]],
            1 => [all[0], all[2]],
            2 => [all[2], all[3]],
            _ => [all[0], all[1]],
        };
        Some(Beside::Finer([shown(n + 1, a)?, shown(n + 1, b)?]))
    }
}

/// The cells of a plane along side `s`, `deep` rows or columns from it.
fn row(theta: &[f32], s: usize, deep: usize) -> [f32; N] {
    std::array::from_fn(|c| {
        let (i, j) = match s {
            0 => (deep, c),
            1 => (N - 1 - deep, c),
            2 => (c, deep),
            _ => (c, N - 1 - deep),
        };
        theta[j * N + i]
    })
}

/// Largest bend across side `s`: from the cells along the edge to those beside and to those further in.
fn bend(edge: [f32; N], inner: [f32; N], beside: &Beside, s: usize, plane: usize) -> f32 {
    let opposite = s ^ 1;
    let mut largest = 0.0_f32;
    match beside {
        Beside::Same(shown) => {
            let other = row(shown.theta(plane), opposite, 0);
            for c in 0..N {
                largest = largest.max((other[c] - edge[c] + (inner[c] - edge[c])).abs());
            }
        }
        Beside::Coarser(shown, half) => {
            // the middle of a cell twice as large lies half as far again, beside the middle of two
            let other = row(shown.theta(plane), opposite, 0);
            for c in 0..N / 2 {
                let [edge, inner] = [edge, inner].map(|r| 0.5 * (r[2 * c] + r[2 * c + 1]));
                let other = other[half * (N / 2) + c];
                let bend = 0.8 * ((other - edge) / 1.5 + (inner - edge));
                largest = largest.max(bend.abs());
            }
        }
        Beside::Finer(both) => {
            for (half, shown) in both.iter().enumerate() {
                let near = row(shown.theta(plane), opposite, 0);
                let far = row(shown.theta(plane), opposite, 1);
                for c in 0..N / 2 {
                    let four = [near[2 * c], near[2 * c + 1], far[2 * c], far[2 * c + 1]];
                    let other = 0.25 * four.iter().sum::<f32>();
                    let n = half * (N / 2) + c;
                    largest = largest.max((other - edge[n] + (inner[n] - edge[n])).abs());
                }
            }
        }
    }
    largest
}
