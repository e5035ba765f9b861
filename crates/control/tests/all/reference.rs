//! The two-axis reference motor (docs/theory/sources.md, reference heads) behind its current loop.

use meltpath_control::{StateSpace, SystemError, TransferFunction};

/// The motor with its current loop: current set-point (A) to angle (deg); Rasoanarivo 2020, eq. 3.27-3.39.
pub(crate) fn reference_plant() -> Result<StateSpace, SystemError> {
    plant_with_mode(1.0)
}

/// The same with the pulsation of its flexible mode multiplied by `shift`.
pub(crate) fn plant_with_mode(shift: f64) -> Result<StateSpace, SystemError> {
    let (r, l, kc, j, b) = (2.79, 180e-6, 6.17e-3, 4.530_873_193_067_997_5e-8, 3e-6);
    let (w, xi) = (shift * 2.0 * std::f64::consts::PI * 4000.0, 0.015);
    let kr = 0.3 * kc / j;
    let (k, t) = (1.91, 7e-5);
    let deg = 180.0 / std::f64::consts::PI;
    let ke = kc;
    TransferFunction::new(
        [
            deg * k * t * (kc + j * kr),
            deg * k * (kc + j * kr + 2.0 * kc * t * w * xi + b * kr * t),
            deg * k * (kc * t * w * w + 2.0 * kc * xi * w + b * kr),
            deg * k * kc * w * w,
        ],
        [
            j * l * t,
            t * (b * l + j * k + j * r + 2.0 * j * l * w * xi),
            j * k
                + b * k * t
                + b * r * t
                + kc * ke * t
                + j * l * t * w * w
                + 2.0 * b * l * t * w * xi
                + 2.0 * j * k * t * w * xi
                + 2.0 * j * r * t * w * xi
                + j * ke * kr * t,
            b * k
                + b * l * t * w * w
                + j * k * t * w * w
                + j * r * t * w * w
                + 2.0 * j * k * w * xi
                + 2.0 * b * k * t * w * xi
                + 2.0 * b * r * t * w * xi
                + 2.0 * kc * ke * t * w * xi
                + b * ke * kr * t,
            j * k * w * w
                + b * k * t * w * w
                + b * r * t * w * w
                + kc * ke * t * w * w
                + 2.0 * b * k * w * xi,
            b * k * w * w,
            0.0,
        ],
    )?
    .to_state_space()
}
