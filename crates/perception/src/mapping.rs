//! The mapping file: which column of a record is what, in which unit, and when it was sampled.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use meltpath_base::settings::{self, Json, Kind, Node, Place, Problem, Problems, Reader, Value};
use meltpath_base::{Time, choice, table};

use crate::error::RecordError;

table! {
    /// How a file of columns becomes a record: which column is what, in which unit, and when it was sampled.
    pub struct Mapping {
        /// Time between samples.
        sample_time: Time where positive => none("the column of times says it");
        /// The column of times.
        time: TimeColumn => none("the time between samples is said");
        /// First and last row used, counted from 1.
        rows: [usize; 2] => none("all");
        /// Where a channel comes from, under the name that the reader of the record uses: value = `scale` · (raw − `offset`), in `unit`.
        channels: BTreeMap<String, Source> => required;
    }

    /// A column of times.
    pub struct TimeColumn {
        /// Which column: its heading (in a MAT file the variable's name), or its place from 1.
        column: ColumnName => required;
        /// Its unit.
        unit: TimeUnit => required;
    }

    /// Where a channel comes from: value = `scale` · (raw − `offset`), in `unit`.
    pub struct Source {
        /// Which column: its heading (in a MAT file the variable's name), or its place from 1.
        column: ColumnName => required;
        /// Unit of the scaled value.
        unit: Unit => required;
        /// Unit per count.
        scale: f64 => default(1.0, "the column holds values, no counts");
        /// Raw value that means zero, in counts.
        offset: f64 => default(0.0, "the column's zero is zero");
    }
}

choice! {
    /// Units of a column of times.
    pub enum TimeUnit {
        Second "s" => "Seconds.",
        Millisecond "ms" => "Milliseconds.",
        Microsecond "us" => "Microseconds.",
    }

    /// Units of a channel in a file.
    pub enum Unit {
        V "V" => "Volts.",
        MilliV "mV" => "Millivolts.",
        A "A" => "Amperes.",
        MilliA "mA" => "Milliamperes.",
        Radian "rad" => "Radians.",
        Milliradian "mrad" => "Milliradians.",
        Degree "deg" => "Degrees.",
        Millimetre "mm" => "Millimetres.",
        MetrePerMinute "m/min" => "Metres a minute.",
        One "1" => "No unit.",
    }
}

/// A column, by name or by number from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnName {
    /// Its heading, or the variable's name in a MAT file.
    Name(String),
    /// Its place from 1.
    Number(usize),
}

impl Value for ColumnName {
    const KIND: Kind = Kind::Either(&Kind::Text, &Kind::Count);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        match node.get_ref().as_str() {
            Some(name) => Some(ColumnName::Name(name.to_owned())),
            None if node.get_ref().is_integer() => {
                usize::read(node, place, reader).map(ColumnName::Number)
            }
            None => {
                reader.unexpected(
                    node,
                    place,
                    "a column's heading in quotes, or its place from 1",
                );
                None
            }
        }
    }

    fn json(&self) -> Json {
        match self {
            ColumnName::Name(name) => name.json(),
            ColumnName::Number(number) => number.json(),
        }
    }
}

impl std::fmt::Display for ColumnName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ColumnName::Name(name) => write!(f, "\"{name}\""),
            ColumnName::Number(number) => write!(f, "{number}"),
        }
    }
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
    ///
    /// # Errors
    /// [`RecordError::Mapping`]: everything wrong, each with its place and what is known instead.
    pub fn parse(file: &str, text: &str) -> Result<Self, RecordError> {
        let told = |problems: Problems| problems.of_file(file, text);
        Ok(settings::parse(text, Mapping::check).map_err(told)?)
    }

    /// What does not go together.
    fn check(&self) -> Vec<Problem> {
        let (when, [first, last]) = (
            self.sample_time.is_some() || self.time.is_some(),
            self.rows.unwrap_or([1, 1]),
        );
        let mut problems = settings::broken([
            (
                !when,
                Problem::new(
                    "say when samples were taken: sample_time = \"50 us\", or time = { column = \"t\", unit = \"s\" }",
                ),
            ),
            (
                self.channels.is_empty(),
                self.channels.problem(
                    "no channels: add a table such as [channels.voltage] with column and unit",
                ),
            ),
            (
                first == 0 || last < first,
                self.rows.problem(format!(
                    "rows = [{first}, {last}]: rows are counted from 1, first before last"
                )),
            ),
        ]);
        let zero = |(name, source): (&String, &Source)| {
            let message = format!("channels.{name}.scale is 0: write a number that is not zero");
            (*source.scale == 0.0).then(|| source.scale.problem(message))
        };
        problems.extend(self.channels.iter().filter_map(zero));
        problems
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
        assert_eq!((*source.scale, *source.offset), (1.0, 0.0));
        let several = "rows = [0, 4]\nsample_tim = 3\n[channels.u]\ncolumn = true\nunit = \"V\"\n";
        let error = Mapping::parse("m", several).unwrap_err().to_string();
        for word in ["m:2:1: ", "sample_time", "m:4:10: ", "heading"] {
            assert!(error.contains(word), "{word}: {error}");
        }
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
