//! Series: columns with names and units, written block by block as CSV or Parquet, so that a long record is never
//! held whole in memory.

pub mod csv;
pub mod parquet;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// 64-bit floats; NaN where there is no value.
    Float,
    /// 64-bit integers.
    Integer,
    /// Text.
    Text,
}

/// Head of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name, such as `speed`.
    pub name: String,
    /// Unit as written for people; empty when the value has none.
    pub unit: String,
    /// What it holds.
    pub kind: Kind,
}

impl Column {
    /// A column head.
    pub fn new(name: &str, unit: &str, kind: Kind) -> Self {
        Column {
            name: name.to_owned(),
            unit: unit.to_owned(),
            kind,
        }
    }

    /// The name with its unit, as it stands in files: `speed_mm_s`.
    pub fn title(&self) -> String {
        name_in_files(&self.name, &self.unit)
    }
}

/// The name of a quantity in files: its words, then its unit, joined by `_` and in plain letters. Numbers alone have the unit 1,
/// which is not told.
///
/// ```
/// use meltpath_report::series::name_in_files;
/// assert_eq!(name_in_files("highest temperature", "°C"), "highest_temperature_C");
/// assert_eq!(name_in_files("laser-on delay", "s"), "laser_on_delay_s");
/// assert_eq!(name_in_files("speed", "m/min"), "speed_m_min");
/// assert_eq!(name_in_files("contour error 99 %", "µm"), "contour_error_99_percent_um");
/// assert_eq!(name_in_files("samples", "1"), "samples");
/// ```
pub fn name_in_files(name: &str, unit: &str) -> String {
    let unit = if unit == "1" { "" } else { unit };
    let mut whole = String::new();
    for letter in format!("{name} {unit}").chars() {
        match letter {
            'µ' => whole.push('u'),
            '²' => whole.push('2'),
            '³' => whole.push('3'),
            '%' => whole.push_str("percent"),
            '°' => {}
            letter if letter.is_ascii_alphanumeric() => whole.push(letter),
            _ if whole.ends_with('_') => {}
            _ => whole.push('_'),
        }
    }
    whole.trim_matches('_').to_owned()
}

/// The values of a column in one block.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// Of a [`Kind::Float`] column.
    Float(&'a [f64]),
    /// Of a [`Kind::Integer`] column.
    Integer(&'a [i64]),
    /// Of a [`Kind::Text`] column.
    Text(&'a [String]),
}

impl Values<'_> {
    fn kind(&self) -> Kind {
        match self {
            Values::Float(_) => Kind::Float,
            Values::Integer(_) => Kind::Integer,
            Values::Text(_) => Kind::Text,
        }
    }

    fn len(&self) -> usize {
        match self {
            Values::Float(v) => v.len(),
            Values::Integer(v) => v.len(),
            Values::Text(v) => v.len(),
        }
    }
}

/// Why a series could not be written.
#[derive(Debug, thiserror::Error)]
pub enum SeriesError {
    /// A block has another number of columns than the head.
    #[error("a block of {found} columns in a series of {expected}")]
    Columns {
        /// Columns of the head.
        expected: usize,
        /// Columns of the block.
        found: usize,
    },
    /// A column of a block has another length than the first one.
    #[error("column \"{column}\" has {found} values in a block of {expected} rows")]
    Rows {
        /// The column.
        column: String,
        /// Rows of the first column.
        expected: usize,
        /// Rows of this one.
        found: usize,
    },
    /// A column of a block holds something else than its head says.
    #[error("column \"{column}\" holds {expected:?} values, a block gave {found:?}")]
    Kind {
        /// The column.
        column: String,
        /// What the head says.
        expected: Kind,
        /// What the block holds.
        found: Kind,
    },
    /// The system refused.
    #[error("cannot write the series: {0}")]
    Io(#[from] std::io::Error),
}

/// Checks a block against the head; the number of its rows.
fn check(columns: &[Column], block: &[Values<'_>]) -> Result<usize, SeriesError> {
    if columns.len() != block.len() {
        return Err(SeriesError::Columns {
            expected: columns.len(),
            found: block.len(),
        });
    }
    let rows = block.first().map_or(0, Values::len);
    for (column, values) in columns.iter().zip(block) {
        if values.kind() != column.kind {
            return Err(SeriesError::Kind {
                column: column.title(),
                expected: column.kind,
                found: values.kind(),
            });
        }
        if values.len() != rows {
            return Err(SeriesError::Rows {
                column: column.title(),
                expected: rows,
                found: values.len(),
            });
        }
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_that_do_not_match_the_head_are_refused() {
        let head = [
            Column::new("time", "s", Kind::Float),
            Column::new("layer", "", Kind::Integer),
        ];
        assert_eq!(
            check(&head, &[Values::Float(&[1.0]), Values::Integer(&[1])]).unwrap(),
            1
        );
        let wrong = |block: &[Values<'_>]| check(&head, block).unwrap_err().to_string();
        assert_eq!(
            wrong(&[Values::Float(&[])]),
            "a block of 1 columns in a series of 2"
        );
        assert_eq!(
            wrong(&[Values::Float(&[1.0]), Values::Integer(&[])]),
            "column \"layer\" has 0 values in a block of 1 rows"
        );
        assert_eq!(
            wrong(&[Values::Integer(&[1]), Values::Integer(&[1])]),
            "column \"time_s\" holds Float values, a block gave Integer"
        );
    }
}
