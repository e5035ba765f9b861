//! Sanity of measured beads before they become a map: the metal must balance.

use meltpath_base::Reporter;
use serde::{Deserialize, Serialize};

/// A measured bead: speeds in m/min, sizes in mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredBead {
    /// Programmed wire feed, m/min.
    pub wire_feed: f64,
    /// Travel speed, m/min.
    pub travel_speed: f64,
    /// Width, mm.
    pub width: f64,
    /// Height, mm.
    pub height: f64,
}

/// Share of its width-by-height box that a bead can fill: a triangle has 0.5, a semi-ellipse 0.785; the margin
/// above is for a feed factor that is off.
const PLAUSIBLE_FILL: std::ops::RangeInclusive<f64> = 0.5..=0.9;

/// Checks beads against the metal fed, `area_per_ratio` = η·k_f·S_f mm² per unit of V_f/V_r, and warns of
/// what cannot be: columns swapped, a wrong wire diameter, a wrong unit. Returns whether all are plausible.
pub fn check_beads(beads: &[MeasuredBead], area_per_ratio: f64, reporter: &Reporter) -> bool {
    let n = beads.len().max(1) as f64;
    let taller = beads.iter().filter(|b| b.height > b.width).count();
    let mut plausible = true;
    if 2 * taller > beads.len() {
        plausible = false;
        reporter.warn(
            "beads-swapped",
            format!("{taller} of {} beads are taller than wide", beads.len()),
            "width and height look swapped: check the columns",
        );
    }
    let fills: Vec<f64> = beads
        .iter()
        .map(|b| area_per_ratio * b.wire_feed / b.travel_speed / (b.width * b.height))
        .collect();
    let outside = fills.iter().filter(|f| !PLAUSIBLE_FILL.contains(f)).count();
    if outside > 0 {
        plausible = false;
        let mean = fills.iter().sum::<f64>() / n;
        reporter.warn(
            "beads-mass-balance",
            format!(
                "the metal fed fills {mean:.2} of width times height on average, {outside} of {} beads lie outside {:.1} to {:.1}",
                beads.len(),
                PLAUSIBLE_FILL.start(),
                PLAUSIBLE_FILL.end()
            ),
            "check the wire diameter, the units of the speeds and the columns of width and height",
        );
    }
    plausible
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn swapped_columns_and_wrong_wires_are_seen() {
        let section = std::f64::consts::FRAC_PI_4;
        let good: Vec<MeasuredBead> = [(8.0, 0.75), (8.0, 0.5), (4.0, 0.75)]
            .iter()
            .map(|&(vf, vr)| {
                let area = 1.15 * section * vf / vr;
                let width = 2.34 * f64::powf(vf, 0.446) * f64::powf(vr, -0.345);
                MeasuredBead {
                    wire_feed: vf,
                    travel_speed: vr,
                    width,
                    height: 1.5 * area / width,
                }
            })
            .collect();
        let reporter = Reporter::new();
        assert!(check_beads(&good, 1.15 * section, &reporter));
        assert!(reporter.warnings().is_empty());
        let swapped: Vec<_> = good
            .iter()
            .map(|b| MeasuredBead {
                width: b.height,
                height: b.width,
                ..*b
            })
            .collect();
        assert!(!check_beads(&swapped, 1.15 * section, &reporter));
        assert_eq!(reporter.warnings()[0].code, "beads-swapped");
        let thick = 1.15 * section * 1.44;
        let reporter = Reporter::new();
        assert!(!check_beads(&good, thick, &reporter));
        assert_eq!(reporter.warnings()[0].code, "beads-mass-balance");
    }
}
