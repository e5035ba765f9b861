//! Measured beads before they become a map: the metal must balance, columns must not be swapped; wall laws become beads.

use meltpath_base::choice;

/// A measured bead: speeds in m/min, sizes in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeasuredBead {
    /// Programmed wire feed, m/min.
    pub(super) wire_feed: f64,
    /// Wire feed really delivered, m/min.
    pub(super) fed: f64,
    /// Travel speed, m/min.
    pub(super) travel_speed: f64,
    /// Width, mm.
    pub(super) width: f64,
    /// Height, mm.
    pub(super) height: f64,
}

choice! {
    /// What stops the import of measured beads unless the file accepts it.
    pub enum Oddity {
        MassBalance "mass-balance" => "The metal fed does not fit into width and height.",
        TallerThanWide "taller-than-wide" => "A bead is taller than wide.",
    }
}

/// Share of its width-by-height box that a bead can fill: a triangle has 0.5, a semi-ellipse 0.785; the margin
/// above is for a feed factor that is off.
const PLAUSIBLE_FILL: std::ops::RangeInclusive<f64> = 0.5..=0.9;

/// Rows that are told by their numbers.
const SHOWN_ROWS: usize = 8;

/// What is odd about beads, with the rows concerned; `area_per_ratio` = η·S_f is a bead's area, mm², where the feed delivered is the
/// travel speed.
pub(super) fn oddities(beads: &[MeasuredBead], area_per_ratio: f64) -> Vec<(Oddity, String)> {
    let rows = |odd: &dyn Fn(&MeasuredBead) -> bool| -> Vec<String> {
        let found = beads.iter().enumerate().filter(|(_, b)| odd(b));
        found.map(|(n, _)| (n + 1).to_string()).collect()
    };
    let told = |rows: &[String]| {
        let more = rows.len().saturating_sub(SHOWN_ROWS);
        let rest = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        format!(
            "{} of {} beads (rows {}{rest})",
            rows.len(),
            beads.len(),
            rows[..rows.len() - more].join(", ")
        )
    };
    let mut odd = Vec::new();
    let taller = rows(&|b| b.height > b.width);
    if !taller.is_empty() {
        let message = format!(
            "{} are taller than wide: are width and height swapped?",
            told(&taller)
        );
        odd.push((Oddity::TallerThanWide, message));
    }
    let fill = |b: &MeasuredBead| area_per_ratio * b.fed / b.travel_speed / (b.width * b.height);
    let off = rows(&|b| !PLAUSIBLE_FILL.contains(&fill(b)));
    if !off.is_empty() {
        let mean = beads.iter().map(fill).sum::<f64>() / beads.len() as f64;
        let message = format!(
            "the metal fed is not that of {}: it must fill {:.1} to {:.1} of width times height, and fills {mean:.2} on average of all; check the wire diameter, the units of the speeds and the columns",
            told(&off),
            PLAUSIBLE_FILL.start(),
            PLAUSIBLE_FILL.end()
        );
        odd.push((Oddity::MassBalance, message));
    }
    odd
}

/// Width of a wall of single beads over that of the bead: how a wall's layer is read as a bead (Rouchon 2022, § 4.3).
const WALL_SHARE: f64 = 0.9;

/// The single bead of which a wall's layers grow by `layer` mm: as wide as makes a wall of nine tenths of it, a parabola of the metal
/// fed. `area` is that metal, mm².
pub(super) fn bead_of_wall(layer: f64, area: f64) -> (f64, f64) {
    let width = area / (WALL_SHARE * layer);
    (width, 1.5 * area / width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Vec<MeasuredBead> {
        let section = std::f64::consts::FRAC_PI_4;
        let beads = [(8.0, 0.75), (8.0, 0.5), (4.0, 0.75)];
        let bead = |(vf, vr): (f64, f64)| {
            let area = 1.15 * section * vf / vr;
            let width = 2.34 * vf.powf(0.446) * vr.powf(-0.345);
            MeasuredBead {
                wire_feed: vf,
                fed: 1.15 * vf,
                travel_speed: vr,
                width,
                height: 1.5 * area / width,
            }
        };
        beads.map(bead).to_vec()
    }

    #[test]
    fn swapped_columns_and_wrong_wires_are_seen() {
        let section = std::f64::consts::FRAC_PI_4;
        let good = good();
        assert_eq!(oddities(&good, section), []);
        let swapped: Vec<_> = good
            .iter()
            .map(|b| MeasuredBead {
                width: b.height,
                height: b.width,
                ..*b
            })
            .collect();
        let odd = oddities(&swapped, section);
        assert_eq!(odd[0].0, Oddity::TallerThanWide);
        assert!(
            odd[0].1.starts_with("3 of 3 beads (rows 1, 2, 3)"),
            "{}",
            odd[0].1
        );
        let odd = oddities(&good, 1.44 * section);
        assert_eq!((odd.len(), odd[0].0), (1, Oddity::MassBalance));
        // one row is enough
        let mut one = good;
        one[1].travel_speed = 0.75;
        assert!(
            oddities(&one, section)[0]
                .1
                .contains("1 of 3 beads (rows 2)")
        );
    }

    #[test]
    fn a_wall_is_nine_tenths_of_its_bead() {
        let (width, height) = bead_of_wall(1.5, 9.0);
        assert!((0.9 * width * 1.5 - 9.0).abs() < 1e-12);
        assert!((2.0 / 3.0 * width * height - 9.0).abs() < 1e-12);
    }
}
