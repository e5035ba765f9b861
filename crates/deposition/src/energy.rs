//! Electric energy that the source spends per volume of deposit, by configuration (Rouchon 2022, table 2.5).

use serde::Deserialize;

use crate::consumable::{self, DataError};

const FILE: &str = "energy/rouchon-2022";
const TEXT: &str = meltpath_data::energy::ROUCHON_2022.text;

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
    /// Beads of the same wire, mode and gas.
    Configuration,
    /// Beads of the same wire and mode with other gases: the energy depends on the mode before all else (Rouchon 2022, § 2.3).
    OtherGases,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EnergyFile {
    #[serde(rename = "schema")]
    _schema: u32,
    #[serde(rename = "id")]
    _id: String,
    source: String,
    #[serde(rename = "page")]
    _page: String,
    #[serde(rename = "unit")]
    _unit: String,
    rows: Vec<(String, String, String, f64, f64, f64)>,
}

/// Energy per volume of a wire in this mode and gas; nothing for a wire or a mode that was not measured: what one wire takes says
/// nothing of another.
///
/// ```
/// use meltpath_deposition::energy::{EnergyBasis, energy_per_volume};
/// let energy = energy_per_volume("x90-ig-1.0", "cmt", "m14").unwrap().unwrap();
/// assert_eq!((energy.mean, energy.basis), (23.1, EnergyBasis::Configuration));
/// ```
///
/// # Errors
/// [`DataError`] when the table that comes with the program does not read.
pub fn energy_per_volume(
    wire: &str,
    mode: &str,
    gas: &str,
) -> Result<Option<EnergyPerVolume>, DataError> {
    let file: EnergyFile = consumable::read(FILE, TEXT)?;
    let of_mode = || {
        let rows = file.rows.iter();
        rows.filter(|row| row.0 == wire && row.1 == mode)
    };
    let same: Vec<_> = of_mode().filter(|row| row.2 == gas).collect();
    let (rows, basis) = if same.is_empty() {
        (of_mode().collect(), EnergyBasis::OtherGases)
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
        source: file.source,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energies_count_for_the_wire_they_were_measured_on() {
        let of = |wire, mode, gas| energy_per_volume(wire, mode, gas).unwrap();
        let energy = of("x90-ig-1.2", "cmt", "argon").unwrap();
        assert_eq!(energy.basis, EnergyBasis::OtherGases);
        assert!((energy.mean - 0.5 * (25.7 + 24.6)).abs() < 1e-9);
        assert!((energy.sigma - (27.9 - 21.4) / 4.0).abs() < 1e-9);
        // as thick, but another alloy
        assert_eq!(of("g3si-1.2", "cmt", "m14"), None);
        assert_eq!(of("x90-ig-1.0", "laser", "m14"), None);
    }

    #[test]
    fn waam_ac08_pulsed_transfer_spends_more_than_cmt() {
        for (wire, gas) in [
            ("x90-ig-1.0", "speed"),
            ("x90-ig-1.0", "m14"),
            ("x90-ig-1.2", "speed"),
            ("x90-ig-1.2", "m14"),
        ] {
            let cmt = energy_per_volume(wire, "cmt", gas).unwrap().unwrap();
            let pulsed = energy_per_volume(wire, "pulsed", gas).unwrap().unwrap();
            assert!((20.0..=28.0).contains(&cmt.mean));
            assert!((28.0..=39.0).contains(&pulsed.mean));
        }
    }
}
