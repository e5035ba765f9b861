//! The beam as a heat source, integrated exactly over cells, so that no energy is lost on a coarse grid.
//!
//! Béraud 2016, eqs. 3.2.1-2: `S = f(z) · 8 η U I/(π φ²) · exp(−8 r²/φ²)`, in W/m³ (printed J/m³, erratum E3).

use serde::{Deserialize, Serialize};

use crate::grid::Grid;

/// How the heat is spread below the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Depth {
    /// `f(z) = 2/d (1 − z/d)` down to `d` mm: electrons (Béraud 2016, eq. 3.2.2).
    Falling {
        /// Penetration `d`, mm.
        penetration: f64,
    },
    /// All on the surface: in the top cells.
    Surface,
    /// Evenly down to a depth, mm.
    Even {
        /// The depth, mm.
        depth: f64,
    },
}

impl Depth {
    /// Share of the heat above `depth` mm.
    ///
    /// ```
    /// use meltpath_thermal::solver::source::Depth;
    /// let electrons = Depth::Falling { penetration: 0.1 };
    /// assert_eq!(electrons.share_above(0.05), 0.75);
    /// assert_eq!(electrons.share_above(0.2), 1.0);
    /// ```
    pub fn share_above(&self, depth: f64) -> f64 {
        match *self {
            Depth::Falling { penetration } => {
                let s = (depth / penetration).clamp(0.0, 1.0);
                s * (2.0 - s)
            }
            Depth::Surface => f64::from(depth > 0.0),
            Depth::Even { depth: whole } => (depth / whole).clamp(0.0, 1.0),
        }
    }
}

impl Depth {
    /// How much hotter the build plane is than the mean of the `height` mm below it, per heat that arrives on an area and over the
    /// conductivity, mm: the flux below `z` is what arrives above it less what the cell stores, evenly, so that with `F` as
    /// [`Depth::share_above`]
    ///
    /// `T_s − T̄ = (I/k)·(1/h ∫₀ʰ (h − z) F dz − F(h) h/6) + q h/(6 k)`,
    ///
    /// where `q` leaves the cell downwards; what this returns is the first bracket. Steady within the cell: right where heat crosses it
    /// (`h²/π²α`, 30 µs for 50 µm of molten titanium) sooner than the beam.
    ///
    /// ```
    /// use meltpath_thermal::solver::source::Depth;
    /// // all on the surface: a third here, and with q = I the sixth that is left of half a cell of conduction
    /// assert!((Depth::Surface.lift(0.05) - 0.05 / 3.0).abs() < 1e-12);
    /// // electrons that go deeper than the cell heat its middle as well
    /// assert!(Depth::Falling { penetration: 0.1 }.lift(0.05) < 0.3 * Depth::Surface.lift(0.05));
    /// ```
    pub fn lift(&self, height: f64) -> f64 {
        let h = height;
        let mean = match *self {
            Depth::Surface => 0.5 * h,
            Depth::Falling { penetration: d } if h <= d => h * h / d * (1.0 / 3.0 - h / (12.0 * d)),
            Depth::Falling { penetration: d } => 0.5 * h - d / 3.0 + d * d / (12.0 * h),
            Depth::Even { depth: d } if h <= d => h * h / (6.0 * d),
            Depth::Even { depth: d } => 0.5 * (h - d) + d * d / (6.0 * h),
        };
        mean - self.share_above(h) * h / 6.0
    }
}

/// A beam at rest on the build plane during a time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Where, mm.
    pub centre: [f64; 2],
    /// Diameter φ where the intensity has fallen to 1/e², mm.
    pub diameter: f64,
    /// Heat that enters the metal, W: `η U I`.
    pub power: f64,
    /// How it is spread below the surface.
    pub depth: Depth,
}

/// What share of a spot's power each cell takes: the product of one share along x, one along y and one along depth.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Footprint {
    /// First cell along x and y.
    pub(crate) first: [usize; 2],
    /// Shares along x and y.
    pub(crate) across: [Vec<f64>; 2],
    /// Shares along depth, one per plane of cells, bottom first.
    pub(crate) along: Vec<f64>,
}

/// How far from the centre a Gaussian is followed, in diameters: 1e-10 of its power lies outside.
const REACH: f64 = 1.7;

/// Shares of a Gaussian of 1/e² diameter `diameter` centred on `centre` in the cells of `edge` from `origin`.
fn gaussian_shares(
    origin: f64,
    edge: f64,
    cells: usize,
    centre: f64,
    diameter: f64,
) -> (usize, Vec<f64>) {
    let index = |x: f64| ((x - origin) / edge).floor().clamp(0.0, cells as f64) as usize;
    let first = index(centre - REACH * diameter);
    let end = (index(centre + REACH * diameter) + 1).min(cells);
    let scale = 8.0_f64.sqrt() / diameter;
    let edge_value = |i: usize| libm::erf(scale * (origin + i as f64 * edge - centre));
    let mut left = edge_value(first);
    let shares = (first..end)
        .map(|i| {
            let right = edge_value(i + 1);
            let share = 0.5 * (right - left);
            left = right;
            share
        })
        .collect();
    (first, shares)
}

impl Spot {
    /// Shares of the spot's power in the cells of `grid`; they sum to less than 1 where the beam leaves the grid.
    pub(crate) fn footprint(&self, grid: &Grid, depths: &[f64]) -> Footprint {
        let [nx, ny] = grid.cells;
        let (i0, sx) = gaussian_shares(
            grid.origin.x,
            grid.edge[0],
            nx,
            self.centre[0],
            self.diameter,
        );
        let (j0, sy) = gaussian_shares(
            grid.origin.y,
            grid.edge[1],
            ny,
            self.centre[1],
            self.diameter,
        );
        Footprint {
            first: [i0, j0],
            across: [sx, sy],
            along: self.depth_shares(&grid.heights, depths),
        }
    }

    /// How far from its centre a spot is followed, mm.
    pub(crate) fn reach(&self) -> f64 {
        REACH * self.diameter
    }

    /// Shares in planes of these heights whose tops lie at these depths, mm.
    pub(crate) fn depth_shares(&self, heights: &[f64], depths: &[f64]) -> Vec<f64> {
        heights
            .iter()
            .zip(depths)
            .map(|(h, d)| self.depth.share_above(d + h) - self.depth.share_above(*d))
            .collect()
    }
}

impl Footprint {
    /// Share of the power that falls on the grid.
    pub(crate) fn total(&self) -> f64 {
        self.across[0].iter().sum::<f64>()
            * self.across[1].iter().sum::<f64>()
            * self.along.iter().sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use proptest::prelude::*;

    proptest! {
        /// The closed forms are the integral that they stand for.
        #[test]
        fn the_lift_of_the_surface_is_its_integral(height in 0.005..0.2_f64, deep in 0.005..0.2_f64) {
            for depth in [Depth::Falling { penetration: deep }, Depth::Even { depth: deep }, Depth::Surface] {
                let n = 4000;
                let dz = height / f64::from(n);
                let part = |i: i32| {
                    let z = (f64::from(i) + 0.5) * dz;
                    (height - z) * depth.share_above(z) * dz
                };
                let mean = (0..n).map(part).sum::<f64>() / height;
                let lift = mean - depth.share_above(height) * height / 6.0;
                prop_assert!((depth.lift(height) - lift).abs() < 1e-3 * height, "{:?} {}", depth, height);
            }
        }

        #[test]
        fn ebm_a02_all_the_power_arrives_on_any_grid(
            edge in 0.005..0.06_f64, height in 0.005..0.06_f64, diameter in 0.2..0.9_f64, x in -0.3..0.3_f64, y in -0.3..0.3_f64,
        ) {
            let low = DVec3::new(-2.0, -2.0, -0.3);
            let grid = Grid::covering(low, DVec3::new(2.0, 2.0, 0.0), DVec3::new(edge, edge, height)).unwrap();
            let power = 0.9 * 60e3 * 2e-3;
            prop_assert!((power - 108.0_f64).abs() < 1e-9);
            let spot = Spot { centre: [x, y], diameter, power, depth: Depth::Falling { penetration: 0.1 } };
            let total = power * spot.footprint(&grid, &grid.depths()).total();
            prop_assert!((total / 108.0 - 1.0).abs() < 1e-3);
        }
    }
}
