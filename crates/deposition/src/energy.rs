//! Electric energy that the source spends per volume of wire fed, by configuration: E_v = U I / (V_f π ∅²/4) (Rouchon 2022, eq. 2.16).

use meltpath_base::settings::{self, Json, Kind, Node, Place, Problem, Problems, Reader, Value};
use meltpath_base::{choice, table};

/// Energy per volume of the wire that is fed, J/mm³: spatter and fume are in it.
#[derive(Debug, Clone, PartialEq)]
pub struct EnergyPerVolume {
    /// Mean over the beads.
    pub mean: f64,
    /// Standard uncertainty of one bead: a quarter of the range of the beads.
    pub sigma: f64,
    /// Whether the table holds this very configuration.
    pub basis: EnergyBasis,
    /// Document.
    pub source: String,
}

/// Electric energy per volume of wire, J/mm³, of a power in W, a wire's section in mm² and its feed in mm/s: the feed that was measured,
/// not the one that was set, which is 3.5 to 26 % less. Rouchon 2022, equation 2.16.
///
/// ```
/// let section = std::f64::consts::FRAC_PI_4;
/// let energy = meltpath_deposition::energy::per_volume(16.65 * 190.0, section, 10.10e3 / 60.0);
/// assert!((energy - 23.9).abs() < 0.1);
/// ```
pub fn per_volume(power: f64, wire_section: f64, feed: f64) -> f64 {
    power / (wire_section * feed)
}

/// What an energy per volume rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EnergyBasis {
    /// Beads of the same wire, mode and gas.
    Configuration,
    /// Beads of the same wire and mode with other gases: the energy depends on the mode before all else (Rouchon 2022, § 2.3).
    OtherGases,
}

table! {
    /// Electric energy per volume of the wire that is fed: voltage times current over wire feed and section.
    pub struct EnergyFile {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Identifier.
        id: String => required;
        /// Document.
        source: String => required;
        /// Place in it.
        page: String => required;
        /// Unit of the energies.
        unit: EnergyUnit => required;
        /// Wire, mode, gas; mean, least and greatest energy of the beads.
        rows: Vec<Row> => required;
    }
}

choice! {
    /// The unit of energies per volume.
    pub enum EnergyUnit {
        JoulePerCubicMillimetre "J/mm3" => "Joules per cubic millimetre.",
    }
}

/// A row of the table: wire, mode, gas; mean, least, greatest.
#[derive(Debug, Clone, PartialEq)]
pub struct Row(String, String, String, f64, f64, f64);

impl Value for Row {
    const KIND: Kind = Kind::List {
        of: &Kind::Either(&Kind::Number, &Kind::Text),
        least: 6,
        most: 6,
    };

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let row: Vec<&Node<'_>> = node.get_ref().as_array().into_iter().flatten().collect();
        let [wire, mode, gas, mean, least, greatest] = row[..] else {
            reader.unexpected(node, place, "a wire, a mode, a gas and three energies");
            return None;
        };
        let mut number = |node| f64::read(node, place, reader);
        let [mean, least, greatest] = [mean, least, greatest].map(&mut number);
        let [wire, mode, gas] = [wire, mode, gas].map(|node| String::read(node, place, reader));
        let (mean, least, greatest) = (mean?, least?, greatest?);
        if !(0.0 < least && least <= mean && mean <= greatest) {
            let message = format!(
                "{}: {mean}, {least} and {greatest} are no mean, least and greatest energy",
                place.name
            );
            reader.wrong(node, Problem::new(message));
            return None;
        }
        Some(Row(wire?, mode?, gas?, mean, least, greatest))
    }

    fn json(&self) -> Json {
        Json::Null
    }
}

impl EnergyFile {
    /// Reads a file of energies per volume.
    ///
    /// # Errors
    /// Everything wrong, with its place in the file.
    pub fn parse(text: &str) -> Result<Self, Problems> {
        settings::parse(text, |_: &Self| Vec::new())
    }

    /// Energy per volume of a wire in this mode and gas; nothing for a wire or a mode that was not measured: what one wire takes
    /// says nothing of another.
    ///
    /// ```
    /// use meltpath_deposition::energy::{EnergyBasis, EnergyFile};
    /// let file = EnergyFile::parse(meltpath_data::energy::ROUCHON_2022.text).unwrap();
    /// let energy = file.of("x90-ig-1.0", "cmt", "m14").unwrap();
    /// assert_eq!((energy.mean, energy.basis), (23.1, EnergyBasis::Configuration));
    /// ```
    pub fn of(&self, wire: &str, mode: &str, gas: &str) -> Option<EnergyPerVolume> {
        let of_mode = || {
            let rows = self.rows.iter();
            rows.filter(|row| row.0 == wire && row.1 == mode)
        };
        let same: Vec<_> = of_mode().filter(|row| row.2 == gas).collect();
        let (rows, basis) = if same.is_empty() {
            (of_mode().collect(), EnergyBasis::OtherGases)
        } else {
            (same, EnergyBasis::Configuration)
        };
        if rows.is_empty() {
            return None;
        }
        let mean = rows.iter().map(|row| row.3).sum::<f64>() / rows.len() as f64;
        let least = rows.iter().map(|row| row.4).fold(f64::INFINITY, f64::min);
        let greatest = rows.iter().map(|row| row.5).fold(0.0, f64::max);
        Some(EnergyPerVolume {
            mean,
            sigma: (greatest - least) / 4.0,
            basis,
            source: self.source.value.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> EnergyFile {
        EnergyFile::parse(meltpath_data::energy::ROUCHON_2022.text).unwrap()
    }

    #[test]
    fn energies_count_for_the_wire_they_were_measured_on() {
        let file = file();
        let of = |wire, mode, gas| file.of(wire, mode, gas);
        let energy = of("x90-ig-1.2", "cmt", "argon").unwrap();
        assert_eq!(energy.basis, EnergyBasis::OtherGases);
        assert!((energy.mean - 0.5 * (25.7 + 24.6)).abs() < 1e-9);
        assert!((energy.sigma - (27.9 - 21.4) / 4.0).abs() < 1e-9);
        // as thick, but another alloy
        assert_eq!(of("g3si-1.2", "cmt", "m14"), None);
        assert_eq!(of("x90-ig-1.0", "laser", "m14"), None);
    }

    #[test]
    fn energies_out_of_order_are_refused_where_they_stand() {
        let text = meltpath_data::energy::ROUCHON_2022.text;
        for wrong in ["23.1, 24.7, 21.6", "20, 21.6, 24.7", "0, 0, 0"] {
            let text = text.replacen("23.1, 21.6, 24.7", wrong, 1);
            let problems = EnergyFile::parse(&text).unwrap_err();
            let [problem] = problems.0.as_slice() else {
                panic!("{problems}")
            };
            let row = &text[problem.span.clone().unwrap()];
            assert!(row.contains(wrong), "{row}: {problem}");
        }
    }

    #[test]
    fn waam_ac08_pulsed_transfer_spends_more_than_cmt() {
        for (wire, gas) in [
            ("x90-ig-1.0", "speed"),
            ("x90-ig-1.0", "m14"),
            ("x90-ig-1.2", "speed"),
            ("x90-ig-1.2", "m14"),
        ] {
            let cmt = file().of(wire, "cmt", gas).unwrap();
            let pulsed = file().of(wire, "pulsed", gas).unwrap();
            assert!((20.0..=28.0).contains(&cmt.mean));
            assert!((28.0..=39.0).contains(&pulsed.mean));
        }
    }
}
