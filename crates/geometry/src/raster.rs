//! Regions on a square grid: which cell centres lie inside, as runs of cells per row.

use std::ops::Range;

use rayon::prelude::*;

use crate::math::DVec2;
use crate::region::Region;

/// A square grid: cell (0, 0) has its centre at `origin`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Centre of cell (0, 0), mm.
    pub origin: DVec2,
    /// Side of a cell, mm.
    pub cell: f64,
    /// Cells along x.
    pub nx: usize,
    /// Cells along y.
    pub ny: usize,
}

impl Grid {
    /// The cells whose centres lie within `within` mm of the stretch from `a` to `b`: rows, and the columns in each.
    pub fn rows_beside(
        &self,
        a: DVec2,
        b: DVec2,
        within: f64,
    ) -> impl Iterator<Item = (usize, Range<usize>)> + use<> {
        // in cells, whose centres are whole numbers
        let [a, b] = [a, b].map(|p| (p - self.origin) / self.cell);
        let r = within / self.cell;
        let nx = self.nx;
        let first = (a.y.min(b.y) - r).ceil().max(0.0) as usize;
        let past = ((a.y.max(b.y) + r).floor() + 1.0).max(0.0) as usize;
        (first..past.min(self.ny)).filter_map(move |iy| {
            let (from, to) = row_of_band(a, b, r, iy as f64)?;
            let from = from.ceil().max(0.0) as usize;
            let past = ((to.floor() + 1.0).max(0.0) as usize).min(nx);
            (from < past).then_some((iy, from..past))
        })
    }
}

/// Where a row at height `y` lies within `r` of the stretch from `a` to `b`.
fn row_of_band(a: DVec2, b: DVec2, r: f64, y: f64) -> Option<(f64, f64)> {
    let mut row = (f64::INFINITY, f64::NEG_INFINITY);
    let mut take = |x: f64| row = (row.0.min(x), row.1.max(x));
    for end in [a, b] {
        let half = r * r - (y - end.y) * (y - end.y);
        if half >= 0.0 {
            take(end.x - half.sqrt());
            take(end.x + half.sqrt());
        }
    }
    let way = b - a;
    let beside = way.normalize_or_zero().perp() * r;
    for side in [beside, -beside] {
        let share = (y - a.y - side.y) / way.y;
        if (0.0..=1.0).contains(&share) {
            take(a.x + side.x + share * way.x);
        }
    }
    (row.0 <= row.1).then_some(row)
}

/// The cells of a grid whose centres lie inside regions: half-open runs of columns, in order, per row.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mask {
    /// Runs `[first, past)` of each row.
    pub rows: Vec<Vec<(u32, u32)>>,
}

impl Mask {
    /// Whether cell (ix, iy) is inside.
    pub fn contains(&self, ix: usize, iy: usize) -> bool {
        self.rows.get(iy).is_some_and(|runs| {
            let after = runs.partition_point(|&(first, _)| first as usize <= ix);
            after > 0 && ix < runs[after - 1].1 as usize
        })
    }

    /// Every cell inside, row by row.
    pub fn cells(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.rows.iter().enumerate().flat_map(|(iy, runs)| {
            runs.iter()
                .flat_map(move |&(first, past)| (first..past).map(move |ix| (ix as usize, iy)))
        })
    }

    /// Number of cells inside.
    pub fn count(&self) -> usize {
        self.rows
            .iter()
            .flatten()
            .map(|&(first, past)| (past - first) as usize)
            .sum()
    }

    /// The cells inside either mask.
    #[must_use]
    pub fn union(&self, other: &Mask) -> Mask {
        let empty = Vec::new();
        let rows = (0..self.rows.len().max(other.rows.len()))
            .map(|iy| {
                let mut runs: Vec<_> = self.rows.get(iy).unwrap_or(&empty).clone();
                runs.extend_from_slice(other.rows.get(iy).unwrap_or(&empty));
                runs.sort_unstable();
                let mut joined: Vec<(u32, u32)> = Vec::with_capacity(runs.len());
                for run in runs {
                    match joined.last_mut() {
                        Some(last) if run.0 <= last.1 => last.1 = last.1.max(run.1),
                        _ => joined.push(run),
                    }
                }
                joined
            })
            .collect();
        Mask { rows }
    }
}

/// The cells of `grid` whose centres lie inside `regions` (even-odd over all rings; rows in parallel).
///
/// A centre on an edge counts as inside on the lower-left side only, so that regions that share an edge share no cell.
///
/// ```
/// use meltpath_geometry::{Region, math::DVec2, raster::{Grid, rasterise}};
/// let square = Region { outer: vec![DVec2::ZERO, DVec2::X * 4.0, DVec2::splat(4.0), DVec2::Y * 4.0], holes: vec![] };
/// let grid = Grid { origin: DVec2::splat(-0.75), cell: 0.5, nx: 20, ny: 20 };
/// let mask = rasterise(&[square], &grid);
/// assert_eq!(mask.count(), 64);
/// assert!(mask.contains(2, 2) && !mask.contains(1, 2));
/// ```
pub fn rasterise(regions: &[Region], grid: &Grid) -> Mask {
    let mut edges: Vec<(DVec2, DVec2)> = Vec::new();
    for ring in regions.iter().flat_map(Region::rings) {
        let next = ring.iter().cycle().skip(1);
        // lower end first: each edge covers the half-open interval [a.y, b.y)
        edges.extend(
            ring.iter()
                .zip(next)
                .filter(|(a, b)| a.y != b.y)
                .map(|(&a, &b)| if a.y < b.y { (a, b) } else { (b, a) }),
        );
    }
    // edges by the first row they reach, so that a row looks only at those that can cross it
    let row_of = |y: f64| {
        ((y - grid.origin.y) / grid.cell)
            .ceil()
            .clamp(0.0, grid.ny as f64) as usize
    };
    let mut by_row: Vec<Vec<u32>> = vec![Vec::new(); grid.ny];
    for (i, (a, b)) in edges.iter().enumerate() {
        for row in &mut by_row[row_of(a.y)..row_of(b.y)] {
            row.push(i as u32);
        }
    }
    let rows = by_row
        .par_iter()
        .enumerate()
        .map(|(iy, crossing)| {
            let y = grid.origin.y + iy as f64 * grid.cell;
            let mut at: Vec<f64> = crossing
                .iter()
                .map(|&i| {
                    let (a, b) = edges[i as usize];
                    a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y))
                })
                .collect();
            at.sort_unstable_by(f64::total_cmp);
            let column = |x: f64| {
                ((x - grid.origin.x) / grid.cell)
                    .ceil()
                    .clamp(0.0, grid.nx as f64) as u32
            };
            at.as_chunks::<2>()
                .0
                .iter()
                .map(|&[a, b]| (column(a), column(b)))
                .filter(|(first, past)| first < past)
                .collect()
        })
        .collect();
    Mask { rows }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::region::signed_area;

    fn disc(centre: DVec2, radius: f64) -> Vec<DVec2> {
        (0..360)
            .map(|i| centre + DVec2::from_angle(f64::from(i).to_radians()) * radius)
            .collect()
    }

    fn grid(origin: f64, cell: f64, [nx, ny]: [usize; 2]) -> Grid {
        let origin = DVec2::splat(origin);
        Grid {
            origin,
            cell,
            nx,
            ny,
        }
    }

    #[test]
    fn area_of_a_ring_to_a_cell_row() {
        let outer = disc(DVec2::new(3.3, 4.7), 20.0);
        let mut hole = disc(DVec2::new(3.3, 4.7), 10.0);
        hole.reverse();
        let exact = signed_area(&outer) + signed_area(&hole);
        let grid = grid(-30.0, 0.25, [280, 280]);
        let holes = vec![hole];
        let mask = rasterise(&[Region { outer, holes }], &grid);
        let area = mask.count() as f64 * grid.cell * grid.cell;
        assert!((area - exact).abs() < 2e-3 * exact, "{area} {exact}");
        assert_eq!(mask.cells().count(), mask.count());
        assert!(mask.cells().all(|(ix, iy)| mask.contains(ix, iy)));
    }

    /// A triangle of three long slanted edges, against the side of each edge on which a point lies.
    #[test]
    fn a_cell_is_in_where_its_point_is() {
        let corners = [(1.3, 0.7), (37.1, 11.9), (8.2, 29.4)].map(DVec2::from);
        let grid = grid(-3.0, 0.5, [90, 70]);
        let mask = rasterise(
            &[Region {
                outer: corners.to_vec(),
                holes: vec![],
            }],
            &grid,
        );
        for (ix, iy) in (0..grid.nx).flat_map(|ix| (0..grid.ny).map(move |iy| (ix, iy))) {
            let p = grid.origin + grid.cell * DVec2::new(ix as f64, iy as f64);
            let inside = (0..3).all(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                (b - a).perp_dot(p - a) > 0.0
            });
            assert_eq!(mask.contains(ix, iy), inside, "{p}");
        }
    }

    #[test]
    fn regions_off_the_grid_are_cut() {
        let square = Region {
            outer: disc(DVec2::ZERO, 500.0),
            holes: vec![],
        };
        let grid = Grid {
            origin: DVec2::ZERO,
            cell: 1.0,
            nx: 7,
            ny: 5,
        };
        assert_eq!(rasterise(&[square], &grid).count(), 35);
        assert_eq!(rasterise(&[], &grid).count(), 0);
    }

    #[test]
    fn union_joins_runs() {
        let a = Mask {
            rows: vec![vec![(0, 3), (8, 9)], vec![]],
        };
        let b = Mask {
            rows: vec![vec![(2, 5)], vec![(1, 2)], vec![(0, 1)]],
        };
        assert_eq!(
            a.union(&b).rows,
            vec![vec![(0, 5), (8, 9)], vec![(1, 2)], vec![(0, 1)]]
        );
    }
}
