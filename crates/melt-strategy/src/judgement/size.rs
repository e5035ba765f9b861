//! How much memory a run of the judge takes, told from its settings: nothing is made for it.

use crate::bed::{EVEN, GROWTH, Resolution};
use crate::part::Rectangle;

/// Most levels of coarser cells.
const COARSER: usize = 4;
/// Where layers cool on each other the coarsest cells, on which they do, are no larger than this, mm: two fifths of what heat spreads
/// before.
const COOLING: f64 = 1.0;
/// How far beside the path highest temperatures are kept, mm.
pub const KEPT: f64 = 0.5;

/// Bytes of a number that the solver keeps.
const NUMBER: f64 = 4.0;
/// Bytes of a cell of a tile, with what others see of it and what it gives them.
const CELL: f64 = 40.0;
/// Cells along an edge of a tile.
const TILE: f64 = 16.0;
/// Of each finest column: the ground, and how the two highest planes froze.
const OF_COLUMN: f64 = 7.0;
/// Of each finest column where paths lie, besides its tracked planes: three planes of temperatures, two of how they froze, three times.
const OF_RESULT: f64 = 9.0;

/// Levels of coarser cells; whether layers cool on each other.
pub(super) fn coarser(resolution: &Resolution, cooling: bool) -> usize {
    // the coarsest tiles are no wider than what lies beside twice over: the ground ends where it is asked to, or little further
    let wide = |levels: usize| {
        let coarsest = resolution.cell * f64::from(1_u32 << levels);
        16.0 * coarsest > 4.0 * resolution.domain.beside || (cooling && coarsest > COOLING)
    };
    (0..COARSER).find(|n| wide(n + 1)).unwrap_or(COARSER)
}

/// Bytes that a run takes while it draws, and what stays of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bytes {
    /// While it draws.
    pub drawing: f64,
    /// Of its results.
    pub left: f64,
}

/// What a run of paths in `hull`, with `lower` layers of `layer` mm below the last one, takes; whether they cool on each other.
pub fn bytes(
    hull: &Rectangle,
    (lower, layer, cooling): (usize, f64, bool),
    resolution: &Resolution,
) -> Bytes {
    let layers = resolution.planes.max(1);
    let height = layer / f64::from(layers);
    let depth = resolution.domain.below.max(layer);
    let tracked = (((EVEN / layer).ceil() * layer).min(depth) / height).round();
    let grown = (1.0 + (depth - tracked * height).max(0.0) * (1.0 - 1.0 / GROWTH) / height).ln();
    let planes = tracked + (grown / GROWTH.ln()).ceil();
    let coarser = coarser(resolution, cooling);
    let root = TILE * resolution.cell * f64::from(1_u32 << coarser);
    let covered = hull.grown(resolution.domain.beside);
    let size = [0, 1].map(|a| covered.high[a] - covered.low[a]);
    let roots = size.map(|s| (s / root - 1e-6).ceil().max(1.0));
    let tiles = roots[0] * roots[1];
    let columns = tiles * (TILE * f64::from(1_u32 << coarser)).powi(2);
    let matter = (tracked + lower as f64 * f64::from(layers)).min((depth / height).ceil());
    let kept = hull.grown(KEPT);
    let kept: f64 = [0, 1]
        .map(|a| (kept.high[a] - kept.low[a]) / resolution.cell)
        .iter()
        .product();
    Bytes {
        drawing: NUMBER * columns * (OF_COLUMN + matter + tracked)
            + CELL * tiles * TILE * TILE * planes,
        left: NUMBER * kept * OF_RESULT,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bed::{Domain, planes};

    /// What is foretold grows with the finest columns of the frame that is really made, and with its planes.
    #[test]
    fn memory_is_that_of_the_cells_that_would_be_made() {
        let hull = Rectangle {
            low: [0.0; 2],
            high: [10.0, 4.0],
        };
        let of = |cell: f64, beside: f64| Resolution {
            cell,
            planes: 1,
            step: 2e-5,
            domain: Domain {
                below: beside,
                beside,
            },
            power: 1.0,
        };
        for (cell, layer, beside) in [(0.03125, 0.05, 5.0), (0.01, 0.05, 0.5), (0.125, 0.01, 32.0)]
        {
            let resolution = of(cell, beside);
            let root = cell * TILE * f64::from(1_u32 << coarser(&resolution, false));
            let roots = [10.0, 4.0].map(|s| ((s + 2.0 * beside) / root - 1e-6).ceil().max(1.0));
            let columns = roots[0] * roots[1] * (root / cell).powi(2);
            let heights = planes(layer, layer, beside);
            let even = |h: &&f64| **h < layer * (1.0 + 1e-9);
            let tracked = heights.iter().rev().take_while(even).count() as f64;
            let least = NUMBER * columns * (1.0 + 2.0 * tracked);
            let found = bytes(&hull, (0, layer, false), &resolution).drawing;
            assert!(
                found > least && found < 6.0 * least,
                "{cell} {layer}: {found} {least}"
            );
        }
        // planes too many to be listed are told all the same
        let thin = bytes(&hull, (0, 1e-12, false), &of(0.03125, 0.5));
        assert!(thin.drawing > 1e15);
    }
}
