//! Why nothing was fitted.

use meltpath_thermal::calibration::coupon::CouponError;
use meltpath_thermal::calibration::fit::FitError;
use meltpath_thermal::charts::build::BuildError;
use meltpath_thermal::charts::simulation::ChartSimulationError;
use meltpath_thermal::solver::SolverError;

use crate::cancel::{Stop, cancellable, stops};
use crate::data::DataFileError;

meltpath_base::passes_on! {
    /// Why nothing was fitted.
    pub enum FitCommandError {
        /// What stops any command.
        Stop(Stop),
        /// The material.
        Material(DataFileError),
        /// A simulation.
        Coupon[CouponError],
        /// The fit.
        Fit[FitError<CouponError>],
    }
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
