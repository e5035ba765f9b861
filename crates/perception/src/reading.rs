//! From a file of columns to a record: rows and columns of the mapping, sample times without gaps, units.

use std::path::Path;

use meltpath_base::Reporter;
use meltpath_base::settings::{Problem, Problems};

use crate::error::RecordError;
use crate::examine::examine;
use crate::mapping::{ColumnName, Mapping};
use crate::record::{Channel, Record, listed};
use crate::table::{self, Table};

/// Longest step between two samples that is not a gap, over the usual step.
const GAP: f64 = 1.5;

/// How far the mean step of a column of times may lie from the sample time that the mapping states.
const SAMPLING: f64 = 1e-3;

/// Reads a record from a CSV, Parquet or MAT file (by its extension) and examines it; warnings go to `reporter`.
///
/// # Errors
/// [`RecordError`]: an unreadable file, a missing column, values that are no numbers, gaps, times that disagree with the
/// mapping.
pub fn read(path: &Path, mapping: &Mapping, reporter: &Reporter) -> Result<Record, RecordError> {
    let table = table::read(path)?;
    let file = path.display().to_string();
    let record = assemble(&file, &table, mapping)?;
    examine(&record, reporter);
    Ok(record)
}

/// The rows that the mapping uses, from 0, end excluded.
fn rows(
    file: &str,
    table: &Table,
    mapping: &Mapping,
) -> Result<std::ops::Range<usize>, RecordError> {
    let rows = table.rows();
    match *mapping.rows {
        None => Ok(0..rows),
        Some([first, last]) if last <= rows => Ok(first - 1..last),
        Some([first, last]) => Err(RecordError::Rows {
            file: file.to_owned(),
            rows,
            first,
            last,
        }),
    }
}

fn column<'t>(file: &str, table: &'t Table, name: &ColumnName) -> Result<&'t [f64], RecordError> {
    let found = match name {
        ColumnName::Name(name) => table.columns.iter().find(|c| c.0 == *name),
        ColumnName::Number(number) => number.checked_sub(1).and_then(|i| table.columns.get(i)),
    };
    found
        .map(|c| c.1.as_slice())
        .ok_or_else(|| RecordError::Column {
            file: file.to_owned(),
            column: name.to_string(),
            known: listed(table.columns.iter().map(|c| c.0.as_str())),
        })
}

fn assemble(file: &str, table: &Table, mapping: &Mapping) -> Result<Record, RecordError> {
    let rows = rows(file, table, mapping)?;
    let taken = |name: &ColumnName| -> Result<&[f64], RecordError> {
        let all = column(file, table, name)?;
        let part = all.get(rows.clone()).unwrap_or_default();
        let bad = part.iter().position(|v| !v.is_finite());
        match bad {
            None => Ok(part),
            Some(at) => Err(RecordError::NotFinite {
                file: file.to_owned(),
                column: name.to_string(),
                row: rows.start + at + 1,
                cut: longest(part.len(), rows.start, |i| !part[i].is_finite(), |_| false),
            }),
        }
    };
    let period = match (&*mapping.time, &*mapping.sample_time) {
        (Some(time), stated) => {
            let seconds = time.unit.seconds();
            let times: Vec<f64> = taken(&time.column)?.iter().map(|t| t * seconds).collect();
            let found = regular(file, &times, rows.start)?;
            if let Some(stated) = stated.filter(|s| (found / s.0 - 1.0).abs() > SAMPLING) {
                return Err(RecordError::Sampling {
                    file: file.to_owned(),
                    found,
                    stated: stated.0,
                });
            }
            found
        }
        (None, Some(stated)) => stated.0,
        (None, None) => {
            let message = "the mapping says neither sample_time nor a column of times";
            return Err(Problems::from(Problem::new(message)).into());
        }
    };
    let channels = mapping
        .channels
        .iter()
        .map(|(name, source)| {
            let raw = taken(&source.column)?;
            let unit = source.unit.factor() * *source.scale;
            Ok(Channel {
                name: name.clone(),
                unit: source.unit.symbol().to_owned(),
                samples: raw.iter().map(|v| unit * (v - *source.offset)).collect(),
            })
        })
        .collect::<Result<Vec<_>, RecordError>>()?;
    Ok(Record { period, channels })
}

/// The mean step of times that have no gap.
fn regular(file: &str, times: &[f64], first: usize) -> Result<f64, RecordError> {
    let mut steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return Err(RecordError::Rows {
            file: file.to_owned(),
            rows: times.len(),
            first: 1,
            last: 2,
        });
    }
    let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let odd = |i: usize| {
        let step = times[i + 1] - times[i];
        !(step > 0.0 && step < GAP * usual)
    };
    if let Some(at) = (0..times.len() - 1).find(|&i| odd(i)) {
        return Err(RecordError::Gap {
            file: file.to_owned(),
            row: first + at + 1,
            step: times[at + 1] - times[at],
            usual,
            cut: longest(times.len(), first, |_| false, odd),
        });
    }
    let last = times.len() - 1;
    Ok((times[last] - times[0]) / last as f64)
}

/// The longest run of rows (from 1) without a bad row and without a break after a row; `first` rows come before.
fn longest(
    count: usize,
    first: usize,
    bad: impl Fn(usize) -> bool,
    break_after: impl Fn(usize) -> bool,
) -> [usize; 2] {
    let (mut best, mut start) = (0..0, 0);
    for i in 0..count {
        if bad(i) {
            start = i + 1;
            continue;
        }
        if i + 1 - start > best.len() {
            best = start..i + 1;
        }
        if i + 1 < count && break_after(i) {
            start = i + 1;
        }
    }
    [first + best.start + 1, first + best.end]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mapping(text: &str) -> Mapping {
        Mapping::parse("m.toml", text).unwrap()
    }

    fn table(columns: &[(&str, &[f64])]) -> Table {
        Table {
            columns: columns
                .iter()
                .map(|(n, v)| ((*n).to_owned(), v.to_vec()))
                .collect(),
        }
    }

    #[test]
    fn counts_become_radians() {
        let record = assemble(
            "r.csv",
            &table(&[("n", &[100.0, 101.0, 99.0]), ("t", &[0.0, 10.0, 20.0])]),
            &mapping(
                "time = { column = \"t\", unit = \"us\" }\n[channels.angle]\ncolumn = \"n\"\nunit = \"deg\"\nscale = 0.5\noffset = 100\n",
            ),
        )
        .unwrap();
        assert!((record.period - 1e-5).abs() < 1e-18);
        let angle = record.channel("angle").unwrap();
        assert!((angle[1] - 0.5f64.to_radians()).abs() < 1e-15 && angle[0] == 0.0);
        let error = record.channel("current").unwrap_err().to_string();
        assert!(error.contains("[channels.current]"), "{error}");
    }

    #[test]
    fn gaps_and_blanks_name_the_longest_piece() {
        let map = "time = { column = 1, unit = \"s\" }\n[channels.u]\ncolumn = 2\nunit = \"V\"\n";
        let times = [0.0, 1.0, 2.0, 7.0, 8.0, 9.0, 10.0];
        let u = [1.0; 7];
        let error = assemble("r", &table(&[("t", &times), ("u", &u)]), &mapping(map)).unwrap_err();
        let RecordError::Gap { row, cut, .. } = error else {
            panic!("{error}");
        };
        assert_eq!((row, cut), (3, [4, 7]));
        let cut = format!("rows = [4, 7]\n{map}");
        let record = assemble("r", &table(&[("t", &times), ("u", &u)]), &mapping(&cut)).unwrap();
        assert_eq!((record.len(), record.period), (4, 1.0));

        let u = [1.0, f64::NAN, 2.0, 3.0, 4.0, f64::NAN, 1.0];
        let even = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let error = assemble("r", &table(&[("t", &even), ("u", &u)]), &mapping(map)).unwrap_err();
        let RecordError::NotFinite { row, cut, .. } = error else {
            panic!("{error}");
        };
        assert_eq!((row, cut), (2, [3, 5]));
    }

    #[test]
    fn a_wrong_sample_time_is_told() {
        let map = "sample_time = \"2 s\"\ntime = { column = 1, unit = \"s\" }\n[channels.u]\ncolumn = 2\nunit = \"V\"\n";
        let error = assemble(
            "r",
            &table(&[("t", &[0.0, 1.0, 2.0]), ("u", &[0.0, 1.0, 0.0])]),
            &mapping(map),
        )
        .unwrap_err();
        assert!(matches!(error, RecordError::Sampling { .. }), "{error}");
    }

    /// A step is held to the middle one; one half as long again is a gap.
    #[test]
    fn a_gap_is_told_with_its_step_and_the_usual_one() {
        let period = regular("r", &[0.0, 1.0, 2.0, 4.0, 6.0, 8.0], 0).unwrap();
        assert!((period - 1.6).abs() < 1e-15);
        let error = regular("r", &[1.0, 2.0, 3.0, 4.5, 5.5, 6.5], 10).unwrap_err();
        let RecordError::Gap {
            row, step, usual, ..
        } = error
        else {
            panic!("{error}");
        };
        assert_eq!((row, step, usual), (13, 1.5, 1.0));
    }
}
