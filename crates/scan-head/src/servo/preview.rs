//! Set-points shaped with the path ahead known: axes made alike, or both made to arrive without lag.
//!
//! The path of a scan job is known before it is run. A filter over past *and* coming set-points, one for each mirror, turns the response
//! of the axis behind it into a wanted one: that of the slower axis (synchronisation, nothing ahead is needed), or the path itself
//! (preview), smoothed alike to both sides and on both axes as far as the drives need it. Least squares in time: E. Gross, M. Tomizuka,
//! W. Messner, "Cancellation of discrete time unstable zeros by feedforward control", J. Dyn. Syst. Meas. Control 116 (1994), by
//! finite responses; the weight on slow errors, the bound on the filter's size and the smoothing that keeps the drives within their
//! limits are ours. The response is taken from the simulated axis without friction, so that any controller will do.
//!
//! Why the limits matter: behind the cascade of the three-axis reference head an impulse that the drive cuts away for a single sample
//! leaves an error that only the position loop's slow pole takes back, K_θ/(1 + K_θT_dθ) = 16 1/s.

use meltpath_control::Matrix;
use meltpath_numerics::dense::solve;
use serde::{Deserialize, Serialize};

use crate::axis::chain::{Axis, Encoder};
use crate::axis::control::Limits;
use crate::axis::error::{AxisError, positive};
use crate::axis::friction::Friction;

/// A filter of set-points: `y[k] = Σ taps[i] r[k + ahead − i]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preview {
    /// Weights, the one of the farthest coming set-point first; their sum is 1.
    pub taps: Vec<f64>,
    /// Coming set-points that are used.
    pub ahead: usize,
}

/// How filters are made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreviewDesign {
    /// Time over which the axis' response is taken, s.
    pub response: f64,
    /// Time of the filter to either side, s.
    pub reach: f64,
    /// Memory of the errors that are weighed, s: errors slower than this count as one kept up for it.
    pub memory: f64,
    /// Weight of the filter's own size; larger is gentler on current and voltage.
    pub gentleness: f64,
    /// Room that a preview leaves to the drives' limits: they hold for changes of speed larger by this factor.
    pub room: f64,
}

impl Default for PreviewDesign {
    /// 60 ms of response (a slow integral has a long tail), filters of 1.5 ms to either side.
    fn default() -> Self {
        PreviewDesign {
            response: 60e-3,
            reach: 1.5e-3,
            memory: 3e-3,
            gentleness: 1e-3,
            room: 1.2,
        }
    }
}

/// Filters of both mirrors' set-points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Previews {
    /// Of X and Y.
    pub mirrors: [Preview; 2],
    /// Time by which the path is smoothed to either side (half the base of a triangle), s; 0 for not at all.
    pub smoothing: f64,
}

/// The small set-point that the response is taken with, rad.
const SMALL: f64 = 1e-4;
/// Limits that no small set-point meets.
const UNLIMITED: Limits = Limits {
    voltage: 1e9,
    current: 1e9,
};

/// An axis without what is not linear, but for its limits.
fn smooth(axis: &Axis) -> Axis {
    let mut smooth = axis.clone();
    smooth.motor.friction = Friction::None;
    smooth.encoder = Encoder::default();
    smooth
}

/// The response of a frictionless axis to a set-point of one for one sample, from that sample on.
fn response(axis: &Axis, period: f64, samples: usize) -> Result<Vec<f64>, AxisError> {
    let mut linear = smooth(axis);
    linear.limits = UNLIMITED;
    let mut set_points = vec![0.0; samples];
    if let Some(first) = set_points.first_mut() {
        *first = SMALL;
    }
    let record = linear.start(period, 0.0, 1)?.record(&set_points)?;
    // what comes later is left to the integral: the filter must not make up for it at rest
    let sum: f64 = record.angle.iter().sum();
    positive("the response of the axis to a step", sum)?;
    Ok(record.angle.iter().map(|a| a / sum).collect())
}

/// Least squares for the filter in front of one response, made ready.
struct Fitting {
    /// The response under leaky sums.
    heavy: Vec<f64>,
    normal: Matrix,
    ahead: usize,
    taps: usize,
    keep: f64,
}

impl Fitting {
    fn new(own: &[f64], ahead: usize, period: f64, design: &PreviewDesign) -> Self {
        let reach = samples_in(design.reach, period);
        let taps = ahead + reach + 1;
        let length = own.len() + taps;
        let keep = (-period / design.memory).exp();
        let mut heavy = own.to_vec();
        heavy.resize(length, 0.0);
        weigh(&mut heavy, keep);
        let mut normal = Matrix::zeros(taps, taps);
        for i in 0..taps {
            for j in 0..=i {
                let value = product(&heavy, i, &heavy, j);
                normal[(i, j)] = value;
                normal[(j, i)] = value;
            }
        }
        let size = normal[(0, 0)].max(f64::MIN_POSITIVE);
        for i in 0..taps {
            normal[(i, i)] += design.gentleness * design.gentleness * size;
        }
        Fitting {
            heavy,
            normal,
            ahead,
            taps,
            keep,
        }
    }

    /// The filter, of gain one at rest, whose response with the axis comes closest to `aim`; sample `ahead` of it is the present.
    fn filter(&self, mut aim: Vec<f64>) -> Result<Preview, AxisError> {
        aim.resize(self.heavy.len(), 0.0);
        weigh(&mut aim, self.keep);
        // with a multiplier for the gain at rest
        let right = Matrix::from_fn(self.taps, 2, |i, j| match j {
            0 => product(&self.heavy, i, &aim, 0),
            _ => 1.0,
        });
        let found = solve(&self.normal, &right)
            .map_err(|e| AxisError::System(meltpath_control::SystemError::from(e)))?;
        let sum = |j: usize| -> f64 { (0..self.taps).map(|i| found[(i, j)]).sum() };
        let multiplier = (1.0 - sum(0)) / sum(1);
        let taps: Vec<f64> = (0..self.taps)
            .map(|i| found[(i, 0)] + multiplier * found[(i, 1)])
            .collect();
        if taps.iter().all(|w| w.is_finite()) {
            Ok(Preview {
                taps,
                ahead: self.ahead,
            })
        } else {
            Err(AxisError::Parameter {
                what: "the gain of the preview filter at rest",
                value: f64::NAN,
                wanted: "one",
            })
        }
    }
}

fn samples_in(time: f64, period: f64) -> usize {
    (time / period).round().max(1.0) as usize
}

/// Errors of ramps, not of single samples: two leaky sums.
fn weigh(values: &mut [f64], keep: f64) {
    for _ in 0..2 {
        let mut sum = 0.0;
        for v in values.iter_mut() {
            sum = keep * sum + *v;
            *v = sum;
        }
    }
}

/// Σ_n a[n − i] b[n − j].
fn product(a: &[f64], i: usize, b: &[f64], j: usize) -> f64 {
    let from = i.max(j);
    let count = a.len() - from;
    let (a, b) = (&a[from - i..], &b[from - j..]);
    a.iter().zip(b).take(count).map(|(x, y)| x * y).sum()
}

fn checked(design: &PreviewDesign, period: f64) -> Result<usize, AxisError> {
    positive("the sample period", period)?;
    positive("the time of the response", design.response)?;
    positive("the reach of the preview", design.reach)?;
    positive("the memory of the preview", design.memory)?;
    positive("the gentleness of the preview", design.gentleness)?;
    positive("the room that a preview leaves", design.room)?;
    Ok((design.response / period).ceil() as usize)
}

/// A triangle of sum one round sample `ahead`, `half` samples to either side.
fn triangle(ahead: usize, half: f64) -> Vec<f64> {
    let height = |k: usize| (1.0 - (k as f64 - ahead as f64).abs() / half.max(1.0)).max(0.0);
    let mut values: Vec<f64> = (0..=2 * ahead).map(height).collect();
    let sum: f64 = values.iter().sum();
    for v in &mut values {
        *v /= sum;
    }
    values
}

/// Whether the drive of an axis follows a change of speed by `change` rad/s, filtered, without meeting a limit.
fn follows(axis: &Axis, filter: &Preview, change: f64, period: f64) -> Result<bool, AxisError> {
    let taps = filter.taps.len();
    // the speed changes at sample `taps`, seen from one before the filter's first effect on
    let set_points: Vec<f64> = (0..4 * taps)
        .map(|k| {
            let ramp = |i: usize| (k + filter.ahead).saturating_sub(taps + i) as f64;
            let shaped = filter.taps.iter().enumerate().map(|(i, w)| w * ramp(i));
            change * period * shaped.sum::<f64>()
        })
        .collect();
    let mut free = smooth(axis);
    // both run through the whole ramp: how far they travel is not asked here
    free.travel = free
        .travel
        .max(2.0 * change.abs() * period * set_points.len() as f64);
    let mut limited = free.clone();
    free.limits = UNLIMITED;
    limited.limits = axis.limits;
    let done = |axis: &Axis| axis.start(period, 0.0, 1)?.record(&set_points);
    // the same arithmetic, bit for bit, where nothing is cut
    Ok(done(&free)?.voltage == done(&limited)?.voltage)
}

/// Filters after which both axes follow the path without lag. `changes` are the largest changes of speed that the path asks of each
/// mirror at once, rad/s ([`crate::head::ready::ReadyHead::speed_changes`]): where a drive would meet a limit at one of them, the path is smoothed
/// for both axes alike, as little as that needs.
///
/// # Errors
/// [`AxisError`] for an axis that cannot run, or whose drive cannot follow such a change within the filter's reach.
pub fn preview(
    axes: [&Axis; 2],
    period: f64,
    changes: [f64; 2],
    design: &PreviewDesign,
) -> Result<Previews, AxisError> {
    let samples = checked(design, period)?;
    let ahead = samples_in(design.reach, period);
    let fitting = |axis: &Axis| -> Result<Fitting, AxisError> {
        let own = response(axis, period, samples)?;
        Ok(Fitting::new(&own, ahead, period, design))
    };
    let fittings = [fitting(axes[0])?, fitting(axes[1])?];
    let made = |half: f64| -> Result<Option<[Preview; 2]>, AxisError> {
        let aim = triangle(ahead, half);
        let mirrors = [fittings[0].filter(aim.clone())?, fittings[1].filter(aim)?];
        for ((axis, filter), change) in axes.iter().zip(&mirrors).zip(changes) {
            if !follows(axis, filter, design.room * change, period)? {
                return Ok(None);
            }
        }
        Ok(Some(mirrors))
    };
    if let Some(mirrors) = made(1.0)? {
        return Ok(Previews {
            mirrors,
            smoothing: 0.0,
        });
    }
    // half the reach is left for the inverse to ring out
    let (mut low, mut high) = (1.0, 0.5 * ahead as f64);
    let mut best = made(high)?.ok_or(AxisError::Ahead {
        changes_deg: changes.map(f64::to_degrees),
        smoothing: high * period,
    })?;
    while high - low > 0.25 {
        let middle = 0.5 * (low + high);
        match made(middle)? {
            Some(mirrors) => (high, best) = (middle, mirrors),
            None => low = middle,
        }
    }
    Ok(Previews {
        mirrors: best,
        smoothing: high * period,
    })
}

/// Filters after which both axes respond as the slower one does; nothing ahead of the path is used.
///
/// # Errors
/// [`AxisError`] for an axis that cannot run.
pub fn synchronise(
    axes: [&Axis; 2],
    period: f64,
    design: &PreviewDesign,
) -> Result<Previews, AxisError> {
    let samples = checked(design, period)?;
    let both = [
        response(axes[0], period, samples)?,
        response(axes[1], period, samples)?,
    ];
    // the mean delay of a response is its first moment
    let delay = |g: &[f64]| -> f64 { g.iter().enumerate().map(|(k, v)| k as f64 * v).sum() };
    let slower = usize::from(delay(&both[1]) > delay(&both[0]));
    let faster = 1 - slower;
    let [x, y] = both;
    let (own, wanted) = if faster == 0 { (x, y) } else { (y, x) };
    let filter = Fitting::new(&own, 0, period, design).filter(wanted)?;
    let plain = Preview {
        taps: vec![1.0],
        ahead: 0,
    };
    Ok(Previews {
        mirrors: if faster == 0 {
            [filter, plain]
        } else {
            [plain, filter]
        },
        smoothing: 0.0,
    })
}
