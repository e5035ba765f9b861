//! A search for weights whose controller serves a whole spread of motors: modes that moved, loop delays.
//!
//! The thesis tunes the weights by hand on one motor; its controller is lost when the mode moves by -10 %. Here the weights,
//! and the damping by which the synthesis broadens the modes, are searched for the fastest and stiffest loop that keeps
//! its distance to the critical point over the whole spread.

use meltpath_base::Observer;
use meltpath_control::h_infinity::Template;
use meltpath_numerics::swarm::{Optimum, Range, Swarm, SwarmError, minimise};
use serde::{Deserialize, Serialize};

use crate::axis::control::{AngleUnit, CurrentGains};
use crate::axis::error::{AxisError, positive};
use crate::axis::galvanometer::Galvanometer;
use crate::servo::h_infinity::{
    Changes, Form, HInfinityError, HInfinityServo, HInfinityTargets, LoopQuality, Weights,
    command_unit, design, quality,
};
use crate::servo::sampled::Sampling;

/// The motors a controller has to serve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// Factors on the pulsation of the modes.
    pub mode_shifts: Vec<f64>,
    /// Loop delays, s.
    pub delays: Vec<f64>,
    /// Distance to the critical point to keep everywhere.
    pub modulus_margin: f64,
    /// Largest gain of the closed loop accepted anywhere.
    pub resonance: f64,
}

/// What the search found.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustDesign {
    /// The settings found.
    pub targets: HInfinityTargets,
    /// The controller.
    pub servo: HInfinityServo,
    /// Its sampled loop for every motor of the spread.
    pub loops: Vec<LoopQuality>,
    /// The swarm's way.
    pub search: Optimum,
}

meltpath_base::passes_on! {
    /// Why no robust controller is found.
    #[derive(Clone, PartialEq)]
    pub enum RobustError {
        /// The swarm did not start, or was stopped.
        Swarm(SwarmError),
        /// The last synthesis.
        HInfinity(HInfinityError);

        /// The spread names no motor.
        #[error(
            "the spread has {shifts} mode shifts and {delays} delays: at least one of each is needed"
        )]
        Empty {
            /// Number of shifts.
            shifts: usize,
            /// Number of delays.
            delays: usize,
        },
        /// The best controller found does not serve every motor.
        #[error(
            "the best controller found does not serve the motor with its modes at {shift} times their pulsation and {} µs of delay ({}; its closed loop's largest gain is {resonance:.2}, {most:.2} are allowed): narrow the spread or ask for less",
            1e6 * delay,
            if *stable { format!("distance to the critical point {margin:.2}, {least:.2} are asked for") } else { "unstable".to_owned() }
        )]
        OutOfReach {
            /// Factor on the modes.
            shift: f64,
            /// Delay, s.
            delay: f64,
            /// Modulus margin there.
            margin: f64,
            /// The one asked for.
            least: f64,
            /// Largest gain of the closed loop there.
            resonance: f64,
            /// The largest allowed.
            most: f64,
            /// Whether it is stable there.
            stable: bool,
        },
    }
}

/// Bounds of the unknowns: crossover of W1 (rad/s) and its high gain, low and high gain and crossover of W2, low gain and
/// crossover of W3, least damping; for the thesis' bandwidth of 3000 rad/s.
const BOUNDS: [(f64, f64); 8] = [
    (500.0, 8000.0),
    (1.001, 2.5),
    (5.0, 300.0),
    (1e-3, 0.5),
    (1e4, 2e6),
    (2.0, 60.0),
    (50.0, 1500.0),
    (0.005, 0.5),
];

/// Which of them are frequencies and grow with the bandwidth.
const FREQUENCIES: [bool; 8] = [true, false, false, false, true, false, true, false];

fn targets(
    x: &[f64],
    changes: Changes,
    sampling: Sampling,
    command_unit: f64,
) -> Option<HInfinityTargets> {
    Some(HInfinityTargets {
        weights: Weights {
            sensitivity: Template::new(0.001, x[1], x[0]).ok()?,
            command: Template::new(x[2], x[3], x[4]).ok()?,
            disturbance: Template::new(x[5], 0.9, x[6]).ok()?,
        },
        least_damping: x[7],
        crossover: x[0],
        changes,
        period: sampling.period,
        every: sampling.every,
        command_unit,
    })
}

/// Searches weights for a motor and its spread, from the thesis' weights for a `bandwidth` (rad/s) on; frequencies are searched
/// from a sixth to 2.7 times those of the thesis at that bandwidth.
///
/// # Errors
/// [`RobustError`].
#[expect(
    clippy::too_many_arguments,
    reason = "what is controlled, for what, and how it is searched"
)]
pub fn search(
    motor: &Galvanometer,
    current: &CurrentGains,
    unit: AngleUnit,
    spread: &Spread,
    bandwidth: f64,
    changes: Changes,
    sampling: Sampling,
    swarm: &Swarm,
    observer: &dyn Observer,
) -> Result<RobustDesign, RobustError> {
    if spread.mode_shifts.is_empty() || spread.delays.is_empty() {
        return Err(RobustError::Empty {
            shifts: spread.mode_shifts.len(),
            delays: spread.delays.len(),
        });
    }
    positive("the bandwidth", bandwidth).map_err(HInfinityError::Axis)?;
    let pace = bandwidth / 3000.0;
    let worth = command_unit(motor, unit, bandwidth);
    let cost = |x: &[f64]| -> f64 {
        // the rest of a round that was stopped costs nothing
        if observer.check().is_err() {
            return f64::INFINITY;
        }
        let Some(targets) = targets(x, changes, sampling, worth) else {
            return f64::INFINITY;
        };
        let Ok(servo) = design(motor, current, unit, &targets) else {
            return f64::INFINITY;
        };
        loops(motor, current, unit, &servo, spread).map_or(f64::INFINITY, |l| judge(&l, spread))
    };
    let ranges: Vec<Range> = BOUNDS
        .iter()
        .zip(FREQUENCIES)
        .map(|(b, frequency)| {
            let factor = if frequency { pace } else { 1.0 };
            Range::logarithmic(factor * b.0, factor * b.1)
        })
        .collect();
    let mut start = [3000.0, 1.001, 55.0, 0.1, 5e5, 15.0, 300.0, 0.05];
    for (value, frequency) in start.iter_mut().zip(FREQUENCIES) {
        *value *= if frequency { pace } else { 1.0 };
    }
    let found = minimise(cost, &ranges, Some(&start), swarm, observer)?;
    let targets =
        targets(&found.values, changes, sampling, worth).ok_or(SwarmError::NoFiniteCost)?;
    let servo = design(motor, current, unit, &targets)?;
    let loops = loops(motor, current, unit, &servo, spread).map_err(HInfinityError::Axis)?;
    if let Some(bad) = loops.iter().find(|l| !serves(l, spread)) {
        return Err(RobustError::OutOfReach {
            shift: bad.mode_shift,
            delay: bad.delay,
            margin: bad.modulus_margin,
            least: spread.modulus_margin,
            resonance: bad.resonance,
            most: spread.resonance,
            stable: bad.stable,
        });
    }
    Ok(RobustDesign {
        targets,
        servo,
        loops,
        search: found,
    })
}

/// The sampled loop of a controller for every motor of a spread.
///
/// # Errors
/// [`AxisError::System`].
pub fn loops(
    motor: &Galvanometer,
    current: &CurrentGains,
    unit: AngleUnit,
    servo: &HInfinityServo,
    spread: &Spread,
) -> Result<Vec<LoopQuality>, AxisError> {
    let mut all = Vec::with_capacity(spread.mode_shifts.len() * spread.delays.len());
    for &shift in &spread.mode_shifts {
        for &delay in &spread.delays {
            all.push(quality(
                motor,
                current,
                unit,
                servo,
                Form::Sampled,
                shift,
                delay,
            )?);
        }
    }
    Ok(all)
}

fn serves(quality: &LoopQuality, spread: &Spread) -> bool {
    // a percent for the swarm's last step against its penalty
    quality.stable
        && quality.modulus_margin >= 0.99 * spread.modulus_margin
        && quality.resonance <= 1.01 * spread.resonance
}

/// Low when the worst loop is fast and stiff and every loop keeps its distance.
fn judge(loops: &[LoopQuality], spread: &Spread) -> f64 {
    let mut penalty = 0.0;
    let mut slowest = f64::INFINITY;
    let mut left = 0.0f64;
    for l in loops {
        penalty += if l.stable { 0.0 } else { 20.0 };
        penalty += 20.0 * (spread.modulus_margin - l.modulus_margin).max(0.0);
        penalty += 20.0 * (l.resonance - spread.resonance).clamp(0.0, 10.0);
        slowest = slowest.min(l.error_band);
        left = left.max(l.slow_error);
    }
    penalty + left.max(1e-9).ln() - slowest.max(1.0).ln()
}
