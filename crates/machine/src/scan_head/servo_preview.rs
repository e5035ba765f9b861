//! Set-points shaped with the path ahead known: axes made alike, or both made to arrive without lag.
//!
//! The path of a scan job is known before it is run. A filter over past *and* coming set-points, one for each mirror, turns the response
//! of the axis behind it into a wanted one: that of the slower axis (synchronisation, nothing ahead is needed), or none at all
//! (preview). Least squares in time: E. Gross, M. Tomizuka, W. Messner, "Cancellation of discrete time unstable zeros by
//! feedforward control", J. Dyn. Syst. Meas. Control 116 (1994), by finite responses; the weight on slow errors and the bound on
//! the filter's size are ours. The response is taken from the simulated axis without friction, so that any controller will do.

use meltpath_control::Matrix;
use meltpath_control::dense::solve;
use serde::{Deserialize, Serialize};

use super::axis::{Axis, Encoder};
use super::friction::Friction;
use super::galvanometer::{AxisError, positive};

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
}

impl Default for PreviewDesign {
    /// 60 ms of response (a slow integral has a long tail), filters of 1.5 ms to either side.
    fn default() -> Self {
        PreviewDesign {
            response: 60e-3,
            reach: 1.5e-3,
            memory: 3e-3,
            gentleness: 1e-3,
        }
    }
}

/// The small set-point that the response is taken with, rad.
const SMALL: f64 = 1e-4;

/// The response of a frictionless axis to a set-point of one for one sample, from that sample on.
fn response(axis: &Axis, period: f64, samples: usize) -> Result<Vec<f64>, AxisError> {
    let mut linear = axis.clone();
    linear.motor.friction = Friction::None;
    linear.encoder = Encoder::default();
    // no limit is met by a small enough set-point
    linear.limits.voltage = 1e9;
    linear.limits.current = 1e9;
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

/// What the response behind a filter is to be.
enum Wanted<'a> {
    /// The set-point itself, at once.
    Nothing,
    /// Another axis' response.
    Like(&'a [f64]),
}

/// The filter that brings a response to the wanted one.
fn fit(
    own: &[f64],
    wanted: &Wanted<'_>,
    period: f64,
    design: &PreviewDesign,
) -> Result<Preview, AxisError> {
    let reach = (design.reach / period).round().max(1.0) as usize;
    let ahead = match wanted {
        Wanted::Nothing => reach,
        Wanted::Like(_) => 0,
    };
    let taps = ahead + reach + 1;
    let length = own.len() + taps;
    // the aim, shifted by the samples ahead: time 0 of the path is sample `ahead`
    let mut aim = vec![0.0; length];
    match wanted {
        Wanted::Nothing => aim[ahead] = 1.0,
        Wanted::Like(other) => aim[..other.len()].copy_from_slice(other),
    }
    // errors of ramps, not of single samples: two leaky sums
    let keep = (-period / design.memory).exp();
    let weigh = |values: &mut [f64]| {
        for _ in 0..2 {
            let mut sum = 0.0;
            for v in values.iter_mut() {
                sum = keep * sum + *v;
                *v = sum;
            }
        }
    };
    let mut heavy = vec![0.0; length];
    heavy[..own.len()].copy_from_slice(own);
    weigh(&mut heavy);
    weigh(&mut aim);
    // Σ_n (Σ_i h_i g[n − i] − m[n])²
    let product = |i: usize, other: &[f64], j: usize| -> f64 {
        let from = i.max(j);
        (from..length).map(|n| heavy[n - i] * other[n - j]).sum()
    };
    let mut normal = Matrix::zeros(taps, taps);
    for i in 0..taps {
        for j in 0..=i {
            let value = product(i, &heavy, j);
            normal[(i, j)] = value;
            normal[(j, i)] = value;
        }
    }
    let size = normal[(0, 0)].max(f64::MIN_POSITIVE);
    for i in 0..taps {
        normal[(i, i)] += design.gentleness * design.gentleness * size;
    }
    let right = Matrix::from_fn(taps, 1, |i, _| product(i, &aim, 0));
    let found = solve(&normal, &right)
        .map_err(|e| AxisError::System(meltpath_control::SystemError::from(e)))?;
    let mut weights: Vec<f64> = found.entries().to_vec();
    let sum: f64 = weights.iter().sum();
    positive("the gain of the preview filter at rest", sum)?;
    for w in &mut weights {
        *w /= sum;
    }
    Ok(Preview {
        taps: weights,
        ahead,
    })
}

fn checked(design: &PreviewDesign, period: f64) -> Result<usize, AxisError> {
    positive("the sample period", period)?;
    positive("the time of the response", design.response)?;
    positive("the reach of the preview", design.reach)?;
    positive("the memory of the preview", design.memory)?;
    positive("the gentleness of the preview", design.gentleness)?;
    Ok((design.response / period).ceil() as usize)
}

/// Filters after which both axes follow the path without lag. Validity: axes under a fast integral (H-infinity) without pre-filter. Behind
/// the cascade of the reference heads they make contours worse (0.2 mm where 0.03 mm were), why is not known.
///
/// # Errors
/// [`AxisError`] for an axis that cannot run.
pub fn preview(
    axes: [&Axis; 2],
    period: f64,
    design: &PreviewDesign,
) -> Result<[Preview; 2], AxisError> {
    let samples = checked(design, period)?;
    let one = |axis: &Axis| {
        let own = response(axis, period, samples)?;
        fit(&own, &Wanted::Nothing, period, design)
    };
    Ok([one(axes[0])?, one(axes[1])?])
}

/// Filters after which both axes respond as the slower one does; nothing ahead of the path is used.
///
/// # Errors
/// [`AxisError`] for an axis that cannot run.
pub fn synchronise(
    axes: [&Axis; 2],
    period: f64,
    design: &PreviewDesign,
) -> Result<[Preview; 2], AxisError> {
    let samples = checked(design, period)?;
    let both = [
        response(axes[0], period, samples)?,
        response(axes[1], period, samples)?,
    ];
    // the mean delay of a response is its first moment
    let delay = |g: &[f64]| -> f64 { g.iter().enumerate().map(|(k, v)| k as f64 * v).sum() };
    let slower = usize::from(delay(&both[1]) > delay(&both[0]));
    let faster = 1 - slower;
    let filter = fit(&both[faster], &Wanted::Like(&both[slower]), period, design)?;
    let plain = Preview {
        taps: vec![1.0],
        ahead: 0,
    };
    Ok(if faster == 0 {
        [filter, plain]
    } else {
        [plain, filter]
    })
}
