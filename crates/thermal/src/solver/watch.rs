//! What the reference solver shows besides highest temperatures: how long the cells near the build plane are molten and when
//! they freeze, and the temperature in time at chosen places. The same readings as those of the chart simulation.

use meltpath_geometry::math::DVec3;

use crate::grid::sample::Sample;
use crate::grid::{Field, Grid};

/// Planes that are watched: the build plane, and the one below for the gradient's slope.
const PLANES: usize = 2;

/// What is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Watch {
    /// Places whose temperature is kept in time, mm.
    pub places: Vec<[f64; 3]>,
    /// Time between two samples of a place, s.
    pub every: f64,
}

/// How cells near the build plane froze while a layer was drawn; the two highest planes. Times count from the beginning of its
/// path.
#[derive(Debug, Clone, PartialEq)]
pub struct Freezing {
    /// Time above the liquidus, s.
    pub above: Field,
    /// When each last fell through the liquidus, s; not a number where it has not.
    pub fell: Field,
    /// How fast it then cooled, K/s; not a number where it did not.
    pub rate: Field,
}

/// The highest planes of a grid that are looked at.
pub(crate) fn upper(grid: &Grid) -> Grid {
    let heights = grid.heights[grid.planes().saturating_sub(PLANES)..].to_vec();
    let bottom = grid.top() - heights.iter().sum::<f64>();
    Grid {
        origin: DVec3::new(grid.origin.x, grid.origin.y, bottom),
        heights,
        ..*grid
    }
}

/// What was seen while the last layer was drawn. Times count from the beginning of its path.
#[derive(Debug, Clone, PartialEq)]
pub struct Watched {
    /// How the metal froze.
    pub freezing: Freezing,
    /// Temperatures at the places inside the grid, in order of time, straight between the centres of cells.
    pub samples: Vec<Sample>,
    /// Places outside the grid, mm.
    pub outside: Vec<[f64; 3]>,
}
