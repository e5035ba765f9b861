//! Tables of temperatures: columns x, y, z, t, T, or highest temperatures and times of freezing, with their units in the heads.

use std::path::Path;

use meltpath_base::Reporter;
use meltpath_perception::{RecordError, table};
use meltpath_thermal::grid::sample::Sample;
use meltpath_thermal::material::CELSIUS;

use super::quantity::Quantity;

/// Why a table of temperatures was refused.
#[derive(Debug, thiserror::Error)]
pub enum SamplesError {
    /// The file.
    #[error(transparent)]
    File(#[from] RecordError),
    /// A column that is not there.
    #[error(
        "`{file}` has no column for {wanted}: its columns are {found}; name them x, y, z, t, T (or T_max, time_molten, solidified without t), with the unit if it is not mm, s, °C, such as `x_mm`, `t (ms)`, `T_K`"
    )]
    Column {
        /// The file.
        file: String,
        /// What is missing.
        wanted: &'static str,
        /// What there is.
        found: String,
    },
    /// Two columns of one meaning.
    #[error(
        "`{file}` has two columns for {wanted}, \"{first}\" and \"{second}\": which of them is meant? Leave one out, or give it another name"
    )]
    Twice {
        /// The file.
        file: String,
        /// What both tell.
        wanted: &'static str,
        /// The one.
        first: String,
        /// The other.
        second: String,
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
    #[error("`{file}` has no row in which x, y and what it tells are all numbers")]
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

/// The unit of a head such as `x (mm)`, `x [mm]`, `x_mm` or `x` that bears the name; `None` where it bears another.
fn unit_of<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    let rest = head.trim().strip_prefix(name)?.trim();
    if rest.is_empty() {
        return Some("");
    }
    let unit = rest.strip_prefix(['(', '[', '_'])?;
    Some(unit.trim_end_matches([')', ']']).trim())
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

const fn wanted(
    names: &'static [&'static str],
    what: &'static str,
    units: &'static [Unit],
) -> Wanted {
    Wanted { names, what, units }
}

/// Place, layer and time, then the quantities in the order of [`Quantity::ALL`].
const COLUMNS: [Wanted; 9] = [
    wanted(&["x", "X"], "x", LENGTHS),
    wanted(&["y", "Y"], "y", LENGTHS),
    wanted(&["z", "Z"], "z", LENGTHS),
    wanted(&["layer", "Layer"], "the layer", NUMBERS),
    wanted(&["t", "time", "Time"], "the time t", TIMES),
    wanted(
        &["T", "temperature", "Temperature", "temp"],
        "the temperature T",
        TEMPERATURES,
    ),
    wanted(
        &[
            "highest_temperature",
            "highest temperature",
            "T_max",
            "Tmax",
        ],
        "the highest temperature T_max",
        TEMPERATURES,
    ),
    wanted(&["time_molten"], "the time molten", TIMES),
    wanted(&["solidified"], "the time of freezing", TIMES),
];
/// See [`COLUMNS`].
const Z: usize = 2;
const LAYER: usize = 3;
const TIME: usize = 4;
const FIRST_QUANTITY: usize = 5;

/// Which of [`COLUMNS`] a head names, by the longest name that it bears, and the unit it writes.
fn named(head: &str) -> Option<(usize, &str)> {
    let names = COLUMNS.iter().enumerate().flat_map(|(n, wanted)| {
        let names = wanted.names.iter();
        names.filter_map(move |name| Some((name.len(), n, unit_of(head, name)?)))
    });
    let longest = names.max_by_key(|(length, _, _)| *length);
    longest.map(|(_, n, unit)| (n, unit))
}

/// A column in mm, s or K, with the unit as written.
type Column = (Vec<f64>, &'static str);

/// The columns of a table that are wanted, one of each; a head bears the longest name that it can.
fn columns(file: &str, table: &[(String, Vec<f64>)]) -> Result<Vec<Option<Column>>, SamplesError> {
    let mut found: Vec<Option<Column>> = COLUMNS.iter().map(|_| None).collect();
    let mut heads = [None; COLUMNS.len()];
    for (head, values) in table {
        let Some((n, written)) = named(head) else {
            continue;
        };
        if let Some(first) = heads[n].replace(head) {
            return Err(SamplesError::Twice {
                file: file.to_owned(),
                wanted: COLUMNS[n].what,
                first: first.clone(),
                second: head.clone(),
            });
        }
        let units = COLUMNS[n].units;
        let unit = if written.is_empty() {
            units.first()
        } else {
            units.iter().find(|u| u.spellings.contains(&written))
        };
        let unit = unit.ok_or_else(|| SamplesError::Unit {
            file: file.to_owned(),
            column: head.clone(),
            unit: written.to_owned(),
            known: units
                .iter()
                .flat_map(|u| u.spellings)
                .copied()
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        let values = values.iter().map(|v| unit.factor * v + unit.offset);
        found[n] = Some((values.collect(), unit.spellings[0]));
    }
    Ok(found)
}

/// What a table tells of each quantity that it has.
pub type Told = Vec<(Quantity, Vec<Row>)>;

/// Reads what a CSV, Parquet or MAT table tells of `layers`. Without a column `layer` the last one is meant, without a z its
/// surface. Rows in which a number is missing are left out and told.
///
/// # Errors
/// [`SamplesError`].
pub fn read(path: &Path, layers: Layers, reporter: &Reporter) -> Result<Told, SamplesError> {
    told(path, Some(layers), reporter)
}

/// The same whatever was being drawn: a column `layer` is not looked at, and without a z the height is 0.
///
/// # Errors
/// [`SamplesError`].
pub fn of_any_layer(path: &Path, reporter: &Reporter) -> Result<Told, SamplesError> {
    told(path, None, reporter)
}

fn told(path: &Path, layers: Option<Layers>, reporter: &Reporter) -> Result<Told, SamplesError> {
    let file = path.display().to_string();
    // words are welcome in the columns beside
    let table = table::read_where(path, |_, head| named(head).is_some())?;
    let mut found = columns(&file, &table.columns)?;
    let missing = |wanted: &'static str| {
        let heads = table.columns.iter().map(|(head, _)| format!("\"{head}\""));
        SamplesError::Column {
            file: file.clone(),
            wanted,
            found: heads.collect::<Vec<String>>().join(", "),
        }
    };
    let temperature = FIRST_QUANTITY + Quantity::Temperature as usize;
    if let Some(n) = (0..Z).find(|n| found[*n].is_none()) {
        return Err(missing(COLUMNS[n].what));
    }
    if found[FIRST_QUANTITY..].iter().all(Option::is_none) {
        return Err(missing(COLUMNS[temperature].what));
    }
    if found[temperature].is_some() && found[TIME].is_none() {
        return Err(missing(COLUMNS[TIME].what));
    }
    if found[Z].is_none() {
        reporter.warn(
            "no-z",
            format!(
                "`{file}` has no column z: its temperatures are taken as those of the build plane"
            ),
            "add a column z if they were taken deeper",
        );
    }
    if layers.is_none() {
        found[LAYER] = None;
    }
    let layers = layers.unwrap_or(Layers {
        count: 1,
        thickness: 0.0,
    });
    let mut all = Told::new();
    for quantity in Quantity::ALL {
        let column = FIRST_QUANTITY + quantity as usize;
        if found[column].is_none() {
            continue;
        }
        let rows = of_quantity(&file, &found, quantity, table.rows(), layers)?;
        if rows.len() < table.rows() && !rows.is_empty() {
            reporter.warn(
                "rows-without-numbers",
                format!(
                    "{} of {} rows of `{file}` lack a number of the {} and are left out",
                    table.rows() - rows.len(),
                    table.rows(),
                    quantity.words()
                ),
                "",
            );
        }
        if !rows.is_empty() {
            all.push((quantity, rows));
        }
    }
    if all.is_empty() {
        return Err(SamplesError::Empty { file });
    }
    Ok(all)
}

/// The rows that tell a quantity.
fn of_quantity(
    file: &str,
    found: &[Option<Column>],
    quantity: Quantity,
    rows: usize,
    layers: Layers,
) -> Result<Vec<Row>, SamplesError> {
    let value = |column: usize, row: usize, otherwise: f64| {
        let column = found[column].as_ref();
        column.map_or(otherwise, |(values, _)| values[row])
    };
    let told = FIRST_QUANTITY + quantity as usize;
    let mut samples = Vec::with_capacity(rows);
    for row in 0..rows {
        let layer = value(LAYER, row, layers.count as f64);
        let top = (layer - 1.0) * layers.thickness;
        let sample = Sample {
            place: [value(0, row, 0.0), value(1, row, 0.0), value(Z, row, top)],
            time: if quantity.is_in_time() {
                value(TIME, row, 0.0)
            } else {
                0.0
            },
            value: value(told, row, f64::NAN),
        };
        let whole = sample.place.iter().all(|v| v.is_finite())
            && sample.time.is_finite()
            && sample.value.is_finite()
            && layer.is_finite();
        if !whole {
            continue;
        }
        if quantity.is_temperature() && sample.value < 0.0 {
            let unit = found[told].as_ref().map_or("", |(_, unit)| unit);
            let offset = if unit == "K" { 0.0 } else { CELSIUS };
            return Err(SamplesError::Cold {
                file: file.to_owned(),
                row: row + 1,
                value: sample.value - offset,
                unit: unit.to_owned(),
            });
        }
        let number = (1..=layers.count).find(|n| (*n as f64 - layer).abs() < 1e-6);
        let layer = number.ok_or_else(|| SamplesError::Layer {
            file: file.to_owned(),
            row: row + 1,
            value: layer,
            layers: layers.count,
        })?;
        samples.push(Row { layer, sample });
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
        let told = read(&file, TWO, &Reporter::new())?;
        Ok(told.into_iter().next().unwrap().1)
    }

    #[test]
    fn heads_name_units() {
        let mm = written("x,y,z,t,T\n1,2,-0.1,0.5,1000\n").unwrap();
        let other = written("t (ms);T_K;X [m];y_um;z\n500;1273,15;0,001;2000;-0,1\n").unwrap();
        let (a, b) = (&mm[0].sample, &other[0].sample);
        assert!((a.place[0] - b.place[0]).abs() < 1e-12, "{a:?} {b:?}");
        assert!((a.place[1] - b.place[1]).abs() < 1e-12, "{a:?} {b:?}");
        assert!((a.time - b.time).abs() < 1e-12 && (a.value - b.value).abs() < 1e-9);
        // words in a column beside
        let words = written("note,x,y,z,t,T,who\nfirst,1,2,-0.1,0.5,1000,\"A, B\"\n").unwrap();
        assert_eq!(words, mm);
        // without z: the build plane
        let last = written("x,y,t,T\n1,2,0,900\n").unwrap()[0];
        assert!(last.layer == 2 && (last.sample.place[2] - 0.1).abs() < 1e-12);
        let first = written("x,y,t,T,layer\n1,2,0,900,1\n").unwrap()[0];
        assert!(first.layer == 1 && first.sample.place[2] == 0.0);
    }

    #[test]
    fn the_longest_name_is_meant() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("table.csv");
        let text = "x_mm,y_mm,time_molten_ms,T_max_K,solidified (s),temperature gradient\n1,2,3,1500,0.25,7\n1,2,3,1500,,7\n";
        std::fs::write(&file, text).unwrap();
        let told = read(&file, TWO, &Reporter::new()).unwrap();
        let all: Vec<(Quantity, usize, f64)> = told
            .iter()
            .map(|(q, rows)| (*q, rows.len(), rows[0].sample.value))
            .collect();
        let wanted = [
            (Quantity::Highest, 2, 1500.0),
            (Quantity::Molten, 2, 3e-3),
            (Quantity::Solidified, 1, 0.25),
        ];
        assert_eq!(all, wanted);
    }

    #[test]
    fn bad_tables_are_named() {
        let told = |text: &str| written(text).unwrap_err().to_string();
        assert!(told("note,x,y,t,T\na,1,2,3,hot\n").contains("`hot` is no number"));
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
