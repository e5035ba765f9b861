//! Electric energy that the source spends per volume of deposit, by configuration (Rouchon 2022, table 2.5).

use meltpath_base::settings::{self, Json, Kind, Node, Place, Problems, Reader, Value};
use meltpath_base::{choice, table};

const TEXT: &str = meltpath_data::energy::ROUCHON_2022.text;

/// How near a table's wire is to the wire asked for, mm.
const SAME_DIAMETER: f64 = 0.01;

/// Energy per volume of deposit, J/mm³.
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

/// What an energy per volume rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EnergyBasis {
    /// Beads of the same wire diameter, mode and gas.
    Configuration,
    /// All beads of the same mode: the energy depends on the mode before all else (Rouchon 2022, § 2.3).
    Mode,
}

table! {
    /// Electric energy per volume of deposit.
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
        /// Wire diameter in mm, mode, gas; mean, least and greatest energy of the beads.
        rows: Vec<Row> => required;
    }
}

choice! {
    /// The unit of energies per volume.
    pub enum EnergyUnit {
        /// Joules per cubic millimetre.
        JoulePerCubicMillimetre = "J/mm3",
    }
}

/// A row of the table: wire diameter mm, mode, gas; mean, least, greatest.
#[derive(Debug, Clone, PartialEq)]
pub struct Row(f64, String, String, f64, f64, f64);

impl Value for Row {
    const KIND: Kind = Kind::List {
        of: &Kind::Either(&Kind::Number, &Kind::Text),
        least: 6,
        most: 6,
    };

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let row: Vec<&Node<'_>> = node.get_ref().as_array().into_iter().flatten().collect();
        let [diameter, mode, gas, mean, least, greatest] = row[..] else {
            reader.unexpected(node, place, "a diameter, a mode, a gas and three energies");
            return None;
        };
        let mut number = |node| f64::read(node, place, reader);
        let [diameter, mean, least, greatest] = [diameter, mean, least, greatest].map(&mut number);
        let [mode, gas] = [mode, gas].map(|node| String::read(node, place, reader));
        Some(Row(diameter?, mode?, gas?, mean?, least?, greatest?))
    }

    fn json(&self) -> Json {
        Json::Null
    }
}

/// Energy per volume of a wire of this diameter (mm) in this mode and gas; nothing for a mode that was not measured.
///
/// ```
/// use meltpath_deposition::energy::{EnergyBasis, energy_per_volume};
/// let energy = energy_per_volume(1.0, "cmt", "m14").unwrap().unwrap();
/// assert_eq!((energy.mean, energy.basis), (23.1, EnergyBasis::Configuration));
/// ```
///
/// # Errors
/// [`Problems`] when the table that comes with the program does not read.
pub fn energy_per_volume(
    diameter: f64,
    mode: &str,
    gas: &str,
) -> Result<Option<EnergyPerVolume>, Problems> {
    let file = settings::parse(TEXT, |_: &EnergyFile| Vec::new())?;
    let of_mode = || file.rows.iter().filter(|row| row.1 == mode);
    let same: Vec<_> = of_mode()
        .filter(|row| (row.0 - diameter).abs() < SAME_DIAMETER && row.2 == gas)
        .collect();
    let (rows, basis) = if same.is_empty() {
        (of_mode().collect(), EnergyBasis::Mode)
    } else {
        (same, EnergyBasis::Configuration)
    };
    if rows.is_empty() {
        return Ok(None);
    }
    let mean = rows.iter().map(|row| row.3).sum::<f64>() / rows.len() as f64;
    let least = rows.iter().map(|row| row.4).fold(f64::INFINITY, f64::min);
    let greatest = rows.iter().map(|row| row.5).fold(0.0, f64::max);
    Ok(Some(EnergyPerVolume {
        mean,
        sigma: (greatest - least) / 4.0,
        basis,
        source: file.source.value,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_wires_of_the_mode_take_all_its_beads() {
        let energy = energy_per_volume(1.6, "cmt", "m14").unwrap().unwrap();
        assert_eq!(energy.basis, EnergyBasis::Mode);
        assert!((energy.mean - 24.175).abs() < 1e-9);
        assert!((energy.sigma - (27.9 - 20.4) / 4.0).abs() < 1e-9);
        assert_eq!(energy_per_volume(1.0, "laser", "m14").unwrap(), None);
    }

    #[test]
    fn waam_ac08_pulsed_transfer_spends_more_than_cmt() {
        for (diameter, gas) in [(1.0, "speed"), (1.0, "m14"), (1.2, "speed"), (1.2, "m14")] {
            let cmt = energy_per_volume(diameter, "cmt", gas).unwrap().unwrap();
            let pulsed = energy_per_volume(diameter, "pulsed", gas).unwrap().unwrap();
            assert!((20.0..=28.0).contains(&cmt.mean));
            assert!((28.0..=39.0).contains(&pulsed.mean));
        }
    }
}
