//! Why a head cannot execute a job.

use crate::axis::error::AxisError;
use crate::head::vector::ScanJobError;
use crate::optics::correction::CorrectionError;
use crate::optics::geometry::GeometryError;
use meltpath_base::Cancelled;

meltpath_base::passes_on! {
    /// Why a head could not execute a job.
    #[derive(Clone, PartialEq)]
    pub enum HeadError {
        /// The job.
        Job(ScanJobError),
        /// The correction table.
        Correction(CorrectionError),
        /// The geometry.
        Geometry(GeometryError),
        /// Cancelled.
        Cancelled(Cancelled);

        /// An axis.
        #[error("{axis} axis: {source}")]
        Axis {
            /// `X`, `Y` or `Z`.
            axis: char,
            /// What is wrong.
            source: AxisError,
        },
        /// A layer that cannot be had, in words.
        #[error("{0}")]
        Layer(String),
        /// A vector that leaves the field.
        #[error("vector {index}: {source}")]
        Field {
            /// Position in the job, from 0.
            index: usize,
            /// Where it goes.
            source: CorrectionError,
        },
        /// Delays that leave every mark dark.
        #[error(
            "no mark is lit: the laser-on delay, {:.0} µs, outlasts the longest mark between jumps, {:.0} µs, and the laser-off delay, {:.0} µs: a shorter laser-on delay, or tuned delays",
            1e6 * .on, 1e6 * .longest, 1e6 * .off
        )]
        Dark {
            /// On-delay, s.
            on: f64,
            /// Off-delay, s.
            off: f64,
            /// Duration of the longest chain of marks, s.
            longest: f64,
        },
    }
}
