//! Wires, gases and measured pools, from the data files that come with the program.

use std::f64::consts::PI;

use meltpath_base::Speed;
use meltpath_data::{File, find, gases, names, pools, wires};
use serde::Deserialize;

use crate::bead::{PoolModel, PursuitLength};

/// A number with where it comes from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Datum {
    /// The value, in `unit`.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Standard uncertainty in the same unit, where known.
    pub uncertainty: Option<f64>,
    /// Document.
    pub source: String,
    /// Page of it.
    pub page: String,
    /// How it was read or derived.
    pub note: Option<String>,
}

/// Why a data file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DataError {
    /// It does not read.
    #[error("{file}: {message}")]
    Syntax {
        /// Which file.
        file: String,
        /// What is wrong and where.
        message: String,
    },
    /// A number is out of range.
    #[error("{file}: {what} is {value}: {must}")]
    Value {
        /// Which file.
        file: String,
        /// Which number.
        what: String,
        /// What it is.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// There is no such entry.
    #[error("no {kind} \"{id}\" comes with the program: known are {known}")]
    Unknown {
        /// What was looked for.
        kind: &'static str,
        /// Its name.
        id: String,
        /// The names there are.
        known: String,
    },
}

pub(crate) fn read<T: for<'de> Deserialize<'de>>(file: &str, text: &str) -> Result<T, DataError> {
    toml::from_str(text).map_err(|e| DataError::Syntax {
        file: file.to_owned(),
        message: e.to_string(),
    })
}

fn within(
    file: &str,
    what: &str,
    value: f64,
    [low, high]: [f64; 2],
    must: &'static str,
) -> Result<f64, DataError> {
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(DataError::Value {
            file: file.to_owned(),
            what: what.to_owned(),
            value,
            must,
        })
    }
}

pub(crate) fn positive(file: &str, what: &str, value: f64) -> Result<f64, DataError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(DataError::Value {
            file: file.to_owned(),
            what: what.to_owned(),
            value,
            must: "it must be positive and finite",
        })
    }
}

/// Looks `id` up in a table of (id, text).
pub(crate) fn lookup(
    kind: &'static str,
    id: &str,
    files: &'static [File],
) -> Result<&'static str, DataError> {
    find(files, id)
        .map(|file| file.text)
        .ok_or_else(|| DataError::Unknown {
            kind,
            id: id.to_owned(),
            known: names(files),
        })
}

/// A wire.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wire {
    /// Version of the file's layout.
    pub schema: u32,
    /// Identifier in jobs.
    pub id: String,
    /// Name in words.
    pub name: String,
    /// Designation by its standard.
    pub standard: String,
    /// Diameter, mm.
    pub diameter: Datum,
    /// Density, kg/m³.
    pub density: Datum,
}

impl Wire {
    /// Reads a wire file.
    ///
    /// # Errors
    /// [`DataError`] when it does not read or a number is not positive.
    pub fn parse(file: &str, text: &str) -> Result<Self, DataError> {
        let wire: Wire = read(file, text)?;
        within(
            file,
            "diameter",
            wire.diameter.value,
            [0.1, 10.0],
            "it must be 0.1 to 10 mm",
        )?;
        within(
            file,
            "density",
            wire.density.value,
            [500.0, 25_000.0],
            "it must be 500 to 25000 kg/m³",
        )?;
        Ok(wire)
    }

    /// A wire that comes with the program.
    ///
    /// ```
    /// let wire = meltpath_deposition::consumable::Wire::builtin("x90-ig-1.0").unwrap();
    /// assert!((wire.section() - 0.7854).abs() < 1e-4);
    /// ```
    ///
    /// # Errors
    /// [`DataError::Unknown`] listing the wires there are.
    pub fn builtin(id: &str) -> Result<Self, DataError> {
        Self::parse(id, lookup("wire", id, wires::ALL)?)
    }

    /// Section, mm².
    pub fn section(&self) -> f64 {
        0.25 * PI * self.diameter.value * self.diameter.value
    }
}

/// A shielding gas.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gas {
    /// Version of the file's layout.
    pub schema: u32,
    /// Identifier in jobs.
    pub id: String,
    /// Name in words.
    pub name: String,
    /// Designation by its standard.
    pub standard: String,
    /// Volume percent of each component.
    pub composition: std::collections::BTreeMap<String, f64>,
    /// Flow, L/min.
    pub flow: Datum,
}

impl Gas {
    /// A gas that comes with the program.
    ///
    /// # Errors
    /// [`DataError::Unknown`] listing the gases there are.
    pub fn builtin(id: &str) -> Result<Self, DataError> {
        let gas: Gas = read(id, lookup("gas", id, gases::ALL)?)?;
        positive(id, "flow", gas.flow.value)?;
        Ok(gas)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PoolFile {
    #[serde(rename = "schema")]
    _schema: u32,
    #[serde(rename = "id")]
    _id: String,
    #[serde(rename = "wire")]
    _wire: String,
    #[serde(rename = "gas")]
    _gas: String,
    #[serde(rename = "mode")]
    _mode: String,
    pool: Vec<PoolRow>,
}

/// A pool measured at given settings.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoolRow {
    /// Wire feed, mm/s.
    pub wire_feed: Speed,
    /// Travel speed, mm/s.
    pub travel_speed: Speed,
    /// Half width b, mm; the front length is the same.
    pub half_width: Datum,
    /// Rear length a_b, mm.
    pub rear: Datum,
    /// Offset e, mm.
    pub offset: Datum,
}

impl PoolRow {
    /// The pool as the deposit takes it.
    pub fn model(&self, pursuit: PursuitLength) -> PoolModel {
        PoolModel {
            front: self.half_width.value,
            rear: self.rear.value,
            half_width: self.half_width.value,
            offset: self.offset.value,
            pursuit,
        }
    }
}

/// The measured pools of a configuration that comes with the program (`wire`-`mode`-`gas`).
///
/// # Errors
/// [`DataError::Unknown`] listing the configurations there are.
pub fn pools(id: &str) -> Result<Vec<PoolRow>, DataError> {
    let file: PoolFile = read(id, lookup("pool", id, pools::ALL)?)?;
    for row in &file.pool {
        positive(id, "half_width", row.half_width.value)?;
        positive(id, "rear", row.rear.value)?;
    }
    Ok(file.pool)
}

/// The measured pool nearest to given settings in the ratio of wire feed to travel speed; the first of a
/// configuration that has none of its own is the only one there is, stated as such by the caller.
pub fn nearest_pool(rows: &[PoolRow], wire_feed: f64, travel_speed: f64) -> Option<&PoolRow> {
    let wanted = wire_feed / travel_speed;
    let distance = |r: &&PoolRow| (r.wire_feed.0 / r.travel_speed.0 / wanted).ln().abs();
    rows.iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_that_ships_reads() {
        for file in wires::ALL {
            assert_eq!(Wire::builtin(file.name).unwrap().id, file.name);
        }
        for file in gases::ALL {
            let gas = Gas::builtin(file.name).unwrap();
            assert_eq!(gas.id, file.name);
            assert!((gas.composition.values().sum::<f64>() - 100.0).abs() < 1e-9);
        }
        let rows = pools("x90-ig-1.0-cmt-m14").unwrap();
        assert_eq!(rows.len(), 2);
        let near = nearest_pool(&rows, 9.0, 0.5).unwrap();
        assert!((near.half_width.value - 4.14).abs() < 1e-12);
    }

    #[test]
    fn unknown_names_are_told_the_known_ones() {
        let error = Wire::builtin("x91").unwrap_err().to_string();
        assert!(error.contains("\"x90-ig-1.0\""), "{error}");
        let bad = wires::ALL[0].text.replace("value = 1.0", "value = -1.0");
        assert!(matches!(
            Wire::parse("w", &bad),
            Err(DataError::Value { .. })
        ));
        assert!(Wire::parse("w", &format!("colour = 1\n{}", wires::ALL[0].text)).is_err());
    }
}
