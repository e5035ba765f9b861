//! Beam paths in files, as the gun records them: CSV, or the same columns as Parquet.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use meltpath_gun::record::{COLUMNS, Record, RecordError, Row};
use meltpath_perception::RecordError as TableError;
use meltpath_perception::table;
use meltpath_report::series::parquet::ParquetWriter;
use meltpath_report::series::{Column, Kind, SeriesError, Values};

meltpath_base::passes_on! {
    /// Why a file is no beam path.
    pub enum PathFileError {
        /// The file cannot be opened.
        Io(io::Error),
        /// What it says is no path.
        Record(RecordError),
        /// It is no table.
        Table(TableError);

        /// A column that is not there.
        #[error("there is no column `{name}`; a beam path has the columns {COLUMNS}")]
        Column {
            /// Its name.
            name: String,
        },
        /// A value of `on` that is neither 0 nor 1.
        #[error("row {row}: `on` is {value}: write 0 or 1")]
        Switch {
            /// Which, from 1.
            row: usize,
            /// The value.
            value: f64,
        },
    }
}

/// Reads a beam path: Parquet by its extension, CSV otherwise.
///
/// # Errors
/// [`PathFileError`].
pub fn read(file: &Path) -> Result<Record, PathFileError> {
    let parquet = file
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("parquet") || e.eq_ignore_ascii_case("pq"));
    if !parquet {
        return Ok(Record::from_csv(BufReader::new(File::open(file)?))?);
    }
    let table = table::read(file)?;
    let column = |name: &str| {
        let found = table.columns.iter().find(|c| c.0 == name);
        found
            .map(|c| c.1.as_slice())
            .ok_or_else(|| PathFileError::Column {
                name: name.to_owned(),
            })
    };
    let [time, x, y, voltage, current, focus, on] = [
        column("t_s")?,
        column("x_mm")?,
        column("y_mm")?,
        column("U_V")?,
        column("I_A")?,
        column("I_f_A")?,
        column("on")?,
    ];
    let rows = (0..table.rows())
        .map(|n| {
            let row = Row {
                time: time[n],
                x: x[n],
                y: y[n],
                voltage: voltage[n],
                current: current[n],
                focus: focus[n],
                on: on[n] == 1.0,
            };
            if on[n] == 0.0 || on[n] == 1.0 {
                Ok(row)
            } else {
                Err(PathFileError::Switch {
                    row: n + 1,
                    value: on[n],
                })
            }
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Record::new(rows)?)
}

/// Writes a beam path as Parquet; reads back to the same bits.
///
/// # Errors
/// What the writer says.
pub fn write_parquet(record: &Record, out: &mut dyn io::Write) -> io::Result<()> {
    let rows = record.rows();
    let pick = |of: fn(&Row) -> f64| rows.iter().map(of).collect::<Vec<f64>>();
    let columns: [Vec<f64>; 7] = [
        pick(|p| p.time),
        pick(|p| p.x),
        pick(|p| p.y),
        pick(|p| p.voltage),
        pick(|p| p.current),
        pick(|p| p.focus),
        pick(|p| f64::from(u8::from(p.on))),
    ];
    let heads = COLUMNS
        .split(',')
        .map(|name| Column::new(name, "", Kind::Float))
        .collect();
    let values: Vec<Values<'_>> = columns.iter().map(|c| Values::Float(c)).collect();
    let write = || -> Result<(), SeriesError> {
        let mut parquet = ParquetWriter::new(out, heads)?;
        parquet.block(&values)?;
        parquet.finish()
    };
    write().map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_comes_back_from_parquet_and_a_bad_one_is_named() {
        let row = |time: f64, x: f64, y: f64, on: bool| Row {
            time,
            x,
            y,
            voltage: 60e3,
            current: 1.0 / 300.0,
            focus: 4e-3,
            on,
        };
        let rows = vec![
            row(0.1, 0.1, 0.2, true),
            row(1.0 / 3.0, 3.0, 0.7, true),
            row(0.7, 0.0, 1.0, false),
        ];
        let path = Record::new(rows).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("path.parquet");
        let mut bytes = Vec::new();
        write_parquet(&path, &mut bytes).unwrap();
        std::fs::write(&file, &bytes).unwrap();
        assert_eq!(read(&file).unwrap(), path);
        std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
        assert!(matches!(read(&file), Err(PathFileError::Table(_))));
        assert!(matches!(
            read(&dir.path().join("none.csv")),
            Err(PathFileError::Io(_))
        ));
    }
}
