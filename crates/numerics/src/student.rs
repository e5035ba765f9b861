//! Student's distribution and those of sums of few squares: what chance makes of means and misses whose noise is estimated from few data.
//!
//! M. Abramowitz, I. A. Stegun, "Handbook of Mathematical Functions" (1964), 26.7.3 and 26.7.4; closed sums for whole degrees of freedom.

use std::f64::consts::FRAC_PI_2;

/// Share of values that lie within one standard deviation of a normal distribution.
pub const ONE_SIGMA: f64 = 0.682_689_492_137_085_9;

/// Chance that a value of Student's t with `freedom` degrees of freedom lies farther from zero than `t`, to either side; 1 with none.
///
/// ```
/// use meltpath_numerics::student::beyond;
/// assert!((beyond(12.706, 1) - 0.05).abs() < 1e-5 && (beyond(2.228, 10) - 0.05).abs() < 1e-4);
/// ```
pub fn beyond(t: f64, freedom: usize) -> f64 {
    if freedom == 0 {
        return 1.0;
    }
    let n = freedom as f64;
    let angle = (t.abs() / n.sqrt()).atan();
    let (sin, square) = (angle.sin(), angle.cos().powi(2));
    let odd = freedom % 2 == 1;
    // both sums run over every second whole number below the degrees of freedom
    let mut term = if odd { angle.cos() } else { 1.0 };
    let mut sum = 0.0;
    let mut k = usize::from(odd);
    while k + 2 <= freedom {
        sum += term;
        term *= square * (k + 1) as f64 / (k + 2) as f64;
        k += 2;
    }
    let within = if odd {
        (angle + sin * sum) / FRAC_PI_2
    } else {
        sin * sum
    };
    (1.0 - within).clamp(0.0, 1.0)
}

/// How far from zero, to either side, a `share` of the values of Student's t with `freedom` degrees of freedom lies; infinite with none.
///
/// ```
/// use meltpath_numerics::student::{ONE_SIGMA, within};
/// assert!((within(0.95, 2) - 4.3027).abs() < 1e-3 && (within(ONE_SIGMA, 1) - 1.8373).abs() < 1e-3);
/// assert!((within(0.95, 1_000) - 1.962).abs() < 1e-3 && within(0.95, 0).is_infinite());
/// ```
pub fn within(share: f64, freedom: usize) -> f64 {
    if freedom == 0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, 1.0);
    while beyond(high, freedom) > 1.0 - share && high < 1e12 {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if beyond(middle, freedom) > 1.0 - share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Chance that noise alone lets `more` further unknowns take as much off a sum of squares, as `ratio` tells: what they took off, each, over
/// what they leave for each of `freedom` degrees of freedom (Fisher's F). One or two unknowns; 1 with no freedom.
///
/// ```
/// use meltpath_numerics::student::{Unknowns, as_much_by_chance};
/// // the tables' 5 % points
/// assert!((as_much_by_chance(4.9646, Unknowns::One, 10) - 0.05).abs() < 1e-4);
/// assert!((as_much_by_chance(4.1028, Unknowns::Two, 10) - 0.05).abs() < 1e-4);
/// ```
pub fn as_much_by_chance(ratio: f64, more: Unknowns, freedom: usize) -> f64 {
    match more {
        _ if freedom == 0 => 1.0,
        Unknowns::One => beyond(ratio.max(0.0).sqrt(), freedom),
        Unknowns::Two => {
            let n = freedom as f64;
            (1.0 + 2.0 * ratio.max(0.0) / n).powf(-0.5 * n)
        }
    }
}

/// How many unknowns are tried beside those of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknowns {
    /// One.
    One,
    /// Two.
    Two,
}

impl Unknowns {
    /// Their number.
    pub fn number(self) -> usize {
        match self {
            Unknowns::One => 1,
            Unknowns::Two => 2,
        }
    }
}
