//! The predicted surface layer by layer, averaged as it comes so that the page stays small.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::raster::Grid;

use super::item::{MAX_LAYER, Scalar, SceneError, Visibility};

/// The predicted surface after chosen layers.
///
/// Snapshots are averaged over blocks of cells as they come, so that the page stays small; [`HeightLayers::shown`]
/// says at which cell size.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightLayers {
    /// Name in the list of items.
    pub name: String,
    /// 1 opaque, below 1 seen through, so that the paths inside show.
    pub opacity: f64,
    /// Whether it is shown at first.
    pub visibility: Visibility,
    given: Grid,
    block: usize,
    shown: Grid,
    numbers: Vec<u32>,
    heights: Vec<f32>,
    scalars: Vec<Scalar>,
}

/// Height values that a page carries at most, over all snapshots: about 10 MB of page for noisy ones.
const SHOWN_VALUES: usize = 12_000_000;

impl HeightLayers {
    /// Begins with no snapshot; `snapshots` is how many will come, which decides the cell size shown.
    ///
    /// # Errors
    /// [`SceneError::Grid`] when the grid is empty or its cell size not positive.
    pub fn new(name: &str, grid: Grid, snapshots: usize) -> Result<Self, SceneError> {
        let usable = grid.nx >= 1 && grid.ny >= 1 && grid.cell > 0.0 && grid.cell.is_finite();
        if !usable || !grid.origin.is_finite() || grid.nx.checked_mul(grid.ny).is_none() {
            return Err(SceneError::Grid {
                nx: grid.nx,
                ny: grid.ny,
                cell: grid.cell.to_string(),
            });
        }
        let fits = |block: usize| {
            let cells = grid.nx.div_ceil(block) as f64 * grid.ny.div_ceil(block) as f64;
            cells * snapshots.max(1) as f64 <= SHOWN_VALUES as f64
        };
        let coarsest = grid.nx.max(grid.ny);
        let block = (1..coarsest).find(|&b| fits(b)).unwrap_or(coarsest);
        let half = 0.5 * grid.cell * (block - 1) as f64;
        let shown = Grid {
            origin: grid.origin + DVec2::splat(half),
            cell: grid.cell * block as f64,
            nx: grid.nx.div_ceil(block),
            ny: grid.ny.div_ceil(block),
        };
        Ok(HeightLayers {
            name: name.to_owned(),
            opacity: 1.0,
            visibility: Visibility::Shown,
            given: grid,
            block,
            shown,
            numbers: Vec::new(),
            heights: Vec::new(),
            scalars: Vec::new(),
        })
    }

    /// Declares a field that every snapshot carries; before the first snapshot. `range` and colours as in [`Scalar`],
    /// whose `values` are ignored.
    #[must_use]
    pub fn with_scalar(mut self, scalar: Scalar) -> Self {
        self.scalars.push(Scalar {
            values: Vec::new(),
            ..scalar
        });
        self
    }

    /// Adds the surface after `layer` (counted from 1): heights, mm, and one frame per declared field, NaN where
    /// there is no value.
    ///
    /// # Errors
    /// [`SceneError::Count`] when a frame does not match the grid or a field is missing, [`SceneError::Layer`]
    /// when layers do not ascend or are too many; nothing is added then.
    pub fn push(
        &mut self,
        layer: u32,
        heights: &[f64],
        scalars: &[&[f64]],
    ) -> Result<(), SceneError> {
        if layer > MAX_LAYER || self.numbers.last().is_some_and(|&last| last >= layer) {
            return Err(SceneError::Layer {
                what: self.name.clone(),
                layer,
            });
        }
        let wrong = |what: &str, expected, found, element| SceneError::Count {
            what: format!("{what} of \"{}\" at layer {layer}", self.name),
            expected,
            found,
            element,
        };
        if scalars.len() != self.scalars.len() {
            return Err(wrong(
                "fields",
                self.scalars.len(),
                scalars.len(),
                "declared field",
            ));
        }
        let cells = self.given.nx * self.given.ny;
        for frame in scalars.iter().chain([&heights]) {
            if frame.len() != cells {
                return Err(wrong("frame", cells, frame.len(), "cell"));
            }
        }
        self.numbers.push(layer);
        block_means(heights, &self.given, self.block, &mut self.heights);
        for (scalar, frame) in self.scalars.iter_mut().zip(scalars) {
            block_means(frame, &self.given, self.block, &mut scalar.values);
        }
        Ok(())
    }

    /// The grid shown; its cell size is a whole multiple of the one given.
    pub fn shown(&self) -> Grid {
        self.shown
    }

    /// The grid given.
    pub fn given(&self) -> Grid {
        self.given
    }

    /// Layers after which the snapshots stand, ascending.
    pub fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// Heights of all snapshots one after another, on the shown grid, mm.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// The fields, their frames one after another, on the shown grid.
    pub fn scalars(&self) -> &[Scalar] {
        &self.scalars
    }
}

/// Appends the mean of the finite values of each block; NaN where a block has none.
fn block_means(frame: &[f64], grid: &Grid, block: usize, out: &mut Vec<f32>) {
    if block == 1 {
        out.extend(frame.iter().map(|&v| v as f32));
        return;
    }
    for by in (0..grid.ny).step_by(block) {
        for bx in (0..grid.nx).step_by(block) {
            let (mut sum, mut count) = (0.0, 0.0);
            for iy in by..(by + block).min(grid.ny) {
                let row = &frame[iy * grid.nx + bx..iy * grid.nx + (bx + block).min(grid.nx)];
                for v in row.iter().filter(|v| v.is_finite()) {
                    sum += v;
                    count += 1.0;
                }
            }
            out.push((sum / count) as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_maps_are_averaged_and_say_so() {
        let grid = Grid {
            origin: DVec2::ZERO,
            cell: 0.5,
            nx: 1001,
            ny: 1000,
        };
        let mut layers = HeightLayers::new("built", grid, 200).unwrap();
        let shown = layers.shown();
        assert_eq!((shown.nx, shown.ny), (201, 200));
        assert_eq!(shown.cell, 2.5);
        assert_eq!(shown.origin, DVec2::splat(1.0));
        let plane: Vec<f64> = (0..grid.nx * grid.ny)
            .map(|i| (i % grid.nx) as f64 * grid.cell)
            .collect();
        layers.push(1, &plane, &[]).unwrap();
        // the mean of a plane over a block is its value at the block's centre
        assert_eq!(
            f64::from(layers.heights()[7]),
            shown.origin.x + 7.0 * shown.cell
        );
        assert!(matches!(
            layers.push(1, &plane, &[]),
            Err(SceneError::Layer { .. })
        ));
        assert!(matches!(
            layers.push(2, &plane[1..], &[]),
            Err(SceneError::Count { .. })
        ));
        assert_eq!(layers.numbers(), [1]);
    }
}
