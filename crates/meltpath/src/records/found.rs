//! What records of a deposit showed.

use std::path::PathBuf;

use meltpath_base::Verdict;
use meltpath_deposition::energy;
use meltpath_perception::arc::steady::{Mean, Piece, Steady};

use super::file::{Records, Setting};
use super::line::Fitted;

/// m/min of a mm/s.
pub(super) const PER_MINUTE: f64 = 0.06;

/// A record with what it showed.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// What the bead was laid with.
    pub setting: Setting,
    /// What it holds where its arc burns steadily.
    pub steady: Steady,
    /// The record in pieces.
    pub pieces: Vec<Piece>,
    /// The section of the wire, mm².
    pub wire_section: f64,
    /// Distance that the voltage tells, mm, and its standard uncertainty; by a line that does not know this record, where there is one.
    pub told: Option<Told>,
    /// What the circuit of source, stick-out and arc tells.
    pub circuit: Option<ByCircuit>,
}

/// A distance that a voltage tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// mm.
    pub distance: f64,
    /// One standard deviation, mm.
    pub sigma: f64,
}

/// What the circuit tells of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct ByCircuit {
    /// Current at rest of the mean feed, voltage and the distance, A.
    pub current: f64,
    /// Stick-out, mm.
    pub stick_out: f64,
    /// Distance of the mean feed, voltage and current, mm.
    pub distance: Option<f64>,
    /// Whether feed and distance lie where its constants were fitted.
    pub covered: bool,
    /// Current over time, s and A, of the feed and the voltage of each piece.
    pub course: Vec<[f64; 2]>,
}

impl Recorded {
    /// Wire feed, mm/s: as it was measured, else as it was set.
    pub fn feed(&self) -> f64 {
        self.steady.feed.map_or(self.setting.wire_feed, |f| f.value)
    }

    /// Wire fed over wire set, and its scatter, where it was measured.
    pub fn factor(&self) -> Option<Mean> {
        let set = self.setting.wire_feed;
        self.steady.feed.map(|feed| Mean {
            value: feed.value / set,
            scatter: feed.scatter / set,
        })
    }

    /// Wire feed over travel speed.
    pub fn ratio(&self) -> f64 {
        self.feed() / self.setting.travel_speed
    }

    /// Electric energy per volume of wire, J/mm³, of the mean of the products, and its scatter along the bead.
    pub fn energy(&self) -> Mean {
        let value = energy::per_volume(self.steady.power.value, self.wire_section, self.feed());
        let share = |m: Mean| m.scatter / m.value;
        let feed = self.steady.feed.map_or(0.0, share);
        Mean {
            value,
            scatter: value * share(self.steady.power).hypot(feed),
        }
    }

    /// The same of the product of the means.
    pub fn energy_of_means(&self) -> f64 {
        let power = self.steady.voltage.value * self.steady.current.value;
        energy::per_volume(power, self.wire_section, self.feed())
    }

    /// The same by the feed that was set: too much where the source feeds more.
    pub fn energy_by_set_feed(&self) -> f64 {
        energy::per_volume(
            self.steady.power.value,
            self.wire_section,
            self.setting.wire_feed,
        )
    }

    /// Electric energy per length of bead, J/mm.
    pub fn energy_per_length(&self) -> f64 {
        self.steady.power.value / self.setting.travel_speed
    }
}

/// How feed, voltage, current and power follow the contact tube distance at one feed that was set.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// The wire feed that was set, mm/s.
    pub programmed: f64,
    /// Distance at which the lines have their values, mm.
    pub reference: f64,
    /// Least and greatest distance, mm.
    pub measured: [f64; 2],
    /// Wire feed, mm/s.
    pub feed: Fitted,
    /// Voltage, V.
    pub voltage: Fitted,
    /// Current, A.
    pub current: Fitted,
    /// Mean of the products of both, W.
    pub power: Fitted,
    /// Which records it is of.
    pub of: Vec<usize>,
}

/// A file that is written, or why not.
pub type Written = Result<String, String>;

/// What records showed.
#[derive(Debug)]
pub struct Found {
    /// The file, resolved.
    pub records: Records,
    /// The records.
    pub beads: Vec<Recorded>,
    /// How the source answers to the distance, where several distances show it.
    pub response: Option<Response>,
    /// The table of energies.
    pub energy: Written,
    /// The tables for a process map.
    pub source: Written,
    /// The process map with them.
    pub map: Written,
    /// As checks.
    pub verdict: Verdict,
    /// The folder of the report.
    pub folder: PathBuf,
}
