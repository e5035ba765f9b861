//! What jobs call on a Yaskawa controller: the `[program.inform]` table of a cell file.

use meltpath_base::settings::Many;
use meltpath_base::{Length, choice, table};

use crate::program::{Dialect, SpeedUnit};
use crate::template::ArcLines;

choice! {
    /// Units of `V=`, which the controller's parameters set.
    pub enum InformSpeed {
        MillimetrePerSecond "mm/s" => "Millimetres per second.",
        CentimetrePerMinute "cm/min" => "Centimetres per minute.",
    }
}

table! {
    /// Group, zones and unit of the controller, and what switches the arc.
    pub struct InformWords {
        /// Who says so: the parameters of the controller.
        source: String => required;
        /// The robot's control group.
        group: String => default("RB1", "the first robot");
        /// The group of the base axis that carries it (`program.track`).
        base_group: String => default("BS1", "the first base");
        /// The group of the station that turns the part (`program.positioner`).
        station_group: String => default("ST1", "the first station");
        /// Pulses a degree of the arm's axes S, L, U, R, B, T, below zero where they count the other way than the robot's file: by these positions in pulses are read, of jobs of others.
        pulses_per_degree: [f64; 6] => none("such positions are told, not simulated");
        /// How far before a corner the path is left with `PL=1`, `PL=2`…: parameters of the controller.
        zones: Many<Length, 1, 8> where positive => required;
        /// Unit of `V=`.
        speed_unit: InformSpeed => default("mm/s", "as controllers are delivered");
        /// Lines that start the arc; `{1}`, `{2}`… stand for the values of the schedule.
        arc_start: Vec<String> => default(["ARCON ASF#({1})"], "a condition file");
        /// Lines that set the arc anew while it burns.
        arc_set: Vec<String> => default(["ARCSET ASF#({1})"], "a condition file");
        /// Lines that end the arc.
        arc_end: Vec<String> => default(["ARCOF"], "as the conditions say");
    }
}

impl InformWords {
    pub(crate) fn arc(&self) -> ArcLines<'_> {
        ArcLines {
            dialect: Dialect::Inform,
            start: &self.arc_start,
            set: &self.arc_set,
            end: &self.arc_end,
        }
    }

    /// The unit of speeds along a path.
    pub(crate) fn unit(&self) -> SpeedUnit {
        match *self.speed_unit {
            InformSpeed::MillimetrePerSecond => SpeedUnit::MillimetrePerSecond,
            InformSpeed::CentimetrePerMinute => SpeedUnit::CentimetrePerMinute,
        }
    }

    /// The `PL` of a distance, mm.
    pub(super) fn level(&self, distance: f64) -> Option<usize> {
        let same = |z: &Length| (z.0 - distance).abs() < 5e-4;
        self.zones.iter().position(same).map(|i| i + 1)
    }

    /// The distance of a `PL` above 0, mm.
    pub(super) fn distance(&self, level: usize) -> Option<f64> {
        Some(self.zones.get(level.checked_sub(1)?)?.0)
    }
}

/// The zone nearest to a distance, mm.
pub(crate) fn zone_near(words: Option<&InformWords>, distance: f64) -> f64 {
    let zones = words.into_iter().flat_map(|w| w.zones.iter().map(|z| z.0));
    let off = |z: &f64| (z - distance).abs();
    zones
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .unwrap_or(distance)
}
