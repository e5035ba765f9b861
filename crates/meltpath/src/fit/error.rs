//! Why nothing was fitted.

use meltpath_thermal::calibration::coupon::CouponError;
use meltpath_thermal::calibration::fit::FitError;

use super::measurements::MeasurementsError;
use crate::material::MaterialFileError;

/// Why nothing was fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitCommandError {
    /// The file.
    #[error(transparent)]
    Measurements(#[from] MeasurementsError),
    /// The material.
    #[error(transparent)]
    Material(#[from] MaterialFileError),
    /// A simulation.
    #[error(transparent)]
    Coupon(#[from] CouponError),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] FitError<CouponError>),
}
