//! The gains of a cascade brought closer to a recorded response by a swarm: friction, limits and all.
//!
//! Source: Rasoanarivo 2020, § 2.2.3 and annex B: the eight parameters of the cascade minimise the mean square difference
//! between the recorded angle of driver and motor and the simulated one, both under the same multi-step signal.

use meltpath_base::Observer;
use meltpath_control::swarm::{Optimum, Range, Swarm, SwarmError, minimise};
use serde::{Deserialize, Serialize};

use super::axis::Axis;
use super::galvanometer::AxisError;
use super::servo_compare::{TrackingError, run};
use super::servo_loop::{CascadeGains, Controller, CurrentGains, FeedForward};

/// How far the swarm looks: gains and times from 1/`reach` to `reach` times their start.
pub const REACH: f64 = 10.0;

/// Gains before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Refined {
    /// The refined gains.
    pub gains: CascadeGains,
    /// Difference between record and simulation with the gains at the start.
    pub before: TrackingError,
    /// And with the refined ones.
    pub after: TrackingError,
    /// The swarm's way.
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
    /// The axis.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// The swarm.
    #[error(transparent)]
    Swarm(#[from] SwarmError),
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

/// Refines the gains of a cascade on a record: set-points before the pre-filter and angles (rad), one of each every
/// `period` s, from rest. `axis` tells motor, drive, pre-filter and sensor; its controller is replaced. Gains that are not
/// `admissible` are no candidates: the swarm sees one motor and one signal, and would buy the last bit of error with margins.
///
/// # Errors
/// [`RefineError`].
#[expect(
    clippy::too_many_arguments,
    reason = "what is refined, on what, and how it is searched"
)]
pub fn refine(
    axis: &Axis,
    start: &CascadeGains,
    set_points: &[f64],
    record: &[f64],
    period: f64,
    admissible: impl Fn(&CascadeGains) -> bool + Sync,
    swarm: &Swarm,
    observer: &dyn Observer,
) -> Result<Refined, RefineError> {
    if set_points.len() != record.len() || record.is_empty() {
        return Err(RefineError::Lengths {
            set_points: set_points.len(),
            record: record.len(),
        });
    }
    let difference = |g: CascadeGains| -> Result<TrackingError, AxisError> {
        let trial = Axis {
            controller: Controller::Cascade(g),
            ..axis.clone()
        };
        let simulated = run(&trial, set_points, period, 1)?;
        Ok(TrackingError::of(record, &simulated.angle))
    };
    let before = difference(*start)?;
    let first = unknowns(start);
    let ranges: Vec<Range> = first
        .iter()
        .enumerate()
        .map(|(k, &x)| {
            if k < 6 {
                Range::logarithmic(x / REACH, x * REACH)
            } else {
                Range::linear(0.0, 1.0)
            }
        })
        .collect();
    // gains that run away are no candidates
    let cost = |x: &[f64]| {
        let trial = gains(x, start);
        if !admissible(&trial) {
            return f64::INFINITY;
        }
        difference(trial).map_or(f64::INFINITY, |e| e.rms().powi(2))
    };
    let search = minimise(cost, &ranges, Some(&first), swarm, observer)?;
    let gains = gains(&search.values, start);
    Ok(Refined {
        gains,
        before,
        after: difference(gains)?,
        search,
    })
}
