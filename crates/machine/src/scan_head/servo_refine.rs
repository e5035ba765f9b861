//! The gains of a cascade refined by a swarm on simulated runs: friction, limits and all.
//!
//! Source: Rasoanarivo 2020, § 2.2.3 and annex B: the eight parameters of the cascade minimise the mean square difference
//! between the recorded angle of driver and motor and the simulated one, both under the same multi-step signal. Several runs at once
//! (delays, motors that differ), the rule that none of them may get worse, and the delay margins are ours: a swarm that sees
//! one motor with one delay buys the last bit of its error with everything else.

use std::f64::consts::PI;

use meltpath_base::Observer;
use meltpath_control::swarm::{Optimum, Range, Swarm, SwarmError, minimise};
use serde::{Deserialize, Serialize};

use super::axis::Axis;
use super::galvanometer::{AxisError, Galvanometer};
use super::servo::{Loop, ServoModel};
use super::servo_compare::{TrackingError, run};
use super::servo_loop::{CascadeGains, Controller, CurrentGains, FeedForward};
use super::servo_synthesis::Targets;

/// How far the swarm looks: gains and times from 1/`reach` to `reach` times their start.
pub const REACH: f64 = 10.0;

/// Gains that bring less than this share are not worth a change.
const WORTH: f64 = 1e-3;

/// A parameter within this share of its range from an end of it, or a margin within it of what is asked, is held there.
const HELD: f64 = 0.01;

/// The eight parameters, as people call them.
const NAMES: [&str; 8] = ["K_ii", "T_ii", "K_iω", "T_iω", "K_θ", "T_dθ", "K1", "K2"];

/// What an axis is asked to do: set-points before the pre-filter and wanted angles (rad), one of each a sample, from rest.
#[derive(Debug, Clone, Copy)]
pub struct Signal<'a> {
    /// Set-points.
    pub set_points: &'a [f64],
    /// Wanted angles: a record of the real drive, or the set-points themselves.
    pub wanted: &'a [f64],
    /// Time between samples, s.
    pub period: f64,
}

/// One of the runs by which gains are judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// What it stands for, for people.
    pub name: String,
    /// Motor, drive, delay, pre-filter and sensor; its controller is replaced.
    pub axis: Axis,
}

/// What the gains at the start and the refined ones do in one run; none where the axis ran away.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// Which run.
    pub name: String,
    /// Difference to the wanted angles with the gains at the start.
    pub before: Option<TrackingError>,
    /// And with the refined ones.
    pub after: Option<TrackingError>,
}

impl Compared {
    /// Error after over error before; 0 where only the refined gains survive, infinite where they do not.
    fn ratio(before: Option<f64>, after: Option<f64>) -> f64 {
        match (before, after) {
            (_, None) => f64::INFINITY,
            (None, Some(_)) => 0.0,
            (Some(before), Some(after)) => after / before.max(f64::MIN_POSITIVE),
        }
    }
}

/// What stopped the swarm from going further.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Held {
    /// A parameter at an end of its range.
    Range {
        /// Which one.
        parameter: String,
        /// Its value.
        value: f64,
    },
    /// A loop at its phase or delay margin.
    Margin {
        /// Which one.
        which: Loop,
    },
}

/// Gains before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Refined {
    /// The refined gains; those at the start where none did better.
    pub gains: CascadeGains,
    /// Every run, before and after.
    pub runs: Vec<Compared>,
    /// Whether something was gained; no run is worse then.
    pub gained: bool,
    /// What held the swarm back.
    pub held: Vec<Held>,
    /// The swarm's way; its cost is the mean of the runs' errors over those at the start.
    pub search: Optimum,
}

/// Why gains are not refined.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// Set-points and record differ in length.
    #[error(
        "{set_points} set-points and {record} recorded angles: one angle a set-point is needed, without gaps"
    )]
    Lengths {
        /// Number of set-points.
        set_points: usize,
        /// Number of angles.
        record: usize,
    },
    /// The start runs away wherever it is tried, or nothing is tried.
    #[error(
        "the axis runs away with the gains at the start in all of its {runs} runs: start from slower loops, or shorten the delay"
    )]
    Unstable {
        /// How many were tried.
        runs: usize,
    },
    /// The axis.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// The swarm.
    #[error(transparent)]
    Swarm(#[from] SwarmError),
}

/// Which gains may be tried.
#[derive(Debug, Clone, Copy)]
pub enum Bounds<'a> {
    /// Any: on a record the drive has what it has.
    Reach,
    /// Those whose loops keep the margins of `targets` on a motor, as phase and as delay, and whose integrals are not shorter than
    /// a sample: a shorter one adds more in a sample than the proportional part.
    Margins {
        /// The motor.
        motor: &'a Galvanometer,
        /// Margins and crossovers.
        targets: &'a Targets,
    },
}

/// What a loop may lack of its margin, rad: 2°, as in the synthesis.
const SLACK: f64 = 2.0 * PI / 180.0;

/// Phase (rad) and delay (s) that a loop has to spare.
#[derive(Debug, Clone, Copy)]
struct Spare {
    phase: f64,
    delay: f64,
}

const LOOPS: [Loop; 3] = [Loop::Current, Loop::Speed, Loop::Position];

fn spare(motor: &Galvanometer, gains: &CascadeGains) -> [Option<Spare>; 3] {
    let model = ServoModel::new(motor, gains);
    LOOPS.map(|which| {
        let figures = model.figures(which)?;
        Some(Spare {
            phase: figures.crossover.value,
            delay: figures.margins.delay?.value,
        })
    })
}

impl Bounds<'_> {
    /// What loops have to keep: the targets' margins, or those of the start where it has less.
    fn floor(&self, start: &CascadeGains) -> [Option<Spare>; 3] {
        let Bounds::Margins { motor, targets } = self else {
            return [None; 3];
        };
        let own = spare(motor, start);
        let asked = [targets.current, targets.speed, targets.position];
        std::array::from_fn(|k| {
            let phase = asked[k].margin - SLACK;
            let asked = Spare {
                phase,
                delay: phase / asked[k].crossover,
            };
            Some(own[k].map_or(asked, |own| Spare {
                phase: asked.phase.min(own.phase),
                delay: asked.delay.min(own.delay),
            }))
        })
    }

    /// By how much the loops stay above a floor, relative; infinite without one, negative below.
    fn clearance(&self, gains: &CascadeGains, floor: &[Option<Spare>; 3]) -> [f64; 3] {
        let Bounds::Margins { motor, .. } = self else {
            return [f64::INFINITY; 3];
        };
        let own = spare(motor, gains);
        std::array::from_fn(|k| match (own[k], floor[k]) {
            (Some(own), Some(floor)) => {
                (own.phase / floor.phase - 1.0).min(own.delay / floor.delay - 1.0)
            }
            _ => f64::NEG_INFINITY,
        })
    }

    fn ranges(&self, first: &[f64; 8], period: f64) -> Vec<Range> {
        first
            .iter()
            .enumerate()
            .map(|(k, &x)| match (k, self) {
                (6.., _) => Range::linear(0.0, 1.0),
                (1 | 3, Bounds::Margins { .. }) => {
                    Range::logarithmic((x / REACH).max(period.min(x)), x * REACH)
                }
                _ => Range::logarithmic(x / REACH, x * REACH),
            })
            .collect()
    }
}

/// K_ii, T_ii, K_iω, T_iω, K_θ, T_dθ, K1, K2.
fn unknowns(g: &CascadeGains) -> [f64; 8] {
    [
        g.current.gain,
        g.current.integral_time,
        g.speed_gain,
        g.speed_integral_time,
        g.position_gain,
        g.position_derivative_time,
        g.feed_forward.speed,
        g.feed_forward.current,
    ]
}

fn gains(x: &[f64], start: &CascadeGains) -> CascadeGains {
    CascadeGains {
        current: CurrentGains {
            gain: x[0],
            integral_time: x[1],
        },
        speed_gain: x[2],
        speed_integral_time: x[3],
        position_gain: x[4],
        position_derivative_time: x[5],
        feed_forward: FeedForward {
            speed: x[6],
            current: x[7],
            ..start.feed_forward
        },
        unit: start.unit,
    }
}

/// The error of one run; none where the axis runs away.
fn difference(
    trial: &Trial,
    gains: &CascadeGains,
    signal: &Signal<'_>,
) -> Result<Option<TrackingError>, AxisError> {
    let axis = Axis {
        controller: Controller::Cascade(*gains),
        ..trial.axis.clone()
    };
    match run(&axis, signal.set_points, signal.period, 1) {
        Ok(simulated) => Ok(Some(TrackingError::of(signal.wanted, &simulated.angle))),
        Err(AxisError::RanAway { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}

/// Refines the gains of a cascade for the least mean of the runs' errors, each over its error with the gains at the start. Gains that do
/// worse than the start in any run, or whose loops leave their `bounds`, are no candidates; the start is one: the result is
/// never worse in any run.
///
/// # Errors
/// [`RefineError`].
pub fn refine(
    trials: &[Trial],
    start: &CascadeGains,
    signal: &Signal<'_>,
    bounds: Bounds<'_>,
    swarm: &Swarm,
    observer: &dyn Observer,
) -> Result<Refined, RefineError> {
    if signal.set_points.len() != signal.wanted.len() || signal.wanted.is_empty() {
        return Err(RefineError::Lengths {
            set_points: signal.set_points.len(),
            record: signal.wanted.len(),
        });
    }
    let all = |g: &CascadeGains| -> Result<Vec<Option<TrackingError>>, AxisError> {
        trials.iter().map(|t| difference(t, g, signal)).collect()
    };
    let before = all(start)?;
    if before.iter().all(Option::is_none) {
        return Err(RefineError::Unstable { runs: trials.len() });
    }
    let reference: Vec<Option<f64>> = before
        .iter()
        .map(|e| e.as_ref().map(TrackingError::rms))
        .collect();
    let floor = bounds.floor(start);
    let cost = |x: &[f64]| {
        let tried = gains(x, start);
        if bounds.clearance(&tried, &floor).iter().any(|c| *c < -1e-9) {
            return f64::INFINITY;
        }
        let (mut sum, mut worst) = (0.0, 0.0f64);
        for (trial, reference) in trials.iter().zip(&reference) {
            let error = difference(trial, &tried, signal)
                .ok()
                .flatten()
                .map(|e| e.rms());
            let ratio = Compared::ratio(*reference, error);
            worst = worst.max(ratio);
            sum += ratio;
            if worst.is_infinite() {
                return f64::INFINITY;
            }
        }
        // worse somewhere: worse than the start, but the swarm is told by how much
        if worst > 1.0 {
            worst
        } else {
            sum / trials.len() as f64
        }
    };
    let first = unknowns(start);
    let ranges = bounds.ranges(&first, signal.period);
    let search = minimise(cost, &ranges, Some(&first), swarm, observer)?;
    let gained = search.cost < 1.0 - WORTH;
    let found = if gained {
        gains(&search.values, start)
    } else {
        *start
    };
    let held = if gained {
        held(&search.values, &ranges, bounds.clearance(&found, &floor))
    } else {
        Vec::new()
    };
    let runs = trials
        .iter()
        .zip(before)
        .zip(all(&found)?)
        .map(|((trial, before), after)| Compared {
            name: trial.name.clone(),
            before,
            after,
        })
        .collect();
    Ok(Refined {
        gains: found,
        runs,
        gained,
        held,
        search,
    })
}

/// Parameters at the ends of their ranges (full feed-forward is meant to be there) and loops at their margins.
fn held(values: &[f64], ranges: &[Range], clearance: [f64; 3]) -> Vec<Held> {
    let at_an_end = values
        .iter()
        .zip(ranges)
        .enumerate()
        .filter(|(k, (value, range))| {
            let share = range.share(**value);
            share < HELD || (*k < 6 && share > 1.0 - HELD)
        })
        .map(|(k, (&value, _))| Held::Range {
            parameter: NAMES[k].to_owned(),
            value,
        });
    let at_a_margin = LOOPS
        .into_iter()
        .zip(clearance)
        .filter(|(_, c)| *c < HELD)
        .map(|(which, _)| Held::Margin { which });
    at_an_end.chain(at_a_margin).collect()
}
