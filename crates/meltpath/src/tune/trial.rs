//! Runs of the comparison signal, and which axes count as lost.

use super::settings::{AxisTask, Settings};
use meltpath_scan_head::axis::chain::{Axis, AxisRecord};
use meltpath_scan_head::axis::error::AxisError;
use meltpath_scan_head::servo::compare::{Draw, MultiStep, TrackingError, run};

/// Time at each step where many runs are made, s: the longer hold of the comparison tells them nothing more.
const SHORT_HOLD: f64 = 15e-3;

/// An error beyond this share of the first amplitude is a lost axis, even where it does not run away.
const LOST: f64 = 0.05;

/// One run of the comparison signal.
#[derive(Debug, Clone)]
pub(crate) struct Trial {
    pub(crate) error: TrackingError,
    pub(crate) record: AxisRecord,
    pub(crate) peak_current: f64,
}

/// Whether an axis with this largest error (rad) under steps of an `amplitude` counts as lost.
pub(crate) fn is_lost(largest: f64, amplitude: f64) -> bool {
    largest > LOST * amplitude
}

/// Root mean square and largest error (rad), in ascending order, of scattered motors that neither ran away nor ring under steps of
/// an `amplitude`, rad.
pub(crate) fn errors_kept(draws: &[Draw], amplitude: f64) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = draws
        .iter()
        .filter_map(|d| d.error)
        .filter(|e| !is_lost(e.1, amplitude))
        .collect();
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    kept
}

/// The comparison signal with its holds cut.
pub(crate) fn short_signal(task: &AxisTask, settings: &Settings) -> Result<Vec<f64>, AxisError> {
    let signal = MultiStep {
        hold: SHORT_HOLD.min(task.signal.hold),
        ..task.signal
    };
    signal.samples(settings.data.head.period)
}

/// One run of the comparison signal.
pub(crate) fn trial(
    axis: &Axis,
    set_points: &[f64],
    settings: &Settings,
) -> Result<Trial, AxisError> {
    let record = run(
        axis,
        set_points,
        settings.data.head.period,
        *settings.file.compare.seed,
    )?;
    Ok(Trial {
        error: TrackingError::of(set_points, &record.angle),
        peak_current: record.current.iter().fold(0.0, |m, i| f64::max(m, i.abs())),
        record,
    })
}
