//! The friction behind the ramps of a health test.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.5 (eq. 2.22).

use crate::axis::error::AxisError;
use crate::health::records::RampRecord;
use serde::{Deserialize, Serialize};

/// Friction fitted to the ramps: T = B ω + T_P + T_C sgn ω (eq. 2.22).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrictionFit {
    /// B, N·m·s/rad.
    pub viscous: f64,
    /// T_P, N·m.
    pub bias: f64,
    /// T_C, N·m.
    pub coulomb: f64,
    /// RMS of what is left, N·m.
    pub residual: f64,
    /// RMS left by B alone, N·m.
    pub residual_viscous: f64,
}

/// Fits T = B ω + T_P + T_C sgn ω to ramps by least squares.
///
/// # Errors
/// [`AxisError::Parameter`] where there are fewer than four ramps or not in both directions.
pub fn fit_friction(ramps: &[RampRecord]) -> Result<FrictionFit, AxisError> {
    let up = ramps.iter().filter(|r| r.speed_deg > 0.0).count();
    let down = ramps.iter().filter(|r| r.speed_deg < 0.0).count();
    if up < 2 || down < 2 {
        return Err(AxisError::Parameter {
            what: "the number of ramps in one direction",
            value: up.min(down) as f64,
            wanted: "2 or more, at different speeds",
        });
    }
    // each direction is a line T = B ω + c; together: a common slope and two intercepts c = T_P ± T_C
    let point = |r: &RampRecord| (r.steady_speed_deg.to_radians(), r.torque);
    let means = |positive: bool| {
        let side = || {
            ramps
                .iter()
                .filter(move |r| (r.speed_deg > 0.0) == positive)
                .map(point)
        };
        let n = side().count() as f64;
        let (sx, sy) = side().fold((0.0, 0.0), |a, p| (a.0 + p.0, a.1 + p.1));
        (sx / n, sy / n)
    };
    let (above, below) = (means(true), means(false));
    let (mut xx, mut xy, mut all_xx, mut all_xy) = (0.0, 0.0, 0.0, 0.0);
    for r in ramps {
        let (x, y) = point(r);
        let (mx, my) = if r.speed_deg > 0.0 { above } else { below };
        xx += (x - mx) * (x - mx);
        xy += (x - mx) * (y - my);
        all_xx += x * x;
        all_xy += x * y;
    }
    if !(xx > 0.0 && xx.is_finite()) {
        return Err(AxisError::Parameter {
            what: "the spread of the ramps' speeds",
            value: xx,
            wanted: "above zero",
        });
    }
    let viscous = xy / xx;
    let (c_up, c_down) = (above.1 - viscous * above.0, below.1 - viscous * below.0);
    let (bias, coulomb) = (0.5 * (c_up + c_down), 0.5 * (c_up - c_down));
    let alone = all_xy / all_xx;
    let rms = |model: &dyn Fn(f64) -> f64| {
        let sum: f64 = ramps
            .iter()
            .map(|r| (point(r).1 - model(point(r).0)).powi(2))
            .sum();
        (sum / ramps.len() as f64).sqrt()
    };
    Ok(FrictionFit {
        viscous,
        bias,
        coulomb,
        residual: rms(&|w| viscous * w + bias + coulomb * w.signum()),
        residual_viscous: rms(&|w| alone * w),
    })
}
