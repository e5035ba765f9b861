//! Why an axis is not tuned.

use meltpath_base::Cancelled;
use meltpath_control::export::ExportError;
use meltpath_numerics::swarm::SwarmError;
use meltpath_perception::RecordError;
use meltpath_scan_head::axis::error::AxisError;
use meltpath_scan_head::servo::compare::ScatterError;
use meltpath_scan_head::servo::h_infinity::HInfinityError;
use meltpath_scan_head::servo::refine::RefineError;
use meltpath_scan_head::servo::robust::RobustError;
use meltpath_scan_head::servo::synthesis::ServoError;

use crate::cancel::{Stop, stops};

/// Why an axis is not tuned.
#[derive(Debug, thiserror::Error)]
pub enum TuneError {
    /// One of its steps.
    #[error("{axis} axis, {step}: {source}")]
    Step {
        /// Which axis.
        axis: char,
        /// Which step.
        step: &'static str,
        /// Why.
        source: StepError,
    },
    /// The record of a refinement.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A record that was sampled otherwise than the head.
    #[error(
        "the record is sampled every {found:.4} µs, the head every {wanted:.4} µs: refine on a record at the head's rate"
    )]
    Sampling {
        /// The record's, µs.
        found: f64,
        /// The head's, µs.
        wanted: f64,
    },
    /// What stops any command.
    #[error(transparent)]
    Stop(#[from] Stop),
}

stops!(TuneError);

/// Why a step of the tuning fails.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The cascade.
    #[error(transparent)]
    Servo(#[from] ServoError),
    /// The refinement.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The H-infinity controller.
    #[error(transparent)]
    Hinf(#[from] HInfinityError),
    /// The search for a spread of motors.
    #[error(transparent)]
    Robust(#[from] RobustError),
    /// The comparison.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// The scattered motors.
    #[error(transparent)]
    Scatter(#[from] ScatterError),
    /// The export.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// A linear system.
    #[error(transparent)]
    System(#[from] meltpath_control::SystemError),
}

impl StepError {
    /// Whether the person stopped it.
    fn cancelled(&self) -> Option<Cancelled> {
        match self {
            StepError::Refine(RefineError::Swarm(SwarmError::Cancelled(c)))
            | StepError::Robust(RobustError::Swarm(SwarmError::Cancelled(c)))
            | StepError::Scatter(ScatterError::Cancelled(c)) => Some(*c),
            _ => None,
        }
    }
}

/// The error of a step of an axis.
pub(crate) fn step<E: Into<StepError>>(
    axis: char,
    step: &'static str,
) -> impl FnOnce(E) -> TuneError {
    move |source| {
        let source = source.into();
        match source.cancelled() {
            Some(c) => c.into(),
            None => TuneError::Step { axis, step, source },
        }
    }
}
