//! Sections through voxels: along which axis they run, and through which voxels.

use meltpath_thermal::grid::Grid;

/// A direction of sections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Along {
    X,
    Y,
}

impl Along {
    pub(crate) fn axis(self) -> usize {
        self as usize
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Along::X => "x",
            Along::Y => "y",
        }
    }

    pub(crate) fn other(self) -> Along {
        match self {
            Along::X => Along::Y,
            Along::Y => Along::X,
        }
    }

    /// The column of voxels `n` along and `row` across.
    pub(crate) fn cell(self, n: usize, row: usize) -> (usize, usize) {
        match self {
            Along::X => (n, row),
            Along::Y => (row, n),
        }
    }
}

/// Index of the cell round a place; `None` outside.
pub(crate) fn index(grid: &Grid, axis: usize, place: f64) -> Option<usize> {
    let at = ((place - grid.origin[axis]) / grid.edge[axis]).floor();
    (at >= 0.0 && at < grid.cells[axis] as f64).then_some(at as usize)
}
