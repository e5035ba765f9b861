//! The recipe that a head follows: speeds, powers, waits, delays, sky-writing.
//!
//! Source: Rasoanarivo 2020, § 2.5.2 and 2.6; sky-writing: ours.

use crate::head::power::PowerLaw;
use crate::head::vector::ScanJobError;
use serde::{Deserialize, Serialize};

/// Delays of the laser against the commanded marks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LaserDelays {
    /// From the start of a chain of marks to laser on, s.
    pub on: f64,
    /// From its end to laser off, s.
    pub off: f64,
}

/// Run-up and run-out of fill lines, so that they are marked at constant speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SkyWriting {
    /// Time at the line's speed before the line, s.
    pub run_in: f64,
    /// Time at the line's speed after it, s.
    pub run_out: f64,
}

/// Speeds, powers, waits and delays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Name for people.
    pub name: String,
    /// Speed of contour marks, mm/s.
    pub contour_speed: f64,
    /// Speed of fill marks, mm/s.
    pub fill_speed: f64,
    /// Speed of jumps between contours, mm/s.
    pub contour_jump_speed: f64,
    /// Speed of jumps between contour and fill, and from part to part, mm/s.
    pub fill_jump_speed: f64,
    /// Power on contours, W.
    pub contour_power: f64,
    /// Power on fills, W.
    pub fill_power: f64,
    /// Wait after a jump, before a mark, s.
    pub jump_wait: f64,
    /// Wait after a mark, before a jump, s.
    pub mark_wait: f64,
    /// Wait between two marks of a chain, laser on, s.
    pub polygon_wait: f64,
    /// Delays of the laser.
    pub delays: LaserDelays,
    /// What the power follows.
    pub power_law: PowerLaw,
    /// Sky-writing of fill lines; lines have no waits then.
    pub sky_writing: Option<SkyWriting>,
}

impl Recipe {
    /// Checks every value.
    ///
    /// # Errors
    /// [`ScanJobError::Value`].
    pub fn check(&self) -> Result<(), ScanJobError> {
        let fail = |what, value, wanted| {
            Err(ScanJobError::Value {
                what,
                value,
                wanted,
            })
        };
        for (what, value) in [
            ("the contour speed", self.contour_speed),
            ("the fill speed", self.fill_speed),
            (
                "the speed of jumps between contours",
                self.contour_jump_speed,
            ),
            ("the speed of jumps to and from fills", self.fill_jump_speed),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return fail(what, value, "positive and finite (mm/s)");
            }
        }
        for (what, value) in [
            ("the contour power", self.contour_power),
            ("the fill power", self.fill_power),
            (
                "the least power with speed",
                match self.power_law {
                    PowerLaw::Constant => 0.0,
                    PowerLaw::WithSpeed { least } => least,
                },
            ),
            ("the wait after jumps", self.jump_wait),
            ("the wait after marks", self.mark_wait),
            ("the wait between marks", self.polygon_wait),
            ("the laser-on delay", self.delays.on),
            ("the laser-off delay", self.delays.off),
            (
                "the run-up of sky-writing",
                self.sky_writing.map_or(0.0, |s| s.run_in),
            ),
            (
                "the run-out of sky-writing",
                self.sky_writing.map_or(0.0, |s| s.run_out),
            ),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return fail(what, value, "finite and not negative");
            }
        }
        if let PowerLaw::WithSpeed { least } = self.power_law
            && least > self.contour_power.min(self.fill_power)
        {
            return fail(
                "the least power with speed",
                least,
                "at most the power of the marks (W)",
            );
        }
        Ok(())
    }
}
