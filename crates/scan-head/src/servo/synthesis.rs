//! Tuning of the cascade in frequency, loop after loop, each step kept so that it can be shown.
//!
//! Source: Rasoanarivo 2020, § 2.2.2.2, fig. 2.34-2.40. The thesis turns the knobs by hand; the rules here find the same
//! settings: the integral of the current loop is a share of its crossover (or the shortest that leaves the margin), that of the speed loop the shortest that leaves
//! the margin, the derivative of the position loop the longest that does.

use std::f64::consts::PI;

use meltpath_control::{Complex64, SystemError};
use serde::{Deserialize, Serialize};

use crate::axis::control::{AngleUnit, CascadeGains, CurrentGains, FeedForward};
use crate::axis::error::{AxisError, positive};
use crate::axis::galvanometer::Galvanometer;
use crate::servo::model::{Loop, ServoModel, current_loop, lead, proportional_integral};

/// Why a cascade cannot be tuned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ServoError {
    /// A loop does not reach its margin.
    #[error(
        "the {which:?} loop reaches a phase margin of {best_deg:.1} deg at {crossover:.0} rad/s, {wanted_deg:.1} deg are wanted: slow the loop down, or speed up the loop inside it"
    )]
    Margin {
        /// Which loop.
        which: Loop,
        /// Best margin, deg.
        best_deg: f64,
        /// Wanted, deg.
        wanted_deg: f64,
        /// Crossover, rad/s.
        crossover: f64,
    },
    /// A loop is to be faster than the loop inside it.
    #[error(
        "the {which:?} loop is to cross at {crossover:.0} rad/s, not below the {inner:.0} rad/s of the loop inside it"
    )]
    Order {
        /// Which loop.
        which: Loop,
        /// Its crossover, rad/s.
        crossover: f64,
        /// Crossover of the loop inside, rad/s.
        inner: f64,
    },
    /// The tuned cascade is unstable.
    #[error(
        "the tuned cascade is unstable (a pole at {pole} rad/s), likely because of a flexible mode: slow the loops down or damp the mode"
    )]
    Unstable {
        /// A pole that grows, rad/s.
        pole: Complex64,
    },
    /// A parameter of motor or target.
    #[error(transparent)]
    Axis(#[from] AxisError),
}

impl From<SystemError> for ServoError {
    fn from(error: SystemError) -> Self {
        ServoError::Axis(AxisError::System(error))
    }
}

/// What a loop is to reach.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Crossover ω_c, rad/s.
    pub crossover: f64,
    /// Phase margin, rad.
    pub margin: f64,
}

impl Target {
    /// From the time of the first maximum of the step response (s), by ω_c t_m ≈ 3, and a margin in degrees.
    pub fn from_first_maximum(time: f64, margin_deg: f64) -> Self {
        Target {
            crossover: 3.0 / time,
            margin: margin_deg.to_radians(),
        }
    }
}

/// What the cascade is to reach, and how its integrals are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Targets {
    /// Current loop.
    pub current: Target,
    /// Speed loop.
    pub speed: Target,
    /// Position loop.
    pub position: Target,
    /// T_ii in units of 1/ω_c of the current loop; 0.7 gives the thesis' value. Longer where the margin asks for it.
    pub integral_share: f64,
    /// T_iω (s) where the speed loop has no phase to spare for an integral.
    pub spare_integral_time: f64,
    /// Which of the two derivative times that leave the margin.
    pub derivative: Branch,
    /// The unit of angles in the gains.
    pub unit: AngleUnit,
}

/// Two derivative times leave the same margin of the position loop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Branch {
    /// The longer one, where the filter of the derivative takes the phase back (the thesis' choice).
    #[default]
    Falling,
    /// The shorter one.
    Rising,
}

impl Default for Targets {
    /// The thesis' example: first maxima at 300, 600 and 1000 µs, margins of 65, 65 and 75°.
    fn default() -> Self {
        Targets {
            current: Target::from_first_maximum(300e-6, 65.0),
            speed: Target::from_first_maximum(600e-6, 65.0),
            position: Target::from_first_maximum(1000e-6, 75.0),
            integral_share: 0.7,
            spare_integral_time: 0.04,
            derivative: Branch::Falling,
            unit: AngleUnit::Degree,
        }
    }
}

/// What a step of the synthesis did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Gain one, no integral, no derivative.
    Uncorrected,
    /// The integral or derivative time tried on the way.
    Trial,
    /// The integral or derivative time kept.
    Time,
    /// The gain set for the crossover.
    Gain,
}

/// One step: the gains after it, and what the loop does at its wanted crossover.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Which loop.
    pub which: Loop,
    /// What was done.
    pub stage: Stage,
    /// All gains after the step; loops outside are not tuned yet.
    pub gains: CascadeGains,
    /// |T_BO| at the wanted crossover.
    pub gain_there: f64,
    /// Phase of T_BO at the wanted crossover plus π, rad.
    pub margin_there: f64,
}

/// The tuned cascade with the way to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tuned {
    /// The gains.
    pub gains: CascadeGains,
    /// Every step in order.
    pub steps: Vec<Step>,
}

/// Tunes the three loops for a motor. Feed-forward is set to full (K1 = K2 = 1) with `filter` s.
///
/// # Errors
/// [`ServoError`].
///
/// ```
/// use meltpath_scan_head::servo::synthesis::{tune, Targets};
/// # use meltpath_scan_head::axis::galvanometer::{Galvanometer, Mode};
/// # let (kc, j) = (6.17e-3, 4.530_873_193e-8);
/// # let motor = Galvanometer { resistance: 2.79, inductance: 180e-6, torque_constant: kc, back_emf: kc, inertia: j,
/// #     viscous: 3e-6, friction: Default::default(), felt: 0.0,
/// #     modes: vec![Mode { omega: 25_132.74, damping: 0.015, gain: 0.3 * kc / j }] };
/// let tuned = tune(&motor, &Targets::default(), 50e-6).unwrap();
/// assert!((tuned.gains.current.gain - 1.88).abs() < 0.01);           // V/A
/// ```
pub fn tune(motor: &Galvanometer, targets: &Targets, filter: f64) -> Result<Tuned, ServoError> {
    motor.check()?;
    let all = [
        (Loop::Current, targets.current),
        (Loop::Speed, targets.speed),
        (Loop::Position, targets.position),
    ];
    for (_, target) in all {
        positive("a crossover", target.crossover)?;
        positive("a phase margin", target.margin)?;
    }
    positive("the share of the integral", targets.integral_share)?;
    positive("the spare integral time", targets.spare_integral_time)?;
    for pair in all.windows(2) {
        if pair[1].1.crossover >= pair[0].1.crossover {
            return Err(ServoError::Order {
                which: pair[1].0,
                crossover: pair[1].1.crossover,
                inner: pair[0].1.crossover,
            });
        }
    }
    let mut bench = Bench {
        motor,
        gains: CascadeGains {
            current: CurrentGains {
                gain: 1.0,
                integral_time: f64::INFINITY,
            },
            speed_gain: 1.0,
            speed_integral_time: f64::INFINITY,
            position_gain: 1.0,
            position_derivative_time: 0.0,
            feed_forward: FeedForward {
                speed: 1.0,
                current: 1.0,
                filter,
                inertia_over_torque: motor.inertia / motor.torque_constant,
            },
            unit: targets.unit,
        },
        steps: Vec::new(),
    };
    bench.current(targets)?;
    bench.speed(targets)?;
    bench.position(targets)?;
    let closed = ServoModel::new(motor, &bench.gains).closed_loop()?;
    let worst = closed
        .poles()
        .map_err(SystemError::from)?
        .into_iter()
        .max_by(|a, b| a.re.total_cmp(&b.re));
    // the feed-forward filters stand outside the loop and decay
    match worst {
        Some(pole) if pole.re >= 0.0 => Err(ServoError::Unstable { pole }),
        _ => Ok(Tuned {
            gains: bench.gains,
            steps: bench.steps,
        }),
    }
}

struct Bench<'a> {
    motor: &'a Galvanometer,
    gains: CascadeGains,
    steps: Vec<Step>,
}

impl Bench<'_> {
    fn note(&mut self, which: Loop, stage: Stage, omega: f64) {
        let open = ServoModel::new(self.motor, &self.gains).open(which, Complex64::new(0.0, omega));
        self.steps.push(Step {
            which,
            stage,
            gains: self.gains,
            gain_there: open.norm(),
            margin_there: (-open).arg(),
        });
    }

    fn gain_there(&self, which: Loop, omega: f64) -> f64 {
        ServoModel::new(self.motor, &self.gains)
            .open(which, Complex64::new(0.0, omega))
            .norm()
    }

    fn current(&mut self, targets: &Targets) -> Result<(), ServoError> {
        let Target { crossover, margin } = targets.current;
        self.note(Loop::Current, Stage::Uncorrected, crossover);
        let s = Complex64::new(0.0, crossover);
        let mut time = targets.integral_share / crossover;
        let margin_with = |time: f64| {
            (-(proportional_integral(1.0, time, s) * self.motor.current_over_voltage(s))).arg()
        };
        if margin_with(time) < margin {
            // the share takes too much phase from this coil: the shortest time that does not, as in the speed loop
            let spare = (-self.motor.current_over_voltage(s)).arg() - margin;
            if spare > 0.0 {
                time = 1.0 / (crossover * spare.tan()) * (1.0 + 1e-9);
            }
        }
        for factor in [100.0, 10.0, 3.0] {
            self.gains.current.integral_time = factor * time;
            self.note(Loop::Current, Stage::Trial, crossover);
        }
        self.gains.current.integral_time = time;
        self.note(Loop::Current, Stage::Time, crossover);
        let left = self.steps.last().map_or(0.0, |step| step.margin_there);
        reached(Loop::Current, left, margin, crossover)?;
        self.gains.current.gain = 1.0 / self.gain_there(Loop::Current, crossover);
        self.note(Loop::Current, Stage::Gain, crossover);
        Ok(())
    }

    fn speed(&mut self, targets: &Targets) -> Result<(), ServoError> {
        let Target { crossover, margin } = targets.speed;
        self.note(Loop::Speed, Stage::Uncorrected, crossover);
        let s = Complex64::new(0.0, crossover);
        let bare =
            current_loop(self.motor, &self.gains.current, s) * self.motor.speed_over_current(s);
        // the regulator takes atan(1/(ωT)) of phase
        let spare = (-bare).arg() - margin;
        let shortest = 1.0 / (crossover * spare.tan());
        self.gains.speed_integral_time = if spare > 0.0 && shortest < targets.spare_integral_time {
            shortest
        } else {
            targets.spare_integral_time
        };
        self.note(Loop::Speed, Stage::Time, crossover);
        let left = self.steps.last().map_or(0.0, |step| step.margin_there);
        // the thesis accepts a margin close to the wanted one here
        reached(Loop::Speed, left + CLOSE, margin, crossover)?;
        self.gains.speed_gain = 1.0 / self.gain_there(Loop::Speed, crossover);
        self.note(Loop::Speed, Stage::Gain, crossover);
        Ok(())
    }

    fn position(&mut self, targets: &Targets) -> Result<(), ServoError> {
        let Target { crossover, margin } = targets.position;
        self.note(Loop::Position, Stage::Uncorrected, crossover);
        let s = Complex64::new(0.0, crossover);
        let bare = ServoModel::new(self.motor, &self.gains).closed(Loop::Speed, s) / s;
        let margin_with = |time: f64| (-(bare * lead(time, s))).arg();
        // 1 + T s/(1 + T s/100) lifts the phase most at T ω = 100/√101
        let best = 100.0 / 101f64.sqrt() / crossover;
        reached(Loop::Position, margin_with(best), margin, crossover)?;
        let (mut inside, mut outside) = match targets.derivative {
            Branch::Falling => (best, 1e6 * best),
            Branch::Rising => (best, 0.0),
        };
        if margin_with(outside) >= margin {
            // even the end of the branch keeps the margin: the derivative is not what limits
            inside = outside;
        }
        for _ in 0..200 {
            let middle = match targets.derivative {
                Branch::Falling => (inside * outside).sqrt(),
                Branch::Rising => f64::midpoint(inside, outside),
            };
            if margin_with(middle) >= margin {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        for factor in [0.01, 0.1, 0.5] {
            self.gains.position_derivative_time = factor * inside;
            self.note(Loop::Position, Stage::Trial, crossover);
        }
        self.gains.position_derivative_time = inside;
        self.note(Loop::Position, Stage::Time, crossover);
        self.gains.position_gain = 1.0 / self.gain_there(Loop::Position, crossover);
        self.note(Loop::Position, Stage::Gain, crossover);
        Ok(())
    }
}

/// What a speed loop may lack of its margin, rad: 2°, as the thesis' own (64.9° for 65°) and the spare integral's share.
const CLOSE: f64 = 2.0 * PI / 180.0;

fn reached(which: Loop, best: f64, wanted: f64, crossover: f64) -> Result<(), ServoError> {
    if best >= wanted {
        return Ok(());
    }
    Err(ServoError::Margin {
        which,
        best_deg: best.to_degrees(),
        wanted_deg: wanted.to_degrees(),
        crossover,
    })
}
