//! Quantities as people write them, `"0.75 m/min"`, and as the code computes with them, mm/s.
//!
//! Files carry units in the value. A bare number where a unit is needed is an error that lists the accepted units.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A unit as files write it: its symbol, and the linear map `internal = factor · written + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// The symbol in files, such as `m/min`.
    pub symbol: &'static str,
    /// Internal units per written unit.
    pub factor: f64,
    /// Internal value of a written zero (temperatures only).
    pub offset: f64,
}

const fn unit(symbol: &'static str, factor: f64) -> Unit {
    Unit {
        symbol,
        factor,
        offset: 0.0,
    }
}

/// Why a text is not a quantity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum QuantityError {
    /// No unit, or one of another dimension.
    #[error("{what} \"{text}\" needs a unit: write it as \"{number} UNIT\" with one of {accepted}")]
    Unit {
        /// The dimension wanted, such as `length`.
        what: &'static str,
        /// What was written.
        text: String,
        /// The number read, or an example.
        number: String,
        /// The accepted unit symbols.
        accepted: String,
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

fn accepted(units: &[Unit]) -> String {
    let names: Vec<_> = units.iter().map(|u| format!("\"{}\"", u.symbol)).collect();
    names.join(", ")
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
    let example = || format!("1 {}", units.first().map_or("", |u| u.symbol));
    let value: f64 = number.parse().map_err(|_| QuantityError::Number {
        what,
        text: text.to_owned(),
        example: example(),
    })?;
    let symbol = symbol.trim();
    let unit = units
        .iter()
        .find(|u| u.symbol == symbol)
        .ok_or_else(|| QuantityError::Unit {
            what,
            text: text.to_owned(),
            number: number.to_owned(),
            accepted: accepted(units),
        })?;
    let internal = value * unit.factor + unit.offset;
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
            number: number.to_string(),
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

/// One newtype per dimension: they differ in nothing but the table of units.
macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $what:literal, $internal:literal, [$(($symbol:literal, $factor:expr)),+]) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        pub struct $name(
            #[doc = concat!("The value in ", $internal, ".")]
            pub f64,
        );

        impl $name {
            /// The units that files may use; the first is the one values are written back in.
            pub const UNITS: &'static [Unit] = &[$(unit($symbol, $factor)),+];

            /// Reads a number with a unit.
            ///
            /// # Errors
            /// [`QuantityError`] naming what was written and the accepted units.
            pub fn parse(text: &str) -> Result<Self, QuantityError> {
                parse(text, $what, Self::UNITS).map($name)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let unit = Self::UNITS[0];
                let written = (self.0 - unit.offset) / unit.factor;
                // ten significant digits: what a person wrote comes back as written
                let rounded: f64 = format!("{written:.9e}").parse().unwrap_or(written);
                write!(f, "{rounded} {}", unit.symbol)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                d.deserialize_any(QuantityVisitor { what: $what, units: Self::UNITS }).map($name)
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                s.collect_str(self)
            }
        }
    };
}

quantity!(
    /// A length, mm inside.
    ///
    /// ```
    /// use meltpath_base::Length;
    /// assert_eq!(Length::parse("1.6 mm").unwrap().0, 1.6);
    /// assert_eq!(Length::parse("2 in").unwrap().0, 50.8);
    /// assert!(Length::parse("1.6").unwrap_err().to_string().contains("\"mm\""));
    /// ```
    Length, "length", "mm",
    [("mm", 1.0), ("µm", 1e-3), ("um", 1e-3), ("cm", 10.0), ("m", 1e3), ("in", 25.4)]
);
quantity!(
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
quantity!(
    /// A duration, s inside.
    Time, "time", "s",
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("min", 60.0), ("h", 3600.0)]
);
quantity!(
    /// An angle, rad inside.
    Angle, "angle", "rad",
    [("deg", std::f64::consts::PI / 180.0), ("°", std::f64::consts::PI / 180.0), ("rad", 1.0)]
);
quantity!(
    /// A voltage, V inside.
    Voltage, "voltage", "V",
    [("kV", 1e3), ("V", 1.0)]
);
quantity!(
    /// An electric current, A inside.
    ///
    /// ```
    /// use meltpath_base::Current;
    /// assert_eq!(Current::parse("5 mA").unwrap(), Current(0.005));
    /// ```
    Current, "current", "A",
    [("mA", 1e-3), ("A", 1.0)]
);
quantity!(
    /// A share or a factor, 1 inside for `100 %`.
    Ratio, "ratio", "1",
    [("%", 0.01)]
);

/// A temperature, K inside.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Temperature(
    /// The value in kelvin.
    pub f64,
);

impl Temperature {
    /// The units that files may use.
    pub const UNITS: &'static [Unit] = &[
        Unit {
            symbol: "°C",
            factor: 1.0,
            offset: 273.15,
        },
        Unit {
            symbol: "degC",
            factor: 1.0,
            offset: 273.15,
        },
        unit("K", 1.0),
    ];
}

impl fmt::Display for Temperature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} °C", self.0 - 273.15)
    }
}

impl<'de> Deserialize<'de> for Temperature {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(QuantityVisitor {
            what: "temperature",
            units: Self::UNITS,
        })
        .map(Temperature)
    }
}

impl Serialize for Temperature {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(self)
    }
}

/// A dimension whose value is one number.
pub trait Scalar: Copy + fmt::Display {
    /// The number, in internal units.
    fn number(self) -> f64;
}

macro_rules! scalar {
    ($($name:ident),+) => {
        $(impl Scalar for $name {
            fn number(self) -> f64 {
                self.0
            }
        })+
    };
}
scalar!(
    Length,
    Speed,
    Time,
    Angle,
    Voltage,
    Current,
    Ratio,
    Temperature
);

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

impl<'de, T: Scalar + Deserialize<'de>> Deserialize<'de> for Positive<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let value = T::deserialize(d)?;
        if value.number() > 0.0 {
            Ok(Positive(value))
        } else {
            Err(de::Error::custom(format!("{value} must be above zero")))
        }
    }
}

impl<'de, T: Scalar + Deserialize<'de>> Deserialize<'de> for NotNegative<T> {
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

struct AutoVisitor<T>(std::marker::PhantomData<T>);

impl<'de, T: Deserialize<'de>> de::Visitor<'de> for AutoVisitor<T> {
    type Value = Auto<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"auto\" or a value with its unit")
    }
    fn visit_str<E: de::Error>(self, text: &str) -> Result<Auto<T>, E> {
        if text.trim() == "auto" {
            Ok(Auto::Auto)
        } else {
            T::deserialize(de::value::StrDeserializer::new(text)).map(Auto::Value)
        }
    }
    fn visit_f64<E: de::Error>(self, v: f64) -> Result<Auto<T>, E> {
        T::deserialize(de::value::F64Deserializer::new(v)).map(Auto::Value)
    }
    fn visit_i64<E: de::Error>(self, v: i64) -> Result<Auto<T>, E> {
        T::deserialize(de::value::I64Deserializer::new(v)).map(Auto::Value)
    }
    fn visit_seq<A: de::SeqAccess<'de>>(self, seq: A) -> Result<Auto<T>, A::Error> {
        T::deserialize(de::value::SeqAccessDeserializer::new(seq)).map(Auto::Value)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Auto<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(AutoVisitor(std::marker::PhantomData))
    }
}

impl<T: Serialize> Serialize for Auto<T> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        match self {
            Auto::Auto => s.serialize_str("auto"),
            Auto::Value(v) => v.serialize(s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            error.contains("\"12 UNIT\"") && error.contains("\"m/min\""),
            "{error}"
        );
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
            error.contains("\"1.6 UNIT\"") && error.contains("\"mm\""),
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
        fn each<T: Scalar>(parse: fn(&str) -> Result<T, QuantityError>, sizes: &[(&str, f64)]) {
            for (symbol, one) in sizes {
                let found = parse(&format!("1 {symbol}")).unwrap().number();
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
        ];
        each(Length::parse, &lengths);
        let speeds = [
            ("m/min", 16.666_666_666_666_67),
            ("mm/s", 1.0),
            ("mm/min", 0.016_666_666_666_666_67),
            ("cm/min", 0.166_666_666_666_666_7),
            ("m/s", 1000.0),
            ("in/min", 0.423_333_333_333_333_3),
        ];
        each(Speed::parse, &speeds);
        let times = [
            ("s", 1.0),
            ("ms", 0.001),
            ("us", 0.000_001),
            ("min", 60.0),
            ("h", 3600.0),
        ];
        each(Time::parse, &times);
        let degree = 0.017_453_292_519_943_295;
        each(
            Angle::parse,
            &[("deg", degree), ("°", degree), ("rad", 1.0)],
        );
        each(Voltage::parse, &[("kV", 1000.0), ("V", 1.0)]);
        each(Current::parse, &[("mA", 0.001), ("A", 1.0)]);
        each(Ratio::parse, &[("%", 0.01)]);
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
