//! Why a scan-head job could not be done.

use meltpath_programs::toolpath_3mf::ToolpathFileWriteError;
use meltpath_scan_head::head::error::HeadError;
use meltpath_thermal::pool::fusion::FusionError;

use super::heat::HeatError;
use crate::cancel::{Stop, cancellable, stops};

/// Why a scan-head job could not be done. Nothing was written then.
#[derive(Debug, thiserror::Error)]
pub enum LpbfError {
    /// What stops any command.
    #[error(transparent)]
    Stop(#[from] Stop),
    /// The scan head.
    #[error(transparent)]
    Head(HeadError),
    /// A 3MF toolpath cannot be written.
    #[error(transparent)]
    Toolpath(#[from] ToolpathFileWriteError),
    /// What the laser melts.
    #[error("cannot tell what the laser melts: {0}")]
    Heat(HeatError),
}

stops!(LpbfError);

cancellable!(LpbfError:
    HeadError => Head, HeadError::Cancelled(c) => c;
    HeatError => Heat, HeatError::Fusion(FusionError::Cancelled(c)) => c;
);
