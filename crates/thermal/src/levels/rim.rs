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
    /// Whether `θ` bends by more than `may` W/mm across an edge of a tile that is awake.
    pub(super) fn bends_at_rim(&self, n: usize, i: usize, may: f32) -> bool {
        let level = &self.levels[n];
        let (tile, own) = (&level.tiles[i], &level.shown[i]);
        if own.asleep {
            return false;
        }
        SIDES.iter().enumerate().any(|(s, way)| {
            let Some(there) = self.tree.beside(n, tile.at, *way) else {
                return false;
            };
            tile.planes().any(|plane| {
                let theta = own.theta(plane);
                let Some(beside) = self.beside(n, (tile.at, there), s, plane) else {
                    return false;
                };
                bend(row(theta, s, 0), row(theta, s, 1), &beside, s, plane) > may
            })
        })
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
#[inline(always)]
fn row(theta: &[f32], s: usize, deep: usize) -> [f32; N] {
    let (first, next) = match s {
        0 => (deep, N),
        1 => (N - 1 - deep, N),
        2 => (deep * N, 1),
        _ => ((N - 1 - deep) * N, 1),
    };
    let mut cells = [0.0; N];
    for (cell, theta) in cells.iter_mut().zip(theta[first..].iter().step_by(next)) {
        *cell = *theta;
    }
    cells
}

/// Means of two cells each.
#[inline(always)]
fn halved(row: &[f32; N]) -> [f32; N / 2] {
    let mut means = [0.0; N / 2];
    for (mean, two) in means.iter_mut().zip(row.as_chunks::<2>().0) {
        *mean = 0.5 * (two[0] + two[1]);
    }
    means
}

/// Largest bend across side `s`: from the cells along the edge to those beside and to those further in.
#[inline(always)]
fn bend(edge: [f32; N], inner: [f32; N], beside: &Beside, s: usize, plane: usize) -> f32 {
    let opposite = s ^ 1;
    let mut largest = 0.0_f32;
    let mut found = |bend: f32| {
        let bend = bend.abs();
        largest = if bend > largest { bend } else { largest };
    };
    match beside {
        Beside::Same(shown) => {
            let other = row(shown.theta(plane), opposite, 0);
            for c in 0..N {
                found(other[c] - edge[c] + (inner[c] - edge[c]));
            }
        }
        Beside::Coarser(shown, half) => {
            // the middle of a cell twice as large lies half as far again, beside the middle of two
            let other = row(shown.theta(plane), opposite, 0);
            let (edge, inner) = (halved(&edge), halved(&inner));
            for c in 0..N / 2 {
                let other = other[half * (N / 2) + c];
                found(0.8 * ((other - edge[c]) / 1.5 + (inner[c] - edge[c])));
            }
        }
        Beside::Finer(both) => {
            for (half, shown) in both.iter().enumerate() {
                let near = halved(&row(shown.theta(plane), opposite, 0));
                let far = halved(&row(shown.theta(plane), opposite, 1));
                for c in 0..N / 2 {
                    let other = 0.5 * (near[c] + far[c]);
                    let n = half * (N / 2) + c;
                    found(other - edge[n] + (inner[n] - edge[n]));
                }
            }
        }
    }
    largest
}
