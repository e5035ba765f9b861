//! Why nothing was fitted.

use meltpath_base::Cancelled;
use meltpath_base::output::OutputError;
use meltpath_thermal::calibration::coupon::CouponError;
use meltpath_thermal::calibration::fit::FitError;
use meltpath_thermal::charts::build::BuildError;
use meltpath_thermal::charts::simulation::ChartSimulationError;
use meltpath_thermal::solver::SolverError;

use super::measurements::MeasurementsError;
use crate::cancel::cancellable;
use crate::data::DataFileError;
use crate::job::JobError;

/// Why nothing was fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitCommandError {
    /// The person stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A file that cannot be read.
    #[error(transparent)]
    Job(#[from] JobError),
    /// Output.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The file.
    #[error(transparent)]
    Measurements(#[from] MeasurementsError),
    /// The material.
    #[error(transparent)]
    Material(#[from] DataFileError),
    /// A simulation.
    #[error(transparent)]
    Coupon(CouponError),
    /// The fit.
    #[error(transparent)]
    Fit(FitError<CouponError>),
}

cancellable!(FitCommandError:
    CouponError => Coupon,
        CouponError::Charts(BuildError::Solver(SolverError::Cancelled(c)))
        | CouponError::Simulation(ChartSimulationError::Cancelled(c)) => c;
);

impl From<FitError<CouponError>> for FitCommandError {
    fn from(error: FitError<CouponError>) -> Self {
        match error {
            FitError::Model(coupon) => coupon.into(),
            other => FitCommandError::Fit(other),
        }
    }
}
