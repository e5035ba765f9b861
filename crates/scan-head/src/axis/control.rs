//! Angle control, sample by sample: the cascade with feed-forward, or any controller in sampled state space.
//!
//! Source: Rasoanarivo 2020, fig. 2.26-2.29, eq. 2.26-2.27 (cascade) and fig. 3.7 (a state-space controller in place of the
//! speed and position regulators, current regulator and current feed-forward kept).

use meltpath_control::export::{Exported, RunningExport, Word};
use meltpath_control::simulate::Running;
use meltpath_control::{Domain, StateSpace};
use serde::{Deserialize, Serialize};

use crate::axis::error::{AxisError, not_negative, positive};

/// The unit in which a controller's coefficients count angles. The thesis does not say it; degrees are inferred (docs/theory/axis-control.md).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AngleUnit {
    /// Degrees.
    #[default]
    Degree,
    /// Radians.
    Radian,
}

impl AngleUnit {
    /// Units in a radian.
    pub fn per_radian(self) -> f64 {
        match self {
            AngleUnit::Degree => 180.0 / std::f64::consts::PI,
            AngleUnit::Radian => 1.0,
        }
    }
}

/// The current regulator, proportional and integral: K (1 + 1/(T s)).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurrentGains {
    /// K_ii, V/A.
    pub gain: f64,
    /// T_ii, s.
    pub integral_time: f64,
}

/// Current feed-forward K2 (J/Kc) s²/(1 + τ s)² (eq. 2.27), and speed feed-forward K1 s/(1 + τ s) (eq. 2.26).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeedForward {
    /// K1, 0 to 1; only the cascade uses it.
    pub speed: f64,
    /// K2, 0 to 1.
    pub current: f64,
    /// Derivative filter τ, s.
    pub filter: f64,
    /// J/Kc as the controller believes it, A·s²/rad.
    pub inertia_over_torque: f64,
}

impl FeedForward {
    /// K2 J/Kc: current for the set-point's acceleration, A·s²/rad.
    pub fn acceleration_gain(&self) -> f64 {
        self.current * self.inertia_over_torque
    }
}

/// The gains of the cascade, per degree or per radian.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CascadeGains {
    /// Current regulator.
    pub current: CurrentGains,
    /// K_iω, A per (angle unit/s).
    pub speed_gain: f64,
    /// T_iω, s.
    pub speed_integral_time: f64,
    /// K_θ, 1/s.
    pub position_gain: f64,
    /// T_dθ, s; filtered with a hundredth of it.
    pub position_derivative_time: f64,
    /// Feed-forward.
    pub feed_forward: FeedForward,
    /// The unit of angles in these gains.
    #[serde(default)]
    pub unit: AngleUnit,
}

impl CascadeGains {
    /// K_ii, T_ii, K_iω, T_iω, K_θ, T_dθ, K1, K2.
    pub fn values(&self) -> [f64; 8] {
        [
            self.current.gain,
            self.current.integral_time,
            self.speed_gain,
            self.speed_integral_time,
            self.position_gain,
            self.position_derivative_time,
            self.feed_forward.speed,
            self.feed_forward.current,
        ]
    }
}

/// What the controller does with the error angle.
#[derive(Debug, Clone, PartialEq)]
pub enum Controller {
    /// Position, speed and current loops with feed-forward.
    Cascade(CascadeGains),
    /// A sampled controller in place of the position and speed loops.
    Sampled(SampledController),
}

impl Controller {
    /// Whether it keeps its signals in whole numbers of a unit: an export to a word of fixed point.
    pub fn rounds_signals(&self) -> bool {
        match self {
            Controller::Sampled(SampledController {
                form: SampledForm::Exported(exported),
                ..
            }) => matches!(exported.word, Word::Fixed { .. }),
            Controller::Sampled(_) | Controller::Cascade(_) => false,
        }
    }
}

/// A sampled controller from error angle to current set-point, behind it the current regulator, beside it the feed-forward.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledController {
    /// The controller: one input (angle in `unit`) and one output (A).
    pub form: SampledForm,
    /// The unit of angles at its input.
    pub unit: AngleUnit,
    /// It acts once in this many samples of the axis.
    pub every: u32,
    /// Current regulator.
    pub current: CurrentGains,
    /// Feed-forward of current.
    pub feed_forward: FeedForward,
}

/// A controller as it was designed, or as a drive runs it.
#[derive(Debug, Clone, PartialEq)]
pub enum SampledForm {
    /// The sampled system.
    Designed(StateSpace),
    /// As it leaves for a drive: word length, cut output and anti-windup included.
    Exported(Exported),
}

/// Where a sampled controller's output comes from.
#[derive(Debug, Clone)]
enum Behind {
    /// The system as designed.
    Designed(Running),
    /// The controller as exported, in the numbers of its word.
    Exported(RunningExport),
}

impl Behind {
    fn step(&mut self, error: f64) -> f64 {
        match self {
            Behind::Designed(system) => {
                let mut out = [0.0];
                system.step(&[error], &mut out);
                out[0]
            }
            Behind::Exported(export) => export.step(error),
        }
    }
}

/// Where the speed of the speed loop comes from; the source does not say.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum SpeedSource {
    /// The rotor's true speed.
    Rotor,
    /// The measured angle through s/(1 + τ s).
    Derivative {
        /// τ, s.
        filter: f64,
    },
}

/// What is measured at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Current, A.
    pub current: f64,
    /// Angle, rad.
    pub angle: f64,
    /// Rotor speed where it is known, rad/s.
    pub speed: f64,
}

/// Limits of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Supply voltage, V: the motor gets ± this.
    pub voltage: f64,
    /// Peak current set-point, A.
    pub current: f64,
}

/// s/(1 + τ s) at a sample period, backward.
#[derive(Debug, Clone)]
struct Derivative {
    keep: f64,
    gain: f64,
    last: f64,
    value: f64,
}

impl Derivative {
    fn new(filter: f64, period: f64, start: f64) -> Self {
        Derivative {
            keep: filter / (filter + period),
            gain: 1.0 / (filter + period),
            last: start,
            value: 0.0,
        }
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        self.value = self.keep * self.value + self.gain * (input - self.last);
        self.last = input;
        self.value
    }
}

/// A proportional and integral regulator whose integral stands still while its output is cut and it would go further.
#[derive(Debug, Clone)]
struct Regulator {
    gain: f64,
    step: f64,
    integral: f64,
    limit: f64,
}

impl Regulator {
    fn new(gain: f64, integral_time: f64, period: f64, limit: f64) -> Self {
        Regulator {
            gain,
            step: gain * period / integral_time,
            integral: 0.0,
            limit,
        }
    }

    #[inline]
    fn act(&mut self, error: f64, added: f64) -> f64 {
        let next = self.integral + self.step * error;
        let wanted = self.gain * error + next + added;
        let out = wanted.clamp(-self.limit, self.limit);
        if out == wanted || error * wanted < 0.0 {
            self.integral = next;
        }
        out
    }
}

/// A law that turns set-point and measures into a voltage, once a sample.
pub trait Law: Send {
    /// The voltage, V, for the set-point `reference` rad.
    fn step(&mut self, reference: f64, measured: Measured) -> f64;
}

/// The cascade, running.
#[derive(Debug, Clone)]
pub struct Cascade {
    position_gain: f64,
    lead: f64,
    error_slope: Derivative,
    speed: Option<Derivative>,
    speed_regulator: Regulator,
    current_regulator: Regulator,
    forward_speed: Derivative,
    forward_acceleration: Derivative,
    k1: f64,
    k2: f64,
}

impl Cascade {
    /// At rest at `angle` rad.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn new(
        gains: &CascadeGains,
        speed: SpeedSource,
        limits: Limits,
        period: f64,
        angle: f64,
    ) -> Result<Self, AxisError> {
        check_common(&gains.current, &gains.feed_forward, limits, period)?;
        not_negative("the gain of the speed loop", gains.speed_gain)?;
        positive(
            "the integral time of the speed loop",
            gains.speed_integral_time,
        )?;
        not_negative("the gain of the position loop", gains.position_gain)?;
        not_negative(
            "the derivative time of the position loop",
            gains.position_derivative_time,
        )?;
        let ff = gains.feed_forward;
        let speed = match speed {
            SpeedSource::Rotor => None,
            SpeedSource::Derivative { filter } => {
                not_negative("the filter of the speed estimate", filter)?;
                Some(Derivative::new(filter, period, angle))
            }
        };
        Ok(Cascade {
            position_gain: gains.position_gain,
            lead: gains.position_derivative_time,
            error_slope: Derivative::new(gains.position_derivative_time / 100.0, period, 0.0),
            speed,
            speed_regulator: Regulator::new(
                gains.speed_gain * gains.unit.per_radian(),
                gains.speed_integral_time,
                period,
                limits.current,
            ),
            current_regulator: Regulator::new(
                gains.current.gain,
                gains.current.integral_time,
                period,
                limits.voltage,
            ),
            forward_speed: Derivative::new(ff.filter, period, angle),
            forward_acceleration: Derivative::new(ff.filter, period, 0.0),
            k1: ff.speed,
            k2: ff.acceleration_gain(),
        })
    }
}

impl Law for Cascade {
    #[inline]
    fn step(&mut self, reference: f64, measured: Measured) -> f64 {
        let speed = match &mut self.speed {
            None => measured.speed,
            Some(estimate) => estimate.step(measured.angle),
        };
        let error = reference - measured.angle;
        let reference_speed = self.forward_speed.step(reference);
        let reference_acceleration = self.forward_acceleration.step(reference_speed);
        let wanted_speed = self.position_gain * (error + self.lead * self.error_slope.step(error))
            + self.k1 * reference_speed;
        let wanted_current = self
            .speed_regulator
            .act(wanted_speed - speed, self.k2 * reference_acceleration);
        self.current_regulator
            .act(wanted_current - measured.current, 0.0)
    }
}

/// A state-space controller with current regulator and feed-forward, running.
#[derive(Debug, Clone)]
pub struct Sampled {
    system: Behind,
    per_radian: f64,
    every: u32,
    count: u32,
    output: f64,
    forward_speed: Derivative,
    forward_acceleration: Derivative,
    k2: f64,
    limit: f64,
    current_regulator: Regulator,
}

impl Sampled {
    /// At rest at `angle` rad.
    ///
    /// # Errors
    /// [`AxisError::Controller`] where the controller has not one input and one output, or is made for another period;
    /// [`AxisError::Export`] where an exported one cannot run.
    pub fn new(
        controller: &SampledController,
        limits: Limits,
        period: f64,
        angle: f64,
    ) -> Result<Self, AxisError> {
        let SampledController {
            form,
            unit,
            every,
            current,
            feed_forward: forward,
        } = controller;
        check_common(current, forward, limits, period)?;
        let (inputs, outputs, own) = match form {
            SampledForm::Designed(system) => {
                let own = match system.domain {
                    Domain::Sampled { period } => period,
                    Domain::Continuous => 0.0,
                };
                (system.inputs(), system.outputs(), own)
            }
            SampledForm::Exported(export) => (1, 1, export.period),
        };
        let wanted = period * f64::from(*every);
        if inputs != 1 || outputs != 1 || (own - wanted).abs() > 1e-6 * wanted || *every == 0 {
            return Err(AxisError::Controller {
                inputs,
                outputs,
                period: own,
                wanted,
            });
        }
        let system = match form {
            SampledForm::Designed(system) => Behind::Designed(Running::new(system)?),
            SampledForm::Exported(export) => {
                export.check()?;
                Behind::Exported(export.running())
            }
        };
        Ok(Sampled {
            system,
            per_radian: unit.per_radian(),
            every: *every,
            count: 0,
            output: 0.0,
            forward_speed: Derivative::new(forward.filter, period, angle),
            forward_acceleration: Derivative::new(forward.filter, period, 0.0),
            k2: forward.acceleration_gain(),
            limit: limits.current,
            current_regulator: Regulator::new(
                current.gain,
                current.integral_time,
                period,
                limits.voltage,
            ),
        })
    }
}

impl Sampled {
    /// The set-point of the current, A, for a set-point and a measured angle, rad: the law and the feed-forward of acceleration, cut.
    #[inline]
    pub fn current(&mut self, reference: f64, angle: f64) -> f64 {
        if self.count == 0 {
            let error = (reference - angle) * self.per_radian;
            self.output = self.system.step(error);
            self.count = self.every;
        }
        self.count -= 1;
        let reference_speed = self.forward_speed.step(reference);
        let forward = self.k2 * self.forward_acceleration.step(reference_speed);
        (self.output + forward).clamp(-self.limit, self.limit)
    }
}

impl Law for Sampled {
    #[inline]
    fn step(&mut self, reference: f64, measured: Measured) -> f64 {
        let wanted = self.current(reference, measured.angle);
        self.current_regulator.act(wanted - measured.current, 0.0)
    }
}

fn check_common(
    current: &CurrentGains,
    forward: &FeedForward,
    limits: Limits,
    period: f64,
) -> Result<(), AxisError> {
    positive("the sample period", period)?;
    positive("the supply voltage", limits.voltage)?;
    positive("the peak current", limits.current)?;
    positive("the gain of the current loop", current.gain)?;
    positive(
        "the integral time of the current loop",
        current.integral_time,
    )?;
    not_negative("the filter of the feed-forward", forward.filter)?;
    not_negative("J/Kc of the feed-forward", forward.inertia_over_torque)?;
    for (what, value) in [
        ("the feed-forward of speed", forward.speed),
        ("the feed-forward of current", forward.current),
    ] {
        if !(0.0..=1.0).contains(&value) {
            return Err(AxisError::Parameter {
                what,
                value,
                wanted: "0 to 1",
            });
        }
    }
    Ok(())
}
