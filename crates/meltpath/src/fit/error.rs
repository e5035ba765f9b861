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
        Fit[FitError<CouponError>];

        /// A beam that melts too little for charts of it.
        #[error(
            "the beam of a body is too weak: under it the hottest point has {reached:.0} °C and never reaches the {stop:.0} °C from which its charts cool; look at the voltage, current and focus of each body, and at prior.efficiency and prior.width"
        )]
        Weak {
            /// Temperature reached, °C.
            reached: f64,
            /// Temperature from which charts cool, °C.
            stop: f64,
        },
    }
}

stops!(FitCommandError);

cancellable!(FitCommandError:
    CouponError => Coupon,
        CouponError::Charts(BuildError::Solver(SolverError::Cancelled(c)))
        | CouponError::Simulation(ChartSimulationError::Cancelled(c)) => c;
);

impl FitCommandError {
    /// The same in words of a file of measurements, which sets no temperatures of charts.
    pub(super) fn of_measurements(self) -> Self {
        match self {
            FitCommandError::Coupon(CouponError::Charts(BuildError::TooCold { reached, stop })) => {
                FitCommandError::Weak { reached, stop }
            }
            other => other,
        }
    }
}

impl From<FitError<CouponError>> for FitCommandError {
    fn from(error: FitError<CouponError>) -> Self {
        match error {
            FitError::Model(coupon) => coupon.into(),
            other => FitCommandError::Fit(other),
        }
    }
}
