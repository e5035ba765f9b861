//! What lies under the lowest plane of a tile: a face, or the cells of a trunk on the next coarser level.

use super::tile::{Beneath, N, PLANE, Shown};

/// What lies under the lowest plane of a tile.
#[derive(Clone, Copy)]
pub(crate) enum Under<'a> {
    /// Nothing flows: the lower face of all, or a trunk that sleeps.
    Closed,
    /// The lower face of all, held at this `θ`.
    Held(f32),
    /// Of the trunk on the next coarser level which quarter, by column and row.
    Trunk(&'a Shown, [usize; 2]),
}

/// A quarter of the slope along a row, from cell to cell.
#[inline(always)]
fn onwards(row: &[f32]) -> [f32; N] {
    let mut out = [0.0; N];
    for n in 1..N - 1 {
        out[n] = 0.125 * (row[n + 1] - row[n - 1]);
    }
    out[0] = 0.25 * (row[1] - row[0]);
    out[N - 1] = 0.25 * (row[N - 1] - row[N - 2]);
    out
}

/// A quarter of a trunk's highest plane under finer cells: `θ` straight between its cells.
#[inline(always)]
pub(super) fn look_beneath(out: &mut Beneath, under: &Under) {
    match under {
        Under::Closed => *out = Beneath::default(),
        Under::Held(theta) => {
            *out = Beneath::default();
            out.theta = [*theta; PLANE];
        }
        Under::Trunk(shown, quarter) => {
            let top = shown.base + shown.dense.len() - 1;
            let (theta, share) = (shown.theta(top), shown.share(top));
            out.dense = shown.dense(top);
            for half in 0..N / 2 {
                let row = quarter[1] * (N / 2) + half;
                let (south, north) = (row.saturating_sub(1), (row + 1).min(N - 1));
                let upwards = 0.25 / (north - south) as f32;
                let (here, south) = (&theta[row * N..][..N], &theta[south * N..][..N]);
                let north = &theta[north * N..][..N];
                let onwards = onwards(here);
                for n in 0..N / 2 {
                    let c = quarter[0] * (N / 2) + n;
                    let (up, on) = (upwards * (north[c] - south[c]), onwards[c]);
                    let to = 2 * half * N + 2 * n;
                    out.theta[to] = here[c] - up - on;
                    out.theta[to + 1] = here[c] - up + on;
                    out.theta[to + N] = here[c] + up - on;
                    out.theta[to + N + 1] = here[c] + up + on;
                }
                for n in 0..N {
                    let of = share[row * N + quarter[0] * (N / 2) + n / 2];
                    out.share[2 * half * N + n] = of;
                    out.share[(2 * half + 1) * N + n] = of;
                }
            }
        }
    }
}
