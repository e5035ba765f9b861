//! The reference solver made ready for beam paths: fresh powder on the ground, margins round the paths, planes of cells that
//! grow with depth, rows that sleep, lower layers drawn.

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;

use crate::interrupted::Kept;
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::Material;
use meltpath_thermal::solver::run::draw;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::{Face, Faces, Solver, SolverError, State};

/// Rows this close to the start temperature sleep, K.
const TOLERANCE: f64 = 2.0;
/// Planes are equal down to this depth, mm: twice what electrons reach, and deeper than pools of 300 W.
pub(crate) const EVEN: f64 = 0.2;
/// Each plane below is at most so many times as high as the one above it.
pub(crate) const GROWTH: f64 = 1.5;

/// How far the ground reaches that is drawn on: there it is held at the start temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Below the last layer's build plane, mm, in whole layers.
    pub below: f64,
    /// Beside the path, mm.
    pub beside: f64,
}

impl Domain {
    /// Half a millimetre each way: Béraud 2016, section 3.2.2.1.
    pub const NARROW: Domain = Domain {
        below: 0.5,
        beside: 0.5,
    };
}

/// Where the highest temperatures of the last layer are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// Means over the layer.
    LayerMean,
    /// So far below the build plane, mm.
    Depth(f64),
}

/// Cell, longest step, domain and power of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Edge of a cell in the plane, mm.
    pub cell: f64,
    /// Planes of cells in a layer.
    pub planes: u32,
    /// Longest step, s; shorter where stability asks for it.
    pub step: f64,
    /// Where the ground ends.
    pub domain: Domain,
    /// Factor on the beam's power.
    pub power: f64,
}

/// What is drawn on.
#[derive(Clone, Copy)]
pub struct Body<'a> {
    /// The material.
    pub material: &'a Material,
    /// Beam to heat.
    pub beam: &'a Beam,
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// Where temperatures are read.
    pub reading: Reading,
    /// What lies under the first layer at a place of the build plane, mm.
    pub ground: &'a (dyn Fn([f64; 2]) -> State + Sync),
    /// What the build plane sees.
    pub surface: Surface,
    /// What the ground does where it ends, below and beside.
    pub beyond: Face,
    /// What happens from one layer to the next on the solver for whole layers; each starts at the start temperature where absent.
    pub between: Option<Between>,
    /// Where layers that were drawn on that solver are kept until the run is done.
    pub kept: Option<&'a Kept>,
}

/// From the end of a layer's path to the beginning of the next one's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Between {
    /// How long the layer cools, s.
    pub time: f64,
    /// Temperature of the next layer of powder when its path begins, K.
    pub powder: f64,
}

/// Lowest and highest corner of where the beam is on along paths, mm.
pub(crate) fn extent<'a>(paths: impl Iterator<Item = &'a BeamPath>) -> [[f64; 2]; 2] {
    let mut corners = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for w in paths
        .flat_map(|p| p.points().windows(2))
        .filter(|w| w[0].is_on())
    {
        for p in w {
            for (a, x) in [p.x, p.y].into_iter().enumerate() {
                corners[0][a] = corners[0][a].min(x);
                corners[1][a] = corners[1][a].max(x);
            }
        }
    }
    corners
}

/// A solver that waits for the last layer's path.
#[derive(Debug, Clone)]
pub struct Bed {
    /// The solver.
    pub solver: Solver<f32>,
    /// The beam, with the power of the resolution.
    pub beam: Beam,
    /// Longest step that is stable and no longer than asked, s.
    pub step: f64,
}

/// Heights of planes of cells, bottom first: `height` each in whole layers down to 0.2 mm, then growing to `depth` mm.
///
/// ```
/// let heights = meltpath_melt_strategy::bed::planes(0.05, 0.05, 0.5);
/// assert!((heights.iter().sum::<f64>() - 0.5).abs() < 1e-12);
/// assert_eq!(heights.last(), Some(&0.05));
/// assert!(heights.len() < 8);
/// ```
pub fn planes(layer: f64, height: f64, depth: f64) -> Vec<f64> {
    let even = ((EVEN / layer).ceil() * layer).min(depth);
    let mut heights = vec![height; (even / height).round().max(1.0) as usize];
    let rest = depth - even;
    if rest > 1e-9 {
        // as few planes as the growth allows, all in one ratio
        let sum = |ratio: f64, n: i32| (1..=n).map(|k| ratio.powi(k)).sum::<f64>() * height;
        let mut count = 1;
        while sum(GROWTH, count) < rest {
            count += 1;
        }
        let (mut low, mut high) = (0.5, GROWTH);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if sum(middle, count) < rest {
                low = middle;
            } else {
                high = middle;
            }
        }
        heights.extend((1..=count).map(|k| height * high.powi(k)));
    }
    heights.reverse();
    heights
}

impl Body<'_> {
    /// A bed with room for `around`, on which `lower` layers are drawn, each on fresh powder from the start temperature.
    ///
    /// # Errors
    /// [`SolverError`].
    pub fn bed(
        &self,
        around: &[&BeamPath],
        lower: &[BeamPath],
        resolution: &Resolution,
        observer: &dyn Observer,
    ) -> Result<Bed, SolverError> {
        let paths = around.iter().copied().chain(lower);
        let [low, high] = extent(paths).map(|[x, y]| DVec3::new(x, y, 0.0));
        let Domain { below, beside } = resolution.domain;
        let margin = DVec3::new(beside, beside, 0.0);
        let height = self.layer / f64::from(resolution.planes.max(1));
        // whole layers, so that the powder of the first one ends on a plane of cells
        let depth = ((below / self.layer - 1e-6).ceil() * self.layer).max(self.layer);
        let edge = DVec3::new(resolution.cell, resolution.cell, height);
        let mut grid = Grid::covering((low - margin).with_z(-depth), high + margin, edge)?;
        grid.heights = planes(self.layer, height, depth);
        let faces = Faces {
            top: self.surface,
            sides: self.beyond,
            bottom: self.beyond,
        };
        let mut solver = Solver::<f32>::new(grid, self.material.clone(), faces)?;
        solver.set_state(|c| {
            if c.z > -self.layer {
                State::Powder
            } else {
                (self.ground)([c.x, c.y])
            }
        });
        let beam = Beam {
            efficiency: self.beam.efficiency * resolution.power,
            ..*self.beam
        };
        let step = resolution.step.min(solver.stable_step());
        solver.let_rows_sleep(TOLERANCE);
        for path in lower {
            draw(&mut solver, path, &beam, step, &mut [], observer)?;
            solver.add_layer(self.layer)?;
            solver.freeze_below(depth);
        }
        Ok(Bed { solver, beam, step })
    }
}

#[cfg(test)]
mod tests {
    use super::planes;
    use proptest::prelude::*;

    proptest! {
        /// Planes fill the depth, even ones are whole layers, and no plane is much higher than the one above it.
        #[test]
        fn planes_fill_the_depth(layer in 0.02..0.15_f64, parts in 1..5_u32, layers in 1..20_u32) {
            let depth = layer * f64::from(layers);
            let height = layer / f64::from(parts);
            let heights = planes(layer, height, depth);
            prop_assert!((heights.iter().sum::<f64>() - depth).abs() < 1e-9);
            for pair in heights.windows(2) {
                prop_assert!(pair[0] > 0.99 * pair[1] && pair[0] < 1.51 * pair[1], "{:?}", heights);
            }
        }
    }
}
