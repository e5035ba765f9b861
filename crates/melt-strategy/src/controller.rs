//! Melt strategies optimised by simulation: controllers that choose the speed along a path from the temperatures while it is
//! drawn, so that they meet an aim. Learning from whole drawings: [`crate::learning`]; prediction: [`crate::prediction`].
//!
//! Béraud 2016, section 3.3.2.2 and annex F (its controller repaired, erratum E13); controllers and learning beyond it:
//! docs/theory/sources.md. Simulator, controller and aim do not know each other.

use meltpath_base::Observer;

use crate::error::StrategyError;
use crate::speed::SpeedProfile;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::charts::simulation::{ChartSimulation, ChartSimulationError};
use meltpath_thermal::material::CELSIUS;

/// Chooses how fast the beam goes on from the temperature under it.
pub trait Controller {
    /// Factor on the path's own speed for the next moment of `dt` s, from the hottest temperature near the beam, K.
    fn factor(&mut self, hottest: f64, dt: f64) -> f64;
}

/// Only accelerates: the thesis' controller, with its branches in the order of its text and a step that grows towards the
/// aim and stays bounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accelerator {
    /// Highest temperature wanted, K.
    pub aim: f64,
    /// Share of the aim (in °C) from which it accelerates.
    pub from: f64,
    /// Greatest factor: reached at the aim and kept above it.
    pub most: f64,
}

impl Accelerator {
    /// For a beam of `diameter` mm that moves `speed` mm/s on its own, in steps of `dt` s: at the aim it skips 0.3 φ.
    pub fn for_beam(aim: f64, diameter: f64, speed: f64, dt: f64) -> Self {
        Accelerator {
            aim,
            from: 0.96,
            most: 1.0 + 0.3 * diameter / (speed * dt),
        }
    }
}

impl Controller for Accelerator {
    fn factor(&mut self, hottest: f64, _dt: f64) -> f64 {
        let aim = self.aim - CELSIUS;
        let close = (hottest - CELSIUS - self.from * aim) / ((1.0 - self.from) * aim);
        1.0 + (self.most - 1.0) * close.clamp(0.0, 1.0).powi(2)
    }
}

/// Proportional, integral and derivative action on the relative excess of temperature, on the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid {
    /// Temperature wanted near the beam, K.
    pub aim: f64,
    /// Temperature of the bed, K.
    pub ambient: f64,
    /// Change of the factor per relative excess.
    pub proportional: f64,
    /// The same per second of it.
    pub integral: f64,
    /// The same per change of it per second, s.
    pub derivative: f64,
    /// Slowest and fastest factor; the integral stops where one is reached.
    pub bounds: [f64; 2],
    sum: f64,
    before: Option<f64>,
}

impl Pid {
    /// A controller that starts from the path's own speed.
    pub fn new(aim: f64, ambient: f64, gains: [f64; 3], bounds: [f64; 2]) -> Self {
        Pid {
            aim,
            ambient,
            proportional: gains[0],
            integral: gains[1],
            derivative: gains[2],
            bounds,
            sum: 0.0,
            before: None,
        }
    }
}

impl Controller for Pid {
    fn factor(&mut self, hottest: f64, dt: f64) -> f64 {
        let excess = (hottest - self.aim) / (self.aim - self.ambient);
        let slope = self.before.map_or(0.0, |b| (excess - b) / dt);
        self.before = Some(excess);
        let sum = self.sum + excess * dt;
        let wanted =
            1.0 + self.proportional * excess + self.integral * sum + self.derivative * slope;
        let factor = wanted.clamp(self.bounds[0], self.bounds[1]);
        // no wind-up: the integral grows only towards the inside of the bounds
        if factor == wanted || (wanted - factor) * excess < 0.0 {
            self.sum = sum;
        }
        factor
    }
}

/// Draws `path` with a controller that looks every `every` steps; returns the speeds it chose. `simulation` shows the
/// temperatures they led to.
///
/// # Errors
/// [`StrategyError`], cancellation included.
pub fn control(
    simulation: &mut ChartSimulation,
    path: &BeamPath,
    controller: &mut dyn Controller,
    every: usize,
    observer: &dyn Observer,
) -> Result<SpeedProfile, StrategyError> {
    let dt = simulation.settings().step;
    let whole = 1000;
    observer.stage("draw under control", whole);
    let mut told = 0;
    let mut now = path.begin();
    let (mut knots, mut factors) = (vec![now], Vec::new());
    let mut points = Vec::with_capacity(every);
    while now < path.end() {
        observer.check().map_err(ChartSimulationError::from)?;
        let look = dt * every as f64;
        let factor = if path.at(now).is_on() {
            controller.factor(simulation.hottest_under_beam(), look)
        } else {
            1.0
        };
        points.clear();
        points.extend((0..every).map(|n| path.at(now + (n as f64 + 0.5) * dt * factor)));
        simulation.advance(&points)?;
        now += look * factor;
        knots.push(now.min(path.end()));
        factors.push(factor);
        let share = (now - path.begin()) / (path.end() - path.begin());
        let done = ((whole as f64 * share) as u64).min(whole);
        observer.advance(done - told);
        told = done;
    }
    Ok(SpeedProfile::from_parts(knots, factors))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_accelerator_only_accelerates() {
        let mut controller = Accelerator::for_beam(2730.0 + CELSIUS, 0.413_67, 980.0, 2.5e-6);
        let mut factor = |celsius: f64| controller.factor(celsius + CELSIUS, 1e-5);
        assert_eq!(factor(1000.0), 1.0);
        assert_eq!(factor(2600.0), 1.0);
        let (some, full) = (factor(2700.0), factor(2800.0));
        assert!(some > 1.0 && full > some);
        // 0.3 φ in a step of 2.45 µm
        assert!((full - 1.0 - 0.3 * 0.413_67 / 2.45e-3).abs() < 1e-9);
    }

    #[test]
    fn the_derivative_acts_on_the_change_in_a_second() {
        let mut pid = Pid::new(3000.0, 1000.0, [0.0, 0.0, 2e-3], [0.5, 2.0]);
        assert_eq!(pid.factor(3100.0, 1e-3), 1.0);
        // by 0.05 of the rise in a millisecond
        assert!((pid.factor(3200.0, 1e-3) - 1.1).abs() < 1e-12);
    }

    #[test]
    fn the_integral_sums_excess_and_time() {
        let mut pid = Pid::new(3000.0, 1000.0, [0.0, 2.0, 0.0], [0.5, 2.0]);
        // by 0.1 of the rise, 50 ms each
        for n in 1..5 {
            let wanted = 1.0 + 2.0 * 0.1 * 0.05 * f64::from(n);
            assert!((pid.factor(3200.0, 0.05) - wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn the_integral_does_not_wind_up() {
        let mut pid = Pid::new(3000.0, 1000.0, [1.0, 100.0, 0.0], [0.5, 2.0]);
        for _ in 0..1000 {
            assert_eq!(pid.factor(9000.0, 1e-3), 2.0);
        }
        // back at once when the excess turns
        assert!(pid.factor(2000.0, 1e-3) < 1.0);
    }
}
