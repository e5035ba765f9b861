//! The pre-filter of an axis: speed limit, then two moving averages that bound acceleration and jerk; or a kernel that
//! also cancels a damped mode.
//!
//! Sources: Rasoanarivo 2020, fig. 2.27; L. Biagiotti, C. Melchiorri, "FIR filters for online trajectory planning", Control
//! Engineering Practice 20 (2012); R. Béarée, "New damped-jerk trajectory for vibration reduction", ibid. 28 (2014).

use meltpath_control::Complex64;
use serde::{Deserialize, Serialize};

use meltpath_numerics::moving_average::MovingAverage;

use crate::axis::error::{AxisError, not_negative, positive};

/// The second moving average.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Kernel {
    /// Constant over a length, s: T_j = Acc_max/Jerk_max; no gain at the multiples of 1/T_j.
    Box(f64),
    /// Linear in time, made for the mode (ω, ξ): close to no gain at the mode's damped pole.
    DampedJerk {
        /// ω, rad/s.
        omega: f64,
        /// ξ, below 1.
        damping: f64,
    },
    /// Exponential, made for the mode (ω, ξ): no gain at all at its damped pole.
    Exponential {
        /// ω, rad/s.
        omega: f64,
        /// ξ, below 1.
        damping: f64,
    },
    /// Linear, h(t) = (1 − b t/T)/(T (1 − b/2)), with its own length and slope.
    Linear {
        /// T, s.
        length: f64,
        /// b.
        slope: f64,
    },
}

impl Kernel {
    /// Checks every parameter.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn check(&self) -> Result<(), AxisError> {
        match *self {
            Kernel::Box(length) => positive("the second filter's length", length),
            Kernel::DampedJerk { omega, damping } | Kernel::Exponential { omega, damping } => {
                positive("the mode's pulsation", omega)?;
                if (0.0..1.0).contains(&damping) {
                    Ok(())
                } else {
                    Err(AxisError::Parameter {
                        what: "the mode's damping",
                        value: damping,
                        wanted: "0 to 1",
                    })
                }
            }
            Kernel::Linear { length, slope } => {
                positive("the second filter's length", length)?;
                if slope < 2.0 && slope.is_finite() {
                    Ok(())
                } else {
                    Err(AxisError::Parameter {
                        what: "the kernel's slope",
                        value: slope,
                        wanted: "below 2",
                    })
                }
            }
        }
    }

    /// Length, s.
    pub fn length(&self) -> f64 {
        match *self {
            Kernel::Box(length) | Kernel::Linear { length, .. } => length,
            Kernel::DampedJerk { omega, damping } | Kernel::Exponential { omega, damping } => {
                std::f64::consts::TAU / (omega * (1.0 - damping * damping).sqrt())
            }
        }
    }

    /// Length and slope of a linear kernel.
    fn linear(&self) -> Option<(f64, f64)> {
        match *self {
            Kernel::Box(length) => Some((length, 0.0)),
            Kernel::Linear { length, slope } => Some((length, slope)),
            Kernel::DampedJerk { omega, damping } => {
                let length = self.length();
                Some((length, 1.0 - (-damping * omega * length).exp()))
            }
            Kernel::Exponential { .. } => None,
        }
    }

    /// The share of the kernel that lies before time `t` s: its integral from 0.
    pub fn share(&self, t: f64) -> f64 {
        let u = (t / self.length()).clamp(0.0, 1.0);
        match *self {
            Kernel::Exponential { omega, damping } if damping > 0.0 => {
                let whole = damping * omega * self.length();
                (-(-whole * u).exp_m1()) / (-(-whole).exp_m1())
            }
            Kernel::Exponential { .. } => u,
            _ => {
                let slope = self.linear().map_or(0.0, |l| l.1);
                (u - 0.5 * slope * u * u) / (1.0 - 0.5 * slope)
            }
        }
    }

    /// Mean delay, s.
    pub fn delay(&self) -> f64 {
        let n = 2000;
        let length = self.length();
        // mean of t = ∫ (1 − share) dt
        (0..n)
            .map(|k| {
                (1.0 - self.share((f64::from(k) + 0.5) / f64::from(n) * length)) * length
                    / f64::from(n)
            })
            .sum()
    }

    /// The response H(s) of the continuous kernel, gain 1 at rest.
    pub fn response(&self, s: Complex64) -> Complex64 {
        let t = self.length();
        let one = Complex64::new(1.0, 0.0);
        if let Kernel::Exponential { omega, damping } = *self
            && damping > 0.0
        {
            let sigma = damping * omega;
            let p = s + sigma;
            let whole = -(-sigma * t).exp_m1();
            if (p * t).norm() < 1e-8 {
                return sigma * t * one / whole;
            }
            return sigma / p * (one - (-p * t).exp()) / whole;
        }
        let slope = self.linear().map_or(0.0, |l| l.1);
        let x = s * t;
        if x.norm() < 1e-6 {
            return one;
        }
        let e = (-x).exp();
        // ∫ e^{-xu} du and ∫ u e^{-xu} du over 0..1
        let zeroth = (one - e) / x;
        let first = (one - e * (one + x)) / (x * x);
        (zeroth - slope * first) / (1.0 - 0.5 * slope)
    }

    /// Weights of the samples at `period` s: the kernel's share of each; their sum is 1. The sampled box has T/period
    /// rounded to whole samples, so that its zeros stay exact.
    fn weights(&self, period: f64) -> Vec<f64> {
        if let Kernel::Box(length) = *self {
            let n = whole(length, period);
            return vec![1.0 / n as f64; n];
        }
        let n = (self.length() / period).ceil().max(1.0) as usize;
        (0..n)
            .map(|k| self.share((k + 1) as f64 * period) - self.share(k as f64 * period))
            .collect()
    }
}

/// A length in whole samples, at least one.
fn whole(length: f64, period: f64) -> usize {
    (length / period).round().max(1.0) as usize
}

/// The pre-filter of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreFilter {
    /// Speed limit V_max, rad/s.
    pub speed_limit: f64,
    /// Length of the first moving average T_a = V_max/Acc_max, s.
    pub first: f64,
    /// The second moving average.
    pub second: Kernel,
}

impl PreFilter {
    /// Checks every parameter.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn check(&self) -> Result<(), AxisError> {
        positive("the speed limit", self.speed_limit)?;
        not_negative("the first filter's length", self.first)?;
        self.second.check()
    }

    /// The steady lag behind a ramp, s.
    pub fn lag(&self) -> f64 {
        0.5 * self.first + self.second.delay()
    }

    /// The response of the two averages, gain 1 at rest.
    pub fn response(&self, s: Complex64) -> Complex64 {
        let first = if self.first > 0.0 {
            Kernel::Box(self.first).response(s)
        } else {
            Complex64::new(1.0, 0.0)
        };
        first * self.second.response(s)
    }
}

/// A pre-filter that runs at a sample period.
#[derive(Debug, Clone)]
pub struct Running {
    last: f64,
    step: f64,
    first: MovingAverage<f64>,
    second: Second,
}

#[derive(Debug, Clone)]
enum Second {
    Box(MovingAverage<f64>),
    /// Weights, newest first, and the last samples in a ring stored twice so that a window is always one slice.
    Weighted {
        weights: Vec<f64>,
        ring: Vec<f64>,
        at: usize,
    },
}

impl Running {
    /// At rest at `value` rad.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn new(filter: &PreFilter, period: f64, value: f64) -> Result<Self, AxisError> {
        filter.check()?;
        positive("the sample period", period)?;
        let second = if let Kernel::Box(length) = filter.second {
            Second::Box(MovingAverage::new(whole(length, period), value))
        } else {
            let mut weights = filter.second.weights(period);
            weights.reverse();
            let ring = vec![value; 2 * weights.len()];
            Second::Weighted {
                weights,
                ring,
                at: 0,
            }
        };
        Ok(Running {
            last: value,
            step: filter.speed_limit * period,
            first: MovingAverage::new(whole(filter.first, period), value),
            second,
        })
    }

    /// Takes a set-point and gives the filtered one, rad.
    #[inline]
    pub fn step(&mut self, set_point: f64) -> f64 {
        self.last += (set_point - self.last).clamp(-self.step, self.step);
        let once = self.first.push(self.last);
        match &mut self.second {
            Second::Box(average) => average.push(once),
            Second::Weighted { weights, ring, at } => {
                let n = weights.len();
                ring[*at] = once;
                ring[*at + n] = once;
                *at = (*at + 1) % n;
                // the window [at, at + n) runs from oldest to newest
                weights
                    .iter()
                    .zip(&ring[*at..*at + n])
                    .map(|(w, v)| w * v)
                    .sum()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_kernel_passes_a_constant_and_lags_a_ramp(
            first in 2e-5..5e-4, omega in 1e4..6e4, damping in 0.0..0.2, which in 0..4
        ) {
            let second = match which {
                0 => Kernel::Box(std::f64::consts::TAU / omega),
                1 => Kernel::DampedJerk { omega, damping },
                2 => Kernel::Exponential { omega, damping },
                _ => Kernel::Linear { length: 2e-4, slope: 0.3 },
            };
            let filter = PreFilter { speed_limit: 1e3, first, second };
            let period = 1e-6;
            let mut running = Running::new(&filter, period, 0.2).unwrap();
            for _ in 0..100 {
                prop_assert!((running.step(0.2) - 0.2).abs() < 1e-12);
            }
            let mut last = 0.0;
            for k in 1..3000 {
                let x = 0.2 + 50.0 * f64::from(k) * period;
                last = x - running.step(x);
            }
            prop_assert!((last / 50.0 - filter.lag()).abs() < 2.0 * period, "{} {}", last / 50.0, filter.lag());
        }
    }
}
