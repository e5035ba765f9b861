//! Why a scan-head job could not be done.

use meltpath_base::Cancelled;
use meltpath_base::output::OutputError;
use meltpath_scan_head::head::error::HeadError;
use meltpath_thermal::pool::fusion::FusionError;

use super::heat::HeatError;
use crate::cancel::cancellable;
use crate::job::JobError;

/// Why a scan-head job could not be done. Nothing was written then.
#[derive(Debug, thiserror::Error)]
pub enum LpbfError {
    /// The person stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The job file.
    #[error(transparent)]
    Job(#[from] JobError),
    /// Output.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The scan head.
    #[error(transparent)]
    Head(HeadError),
    /// What the laser melts.
    #[error("cannot tell what the laser melts: {0}")]
    Heat(HeatError),
}

cancellable!(LpbfError:
    HeadError => Head, HeadError::Cancelled(c) => c;
    HeatError => Heat, HeatError::Fusion(FusionError::Cancelled(c)) => c;
);
