//! Measured beads before they become a map: the metal must balance, columns must not be swapped; wall laws become beads.

use meltpath_base::choice;

use crate::section::Section;

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
        MoreThanFed "more-than-fed" => "All beads together hold more metal than was fed.",
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

/// The section that holds least metal for its width and height of those that beads are told to have: what beads hold at least.
const LEANEST: Section = Section::Cosine;

/// Standard uncertainties by which beads together may hold more than was fed.
const OPEN: f64 = 2.0;

/// Beads that together hold more metal than was fed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Excess {
    /// Metal held at least over metal fed.
    pub(super) held: f64,
    /// The same of the parabola that the map is made of.
    pub(super) parabola: f64,
    /// The most that is let pass.
    most: f64,
    /// The same as `held` where what was set is what was fed.
    exchanged: f64,
}

/// Whether all beads together hold more metal than was fed, by more than is left open: each may be odd by chance, all of them to the same side
/// are a wrong wire, feed or unit. `sigma` is the relative standard uncertainty of the metal fed; the scatter of the beads comes to it, and sections
/// are the leanest. Less metal than fed is no contradiction: it spatters.
pub(super) fn excess(beads: &[MeasuredBead], area_per_ratio: f64, sigma: f64) -> Option<Excess> {
    let n = beads.len() as f64;
    let fed = |feed: f64, b: &MeasuredBead| area_per_ratio * feed / b.travel_speed;
    let of = |section: Section, b: &MeasuredBead| section.area(b.width, b.height);
    let mean = |share: &dyn Fn(&MeasuredBead) -> f64| beads.iter().map(share).sum::<f64>() / n;
    let share = |b: &MeasuredBead| of(LEANEST, b) / fed(b.fed, b);
    let held = mean(&share);
    let squares = beads.iter().map(|b| (share(b) - held).powi(2)).sum::<f64>();
    let scatter = (squares / (n - 1.0).max(1.0) / n).sqrt();
    let most = 1.0 + OPEN * (sigma * held).hypot(scatter);
    (held > most).then(|| Excess {
        held,
        parabola: mean(&|b| of(Section::Parabola, b) / fed(b.fed, b)),
        most,
        exchanged: mean(&|b| of(LEANEST, b) / fed(b.wire_feed, b)),
    })
}

impl Excess {
    /// In words, of `count` beads.
    pub(super) fn told(&self, count: usize) -> String {
        let percent = |share: f64| 100.0 * (share - 1.0);
        format!(
            "all {count} beads together hold {:.0} % more metal than was fed, and {:.0} % more even where their sections are as lean as a cosine: feed, wire and the scatter of the beads leave {:.0} % open",
            percent(self.parabola),
            percent(self.held),
            percent(self.most)
        )
    }

    /// What may be wrong, where the wire is `diameter` mm thick.
    pub(super) fn remedy(&self, diameter: f64, measured: bool) -> String {
        let whole = self.parabola.sqrt();
        let mut remedy = format!(
            "check the diameter of the wire ({diameter} mm here; {:.2} mm would balance), the units of feed and travel speed, feed_factor and efficiency",
            diameter * whole
        );
        if measured && self.exchanged <= self.most {
            remedy.push_str(
                "; with set and measured feed the other way round the metal balances: are they exchanged?",
            );
        }
        remedy
    }
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

    /// Rows that each may be, all a third too large: told, unless what was fed is known no better; so are exchanged feeds.
    #[test]
    fn beads_that_all_hold_more_than_was_fed_are_seen() {
        let section = std::f64::consts::FRAC_PI_4;
        let larger = |by: f64| -> Vec<MeasuredBead> {
            let higher = |b: MeasuredBead| MeasuredBead {
                height: by * b.height,
                ..b
            };
            good().into_iter().map(higher).collect()
        };
        // a cosine holds 0.955 of a parabola: what is above 1.047 of it is too much, and what feed and wire leave open
        for (by, sigma, too_much) in [
            (1.0, 0.0, false),
            (1.04, 0.0, false),
            (1.06, 0.0, true),
            (1.1, 0.03, false),
            (1.3, 0.03, true),
            (1.3, 0.15, false),
            (0.8, 0.0, false),
        ] {
            let beads = larger(by);
            assert_eq!(oddities(&beads, section), []);
            let found = excess(&beads, section, sigma);
            assert_eq!(found.is_some(), too_much, "{by} {sigma}");
        }
        let found = excess(&larger(1.3), section, 0.03).unwrap();
        assert!((found.parabola - 1.3).abs() < 1e-9 && (found.held - 1.2414).abs() < 1e-3);
        let remedy = found.remedy(1.0, false);
        assert!(
            remedy.contains("1.14 mm would balance") && !remedy.contains("way round"),
            "{remedy}"
        );
        // one bead far off is a matter of that bead
        let mut one = good();
        one[2].height *= 1.3;
        assert_eq!(excess(&one, section, 0.03), None);
        let exchanged: Vec<MeasuredBead> = good()
            .into_iter()
            .map(|b| MeasuredBead {
                wire_feed: b.fed,
                fed: b.wire_feed,
                ..b
            })
            .collect();
        let found = excess(&exchanged, section, 0.0).unwrap();
        assert!(found.remedy(1.0, true).contains("exchanged"), "{found:?}");
    }

    #[test]
    fn a_wall_is_nine_tenths_of_its_bead() {
        let (width, height) = bead_of_wall(1.5, 9.0);
        assert!((0.9 * width * 1.5 - 9.0).abs() < 1e-12);
        assert!((2.0 / 3.0 * width * height - 9.0).abs() < 1e-12);
    }
}
