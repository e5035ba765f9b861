//! The controller's data: the `[motion]` table of a cell file, every number with where it comes from.

use meltpath_base::{Angle, Length, Ratio, Speed, Time};
use serde::{Deserialize, Serialize};

/// A number of a data file with its origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sourced<T> {
    /// The value.
    pub value: T,
    /// One standard deviation, where known.
    #[serde(skip_serializing_if = "Option::is_none", default = "Option::default")]
    pub uncertainty: Option<T>,
    /// Who says so.
    pub source: String,
    /// Page of the source.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub page: Option<String>,
}

/// Dwell at a change of direction, for one value of the smoothing option.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DwellEntry {
    /// Smoothing option: 0 % is point to point.
    pub smoothing: Ratio,
    /// Dwell T_D.
    pub time: Sourced<Time>,
}

/// Which points of a path are changes of direction: see [`crate::interpolation::corner`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CornerLaw {
    /// No dwell where the direction changes by less.
    pub none_below: Sourced<Angle>,
    /// The full dwell where the direction changes by more.
    pub full_above: Sourced<Angle>,
    /// A chain of chords closer than this to a smooth curve is that curve.
    pub chord_error: Sourced<Length>,
}

/// A controller that interpolates by a cascade of two moving averages (FIR), with a dwell at changes of direction.
/// Source of the model: Rouchon 2022, §3.3.1, pp. 62-66.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Controller {
    /// Interpolation period.
    pub period: Sourced<Time>,
    /// Duration T_1 of the first filter: a whole number of periods.
    pub t1: Sourced<Time>,
    /// Duration T_2 of the second filter, at most T_1: a whole number of periods.
    pub t2: Sourced<Time>,
    /// Speed of moves that only turn the tool, and limit of all others' turning; per second.
    pub rotation_speed: Sourced<RotationSpeed>,
    /// Speed of the tool centre point in a joint move at 100 %.
    pub joint_speed: Sourced<Speed>,
    /// Dwell against smoothing, by increasing smoothing from 0 to 100 %; linear between the entries.
    pub dwell: Vec<DwellEntry>,
    /// What a change of direction is.
    pub corner: CornerLaw,
}

/// An angular speed, rad/s inside; files write `"90 deg/s"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationSpeed(
    /// The value in rad/s.
    pub f64,
);

const ROTATION_UNITS: &[meltpath_base::quantity::Unit] = &[
    meltpath_base::quantity::Unit::new("deg/s", std::f64::consts::PI / 180.0),
    meltpath_base::quantity::Unit::new("rad/s", 1.0),
];

impl<'de> Deserialize<'de> for RotationSpeed {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let text = String::deserialize(d)?;
        meltpath_base::quantity::parse(&text, "rotation speed", ROTATION_UNITS)
            .map(RotationSpeed)
            .map_err(serde::de::Error::custom)
    }
}

impl Serialize for RotationSpeed {
    fn serialize<S: serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(&format_args!("{} deg/s", self.0.to_degrees()))
    }
}

/// Why a controller's data cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// A value is not what it must be.
    #[error("[motion] {name} is {value}, but must be {wanted}: correct the cell file")]
    Value {
        /// The entry of the table.
        name: &'static str,
        /// What it holds.
        value: String,
        /// What it must be.
        wanted: &'static str,
    },
    /// The sampling period does not divide a filter.
    #[error(
        "a sampling period of {dt} s does not divide the filters of {t1} s and {t2} s: take the controller's period of {period} s divided by a whole number"
    )]
    Sampling {
        /// The sampling period asked for, s.
        dt: f64,
        /// T_1, s.
        t1: f64,
        /// T_2, s.
        t2: f64,
        /// The controller's period, s.
        period: f64,
    },
}

/// `a / b` where it is a whole number of at least 1 within rounding.
fn whole(a: f64, b: f64) -> Option<usize> {
    let ratio = a / b;
    let n = ratio.round();
    ((1.0..1e6).contains(&n) && (ratio - n).abs() < 1e-6).then_some(n as usize)
}

impl Controller {
    /// T_1 + T_2, s: the duration of every transition, and of the stop at a FINE point.
    pub fn transition(&self) -> f64 {
        self.t1.value.0 + self.t2.value.0
    }

    /// The dwell T_D of a change of direction at the smoothing option `share` (0 to 1), s; linear between the entries.
    pub fn dwell(&self, share: f64) -> f64 {
        let mut last: Option<(f64, f64)> = None;
        for entry in &self.dwell {
            let (x, y) = (entry.smoothing.0, entry.time.value.0);
            if share <= x {
                return match last {
                    Some((x0, y0)) if x > x0 => y0 + (y - y0) * (share - x0) / (x - x0),
                    _ => y,
                };
            }
            last = Some((x, y));
        }
        last.map_or(0.0, |(_, y)| y)
    }

    /// The sampling period nearest to 2 ms that divides the controller's, s.
    pub fn sampling(&self) -> f64 {
        let period = self.period.value.0;
        period / (period / 2e-3).round().max(1.0)
    }

    /// Checks that the data make sense.
    ///
    /// # Errors
    /// [`ControllerError::Value`] naming the entry.
    pub fn check(&self) -> Result<(), ControllerError> {
        let wrong = |name, value: String, wanted| {
            Err(ControllerError::Value {
                name,
                value,
                wanted,
            })
        };
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let period = self.period.value;
        if !positive(period.0) {
            return wrong("period", period.to_string(), "positive");
        }
        for (name, t) in [("t1", self.t1.value), ("t2", self.t2.value)] {
            if !positive(t.0) || whole(t.0, period.0).is_none() {
                return wrong(name, t.to_string(), "a whole number of periods, at least 1");
            }
        }
        if self.t2.value.0 > self.t1.value.0 {
            return wrong("t2", self.t2.value.to_string(), "at most t1");
        }
        if !positive(self.rotation_speed.value.0) {
            let value = self.rotation_speed.value.0.to_string();
            return wrong("rotation_speed", value, "positive");
        }
        if !positive(self.joint_speed.value.0) {
            let value = self.joint_speed.value.to_string();
            return wrong("joint_speed", value, "positive");
        }
        self.check_dwell()?;
        let law = &self.corner;
        let (none, full) = (law.none_below.value.0, law.full_above.value.0);
        if !(none >= 0.0 && none < full && full <= std::f64::consts::PI) {
            let value = format!("{} to {}", law.none_below.value, law.full_above.value);
            return wrong(
                "corner",
                value,
                "an increasing pair of angles up to 180 deg",
            );
        }
        if !positive(law.chord_error.value.0) {
            let value = law.chord_error.value.to_string();
            return wrong("corner.chord_error", value, "positive");
        }
        Ok(())
    }

    fn check_dwell(&self) -> Result<(), ControllerError> {
        let rising = self
            .dwell
            .windows(2)
            .all(|w| w[0].smoothing < w[1].smoothing && w[0].time.value >= w[1].time.value);
        let ends = self.dwell.first().zip(self.dwell.last());
        let whole_range = ends.is_some_and(|(first, last)| {
            first.smoothing.0 == 0.0
                && (first.time.value.0 - self.transition()).abs() < 1e-9
                && last.smoothing.0 == 1.0
                && last.time.value.0 >= 0.0
        });
        if rising && whole_range {
            return Ok(());
        }
        Err(ControllerError::Value {
            name: "dwell",
            value: format!("{} entries", self.dwell.len()),
            wanted: "entries by increasing smoothing from \"0 %\" with t1 + t2 down to \"100 %\", never negative, never rising",
        })
    }

    /// The lengths of the two filters in samples of `dt` s.
    pub(crate) fn taps(&self, dt: f64) -> Result<(usize, usize), ControllerError> {
        let (t1, t2) = (self.t1.value.0, self.t2.value.0);
        whole(t1, dt)
            .zip(whole(t2, dt))
            .ok_or(ControllerError::Sampling {
                dt,
                t1,
                t2,
                period: self.period.value.0,
            })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    #[derive(Deserialize)]
    struct File {
        motion: Controller,
    }

    /// The controller of the shipped cell.
    pub(crate) fn arcmate() -> Controller {
        let text = meltpath_data::cells::ARCMATE_120IC.text;
        toml::from_str::<File>(text).unwrap().motion
    }

    #[test]
    fn the_shipped_cell_is_sound() {
        let c = arcmate();
        c.check().unwrap();
        assert!((c.transition() - 0.216).abs() < 1e-12);
        for (share, ms) in [
            (0.0, 216.0),
            (0.25, 117.0),
            (0.5, 49.5),
            (1.0, 0.0),
            (0.6, 34.1),
        ] {
            assert!((c.dwell(share) * 1e3 - ms).abs() < 1e-9, "{share}");
        }
        assert!((c.sampling() - 2e-3).abs() < 1e-15);
    }

    #[test]
    fn unsound_data_are_refused_by_name() {
        let refused = |change: fn(&mut Controller)| {
            let mut c = arcmate();
            change(&mut c);
            c.check().unwrap_err().to_string()
        };
        assert!(refused(|c| c.t1.value.0 = 0.130).contains("t1"));
        assert!(refused(|c| c.t2.value.0 = 0.144).contains("t2"));
        assert!(refused(|c| c.dwell[2].time.value.0 = 0.2).contains("dwell"));
        assert!(refused(|c| c.corner.full_above.value.0 = 0.01).contains("corner"));
        assert!(refused(|c| c.joint_speed.value.0 = f64::NAN).contains("joint_speed"));
        assert!(arcmate().taps(0.005).is_err());
    }

    #[test]
    fn unknown_entries_are_errors() {
        let text = meltpath_data::cells::ARCMATE_120IC
            .text
            .replace("rotation_speed", "rotation_sped");
        let error = toml::from_str::<File>(&text).err().unwrap().to_string();
        assert!(error.contains("rotation_sped"), "{error}");
    }
}
