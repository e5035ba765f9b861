//! Tables of temperatures: columns x, y, z, t, T with their units in the heads.

use std::path::Path;

use meltpath_base::Reporter;
use meltpath_perception::{RecordError, table};
use meltpath_thermal::comparison::Sample;
use meltpath_thermal::material::CELSIUS;

/// Why a table of temperatures was refused.
#[derive(Debug, thiserror::Error)]
pub enum SamplesError {
    /// The file.
    #[error(transparent)]
    File(#[from] RecordError),
    /// A column that is not there.
    #[error(
        "`{file}` has no column for {wanted}: its columns are {found}; name them x, y, z, t, T, with the unit if it is not mm, s, °C, such as `x_mm`, `t (ms)`, `T_K`"
    )]
    Column {
        /// The file.
        file: String,
        /// What is missing.
        wanted: &'static str,
        /// What there is.
        found: String,
    },
    /// A unit that is not known.
    #[error("`{file}`, column \"{column}\": the unit \"{unit}\" is not one of {known}")]
    Unit {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// What is known.
        known: String,
    },
    /// A layer that is not there.
    #[error("`{file}`, row {row}: layer {value} is not one of the run's 1 to {layers}")]
    Layer {
        /// The file.
        file: String,
        /// Row of numbers, from 1.
        row: usize,
        /// The layer given.
        value: f64,
        /// Layers of the run.
        layers: usize,
    },
    /// A temperature below absolute zero.
    #[error(
        "`{file}`, row {row}: {value} {unit} is below absolute zero: is the column in another unit?"
    )]
    Cold {
        /// The file.
        file: String,
        /// Row of numbers, from 1.
        row: usize,
        /// The value.
        value: f64,
        /// Its unit.
        unit: String,
    },
    /// No row with all numbers.
    #[error("`{file}` has no row in which x, y, t and T are all numbers")]
    Empty {
        /// The file.
        file: String,
    },
}

/// A unit: its spellings, and `internal = factor · written + offset`.
struct Unit {
    spellings: &'static [&'static str],
    factor: f64,
    offset: f64,
}

const fn unit(spellings: &'static [&'static str], factor: f64, offset: f64) -> Unit {
    Unit {
        spellings,
        factor,
        offset,
    }
}

/// The first unit of each is meant where a head names none.
const LENGTHS: &[Unit] = &[
    unit(&["mm"], 1.0, 0.0),
    unit(&["m"], 1e3, 0.0),
    unit(&["µm", "um"], 1e-3, 0.0),
];
const TIMES: &[Unit] = &[
    unit(&["s"], 1.0, 0.0),
    unit(&["ms"], 1e-3, 0.0),
    unit(&["µs", "us"], 1e-6, 0.0),
];
const TEMPERATURES: &[Unit] = &[
    unit(&["°C", "C", "degC"], 1.0, CELSIUS),
    unit(&["K"], 1.0, 0.0),
];

/// Name and unit of a head such as `x (mm)`, `x [mm]`, `x_mm` or `x`.
fn parts(head: &str) -> (&str, &str) {
    let head = head.trim();
    match head.find(['(', '[', '_']) {
        Some(at) => {
            let unit = head[at + 1..].trim_end_matches([')', ']']);
            (head[..at].trim(), unit.trim())
        }
        None => (head, ""),
    }
}

struct Wanted {
    names: &'static [&'static str],
    what: &'static str,
    units: &'static [Unit],
}

/// A sample and its layer, from 1 on the plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// The layer that was being drawn; the last one where the table does not say.
    pub layer: usize,
    /// The sample.
    pub sample: Sample,
}

/// Layers of what a table is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    /// How many.
    pub count: usize,
    /// Thickness of each, mm: the first one's surface lies at z = 0.
    pub thickness: f64,
}

const NUMBERS: &[Unit] = &[unit(&["1"], 1.0, 0.0)];

const COLUMNS: [Wanted; 6] = [
    Wanted {
        names: &["x", "X"],
        what: "x",
        units: LENGTHS,
    },
    Wanted {
        names: &["y", "Y"],
        what: "y",
        units: LENGTHS,
    },
    Wanted {
        names: &["z", "Z"],
        what: "z",
        units: LENGTHS,
    },
    Wanted {
        names: &["t", "time", "Time"],
        what: "the time t",
        units: TIMES,
    },
    Wanted {
        names: &["T", "temperature", "Temperature", "temp"],
        what: "the temperature T",
        units: TEMPERATURES,
    },
    Wanted {
        names: &["layer", "Layer"],
        what: "the layer",
        units: NUMBERS,
    },
];

/// Values of a column in mm, s or K, with the unit as written; `None` where there is none of its names.
fn column(
    file: &str,
    columns: &[(String, Vec<f64>)],
    wanted: &Wanted,
) -> Result<Option<(Vec<f64>, &'static str)>, SamplesError> {
    let found = columns
        .iter()
        .find(|(head, _)| wanted.names.contains(&parts(head).0));
    let Some((head, values)) = found else {
        return Ok(None);
    };
    let written = parts(head).1;
    let unit = if written.is_empty() {
        wanted.units.first()
    } else {
        wanted.units.iter().find(|u| u.spellings.contains(&written))
    };
    let unit = unit.ok_or_else(|| SamplesError::Unit {
        file: file.to_owned(),
        column: head.clone(),
        unit: written.to_owned(),
        known: wanted
            .units
            .iter()
            .flat_map(|u| u.spellings)
            .copied()
            .collect::<Vec<_>>()
            .join(", "),
    })?;
    let values = values
        .iter()
        .map(|v| unit.factor * v + unit.offset)
        .collect();
    Ok(Some((values, unit.spellings[0])))
}

/// Reads the samples of a CSV, Parquet or MAT table taken while `layers` were drawn. Without a column `layer` the last one is
/// meant, without a z its surface. Rows in which a number is missing are left out and told.
///
/// # Errors
/// [`SamplesError`].
pub fn read(path: &Path, layers: Layers, reporter: &Reporter) -> Result<Vec<Row>, SamplesError> {
    rows(path, Some(layers), reporter)
}

/// The same whatever was being drawn: a column `layer` is not looked at, and without a z the height is 0.
///
/// # Errors
/// [`SamplesError`].
pub fn of_any_layer(path: &Path, reporter: &Reporter) -> Result<Vec<Sample>, SamplesError> {
    let found = rows(path, None, reporter)?;
    Ok(found.into_iter().map(|r| r.sample).collect())
}

fn rows(
    path: &Path,
    layers: Option<Layers>,
    reporter: &Reporter,
) -> Result<Vec<Row>, SamplesError> {
    let file = path.display().to_string();
    let table = table::read(path)?;
    let mut found: Vec<Option<(Vec<f64>, &'static str)>> = Vec::new();
    let known = if layers.is_some() { 6 } else { 5 };
    for wanted in &COLUMNS[..known] {
        let values = column(&file, &table.columns, wanted)?;
        if values.is_none() && !["z", "the layer"].contains(&wanted.what) {
            let heads: Vec<String> = table
                .columns
                .iter()
                .map(|(h, _)| format!("\"{h}\""))
                .collect();
            return Err(SamplesError::Column {
                file,
                wanted: wanted.what,
                found: heads.join(", "),
            });
        }
        found.push(values);
    }
    if found[2].is_none() {
        reporter.warn(
            "no-z",
            format!(
                "`{file}` has no column z: its temperatures are taken as those of the build plane"
            ),
            "add a column z if they were taken deeper",
        );
    }
    if layers.is_none() {
        found.push(None);
    }
    let layers = layers.unwrap_or(Layers {
        count: 1,
        thickness: 0.0,
    });
    let rows = table.rows();
    let value = |column: usize, row: usize, otherwise: f64| {
        found[column]
            .as_ref()
            .map_or(otherwise, |(values, _)| values[row])
    };
    let mut samples = Vec::with_capacity(rows);
    for row in 0..rows {
        let layer = value(5, row, layers.count as f64);
        let top = (layer - 1.0) * layers.thickness;
        let sample = Sample {
            place: [value(0, row, 0.0), value(1, row, 0.0), value(2, row, top)],
            time: value(3, row, 0.0),
            kelvin: value(4, row, 0.0),
        };
        let whole = sample.place.iter().all(|v| v.is_finite())
            && sample.time.is_finite()
            && sample.kelvin.is_finite()
            && layer.is_finite();
        if !whole {
            continue;
        }
        if sample.kelvin < 0.0 {
            let unit = found[4].as_ref().map_or("", |(_, unit)| unit);
            let offset = if unit == "K" { 0.0 } else { CELSIUS };
            return Err(SamplesError::Cold {
                file,
                row: row + 1,
                value: sample.kelvin - offset,
                unit: unit.to_owned(),
            });
        }
        let number = (1..=layers.count).find(|n| (*n as f64 - layer).abs() < 1e-6);
        let layer = number.ok_or(SamplesError::Layer {
            file: file.clone(),
            row: row + 1,
            value: layer,
            layers: layers.count,
        })?;
        samples.push(Row { layer, sample });
    }
    if samples.is_empty() {
        return Err(SamplesError::Empty { file });
    }
    if samples.len() < rows {
        reporter.warn(
            "rows-without-numbers",
            format!(
                "{} of {rows} rows of `{file}` lack a number and are left out",
                rows - samples.len()
            ),
            "",
        );
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: Layers = Layers {
        count: 2,
        thickness: 0.1,
    };

    fn written(text: &str) -> Result<Vec<Row>, SamplesError> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("table.csv");
        std::fs::write(&file, text).unwrap();
        read(&file, TWO, &Reporter::new())
    }

    #[test]
    fn heads_name_units() {
        let mm = written("x,y,z,t,T\n1,2,-0.1,0.5,1000\n").unwrap();
        let other = written("t (ms);T_K;X [m];y_um;z\n500;1273,15;0,001;2000;-0,1\n").unwrap();
        let (a, b) = (&mm[0].sample, &other[0].sample);
        assert!((a.place[0] - b.place[0]).abs() < 1e-12, "{a:?} {b:?}");
        assert!((a.place[1] - b.place[1]).abs() < 1e-12, "{a:?} {b:?}");
        assert!((a.time - b.time).abs() < 1e-12 && (a.kelvin - b.kelvin).abs() < 1e-9);
        // without z: the build plane
        let last = written("x,y,t,T\n1,2,0,900\n").unwrap()[0];
        assert!(last.layer == 2 && (last.sample.place[2] - 0.1).abs() < 1e-12);
        let first = written("x,y,t,T,layer\n1,2,0,900,1\n").unwrap()[0];
        assert!(first.layer == 1 && first.sample.place[2] == 0.0);
    }

    #[test]
    fn bad_tables_are_named() {
        let told = |text: &str| written(text).unwrap_err().to_string();
        assert!(told("x,y,t\n1,2,3\n").contains("no column for the temperature T"));
        assert!(told("x_inch,y,t,T\n1,2,3,4\n").contains("the unit \"inch\" is not one of mm, m"));
        assert!(told("x,y,t,T\n1,2,3,900\n1,2,3,-300\n").contains("row 2: -300 °C is below"));
        assert!(told("x,y,t,T\n,2,3,900\n").contains("no row"));
        assert!(told("x,y,t,T\n1,2,3,hot\n").contains("hot"));
        let third = told("x,y,t,T,layer\n1,2,3,900,1\n1,2,3,900,3\n");
        assert!(
            third.contains("row 2: layer 3 is not one of the run's 1 to 2"),
            "{third}"
        );
        assert!(told("x,y,t,T,layer\n1,2,3,900,1.5\n").contains("layer 1.5"));
    }
}
