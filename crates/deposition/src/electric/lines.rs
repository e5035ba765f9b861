//! Wire feed, voltage and current as straight lines over the contact tube distance, as they were measured.
//!
//! The control law of a source is not published. What records of several distances show is taken as it is: a line each. Source of the
//! lines that ship: the two rows of Rouchon 2022, table 4.4.

use meltpath_base::settings::{Datum, Problem};
use meltpath_base::{Current, Length, Speed, Voltage, quantity, table};

use super::file::VoltageSlope;
use crate::energy;
use crate::feed_response::{FeedSlope, SCATTER};

/// mm/s in one m/min.
const M_PER_MIN: f64 = 1000.0 / 60.0;

quantity!(
    /// A current per length, A/mm inside.
    CurrentSlope, "current per length", "A/mm",
    [("A/mm", 1.0)]
);

quantity!(
    /// The power of an arc, W inside.
    ArcPower, "power", "W",
    [("W", 1.0), ("kW", 1e3)]
);
quantity!(
    /// A power per length, W/mm inside.
    PowerSlope, "power per length", "W/mm",
    [("W/mm", 1.0)]
);

table! {
    /// Wire feed, voltage and current over the contact tube distance, as they were measured at one wire feed that was set.
    pub struct MeasuredLines {
        /// The wire feed that was set.
        programmed: Datum<Speed> where positive => required;
        /// Distance at which the three values hold.
        reference: Datum<Length> where positive => required;
        /// Wire feed that was measured there.
        feed: Datum<Speed> where positive => required;
        /// Its change per mm of distance.
        feed_slope: Datum<FeedSlope> => required;
        /// Voltage there.
        voltage: Datum<Voltage> where positive => required;
        /// Its change per mm of distance.
        voltage_slope: Datum<VoltageSlope> => required;
        /// Current there.
        current: Datum<Current> where positive => required;
        /// Its change per mm of distance.
        current_slope: Datum<CurrentSlope> => required;
        /// Mean there of the products of voltage and current, sample by sample.
        power: Datum<ArcPower> where positive => none("the product of both means: too low where the arc is pulsed");
        /// Its change per mm of distance.
        power_slope: Datum<PowerSlope> => none("the power does not change");
        /// Least distance that was measured.
        least: Datum<Length> where positive => required;
        /// Greatest distance that was measured.
        greatest: Datum<Length> where positive => required;
    }
}

/// A straight line over the contact tube distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Value at the reference distance.
    pub value: f64,
    /// Change per mm.
    pub slope: f64,
}

/// Wire feed, voltage and current over the contact tube distance. mm, mm/s, V, A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lines {
    /// The wire feed that was set.
    pub programmed: f64,
    /// Distance at which the lines have their values.
    pub reference: f64,
    /// Wire feed.
    pub feed: Line,
    /// Voltage.
    pub voltage: Line,
    /// Current.
    pub current: Line,
    /// Mean of the products of voltage and current, W, where it was measured.
    pub power: Option<Line>,
    /// Least and greatest distance that was measured.
    pub measured: [f64; 2],
}

impl MeasuredLines {
    /// The lines.
    pub fn lines(&self) -> Lines {
        let line = |value: f64, slope: f64| Line { value, slope };
        Lines {
            programmed: self.programmed.0,
            reference: self.reference.0,
            feed: line(self.feed.0, self.feed_slope.0 * M_PER_MIN),
            voltage: line(self.voltage.0, self.voltage_slope.0),
            current: line(self.current.0, self.current_slope.0),
            power: self.power.as_ref().map(|power| {
                let slope = self.power_slope.as_ref().map_or(0.0, |slope| slope.0);
                line(power.0, slope)
            }),
            measured: [self.least.0, self.greatest.0],
        }
    }

    /// Distances out of order.
    pub(crate) fn check(&self) -> Option<Problem> {
        if self.power_slope.is_some() && self.power.is_none() {
            return Some(
                self.power_slope
                    .problem("a change of the power says nothing without the power"),
            );
        }
        let message = "the greatest distance measured must be above the least";
        (self.greatest.0 <= self.least.0).then(|| self.greatest.problem(message))
    }
}

/// Settings within this share of the measured ones are the same.
const SAME: f64 = 0.02;

impl Lines {
    /// A line at a distance, mm.
    pub fn at(&self, line: Line, distance: f64) -> f64 {
        line.value + line.slope * (distance - self.reference)
    }

    /// Electric energy per volume of wire at a distance, J/mm³: the mean power over the feed that was measured; the product of mean
    /// voltage and mean current where the power was not. Rouchon 2022, equation 2.16.
    ///
    /// ```
    /// use meltpath_deposition::process_map::ProcessMap;
    /// let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
    /// let lines = map.electric.as_ref().unwrap().lines();
    /// assert!((lines.energy(15.0, map.wire_section) - 23.9).abs() < 0.1);
    /// ```
    pub fn energy(&self, distance: f64, wire_section: f64) -> f64 {
        let [feed, voltage, current] =
            [self.feed, self.voltage, self.current].map(|line| self.at(line, distance));
        let power = self.power.map(|line| self.at(line, distance));
        energy::per_volume(power.unwrap_or(voltage * current), wire_section, feed)
    }

    /// The distance, mm, that a voltage tells; `None` where the voltage does not change with it. After the ignition only.
    pub fn distance(&self, voltage: f64) -> Option<f64> {
        let off = (voltage - self.voltage.value) / self.voltage.slope;
        off.is_finite().then_some(self.reference + off)
    }

    /// Whether a distance lies within what was measured, to the scatter of such a measurement.
    pub fn covers(&self, distance: f64) -> bool {
        let [least, greatest] = self.measured;
        distance >= least - SCATTER && distance <= greatest + SCATTER
    }

    /// Whether a wire feed that is set, mm/s, is the one they were measured at.
    pub fn of_feed(&self, programmed: f64) -> bool {
        (programmed / self.programmed - 1.0).abs() <= SAME
    }
}

#[cfg(test)]
mod tests {
    use crate::process_map::ProcessMap;

    #[test]
    fn waam_ac43_voltage_falls_and_current_rises_as_the_tube_comes_nearer() {
        let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
        let lines = map.electric.unwrap().lines();
        let change = |line| 100.0 * (lines.at(line, 5.47) / lines.at(line, 15.0) - 1.0);
        // the source prints - 20, - 8.8 and + 7.9 %
        assert!((change(lines.feed) + 19.5).abs() < 0.1);
        assert!((change(lines.voltage) + 8.89).abs() < 0.01);
        assert!((change(lines.current) - 7.89).abs() < 0.01);
        assert!((lines.energy(5.47, map.wire_section) - 29.2).abs() < 0.1);
        // the mean power, where it was measured, is not the product of both means
        let pulsed = super::Lines {
            power: Some(super::Line {
                value: 4000.0,
                slope: 10.0,
            }),
            ..lines
        };
        let per_volume = 3900.0 / (pulsed.at(pulsed.feed, 5.0) * map.wire_section);
        assert!((pulsed.energy(5.0, map.wire_section) / per_volume - 1.0).abs() < 1e-12);
        assert!(lines.covers(5.0) && !lines.covers(4.9) && lines.of_feed(8000.0 / 60.0));
        assert!(!lines.of_feed(8.5 * 1000.0 / 60.0));
    }
}
