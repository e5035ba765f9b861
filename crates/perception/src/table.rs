//! Columns of numbers from the files that benches write: CSV, Parquet, MAT (level 5).

use std::fs::File;
use std::path::Path;

use matfile::{MatFile, NumericData};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use crate::error::RecordError;

/// Named columns of one length; what is no number is NaN.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Name and values.
    pub columns: Vec<(String, Vec<f64>)>,
}

impl Table {
    /// Values in each column; of columns of different lengths, the shortest.
    pub fn rows(&self) -> usize {
        self.columns.iter().map(|c| c.1.len()).min().unwrap_or(0)
    }
}

/// Reads a file by its extension.
///
/// # Errors
/// [`RecordError::Kind`] for other files, [`RecordError::File`] when it does not read.
pub fn read(path: &Path) -> Result<Table, RecordError> {
    read_where(path, |_, _| true)
}

/// Reads a file by its extension, of which only the columns that `needed` answers for, by place from 1 and heading, must hold numbers:
/// what is none elsewhere is NaN.
///
/// # Errors
/// Those of [`read`].
pub fn read_where(path: &Path, needed: impl Fn(usize, &str) -> bool) -> Result<Table, RecordError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let failed = |message: String| RecordError::File {
        file: path.display().to_string(),
        message,
    };
    match extension.as_str() {
        "csv" | "tsv" | "txt" => {
            // headings may hold a degree sign or an umlaut in another encoding than this one
            let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
            csv_where(&String::from_utf8_lossy(&bytes), needed).map_err(failed)
        }
        "parquet" | "pq" => {
            let file = File::open(path).map_err(|e| failed(e.to_string()))?;
            parquet_or_damaged(file).map_err(failed)
        }
        "mat" => {
            let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
            mat(&bytes).map_err(failed)
        }
        _ => Err(RecordError::Kind {
            file: path.display().to_string(),
        }),
    }
}

/// Columns of a CSV text: comma, semicolon (with decimal points or commas) or tab; lines that begin with # are left out; a
/// first line with words gives the names, else columns are named by their number.
///
/// ```
/// use meltpath_perception::table::csv;
/// let table = csv("t;U\n0,0;1,5\n0,1;-1,5\n").unwrap();
/// assert_eq!(table.columns[1], ("U".to_owned(), vec![1.5, -1.5]));
/// ```
///
/// # Errors
/// What is wrong, with its line.
pub fn csv(text: &str) -> Result<Table, String> {
    csv_where(text, |_, _| true)
}

/// The same, of which only the columns that `needed` answers for must hold numbers. A second line of words below the headings holds their
/// units: they become part of the headings.
fn csv_where(text: &str, needed: impl Fn(usize, &str) -> bool) -> Result<Table, String> {
    let text = text.trim_start_matches('\u{feff}');
    let first = text
        .lines()
        .find(|l| !l.trim().is_empty() && !l.starts_with('#'))
        .ok_or("the file is empty")?;
    let delimiter = [b';', b'\t', b',']
        .into_iter()
        .find(|d| first.contains(char::from(*d)))
        .unwrap_or(b',');
    let number = |cell: &str| -> Option<f64> {
        // between commas a cell can hold one only in quotes, as a decimal one
        cell.parse()
            .or_else(|_| cell.replacen(',', ".", 1).parse())
            .ok()
    };
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut table = Table::default();
    let mut wanted: Vec<bool> = Vec::new();
    let mut headed = false;
    for row in reader.records() {
        let row = row.map_err(|e| e.to_string())?;
        if table.columns.is_empty() {
            let words = row.iter().any(|c| !c.is_empty() && number(c).is_none());
            wanted = (1..).zip(&row).map(|(k, c)| needed(k, c)).collect();
            headed = words;
            table.columns = row
                .iter()
                .enumerate()
                .map(|(i, cell)| {
                    if words {
                        (cell.to_owned(), Vec::new())
                    } else {
                        let value = number(cell).unwrap_or(f64::NAN);
                        ((i + 1).to_string(), vec![value])
                    }
                })
                .collect();
            continue;
        }
        if std::mem::take(&mut headed) && is_units(&row, number) {
            for (unit, column) in row.iter().zip(&mut table.columns) {
                let unit = unit.trim_matches(['[', ']', '(', ')']);
                column.0 = format!("{} ({unit})", column.0);
            }
            continue;
        }
        for ((cell, column), wanted) in row.iter().zip(&mut table.columns).zip(&wanted) {
            let value = if cell.is_empty() {
                f64::NAN
            } else if !wanted {
                number(cell).unwrap_or(f64::NAN)
            } else {
                number(cell).ok_or_else(|| {
                    let line = row.position().map_or(0, csv::Position::line);
                    format!(
                        "line {line}, column \"{}\": `{cell}` is no number",
                        column.0
                    )
                })?
            };
            column.1.push(value);
        }
    }
    Ok(table)
}

/// Whether a line holds units: several words, all of them short, and no number.
fn is_units(row: &csv::StringRecord, number: impl Fn(&str) -> Option<f64>) -> bool {
    const LONGEST: usize = 9;
    let words = |c: &str| !c.is_empty() && c.len() <= LONGEST && number(c).is_none();
    row.len() > 1 && row.iter().all(words)
}

/// Values read at a time.
const BATCH: usize = 1 << 16;

/// A Parquet file; the crate asserts what a damaged one says of itself.
fn parquet_or_damaged(file: File) -> Result<Table, String> {
    std::panic::catch_unwind(|| parquet(file))
        .map_err(|_| "it states places and sizes that cannot be: it is damaged".to_owned())?
        .map_err(|e| {
            let text = e.to_string();
            let packed = text.split_once("Disabled feature at compile time: ");
            packed.map_or(text.clone(), |(_, codec)| {
                format!(
                    "its columns are packed by {codec}, which is not read: write it with compression \"snappy\", \"gzip\" or none (pandas and Polars take `compression=\"snappy\"`)"
                )
            })
        })
}

fn parquet(file: File) -> Result<Table, ParquetError> {
    let reader = SerializedFileReader::new(file)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut table = Table {
        columns: (0..schema.num_columns())
            .map(|i| (schema.column(i).name().to_owned(), Vec::new()))
            .collect(),
    };
    for group in 0..reader.num_row_groups() {
        let rows = reader.get_row_group(group)?;
        let count = usize::try_from(rows.metadata().num_rows()).unwrap_or(0);
        for (i, (_, values)) in table.columns.iter_mut().enumerate() {
            match rows.get_column_reader(i)? {
                ColumnReader::DoubleColumnReader(c) => append(c, values, |v| v)?,
                ColumnReader::FloatColumnReader(c) => append(c, values, f64::from)?,
                ColumnReader::Int32ColumnReader(c) => append(c, values, f64::from)?,
                ColumnReader::Int64ColumnReader(c) => append(c, values, |v: i64| v as f64)?,
                ColumnReader::BoolColumnReader(c) => {
                    append(c, values, |v| f64::from(u8::from(v)))?;
                }
                // words and bytes are no numbers
                _ => values.extend(std::iter::repeat_n(f64::NAN, count)),
            }
        }
    }
    Ok(table)
}

/// Appends a column; nulls become NaN.
fn append<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    to: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
) -> Result<(), ParquetError> {
    loop {
        let (mut levels, mut values) = (Vec::new(), Vec::new());
        let (rows, found, _) = reader.read_records(BATCH, Some(&mut levels), None, &mut values)?;
        if rows == 0 {
            return Ok(());
        }
        if found == rows {
            to.extend(values.into_iter().map(&number));
        } else {
            let most = levels.iter().copied().max().unwrap_or(0);
            let mut values = values.into_iter();
            to.extend(levels.iter().map(|level| {
                if *level == most && most > 0 {
                    values.next().map_or(f64::NAN, &number)
                } else {
                    f64::NAN
                }
            }));
        }
    }
}

fn mat(bytes: &[u8]) -> Result<Table, String> {
    if bytes.starts_with(b"MATLAB 7.3") {
        return Err(
            "a MAT file of version 7.3 (HDF5): save it again with save(…, '-v7')".to_owned(),
        );
    }
    // the crate multiplies the sizes that a damaged file states without a look at what that gives
    let file = std::panic::catch_unwind(|| MatFile::parse(bytes))
        .map_err(|_| "it states an array of a size that cannot be: it is damaged".to_owned())?
        .map_err(|e| format!("{e:?}"))?;
    let mut columns = Vec::new();
    for array in file.arrays() {
        let size = array.size();
        let values = numbers(array.data());
        let (rows, wide) = match size.as_slice() {
            [1, n] => (*n, 1),
            [rows, columns] => (*rows, *columns),
            _ => continue,
        };
        if rows == 0 || Some(values.len()) != rows.checked_mul(wide) {
            continue;
        }
        // a matrix is a set of columns: x:1, x:2, …
        for (k, column) in values.chunks_exact(rows).enumerate() {
            let name = match wide {
                1 => array.name().to_owned(),
                _ => format!("{}:{}", array.name(), k + 1),
            };
            columns.push((name, column.to_vec()));
        }
    }
    Ok(Table { columns })
}

fn numbers(data: &NumericData) -> Vec<f64> {
    fn all<T: Copy>(values: &[T], number: impl Fn(T) -> f64) -> Vec<f64> {
        values.iter().map(|v| number(*v)).collect()
    }
    match data {
        NumericData::Int8 { real, .. } => all(real, f64::from),
        NumericData::UInt8 { real, .. } => all(real, f64::from),
        NumericData::Int16 { real, .. } => all(real, f64::from),
        NumericData::UInt16 { real, .. } => all(real, f64::from),
        NumericData::Int32 { real, .. } => all(real, f64::from),
        NumericData::UInt32 { real, .. } => all(real, f64::from),
        NumericData::Int64 { real, .. } => all(real, |v| v as f64),
        NumericData::UInt64 { real, .. } => all(real, |v| v as f64),
        NumericData::Single { real, .. } => all(real, f64::from),
        NumericData::Double { real, .. } => real.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_of_a_matrix_become_numbers() {
        let real = vec![-2, 7, 300];
        let whole = NumericData::Int16 { real, imag: None };
        assert_eq!(numbers(&whole), [-2.0, 7.0, 300.0]);
    }

    #[test]
    fn a_line_of_units_and_columns_of_words_are_taken_as_what_they_are() {
        let text = "Zeit;U;Zustand\ns;V;-\n0,0;16,5;EIN\n0,1;16,7;EIN\n";
        let table = csv_where(text, |_, name| name != "Zustand").unwrap();
        assert_eq!(table.columns[1], ("U (V)".to_owned(), vec![16.5, 16.7]));
        assert!(table.columns[2].1.iter().all(|v| v.is_nan()));
        let error = csv(text).unwrap_err();
        assert!(error.contains("line 3") && error.contains("EIN"), "{error}");
        let quoted = csv("t,U\n\"0,1\",\"16,5\"\n").unwrap();
        assert_eq!(quoted.columns[1].1, [16.5]);
    }
}
