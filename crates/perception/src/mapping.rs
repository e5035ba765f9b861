//! The mapping file: which column of a record is what, in which unit, and when it was sampled.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use meltpath_base::Time;
use serde::Deserialize;

use crate::error::RecordError;

/// How a file of columns becomes a [`Record`](crate::Record).
///
/// ```
/// use meltpath_perception::Mapping;
/// let mapping = Mapping::parse("bench.toml", r#"
///     sample_time = "50 us"                  # or:  time = { column = "t", unit = "s" }
///     [channels.voltage]
///     column = "U"                           # a name, or the column's number from 1
///     unit = "V"
///     [channels.angle]
///     column = "enc"
///     unit = "deg"
///     scale = 6.87e-5                        # degrees per count
///     offset = 12.0                          # counts that read zero
/// "#).unwrap();
/// assert_eq!(mapping.channels["angle"].unit.symbol(), "rad");
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mapping {
    /// Time between samples, where the file has no column of times.
    pub sample_time: Option<Time>,
    /// The column of times.
    pub time: Option<TimeColumn>,
    /// First and last row used, counted from 1; all by default.
    pub rows: Option<[usize; 2]>,
    /// The channels, by the name that the reader of the record uses.
    pub channels: BTreeMap<String, Source>,
}

/// A column, by name or by number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum ColumnName {
    /// Its heading, or the variable's name in a MAT file.
    Name(String),
    /// Its place from 1.
    Number(usize),
}

impl std::fmt::Display for ColumnName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ColumnName::Name(name) => write!(f, "\"{name}\""),
            ColumnName::Number(number) => write!(f, "{number}"),
        }
    }
}

/// A column of times.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeColumn {
    /// Which column.
    pub column: ColumnName,
    /// Its unit.
    pub unit: TimeUnit,
}

/// Units of a column of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum TimeUnit {
    /// Seconds.
    #[serde(rename = "s")]
    Second,
    /// Milliseconds.
    #[serde(rename = "ms")]
    Millisecond,
    /// Microseconds.
    #[serde(rename = "us")]
    Microsecond,
}

impl TimeUnit {
    /// Seconds in one.
    pub fn seconds(self) -> f64 {
        match self {
            TimeUnit::Second => 1.0,
            TimeUnit::Millisecond => 1e-3,
            TimeUnit::Microsecond => 1e-6,
        }
    }
}

/// Where a channel comes from: value = `scale` · (raw − `offset`), in `unit`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Which column.
    pub column: ColumnName,
    /// Unit of the scaled value.
    pub unit: Unit,
    /// Unit per count.
    #[serde(default = "one")]
    pub scale: f64,
    /// Raw value that means zero, in counts.
    #[serde(default)]
    pub offset: f64,
}

fn one() -> f64 {
    1.0
}

/// Units of a channel in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Unit {
    /// Volts.
    V,
    /// Millivolts.
    #[serde(rename = "mV")]
    MilliV,
    /// Amperes.
    A,
    /// Milliamperes.
    #[serde(rename = "mA")]
    MilliA,
    /// Radians.
    #[serde(rename = "rad")]
    Radian,
    /// Milliradians.
    #[serde(rename = "mrad")]
    Milliradian,
    /// Degrees.
    #[serde(rename = "deg")]
    Degree,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// Metres a minute.
    #[serde(rename = "m/min")]
    MetrePerMinute,
    /// No unit.
    #[serde(rename = "1")]
    One,
}

impl Unit {
    /// The unit that values are kept in.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::V | Unit::MilliV => "V",
            Unit::A | Unit::MilliA => "A",
            Unit::Radian | Unit::Milliradian | Unit::Degree => "rad",
            Unit::Millimetre => "mm",
            Unit::MetrePerMinute => "mm/s",
            Unit::One => "1",
        }
    }

    /// Kept units in one of these.
    pub fn factor(self) -> f64 {
        match self {
            Unit::V | Unit::A | Unit::Radian | Unit::Millimetre | Unit::One => 1.0,
            Unit::MilliV | Unit::MilliA | Unit::Milliradian => 1e-3,
            Unit::Degree => PI / 180.0,
            Unit::MetrePerMinute => 1000.0 / 60.0,
        }
    }
}

impl Mapping {
    /// Reads a mapping from its file.
    ///
    /// # Errors
    /// [`RecordError::File`] where it does not open, else those of [`Mapping::parse`].
    pub fn load(path: &std::path::Path) -> Result<Self, RecordError> {
        let file = path.display().to_string();
        match std::fs::read_to_string(path) {
            Ok(text) => Mapping::parse(&file, &text),
            Err(e) => Err(RecordError::File {
                file,
                message: e.to_string(),
            }),
        }
    }

    /// Reads a mapping; `file` names it in errors.
    ///
    /// # Errors
    /// [`RecordError::Mapping`] with the place and what is known instead.
    pub fn parse(file: &str, text: &str) -> Result<Self, RecordError> {
        let wrong = |message: String| RecordError::Mapping {
            file: file.to_owned(),
            message,
        };
        let mapping: Mapping = toml::from_str(text).map_err(|e| wrong(e.to_string()))?;
        match (&mapping.sample_time, &mapping.time) {
            (None, None) => return Err(wrong(
                "say when samples were taken: sample_time = \"50 us\", or time = { column = \"t\", unit = \"s\" }".to_owned(),
            )),
            (Some(t), _) if !(t.0 > 0.0 && t.0.is_finite()) => {
                return Err(wrong(format!("sample_time is {t}: it must be above zero")));
            }
            _ => {}
        }
        if mapping.channels.is_empty() {
            return Err(wrong(
                "no channels: add a table such as [channels.voltage] with column and unit"
                    .to_owned(),
            ));
        }
        for (name, source) in &mapping.channels {
            let usable = source.scale.is_finite() && source.scale != 0.0;
            if !usable || !source.offset.is_finite() {
                return Err(wrong(format!(
                    "channels.{name}: scale is {} and offset {}: both must be finite, the scale not zero",
                    source.scale, source.offset
                )));
            }
        }
        if let Some([first, last]) = mapping.rows
            && (first == 0 || last < first)
        {
            return Err(wrong(format!(
                "rows = [{first}, {last}]: rows are counted from 1, first before last"
            )));
        }
        Ok(mapping)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_kept_in_mm_a_second() {
        assert!((0.6 * Unit::MetrePerMinute.factor() - 10.0).abs() < 1e-12);
        assert!((180.0 * Unit::Degree.factor() - PI).abs() < 1e-15);
    }

    #[test]
    fn mistakes_are_told() {
        let good = "sample_time = \"50 us\"\n[channels.u]\ncolumn = 1\nunit = \"V\"\n";
        let mapping = Mapping::parse("m", good).unwrap();
        assert!((mapping.sample_time.unwrap().0 - 5e-5).abs() < 1e-18);
        let source = &mapping.channels["u"];
        assert_eq!((source.scale, source.offset), (1.0, 0.0));
        for (text, word) in [
            ("[channels.u]\ncolumn = 1\nunit = \"V\"\n", "sample_time"),
            ("sample_time = \"50 us\"\n[channels]\n", "no channels"),
            (&good.replace("50 us", "0 s"), "above zero"),
            (&good.replace("\"V\"", "\"volt\""), "volt"),
            (&good.replace("column", "colum"), "colum"),
            (&format!("rows = [0, 4]\n{good}"), "from 1"),
            (&format!("rows = [5, 4]\n{good}"), "first before last"),
            (&format!("{good}scale = 0.0\n"), "not zero"),
        ] {
            let error = Mapping::parse("m", text).unwrap_err().to_string();
            assert!(error.contains(word), "{word}: {error}");
        }
    }
}
