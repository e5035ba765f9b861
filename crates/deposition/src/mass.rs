//! Mass, volume and energy of a bead. Source: Rouchon 2022, §2.2 of the thesis' chapter 2, eq. 2.15, 2.16, 3.6.
//!
//! Speeds in mm/s (only ratios of speeds enter λ), lengths in mm, electrical values in V and A.

use std::f64::consts::PI;

/// Section of a round wire, mm², from its diameter, mm.
pub fn wire_section(diameter: f64) -> f64 {
    0.25 * PI * diameter * diameter
}

/// Ratio of wire feed speed to travel speed, λ: what sets the shape of the bead.
///
/// ```
/// assert_eq!(meltpath_deposition::mass::feed_ratio(6.0, 0.25), 24.0);
/// ```
pub fn feed_ratio(wire_feed: f64, travel_speed: f64) -> f64 {
    wire_feed / travel_speed
}

/// Section of the bead by conservation of volume, A = η·λ·S_f, mm².
pub fn bead_area(feed_ratio: f64, wire_section: f64, efficiency: f64) -> f64 {
    efficiency * feed_ratio * wire_section
}

/// Mass deposited per second, kg/s, from the wire section in mm², the feed in mm/s and the density in kg/m³.
pub fn mass_rate(wire_section: f64, wire_feed: f64, density: f64) -> f64 {
    wire_section * wire_feed * 1e-9 * density
}

/// Electrical energy per length of bead, J/mm: U·I/V_r with the travel speed in mm/s (eq. 2.15).
pub fn energy_per_length(voltage: f64, current: f64, travel_speed: f64) -> f64 {
    voltage * current / travel_speed
}

/// Electrical energy per volume of wire, J/mm³: U·I/(S_f·V_f), with the **measured** wire feed in mm/s (eq. 2.16).
pub fn energy_per_volume(voltage: f64, current: f64, wire_section: f64, wire_feed: f64) -> f64 {
    voltage * current / (wire_section * wire_feed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waam_ac2_feed_ratios() {
        for (vf, vr, ratio) in [
            (6.0, 1.25, 4.8),
            (6.0, 0.25, 24.0),
            (8.0, 0.75, 32.0 / 3.0),
            (8.0, 0.5, 16.0),
            (4.0, 0.75, 16.0 / 3.0),
            (6.0, 0.5, 12.0),
        ] {
            assert_eq!(feed_ratio(vf, vr), ratio);
        }
    }

    #[test]
    fn waam_ac3_area_from_conservation() {
        let s = wire_section(1.0);
        assert!((bead_area(8.0 / 0.75, s, 1.0) - 8.378).abs() < 1e-3);
        assert!((bead_area(8.0 / 0.5, s, 1.0) - 12.566).abs() < 1e-3);
    }

    #[test]
    fn mass_rate_of_a_common_wire() {
        let kg_per_hour = 3600.0 * mass_rate(wire_section(1.2), 10_000.0 / 60.0, 7850.0);
        assert!((kg_per_hour - 5.33).abs() < 0.01);
    }
}
