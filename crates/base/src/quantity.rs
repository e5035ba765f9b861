//! Quantities as people write them, `"0.75 m/min"`, and as the code computes with them, mm/s.
//!
//! Files carry units in the value. A bare number where a unit is needed is an error that lists the accepted units.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::number::{WRITTEN, rounded};

/// A unit as files write it: its symbol, and the linear map `internal = factor · written / divisor + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// The symbol in files, such as `m/min`.
    pub symbol: &'static str,
    /// Internal units per written unit.
    pub factor: f64,
    /// What the written number is divided by: 95 % is 95 / 100, which 95 · 0.01 is not.
    pub divisor: f64,
    /// Internal value of a written zero (temperatures only).
    pub offset: f64,
}

impl Unit {
    /// A unit of `factor` internal units.
    pub const fn new(symbol: &'static str, factor: f64) -> Self {
        Unit {
            symbol,
            factor,
            divisor: 1.0,
            offset: 0.0,
        }
    }

    /// The internal value of a written number.
    pub fn read(&self, written: f64) -> f64 {
        written * self.factor / self.divisor + self.offset
    }

    /// An internal value in this unit, to ten significant digits: what a person wrote comes back as written.
    pub fn show(&self, internal: f64) -> String {
        let written = (internal - self.offset) * self.divisor / self.factor;
        let rounded = rounded(written, WRITTEN);
        match self.symbol {
            "1" => rounded.to_string(),
            symbol => format!("{rounded} {symbol}"),
        }
    }
}

/// Why a text is not a quantity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum QuantityError {
    /// No unit, or one of another dimension.
    #[error("{what} \"{text}\" needs a unit, one of {accepted}: write for example \"{example}\"")]
    Unit {
        /// The dimension wanted, such as `length`.
        what: &'static str,
        /// What was written.
        text: String,
        /// A text that reads.
        example: String,
        /// The accepted unit symbols.
        accepted: String,
    },
    /// A decimal comma.
    #[error("{what} \"{text}\" has a comma: numbers carry a decimal point, \"{written}\"")]
    Comma {
        /// The dimension wanted, such as `length`.
        what: &'static str,
        /// What was written.
        text: String,
        /// The same with a point.
        written: String,
    },
    /// The number does not read.
    #[error("{what} \"{text}\" does not start with a number: write for example \"{example}\"")]
    Number {
        /// The dimension wanted.
        what: &'static str,
        /// What was written.
        text: String,
        /// A text that would read.
        example: String,
    },
    /// Infinite or not a number.
    #[error("{what} \"{text}\" is not finite")]
    NotFinite {
        /// The dimension wanted.
        what: &'static str,
        /// What was written.
        text: String,
    },
}

pub(crate) fn accepted(units: &[Unit]) -> String {
    let names: Vec<_> = units.iter().map(|u| format!("\"{}\"", u.symbol)).collect();
    names.join(", ")
}

/// A number with the unit that values are written back in.
pub(crate) fn in_first_unit(number: &str, units: &[Unit]) -> String {
    format!("{number} {}", units.first().map_or("", |u| u.symbol))
}

/// The text that a bare number is most likely meant as: shares below 1 are often written so, other numbers carry the first unit.
pub(crate) fn with_unit(number: &str, units: &[Unit]) -> String {
    let share = number.parse::<f64>().ok().filter(|n| 0.0 < *n && *n < 1.0);
    match (units, share) {
        ([unit, ..], Some(share)) if unit.symbol == "%" => {
            let percent = rounded(100.0 * share, WRITTEN);
            format!("{percent} %")
        }
        _ => in_first_unit(number, units),
    }
}

/// Reads `text` as a number followed by one of `units`; the result is in internal units.
///
/// # Errors
/// [`QuantityError`] when the number or the unit does not read, or the value is not finite.
pub fn parse(text: &str, what: &'static str, units: &[Unit]) -> Result<f64, QuantityError> {
    let trimmed = text.trim();
    let split = trimmed
        .char_indices()
        .find(|&(i, c)| {
            let exponent = matches!(c, 'e' | 'E')
                && trimmed[i + 1..]
                    .chars()
                    .next()
                    .is_some_and(|n| n.is_ascii_digit() || n == '-' || n == '+');
            !(c.is_ascii_digit() || matches!(c, '.' | '+' | '-') || exponent)
        })
        .map_or(trimmed.len(), |(i, _)| i);
    let (number, symbol) = trimmed.split_at(split);
    let value: f64 = number.parse().map_err(|_| QuantityError::Number {
        what,
        text: text.to_owned(),
        example: in_first_unit("1", units),
    })?;
    let symbol = symbol.trim();
    if let Some(fraction) = symbol.strip_prefix(',')
        && fraction.starts_with(|c: char| c.is_ascii_digit())
    {
        return Err(QuantityError::Comma {
            what,
            text: text.to_owned(),
            written: format!("{number}.{fraction}"),
        });
    }
    let unit = units
        .iter()
        .find(|u| u.symbol == symbol)
        .ok_or_else(|| QuantityError::Unit {
            what,
            text: text.to_owned(),
            example: in_first_unit(number, units),
            accepted: accepted(units),
        })?;
    let internal = unit.read(value);
    if internal.is_finite() {
        Ok(internal)
    } else {
        Err(QuantityError::NotFinite {
            what,
            text: text.to_owned(),
        })
    }
}

struct QuantityVisitor {
    what: &'static str,
    units: &'static [Unit],
}

impl QuantityVisitor {
    fn bare<E: de::Error>(&self, number: impl fmt::Display) -> E {
        E::custom(QuantityError::Unit {
            what: self.what,
            text: number.to_string(),
            example: in_first_unit(&number.to_string(), self.units),
            accepted: accepted(self.units),
        })
    }
}

impl de::Visitor<'_> for QuantityVisitor {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "a {} in quotes with one of the units {}",
            self.what,
            accepted(self.units)
        )
    }
    fn visit_str<E: de::Error>(self, text: &str) -> Result<f64, E> {
        parse(text, self.what, self.units).map_err(E::custom)
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<f64, E> {
        Err(self.bare(v))
    }
    fn visit_i64<E: de::Error>(self, v: i64) -> Result<f64, E> {
        Err(self.bare(v))
    }
    fn visit_u64<E: de::Error>(self, v: u64) -> Result<f64, E> {
        Err(self.bare(v))
    }
}

/// The dimensions that are read by serde too.
macro_rules! deserialized {
    ($($name:ident),+) => {$(
        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                let visitor = QuantityVisitor { what: Self::WHAT, units: Self::UNITS };
                d.deserialize_any(visitor).map($name)
            }
        }
    )+};
}
deserialized!(
    Length,
    Speed,
    Time,
    Angle,
    Voltage,
    Current,
    Ratio,
    Temperature,
    TemperatureDifference,
    Frequency,
    AngularSpeed,
    BeadWidths
);

crate::quantity!(
    /// A length, mm inside.
    ///
    /// ```
    /// use meltpath_base::Length;
    /// assert_eq!(Length::parse("1.6 mm").unwrap().0, 1.6);
    /// assert_eq!(Length::parse("2 in").unwrap().0, 50.8);
    /// assert!(Length::parse("1.6").unwrap_err().to_string().contains("\"mm\""));
    /// ```
    Length, "length", "mm",
    [("mm", 1.0), ("µm", 1e-3), ("um", 1e-3), ("cm", 10.0), ("m", 1e3), ("in", 25.4), ("nm", 1e-6)]
);
crate::quantity!(
    /// A speed (travel, wire feed), mm/s inside; people write m/min.
    ///
    /// ```
    /// use meltpath_base::Speed;
    /// assert_eq!(Speed::parse("0.75 m/min").unwrap(), Speed(12.5));
    /// assert_eq!(Speed(12.5).to_string(), "0.75 m/min");
    /// ```
    Speed, "speed", "mm/s",
    [("m/min", 1e3 / 60.0), ("mm/s", 1.0), ("mm/min", 1.0 / 60.0), ("cm/min", 10.0 / 60.0), ("m/s", 1e3), ("in/min", 25.4 / 60.0)]
);
crate::quantity!(
    /// A duration, s inside.
    Time, "time", "s",
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("min", 60.0), ("h", 3600.0)]
);
crate::quantity!(
    /// An angle, rad inside.
    Angle, "angle", "rad",
    [("deg", std::f64::consts::PI / 180.0), ("°", std::f64::consts::PI / 180.0), ("rad", 1.0)]
);
crate::quantity!(
    /// A voltage, V inside.
    Voltage, "voltage", "V",
    [("kV", 1e3), ("V", 1.0)]
);
crate::quantity!(
    /// An electric current, A inside.
    ///
    /// ```
    /// use meltpath_base::Current;
    /// assert_eq!(Current::parse("5 mA").unwrap(), Current(0.005));
    /// ```
    Current, "current", "A",
    [("mA", 1e-3), ("A", 1.0)]
);
crate::quantity!(
    /// A pressure, Pa inside.
    Pressure, "pressure", "Pa",
    [("Pa", 1.0), ("kPa", 1e3), ("mbar", 100.0), ("bar", 1e5)]
);
crate::quantity!(
    /// A share or a factor, 1 inside for `100 %`.
    Ratio, "ratio", "1",
    [("%", 1.0, divisor = 100.0)]
);

crate::quantity!(
    /// A temperature, K inside.
    Temperature, "temperature", "K",
    [("°C", 1.0, offset = 273.15), ("degC", 1.0, offset = 273.15), ("K", 1.0)]
);
crate::quantity!(
    /// A difference of temperatures, K inside.
    TemperatureDifference, "difference of temperatures", "K",
    [("K", 1.0)]
);
crate::quantity!(
    /// An angular frequency (bandwidth, crossover), rad/s inside.
    Frequency, "frequency", "rad/s",
    [("rad/s", 1.0), ("Hz", std::f64::consts::TAU), ("kHz", 1e3 * std::f64::consts::TAU)]
);
crate::quantity!(
    /// A speed of turning, rad/s inside.
    AngularSpeed, "angular speed", "rad/s",
    [("deg/s", std::f64::consts::PI / 180.0), ("rad/s", 1.0)]
);
crate::quantity!(
    /// How fast a speed of turning changes, rad/s² inside.
    AngularAcceleration, "angular acceleration", "rad/s²",
    [("deg/s²", std::f64::consts::PI / 180.0), ("deg/s2", std::f64::consts::PI / 180.0), ("rad/s²", 1.0)]
);
crate::quantity!(
    /// A number without a unit, such as an exponent.
    Pure, "number", "1",
    [("1", 1.0)]
);
crate::quantity!(
    /// A density, kg/m³ inside.
    Density, "density", "kg/m³",
    [("kg/m³", 1.0), ("kg/m3", 1.0), ("g/cm³", 1e3)]
);
crate::quantity!(
    /// A number of bead widths.
    BeadWidths, "number of bead widths", "1",
    [("w", 1.0)]
);

/// A dimension whose value is one number.
pub trait Quantity: Copy + fmt::Display + Serialize {
    /// What it is, such as `length`.
    const WHAT: &'static str;
    /// The units that files may use; the first is the one values are written back in.
    const UNITS: &'static [Unit];

    /// From a number in internal units.
    fn from_number(number: f64) -> Self;

    /// The number, in internal units.
    fn number(self) -> f64;
}

/// A quantity that must be above zero: refused where it is read, with its place in the file.
///
/// ```
/// use meltpath_base::{Speed, quantity::Positive};
/// let error = serde_json::from_str::<Positive<Speed>>("\"-2 m/min\"").unwrap_err();
/// assert!(error.to_string().contains("must be above zero"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Positive<T>(
    /// The quantity, above zero.
    pub T,
);

/// A quantity that must not be below zero: refused where it is read, with its place in the file.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct NotNegative<T>(
    /// The quantity, zero or above.
    pub T,
);

impl<'de, T: Quantity + Deserialize<'de>> Deserialize<'de> for Positive<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let value = T::deserialize(d)?;
        if value.number() > 0.0 {
            Ok(Positive(value))
        } else {
            Err(de::Error::custom(format!("{value} must be above zero")))
        }
    }
}

impl<'de, T: Quantity + Deserialize<'de>> Deserialize<'de> for NotNegative<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let value = T::deserialize(d)?;
        if value.number() >= 0.0 {
            Ok(NotNegative(value))
        } else {
            Err(de::Error::custom(format!("{value} must not be negative")))
        }
    }
}

impl<T: Serialize> Serialize for Positive<T> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(s)
    }
}

impl<T: Serialize> Serialize for NotNegative<T> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(s)
    }
}

/// A setting that a person writes, or leaves to meltpath with `"auto"`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Auto<T> {
    /// `"auto"`: chosen from the models, told by `doctor` and the provenance.
    #[default]
    Auto,
    /// The value written.
    Value(T),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A share without a unit is most likely meant as one, and not as a hundredth of it.
    #[test]
    fn a_bare_share_is_answered_in_percent() {
        for (number, told) in [
            ("0.28", "28 %"),
            ("0.07", "7 %"),
            ("28", "28 %"),
            ("1", "1 %"),
        ] {
            assert_eq!(with_unit(number, Ratio::UNITS), told);
        }
        assert_eq!(with_unit("0.28", Length::UNITS), "0.28 mm");
    }

    #[test]
    fn people_write_units_in_many_ways() {
        assert_eq!(Length::parse(" 4.8mm ").unwrap(), Length(4.8));
        assert!((Speed::parse("750 mm/min").unwrap().0 - 12.5).abs() < 1e-12);
        assert_eq!(Length::parse("1e-3 m").unwrap(), Length(1.0));
        assert_eq!(Ratio::parse("50 %").unwrap(), Ratio(0.5));
        assert_eq!(Time::parse("2 min").unwrap(), Time(120.0));
    }

    #[test]
    fn errors_say_what_to_write() {
        let error = Speed::parse("12").unwrap_err().to_string();
        assert!(
            error.contains("\"12 m/min\"") && error.contains("\"mm/s\""),
            "{error}"
        );
        let error = Speed::parse("0,75 m/min").unwrap_err().to_string();
        assert!(error.ends_with("\"0.75 m/min\""), "{error}");
        assert_eq!(Ratio::parse("95 %").unwrap(), Ratio(0.95));
        assert!(matches!(
            Length::parse("mm"),
            Err(QuantityError::Number { .. })
        ));
        assert!(matches!(
            Length::parse("1e999 mm"),
            Err(QuantityError::NotFinite { .. })
        ));
        assert!(matches!(
            Length::parse("3 m/min"),
            Err(QuantityError::Unit { .. })
        ));
    }

    #[test]
    fn a_bare_number_in_a_file_is_refused_with_the_units() {
        let error = serde_json::from_str::<Length>("1.6")
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("\"1.6 mm\"") && error.contains("\"µm\""),
            "{error}"
        );
    }

    #[test]
    fn values_come_back_as_written() {
        for text in ["0.75 m/min", "8 m/min", "0.1 m/min"] {
            assert_eq!(Speed::parse(text).unwrap().to_string(), text);
        }
        assert_eq!(Angle::parse("30 deg").unwrap().to_string(), "30 deg");
    }

    #[test]
    fn every_unit_has_its_size() {
        fn each(parse: impl Fn(&str) -> f64, sizes: &[(&str, f64)]) {
            for (symbol, one) in sizes {
                let found = parse(&format!("1 {symbol}"));
                assert!((found / one - 1.0).abs() < 1e-12, "1 {symbol} is {found}");
            }
        }
        let lengths = [
            ("mm", 1.0),
            ("µm", 0.001),
            ("um", 0.001),
            ("cm", 10.0),
            ("m", 1000.0),
            ("in", 25.4),
            ("nm", 0.000_001),
        ];
        each(|text| Length::parse(text).unwrap().0, &lengths);
        let speeds = [
            ("m/min", 16.666_666_666_666_67),
            ("mm/s", 1.0),
            ("mm/min", 0.016_666_666_666_666_67),
            ("cm/min", 0.166_666_666_666_666_7),
            ("m/s", 1000.0),
            ("in/min", 0.423_333_333_333_333_3),
        ];
        each(|text| Speed::parse(text).unwrap().0, &speeds);
        let times = [
            ("s", 1.0),
            ("ms", 0.001),
            ("us", 0.000_001),
            ("µs", 0.000_001),
            ("min", 60.0),
            ("h", 3600.0),
        ];
        each(|text| Time::parse(text).unwrap().0, &times);
        let degree = 0.017_453_292_519_943_295;
        each(
            |text| Angle::parse(text).unwrap().0,
            &[("deg", degree), ("°", degree), ("rad", 1.0)],
        );
        each(
            |text| Voltage::parse(text).unwrap().0,
            &[("kV", 1000.0), ("V", 1.0)],
        );
        each(
            |text| Current::parse(text).unwrap().0,
            &[("mA", 0.001), ("A", 1.0)],
        );
        each(|text| Ratio::parse(text).unwrap().0, &[("%", 0.01)]);
        for (text, kelvin) in [("750 °C", 1023.15), ("-20 degC", 253.15), ("300 K", 300.0)] {
            let found: Temperature = serde_json::from_value(text.into()).unwrap();
            assert!((found.0 - kelvin).abs() < 1e-9, "{text}");
            let back: Temperature = serde_json::from_value(found.to_string().into()).unwrap();
            assert!((back.0 - kelvin).abs() < 1e-9, "{text}");
        }
    }

    #[test]
    fn zero_is_not_above_zero_and_not_negative() {
        let read = |text: &str| {
            let positive = serde_json::from_value::<Positive<Length>>(text.into()).is_ok();
            let not_negative = serde_json::from_value::<NotNegative<Length>>(text.into()).is_ok();
            [positive, not_negative]
        };
        assert_eq!(read("1 mm"), [true, true]);
        assert_eq!(read("0 mm"), [false, true]);
        assert_eq!(read("-1 mm"), [false, false]);
    }
}
