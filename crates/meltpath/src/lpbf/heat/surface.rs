//! The surface that lines are to melt together: half a hatch beside them, and what they melt with the gaps between filled.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::raster::Grid;
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::pool::fusion::FusionMap;

use super::beam::lit;

/// Cells with the gaps between them filled: grown by `reach` cells and shrunk by as many, in squares. They grow beyond the map, too, where
/// nothing stops them: what is found does not hang on where it ends.
pub(super) fn closed(cells: &[bool], [nx, ny]: [usize; 2], reach: f64) -> Vec<bool> {
    let reach = reach.ceil().max(0.0) as usize;
    let (wide, high) = (nx + 2 * reach, ny + 2 * reach);
    let mut room = vec![false; wide * high];
    let inside = |j: usize| (j + reach) * wide + reach..(j + reach) * wide + reach + nx;
    for (j, row) in cells.chunks(nx).enumerate() {
        room[inside(j)].copy_from_slice(row);
    }
    let grown = |cells: &[bool], wanted: bool| {
        let rows = spread(cells, wide, wanted, reach);
        let columns = spread(&turned(&rows, wide), high, wanted, reach);
        turned(&columns, high)
    };
    let room = grown(&grown(&room, true), false);
    (0..ny).flat_map(|j| &room[inside(j)]).copied().collect()
}

/// Marks the cells that lie within `reach` mm of a way drawn with light that counts, and not beyond its ends.
pub(super) fn beside(
    cells: &mut [bool],
    map: &FusionMap,
    (path, counts): (&BeamPath, impl Fn([&BeamPoint; 2]) -> bool),
    reach: f64,
) {
    let grid = Grid {
        origin: DVec2::from_array(map.origin) + 0.5 * map.cell,
        cell: map.cell,
        nx: map.cells[0],
        ny: map.cells[1],
    };
    for [from, to] in lit(path).filter(|way| counts(*way)) {
        let [from, to] = [from, to].map(|p| DVec2::new(p.x, p.y));
        let way = to - from;
        for (iy, row) in grid.rows_beside(from, to, reach) {
            for ix in row {
                let place = grid.origin + DVec2::new(ix as f64, iy as f64) * grid.cell;
                let along = (place - from).dot(way);
                cells[iy * grid.nx + ix] |= (0.0..=way.length_squared()).contains(&along);
            }
        }
    }
}

/// Rows of `width` in which the wanted cells have spread by `reach` cells to either side.
fn spread(cells: &[bool], width: usize, wanted: bool, reach: usize) -> Vec<bool> {
    let mut out = vec![!wanted; cells.len()];
    for (row, to) in cells.chunks(width).zip(out.chunks_mut(width)) {
        for (i, _) in row.iter().enumerate().filter(|(_, c)| **c == wanted) {
            to[i.saturating_sub(reach)..(i + reach + 1).min(width)].fill(wanted);
        }
    }
    out
}

/// Rows of `width` as columns.
fn turned(cells: &[bool], width: usize) -> Vec<bool> {
    let height = cells.len() / width.max(1);
    (0..cells.len())
        .map(|n| cells[(n % height) * width + n / height])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_and_borders_stay() {
        let lines = |x: usize, y: usize| {
            (3..17).contains(&y) && (4..26).contains(&x) && y.is_multiple_of(3)
        };
        let cells: Vec<bool> = (0..600).map(|n| lines(n % 30, n / 30)).collect();
        let filled = closed(&cells, [30, 20], 2.0);
        let all = |x: usize, y: usize| (3..16).contains(&y) && (4..26).contains(&x);
        for (n, c) in filled.iter().enumerate() {
            assert_eq!(*c, all(n % 30, n / 30), "{} {}", n % 30, n / 30);
        }
    }
}
