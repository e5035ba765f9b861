//! Wires, gases and measured pools, from the data files that come with the program.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use meltpath_base::settings::{Datum, Problem, Problems};
use meltpath_base::{Angle, Density, Length, Speed, quantity, settings, table};
use meltpath_data::{File, find, names, wires};

use crate::bead::{PoolModel, PursuitLength};
use crate::pursuit::law::{LawError, MOST, PursuitLaw};

/// Why a data file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DataError {
    /// What is written in it is wrong.
    #[error(transparent)]
    Content(#[from] Problems),
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

quantity!(
    /// A flow of gas, L/min inside.
    GasFlow, "flow", "L/min",
    [("L/min", 1.0)]
);

table! {
    /// A wire.
    pub struct Wire {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Identifier in jobs, process maps and weld pools.
        id: String => required;
        /// Name in words.
        name: String => required;
        /// Designation by its standard.
        standard: String => required;
        /// Diameter.
        diameter: Datum<Length> where within(0.1, 10.0) => required;
        /// Density.
        density: Datum<Density> where within(500.0, 25_000.0) => required;
    }

    /// A shielding gas.
    pub struct Gas {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Identifier in jobs and process maps.
        id: String => required;
        /// Name in words.
        name: String => required;
        /// Designation by its standard.
        standard: String => required;
        /// Volume percent of each component.
        composition: BTreeMap<String, f64> where within(0.0, 100.0) => required;
        /// Flow.
        flow: Datum<GasFlow> where positive => required;
    }

    /// Weld pools measured for a wire, gas and mode, and how far the bead stays behind the torch at corners.
    pub struct PoolFile {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Identifier: `wire-mode-gas`.
        id: String => required;
        /// Wire.
        wire: String => required;
        /// Gas.
        gas: String => required;
        /// Transfer mode.
        mode: String => required;
        /// The pools.
        pool: Vec<PoolRow> => default([], "a file of pursuit lengths alone, such as `meltpath measure` writes");
        /// Pursuit lengths of corners, linear between them and constant beyond, at most ten.
        pursuit: Vec<PursuitRow> => default([], "those of another file, told");
    }

    /// How far the bead stays behind the torch at a corner.
    pub struct PursuitRow {
        /// How far the path turns there: 0 is straight on.
        corner: Angle where within(0.0, std::f64::consts::PI) => required;
        /// Distance l from the torch to the point of the bead that it draws behind it.
        length: Datum<Length> where within(0.2, 50.0) => required;
    }

    /// A pool measured at given settings.
    pub struct PoolRow {
        /// Wire feed.
        wire_feed: Speed where positive => required;
        /// Travel speed.
        travel_speed: Speed where positive => required;
        /// Half width b; the front length is the same.
        half_width: Datum<Length> where positive => required;
        /// Rear length a_b.
        rear: Datum<Length> where positive => required;
        /// Offset e.
        offset: Datum<Length> where not_negative => required;
    }
}

impl Wire {
    /// Reads a wire file.
    ///
    /// # Errors
    /// Everything wrong, with its place in the file.
    pub fn parse(text: &str) -> Result<Self, Problems> {
        settings::parse(text, |_: &Self| Vec::new())
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
        Ok(Self::parse(lookup("wire", id, wires::ALL)?)?)
    }

    /// Section, mm².
    pub fn section(&self) -> f64 {
        0.25 * PI * self.diameter.0 * self.diameter.0
    }
}

/// How far the components of a gas may be from 100 % together.
const COMPOSITION_SLACK: f64 = 0.5;

impl Gas {
    /// Reads a gas file.
    ///
    /// # Errors
    /// Everything wrong, with its place in the file.
    pub fn parse(text: &str) -> Result<Self, Problems> {
        settings::parse(text, |gas: &Self| {
            let sum: f64 = gas.composition.values().sum();
            let complete = (sum - 100.0).abs() <= COMPOSITION_SLACK;
            let problem = || {
                let message = format!("the components of the gas are {sum} % together, not 100 %");
                let problem: Problem = gas.composition.problem(message);
                problem.help("give the volume percent of each: { Ar = 82.0, CO2 = 18.0 }")
            };
            if complete {
                Vec::new()
            } else {
                vec![problem()]
            }
        })
    }
}

impl PoolRow {
    /// The pool as the deposit takes it.
    pub fn model(&self, pursuit: PursuitLength) -> PoolModel {
        PoolModel {
            front: self.half_width.0,
            rear: self.rear.0,
            half_width: self.half_width.0,
            offset: self.offset.0,
            pursuit,
        }
    }
}

impl PoolFile {
    /// Reads a file of measured pools.
    ///
    /// # Errors
    /// Everything wrong, with its place in the file.
    pub fn parse(text: &str) -> Result<Self, Problems> {
        settings::parse(text, |file: &Self| {
            let none = || {
                file.pool
                    .problem("the file holds no pool and no pursuit length: add a table [[pool]] or [[pursuit]]")
            };
            let none = (file.pool.is_empty() && file.pursuit.is_empty()).then(none);
            let refused = match file.law_of_rows() {
                Some(Err(LawError::Count)) => Some(format!(
                    "the file tells {} pursuit lengths, {MOST} are the most: leave some out, they are linear between",
                    file.pursuit.len()
                )),
                Some(Err(LawError::Values)) => Some(
                    "angles of [[pursuit]] must increase from row to row: sort them, and make one row of those at one angle".to_owned(),
                ),
                None | Some(Ok(_)) => None,
            };
            let refused = refused.map(|why| file.pursuit.problem(why));
            let swapped = file.pool.iter().filter(|row| row.rear.0 < row.half_width.0);
            let swapped = swapped.map(|row| {
                let [rear, half] = [row.rear.0, row.half_width.0];
                let message = format!("a pool that reaches {rear} mm behind the arc and {half} mm to each side");
                row.rear.problem(message).help("a moving pool is longer behind than it is wide: are rear and half_width swapped?")
            });
            none.into_iter().chain(refused).chain(swapped).collect()
        })
    }

    fn law_of_rows(&self) -> Option<Result<PursuitLaw, LawError>> {
        let rows: Vec<[f64; 2]> = self
            .pursuit
            .iter()
            .map(|r| [r.corner.0, r.length.0])
            .collect();
        (!rows.is_empty()).then(|| PursuitLaw::new(&rows))
    }

    /// Its pursuit lengths, where it tells any.
    pub fn law(&self) -> Option<PursuitLaw> {
        self.law_of_rows()?.ok()
    }
}

/// The measured pool nearest to given settings in the ratio of wire feed to travel speed.
pub fn nearest_pool(rows: &[PoolRow], wire_feed: f64, travel_speed: f64) -> Option<&PoolRow> {
    let wanted = wire_feed / travel_speed;
    let distance = |r: &&PoolRow| (r.wire_feed.0 / r.travel_speed.0 / wanted).ln().abs();
    rows.iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

#[cfg(test)]
mod tests {
    use meltpath_data::{gases, pools};

    use super::*;

    #[test]
    fn everything_that_ships_reads() {
        for file in wires::ALL {
            assert_eq!(*Wire::builtin(file.name).unwrap().id, file.name);
        }
        for file in gases::ALL {
            let gas = Gas::parse(file.text).unwrap();
            assert_eq!(*gas.id, file.name);
        }
        for file in pools::ALL {
            assert_eq!(*PoolFile::parse(file.text).unwrap().id, file.name);
        }
        let rows = PoolFile::parse(pools::X90_IG_1_0_CMT_M14.text)
            .unwrap()
            .pool;
        assert_eq!(rows.len(), 2);
        let near = nearest_pool(&rows, 9.0, 0.5).unwrap();
        assert!((near.half_width.0 - 4.14).abs() < 1e-12);
    }

    /// A pool that is wider than long is one whose sizes were exchanged; none lies behind where it begins.
    #[test]
    fn pools_that_cannot_be_are_refused() {
        let good = pools::X90_IG_1_0_CMT_M14.text;
        let swapped = good.replace("value = 10.80", "value = 3.0");
        let ahead = good.replace("value = 1.66", "value = -1.66");
        for (text, words) in [(swapped, "swapped"), (ahead, "offset")] {
            let refused = PoolFile::parse(&text).unwrap_err().to_string();
            assert!(refused.contains(words), "{refused}");
        }
    }

    #[test]
    fn unknown_names_are_told_the_known_ones() {
        let error = Wire::builtin("x91").unwrap_err().to_string();
        assert!(error.contains("\"x90-ig-1.0\""), "{error}");
    }

    /// All mistakes of a file at once, each with its place; what mends it does.
    #[test]
    fn a_wire_of_ones_own_is_answered_with_places_and_remedies() {
        let good = wires::X90_IG_1_0.text;
        let inch = good.replace("value = 1.0\nunit = \"mm\"", "value = 0.045\nunit = \"in\"");
        let wire = Wire::parse(&inch).unwrap();
        assert!((wire.diameter.0 - 1.143).abs() < 1e-12);
        assert!((wire.diameter.uncertainty.unwrap() - 0.254).abs() < 1e-12);

        let mut bad = good
            .replace("value = 1.0", "value = \"1,0\"")
            .replace("standard =", "standart =")
            .replace("unit = \"kg/m3\"", "unit = \"kg/cm3\"");
        let problems = Wire::parse(&bad).unwrap_err().0;
        assert_eq!(problems.len(), 4, "{problems:?}");
        for problem in problems.iter().rev() {
            if let (Some(fix), Some(span)) = (&problem.fix, problem.span.clone()) {
                bad.replace_range(span, fix);
            }
        }
        assert_eq!(bad, good);

        let thick = good.replace("value = 1.0", "value = 12.0");
        let told = Wire::parse(&thick).unwrap_err().to_string();
        assert!(
            told.contains("diameter is 12 mm: it must be 0.1 mm to 10 mm"),
            "{told}"
        );
        let gas = gases::M14.text.replace("96.0", "90.0");
        assert!(
            Gas::parse(&gas)
                .unwrap_err()
                .to_string()
                .contains("94 % together")
        );
    }
}
