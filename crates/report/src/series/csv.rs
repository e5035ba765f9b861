//! Comma-separated values, RFC 4180: a head with units, CRLF line ends, UTF-8; numbers with every digit they need to
//! come back as the same bits, an empty field for a value that is not finite.

use std::io::Write;

use super::{Column, Kind, SeriesError, Values, check};

/// Writes columns of numbers, each with its name and unit, as one series.
///
/// # Errors
/// [`SeriesError`] as of [`CsvWriter::block`].
///
/// ```
/// use meltpath_report::series::csv::write_columns;
/// let mut out = Vec::new();
/// write_columns(&mut out, &[("x", "mm", vec![0.0, 0.5]), ("temperature", "K", vec![300.0, 1900.0])]).unwrap();
/// assert_eq!(String::from_utf8(out).unwrap(), "x_mm,temperature_K\r\n0,300\r\n0.5,1900\r\n");
/// ```
pub fn write_columns(
    out: &mut dyn Write,
    columns: &[(&str, &str, Vec<f64>)],
) -> Result<(), SeriesError> {
    let heads = columns
        .iter()
        .map(|(name, unit, _)| Column::new(name, unit, Kind::Float))
        .collect();
    let values: Vec<Values<'_>> = columns.iter().map(|c| Values::Float(&c.2)).collect();
    let mut csv = CsvWriter::new(out, heads)?;
    csv.block(&values)?;
    csv.finish()
}

/// Writes a series as CSV.
///
/// ```
/// use meltpath_report::series::{Column, Kind, Values, csv::CsvWriter};
/// let mut out = Vec::new();
/// let head = vec![Column::new("time", "s", Kind::Float), Column::new("note", "", Kind::Text)];
/// let mut csv = CsvWriter::new(&mut out, head).unwrap();
/// csv.block(&[Values::Float(&[0.1, f64::NAN]), Values::Text(&["a, \"b\"".to_owned(), String::new()])]).unwrap();
/// csv.finish().unwrap();
/// assert_eq!(String::from_utf8(out).unwrap(), "time_s,note\r\n0.1,\"a, \"\"b\"\"\"\r\n,\r\n");
/// ```
pub struct CsvWriter<'w> {
    out: &'w mut dyn Write,
    columns: Vec<Column>,
}

impl<'w> CsvWriter<'w> {
    /// Writes the head.
    ///
    /// # Errors
    /// [`SeriesError::Io`].
    pub fn new(out: &'w mut dyn Write, columns: Vec<Column>) -> Result<Self, SeriesError> {
        for (i, column) in columns.iter().enumerate() {
            separator(out, i)?;
            text(out, &column.title())?;
        }
        out.write_all(b"\r\n")?;
        Ok(CsvWriter { out, columns })
    }

    /// Writes rows.
    ///
    /// # Errors
    /// A block that does not match the head, before anything of it is written; [`SeriesError::Io`].
    pub fn block(&mut self, block: &[Values<'_>]) -> Result<(), SeriesError> {
        let rows = check(&self.columns, block)?;
        for row in 0..rows {
            for (i, values) in block.iter().enumerate() {
                separator(self.out, i)?;
                match values {
                    Values::Float(v) => float(self.out, v[row])?,
                    Values::Integer(v) => write!(self.out, "{}", v[row])?,
                    Values::Text(v) => text(self.out, &v[row])?,
                }
            }
            self.out.write_all(b"\r\n")?;
        }
        Ok(())
    }

    /// Flushes.
    ///
    /// # Errors
    /// [`SeriesError::Io`].
    pub fn finish(self) -> Result<(), SeriesError> {
        Ok(self.out.flush()?)
    }
}

fn separator(out: &mut dyn Write, column: usize) -> std::io::Result<()> {
    if column > 0 {
        out.write_all(b",")
    } else {
        Ok(())
    }
}

fn float(out: &mut dyn Write, value: f64) -> std::io::Result<()> {
    let magnitude = value.abs();
    if !value.is_finite() {
        Ok(())
    } else if value == 0.0 || (1e-5..1e15).contains(&magnitude) {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    }
}

fn text(out: &mut dyn Write, value: &str) -> std::io::Result<()> {
    if value.contains(['"', ',', '\r', '\n']) {
        write!(out, "\"{}\"", value.replace('"', "\"\""))
    } else {
        out.write_all(value.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::series::Kind;

    proptest! {
        #[test]
        fn numbers_come_back_as_the_same_bits(value in any::<f64>()) {
            let mut out = Vec::new();
            float(&mut out, value).unwrap();
            let text = String::from_utf8(out).unwrap();
            prop_assert!(text.len() <= 25, "{text}");
            if value.is_finite() {
                prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
            } else {
                prop_assert_eq!(text, "");
            }
        }
    }

    #[test]
    fn a_full_disk_is_an_error() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let head = vec![Column::new("t", "s", Kind::Float)];
        assert!(matches!(
            CsvWriter::new(&mut Full, head),
            Err(SeriesError::Io(_))
        ));
    }
}
