//! Laser power that follows the spot's speed.
//!
//! Source: Rasoanarivo 2020, § 2.1 and perspectives: current machines do not modulate the power.

use serde::{Deserialize, Serialize};

/// What the laser's power follows while a mark is lit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum PowerLaw {
    /// Nothing: the mark's own power, as on current machines.
    #[default]
    Constant,
    /// The spot's speed over that of the mark: the same energy a millimetre wherever it is slower. Never more than the mark's
    /// power.
    WithSpeed {
        /// The least power the laser keeps up, W.
        least: f64,
    },
}

impl PowerLaw {
    /// The power, W, of a spot at `speed` mm/s on a mark of its own `power` and `commanded` speed.
    ///
    /// ```
    /// use meltpath_scan_head::head::power::PowerLaw;
    /// let law = PowerLaw::WithSpeed { least: 30.0 };
    /// assert_eq!(law.power(300.0, 1000.0, 500.0), 150.0);
    /// assert_eq!(law.power(300.0, 1000.0, 10.0), 30.0);
    /// assert_eq!(law.power(300.0, 1000.0, 1200.0), 300.0);
    /// assert_eq!(PowerLaw::Constant.power(300.0, 1000.0, 10.0), 300.0);
    /// ```
    pub fn power(self, power: f64, commanded: f64, speed: f64) -> f64 {
        match self {
            PowerLaw::Constant => power,
            PowerLaw::WithSpeed { least } => {
                (power * speed / commanded).clamp(least.min(power), power)
            }
        }
    }
}
