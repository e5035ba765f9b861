//! What a synergic source with penetration stabiliser feeds when the contact tube comes nearer to the part or goes away.
//!
//! The stabiliser holds the current: a longer stick-out melts more wire by its own resistance, so the source feeds more,
//! within the setting of the stabiliser. Growth then regulates itself: low places get more metal, high ones less. The
//! control law of the source is not published; what is known are measured feeds at two distances (Rouchon 2022, table
//! 4.4), taken here as a line. Its place among the source's regulations: Rouchon 2022, §4.5.1.

use meltpath_base::settings::{Datum, Problem};
use meltpath_base::{Length, quantity, table};
use serde::{Deserialize, Serialize};

/// Scatter of a measured contact tube distance, mm.
pub const SCATTER: f64 = 0.5;

/// Wire feed against contact tube distance, as a share of the feed at a reference distance.
///
/// - Distances in mm, from the contact tube to the surface that the bead finds.
/// - Quasi-static: the circuit of Rouchon 2022, §4.5.2 settles within 0.1 s, a millimetre of travel, less than the pool.
/// - Validity: between the measured distances; the stabiliser bounds it outside, and [`FeedResponse::measured`] tells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FeedResponse {
    /// Distance at which the source feeds what the process map says, mm.
    pub reference: f64,
    /// Change of feed per mm of distance, share of the feed at the reference.
    pub slope: f64,
    /// Least and greatest feed that the stabiliser allows, shares of the feed at the reference.
    pub limits: (f64, f64),
    /// Least and greatest distance that was measured, mm.
    pub measured: (f64, f64),
}

quantity!(
    /// Change of the wire feed per mm of distance, m/min/mm inside.
    FeedSlope, "change of feed", "m/min/mm",
    [("m/min/mm", 1.0)]
);
quantity!(
    /// A change of the wire feed, m/min inside: maps are made in these.
    FeedBand, "feed", "m/min",
    [("m/min", 1.0)]
);

table! {
    /// What the source feeds at other contact tube distances, as it was measured.
    pub struct MeasuredResponse {
        /// Change of the wire feed per mm of distance; 0 for a source that holds its feed.
        slope: Datum<FeedSlope> where not_negative => required;
        /// Distance at which the feed factor of the process map holds.
        reference: Datum<Length> where positive => required;
        /// Setting of the penetration stabiliser: the greatest change to the programmed feed.
        stabiliser: Datum<FeedBand> where not_negative => required;
        /// Least distance that was measured.
        least: Datum<Length> where positive => required;
        /// Greatest distance that was measured.
        greatest: Datum<Length> where positive => required;
    }
}

impl MeasuredResponse {
    /// The answer at a `programmed` wire feed of which the source delivers `delivered` at the reference distance, with the
    /// stabiliser at `stabiliser`; m/min.
    ///
    /// A stabiliser at 0 holds the feed. Its band cannot exclude what the source delivers anyway: the feed at the reference
    /// distance is always allowed.
    #[must_use]
    pub fn at(&self, programmed: f64, delivered: f64, stabiliser: f64) -> FeedResponse {
        FeedResponse {
            reference: self.reference.0,
            slope: self.slope.0 / delivered,
            limits: (
                ((programmed - stabiliser) / delivered).clamp(0.0, 1.0),
                ((programmed + stabiliser) / delivered).max(1.0),
            ),
            measured: (self.least.0, self.greatest.0),
        }
        .held_by(stabiliser)
    }

    /// Distances out of order.
    pub(crate) fn check(&self) -> Option<Problem> {
        let message = "the greatest distance measured must be above the least";
        (self.greatest.0 <= self.least.0).then(|| self.greatest.problem(message))
    }
}

impl FeedResponse {
    /// Without a stabiliser the feed is what is programmed and corrected, at any distance.
    fn held_by(self, stabiliser: f64) -> Self {
        let limits = if stabiliser > 0.0 {
            self.limits
        } else {
            (1.0, 1.0)
        };
        FeedResponse { limits, ..self }
    }

    /// Feed at a distance, as a share of the feed at the reference distance.
    pub fn ratio(&self, distance: f64) -> f64 {
        let (least, greatest) = self.limits;
        (1.0 + self.slope * (distance - self.reference)).clamp(least, greatest)
    }

    /// How far a build is off, mm, at `height` mm, when each layer grows by the share `growth` more (less, if negative) than
    /// it was planned to: the error of height E that follows from E′ = growth − slope · E, as the source answers to the
    /// distance that the error changes, within its limits.
    ///
    /// Layers are taken as thin beside 1/slope (45 mm on the seed map), and planned for the reference distance. The uncertainty
    /// of the slope, a quarter on the seed map, is not carried. Ours; checked against the simulated raster wall.
    ///
    /// ```
    /// use meltpath_deposition::feed_response::FeedResponse;
    /// let r = FeedResponse { reference: 15.0, slope: 0.022, limits: (0.65, 1.09), measured: (5.5, 15.0) };
    /// // an error of 5 % ends in 2.3 mm, however tall the build
    /// assert!((r.height_error(0.05, 1000.0) - 0.05 / 0.022).abs() < 1e-6);
    /// assert!((r.height_error(0.05, 1.0) - 0.05).abs() < 1e-3);
    /// ```
    pub fn height_error(&self, growth: f64, height: f64) -> f64 {
        let room = if growth > 0.0 {
            1.0 - self.limits.0
        } else {
            self.limits.1 - 1.0
        };
        let size = growth.abs();
        if self.slope <= 0.0 || room <= 0.0 {
            return growth * height;
        }
        // the source is at its limit from here on
        let bound = if size > room {
            -(1.0 - room / size).ln() / self.slope
        } else {
            f64::INFINITY
        };
        let regulated = size / self.slope * (1.0 - (-self.slope * height.min(bound)).exp());
        let beyond = (height - bound).max(0.0) * (size - room);
        (regulated + beyond).copysign(growth)
    }

    /// Whether a distance lies within what was measured, to the scatter of such a measurement (half a millimetre).
    pub fn covers(&self, distance: f64) -> bool {
        let (least, greatest) = self.measured;
        distance >= least - SCATTER && distance <= greatest + SCATTER
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::process_map::ProcessMap;

    fn table() -> MeasuredResponse {
        let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
        map.feed_response.unwrap()
    }

    #[test]
    fn waam_ac43_the_feed_falls_by_a_fifth_over_the_thin_wall() {
        // both rows of table 4.4: the line passes through them when the feed delivered at 15 mm is 10.10 m/min
        let r = table().at(8.0, 10.10, 2.0);
        assert!((10.10 * r.ratio(5.47) - 8.13).abs() < 0.01);
        assert!((r.ratio(5.47) - 0.80).abs() < 0.01);
        // bounded at 6 m/min; above, by the feed of the reference, which exceeds the stabiliser's band in the table itself
        assert!((10.10 * r.ratio(-30.0) - 6.0).abs() < 1e-9);
        assert_eq!(r.ratio(40.0), 1.0);
        let r = table().at(8.0, 9.2, 2.0);
        assert!((9.2 * r.ratio(10.0) - 8.165).abs() < 1e-3);
        assert!((9.2 * r.ratio(40.0) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn a_stabiliser_at_zero_holds_the_feed() {
        let r = table().at(8.0, 9.2, 0.0);
        assert_eq!((r.ratio(5.0), r.ratio(25.0)), (1.0, 1.0));
    }

    #[test]
    fn an_error_beyond_the_limits_grows_on() {
        let r = FeedResponse {
            reference: 15.0,
            slope: 0.02,
            limits: (0.7, 1.1),
            measured: (5.0, 15.0),
        };
        // 5 mm lower the source feeds 10 % more, all it can: the other 10 % are lost layer after layer
        let slope = r.height_error(-0.2, 301.0) - r.height_error(-0.2, 300.0);
        assert!((slope + 0.1).abs() < 1e-12, "{slope}");
        // E' = 0.2 - 0.02 E reaches 5 mm at h = 50 ln 2
        let at = 50.0 * 2.0_f64.ln();
        assert!((r.height_error(-0.2, at) + 5.0).abs() < 1e-12);
    }

    #[test]
    fn validity_is_what_was_measured() {
        let r = table().at(8.0, 9.2, 2.0);
        assert!(r.covers(5.0) && r.covers(15.4));
        assert!(!r.covers(4.9) && !r.covers(16.0));
    }

    proptest::proptest! {
        #[test]
        fn an_error_of_growth_is_regulated_never_turned_over(growth in -0.3..0.3f64, height in 0.0..400.0f64) {
            let r = table().at(8.0, 9.2, 2.0);
            let error = r.height_error(growth, height);
            proptest::prop_assert!(error * growth >= 0.0);
            proptest::prop_assert!(error.abs() <= (growth * height).abs() + 1e-12);
            proptest::prop_assert!(r.height_error(growth, height + 1.0).abs() >= error.abs());
        }

        #[test]
        fn the_feed_never_falls_as_the_distance_grows(a in -5.0..40.0f64, b in -5.0..40.0f64) {
            let r = table().at(8.0, 9.2, 2.0);
            let (near, far) = (a.min(b), a.max(b));
            proptest::prop_assert!(r.ratio(near) <= r.ratio(far));
        }
    }
}
