//! The cells of a field: equal in the plane, of any heights, counted upwards from the bottom.

pub mod sample;

use meltpath_geometry::math::DVec3;

/// A rectangular block of cells. Cell `(i, j, k)` is number `(k·ny + j)·nx + i`; the top of the last plane is the
/// build plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Lowest corner, mm, part frame, z along the build direction.
    pub origin: DVec3,
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// Edges of a cell along x and y, mm.
    pub edge: [f64; 2],
    /// Heights of the planes of cells, bottom first, mm.
    pub heights: Vec<f64>,
}

/// Why a grid was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// No cells or a cell without size.
    #[error(
        "a grid of {cells:?} cells with edges {edge:?} mm and {planes} planes: it needs at least one cell each way, all edges above zero"
    )]
    Empty {
        /// Cells along x and y.
        cells: [usize; 2],
        /// Their edges, mm.
        edge: [f64; 2],
        /// Planes.
        planes: usize,
    },
}

impl Grid {
    /// Cells of `edge` mm that cover the box from `low` to `high`, all planes of the same height; the top plane ends at
    /// `high.z`, and the box grows outwards (down along z) to whole cells.
    ///
    /// # Errors
    /// [`GridError`] where a length is not above zero.
    ///
    /// ```
    /// use meltpath_geometry::math::DVec3;
    /// use meltpath_thermal::grid::Grid;
    /// let grid = Grid::covering(DVec3::new(-1.0, -0.5, -0.5), DVec3::new(1.0, 0.5, 0.0), DVec3::splat(0.025)).unwrap();
    /// assert_eq!((grid.cells, grid.planes()), ([80, 40], 20));
    /// ```
    pub fn covering(low: DVec3, high: DVec3, edge: DVec3) -> Result<Self, GridError> {
        let count = |length: f64, edge: f64| {
            let n = (length / edge - 1e-6).ceil();
            if (1.0..1e7).contains(&n) {
                n as usize
            } else {
                0
            }
        };
        let size = high - low;
        let cells = [count(size.x, edge.x), count(size.y, edge.y)];
        let planes = count(size.z, edge.z);
        let spread =
            |n: usize, edge: f64, low: f64, high: f64| 0.5 * (low + high - n as f64 * edge);
        let grid = Grid {
            origin: DVec3::new(
                spread(cells[0], edge.x, low.x, high.x),
                spread(cells[1], edge.y, low.y, high.y),
                high.z - planes as f64 * edge.z,
            ),
            cells,
            edge: [edge.x, edge.y],
            heights: vec![edge.z; planes],
        };
        grid.check()?;
        Ok(grid)
    }

    /// Whether there are cells, all with a size.
    ///
    /// # Errors
    /// [`GridError`].
    pub fn check(&self) -> Result<(), GridError> {
        let sized = self
            .edge
            .iter()
            .chain(&self.heights)
            .all(|&e| e > 0.0 && e.is_finite());
        if sized
            && self.cells[0] > 0
            && self.cells[1] > 0
            && !self.heights.is_empty()
            && self.origin.is_finite()
        {
            Ok(())
        } else {
            Err(GridError::Empty {
                cells: self.cells,
                edge: self.edge,
                planes: self.heights.len(),
            })
        }
    }

    /// Planes of cells.
    pub fn planes(&self) -> usize {
        self.heights.len()
    }

    /// Cells in all.
    pub fn len(&self) -> usize {
        self.cells[0] * self.cells[1] * self.heights.len()
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Height of the build plane, mm.
    pub fn top(&self) -> f64 {
        self.origin.z + self.heights.iter().sum::<f64>()
    }

    /// Depth of the top of each plane of cells below the build plane, mm, bottom plane first.
    pub fn depths(&self) -> Vec<f64> {
        let mut depth = 0.0;
        let mut out: Vec<f64> = self
            .heights
            .iter()
            .rev()
            .map(|h| {
                depth += h;
                depth - h
            })
            .collect();
        out.reverse();
        out
    }

    /// Centre of cell `(i, j, k)`, mm.
    pub fn centre(&self, i: usize, j: usize, k: usize) -> DVec3 {
        let below: f64 = self.heights[..k].iter().sum();
        self.origin
            + DVec3::new(
                (i as f64 + 0.5) * self.edge[0],
                (j as f64 + 0.5) * self.edge[1],
                below + 0.5 * self.heights[k],
            )
    }

    /// Volume of a cell of plane `k`, mm³.
    pub fn volume(&self, k: usize) -> f64 {
        self.edge[0] * self.edge[1] * self.heights[k]
    }
}

/// The planes between whose middles `depth` lies, the lower one first, and how far it is from the upper one's towards the lower one's;
/// above the uppermost middle that plane alone. Planes from the lowest one: their upper faces' depths, their heights, mm.
pub(crate) fn between(depths: &[f64], heights: &[f64], depth: f64) -> (usize, usize, f64) {
    let middle = |k: usize| depths[k] + 0.5 * heights[k];
    // the lowest plane whose middle lies no deeper
    let planes = 0..heights.len();
    let upper = planes.clone().find(|k| middle(*k) <= depth);
    let upper = upper.unwrap_or(planes.end - 1);
    let lower = upper.saturating_sub(1);
    let way = middle(lower) - middle(upper);
    let share = if way > 0.0 {
        ((depth - middle(upper)) / way).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (lower, upper, share)
}

/// One number per cell of a grid: temperatures in K, highest temperatures, relative densities.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// The cells.
    pub grid: Grid,
    /// The values, in the order of the grid.
    pub values: Vec<f32>,
}

/// A field of temperatures, K.
pub type TemperatureField = Field;

impl Field {
    /// Value of cell `(i, j, k)`.
    pub fn at(&self, i: usize, j: usize, k: usize) -> f64 {
        f64::from(self.values[(k * self.grid.cells[1] + j) * self.grid.cells[0] + i])
    }

    /// The same field with the mean of each column over its uppermost `thickness` mm in the top plane: what a voxel as high as
    /// a layer has, where cells are lower.
    ///
    /// ```
    /// use meltpath_geometry::math::DVec3;
    /// use meltpath_thermal::grid::{Field, Grid};
    /// let grid = Grid::covering(DVec3::ZERO, DVec3::ONE, DVec3::new(1.0, 1.0, 0.25)).unwrap();
    /// let field = Field { grid, values: vec![1.0, 2.0, 3.0, 5.0] };
    /// assert_eq!(field.over_layer(0.5).values, [1.0, 2.0, 3.0, 4.0]);
    /// ```
    #[must_use]
    pub fn over_layer(mut self, thickness: f64) -> Field {
        let columns = self.grid.cells[0] * self.grid.cells[1];
        let mut cut = thickness;
        // heights of the planes that the thickness takes, top first
        let mut heights = Vec::new();
        for height in self.grid.heights.iter().rev() {
            if cut <= 1e-6 * thickness {
                break;
            }
            heights.push(height.min(cut));
            cut -= height.min(cut);
        }
        if heights.len() < 2 {
            return self;
        }
        let whole: f64 = heights.iter().sum();
        let top = self.grid.planes() - 1;
        for column in 0..columns {
            let of =
                |(n, h): (usize, &f64)| h * f64::from(self.values[(top - n) * columns + column]);
            let mean = heights.iter().enumerate().map(of).sum::<f64>() / whole;
            self.values[top * columns + column] = mean as f32;
        }
        self
    }

    /// The same field with what each column has `depth` mm below the build plane in the top plane: straight between the middles of
    /// cells; above the uppermost middle that cell's own.
    ///
    /// ```
    /// use meltpath_geometry::math::DVec3;
    /// use meltpath_thermal::grid::{Field, Grid};
    /// let grid = Grid::covering(DVec3::ZERO, DVec3::ONE, DVec3::new(1.0, 1.0, 0.25)).unwrap();
    /// let field = Field { grid, values: vec![1.0, 2.0, 3.0, 5.0] };
    /// assert_eq!(field.clone().at_depth(0.25).values, [1.0, 2.0, 3.0, 4.0]);
    /// assert_eq!(field.at_depth(0.0).values, [1.0, 2.0, 3.0, 5.0]);
    /// ```
    #[must_use]
    pub fn at_depth(mut self, depth: f64) -> Field {
        let columns = self.grid.cells[0] * self.grid.cells[1];
        let top = self.grid.planes() - 1;
        let (lower, upper, share) = between(&self.grid.depths(), &self.grid.heights, depth);
        for column in 0..columns {
            let of = |k: usize| f64::from(self.values[k * columns + column]);
            let value = (1.0 - share) * of(upper) + share * of(lower);
            self.values[top * columns + column] = value as f32;
        }
        self
    }

    /// The largest value and its cell.
    pub fn largest(&self) -> (f64, [usize; 3]) {
        let mut best = (f32::NEG_INFINITY, 0);
        for (n, &v) in self.values.iter().enumerate() {
            if v > best.0 {
                best = (v, n);
            }
        }
        let [nx, ny] = self.grid.cells;
        (
            f64::from(best.0),
            [best.1 % nx, best.1 / nx % ny, best.1 / (nx * ny)],
        )
    }
}
