//! What a field says at a place between the centres of its cells.

use crate::grid::{Field, Grid};

/// What a field says somewhere at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Where, mm.
    pub place: [f64; 3],
    /// When, s.
    pub time: f64,
    /// Temperature, K; or s where times are compared.
    pub value: f64,
}

/// Value of a field between the centres of its cells, straight along each axis; beyond the outer centres theirs. `None`
/// outside the grid.
pub fn between(field: &Field, place: [f64; 3]) -> Option<f64> {
    let corners = around(&field.grid, place)?;
    Some(
        corners
            .iter()
            .map(|&([i, j, k], weight)| weight * field.at(i, j, k))
            .sum(),
    )
}

/// Value of the cell in which a place lies. `None` outside the grid.
pub fn nearest(field: &Field, place: [f64; 3]) -> Option<f64> {
    let cells = around(&field.grid, place)?;
    let nearest = cells.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let [i, j, k] = nearest.0;
    Some(field.at(i, j, k))
}

/// The cells round a place and their weights.
pub fn around(grid: &Grid, place: [f64; 3]) -> Option<Vec<([usize; 3], f64)>> {
    let axis = |at: f64, origin: f64, edge: f64, cells: usize| -> Option<[(usize, f64); 2]> {
        let x = (at - origin) / edge;
        if !(x > -1e-9 && x < cells as f64 + 1e-9) {
            return None;
        }
        let x = (x - 0.5).clamp(0.0, (cells - 1) as f64);
        let low = (x as usize).min(cells.saturating_sub(2));
        let share = x - low as f64;
        Some([(low, 1.0 - share), ((low + 1).min(cells - 1), share)])
    };
    let x = axis(place[0], grid.origin.x, grid.edge[0], grid.cells[0])?;
    let y = axis(place[1], grid.origin.y, grid.edge[1], grid.cells[1])?;
    let z = along_planes(grid, place[2])?;
    let mut out = Vec::with_capacity(8);
    for (k, c) in z {
        for (j, b) in y {
            for (i, a) in x {
                if a * b * c > 0.0 {
                    out.push(([i, j, k], a * b * c));
                }
            }
        }
    }
    Some(out)
}

/// The same along the planes, whose heights may differ.
fn along_planes(grid: &Grid, z: f64) -> Option<[(usize, f64); 2]> {
    let top = grid.top();
    if !(z > grid.origin.z - 1e-9 && z < top + 1e-9) {
        return None;
    }
    let mut centres = Vec::with_capacity(grid.planes());
    let mut floor = grid.origin.z;
    for h in &grid.heights {
        centres.push(floor + 0.5 * h);
        floor += h;
    }
    let last = centres.len() - 1;
    let above = centres.partition_point(|c| *c <= z);
    if above == 0 {
        return Some([(0, 1.0), (0, 0.0)]);
    }
    if above > last {
        return Some([(last, 1.0), (last, 0.0)]);
    }
    let share = (z - centres[above - 1]) / (centres[above] - centres[above - 1]);
    Some([(above - 1, 1.0 - share), (above, share)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_straight_field_is_met_between_its_cells(p in (0.05..0.95_f64, 0.05..0.75_f64, -0.45..-0.05_f64)) {
            let grid = Grid::covering(DVec3::new(0.0, 0.0, -0.5), DVec3::new(1.0, 0.8, 0.0), DVec3::new(0.1, 0.1, 0.1)).unwrap();
            let [nx, ny] = grid.cells;
            let of = |c: DVec3| 1000.0 + 300.0 * c.x - 200.0 * c.y + 500.0 * c.z;
            let values = (0..grid.len()).map(|n| of(grid.centre(n % nx, n / nx % ny, n / (nx * ny))) as f32).collect();
            let field = Field { grid, values };
            let found = between(&field, [p.0, p.1, p.2]).unwrap();
            prop_assert!((found - of(DVec3::new(p.0, p.1, p.2))).abs() < 1e-2, "{}", found);
        }
    }

    #[test]
    fn outside_is_not_invented() {
        let grid = Grid::covering(
            DVec3::new(0.0, 0.0, -0.1),
            DVec3::new(0.2, 0.2, 0.0),
            DVec3::splat(0.1),
        )
        .unwrap();
        let field = Field {
            values: vec![300.0; grid.len()],
            grid,
        };
        assert_eq!(between(&field, [0.1, 0.1, 0.01]), None);
        assert_eq!(between(&field, [-0.01, 0.1, -0.05]), None);
        assert!(between(&field, [0.2, 0.2, 0.0]).is_some());
    }
}
