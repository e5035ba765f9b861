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

meltpath_base::passes_on! {
    /// Why an axis is not tuned.
    pub enum TuneError {
        /// The record of a refinement.
        Record(RecordError),
        /// What stops any command.
        Stop(Stop);

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
    }
}

stops!(TuneError);

meltpath_base::passes_on! {
    /// Why a step of the tuning fails.
    pub enum StepError {
        /// The cascade.
        Servo(ServoError),
        /// The refinement.
        Refine(RefineError),
        /// The H-infinity controller.
        Hinf(HInfinityError),
        /// The search for a spread of motors.
        Robust(RobustError),
        /// The comparison.
        Axis(AxisError),
        /// The scattered motors.
        Scatter(ScatterError),
        /// The export.
        Export(ExportError),
        /// A linear system.
        System(meltpath_control::SystemError),
    }
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
