//! Which column of a record is what: by its heading or its place, with the unit that is told or that stands in the heading.

use meltpath_base::quantity::Quantity;
use meltpath_base::settings::{Json, Kind, Node, Place, Reader, Value};
use meltpath_base::table;

use super::ArcError;
use crate::error::RecordError;
use crate::mapping::ColumnName;
use crate::table::Table;

table! {
    /// Which columns the records have, alike in all of them.
    pub struct ArcColumns {
        /// Times: a heading, a place from 1, or a table with the unit. The usual unit is s.
        time: Column => none("`sample_time` is told");
        /// Voltage.
        voltage: Column => required;
        /// Current.
        current: Column => required;
        /// Wire feed that was measured.
        feed: Column => none("energies are told by the feed that was set, and no file is written of them");
    }

    /// A column with its unit.
    pub struct ColumnTable {
        /// Its heading (in a MAT file the variable's name), or its place from 1.
        column: ColumnName => required;
        /// Its unit.
        unit: String => none("it stands in the heading: `U (V)`, `U [V]`, `U / V`, `U_V`, or in a line below the headings");
        /// What its numbers are multiplied by.
        scale: f64 => default(1.0, "the column holds values");
    }
}

/// A column, as a file names it.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its heading or place.
    pub name: ColumnName,
    /// Its unit, where it is told.
    pub unit: Option<String>,
    /// What its numbers are multiplied by.
    pub scale: f64,
}

impl Value for Column {
    const KIND: Kind = Kind::Either(&ColumnName::KIND, &ColumnTable::KIND);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        if node.get_ref().as_table().is_some() {
            let ColumnTable {
                column,
                unit,
                scale,
            } = ColumnTable::read(node, place, reader)?;
            return Some(Column {
                name: column.value,
                unit: unit.value,
                scale: scale.value,
            });
        }
        Some(Column {
            name: ColumnName::read(node, place, reader)?,
            unit: None,
            scale: 1.0,
        })
    }

    fn json(&self) -> Json {
        self.name.json()
    }
}

impl ArcColumns {
    /// Those that are told.
    pub(super) fn told(&self) -> impl Iterator<Item = &Column> {
        let all = [
            self.time.as_ref(),
            Some(&*self.voltage),
            Some(&*self.current),
        ];
        all.into_iter().flatten().chain(self.feed.as_ref())
    }
}

/// The heading without a unit that follows it in brackets.
fn bare(heading: &str) -> &str {
    let cut = heading.rfind(['(', '[']).unwrap_or(heading.len());
    heading.get(..cut).unwrap_or(heading).trim()
}

/// Whether a name means a column of this place, from 1, and heading.
pub(super) fn means(name: &ColumnName, place: usize, heading: &str) -> bool {
    match name {
        ColumnName::Number(number) => *number == place,
        ColumnName::Name(name) => name == heading || name == bare(heading),
    }
}

/// Where in a heading its unit may stand.
fn units_of(heading: &str) -> Vec<String> {
    let heading = heading.trim();
    let mut found = Vec::new();
    let inside = |open, close| {
        let (_, rest) = heading.rsplit_once(open)?;
        rest.split_once(close)
            .map(|(unit, _)| unit.trim().to_owned())
    };
    found.extend(inside('(', ')'));
    found.extend(inside('[', ']'));
    found.extend(
        heading
            .rsplit_once(" / ")
            .map(|(_, unit)| unit.trim().to_owned()),
    );
    let parts: Vec<&str> = heading.split(['_', ' ', ',']).collect();
    if let [.., a, b] = parts[..] {
        found.push(format!("{a}/{b}"));
    }
    found.extend(parts.last().map(|unit| (*unit).to_owned()));
    found
}

/// The values of a column in the units of a quantity of the house; `usual` is the unit that people write.
///
/// # Errors
/// [`ArcError::Record`] where it is not there, [`ArcError::Unit`].
pub(super) fn values<Q: Quantity>(
    file: &str,
    table: &Table,
    column: &Column,
    usual: &'static str,
) -> Result<Vec<f64>, ArcError> {
    let found = (1..)
        .zip(&table.columns)
        .find(|(place, (heading, _))| means(&column.name, *place, heading));
    let Some((_, (heading, raw))) = found else {
        let known = table.columns.iter().map(|c| c.0.as_str());
        return Err(ArcError::Record(RecordError::Column {
            file: file.to_owned(),
            column: column.name.to_string(),
            known: crate::record::listed(known),
        }));
    };
    let of = |symbol: &String| Q::UNITS.iter().find(|u| u.symbol == symbol);
    let unit = match &column.unit {
        Some(symbol) => of(symbol),
        None => units_of(heading).iter().find_map(of),
    };
    let unit = unit.ok_or_else(|| ArcError::Unit {
        file: file.to_owned(),
        column: heading.clone(),
        told: match &column.unit {
            Some(symbol) => format!("\"{symbol}\" is no unit of a {}", Q::WHAT),
            None => format!("no unit of a {} is told or stands in its heading", Q::WHAT),
        },
        known: crate::record::listed(Q::UNITS.iter().map(|u| u.symbol)),
        example: usual,
    })?;
    let values = raw.iter().map(|v| unit.read(v * column.scale));
    Ok(values.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_in_headings_in_many_ways() {
        for (heading, unit) in [
            ("U (V)", "V"),
            ("Spannung [V]", "V"),
            ("feed / m/min", "m/min"),
            ("wire_feed_m/min", "m/min"),
            ("wfs_m_min", "m/min"),
            ("t_ms", "ms"),
            ("Current A", "A"),
        ] {
            assert!(units_of(heading).contains(&unit.to_owned()), "{heading}");
        }
        let name = |n: &str| ColumnName::Name(n.to_owned());
        assert!(means(&name("U"), 3, "U (V)") && means(&name("U (V)"), 3, "U (V)"));
        assert!(!means(&name("U"), 3, "Uset (V)") && means(&ColumnName::Number(3), 3, "x"));
    }
}
