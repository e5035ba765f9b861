//! What the highest temperature of a point says about the metal there, and how much of a region meets the aim.
//!
//! Béraud 2016, section 3.3.2.1: compared with tomography, the highest temperature tells melted from porous from good from
//! overheated metal; the time above a temperature does not. The thesis' limits lie on the scale of its own simulator:
//! calibrate them for another (erratum E10), see [`Classes::calibrated`].

pub mod as_built;

use crate::grid::Field;

/// What a point becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Powder remains.
    Unmelted,
    /// Molten, not hot enough for the gaps to fill.
    Porous,
    /// Few pores, true shape.
    Good,
    /// Few pores, upper surface out of shape.
    Overheated,
}

/// Highest temperatures between which a class lies, K.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Classes {
    /// Melting, K.
    pub melting: f64,
    /// Window of good metal, K.
    pub window: [f64; 2],
}

impl Classes {
    /// Limits for another simulator: the window of the thesis' width round what that simulator computes where the metal
    /// is known to be good, K.
    ///
    /// ```
    /// use meltpath_thermal::criteria::Classes;
    /// let ours = Classes::calibrated(1938.15, 3200.0, 60.0);
    /// assert_eq!(ours.window, [3170.0, 3230.0]);
    /// ```
    pub fn calibrated(melting: f64, good: f64, width: f64) -> Self {
        Classes {
            melting,
            window: [good - 0.5 * width, good + 0.5 * width],
        }
    }

    /// The class of a point whose highest temperature is `highest` K.
    pub fn of(&self, highest: f64) -> Class {
        if highest < self.melting {
            Class::Unmelted
        } else if highest < self.window[0] {
            Class::Porous
        } else if highest <= self.window[1] {
            Class::Good
        } else {
            Class::Overheated
        }
    }
}

/// Highest temperatures of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// Voxels in the region.
    pub voxels: usize,
    /// Voxels of each class: unmelted, porous, good, overheated.
    pub counts: [usize; 4],
    /// Mean highest temperature of the molten ones, K.
    pub mean: f64,
    /// Standard deviation of the molten ones, K.
    pub deviation: f64,
    /// The hottest, K, and its cell.
    pub hottest: (f64, [usize; 3]),
}

impl Tally {
    /// Counts the voxels of `highest` in the cells that `region` names.
    pub fn of(highest: &Field, classes: &Classes, region: impl Fn([usize; 3]) -> bool) -> Self {
        let mut tally = Tally {
            voxels: 0,
            counts: [0; 4],
            mean: 0.0,
            deviation: 0.0,
            hottest: (f64::NEG_INFINITY, [0; 3]),
        };
        let mut squares = 0.0;
        each(highest, |cell, kelvin| {
            if !region(cell) {
                return;
            }
            tally.voxels += 1;
            let class = classes.of(kelvin);
            tally.counts[class as usize] += 1;
            if class != Class::Unmelted {
                tally.mean += kelvin;
                squares += kelvin * kelvin;
            }
            if kelvin > tally.hottest.0 {
                tally.hottest = (kelvin, cell);
            }
        });
        let molten = tally.molten() as f64;
        tally.mean /= molten;
        tally.deviation = (squares / molten - tally.mean * tally.mean).max(0.0).sqrt();
        tally
    }

    /// With so many more voxels that stay powder.
    #[must_use]
    pub fn with_powder(mut self, voxels: usize) -> Self {
        self.voxels += voxels;
        self.counts[Class::Unmelted as usize] += voxels;
        self
    }

    /// Voxels that melted.
    pub fn molten(&self) -> usize {
        self.counts[1..].iter().sum()
    }

    /// Share of the molten voxels in a class; 0 where nothing melted.
    pub fn share(&self, class: Class) -> f64 {
        self.counts[class as usize] as f64 / (self.molten() as f64).max(1.0)
    }
}

/// A histogram of highest temperatures over a region: for each bin its lower limit (K) and its voxels.
pub fn histogram(
    highest: &Field,
    width: f64,
    region: impl Fn([usize; 3]) -> bool,
) -> Vec<(f64, usize)> {
    let mut bins: std::collections::BTreeMap<i64, usize> = std::collections::BTreeMap::new();
    each(highest, |cell, kelvin| {
        if region(cell) && kelvin.is_finite() {
            *bins.entry((kelvin / width).floor() as i64).or_default() += 1;
        }
    });
    bins.into_iter()
        .map(|(n, count)| (n as f64 * width, count))
        .collect()
}

fn each(field: &Field, mut see: impl FnMut([usize; 3], f64)) {
    let [nx, ny] = field.grid.cells;
    for (n, value) in field.values.iter().enumerate() {
        see([n % nx, n / nx % ny, n / (nx * ny)], f64::from(*value));
    }
}

/// Temperature gradient at solidification, K/mm, from when each voxel froze (`fell`, s) and how fast (`rate`, K/s): the
/// front passes with the speed `1/|∇fell|`, so the gradient is `rate · |∇fell|`. NaN where a voxel or all its neighbours
/// along an axis did not freeze.
pub fn gradient(fell: &Field, rate: &Field) -> Field {
    let slow = slowness(fell);
    let values = slow.iter().zip(&rate.values);
    Field {
        grid: fell.grid.clone(),
        values: values.map(|(s, r)| (f64::from(*r) * s) as f32).collect(),
    }
}

/// Speed of the front at solidification, mm/s: `1/|∇fell|`, along its normal. Not a number where [`gradient`] is none, and where a
/// voxel froze at the same time as those around it.
pub fn front_speed(fell: &Field) -> Field {
    let speed = |slow: f64| if slow > 0.0 { 1.0 / slow } else { f64::NAN };
    Field {
        grid: fell.grid.clone(),
        values: slowness(fell).iter().map(|s| speed(*s) as f32).collect(),
    }
}

/// `|∇fell|`, s/mm.
fn slowness(fell: &Field) -> Vec<f64> {
    let grid = &fell.grid;
    let [nx, ny] = grid.cells;
    let nz = grid.planes();
    let at = |i: usize, j: usize, k: usize| fell.at(i, j, k);
    // central where both neighbours froze, one-sided at rims
    let slope = |before: Option<f64>, here: f64, after: Option<f64>, edge: f64| {
        let known = |v: Option<f64>| v.filter(|v| v.is_finite());
        match (known(before), known(after)) {
            (Some(a), Some(b)) => (b - a) / (2.0 * edge),
            (Some(a), None) => (here - a) / edge,
            (None, Some(b)) => (b - here) / edge,
            (None, None) => f64::NAN,
        }
    };
    (0..fell.values.len())
        .map(|n| {
            let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
            let here = at(i, j, k);
            let x = slope(
                (i > 0).then(|| at(i - 1, j, k)),
                here,
                (i + 1 < nx).then(|| at(i + 1, j, k)),
                grid.edge[0],
            );
            let y = slope(
                (j > 0).then(|| at(i, j - 1, k)),
                here,
                (j + 1 < ny).then(|| at(i, j + 1, k)),
                grid.edge[1],
            );
            let z = slope(
                (k > 0).then(|| at(i, j, k - 1)),
                here,
                (k + 1 < nz).then(|| at(i, j, k + 1)),
                grid.heights[k],
            );
            // a single molten plane has no neighbour along z: the front then runs in the plane
            let z = if z.is_nan() { 0.0 } else { z };
            (x * x + y * y + z * z).sqrt()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::material::CELSIUS;
    use meltpath_geometry::math::DVec3;

    /// The thesis' limits.
    const THESIS: Classes = Classes {
        melting: 1665.0 + CELSIUS,
        window: [2700.0 + CELSIUS, 2760.0 + CELSIUS],
    };

    fn field(value: impl Fn(usize, usize, usize) -> f64) -> Field {
        let grid =
            Grid::covering(DVec3::ZERO, DVec3::new(0.5, 0.4, 0.3), DVec3::splat(0.1)).unwrap();
        let [nx, ny] = grid.cells;
        let values = (0..grid.len())
            .map(|n| value(n % nx, n / nx % ny, n / (nx * ny)) as f32)
            .collect();
        Field { grid, values }
    }

    #[test]
    fn ebm_a14_classes() {
        let class = |celsius: f64| THESIS.of(celsius + CELSIUS);
        assert_eq!(class(1600.0), Class::Unmelted);
        assert_eq!(class(2000.0), Class::Porous);
        assert_eq!(class(2730.0), Class::Good);
        assert_eq!(class(2800.0), Class::Overheated);
    }

    #[test]
    fn a_tally_counts_its_region_only() {
        let celsius = [1000.0, 2000.0, 2710.0, 2730.0, 2900.0];
        let field = field(|i, _, _| celsius[i] + CELSIUS);
        let tally = Tally::of(&field, &THESIS, |c| c[2] == 2);
        assert_eq!((tally.voxels, tally.counts), (20, [4, 4, 8, 4]));
        assert!((tally.share(Class::Good) - 0.5).abs() < 1e-12);
        assert!((tally.mean - CELSIUS - 2585.0).abs() < 1e-2);
        assert_eq!(tally.hottest.1[0], 4);
        let bins = histogram(&field, 100.0, |c| c[2] == 2);
        assert_eq!(bins.iter().map(|b| b.1).sum::<usize>(), 20);
    }

    #[test]
    fn the_gradient_is_that_of_a_moving_field() {
        // T = T0 − G (v t − x) passes a level at t = x/v with the rate G v: here G = 500 K/mm, v = 200 mm/s
        let fell = field(|i, _, _| 0.1 * i as f64 / 200.0);
        let rate = field(|_, _, _| 500.0 * 200.0);
        for value in gradient(&fell, &rate).values {
            assert!((value - 500.0).abs() < 1e-1, "{value}");
        }
        for value in front_speed(&fell).values {
            assert!((value - 200.0).abs() < 1e-1, "{value}");
        }
        // what freezes all at once has no front
        let still = front_speed(&field(|_, _, _| 0.5));
        assert!(still.values.iter().all(|v| v.is_nan()));
    }
}
