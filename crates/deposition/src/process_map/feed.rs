//! A campaign of wire feed measurements: what is really fed, and the energy it takes.

use serde::Deserialize;

use super::M_PER_MIN;
use crate::consumable::{DataError, Wire, lookup, positive, read};
use crate::mass;

/// One bead of the campaign; voltages V, currents A, speeds m/min.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(from = "[f64; 7]")]
pub struct FeedBead {
    /// Programmed voltage.
    pub voltage_programmed: f64,
    /// Measured voltage.
    pub voltage: f64,
    /// Programmed current.
    pub current_programmed: f64,
    /// Measured current.
    pub current: f64,
    /// Programmed wire feed.
    pub feed_programmed: f64,
    /// Measured wire feed.
    pub feed: f64,
    /// Travel speed.
    pub travel_speed: f64,
}

impl From<[f64; 7]> for FeedBead {
    fn from(r: [f64; 7]) -> Self {
        FeedBead {
            voltage_programmed: r[0],
            voltage: r[1],
            current_programmed: r[2],
            current: r[3],
            feed_programmed: r[4],
            feed: r[5],
            travel_speed: r[6],
        }
    }
}

/// Programmed against measured wire feed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeedCampaign {
    /// Version of the file's layout.
    pub schema: u32,
    /// Identifier.
    pub id: String,
    /// Wire.
    pub wire: String,
    /// Gas.
    pub gas: String,
    /// Transfer mode.
    pub mode: String,
    /// Document.
    pub source: String,
    /// Page of it.
    pub page: String,
    /// The beads.
    pub beads: Vec<FeedBead>,
}

impl FeedCampaign {
    /// A campaign that comes with the program.
    ///
    /// # Errors
    /// [`DataError`] when there is none of that name.
    pub fn builtin(id: &str) -> Result<Self, DataError> {
        let campaign: FeedCampaign = read(
            id,
            lookup("feed campaign", id, meltpath_data::feed_campaigns::ALL)?,
        )?;
        for bead in &campaign.beads {
            positive(id, "feed", bead.feed)?;
            positive(id, "feed programmed", bead.feed_programmed)?;
        }
        Ok(campaign)
    }

    /// Mean and standard deviation of measured over programmed feed: k_f of this configuration.
    pub fn feed_factor(&self) -> (f64, f64) {
        let ratios = self.beads.iter().map(|b| b.feed / b.feed_programmed);
        let n = self.beads.len().max(1) as f64;
        let mean = ratios.clone().sum::<f64>() / n;
        let variance = ratios.map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        (mean, variance.sqrt())
    }

    /// Mean energy per volume of wire, J/mm³, with the measured feed.
    pub fn energy_per_volume(&self, wire: &Wire) -> f64 {
        let each = |b: &FeedBead| {
            mass::energy_per_volume(b.voltage, b.current, wire.section(), b.feed * M_PER_MIN)
        };
        self.beads.iter().map(each).sum::<f64>() / self.beads.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waam_ac4_energy_per_volume_of_table_2_2() {
        let campaign = FeedCampaign::builtin("g3si-1.2-cmt-speed-feed").unwrap();
        let wire = Wire::builtin(&campaign.wire).unwrap();
        assert!((campaign.energy_per_volume(&wire) - 26.6).abs() < 0.1);
        let mut programmed = campaign.clone();
        for b in &mut programmed.beads {
            b.feed = b.feed_programmed;
        }
        assert!((programmed.energy_per_volume(&wire) - 29.3).abs() < 0.1);
        // the printed column E, row 8 excepted (it computes to 9.8 %)
        let printed = [
            11.5, 14.7, 13.0, 13.6, 14.0, 15.8, 6.5, 9.8, 10.0, 5.4, 13.3, 12.1, 3.5, 7.6, 4.1,
        ];
        for (b, e) in campaign.beads.iter().zip(printed) {
            let got = 100.0 * (b.feed / b.feed_programmed - 1.0);
            assert!((got - e).abs() < 0.1, "{got} {e}");
        }
        let (mean, sigma) = campaign.feed_factor();
        assert!(
            (mean - 1.103).abs() < 0.002 && (0.03..0.05).contains(&sigma),
            "{mean} {sigma}"
        );
    }

    #[test]
    fn waam_ac9_energy_per_length_follows_the_feed_ratio() {
        let campaign = FeedCampaign::builtin("g3si-1.2-cmt-speed-feed").unwrap();
        let each = campaign.beads.iter().map(|b| {
            let speed = b.travel_speed * M_PER_MIN;
            let energy = mass::energy_per_length(b.voltage, b.current, speed);
            (mass::feed_ratio(b.feed, b.travel_speed), energy)
        });
        let (mut xy, mut xx) = (0.0, 0.0);
        for (ratio, energy) in each.clone() {
            xy += ratio * energy;
            xx += ratio * ratio;
        }
        // one line through the origin over a range of 15 in energy: within the scatter of E_v, 23.3 to 28.4 J/mm³
        let slope = xy / xx;
        for (ratio, energy) in each {
            assert!(
                (energy / (slope * ratio) - 1.0).abs() < 0.15,
                "{ratio} {energy}"
            );
        }
        // the series at ratio 8 of the X90-IG campaign: equal areas
        let map = crate::process_map::ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
        let area = |vr: f64| map.bead(8.0 * vr * M_PER_MIN, vr * M_PER_MIN).area.value;
        for vr in [0.25, 0.5, 0.75, 1.0, 1.25] {
            assert!((area(vr) / area(0.75) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn waam_ac5_energy_per_volume_of_the_thin_wall() {
        let s = mass::wire_section(1.0);
        let first = mass::energy_per_volume(16.65, 190.0, s, 10.10 * M_PER_MIN);
        let last = mass::energy_per_volume(15.17, 205.0, s, 8.13 * M_PER_MIN);
        assert!(
            (first - 23.9).abs() < 0.2 && (21.6..24.7).contains(&first),
            "{first}"
        );
        assert!((last - 29.2).abs() < 0.2, "{last}");
    }
}
