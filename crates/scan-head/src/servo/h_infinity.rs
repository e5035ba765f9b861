//! H-infinity control of an axis: three weights, synthesis, the controller made practical and sampled, and its loop over
//! a spread of motors.
//!
//! Source: Rasoanarivo 2020, chapter 3. The controller replaces the speed and position regulators; the current regulator
//! stays and belongs to the plant (fig. 3.4).

use meltpath_control::balanced::{Reduction, reduce};
use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::h_infinity::{
    MixedSensitivity, SynthesisError, SynthesisOptions, Template, WeightError, synthesise,
};
use meltpath_control::margins::{Margins, bandwidth, lowest};
use meltpath_control::simplify::{Simplified, largest_change, simplify_controller};
use meltpath_control::{
    Complex64, Domain, Matrix, StateSpace, SystemError, TransferFunction, ZeroPoleGain,
};
use meltpath_numerics::halving::halve;
use serde::{Deserialize, Serialize};

use crate::axis::control::{AngleUnit, CurrentGains};
use crate::axis::error::{AxisError, positive};
use crate::axis::galvanometer::{Galvanometer, Mode};
use crate::servo::model::{current_loop, grid_for};
use crate::servo::sampled::{self, Sampling};

meltpath_base::passes_on! {
    /// Why no controller is made.
    #[derive(Clone, PartialEq)]
    pub enum HInfinityError {
        /// The synthesis refused.
        Synthesis(SynthesisError),
        /// The motor or a setting.
        Axis(AxisError);

        /// The changed or sampled controller no longer stabilises its own motor.
        #[error("the controller of order {order} stabilises the motor, but not after {what}: {remedy}")]
        Lost {
            /// Order of the synthesised controller.
            order: usize,
            /// What was done to it.
            what: &'static str,
            /// What to change.
            remedy: &'static str,
        },
    }
}

impl From<SystemError> for HInfinityError {
    fn from(error: SystemError) -> Self {
        HInfinityError::Axis(AxisError::System(error))
    }
}

/// The three weights, by their templates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weights {
    /// Of the sensitivity: bandwidth, precision, modulus margin (W1).
    pub sensitivity: Template,
    /// From set-point to command: how fast and how much the command may act (W2).
    pub command: Template,
    /// With the first, of the response to a disturbance of current (W3).
    pub disturbance: Template,
}

impl Weights {
    /// The thesis' weights for the Y axis of the two-axis head (§ 3.3): a bandwidth of 3000 rad/s.
    ///
    /// # Errors
    /// None in fact: the numbers are sound.
    pub fn thesis() -> Result<Self, WeightError> {
        Ok(Weights {
            sensitivity: Template::new(0.001, 1.001, 3000.0)?,
            command: Template::new(55.0, 0.1, 5e5)?,
            disturbance: Template::new(15.0, 0.9, 300.0)?,
        })
    }
}

/// How a controller is synthesised and made practical.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HInfinityTargets {
    /// The weights.
    pub weights: Weights,
    /// Damping given to the modes of the motor in the synthesis where it is larger than theirs: a controller for a broad
    /// resonance does not rely on where exactly it lies.
    pub least_damping: f64,
    /// Wanted crossover (rad/s): the changes keep the gain there.
    pub crossover: f64,
    /// What is taken off the controller.
    pub changes: Changes,
    /// Sample time of the controller, s.
    pub period: f64,
    /// It acts once in so many samples of the axis, whose current regulator acts at each.
    #[serde(default = "each")]
    pub every: u32,
    /// Amperes in the unit in which the weights count the command; 1 where they count amperes.
    #[serde(default = "one")]
    pub command_unit: f64,
}

fn one() -> f64 {
    1.0
}

fn each() -> u32 {
    1
}

/// Bandwidth of the thesis' weights, rad/s.
const PRINTED_BANDWIDTH: f64 = 3000.0;

/// (J/Kc) ω² of the reference motor (J/Kc = 1.2817·10⁻⁷ A·s²/deg from the printed speed gains) at that bandwidth, A/deg: what
/// a command of the thesis' weights is worth.
const PRINTED_COMMAND: f64 = 1.2817e-7 * PRINTED_BANDWIDTH * PRINTED_BANDWIDTH;

impl HInfinityTargets {
    /// The thesis' weights moved to another motor and bandwidth (rad/s): frequencies in proportion to the bandwidth, commands
    /// in proportion to the current that accelerates the motor at it. For the reference motor and 3000 rad/s they are the printed
    /// ones to 10⁻⁴.
    ///
    /// # Errors
    /// [`WeightError`] for a bandwidth that is not positive.
    pub fn for_motor(
        motor: &Galvanometer,
        unit: AngleUnit,
        bandwidth: f64,
        period: f64,
    ) -> Result<Self, WeightError> {
        let pace = bandwidth / PRINTED_BANDWIDTH;
        Ok(HInfinityTargets {
            weights: Weights {
                sensitivity: Template::new(0.001, 1.001, 3000.0 * pace)?,
                command: Template::new(55.0, 0.1, 5e5 * pace)?,
                disturbance: Template::new(15.0, 0.9, 300.0 * pace)?,
            },
            least_damping: 0.0,
            crossover: bandwidth,
            changes: Changes::Pairs {
                pairs: 1,
                closeness: 0.2,
            },
            period,
            every: 1,
            command_unit: command_unit(motor, unit, bandwidth),
        })
    }
}

/// Amperes that a command of the thesis' weights means for a motor at a bandwidth (rad/s).
pub(super) fn command_unit(motor: &Galvanometer, unit: AngleUnit, bandwidth: f64) -> f64 {
    motor.inertia / motor.torque_constant / unit.per_radian() * bandwidth * bandwidth
        / PRINTED_COMMAND
}

/// How the controller of full order is made smaller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind", deny_unknown_fields)]
pub enum Changes {
    /// The thesis' way: nearly cancelling real pairs, at most this many and this close (relative), are removed; the
    /// slowest pole becomes an integrator.
    Pairs {
        /// How many.
        pairs: usize,
        /// How close, relative.
        closeness: f64,
    },
    /// The slowest pole becomes an integrator, the rest is cut to a number of states by balanced truncation.
    Balanced {
        /// States that stay, the integrator counted.
        order: usize,
    },
}

/// A controller from error angle to current set-point.
#[derive(Debug, Clone, PartialEq)]
pub struct HInfinityServo {
    /// Best level γ*.
    pub level: f64,
    /// As synthesised.
    pub full: ZeroPoleGain,
    /// After the changes.
    pub simplified: Simplified,
    /// The same in state space, continuous.
    pub continuous: StateSpace,
    /// The same sampled by triangle hold: what runs.
    pub sampled: StateSpace,
    /// It acts once in so many samples of the axis.
    pub every: u32,
}

/// Which form of a controller a loop is judged with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// The continuous controller: what the source's figures are about.
    Continuous,
    /// The sampled controller and a held command: what runs.
    Sampled,
}

/// The frequency (rad/s) at which slow errors are judged: 100 Hz, that of a scan line of a few millimetres.
pub const SLOW: f64 = 200.0 * std::f64::consts::PI;

/// What a loop does for one motor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoopQuality {
    /// Factor on the pulsation of every mode.
    pub mode_shift: f64,
    /// Loop delay, s.
    pub delay: f64,
    /// The form judged.
    pub form: Form,
    /// Whether the loop is stable.
    pub stable: bool,
    /// First crossover of the open loop (rad/s) and phase margin (rad); zero where there is none.
    pub crossover: f64,
    /// Phase margin there, rad.
    pub phase_margin: f64,
    /// Smallest distance to the critical point.
    pub modulus_margin: f64,
    /// Gain of the sensitivity at [`SLOW`]: what is left of slow errors, friction's among them.
    pub slow_error: f64,
    /// Frequency (rad/s) below which errors shrink: |S| = 1 for the first time.
    pub error_band: f64,
    /// −3 dB of the closed loop (rad/s), read against one.
    pub bandwidth: f64,
    /// Largest gain of the closed loop.
    pub resonance: f64,
}

/// The motor behind its current regulator: current set-point (A) to angle in the given unit (eq. 3.27-3.39).
///
/// # Errors
/// [`SystemError`] where a parameter is not finite.
pub fn current_plant(
    motor: &Galvanometer,
    current: &CurrentGains,
    unit: AngleUnit,
) -> Result<StateSpace, SystemError> {
    let plant = motor.linear()?;
    let n = plant.order();
    // U = K (i* − i + ∫(i* − i)/T); the integral is the last state
    let row = |i: usize, j: usize| plant.b[(i, 0)] * current.gain * -plant.c[(0, j)];
    let a = Matrix::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
        (true, true) => plant.a[(i, j)] + row(i, j),
        (true, false) => plant.b[(i, 0)] * current.gain / current.integral_time,
        (false, true) => -plant.c[(0, j)],
        (false, false) => 0.0,
    });
    let b = Matrix::from_fn(n + 1, 1, |i, _| {
        if i < n {
            plant.b[(i, 0)] * current.gain
        } else {
            1.0
        }
    });
    let c = Matrix::from_fn(1, n + 1, |_, j| {
        if j < n {
            plant.c[(1, j)] * unit.per_radian()
        } else {
            0.0
        }
    });
    Ok(StateSpace::continuous(a, b, c, Matrix::zeros(1, 1))?.balanced_scaling())
}

/// The same motor with the pulsation of every mode multiplied.
#[must_use]
pub fn with_modes(motor: &Galvanometer, shift: f64) -> Galvanometer {
    let mut moved = motor.clone();
    for mode in &mut moved.modes {
        mode.omega *= shift;
    }
    moved
}

/// Synthesises a controller for a motor behind its current regulator.
///
/// # Errors
/// [`HInfinityError`].
pub fn design(
    motor: &Galvanometer,
    current: &CurrentGains,
    unit: AngleUnit,
    targets: &HInfinityTargets,
) -> Result<HInfinityServo, HInfinityError> {
    motor.check()?;
    positive("the wanted crossover", targets.crossover)?;
    positive("the sample period of the controller", targets.period)?;
    positive("the unit of the command", targets.command_unit)?;
    let mut broad = motor.clone();
    for mode in &mut broad.modes {
        broaden(mode, targets.least_damping);
    }
    let weights = &targets.weights;
    let mut scaled = current_plant(&broad, current, unit)?;
    scaled.b = scaled.b.scaled(targets.command_unit);
    let problem = MixedSensitivity::new(scaled)
        .sensitivity(weights.sensitivity)
        .command(weights.command)
        .disturbance(weights.disturbance)
        .assemble()?;
    let found = synthesise(&problem, &SynthesisOptions::default())?;
    let mut full = ZeroPoleGain::from_state_space(&found.controller, 0, 0)?;
    full.gain *= targets.command_unit;
    let order = full.poles.len();
    let simplified = match targets.changes {
        Changes::Pairs { pairs, closeness } => {
            simplify_controller(&full, targets.crossover, closeness, pairs)?
        }
        Changes::Balanced { order } => {
            let mut changed = simplify_controller(&full, targets.crossover, 0.0, 0)?;
            let (small, _) = reduce(
                &changed.controller.to_state_space()?,
                order,
                Reduction::Truncate,
            )?;
            let mut small = ZeroPoleGain::from_state_space(&small, 0, 0)?;
            // rounding moves the integrator: put it back
            if let Some(slow) = small
                .poles
                .iter_mut()
                .min_by(|a, b| a.norm().total_cmp(&b.norm()))
            {
                *slow = Complex64::default();
            }
            changed.change = largest_change(&full, &small, changed.checked);
            changed.controller = small;
            changed
        }
    };
    let continuous = simplified.controller.to_state_space()?;
    let plant = current_plant(motor, current, unit)?;
    if !is_stable(&continuous.then(&plant)?)? {
        return Err(HInfinityError::Lost {
            order,
            what: "its changes",
            remedy: "remove fewer pairs, or keep more states",
        });
    }
    let sampled = discretise(&continuous, targets.period, Hold::First)?;
    let sampling = Sampling {
        period: targets.period,
        every: targets.every,
    };
    let runs = sampled::current_plant(motor, current, unit, sampling, 0.0)?;
    if !is_stable(&sampled.then(&runs)?)? {
        return Err(HInfinityError::Lost {
            order,
            what: "sampling",
            remedy: "sample faster, or lower the bandwidth",
        });
    }
    Ok(HInfinityServo {
        level: found.optimum,
        full,
        simplified,
        continuous,
        sampled,
        every: targets.every,
    })
}

fn broaden(mode: &mut Mode, damping: f64) {
    mode.damping = mode.damping.max(damping);
}

/// The loop of a controller with the motor's modes shifted by a factor and a loop delay, s.
///
/// # Errors
/// [`SystemError`].
pub fn quality(
    motor: &Galvanometer,
    current: &CurrentGains,
    unit: AngleUnit,
    servo: &HInfinityServo,
    form: Form,
    mode_shift: f64,
    delay: f64,
) -> Result<LoopQuality, SystemError> {
    if form == Form::Sampled {
        let controller = (&servo.sampled, servo.every);
        return sampled_quality(motor, current, unit, controller, mode_shift, delay);
    }
    let moved = with_modes(motor, mode_shift);
    let plant = current_plant(&moved, current, unit)?;
    let grid = grid_for(&moved);
    let exact = servo.continuous.then(&plant)?;
    let late = if delay > 0.0 {
        TransferFunction::constant(1.0)
            .delayed(delay)?
            .pade(PADE)?
            .to_state_space()?
            .then(&exact)?
    } else {
        exact
    };
    let k = &servo.simplified.controller;
    let open = |w: f64| {
        let s = Complex64::new(0.0, w);
        let plant =
            current_loop(&moved, current, s) * moved.speed_over_current(s) * unit.per_radian() / s;
        k.at(s) * plant * Complex64::cis(-w * delay)
    };
    Ok(judged(
        form,
        open,
        &grid,
        is_stable(&late)?,
        mode_shift,
        delay,
    ))
}

/// The same of any sampled controller that acts once in so many samples of the axis, as it runs: current regulator sampled, voltage held
/// and `delay` s late.
///
/// # Errors
/// [`SystemError`].
pub fn sampled_quality(
    motor: &Galvanometer,
    current: &CurrentGains,
    unit: AngleUnit,
    (controller, every): (&StateSpace, u32),
    mode_shift: f64,
    delay: f64,
) -> Result<LoopQuality, SystemError> {
    let Domain::Sampled { period } = controller.domain else {
        return Err(SystemError::Period { period: 0.0 });
    };
    let moved = with_modes(motor, mode_shift);
    let sampling = Sampling { period, every };
    let plant = sampled::current_plant(&moved, current, unit, sampling, delay)?;
    let stable = is_stable(&controller.then(&plant)?)?;
    // by zeros and poles, far cheaper than a solution at every frequency
    let controller = ZeroPoleGain::from_state_space(controller, 0, 0)?;
    let motor = ZeroPoleGain::from_state_space(&plant, 0, 0)?;
    let open = |w: f64| controller.response(w) * motor.response(w);
    let grid = sampled::grid(&moved, period);
    Ok(judged(
        Form::Sampled,
        open,
        &grid,
        stable,
        mode_shift,
        delay,
    ))
}

/// Order of the rational form of a delay when poles are computed.
const PADE: usize = 6;

/// Whether an open loop is stable in unit feedback.
fn is_stable(open: &StateSpace) -> Result<bool, SystemError> {
    let unity = StateSpace::constant(Matrix::identity(1), open.domain);
    Ok(open.feedback(&unity)?.is_stable()?)
}

fn judged(
    form: Form,
    open: impl Fn(f64) -> Complex64,
    grid: &[f64],
    stable: bool,
    mode_shift: f64,
    delay: f64,
) -> LoopQuality {
    let margins = Margins::of(&open, grid);
    let first = margins.phase.first();
    let closed = |w: f64| open(w) / (1.0 + open(w));
    let peak = lowest(|w| 1.0 / closed(w).norm(), grid);
    LoopQuality {
        mode_shift,
        delay,
        form,
        stable,
        crossover: first.map_or(0.0, |m| m.omega),
        phase_margin: first.map_or(0.0, |m| m.value),
        modulus_margin: margins.modulus.value,
        slow_error: 1.0 / (1.0 + open(SLOW)).norm(),
        error_band: rises_to_one(|w| 1.0 / (1.0 + open(w)).norm(), grid),
        bandwidth: bandwidth(closed, grid).unwrap_or(0.0),
        resonance: 1.0 / peak.value,
    }
}

/// The first frequency at which a function that starts below one reaches it; the end of the grid where it does not.
fn rises_to_one(f: impl Fn(f64) -> f64, grid: &[f64]) -> f64 {
    let Some(k) = grid.iter().position(|&w| f(w) >= 1.0) else {
        return grid.last().copied().unwrap_or(0.0);
    };
    if k == 0 {
        return grid[0];
    }
    halve([grid[k - 1], grid[k]], 60, |w| f(w) >= 1.0)[0]
}
