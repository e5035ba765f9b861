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

/// A grid (rad/s, ascending) that resolves every root of a continuous system: `per_decade` points a decade from a tenth of
/// the slowest root to ten times the fastest, and a cluster as wide as the resonance round every lightly damped root.
pub fn round_roots(roots: &[Complex64], per_decade: usize) -> Vec<f64> {
    let sizes = roots.iter().map(|r| r.norm()).filter(|&r| r > 0.0);
    let (low, high) = sizes.fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(r), h.max(r)));
    let (low, high) = if high > 0.0 {
        (low / 10.0, high * 10.0)
    } else {
        (0.01, 100.0)
    };
    let decades = (high / low).log10();
    let mut grid = logarithmic(low, high, (decades * per_decade as f64).ceil() as usize + 2);
    for root in roots {
        let (width, centre) = (root.re.abs(), root.im.abs());
        if centre > 0.0 && width < 0.5 * centre {
            // the peak of |1/(s − p)| lies at the centre; its flanks are resolved geometrically
            let mut offset = 0.02 * width.max(1e-6 * centre);
            grid.push(centre);
            while offset < 0.3 * centre {
                grid.push(centre - offset);
                grid.push(centre + offset);
                offset *= 1.25;
            }
        }
    }
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resonances_are_resolved() {
        let grid = round_roots(
            &[
                Complex64::new(-1.0, 1e4),
                Complex64::new(-1.0, -1e4),
                Complex64::new(-5.0, 0.0),
            ],
            30,
        );
        assert!(grid.is_sorted());
        assert!(grid.iter().filter(|&&w| (w - 1e4).abs() < 1.0).count() > 10);
        assert!(grid[0] <= 0.5 && *grid.last().unwrap() >= 1e5);
    }
}
