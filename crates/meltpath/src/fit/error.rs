//! Why nothing was fitted.

use meltpath_thermal::calibration::coupon::CouponError;
use meltpath_thermal::calibration::fit::FitError;
use meltpath_thermal::charts::build::BuildError;
use meltpath_thermal::charts::simulation::ChartSimulationError;
use meltpath_thermal::solver::SolverError;

use crate::cancel::{Stop, cancellable, stops};
use crate::data::DataFileError;

/// Why nothing was fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitCommandError {
    /// What stops any command.
    #[error(transparent)]
    Stop(#[from] Stop),
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

stops!(FitCommandError);

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
