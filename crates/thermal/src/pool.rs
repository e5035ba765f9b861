//! The melt pool: cells above the liquidus (Béraud 2016, section 3.2.2.1).

pub mod fusion;
pub mod history;
pub mod keyhole;
pub mod moving_source;
mod sheet;

use crate::grid::TemperatureField;

/// Size of a melt pool, mm; zeros where nothing is molten.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeltPool {
    /// Extent along the direction of travel.
    pub length: f64,
    /// Extent across it.
    pub width: f64,
    /// Extent below the build plane.
    pub depth: f64,
    /// Hottest temperature, K.
    pub hottest: f64,
    /// Molten cells.
    pub cells: usize,
}

impl MeltPool {
    /// The pool in `field`, above `liquidus` K, under a beam that travels along `direction`; whole cells count, so a size is
    /// known to a cell.
    pub fn of(field: &TemperatureField, liquidus: f64, direction: [f64; 2]) -> Self {
        let norm = direction[0].hypot(direction[1]).max(f64::MIN_POSITIVE);
        let [ux, uy] = direction.map(|c| c / norm);
        let grid = &field.grid;
        let [nx, ny] = grid.cells;
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        let (mut depth, mut cells) = (0.0_f64, 0);
        let depths = grid.depths();
        for (n, &kelvin) in field.values.iter().enumerate() {
            if f64::from(kelvin) <= liquidus {
                continue;
            }
            let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
            let (x, y) = (
                (i as f64 + 0.5) * grid.edge[0],
                (j as f64 + 0.5) * grid.edge[1],
            );
            for (end, at) in ends.iter_mut().zip([x * ux + y * uy, y * ux - x * uy]) {
                *end = [end[0].min(at), end[1].max(at)];
            }
            depth = depth.max(depths[k] + grid.heights[k]);
            cells += 1;
        }
        if cells == 0 {
            return MeltPool {
                hottest: field.largest().0,
                ..MeltPool::default()
            };
        }
        let cell =
            |along: f64, across: f64| along.abs() * grid.edge[0] + across.abs() * grid.edge[1];
        MeltPool {
            length: ends[0][1] - ends[0][0] + cell(ux, uy),
            width: ends[1][1] - ends[1][0] + cell(uy, ux),
            depth,
            hottest: field.largest().0,
            cells,
        }
    }
}
