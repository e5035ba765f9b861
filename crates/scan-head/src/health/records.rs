//! One step and one ramp of a health test, as analysed.

use serde::{Deserialize, Serialize};

/// One step, up or down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Set-point amplitude, deg; negative when falling.
    pub amplitude_deg: f64,
    /// Instant from which the axis is at rest, s after the step begins.
    pub steady_from: f64,
    /// Mean response from then on, deg.
    pub steady_deg: f64,
    /// Time for the response to change by 10⁻⁴ deg, s.
    pub start_delay: f64,
    /// Overshoot, % of the change.
    pub overshoot: f64,
    /// Time to enter the ±5 % band for good, s.
    pub response_time: f64,
    /// Set-point − steady response, deg.
    pub static_error_deg: f64,
}

/// One ramp, up or down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RampRecord {
    /// Programmed speed, deg/s; negative when falling.
    pub speed_deg: f64,
    /// Mean speed of the second half, deg/s.
    pub steady_speed_deg: f64,
    /// Angle covered, deg.
    pub amplitude_deg: f64,
    /// Set-point − response at the end of the ramp, deg.
    pub lag_deg: f64,
    /// Time for the speed to enter ±5 % of the steady one, s.
    pub speed_response_time: f64,
    /// Mean current of the second half, A.
    pub current: f64,
    /// Kc times that current, N·m.
    pub torque: f64,
}
