//! Frequencies at which a response is worth looking at, and points of a measured one.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// One measured point of a response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Frequency (rad/s).
    pub omega: f64,
    /// The response there.
    pub response: Complex64,
    /// Weight of its squared error.
    pub weight: f64,
}

/// `count` frequencies (rad/s) from `from` to `to`, evenly spread in logarithm, both ends included.
///
/// ```
/// let grid = meltpath_control::frequency::logarithmic(1.0, 100.0, 3);
/// assert!((grid[1] - 10.0).abs() < 1e-12);
/// ```
pub fn logarithmic(from: f64, to: f64, count: usize) -> Vec<f64> {
    let steps = count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|k| match k {
            0 => from,
            _ if k + 1 == count => to,
            _ => from * (to / from).powf(k as f64 / steps),
        })
        .collect()
}
