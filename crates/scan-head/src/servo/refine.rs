//! The gains of a cascade refined by a swarm on simulated runs: friction, limits and all.
//!
//! Source: Rasoanarivo 2020, § 2.2.3 and annex B: the eight parameters of the cascade minimise the mean square difference
//! between the recorded angle of driver and motor and the simulated one, both under the same multi-step signal. Several runs at once
//! (delays, motors that differ), the rule that none of them may get worse, and what feedback has to keep are ours: a swarm that sees
//! one motor with one delay buys the last bit of its error with everything else.

use std::f64::consts::PI;

use meltpath_base::Observer;
use meltpath_numerics::swarm::{Optimum, Range, Swarm, SwarmError, minimise};
use serde::{Deserialize, Serialize};

use crate::axis::chain::Axis;
use crate::axis::control::{CascadeGains, Controller, CurrentGains, FeedForward};
use crate::axis::error::AxisError;
use crate::axis::galvanometer::Galvanometer;
use crate::servo::compare::{TrackingError, run};
use crate::servo::model::{Actions, Loop, ServoModel};
use crate::servo::synthesis::Targets;

/// How far the swarm looks: gains and times from 1/`reach` to `reach` times their start.
pub const REACH: f64 = 10.0;

/// The same for gains whose loops may become a quarter faster or a tenth slower: no further gain leaves such loops.
const NEAR: f64 = 2.0;

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
    /// The position loop at the least bandwidth.
    Bandwidth,
    /// The axis as soft against disturbances as it may be.
    Disturbance,
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

meltpath_base::passes_on! {
    /// Why gains are not refined.
    #[derive(Clone, PartialEq)]
    pub enum RefineError {
        /// The axis.
        Axis(AxisError),
        /// The swarm.
        Swarm(SwarmError);

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
    }
}

/// Which gains may be tried.
#[derive(Debug, Clone, Copy)]
pub enum Bounds<'a> {
    /// Any: on a record the drive has what it has.
    Reach,
    /// Those whose loops keep the margins of `targets` on a motor, as phase and as delay; whose feedback alone keeps its bandwidth
    /// and its stiffness against disturbances but for a share `loss`; and whose integrals are not shorter than a sample: a
    /// shorter one adds more in a sample than the proportional part.
    Loops {
        /// The motor.
        motor: &'a Galvanometer,
        /// Margins and crossovers.
        targets: &'a Targets,
        /// What feedback alone may lose, 0 to below 1. Feed-forward hides a lazy feedback from every
        /// error that is measured without a disturbance. The rule that turns a first maximum into a crossover (ω_c t_m ≈ 3) is no better
        /// than a tenth: on a loop of second order the product is 2.85 at a margin of 65°, 3.8 at 74°.
        loss: f64,
    },
}

/// What a loop may lack of its margin, rad: 2°, as in the synthesis.
const SLACK: f64 = 2.0 * PI / 180.0;

/// How much faster than asked a loop may become: its delay margin is that of the asked phase margin at a crossover a quarter higher.
const FASTER: f64 = 1.25;

/// Cost of gains that lose more, beyond any that a run makes: errors over those at the start.
const OUTSIDE: f64 = 1e6;

const LOOPS: [Loop; 3] = [Loop::Current, Loop::Speed, Loop::Position];

/// Phase (rad) and delay (s) that a loop has to spare.
#[derive(Debug, Clone, Copy)]
struct Spare {
    phase: f64,
    delay: f64,
}

/// What feedback is worth without the set-points: spare phase and delay of its loops, −3 dB of the position loop (rad/s), and how
/// hard it is to push away (A per unit of angle).
#[derive(Debug, Clone, Copy)]
struct Feedback {
    spare: [Option<Spare>; 3],
    bandwidth: Option<f64>,
    stiffness: f64,
}

impl Feedback {
    fn of(motor: &Galvanometer, gains: &CascadeGains) -> Self {
        let model = ServoModel::new(motor, gains);
        Feedback {
            spare: LOOPS.map(|which| {
                let figures = model.figures(which)?;
                Some(Spare {
                    phase: figures.crossover.value,
                    delay: figures.margins.delay?.value,
                })
            }),
            bandwidth: model.bandwidth(Actions::Feedback),
            stiffness: model.softest().recip(),
        }
    }

    /// The least that is asked where this is the start: the targets' margins, or its own where it has less.
    fn floor(&self, targets: &Targets, loss: f64) -> Self {
        let asked = [targets.current, targets.speed, targets.position];
        Feedback {
            spare: std::array::from_fn(|k| {
                let phase = asked[k].margin - SLACK;
                let asked = Spare {
                    phase,
                    delay: phase / (FASTER * asked[k].crossover),
                };
                Some(self.spare[k].map_or(asked, |own| Spare {
                    phase: asked.phase.min(own.phase),
                    delay: asked.delay.min(own.delay),
                }))
            }),
            bandwidth: self.bandwidth.map(|b| (1.0 - loss) * b),
            stiffness: (1.0 - loss) * self.stiffness,
        }
    }

    /// By how much this stays above a floor, relative; negative below.
    fn above(&self, floor: &Feedback) -> [(Held, f64); 5] {
        let share = |own: Option<f64>, floor: Option<f64>| match (own, floor) {
            (Some(own), Some(floor)) => own / floor - 1.0,
            (_, None) => f64::INFINITY,
            (None, Some(_)) => f64::NEG_INFINITY,
        };
        let margin = |k: usize| {
            let (own, floor) = (self.spare[k], floor.spare[k]);
            let phase = share(own.map(|s| s.phase), floor.map(|s| s.phase));
            let delay = share(own.map(|s| s.delay), floor.map(|s| s.delay));
            (Held::Margin { which: LOOPS[k] }, phase.min(delay))
        };
        [
            margin(0),
            margin(1),
            margin(2),
            (Held::Bandwidth, share(self.bandwidth, floor.bandwidth)),
            (Held::Disturbance, self.stiffness / floor.stiffness - 1.0),
        ]
    }
}

impl Bounds<'_> {
    /// What gains have to keep; none where nothing is.
    fn floor(&self, start: &CascadeGains) -> Option<Feedback> {
        match self {
            Bounds::Reach => None,
            Bounds::Loops {
                motor,
                targets,
                loss,
            } => Some(Feedback::of(motor, start).floor(targets, *loss)),
        }
    }

    /// By how much gains stay above a floor; nothing without one.
    fn above(&self, gains: &CascadeGains, floor: Option<&Feedback>) -> Vec<(Held, f64)> {
        match (self, floor) {
            (Bounds::Loops { motor, .. }, Some(floor)) => {
                Feedback::of(motor, gains).above(floor).into()
            }
            _ => Vec::new(),
        }
    }

    fn ranges(&self, first: &[f64; 8], period: f64) -> Vec<Range> {
        first
            .iter()
            .enumerate()
            .map(|(k, &x)| match (k, self) {
                (6.., _) => Range::linear(0.0, 1.0),
                (0 | 2 | 4, Bounds::Loops { .. }) => Range::logarithmic(x / NEAR, x * NEAR),
                (1 | 3, Bounds::Loops { .. }) => {
                    Range::logarithmic((x / REACH).max(period.min(x)), x * REACH)
                }
                _ => Range::logarithmic(x / REACH, x * REACH),
            })
            .collect()
    }
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
    if let Bounds::Loops { loss, .. } = bounds
        && !(0.0..1.0).contains(&loss)
    {
        return Err(RefineError::Axis(AxisError::Parameter {
            what: "the share that feedback may lose",
            value: loss,
            wanted: "0 to below 1",
        }));
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
        let above = bounds.above(&tried, floor.as_ref());
        let lacks = above.iter().map(|(_, share)| -share).fold(0.0, f64::max);
        if lacks > 1e-9 {
            // no run is worth it; the swarm is told which way loops come back
            return OUTSIDE * (1.0 + lacks);
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
            if worst >= OUTSIDE {
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
    let first = start.values();
    let ranges = bounds.ranges(&first, signal.period);
    let search = minimise(cost, &ranges, Some(&first), swarm, observer)?;
    let gained = search.cost < 1.0 - WORTH;
    let found = if gained {
        gains(&search.values, start)
    } else {
        *start
    };
    let held = if gained {
        held(
            &search.values,
            &ranges,
            bounds.above(&found, floor.as_ref()),
        )
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

/// Parameters at the ends of their ranges (full feed-forward is meant to be there) and what stands at its least.
fn held(values: &[f64], ranges: &[Range], above: Vec<(Held, f64)>) -> Vec<Held> {
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
    let at_its_least = above
        .into_iter()
        .filter(|(_, share)| *share < HELD)
        .map(|(what, _)| what);
    at_an_end.chain(at_its_least).collect()
}
