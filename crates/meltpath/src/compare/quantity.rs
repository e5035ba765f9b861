//! What two tellings of a field are compared by.

use meltpath_thermal::material::CELSIUS;

/// What a table tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Temperatures in time, K.
    Temperature,
    /// Highest temperatures of a layer, K.
    Highest,
    /// How long a place was molten, s.
    Molten,
    /// When it froze, s after its layer's path began.
    Solidified,
}

/// How values are shown: the unit of a value, that of a difference, and `shown = factor · value − offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Unit of a value.
    pub unit: &'static str,
    /// Unit of a difference.
    pub difference: &'static str,
    factor: f64,
    offset: f64,
}

impl Shown {
    /// A value in its unit.
    pub fn value(&self, value: f64) -> f64 {
        self.factor * value - self.offset
    }

    /// A difference in its unit.
    pub fn difference(&self, difference: f64) -> f64 {
        self.factor * difference
    }
}

impl Quantity {
    /// All, in the order of reports.
    pub const ALL: [Quantity; 4] = [
        Quantity::Temperature,
        Quantity::Highest,
        Quantity::Molten,
        Quantity::Solidified,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Quantity::Temperature => "temperature in time",
            Quantity::Highest => "highest temperature",
            Quantity::Molten => "time molten",
            Quantity::Solidified => "time of freezing",
        }
    }

    /// What its files are called by; nothing for temperatures in time.
    pub fn suffix(self) -> &'static str {
        match self {
            Quantity::Temperature => "",
            Quantity::Highest => "-highest",
            Quantity::Molten => "-molten",
            Quantity::Solidified => "-solidified",
        }
    }

    /// Whether values are temperatures.
    pub fn is_temperature(self) -> bool {
        matches!(self, Quantity::Temperature | Quantity::Highest)
    }

    /// Whether a sample has a time of its own.
    pub fn is_in_time(self) -> bool {
        self == Quantity::Temperature
    }

    /// How it is shown.
    pub fn shown(self) -> Shown {
        if self.is_temperature() {
            Shown {
                unit: "°C",
                difference: "K",
                factor: 1.0,
                offset: CELSIUS,
            }
        } else {
            Shown {
                unit: "ms",
                difference: "ms",
                factor: 1e3,
                offset: 0.0,
            }
        }
    }
}
