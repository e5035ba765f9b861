//! Stability margins of a single loop: gain, phase, delay and modulus, from its open-loop response.
//!
//! The response may hold anything a frequency response can (exact delays, smoothers, measured points), so margins are
//! found on a grid and refined between its points.

use meltpath_numerics::{golden, halving};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// A margin at the frequency where it is read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MarginAt {
    /// The margin: a factor (gain, modulus) or an angle (rad).
    pub value: f64,
    /// Frequency (rad/s).
    pub omega: f64,
}

/// The margins of an open loop L in negative feedback.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// Every crossing of the negative real axis: the factor on the gain that puts the loop on the critical point.
    pub gain: Vec<MarginAt>,
    /// Every crossing of unit gain: the phase arg L + π, in −π..π (rad).
    pub phase: Vec<MarginAt>,
    /// The smallest delay (s) that takes a phase margin away, and its crossing (rad/s); none without a crossing.
    pub delay: Option<MarginAt>,
    /// Smallest distance to the critical point, min |1 + L| (1 over the peak of the sensitivity).
    pub modulus: MarginAt,
}

impl Margins {
    /// The margins of the loop `response` (open loop at ω in rad/s), seen on an ascending grid.
    ///
    /// ```
    /// use meltpath_control::{frequency, margins::Margins, TransferFunction};
    /// let l = TransferFunction::new([1.0], [1.0, 2.0, 1.0, 0.0]).unwrap(); // 1/(s(s+1)²)
    /// let m = Margins::of(|w| l.response(w), &frequency::logarithmic(0.01, 100.0, 400));
    /// assert!((m.gain[0].value - 2.0).abs() < 1e-9);
    /// assert!((m.phase[0].value.to_degrees() - 21.386).abs() < 1e-3);
    /// ```
    pub fn of(response: impl Fn(f64) -> Complex64, grid: &[f64]) -> Self {
        let values: Vec<Complex64> = grid.iter().map(|&w| response(w)).collect();
        let mut gain = Vec::new();
        let mut phase = Vec::new();
        for k in 1..grid.len() {
            let (w0, w1) = (grid[k - 1], grid[k]);
            let (z0, z1) = (values[k - 1], values[k]);
            if (z0.norm() >= 1.0) != (z1.norm() >= 1.0) {
                let omega = cross(|w| response(w).norm() - 1.0, w0, w1);
                let angle = (-response(omega)).arg();
                phase.push(MarginAt {
                    value: angle,
                    omega,
                });
            }
            // a change of sign on the left half only: the right half crosses the positive axis
            if (z0.im >= 0.0) != (z1.im >= 0.0) && z0.re.min(z1.re) < 0.0 {
                let omega = cross(|w| response(w).im, w0, w1);
                let real = response(omega).re;
                if real < 0.0 {
                    gain.push(MarginAt {
                        value: -1.0 / real,
                        omega,
                    });
                }
            }
        }
        let delay = phase
            .iter()
            .map(|m| {
                let angle = if m.value >= 0.0 {
                    m.value
                } else {
                    m.value + std::f64::consts::TAU
                };
                MarginAt {
                    value: angle / m.omega,
                    omega: m.omega,
                }
            })
            .min_by(|a, b| a.value.total_cmp(&b.value));
        let modulus = lowest(|w| (1.0 + response(w)).norm(), grid);
        Margins {
            gain,
            phase,
            delay,
            modulus,
        }
    }
}

/// The −3 dB bandwidth (rad/s): the first frequency of the grid, refined, at which the gain falls below its value at the
/// first point of the grid over √2; none when it does not.
pub fn bandwidth(response: impl Fn(f64) -> Complex64, grid: &[f64]) -> Option<f64> {
    let limit = response(*grid.first()?).norm() / std::f64::consts::SQRT_2;
    let k = grid.iter().position(|&w| response(w).norm() < limit)?;
    Some(cross(|w| response(w).norm() - limit, grid[k - 1], grid[k]))
}

/// Narrowings about a minimum on the grid: to 1e-9 of where it lies.
const TIMES: u32 = 44;

/// The lowest value of a positive function on a grid, refined by golden section about each local minimum.
pub fn lowest(f: impl Fn(f64) -> f64, grid: &[f64]) -> MarginAt {
    let values: Vec<f64> = grid.iter().map(|&w| f(w)).collect();
    let mut best = MarginAt {
        value: f64::INFINITY,
        omega: 0.0,
    };
    for k in 0..grid.len() {
        let left = k.saturating_sub(1);
        let right = (k + 1).min(grid.len() - 1);
        if values[k] > values[left] || values[k] > values[right] {
            continue;
        }
        let [omega, value] = golden::least([grid[left], grid[right]], TIMES, &f);
        let found = MarginAt { value, omega };
        for candidate in [
            found,
            MarginAt {
                value: values[k],
                omega: grid[k],
            },
        ] {
            if candidate.value < best.value {
                best = candidate;
            }
        }
    }
    best
}

/// Where a function that changes sign between two points is zero.
fn cross(f: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let positive = f(low) >= 0.0;
    halving::root([low, high], 100, |x| (f(x) >= 0.0) != positive)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TransferFunction, frequency};

    #[test]
    fn a_delay_takes_the_phase_margin() {
        let l = TransferFunction::new([10.0], [1.0, 0.0]).unwrap();
        let grid = frequency::logarithmic(0.1, 1000.0, 300);
        let m = Margins::of(|w| l.response(w), &grid);
        assert!((m.delay.unwrap().value - std::f64::consts::FRAC_PI_2 / 10.0).abs() < 1e-12);
        assert!(m.gain.is_empty());
        let late = l.delayed(0.05).unwrap();
        let m = Margins::of(|w| late.response(w), &grid);
        assert!((m.phase[0].value - (std::f64::consts::FRAC_PI_2 - 0.5)).abs() < 1e-12);
        assert!((m.gain[0].omega - std::f64::consts::FRAC_PI_2 / 0.05).abs() < 1e-9);
        assert!(m.gain[0].value > 3.1 && m.modulus.value < 0.8);
    }

    #[test]
    fn bandwidth_of_a_first_order_lag() {
        let g = TransferFunction::new([7.0], [1.0, 7.0]).unwrap();
        let w = bandwidth(|w| g.response(w), &frequency::logarithmic(1e-4, 100.0, 200)).unwrap();
        assert!((w - 7.0).abs() < 1e-6);
    }
}
